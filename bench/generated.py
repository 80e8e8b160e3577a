"""A generated model of any size, so that measurements over size need no downloads: a lumpy torus, like a scan of one.

Corners are moved off their grid and diagonals turned at random, so that vertices have four to eight neighbours; the same
on every run.
"""

from __future__ import annotations

import numpy as np

from gltf_meshlet.demo.model import Part

OCTAVES = (
    7  # of the displacement, each of twice the frequency and half the height of the one before
)
HEIGHT = 0.16  # of the first octave, of a tube of radius 1
RADIUS = 2.2  # of the torus's own circle
JITTER = 0.3  # of a cell, to each side


def torus(triangles: int) -> Part:
    """About as many triangles (at least 64) as asked for, with normals and texture coordinates.

    The surface is closed; vertices along the two circles where the texture coordinates wrap round are double.
    """
    around = max(4, round((triangles / 4) ** 0.5))
    along = max(8, round(triangles / 2 / around))
    random = np.random.default_rng(1)
    cell = np.stack(np.meshgrid(np.arange(along), np.arange(around), indexing="ij"), axis=-1)
    place = ((cell + random.uniform(-JITTER, JITTER, cell.shape)) / (along, around)).reshape(-1, 2)
    positions, normals = _surface(place)
    # One row and one column more than there are cells: the texture coordinates end at the circles where positions begin again.
    wrapped = np.arange(along + 1)[:, None] % along * around + np.arange(around + 1) % around
    turns = np.stack(
        np.broadcast_arrays(
            (np.arange(along + 1) == along)[:, None], np.arange(around + 1) == around
        ),
        axis=-1,
    )
    corners = np.arange((along + 1) * (around + 1), dtype=np.uint32).reshape(along + 1, around + 1)
    wrapped = wrapped.ravel()
    return Part(
        "torus",
        "torus",
        (0.6, 0.6, 0.6),
        0.0,
        0.6,
        positions[wrapped].astype(np.float32),
        normals[wrapped].astype(np.float32),
        (place[wrapped] + turns.reshape(-1, 2)).astype(np.float32),
        _diagonals(corners, random),
    )


def _diagonals(corners: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Two triangles for each cell of a grid of vertex numbers, divided one way or the other: uint32[T, 3]."""
    a, b, c, d = (
        corners[:-1, :-1].ravel(),
        corners[1:, :-1].ravel(),
        corners[1:, 1:].ravel(),
        corners[:-1, 1:].ravel(),
    )
    one, other = np.stack([a, c, b, a, d, c], axis=1), np.stack([a, d, b, b, d, c], axis=1)
    return np.ascontiguousarray(
        np.where(random.random(len(a))[:, None] < 0.5, one, other).reshape(-1, 3)
    )


def _surface(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and unit normals [V, 3] at places [V, 2] in [0, 1) on the torus."""
    u, v = (2 * np.pi * place).T
    height, along, around = _displacement(u, v)
    tube = 1 + height
    ring, centre = (
        np.stack([np.cos(u), 0 * u, np.sin(u)], 1),
        np.stack([-np.sin(u), 0 * u, np.cos(u)], 1),
    )
    up = np.array([0.0, 1.0, 0.0])
    outward = np.cos(v)[:, None] * ring + np.sin(v)[:, None] * up
    positions = RADIUS * ring + tube[:, None] * outward
    by_u = (RADIUS + tube * np.cos(v))[:, None] * centre + along[:, None] * outward
    by_v = (
        tube[:, None] * (np.cos(v)[:, None] * up - np.sin(v)[:, None] * ring)
        + around[:, None] * outward
    )
    normals = np.cross(by_v, by_u)
    return positions, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _displacement(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height over the tube, and its derivatives by u and by v."""
    random = np.random.default_rng(2)
    height, along, around = (np.zeros_like(u) for _ in range(3))
    for octave in range(OCTAVES):
        frequency, strength = 2**octave, HEIGHT / 2**octave
        for _ in range(3):
            m, n = random.integers(1, 2 * frequency + 1), random.integers(-frequency, frequency + 1)
            phase = m * u + n * v + random.uniform(0, 2 * np.pi)
            height += strength / 3 * np.sin(phase)
            along += strength / 3 * m * np.cos(phase)
            around += strength / 3 * n * np.cos(phase)
    return height, along, around
