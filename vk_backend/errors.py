"""What this package raises when Vulkan cannot do what was asked."""

from __future__ import annotations

from gltf_ext.errors import MeshletError


class VulkanError(MeshletError):
    """No driver, no such device, or a device without what a path needs; one line says which."""
