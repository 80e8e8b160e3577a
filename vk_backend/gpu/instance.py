"""The Vulkan instance: the loader with its drivers, and the validation layer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from . import vk
from .errors import VulkanError
from .physical import API_VERSION, no_driver

VALIDATION_LAYER = "VK_LAYER_KHRONOS_validation"
DEBUG_EXTENSION = "VK_EXT_debug_utils"
FEATURES_EXTENSION = "VK_EXT_validation_features"
# Drivers that translate to another API, as on Apple's systems, are listed only with it.
PORTABILITY_EXTENSION = "VK_KHR_portability_enumeration"


def create_instance(*, validation: bool) -> Any:
    """VkInstance. validation: with the validation layer. Raises VulkanError."""
    layers: list[str] = []
    extensions: list[str] = []
    chain: Any = None
    flags = 0
    if validation:
        if VALIDATION_LAYER not in {
            layer.layerName for layer in vk.vkEnumerateInstanceLayerProperties()
        }:
            raise VulkanError(
                "the Vulkan validation layer is not installed",
                "Debian: apt install vulkan-validationlayers",
            )
        layers, extensions = [VALIDATION_LAYER], [DEBUG_EXTENSION, FEATURES_EXTENSION]
        enabled = [vk.VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT]
        chain = vk.VkValidationFeaturesEXT(
            enabledValidationFeatureCount=len(enabled), pEnabledValidationFeatures=enabled
        )
    if PORTABILITY_EXTENSION in {
        extension.extensionName for extension in vk.vkEnumerateInstanceExtensionProperties(None)
    }:
        extensions.append(PORTABILITY_EXTENSION)
        flags = vk.VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR
    application = vk.VkApplicationInfo(pApplicationName="gltf-meshlet", apiVersion=API_VERSION)
    try:
        return vk.vkCreateInstance(
            vk.VkInstanceCreateInfo(
                pNext=chain,
                flags=flags,
                pApplicationInfo=application,
                enabledLayerCount=len(layers),
                ppEnabledLayerNames=layers,
                enabledExtensionCount=len(extensions),
                ppEnabledExtensionNames=extensions,
            ),
            None,
        )
    except vk.VkErrorIncompatibleDriver:
        raise no_driver() from None


@contextmanager
def open_instance() -> Iterator[Any]:
    """An instance that the block's end destroys."""
    instance = create_instance(validation=False)
    try:
        yield instance
    finally:
        vk.vkDestroyInstance(instance, None)
