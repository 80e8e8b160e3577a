"""Decodes views with each vertex of the source once.

A view holds vertices on the borders of its blobs, and a few others, more than once (specification,
section "Joining vertices"). codec/common/join_vertices.h has the rule.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gltf_ext import _codec
from gltf_ext._joinable import Joinable
from gltf_ext.attributes.extension import Compressed, malformed_from, parts_of
from gltf_ext.ranges import first_of_each, occurring, renumbered
from gltf_ext.sources.primitives import Primitive
from gltf_ext.work_files import Buckets, hashes

Arrays = tuple[np.ndarray, list[np.ndarray]]  # uint32[T, 3], values of streams
VERTEX = np.dtype([("key", "<u8"), ("number", "<u4")])


def decode(compressed: Compressed) -> Primitive:
    """All of a compressed primitive, each vertex of the source once. Raises MeshletError."""
    with malformed_from(compressed.where):
        return compressed.as_primitive(*decode_view(compressed.blob, compressed.source_vertices))


def decode_view(view: _codec.Bytes, source_vertices: int | None) -> Arrays:
    """Decode a view, as _codec.decode_values gives it. Raises ValueError.

    source_vertices: as in the extension's object; None where that has none: no vertex is doubled.
    """
    blobs = _codec.View(view)
    if source_vertices is None or source_vertices >= blobs.vertex_count:
        return blobs.decode(threads=0, as_values=True)
    joinable, values = blobs.decode_joinable(threads=0)
    return without_copies(joinable, values, max(source_vertices, 1))


def without_copies(joinable: Joinable, values: list[np.ndarray], source_vertices: int) -> Arrays:
    """Triangles and values without the vertices that are doubled."""
    if source_vertices >= len(joinable.integers[0]):
        return joinable.triangles, values
    numbers, count = joinable.join(source_vertices)
    if count == len(numbers):
        return joinable.triangles, values
    first = first_of_each(numbers, count)
    return numbers[joinable.triangles], [v[first] for v in values]


class Parts:
    """The same for a primitive that need not fit memory.

    Decodes parts of it up to three times: for the integers' hashes; where the grid has made
    different vertices equal, for the triangles at vertices that may be doubled; and to read them.
    Hashes are in work files. In memory are, for each vertex that may be doubled, 16 bytes; and in
    the second case the triangles around these vertices with their integers.

    Attributes:
        triangle_count, vertex_count: of all parts.
    """

    def __init__(self, compressed: Compressed, folder: str) -> None:
        """folder: for work files. Raises MeshletError, OSError."""
        self._compressed = compressed
        self.triangle_count = compressed.triangle_count
        self._whole: Arrays | None = None
        self._copies = self._of_copies = np.empty(0, np.uint32)
        before, after = compressed.vertex_count, compressed.source_vertices
        if after < before:
            if len(list(parts_of(compressed.blob))) == 1:
                with malformed_from(compressed.where):
                    self._whole = decode_view(compressed.blob, after)
                self.vertex_count = len(self._whole[1][0])
                return
            numbers, originals = _equal_vertices(compressed, folder)
            distinct_count = int(np.count_nonzero(numbers == originals))
            if after > before - len(numbers) + distinct_count:
                originals = _originals(compressed, numbers)
            is_removed = numbers != originals
            self._copies, self._of_copies = numbers[is_removed], originals[is_removed]
        self.vertex_count = before - len(self._copies)

    def __iter__(self) -> Iterator[Primitive]:
        """Decode some triangles at a time, with vertices that no part before has.

        Indices number the vertices of all parts. Raises MeshletError.
        """
        for triangles, values in [self._whole] if self._whole else self._renumbered():
            yield self._compressed.as_primitive(triangles, values)

    def _renumbered(self) -> Iterator[Arrays]:
        first = 0  # number of the part's first vertex, in the view
        for part in parts_of(self._compressed.blob):
            with malformed_from(self._compressed.where):
                triangles, values = _codec.decode_values(part)
            last = first + len(values[0])
            begin, end = np.searchsorted(self._copies, [first, last])
            numbers = np.arange(first - begin, last - begin, dtype=np.uint32)
            if end > begin:
                removed = self._copies[begin:end] - np.uint32(first)
                is_kept = np.ones(len(numbers), bool)
                is_kept[removed] = False
                numbers = np.cumsum(is_kept, dtype=np.uint32) + np.uint32(first - begin - 1)
                originals = self._of_copies[begin:end]
                numbers[removed] = originals - np.searchsorted(self._copies, originals).astype(
                    np.uint32
                )
                values = [v[is_kept] for v in values]
            yield numbers[triangles], values
            first = last


def _equal_vertices(compressed: Compressed, folder: str) -> tuple[np.ndarray, np.ndarray]:
    """Find the vertices whose integers others have too.

    Returns (their numbers, uint32, in ascending order; for each the first one that has its
    integers). Raises MeshletError, OSError.
    """
    buckets = Buckets(VERTEX, VERTEX.itemsize * compressed.vertex_count, folder)
    first = 0
    for part in parts_of(compressed.blob):
        with malformed_from(compressed.where):
            integers = _codec.decode(part)[1]
        rows = np.empty(len(integers[0]), VERTEX)
        rows["key"] = hashes(np.concatenate(integers, axis=1))
        rows["number"] = np.arange(first, first + len(rows))
        buckets.add(rows, rows["key"])
        first += len(rows)
    numbers, originals = [np.empty(0, np.uint32)], [np.empty(0, np.uint32)]
    for rows in buckets.parts():
        rows = rows[np.argsort(rows["key"], kind="stable")]
        is_first = np.append(True, rows["key"][1:] != rows["key"][:-1])[: len(rows)]
        is_alone = is_first & np.append(is_first[1:], True)[: len(rows)]
        first_rows = np.flatnonzero(is_first)[np.cumsum(is_first) - 1]
        numbers.append(rows["number"][~is_alone])
        originals.append(rows["number"][first_rows][~is_alone])
    vertices, of_vertices = np.concatenate(numbers), np.concatenate(originals)
    order = np.argsort(vertices)
    return vertices[order], of_vertices[order]


def _originals(compressed: Compressed, doubled: np.ndarray) -> np.ndarray:
    """uint32: for each of the doubled vertices the first one that was one with it in the source.

    Looks only at triangles around these vertices. Raises MeshletError.
    """
    pieces: list[Joinable] = []
    numbers: list[np.ndarray] = []
    first = count = 0
    for part in parts_of(compressed.blob):
        with malformed_from(compressed.where):
            whole, _ = _codec.decode_joinable(part)
        size = len(whole.integers[0])
        begin, end = np.searchsorted(doubled, [first, first + size])
        is_doubled = np.zeros(size, bool)
        is_doubled[doubled[begin:end] - np.uint32(first)] = True
        piece, used = _triangles_around(whole, is_doubled, count)
        pieces.append(piece)
        numbers.append(used + first)
        first += size
        count += len(used)
    reduced = Joinable(
        np.concatenate([p.triangles for p in pieces]),
        [np.concatenate(column) for column in zip(*(p.integers for p in pieces))],
        np.concatenate([p.first_vertices for p in pieces]),
        np.concatenate([p.shared for p in pieces if p.shared is not None]),
    )
    rest = compressed.vertex_count - count
    joined_numbers, different = reduced.join(max(compressed.source_vertices - rest, 1))
    in_view = np.concatenate(numbers)
    originals = in_view[first_of_each(joined_numbers, different)][joined_numbers]
    result: np.ndarray = originals[np.searchsorted(in_view, doubled)].astype(np.uint32)
    return result


def _triangles_around(
    whole: Joinable, is_doubled: np.ndarray, first: int
) -> tuple[Joinable, np.ndarray]:
    """Return (the triangles around some vertices, numbers of their vertices in ascending order).

    The vertices are numbered from `first` on.
    """
    assert whole.shared is not None
    size = len(is_doubled)
    triangles = whole.triangles[is_doubled[whole.triangles].any(axis=1)]
    used = occurring(triangles.reshape(-1), size)
    shared = whole.shared
    while (shared[shared] != shared).any():
        shared = shared[shared]
    _, of_root, root = np.unique(shared[used], return_index=True, return_inverse=True)
    piece = Joinable(
        renumbered(triangles, used, size) + np.uint32(first),
        [values[used] for values in whole.integers],
        np.searchsorted(used, whole.first_vertices).astype(np.uint64) + np.uint64(first),
        (of_root[root] + first).astype(np.uint32),
    )
    return piece, used
