"""Opens a model of any supported format as a glTF document."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from gltf_ext.document import container
from gltf_ext.document.container import EMPTY, read_document
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, is_path, read_gltf2
from gltf_ext.document.lfs import START, refuse_pointer
from gltf_ext.errors import EXPORT_AGAIN, MeshletError
from gltf_ext.progress import Advance
from gltf_ext.sources import mtl, obj, ply, stl
from gltf_ext.sources.limits import check_triangle_count
from gltf_ext.sources.mesh_files import (
    IndexedMesh,
    IndexedPrimitive,
    MeshFile,
    MeshPrimitive,
    beside,
    to_document,
)
from gltf_ext.sources.ply_header import read_header
from gltf_ext.sources.row_arrays import MemoryRows, NewRows

GLTF_SUFFIXES = (".glb", ".gltf")
READERS = {".ply": ply, ".stl": stl}  # those with a header, beside obj
MESH_SUFFIXES = (".obj", *READERS)
SUFFIXES = GLTF_SUFFIXES + MESH_SUFFIXES


def open_model(path: Model, obj_groups: bool = False, advance: Advance | None = None) -> Document:
    """Read a document from a .glb, .gltf, .obj, .ply or .stl, or from a pygltflib.GLTF2.

    obj_groups, advance: see `read_meshes`. Raises MeshletError, OSError.
    """
    if not is_path(path):
        return read_gltf2(path)
    suffix = Path(path).suffix.lower()
    if suffix in GLTF_SUFFIXES:
        return read_document(path)
    if suffix in MESH_SUFFIXES:
        contents = read_meshes(Path(path), MemoryRows, obj_groups, advance)
        return document_of(path, contents, MeshPrimitive.indexed)
    raise MeshletError(
        f"has an unknown format ({suffix or 'no suffix'})",
        f"use one of {' '.join(SUFFIXES)}",
    )


def referenced_files(path: Path) -> list[Path]:
    """List the other files that a model names by relative paths, whether they exist or not.

    Materials of an .obj name images once they lie beside it. Raises MeshletError, OSError.
    """
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return mtl.referenced_files(path)
    if suffix == ".ply":
        with open(path, "rb") as file:
            texture = read_header(file).texture
        return beside(path.parent, texture) if texture else []
    return container.referenced_files(path) if suffix in GLTF_SUFFIXES else []


def triangles_in_header(path: Path) -> int:
    """Return the triangles of an .obj, .ply or .stl as far as a header counts them, else 0.

    Raises MeshletError, also for more than a primitive may have, OSError.
    """
    suffix = path.suffix.lower()
    count = READERS[suffix].triangles_in_header(path) if suffix in READERS else 0
    check_triangle_count(count)
    return count


def read_meshes(
    path: Path,
    new_rows: NewRows,
    obj_groups: bool = False,
    advance: Advance | None = None,
) -> MeshFile:
    """Read the meshes of an .obj, .ply or .stl that have triangles, at least one.

    obj_groups: groups of an .obj become meshes, too. Identical vertices are welded later. advance:
    moves the progress bar. Raises MeshletError, OSError.
    """
    if not os.path.getsize(path):
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    with open(path, "rb") as file:
        refuse_pointer(file.read(len(START)))
    try:
        triangles_in_header(path)  # check
        if path.suffix.lower() == ".obj":
            contents = obj.read(path, new_rows, obj_groups, advance)
        else:
            contents = READERS[path.suffix.lower()].read(path, new_rows, advance)
    except MeshletError:
        raise
    except ValueError as error:  # of _codec.scan_lines
        raise MeshletError(str(error), EXPORT_AGAIN) from None
    contents.keep_triangles()
    if not contents.meshes:
        raise MeshletError("holds no triangles", "there is nothing to compress")
    return contents


def document_of(
    path: str | os.PathLike[str],
    contents: MeshFile,
    indexed: Callable[[MeshPrimitive], IndexedPrimitive],
) -> Document:
    """Return a document of the meshes of what was read, which has them no more.

    indexed: what the document has of each primitive.
    """
    meshes = []
    for mesh in contents.meshes:
        # Each primitive is gone once it is indexed, so that memory holds few of them twice.
        primitives = [indexed(mesh.primitives.pop(0)) for _ in range(len(mesh.primitives))]
        meshes.append(IndexedMesh(mesh.name, primitives, mesh.parent))
    document = to_document(meshes, contents.offset)
    document.base, document.import_warnings = Path(path).parent, tuple(contents.warnings)
    document.import_rounding = contents.rounding
    document.import_files = tuple(filter(os.path.isfile, contents.others))
    return document
