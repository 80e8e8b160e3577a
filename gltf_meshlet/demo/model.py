"""The demo's model, generated: the same on every run and machine, and nothing to download.

Five primitives in three meshes, chosen to exercise a codec: a ridged torus knot (smooth, with
wrap-around uv seams), a displaced sphere unfolded into an atlas of six islands, a gear (hard edges
everywhere), and a turned plinth with its inlay. Units are metres, y is up.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext.document.accessors import add_accessor, bounds, set_bounds
from gltf_ext.document.container import model_files
from gltf_ext.document.document import Document
from gltf_ext.files import write_files


@dataclass(frozen=True)
class Primitive:
    """One glTF primitive with its material.

    Attributes:
        mesh: the name of the glTF mesh it belongs to.
        color: linear RGB in [0, 1].
        metallic, roughness: in [0, 1].
        positions, normals: float32[V, 3].
        texcoords: float32[V, 2].
        triangles: uint32[T, 3], counter-clockwise.
    """

    name: str
    mesh: str
    color: tuple[float, float, float]
    metallic: float
    roughness: float
    positions: np.ndarray
    normals: np.ndarray
    texcoords: np.ndarray
    triangles: np.ndarray


# (positions, normals, texcoords, triangles), as Primitive has them.
Shape = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def generate() -> list[Primitive]:
    """The five primitives; those of a mesh are neighbours."""
    brass, ceramic, steel = (0.80, 0.55, 0.25), (0.16, 0.42, 0.60), (0.55, 0.57, 0.60)
    return [
        Primitive("knot", "sculpture", brass, 1.0, 0.35, *_knot()),
        Primitive("planet", "sculpture", ceramic, 0.0, 0.5, *_planet()),
        Primitive("gear", "gear", steel, 1.0, 0.45, *_gear()),
        Primitive("plinth", "base", (0.72, 0.68, 0.62), 0.0, 0.8, *_plinth()),
        Primitive("inlay", "base", (0.35, 0.12, 0.10), 0.0, 0.6, *_inlay()),
    ]


# --- shapes ---


def _knot(along: int = 480, around: int = 32) -> Shape:
    """A (2, 3) torus knot whose tube carries five twisted ridges."""
    t = np.arange(along)[:, None] * (2 * np.pi / along)
    center = _knot_curve(t)
    tangent = unit(_knot_curve(t + 1e-4) - _knot_curve(t - 1e-4))
    ring = np.concatenate([np.cos(2 * t), 0 * t, np.sin(2 * t)], axis=1)  # the torus's own circle
    normal = center - ring
    normal = unit(normal - tangent * np.sum(normal * tangent, axis=1, keepdims=True))
    binormal = np.cross(normal, tangent)
    angle = np.arange(around) * (2 * np.pi / around)
    radius = 0.2 * (1 + 0.13 * np.cos(5 * angle + 10 * t))
    tube = center[:, None] + radius[..., None] * (
        np.cos(angle)[:, None] * normal[:, None] + np.sin(angle)[:, None] * binormal[:, None]
    )
    wrapped = (np.arange(along + 1) % along)[:, None] * around + np.arange(around + 1) % around
    standing = tube.reshape(-1, 3)[:, [0, 2, 1]] * [0.5, 0.5, -0.5] + [0, 0.78, 0]
    return _smooth(standing, wrapped, _unit_grid(along, around))


def _knot_curve(t: np.ndarray) -> np.ndarray:
    swing = 1 + 0.42 * np.cos(3 * t)
    return np.concatenate(
        [swing * np.cos(2 * t), 0.42 * np.sin(3 * t), swing * np.sin(2 * t)], axis=1
    )


def _planet(cells: int = 36) -> Shape:
    """A displaced sphere made from a cube; each side of the cube is an island of the atlas."""
    steps = np.arange(cells + 1)
    i, j = np.meshgrid(steps, steps, indexing="ij")
    far, near = np.full_like(i, cells), np.zeros_like(i)
    sides = [(far, i, j), (j, far, i), (i, j, far), (near, j, i), (i, near, j), (j, i, near)]
    lattice = np.stack([np.stack(side, axis=-1) for side in sides]).reshape(-1, 3)
    # Points on the cube's edges lie on two or three sides: compute them once, so that seams match.
    unique, index = np.unique(lattice, axis=0, return_inverse=True)
    direction = unit(np.tan((unique / cells - 0.5) * (np.pi / 2)))
    x, y, z = direction.T
    bumps = (
        0.05 * np.sin(5 * x + 2 * z) * np.cos(4 * y - x)
        + 0.025 * np.sin(11 * y + 3 * x) * np.sin(9 * z + 1)
        + 0.012 * np.sin(23 * x + 17 * y) * np.sin(19 * z - 13 * x)
    )
    points = direction * (0.34 * (1 + bumps))[:, None] + [-0.92, 0.355, 0.62]
    side_uv = _unit_grid(cells, cells)
    islands = [(side_uv * 0.31 + [0.01 + 0.333 * (k % 3), 0.01 + 0.5 * (k // 3)]) for k in range(6)]
    vertices = index.reshape(6, cells + 1, cells + 1)
    return _smooth(points, vertices, np.concatenate(islands))


def _gear(teeth: int = 18, rings: int = 6) -> Shape:
    """A spur gear with a bore. Its vertices are split along every hard edge."""
    # (share of the tooth's angle, radius): root, flank, tip, flank
    tooth = np.array(
        [
            (0.00, 0.37),
            (0.10, 0.37),
            (0.20, 0.37),
            (0.30, 0.37),
            (0.37, 0.405),
            (0.43, 0.44),
            (0.50, 0.475),
            (0.60, 0.475),
            (0.70, 0.475),
            (0.77, 0.44),
            (0.83, 0.405),
            (0.90, 0.37),
        ]
    )
    angle = ((np.arange(teeth)[:, None] + tooth[:, 0]) * (2 * np.pi / teeth)).ravel()
    rim = np.tile(tooth[:, 1], teeth)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    blend = np.linspace(0, 1, rings + 1)[:, None]
    radius = 0.16 * (1 - blend) + rim * blend
    disc = radius[..., None] * circle
    top, bottom, bore, outline = 0.09, -0.09, disc[0], disc[-1]
    pieces = [
        _gear_face(disc, top),
        _gear_face(disc[::-1], bottom),
        _wall(outline, np.roll(outline, -1, axis=0), bottom, top),
        _wall(np.roll(bore, -1, axis=0), bore, bottom, top),
    ]
    positions, normals, texcoords, triangles = _merge(pieces)
    tilt = _rotation(2, -0.25) @ _rotation(0, 0.95) @ _rotation(1, 0.5)
    return _finish(positions @ tilt.T + [0.80, 0.44, 0.72], normals @ tilt.T, texcoords, triangles)


def _gear_face(disc: np.ndarray, height: float) -> Shape:
    """A flat ring of the gear at a height. disc: [rings + 1, n, 2], innermost first for the top."""
    rings, count = disc.shape[0] - 1, disc.shape[1]
    points = np.stack(
        [disc[..., 0], np.full(disc.shape[:2], height), -disc[..., 1]], axis=-1
    ).reshape(-1, 3)
    normals = np.tile([0.0, np.sign(height), 0.0], (len(points), 1))
    closed = np.arange(rings + 1)[:, None] * count + np.arange(count + 1) % count
    return points, normals, disc.reshape(-1, 2) + 0.5, _quads(closed)


def _wall(start: np.ndarray, end: np.ndarray, bottom: float, top: float, levels: int = 4) -> Shape:
    """Upright rectangles from start[i] to end[i], [n, 2] each, that share no vertices."""
    height = np.linspace(bottom, top, levels + 1)
    ends = np.stack([start, end], axis=1)
    points = np.empty((len(start), 2, levels + 1, 3))
    points[..., 0], points[..., 2] = ends[..., None, 0], -ends[..., None, 1]
    points[..., 1] = height
    along = end - start
    outward = unit(np.stack([along[:, 1], 0 * along[:, 0], along[:, 0]], axis=1))
    normals = np.broadcast_to(outward[:, None, None], points.shape).reshape(-1, 3)
    share = (np.arange(len(start))[:, None] + [0, 1]) / len(start)
    texcoords = np.empty((*points.shape[:-1], 2))
    texcoords[..., 0], texcoords[..., 1] = share[..., None], (height - bottom) / (top - bottom)
    cell = _quads(np.arange(2 * (levels + 1)).reshape(2, levels + 1))
    triangles = (cell + np.arange(len(start))[:, None, None] * (2 * (levels + 1))).reshape(-1, 3)
    return points.reshape(-1, 3), normals, texcoords.reshape(-1, 2), triangles


def _plinth(around: int = 144) -> Shape:
    """A lathe: straight profile segments are smooth around the axis and meet in hard edges."""
    profile = np.array(
        [
            (1.00, 0.0),
            (1.40, 0.0),
            (1.46, -0.05),
            (1.46, -0.14),
            (1.40, -0.17),
            (1.52, -0.24),
            (1.60, -0.26),
            (1.60, -0.36),
            (0.0, -0.36),
        ]
    )
    pieces = [_lathe(profile[k], profile[k + 1], around) for k in range(len(profile) - 1)]
    return _finish(*_merge(pieces))


def _inlay(around: int = 144) -> Shape:
    return _finish(*_lathe(np.array((0.0, 0.0)), np.array((1.0, 0.0)), around))


def _lathe(start: np.ndarray, end: np.ndarray, around: int) -> Shape:
    """The surface of revolution of a segment (radius, height)..(radius, height), outside left."""
    length = np.hypot(*(end - start))
    rows = max(2, int(np.ceil(length / 0.07)))
    share = np.linspace(0, 1, rows + 1)[:, None]
    radius, height = start[0] + (end - start)[0] * share, start[1] + (end - start)[1] * share
    angle = np.arange(around) * (2 * np.pi / around)
    points = np.stack([radius * np.cos(angle), height + 0 * angle, radius * np.sin(angle)], axis=-1)
    slope = (end - start) / length
    normals = np.stack(
        [-slope[1] * np.cos(angle), slope[0] + 0 * angle, -slope[1] * np.sin(angle)], axis=-1
    )
    normals = np.broadcast_to(normals, points.shape)
    wrapped = np.arange(rows + 1)[:, None] * around + np.arange(around + 1) % around
    texcoords = _unit_grid(rows, around)[:, ::-1]
    triangles = _quads(np.arange(wrapped.size).reshape(wrapped.shape))[:, ::-1]
    vertices = wrapped.ravel()
    points, normals = points.reshape(-1, 3)[vertices], normals.reshape(-1, 3)[vertices]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    # The axis collapses triangles to a line.
    return points, normals, texcoords, triangles[np.any(np.cross(b - a, c - a) != 0, axis=1)]


# --- building blocks ---


def _smooth(points: np.ndarray, grids: np.ndarray, texcoords: np.ndarray) -> Shape:
    """A surface with normals averaged across seams. grids: [..., n, m] indices into the points."""
    grids = grids.reshape(-1, *grids.shape[-2:])
    corners = np.arange(grids.size).reshape(grids.shape)
    triangles = np.concatenate([_quads(grid) for grid in corners])
    vertices = grids.ravel()
    points = _grid_aligned(points)
    normals = _averaged_normals(points, vertices[triangles])
    return _finish(points[vertices], normals[vertices], texcoords, triangles)


def _quads(grid: np.ndarray) -> np.ndarray:
    """Two triangles for every cell of an [n, m] grid of vertex ids."""
    a, b = grid[:-1, :-1].ravel(), grid[1:, :-1].ravel()
    c, d = grid[1:, 1:].ravel(), grid[:-1, 1:].ravel()
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)


def _unit_grid(rows: int, columns: int) -> np.ndarray:
    u, v = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    return np.stack([u, v], axis=-1).reshape(-1, 2)


def _averaged_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros((len(points), 3))
    for k in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(triangles[:, k], face[:, axis], len(points))
    return unit(total)


def _merge(pieces: list[Shape]) -> Shape:
    offsets = np.cumsum([0] + [len(piece[0]) for piece in pieces[:-1]])
    positions, normals, texcoords = (
        np.concatenate([piece[k] for piece in pieces]) for k in range(3)
    )
    triangles = np.concatenate([piece[3] + offset for piece, offset in zip(pieces, offsets)])
    return positions, normals, texcoords, triangles


def _finish(
    points: np.ndarray, normals: np.ndarray, texcoords: np.ndarray, triangles: np.ndarray
) -> Shape:
    return (
        _grid_aligned(points).astype(np.float32),
        unit(_grid_aligned(normals)).astype(np.float32),
        texcoords.astype(np.float32),
        triangles.astype(np.uint32),
    )


def _grid_aligned(values: np.ndarray) -> np.ndarray:
    """Rounds to 2^-18: the last bits of sine and cosine differ between machines."""
    rounded: np.ndarray = np.round(np.asarray(values) * 2.0**18) / 2.0**18
    return rounded


def unit(vectors: np.ndarray) -> np.ndarray:
    """The vectors [..., 3], none of them zero, with length 1."""
    result: np.ndarray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def _rotation(axis: int, angle: float) -> np.ndarray:
    """Turns about axis 0, 1 or 2, counter-clockwise seen from its tip."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[j, i], matrix[i, j] = np.sin(angle), -np.sin(angle)
    return matrix


def meshlet_colors(meshlets: np.ndarray) -> np.ndarray:
    """Linear RGB float[T, 3] for meshlet numbers int[T]. Successive numbers get different hues."""
    # Multiples of the golden ratio and of the plastic number spread evenly over [0, 1).
    hue = meshlets * 0.61803398875 % 1
    value = 0.55 + 0.3 * (meshlets * 0.7548776662 % 1)
    wheel = np.clip(np.abs((hue[:, None] + [0, 2 / 3, 1 / 3]) % 1 * 6 - 3) - 1, 0, 1)
    colors: np.ndarray = value[:, None] * (0.45 + 0.55 * wheel)
    return colors


def write_glb(primitives: list[Primitive], path: str | Path) -> None:
    """Writes a .glb of `document_of` the primitives."""
    write_files(model_files(document_of(primitives), Path(path)), input_files=())


def document_of(primitives: list[Primitive]) -> Document:
    """32-bit indices, one node per mesh, one material per primitive."""
    meshes = list(dict.fromkeys(primitive.mesh for primitive in primitives))
    document = Document(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(meshes)))}],
            "nodes": [{"name": name, "mesh": mesh} for mesh, name in enumerate(meshes)],
            "meshes": [{"name": name, "primitives": []} for name in meshes],
            "materials": [_material(primitive) for primitive in primitives],
        }
    )
    for material, primitive in enumerate(primitives):
        names = {
            "POSITION": add_accessor(document, primitive.positions),
            "NORMAL": add_accessor(document, primitive.normals),
            "TEXCOORD_0": add_accessor(document, primitive.texcoords),
        }
        set_bounds(document.accessors[names["POSITION"]], *bounds(primitive.positions))
        indices = add_accessor(document, primitive.triangles.reshape(-1, 1))
        mesh = document.meshes[meshes.index(primitive.mesh)]
        mesh["primitives"].append({"attributes": names, "indices": indices, "material": material})
    return document


def _material(primitive: Primitive) -> dict[str, Any]:
    factors = {
        "baseColorFactor": [*primitive.color, 1.0],
        "metallicFactor": primitive.metallic,
        "roughnessFactor": primitive.roughness,
    }
    return {"name": primitive.name, "pbrMetallicRoughness": factors}
