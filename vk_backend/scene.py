"""A glTF scene with compressed primitives, for Vulkan: on the host, and as the buffers that shaders/scene.glsl describes."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pygltflib

from gltf_ext import _codec
from gltf_ext.compression.extension import (
    EXTENSION,
    Compressed,
    malformed,
    read_compressed,
    require_compressed,
)
from gltf_ext.compression.streams import GRID, OCT, SIGN, Stream, streams_of
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document, item, named_indices
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.nodes import placed

from .camera import Camera, gltf_camera
from .constants import CONSTANTS
from .errors import VulkanError
from .materials import Material, Materials, Texture

if TYPE_CHECKING:
    from .device import Device

# Of a workgroup that is a team (shaders/meshlet_workgroup.glsl): shared bytes for each component, for each stream, and for the rest, at most.
TEAM_BYTES = (512, 8, 4096)

# Accessors whose integers are fractions even where a file forgets to say `normalized`.
ALWAYS_NORMALIZED = ("COLOR_", "NORMAL", "TEXCOORD_")
MAX_SIZE = 1e15  # of a scene: 32-bit floats must be able to hold products of sizes
SHADED = ("POSITION", "NORMAL", "TEXCOORD", "COLOR")
NO_ELEMENT = CONSTANTS["NO_ELEMENT"]
# Bits of `Scene.attributes` and of the shaders' constant ATTRIBUTES, with the floats that each takes in an uncompressed vertex.
HAS_NORMAL, HAS_TEXCOORD, HAS_COLOR = (
    CONSTANTS[name] for name in ("HAS_NORMAL", "HAS_TEXCOORD", "HAS_COLOR")
)
VERTEX_FLOATS = ((HAS_NORMAL, 3), (HAS_TEXCOORD, 2), (HAS_COLOR, 4))

# The structures of shaders/scene.glsl (std430).
ATTRIBUTE = np.dtype(
    [
        ("offset", "<f4", 4),
        ("step", "<f4"),
        ("element", "<u4"),
        ("kind_bits", "<u4"),
        ("scale", "<f4"),
    ]
)
PRIMITIVE = np.dtype(
    [
        ("blob", "<u4", 2),
        ("blob_words", "<u4"),
        ("meshlets", "<u4"),
        ("stream_end", "<u4"),
        ("elements", "<u4"),
        ("triangles", "<u4"),
        ("vertices", "<u4"),
        ("bounds", "<u4", 2),
        ("vertex_data", "<u4", 2),
        ("index_data", "<u4", 2),
        ("plain_meshlets", "<u4", 2),
        ("box_low", "<f4", 4),
        ("box_size", "<f4", 4),
        ("position", ATTRIBUTE),
        ("normal", ATTRIBUTE),
        ("texcoord", ATTRIBUTE),
        ("color", ATTRIBUTE),
    ]
)
# Matrices are stored column by column: numpy's [4, 4] transposed.
INSTANCE = np.dtype(
    [
        ("object_to_world", "<f4", (4, 4)),
        ("world_to_object", "<f4", (4, 4)),
        ("primitive", "<u4"),
        ("material", "<u4"),
        ("id", "<u4"),
        ("flags", "<u4"),
    ]
)
MATERIAL = np.dtype(
    [
        ("base_color", "<f4", 4),
        ("emissive", "<f4", 4),
        ("texcoord_matrix", "<f4", 4),
        ("texcoord_offset", "<f4", 2),
        ("metallic", "<f4"),
        ("roughness", "<f4"),
        ("alpha_cutoff", "<f4"),
        ("flags", "<u4"),
        ("base_texture", "<i4"),
        ("emissive_texture", "<i4"),
    ]
)
FRAME = np.dtype(
    [
        ("world_to_clip", "<f4", (4, 4)),
        ("clip_to_world", "<f4", (4, 4)),
        ("eye", "<f4", 4),
        ("light_direction", "<f4", 4),
        ("primitives", "<u4", 2),
        ("instances", "<u4", 2),
        ("materials", "<u4", 2),
        ("object_to_clip", "<u4", 2),
        ("plain_words", "<u4", 2),
        ("width", "<u4"),
        ("height", "<u4"),
    ]
)
PLAIN_MESHLET = np.dtype([("first", "<u4"), ("counts", "<u4")])

# --- on the host ---


@dataclass(frozen=True)
class Attribute:
    """One attribute that shading needs: its stream, the stream's first element, and what its integers mean.

    rounded: the accessor holds integers; scale: what they are multiplied by.
    """

    stream: Stream
    index: int
    element: int
    rounded: bool
    scale: float

    def record(self) -> np.ndarray:
        """ATTRIBUTE[()]"""
        row = np.zeros((), ATTRIBUTE)
        row["offset"][: len(self.stream.offset)] = self.stream.offset
        row["step"], row["element"], row["scale"] = self.stream.step, self.element, self.scale
        kind_bits = self.stream.kind | self.stream.bits << 8 | self.stream.components << 16
        row["kind_bits"] = kind_bits | (CONSTANTS["ATTRIBUTE_ROUND"] if self.rounded else 0)
        return row

    def values(self, integers: np.ndarray) -> np.ndarray:
        """float32[V, components (3 for OCT)] of uint32[V, components]: what shaders/scene.glsl computes, bit for bit for positions."""
        kind, bits = self.stream.kind, self.stream.bits
        if kind == OCT:
            return _unit_of_oct(integers, bits)
        if kind == GRID:
            offset, step = np.array(self.stream.offset, np.float32), np.float32(self.stream.step)
            values = offset + integers.astype(np.float32) * step
            return (np.rint(values) if self.rounded else values) * np.float32(self.scale)
        if kind == CONSTANTS["KIND_FLOAT32"]:
            return (
                np.where(integers >> 31, integers ^ np.uint32(0x80000000), ~integers)
                .astype(np.uint32)
                .view(np.float32)
            )
        return integers.astype(np.float32) * np.float32(self.scale)


def _unit_of_oct(integers: np.ndarray, bits: int) -> np.ndarray:
    plane = np.float32(2.0) * integers.astype(np.float32) / np.float32(
        (1 << bits) - 1
    ) - np.float32(1.0)
    z = np.float32(1.0) - np.abs(plane).sum(axis=1)
    plane -= np.copysign(np.maximum(-z, np.float32(0.0))[:, None], plane)
    vectors = np.column_stack([plane, z])
    return vectors / np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Decoded:
    """A primitive without its compression, for the baselines and for tests.

    triangles: uint32[T, 3] in the order of the meshlets; positions float32[V, 3]; normals float32[V, 3], texcoords float32[V, 2],
    colors float32[V, 4] or None; meshlet_triangles: int64[M], triangles of each meshlet.
    """

    triangles: np.ndarray
    positions: np.ndarray
    normals: np.ndarray | None
    texcoords: np.ndarray | None
    colors: np.ndarray | None
    meshlet_triangles: np.ndarray

    def vertices(self, attributes: int) -> np.ndarray:
        """float32[V, n]: positions and the given attributes side by side, 0 (colours 1) where the primitive lacks one."""
        count = len(self.positions)
        columns = [self.positions]
        columns += [_or_constant(self.normals, count, 3, 0.0)] if attributes & HAS_NORMAL else []
        columns += (
            [_or_constant(self.texcoords, count, 2, 0.0)] if attributes & HAS_TEXCOORD else []
        )
        columns += [_or_constant(self.colors, count, 4, 1.0)] if attributes & HAS_COLOR else []
        return np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32)

    def ids(self) -> np.ndarray:
        """uint32[T]: meshlet * 64 + number in the meshlet, of each triangle."""
        counts = self.meshlet_triangles
        first = np.repeat(np.cumsum(counts) - counts, counts)
        meshlet = np.repeat(np.arange(len(counts)), counts)
        return (meshlet * CONSTANTS["MESHLET_TRIANGLES"] + np.arange(len(first)) - first).astype(
            np.uint32
        )

    def meshlets(self) -> tuple[np.ndarray, np.ndarray]:
        """(PLAIN_MESHLET[M], uint32 words): each meshlet's vertex numbers, and its triangles as bytes a | b << 8 | v << 16."""
        counts = self.meshlet_triangles
        meshlet = np.repeat(np.arange(len(counts), dtype=np.uint64), 3 * counts)
        keys, local = np.unique(
            meshlet << np.uint64(32) | self.triangles.ravel(), return_inverse=True
        )
        first_key = np.searchsorted(
            keys, np.arange(len(counts) + 1, dtype=np.uint64) << np.uint64(32)
        )
        vertex_counts = np.diff(first_key)
        corners = (local.reshape(-1, 3) - np.repeat(first_key[:-1], counts)[:, None]).astype(
            np.uint32
        )
        rows = np.zeros(len(counts), PLAIN_MESHLET)
        rows["first"] = np.cumsum(vertex_counts + counts) - (vertex_counts + counts)
        rows["counts"] = vertex_counts | counts << 8
        words = np.empty(len(keys) + len(corners), np.uint32)
        before = np.cumsum(counts) - counts  # triangles of the meshlets before
        words[np.arange(len(keys)) + np.repeat(before, vertex_counts)] = keys & np.uint64(
            0xFFFFFFFF
        )
        after = np.repeat(
            first_key[1:], counts
        )  # vertices of the meshlets up to the triangle's own
        words[np.arange(len(corners)) + after] = (
            corners[:, 0] | corners[:, 1] << 8 | corners[:, 2] << 16
        )
        return rows, words


def _or_constant(
    values: np.ndarray | None, count: int, components: int, constant: float
) -> np.ndarray:
    return np.full((count, components), constant, np.float32) if values is None else values


@dataclass
class Primitive:
    """One compressed primitive, as it is in the file.

    stream_end: streams before it hold all that shading needs; elements: their components. low, high: float64[3], the positions' box.
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

    @property
    def elements(self) -> int:
        return sum(s.components for s in self.streams[: self.stream_end])

    @property
    def position_bits(self) -> int:
        return self.streams[0].bits

    def decoded(self) -> Decoded:
        """Everything, through the codec; the result is kept. Raises MeshletError for malformed bytes."""
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


def meshlet_triangles(blob: bytes) -> np.ndarray:
    """int64[M]: triangles of each meshlet, from the blob's directory."""
    streams, meshlets = blob[5], int.from_bytes(blob[16:20], "little")
    groups = -(-meshlets // CONSTANTS["BLOB_GROUP_MESHLETS"])
    directory = (
        CONSTANTS["BLOB_HEADER_BYTES"]
        + CONSTANTS["BLOB_STREAM_BYTES"] * streams
        + CONSTANTS["BLOB_GROUP_BYTES"] * groups
    )
    entries = np.frombuffer(blob, "<u4", meshlets, directory)
    mask = (1 << CONSTANTS["BLOB_TRIANGLE_BITS"]) - 1
    return (entries >> CONSTANTS["BLOB_OFFSET_BITS"] & mask).astype(np.int64) + 1


@dataclass(frozen=True)
class Instance:
    """A primitive in its place. matrix: float64[4, 4], object to world."""

    primitive: int
    material: int
    matrix: np.ndarray

    @property
    def mirrored(self) -> bool:
        return bool(np.linalg.det(self.matrix[:3, :3]) < 0)


@dataclass
class Scene:
    """A file's compressed primitives, placed. low, high: float64[3] in world space; warnings: what was left out."""

    path: str
    primitives: list[Primitive]
    instances: list[Instance]
    materials: list[Material]
    textures: list[Texture]
    cameras: list[Camera]
    low: np.ndarray
    high: np.ndarray
    warnings: list[str] = field(default_factory=list)

    @property
    def compressed_bytes(self) -> int:
        """Of all blobs, each counted once."""
        return sum(len(blob) for blob in {p.blob for p in self.primitives})

    @property
    def triangles(self) -> int:
        """Of all instances."""
        return sum(self.primitives[i.primitive].triangles for i in self.instances)

    @property
    def attributes(self) -> int:
        """HAS_ bits of what any primitive has."""
        names = {name for p in self.primitives for name in p.attributes}
        return sum(
            bit
            for bit, name in zip((HAS_NORMAL, HAS_TEXCOORD, HAS_COLOR), SHADED[1:])
            if name in names
        )

    @property
    def vertex_floats(self) -> int:
        """Floats of an uncompressed vertex."""
        return 3 + sum(floats for bit, floats in VERTEX_FLOATS if self.attributes & bit)

    @property
    def max_streams(self) -> int:
        """Streams of the blob that has most: the shaders' MAX_STREAMS."""
        return max(len(p.streams) for p in self.primitives)

    @property
    def max_elements(self) -> int:
        """Components of the decoded streams of the blob that has most: the shaders' MAX_ELEMENTS."""
        return max(p.elements for p in self.primitives)


def load_scene(path: str | os.PathLike) -> Scene:
    """The scene of a file. Raises MeshletError for a file that is not valid or holds nothing compressed, OSError."""
    try:
        return _Loader(os.fspath(path), open_model(path)).result()
    except MeshletError as error:
        error.path = error.path or os.fspath(path)
        raise


class _Loader:
    """Walks the nodes of a document and gathers what they show."""

    def __init__(self, path: str, document: Document):
        self._path, self._document = path, document
        self._materials = Materials(document)
        self._primitives: dict[tuple[int, int], int] = {}
        self._found: list[Primitive] = []
        self._instances: list[Instance] = []
        self._cameras: list[Camera] = []
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._warnings: list[str] = []

    def result(self) -> Scene:
        require_compressed(self._document)
        for node, matrix in placed(self._document):
            if not (np.abs(matrix) < MAX_SIZE).all():
                raise MeshletError(
                    f"a node's transform is not finite, or larger than {MAX_SIZE:g}",
                    "export the file again, smaller",
                )
            if node.camera is not None:
                self._cameras.append(
                    gltf_camera(item(self._document.cameras, node.camera, "camera"), matrix)
                )
            if node.mesh is not None:
                self._place(node, matrix)
        if not self._instances:
            raise MeshletError(
                "no node of its scene shows a compressed primitive",
                "check the file in another viewer",
            )
        return Scene(
            self._path,
            self._found,
            self._instances,
            self._materials.records,
            self._materials.textures,
            self._cameras,
            self._low,
            self._high,
            list(dict.fromkeys(self._warnings + self._materials.warnings)),
        )

    def _place(self, node: pygltflib.Node, matrix: np.ndarray) -> None:
        mesh = item(self._document.meshes, node.mesh, "mesh")
        if node.skin is not None:
            self._warnings.append("a skin is not applied: the mesh is shown in its bind pose")
        if "EXT_mesh_gpu_instancing" in (node.extensions or {}):
            self._warnings.append("EXT_mesh_gpu_instancing is not applied: the mesh is shown once")
        for number, primitive in enumerate(mesh.primitives):
            if EXTENSION not in (primitive.extensions or {}):
                self._warnings.append(
                    f"mesh {node.mesh} primitive {number} is not compressed and is left out"
                )
                continue
            material, texcoord = self._materials.index(primitive.material)
            index = self._primitive(node.mesh, number, texcoord)
            self._instances.append(Instance(index, material, matrix))
            self._extend(self._found[index], matrix)

    def _primitive(self, mesh: int, number: int, texcoord: int) -> int:
        if (mesh, number) not in self._primitives:
            compressed = read_compressed(self._document, mesh, number)
            if compressed.targets:
                self._warnings.append("morph targets are not applied")
            self._primitives[mesh, number] = len(self._found)
            self._found.append(self._read(compressed, texcoord))
        return self._primitives[mesh, number]

    def _read(self, compressed: Compressed, texcoord: int) -> Primitive:
        names = {
            "POSITION": "POSITION",
            "NORMAL": "NORMAL",
            "TEXCOORD": f"TEXCOORD_{texcoord}",
            "COLOR": "COLOR_0",
        }
        attributes = {}
        for role, name in names.items():
            attribute = self._attribute(compressed, role, name)
            if attribute is not None:
                attributes[role] = attribute
        stream_end = 1 + max(a.index for a in attributes.values())
        low, high = self._box(compressed, attributes["POSITION"])
        meshlets = _codec.Decoder(compressed.blob).meshlet_count
        return Primitive(
            compressed.where,
            compressed.blob,
            compressed.streams,
            compressed.triangle_count,
            compressed.vertex_count,
            meshlets,
            stream_end,
            attributes,
            low,
            high,
        )

    def _attribute(self, compressed: Compressed, role: str, name: str) -> Attribute | None:
        if name not in compressed.attributes:
            return None
        first, (dtype, components) = compressed.attributes[name]
        stream = compressed.streams[first]
        fits = {"POSITION": (3,), "NORMAL": (3,), "TEXCOORD": (2,), "COLOR": (3, 4)}[role]
        if (
            len(streams_of(first, components, compressed.streams)) > 1
            or stream.kind == SIGN
            or stream.width not in fits
        ):
            self._warnings.append(
                f"{name} of {compressed.where} has an unusual form and is left out"
            )
            return None
        element = sum(s.components for s in compressed.streams[:first])
        if dtype.kind == "f":
            return Attribute(stream, first, element, False, 1.0)
        primitive = self._document.meshes[compressed.mesh].primitives[compressed.primitive]
        accessor = self._document.accessors[named_indices(primitive.attributes)[name]]
        normalized = accessor.normalized or name.startswith(ALWAYS_NORMALIZED)
        return Attribute(
            stream,
            first,
            element,
            True,
            float(np.float32(1.0 / np.iinfo(dtype).max)) if normalized else 1.0,
        )

    def _box(self, compressed: Compressed, position: Attribute) -> tuple[np.ndarray, np.ndarray]:
        """The accessor's min and max, or the whole grid where these are missing or not of this primitive."""
        primitive = self._document.meshes[compressed.mesh].primitives[compressed.primitive]
        accessor = self._document.accessors[named_indices(primitive.attributes)["POSITION"]]
        corners = np.array([[0, 0, 0], [(1 << position.stream.bits) - 1] * 3], np.uint32)
        with np.errstate(over="ignore", invalid="ignore"):
            low, high = position.values(corners).astype(np.float64)
        if not (np.abs([low, high]) < MAX_SIZE).all():
            raise MeshletError(
                f"positions of {compressed.where} are not finite, or larger than {MAX_SIZE:g}",
                "export the file again, smaller",
            )
        given = [accessor.min, accessor.max]
        if all(g is not None and len(g) == 3 and np.isfinite(g).all() for g in given):
            bounds = np.array(given, np.float64) * position.scale
            if (bounds[0] <= bounds[1]).all():
                low, high = np.clip(bounds[0], low, high), np.clip(bounds[1], low, high)
        return low, high

    def _extend(self, primitive: Primitive, matrix: np.ndarray) -> None:
        corners = np.array(
            [[(primitive.low, primitive.high)[i >> a & 1][a] for a in range(3)] for i in range(8)]
        )
        corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
        self._low, self._high = (
            np.minimum(self._low, corners.min(axis=0)),
            np.maximum(self._high, corners.max(axis=0)),
        )


# --- on the device ---


def address_words(address: int) -> tuple[int, int]:
    """A buffer address as the (low, high) words of a uvec2."""
    return address & 0xFFFFFFFF, address >> 32


class SceneBuffers:
    """A scene's buffers for one path.

    needs: of "blobs" (the compressed bytes), "bounds" (room for the culling bounds), "vertices" (uncompressed vertices), "indices"
    (and their triangles), "plain" (uncompressed meshlets over the vertices). resident_bytes: what all of it takes; images apart.
    """

    def __init__(self, device: Device, scene: Scene, needs: Iterable[str]):
        self.device, self.scene, self._buffers = device, scene, []
        needs = frozenset(needs)
        unknown = needs - {"blobs", "bounds", "vertices", "indices", "plain"}
        if unknown:
            raise ValueError(f"unknown needs: {', '.join(sorted(unknown))}")
        self.primitives = np.array([_primitive_record(p) for p in scene.primitives], PRIMITIVE)
        self.blobs: Any = None
        self.index_buffer: Any = None
        self.plain_words = 0  # address
        if "blobs" in needs:
            self._upload_blobs()
        if "bounds" in needs:
            self._reserve_bounds()
        if "vertices" in needs:
            self._upload_vertices()
        if "indices" in needs:
            self._upload_indices()
        if "plain" in needs:
            self._upload_plain()
        self._upload_tables()

    @property
    def resident_bytes(self) -> int:
        return sum(buffer.allocated for buffer in self._buffers)

    def index_range(self, primitive: int) -> tuple[int, int, int]:
        """(first index, first vertex, number of indices) of a primitive in the index and vertex buffers."""
        before, own = self.scene.primitives[:primitive], self.scene.primitives[primitive]
        return (
            3 * sum(p.triangles for p in before),
            sum(p.vertices for p in before),
            3 * own.triangles,
        )

    def free(self) -> None:
        for buffer in self._buffers:
            buffer.free()

    # --- parts ---------------------------------------------------------------------------------------------------------------------

    def _new(self, data: np.ndarray | bytes | int, usage: int = 0):
        """A buffer of these bytes, or of so many."""
        from .memory import STORAGE, Buffer

        size = (
            data if isinstance(data, int) else len(data) if isinstance(data, bytes) else data.nbytes
        )
        buffer = Buffer(self.device, size, STORAGE | usage)
        self._buffers.append(buffer)
        return buffer if isinstance(data, int) else buffer.write(data)

    def _upload_blobs(self) -> None:
        place: dict[bytes, int] = {}
        size = 0
        for p in self.scene.primitives:
            if p.blob not in place:
                place[p.blob], size = size, size + len(p.blob)
        self.blobs = self._new(b"".join(place))
        for row, p in zip(self.primitives, self.scene.primitives):
            row["blob"], row["blob_words"] = (
                address_words(self.blobs.address + place[p.blob]),
                len(p.blob) // 4,
            )

    def _reserve_bounds(self) -> None:
        counts = (
            np.array([p.meshlets for p in self.scene.primitives], np.int64)
            * CONSTANTS["BOUNDS_BYTES"]
        )
        self.bounds = self._new(int(counts.sum()))
        for row, first in zip(self.primitives, np.cumsum(counts) - counts):
            row["bounds"] = address_words(self.bounds.address + int(first))

    def _upload_vertices(self) -> None:
        import vulkan as vk

        arrays = [p.decoded().vertices(self.scene.attributes) for p in self.scene.primitives]
        sizes = np.array([a.nbytes for a in arrays], np.int64)
        self.vertices = self._new(np.concatenate(arrays), vk.VK_BUFFER_USAGE_VERTEX_BUFFER_BIT)
        for row, first in zip(self.primitives, np.cumsum(sizes) - sizes):
            row["vertex_data"] = address_words(self.vertices.address + int(first))

    def _upload_indices(self) -> None:
        import vulkan as vk

        arrays = [p.decoded().triangles.ravel() for p in self.scene.primitives]
        counts = np.array([len(a) for a in arrays], np.int64)
        self.index_buffer = self._new(
            np.concatenate(arrays).astype(np.uint32), vk.VK_BUFFER_USAGE_INDEX_BUFFER_BIT
        )
        for row, first in zip(self.primitives, np.cumsum(counts) - counts):
            row["index_data"] = address_words(self.index_buffer.address + 4 * int(first))

    def _upload_plain(self) -> None:
        made = [p.decoded().meshlets() for p in self.scene.primitives]
        rows, before = [], 0
        for meshlets, words in made:
            meshlets = meshlets.copy()
            meshlets["first"] += np.uint32(before)
            rows.append(meshlets)
            before += len(words)
        counts = np.array([len(r) for r in rows], np.int64) * PLAIN_MESHLET.itemsize
        self._plain_meshlets, plain_words = (
            self._new(np.concatenate(rows)),
            self._new(np.concatenate([w for _, w in made])),
        )
        self.plain_words = plain_words.address
        for row, first in zip(self.primitives, np.cumsum(counts) - counts):
            row["plain_meshlets"] = address_words(self._plain_meshlets.address + int(first))

    def _upload_tables(self) -> None:
        """Primitives, instances and materials, one after the other in one buffer."""
        instances = np.array(
            [_instance_record(i, n) for n, i in enumerate(self.scene.instances)], INSTANCE
        )
        materials = np.array([m.record(MATERIAL) for m in self.scene.materials], MATERIAL)
        parts = [self.primitives.tobytes(), instances.tobytes(), materials.tobytes()]
        tables = self._new(b"".join(parts))
        self.primitives_address = tables.address
        self.instances_address = self.primitives_address + len(parts[0])
        self.materials_address = self.instances_address + len(parts[1])

    def frame_record(
        self, camera: Camera, width: int, height: int, object_to_clip: int
    ) -> np.ndarray:
        """FRAME[()] for a camera; object_to_clip: the address of `object_to_clip_matrices`."""
        row = np.zeros((), FRAME)
        row["world_to_clip"] = camera.world_to_clip(width, height).T
        row["clip_to_world"] = camera.clip_to_world(width, height).T
        row["eye"], row["light_direction"] = camera.eye, (*camera.light_direction(), 0.0)
        row["primitives"] = address_words(self.primitives_address)
        row["instances"] = address_words(self.instances_address)
        row["materials"] = address_words(self.materials_address)
        row["object_to_clip"] = address_words(object_to_clip)
        row["plain_words"] = address_words(self.plain_words)
        row["width"], row["height"] = width, height
        return row

    def object_to_clip_matrices(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """float32[instances, 4, 4], column by column."""
        world_to_clip = camera.world_to_clip(width, height)
        return np.array([(world_to_clip @ i.matrix).T for i in self.scene.instances], np.float32)


def _primitive_record(p: Primitive) -> np.ndarray:
    row = np.zeros((), PRIMITIVE)
    row["meshlets"], row["stream_end"], row["elements"] = p.meshlets, p.stream_end, p.elements
    row["triangles"], row["vertices"] = p.triangles, p.vertices
    row["box_low"][:3], row["box_size"][:3] = p.low, p.high - p.low
    for role in SHADED:
        row[role.lower()]["element"] = NO_ELEMENT
        if role in p.attributes:
            row[role.lower()] = p.attributes[role].record()
    return row


def _instance_record(instance: Instance, number: int) -> np.ndarray:
    row = np.zeros((), INSTANCE)
    row["object_to_world"] = instance.matrix.T
    # A flattened node has no inverse; what it shows has no volume either.
    row["world_to_object"] = np.linalg.pinv(instance.matrix).T
    row["primitive"], row["material"], row["id"] = instance.primitive, instance.material, number
    row["flags"] = CONSTANTS["INSTANCE_MIRRORED"] if instance.mirrored else 0
    return row


def require_room(device: Device, scene: Scene, path: str, shared_bytes: int, advice: str) -> None:
    """Raises VulkanError where the scene's vertices have more components than a team of the device's threads has shared memory for."""
    needed = sum(
        n * size for n, size in zip((scene.max_elements, scene.max_streams, 1), TEAM_BYTES)
    )
    if needed > shared_bytes:
        raise VulkanError(
            f"a vertex has {scene.max_elements} components up to the last one that is shown, too many for path {path} on {device.name}",
            advice,
        )
