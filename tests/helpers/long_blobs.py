"""Blobs of about half a gigabyte, nearly all of it zeros that take no memory, and packed views."""

from __future__ import annotations

import ctypes
import mmap
import struct

from spec.blob_writer import COPY, GRID, INTEGER

MAX_BYTES = 448 << 20  # of a blob
WRAPPING = (1 << 29) - 4  # bytes: bit positions behind the end of the blob wrap to its beginning
BYTE_LENGTH = 20  # offset of the header's byte length
DATA_OFFSET = 24
PADDING_BYTES = 8
PAGE_BYTES = mmap.PAGESIZE
MAGIC = 0x314D4245

CODES = ("fixed", "rice", "exponential")


class Sparse:
    """`size` bytes that are 0 and end where memory ends: a read behind them ends the process.

    bytes: a memoryview, to be written. address: its, for functions that take only `bytes`.
    """

    def __init__(self, size: int) -> None:
        pages = -(-size // PAGE_BYTES) * PAGE_BYTES
        options = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
        self._map = mmap.mmap(-1, pages + PAGE_BYTES, flags=options)
        begin = ctypes.addressof(ctypes.c_char.from_buffer(self._map))
        protect = ctypes.CDLL(None).mprotect
        assert protect(ctypes.c_void_p(begin + pages), ctypes.c_size_t(PAGE_BYTES), 0) == 0
        self.bytes = memoryview(self._map)[pages - size : pages]
        self.address = begin + pages - size

    def put(self, at: int, data: bytes) -> None:
        self.bytes[at : at + len(data)] = data


def stretched(blob: bytes, size: int) -> Sparse:
    """A blob of one group with unused bytes before the entries, so that it has `size` bytes."""
    out = Sparse(size)
    (tables,) = struct.unpack_from("<I", blob, DATA_OFFSET)
    row = tables - 12
    (base,) = struct.unpack_from("<I", blob, row)
    out.put(0, blob[:tables])
    out.put(BYTE_LENGTH, struct.pack("<I", size))
    out.put(row, struct.pack("<I", base + size - len(blob)))
    out.put(size - len(blob) + tables, blob[tables:])
    return out


class _Bits:
    """Writes bit fields, the lowest bit first."""

    def __init__(self, out: Sparse, at: int) -> None:
        self.out = out
        self.at = at

    def put(self, value: int, width: int) -> None:
        for i in range(width):
            if value >> i & 1:
                self.out.bytes[self.at + i >> 3] |= 1 << (self.at + i & 7)
        self.at += width


def wrapping(code: str) -> Sparse:
    """A triangle whose last residuals lie behind the end of a blob of WRAPPING bytes. code: theirs,
    one of CODES. Their bit positions, modulo 2^32, lie inside the blob."""
    out = Sparse(WRAPPING)
    tables = 32 + 2 * 28 + 12
    start = WRAPPING - (31 if code == "fixed" else 29)  # the low bits begin about 100 before 2^32
    header = struct.pack("<8I", MAGIC, 2 | 2 << 8, 1, 3, 1, WRAPPING, tables, 0)
    streams = [
        struct.pack("<8B5f", GRID, 3, 1, COPY, 0, 0, 0, 0, 1.0, 0, 0, 0, 0),
        struct.pack("<8B5f", INTEGER, 4, 32, COPY, 0, 28, 0, 0, 1.0, 0, 0, 0, 0),
    ]
    out.put(0, header + b"".join(streams) + struct.pack("<3I", start, 0, 0))
    bits = _Bits(out, 8 * start)
    bits.put(0, 6)  # a triangle
    bits.put(7, 3)  # stream 0: fixed widths, of no bits
    bits.put(0, 15)
    if code == "fixed":  # stream 1: 4 widths of 32 bits
        bits.put(7, 3)
        bits.put((1 << 20) - 1, 20)
    else:  # with the base 28, a Rice parameter of 31 or an exp-Golomb one of 29
        bits.put(3 if code == "rice" else 6, 3)
    bits.put(0, 3 + 128)  # anchors
    if code != "fixed":
        bits.put(255, 8)  # the unary parts of 2 vertices of 4 elements
    widths = {"fixed": 32, "rice": 31, "exponential": 29}
    assert bits.at < 8 * (WRAPPING - PADDING_BYTES) and bits.at + 8 * widths[code] >= 1 << 32
    return out


def packed_page(resident: int, packed: int) -> Sparse:
    """A packed view of one page. resident, packed: its bytes, 0 for a raw page."""
    out = Sparse(12 + (packed or resident))
    out.put(0, struct.pack("<3I", 1 | 1 << 8, resident, packed))
    return out
