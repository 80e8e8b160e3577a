"""The one exception that callers of this package have to expect."""

from __future__ import annotations


class MeshletError(ValueError):
    """Something is wrong with a file or an option; str() is one line: the file, what is wrong; what to do.

    path: the file at fault, when known; message: the line without it; options: names of the options at fault.
    """

    def __init__(
        self, what: str, remedy: str = "", path: str | None = None, options: tuple[str, ...] = ()
    ):
        self.message = "; ".join(part for part in (what, remedy) if part)
        super().__init__(self.message)
        self.path, self.options = path, options

    def __str__(self) -> str:
        return f"{self.path}: {self.message}" if self.path else self.message
