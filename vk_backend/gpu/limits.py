"""The limits of a device: read once, and checked before Vulkan is asked for more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import vk
from .errors import VulkanError

# What every device allows, by the table "Required Limits" of the specification of Vulkan.
MAX_WORKGROUPS = 65535  # in a dimension of a dispatch or draw
PUSH_BYTES = 128  # of push constants
COLOR_ATTACHMENTS = 2  # of a picture, at most: colours and ids


@dataclass(frozen=True)
class Limits:
    """The limits and sizes of a device that this package uses. Bytes and counts.

    device: its name. image_side: pixels of an image; picture_side: of one that a graphics pipeline
    draws into. workgroups: columns, rows and layers of a dispatch. textures: of a scene.
    launch_width, launch_height, launch_invocations: of rays. structure_boxes, structure_instances:
    of an acceleration structure. Without mesh shaders or ray tracing, their limits are 0.

    The checks raise VulkanError.
    """

    device: str
    image_side: int
    picture_side: int
    workgroups: tuple[int, int, int]
    textures: int
    buffer_bytes: int
    allocations: int
    compute_shared_bytes: int
    mesh_shared_bytes: int
    mesh_total_bytes: int  # shared memory and payload of a mesh workgroup
    task_payload_bytes: int
    timestamp_ns: float
    scratch_alignment: int
    structure_boxes: int
    structure_instances: int
    handle_bytes: int
    base_alignment: int
    launch_width: int
    launch_height: int
    launch_invocations: int

    def check_picture(self, width: int, height: int) -> None:
        """Of a picture that is rasterised."""
        if not (0 < width <= self.picture_side and 0 < height <= self.picture_side):
            raise VulkanError(
                f"{width} x {height} pixels are not possible on {self.device}",
                f"at most {self.picture_side} each",
            )

    def check_rays(self, width: int, height: int) -> None:
        """Of a picture that is ray-traced."""
        if (
            not (0 < width <= self.launch_width and 0 < height <= self.launch_height)
            or width * height > self.launch_invocations
        ):
            raise VulkanError(
                f"{self.device} cannot trace a picture of {width} x {height} pixels",
                f"at most {self.launch_width} x {self.launch_height}, and "
                f"{self.launch_invocations} in all",
            )

    def check_image(self, width: int, height: int) -> None:
        if max(width, height) > self.image_side:
            raise VulkanError(
                f"an image has {width} x {height} pixels, too many for {self.device}",
                f"at most {self.image_side} on a side",
            )

    def check_textures(self, count: int) -> None:
        if count > self.textures:
            raise VulkanError(
                f"the scene needs room for {count} textures, too many for {self.device}",
                f"at most {self.textures}",
            )

    def check_workgroups(self, columns: int, rows: int) -> None:
        if columns > self.workgroups[0] or rows > self.workgroups[1]:
            raise VulkanError(
                f"{columns} x {rows} workgroups are too many for {self.device}",
                "ask for a smaller picture or scene",
            )

    def check_buffer(self, size: int) -> None:
        if size > self.buffer_bytes:
            raise VulkanError(
                f"a buffer of {size / 1e6:.0f} MB is too large for {self.device}",
                f"at most {self.buffer_bytes / 1e6:.0f} MB: ask for a smaller picture or scene",
            )

    def check_allocations(self, count: int) -> None:
        if count > self.allocations:
            raise VulkanError(
                f"{self.device} allows no more than {self.allocations} allocations of memory",
                "render a smaller scene",
            )

    def check_structure(self, count: int, *, of_instances: bool) -> None:
        """Of an acceleration structure over boxes or instances."""
        if count > (self.structure_instances if of_instances else self.structure_boxes):
            raise VulkanError(
                f"{self.device} cannot trace {count} {'instances' if of_instances else 'boxes'}",
                "choose another --path",
            )


def read_limits(physical: Any, *, mesh: bool, raytracing: bool) -> Limits:
    """The limits of a VkPhysicalDevice. mesh, raytracing: capabilities that it has."""
    largest = chain = vk.VkPhysicalDeviceVulkan13Properties()
    meshes = structures = rays = None
    if mesh:
        chain = meshes = vk.VkPhysicalDeviceMeshShaderPropertiesEXT(pNext=chain)
    if raytracing:
        chain = structures = vk.VkPhysicalDeviceAccelerationStructurePropertiesKHR(pNext=chain)
        chain = rays = vk.VkPhysicalDeviceRayTracingPipelinePropertiesKHR(pNext=chain)
    vk.vkGetPhysicalDeviceProperties2(physical, vk.VkPhysicalDeviceProperties2(pNext=chain))
    properties = vk.vkGetPhysicalDeviceProperties(physical)
    core = properties.limits
    image_side = core.maxImageDimension2D
    framebuffer = core.maxFramebufferWidth, core.maxFramebufferHeight
    columns, rows = (
        core.maxComputeWorkGroupCount[i] * core.maxComputeWorkGroupSize[i] for i in (0, 1)
    )
    return Limits(
        device=properties.deviceName,
        image_side=image_side,
        picture_side=min(image_side, *framebuffer, *core.maxViewportDimensions),
        workgroups=tuple(core.maxComputeWorkGroupCount),
        # A texture takes a sampler and a sampled image, and all are in one set for any stage. The
        # fragment stage has colour attachments among its resources.
        textures=min(
            core.maxPerStageDescriptorSamplers,
            core.maxPerStageDescriptorSampledImages,
            core.maxPerStageResources - COLOR_ATTACHMENTS,
            core.maxDescriptorSetSamplers,
            core.maxDescriptorSetSampledImages,
        ),
        buffer_bytes=largest.maxBufferSize,
        allocations=core.maxMemoryAllocationCount,
        compute_shared_bytes=core.maxComputeSharedMemorySize,
        mesh_shared_bytes=meshes.maxMeshSharedMemorySize if meshes else 0,
        mesh_total_bytes=meshes.maxMeshPayloadAndSharedMemorySize if meshes else 0,
        task_payload_bytes=meshes.maxTaskPayloadSize if meshes else 0,
        timestamp_ns=core.timestampPeriod,
        scratch_alignment=structures.minAccelerationStructureScratchOffsetAlignment
        if structures
        else 0,
        structure_boxes=structures.maxPrimitiveCount if structures else 0,
        structure_instances=structures.maxInstanceCount if structures else 0,
        handle_bytes=rays.shaderGroupHandleSize if rays else 0,
        base_alignment=rays.shaderGroupBaseAlignment if rays else 0,
        launch_width=columns,
        launch_height=rows,
        launch_invocations=rays.maxRayDispatchInvocationCount if rays else 0,
    )
