"""The devices that the drivers offer: what each one has, and the choice of one."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

from . import vk
from .errors import VulkanError

API_VERSION = vk.VK_MAKE_VERSION(1, 3, 0)

NVIDIA = 0x10DE  # vendor id

# Optional capabilities beyond Vulkan 1.3: the extensions to enable, and the feature structures with
# the members to set.
CAPABILITIES: dict[str, tuple[tuple[str, ...], dict[str, tuple[str, ...]]]] = {
    "mesh": (
        ("VK_EXT_mesh_shader",),
        {"VkPhysicalDeviceMeshShaderFeaturesEXT": ("taskShader", "meshShader")},
    ),
    "raytracing": (
        (
            "VK_KHR_acceleration_structure",
            "VK_KHR_ray_tracing_pipeline",
            "VK_KHR_deferred_host_operations",
        ),
        {
            "VkPhysicalDeviceAccelerationStructureFeaturesKHR": ("accelerationStructure",),
            "VkPhysicalDeviceRayTracingPipelineFeaturesKHR": (
                "rayTracingPipeline",
                "rayTracingPipelineTraceRaysIndirect",
            ),
        },
    ),
    "geometry": ((), {}),
    "atomics64": ((), {"VkPhysicalDeviceVulkan12Features": ("shaderBufferInt64Atomics",)}),
}
# Vulkan 1.2 and 1.3 features that every path uses.
NEEDED = {
    "VkPhysicalDeviceVulkan12Features": (
        "bufferDeviceAddress",
        "scalarBlockLayout",
        "runtimeDescriptorArray",
        "shaderSampledImageArrayNonUniformIndexing",
        "timelineSemaphore",
    ),
    "VkPhysicalDeviceVulkan13Features": ("dynamicRendering", "synchronization2", "maintenance4"),
}
# Vulkan 1.0 features that are enabled if the device has them.
OPTIONAL = (
    "geometryShader",
    "fragmentStoresAndAtomics",
    "vertexPipelineStoresAndAtomics",
    "shaderInt64",
)
# Capability -> the Vulkan 1.0 feature that it needs.
CORE = {"geometry": "geometryShader", "atomics64": "shaderInt64"}


GRAPHICS_COMPUTE = vk.VK_QUEUE_GRAPHICS_BIT | vk.VK_QUEUE_COMPUTE_BIT
Features = Mapping[str, tuple[str, ...]]  # structure -> its members


class Physical:
    """A device that a driver offers. handle: VkPhysicalDevice; driver: its version."""

    def __init__(self, handle: Any):
        self.handle = handle
        self._properties = vk.vkGetPhysicalDeviceProperties(handle)
        self.name: str = self._properties.deviceName
        self.driver = _driver_version(self._properties)
        self.extensions: set[str] = {
            e.extensionName for e in vk.vkEnumerateDeviceExtensionProperties(handle, None)
        }

    @property
    def cache_header(self) -> bytes:
        """The 32 bytes with which the driver's data of a pipeline cache begin (Vulkan, 10.7.3)."""
        own = self._properties
        version = int(vk.VK_PIPELINE_CACHE_HEADER_VERSION_ONE)
        numbers = struct.pack("<IIII", 32, version, own.vendorID, own.deviceID)
        return numbers + bytes(own.pipelineCacheUUID)

    @property
    def is_software(self) -> bool:
        return bool(self._properties.deviceType == vk.VK_PHYSICAL_DEVICE_TYPE_CPU)

    def fault(self, needed: Features) -> VulkanError | None:
        """Why no path can use the device, or None. needed: as NEEDED."""
        if self._properties.apiVersion < API_VERSION:
            return VulkanError(
                f"{self.name} has no Vulkan 1.3", "update the driver or choose another --device"
            )
        if self._first_family(GRAPHICS_COMPUTE) is None:
            return VulkanError(
                f"{self.name} has no queue for graphics and compute", "choose another --device"
            )
        missing = self.missing(needed)
        if missing:
            return VulkanError(
                f"{self.name} lacks {', '.join(missing)}",
                "update the driver or choose another --device",
            )
        return None

    @property
    def queue_families(self) -> tuple[int, int]:
        """(family with graphics and compute, family with compute alone or else the same).

        Of a device without a fault.
        """
        graphics = self._first_family(GRAPHICS_COMPUTE)
        assert graphics is not None
        compute = self._first_family(vk.VK_QUEUE_COMPUTE_BIT)
        return graphics, graphics if compute is None else compute

    def _first_family(self, wanted: int) -> int | None:
        """The first queue family that has these of graphics and compute, and no more of them."""
        families = vk.vkGetPhysicalDeviceQueueFamilyProperties(self.handle)
        return next(
            (i for i, f in enumerate(families) if f.queueFlags & GRAPHICS_COMPUTE == wanted), None
        )

    def capabilities(self) -> set[str]:
        """The keys of CAPABILITIES that the device has."""
        return {name for name in CAPABILITIES if self._has(name)}

    def _has(self, capability: str) -> bool:
        extensions, features = CAPABILITIES[capability]
        if any(e not in self.extensions for e in extensions):
            return False
        core = vk.vkGetPhysicalDeviceFeatures(self.handle)
        if capability in CORE and not getattr(core, CORE[capability]):
            return False
        return not self.missing(features)

    def missing(self, features: Features) -> list[str]:
        """The features that the device lacks."""
        missing = []
        for structure, members in features.items():
            found = getattr(vk, structure)()
            vk.vkGetPhysicalDeviceFeatures2(self.handle, vk.VkPhysicalDeviceFeatures2(pNext=found))
            missing += [member for member in members if not getattr(found, member)]
        return missing


def choose(instance: Any, select: str | int | None, needed: Features) -> Physical:
    """The device that Device's `select` names.

    By default the first GPU that paths can use, or else the first such device: a software renderer.
    Raises VulkanError if there is none.
    """
    listed = devices_of(instance)
    if select is not None:
        listed = [listed[index_of(str(select), [device.name for device in listed])]]
    faults = []
    for device in sorted(listed, key=lambda device: device.is_software):
        fault = device.fault(needed)
        if fault is None:
            return device
        faults.append(fault)
    raise faults[0]


def devices_of(instance: Any) -> list[Physical]:
    """All devices of the drivers. Raises VulkanError if there is none."""
    try:
        handles = vk.vkEnumeratePhysicalDevices(instance)
    except vk.VkError:
        handles = []
    if not handles:
        raise no_driver()
    return [Physical(handle) for handle in handles]


def no_driver() -> VulkanError:
    return VulkanError(
        "there is no Vulkan driver",
        "install one, or Mesa's software renderer; Debian: apt install mesa-vulkan-drivers",
    )


def index_of(select: str, names: list[str]) -> int:
    """The index of the device with this number, or with this part of its name."""
    numbers = [str(i) for i in range(len(names))]
    if select in numbers:
        return int(select)
    part = select.strip().lower()
    index = next((i for i, name in enumerate(names) if part and part in name.lower()), None)
    if index is None:
        raise VulkanError(
            f"there is no device {select if part else 'without a name'}",
            "there are: " + "; ".join(f"{i}: {n}" for i, n in enumerate(names)),
        )
    return index


def _driver_version(properties: Any) -> str:
    version = properties.driverVersion
    if properties.vendorID == NVIDIA:  # a layout of its own
        return f"{version >> 22}.{version >> 14 & 255}.{version >> 6 & 255}"
    parts = (vk.VK_VERSION_MAJOR, vk.VK_VERSION_MINOR, vk.VK_VERSION_PATCH)
    return ".".join(str(part(version)) for part in parts)
