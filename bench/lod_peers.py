"""Discrete chains: whole primitives, each with half the triangles of the one before. For bench.lod.

A viewer without levels of detail loads and draws one of them: the coarsest whose measured error is
within the allowed one. They are made by meshoptimizer's simplification and keep all attributes.
"""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import numpy as np

import gltf_ext
from bench import peers
from bench.common import BITS, progress
from gltf_ext.checks.samples import surface_distances
from gltf_ext.lod import open_lod
from gltf_ext.lod.simplifier import library
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import Primitive
from gltf_scene.scene import read_scene

LEAST_TRIANGLES = 64
SAMPLES = 50_000  # of each surface
WITHIN = 99.9  # percent
SPARSE, ERROR_ABSOLUTE = 2, 4  # options of the simplifier


def measure(path: str) -> dict:
    """Of a file: the longest side of its scene, and for each primitive in it, by "mesh primitive",
    its largest scale and its levels: triangles, error in its units, bytes of its view."""
    scene = read_scene(open_model(path))
    sources = {(p.mesh, p.primitive): p for p in peers.read_primitives(Path(path))}
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    scales: dict[tuple[int, int], float] = {}
    places = [(placed, matrix) for placed in scene.primitives for matrix in placed.matrices]
    for placed, matrix in places:
        key = placed.mesh, placed.primitive
        points = sources[key].attributes["POSITION"] @ matrix[:3, :3].T + matrix[:3, 3]
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
        scales[key] = max(scales.get(key, 0.0), float(np.linalg.norm(matrix[:3, :3], 2)))
    chains = {}
    for number, (key, scale) in enumerate(scales.items()):
        progress(f"chain {number + 1} of {len(scales)}")
        chains[" ".join(map(str, key))] = {"scale": scale, "levels": chain_of(sources[key])}
    return {"longest_side": float((high - low).max()), "chains": chains}


def chain_of(source: Primitive) -> list[dict]:
    """Triangles, error and bytes of each level of a primitive."""
    mesh, levels = source, [level_of(source, 0.0)]
    while len(mesh.indices) > LEAST_TRIANGLES:
        coarser = halved(mesh)
        if not 0 < len(coarser.indices) <= 0.9 * len(mesh.indices):
            break  # nothing more can be removed
        mesh = coarser
        distances = surface_distances(source, mesh, SAMPLES)
        levels.append(level_of(mesh, float(np.percentile(distances, WITHIN))))
    return levels


def within(levels: list[dict], error: float) -> dict:
    """The coarsest level of a chain whose error is at most this one."""
    return [level for level in levels if level["error"] <= error][-1]


def halved(mesh: Primitive) -> Primitive:
    """The mesh with half of its triangles, without vertices that none uses."""
    points = np.ascontiguousarray(mesh.attributes["POSITION"], np.float32)
    triangles = simplified(np.ascontiguousarray(mesh.indices, np.uint32), points)
    used, local = np.unique(triangles, return_inverse=True)
    attributes = {name: values[used] for name, values in mesh.attributes.items()}
    return Primitive(0, 0, local.reshape(-1, 3).astype(np.uint32), attributes)


def simplified(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Half of the triangles, by meshoptimizer's simplifier without attributes and locks."""
    function = library().meshopt_simplifyWithAttributes
    function.restype = ctypes.c_size_t
    result = np.empty(triangles.size, np.uint32)
    locked = np.zeros(len(points), np.uint8)
    indices, positions, locks, found = (
        array.ctypes.data_as(ctypes.c_void_p) for array in (triangles, points, locked, result)
    )
    size = ctypes.c_size_t
    count = function(
        found,
        indices,
        size(triangles.size),
        positions,
        size(len(points)),
        size(12),
        *(None, size(0), None, size(0)),  # attributes and their weights
        locks,
        size(3 * (len(triangles) // 2)),
        ctypes.c_float(1e30),
        ctypes.c_uint(SPARSE | ERROR_ABSOLUTE),
        None,
    )
    return result[:count].reshape(-1, 3)


def level_of(mesh: Primitive, error: float) -> dict:
    """A level, with the bytes of our view of it."""
    with tempfile.TemporaryDirectory() as folder:
        plain, ours = Path(folder) / "plain.glb", Path(folder) / "ours.glb"
        peers.write_primitives([mesh], plain)
        gltf_ext.compress(plain, ours, page_bytes=0, **BITS)
        (compressed,) = open_lod(ours)
    return {"triangles": len(mesh.indices), "error": error, "bytes": len(compressed.blob)}
