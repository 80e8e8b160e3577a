"""Simplifies the groups of one level, all up to about the same error."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import numpy as np

from gltf_ext.lod import simplifier
from gltf_ext.lod.surface import Surface

# A group of which more is left does not count as simplified: its clusters wait for the next level.
STUCK = 0.85
# A group of which more is left is simplified again with the vertices of each position joined.
RETRY = 0.5
# A group that is farther from level 0 than this, times the level's error, is simplified again, with
# what it lost locked, and after so many tries not at all. Otherwise a few groups, as a rule thin
# parts that vanish, decide the errors of all levels above them: with 4, dragon draws twice the
# triangles. As a rule some ten vertices are locked of thousands, and the group has as few triangles
# as before. Dragon with four times its triangles and noise draws 1.39 times the triangles of a
# discrete chain; with limits lowered only, 1.82 times.
HIGH, TRIES = 1.2, 3
LEAST_MEDIAN = 0.25  # cells of the grid
# Of the factors by which a try lowers a limit. With 0.5, level 2 of DamagedHelmet has 3,155
# triangles instead of 1,747 at the same error, and sponza_like is 1.71 times level 0, not 1.69.
STRONGEST = 0.25
# A level that is not smaller by a quarter is no level. It may then have LOOSER times the error.
SHRINK, LOOSER = 0.75, 2.0


class Meter(Protocol):
    """Measures the groups of a level: gltf_ext.lod.errors."""

    def measure(self, after: list[np.ndarray], groups: np.ndarray) -> np.ndarray:
        """Distances of some groups' replacements to level 0. after: triangles of all groups."""

    def lost(self, group: int, after: np.ndarray, allowed: float) -> np.ndarray:
        """Vertices of the group where its replacement is farther than `allowed`."""


def reduce_groups(
    surface: Surface,
    groups: list[np.ndarray],
    step: float,
    meter: Meter,
    expected: float,
    threads: int,
) -> tuple[list[np.ndarray], np.ndarray, float]:
    """Simplifies groups of triangles, uint32[T, 3] each, to 1 / step of their triangles or more.

    expected: the largest error that the level should have: where groups are few, most of them may
    have lost something. Returns the triangles of each group, float64: their distances to level 0,
    and the error of the level: the median of the groups, or less: `expected`, doubled as often as
    the level needs to shrink. Groups that are stuck keep their triangles and have infinite
    distances.
    """
    reduction = _Reduction(surface, groups, step, meter, threads)
    reduction.attempt(np.arange(len(groups)))
    if not np.isfinite(reduction.error).any():
        return groups, reduction.error, expected
    first, median = reduction.state(), reduction.median()
    level, most = min(median, expected), SHRINK * sum(map(len, groups))
    while True:
        _keep_to(level, reduction)
        if sum(map(len, reduction.after)) <= most:
            break
        reduction.put_back(first)
        if level == median:
            break
        level = min(LOOSER * level, median)
    return reduction.after, reduction.error, level


def _keep_to(level: float, reduction: _Reduction) -> None:
    """Simplifies groups that are farther from level 0 than this again, or not at all."""
    for number in range(TRIES):
        far = reduction.above(HIGH * level)
        if not len(far):
            break
        reduction.restrict(far, level, lowers_limits=number > 0)
        reduction.attempt(far)
    reduction.undo(reduction.above(HIGH * level))


class _Reduction:
    """Groups of a level while they are simplified.

    Attributes:
        after, error: as reduce_groups returns them.
        limit: float64[G]: the largest error of a collapse that each group may have.
    """

    def __init__(
        self,
        surface: Surface,
        groups: list[np.ndarray],
        step: float,
        meter: Meter,
        threads: int,
    ) -> None:
        self._surface, self._groups, self._step = surface, groups, step
        self._meter, self._threads = meter, threads
        self._shared = _locked(surface, groups)
        self._locked = self._shared.copy()
        self._is_joined = np.zeros(len(groups), bool)  # whether seams are ignored
        self.after = groups.copy()
        self.error = np.full(len(groups), np.inf)
        self.limit = np.full(len(groups), np.inf)

    def attempt(self, numbers: np.ndarray) -> None:
        """Simplifies these groups up to their limits, and measures them."""
        with ThreadPoolExecutor(self._threads or None) as pool:
            found = list(pool.map(self._simplified, numbers))
        for g, (triangles, largest, is_joined) in zip(numbers, found):
            self.limit[g], self._is_joined[g] = largest, is_joined
            is_solved = 0 < len(triangles) <= STUCK * len(self._groups[g])
            self.after[g] = triangles if is_solved else self._groups[g]
            self.error[g] = 0.0 if is_solved else np.inf
        solved = numbers[np.isfinite(self.error[numbers])]
        if len(solved):
            self.error[solved] = self._meter.measure(self.after, solved)

    def restrict(self, numbers: np.ndarray, error: float, lowers_limits: bool) -> None:
        """Locks the vertices of what these groups lost. Lowers the limits of those that lost
        nothing new, or of all, for this error. Where seams are ignored, the simplifier sees one
        vertex of each position, and most locks miss it: limits do the rest."""
        for g in numbers:
            lost = self._meter.lost(g, self.after[g], HIGH * error)
            is_new = self._locked[lost] == 0
            self._locked[lost] = 1
            if lowers_limits or not is_new.any():
                self.limit[g] *= max(error / self.error[g], STRONGEST)

    def undo(self, numbers: np.ndarray) -> None:
        """Gives these groups their triangles back: they are stuck."""
        for g in numbers:
            self.after[g] = self._groups[g]
        self.error[numbers] = np.inf

    def state(self) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
        """For put_back."""
        return self.after.copy(), self.limit.copy(), self._is_joined.copy()

    def put_back(self, state: tuple[list[np.ndarray], np.ndarray, np.ndarray]) -> None:
        """Makes the groups what they were, and measures those that changed."""
        after, limit, is_joined = state
        changed = [now is not then for now, then in zip(self.after, after)]
        self.after, self.limit, self._is_joined = after.copy(), limit.copy(), is_joined.copy()
        self._locked = self._shared.copy()
        numbers = np.flatnonzero(changed)
        self.error[numbers] = self._meter.measure(after, numbers)

    def above(self, allowed: float) -> np.ndarray:
        """int64: the simplified groups with a larger error."""
        return np.flatnonzero(np.isfinite(self.error) & (self.error > allowed))

    def median(self) -> float:
        """The median error of the simplified groups, weighed by their triangles before."""
        solved = np.flatnonzero(np.isfinite(self.error))
        order = solved[np.argsort(self.error[solved])]
        sums = np.cumsum([len(self._groups[g]) for g in order])
        middle = order[np.searchsorted(sums, sums[-1] / 2)]
        return max(float(self.error[middle]), LEAST_MEDIAN)

    def _simplified(self, group: int) -> tuple[np.ndarray, float, bool]:
        """(triangles, the largest error of a collapse, whether vertices of one position are
        joined): they are where seams hold the first attempt back."""
        triangles, surface = self._groups[group], self._surface
        target = max(round(len(triangles) / self._step), 1)

        def simplify(corners: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, float]:
            return simplifier.simplify(
                corners,
                surface.apart,
                surface.attributes,
                weights,
                self._locked,
                target,
                self.limit[group],
            )

        result, largest = triangles, 0.0
        is_joined = bool(self._is_joined[group])
        if not is_joined:
            result, largest = simplify(triangles, surface.weights)
        is_first = math.isinf(self.limit[group])
        if is_joined or (is_first and len(result) > RETRY * len(triangles)):
            joined = surface.vertex_at[surface.position_ids[triangles]]
            again, error = simplify(joined, surface.weights[:0])
            if is_joined or len(again) < len(result):
                result, largest, is_joined = again, error, True
        return np.ascontiguousarray(result[~surface.is_flat(result)]), largest, is_joined


def _locked(surface: Surface, groups: list[np.ndarray]) -> np.ndarray:
    """uint8[V]: 1 for vertices at positions that two groups share, and for those that are fixed."""
    last = np.empty(len(surface.vertex_at), np.int32)  # group at each position
    shared = np.zeros(len(surface.vertex_at), np.uint8)
    # Group by group: little memory at a time.
    ids_of = [surface.position_ids[group] for group in groups]
    for number, ids in enumerate(ids_of):
        last[ids] = number
    for number, ids in enumerate(ids_of):
        shared[ids[last[ids] != number]] = 1
    locked: np.ndarray = shared[surface.position_ids]
    return locked if surface.fixed is None else locked | surface.fixed.astype(np.uint8)
