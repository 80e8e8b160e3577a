"""Vulkan back end: renders files with EXT_meshlet_edgebreaker from their compressed bytes.

    from vk_backend import Camera, Renderer, load_scene

Needs the Python package vulkan and a Vulkan 1.3 driver. README.md in this folder lists the modules
in reading order.
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "Camera": "scene.camera",
    "Picture": "renderer",
    "RayTracer": "raytrace.tracer",
    "Renderer": "renderer",
    "VulkanError": "gpu.errors",
    "load_scene": "scene.scene",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    """Imports public names on first use: constants and load_scene work without a driver."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_PUBLIC[name]}", __name__), name)
