"""Opening a model of any supported format as a glTF document."""

from __future__ import annotations

import logging
import os
import re
from pathlib import Path

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import EMPTY, EXPORT_AGAIN, Document, parse_glb, read_document

GLTF_SUFFIXES = (".glb", ".gltf")
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes of a binary .stl
MESH_SUFFIXES = (".obj", ".ply", ".stl")


def open_model(path: str | os.PathLike) -> Document:
    """A document from a .glb, .gltf, .obj, .ply or .stl file."""
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
    """Through trimesh, whose own vertex merging is switched off: identical vertices are welded later."""
    import trimesh

    content = path.read_bytes()
    if not content:
        raise MeshletError(EMPTY, EXPORT_AGAIN)
    if path.suffix.lower() == ".stl" and _is_cut_off(content):
        raise MeshletError("is cut off", "get it again")
    if path.suffix.lower() == ".obj" and b"\0" in content:
        raise MeshletError("is not a text .obj", EXPORT_AGAIN)
    logger, level = logging.getLogger("trimesh"), logging.getLogger("trimesh").level
    logger.setLevel(logging.ERROR)
    try:
        scene = trimesh.load_scene(path, process=False)
        if not any(
            isinstance(g, trimesh.Trimesh) and len(g.faces) for g in scene.geometry.values()
        ):
            raise MeshletError("holds no triangles", "there is nothing to compress")
        document = parse_glb(scene.export(file_type="glb"), path.parent)
    except (MeshletError, MemoryError):
        raise
    except Exception:  # trimesh's readers raise anything
        raise MeshletError(
            f"cannot be read as {path.suffix.lower()}: it is damaged or cut off", EXPORT_AGAIN
        ) from None
    finally:
        logger.setLevel(level)
    document.import_warnings = (
        _missing_materials(path.parent, content) if path.suffix.lower() == ".obj" else ()
    )
    return document


def _is_cut_off(stl: bytes) -> bool:
    if b"\0" not in stl:  # text
        return b"endsolid" not in stl.lower()
    return len(stl) < STL_HEADER + STL_TRIANGLE * int.from_bytes(stl[80:STL_HEADER], "little")


def _missing_materials(folder: Path, content: bytes) -> tuple[str, ...]:
    """Warnings for material libraries and textures that an .obj names and that are not there."""
    libraries = _named_files(rb"mtllib", folder, content)
    textures = [
        texture
        for library in libraries
        if library.is_file()
        for texture in _named_files(rb"map_Kd", folder, library.read_bytes())
    ]
    return tuple(
        f"{path.name} is not there, so its material is left out"
        for path in (*libraries, *textures)
        if not path.is_file()
    )


def _named_files(keyword: bytes, folder: Path, content: bytes) -> list[Path]:
    names = re.findall(rb"^\s*" + keyword + rb"[ \t]+([^\r\n\0]+)", content, re.MULTILINE)
    return [folder / os.fsdecode(name.strip()) for name in dict.fromkeys(names)]
