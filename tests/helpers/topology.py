"""Closed surfaces, and what their triangles connect."""

from __future__ import annotations

import numpy as np


def torus(columns, rows, *, offset=0.0, noise=0.0, seed=0):
    """A closed surface: (positions float32[V, 3], triangles uint32[T, 3])."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a, b = 2 * np.pi * u.ravel() / columns, 2 * np.pi * v.ravel() / rows
    radius = 2 + np.cos(b) + noise * np.random.default_rng(seed).normal(size=len(a))
    points = np.stack([radius * np.cos(a) + offset, radius * np.sin(a), np.sin(b)], axis=1)
    number = np.arange(columns * rows).reshape(columns, rows)
    right, up = np.roll(number, -1, 0), np.roll(number, -1, 1)
    both = np.roll(right, -1, 1)
    quads = np.stack([number, right, both, number, both, up], axis=-1)
    return points.astype(np.float32), quads.reshape(-1, 3).astype(np.uint32)


def topology(triangles):
    """(vertices, boundary edges, islands) of triangles."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]],
                                    triangles[:, [2, 0]]]), axis=1)  # fmt: skip
    _, counts = np.unique(edges, axis=0, return_counts=True)
    island = np.arange(int(triangles.max()) + 1)
    while (island[edges[:, 0]] != island[edges[:, 1]]).any():
        low = island[edges].min(axis=1)
        np.minimum.at(island, island[edges].ravel(), np.repeat(low, 2))
        island = island[island]
    used = np.unique(triangles)
    return len(used), int((counts == 1).sum()), len(np.unique(island[used]))
