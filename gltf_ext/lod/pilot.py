"""Encodes groups before they are simplified, to see whether they fit in a page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.ranges import occurring

SMALLEST = 4  # clusters in a group
TIGHTER = 0.9  # than what would fit: the largest group varies
# Bytes of connectivity that a triangle takes at most; vertices take no more than their integers.
CONNECTIVITY = 0.5


def smaller(group_size: int, share: float) -> int:
    """The size of groups to try next, where the largest one must shrink to this share."""
    return max(min(int(TIGHTER * share * group_size), group_size - 1), SMALLEST)


@dataclass(frozen=True)
class Pilot:
    """What a group is encoded with.

    Attributes:
        streams, values: the stream table, and uint32[V, elements] of each.
        ids, points: of the surface: uint32[V], float32[V, 3].
        page_bytes: largest page.
    """

    streams: list[Stream]
    values: list[np.ndarray]
    ids: np.ndarray
    points: np.ndarray
    page_bytes: int

    def share_of_page(
        self,
        triangles: np.ndarray,
        disk_begin: np.ndarray,
        cluster_begin: np.ndarray,
        refined: np.ndarray,
    ) -> float:
        """The bytes of a group over those of a page; 0 where they cannot be too many.

        Arguments as in Clusters and ClusterSet.
        """
        vertices = len(occurring(triangles, len(self.points)))
        bits = sum(stream.elements * stream.bits for stream in self.streams)
        if vertices * bits / 8 + CONNECTIVITY * len(triangles) < self.page_bytes:
            return 0.0
        layer = np.zeros(len(triangles), np.int64)
        if _repeats_edge(triangles, len(self.points)):  # as _separate of gltf_ext.lod.writing
            layer = np.repeat(refined + 1, np.diff(disk_begin[cluster_begin]))
        keys = (layer * len(self.points))[:, None] + triangles
        made, local = np.unique(keys, return_inverse=True)
        used = made % len(self.points)
        _, ids = np.unique(made - used + self.ids[used], return_inverse=True)
        view, _ = _codec.encode(
            local.reshape(-1, 3).astype(np.uint32),
            ids.astype(np.uint32),
            self.points[used],
            self.streams,
            [values[used] for values in self.values],
            threads=1,
            meshlets=(
                np.arange(len(triangles), dtype=np.uint32),
                disk_begin.astype(np.uint32),
                cluster_begin.astype(np.uint32),
                np.array([0, len(cluster_begin) - 1], np.uint32),
            ),
        )
        return len(view) / self.page_bytes


def _repeats_edge(triangles: np.ndarray, vertices: int) -> bool:
    """Whether two triangles pass an edge in one direction."""
    edges = triangles.astype(np.int64) * vertices + np.roll(triangles, -1, axis=1)
    return bool(len(np.unique(edges)) < edges.size)
