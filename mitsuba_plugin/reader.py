"""From a glTF file to the native shape: blobs, placement, and the layout of their attributes."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gltf_ext.attributes.extension import read_compressed, require_compressed
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_ext.lod.reading import LodPrimitive, read_lod
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import EXTENSION, is_compressed
from gltf_scene.materials import read_material
from gltf_scene.scene import PlacedPrimitive, read_scene
from gltf_scene.values import ValueFormat, value_format

from .lod import LodView

MAX_NAME = 95  # bytes, of primitive.h's Attribute
# Primitives in their places. Mitsuba has an object for each: 6 kB, and 60 microseconds to load.
MAX_INSTANCES = 1 << 18
MAX_COMPONENTS = 4  # of an attribute, see queries.h
# Attributes with a place of their own in the shape, and those that Mitsuba has no use for.
OWN_PLACE = ("POSITION", "NORMAL", "TEXCOORD_0", "TANGENT")
UNUSED = ("JOINTS_", "WEIGHTS_")


class Attribute(ctypes.Structure):
    """An attribute in a blob: primitive.h's Attribute.

    stream: the first of its streams; stored: components in the blob; components: those used,
    after the first `skipped`. Integers are rounded to [lowest, highest]; then all values are
    multiplied by the scale.
    """

    _fields_ = [
        ("name", ctypes.c_char * (MAX_NAME + 1)),
        ("stream", ctypes.c_uint32),
        ("stored", ctypes.c_uint32),
        ("skipped", ctypes.c_uint32),
        ("components", ctypes.c_uint32),
        ("scale", ctypes.c_float),
        ("lowest", ctypes.c_float),
        ("highest", ctypes.c_float),
        ("integer", ctypes.c_uint32),
    ]


@dataclass
class PlacedBlob:
    """One blob of a compressed primitive in its place.

    others: further attributes by Mitsuba's names; matrix: float64[4, 4], object to shape; chosen:
    the blob's meshlets to show, all of them if it is empty.
    """

    blob: bytes
    position: Attribute
    normal: Attribute | None
    texcoord: Attribute | None
    others: dict[str, Attribute]
    matrix: np.ndarray
    chosen: list[int] = field(default_factory=list)


_held: dict[str, Document] = {}


@contextmanager
def holding(path: str, document: Document) -> Iterator[None]:
    """While `load_scene` loads a document, its shapes do not read the file again."""
    _held[path] = document
    try:
        yield
    finally:
        if _held.get(path) is document:  # two threads may load the same file
            del _held[path]


def read_blobs(
    path: str,
    mesh: int | None,
    primitive: int | None,
    lod: LodView | None = None,
    to_world: np.ndarray | None = None,
) -> list[PlacedBlob]:
    """The compressed primitives that the shape's parameters name: at least one.

    mesh, primitive: indices in the document; None for all. lod: the camera in the world that
    decides about levels of detail; None for all triangles. to_world: float64[4, 4], of the shape.
    Raises MeshletError, OSError.
    """
    to_world = np.eye(4) if to_world is None else to_world
    return [
        blob
        for source, matrix in _sources(path, mesh, primitive)
        for blob in source.placed(matrix, lod, to_world @ matrix)
    ]


def _sources(path: str, mesh: int | None, primitive: int | None) -> list[tuple[Source, np.ndarray]]:
    """Each compressed primitive that the parameters name, and its place: float64[4, 4]."""
    document = _held.get(path)
    if document is None:
        document = open_model(path)
    if mesh is None:
        if primitive is not None:
            raise MeshletError(
                "primitive is given without mesh", "give both, or neither for the whole file"
            )
        return _sources_of_scene(document)
    if not 0 <= mesh < len(document.meshes):
        raise MeshletError(f"mesh {mesh} does not exist", f"there are {len(document.meshes)}")
    primitives = document.meshes[mesh]["primitives"]
    if primitive is not None and not 0 <= primitive < len(primitives):
        raise MeshletError(
            f"mesh {mesh} primitive {primitive} does not exist", f"there are {len(primitives)}"
        )
    numbers = range(len(primitives)) if primitive is None else [primitive]
    sources = [
        (Source(document, mesh, p), np.eye(4)) for p in numbers if is_compressed(primitives[p])
    ]
    if not sources:
        raise MeshletError(
            f"mesh {mesh} has no primitive with {EXTENSION} there",
            "compress it first: gltf-meshlet compress IN OUT.glb",
        )
    return sources


def require_few(primitives: Sequence[PlacedPrimitive]) -> None:
    """Raises MeshletError for more instances than Mitsuba takes as objects."""
    count = sum(len(placed.matrices) for placed in primitives)
    if count > MAX_INSTANCES:
        raise MeshletError(
            f"{count:,} instances are too many for Mitsuba, which takes {MAX_INSTANCES:,}",
            "split the scene, or render it with --backend vulkan",
        )


def _sources_of_scene(document: Document) -> list[tuple[Source, np.ndarray]]:
    require_compressed(document)
    known: dict[tuple[int, int], Source] = {}
    sources = []
    primitives = read_scene(document).primitives
    require_few(primitives)
    for placed in primitives:
        place = placed.mesh, placed.primitive
        if is_compressed(document.primitive(placed.mesh, placed.primitive)):
            if place not in known:
                known[place] = Source(document, *place)
            sources += [(known[place], matrix) for matrix in placed.matrices]
    if not sources:
        raise MeshletError(
            "no node of its scene shows a compressed primitive", "give mesh and primitive"
        )
    return sources


def widths_of(others: Sequence[dict[str, Attribute]]) -> dict[str, int]:
    """Name -> components of the shape's attribute, from those of all its primitives."""
    names = sorted({name for own in others for name in own})
    return {name: max(own[name].components for own in others if name in own) for name in names}


class Source:
    """A compressed primitive, read once for all its places. Raises MeshletError."""

    def __init__(self, document: Document, mesh: int, primitive: int):
        self._compressed = read_compressed(document, mesh, primitive)
        self._document = document
        self._pages: dict[int, bytes] = {}
        source = document.primitive(mesh, primitive)
        texcoord = f"TEXCOORD_{read_material(document, source.get('material')).texcoord}"
        own: dict[str, Attribute] = {}
        others: dict[str, Attribute] = {}
        for name, (stream, _) in self._compressed.attributes.items():
            form = value_format(document, source, name)
            if name in ("POSITION", "NORMAL", texcoord):
                role = "TEXCOORD" if name == texcoord else name
                own[role] = _attribute(name, stream, form, 0, form.components)
            for new, (skipped, count) in mesh_attributes(name, form.components).items():
                # The native shape has room for no others.
                if len(new.encode(errors="replace")) <= MAX_NAME and count <= MAX_COMPONENTS:
                    others[new] = _attribute(new, stream, form, skipped, count)
        self._attributes = (own["POSITION"], own.get("NORMAL"), own.get("TEXCOORD"), others)

    @cached_property
    def _blobs(self) -> list[bytes]:
        """All of level 0."""
        return self._compressed.blobs

    @cached_property
    def levels(self) -> LodPrimitive | None:
        """None without levels."""
        return read_lod(self._document, self._compressed)

    def placed(
        self, matrix: np.ndarray, lod: LodView | None, to_world: np.ndarray
    ) -> list[PlacedBlob]:
        """The blobs to show, in order; to_world: from the primitive to the camera."""
        if lod is None or self.levels is None:
            return [PlacedBlob(blob, *self._attributes, matrix) for blob in self._blobs]
        cut = lod.cut(self.levels, to_world)
        return [
            PlacedBlob(
                self._page(page),
                *self._attributes,
                matrix,
                self.levels.drawn_of_page(page, cut.drawn).tolist(),
            )
            for page in cut.pages.tolist()
        ]

    def _page(self, number: int) -> bytes:
        """The same object for each place, so that the shape keeps it once."""
        assert self.levels is not None
        if number not in self._pages:
            self._pages[number] = self.levels.page(number)
        return self._pages[number]


def _attribute(
    name: str, stream: int, form: ValueFormat, skipped: int, components: int
) -> Attribute:
    return Attribute(
        name.encode(errors="replace"),
        stream,
        form.components,
        skipped,
        components,
        form.scale,
        *form.limits,
        form.is_integer,
    )


def mesh_attributes(name: str, components: int) -> dict[str, tuple[int, int]]:
    """The names that Mitsuba knows an attribute of glTF by: (first, number) of its components.

    COLOR_0 becomes vertex_color and vertex_alpha, COLOR_1 vertex_color_1, _TEMPERATURE
    vertex_temperature. Empty for those with a place of their own, and those of skins.
    """
    if name in OWN_PLACE or name.startswith(UNUSED):
        return {}
    plain = name.lower().lstrip("_")
    plain = plain[:-2] if plain.endswith("_0") else plain
    if name.startswith("COLOR_") and components == 4:
        alpha = plain.replace("color", "alpha")
        return {f"vertex_{plain}": (0, 3), f"vertex_{alpha}": (3, 1)}
    return {f"vertex_{plain}": (0, components)}
