"""Encodes groups before they are simplified, to see whether they fit in a page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.ranges import occurring

SMALLEST_GROUP = 4  # clusters in a group
TIGHTER = 0.9  # groups are made smaller than the estimate allows: the largest group varies
# The most bytes of connectivity for a triangle; vertices take no more than their integers.
CONNECTIVITY = 0.5


def shrink_group_size(group_size: int, fraction: float) -> int:
    """Return the next group size to try, if the largest group must shrink to this fraction."""
    return max(min(int(TIGHTER * fraction * group_size), group_size - 1), SMALLEST_GROUP)


@dataclass(frozen=True)
class Pilot:
    """Encodes single groups of a surface.

    Attributes:
        streams: the stream table; values: uint32[V, elements] of each stream.
        position_ids, points: uint32[V], float32[V, 3]: of the surface.
        page_limit: bytes that a page should not exceed.
    """

    streams: list[Stream]
    values: list[np.ndarray]
    position_ids: np.ndarray
    points: np.ndarray
    page_limit: int

    def page_fraction(
        self,
        triangles: np.ndarray,
        disk_begin: np.ndarray,
        cluster_begin: np.ndarray,
        finer_group: np.ndarray,
    ) -> float:
        """Return the size of a group as a fraction of a page; 0 if it certainly fits.

        Args:
            triangles: uint32[T, 3], as in ClusterRanges.
            disk_begin: int64[D + 1], as in ClusterRanges.
            cluster_begin: int64[N + 1], as in ClusterRanges.
            finer_group: int64[N], as in ClusterSet.
        """
        vertices = len(occurring(triangles, len(self.points)))
        bits = sum(stream.elements * stream.bits for stream in self.streams)
        if vertices * bits / 8 + CONNECTIVITY * len(triangles) < self.page_limit:
            return 0.0
        layer = np.zeros(len(triangles), np.int64)
        if _repeats_edge(triangles, len(self.points)):  # as _find_clashes of gltf_ext.lod.writing
            layer = np.repeat(finer_group + 1, np.diff(disk_begin[cluster_begin]))
        keys = (layer * len(self.points))[:, None] + triangles
        unique_keys, local_indices = np.unique(keys, return_inverse=True)
        vertex_ids = unique_keys % len(self.points)
        _, ids = np.unique(
            unique_keys - vertex_ids + self.position_ids[vertex_ids], return_inverse=True
        )
        view, _ = _codec.encode(
            local_indices.reshape(-1, 3).astype(np.uint32),
            ids.astype(np.uint32),
            self.points[vertex_ids],
            self.streams,
            [values[vertex_ids] for values in self.values],
            threads=1,
            meshlets=(
                np.arange(len(triangles), dtype=np.uint32),
                disk_begin.astype(np.uint32),
                cluster_begin.astype(np.uint32),
                np.array([0, len(cluster_begin) - 1], np.uint32),
            ),
        )
        return len(view) / self.page_limit


def _repeats_edge(triangles: np.ndarray, vertices: int) -> bool:
    """Return whether two triangles pass an edge in one direction."""
    edges = triangles.astype(np.int64) * vertices + np.roll(triangles, -1, axis=1)
    return bool(len(np.unique(edges)) < edges.size)
