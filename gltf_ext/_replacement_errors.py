"""The codec's measure of what replaces parts of level 0: the part of it that keeps state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gltf_ext._library import (
    Floats,
    Handle,
    Result,
    Samples,
    UInt32s,
    array_of,
    functions,
    groups_of,
    pointers,
)


class ReplacementErrors(Handle):
    """Level 0, to measure what replaces parts of it. Keeps its arrays."""

    def __init__(
        self,
        shapes: Sequence[Floats],
        triangles: UInt32s,
        begin: UInt32s,
        vertex_fraction: float,
        threads: int = 0,
    ) -> None:
        """Place samples in level 0.

        Args:
            shapes: float32[V, 3] each: positions at rest, and with each morph target.
            triangles: uint32[T, 3]: level 0, group after group.
            begin: uint32[G + 1]: the first triangle of each group, and T.
            vertex_fraction: the fraction of the area of level 0 that its vertices represent.
            threads: number of threads, 0 for all processors.

        Raises:
            ValueError: arrays do not fit each other.
        """
        super().__init__()
        self._shapes = [array_of(shape, np.float32, -1, 3) for shape in shapes]
        self._threads, vertices = threads, {len(shape) for shape in self._shapes}
        if len(vertices) > 1:
            raise ValueError("shapes differ in length")
        level_0 = groups_of(triangles, begin), vertex_fraction, threads
        functions.open_surface(
            pointers(self._shapes), len(shapes), sum(vertices), *level_0, self.out
        )

    def measure(
        self,
        old_triangles: UInt32s,
        old_begin: UInt32s,
        new_triangles: UInt32s,
        new_begin: UInt32s,
        measured_groups: UInt32s,
        sample_vertices: UInt32s,
        sample_begin: UInt32s,
        areas: Floats,
    ) -> tuple[Floats, UInt32s, UInt32s, UInt32s, Floats]:
        """Measure the distance between groups of triangles and their replacements.

        Args:
            old_triangles: uint32[T, 3]: a level, group after group.
            old_begin: uint32[G + 1]: the first triangle of each group, and T.
            new_triangles: uint32[N, 3]: the replacements, in the same order.
            new_begin: uint32[G + 1]: the first triangle of each replacement, and N.
            measured_groups: uint32[K]: the groups to measure.
            sample_vertices: uint32[S]: vertices of level 0 that earlier levels have removed, group
                after group.
            sample_begin: uint32[K + 1]: the first sample of each measured group, and S.
            areas: float32[S]: the area of level 0 that each sample represents.

        Returns:
            float32[K]: the distance between each replacement and level 0 that 99.9 % of either
            surface keeps; uint32[R]: the samples for the next level; uint32[R]: the index in
            `new_triangles` of the nearest triangle of the same group; uint32[K + 1]: the first
            sample of each group, and R; float32[R]: their areas.

        Raises:
            ValueError: arrays do not fit each other.
        """
        measured_groups = array_of(measured_groups, np.uint32, -1)
        sample_vertices = array_of(sample_vertices, np.uint32, -1)
        sample_begin, areas = array_of(sample_begin, np.uint32, -1), array_of(areas, np.float32, -1)
        if len(sample_begin) != len(measured_groups) + 1:
            raise ValueError("begins do not rise from 0 to the number of vertices")
        if len(areas) != len(sample_vertices):
            raise ValueError("areas differ in length")
        vertices = Samples(
            vertices=sample_vertices, begin=sample_begin, areas=areas, count=len(sample_vertices)
        )
        groups = groups_of(old_triangles, old_begin), groups_of(new_triangles, new_begin)
        result = Result()
        selection = measured_groups.ctypes, len(measured_groups), vertices
        functions.measure(self, *groups, *selection, self._threads, result.out)
        distances, areas = result.array(0, np.float32), result.array(4, np.float32)
        return distances, result.array(1), result.array(2), result.array(3), areas

    def nearest(self, points: Floats) -> UInt32s:
        """Return uint32[N]: the triangle of level 0, at rest, that is nearest to each point.

        points: float32[N, 3].
        """
        points = array_of(points, np.float32, -1, 3)
        triangles = np.empty(len(points), np.uint32)
        functions.get_nearest(self, points.ctypes, len(points), self._threads, triangles.ctypes)
        return triangles
