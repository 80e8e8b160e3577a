"""Vertices of the source that are apart although all their values are equal, or become so.

A table says which corners of decoded triangles belong to which of them (specification, "Equal
vertices"): modellers split meshes along such vertices, and the grid makes others equal.
"""

from __future__ import annotations

import numpy as np

from gltf_ext._joinable import Joinable
from gltf_ext.attributes.records import RecordFormat, Triangles, weld_rows
from gltf_ext.ranges import begins, first_of_each, has_repeats, occurring

MAX_LENGTH = 31  # low bits of a gap, at most
VERTEX_BITS = 32  # of a corner's vertex, at most
COUNT_BYTES = 4
CUT_OFF = "its table of equal vertices is cut off"
NOT_THERE = "its table of equal vertices names vertices that are not there"


# --- writing ---


def table_of(triangles: Triangles, record_format: RecordFormat, joinable: Joinable) -> bytes:
    """Return the table of a primitive; empty if no vertices of the source are equal.

    Args:
        triangles: of the source, all in memory.
        record_format: of their records.
        joinable: what they decode to.
    """
    decoded = integer_rows(joinable.integers)
    rows = np.concatenate(record_format.values_of(triangles.records), axis=1)
    places, count = weld_rows(np.concatenate([decoded, rows]))
    of_decoded, of_source = places[: len(decoded)], places[len(decoded) :]
    corners, vertices = _corners_of(triangles), source_vertices_of(triangles)
    is_split = _are_split(of_source[corners], vertices[corners], count)
    source = _canonical(of_source[corners], is_split)
    target = _canonical(of_decoded[joinable.triangles], is_split)
    if len(source[0]) != len(target[0]):
        return b""
    matched = np.zeros((len(joinable.triangles), 3), np.uint32)
    matched[target[0][:, None], target[1]] = vertices[corners[source[0][:, None], source[1]]]
    return _encode(of_decoded[joinable.triangles].reshape(-1), matched.reshape(-1), is_split)


def source_vertices_of(triangles: Triangles) -> np.ndarray:
    """Return uint32[V]: the number of the source's vertex of each record.

    Each record is one, unless the triangles have no vertex in common: then nobody has said which
    vertices are one, and those are that have equal records.
    """
    if triangles.corners is None or is_soup(triangles.corners, len(triangles.records)):
        return weld_rows(triangles.records)[0]
    return np.arange(len(triangles.records), dtype=np.uint32)


def is_soup(corners: np.ndarray, vertex_count: int) -> bool:
    """Return whether no two corners of triangles, [T, 3], have a vertex in common."""
    return len(occurring(corners, vertex_count)) == corners.size


def _corners_of(triangles: Triangles) -> np.ndarray:
    """Return [T, 3]: the records at the corners, without the triangles that encoders drop."""
    corners = triangles.corners_between(0, triangles.count)
    is_degenerate = has_repeats(weld_rows(triangles.records)[0][corners])
    return corners[~is_degenerate] if is_degenerate.any() else corners


def _are_split(places: np.ndarray, vertices: np.ndarray, count: int) -> np.ndarray:
    """Return bool[count]: whether places have several vertices. Both arguments: of corners."""
    first = np.zeros(count, np.uint32)
    first[places.reshape(-1)] = vertices.reshape(-1)
    result = np.zeros(count, bool)
    result[places[first[places] != vertices]] = True
    return result


def _canonical(places: np.ndarray, is_split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort the triangles that touch split places by their places, whatever their first corner.

    Returns (numbers of the triangles, [n, 3]: their corners from the first place on).
    """
    numbers = np.flatnonzero(is_split[places].any(axis=1))
    places = places[numbers]
    turns = [places[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)]
    turn = np.zeros(len(places), np.intp)
    best = turns[0]
    for k in (1, 2):
        is_less = _are_less(turns[k], best)
        turn[is_less] = k
        best = np.where(is_less[:, None], turns[k], best)
    order = np.lexsort(best.T[::-1])
    return numbers[order], (turn[order, None] + np.arange(3)) % 3


def _are_less(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return bool[n]: whether rows, [n, 3], come before others."""
    result: np.ndarray = (a[:, 0] < b[:, 0]) | (
        (a[:, 0] == b[:, 0]) & ((a[:, 1] < b[:, 1]) | ((a[:, 1] == b[:, 1]) & (a[:, 2] < b[:, 2])))
    )
    return result


def _encode(places: np.ndarray, vertices: np.ndarray, is_split: np.ndarray) -> bytes:
    """Return the table. places, vertices: of all corners in order."""
    split = np.flatnonzero(is_split)
    if not len(split):
        return b""
    corners, begin = _corners_at(places, is_split)
    pairs = np.stack([places[corners], vertices[corners]], axis=1)
    numbers, count = weld_rows(pairs)  # of one place after those of the places before
    first = numbers[begin[:-1]]
    copies = np.diff(np.append(first, count))
    sizes = np.diff(begin)
    gaps = np.diff(split, prepend=-1) - 1
    parameter = _best_parameter(gaps)
    ranks = (numbers - np.repeat(first, sizes))[_but_first(begin)]
    bits = [
        _unary(gaps >> parameter),
        _fields_of(gaps, np.full(len(gaps), parameter)),
        _unary(copies - 2),
        _fields_of(ranks, np.repeat(_lengths(copies - 1), sizes - 1)),
    ]
    data = np.packbits(np.concatenate(bits), bitorder="little").tobytes()
    data = len(split).to_bytes(COUNT_BYTES, "little") + bytes([parameter]) + data
    return data + bytes(-len(data) % 4)


def _best_parameter(gaps: np.ndarray) -> int:
    """Return the number of low bits with which gaps take the fewest bits."""
    return min(range(MAX_LENGTH + 1), key=lambda k: int((gaps >> k).sum()) + k * len(gaps))


def _unary(numbers: np.ndarray) -> np.ndarray:
    """Return bits, uint8: as many zeros as each number says, and a one."""
    ends = np.cumsum(numbers + 1)
    bits = np.zeros(ends[-1], np.uint8)
    bits[ends - 1] = 1
    return bits


def _fields_of(values: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Return bits, uint8: of fields, one after the other, from the lowest bit on."""
    shifts = np.arange(widths.sum()) - np.repeat(begins(widths)[:-1], widths)
    bits: np.ndarray = np.repeat(values, widths) >> shifts & 1
    return bits.astype(np.uint8)


def _lengths(numbers: np.ndarray) -> np.ndarray:
    """Return int64: the number of bits of each, below 2^32."""
    return np.frexp(numbers.astype(np.float64))[1].astype(np.int64)


def _but_first(begin: np.ndarray) -> np.ndarray:
    """Return bool: whether a corner is not the first one of its place."""
    result = np.ones(begin[-1], bool)
    result[begin[:-1]] = False
    return result


# --- reading ---


def separate(
    joinable: Joinable, values: list[np.ndarray], table: memoryview | bytes
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return (uint32[T, 3], values of streams): each vertex of the source once.

    Args:
        joinable: a decoded view.
        values: of its vertices, for each stream.
        table: as table_of writes it.

    Raises:
        ValueError: the table is malformed.
    """
    places, count = weld_rows(integer_rows(joinable.integers))
    result = places[joinable.triangles]
    corners, numbers, of_place = _read(table, result.reshape(-1), count)
    first = first_of_each(places, count)
    result.reshape(-1)[corners] = numbers
    return result, [v[np.concatenate([first, first[of_place]])] for v in values]


def _read(
    table: memoryview | bytes, places: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read which corners have vertices beside the first ones of their places.

    places: of all corners; count: of places. Returns (these corners, uint32: their vertices, from
    `count` on, the place of each of those). Raises ValueError.
    """
    bits = _Bits(memoryview(table)[: _most_bytes(len(places), count)])
    quotients = bits.unary()
    # Beyond these bounds, places would not fit 64 bits.
    if bits.count > count or quotients.sum() > count >> bits.parameter:
        raise ValueError(NOT_THERE)
    split = np.cumsum(quotients << bits.parameter | bits.low_bits()) + np.arange(bits.count)
    copies = bits.unary() + 2
    corner_counts = np.bincount(places, minlength=count)
    if bits.count and not (split[-1] < count and (copies <= corner_counts[split]).all()):
        raise ValueError(NOT_THERE)
    is_split = np.zeros(count, bool)
    is_split[split] = True
    corners, begin = _corners_at(places, is_split)
    sizes = np.diff(begin)
    rank = np.zeros(len(corners), np.int64)
    rank[_but_first(begin)] = bits.fields(np.repeat(_lengths(copies - 1), sizes - 1))
    if (rank >= np.repeat(copies, sizes)).any():
        raise ValueError(NOT_THERE)
    numbers = count + np.repeat(begins(copies - 1)[:-1], sizes) + rank - 1
    is_further = rank > 0
    return corners[is_further], numbers[is_further], np.repeat(split, copies - 1)


def _most_bytes(corner_count: int, place_count: int) -> int:
    """Return the size of the largest table that a view can have; what follows is not data."""
    of_gaps = 2 + MAX_LENGTH  # bits of a place: zeros and a one for its quotient, and low bits
    of_corners = 2 + VERTEX_BITS  # of a corner: zeros and a one for copies, and its vertex
    bits = of_gaps * place_count + of_corners * corner_count
    return COUNT_BYTES + 1 + -(-bits // 8)


def _corners_at(places: np.ndarray, is_split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (the corners at split places, place after place, in order; begins of the places)."""
    corners = np.flatnonzero(is_split[places])
    corners = corners[np.argsort(places[corners], kind="stable")]
    counts = np.bincount(places[corners], minlength=len(is_split))[is_split]
    return corners, begins(counts)


class _Bits:
    """Reads a table. Each method raises ValueError if it ends too early.

    Attributes:
        count: number of places; parameter: number of low bits of each gap.
    """

    def __init__(self, table: memoryview | bytes) -> None:
        data = np.frombuffer(table, np.uint8)
        if len(data) <= COUNT_BYTES:
            raise ValueError(CUT_OFF)
        self.count = int.from_bytes(data[:COUNT_BYTES].tobytes(), "little")
        self.parameter = int(data[COUNT_BYTES])
        if self.parameter > MAX_LENGTH:
            raise ValueError("its table of equal vertices has too many low bits")
        self._bits = np.unpackbits(data[COUNT_BYTES + 1 :], bitorder="little")
        self._ones = np.flatnonzero(self._bits)
        self._at = 0

    def unary(self) -> np.ndarray:
        """Return int64[count]: the zeros before each of the next ones."""
        first = int(np.searchsorted(self._ones, self._at))
        ones = self._ones[first : first + self.count]
        if len(ones) < self.count:
            raise ValueError(CUT_OFF)
        zeros: np.ndarray = np.diff(ones, prepend=self._at - 1) - 1
        self._at = int(ones[-1]) + 1 if self.count else self._at
        return zeros

    def low_bits(self) -> np.ndarray:
        """Return int64[count]: of the gaps."""
        return self.fields(np.full(self.count, self.parameter))

    def fields(self, widths: np.ndarray) -> np.ndarray:
        """Return int64: the next fields."""
        begin = begins(widths) + self._at
        self._at = int(begin[-1])
        if self._at > len(self._bits):
            raise ValueError(CUT_OFF)
        values = np.zeros(len(widths), np.int64)
        for bit in range(int(widths.max(initial=0))):
            wide = np.flatnonzero(widths > bit)
            values[wide] |= self._bits[begin[wide] + bit].astype(np.int64) << bit
        return values


def integer_rows(integers: list[np.ndarray]) -> np.ndarray:
    """Return uint32[V, all elements] of the streams' integers."""
    return np.ascontiguousarray(np.concatenate(integers, axis=1), np.uint32)
