"""Vertices as records: their integers in all streams, packed, and a hash of the float position.

Equal vertices have equal records, in whatever chunk they are. The hash keeps vertices apart that
only the grid joins, so that level 0 has the connectivity of the original. Not those that differ by
the rounding of floats: transforms leave such cracks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.streams import (
    Bits,
    Grid,
    Plan,
    dequantise,
    keeps_sums,
    plan_streams,
    streams_of,
    to_accessor,
)
from gltf_ext.document.accessors import Format
from gltf_ext.ranges import first_of_each, has_repeats, occurring, renumbered
from gltf_ext.sources.primitives import DropCounts, place
from gltf_ext.sources.source import Source, blocks

HASH = "hash"
FLOAT_BITS = 24  # of a float's fraction
# Triangles, position ids, positions, streams and their values, as _codec.encode takes them.
EncoderInput = tuple[np.ndarray, np.ndarray, np.ndarray, list[_codec.Stream], list[np.ndarray]]


@dataclass
class Triangles:
    """Some triangles of a primitive, before equal vertices are joined.

    Attributes:
        records: of vertices, all of them at corners.
        corners: [T, 3]: their numbers at the corners; None for 0, 1, 2 ...
        source, rows: what all triangles are from, if that is in memory, and where its vertices are;
            no rows for all.
    """

    records: np.ndarray
    corners: np.ndarray | None = None
    source: Source | None = None
    rows: np.ndarray | None = None

    @property
    def count(self) -> int:
        """The number of triangles."""
        return len(self.records) // 3 if self.corners is None else len(self.corners)

    def count_dropped(self, distinct_count: int, remaining_count: int) -> DropCounts:
        """Count the vertices that are left out, which only a whole source has.

        Args:
            distinct_count: number of vertices, equal ones once.
            remaining_count: the same without those of degenerate triangles only.
        """
        if self.source is None:
            return DropCounts()
        duplicates = len(self.records) - distinct_count
        unreferenced = self.source.vertex_count - duplicates - remaining_count
        return DropCounts(unreferenced_vertices=unreferenced, duplicate_vertices=duplicates)

    def clear(self) -> None:
        """Give the memory of the records back."""
        self.records = np.empty(0, self.records.dtype)

    def corners_between(self, first: int, last: int) -> np.ndarray:
        """[last - first, 3]: corners of some of the triangles."""
        if self.corners is None:
            return np.arange(3 * first, 3 * last).reshape(-1, 3)
        return self.corners[first:last]


@dataclass
class Vertices:
    """Different vertices in memory, all of them used.

    Attributes:
        triangles: uint32[T, 3], no vertex twice in one.
        records: of each vertex; position_ids: uint32[V], equal for equal float positions.
        drop_counts: what is left out.
        source, rows: where vertices are from, [V], if that is in memory; no rows for all.
    """

    triangles: np.ndarray
    records: np.ndarray
    position_ids: np.ndarray
    drop_counts: DropCounts
    source: Source | None
    rows: np.ndarray | None


@dataclass
class RecordFormat:
    """How records are made, and read back.

    Attributes:
        plan: the primitive's streams.
        mesh, primitive: its place in the document; formats: type of each attribute.
    """

    plan: Plan
    mesh: int
    primitive: int
    formats: dict[str, Format]

    @classmethod
    def of(cls, source: Source, grid: Grid | None, bits: Bits) -> RecordFormat:
        """With the streams that the source's bounds ask for. Raises MeshletError."""
        plan = plan_streams(source.bounds, grid, bits, source.where)
        return cls(plan, source.mesh, source.primitive, source.formats)

    @classmethod
    def with_streams(
        cls, source: Source, streams: list[_codec.Stream], first: dict[str, int]
    ) -> RecordFormat:
        """With streams that are there. first: of each attribute."""
        numbers = {
            name: streams_of(first[name], format_[1], streams)
            for name, format_ in source.formats.items()
        }
        plan = Plan(streams, numbers, keeps_sums(source.bounds))
        return cls(plan, source.mesh, source.primitive, source.formats)

    @property
    def where(self) -> str:
        """The primitive's place, for errors."""
        return place(self.mesh, self.primitive)

    @cached_property
    def coarse(self) -> np.dtype:
        """Records without hash, of levels whose vertices only the grid tells apart."""
        fields = []
        for number, stream in enumerate(self.plan.streams):
            size = 1 if stream.bits <= 8 else 2 if stream.bits <= 16 else 4
            fields.append((str(number), f"<u{size}", (stream.elements,)))
        return np.dtype(fields)

    @cached_property
    def fine(self) -> np.dtype:
        """Records with hash."""
        return np.dtype([*self.coarse.descr, (HASH, "<u4")])

    def part(self, names: tuple[str, ...]) -> np.dtype:
        """Return the fields of `fine` that hold these attributes."""
        fields = [str(s) for name in names for s in self.plan.attributes[name]]
        fields += [HASH] * ("POSITION" in names)
        return np.dtype([row for row in self.fine.descr if row[0] in fields])

    def quantise(self, attributes: dict[str, np.ndarray]) -> np.ndarray:
        """part(names)[n]: records of vertices, by name [n, components]."""
        count = len(next(iter(attributes.values())))
        records = np.empty(count, self.part(tuple(attributes)))
        self.quantise_into(records, attributes)
        return records

    def quantise_into(self, records: np.ndarray, attributes: dict[str, np.ndarray]) -> None:
        """Set the records of vertices, by name [n, components]."""
        for number, values in self.plan.quantise(attributes).items():
            records[str(number)] = values
        if "POSITION" in attributes:
            records[HASH] = _hashes(attributes["POSITION"])

    def without_hash(self, records: np.ndarray) -> np.ndarray:
        """Return coarse[...] of fine[...], or the same records if they are coarse."""
        result = np.empty(records.shape, self.coarse)
        for name in self.coarse.names or ():
            result[name] = records[name]
        return result

    def triangles_of(self, source: Source) -> Triangles:
        """Return all triangles of a source in memory whose attributes have the same numbers.

        Takes only the vertices that they use: many primitives may share the attributes.
        """
        ((names, numbers),) = source.numberings
        count = source.vertex_count
        corners = source.corners(names, numbers, 0, source.triangle_count)
        rows = occurring(corners, count)
        records = np.empty(len(rows), self.fine)
        if len(rows) == count:
            for first, last in blocks(count):
                self.quantise_into(records[first:last], source.vertices(names, first, last))
            return Triangles(records, corners, source)
        for first, last in blocks(len(rows)):
            vertices = source.chosen_vertices(names, rows[first:last])
            self.quantise_into(records[first:last], vertices)
        return Triangles(records, renumbered(corners, rows, count), source, rows)

    def vertices_of(self, triangles: Triangles) -> Vertices:
        """Join equal vertices; leaves out triangles with two equal ones, and unused vertices."""
        corners, numbers, count = join_equal(triangles)
        is_degenerate = has_repeats(corners)
        numbers_left = np.arange(count)
        if is_degenerate.any():
            corners = corners[~is_degenerate]
            numbers_left = occurring(corners, count)
        counts = triangles.count_dropped(count, len(numbers_left))
        counts.degenerate_triangles = int(np.count_nonzero(is_degenerate))
        records, rows = triangles.records, triangles.rows
        if len(numbers_left) < len(records):
            first_records = first_of_each(numbers, count)[numbers_left]
            corners, records = renumbered(corners, numbers_left, count), records[first_records]
            rows = first_records if rows is None else rows[first_records]
        ids = self._position_ids(records)
        return Vertices(corners, records, ids, counts, triangles.source, rows)

    def _position_ids(self, records: np.ndarray) -> np.ndarray:
        fields = [name for name in ("0", HASH) if name in (records.dtype.names or ())]
        if fields == list(records.dtype.names or ()):
            return np.arange(len(records), dtype=np.uint32)  # different records are all there is
        positions = np.empty(len(records), [(name, records.dtype[name]) for name in fields])
        for name in fields:
            positions[name] = records[name]
        return weld_rows(positions)[0]

    def values_of(self, records: np.ndarray) -> list[np.ndarray]:
        """Return uint32[n, elements] of each stream."""
        return [records[str(s)].astype(np.uint32) for s in range(len(self.plan.streams))]

    def encoder_input_of(self, vertices: Vertices) -> EncoderInput:
        """Return the first arguments of _codec.encode."""
        values = self.values_of(vertices.records)
        positions = self.attributes_of(vertices, values, ("POSITION",))["POSITION"]
        positions = np.ascontiguousarray(positions, np.float32)
        ids = vertices.position_ids
        id_count = int(ids.max(initial=0)) + 1
        if id_count < len(ids):  # of equal ones, one position: they may differ by noise
            positions = positions[first_of_each(ids, id_count)[ids]]
        return vertices.triangles, ids, positions, self.plan.streams, values

    def attributes_of(
        self, vertices: Vertices, values: list[np.ndarray], names: tuple[str, ...]
    ) -> dict[str, np.ndarray]:
        """Return name -> [V, components]: as in the source, or what is left of it.

        values: of the vertices, of each stream.
        """
        if vertices.source is None:
            return self.dequantise(values, names)
        attributes = vertices.source.attributes
        all_values = {name: attributes[name].rows(0, attributes[name].count) for name in names}
        if vertices.rows is None:
            return all_values
        return {name: rows[vertices.rows] for name, rows in all_values.items()}

    def dequantise(
        self, values: dict[int, np.ndarray] | list[np.ndarray], names: tuple[str, ...]
    ) -> dict[str, np.ndarray]:
        """Return name -> [n, components]: what attributes decode to. values: of each stream."""
        return {
            name: to_accessor(
                [dequantise(values[s], self.plan.streams[s]) for s in self.plan.attributes[name]],
                self.formats[name][0],
            )
            for name in names
        }


def join_equal(triangles: Triangles) -> tuple[np.ndarray, np.ndarray, int]:
    """Join equal vertices.

    Returns (uint32[T, 3]: their numbers at corners; the numbers of all records; how many differ).
    """
    numbers, count = weld_rows(triangles.records)
    corners = numbers if triangles.corners is None else triangles.corners
    if triangles.corners is not None and count < len(numbers):
        corners = numbers[corners]
    return np.ascontiguousarray(corners.reshape(-1, 3), np.uint32), numbers, count


def weld_rows(rows: np.ndarray) -> tuple[np.ndarray, int]:
    """Return (uint32 numbers of equal rows, in order of first occurrence, how many there are)."""
    rows = np.ascontiguousarray(rows)
    size = rows[:1].nbytes if len(rows) else 0
    return _codec.weld(rows.view(np.uint8).reshape(len(rows), size))


def _hashes(positions: np.ndarray) -> np.ndarray:
    """Return uint32[n]: of positions; equal for negative and positive zero.

    All coordinates of a position are rounded as the largest of them is.
    """
    floats = positions.astype(np.float32)
    shift = np.frexp(np.abs(floats).max(axis=1, initial=0.0))[1] - FLOAT_BITS
    rounded = np.ldexp(np.rint(np.ldexp(floats, -shift[:, None])), shift[:, None])
    words = np.ascontiguousarray(rounded + np.float32(0)).view(np.uint32)
    result = np.zeros(len(words), np.uint32)
    for column in words.T:
        result = (result + column) * np.uint32(0x9E3779B1)
        result ^= result >> np.uint32(15)
    return result
