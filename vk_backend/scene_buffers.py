"""A scene in GPU memory: the structures of shaders/scene/scene.glsl, and their buffers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from . import vk
from .camera import Camera
from .constants import CONSTANTS
from .device import Device
from .errors import VulkanError
from .materials import Material
from .memory import STORAGE, Buffer
from .reflection import structure
from .scene import SHADED, Attribute, Instance, Primitive, Scene

# Shared memory that a team decoder needs at most (shaders/decoders/team_meshlet.glsl), in bytes:
# per element of a vertex, per stream, and for the rest.
TEAM_ELEMENT_BYTES = 256
TEAM_STREAM_BYTES = 20
TEAM_OTHER_BYTES = 4096
NO_ELEMENT = CONSTANTS["NO_ELEMENT"]
# What a path may need of a scene: the compressed bytes, room for the culling bounds, uncompressed
# vertices, and their indices.
NEEDS = frozenset({"blobs", "bounds", "vertices", "indices"})

# Of shaders/scene/scene.glsl. Matrices are stored column by column: numpy's [4, 4] transposed.
ATTRIBUTE, PRIMITIVE, INSTANCE, MATERIAL, FRAME = map(
    structure, ("Attribute", "Primitive", "Instance", "Material", "Frame")
)


class SceneBuffers:
    """A scene's buffers for one path. needs: of NEEDS."""

    def __init__(self, device: Device, scene: Scene, needs: Iterable[str]):
        self.device, self.scene = device, scene
        self._buffers: list[Buffer] = []
        needs = frozenset(needs)
        unknown = needs - NEEDS
        if unknown:
            raise ValueError(f"unknown needs: {', '.join(sorted(unknown))}")
        self.primitives = np.array([_primitive_record(p) for p in scene.primitives], PRIMITIVE)
        self.blobs: Any = None
        self.index_buffer: Any = None
        if "blobs" in needs:
            self._upload_blobs()
        if "bounds" in needs:
            self._reserve_bounds()
        if "vertices" in needs:
            self._upload_vertices()
        if "indices" in needs:
            self._upload_indices()
        self._upload_tables()

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers; images do not count."""
        return sum(buffer.allocated for buffer in self._buffers)

    def index_range(self, primitive: int) -> tuple[int, int, int]:
        """(first index, first vertex, indices) of a primitive in the index and vertex buffers."""
        before, own = self.scene.primitives[:primitive], self.scene.primitives[primitive]
        return (
            3 * sum(p.triangles for p in before),
            sum(p.vertices for p in before),
            3 * own.triangles,
        )

    def free(self) -> None:
        for buffer in self._buffers:
            buffer.free()

    def _new(self, data: np.ndarray | bytes | int, usage: int = 0) -> Buffer:
        """A buffer with this content, or of this size with none."""
        if isinstance(data, int):
            size = data
        else:
            size = len(data) if isinstance(data, bytes) else data.nbytes
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
            row["blob"] = self.blobs.address + place[p.blob]
            row["blob_words"] = len(p.blob) // 4

    def _reserve_bounds(self) -> None:
        meshlets = np.array([p.meshlets for p in self.scene.primitives], np.int64)
        sizes = meshlets * CONSTANTS["BOUNDS_BYTES"]
        self.bounds = self._new(int(sizes.sum()))
        for row, first in zip(self.primitives, np.cumsum(sizes) - sizes):
            row["bounds"] = self.bounds.address + int(first)

    def _upload_vertices(self) -> None:
        arrays = [p.decoded().vertices(self.scene.attributes) for p in self.scene.primitives]
        self.vertices = self._new(np.concatenate(arrays), vk.VK_BUFFER_USAGE_VERTEX_BUFFER_BIT)

    def _upload_indices(self) -> None:
        arrays = [p.decoded().triangles.ravel() for p in self.scene.primitives]
        self.index_buffer = self._new(
            np.concatenate(arrays).astype(np.uint32), vk.VK_BUFFER_USAGE_INDEX_BUFFER_BIT
        )

    def _upload_tables(self) -> None:
        """Primitives, instances and materials, in this order in one buffer."""
        instances = np.array(
            [_instance_record(i, n) for n, i in enumerate(self.scene.instances)], INSTANCE
        )
        materials = np.array([_material_record(m) for m in self.scene.materials], MATERIAL)
        parts = [self.primitives.tobytes(), instances.tobytes(), materials.tobytes()]
        tables = self._new(b"".join(parts))
        self.primitives_address = tables.address
        self.instances_address = self.primitives_address + len(parts[0])
        self.materials_address = self.instances_address + len(parts[1])

    def frame_record(
        self, camera: Camera, width: int, height: int, object_to_clip: int
    ) -> np.ndarray:
        """FRAME[()] for a camera; object_to_clip: address of the `object_to_clip_matrices`."""
        row = np.zeros((), FRAME)
        row["world_to_clip"] = camera.world_to_clip(width, height).T
        row["clip_to_world"] = camera.clip_to_world(width, height).T
        row["eye"], row["light_direction"] = camera.eye, (*camera.light_direction(), 0.0)
        row["primitives"] = self.primitives_address
        row["instances"] = self.instances_address
        row["materials"] = self.materials_address
        row["object_to_clip"] = object_to_clip
        row["width"], row["height"] = width, height
        return row

    def object_to_clip_matrices(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """float32[instances, 4, 4], column by column."""
        world_to_clip = camera.world_to_clip(width, height)
        return np.array([(world_to_clip @ i.matrix).T for i in self.scene.instances], np.float32)


def _primitive_record(p: Primitive) -> np.ndarray:
    row = np.zeros((), PRIMITIVE)
    row["meshlets"], row["stream_end"], row["elements"] = p.meshlets, p.stream_end, p.elements
    row["box_low"][:3], row["box_size"][:3] = p.low, p.high - p.low
    for role in SHADED:
        row[role.lower()]["element"] = NO_ELEMENT
        if role in p.attributes:
            row[role.lower()] = _attribute_record(p.attributes[role])
    return row


def _attribute_record(a: Attribute) -> np.ndarray:
    row = np.zeros((), ATTRIBUTE)
    row["offset"][: len(a.stream.offset)] = a.stream.offset
    row["step"], row["element"], row["scale"] = a.stream.step, a.element, a.scale
    kind_bits = a.stream.kind | a.stream.bits << 8 | a.stream.components << 16
    row["kind_bits"] = kind_bits | (CONSTANTS["ATTRIBUTE_ROUND"] if a.rounded else 0)
    return row


def _material_record(m: Material) -> np.ndarray:
    row = np.zeros((), MATERIAL)
    row["base_color"], row["emissive"][:3] = m.base_color, m.emissive
    row["texcoord_matrix"], row["texcoord_offset"] = m.texcoord_matrix, m.texcoord_offset
    row["metallic"], row["roughness"] = m.metallic, m.roughness
    row["alpha_cutoff"], row["flags"] = m.alpha_cutoff, m.flags
    row["base_texture"], row["emissive_texture"] = m.texture, m.emissive_texture
    return row


def _instance_record(instance: Instance, number: int) -> np.ndarray:
    row = np.zeros((), INSTANCE)
    row["object_to_world"] = instance.matrix.T
    # The matrix of a flattened node has no inverse.
    row["world_to_object"] = np.linalg.pinv(instance.matrix).T
    row["primitive"], row["material"], row["id"] = instance.primitive, instance.material, number
    row["flags"] = CONSTANTS["INSTANCE_MIRRORED"] if instance.mirrored else 0
    return row


def team_bytes(elements: int, streams: int) -> int:
    """Shared memory, in bytes, that a team decoder of blobs of this shape needs at most."""
    return elements * TEAM_ELEMENT_BYTES + streams * TEAM_STREAM_BYTES + TEAM_OTHER_BYTES


def require_room(device: Device, scene: Scene, path: str, shared_bytes: int, advice: str) -> None:
    """Raises VulkanError if a team decoder of the scene's blobs needs more shared memory.

    shared_bytes: of a workgroup; advice: the remedy in the message.
    """
    if team_bytes(scene.max_elements, scene.max_streams) > shared_bytes:
        raise VulkanError(
            f"a vertex has {scene.max_elements} components up to the last one that is shown, "
            f"too many for path {path} on {device.name}",
            advice,
        )
