"""Values that are not finite, NaN and infinity: no grid holds them. Repairs or refuses them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gltf_ext.errors import MeshletError
from gltf_ext.progress import Advance
from gltf_ext.sources.attribute_names import is_of_target, semantic
from gltf_ext.sources.limits import check_vertex_count
from gltf_ext.sources.row_arrays import Numbering, Rows
from gltf_ext.sources.source import ArrayRows, Source, blocks

REPAIR, REFUSE = "repair", "refuse"
# Of the memory for vertices of a source in files: what repairs may take. Bytes of a row or triangle
# while it is repaired.
REPAIR_SHARE, REPAIR_BYTES = 0.5, 256
# What stands for values, by the kind of attribute, in the words of a warning.
REPLACEMENTS = {
    "POSITION": "triangles left out, as a position is not finite",
    "NORMAL": "normals that are not finite, computed from the triangles around them",
    "TANGENT": "tangents that are not finite, now at right angles to the normals",
    "TEXCOORD": "texture coordinates that are not finite, now 0",
    "COLOR": "colours that are not finite, now white",
    "WEIGHTS": "skin weights that are not finite, now 0",
    "": "values of morph targets that are not finite, now 0",
}


def repair_warnings(sources: Iterable[Source]) -> list[str]:
    """Return a line for each kind of value that was replaced."""
    counts: Counter[str] = Counter()
    for source in sources:
        counts += source.replaced
    return [f"{text}: {counts[kind]:,}" for kind, text in REPLACEMENTS.items() if counts[kind]]


def read_finite_bounds(
    source: Source, non_finite: str = REPAIR, advance: Advance | None = None
) -> None:
    """Read the bounds of a source, and repair the values in it that are not finite.

    non_finite: REPAIR, or REFUSE to raise MeshletError for them. Raises also for too many in files.
    """
    source.read_bounds(advance)
    names = source.not_finite
    if not names:
        return
    if non_finite == REFUSE:
        raise _refusal(names[0], source, "repair the model first")
    for name in sorted(names, key=lambda name: (name != "POSITION", name)):
        numbering = source.numbering_of(name)
        rows = _bad_rows(source, name, numbering)
        if not len(rows):  # their triangles are left out
            continue
        if name == "POSITION":
            source.replaced[name] += _leave_out(source, numbering, rows)
        elif name == "NORMAL" and "POSITION" not in numbering[0]:
            source.replaced[name] += _split_normals(source, numbering, rows)
        else:  # after positions and normals, which others depend on
            values = _replacements(source, name, numbering, rows)
            source.attributes[name] = _Replaced(source.attributes[name], rows, values)
            source.replaced[_kind(name)] += len(rows)
    source.bounds = {}
    source.read_bounds()


def _refusal(name: str, source: Source, remedy: str) -> MeshletError:
    return MeshletError(f"{name} of {source.where} has a NaN or infinite value", remedy)


def _kind(name: str) -> str:
    return "" if is_of_target(name) else semantic(name)


def _require_few(source: Source, count: int, name: str) -> None:
    """Raise MeshletError for more rows or triangles to repair than bounded memory holds."""
    needed_bytes = REPAIR_BYTES * count + sum(
        rows.nbytes
        for rows in source.attributes.values()
        if isinstance(rows, (_Replaced, _Extended))
    )
    if not source.is_in_memory and needed_bytes > REPAIR_SHARE * source.room:
        raise _refusal(name, source, "it has too many of them for max_memory: repair it first")


# --- rows and triangles ---


def _bad_rows(source: Source, name: str, numbering: Numbering) -> np.ndarray:
    """Return the rows of an attribute that are not finite and in use, in order."""
    rows = source.attributes[name]

    def bad_rows(first: int, last: int) -> np.ndarray:
        return first + np.flatnonzero(~np.isfinite(rows.rows(first, last)).all(axis=1))

    bad = _collect(source, name, (bad_rows(*block) for block in blocks(rows.count)))
    is_used = np.zeros(len(bad), bool)
    for _, corners in _corners(source, numbering):
        indices, is_bad = _find(corners, bad)
        is_used[indices[is_bad]] = True
    return bad[is_used]


def _collect(source: Source, name: str, parts: Iterable[np.ndarray]) -> np.ndarray:
    """Join numbers of rows or triangles to repair, as far as memory holds them."""
    arrays, count = [np.zeros(0, np.int64)], 0
    for part in parts:
        if len(part):
            arrays.append(part)
            count += len(part)
            _require_few(source, count, name)
    return np.concatenate(arrays)


def _corners(source: Source, numbering: Numbering) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the first triangle and the corners, [n, 3], of a block of triangles at a time."""
    for first, last in blocks(source.triangle_count):
        yield first, source.corners(*numbering, first, last)


def _find(numbers: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (indices of numbers in rows, whether they are there). rows: ascending."""
    if not len(rows):
        return np.zeros(numbers.shape, np.intp), np.zeros(numbers.shape, bool)
    indices = np.minimum(np.searchsorted(rows, numbers), len(rows) - 1)
    return indices, rows[indices] == numbers


def _leave_out(source: Source, numbering: Numbering, rows: np.ndarray) -> int:
    """Leave out the triangles with one of these rows at a corner; return their number."""
    triangles = _triangles_at(source, "POSITION", numbering, rows)
    source.numberings = [_without(source, row, triangles) for row in source.numberings]
    return len(triangles)


def _triangles_at(source: Source, name: str, numbering: Numbering, rows: np.ndarray) -> np.ndarray:
    """Return the numbers of the triangles with one of these rows at a corner, in order."""
    return _collect(
        source,
        name,
        (
            first + np.flatnonzero(_find(corners, rows)[1].any(axis=1))
            for first, corners in _corners(source, numbering)
        ),
    )


def _without(source: Source, numbering: Numbering, triangles: np.ndarray) -> Numbering:
    names, numbers = numbering
    numbers = _TrianglesWithout(_numbers_of(source, numbering), triangles)
    if source.is_in_memory:  # read once
        return names, ArrayRows(numbers.rows(0, numbers.count))
    return names, numbers


def _numbers_of(source: Source, numbering: Numbering) -> Rows:
    names, numbers = numbering
    return numbers or _Counting(source.attributes[names[0]].count)


@dataclass(frozen=True)
class _Counting:
    """The numbers 0, 1, 2 ..."""

    count: int
    format = (np.dtype(np.uint32), 1)

    def rows(self, first: int, last: int) -> np.ndarray:
        return np.arange(first, last, dtype=np.uint32).reshape(-1, 1)


@dataclass(frozen=True)
class _Derived:
    """Rows made of others: as many of the same format, unless a subclass has another count."""

    source: Rows

    @property
    def count(self) -> int:
        return self.source.count

    @property
    def format(self) -> tuple[np.dtype, int]:
        return self.source.format


@dataclass(frozen=True)
class _TrianglesWithout(_Derived):
    """The corners of triangles without some of these. Read in whole triangles."""

    triangles: np.ndarray

    @property
    def count(self) -> int:
        return self.source.count - self.source.count % 3 - 3 * len(self.triangles)

    def rows(self, first: int, last: int) -> np.ndarray:
        if first >= last:
            return self.source.rows(0, 0)
        # The n-th triangle that stays has n and those left out before it ahead of it.
        stayed_before = self.triangles - np.arange(len(self.triangles))
        ends = np.array([first // 3, last // 3 - 1])
        low, high = ends + np.searchsorted(stayed_before, ends, side="right") + [0, 1]
        out = self.triangles[slice(*np.searchsorted(self.triangles, [low, high]))] - low
        rows = self.source.rows(3 * low, 3 * high)
        width = rows.shape[1]
        return np.delete(rows.reshape(-1, 3, width), out, axis=0).reshape(-1, width)


@dataclass(frozen=True)
class _Replaced(_Derived):
    """Rows of which some have other values.

    Attributes:
        indices: their numbers, ascending; values: [len(indices), components].
    """

    indices: np.ndarray
    values: np.ndarray

    @property
    def nbytes(self) -> int:
        return self.indices.nbytes + self.values.nbytes

    def rows(self, first: int, last: int) -> np.ndarray:
        result = np.array(self.source.rows(first, last))
        low, high = np.searchsorted(self.indices, [first, last])
        result[self.indices[low:high] - first] = self.values[low:high]
        return result


@dataclass(frozen=True)
class _Extended(_Derived):
    """Rows, then others: values, [n, components]."""

    values: np.ndarray

    @property
    def nbytes(self) -> int:
        return self.values.nbytes

    @property
    def count(self) -> int:
        return self.source.count + len(self.values)

    def rows(self, first: int, last: int) -> np.ndarray:
        count = self.source.count
        before = self.source.rows(min(first, count), min(last, count))
        return np.concatenate([before, self.values[max(first - count, 0) : max(last - count, 0)]])


@dataclass(frozen=True)
class _Split(_Derived):
    """Numbers of which some, `bad`, are instead `first` plus the index of a position's number."""

    positions: Rows
    bad: np.ndarray
    own_rows: np.ndarray
    first: int

    def rows(self, first: int, last: int) -> np.ndarray:
        result = np.array(self.source.rows(first, last))
        is_bad = _find(result, self.bad)[1]
        positions = self.positions.rows(first, last)[is_bad]
        result[is_bad] = self.first + np.searchsorted(self.own_rows, positions)
        return result


# --- values ---


def _replacements(source: Source, name: str, numbering: Numbering, rows: np.ndarray) -> np.ndarray:
    """Return what stands for these rows of an attribute, [len(rows), components]."""
    kind, (dtype, width) = _kind(name), source.attributes[name].format
    if kind == "NORMAL":
        return _normals(source, numbering, rows).astype(dtype)
    if kind == "TANGENT":
        return _tangents(source, rows).astype(dtype)
    if kind == "WEIGHTS":  # those that are finite stay
        values = _gather(source.attributes[name], rows)
        return np.where(np.isfinite(values), values, 0).astype(dtype)
    return np.full((len(rows), width), 1 if kind == "COLOR" else 0, dtype)


def _normals(source: Source, numbering: Numbering, rows: np.ndarray) -> np.ndarray:
    """Return the normals of the triangles around vertices, weighted by area: [len(rows), 3]."""
    corners = _corners_of(source, numbering, _triangles_at(source, "NORMAL", numbering, rows))
    return _sums_of_areas(source, corners, *_find(corners, rows), len(rows))


def _split_normals(source: Source, numbering: Numbering, rows: np.ndarray) -> int:
    """Replace rows of normals, which several positions may share, by one for each position.

    Returns their number. Only of a source in files.
    """
    names, _ = numbering
    of_positions = source.numbering_of("POSITION")
    touched = _triangles_at(source, "NORMAL", numbering, rows)
    corners = _corners_of(source, of_positions, touched)
    is_bad = _find(_corners_of(source, numbering, touched), rows)[1]
    own_rows = np.unique(corners[is_bad])
    indices = np.searchsorted(own_rows, corners)
    normals = _sums_of_areas(source, corners, indices, is_bad, len(own_rows))
    old = source.attributes["NORMAL"]
    check_vertex_count(old.count + len(own_rows), "normals")
    numbers, positions = _numbers_of(source, numbering), _numbers_of(source, of_positions)
    split = names, _Split(numbers, positions, rows, own_rows, old.count)
    source.attributes["NORMAL"] = _Extended(old, normals.astype(old.format[0]))
    source.numberings = [split if row is numbering else row for row in source.numberings]
    return len(own_rows)


def _corners_of(source: Source, numbering: Numbering, triangles: np.ndarray) -> np.ndarray:
    """Return the corners of some triangles, [n, 3]. triangles: ascending."""
    blocks_of_all = _corners(source, numbering)
    return np.concatenate(
        [block[_within(triangles, first, len(block))] for first, block in blocks_of_all]
    )


def _sums_of_areas(
    source: Source, corners: np.ndarray, indices: np.ndarray, is_bad: np.ndarray, count: int
) -> np.ndarray:
    """Return unit normals, [count, 3]: sums of those of triangles at their bad corners.

    corners: [n, 3], of positions; indices, is_bad: [n, 3], of the sums that they count for.
    """
    positions = _gather(source.attributes["POSITION"], corners.reshape(-1))
    a, b, c = positions.reshape(-1, 3, 3).astype(np.float64).transpose(1, 0, 2)
    areas = np.repeat(np.cross(b - a, c - a)[:, None], 3, axis=1)
    sums = np.zeros((count, 3))
    np.add.at(sums, indices[is_bad], areas[is_bad])
    return _unit(sums)


def _within(numbers: np.ndarray, first: int, count: int) -> np.ndarray:
    """Return those of `count` numbers from the first, less the first. numbers: ascending."""
    low, high = np.searchsorted(numbers, [first, first + count])
    result: np.ndarray = numbers[low:high] - first
    return result


def _tangents(source: Source, rows: np.ndarray) -> np.ndarray:
    """Return vectors at right angles to the normals of vertices: [len(rows), 4]."""
    normals = np.tile([0.0, 0.0, 1.0], (len(rows), 1))
    if "NORMAL" in source.attributes:
        normals = _gather(source.attributes["NORMAL"], rows).astype(np.float64)
    axes = np.eye(3)[np.abs(normals).argmin(axis=1)]
    return np.pad(_unit(np.cross(normals, axes)), ((0, 0), (0, 1)), constant_values=1.0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return unit vectors; z for those without a length."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        vectors = vectors / np.abs(vectors).max(axis=1, keepdims=True)
        vectors = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    is_finite = np.isfinite(vectors).all(axis=1, keepdims=True)
    result: np.ndarray = np.where(is_finite, vectors, [0.0, 0.0, 1.0])
    return result


def _gather(rows: Rows, numbers: np.ndarray) -> np.ndarray:
    """Return a copy of these rows, which are read block after block."""
    different, inverse = np.unique(numbers, return_inverse=True)
    values = [
        rows.rows(first, last)[different[low:high] - first]
        for first, last in blocks(rows.count)
        for low, high in [np.searchsorted(different, [first, last])]
        if low < high
    ]
    result: np.ndarray = np.concatenate(values)[inverse.reshape(-1)]
    return result
