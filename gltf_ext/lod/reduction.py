"""Simplifies the groups of one level, all up to about the same error."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gltf_ext.lod import simplifier
from gltf_ext.lod.errors import ErrorMeter
from gltf_ext.lod.surface import Surface

# A group of which a larger fraction of triangles remains does not count as simplified: its clusters
# wait for the next level.
STUCK_FRACTION = 0.85
# A group of which a larger fraction remains is simplified again without its seams.
RETRY_FRACTION = 0.5
# A group whose error is HIGH times that of its level is simplified again with the lost parts
# locked, and keeps its triangles after TRIES + LAST_TRIES attempts. Otherwise a few groups, mostly
# thin parts that vanish, decide the errors of all coarser levels: with HIGH = 4, dragon draws twice
# the triangles. Usually about ten of thousands of vertices are locked, and the group gets as few
# triangles as before. Dragon with four times its triangles and noise draws 1.39 times the triangles
# of a discrete chain; if only limits are lowered, 1.82 times.
# The last attempts come after the level has its error, which they do not change: with 5 tries and
# none after, files of engine are 1.8 % larger. Without them, one of the five groups of
# DamagedHelmet, for which the fourth attempt is enough, keeps its 4,093 triangles: level 1 has
# 7,963 at 13 bits for positions, and 4,879 at 12, where three attempts happen to do.
HIGH, TRIES, LAST_TRIES = 1.2, 3, 2
LEAST_MEDIAN = 0.25  # cells of the grid
# The smallest factor by which an attempt lowers a limit. With 0.5, level 2 of DamagedHelmet has
# 3,155 triangles instead of 1,747 at the same error, and sponza_like is 1.71 times level 0, not
# 1.69.
STRONGEST = 0.25
# A level has at most SHRINK of the triangles of the finer one. If it has more, it is simplified
# again with LOOSER times the error.
SHRINK, LOOSER = 0.75, 2.0


def reduce_groups(
    surface: Surface,
    groups: list[np.ndarray],
    step: float,
    meter: ErrorMeter,
    expected_error: float,
    threads: int,
) -> tuple[list[np.ndarray], np.ndarray, float]:
    """Simplify the groups of a level.

    Args:
        surface: the primitive on its grid.
        groups: uint32[T, 3] each: the triangles of each group.
        step: triangles of a group over those of its replacement, at most.
        meter: measures the distance of replacements to level 0.
        expected_error: the largest error that the level should have. The median of the groups
            alone is no bound: where groups are few, most of them may have lost something.
        threads: number of threads, 0 for all processors.

    Returns:
        The triangles of each group; float64[G]: the distance of each group to level 0; the error
        of the level: the median of the groups or, if that is less, `expected_error`, doubled as
        often as the level needs to shrink. Groups that are stuck keep their triangles and have
        infinite distances.
    """
    reduction = _Reduction(surface, groups, step, meter, threads)
    reduction.attempt(np.arange(len(groups)))
    if not np.isfinite(reduction.error).any():
        return groups, reduction.error, expected_error
    first_state, median = reduction.state(), reduction.median()
    error_limit, triangle_limit = min(median, expected_error), SHRINK * sum(map(len, groups))
    while True:
        _keep_to(error_limit, reduction, range(TRIES))
        if reduction.triangles_within(HIGH * error_limit) <= triangle_limit:
            break
        reduction.restore(first_state)
        if error_limit == median:
            return reduction.pieces, reduction.error, error_limit
        error_limit = min(LOOSER * error_limit, median)
    _keep_to(error_limit, reduction, range(TRIES, TRIES + LAST_TRIES))
    reduction.undo(reduction.above(HIGH * error_limit))
    return reduction.pieces, reduction.error, error_limit


def _keep_to(error_limit: float, reduction: _Reduction, attempts: range) -> None:
    """Simplify groups that are farther from level 0 than the limit again."""
    for attempt in attempts:
        far_groups = reduction.above(HIGH * error_limit)
        if not len(far_groups):
            break
        reduction.restrict(far_groups, error_limit, lowers_limits=attempt > 0)
        reduction.attempt(far_groups)


class _Reduction:
    """Groups of a level while they are simplified.

    Attributes:
        pieces, error: the triangles and the distance of each group, as reduce_groups returns them.
        collapse_limit: float64[G]: the largest error of a collapse that each group may have.
    """

    def __init__(
        self,
        surface: Surface,
        groups: list[np.ndarray],
        step: float,
        meter: ErrorMeter,
        threads: int,
    ) -> None:
        self._surface, self._groups, self._step = surface, groups, step
        self._meter, self._threads = meter, threads
        self._guard = surface.choices.guard if surface.choices else None
        self._border_vertices = _find_border_vertices(surface, groups)
        self._locked_vertices = self._border_vertices.copy()
        self._is_joined = np.zeros(len(groups), bool)  # whether seams are ignored
        self.pieces = groups.copy()
        self.error = np.full(len(groups), np.inf)
        self.collapse_limit = np.full(len(groups), np.inf)

    def attempt(self, groups: np.ndarray) -> None:
        """Simplify these groups up to their limits, and measure them."""
        with ThreadPoolExecutor(self._threads or None) as pool:
            results = list(pool.map(self._simplify, groups))
        for g, (triangles, collapse_error, is_joined) in zip(groups, results):
            self.collapse_limit[g], self._is_joined[g] = collapse_error, is_joined
            is_solved = 0 < len(triangles) <= STUCK_FRACTION * len(self._groups[g])
            self.pieces[g] = triangles if is_solved else self._groups[g]
            self.error[g] = 0.0 if is_solved else np.inf
        solved = groups[np.isfinite(self.error[groups])]
        if len(solved):
            self.error[solved] = self._meter.measure(self.pieces, solved)

    def restrict(self, groups: np.ndarray, error: float, lowers_limits: bool) -> None:
        """Lock the vertices around parts that groups lost, or lower their limits.

        Limits are lowered for groups that lost nothing new. Where seams are ignored, the simplifier
        sees one vertex of each position, and most locks miss it: limits do the rest.

        Args:
            groups: int64: the groups to restrict.
            error: the error that they should have.
            lowers_limits: whether the limits of all groups are lowered.
        """
        for g in groups:
            lost_vertices = self._meter.lost_vertices(g, self.pieces[g], HIGH * error)
            is_new = self._locked_vertices[lost_vertices] == 0
            self._locked_vertices[lost_vertices] = 1
            if lowers_limits or not is_new.any():
                self.collapse_limit[g] *= max(error / self.error[g], STRONGEST)

    def undo(self, groups: np.ndarray) -> None:
        """Give these groups their triangles back: they are stuck."""
        for g in groups:
            self.pieces[g] = self._groups[g]
        self.error[groups] = np.inf

    def state(self) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
        """Return the state for `restore`."""
        return self.pieces.copy(), self.collapse_limit.copy(), self._is_joined.copy()

    def restore(self, state: tuple[list[np.ndarray], np.ndarray, np.ndarray]) -> None:
        """Restore the groups to a state, and measure those that changed."""
        pieces, limits, is_joined = state
        is_changed = [current is not saved for current, saved in zip(self.pieces, pieces)]
        self.pieces, self.collapse_limit, self._is_joined = (
            pieces.copy(),
            limits.copy(),
            is_joined.copy(),
        )
        self._locked_vertices = self._border_vertices.copy()
        groups = np.flatnonzero(is_changed)
        self.error[groups] = self._meter.measure(pieces, groups)

    def above(self, max_error: float) -> np.ndarray:
        """Return the simplified groups with a larger error, int64."""
        return np.flatnonzero(np.isfinite(self.error) & (self.error > max_error))

    def triangles_within(self, max_error: float) -> int:
        """Return the number of triangles, if groups with a larger error keep theirs."""
        saved = sum(len(self._groups[g]) - len(self.pieces[g]) for g in self.above(max_error))
        return sum(map(len, self.pieces)) + saved

    def median(self) -> float:
        """Return the median error of the simplified groups, weighted by their old triangles."""
        solved = np.flatnonzero(np.isfinite(self.error))
        order = solved[np.argsort(self.error[solved])]
        sums = np.cumsum([len(self._groups[g]) for g in order])
        middle = order[np.searchsorted(sums, sums[-1] / 2)]
        return max(float(self.error[middle]), LEAST_MEDIAN)

    def _simplify(self, group: int) -> tuple[np.ndarray, float, bool]:
        """Simplify a group, without its seams if these leave too many triangles.

        Returns:
            The triangles, the largest error of a collapse, and whether seams were ignored: then
            the vertices of each position are joined.
        """
        triangles, surface = self._groups[group], self._surface
        target = max(round(len(triangles) / self._step), 1)

        def simplify(corners: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, float]:
            return simplifier.simplify(
                corners,
                surface.seam_points,
                surface.attributes,
                weights,
                self._locked_vertices,
                target,
                self.collapse_limit[group],
                self._guard,
            )

        result, collapse_error = triangles, 0.0
        is_joined = bool(self._is_joined[group])
        if not is_joined:
            result, collapse_error = simplify(triangles, surface.weights)
        is_first = math.isinf(self.collapse_limit[group])
        if is_joined or (is_first and len(result) > RETRY_FRACTION * len(triangles)):
            unified_triangles = surface.vertex_of_position[surface.position_ids[triangles]]
            second_result, second_error = simplify(unified_triangles, surface.weights[:0])
            if is_joined or len(second_result) < len(result):
                result, collapse_error, is_joined = second_result, second_error, True
        return (
            np.ascontiguousarray(result[~surface.is_degenerate(result)]),
            collapse_error,
            is_joined,
        )


def _find_border_vertices(surface: Surface, groups: list[np.ndarray]) -> np.ndarray:
    """Return uint8[V]: 1 for locked vertices and those at positions that two groups share."""
    last_group = np.empty(len(surface.vertex_of_position), np.int32)  # group at each position
    is_shared = np.zeros(len(surface.vertex_of_position), np.uint8)
    # Group by group: little memory at a time.
    ids_of = [surface.position_ids[group] for group in groups]
    for number, ids in enumerate(ids_of):
        last_group[ids] = number
    for number, ids in enumerate(ids_of):
        is_shared[ids[last_group[ids] != number]] = 1
    on_border: np.ndarray = is_shared[surface.position_ids]
    if surface.is_locked is None:
        return on_border
    return on_border | surface.is_locked.astype(np.uint8)
