"""Vertices of the source that are apart although all their values are equal, or become so.

A table says which corners of decoded triangles belong to which of them (specification, "Equal
vertices"): modellers split meshes along such vertices, and the grid makes others equal.
"""

from __future__ import annotations

import numpy as np

from gltf_ext._joinable import Joinable
from gltf_ext.attributes.records import RecordFormat, Triangles, weld_rows
from gltf_ext.ranges import begins, first_of_each, has_repeats, occurring

MAX_LENGTH = 31  # zeros before the first 1 of a number
COUNT_BYTES = 4


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
    field_begin = begins(sizes + 1)  # gap, copies, and the corners but the first
    values = np.empty(field_begin[-1], np.uint64)
    widths = np.empty(field_begin[-1], np.int64)
    is_rank = np.ones(len(values), bool)
    for column, of_places in enumerate((np.diff(split, prepend=-1) - 1, copies - 2)):
        fields = field_begin[:-1] + column
        values[fields], widths[fields] = _number_codes(of_places)
        is_rank[fields] = False
    is_first = np.zeros(len(corners), bool)
    is_first[begin[:-1]] = True
    values[is_rank] = (numbers - np.repeat(first, sizes))[~is_first]
    widths[is_rank] = np.repeat(_lengths(copies - 1), sizes - 1)
    data = len(split).to_bytes(COUNT_BYTES, "little") + _packed(values, widths)
    return data + bytes(-len(data) % 4)


def _lengths(numbers: np.ndarray) -> np.ndarray:
    """Return int64: the number of bits of each, below 2^32."""
    return np.frexp(numbers.astype(np.float64))[1].astype(np.int64)


def _number_codes(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (exp-Golomb codes: uint64, their widths)."""
    following = (numbers + 1).astype(np.uint64)
    zeros = _lengths(following) - 1
    shift = zeros.astype(np.uint64)
    one = np.uint64(1) << shift
    return one | (following ^ one) << (shift + np.uint64(1)), 2 * zeros + 1


def _packed(values: np.ndarray, widths: np.ndarray) -> bytes:
    """Return the bits of fields, one after the other, from the lowest bit on."""
    shifts = np.arange(widths.sum()) - np.repeat(begins(widths)[:-1], widths)
    bits = np.repeat(values, widths) >> shifts.astype(np.uint64) & np.uint64(1)
    return np.packbits(bits.astype(np.uint8), bitorder="little").tobytes()


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
    split, copies, ranks = _Bits(table).places(np.bincount(places, minlength=count))
    is_split = np.zeros(count, bool)
    is_split[split] = True
    corners, begin = _corners_at(places, is_split)
    rank = np.concatenate([np.empty(0, np.int64), *ranks])
    extra = begins(copies - 1)
    numbers = count + np.repeat(extra[:-1], np.diff(begin)) + rank - 1
    of_place = np.repeat(split, copies - 1)
    return corners[rank > 0], numbers[rank > 0].astype(np.uint32), of_place


def _corners_at(places: np.ndarray, is_split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (the corners at split places, place after place, in order; begins of the places)."""
    corners = np.flatnonzero(is_split[places])
    corners = corners[np.argsort(places[corners], kind="stable")]
    counts = np.bincount(places[corners], minlength=len(is_split))[is_split]
    return corners, begins(counts)


class _Bits:
    """Reads a table bit by bit."""

    def __init__(self, table: memoryview | bytes) -> None:
        self._count = int.from_bytes(table[:COUNT_BYTES], "little")
        rest = np.frombuffer(table, np.uint8)[COUNT_BYTES:]
        self._bits = np.unpackbits(rest, bitorder="little")
        self._ones = self._bits.tobytes()
        self._at = 0

    def places(self, corner_counts: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Return (places, number of vertices at each, those of its corners).

        corner_counts: of all places. Raises ValueError.
        """
        split, copies, ranks = [], [], []
        last = -1
        if self._count > len(corner_counts):
            raise ValueError("its table of equal vertices has more places than vertices")
        for _ in range(self._count):
            last += 1 + self._number()
            vertices = 2 + self._number()
            if last >= len(corner_counts) or vertices > corner_counts[last]:
                raise ValueError("its table of equal vertices names vertices that are not there")
            split.append(last)
            copies.append(vertices)
            ranks.append(self._ranks(int(corner_counts[last]), vertices))
        return np.array(split, np.intp), np.array(copies, np.int64), ranks

    def _number(self) -> int:
        first = self._ones.find(1, self._at, self._at + MAX_LENGTH + 1)
        if first < 0:
            raise ValueError("its table of equal vertices is cut off")
        length = first - self._at
        self._at = first + 1
        return int(self._fields(1, length)[0]) + (1 << length) - 1

    def _ranks(self, corners: int, vertices: int) -> np.ndarray:
        """Return int64[corners]: which of so many vertices each corner of a place has."""
        ranks = np.append(0, self._fields(corners - 1, (vertices - 1).bit_length()))
        if ranks.max() >= vertices:
            raise ValueError("its table of equal vertices names vertices that are not there")
        return ranks

    def _fields(self, count: int, width: int) -> np.ndarray:
        end = self._at + count * width
        if end > len(self._bits):
            raise ValueError("its table of equal vertices is cut off")
        fields = self._bits[self._at : end].reshape(count, width).astype(np.int64)
        self._at = end
        result: np.ndarray = (fields << np.arange(width)).sum(axis=1)
        return result


def integer_rows(integers: list[np.ndarray]) -> np.ndarray:
    """Return uint32[V, all elements] of the streams' integers."""
    return np.ascontiguousarray(np.concatenate(integers, axis=1), np.uint32)
