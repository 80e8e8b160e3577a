"""Measures the error of replaced groups: distances to level 0, not to the level before."""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext.lod.ranges import begins, members


class ErrorMeter:
    """Level 0, and samples of it that follow the surface from level to level.

    A vertex of level 0 that simplification takes becomes a sample. It lies on the nearest triangle
    of the replacement, and belongs to the group that this triangle comes into.
    """

    def __init__(
        self, shapes: list[np.ndarray], triangles: np.ndarray, begin: np.ndarray, threads: int
    ) -> None:
        """shapes: float32[V, 3] each; triangles, begin: level 0 in groups."""
        self._errors = _codec.ReplacementErrors(
            shapes, triangles, begin.astype(np.uint32), threads=threads
        )
        self._samples = np.empty(0, np.uint32)  # vertices
        self._on = np.empty(0, np.int64)  # triangle that each sample lies on: the caller's numbers
        self._group = np.empty(0, np.int64)  # group that it is in
        # Samples on replacements: vertices, their groups, triangles in the replacement.
        self._next: list[np.ndarray] = [self._samples, self._group, self._on]

    def measure(
        self,
        before: np.ndarray,
        begin: np.ndarray,
        rows: np.ndarray,
        after: np.ndarray,
        after_begin: np.ndarray,
        groups: np.ndarray,
    ) -> np.ndarray:
        """float32: the largest distance found between the replacements of groups and level 0.

        before, after: uint32[T, 3] of whole levels; rows: the caller's numbers of those before.
        Groups may be measured again, with another replacement.
        """
        place = np.zeros(int(rows.max()) + 1, np.int64)
        place[rows] = np.arange(len(rows))
        self._group = np.searchsorted(begin, place[self._on], "right") - 1
        counts = np.bincount(self._group, minlength=len(begin) - 1)
        order = np.argsort(self._group, kind="stable")[members(begins(counts), groups)]
        error: np.ndarray
        error, vertices, triangles, sample_begin = self._errors.measure(
            before,
            begin.astype(np.uint32),
            after,
            after_begin.astype(np.uint32),
            groups.astype(np.uint32),
            self._samples[order],
            begins(counts[groups]).astype(np.uint32),
        )
        group = np.repeat(groups, np.diff(sample_begin))
        found = (vertices, group, triangles - after_begin[group])
        is_new = np.zeros(len(begin) - 1, bool)
        is_new[groups] = True
        old = ~is_new[self._next[1]]
        self._next = [np.concatenate([a[old], b]) for a, b in zip(self._next, found)]
        return error

    def replace(self, is_replaced: np.ndarray, first: np.ndarray, numbers: np.ndarray) -> None:
        """Moves the samples of replaced groups to the replacements.

        is_replaced: bool[G]; numbers: the caller's of all new triangles; first: int64[G], of each
        replaced group the first place in `numbers`.
        """
        stays = ~is_replaced[self._group]
        vertices, group, triangle = (column[is_replaced[self._next[1]]] for column in self._next)
        self._samples = np.concatenate([self._samples[stays], vertices])
        self._on = np.concatenate([self._on[stays], numbers[first[group] + triangle]])
        self._next = [column[:0] for column in self._next]
