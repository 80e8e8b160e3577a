"""From a glTF file to what the native shape takes: blobs, and which of their streams hold what."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from gltf_ext.compression.extension import (
    EXTENSION,
    Compressed,
    read_compressed,
    require_compressed,
)
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.nodes import placed

from .materials import texcoord_set

# What fits a row of api.cpp, and an answer of queries.h.
MAX_NAME, MAX_COMPONENTS = 95, 4
# glTF allows integers only with `normalized` here, but files forget it.
ALWAYS_NORMALIZED = ("COLOR_", "NORMAL")


@dataclass
class Attribute:
    """blob_decoder.h's Attribute: `components` of the `stored` ones, behind the first `skipped`; integers in [lowest, highest]; times scale."""

    name: str
    stream: int
    stored: int
    skipped: int
    components: int
    scale: float = 1.0
    lowest: float = 0.0
    highest: float = 0.0
    integer: bool = False


@dataclass
class Part:
    """One compressed primitive in its place. matrix: float64[4, 4]."""

    blob: bytes
    position: Attribute
    normal: Attribute | None
    texcoord: Attribute | None
    others: dict[str, Attribute] = field(default_factory=dict)
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))


@contextmanager
def keeping(path: str, document: Document) -> Iterator[None]:
    """Within this context files are not opened again: `document` stands for what is at `path`."""
    _documents[path] = document
    try:
        yield
    finally:
        del _documents[path]


_documents: dict[str, Document] = {}


def read_parts(path: str, mesh: int | None, primitive: int | None) -> list[Part]:
    """The compressed primitives that the shape's parameters name; MeshletError when there are none."""
    document = _documents.get(path) or open_model(path)
    if mesh is None:
        if primitive is not None:
            raise MeshletError(
                "primitive is given without mesh", "give both, or neither for the whole file"
            )
        return _parts_of_scene(document)
    if not 0 <= mesh < len(document.meshes):
        raise MeshletError(f"mesh {mesh} does not exist", f"there are {len(document.meshes)}")
    primitives = document.meshes[mesh].primitives
    if primitive is not None and not 0 <= primitive < len(primitives):
        raise MeshletError(
            f"mesh {mesh} primitive {primitive} does not exist", f"there are {len(primitives)}"
        )
    numbers = range(len(primitives)) if primitive is None else [primitive]
    parts = [
        part_of(document, mesh, p) for p in numbers if EXTENSION in (primitives[p].extensions or {})
    ]
    if not parts:
        raise MeshletError(
            f"mesh {mesh} has no primitive with {EXTENSION} there",
            "compress it first: gltf-meshlet compress IN OUT.glb",
        )
    return parts


def _parts_of_scene(document: Document) -> list[Part]:
    require_compressed(document)
    parts: list[Part] = []
    of_mesh: dict[int, list[Part]] = {}
    for node, matrix in placed(document):
        if node.mesh is None:
            continue
        if node.mesh not in of_mesh:
            numbers = range(len(document.meshes[node.mesh].primitives))
            of_mesh[node.mesh] = [
                part_of(document, node.mesh, p)
                for p in numbers
                if EXTENSION in (document.meshes[node.mesh].primitives[p].extensions or {})
            ]
        for part in of_mesh[node.mesh]:
            parts.append(
                Part(part.blob, part.position, part.normal, part.texcoord, part.others, matrix)
            )
    if not parts:
        raise MeshletError(
            "no node of its scene shows a compressed primitive", "give mesh and primitive"
        )
    return parts


def part_of(document: Document, mesh: int, primitive: int) -> Part:
    """One compressed primitive in its own coordinates."""
    compressed = read_compressed(document, mesh, primitive)
    normalized = {
        name: bool(document.accessors[index].normalized)
        for name, index in vars(document.meshes[mesh].primitives[primitive].attributes).items()
        if index is not None
    }
    found = {
        name: _attribute(compressed, name, normalized[name] or name.startswith(ALWAYS_NORMALIZED))
        for name in compressed.attributes
    }
    others: dict[str, Attribute] = {}
    for name, attribute in found.items():
        if name not in ("POSITION", "NORMAL", "TEXCOORD_0", "TANGENT") and not name.startswith(
            ("JOINTS_", "WEIGHTS_")
        ):
            others.update(_as_mesh_attributes(name, attribute))
    texcoord = (
        f"TEXCOORD_{texcoord_set(document, document.meshes[mesh].primitives[primitive].material)}"
    )
    return Part(
        compressed.blob, found["POSITION"], found.get("NORMAL"), found.get(texcoord), others
    )


def _attribute(compressed: Compressed, name: str, normalized: bool) -> Attribute:
    first, (dtype, components) = compressed.attributes[name]
    if dtype.kind == "f":
        return Attribute(name, first, components, 0, components)
    limits = np.iinfo(dtype)
    return Attribute(
        name,
        first,
        components,
        0,
        components,
        1.0 / limits.max if normalized else 1.0,
        float(limits.min),
        float(limits.max),
        True,
    )


def _as_mesh_attributes(name: str, attribute: Attribute) -> dict[str, Attribute]:
    """Mitsuba's names: COLOR_0 -> vertex_color and vertex_alpha, _TEMPERATURE -> vertex_temperature, COLOR_1 -> vertex_color_1."""
    plain = name.lower().lstrip("_")
    plain = plain[:-2] if plain.endswith("_0") else plain
    if name.startswith("COLOR_") and attribute.components == 4:
        return {
            **_renamed(f"vertex_{plain}", attribute, 0, 3),
            **_renamed(f"vertex_{plain.replace('color', 'alpha')}", attribute, 3, 1),
        }
    return _renamed(f"vertex_{plain}", attribute, 0, attribute.components)


def _renamed(
    name: str, attribute: Attribute, skipped: int, components: int
) -> dict[str, Attribute]:
    if len(name.encode()) > MAX_NAME or components > MAX_COMPONENTS:
        return {}
    return {name: replace(attribute, name=name, skipped=skipped, components=components)}
