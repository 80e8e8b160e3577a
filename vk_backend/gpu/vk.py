"""The Python package `vulkan`, with its gaps filled and its wrong values corrected.

All modules of this package write `from . import vk` and use names of the Vulkan API. A name that is
not defined here comes from the package. Values are from the Vulkan registry (vk.xml).
"""

from __future__ import annotations

from typing import Any

from .errors import VulkanError

try:
    import vulkan as _package
    from vulkan._vulkan import lib as _library
except ImportError:
    raise VulkanError(
        "the Python package vulkan is not installed", "pip install 'gltf-meshlet[vulkan]'"
    ) from None
except OSError:  # the package raises it if there is no loader
    raise VulkanError(
        "there is no Vulkan loader (libvulkan.so.1)",
        "install it with a driver; Debian: apt install libvulkan1 mesa-vulkan-drivers",
    ) from None

# Missing in the package.
VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT = 0x20000
VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT = 2

# Wrong in the package: it numbers them as another extension's.
VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR = 1000150015
VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR = 1000150016
VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR = 1000165000


def vkGetBufferDeviceAddress(device: Any, info: Any) -> int:
    """The package's wrapper drops the result."""
    return int(_library.vkGetBufferDeviceAddress(device, _package.ffi.addressof(info)))


def vkGetAccelerationStructureDeviceAddressKHR(device: Any, info: Any) -> int:
    """The package's wrapper drops the result."""
    name = "vkGetAccelerationStructureDeviceAddressKHR"
    function = _package.ffi.cast(f"PFN_{name}", _library.vkGetDeviceProcAddr(device, name.encode()))
    return int(function(device, _package.ffi.addressof(info)))


def vkGetPipelineCacheData(device: Any, cache: Any) -> bytes:
    """The package has no wrapper. Empty if the driver cannot say."""
    ffi = _package.ffi
    size = ffi.new("size_t *")
    if _library.vkGetPipelineCacheData(device, cache, size, ffi.NULL) != _package.VK_SUCCESS:
        return b""
    data = ffi.new("char[]", size[0])
    if _library.vkGetPipelineCacheData(device, cache, size, data) != _package.VK_SUCCESS:
        return b""
    return bytes(ffi.buffer(data, size[0]))


def __getattr__(name: str) -> Any:
    return getattr(_package, name)
