"""Triangle primitives to compress or compare: rows of vertices and corners, in memory or not."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import Format, bounds, read_accessor
from gltf_ext.document.document import Document
from gltf_ext.document.draco import DRACO, decode_draco
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance
from gltf_ext.scheduler import in_order
from gltf_ext.sources.attribute_names import is_of_target, local_name, pair_names, semantic
from gltf_ext.sources.primitives import DropCounts, Primitive, place
from gltf_ext.sources.row_arrays import Numbering, Rows

# Rows that are read at a time. With 1 << 17, a million triangles in --max-memory 110M peaked at 98
# to 110 MB, with 1 << 16 at 80 to 87.
BLOCK = 1 << 16
CACHED = 1 << 14  # triangles whose corners are compared at a time, in the processor's cache
WIDTHS = {"POSITION": 3, "NORMAL": 3, "TANGENT": 4}  # components; a target's TANGENT has three
# Semantics of floats that are rounded. Others, but those of morph targets, keep any bits.
ROUNDED = ("POSITION", "NORMAL", "TANGENT", "TEXCOORD", "COLOR", "WEIGHTS")

Box = tuple[np.ndarray, np.ndarray]  # smallest and largest position


@dataclass(frozen=True)
class ArrayRows:
    """Elements in memory, [count, components]."""

    values: np.ndarray

    @property
    def count(self) -> int:
        """The number of elements."""
        return len(self.values)

    @property
    def format(self) -> Format:
        """Their type."""
        return self.values.dtype, self.values.shape[1]

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components] elements."""
        return self.values[first:last]


@dataclass
class Source:
    """A list of triangles.

    Attributes:
        mesh, primitive: its place in the document.
        attributes: name -> elements; of morph targets as "targets[i].NAME".
        numberings: each attribute is in one.
        room: bytes of memory that vertices may take at a time; 0 for a source that is in memory.
        threads: number of blocks that are read at a time, from files.
        is_copy: whether the rows are in work files of this source and others of the same document.
        bounds: name -> [2, components]: smallest and largest values at corners, without degenerate
            triangles; once read.
        used_vertices: number of the vertices at these corners, of a source whose attributes have
            the same numbers; read with the bounds.
        replaced: kind of value that was not finite (repair.py) -> how many there were.
    """

    mesh: int
    primitive: int
    attributes: dict[str, Rows]
    numberings: list[Numbering]
    room: int = 0
    threads: int = 1
    is_copy: bool = False
    bounds: dict[str, np.ndarray] = field(default_factory=dict)
    used_vertices: int = 0
    replaced: Counter[str] = field(default_factory=Counter)
    _used: tuple[list[Any], np.ndarray] | None = None  # rows in memory, and what _are_used returned

    @classmethod
    def of(cls, primitive: Primitive) -> Source:
        """Arrays as a source."""
        attributes: dict[str, Rows] = {n: ArrayRows(values) for n, values in primitive.arrays}
        indices = ArrayRows(primitive.indices.reshape(-1, 1))
        return cls(primitive.mesh, primitive.primitive, attributes, [(tuple(attributes), indices)])

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return place(self.mesh, self.primitive)

    @property
    def is_in_memory(self) -> bool:
        """Whether nothing has to be read from files."""
        return not self.room

    @property
    def formats(self) -> dict[str, Format]:
        """Type of each attribute."""
        return {name: rows.format for name, rows in self.attributes.items()}

    @property
    def box(self) -> Box | None:
        """The bounds of its positions; None without triangles, or for integers."""
        if "POSITION" not in self.bounds:
            return None
        low, high = self.bounds["POSITION"]
        return (low, high) if low.dtype.kind == "f" else None

    @property
    def not_finite(self) -> list[str]:
        """Names of attributes that would be rounded, but whose bounds are NaN or infinite."""
        return [
            name
            for name, ends in self.bounds.items()
            if ends.dtype.kind == "f"
            and (is_of_target(name) or semantic(name) in ROUNDED)
            and not np.isfinite(ends).all()
        ]

    @property
    def triangle_count(self) -> int:
        """The number of triangles."""
        names, numbers = self.numberings[0]
        return (numbers or self.attributes[names[0]]).count // 3

    @property
    def vertex_count(self) -> int:
        """The number of vertices, of a source whose attributes have the same numbers."""
        return self.attributes["POSITION"].count

    def give_back_copy(self) -> None:
        """Forget rows in work files, which are gone with the last source that has some in them."""
        if self.is_copy:
            self.attributes, self.numberings = {}, []

    def read_bounds(self, advance: Advance | None = None) -> None:
        """Set `bounds`, to none if all triangles are degenerate, and `used_vertices`.

        Reads everything.

        Raises MeshletError, OSError.
        """
        self.used_vertices = 0
        for count, extremes in self.of_used_vertices(self._count_and_bounds, advance):
            self.used_vertices += count
            for name, rows in extremes.items():
                rows = np.concatenate([self.bounds.get(name, rows), rows])
                self.bounds[name] = np.stack(bounds(rows))

    def of_used_vertices(
        self,
        function: Callable[[dict[str, np.ndarray]], Any],
        advance: Advance | None = None,
    ) -> Iterator[Any]:
        """Yield the results of a function for some vertices of triangles at a time.

        Leaves out vertices that only degenerate triangles have.

        Args:
            function: takes attributes that have numbers in common, name -> [n, components]; runs on
                threads.
            advance: moves the progress bar.

        Raises:
            MeshletError: indices are out of range.
            OSError: a file cannot be read.
        """
        total = sum(self.attributes[names[0]].count for names, _ in self.numberings)
        finished = 0
        for names, numbers in self.numberings:
            count = self.attributes[names[0]].count
            for low, high in blocks(count, self.room or max(count, 1)):
                is_used = self._are_used(names, numbers, low, high)
                parts = list(blocks(high - low))
                tasks = ((function, names, low, is_used, *part) for part in parts)
                for (first, last), result in zip(parts, self.in_order(self._of_used, tasks)):
                    if result is not None:
                        yield result
                    finished += last - first
                    if advance:
                        advance(finished / total)
                del is_used, tasks  # before the next flags are made

    def used_rows(self) -> np.ndarray:
        """Return the rows of vertices that of_used_vertices takes, of a source in memory."""
        ((names, numbers),) = self.numberings
        return np.flatnonzero(self._are_used(names, numbers, 0, self.vertex_count))

    def _of_used(
        self,
        function: Callable[[dict[str, np.ndarray]], Any],
        names: tuple[str, ...],
        low: int,
        is_used: np.ndarray,
        first: int,
        last: int,
    ) -> Any:
        rows_used = np.flatnonzero(is_used[first:last])
        if not len(rows_used):
            return None
        values = self.vertices(names, low + first, low + last)
        if len(rows_used) < last - first:
            values = {name: rows[rows_used] for name, rows in values.items()}
        return function(values)

    def in_order(
        self, function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]
    ) -> Iterator[Any]:
        """Yield the results of a function for tasks, such as blocks; on threads for files."""
        if self.is_in_memory:
            return (function(*task) for task in tasks)
        return in_order(function, tasks, self.threads)

    def _are_used(
        self, names: tuple[str, ...], numbers: Rows | None, low: int, high: int
    ) -> np.ndarray:
        """Return bool[high - low]: whether triangles have these rows of the attributes.

        Degenerate triangles do not count: what they alone have may be no numbers, or far away.
        """
        if not self.is_in_memory:
            return self._find_used(names, numbers, low, high)
        # A small model takes a tenth less time if this is not done for each use.
        rows = [numbers, *self.attributes.values()]
        if self._used is None or not _are_identical(self._used[0], rows):
            self._used = rows, self._find_used(names, numbers, low, high)
        return self._used[1]

    def _find_used(
        self, names: tuple[str, ...], numbers: Rows | None, low: int, high: int
    ) -> np.ndarray:
        is_used = np.zeros(high - low, bool)
        is_all = high - low == self.attributes[names[0]].count

        def mark(first: int, last: int) -> None:
            is_degenerate = self._are_degenerate(first, last)
            corners = self.corners(names, numbers, first, last)
            if is_degenerate.any():
                corners = corners[~is_degenerate]
            rows = corners.reshape(-1).astype(np.intp)  # half the time of uint32 as an index
            is_used[rows if is_all else rows[(rows >= low) & (rows < high)] - low] = True

        parts = blocks(self.triangle_count)
        if numbers is None:
            parts = (part for part in parts if 3 * part[0] < high and 3 * part[1] > low)
        for _ in self.in_order(mark, parts):
            pass
        return is_used

    def _are_degenerate(self, first: int, last: int) -> np.ndarray:
        """Return bool[last - first]: whether triangles have two corners with equal bytes."""
        is_same = np.ones((3, last - first), bool)
        for names, numbers in self.numberings:
            is_same &= self._are_same(names, numbers, first, last)
            if not is_same.any():
                break
        result: np.ndarray = is_same[0] | is_same[1] | is_same[2]
        return result

    def _are_same(
        self, names: tuple[str, ...], numbers: Rows | None, first: int, last: int
    ) -> np.ndarray:
        """Return bool[3, last - first]: whether corners 0 and 1, 1 and 2, 2 and 0 have equal bytes.

        In files, vertices with different numbers count as different: to look them up in any order
        takes too long.
        """
        if numbers is not None:
            corners = self.corners(names, numbers, first, last).astype(np.intp)
            if not self.is_in_memory:
                return _equal_pairs(corners)
            vertices = self.vertices(names, 0, self.attributes[names[0]].count)
        else:
            corners = np.arange(3 * (last - first)).reshape(-1, 3)
            vertices = self.vertices(names, 3 * first, 3 * last)
        words = [values.view(f"u{values.itemsize}") for values in vertices.values()]
        columns = [column for values in words for column in values.T]
        is_same = np.empty((3, len(corners)), bool)
        for part in blocks(len(corners), CACHED):
            is_same[:, slice(*part)] = _equal_corners(columns, corners[slice(*part)])
        return is_same

    def _count_and_bounds(
        self, vertices: dict[str, np.ndarray]
    ) -> tuple[int, dict[str, np.ndarray]]:
        with np.errstate(invalid="ignore"):  # bounds of NaN and others are NaN
            extremes = {name: np.stack(bounds(values)) for name, values in vertices.items()}
        return len(next(iter(vertices.values()))), extremes

    def vertices(self, names: tuple[str, ...], first: int, last: int) -> dict[str, np.ndarray]:
        """Return name -> [last - first, components]. Raises MeshletError, OSError."""
        return {name: self.attributes[name].rows(first, last) for name in names}

    def chosen_vertices(self, names: tuple[str, ...], rows: np.ndarray) -> dict[str, np.ndarray]:
        """Return name -> [len(rows), components]: some vertices of a source in memory."""
        whole = self.vertices(names, 0, self.attributes[names[0]].count)
        return {name: values[rows] for name, values in whole.items()}

    def numbering_of(self, name: str) -> Numbering:
        """Return the names that share the numbers of an attribute, and these."""
        return next(numbering for numbering in self.numberings if name in numbering[0])

    def all_corners(self) -> np.ndarray:
        """Return [T, 3]: rows at the corners of all triangles, of a source in memory."""
        ((names, numbers),) = self.numberings
        return self.corners(names, numbers, 0, self.triangle_count)

    def corners(
        self, names: tuple[str, ...], numbers: Rows | None, first: int, last: int
    ) -> np.ndarray:
        """[last - first, 3]: rows of the attributes at the corners of triangles.

        names, numbers: one of `numberings`. Raises MeshletError, OSError.
        """
        if numbers is None:
            return np.arange(3 * first, 3 * last, dtype=np.uint32).reshape(-1, 3)
        rows = numbers.rows(3 * first, 3 * last).reshape(-1, 3)
        count = self.attributes[names[0]].count
        if len(rows) and not (rows.max() < count and rows.min() >= 0):
            raise MeshletError(
                f"indices of {self.where} reach {rows.max()}, but it has {count} vertices",
                EXPORT_AGAIN,
            )
        return rows


def _are_identical(some: list[Any], others: list[Any]) -> bool:
    """Return whether two lists have the same objects."""
    return len(some) == len(others) and all(map(operator.is_, some, others))


def _equal_corners(columns: list[np.ndarray], corners: np.ndarray) -> np.ndarray:
    """Return bool[3, T]: whether corners 0 and 1, 1 and 2, 2 and 0 are equal in all columns."""
    is_equal = _equal_pairs(columns[0][corners])
    result = np.zeros(is_equal.shape, bool)
    candidates = np.arange(len(corners))  # most triangles differ in the first columns
    for column in columns[1:]:
        positions = np.flatnonzero(is_equal[0] | is_equal[1] | is_equal[2])
        if not len(positions):
            return result
        if len(positions) < len(candidates):
            corners, candidates, is_equal = (
                corners[positions],
                candidates[positions],
                is_equal[:, positions],
            )
        is_equal &= _equal_pairs(column[corners])
    result[:, candidates] = is_equal
    return result


def _equal_pairs(corners: np.ndarray) -> np.ndarray:
    """Return bool[3, T]: whether values 0 and 1, 1 and 2, 2 and 0 are equal. corners: [T, 3]."""
    a, b, c = corners.T
    return np.stack([a == b, b == c, c == a])


def blocks(count: int, size: int = BLOCK) -> Iterator[tuple[int, int]]:
    """Return (first, last) of blocks of rows."""
    for first in range(0, count, size):
        yield first, min(first + size, count)


# --- of a document ---

# Takes the number of an accessor, what it holds, for errors, and the count that it must have.
FindRows = Callable[[int, str, int | None], Rows]


def read_source(
    document: Document,
    mesh: int,
    index: int,
    find: FindRows | None = None,
    room: int = 0,
    threads: int = 1,
) -> tuple[Source, DropCounts]:
    """Return a triangle primitive that is not compressed with our extension.

    find: finds accessors; by default in memory. room, threads: as in Source.
    Checks counts and types; indices are checked when they are read. Raises MeshletError.
    """
    primitive = document.primitive(mesh, index)
    where = place(mesh, index)

    def in_memory(accessor: int, name: str, count: int | None) -> Rows:
        return ArrayRows(read_accessor(document, accessor, name, count))

    find = find or in_memory
    is_draco = gltf.has_extension(primitive, DRACO)
    arrays = decode_draco(document, primitive, where) if is_draco else {}
    indices = arrays.pop("indices", None)
    attributes: dict[str, Rows] = {}
    accessors = pair_names(gltf.attribute_sets(primitive))
    count = None
    for name, accessor in sorted(accessors, key=lambda pair: pair[0] != "POSITION"):
        if name in attributes:
            raise MeshletError(f"{where} has an attribute named {name}", EXPORT_AGAIN)
        if name in arrays:
            attributes[name] = ArrayRows(arrays[name])
        else:
            attributes[name] = find(accessor, f"{name} of {where}", count)
        count = attributes["POSITION"].count
    _check_widths(attributes, where)
    numbers: Rows | None = None
    if indices is not None:
        numbers = ArrayRows(indices.reshape(-1, 1))
    elif "indices" in primitive:
        numbers = find(primitive["indices"], f"indices of {where}", None)
        if numbers.format[0].kind != "u" or numbers.format[1] != 1:
            raise MeshletError(f"indices of {where} are not unsigned integers", EXPORT_AGAIN)
    corner_count = (numbers or attributes["POSITION"]).count
    mode = gltf.mode(primitive)
    if mode != gltf.TRIANGLES:
        numbers = ArrayRows(_list_of(numbers, corner_count, mode))
    source = Source(mesh, index, attributes, [(tuple(attributes), numbers)], room, threads)
    is_incomplete = mode == gltf.TRIANGLES and corner_count % 3 != 0
    return source, DropCounts(incomplete_triangles=int(is_incomplete))


def read_primitive(document: Document, mesh: int, index: int) -> tuple[Primitive, DropCounts]:
    """Return the same as arrays; triangles are as in the file. Raises MeshletError."""
    source, drop_counts = read_source(document, mesh, index)
    ((names, numbers),) = source.numberings
    corners = source.corners(names, numbers, 0, source.triangle_count)
    arrays = {name: rows.rows(0, rows.count) for name, rows in source.attributes.items()}
    primitive = document.primitive(mesh, index)
    attributes, *targets = (
        {name: arrays[f"targets[{i - 1}].{name}" if i else name] for name in names_of_set}
        for i, names_of_set in enumerate(gltf.attribute_sets(primitive))
    )
    triangles = np.ascontiguousarray(corners, np.uint32)
    return Primitive(mesh, index, triangles, attributes, targets), drop_counts


def _check_widths(attributes: dict[str, Rows], where: str) -> None:
    for name, rows in attributes.items():
        local, width = local_name(name), rows.format[1]
        required_width = (
            3 if is_of_target(name) and local == "TANGENT" else WIDTHS.get(local, width)
        )
        if width != required_width:
            raise MeshletError(
                f"{name} of {where} has {width} components instead of {required_width}",
                EXPORT_AGAIN,
            )


def _list_of(numbers: Rows | None, count: int, mode: int) -> np.ndarray:
    """Return the corners of the triangles of a strip or a fan, [3 T, 1].

    The winding of strips alternates.
    """
    i = np.arange(max(count - 2, 0))
    if mode == gltf.TRIANGLE_STRIP:
        corners = np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)
    else:
        corners = np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)
    rows = corners.reshape(-1, 1).astype(np.uint32)
    return rows if numbers is None else numbers.rows(0, count)[rows[:, 0]]
