"""The details of a primitive: how long its edges are, how much it curves, what a grid collapses."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gltf_ext.attributes.records import RecordFormat, weld_rows
from gltf_ext.attributes.streams import Grid, grid_cells
from gltf_ext.ranges import first_of_each, occurring
from gltf_ext.sources.row_arrays import Rows
from gltf_ext.sources.source import Source, blocks

# Triangles that stand for all of a primitive, and the places where they are read in files.
SAMPLE, PLACES = 1 << 15, 32
NEAR_ROWS = 1 << 18  # that vertices of a sample in files may span to be read together


COLLAPSED_PERCENT = 0.1  # of an area: from there on a warning
BY_GRID = "the grid makes vertices equal: use more position bits"


@dataclass
class Collapse:
    """Triangles without area on a grid.

    Attributes:
        count: of those that had one; triangles: of all.
        area, total_area: theirs before, and that of all triangles.
    """

    count: float = 0
    triangles: float = 0
    area: float = 0.0
    total_area: float = 0.0

    @property
    def share(self) -> float:
        """Share of the area that is lost."""
        return self.area / self.total_area if self.total_area else 0.0

    @property
    def triangles_text(self) -> str:
        """The count, for people."""
        count = round(self.count)
        return f"{count:,} triangle{'' if count == 1 else 's'}"

    def add(self, other: Collapse, factor: float = 1.0) -> None:
        """Add other triangles, each `factor` times."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + factor * value)


@dataclass
class Sample:
    """Some triangles of a primitive.

    Attributes:
        positions: float64[T, 3, 3] of the corners.
        normals: float64[T, 3, 3]; None without.
        factor: triangles that each one stands for.
    """

    positions: np.ndarray
    normals: np.ndarray | None
    factor: float
    _collapses: dict[Grid, Collapse] = field(default_factory=dict)

    @cached_property
    def areas(self) -> np.ndarray:
        """The areas of the triangles: float64[T]."""
        return areas_of(self.positions)

    def collapse(self, grid: Grid) -> Collapse:
        """Count triangles of the sample that a grid collapses, once for each grid."""
        if grid not in self._collapses:
            self._collapses[grid] = collapse_of(self.positions, self.areas, grid)
        return self._collapses[grid]

    def edges(self) -> np.ndarray:
        """Return the lengths of the edges: float64[3 T]."""
        with np.errstate(all="ignore"):  # degenerate triangles may have any positions
            sides = self.positions - self.positions[:, NEXT]
            lengths: np.ndarray = np.sqrt(_dots(sides, sides)).reshape(-1)
        return lengths

    def gentle_share(self, degrees: float) -> float:
        """Return the share of what is curved whose normals turn by less than so many degrees.

        Of the area; a triangle's normals turn by the largest angle between two. 0 if all is flat.
        """
        cosines = self._cosines().min(axis=1)
        is_curved = cosines < math.cos(math.radians(FLAT))
        is_gentle = is_curved & (cosines > math.cos(math.radians(degrees)))
        curved_area = self.areas[is_curved].sum()
        return float(self.areas[is_gentle].sum() / curved_area) if curved_area > 0.0 else 0.0

    def turn(self) -> float:
        """Return the radians that normals turn on a unit of length, times the area: of all."""
        lengths = self.edges().reshape(-1, 3).sum(axis=1)
        with np.errstate(all="ignore"):
            angles = np.arccos(np.clip(self._cosines(), -1.0, 1.0)).sum(axis=1)
            turns = np.nan_to_num(angles / lengths * self.areas, nan=0.0, posinf=0.0)
        return self.factor * float(turns.sum())

    def _cosines(self) -> np.ndarray:
        """Return float64[T, 3]: of the angles between the normals at the ends of each edge."""
        assert self.normals is not None
        with np.errstate(all="ignore"):
            lengths = np.sqrt(_dots(self.normals, self.normals))
            scales = np.maximum(lengths * lengths[:, NEXT], np.finfo(np.float64).tiny)
            cosines: np.ndarray = _dots(self.normals, self.normals[:, NEXT]) / scales
        return cosines


NEXT = [1, 2, 0]  # corner after each corner
FLAT = 0.05  # degrees: between normals of a flat triangle


def sample_of(source: Source) -> Sample:
    """Return triangles from all over a primitive with float positions.

    Raises MeshletError, OSError.
    """
    names: list[str] = [name for name in ("POSITION", "NORMAL") if name in source.attributes]
    if source.is_in_memory:
        values = {name: _memory_corners(source, name) for name in names}
    else:
        values = _file_corners(source, names)
    values = {name: of_corners.astype(np.float64) for name, of_corners in values.items()}
    count = len(values["POSITION"])
    factor = source.triangle_count / max(count, 1)
    return Sample(values["POSITION"], values.get("NORMAL"), factor)


def _memory_corners(source: Source, name: str) -> np.ndarray:
    """Return the values of an attribute at corners of triangles, [T, 3, components]."""
    names, numbers = source.numbering_of(name)
    corners = source.corners(names, numbers, 0, source.triangle_count)
    corners = corners[:: -(-len(corners) // SAMPLE) or 1].astype(np.intp)
    rows = source.attributes[name]
    values: np.ndarray = rows.rows(0, rows.count)[corners]
    return values


def _file_corners(source: Source, names: list[str]) -> dict[str, np.ndarray]:
    """Return the same of several attributes of a source in files, from some places of it."""
    total, each = source.triangle_count, SAMPLE // PLACES
    firsts = np.arange(0, total, each)
    if total > SAMPLE:
        firsts = np.linspace(0, total - each, PLACES).astype(np.int64)
    parts = [
        _file_place(source, names, int(first), min(int(first) + each, total)) for first in firsts
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _file_place(source: Source, names: list[str], first: int, last: int) -> dict[str, np.ndarray]:
    """Return the values at corners of triangles; of the first ones if any of their rows are far.

    All attributes are of the same triangles, though each may have its own rows.
    """
    corners = {
        name: source.corners(*source.numbering_of(name), first, last).astype(np.int64)
        for name in names
    }
    if any(_are_far(rows) for rows in corners.values()):
        corners = {name: rows[:PLACES] for name, rows in corners.items()}
    return {name: _read_rows(source.attributes[name], rows) for name, rows in corners.items()}


def _are_far(corners: np.ndarray) -> bool:
    return int(corners.max()) - int(corners.min()) >= NEAR_ROWS


def _read_rows(rows: Rows, corners: np.ndarray) -> np.ndarray:
    """Return some rows of an attribute: read together, or one by one if they are far."""
    if not _are_far(corners):
        low = int(corners.min())
        near: np.ndarray = rows.rows(low, int(corners.max()) + 1)[corners - low]
        return near
    different, inverse = np.unique(corners, return_inverse=True)
    values = np.concatenate([rows.rows(int(row), int(row) + 1) for row in different])
    far: np.ndarray = values[inverse.reshape(corners.shape)]
    return far


def _dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return float64[T, 3]: dot products of vectors at corners, [T, 3, 3]."""
    products: np.ndarray = np.einsum("tkc,tkc->tk", a, b)
    return products


def areas_of(positions: np.ndarray) -> np.ndarray:
    """Return the areas of triangles, float64[T, 3, 3]: float64[T].

    0 for positions that are not finite, which degenerate triangles may have.
    """
    with np.errstate(all="ignore"):
        (a, b, c), (d, e, f) = (positions[:, 1:] - positions[:, :1]).transpose(1, 2, 0)
        # np.cross and np.linalg.norm take twice as long for small meshes.
        x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
        areas = np.sqrt(x * x + y * y + z * z) / 2
    finite: np.ndarray = np.nan_to_num(areas, nan=0.0, posinf=0.0)
    return finite


# --- what a grid does ---


def collapse_of(positions: np.ndarray, areas: np.ndarray, grid: Grid) -> Collapse:
    """Count triangles, float64[T, 3, 3], that lie on a line or a point of the grid."""
    cells = grid_cells(positions.reshape(-1, 3), grid.offset, grid.step).reshape(positions.shape)
    (a, b, c), (d, e, f) = (cells[:, 1:] - cells[:, :1]).transpose(1, 2, 0)
    is_flat = (b * f == c * e) & (c * d == a * f) & (a * e == b * d) & (areas > 0.0)
    return Collapse(
        int(np.count_nonzero(is_flat)), len(areas), float(areas[is_flat].sum()), float(areas.sum())
    )


def collapse_of_source(source: Source, grid: Grid, sample: Sample) -> Collapse:
    """Count those of a primitive; of one in files, and the total area, by its sample.

    Raises MeshletError, OSError.
    """
    result = Collapse()
    if not source.is_in_memory or sample.factor == 1.0:
        result.add(sample.collapse(grid), sample.factor)
        return result
    names, numbers = source.numbering_of("POSITION")
    rows = source.attributes["POSITION"]
    positions = rows.rows(0, rows.count)
    cells = grid_cells(positions, grid.offset, grid.step)
    result.triangles = source.triangle_count
    result.total_area = sample.factor * float(sample.areas.sum())
    for part in blocks(source.triangle_count):
        corners = source.corners(names, numbers, *part).astype(np.intp)
        suspects = positions[corners[_may_be_flat(cells, corners)]].astype(np.float64)
        flat = collapse_of(suspects, areas_of(suspects), grid)
        result.count += flat.count
        result.area += flat.area
    return result


def _may_be_flat(cells: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return whether triangles, [T, 3], have no area seen along x, on the grid: bool[T]."""
    (ay, by, cy), (az, bz, cz) = (cells[:, axis][corners].T for axis in (1, 2))
    result: np.ndarray = (by - ay) * (cz - az) == (bz - az) * (cy - ay)
    return result


def joins_vertices(source: Source, record_format: RecordFormat) -> bool:
    """Return whether different vertices of a source in memory are equal on the grids.

    Compares only vertices whose positions share a point of the grid.
    """
    ((names, numbers),) = source.numberings
    corners = source.corners(names, numbers, 0, source.triangle_count)
    rows = occurring(corners, source.vertex_count)
    positions = source.attributes["POSITION"].rows(0, source.vertex_count)[rows]
    stream = record_format.plan.streams[0]
    cells, cell_count = weld_rows(grid_cells(positions, stream.offset, stream.step))
    places, place_count = weld_rows(positions + np.float32(0))  # -0 is 0
    if cell_count == place_count:
        return False
    first_place = places[first_of_each(cells, cell_count)]
    is_shared = np.zeros(cell_count, bool)
    is_shared[cells[places != first_place[cells]]] = True
    suspects = rows[is_shared[cells]]
    records = record_format.quantise(source.chosen_vertices(names, suspects))
    return weld_rows(records)[1] != weld_rows(record_format.without_hash(records))[1]
