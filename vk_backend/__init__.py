"""Vulkan back end: draws and traces files with EXT_meshlet_edgebreaker straight from their compressed bytes.

from vk_backend import Camera, Renderer, load_scene     needs the package vulkan, and a driver
"""

from importlib import import_module

_PLACES = {
    "Camera": "camera",
    "Picture": "renderer",
    "Renderer": "renderer",
    "load_scene": "scene",
    "VulkanError": "errors",
}
__all__ = list(_PLACES)


def __getattr__(name: str):
    """What is public is imported when it is asked for: python -m vk_backend.build_shaders works without a driver."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_PLACES[name]}", __name__), name)
