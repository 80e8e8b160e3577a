"""Nearest points of triangles."""

from __future__ import annotations

import numpy as np


def nearest_weights(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return float64[N, 3]: corner weights of the nearest point of each triangle, [N, 3, 3].

    Tries the three edges and the projection into the triangle, so that degenerate ones need no
    cases of their own.
    """
    best = np.full(len(points), np.inf)
    weights = np.zeros((len(points), 3))

    def offer(candidate: np.ndarray, is_valid: np.ndarray) -> None:
        apart = np.einsum("nk,nkc->nc", candidate, corners) - points
        distance = _dot(apart, apart)
        better = is_valid & (distance < best)
        best[better], weights[better] = distance[better], candidate[better]

    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        length = _dot(b - a, b - a)
        along = _dot(points - a, b - a) / np.where(length > 0.0, length, 1.0)
        candidate = np.zeros((len(points), 3))
        candidate[:, (k + 1) % 3] = along.clip(0.0, 1.0)
        candidate[:, k] = 1.0 - candidate[:, (k + 1) % 3]
        offer(candidate, np.ones(len(points), bool))
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = _dot(normal, normal)
    inside = np.stack(
        [
            _dot(np.cross(q - p, points - p), normal) / np.where(area > 0.0, area, 1.0)
            for p, q in ((b, c), (c, a), (a, b))
        ],
        axis=1,
    )
    offer(inside, (area > 0.0) & (inside >= 0.0).all(axis=1))
    return weights


def _dot(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return float64[N]: the dot products of vectors, [N, 3]."""
    result: np.ndarray = np.einsum("nc,nc->n", first, second)
    return result
