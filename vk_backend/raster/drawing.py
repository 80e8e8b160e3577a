"""The raster paths with a graphics pipeline: their shaders, buffers and draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from gltf_ext.errors import blaming

from ..decode.bounds import fill_bounds
from ..decode.ring import RING, Ring
from ..decode.structures import RASTER_PUSH
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS, Limits
from ..gpu.memory import Buffer
from ..gpu.pipelines import addresses, push, push_record
from ..gpu.targets import Targets
from ..scene.buffers import FRAME, SceneBuffers, require_payload, require_room
from ..scene.camera import Camera
from ..scene.decoded import HAS_COLOR, HAS_NORMAL, HAS_TEXCOORD
from ..scene.instances import Run
from ..scene.scene import Scene
from ..scene.textures import TextureArray, array_size, textures_layout
from .pipeline import FRAGMENT, GEOMETRY, MESH, VERTEX, Modules, graphics_pipeline

# Variants of surface.frag, and some of geometry.geom, with the attributes that they pass on. A
# scene uses the first variant that has all of its attributes.
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

    needs: of SceneBuffers; stages: modules before the fragment shader, with {attributes}, and
    fragment: the fragment shader, with {ids} and {attributes} for Drawing to fill in; drawing: the
    subclass of Drawing; capability: of device.CAPABILITIES, or None; workgroup: meshlets of a
    workgroup or point; teams: the field of Limits with the shared memory in which a team
    decodes a meshlet; payload: bytes that task workgroups pass to mesh workgroups; ring: slots of
    the ring that meshlets are decoded into first, at most; 0: none; bulk: many meshlets are decoded
    in bulk passes; variants: names of VARIANTS; constants: (specialisation constant, value) of the
    path.
    """

    name: str
    needs: frozenset[str]
    stages: Modules
    drawing: type[Drawing]
    capability: str | None = None
    workgroup: int = 1
    teams: str | None = None
    payload: int = 0
    ring: int = 0
    bulk: bool = False
    fragment: str = "surface_{attributes}{ids}.frag"
    variants: tuple[str, ...] = tuple(name for name, _ in VARIANTS)
    constants: tuple[tuple[str, int], ...] = ()

    def shared_bytes(self, limits: Limits) -> int:
        """Shared memory that a team may use; the payload takes some of a mesh workgroup's."""
        room: int = getattr(limits, self.teams) if self.teams else 0
        return min(room, limits.mesh_total_bytes - self.payload) if self.payload else room


BLOBS = frozenset({"blobs", "bounds"})


def parts_of_run(run: Run, workgroups: int) -> list[Run]:
    """A run in parts of at most MAX_WORKGROUPS workgroups, or single instances.

    workgroups: of an instance. Shaders find the instance by the row of their workgroup.
    """
    most = max(MAX_WORKGROUPS // max(workgroups, 1), 1)
    return [
        Run(run.first + first, min(most, run.count - first)) for first in range(0, run.count, most)
    ]


# Called with the commands after each step of a picture is recorded: for timing.
Mark = Callable[[Any], None]


def no_mark(commands: Any) -> None:
    """A Mark that records nothing."""


class Drawing:
    """A scene ready to be drawn by one path.

    ids: draw ids, too. ring: slots of a path with a ring, at most (None: the path's). targets: the
    class that a picture is drawn into.
    Raises VulkanError if the device lacks a capability or the memory that the path needs.
    """

    targets: ClassVar[Any] = Targets

    def __init__(
        self,
        device: Device,
        scene: Scene,
        path: Path,
        *,
        culling: bool = True,
        ids: bool = True,
        ring: int | None = None,
    ):
        self.device, self.scene, self.path, self.ids = device, scene, path, ids
        if path.capability:
            device.require(path.capability, path.name)
        require_payload(device, path.name, path.payload)
        if path.teams:
            shared = path.shared_bytes(device.limits)
            require_room(device, scene, path.name, shared, "choose --path geometry or vertex")
        self._own: dict[str, Buffer] = {}  # of the path, besides those of scene, frame and ring
        self._layout = textures_layout(device, array_size(scene.textures))
        with blaming(scene.path):
            self._textures = TextureArray(device, scene.textures)
        self.buffers = self._make_buffers()
        self._frame = Buffer(device, MATRIX_BYTES * len(scene.instances) + FRAME.itemsize)
        constants = {
            "MAX_STREAMS": scene.max_streams,
            "MAX_ELEMENTS": scene.max_elements,
            "ATTRIBUTES": scene.attributes,
            "CULLING": int(culling),
            **dict(path.constants),
        }
        slots = self.path.ring if ring is None else ring
        self.ring = self._make_ring(slots, constants) if path.ring else None
        self._make_pipelines(self.ring.constants if self.ring else constants)

    def _make_buffers(self) -> SceneBuffers:
        # With bounds even without culling, so that measured memory is the same.
        buffers = SceneBuffers(self.device, self.scene, self.path.needs)
        if "bounds" in self.path.needs:
            fill_bounds(buffers)
        return buffers

    def _make_ring(self, slots: int, constants: dict[str, int]) -> Ring:
        slots = min(slots, CONSTANTS["MAX_SLOTS"])
        return Ring(self.device, self.scene, slots, constants, bulk=self.path.bulk)

    def _make_pipelines(self, constants: dict[str, int]) -> None:
        """Makes everything that draws. constants: specialisation constants by name."""
        textures = array_size(self.scene.textures)
        constants = {**constants, "NUMBERS": int(self._reads_numbers)}
        self._pipeline = graphics_pipeline(
            self.device, self._modules(), constants, textures, self.ids
        )

    @property
    def steps(self) -> tuple[str, ...]:
        """The steps of a picture, in the order of the calls of record's `mark`."""
        return ("draw",)

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers, without images."""
        return (
            self.buffers.resident_bytes
            + self._frame.allocated
            + (self.ring.resident_bytes if self.ring else 0)
            + sum(buffer.allocated for buffer in self._own.values())
        )

    def look(self, camera: Camera, width: int, height: int) -> None:
        """Sets the camera of later pictures."""
        matrices = self.buffers.object_to_clip_matrices(camera, width, height)
        frame = self.buffers.frame_record(camera, width, height, self._frame.address)
        self._frame.write(matrices.tobytes() + frame.tobytes())

    def record(self, commands: Any, targets: Any, mark: Mark = no_mark) -> None:
        """Records the whole picture, for a single queue. targets: of the class self.targets."""
        if self.ring:
            for number in range(len(self.ring.batches)):
                self.ring.wait_for_drawing(commands)
                self.record_decoding(commands, number)
                self.record_drawing(commands, targets, number)
        else:
            self._begin(commands, targets)
            for run in self.scene.instances.runs:
                self._draw(commands, run)
            vk.vkCmdEndRendering(commands)
        mark(commands)

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        self.buffers.free()
        self._frame.free()
        self._textures.free()
        for buffer in self._own.values():
            buffer.free()
        if self.ring:
            self.ring.free()

    # --- path stream ---

    @property
    def overlaps(self) -> bool:
        """Whether decoding and drawing use a queue each: see frame_commands.py."""
        return self.ring is not None and self.ring.sections > 1

    def record_decoding(self, commands: Any, number: int) -> None:
        """Records the decoding of a batch into its slots."""
        assert self.ring is not None
        self.ring.decode(commands, number, self._push_constants(), MAX_WORKGROUPS)

    def record_drawing(self, commands: Any, targets: Targets, number: int) -> None:
        """Records the drawing of a batch from its slots, over the batches before it."""
        assert self.ring is not None
        self.ring.wait_for_decoding(commands)
        self._begin(commands, targets, resumed=number > 0)
        for segment, count in self._draws_of(self.ring.batches[number]):
            self._set_sides(commands, int(segment.instance))
            places = (int(segment.first), int(segment.meshlets), int(segment.slot))
            self._draw_meshlets(commands, Run(int(segment.instance), count), *places)
        vk.vkCmdEndRendering(commands)

    def _draws_of(self, batch: np.recarray) -> list[tuple[Any, int]]:
        """(segment, number of segments) that one draw takes: whole instances of a run."""
        run = self._run_numbers[batch.instance]
        whole = batch.meshlets == self.scene.instance_meshlets[batch.instance]
        goes_on = (run[1:] == run[:-1]) & whole[1:] & whole[:-1]
        goes_on &= np.diff(batch.instance.astype(np.int64)) == 1  # some have no meshlets
        starts = np.flatnonzero(np.concatenate([[True], ~goes_on]))
        counts = np.diff(np.append(starts, len(batch)))
        return [(batch[start], count) for start, count in zip(starts, counts.tolist())]

    @cached_property
    def _run_numbers(self) -> np.ndarray:
        return self.scene.instances.run_numbers()

    # --- all paths ---

    def _begin(self, commands: Any, targets: Targets, *, resumed: bool = False) -> None:
        """Records the start of rendering and all state that does not depend on the instance."""
        targets.begin(commands, resumed=resumed)
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_GRAPHICS, self._pipeline)
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
        chosen = next(
            name
            for name, fits in VARIANTS
            if name in self.path.variants and not self.scene.attributes & ~fits
        )
        ids = "_ids" if self.ids else ""
        # Mesh shaders that write numbers write all attributes.
        inputs = "mesh" if self._reads_numbers else chosen
        fragment = self.path.fragment.format(attributes=inputs, ids=ids)
        stages = [(name.format(attributes=chosen), bit) for name, bit in self.path.stages]
        return (*stages, (fragment, FRAGMENT))

    @property
    def _reads_numbers(self) -> bool:
        """Whether the fragment shader reads a mesh shader's numbers of triangles."""
        return self.ids and self.path.capability == "mesh"

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

    def _draw(self, commands: Any, run: Run) -> None:
        """Records the draws of a run."""
        instance = self.scene.instances[run.first]
        self._set_sides(commands, run.first)
        meshlets = self.scene.primitives[instance.primitive].meshlets
        if self.buffers.index_buffer:
            push(commands, self._layout, self._push_constants(instance=run.first))
            first_index, first_vertex, count = self.buffers.index_range(instance.primitive)
            vk.vkCmdDrawIndexed(commands, count, run.count, first_index, first_vertex, 0)
        elif GEOMETRY in [bit for _, bit in self.path.stages]:
            push(commands, self._layout, self._push_constants(instance=run.first))
            vk.vkCmdDraw(commands, meshlets, run.count, 0, 0)
        else:
            self._draw_meshlets(commands, run, 0, meshlets, 0)

    def _draw_meshlets(self, commands: Any, run: Run, first: int, meshlets: int, slot: int) -> None:
        """Records the draws of meshlets [first, first + meshlets) of each instance of a run.

        slot: of the first meshlet of the first instance, if there is a ring; the others follow.
        """
        draw, workgroup = self.device.function("vkCmdDrawMeshTasksEXT"), self.path.workgroup
        for part in parts_of_run(run, -(-meshlets // workgroup)):
            begin = slot + (part.first - run.first) * meshlets
            data = self._push_constants(instance=part.first)
            for offset in range(0, meshlets, MAX_WORKGROUPS * workgroup):
                data["first"], data["first_slot"] = first + offset, begin + offset
                push(commands, self._layout, data)
                columns = min(-(-(meshlets - offset) // workgroup), MAX_WORKGROUPS)
                draw(commands, columns, part.count, 1)

    @property
    def _addresses(self) -> dict[str, int]:
        """Addresses in RASTER_PUSH besides the frame."""
        return {**(self.ring.addresses if self.ring else {}), **addresses(RASTER_PUSH, self._own)}

    def _push_constants(self, **fields: Any) -> np.ndarray:
        """RASTER_PUSH[()] with all addresses and the given fields; all others are 0."""
        return push_record(RASTER_PUSH, frame=self._frame_address, **self._addresses, **fields)

    @property
    def _frame_address(self) -> int:
        return self._frame.address + MATRIX_BYTES * len(self.scene.instances)

    def finish(self, wait: bool) -> bool:
        """Call after a frame has run. Returns whether another frame would be the same.

        wait: for data that the frame lacked.
        """
        return True


GRAPHICS_PATHS = (
    Path(
        "stream",
        BLOBS,
        (("stream.mesh", MESH),),
        Drawing,
        "mesh",
        teams="compute_shared_bytes",
        ring=RING,
    ),
    Path(
        "geometry",
        BLOBS,
        (("geometry.vert", VERTEX), ("geometry_{attributes}.geom", GEOMETRY)),
        Drawing,
        "geometry",
        variants=("normal", "color"),
    ),
    Path("vertex", frozenset({"vertices", "indices"}), (("vertex.vert", VERTEX),), Drawing),
)
