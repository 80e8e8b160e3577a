"""Cuts through levels of detail, certified from the decoded integers of all pages.

Works on files, with the specification's tables but none of the rules of `gltf_ext.lod.cuts`.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gltf_ext import _codec
from gltf_ext.lod import LodPrimitive

Edges = tuple[np.ndarray, np.ndarray, np.ndarray]


def edges_of(triangles: np.ndarray, count: int) -> Edges:
    """(number of the undirected edge, +1 or -1, its triangle) of each directed edge between
    different positions. Triangles hold position numbers below count."""
    start = triangles.reshape(-1).astype(np.int64)
    end = np.roll(triangles, -1, axis=1).reshape(-1).astype(np.int64)
    kept = np.flatnonzero(start != end)
    start, end = start[kept], end[kept]
    number = np.minimum(start, end) * count + np.maximum(start, end)
    return number, np.where(start < end, 1, -1), kept // 3


class Certifier:
    """All clusters of a primitive, by integer positions."""

    def __init__(self, primitive: LodPrimitive, pages: list[bytes] | None = None) -> None:
        tables = primitive.tables
        self.tables = tables
        blobs = pages or [primitive.page(p) for p in range(len(tables.pages))]
        corners = []
        for blob in blobs:
            triangles, values = _codec.decode(blob, threads=1)
            corners.append(values[0][triangles])
        cells = np.concatenate(corners).reshape(-1, 3)
        rows = np.ascontiguousarray(cells).view(np.uint8)
        ids, self.count = _codec.weld(rows)
        self.triangles = ids.reshape(-1, 3)
        self.owner = np.repeat(np.arange(len(tables.cluster_group)), primitive.cluster_triangles)
        number, sign, triangle = edges_of(self.triangles, self.count)
        edges, column = np.unique(number, return_inverse=True)
        shape = (len(tables.cluster_group), len(edges))
        # The boundary of a cut is the sum of those of its clusters.
        boundary = sparse.coo_matrix((sign, (self.owner[triangle], column)), shape).tocsr()
        self.boundary = boundary.T.tocsr()
        self.ends = np.stack([edges // self.count, edges % self.count], axis=1)
        left = self.boundary @ (tables.finer_group < 0).astype(np.int64)
        self.border = np.zeros(self.count, bool)  # positions on the border of level 0
        self.border[self.ends[left != 0].reshape(-1)] = True

    @property
    def is_closed(self) -> bool:
        return not self.border.any()

    def has_no_cracks(self, drawn: np.ndarray) -> bool:
        """Whether directed edges cancel, or join positions on the border of level 0."""
        left = self.ends[self.boundary @ drawn.astype(np.int64) != 0]
        return bool(self.border[left].all())

    def covers_once(self, drawn: np.ndarray) -> bool:
        """Whether the cut is level 0 with whole groups replaced, each once.

        With replaced[g] 0 or 1: drawn(c) = replaced[finer of c] (1 in level 0) - replaced[group
        of c]. So replaced[g] follows from each cluster of g, fine to coarse, and must be the same.
        """
        tables = self.tables
        group, finer = tables.cluster_group, tables.finer_group
        replaced = np.zeros(len(tables.groups), np.int64)
        for level in range(tables.level_count):
            here = np.flatnonzero(tables.group_level[group] == level)
            made = np.where(finer[here] < 0, 1, replaced[finer[here]])
            value = made - drawn[here]
            low = np.full(len(replaced), 2)
            high = np.full(len(replaced), -1)
            np.minimum.at(low, group[here], value)
            np.maximum.at(high, group[here], value)
            groups = np.unique(group[here])
            if (low != high)[groups].any() or (low < 0)[groups].any() or (high > 1)[groups].any():
                return False
            replaced[groups] = low[groups]
        return not replaced[np.isinf(tables.groups["error"])].any()


def random_views(primitive: LodPrimitive, count: int, random: np.random.Generator):
    """(eye, pixels per unit, threshold in pixels): from inside the model to ten diagonals away,
    with thresholds at which levels change somewhere on it."""
    groups = primitive.tables.groups
    error = groups["error"].astype(np.float64)
    errors = np.sort(error[np.isfinite(error) & (error > 0)])
    centre, size = groups["centre"][0].astype(np.float64), 2.0 * float(groups["radius"][0])
    for _ in range(count):
        direction = random.normal(size=3)
        distance = size * 10 ** random.uniform(-1, 1)
        chosen = np.exp(random.uniform(np.log(errors[len(errors) // 10]), np.log(errors[-1])))
        eye = centre + direction / np.linalg.norm(direction) * distance
        pixels = 1000.0
        yield tuple(eye), pixels, chosen * pixels / distance
