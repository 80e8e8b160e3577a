"""The raster paths: their shaders, buffers and draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import vk
from .camera import Camera
from .constants import CONSTANTS
from .decoded import HAS_COLOR, HAS_NORMAL, HAS_TEXCOORD
from .device import Device
from .graphics_pipeline import FRAGMENT, GEOMETRY, MESH, TASK, VERTEX, Modules, graphics_pipeline
from .memory import Buffer
from .pipelines import MAX_GROUPS, ComputePipeline, push, push_record
from .raster_layout import BOUNDS_PUSH, RASTER_PUSH
from .ring import RING, Ring
from .scene import Scene
from .scene_buffers import FRAME, SceneBuffers, require_room
from .targets import Targets
from .textures import TextureArray, array_size, textures_layout

# SHADING of shaders/raster/surface.frag.
SHADING_LIT = CONSTANTS["SHADING_LIT"]
SHADING_ATTRIBUTES = CONSTANTS["SHADING_ATTRIBUTES"]
# Variants of surface.frag and geometry.geom with the attributes that they pass on. A scene uses the
# first variant that has all of its attributes.
VARIANTS = (
    ("position", 0),
    ("normal", HAS_NORMAL),
    ("texcoord", HAS_NORMAL | HAS_TEXCOORD),
    ("color", HAS_NORMAL | HAS_TEXCOORD | HAS_COLOR),
)
MATRIX_BYTES = 64


@dataclass(frozen=True)
class Path:
    """How meshlets become triangles on the device.

    capability: of device.CAPABILITIES, or None; needs: of SceneBuffers; stages: modules before the
    fragment shader, with {ids} and {attributes} for Drawing to fill in; group: meshlets of a
    workgroup or point, 0 for indexed triangles; teams: the field of device.Limits with the shared
    memory in which a team decodes a meshlet; ring: meshlets are decoded into a ring first.
    """

    capability: str | None
    needs: frozenset[str]
    stages: Modules
    group: int
    teams: str | None = None
    ring: bool = False


BLOBS = frozenset({"blobs", "bounds"})
PATHS = {
    "vertex": Path(
        capability=None,
        needs=frozenset({"vertices", "indices"}),
        stages=(("vertex.vert", VERTEX),),
        group=0,
    ),
    "mesh-plain": Path(
        capability="mesh",
        needs=frozenset({"vertices", "plain", "bounds"}),
        stages=(("plain.task", TASK), ("plain{ids}.mesh", MESH)),
        group=CONSTANTS["TASK_MESHLETS"],
    ),
    "geometry": Path(
        capability="geometry",
        needs=BLOBS,
        stages=(("geometry.vert", VERTEX), ("geometry_{attributes}.geom", GEOMETRY)),
        group=1,
    ),
    "mesh": Path(
        capability="mesh",
        needs=BLOBS,
        stages=(("mesh.task", TASK), ("mesh{ids}.mesh", MESH)),
        group=CONSTANTS["TASK_MESHLETS"],
        teams="mesh_shared_bytes",
    ),
    "mesh-only": Path(
        capability="mesh",
        needs=BLOBS,
        stages=(("mesh_only{ids}.mesh", MESH),),
        group=1,
        teams="mesh_shared_bytes",
    ),
    "stream": Path(
        capability="mesh",
        needs=BLOBS,
        stages=(("stream{ids}.mesh", MESH),),
        group=1,
        teams="compute_shared_bytes",
        ring=True,
    ),
}


class Drawing:
    """A scene ready to be drawn by one path.

    ids: draw ids, too; shading: SHADING_LIT or SHADING_ATTRIBUTES. For path stream, ring: slots, at
    most; overlap: decode on another queue, half a ring ahead (None: if the scene is large enough).
    Raises VulkanError if the device lacks a capability or the memory that the path needs.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        path: str,
        *,
        culling: bool = True,
        ids: bool = True,
        shading: int = SHADING_LIT,
        ring: int = RING,
        overlap: bool | None = None,
    ):
        self.device, self.scene, self.path, self.ids = device, scene, PATHS[path], ids
        if self.path.capability:
            device.require(self.path.capability, path)
        if self.path.teams:
            require_room(
                device,
                scene,
                path,
                getattr(device.limits, self.path.teams),
                "choose --path geometry or vertex",
            )
        textures = array_size(scene.textures)
        self._layout = textures_layout(device, textures)
        self._textures = TextureArray(device, scene.textures)
        # Made even without culling, so that measured memory is the same.
        self.buffers = SceneBuffers(device, scene, self.path.needs)
        if "bounds" in self.path.needs:
            fill_bounds(self.buffers)
        self._frame = Buffer(device, MATRIX_BYTES * len(scene.instances) + FRAME.itemsize)
        constants = {
            "MAX_STREAMS": scene.max_streams,
            "MAX_ELEMENTS": scene.max_elements,
            "ATTRIBUTES": scene.attributes,
            "CULLING": int(culling),
            "SHADING": shading,
        }
        self.ring = Ring(device, scene, ring, overlap, constants) if self.path.ring else None
        self.pipeline = graphics_pipeline(
            device,
            self._modules(),
            self.ring.constants if self.ring else constants,
            textures,
            ids,
        )

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers, without images."""
        return (
            self.buffers.resident_bytes
            + self._frame.allocated
            + (self.ring.resident_bytes if self.ring else 0)
        )

    def look(self, camera: Camera, width: int, height: int) -> None:
        """Sets the camera of later pictures."""
        matrices = self.buffers.object_to_clip_matrices(camera, width, height)
        frame = self.buffers.frame_record(camera, width, height, self._frame.address)
        self._frame.write(matrices.tobytes() + frame.tobytes())

    def record(self, commands: Any, targets: Targets) -> None:
        """Records the whole picture, for a single queue."""
        if self.ring:
            for number in range(len(self.ring.batches)):
                self.ring.wait_for_drawing(commands)
                self.record_decoding(commands, number)
                self.record_drawing(commands, targets, number)
            return
        self._begin(commands, targets)
        for number in range(len(self.scene.instances)):
            self._draw(commands, number)
        vk.vkCmdEndRendering(commands)

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        self.buffers.free()
        self._frame.free()
        self._textures.free()
        if self.ring:
            self.ring.free()

    # --- path stream ---

    @property
    def overlaps(self) -> bool:
        """Whether decoding and drawing use a queue each: see frame_commands.py."""
        return self.ring is not None and self.ring.parts > 1

    def record_decoding(self, commands: Any, number: int) -> None:
        """Records the decoding of a batch into its slots."""
        assert self.ring is not None
        data = self._push_constants(**self.ring.addresses)
        self.ring.decode(commands, number, data, MAX_GROUPS)

    def record_drawing(self, commands: Any, targets: Targets, number: int) -> None:
        """Records the drawing of a batch from its slots, over the batches before it."""
        assert self.ring is not None
        self.ring.wait_for_decoding(commands)
        self._begin(commands, targets, resumed=number > 0)
        draw = self.device.function("vkCmdDrawMeshTasksEXT")
        data = self._push_constants(**self.ring.addresses)
        for segment in self.ring.batches[number]:
            self._set_sides(commands, segment.instance)
            for offset in range(0, segment.meshlets, MAX_GROUPS):
                data["instance"], data["first"], data["first_slot"] = (
                    segment.instance,
                    segment.first + offset,
                    segment.slot + offset,
                )
                push(commands, self._layout, data)
                draw(commands, min(segment.meshlets - offset, MAX_GROUPS), 1, 1)
        vk.vkCmdEndRendering(commands)

    # --- all paths ---

    def _begin(self, commands: Any, targets: Targets, *, resumed: bool = False) -> None:
        """Records the start of rendering and all state that does not depend on the instance."""
        targets.begin(commands, resumed=resumed)
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_GRAPHICS, self.pipeline)
        vk.vkCmdBindDescriptorSets(
            commands,
            vk.VK_PIPELINE_BIND_POINT_GRAPHICS,
            self._layout,
            0,
            1,
            [self._textures.set],
            0,
            None,
        )
        if self.buffers.index_buffer:
            vk.vkCmdBindVertexBuffers(commands, 0, 1, [self.buffers.vertices.handle], [0])
            vk.vkCmdBindIndexBuffer(
                commands, self.buffers.index_buffer.handle, 0, vk.VK_INDEX_TYPE_UINT32
            )

    def _modules(self) -> Modules:
        """The stages of the pipeline."""
        chosen = next(name for name, fits in VARIANTS if not self.scene.attributes & ~fits)
        names = {"ids": "_ids" if self.ids else "", "attributes": chosen}
        per_primitive = "_mesh" if self.ids and self.path.capability == "mesh" else ""
        stages = (
            *self.path.stages,
            (f"surface_{{attributes}}{per_primitive}{{ids}}.frag", FRAGMENT),
        )
        return tuple((name.format(**names), bit) for name, bit in stages)

    def _set_sides(self, commands: Any, number: int) -> None:
        """Records which sides of an instance's triangles are visible."""
        instance = self.scene.instances[number]
        double_sided = self.scene.materials[instance.material].double_sided
        front = (
            vk.VK_FRONT_FACE_CLOCKWISE if instance.mirrored else vk.VK_FRONT_FACE_COUNTER_CLOCKWISE
        )
        vk.vkCmdSetCullMode(
            commands, vk.VK_CULL_MODE_NONE if double_sided else vk.VK_CULL_MODE_BACK_BIT
        )
        vk.vkCmdSetFrontFace(commands, front)

    def _draw(self, commands: Any, number: int) -> None:
        """Records the draws of an instance."""
        instance = self.scene.instances[number]
        self._set_sides(commands, number)
        meshlets = self.scene.primitives[instance.primitive].meshlets
        if self.buffers.index_buffer:
            push(commands, self._layout, self._push_constants(instance=number))
            first_index, first_vertex, count = self.buffers.index_range(instance.primitive)
            vk.vkCmdDrawIndexed(commands, count, 1, first_index, first_vertex, 0)
        elif GEOMETRY in [bit for _, bit in self.path.stages]:
            push(commands, self._layout, self._push_constants(instance=number))
            vk.vkCmdDraw(commands, meshlets, 1, 0, 0)
        else:
            draw = self.device.function("vkCmdDrawMeshTasksEXT")
            for first in range(0, meshlets, MAX_GROUPS * self.path.group):
                push(commands, self._layout, self._push_constants(instance=number, first=first))
                draw(commands, min(-(-(meshlets - first) // self.path.group), MAX_GROUPS), 1, 1)

    def _push_constants(self, **fields: Any) -> np.ndarray:
        """RASTER_PUSH[()] with the frame and the given fields; all others are 0."""
        frame = self._frame.address + MATRIX_BYTES * len(self.scene.instances)
        return push_record(RASTER_PUSH, frame=frame, **fields)


def fill_bounds(buffers: SceneBuffers) -> None:
    """Computes the culling bounds of all meshlets on the device.

    Uploads the blobs for that purpose if the path does not keep them.
    """
    device, scene = buffers.device, buffers.scene
    source = buffers if buffers.blobs else SceneBuffers(device, scene, {"blobs", "bounds"})
    pipeline = ComputePipeline.of(device, "bounds.comp", {"MAX_STREAMS": scene.max_streams})
    with device.commands() as commands:
        for number, primitive in enumerate(scene.primitives):
            data = push_record(BOUNDS_PUSH, primitives=source.primitives_address, primitive=number)
            groups = -(-primitive.meshlets // CONSTANTS["BOUNDS_THREADS"])
            pipeline.dispatch(commands, groups, data)
        device.full_barrier(commands)
        if source is not buffers:
            region = vk.VkBufferCopy(size=source.bounds.size)
            vk.vkCmdCopyBuffer(commands, source.bounds.handle, buffers.bounds.handle, 1, [region])
            device.full_barrier(commands)
    if source is not buffers:
        source.free()
