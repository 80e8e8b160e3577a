"""The raster paths: their pipelines, what they need in memory, and their draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import vulkan as vk

from .camera import Camera
from .constants import CONSTANTS
from .device import Device, Timeline
from .errors import VulkanError
from .memory import Buffer, Image
from .pipelines import MAX_GROUPS, ComputePipeline, push, stage
from .scene import HAS_COLOR, HAS_NORMAL, HAS_TEXCOORD, VERTEX_FLOATS, Scene
from .scene_buffers import FRAME, SceneBuffers, address_words, require_room
from .stream import RING, Ring
from .textures import TextureArray, array_size, textures_layout

COLOR_FORMAT, DEPTH_FORMAT, IDS_FORMAT = (
    vk.VK_FORMAT_R8G8B8A8_SRGB,
    vk.VK_FORMAT_D32_SFLOAT,
    vk.VK_FORMAT_R32G32_UINT,
)
NO_ID = 0xFFFFFFFF  # both ids where nothing is drawn
# Of shaders/raster.glsl.
PUSH = np.dtype(
    [
        ("frame", "<u4", 2),
        ("instance", "<u4"),
        ("first", "<u4"),
        ("meshlets", "<u4"),
        ("first_slot", "<u4"),
        ("slots", "<u4", 2),
        ("summaries", "<u4", 2),
        ("connectivity", "<u4", 2),
        ("segments", "<u4", 2),
        ("segment_count", "<u4"),
    ]
)
LIT, ATTRIBUTES = 0, 1  # what the fragment shader does, see surface.frag
# Specialisation constants of shaders/meshlet_decoder_prologue.glsl, raster.glsl and surface.frag.
STREAMS_ID, ELEMENTS_ID, ATTRIBUTES_ID, CULLING_ID, SHADING_ID = range(5)
# Of surface.frag and geometry.geom: the first that takes all that the scene has.
VARIANTS = (
    ("position", 0),
    ("normal", HAS_NORMAL),
    ("texcoord", HAS_NORMAL | HAS_TEXCOORD),
    ("color", HAS_NORMAL | HAS_TEXCOORD | HAS_COLOR),
)

MESH, TASK = vk.VK_SHADER_STAGE_MESH_BIT_EXT, vk.VK_SHADER_STAGE_TASK_BIT_EXT
FRAGMENT_TESTS = (
    vk.VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | vk.VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT
)
VERTEX, GEOMETRY, FRAGMENT = (
    vk.VK_SHADER_STAGE_VERTEX_BIT,
    vk.VK_SHADER_STAGE_GEOMETRY_BIT,
    vk.VK_SHADER_STAGE_FRAGMENT_BIT,
)


@dataclass(frozen=True)
class Path:
    """How meshlets become triangles on the device.

    capability: of device.CAPABILITIES; needs: of SceneBuffers; stages: (module, stage) before the fragment shader, where Drawing fills in
    {ids} and {attributes}; group: meshlets of a workgroup or point, 0 for indexed triangles; teams: of device.Limits, the shared memory in
    which a team of threads decodes a meshlet; streams: meshlets are decoded into a ring first.
    """

    capability: str | None
    needs: frozenset[str]
    stages: tuple[tuple[str, int], ...]
    group: int
    teams: str | None = None
    streams: bool = False


PATHS = {
    "vertex": Path(None, frozenset({"vertices", "indices"}), (("vertex.vert", VERTEX),), 0),
    "mesh-plain": Path(
        "mesh", frozenset({"vertices", "plain", "bounds"}), (("plain.task", TASK), ("plain{ids}.mesh", MESH)),
        CONSTANTS["TASK_MESHLETS"],
    ),
    "geometry": Path(
        "geometry", frozenset({"blobs", "bounds"}), (("geometry.vert", VERTEX), ("geometry_{attributes}.geom", GEOMETRY)), 1
    ),
    "mesh": Path(
        "mesh", frozenset({"blobs", "bounds"}), (("mesh.task", TASK), ("mesh{ids}.mesh", MESH)), CONSTANTS["TASK_MESHLETS"],
        teams="mesh_shared_bytes",
    ),
    "mesh-only": Path("mesh", frozenset({"blobs", "bounds"}), (("mesh_only{ids}.mesh", MESH),), 1, teams="mesh_shared_bytes"),
    "stream": Path(
        "mesh", frozenset({"blobs", "bounds"}), (("stream{ids}.mesh", MESH),), 1, teams="compute_shared_bytes", streams=True
    ),
}  # fmt: skip


class Targets:
    """The images that a picture is drawn into. ids: None without."""

    def __init__(self, device: Device, width: int, height: int, ids: bool):
        usage = vk.VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | vk.VK_IMAGE_USAGE_TRANSFER_SRC_BIT
        depth_usage = (
            vk.VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | vk.VK_IMAGE_USAGE_TRANSFER_SRC_BIT
        )
        self._device, self.width, self.height = device, width, height
        self.color = Image(device, width, height, COLOR_FORMAT, usage)
        self.depth = Image(device, width, height, DEPTH_FORMAT, depth_usage)
        self.ids = Image(device, width, height, IDS_FORMAT, usage) if ids else None

    def begin(self, commands, *, resumed: bool = False) -> None:
        """Records the start of rendering: everything cleared, or (resumed) over what was drawn before."""
        colors = [self.color] + ([self.ids] if self.ids else [])
        if resumed:
            self._wait_for_pixels(commands)
        else:
            for image in colors:
                image.to_layout(commands, vk.VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL)
            self.depth.to_layout(commands, vk.VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL)
        clear_color = vk.VkClearValue(color=vk.VkClearColorValue(float32=[0.0] * 4))
        clear_ids = vk.VkClearValue(color=vk.VkClearColorValue(uint32=[NO_ID] * 4))
        clear_depth = vk.VkClearValue(depthStencil=vk.VkClearDepthStencilValue(1.0, 0))
        attachments = [
            _attachment(image, clear, resumed)
            for image, clear in zip(colors, (clear_color, clear_ids))
        ]
        area = vk.VkRect2D(vk.VkOffset2D(0, 0), vk.VkExtent2D(self.width, self.height))
        vk.vkCmdBeginRendering(
            commands,
            vk.VkRenderingInfo(
                renderArea=area,
                layerCount=1,
                viewMask=0,
                colorAttachmentCount=len(attachments),
                pColorAttachments=attachments,
                pDepthAttachment=_attachment(self.depth, clear_depth, resumed),
            ),
        )
        vk.vkCmdSetViewport(commands, 0, 1, [vk.VkViewport(0, 0, self.width, self.height, 0, 1)])
        vk.vkCmdSetScissor(commands, 0, 1, [area])

    def _wait_for_pixels(self, commands) -> None:
        """Records that what is drawn next meets the pixels and depths of what was drawn before."""
        color, tests = vk.VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, FRAGMENT_TESTS
        written = (
            vk.VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT
            | vk.VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT
        )
        read = (
            vk.VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT
            | vk.VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT
        )
        self._device.barrier(commands, color | tests, written, color | tests, written | read)

    def free(self) -> None:
        for image in (self.color, self.depth, self.ids):
            if image:
                image.free()


def _attachment(image: Image, clear, resumed: bool):
    return vk.VkRenderingAttachmentInfo(
        imageView=image.view,
        imageLayout=image.layout,
        resolveMode=vk.VK_RESOLVE_MODE_NONE,
        loadOp=vk.VK_ATTACHMENT_LOAD_OP_LOAD if resumed else vk.VK_ATTACHMENT_LOAD_OP_CLEAR,
        storeOp=vk.VK_ATTACHMENT_STORE_OP_STORE,
        clearValue=clear,
    )


class Pipelines:
    """The pipelines of one device, each made once: compiling the decoder takes a driver seconds. Freed with the device."""

    def __init__(self, device: Device):
        self.device = device

    def timelines(self) -> tuple[Timeline, Timeline]:
        """For what is decoded and what is drawn on two queues."""
        return self.device.once(
            ("timelines",), lambda: (Timeline(self.device), Timeline(self.device))
        )

    def graphics(
        self,
        modules: tuple[tuple[str, int], ...],
        constants: dict[int, int],
        textures: int,
        ids: bool,
    ):
        """A pipeline of (module, stage) with specialisation constants (id -> value)."""
        make = lambda: self._graphics(modules, constants, textures, ids)  # noqa: E731
        return self.device.once((modules, *constants.items(), textures, ids), make)

    def _graphics(
        self,
        modules: tuple[tuple[str, int], ...],
        constants: dict[int, int],
        textures: int,
        ids: bool,
    ):
        stages = [stage(self.device, name, bit, constants) for name, bit in modules]
        formats = [COLOR_FORMAT] + ([IDS_FORMAT] if ids else [])
        kinds = {bit for _, bit in modules}
        indexed = kinds == {VERTEX, FRAGMENT}
        topology = (
            vk.VK_PRIMITIVE_TOPOLOGY_POINT_LIST
            if GEOMETRY in kinds
            else vk.VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST
        )
        blend = [
            vk.VkPipelineColorBlendAttachmentState(blendEnable=0, colorWriteMask=0xF)
            for _ in formats
        ]
        dynamic = [
            vk.VK_DYNAMIC_STATE_VIEWPORT, vk.VK_DYNAMIC_STATE_SCISSOR,
            vk.VK_DYNAMIC_STATE_CULL_MODE, vk.VK_DYNAMIC_STATE_FRONT_FACE,
        ]  # fmt: skip
        info = vk.VkGraphicsPipelineCreateInfo(
            flags=self.device.pipeline_flags,
            pNext=vk.VkPipelineRenderingCreateInfo(
                viewMask=0,
                colorAttachmentCount=len(formats),
                pColorAttachmentFormats=formats,
                depthAttachmentFormat=DEPTH_FORMAT,
                stencilAttachmentFormat=vk.VK_FORMAT_UNDEFINED,
            ),
            stageCount=len(stages),
            pStages=stages,
            pVertexInputState=_vertex_input(constants[ATTRIBUTES_ID])
            if indexed
            else vk.VkPipelineVertexInputStateCreateInfo(),
            pInputAssemblyState=vk.VkPipelineInputAssemblyStateCreateInfo(topology=topology),
            pViewportState=vk.VkPipelineViewportStateCreateInfo(viewportCount=1, scissorCount=1),
            pRasterizationState=vk.VkPipelineRasterizationStateCreateInfo(
                polygonMode=vk.VK_POLYGON_MODE_FILL, lineWidth=1.0
            ),
            pMultisampleState=vk.VkPipelineMultisampleStateCreateInfo(
                rasterizationSamples=vk.VK_SAMPLE_COUNT_1_BIT
            ),
            pDepthStencilState=vk.VkPipelineDepthStencilStateCreateInfo(
                depthTestEnable=1, depthWriteEnable=1, depthCompareOp=vk.VK_COMPARE_OP_LESS
            ),
            pColorBlendState=vk.VkPipelineColorBlendStateCreateInfo(
                attachmentCount=len(blend), pAttachments=blend
            ),
            pDynamicState=vk.VkPipelineDynamicStateCreateInfo(
                dynamicStateCount=len(dynamic), pDynamicStates=dynamic
            ),
            layout=textures_layout(self.device, textures),
        )
        pipeline = vk.vkCreateGraphicsPipelines(self.device.handle, None, 1, [info], None)[0]
        self.device.at_close(lambda: vk.vkDestroyPipeline(self.device.handle, pipeline, None))
        return pipeline


FLOAT_FORMATS = {
    2: vk.VK_FORMAT_R32G32_SFLOAT,
    3: vk.VK_FORMAT_R32G32B32_SFLOAT,
    4: vk.VK_FORMAT_R32G32B32A32_SFLOAT,
}


def _vertex_input(scene_attributes: int):
    """Interleaved floats: the position, and what the scene has."""
    attributes, at = [_input(0, vk.VK_FORMAT_R32G32B32_SFLOAT, 0)], 12
    for location, (bit, floats) in enumerate(VERTEX_FLOATS, start=1):
        # What the scene lacks is not read, but the shader names it: any format does.
        there = bool(scene_attributes & bit)
        attributes.append(
            _input(
                location,
                FLOAT_FORMATS[floats] if there else vk.VK_FORMAT_R32_SFLOAT,
                at if there else 0,
            )
        )
        at += 4 * floats if there else 0
    binding = vk.VkVertexInputBindingDescription(
        binding=0, stride=at, inputRate=vk.VK_VERTEX_INPUT_RATE_VERTEX
    )
    return vk.VkPipelineVertexInputStateCreateInfo(
        vertexBindingDescriptionCount=1,
        pVertexBindingDescriptions=[binding],
        vertexAttributeDescriptionCount=len(attributes),
        pVertexAttributeDescriptions=attributes,
    )


def _input(location: int, format: int, offset: int):
    return vk.VkVertexInputAttributeDescription(
        location=location, binding=0, format=format, offset=offset
    )


class Drawing:
    """A scene ready to be drawn by one path.

    ids: with the attachment for ids; shading: LIT or ATTRIBUTES; ring: slots of path stream, at most; overlap: it decodes on another
    queue than it draws on, half a ring ahead (None: where that pays). Raises VulkanError where the device lacks what the path needs.
    """

    def __init__(
        self,
        pipelines: Pipelines,
        scene: Scene,
        path: str,
        *,
        culling: bool = True,
        ids: bool = True,
        shading: int = LIT,
        ring: int = RING,
        overlap: bool | None = None,
    ):
        device = pipelines.device
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
        # Without culling nothing reads the bounds; they are there all the same, so that memory is what it is in use.
        self.buffers = SceneBuffers(device, scene, self.path.needs)
        if "bounds" in self.path.needs:
            fill_bounds(self.buffers)
        self._frame = Buffer(device, 64 * len(scene.instances) + FRAME.itemsize)
        constants = {
            STREAMS_ID: scene.max_streams, ELEMENTS_ID: scene.max_elements, ATTRIBUTES_ID: scene.attributes,
            CULLING_ID: int(culling), SHADING_ID: shading,
        }  # fmt: skip
        self.ring = Ring(pipelines, scene, ring, overlap, constants) if self.path.streams else None
        self.pipeline = pipelines.graphics(
            self._modules(), self.ring.constants if self.ring else constants, textures, ids
        )

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers; images are left out."""
        return (
            self.buffers.resident_bytes
            + self._frame.allocated
            + (self.ring.resident_bytes if self.ring else 0)
        )

    def look(self, camera: Camera, width: int, height: int) -> None:
        """Takes the camera for what is drawn from now on."""
        matrices = self.buffers.object_to_clip_matrices(camera, width, height)
        frame = self.buffers.frame_record(camera, width, height, self._frame.address)
        self._frame.write(matrices.tobytes() + frame.tobytes())

    def record(self, commands, targets: Targets) -> None:
        """Records the whole picture, for one queue."""
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
        self.buffers.free()
        self._frame.free()
        self._textures.free()
        if self.ring:
            self.ring.free()

    # --- path stream ---------------------------------------------------------------------------------------------------------------

    @property
    def overlaps(self) -> bool:
        """Whether batches are decoded and drawn on a queue each (see frame.py)."""
        return self.ring is not None and self.ring.parts > 1

    def record_decoding(self, commands, number: int) -> None:
        """Records that a batch of the ring is decoded into its slots."""
        self.ring.decode(commands, number, self._push_data(**self.ring.addresses), MAX_GROUPS)

    def record_drawing(self, commands, targets: Targets, number: int) -> None:
        """Records that a batch of the ring is drawn from its slots, over what was drawn of the others before."""
        self.ring.wait_for_decoding(commands)
        self._begin(commands, targets, resumed=number > 0)
        draw = self.device.function("vkCmdDrawMeshTasksEXT")
        data = self._push_data(**self.ring.addresses)
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

    # --- all paths -----------------------------------------------------------------------------------------------------------------

    def _begin(self, commands, targets: Targets, *, resumed: bool = False) -> None:
        """Records the start of rendering and all state but what instances have of their own."""
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

    def _modules(self) -> tuple[tuple[str, int], ...]:
        """(module, stage) of the pipeline."""
        chosen = next(name for name, fits in VARIANTS if not self.scene.attributes & ~fits)
        names = {"ids": "_ids" if self.ids else "", "attributes": chosen}
        per_primitive = "_mesh" if self.ids and self.path.capability == "mesh" else ""
        stages = (
            *self.path.stages,
            (f"surface_{{attributes}}{per_primitive}{{ids}}.frag", FRAGMENT),
        )
        return tuple((name.format(**names), bit) for name, bit in stages)

    def _set_sides(self, commands, number: int) -> None:
        """Which sides of an instance's triangles are seen."""
        instance = self.scene.instances[number]
        double_sided = self.scene.materials[instance.material].double_sided
        clockwise = (
            vk.VK_FRONT_FACE_CLOCKWISE if instance.mirrored else vk.VK_FRONT_FACE_COUNTER_CLOCKWISE
        )
        vk.vkCmdSetCullMode(
            commands, vk.VK_CULL_MODE_NONE if double_sided else vk.VK_CULL_MODE_BACK_BIT
        )
        vk.vkCmdSetFrontFace(commands, clockwise)

    def _draw(self, commands, number: int) -> None:
        instance = self.scene.instances[number]
        self._set_sides(commands, number)
        meshlets = self.scene.primitives[instance.primitive].meshlets
        if self.buffers.index_buffer:
            push(commands, self._layout, self._push_data(instance=number))
            first_index, first_vertex, count = self.buffers.index_range(instance.primitive)
            vk.vkCmdDrawIndexed(commands, count, 1, first_index, first_vertex, 0)
        elif GEOMETRY in [bit for _, bit in self.path.stages]:
            push(commands, self._layout, self._push_data(instance=number))
            vk.vkCmdDraw(commands, meshlets, 1, 0, 0)
        else:
            draw = self.device.function("vkCmdDrawMeshTasksEXT")
            for first in range(0, meshlets, MAX_GROUPS * self.path.group):
                push(commands, self._layout, self._push_data(instance=number, first=first))
                draw(commands, min(-(-(meshlets - first) // self.path.group), MAX_GROUPS), 1, 1)

    def _push_data(self, **fields) -> np.ndarray:
        """PUSH[()]; fields: what is not 0, beside the frame."""
        data = np.zeros((), PUSH)
        data["frame"] = address_words(
            self._frame.address + 64 * len(self.scene.instances)
        )  # behind the matrices
        for name, value in fields.items():
            data[name] = value
        return data


def fill_bounds(buffers: SceneBuffers) -> None:
    """Computes the culling bounds of every meshlet on the device, from the blobs, which need not stay there."""
    device, scene = buffers.device, buffers.scene
    source = buffers if buffers.blobs else SceneBuffers(device, scene, {"blobs", "bounds"})
    pipeline = ComputePipeline.of(device, "bounds.comp", {STREAMS_ID: scene.max_streams})
    with device.commands() as commands:
        for number, primitive in enumerate(scene.primitives):
            data = np.array([*address_words(source.primitives_address), number], np.uint32)
            pipeline.dispatch(commands, -(-primitive.meshlets // 32), data)
        device.full_barrier(commands)
        if source is not buffers:
            region = vk.VkBufferCopy(size=source.bounds.size)
            vk.vkCmdCopyBuffer(commands, source.bounds.handle, buffers.bounds.handle, 1, [region])
            device.full_barrier(commands)
    if source is not buffers:
        source.free()
