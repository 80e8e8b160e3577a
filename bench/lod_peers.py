"""What others need for one pixel of error: Draco, and a discrete chain of levels. For bench.lod.

A discrete chain is whole models, each with half the triangles of the one before, by meshoptimizer's
simplification, each a file of its own. A viewer loads and draws one of them: the coarsest whose
measured error is within the allowed one.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from trimesh import Trimesh

import gltf_ext
from bench import peers
from bench.common import progress
from gltf_ext.compression.primitives import Primitive
from gltf_ext.lod.reports import surface_distances
from gltf_ext.lod.simplifier import simplify

REDUCTION = 2
LEAST_TRIANGLES = 1000
SAMPLES = 50_000  # of each surface
WITHIN = 99.9  # percent


def measure(path: str) -> dict:
    """Triangles, error and bytes of each level of a file's largest primitive, and its size."""
    source = max(peers.read_primitives(Path(path)), key=lambda p: len(p.indices))
    source = Primitive(0, 0, source.indices, source.attributes)
    levels = [{"triangles": len(source.indices), "error": 0.0, **_sizes(source)}]
    mesh = source
    while len(mesh.indices) > LEAST_TRIANGLES:
        coarser = halved(mesh)
        if len(coarser.indices) > 0.9 * len(mesh.indices):
            break  # nothing more can be removed
        mesh = coarser
        distances = surface_distances(source, mesh, SAMPLES)
        error = float(np.percentile(distances, WITHIN))
        progress(f"chain: {len(mesh.indices)} triangles")
        levels.append({"triangles": len(mesh.indices), "error": error, **_sizes(mesh)})
    points = source.attributes["POSITION"]
    return {"longest_side": float(np.ptp(points, axis=0).max()), "chain": levels}


def within(levels: list[dict], error: float) -> dict:
    """The coarsest level of a chain whose error is at most this one."""
    return [level for level in levels if level["error"] <= error][-1]


def halved(mesh: Primitive) -> Primitive:
    """The mesh with 1/REDUCTION of its triangles, without vertices that none uses."""
    points = np.ascontiguousarray(mesh.attributes["POSITION"], np.float32)
    nothing = np.zeros((len(points), 0), np.float32)
    triangles, _ = simplify(
        np.ascontiguousarray(mesh.indices, np.uint32),
        points,
        nothing,
        np.zeros(0, np.float32),
        np.zeros(len(points), np.uint8),
        len(mesh.indices) // REDUCTION,
    )
    used, local = np.unique(triangles, return_inverse=True)
    attributes = {name: values[used] for name, values in mesh.attributes.items()}
    return Primitive(0, 0, local.reshape(-1, 3).astype(np.uint32), attributes)


def _sizes(mesh: Primitive) -> dict[str, int]:
    """Bytes as a Draco buffer and as our file without levels."""
    draco = peers.Draco()
    with tempfile.TemporaryDirectory() as folder:
        plain, ours = Path(folder) / "plain.glb", Path(folder) / "ours.glb"
        exported = Trimesh(
            mesh.attributes["POSITION"],
            mesh.indices,
            vertex_normals=mesh.attributes.get("NORMAL"),
            process=False,
        )
        plain.write_bytes(exported.export(file_type="glb", include_normals=True))
        report = gltf_ext.compress(plain, ours)
        return {
            "draco_bytes": draco.file_bytes(draco.encode(peers.parts_of([mesh]))),
            "bytes": report["output_bytes"],
        }
