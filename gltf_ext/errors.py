"""The one exception that callers of this package have to expect."""

from __future__ import annotations


class MeshletError(ValueError):
    """Something is wrong with a file or an option; str() is one line: what is wrong; what to do.

    path: the file at fault, when known; the command line puts it before the message.
    """

    def __init__(self, what: str, remedy: str = "", path: str | None = None):
        super().__init__("; ".join(part for part in (what, remedy) if part))
        self.path = path
