"""The exception that callers of this package have to expect."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

LONGEST = 400  # characters of a problem or a remedy
EXPORT_AGAIN = "export it again"  # a remedy


class MeshletError(ValueError):
    """A file or an option is wrong. str() is one line: the file, what is wrong; what to do.

    Attributes:
        path: the file at fault, when known.
        message: the line without the path.
        options: names of the options at fault.
    """

    def __init__(
        self,
        problem: str,
        remedy: str = "",
        path: str | None = None,
        options: tuple[str, ...] = (),
    ) -> None:
        self.message = "; ".join(_on_one_line(part) for part in (problem, remedy) if part)
        super().__init__(self.message)
        self.path, self.options = path, options

    def __str__(self) -> str:
        return f"{self.path}: {self.message}" if self.path else self.message


class NothingToCompress(MeshletError):
    """A model has no triangles that `compress` can compress."""


def printable(text: str) -> str:
    """Return the text with names out of a file made harmless."""
    if text.isprintable():  # at once: a report has megabytes of pictures
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def _on_one_line(text: str) -> str:
    text = printable(text)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}...{text[-LONGEST // 2 :]}"


@contextmanager
def blaming(path: str | os.PathLike[str]) -> Iterator[None]:
    """Set the path of any MeshletError raised inside that does not name a file yet."""
    try:
        yield
    except MeshletError as error:
        error.path = error.path or str(path)
        raise
