"""The levels of one primitive, which the codec builds: groups of clusters, and what replaces each.

A cluster is a meshlet. A group is some neighbouring clusters that are simplified together. See
codec/lod/build_levels.h and spec/EXT_meshlet_lod.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext._library import Result, pointers
from gltf_ext.lod.simplifier import simplifier
from gltf_ext.lod.surface import Surface
from gltf_ext.lod.tables import PAGE
from gltf_ext.options import Options

# A level has at most SHRINK of the triangles of the finer one: kShrink of reduce_groups.h.
SHRINK = 0.75


@dataclass
class ClusterRanges:
    """Clusters as ranges of disks, disks as ranges of triangles.

    Attributes:
        triangles: uint32[T, 3]: the vertices of the triangles, cluster after cluster.
        disk_begin: int64[D + 1]: the first triangle of each disk, and T.
        cluster_begin: int64[N + 1]: the first disk of each cluster, and D.
    """

    triangles: np.ndarray
    disk_begin: np.ndarray
    cluster_begin: np.ndarray

    @property
    def count(self) -> int:
        """Number of clusters N."""
        return len(self.cluster_begin) - 1

    @property
    def triangle_begin(self) -> np.ndarray:
        """The first triangle of each cluster, and T: int64[N + 1]."""
        begin: np.ndarray = self.disk_begin[self.cluster_begin]
        return begin


@dataclass
class ClusterSet:
    """Clusters with their errors, spheres and finer groups. Lengths are in units of the grid.

    Attributes:
        ranges: the triangles of the C clusters.
        finer_group: int64[C]: the finer group that each cluster replaces a part of, -1 in level 0.
        error: float64[C]: the error of the finer group, 0 in level 0.
        spheres: float64[C, 4]: centre and radius of a sphere around each cluster and all finer
            clusters that it replaces.
    """

    ranges: ClusterRanges
    finer_group: np.ndarray
    error: np.ndarray
    spheres: np.ndarray


@dataclass
class Hierarchy:
    """All levels of a primitive: C clusters in G groups. Lengths are in units of the grid.

    Attributes:
        cluster_group: int64[C]: the group that each cluster belongs to.
        finer_group: int64[C]: the finer group that each cluster replaces a part of, -1 in
            level 0.
        group_level: int64[G]: the level that each group was formed in.
        group_error: float64[G]: the error of the group's replacement; infinite without one.
        group_centre, group_radius: float64[G, 3], float64[G]: a sphere around the group and all
            finer groups below it.
    """

    cluster_group: np.ndarray
    finer_group: np.ndarray
    group_level: np.ndarray
    group_error: np.ndarray
    group_centre: np.ndarray
    group_radius: np.ndarray

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """The arrays of clusters and of groups, in the order of the constructor's arguments."""
        spheres = self.group_centre, self.group_radius
        return self.cluster_group, self.finer_group, self.group_level, self.group_error, *spheres


@dataclass
class Pages:
    """Encoded pages.

    Attributes:
        groups: int64 for each page: the numbers of its groups.
        rows: PAGE[P]: their rows of the table, without firstGroup.
        data: their bytes, one after the other.
    """

    groups: list[np.ndarray] = field(default_factory=list)
    rows: np.ndarray = field(default_factory=partial(np.empty, 0, PAGE))
    data: bytes = b""


@dataclass
class ChunkLevels:
    """All levels of a chunk.

    Attributes:
        hierarchy: the clusters in groups.
        remainder: the clusters that wait for the next level.
        stuck_triangles: for each level, the number of triangles that could not be simplified and
            wait for the next level.
        triangles: for each level, the number of triangles of its groups.
        coarse, fine: the pages of coarse levels and of level 0. A whole primitive that cannot be
            simplified, or has too many groups, has no pages.
        statistics: of the pages of level 0, as _codec.encode returns them; empty without any.
    """

    hierarchy: Hierarchy
    remainder: ClusterSet
    stuck_triangles: list[int]
    triangles: list[int]
    coarse: Pages
    fine: Pages
    statistics: dict[str, Any]


@dataclass(frozen=True)
class LevelSettings:
    """How levels are built.

    Attributes:
        group_size: number of clusters in a group, about; fewer where they do not fit in a page.
        error_limit: groups with a larger error stay as they are; in units of the grid.
        reduction: triangles of a group over those of its replacement.
        page_limit: bytes that a page should not exceed.
        chunk: _codec.ALL_LEVELS, ONE_LEVEL or LAST_LEVEL.
        level: the level of the first groups.
        first_group: the number of the first group.
    """

    group_size: int
    error_limit: float
    reduction: float
    page_limit: int
    chunk: int = _codec.ALL_LEVELS
    level: int = 0
    first_group: int = 0


def build_levels(
    surface: Surface,
    streams: list[Stream],
    values: list[np.ndarray],
    source_position_ids: np.ndarray,
    settings: LevelSettings,
    options: Options,
    threads: int,
    clusters: ClusterSet | None = None,
    progress: Callable[[float], object] | None = None,
) -> ChunkLevels:
    """Build levels and encode them in pages.

    Args:
        surface: the primitive on its grid.
        streams: the stream table.
        values: uint32[V, elements] of each stream.
        source_position_ids: uint32[V], equal for equal positions before quantisation.
        settings: how levels are built.
        options: of `compress`: how clusters are generated.
        threads: number of threads, 0 for all processors.
        clusters: clusters of this level or finer, to which errors are measured; by default those of
            level 0.
        progress: called with a fraction after each level.

    Raises:
        MeshletError: without meshoptimizer.
    """
    choices = surface.choices
    inputs: dict[str, Any] = {}
    begins_of_clusters = None
    if clusters:
        ranges, finer_groups = clusters.ranges, clusters.finer_group.astype(np.int32)
        begins_of_clusters = ranges.disk_begin, ranges.cluster_begin
        inputs = {
            "finer_groups": finer_groups,
            "errors": clusters.error,
            "spheres": clusters.spheres,
        }
    if choices:
        inputs |= {"places": choices.place, "normals": _floats(choices.normals)}
        inputs |= {"others": _floats(choices.others), "other_count": choices.others.shape[1]}
    if surface.is_locked is not None:
        inputs["locked"] = surface.is_locked.view(np.uint8)
    shapes = [_floats(points) for points in surface.morph_points]
    result, describe = _codec.build_levels(
        surface.triangles,
        surface.position_ids,
        surface.points,
        streams,
        values,
        begins_of_clusters,
        simplifier(),
        settings.page_limit,
        **options.generation,
        threads=threads,
        progress=progress,
        shape_count=len(shapes),
        shapes=pointers(shapes),
        source_position_ids=np.ascontiguousarray(source_position_ids, np.uint32),
        canonical_vertices=np.ascontiguousarray(surface.canonical_vertices, np.uint32),
        seam_points=_floats(surface.seam_points),
        attributes=_floats(surface.attributes),
        weights=_floats(surface.weights),
        attribute_count=len(surface.weights),
        level=settings.level,
        first_group=settings.first_group,
        group_size=settings.group_size,
        chunk=settings.chunk,
        reduction=settings.reduction,
        error_limit=settings.error_limit,
        **inputs,
    )
    return _levels_of(result, describe)


def _floats(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)


def _levels_of(result: Result, describe: Callable[[bytes], dict[str, Any]]) -> ChunkLevels:
    """Return the arrays of gltf_meshlet_build_levels as objects."""
    cluster_group, levels = (result.array(number).astype(np.int64) for number in (0, 2))
    finer_group, waits_for = (result.array(n, np.int32).astype(np.int64) for n in (1, 8))
    errors, waiting_errors = (result.array(number, np.float64) for number in (3, 9))
    spheres, waiting_spheres = (result.array(n, np.float64).reshape(-1, 4) for n in (4, 10))
    disks, clusters = (result.array(number).astype(np.int64) for number in (6, 7))
    ranges = ClusterRanges(result.array(5).reshape(-1, 3), disks, clusters)
    stuck_triangles, triangles = (result.array(n, np.uint64).tolist() for n in (11, 12))
    coarse_table, fine_table = (result.array(number).reshape(-1, 4) for number in (13, 14))
    groups, data = result.array(15).astype(np.int64), result.array(16, np.uint8)
    group_count, size = int(coarse_table[:, 1].sum()), int(coarse_table[:, 0].sum(dtype=np.int64))
    coarse = _pages_of(coarse_table, groups[:group_count], data[:size].tobytes())
    fine = _pages_of(fine_table, groups[group_count:], data[size:].tobytes())
    return ChunkLevels(
        Hierarchy(cluster_group, finer_group, levels, errors, spheres[:, :3], spheres[:, 3]),
        ClusterSet(ranges, waits_for, waiting_errors, waiting_spheres),
        stuck_triangles,
        triangles,
        coarse,
        fine,
        describe(fine.data) if fine.data else {},
    )


def _pages_of(table: np.ndarray, groups: np.ndarray, data: bytes) -> Pages:
    """Return pages. table: uint32[P, 4]: their bytes, groups, triangles and vertices."""
    rows = np.zeros(len(table), PAGE)
    names = ("byteLength", "triangles", "vertices")
    for name, column in zip(names, table[:, [0, 2, 3]].T):
        rows[name] = column
    return Pages(np.split(groups, np.cumsum(table[:-1, 1])) if len(table) else [], rows, data)
