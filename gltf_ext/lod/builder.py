"""The levels of one primitive, which the codec builds: groups of clusters, and what replaces each.

A cluster is a meshlet. A group is some neighbouring clusters that are simplified together. See
codec/lod/build_levels.h and spec/EXT_meshlet_lod.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext._library import Result, pointers
from gltf_ext.lod.simplifier import simplifier
from gltf_ext.lod.surface import Surface
from gltf_ext.options import Options
from gltf_ext.ranges import begins, members

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

    def select(self, numbers: np.ndarray) -> ClusterRanges:
        """Return the clusters with these numbers, int64[K], in this order."""
        disks = members(self.cluster_begin, numbers)
        triangles = members(self.disk_begin, disks)
        return ClusterRanges(
            self.triangles[triangles],
            begins(np.diff(self.disk_begin)[disks]),
            begins(np.diff(self.cluster_begin)[numbers]),
        )


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
        ranges: the clusters of all levels, those of level 0 first.
        cluster_group: int64[C]: the group that each cluster belongs to.
        finer_group: int64[C]: the finer group that each cluster replaces a part of, -1 in
            level 0.
        group_level: int64[G]: the level that each group was formed in.
        group_error: float64[G]: the error of the group's replacement; infinite without one.
        group_centre, group_radius: float64[G, 3], float64[G]: a sphere around the group and all
            finer groups below it.
    """

    ranges: ClusterRanges
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
class BuiltLevels:
    """All levels of a chunk.

    Attributes:
        hierarchy: the clusters in groups.
        waiting: the clusters that wait for the next level.
        stuck_triangles: for each level, the number of triangles that could not be simplified and
            wait for the next level.
    """

    hierarchy: Hierarchy
    waiting: ClusterSet
    stuck_triangles: list[int]


@dataclass(frozen=True)
class LevelSettings:
    """How levels are built.

    Attributes:
        group_size: number of clusters in a group, about; fewer where they do not fit in a page.
        error_limit: groups with a larger error stay as they are; in units of the grid.
        reduction: triangles of a group over those of its replacement.
        page_limit: bytes that a page should not exceed; 0 for groups of any size.
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
    settings: LevelSettings,
    options: Options,
    threads: int,
    clusters: ClusterSet | None = None,
    progress: Callable[[float], object] | None = None,
) -> BuiltLevels:
    """Build levels.

    Args:
        surface: the primitive on its grid.
        streams: the stream table.
        values: uint32[V, elements] of each stream.
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
    given: dict[str, Any] = {}
    begins_of_clusters = None
    if clusters:
        ranges, finer_groups = clusters.ranges, clusters.finer_group.astype(np.int32)
        begins_of_clusters = ranges.disk_begin, ranges.cluster_begin
        given = {
            "finer_groups": finer_groups,
            "errors": clusters.error,
            "spheres": clusters.spheres,
        }
    if choices:
        given |= {"places": choices.place, "normals": _floats(choices.normals)}
        given |= {"others": _floats(choices.others), "other_count": choices.others.shape[1]}
    if surface.is_locked is not None:
        given["locked"] = surface.is_locked.view(np.uint8)
    shapes = [_floats(points) for points in surface.morph_points]
    result = _codec.build_levels(
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
        **given,
    )
    return _levels_of(result)


def _floats(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)


def _levels_of(result: Result) -> BuiltLevels:
    """Return the arrays of gltf_meshlet_build_levels as objects."""

    def ranges(first: int) -> ClusterRanges:
        triangles = result.array(first).reshape(-1, 3)
        disks, clusters = (result.array(first + k).astype(np.int64) for k in (1, 2))
        return ClusterRanges(triangles, disks, clusters)

    cluster_group, levels = (result.array(number).astype(np.int64) for number in (3, 5))
    finer_group, waits_for = (result.array(n, np.int32).astype(np.int64) for n in (4, 11))
    errors, waiting_errors = (result.array(number, np.float64) for number in (6, 12))
    spheres, waiting_spheres = (result.array(n, np.float64).reshape(-1, 4) for n in (7, 13))
    of_groups = levels, errors, spheres[:, :3], spheres[:, 3]
    return BuiltLevels(
        Hierarchy(ranges(0), cluster_group, finer_group, *of_groups),
        ClusterSet(ranges(8), waits_for, waiting_errors, waiting_spheres),
        result.array(14, np.uint64).tolist(),
    )
