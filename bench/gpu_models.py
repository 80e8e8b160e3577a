"""The models of the measurements on a GPU: files, and files with four times their triangles."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import gltf_ext
from bench.common import compressed
from gltf_ext.compression.primitives import Primitive


def add_models(parser: argparse.ArgumentParser) -> None:
    """Options that name models, for `parsed`; `models_of` gives the files."""
    parser.add_argument(
        "models",
        nargs="*",
        type=Path,
        help=".glb files; what is not compressed is compressed first",
    )
    parser.add_argument(
        "--subdivide",
        type=Path,
        action="append",
        default=[],
        metavar="MODEL",
        help="a model to measure with four times its triangles, too",
    )


def parsed(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The program's arguments; ends it, before anything else is done, where they name no model."""
    options = parser.parse_args()
    if not options.models and not options.subdivide:
        parser.error("name at least one model")
    return options


def models_of(options: argparse.Namespace, folder: Path) -> list[Path]:
    """Compressed files, those that are made here in `folder`."""
    return [compressed(path, folder) for path in options.models] + [
        subdivided(path, folder) for path in options.subdivide
    ]


def subdivided(path: Path, folder: Path) -> Path:
    """A compressed model of four times the triangles, edges halved, with normals; the first primitive of the file alone."""
    import trimesh

    fine = halved(gltf_ext.load(path)[0])
    mesh = trimesh.Trimesh(
        fine.attributes["POSITION"],
        fine.indices,
        vertex_normals=fine.attributes["NORMAL"],
        process=False,
    )
    raw, output = folder / "raw.glb", folder / f"{path.stem}_x4.glb"
    raw.write_bytes(mesh.export(file_type="glb", include_normals=True))
    gltf_ext.compress(raw, output)
    return output


def halved(primitive: Primitive) -> Primitive:
    """Every edge halved and every triangle in four, with smooth normals."""
    triangles = primitive.indices.astype(np.int64)
    positions = primitive.attributes["POSITION"].astype(np.float64)
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    unique, place = np.unique(edges[:, 0] * len(positions) + edges[:, 1], return_inverse=True)
    a, b = np.divmod(unique, len(positions))
    ab, bc, ca = place.reshape(3, -1) + len(positions)
    p, q, r = triangles.T
    fine = np.concatenate(
        [np.column_stack(c) for c in ((p, ab, ca), (ab, q, bc), (ca, bc, r), (ab, bc, ca))]
    )
    points = np.concatenate([positions, (positions[a] + positions[b]) / 2])
    corners = points[fine]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.column_stack(
        [np.bincount(fine.ravel(), np.repeat(faces[:, c], 3), len(points)) for c in range(3)]
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    attributes = {"POSITION": points.astype(np.float32), "NORMAL": normals.astype(np.float32)}
    return Primitive(0, 0, fine.astype(np.uint32), attributes)
