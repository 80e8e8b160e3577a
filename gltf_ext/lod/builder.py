"""Builds the levels of one primitive: groups of clusters, and what replaces each group.

A cluster is a meshlet. A group is some neighbouring clusters that are simplified together, with the
vertices that it shares with other groups locked. The result is cut into clusters again, and the
next level groups those across the old borders. See spec/EXT_meshlet_lod.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext.lod import simplifier
from gltf_ext.lod.corners import choose_vertices
from gltf_ext.lod.errors import ErrorMeter
from gltf_ext.lod.pilot import SMALLEST_GROUP, Pilot, shrink_group_size
from gltf_ext.lod.reduction import SHRINK, reduce_groups
from gltf_ext.lod.surface import Surface, longest_side
from gltf_ext.lod.tables import MAX_CLUSTERS
from gltf_ext.options import Options
from gltf_ext.ranges import begins, begins_of, members

# Triangles of a level over those of the next: shares of the reduction that the caller asks for. The
# first step has the most triangles, and decides the size of the file; the smaller the others, the
# closer is a level to any error. With steps of 4.2, 3.4, 2.9 instead of 5, 2.5, 2.25 dragon draws
# 1.25 times the triangles and igea 1.1 times, in files of about the same size.
STEPS = (1.0, 0.5, 0.45)
# The error that level 1 should have at most, in longest sides of the primitive. Without a limit,
# level 1 of DamagedHelmet has 6,989 triangles of 15,452 at 0.07 of its side, with it 4,896 at half
# of that: groups that cannot take the whole step spoil it. 0.01 makes files of engine and
# sponza_like larger than 1.7 times level 0.
FIRST_ERROR = 0.03
LAST_LEVEL_TRIANGLES = 128  # triangles of the last level, at most
LARGEST_GROUP = 11 / 8  # of the aimed size

Groups = list[np.ndarray]  # int64 each: positions of a group's clusters in Builder.frontier


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

    def concat(self, other: ClusterRanges) -> ClusterRanges:
        """Return these clusters, followed by others."""
        return ClusterRanges(
            np.concatenate([self.triangles, other.triangles]),
            np.concatenate([self.disk_begin, self.disk_begin[-1] + other.disk_begin[1:]]),
            np.concatenate([self.cluster_begin, self.cluster_begin[-1] + other.cluster_begin[1:]]),
        )


@dataclass
class ClusterSet:
    """Clusters with their errors, spheres and finer groups. Lengths are in units of the grid.

    Attributes:
        ranges: the triangles of the C clusters.
        finer_group: int64[C]: the finer group that each cluster replaces a part of, -1 in level 0.
        error: float64[C]: the error of the finer group, 0 in level 0.
        base_error: float64[C]: the largest distance to level 0 of the surface that errors are
            measured to.
        centre, radius: float64[C, 3], float64[C]: a sphere around each cluster and all finer
            clusters that it replaces.
    """

    ranges: ClusterRanges
    finer_group: np.ndarray
    error: np.ndarray
    base_error: np.ndarray
    centre: np.ndarray
    radius: np.ndarray

    def select(self, numbers: np.ndarray) -> ClusterSet:
        """Return the clusters with these numbers, int64[K], in this order."""
        return ClusterSet(
            self.ranges.select(numbers), *(values[numbers] for values in self._values)
        )

    def concat(self, other: ClusterSet) -> ClusterSet:
        """Return these clusters, followed by others."""
        values = map(np.concatenate, zip(self._values, other._values))
        return ClusterSet(self.ranges.concat(other.ranges), *values)

    @property
    def _values(self) -> tuple[np.ndarray, ...]:
        return self.finer_group, self.error, self.base_error, self.centre, self.radius


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


class Builder:
    """Builds a hierarchy level after level.

    Attributes:
        clusters: the C clusters of all levels so far.
        cluster_group: int64[C]: the group of each cluster, -1 for none.
        frontier: int64[F]: the clusters without a group.
        groups: level, error, centre and radius of the sphere of each group.
        stuck_triangles: for each level, the number of triangles that could not be simplified and
            wait for the next level.
    """

    def __init__(
        self,
        surface: Surface,
        options: Options,
        group_size: int,
        error_limit: float,
        reduction: float,
        threads: int,
        clusters: ClusterSet | None = None,
        level: int = 0,
        first_group: int = 0,
        pilot: Pilot | None = None,
    ) -> None:
        """Begin with some clusters.

        Args:
            surface: the primitive on its grid.
            options: of `compress`: how clusters are generated.
            group_size: number of clusters in a group, about.
            error_limit: groups with a larger error stay as they are; in units of the grid.
            reduction: triangles of a group over those of its replacement.
            threads: number of threads, 0 for all processors.
            clusters: clusters of this level or finer, to which errors are measured; by default
                those of level 0.
            level: the level of the first groups.
            first_group: the number of the first group.
            pilot: estimates the sizes of groups in pages; None for groups of any size.
        """
        self.surface = surface
        self.generation = {**options.generation, "threads": threads}
        self.reduction, self.group_size, self.pilot = reduction, group_size, pilot
        self.error_limit, self.threads = error_limit, threads
        self.clusters = clusters or self._level_0()
        self.meter: ErrorMeter | None = None  # from the first level on
        self.cluster_group = np.full(self.clusters.ranges.count, -1)
        self.frontier = np.arange(self.clusters.ranges.count)
        self.level, self.first_group = level, first_group
        self.level_error = (  # of the level before
            math.inf if clusters else FIRST_ERROR * longest_side(surface.points) / reduction
        )
        self.groups: list[tuple[int, float, np.ndarray, float]] = []
        self.stuck_triangles: list[int] = []

    def result(self) -> Hierarchy:
        """Return the groups so far and their clusters, without the frontier."""
        levels, errors, centres, radii = zip(*self.groups)
        ranges, group = self.clusters.ranges, self.cluster_group
        finer_group = self.clusters.finer_group
        if len(self.frontier):
            in_group = np.flatnonzero(group >= 0)
            ranges = ranges.select(in_group)
            group, finer_group = group[in_group], finer_group[in_group]
        return Hierarchy(
            ranges,
            group,
            finer_group,
            np.array(levels),
            np.array(errors),
            np.array(centres),
            np.array(radii),
        )

    def add_level(self, may_end: bool = True) -> int:
        """Group the clusters of the frontier and simplify the groups.

        Args:
            may_end: whether this may be the last level; otherwise clusters that cannot be
                simplified stay in the frontier.

        Returns:
            The number of triangles of the next level, 0 if this level is the last.
        """
        pending = self.clusters.ranges.select(self.frontier)
        groups = self._group_frontier(pending)
        level = self.level
        self.level += 1
        triangle_ids, old_begin = self._group_triangles(groups)
        if (np.diff(old_begin) == 0).any():
            groups = _join_empty(groups, np.diff(old_begin))
            triangle_ids, old_begin = self._group_triangles(groups)
        is_small = len(pending.triangles) <= LAST_LEVEL_TRIANGLES or pending.count == 1
        if (may_end and is_small) or not len(triangle_ids):
            self._end(groups, level)
            return 0
        old_triangles = self.surface.canonical_vertices[
            self.clusters.ranges.triangles[triangle_ids]
        ]
        if self.meter is None:
            shapes = [self.surface.points, *self.surface.morph_points]
            self.meter = ErrorMeter(shapes, old_triangles, old_begin, triangle_ids, self.threads)
        meter = self.meter
        meter.begin_level(old_triangles, old_begin, triangle_ids)
        step = self.reduction * STEPS[min(level, len(STEPS) - 1)]
        old_pieces = np.split(old_triangles, old_begin[1:-1])
        new_pieces, error, self.level_error = reduce_groups(
            self.surface, old_pieces, step, meter, step * self.level_error, self.threads
        )
        below = self._group_maxima(self.clusters.error, groups)
        error = np.maximum(error + self._group_maxima(self.clusters.base_error, groups), below)
        is_stuck = ~(np.isfinite(error) & (error <= self.error_limit))
        next_pieces = [
            old if stuck else new for old, new, stuck in zip(old_pieces, new_pieces, is_stuck)
        ]
        if may_end and sum(map(len, next_pieces)) > SHRINK * len(old_triangles):
            self._end(groups, level)
            return 0
        self.stuck_triangles.append(int(np.diff(old_begin)[is_stuck].sum()))
        if level == 0:  # clusters of level 0 cannot wait: others would share their pages
            if is_stuck.any():
                meter.measure(next_pieces, np.flatnonzero(is_stuck))
            error[is_stuck] = 0.0
            is_stuck[:] = False
        if is_stuck.all():
            return len(old_triangles)
        simplified_groups = np.flatnonzero(~is_stuck)
        stated_error = error[simplified_groups]
        pieces = self._choose_vertices([next_pieces[g] for g in simplified_groups], stated_error)
        new_triangle_ids = self._replace(
            [groups[g] for g in simplified_groups], level, pieces, stated_error
        )
        first_new_triangle = np.zeros(len(groups), np.int64)
        first_new_triangle[simplified_groups] = begins_of(pieces)[:-1]
        meter.replace(~is_stuck, first_new_triangle, new_triangle_ids)
        return int(np.diff(self.clusters.ranges.triangle_begin)[self.frontier].sum())

    def end(self) -> None:
        """Make a last level of the frontier's clusters."""
        self._end(self._group_frontier(self.clusters.ranges.select(self.frontier)), self.level)

    def _end(self, groups: Groups, level: int) -> None:
        for group in groups:
            self._add_group(group, level, np.inf)
        self.stuck_triangles.append(0)
        self.frontier = self.frontier[:0]

    # --- clusters ---

    def _level_0(self) -> ClusterSet:
        group_begin = np.array([0, len(self.surface.triangles)], np.uint32)
        clusters, _, _ = self._make_clusters(self.surface.triangles, group_begin)
        zeros = np.zeros(clusters.count)
        finer_group = np.full(clusters.count, -1)
        return ClusterSet(clusters, finer_group, zeros, zeros, *self._cluster_spheres(clusters))

    def _make_clusters(
        self, triangles: np.ndarray, begin: np.ndarray
    ) -> tuple[ClusterRanges, np.ndarray, np.ndarray]:
        """Split groups of triangles into clusters.

        Args:
            triangles: uint32[T, 3], group after group.
            begin: [G + 1]: the first triangle of each group, and T.

        Returns:
            The N clusters; int64[G + 1]: the first cluster of each group, and N; uint32[T]: the
            numbers of the triangles in the order of the clusters.
        """
        order, disk_begin, cluster_begin, group_begin = _codec.generate_in_groups(
            triangles,
            begin.astype(np.uint32),
            self.surface.position_ids,
            self.surface.points,
            **self.generation,
        )
        return (
            ClusterRanges(
                triangles[order], disk_begin.astype(np.int64), cluster_begin.astype(np.int64)
            ),
            group_begin.astype(np.int64),
            order,
        )

    def _cluster_spheres(self, clusters: ClusterRanges) -> tuple[np.ndarray, np.ndarray]:
        """Return spheres around clusters in all morph targets: float64[N, 3] and float64[N]."""
        corners = clusters.triangles.reshape(-1)
        first = 3 * clusters.triangle_begin[:-1]
        low = np.full((clusters.count, 3), np.inf)
        high = -low
        for points in [self.surface.points, *self.surface.morph_points]:
            at_corners = points[corners]
            low = np.minimum(low, np.minimum.reduceat(at_corners, first))
            high = np.maximum(high, np.maximum.reduceat(at_corners, first))
        centre = (low + high) / 2
        return centre, np.linalg.norm(high - centre, axis=1)

    # --- grouping ---

    def _group_frontier(self, pending: ClusterRanges) -> Groups:
        """Group the frontier's clusters so that each group fits in a page."""
        size = self.group_size
        while True:
            groups = self._partition(pending, size)
            if self.pilot is None or size <= SMALLEST_GROUP:
                return groups
            fraction = max(self._page_fraction(self.pilot, pending, group) for group in groups)
            if fraction <= 1.0:
                return groups
            size = shrink_group_size(size, 1.0 / fraction)

    def _page_fraction(self, pilot: Pilot, pending: ClusterRanges, group: np.ndarray) -> float:
        selection, finer_group = (
            pending.select(group),
            self.clusters.finer_group[self.frontier[group]],
        )
        ranges = selection.triangles, selection.disk_begin, selection.cluster_begin
        return pilot.page_fraction(*ranges, finer_group)

    def _partition(self, pending: ClusterRanges, size: int) -> Groups:
        """Group the clusters, about `size` in a group, along a Hilbert curve.

        The partitioner joins only clusters that share vertices. Groups that are too small are
        therefore joined along the curve.
        """
        largest_size = min(size * LARGEST_GROUP, MAX_CLUSTERS)
        if pending.count <= largest_size:
            return [np.arange(pending.count)]
        corners = self.surface.position_ids[pending.triangles.reshape(-1)]
        counts = 3 * np.diff(pending.triangle_begin)
        group = simplifier.partition(
            corners, counts.astype(np.uint32), len(self.surface.vertex_of_position), size
        )
        order = np.argsort(group, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
        middles = np.array([self.clusters.centre[self.frontier[g]].mean(axis=0) for g in groups])
        on_curve = [groups[i] for i in _codec.hilbert_order(middles.astype(np.float32))]
        return _join_small(on_curve, size / 2, largest_size)

    def _group_triangles(self, groups: Groups) -> tuple[np.ndarray, np.ndarray]:
        """Return the triangles of groups, without degenerate ones.

        Returns:
            int64[T]: numbers of triangles, group after group; int64[G + 1]: the first of each
            group, and T.
        """
        clusters = self.frontier[np.concatenate(groups)]
        triangle_ids = members(self.clusters.ranges.triangle_begin, clusters)
        sizes = np.diff(self.clusters.ranges.triangle_begin)[clusters]
        owner = np.repeat(np.repeat(np.arange(len(groups)), [len(g) for g in groups]), sizes)
        has_area = ~self.surface.is_degenerate(self.clusters.ranges.triangles[triangle_ids])
        return triangle_ids[has_area], begins(np.bincount(owner[has_area], minlength=len(groups)))

    # --- the next level ---

    def _replace(
        self, groups: Groups, level: int, pieces: list[np.ndarray], error: np.ndarray
    ) -> np.ndarray:
        """Add groups, and the clusters that replace them.

        Args:
            groups: the groups that were simplified.
            level: the level of the groups.
            pieces: uint32[T, 3] each: the triangles of each group's replacement.
            error: float64[G]: the error of each replacement.

        Returns:
            int64: the numbers in `clusters` of the new triangles, piece after piece.
        """
        indices = np.array([self._add_group(g, level, e) for g, e in zip(groups, error)])
        ranges, group_begin, order = self._make_clusters(np.concatenate(pieces), begins_of(pieces))
        triangle_ids = np.empty(len(order), np.int64)
        triangle_ids[order] = len(self.clusters.ranges.triangles) + np.arange(len(order))
        base_error = self._group_maxima(self.clusters.base_error, groups)
        _, errors, centres, radii = (np.array(v) for v in zip(*self.groups[-len(groups) :]))
        values = (self.first_group + indices, errors, base_error, centres, radii)
        counts = np.diff(group_begin)
        first = self.clusters.ranges.count
        self.clusters = self.clusters.concat(
            ClusterSet(ranges, *(np.repeat(v, counts, axis=0) for v in values))
        )
        ungrouped = self.frontier[self.cluster_group[self.frontier] < 0]
        self.frontier = np.concatenate([ungrouped, np.arange(first, first + ranges.count)])
        self.cluster_group = np.concatenate([self.cluster_group, np.full(ranges.count, -1)])
        return triangle_ids

    def _choose_vertices(self, pieces: list[np.ndarray], error: np.ndarray) -> list[np.ndarray]:
        """Return replacements whose corners have the vertices that fit them best."""
        if self.surface.choices is None:
            return pieces
        assert self.meter is not None
        triangles, errors = np.concatenate(pieces), np.repeat(error, [len(p) for p in pieces])
        choices, points = self.surface.choices, self.surface.points
        triangles = choose_vertices(choices, points, triangles, errors, self.meter.nearest)
        return np.split(triangles, begins_of(pieces)[1:-1])

    def _group_maxima(self, values: np.ndarray, groups: Groups) -> np.ndarray:
        """Return the largest of the clusters' values, [C], in each group: [G]."""
        frontier_values = values[self.frontier]
        return np.array([frontier_values[group].max() for group in groups])

    def _add_group(self, group: np.ndarray, level: int, error: float) -> int:
        """Add a group. Return its index in `groups`."""
        clusters = self.frontier[group]
        index = len(self.groups)
        centre, radius = _enclosing_sphere(
            self.clusters.centre[clusters], self.clusters.radius[clusters]
        )
        self.groups.append((level, error, centre, radius))
        self.cluster_group[clusters] = index
        return index


def _enclosing_sphere(centres: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the centre and the radius of a sphere that encloses spheres."""
    low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    centre = (low + high) / 2
    return centre, float((np.linalg.norm(centres - centre, axis=1) + radii).max())


def _join_small(groups: Groups, smallest_size: float, largest_size: float) -> Groups:
    """Join groups of fewer than `smallest_size` clusters along the curve, up to `largest_size`."""
    result: Groups = []
    small: int | None = None  # index of the last group that is too small
    for group in groups:
        for piece in np.split(group, range(MAX_CLUSTERS, len(group), MAX_CLUSTERS)):
            if small is not None and len(result[small]) + len(piece) <= largest_size:
                result[small] = np.concatenate([result[small], piece])
            else:
                result.append(piece)
                small = len(result) - 1 if len(piece) < smallest_size else small
            if small is not None and len(result[small]) >= smallest_size:
                small = None
    return result


def _join_empty(groups: Groups, triangles: np.ndarray) -> Groups:
    """Join groups that have only degenerate triangles to the group before, or after.

    Args:
        groups: along a curve, so that neighbours are close.
        triangles: int64[G]: number of other triangles of each group.
    """
    result: Groups = []
    is_empty = False
    for group, count in zip(groups, triangles):
        if result and (count == 0 or is_empty):
            result[-1] = np.concatenate([result[-1], group])
            is_empty = is_empty and count == 0
        else:
            result.append(group)
            is_empty = count == 0
    return result
