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
from gltf_ext.lod.errors import ErrorMeter
from gltf_ext.lod.pilot import SMALLEST, Pilot, smaller
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
ENOUGH = 128  # triangles of the last level, at most
LARGEST_GROUP = 11 / 8  # of the aimed size

Groups = list[np.ndarray]  # numbers of the clusters in each group


@dataclass
class Clusters:
    """Clusters as ranges of disks, disks as ranges of triangles.

    Attributes:
        triangles: uint32[T, 3]; disk_begin, cluster_begin: int64, as in _codec.encode.
    """

    triangles: np.ndarray
    disk_begin: np.ndarray
    cluster_begin: np.ndarray

    @property
    def count(self) -> int:
        """The number of clusters."""
        return len(self.cluster_begin) - 1

    @property
    def triangle_begin(self) -> np.ndarray:
        """int64[N + 1]: the first triangle of each cluster."""
        begin: np.ndarray = self.disk_begin[self.cluster_begin]
        return begin

    def chosen(self, clusters: np.ndarray) -> Clusters:
        """These clusters, in this order."""
        disks = members(self.cluster_begin, clusters)
        triangles = members(self.disk_begin, disks)
        return Clusters(
            self.triangles[triangles],
            begins(np.diff(self.disk_begin)[disks]),
            begins(np.diff(self.cluster_begin)[clusters]),
        )

    def followed_by(self, other: Clusters) -> Clusters:
        """These clusters, then others."""
        return Clusters(
            np.concatenate([self.triangles, other.triangles]),
            np.concatenate([self.disk_begin, self.disk_begin[-1] + other.disk_begin[1:]]),
            np.concatenate([self.cluster_begin, self.cluster_begin[-1] + other.cluster_begin[1:]]),
        )


@dataclass
class ClusterSet:
    """Clusters, and what they were made from.

    Attributes:
        clusters: C of them.
        refined: int64[C]: the group that each was made from, -1 in level 0.
        error: float64[C]: of that group, 0 in level 0.
        base: float64[C]: largest distance to level 0 of the surface that errors are measured to.
        centre, radius: float64[C, 3], float64[C]: a sphere around each and all finer ones below.
    """

    clusters: Clusters
    refined: np.ndarray
    error: np.ndarray
    base: np.ndarray
    centre: np.ndarray
    radius: np.ndarray

    def chosen(self, numbers: np.ndarray) -> ClusterSet:
        """These clusters, in this order."""
        return ClusterSet(
            self.clusters.chosen(numbers), *(values[numbers] for values in self._values)
        )

    def followed_by(self, other: ClusterSet) -> ClusterSet:
        """These clusters, then others."""
        values = map(np.concatenate, zip(self._values, other._values))
        return ClusterSet(self.clusters.followed_by(other.clusters), *values)

    @property
    def _values(self) -> tuple[np.ndarray, ...]:
        return self.refined, self.error, self.base, self.centre, self.radius


@dataclass
class Hierarchy:
    """All levels of a primitive. Lengths are in units of the grid.

    Attributes:
        clusters: of all levels, those of level 0 first.
        group: int64[C]: the group that each cluster is in, by its place in the arrays of groups.
        refined: int64[C]: the number of the group that it was made from, -1 in level 0.
        level: int64[G]: the round in which each group was made.
        error: float64[G]: of what replaces the group; infinite where nothing does.
        centre, radius: float64[G, 3], float64[G]: a sphere around the group and all finer ones
            below it.
        stuck: number of triangles of each level that wait for the next one.
    """

    clusters: Clusters
    group: np.ndarray
    refined: np.ndarray
    level: np.ndarray
    error: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    stuck: list[int]


class Builder:
    """Adds level after level.

    Attributes:
        all: the clusters so far; group: int64[C]: the group of each, -1 for none.
        pending: int64: the clusters without a group.
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
        """Begins with some clusters.

        clusters: of this level or finer, with errors to be measured to them; by default those of
            level 0. first_group: the number of the first group.
        """
        self.surface = surface
        self.generation = {**options.generation, "threads": threads}
        self.reduction, self.group_size, self.pilot = reduction, group_size, pilot
        self.error_limit, self.threads = error_limit, threads
        self.all = clusters or self._level_0()
        self.meter: ErrorMeter | None = None  # from the first level on
        self.group = np.full(self.all.clusters.count, -1)
        self.pending = np.arange(self.all.clusters.count)
        self.level, self.first_group = level, first_group
        # Of the last level.
        self.error = (
            math.inf if clusters else FIRST_ERROR * longest_side(surface.points) / reduction
        )
        self.groups: list[tuple[int, float, np.ndarray, float]] = []  # level, error, sphere
        self.stuck: list[int] = []

    def result(self) -> Hierarchy:
        """The groups so far and their clusters, without those that are pending."""
        level, error, centre, radius = zip(*self.groups)
        clusters, group, refined = self.all.clusters, self.group, self.all.refined
        if len(self.pending):
            kept = np.flatnonzero(group >= 0)
            clusters, group, refined = clusters.chosen(kept), group[kept], refined[kept]
        return Hierarchy(
            clusters,
            group,
            refined,
            np.array(level),
            np.array(error),
            np.array(centre),
            np.array(radius),
            self.stuck,
        )

    def add_level(self, may_end: bool = True) -> int:
        """Groups the pending clusters.

        Returns the number of triangles of the next level, 0 if this one is the last.

        may_end: else clusters that cannot be simplified wait, and there is no last level.
        """
        here = self.all.clusters.chosen(self.pending)
        groups = self._grouped(here)
        level = self.level
        self.level += 1
        rows, begin = self._triangles_of(groups)
        if (np.diff(begin) == 0).any():
            groups = _without_empty(groups, np.diff(begin))
            rows, begin = self._triangles_of(groups)
        is_small = len(here.triangles) <= ENOUGH or here.count == 1
        if (may_end and is_small) or not len(rows):
            self._end(groups, level)
            return 0
        before = self.surface.canonical[self.all.clusters.triangles[rows]]
        if self.meter is None:
            shapes = [self.surface.points, *self.surface.morphed]
            self.meter = ErrorMeter(shapes, before, begin, rows, self.threads)
        meter = self.meter
        meter.begin_level(before, begin, rows)
        step = self.reduction * STEPS[min(level, len(STEPS) - 1)]
        pieces, error, self.error = reduce_groups(
            self.surface,
            np.split(before, begin[1:-1]),
            step,
            meter,
            step * self.error,
            self.threads,
        )
        after, after_begin = np.concatenate(pieces), begins_of(pieces)
        below = self._largest(self.all.error, groups)
        error = np.maximum(error + self._largest(self.all.base, groups), below)
        is_stuck = ~(np.isfinite(error) & (error <= self.error_limit))
        left = np.where(is_stuck, np.diff(begin), np.diff(after_begin)).sum()
        if may_end and left > SHRINK * len(before):
            self._end(groups, level)
            return 0
        self.stuck.append(int(np.diff(begin)[is_stuck].sum()))
        replaced = np.flatnonzero(~is_stuck)
        if level == 0:  # clusters of level 0 cannot wait: others would share their pages
            after, after_begin = _merged(before, begin, after, after_begin, is_stuck)
            if is_stuck.any():
                meter.measure(np.split(after, after_begin[1:-1]), np.flatnonzero(is_stuck))
            error[is_stuck] = 0.0
            replaced = np.arange(len(groups))
        if not len(replaced):
            return len(before)
        numbers = self._replace(groups, level, after, after_begin, error, replaced)
        first = np.zeros(len(groups), np.int64)
        first[replaced] = begins(np.diff(after_begin)[replaced])[:-1]
        meter.replace(np.isin(np.arange(len(groups)), replaced), first, numbers)
        return int(np.diff(self.all.clusters.triangle_begin)[self.pending].sum())

    def end(self) -> None:
        """Makes a last level of the pending clusters."""
        self._end(self._grouped(self.all.clusters.chosen(self.pending)), self.level)

    def _end(self, groups: Groups, level: int) -> None:
        for group in groups:
            self._add_group(group, level, np.inf)
        self.stuck.append(0)
        self.pending = self.pending[:0]

    # --- clusters ---

    def _level_0(self) -> ClusterSet:
        whole = np.array([0, len(self.surface.triangles)], np.uint32)
        clusters, _, _ = self._clusters(self.surface.triangles, whole)
        zeros = np.zeros(clusters.count)
        refined = np.full(clusters.count, -1)
        return ClusterSet(clusters, refined, zeros, zeros, *self._bounds(clusters))

    def _clusters(
        self, triangles: np.ndarray, begin: np.ndarray
    ) -> tuple[Clusters, np.ndarray, np.ndarray]:
        """Clusters of triangles in groups.

        Returns (clusters, int64: the first cluster of each group, uint32: the numbers of the
        triangles in the order of the clusters).
        """
        order, disk_begin, cluster_begin, group_begin = _codec.generate_in_groups(
            triangles,
            begin.astype(np.uint32),
            self.surface.position_ids,
            self.surface.points,
            **self.generation,
        )
        return (
            Clusters(triangles[order], disk_begin.astype(np.int64), cluster_begin.astype(np.int64)),
            group_begin.astype(np.int64),
            order,
        )

    def _bounds(self, clusters: Clusters) -> tuple[np.ndarray, np.ndarray]:
        """Spheres around the clusters: float64[N, 3] and float64[N]; morph targets included."""
        corners = clusters.triangles.reshape(-1)
        first = 3 * clusters.triangle_begin[:-1]
        low = np.full((clusters.count, 3), np.inf)
        high = -low
        for points in [self.surface.points, *self.surface.morphed]:
            at_corners = points[corners]
            low = np.minimum(low, np.minimum.reduceat(at_corners, first))
            high = np.maximum(high, np.maximum.reduceat(at_corners, first))
        centre = (low + high) / 2
        return centre, np.linalg.norm(high - centre, axis=1)

    # --- grouping ---

    def _grouped(self, here: Clusters) -> Groups:
        """Groups of the pending clusters that fit in a page. Numbers are places in `pending`."""
        size = self.group_size
        while True:
            groups = self._groups_of(here, size)
            if self.pilot is None or size <= SMALLEST:
                return groups
            share = max(self._share_of_page(self.pilot, here, group) for group in groups)
            if share <= 1.0:
                return groups
            size = smaller(size, 1.0 / share)

    def _share_of_page(self, pilot: Pilot, here: Clusters, group: np.ndarray) -> float:
        chosen, refined = here.chosen(group), self.all.refined[self.pending[group]]
        parts = chosen.triangles, chosen.disk_begin, chosen.cluster_begin
        return pilot.share_of_page(*parts, refined)

    def _groups_of(self, here: Clusters, size: int) -> Groups:
        """Groups of about so many clusters, along a Hilbert curve.

        The partitioner joins only clusters that share vertices: smaller groups are joined along the
        curve.
        """
        most = min(size * LARGEST_GROUP, MAX_CLUSTERS)
        if here.count <= most:
            return [np.arange(here.count)]
        corners = self.surface.position_ids[here.triangles.reshape(-1)]
        counts = 3 * np.diff(here.triangle_begin)
        group = simplifier.partition(
            corners, counts.astype(np.uint32), len(self.surface.vertex_at), size
        )
        order = np.argsort(group, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
        middles = np.array([self.all.centre[self.pending[g]].mean(axis=0) for g in groups])
        on_curve = [groups[i] for i in _codec.hilbert_order(middles.astype(np.float32))]
        return _joined(on_curve, size / 2, most)

    def _triangles_of(self, groups: Groups) -> tuple[np.ndarray, np.ndarray]:
        """(numbers of the groups' triangles, one group after the other, begins).

        Drops triangles without extent.
        """
        clusters = self.pending[np.concatenate(groups)]
        rows = members(self.all.clusters.triangle_begin, clusters)
        sizes = np.diff(self.all.clusters.triangle_begin)[clusters]
        owner = np.repeat(np.repeat(np.arange(len(groups)), [len(g) for g in groups]), sizes)
        keep = ~self.surface.is_flat(self.all.clusters.triangles[rows])
        return rows[keep], begins(np.bincount(owner[keep], minlength=len(groups)))

    # --- the next level ---

    def _replace(
        self,
        groups: Groups,
        level: int,
        after: np.ndarray,
        after_begin: np.ndarray,
        error: np.ndarray,
        replaced: np.ndarray,
    ) -> np.ndarray:
        """Makes the replaced groups, and clusters of their replacements.

        after, after_begin: triangles of all groups. Returns int64: numbers in `clusters` of the
        triangles of the replaced groups.
        """
        made = np.array([self._add_group(groups[g], level, error[g]) for g in replaced])
        triangles = np.ascontiguousarray(after[members(after_begin, replaced)])
        new, group_begin, order = self._clusters(triangles, begins(np.diff(after_begin)[replaced]))
        numbers = np.empty(len(order), np.int64)
        numbers[order] = len(self.all.clusters.triangles) + np.arange(len(order))
        base = self._largest(self.all.base, [groups[g] for g in replaced])
        _, errors, centres, radii = (np.array(v) for v in zip(*(self.groups[g] for g in made)))
        values = (self.first_group + made, errors, base, centres, radii)
        counts = np.diff(group_begin)
        first = self.all.clusters.count
        self.all = self.all.followed_by(
            ClusterSet(new, *(np.repeat(v, counts, axis=0) for v in values))
        )
        waiting = self.pending[self.group[self.pending] < 0]
        self.pending = np.concatenate([waiting, np.arange(first, first + new.count)])
        self.group = np.concatenate([self.group, np.full(new.count, -1)])
        return numbers

    def _largest(self, values: np.ndarray, groups: Groups) -> np.ndarray:
        """The largest of the clusters' values in each group."""
        here = values[self.pending]
        return np.array([here[group].max() for group in groups])

    def _add_group(self, group: np.ndarray, level: int, error: float) -> int:
        """Makes a group of these places in `pending`. Returns its place in `groups`."""
        clusters = self.pending[group]
        number = len(self.groups)
        centre, radius = _enclosing(self.all.centre[clusters], self.all.radius[clusters])
        self.groups.append((level, error, centre, radius))
        self.group[clusters] = number
        return number


def _enclosing(centres: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, float]:
    """A sphere that encloses spheres."""
    low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    centre = (low + high) / 2
    return centre, float((np.linalg.norm(centres - centre, axis=1) + radii).max())


def _joined(groups: Groups, least: float, most: float) -> Groups:
    """Joins groups of fewer than `least` clusters along the curve, up to `most`."""
    result: Groups = []
    small: int | None = None  # place of the last one that is too small
    for group in groups:
        for piece in np.split(group, range(MAX_CLUSTERS, len(group), MAX_CLUSTERS)):
            if small is not None and len(result[small]) + len(piece) <= most:
                result[small] = np.concatenate([result[small], piece])
            else:
                result.append(piece)
                small = len(result) - 1 if len(piece) < least else small
            if small is not None and len(result[small]) >= least:
                small = None
    return result


def _without_empty(groups: Groups, triangles: np.ndarray) -> Groups:
    """Joins groups without a triangle that has extent to the one before, or after."""
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


def _merged(
    before: np.ndarray,
    begin: np.ndarray,
    after: np.ndarray,
    after_begin: np.ndarray,
    take_before: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """The triangles and begins of `after`, for some groups those of `before`."""
    pieces = [
        before[begin[g] : begin[g + 1]] if stuck else after[after_begin[g] : after_begin[g + 1]]
        for g, stuck in enumerate(take_before)
    ]
    return np.concatenate(pieces), begins_of(pieces)
