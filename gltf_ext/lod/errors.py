"""Measures the error of replaced groups: distances to level 0, not to the level before."""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext.ranges import begins, begins_of, members

# The share of the area of level 0 that its vertices stand for; points in triangles stand for the
# rest. Vertices are farther away than the surface between them: a noisy scan of 3.5 M triangles
# draws 1.14 times the triangles with 0.25.
VERTEX_SHARE = 0.05
# Points in level 0, however few triangles it has. With 16,384 here and in the native code, engine
# (34 small primitives) takes 1.35 times the time; with 8,192 its errors hold as well.
LEAST_POINTS = 8192
BLOCK = 1 << 18  # triangles at a time: little memory
R2 = 0.7548776662466927, 0.5698402909980532  # Roberts' sequence R2 spreads points in a square


class ErrorMeter:
    """Level 0, and samples of it that follow the surface from level to level.

    Samples are points in triangles, and vertices from when simplification takes them. A sample
    lies on the nearest triangle of the replacement, and belongs to the group that this triangle
    comes into. It counts with the area of level 0 that it stands for.
    """

    def __init__(
        self,
        shapes: list[np.ndarray],
        triangles: np.ndarray,
        begin: np.ndarray,
        rows: np.ndarray,
        threads: int,
    ) -> None:
        """shapes: float32[V, 3] each; triangles, begin: level 0 in groups; rows: the caller's
        numbers of the triangles."""
        self._threads = threads
        chosen, areas = spread_by_area(shapes[0], triangles)
        u, v, w = spread_weights(len(chosen)).T[:, :, None]
        # np.take is six times faster than an index here.
        corners = [np.take(shape, triangles[chosen], axis=0) for shape in shapes]
        points = [at[:, 0] * u + at[:, 1] * v + at[:, 2] * w for at in corners]
        self._shapes = [np.concatenate(pair) for pair in zip(shapes, points)]
        self._errors = _codec.ReplacementErrors(
            self._shapes,
            triangles,
            begin.astype(np.uint32),
            VERTEX_SHARE,
            threads=threads,
        )
        # Of each sample: its number among vertices and points, its triangle by the caller's
        # number, its area. From begin_level on also: its triangle's place in the level, its group.
        self._samples = (len(shapes[0]) + np.arange(len(chosen))).astype(np.uint32)
        self._on = rows[chosen]
        self._areas = np.float32(1 - VERTEX_SHARE) * areas
        # Samples on replacements; triangles are numbers in the replacement.
        nothing = self._on[:0]
        self._next = [self._samples[:0], nothing, nothing, self._areas[:0]]

    def begin_level(self, before: np.ndarray, begin: np.ndarray, rows: np.ndarray) -> None:
        """before: uint32[T, 3], a whole level in groups; rows: the caller's numbers of its
        triangles."""
        place = np.zeros(int(rows.max()) + 1, np.int64)
        place[rows] = np.arange(len(rows))
        self._before, self._begin, self._at = before, begin, place[self._on]
        self._group = np.searchsorted(begin, self._at, "right") - 1

    def measure(self, after: list[np.ndarray], groups: np.ndarray) -> np.ndarray:
        """float32: the distance between the replacement of each group and level 0 that 99.9 % of
        the area of either surface keeps.

        after: the triangles of each group's replacement, or of the group where it has none.
        Groups may be measured again, with another replacement.
        """
        begin = self._begin
        counts = np.bincount(self._group, minlength=len(begin) - 1)
        order = np.argsort(self._group, kind="stable")[members(begins(counts), groups)]
        after_begin = begins_of(after)
        error: np.ndarray
        error, samples, triangles, sample_begin, areas = self._errors.measure(
            self._before,
            begin.astype(np.uint32),
            np.concatenate(after),
            after_begin.astype(np.uint32),
            groups.astype(np.uint32),
            self._samples[order],
            begins(counts[groups]).astype(np.uint32),
            self._areas[order],
        )
        group = np.repeat(groups, np.diff(sample_begin))
        found = (samples, group, triangles - after_begin[group], areas)
        is_new = np.zeros(len(begin) - 1, bool)
        is_new[groups] = True
        old = ~is_new[self._next[1]]
        self._next = [np.concatenate([a[old], b]) for a, b in zip(self._next, found)]
        return error

    def lost(self, group: int, after: np.ndarray, allowed: float) -> np.ndarray:
        """uint32: vertices of the group, around its samples that are farther than `allowed` from
        its replacement, uint32[T, 3]."""
        chosen = np.flatnonzero(self._group == group)
        samples = self._samples[chosen]
        is_far = np.zeros(len(samples), bool)
        for points in self._shapes:
            found, _ = _codec.surface_distances(
                points[samples], points, after, allowed, self._threads
            )
            is_far |= found > allowed
        lost: np.ndarray = np.unique(self._before[self._at[chosen[is_far]]])
        return lost

    def replace(self, is_replaced: np.ndarray, first: np.ndarray, numbers: np.ndarray) -> None:
        """Moves the samples of replaced groups to the replacements.

        is_replaced: bool[G]; numbers: the caller's of all new triangles; first: int64[G], of each
        replaced group the first place in `numbers`.
        """
        stays = ~is_replaced[self._group]
        goes = is_replaced[self._next[1]]
        samples, group, triangle, areas = (values[goes] for values in self._next)
        self._samples = np.concatenate([self._samples[stays], samples])
        self._on = np.concatenate([self._on[stays], numbers[first[group] + triangle]])
        self._areas = np.concatenate([self._areas[stays], areas])
        self._next = [values[:0] for values in self._next]


def spread_by_area(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(int64[N]: triangles to put points into, in order, float32[N]: the area that each point
    stands for): every second triangle, and large ones as often as their areas ask for."""
    area = _areas(points, triangles)
    total = area.sum(dtype=np.float64)
    per_area = max(len(triangles) // 2, LEAST_POINTS) / total if total > 0 else 0.0
    # In float64 with any NumPy; where all areas are alike, rounding does not decide.
    times = (np.multiply(area, per_area, dtype=np.float64) + 1e-6).astype(np.int64)
    small = np.flatnonzero(times == 0)
    chosen = small[::2]
    times[chosen] = 1
    area[chosen] *= len(small) / max(len(chosen), 1)
    chosen = np.repeat(np.arange(len(times)), times)
    return chosen, area[chosen] / times[chosen].astype(np.float32)


def _areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """float32[T]: the area of each triangle."""
    areas = np.empty(len(triangles), np.float32)
    for first in range(0, len(triangles), BLOCK):
        corners = np.take(points, triangles[first : first + BLOCK].T, axis=0).transpose(0, 2, 1)
        (a, b, c), (d, e, f) = corners[1] - corners[0], corners[2] - corners[0]
        # np.cross and np.linalg.norm alone take 1.8 times as long as all of this.
        x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
        areas[first : first + BLOCK] = np.sqrt(x * x + y * y + z * z) / 2
    return areas


def spread_weights(count: int) -> np.ndarray:
    """float32[count, 3]: weights of the corners of a triangle, for points spread evenly in it."""
    u, v = (np.arange(count) * step % 1.0 for step in R2)
    beyond = u + v > 1.0
    u[beyond], v[beyond] = 1.0 - u[beyond], 1.0 - v[beyond]
    return np.stack([1.0 - u - v, u, v], axis=1).astype(np.float32)
