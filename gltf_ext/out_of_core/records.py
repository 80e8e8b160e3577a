"""Vertices as records: their integers in all streams, packed, and a hash of the float position.

Equal vertices have equal records, in whatever chunk they are. The hash keeps vertices apart that
only the grid joins, so that level 0 has the connectivity of the original.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.compression.primitives import Primitive, place
from gltf_ext.compression.streams import (
    Bits,
    Grid,
    Plan,
    dequantise,
    plan_primitive,
    quantise_like,
    streams_of,
    to_accessor,
)
from gltf_ext.gltf.accessors import Format
from gltf_ext.out_of_core.sources import LargePrimitive
from gltf_ext.ranges import first_of_each

HASH = "hash"


@dataclass
class Vertices:
    """Vertices in memory, by the numbers of their first use.

    Attributes:
        triangles: uint32[T, 3], no vertex twice in one.
        records: of each vertex; position_ids: uint32[V], equal for equal float positions.
        dropped: triangles with a repeated vertex, which are left out.
    """

    triangles: np.ndarray
    records: np.ndarray
    position_ids: np.ndarray
    dropped: int


@dataclass
class RecordFormat:
    """How records are made, and read back.

    Attributes:
        plan: the primitive's streams, with the values of its bounds.
        mesh, primitive: its place in the document; formats: type of each attribute.
    """

    plan: Plan
    mesh: int
    primitive: int
    formats: dict[str, Format]

    @classmethod
    def of(cls, source: LargePrimitive, grid: Grid | None, bits: Bits) -> RecordFormat:
        """Quantising grows with the values: those of the bounds decide the streams."""
        return cls.with_plan(source, plan_primitive(source.bounds, [], grid, bits, source.where))

    @classmethod
    def with_plan(cls, source: LargePrimitive, plan: Plan) -> RecordFormat:
        formats = {name: rows.form for name, rows in source.attributes.items()}
        return cls(plan, source.mesh, source.primitive, formats)

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
        """The fields of `fine` that hold these attributes."""
        fields = [str(s) for name in names for s in self._numbers_of(name)]
        fields += [HASH] * ("POSITION" in names)
        return np.dtype([row for row in self.fine.descr if row[0] in fields])

    def quantised(self, attributes: dict[str, np.ndarray]) -> np.ndarray:
        """part(names)[n]: records of vertices, by name [n, components]."""
        count = len(next(iter(attributes.values())))
        records = np.empty(count, self.part(tuple(attributes)))
        for name, given in attributes.items():
            used = self._numbers_of(name)
            rows = quantise_like(name, given, [self.plan.streams[s] for s in used], attributes)
            for s, values in zip(used, rows):
                records[str(s)] = values
        if "POSITION" in attributes:
            records[HASH] = _hashes(attributes["POSITION"])
        return records

    def _numbers_of(self, name: str) -> range:
        width = self.formats[name][1]
        return streams_of(self.plan.attributes[name], width, self.plan.streams)

    def without_hash(self, records: np.ndarray) -> np.ndarray:
        """coarse[...] of fine[...], or the same records if they are coarse."""
        result = np.empty(records.shape, self.coarse)
        for name in self.coarse.names or ():
            result[name] = records[name]
        return result

    def vertices_of(self, corners: np.ndarray) -> Vertices:
        """Vertices and triangles of corners, records [T, 3]."""
        rows = _bytes_of(corners.reshape(-1))
        numbers, count = _codec.weld(rows)
        triangles = numbers.reshape(-1, 3)
        a, b, c = triangles.T
        is_repeated = (a == b) | (b == c) | (c == a)
        if is_repeated.any():
            kept = self.vertices_of(corners[~is_repeated])
            return replace(kept, dropped=int(is_repeated.sum()))
        records = corners.reshape(-1)[first_of_each(numbers, count)]
        return Vertices(triangles, records, self._position_ids(records), 0)

    def _position_ids(self, records: np.ndarray) -> np.ndarray:
        columns = [records["0"].astype("<u4")]
        if HASH in (records.dtype.names or ()):
            columns.append(records[HASH][:, None])
        ids: np.ndarray
        ids, _ = _codec.weld(_bytes_of(np.concatenate(columns, axis=1)))
        return ids

    def decoded(self, records: np.ndarray, names: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Name -> [n, components]: what attributes decode to."""
        return {
            name: to_accessor(
                [
                    dequantise(records[str(s)].astype(np.uint32), self.plan.streams[s])
                    for s in self._numbers_of(name)
                ],
                self.formats[name][0],
            )
            for name in names
        }

    def streams_of(self, name: str) -> list[Stream]:
        """The streams of an attribute."""
        return [self.plan.streams[s] for s in self._numbers_of(name)]

    def primitive_of(self, vertices: Vertices) -> tuple[Primitive, Plan]:
        """(the vertices with the values that they decode to, their plan)."""
        values = [vertices.records[str(s)].astype(np.uint32) for s in range(len(self.plan.streams))]
        attributes = self.decoded(vertices.records, tuple(self.plan.attributes))
        primitive = Primitive(self.mesh, self.primitive, vertices.triangles, attributes)
        return primitive, replace(self.plan, values=values)


def _bytes_of(rows: np.ndarray) -> np.ndarray:
    rows = np.ascontiguousarray(rows)
    return rows.view(np.uint8).reshape(len(rows), rows[:1].nbytes if len(rows) else 0)


def _hashes(positions: np.ndarray) -> np.ndarray:
    """uint32[n]: of positions; equal for negative and positive zero."""
    words = np.ascontiguousarray(positions.astype(np.float32) + np.float32(0)).view(np.uint32)
    result = np.zeros(len(words), np.uint32)
    for column in words.T:
        result = (result + column) * np.uint32(0x9E3779B1)
        result ^= result >> np.uint32(15)
    return result
