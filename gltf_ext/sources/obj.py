"""Reads .obj files in blocks; their materials: mtl.py."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance
from gltf_ext.ranges import begins
from gltf_ext.sources import mtl
from gltf_ext.sources.colors import FULL, Colors
from gltf_ext.sources.limits import check_vertex_count
from gltf_ext.sources.mesh_files import (
    Mesh,
    MeshFile,
    MeshPrimitive,
    Parent,
    to_floats,
    to_texcoords,
)
from gltf_ext.sources.offset import Offset, with_offset
from gltf_ext.sources.polygons import CornerNumbers, Points, at_corners, triangles_of
from gltf_ext.sources.row_arrays import NewRows, Numbering, RowArray, RowRange, Rows
from gltf_ext.sources.text import open_watched, text_blocks, words_after

VERTEX, TEXCOORD, NORMAL = range(3)
KINDS = ("v", "vt", "vn")
NAMES = ("vertex", "texture coordinate", "normal")
PLURALS = ("vertices", "texture coordinates", "normals")
ATTRIBUTES = ("POSITION", "TEXCOORD_0", "NORMAL")  # of each kind
FEWEST = (3, 1, 3)  # numbers of a line
COLORED = 6  # numbers of a vertex with a colour
STATES = ("o", "g", "usemtl")  # what the faces after it belong to
# What has no triangles, and how it is called in a warning.
OTHERS = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}
KEYWORDS = {
    **dict.fromkeys(KINDS, "numbers"),
    "f": "corners",
    **dict.fromkeys((*STATES, "mtllib", *OTHERS), "any"),
}
NONE = -1


class State(NamedTuple):
    """What faces belong to.

    Attributes:
        number: of the object in the file, 0 before the first; of two with the same name, each is an
            object. object, group, material: their names.
    """

    number: int = 0
    object: bytes = b""
    group: bytes = b""
    material: bytes = b""

    def after(self, keyword: str, name: bytes) -> State:
        """Return what faces after a line belong to."""
        if keyword == "o":
            return self._replace(number=self.number + 1, object=name, group=b"")
        return self._replace(group=name) if keyword == "g" else self._replace(material=name)


class Block(NamedTuple):
    """A piece of the file.

    Attributes:
        rows: float64[n, columns] of v, vt and vn; columns: the fewest of a line, but 2 of vt, and 6
            of v if any has a colour, which is FULL for those that have none.
        numbers: int32[C] of v, vt and vn at the corners of all faces, from 0; NONE where there is
            none; None if no corner has one.
        sizes: int64[F], corners of each face.
        states: (what faces belong to, the first of them), in the order of the file.
        libraries: names after mtllib.
        others: keyword -> lines that have no triangles.
    """

    rows: list[np.ndarray]
    numbers: list[np.ndarray | None]
    sizes: np.ndarray
    states: list[tuple[State, int]]
    libraries: list[bytes]
    others: dict[str, int]


def blocks(path: Path, advance: Advance | None = None) -> Iterator[Block]:
    """Yield the file in order. A face may use vertices of later blocks.

    advance: moves the progress bar. Raises MeshletError, OSError.
    """
    totals, state = [0, 0, 0], State()
    with open_watched(path, advance) as file:
        for text in text_blocks(file):
            scans = dict(zip(KEYWORDS, _codec.scan_lines(text, KEYWORDS)))
            of_kinds, (numbers_of_file, counts, at) = [scans[kind] for kind in KINDS], scans["f"]
            rows = [_rows(scan[0], scan[1], kind) for kind, scan in enumerate(of_kinds)]
            sizes = counts.astype(np.int64) // len(KINDS)
            above = _Above(totals, [scan[2] for scan in of_kinds], at)
            lines = [
                (offset, keyword, name)
                for keyword in STATES
                for offset, name in zip(
                    scans[keyword][2].tolist(), words_after(text, scans[keyword][2])
                )
            ]
            states = [(state, 0)]
            for offset, keyword, name in sorted(lines):
                state = state.after(keyword, name)
                states.append((state, int(np.searchsorted(at, offset))))
            yield Block(
                rows,
                _numbers(numbers_of_file.reshape(-1, 3), sizes, above),
                sizes,
                states,
                words_after(text, scans["mtllib"][2]),
                {word: len(scans[word][2]) for word in OTHERS if len(scans[word][2])},
            )
            totals = [total + len(r) for total, r in zip(totals, rows)]
            for total, kind in zip(totals, PLURALS):
                check_vertex_count(total, kind)


class _Above(NamedTuple):
    """totals: lines of each kind before the block; offsets: of those in it; at: of its faces."""

    totals: list[int]
    offsets: list[np.ndarray]
    at: np.ndarray

    def lines(self, kind: int) -> np.ndarray:
        """int32: for each face, the number of lines of a kind above it."""
        lines = np.searchsorted(self.offsets[kind], self.at) + self.totals[kind]
        return lines.astype(np.int32)


def _rows(numbers: np.ndarray, counts: np.ndarray, kind: int) -> np.ndarray:
    if not len(counts):
        return np.empty((0, 3))
    columns, most = int(counts.min()), int(counts.max())
    if columns < FEWEST[kind]:
        raise MeshletError(f"has a {NAMES[kind]} of {columns} numbers", EXPORT_AGAIN)
    if kind == TEXCOORD and columns == 1:  # a line without v, which is 0
        numbers = np.insert(numbers, np.cumsum(counts, dtype=np.int64)[counts == 1], 0.0)
        counts = np.maximum(counts, 2)
        columns = 2
    if columns == counts.max():
        return numbers.reshape(-1, columns)
    starts = np.cumsum(counts, dtype=np.int64) - counts
    if kind == VERTEX and columns < COLORED <= most:
        rows = np.full((len(counts), COLORED), FULL)
        rows[:, :3] = numbers[starts[:, None] + np.arange(3)]
        colored = np.flatnonzero(counts >= COLORED)
        rows[colored, 3:] = numbers[starts[colored, None] + np.arange(3, COLORED)]
        return rows
    result: np.ndarray = numbers[starts[:, None] + np.arange(columns)]
    return result


def _numbers(
    numbers_of_file: np.ndarray, sizes: np.ndarray, above: _Above
) -> list[np.ndarray | None]:
    """Return the numbers of each kind, as in Block.

    numbers_of_file: int32[C, 3]: from 1, or negative and counted back from the face; 0 for none.
    """
    result: list[np.ndarray | None] = []
    for kind in range(len(KINDS)):
        numbers = numbers_of_file[:, kind].copy()
        if not numbers.any():
            result.append(None)
            continue
        is_relative = numbers < 0 if numbers.min() < 0 else None
        numbers -= 1
        if is_relative is not None:
            numbers[is_relative] += np.repeat(above.lines(kind), sizes)[is_relative] + 1
            if (numbers[is_relative] < 0).any():
                raise MeshletError(f"a face uses a {NAMES[kind]} before the first", EXPORT_AGAIN)
        result.append(numbers)
    vertices = result[VERTEX]
    if len(numbers_of_file) and (vertices is None or vertices.min() == NONE):
        raise MeshletError("a face uses vertex 0", EXPORT_AGAIN)
    return result


def read(
    path: Path, new_rows: NewRows, split_groups: bool = False, advance: Advance | None = None
) -> MeshFile:
    """Read a mesh for each object that has triangles. Raises MeshletError, OSError.

    split_groups: read a mesh for each group of an object. advance: moves the progress bar.
    """

    def collect(offset: Offset) -> _Reader:
        reader = _Reader(new_rows, split_groups, offset)
        for block in blocks(path, advance):
            reader.add(block)
        return reader

    return with_offset(collect).result(path)


class _Sets(NamedTuple):
    """Sets of attributes of faces, a bit for each kind.

    Attributes:
        everywhere: that of all faces; of_faces: uint8[F], None if all are the same.
    """

    everywhere: int
    of_faces: np.ndarray | None


class _Faces(NamedTuple):
    """Faces of one object or group and material that have the same attributes."""

    state: State
    kinds: tuple[int, ...]
    numbers: list[CornerNumbers]


@dataclass
class _Reader:
    """Collects blocks.

    Attributes:
        offset: of positions.
        rows: of each kind; colors: of vertices.
        faces: by object or group, material and set of attributes; in the order of the file.
        incomplete: faces of which only some corners have an attribute; short: those with fewer than
            three corners.
    """

    new_rows: NewRows
    split_groups: bool
    offset: Offset
    faces: dict[tuple[State, int], _Faces] = field(default_factory=dict)
    libraries: list[bytes] = field(default_factory=list)
    others: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    incomplete: int = 0
    short: int = 0

    def __post_init__(self) -> None:
        self.rows = [self.new_rows() for _ in KINDS]
        self.colors = Colors(self.new_rows)
        self.points = Points(self.rows[VERTEX])

    def add(self, block: Block) -> None:
        self._add_rows(block.rows)
        self.libraries += block.libraries
        for keyword, count in block.others.items():
            self.others[OTHERS[keyword]] += count
        if len(block.sizes):
            self._add_faces(block)

    def _add_rows(self, rows: list[np.ndarray]) -> None:
        v, vt, vn = rows
        if len(v):
            self.rows[VERTEX].add(self.offset.to_local(v[:, :3]))
            self._add_colors(v[:, 3:COLORED])
        if len(vt):
            self.rows[TEXCOORD].add(to_texcoords(vt))
        if len(vn):
            self.rows[NORMAL].add(to_floats(vn[:, :3]))

    def _add_colors(self, colors: np.ndarray) -> None:
        if colors.shape[1] < COLORED - 3:
            self.colors.skip(len(colors))
        else:
            self.colors.add(colors, colors.dtype)

    def _add_faces(self, block: Block) -> None:
        sizes, numbers = block.sizes, block.numbers
        vertices = numbers[VERTEX]
        if vertices is None:  # faces without corners
            return
        corners, counts = triangles_of(sizes, lambda: self.points.at(vertices))
        sets = self._sets(numbers, sizes)
        self.short += int(np.count_nonzero(sizes < 3)) if corners is not None else 0
        of_kinds = [None if rows is None else at_corners(rows, corners) for rows in numbers]
        ends = begins(counts)
        of_triangles = None if sets.of_faces is None else np.repeat(sets.of_faces, counts)
        firsts = [first for _, first in block.states]
        parts: dict[tuple[State, int], list[slice | np.ndarray]] = defaultdict(list)
        for (state, face), end in zip(block.states, [*firsts[1:], len(sizes)]):
            first, last = int(ends[face]), int(ends[end])
            if first == last:
                continue
            if of_triangles is None:
                parts[state, sets.everywhere].append(slice(first, last))
                continue
            sets_here, at = np.unique(of_triangles[first:last], return_index=True)
            for has in sets_here[np.argsort(at)].tolist():
                parts[state, has].append(first + np.flatnonzero(of_triangles[first:last] == has))
        for (state, has), ranges in parts.items():
            faces = self._faces_of(state, has)
            for kind, rows in zip(faces.kinds, faces.numbers):
                rows.add(_concatenate(of_kinds[kind], ranges))

    def _sets(self, numbers: list[np.ndarray | None], sizes: np.ndarray) -> _Sets:
        """Find the attributes that all corners of each face have."""
        everywhere, of_faces = 0, None
        for kind, rows in enumerate(numbers):
            if rows is None:
                continue
            if rows.min() != NONE:
                everywhere |= 1 << kind
                continue
            whole = _count(rows != NONE, sizes)
            self.incomplete += int(np.count_nonzero((whole > 0) & (whole < sizes)))
            bits = (whole == sizes).astype(np.uint8) << kind
            of_faces = bits if of_faces is None else of_faces | bits
        return _Sets(everywhere, None if of_faces is None else of_faces | everywhere)

    def _faces_of(self, state: State, has: int) -> _Faces:
        if not self.split_groups:
            state = state._replace(group=b"")
        if (state, has) not in self.faces:
            kinds = tuple(kind for kind in range(len(KINDS)) if has >> kind & 1)
            numbers = [CornerNumbers(self.new_rows()) for _ in kinds]
            self.faces[state, has] = _Faces(state, kinds, numbers)
        return self.faces[state, has]

    # --- the result ---

    def result(self, path: Path) -> MeshFile:
        """Return the meshes. Raises MeshletError, OSError."""
        offset = self.offset
        contents = MeshFile([], self._warnings(), offset=offset.values, rounding=offset.rounding)
        used = {faces.state.material for faces in self.faces.values()}
        materials = mtl.read(path.parent, self.libraries, used, contents)
        table: dict[str, RowArray] = dict(zip(ATTRIBUTES, self.rows))
        colors = self.colors.finish()
        if colors is not None:
            table["COLOR_0"] = colors
        meshes: dict[State, Mesh] = {}
        untextured = 0
        for faces in self.faces.values():
            of_mesh = faces.state._replace(material=b"")
            mesh = meshes.setdefault(of_mesh, _mesh(of_mesh, path.name))
            primitive, problems = _primitive(faces, table)
            primitive.material = material = materials.get(faces.state.material)
            mesh.primitives.append(primitive)
            contents.warnings += [f"{mesh.name}: {problem}" for problem in problems]
            if material and material.for_attributes(primitive.attributes) is not material:
                untextured += primitive.triangle_count
        if untextured:
            contents.warnings.append(
                f"{untextured} triangles have no texture coordinates, so they are shown without "
                "the textures of their materials"
            )
        contents.meshes = list(meshes.values())
        return contents

    def _warnings(self) -> list[str]:
        warnings = list(self.points.warnings)
        if self.others:
            counts = ", ".join(f"{count} {kind}" for kind, count in self.others.items())
            warnings.append(f"left out, as they have no triangles: {counts}")
        if self.short:
            warnings.append(f"{self.short} faces of fewer than three corners are left out")
        if self.incomplete:
            warnings.append(
                f"{self.incomplete} faces have texture coordinates or normals at some corners "
                "only, which are left out"
            )
        return warnings


def _mesh(state: State, file: str) -> Mesh:
    """Return an object's or a group's mesh without primitives."""
    names = [name.decode(errors="replace") for name in (state.object, state.group) if name]
    if not names:
        return Mesh(file, [])
    return Mesh(names[-1], [], Parent(state.number, names[0]) if len(names) > 1 else None)


def _count(is_there: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """int64[F]: the corners of each face that are there. is_there: bool[C]."""
    sums, ends = begins(is_there), begins(sizes)
    counts: np.ndarray = sums[ends[1:]] - sums[ends[:-1]]
    return counts


def _concatenate(rows: np.ndarray | None, parts: list[slice | np.ndarray]) -> np.ndarray:
    assert rows is not None
    return rows[parts[0]] if len(parts) == 1 else np.concatenate([rows[part] for part in parts])


def _primitive(faces: _Faces, table: dict[str, RowArray]) -> tuple[MeshPrimitive, list[str]]:
    """Return the triangles with the attributes that they have, and warn of rows that are missing.

    table: the rows of all attributes.
    """
    numberings: list[Numbering] = []
    attributes: dict[str, Rows] = {}
    warnings = []
    for kind, numbers in zip(faces.kinds, faces.numbers):
        names = [ATTRIBUTES[kind]]
        count = table[names[0]].count
        if kind == VERTEX:
            numbers.check(count, NAMES[VERTEX], 1)
            names += ["COLOR_0"] * ("COLOR_0" in table)
        elif numbers.most >= count:
            warnings.append(f"a face uses a {NAMES[kind]} that is not there; all are left out")
            continue
        numberings.append((tuple(names), numbers.from_least()))
        for name in names:
            attributes[name] = RowRange(table[name], numbers.least, numbers.most + 1)
    return MeshPrimitive(attributes, numberings, shares_rows=True), warnings
