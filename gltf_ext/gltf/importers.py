"""Opens a model of any supported format as a glTF document."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gltf_ext.errors import MeshletError, blaming
from gltf_ext.gltf.container import EMPTY, EXPORT_AGAIN, parse_glb, read_document
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.images import check_size

GLTF_SUFFIXES = (".glb", ".gltf")
MESH_SUFFIXES = (".obj", ".ply", ".stl")
# Bytes of a binary .stl.
STL_HEADER = 84
STL_TRIANGLE = 50


def open_model(path: str | os.PathLike[str]) -> Document:
    """A document from a .glb, .gltf, .obj, .ply or .stl file. Raises MeshletError, OSError."""
    suffix = Path(path).suffix.lower()
    if suffix in GLTF_SUFFIXES:
        return read_document(path)
    if suffix in MESH_SUFFIXES:
        return _import_mesh(Path(path))
    raise MeshletError(
        f"has an unknown format ({suffix or 'no suffix'})",
        f"use one of {' '.join(GLTF_SUFFIXES + MESH_SUFFIXES)}",
    )


def _import_mesh(path: Path) -> Document:
    """Through trimesh, without its vertex merging: identical vertices are welded later."""
    content, suffix = path.read_bytes(), path.suffix.lower()
    _check_content(content, suffix)
    missing = _missing_materials(path.parent, content) if suffix == ".obj" else ()
    try:
        with _only_errors_logged():
            glb = _through_trimesh(path)
        document = parse_glb(glb, path.parent)
    except (MeshletError, MemoryError):
        raise
    except Exception:  # trimesh's readers raise anything
        raise MeshletError(
            f"cannot be read as {suffix}: it is damaged or cut off", EXPORT_AGAIN
        ) from None
    document.import_warnings = missing
    return document


def _check_content(content: bytes, suffix: str) -> None:
    """Refuses damage that trimesh would read without an error."""
    if not content:
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    if suffix == ".stl" and _is_cut_off(content):
        raise MeshletError("is cut off", "get it again")
    if suffix == ".obj" and b"\0" in content:
        raise MeshletError("is not a text .obj", EXPORT_AGAIN)


def _through_trimesh(path: Path) -> bytes:
    """The file as a .glb."""
    import trimesh

    scene = trimesh.load_scene(path, process=False)
    meshes = (g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh))
    if not any(len(mesh.faces) for mesh in meshes):
        raise MeshletError("holds no triangles", "there is nothing to compress")
    glb: bytes = scene.export(file_type="glb")
    return glb


@contextmanager
def _only_errors_logged() -> Iterator[None]:
    logger = logging.getLogger("trimesh")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)


def _is_cut_off(stl: bytes) -> bool:
    if b"\0" not in stl:  # text
        return b"endsolid" not in stl.lower()
    return len(stl) < STL_HEADER + STL_TRIANGLE * int.from_bytes(stl[80:STL_HEADER], "little")


def _missing_materials(folder: Path, content: bytes) -> tuple[str, ...]:
    """Warnings for material libraries and textures that an .obj names and that do not exist.

    Raises MeshletError for a texture that takes too much memory.
    """
    libraries = _named_files(rb"mtllib", folder, content)
    textures = [
        texture
        for library in libraries
        if library.is_file()
        for texture in _named_files(rb"map_[Kk][Dd]", folder, library.read_bytes())
    ]
    for path in filter(Path.is_file, textures):
        with blaming(path):
            check_size(path.read_bytes())
    return tuple(
        f"{path.name} is not there, so its material is left out"
        for path in (*libraries, *textures)
        if not path.is_file()
    )


def _named_files(keyword: bytes, folder: Path, content: bytes) -> list[Path]:
    names = re.findall(rb"^\s*" + keyword + rb"[ \t]+([^\r\n\0]+)", content, re.MULTILINE)
    return [folder / os.fsdecode(name.strip()) for name in dict.fromkeys(names)]
