"""Measures the error of replaced groups: distances to level 0, not to the level before."""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext._replacement_errors import ReplacementErrors
from gltf_ext.ranges import begins, begins_of, members

# The fraction of the area of level 0 that its vertices represent; points in triangles represent the
# rest. Distances at vertices are larger than on the surface between them: a noisy scan of 3.5 M
# triangles draws 1.14 times the triangles with 0.25.
VERTEX_FRACTION = 0.05
# The least number of sample points in level 0. With 16,384 here and in the native code, engine
# (34 small primitives) takes 1.35 times the time; with 8,192 its errors hold as well.
LEAST_POINTS = 8192
BLOCK = 1 << 18  # triangles at a time: little memory
R2 = 0.7548776662466927, 0.5698402909980532  # Roberts' sequence R2 spreads points in a square


class ErrorMeter:
    """Level 0, and samples of it that follow the surface from level to level.

    Samples are points in triangles, and the vertices that simplification has removed. A sample lies
    on the nearest triangle of the replacement, and belongs to the group of this triangle in the
    next level. Its weight is the area of level 0 that it represents.
    """

    def __init__(
        self,
        shapes: list[np.ndarray],
        triangles: np.ndarray,
        begin: np.ndarray,
        triangle_ids: np.ndarray,
        threads: int,
    ) -> None:
        """Place samples in level 0.

        Args:
            shapes: float32[V, 3] each: positions at rest, then with each morph target.
            triangles: uint32[T, 3]: level 0, group after group.
            begin: int64[G + 1]: the first triangle of each group, and T.
            triangle_ids: int64[T]: the caller's numbers of the triangles.
            threads: number of threads, 0 for all processors.
        """
        self._threads, self._level_0 = threads, triangles
        sample_triangles, areas = sample_by_area(shapes[0], triangles)
        u, v, w = sample_weights(len(sample_triangles)).T[:, :, None]
        # np.take is six times faster than an index here.
        corners = [np.take(shape, triangles[sample_triangles], axis=0) for shape in shapes]
        points = [abc[:, 0] * u + abc[:, 1] * v + abc[:, 2] * w for abc in corners]
        self._shapes = [np.concatenate(pair) for pair in zip(shapes, points)]
        self._errors = ReplacementErrors(
            self._shapes,
            triangles,
            begin.astype(np.uint32),
            VERTEX_FRACTION,
            threads=threads,
        )
        # For each sample: its number among vertices and points, the caller's number of its
        # triangle, its area. begin_level adds its triangle's index in the level, and its group.
        self._samples = (len(shapes[0]) + np.arange(len(sample_triangles))).astype(np.uint32)
        self._sample_triangle_id = triangle_ids[sample_triangles]
        self._sample_areas = np.float32(1 - VERTEX_FRACTION) * areas
        # Samples on replacements: number, group, index of the triangle in the replacement, area.
        no_triangles = self._sample_triangle_id[:0]
        self._next_samples = [self._samples[:0], no_triangles, no_triangles, self._sample_areas[:0]]

    def begin_level(
        self, triangles: np.ndarray, begin: np.ndarray, triangle_ids: np.ndarray
    ) -> None:
        """Assign the samples to the groups of a level. Arguments as in the constructor."""
        index_of_id = np.zeros(int(triangle_ids.max()) + 1, np.int64)
        index_of_id[triangle_ids] = np.arange(len(triangle_ids))
        self._level_triangles, self._group_begin, self._sample_triangle = (
            triangles,
            begin,
            index_of_id[self._sample_triangle_id],
        )
        self._sample_group = np.searchsorted(begin, self._sample_triangle, "right") - 1

    def measure(self, pieces: list[np.ndarray], groups: np.ndarray) -> np.ndarray:
        """Measure the distance between replacements and level 0.

        Groups may be measured again, with another replacement.

        Args:
            pieces: uint32[T, 3] for each group of the level: its replacement, or the group itself.
            groups: int64[N]: the groups to measure.

        Returns:
            float32[N]: the distance that 99.9 % of the area of either surface keeps.
        """
        begin = self._group_begin
        counts = np.bincount(self._sample_group, minlength=len(begin) - 1)
        sample_order = np.argsort(self._sample_group, kind="stable")[
            members(begins(counts), groups)
        ]
        piece_begin = begins_of(pieces)
        error: np.ndarray
        error, samples, triangles, sample_begin, areas = self._errors.measure(
            self._level_triangles,
            begin.astype(np.uint32),
            np.concatenate(pieces),
            piece_begin.astype(np.uint32),
            groups.astype(np.uint32),
            self._samples[sample_order],
            begins(counts[groups]).astype(np.uint32),
            self._sample_areas[sample_order],
        )
        sample_group = np.repeat(groups, np.diff(sample_begin))
        new_samples = (samples, sample_group, triangles - piece_begin[sample_group], areas)
        is_measured = np.zeros(len(begin) - 1, bool)
        is_measured[groups] = True
        is_other = ~is_measured[self._next_samples[1]]
        self._next_samples = [
            np.concatenate([a[is_other], b]) for a, b in zip(self._next_samples, new_samples)
        ]
        return error

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Return uint32[N, 3]: the triangles of level 0 that are nearest to points, [N, 3]."""
        triangles: np.ndarray = self._level_0[self._errors.nearest(points)]
        return triangles

    def lost_vertices(self, group: int, piece: np.ndarray, max_distance: float) -> np.ndarray:
        """Return the vertices of a group around the parts that its replacement lost.

        Args:
            group: number of the group.
            piece: uint32[T, 3]: its replacement.
            max_distance: samples that are farther from the replacement are lost.

        Returns:
            uint32[N]: the corners of the triangles of these samples, ascending.
        """
        group_samples = np.flatnonzero(self._sample_group == group)
        samples = self._samples[group_samples]
        is_far = np.zeros(len(samples), bool)
        for points in self._shapes:
            distances, _ = _codec.surface_distances(
                points[samples], points, piece, max_distance, self._threads
            )
            is_far |= distances > max_distance
        vertices: np.ndarray = np.unique(
            self._level_triangles[self._sample_triangle[group_samples[is_far]]]
        )
        return vertices

    def replace(
        self, is_replaced: np.ndarray, first_new_triangle: np.ndarray, new_triangle_ids: np.ndarray
    ) -> None:
        """Move the samples of replaced groups to the replacements.

        Args:
            is_replaced: bool[G].
            first_new_triangle: int64[G]: the index in `new_triangle_ids` of each replacement's
                first triangle; unused for groups that are not replaced.
            new_triangle_ids: int64: the caller's numbers of the triangles of all replacements.
        """
        stays = ~is_replaced[self._sample_group]
        goes = is_replaced[self._next_samples[1]]
        samples, group, triangle, areas = (values[goes] for values in self._next_samples)
        self._samples = np.concatenate([self._samples[stays], samples])
        self._sample_triangle_id = np.concatenate(
            [
                self._sample_triangle_id[stays],
                new_triangle_ids[first_new_triangle[group] + triangle],
            ]
        )
        self._sample_areas = np.concatenate([self._sample_areas[stays], areas])
        self._next_samples = [values[:0] for values in self._next_samples]


def sample_by_area(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Choose triangles for sample points: every second one, and large ones several times.

    Returns:
        int64[N]: the triangle of each point, ascending; float32[N]: the area that it represents.
    """
    area = _triangle_areas(points, triangles)
    total = area.sum(dtype=np.float64)
    per_area = max(len(triangles) // 2, LEAST_POINTS) / total if total > 0 else 0.0
    # In float64 with any NumPy; where all areas are alike, rounding does not decide.
    times = (np.multiply(area, per_area, dtype=np.float64) + 1e-6).astype(np.int64)
    small = np.flatnonzero(times == 0)
    sample_triangles = small[::2]
    times[sample_triangles] = 1
    area[sample_triangles] *= len(small) / max(len(sample_triangles), 1)
    sample_triangles = np.repeat(np.arange(len(times)), times)
    return sample_triangles, area[sample_triangles] / times[sample_triangles].astype(np.float32)


def _triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the area of each triangle, float32[T]."""
    areas = np.empty(len(triangles), np.float32)
    for first in range(0, len(triangles), BLOCK):
        corners = np.take(points, triangles[first : first + BLOCK].T, axis=0).transpose(0, 2, 1)
        (a, b, c), (d, e, f) = corners[1] - corners[0], corners[2] - corners[0]
        # np.cross and np.linalg.norm alone take 1.8 times as long as all of this.
        x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
        areas[first : first + BLOCK] = np.sqrt(x * x + y * y + z * z) / 2
    return areas


def sample_weights(count: int) -> np.ndarray:
    """Return float32[count, 3]: corner weights of points spread evenly in a triangle."""
    u, v = (np.arange(count) * step % 1.0 for step in R2)
    beyond = u + v > 1.0
    u[beyond], v[beyond] = 1.0 - u[beyond], 1.0 - v[beyond]
    return np.stack([1.0 - u - v, u, v], axis=1).astype(np.float32)
