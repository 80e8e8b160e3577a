"""A glTF scene with compressed primitives on the host: the facts that drawing needs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.attributes.extension import Compressed, malformed, read_compressed, require_compressed
from gltf_ext.attributes.streams import (
    GRID,
    OCT,
    SIGN,
    from_ordered_bits,
    streams_of,
)
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import MAX_SIZE
from gltf_ext.errors import MeshletError
from gltf_ext.lod.reading import LodPrimitive, read_lod
from gltf_ext.ranges import begins
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import is_compressed
from gltf_scene.features import STRENGTH, UNLIT, undrawn
from gltf_scene.instancing import MAX_PLACES
from gltf_scene.scene import PlacedPrimitive, read_scene
from gltf_scene.values import ValueFormat, box_corners, position_box, value_format
from gltf_scene.view_points import view_points

from ..gpu.constants import CONSTANTS
from .camera import Camera
from .decoded import (
    HAS_COLOR,
    HAS_NORMAL,
    HAS_TEXCOORD,
    VERTEX_FLOATS,
    Decoded,
    meshlet_triangles,
)
from .instances import Instances
from .materials import Material, Materials, Texture

DRAWN = frozenset({UNLIT, STRENGTH})  # of gltf_scene.features
MAX_MESHLETS = 1 << 31  # of all instances: shaders number them with 32 bits
# Attributes that shading needs: role -> elements that it may have.
ROLES = {"POSITION": (3,), "NORMAL": (3,), "TEXCOORD": (2,), "COLOR": (3, 4)}
SHADED = tuple(ROLES)


@dataclass(frozen=True)
class Attribute:
    """One attribute that shading needs.

    stream, index: its stream and the stream's number; element: number of the stream's first
    element; format: how the integers of its accessor become floats.
    """

    stream: Stream
    index: int
    element: int
    format: ValueFormat

    @property
    def rounded(self) -> bool:
        """Values are rounded to the integers of the accessor."""
        return self.format.is_integer

    @property
    def scale(self) -> float:
        """Factor from the accessor's numbers to values."""
        return self.format.scale

    def values(self, integers: np.ndarray) -> np.ndarray:
        """float32[V, elements (3 for OCT)] of uint32[V, elements].

        Positions have the same bits as in shaders/scene/scene.glsl.
        """
        kind, bits = self.stream.kind, self.stream.bits
        if kind == OCT:
            return _unit_of_oct(integers, bits)
        if kind == GRID:
            offset, step = np.array(self.stream.offset, np.float32), np.float32(self.stream.step)
            values = offset + integers.astype(np.float32) * step
            return self.format.to_floats(np.rint(values) if self.rounded else values)
        if kind == CONSTANTS["KIND_FLOAT32"]:
            return from_ordered_bits(integers)
        return self.format.to_floats(integers)


def _unit_of_oct(integers: np.ndarray, bits: int) -> np.ndarray:
    """float32[V, 3] unit vectors of octahedral pairs, as the shaders compute them."""
    # An even number of steps: 0 and the axes are exact.
    plane = integers.astype(np.float32) * (np.float32(2.0) / np.float32((1 << bits) - 2))
    plane -= np.float32(1.0)
    z = np.float32(1.0) - np.abs(plane).sum(axis=1)
    plane -= np.copysign(np.maximum(-z, np.float32(0.0))[:, None], plane)
    vectors = np.column_stack([plane, z])
    lengths: np.ndarray = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    return np.asarray(vectors / lengths, np.float32)


@dataclass
class Primitive:
    """One compressed primitive of the file, or one of its pages.

    stream_end: shading needs only streams before this one; attributes: by role, see ROLES;
    low, high: float64[3], the bounding box of the whole primitive's positions; first_meshlet:
    number of meshlets in the pages before this one. source: the primitive of the file if the scene
    was loaded with levels; then blob is empty and meshlets is 0. chosen: int64[meshlets], those of
    the blob that are drawn; None: all. Only ray tracing draws some.
    """

    where: str
    blob: bytes
    streams: list[Stream]
    triangles: int
    vertices: int
    meshlets: int
    stream_end: int
    attributes: dict[str, Attribute]
    low: np.ndarray
    high: np.ndarray
    first_meshlet: int = 0
    source: LodPrimitive | Compressed | None = None
    chosen: np.ndarray | None = None

    @property
    def drawn(self) -> np.ndarray:
        """int64[meshlets]: numbers in the blob."""
        return np.arange(self.meshlets) if self.chosen is None else self.chosen

    @property
    def elements(self) -> int:
        """Elements of the streams that shading needs."""
        return sum(s.elements for s in self.streams[: self.stream_end])

    @property
    def position_bits(self) -> int:
        return self.streams[0].bits

    def decoded(self) -> Decoded:
        """Uncompressed geometry, which is kept. Raises MeshletError for malformed bytes."""
        return self._decoded

    @cached_property
    def _decoded(self) -> Decoded:
        try:
            triangles, integers = _codec.decode(self.blob)
        except ValueError as error:
            raise malformed(self.where, error) from None
        values = {name: a.values(integers[a.index]) for name, a in self.attributes.items()}
        normals, texcoords, colors = (values.get(name) for name in SHADED[1:])
        if colors is not None and colors.shape[1] == 3:
            colors = np.concatenate([colors, np.ones((len(colors), 1), np.float32)], axis=1)
        return Decoded(
            triangles, values["POSITION"], normals, texcoords, colors, meshlet_triangles(self.blob)
        )


@dataclass
class Scene:
    """The compressed primitives of a file, placed.

    low, high: float64[3], bounding box in world space; document, placed: the source of all
    primitives, uncompressed ones too; warnings: features that are ignored.
    """

    path: str
    primitives: list[Primitive]
    instances: Instances
    materials: list[Material]
    textures: list[Texture]
    cameras: list[Camera]
    low: np.ndarray
    high: np.ndarray
    document: Document
    placed: list[PlacedPrimitive]
    warnings: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not isinstance(self.instances, Instances):
            self.instances = Instances.of(self.instances)

    @cached_property
    def view_points(self) -> np.ndarray:
        """float64[n, 3]: points of all that the file shows. Raises MeshletError."""
        return view_points(self.document, self.placed)

    def whole_ids(self, ids: np.ndarray) -> np.ndarray:
        """uint32[..., 2] ids (instance, meshlet * 64 + triangle) as without pages.

        Instances and meshlets are numbered as if each primitive were one blob. Pixels without a
        surface keep their id.
        """
        if not any(primitive.first_meshlet for primitive in self.primitives):
            return ids
        numbers = np.cumsum(self.instances.page == 0) - 1
        first = self.of_instances([p.first_meshlet for p in self.primitives])
        drawn = ids[..., 0] < len(self.instances)
        own = ids[drawn]
        result: np.ndarray = ids.copy()
        result[drawn, 0] = numbers[own[:, 0]]
        result[drawn, 1] = own[:, 1] + first[own[:, 0]] * CONSTANTS["MESHLET_TRIANGLES"]
        return result

    def drawn_ids(self, ids: np.ndarray) -> np.ndarray:
        """uint32[..., 2] ids (instance, meshlet * 64 + triangle) of (instance, the same by rank).

        The latter count the drawn meshlets of a primitive.
        """
        if all(primitive.chosen is None for primitive in self.primitives):
            return ids
        begin = begins(np.array([p.meshlets for p in self.primitives]))
        of_instance = begin[self.instances.primitive]
        numbers = np.concatenate([p.drawn for p in self.primitives])
        drawn = ids[..., 0] < len(self.instances)
        place, triangle = np.divmod(ids[drawn, 1], CONSTANTS["MESHLET_TRIANGLES"])
        result: np.ndarray = ids.copy()
        meshlet = numbers[of_instance[ids[drawn, 0]] + place]
        result[drawn, 1] = meshlet * CONSTANTS["MESHLET_TRIANGLES"] + triangle
        return result

    def meshlet_ids(self, ids: np.ndarray) -> np.ndarray:
        """uint32[..., 2] ids (instance, meshlet * 64 + triangle) of (instance, triangle).

        The latter count triangles through all meshlets of a primitive.
        """
        result: np.ndarray = ids.copy()
        drawn = ids[..., 0] < len(self.instances)
        own = ids[drawn]
        primitive = self.instances.primitive[own[:, 0]]
        for number in np.unique(primitive):
            at = primitive == number
            own[at, 1] = self.primitives[number].decoded().ids()[own[at, 1]]
        result[drawn] = own
        return result

    def of_instances(self, values: Sequence[int]) -> np.ndarray:
        """int64[n]: of each instance the value of its primitive."""
        return np.asarray(np.array(values, np.int64)[self.instances.primitive])

    @cached_property
    def instance_meshlets(self) -> np.ndarray:
        """int64[n]: meshlets of each instance."""
        return self.of_instances([p.meshlets for p in self.primitives])

    @property
    def compressed_bytes(self) -> int:
        """Of all different blobs, coarse pages included if the scene was loaded with levels."""
        if not self.has_levels:
            return sum(len(blob) for blob in {p.blob for p in self.primitives})
        return sum(
            len(source.coarse) + len(source.compressed.blob)
            if isinstance(source, LodPrimitive)
            else len(source.blob)
            for source in self.sources
        )

    @property
    def has_levels(self) -> bool:
        """Whether it was loaded with levels."""
        return self.primitives[0].source is not None

    @property
    def sources(self) -> list[LodPrimitive | Compressed]:
        """The file's primitives, if the scene was loaded with levels."""
        return [p.source for p in self.primitives if p.source is not None]

    @property
    def triangles(self) -> int:
        """Of all instances."""
        return int(self.of_instances([p.triangles for p in self.primitives]).sum())

    @property
    def attributes(self) -> int:
        """HAS_ bits of the attributes that at least one primitive has."""
        names = {name for p in self.primitives for name in p.attributes}
        return sum(
            bit
            for bit, name in zip((HAS_NORMAL, HAS_TEXCOORD, HAS_COLOR), SHADED[1:])
            if name in names
        )

    @property
    def any_masked(self) -> bool:
        """Whether a surface of an instance may be transparent."""
        return any(self.materials[number].masked for number in np.unique(self.instances.material))

    @property
    def vertex_floats(self) -> int:
        """Floats of an uncompressed vertex."""
        return 3 + sum(floats for bit, floats in VERTEX_FLOATS if self.attributes & bit)

    @property
    def max_streams(self) -> int:
        """Most streams of a blob: the shaders' MAX_STREAMS."""
        return max(len(p.streams) for p in self.primitives)

    @property
    def max_elements(self) -> int:
        """Most elements that shading needs of a blob: the shaders' MAX_ELEMENTS."""
        return max(p.elements for p in self.primitives)


def load_scene(path: str | os.PathLike[str], *, levels: bool = False) -> Scene:
    """The default scene of a file.

    levels: load levels of detail, too, and no pages; `Renderer` then draws what a camera needs.
    Raises OSError, and MeshletError for files that are not valid or hold nothing compressed.
    """
    try:
        return _Loader(os.fspath(path), open_model(path), levels).result()
    except MeshletError as error:
        error.path = error.path or os.fspath(path)
        raise


class _Loader:
    """Adds the compressed primitives of a glTF scene to a Scene."""

    def __init__(self, path: str, document: Document, levels: bool):
        self._path, self._document, self._levels = path, document, levels
        self._materials = Materials(document)
        self._indices: dict[tuple[int, int], range] = {}
        self._primitives: list[Primitive] = []
        self._warnings: list[str] = []

    def result(self) -> Scene:
        require_compressed(self._document)
        source = read_scene(self._document)
        self._warnings += source.warnings + undrawn(self._document, DRAWN)
        parts = [self._instances(p) for p in source.primitives if self._is_compressed(p)]
        if not parts:
            raise MeshletError(
                "no node of its scene shows a compressed primitive",
                "check the file in another viewer",
            )
        instances = self._joined(parts)
        low, high = self._bounds(instances)
        return Scene(
            self._path,
            self._primitives,
            instances,
            self._materials.records,
            self._materials.textures,
            [Camera.of(camera) for camera in source.cameras],
            low,
            high,
            self._document,
            source.primitives,
            list(dict.fromkeys(self._warnings + self._materials.warnings)),
        )

    def _is_compressed(self, placed: PlacedPrimitive) -> bool:
        """Whether it is drawn; otherwise adds a warning."""
        primitive = self._document.primitive(placed.mesh, placed.primitive)
        if is_compressed(primitive):
            return True
        self._warnings.append(
            f"mesh {placed.mesh} primitive {placed.primitive} is not compressed and is left out"
        )
        return False

    def _instances(self, placed: PlacedPrimitive) -> Instances:
        """A placed primitive: in each place an instance for each of its pages."""
        material, texcoord = self._materials.index(placed.material)
        place = placed.mesh, placed.primitive
        if place not in self._indices:
            compressed = read_compressed(self._document, *place)
            first = len(self._primitives)
            self._primitives += self._pages(compressed, texcoord)
            self._indices[place] = range(first, len(self._primitives))
        pages = self._indices[place]
        self._require_few(len(pages) * len(placed.matrices))
        return Instances.placed(pages, material, placed.matrices)

    def _joined(self, parts: list[Instances]) -> Instances:
        self._require_few(sum(map(len, parts)))
        instances = Instances.joined(parts)
        meshlets = np.array([p.meshlets for p in self._primitives], np.int64)
        total = int(meshlets[instances.primitive].sum())
        if total > MAX_MESHLETS:
            raise MeshletError(
                f"its instances have {total:,} meshlets, more than {MAX_MESHLETS:,}",
                "split the scene",
            )
        return instances

    def _require_few(self, count: int) -> None:
        if count > MAX_PLACES:
            raise MeshletError(
                f"its instances have {count:,} pages, more than {MAX_PLACES:,}",
                "compress the original again with larger pages, or split the scene",
            )

    def _pages(self, compressed: Compressed, texcoord: int) -> list[Primitive]:
        names = dict(zip(ROLES, ("POSITION", "NORMAL", f"TEXCOORD_{texcoord}", "COLOR_0")))
        attributes = {}
        for role, name in names.items():
            attribute = self._attribute(compressed, role, name)
            if attribute is not None:
                attributes[role] = attribute
        whole = Primitive(
            compressed.where,
            b"",
            compressed.streams,
            compressed.triangle_count,
            compressed.vertex_count,
            0,
            1 + max(a.index for a in attributes.values()),
            attributes,
            *self._box(compressed, attributes["POSITION"]),
        )
        if self._levels:
            return [replace(whole, source=read_lod(self._document, compressed) or compressed)]
        pages: list[Primitive] = []
        first_meshlet = 0
        for blob in compressed.blobs:
            decoder = _codec.Decoder(blob)
            page = replace(
                whole,
                blob=blob,
                triangles=decoder.triangle_count,
                vertices=decoder.vertex_count,
                meshlets=decoder.meshlet_count,
                first_meshlet=first_meshlet,
            )
            pages.append(page)
            first_meshlet += page.meshlets
        return pages

    def _attribute(self, compressed: Compressed, role: str, name: str) -> Attribute | None:
        """None, with a warning, for a form that the shaders do not have."""
        if name not in compressed.attributes:
            return None
        first, (_, components) = compressed.attributes[name]
        stream = compressed.streams[first]
        one_stream = len(streams_of(first, components, compressed.streams)) == 1
        if not one_stream or stream.kind == SIGN or stream.width not in ROLES[role]:
            self._warnings.append(
                f"{name} of {compressed.where} has an unusual form and is left out"
            )
            return None
        element = sum(s.elements for s in compressed.streams[:first])
        primitive = self._document.primitive(compressed.mesh, compressed.primitive)
        return Attribute(stream, first, element, value_format(self._document, primitive, name))

    def _box(self, compressed: Compressed, position: Attribute) -> tuple[np.ndarray, np.ndarray]:
        """The accessor's box within the grid of positions, or the whole grid if there is none."""
        corners = np.array([[0, 0, 0], [(1 << position.stream.bits) - 1] * 3], np.uint32)
        with np.errstate(over="ignore", invalid="ignore"):
            low, high = position.values(corners).astype(np.float64)
        if not (np.abs([low, high]) < MAX_SIZE).all():
            raise MeshletError(
                f"positions of {compressed.where} are not finite, or larger than {MAX_SIZE:g}",
                "export the file again, smaller",
            )
        primitive = self._document.primitive(compressed.mesh, compressed.primitive)
        box = position_box(self._document, primitive)
        if box is None:
            return low, high
        return np.clip(box[0], low, high), np.clip(box[1], low, high)

    def _bounds(self, instances: Instances) -> tuple[np.ndarray, np.ndarray]:
        """(low, high), float64[3] each, of all instances in world space."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for number, own in instances.of_primitive.items():
            primitive = self._primitives[number]
            matrices = instances.matrix[own]
            local = box_corners(primitive.low, primitive.high)
            corners = np.matmul(local, matrices[:, :3, :3].transpose(0, 2, 1))
            corners += matrices[:, None, :3, 3]
            low = np.minimum(low, corners.min(axis=(0, 1)))
            high = np.maximum(high, corners.max(axis=(0, 1)))
        return low, high
