"""Opens a model of any supported format as a glTF document."""

from __future__ import annotations

import os
from pathlib import Path

from gltf_ext.errors import MeshletError
from gltf_ext.gltf import obj, ply, stl
from gltf_ext.gltf.container import EMPTY, EXPORT_AGAIN, read_document
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.mesh_files import to_document

GLTF_SUFFIXES = (".glb", ".gltf")
READERS = {".obj": obj.read, ".ply": ply.read, ".stl": stl.read}
MESH_SUFFIXES = tuple(READERS)
SUFFIXES = GLTF_SUFFIXES + MESH_SUFFIXES


def open_model(path: str | os.PathLike[str]) -> Document:
    """A document from a .glb, .gltf, .obj, .ply or .stl file. Raises MeshletError, OSError."""
    suffix = Path(path).suffix.lower()
    if suffix in GLTF_SUFFIXES:
        return read_document(path)
    if suffix in MESH_SUFFIXES:
        return _import_mesh(Path(path), suffix)
    raise MeshletError(
        f"has an unknown format ({suffix or 'no suffix'})",
        f"use one of {' '.join(SUFFIXES)}",
    )


def referenced_files(path: Path) -> list[Path]:
    """The other files that a model names, whether they exist or not. Raises MeshletError, OSError.

    Materials of an .obj name images once they lie beside it.
    """
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return obj.referenced_files(path)
    if suffix == ".ply":
        with open(path, "rb") as file:
            texture = ply.read_header(file).texture
        return [path.parent / texture] if texture else []
    return read_document(path).files() if suffix in GLTF_SUFFIXES else []


def _import_mesh(path: Path, suffix: str) -> Document:
    """Identical vertices are welded later."""
    if not os.path.getsize(path):
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    try:
        meshes, warnings, files = READERS[suffix](path)
    except MeshletError:
        raise
    except ValueError as error:  # of _codec.scan_lines
        raise MeshletError(str(error), EXPORT_AGAIN) from None
    if not any(len(mesh.triangles) for mesh in meshes):
        raise MeshletError("holds no triangles", "there is nothing to compress")
    document = to_document(meshes)
    document.base, document.import_warnings = path.parent, tuple(warnings)
    document.import_files = tuple(filter(Path.is_file, files))
    return document
