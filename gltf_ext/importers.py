"""Opening a model of any supported format as a glTF document."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from .document import Document, parse_glb, read_document
from .errors import MeshletError

GLTF_SUFFIXES = (".glb", ".gltf")
REASON_LENGTH = 120  # of what trimesh says
MESH_SUFFIXES = (".obj", ".ply", ".stl")


def open_model(path: str | os.PathLike) -> Document:
    """A document from a .glb, .gltf, .obj, .ply or .stl file."""
    suffix = Path(path).suffix.lower()
    if suffix in GLTF_SUFFIXES:
        return read_document(path)
    if suffix in MESH_SUFFIXES:
        return _import_mesh(Path(path))
    raise MeshletError(
        f"has an unknown format ({suffix or 'no suffix'})", f"use one of {' '.join(GLTF_SUFFIXES + MESH_SUFFIXES)}"
    )


def _import_mesh(path: Path) -> Document:
    """Through trimesh, whose own vertex merging is switched off: identical vertices are welded later."""
    import trimesh

    path.open("rb").close()  # a missing file keeps its own error
    logger, level = logging.getLogger("trimesh"), logging.getLogger("trimesh").level
    logger.setLevel(logging.ERROR)
    try:
        scene = trimesh.load_scene(path, process=False)
        if not any(isinstance(g, trimesh.Trimesh) and len(g.faces) for g in scene.geometry.values()):
            raise ValueError("no triangles")
        return parse_glb(scene.export(file_type="glb"), path.parent)
    except Exception as error:  # trimesh's readers raise anything
        reason = " ".join(str(error).split())[:REASON_LENGTH]
        raise MeshletError(
            f"cannot be read as {path.suffix.lower()[1:]} ({type(error).__name__}: {reason})",
            "export the model again",
        ) from None
    finally:
        logger.setLevel(level)
