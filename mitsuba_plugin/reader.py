"""From a glTF file to the native shape: blobs, placement, and the layout of their attributes."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from gltf_ext.compression.extension import (
    EXTENSION,
    read_compressed,
    require_compressed,
)
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.materials import read_material
from gltf_ext.gltf.scene import ValueFormat, read_scene, value_format
from gltf_ext.lod.reading import LodPrimitive, read_lod

from .lod import LodView

MAX_NAME = 95  # bytes, of python_api.cpp's AttributeRow
MAX_COMPONENTS = 4  # of an attribute, see queries.h
# Attributes with a place of their own in the shape, and those that Mitsuba has no use for.
OWN_PLACE = ("POSITION", "NORMAL", "TEXCOORD_0", "TANGENT")
UNUSED = ("JOINTS_", "WEIGHTS_")


@dataclass
class Attribute:
    """An attribute in a blob, as primitive.h's struct.

    stream: the first of its streams; stored: components in the blob; components: those used,
    after the first `skipped`. Integers are rounded to [lowest, highest]; then all values are
    multiplied by the scale.
    """

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
    """One blob of a compressed primitive in its place.

    others: further attributes by Mitsuba's names; matrix: float64[4, 4], object to shape; chosen:
    the blob's meshlets to show, all of them if it is empty.
    """

    blob: bytes
    position: Attribute
    normal: Attribute | None
    texcoord: Attribute | None
    others: dict[str, Attribute] = field(default_factory=dict)
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    chosen: list[int] = field(default_factory=list)


_documents: dict[str, list[Document]] = {}  # those kept for a path; threads may load it together
_lock = threading.Lock()


@contextmanager
def keeping(path: str, document: Document) -> Iterator[None]:
    """Within this context the file at `path` is not read again: `document` is used instead."""
    with _lock:
        _documents.setdefault(path, []).append(document)
    try:
        yield
    finally:
        with _lock:
            _documents[path].remove(document)
            if not _documents[path]:
                del _documents[path]


def _open(path: str) -> Document:
    with _lock:
        if path in _documents:
            return _documents[path][-1]
    return open_model(path)


def read_parts(
    path: str,
    mesh: int | None,
    primitive: int | None,
    lod: LodView | None = None,
    to_world: np.ndarray | None = None,
) -> list[Part]:
    """The compressed primitives that the shape's parameters name: at least one.

    mesh, primitive: indices in the document; None for all. lod: the camera in the world that
    decides about levels of detail; None for all triangles. to_world: float64[4, 4], of the shape.
    Raises MeshletError, OSError.
    """
    to_world = np.eye(4) if to_world is None else to_world
    document = _open(path)
    if mesh is None:
        if primitive is not None:
            raise MeshletError(
                "primitive is given without mesh", "give both, or neither for the whole file"
            )
        return _parts_of_scene(document, lod, to_world)
    if not 0 <= mesh < len(document.meshes):
        raise MeshletError(f"mesh {mesh} does not exist", f"there are {len(document.meshes)}")
    primitives = document.meshes[mesh].primitives
    if primitive is not None and not 0 <= primitive < len(primitives):
        raise MeshletError(
            f"mesh {mesh} primitive {primitive} does not exist", f"there are {len(primitives)}"
        )
    numbers = range(len(primitives)) if primitive is None else [primitive]
    parts = [
        part
        for p in numbers
        if is_compressed(document, mesh, p)
        for part in Source(document, mesh, p).parts(np.eye(4), lod, to_world)
    ]
    if not parts:
        raise MeshletError(
            f"mesh {mesh} has no primitive with {EXTENSION} there",
            "compress it first: gltf-meshlet compress IN OUT.glb",
        )
    return parts


def _parts_of_scene(document: Document, lod: LodView | None, to_world: np.ndarray) -> list[Part]:
    require_compressed(document)
    known: dict[tuple[int, int], Source] = {}
    parts: list[Part] = []
    for placed in read_scene(document).primitives:
        place = placed.mesh, placed.primitive
        if is_compressed(document, *place):
            if place not in known:
                known[place] = Source(document, *place)
            parts += known[place].parts(placed.matrix, lod, to_world @ placed.matrix)
    if not parts:
        raise MeshletError(
            "no node of its scene shows a compressed primitive", "give mesh and primitive"
        )
    return parts


def is_compressed(document: Document, mesh: int, primitive: int) -> bool:
    """Whether a primitive has the extension."""
    return EXTENSION in (document.meshes[mesh].primitives[primitive].extensions or {})


class Source:
    """A compressed primitive, read once for all its places. Raises MeshletError."""

    def __init__(self, document: Document, mesh: int, primitive: int):
        self._compressed = read_compressed(document, mesh, primitive)
        self._document = document
        self._pages: dict[int, bytes] = {}
        source = document.meshes[mesh].primitives[primitive]
        found = {
            name: _attribute(name, stream, value_format(document, source, name))
            for name, (stream, _) in self._compressed.attributes.items()
        }
        others: dict[str, Attribute] = {}
        for name, attribute in found.items():
            if name not in OWN_PLACE and not name.startswith(UNUSED):
                others.update(_as_mesh_attributes(name, attribute))
        texcoord = f"TEXCOORD_{read_material(document, source.material).texcoord}"
        self._attributes = (found["POSITION"], found.get("NORMAL"), found.get(texcoord), others)

    @cached_property
    def levels(self) -> LodPrimitive | None:
        """None without levels."""
        return read_lod(self._document, self._compressed)

    def parts(self, matrix: np.ndarray, lod: LodView | None, to_world: np.ndarray) -> list[Part]:
        """A part for each blob to show, in order; to_world: from the primitive to the camera."""
        if lod is None or self.levels is None:
            return [Part(blob, *self._attributes, matrix) for blob in self._blobs]
        cut = lod.cut(self.levels, to_world)
        return [
            Part(
                self._page(page),
                *self._attributes,
                matrix,
                self.levels.drawn_of_page(page, cut.drawn).tolist(),
            )
            for page in cut.pages.tolist()
        ]

    @cached_property
    def _blobs(self) -> list[bytes]:
        return self._compressed.blobs

    def _page(self, number: int) -> bytes:
        """The same object for each place, so that the shape keeps it once."""
        assert self.levels is not None
        if number not in self._pages:
            self._pages[number] = self.levels.page(number)
        return self._pages[number]


def _attribute(name: str, stream: int, form: ValueFormat) -> Attribute:
    lowest, highest = form.limits
    return Attribute(
        name,
        stream,
        form.components,
        0,
        form.components,
        form.scale,
        lowest,
        highest,
        form.is_integer,
    )


def _as_mesh_attributes(name: str, attribute: Attribute) -> dict[str, Attribute]:
    """The attribute under Mitsuba's names.

    COLOR_0 becomes vertex_color and vertex_alpha, COLOR_1 vertex_color_1, _TEMPERATURE
    vertex_temperature.
    """
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
    """Empty if the native shape has no room for it."""
    if len(name.encode()) > MAX_NAME or components > MAX_COMPONENTS:
        return {}
    return {name: replace(attribute, name=name, skipped=skipped, components=components)}
