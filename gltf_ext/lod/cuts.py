"""Cuts: which clusters are drawn, for a camera, an error or a level.

The rule: spec/EXT_meshlet_lod.md, section "Cuts".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gltf_ext.lod.tables import GROUP, RUN_BYTES, Tables

# What web/stream reads, see there: bytes of the first request, bytes of the pages of the first
# picture, and groups of a part of the tables, at least.
HEAD_BYTES, FIRST_BYTES, MIN_PART_GROUPS = 32768, 96 * 1024, 128
NEAR = 1e-6  # least distance to a sphere, as a fraction of the largest radius in root pages


@dataclass(frozen=True)
class View:
    """A camera, in the coordinates of the primitive's POSITION, or in the world.

    Attributes:
        eye: its position; None for an orthographic one.
        pixels_per_unit: height of the picture in pixels, over that of the view at distance one
            (perspective) or of the view (orthographic).
    """

    eye: tuple[float, float, float] | None
    pixels_per_unit: float

    @classmethod
    def perspective(
        cls, eye: tuple[float, float, float], vertical_degrees: float, height: int
    ) -> View:
        """vertical_degrees: the whole angle of view; height: of the picture in pixels."""
        return cls(eye, height / (2.0 * math.tan(math.radians(vertical_degrees) / 2.0)))

    def pixels(self, tables: Tables, matrix: np.ndarray | None = None) -> np.ndarray:
        """Return the error of each group on the screen, at the nearest point of its sphere.

        Args:
            tables: the hierarchy.
            matrix: float64[4, 4], from POSITION to the camera's coordinates; by default the
                identity. Spheres and errors are multiplied by its largest scale.

        Returns:
            float64[G], in pixels.
        """
        groups = tables.groups
        error, radius = groups["error"].astype(np.float64), groups["radius"].astype(np.float64)
        centre = groups["centre"].astype(np.float64)
        if matrix is not None:
            scale = np.linalg.norm(matrix[:3, :3], 2)
            error, radius = error * scale, radius * scale
            centre = centre @ matrix[:3, :3].T + matrix[:3, 3]
        if self.eye is None:
            return error * self.pixels_per_unit
        distance = np.linalg.norm(centre - np.asarray(self.eye, np.float64), axis=1)
        # One for all groups: errors on the screen then grow from fine to coarse.
        near = NEAR * radius[groups["page"] < tables.root_pages].max()
        nearest = np.maximum(distance - radius, near)
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = error * self.pixels_per_unit / nearest
        return np.where(error > 0.0, np.where(nearest > 0.0, pixels, np.inf), 0.0)


@dataclass(frozen=True)
class Cut:
    """Clusters to draw.

    Attributes:
        active: bool[G]: groups of which clusters may be drawn.
        drawn: bool[C]: clusters to draw, numbered through all pages.
        pages: int64: the pages that the drawn clusters are in, in order.
        loaded: int64: the pages that a reader holds for this cut: those of all active groups.
    """

    active: np.ndarray
    drawn: np.ndarray
    pages: np.ndarray
    loaded: np.ndarray


def active_groups(tables: Tables, is_needed: np.ndarray) -> np.ndarray:
    """Return bool[G]: the needed groups whose coarser groups are all active.

    is_needed: bool[G]; must not hold groups whose page is not resident.
    """
    active: np.ndarray = is_needed.copy()
    begin, finer = tables.run_begin, tables.run_group
    # Coarse to fine; groups of level 0, the most, have no runs.
    for g in range(int(tables.pages["firstGroup"][tables.coarse_pages])):
        if not active[g]:
            active[finer[begin[g] : begin[g + 1]]] = False
    return active


def cut_of(tables: Tables, is_needed: np.ndarray) -> Cut:
    """Return the cut for a set of groups.

    A cluster is drawn if its group is active and the finer group that it replaces is not.
    """
    active = active_groups(tables, is_needed)
    finer_group = tables.finer_group
    drawn = active[tables.cluster_group] & ~(active[finer_group] & (finer_group >= 0))
    pages = tables.groups["page"].astype(np.int64)
    return Cut(
        active, drawn, np.unique(pages[tables.cluster_group[drawn]]), np.unique(pages[active])
    )


def cut_for_view(
    tables: Tables,
    view: View,
    max_pixels: float,
    resident: np.ndarray | None = None,
    matrix: np.ndarray | None = None,
) -> Cut:
    """Return the coarsest cut whose error is at most max_pixels on the screen.

    Args:
        tables: the hierarchy.
        view: the camera.
        max_pixels: the largest error.
        resident: bool[P]: pages in memory; coarser clusters replace those of other pages. By
            default all.
        matrix: float64[4, 4], from POSITION to the camera's coordinates; by default the identity.
    """
    is_needed = view.pixels(tables, matrix) > max_pixels
    if resident is not None:
        is_needed &= resident[tables.groups["page"]]
    return cut_of(tables, is_needed)


def cut_at_error(tables: Tables, error: float) -> Cut:
    """Return the coarsest cut with at most this error.

    Args:
        tables: the hierarchy.
        error: in units of POSITION.
    """
    return cut_of(tables, tables.groups["error"].astype(np.float64) > error)


def cut_at_level(tables: Tables, level: int) -> Cut:
    """Return the cut of a whole level.

    Args:
        tables: the hierarchy.
        level: 0 is the finest; the coarsest level stands for larger numbers.
    """
    is_top = np.isinf(tables.groups["error"])
    return cut_of(tables, is_top | (tables.group_level >= level))


def held_bytes(tables: Tables, cut: Cut) -> int:
    """Return the bytes that a stream holds for a cut: its pages, and the tables that it reads."""
    return table_bytes(tables, known_groups(tables, cut)) + bytes_of_pages(tables, cut)


def bytes_of_pages(tables: Tables, cut: Cut) -> int:
    """Return bytes of the loaded pages of a cut."""
    return int(tables.pages["byteLength"][cut.loaded].sum())


def table_bytes(tables: Tables, group_count: int) -> int:
    """Return bytes of the page table, of so many groups and of their runs."""
    runs = int(tables.run_begin[group_count])
    return tables.pages.nbytes + GROUP.itemsize * group_count + RUN_BYTES * runs


def known_groups(tables: Tables, cut: Cut) -> int:
    """Group that a stream (web/stream) knows for a cut, of a file that begins with the tables.

    It knows all if they lie within its first request. Else it reads parts: up to those of the root
    pages and of the first picture, then as far as runs of active groups point.
    """
    count = len(tables.groups)
    if table_bytes(tables, count) <= HEAD_BYTES:
        return count
    ends = np.append(tables.pages["firstGroup"][1:], count).astype(np.int64)
    coarse = np.cumsum(tables.pages["byteLength"][: tables.coarse_pages], dtype=np.int64)
    first_pages = max(int(np.searchsorted(coarse, FIRST_BYTES, side="right")), tables.root_pages)
    group_count, last_needed = 0, int(ends[first_pages - 1]) - 1
    while last_needed >= group_count:
        next_count = min(max(last_needed + 1, group_count + MIN_PART_GROUPS), count)
        group_count = int(ends[np.searchsorted(ends, next_count)])
        runs = slice(0, int(tables.run_begin[group_count]))
        finer_groups = tables.run_group[runs][cut.active[tables.run_owner[runs]]]
        last_needed = int(finer_groups.max(initial=0))
    return group_count


def error_of(tables: Tables, cut: Cut) -> float:
    """Return the largest error of the groups that are replaced in a cut."""
    errors = tables.groups["error"][~cut.active]
    return float(errors.max(initial=0.0))
