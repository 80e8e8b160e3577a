"""Files in blocks: of text in whole lines, of binary in whole rows."""

from __future__ import annotations

import codecs
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance

CUT_OFF = "is cut off"
# Of the blocks in which a file is read. An .obj of 38 MB takes 15 % more time in blocks of 256 kB
# than of 1 MB, and 25 to 40 % more in 128 kB; one of 2 MB takes twice its size of memory in blocks
# of 256 kB, and four times in 1 MB.
LEAST_BYTES, MOST_BYTES = 1 << 18, 1 << 20
LINE_BYTES = 1 << 12  # that are searched for a line's end at a time
LONGEST_LINE = 64 << 20  # bytes of a line, with those that continue it: a line is read as a whole


class _WatchedFile(io.FileIO):
    """A file that moves the progress bar as it is read."""

    def __init__(self, path: Path, advance: Advance) -> None:
        super().__init__(path, "rb")
        self._advance, self._size = advance, max(os.fstat(self.fileno()).st_size, 1)

    def readinto(self, buffer: Any) -> int | None:
        count = super().readinto(buffer)
        self._advance(min(self.tell() / self._size, 1.0))
        return count


def open_watched(path: Path, advance: Advance | None) -> BinaryIO:
    """Open a file to read it. advance: moves the progress bar, None for none. Raises OSError."""
    return io.BufferedReader(_WatchedFile(path, advance)) if advance else open(path, "rb")


def block_bytes(file: BinaryIO) -> int:
    """Return the size of blocks in which a file is read: an eighth of it, between the limits."""
    eighth = os.fstat(file.fileno()).st_size // 8
    return min(max(eighth, LEAST_BYTES), MOST_BYTES)


def read_rows(file: BinaryIO, row: np.dtype, most: int) -> np.ndarray:
    """Read the next block of a binary file: at most so many rows, and those that it has.

    The file is then behind these, also where less than a row is left.
    """
    size = row.itemsize
    data = file.read(min(most, block_bytes(file) // size or 1) * size)
    if len(data) % size:
        file.seek(-(len(data) % size), os.SEEK_CUR)
    return np.frombuffer(data, row, len(data) // size)


def text_blocks(file: BinaryIO) -> Iterator[bytes]:
    """Yield the rest of a file in blocks of whole lines. Raises MeshletError if it is not text.

    A line that a backslash continues stays in one block. A file's byte order mark is left out, and
    a CR alone, which ended lines of old Macs, becomes a line feed.
    """
    size = block_bytes(file)
    if file.tell() == 0:
        seek_after_mark(file)
    while start := file.read(size):
        pieces, end, length = [start], start[-3:], 0
        while line := next_line(file):
            pieces.append(line)
            length += len(line)
            _check_length(length)
            end = (end + line)[-3:]
            if not end.rstrip(b"\r\n").endswith(b"\\"):
                break
        text = b"".join(pieces)
        if b"\0" in text:
            raise MeshletError("is not text", EXPORT_AGAIN)
        yield _with_line_feeds(text)


def skip_mark(text: bytes) -> bytes:
    """Return a text without the byte order mark at its start."""
    return text.removeprefix(codecs.BOM_UTF8)


def seek_after_mark(file: BinaryIO) -> None:
    """Move from the start of a file to behind its byte order mark."""
    if file.read(len(codecs.BOM_UTF8)) != codecs.BOM_UTF8:
        file.seek(0)


def next_line(file: BinaryIO) -> bytes:
    """Read a line with its end: a line feed, or a CR; a line feed may follow that is not read.

    Raises MeshletError for one that is too long.
    """
    pieces, length = [], 0
    while piece := file.readline(LINE_BYTES):
        end = piece.find(b"\r") + 1
        if end and piece[end : end + 1] != b"\n":
            file.seek(end - len(piece), os.SEEK_CUR)
            piece = piece[:end]
        pieces.append(piece)
        length += len(piece)
        _check_length(length)
        if piece.endswith((b"\n", b"\r")):
            break
    return b"".join(pieces)


def _check_length(length: int) -> None:
    if length > LONGEST_LINE:
        raise MeshletError(f"has a line of more than {LONGEST_LINE:,} bytes", EXPORT_AGAIN)


def _with_line_feeds(text: bytes) -> bytes:
    """Replace each CR that no line feed follows; scan_lines takes the others for blanks."""
    if b"\r" not in text or text.count(b"\r") == text.count(b"\r\n"):
        return text
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def words_after(text: bytes, offsets: np.ndarray) -> list[bytes]:
    """Return the words after the keyword of each line, which starts at an offset."""
    ends = (text.find(b"\n", at) for at in offsets.tolist())
    lines = (text[at : end if end >= 0 else None] for at, end in zip(offsets.tolist(), ends))
    return [b" ".join(line.split()[1:]) for line in lines]
