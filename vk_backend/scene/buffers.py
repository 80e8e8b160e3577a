"""A scene in GPU memory: the structures of shaders/scene/scene.glsl, and their buffers."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.memory import STORAGE, Buffer
from ..gpu.pipelines import push_record
from ..gpu.reflection import structure
from .camera import Camera
from .instances import Instances
from .scene import SHADED, Attribute, Primitive, Scene

LEAST_SINGULAR = 1e-15  # share of the largest: as numpy's pseudo-inverse, which drops smaller ones
# Shared memory that a team decoder needs at most (shaders/decoders/team_meshlet.glsl), in bytes:
# per element of a vertex, per stream, and for the rest.
TEAM_ELEMENT_BYTES = 256
TEAM_STREAM_BYTES = 20
TEAM_OTHER_BYTES = 4368

# Of shaders/scene/scene.glsl. Matrices are stored column by column: numpy's [4, 4] transposed.
ATTRIBUTE, PRIMITIVE, INSTANCE, MATERIAL, FRAME = map(
    structure, ("Attribute", "Primitive", "Instance", "Material", "Frame")
)


class SceneBuffers:
    """A scene's buffers for one path.

    needs: "blobs", the compressed bytes; "bounds", room for the culling bounds; "vertices",
    uncompressed; "indices". rows: the table of primitives, if it is elsewhere.
    """

    def __init__(
        self, device: Device, scene: Scene, needs: frozenset[str], rows: Buffer | None = None
    ):
        self.device, self.scene, self._rows = device, scene, rows
        self._buffers: list[Buffer] = []
        self.primitives = np.array([primitive_record(p) for p in scene.primitives], PRIMITIVE)
        # float64[4, 4 n]: columns of all matrices, so that one product transforms them all.
        self._columns = scene.instances.matrix.transpose(1, 0, 2).reshape(4, -1)
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

    def _new(self, data: np.ndarray | bytes, usage: int = 0) -> Buffer:
        """A buffer with this content."""
        size = len(data) if isinstance(data, bytes) else data.nbytes
        self._buffers.append(Buffer(self.device, size, STORAGE | usage))
        return self._buffers[-1].write(data)

    def _upload_blobs(self) -> None:
        blobs = list(dict.fromkeys(p.blob for p in self.scene.primitives))
        ends = np.cumsum([len(blob) for blob in blobs])
        self.blobs = self._new(b"".join(blobs))
        begins = {blob: int(end) - len(blob) for blob, end in zip(blobs, ends)}
        for row, p in zip(self.primitives, self.scene.primitives):
            row["blob"] = self.blobs.address + begins[p.blob]
            row["blob_words"] = len(p.blob) // 4

    def _reserve_bounds(self) -> None:
        meshlets = np.array([p.meshlets for p in self.scene.primitives], np.int64)
        sizes = meshlets * CONSTANTS["BOUNDS_BYTES"]
        self.bounds = Buffer(self.device, int(sizes.sum()))
        self._buffers.append(self.bounds)
        for row, first in zip(self.primitives, np.cumsum(sizes) - sizes):
            row["bounds"] = self.bounds.address + int(first)
            row["first_meshlet"] = first // CONSTANTS["BOUNDS_BYTES"]

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
        instances = instance_records(self.scene.instances)
        materials = np.array(
            [push_record(MATERIAL, **vars(m)) for m in self.scene.materials], MATERIAL
        )
        tables = [table.tobytes() for table in (self.primitives, instances, materials)]
        self.primitives_address = self._new(b"".join(tables)).address
        self.instances_address = self.primitives_address + len(tables[0])
        self.materials_address = self.instances_address + len(tables[1])
        if self._rows:
            self.primitives_address = self._rows.address

    def frame_record(
        self, camera: Camera, width: int, height: int, object_to_clip: int
    ) -> np.ndarray:
        """FRAME[()] for a camera; object_to_clip: address of the `object_to_clip_matrices`."""
        return push_record(
            FRAME,
            world_to_clip=camera.world_to_clip(width, height).T,
            clip_to_world=camera.clip_to_world(width, height).T,
            eye=camera.eye,
            light_direction=(*camera.light_direction(), 0.0),
            primitives=self.primitives_address,
            instances=self.instances_address,
            materials=self.materials_address,
            object_to_clip=object_to_clip,
            width=width,
            height=height,
        )

    def object_to_clip_matrices(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """float32[instances, 4, 4], column by column."""
        columns = camera.world_to_clip(width, height) @ self._columns
        return np.ascontiguousarray(columns.reshape(4, -1, 4).transpose(1, 2, 0), np.float32)


def primitive_record(p: Primitive) -> np.ndarray:
    """PRIMITIVE[()] without addresses."""
    row = push_record(PRIMITIVE, meshlets=p.meshlets, stream_end=p.stream_end)
    row["box_low"][:3], row["box_size"][:3] = p.low, p.high - p.low
    for role in SHADED:
        row[role.lower()]["element"] = CONSTANTS["NO_ELEMENT"]
        if role in p.attributes:
            row[role.lower()] = _attribute_record(p.attributes[role])
    return row


def _attribute_record(a: Attribute) -> np.ndarray:
    kind_bits = a.stream.kind | a.stream.bits << 8 | a.stream.elements << 16
    if a.rounded:
        kind_bits |= CONSTANTS["ATTRIBUTE_ROUND"]
    row = push_record(
        ATTRIBUTE, step=a.stream.step, element=a.element, kind_bits=kind_bits, scale=a.scale
    )
    row["offset"][: len(a.stream.offset)] = a.stream.offset
    return row


def instance_records(instances: Instances) -> np.ndarray:
    """INSTANCE[n]"""
    rows = np.zeros(len(instances), INSTANCE)
    rows["object_to_world"] = instances.matrix.transpose(0, 2, 1)
    rows["world_to_object"] = _inverses(instances.matrix).transpose(0, 2, 1)
    rows["primitive"], rows["material"] = instances.primitive, instances.material
    rows["scale"] = np.linalg.svd(instances.matrix[:, :3, :3], compute_uv=False)[:, 0]
    rows["flags"] = instances.mirrored * CONSTANTS["INSTANCE_MIRRORED"]
    return rows


def _inverses(matrices: np.ndarray) -> np.ndarray:
    """float64[n, 4, 4]; the matrix of a flattened node has a pseudo-inverse instead."""
    singular = np.linalg.svd(matrices, compute_uv=False)
    flat = singular[:, -1] <= LEAST_SINGULAR * singular[:, 0]
    result = np.zeros_like(matrices)
    result[~flat] = np.linalg.inv(matrices[~flat])
    result[flat] = np.linalg.pinv(matrices[flat])
    return result


def team_bytes(elements: int, streams: int) -> int:
    """Shared memory, in bytes, that a team decoder of blobs of this shape needs at most."""
    return elements * TEAM_ELEMENT_BYTES + streams * TEAM_STREAM_BYTES + TEAM_OTHER_BYTES


def require_payload(device: Device, path: str, payload: int) -> None:
    """Raises VulkanError if task workgroups cannot pass on so many bytes."""
    most = device.limits.task_payload_bytes
    if payload > most:
        raise VulkanError(
            f"path {path} passes {payload} bytes from task to mesh shaders, "
            f"{device.name} at most {most}",
            "choose another --path",
        )


def require_room(device: Device, scene: Scene, path: str, shared_bytes: int, advice: str) -> None:
    """Raises VulkanError if a team decoder of the scene's blobs needs more shared memory.

    shared_bytes: of a workgroup; advice: the remedy in the message.
    """
    if team_bytes(scene.max_elements, scene.max_streams) > shared_bytes:
        raise VulkanError(
            f"a vertex has {scene.max_elements} elements up to the last one that is shown, "
            f"too many for path {path} on {device.name}",
            advice,
        )
