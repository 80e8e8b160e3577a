"""The error that this package raises."""

from __future__ import annotations

from gltf_ext.errors import MeshletError


class VulkanError(MeshletError):
    """There is no driver or no such device, or the device lacks a feature that a path needs."""
