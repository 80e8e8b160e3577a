"""Generated models, so that measurements over size need no downloads. The same on every run.

The torus is lumpy like a scan of one: corners are moved off their grid and diagonals turned at
random, so that vertices have four to eight neighbours.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo.model import Primitive

# File names and descriptions of the models that `write_generated` makes.
GENERATED = {
    "generated_torus": "a lumpy torus of 100,000 triangles",
    "generated_demo": "the model of `make demo`",
    "generated_boxes": "2,000 boxes that share no vertex, hard edges: the paper's named weakness",
}
BOXES = 2000

# The torus: its tube has radius 1.
RADIUS = 2.2  # of the circle that the tube follows
OCTAVES = 7  # of the displacement; each has twice the frequency and half the height of the last
HEIGHT = 0.16  # of the first octave
JITTER = 0.3  # of a grid cell, to each side


def write_generated(folder: Path) -> list[Path]:
    """Writes one .glb for each of GENERATED into a folder; returns their paths."""
    paths = [folder / f"{name}.glb" for name in GENERATED]
    models = [torus(100_000)], demo_model.generate(), [boxes(BOXES)]
    for path, primitives in zip(paths, models):
        demo_model.write_glb(primitives, path)
    return paths


def torus(triangles: int) -> Primitive:
    """A closed torus of about so many triangles (at least 64), with normals and texcoords.

    Vertices are duplicated along the two circles where the texture coordinates wrap around.
    """
    around = max(4, round((triangles / 4) ** 0.5))
    along = max(8, round(triangles / 2 / around))
    random = np.random.default_rng(1)
    cell = np.stack(np.meshgrid(np.arange(along), np.arange(around), indexing="ij"), axis=-1)
    place = ((cell + random.uniform(-JITTER, JITTER, cell.shape)) / (along, around)).reshape(-1, 2)
    positions, normals = _surface(place)
    # One more row and column than cells: positions wrap around, texture coordinates do not.
    wrapped = np.arange(along + 1)[:, None] % along * around + np.arange(around + 1) % around
    turns = np.stack(
        np.broadcast_arrays(
            (np.arange(along + 1) == along)[:, None], np.arange(around + 1) == around
        ),
        axis=-1,
    )
    corners = np.arange((along + 1) * (around + 1), dtype=np.uint32).reshape(along + 1, around + 1)
    wrapped = wrapped.ravel()
    texcoords = place[wrapped] + turns.reshape(-1, 2)
    triangles = _diagonals(corners, random)
    return _grey("torus", triangles, positions[wrapped], normals[wrapped], texcoords)


def _grey(name: str, triangles: np.ndarray, *attributes: np.ndarray) -> Primitive:
    """attributes: positions, normals, texture coordinates."""
    material = (0.6, 0.6, 0.6), 0.0, 0.6
    floats = (values.astype(np.float32) for values in attributes)
    return Primitive(name, name, *material, *floats, triangles.astype(np.uint32))


def boxes(count: int) -> Primitive:
    """Boxes of random size and place; each has 12 triangles and 24 vertices, 4 per side."""
    random = np.random.default_rng(3)
    square = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    sides = [
        np.roll([[sign, u, v] for u, v in square], axis, axis=1)
        for axis in range(3)
        for sign in (-1, 1)
    ]
    corners = np.concatenate(sides)
    normals = np.repeat([side.sum(axis=0) / 4 for side in sides], 4, axis=0)
    quad, flipped = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 2, 1], [0, 3, 2]])
    box = np.concatenate([(quad if side % 2 else flipped) + 4 * side for side in range(6)])
    place, size = random.uniform(-1, 1, (count, 1, 3)), random.uniform(0.002, 0.02, (count, 1, 3))
    positions = (place + corners * size).reshape(-1, 3)
    texcoords = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), (6 * count, 1))
    triangles = (box + 24 * np.arange(count)[:, None, None]).reshape(-1, 3)
    return _grey("boxes", triangles, positions, np.tile(normals, (count, 1)), texcoords)


def _diagonals(corners: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Splits each cell of a grid of vertex ids along a random diagonal; returns uint32[T, 3]."""
    cells = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    a, b, c, d = map(np.ravel, cells)
    one, other = np.stack([a, c, b, a, d, c], axis=1), np.stack([a, d, b, b, d, c], axis=1)
    return np.where(random.random(len(a))[:, None] < 0.5, one, other).reshape(-1, 3)


def _surface(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and unit normals [V, 3] at places [V, 2] in [0, 1) on the torus."""
    u, v = (2 * np.pi * place).T
    height, along, around = _displacement(u, v)
    tube = 1 + height
    ring = np.stack([np.cos(u), 0 * u, np.sin(u)], 1)
    centre = np.stack([-np.sin(u), 0 * u, np.cos(u)], 1)
    up = np.array([0.0, 1.0, 0.0])
    outward = np.cos(v)[:, None] * ring + np.sin(v)[:, None] * up
    positions = RADIUS * ring + tube[:, None] * outward
    by_u = (RADIUS + tube * np.cos(v))[:, None] * centre + along[:, None] * outward
    by_v = (
        tube[:, None] * (np.cos(v)[:, None] * up - np.sin(v)[:, None] * ring)
        + around[:, None] * outward
    )
    return positions, _unit(np.cross(by_v, by_u))


def _displacement(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height over the tube, and its derivatives with respect to u and v."""
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


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """float64[V, 3]: unit normals, or zero."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    faces = np.cross(b - a, c - a)
    sums = [
        sum(np.bincount(triangles[:, k], faces[:, axis], len(points)) for k in range(3))
        for axis in range(3)
    ]
    return _unit(np.stack(sums, axis=1))


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
