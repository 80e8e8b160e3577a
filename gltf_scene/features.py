"""What a file has besides triangles, materials and cameras, to say which of it is not drawn."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.json_values import member, number

LEAST_MIRROR = 0.05  # share of a metal's light that shows its surroundings
MATERIALS = "KHR_materials_"

LIGHTS, SKINS, MORPHS, ANIMATIONS = "lights", "skins", "morph targets", "animations"
METALS, NORMALS = "reflections of metals", "normal maps"
ROUGHNESS, OCCLUSION = "metallic-roughness maps", "occlusion maps"
UNLIT, STRENGTH, IOR, TRANSMISSION, CLEARCOAT, SHEEN = (
    MATERIALS + name
    for name in ("unlit", "emissive_strength", "ior", "transmission", "clearcoat", "sheen")
)


def undrawn(document: Document, drawn: Container[str]) -> list[str]:
    """Return a warning of one line, or none, for the features of a file beyond `drawn`.

    Features are those of FEATURES, and material extensions by their names.
    """
    names = [name for name, has in FEATURES.items() if name not in drawn and has(document)]
    names += sorted({name for name in _material_extensions(document) if name not in drawn})
    return [f"not drawn: {', '.join(names)}"] if names else []


def _lights(document: Document) -> bool:
    return any(member(node.get("extensions"), "KHR_lights_punctual") for node in document.nodes)


def _morphs(document: Document) -> bool:
    return any(p.get("targets") for mesh in document.meshes for p in mesh["primitives"])


def _metals(document: Document) -> bool:
    """As in shaders/raster/shading.glsl, a rough metal reflects light as other surfaces do."""
    return any(
        number(pbr.get("metallicFactor"), 1.0) * (1 - number(pbr.get("roughnessFactor"), 1.0) ** 4)
        > LEAST_MIRROR
        for pbr in _pbrs(document)
    )


def _pbrs(document: Document) -> Iterator[gltf.PbrMetallicRoughness]:
    for material in document.materials:
        yield material.get("pbrMetallicRoughness", {})


def _material_extensions(document: Document) -> Iterator[str]:
    for material in document.materials:
        yield from (n for n in material.get("extensions", {}) if n.startswith(MATERIALS))


FEATURES: dict[str, Callable[[Document], bool]] = {
    LIGHTS: _lights,
    SKINS: lambda document: any("skin" in node for node in document.nodes),
    MORPHS: _morphs,
    ANIMATIONS: lambda document: bool(document.animations),
    METALS: _metals,
    ROUGHNESS: lambda document: any("metallicRoughnessTexture" in p for p in _pbrs(document)),
    NORMALS: lambda document: any("normalTexture" in m for m in document.materials),
    OCCLUSION: lambda document: any("occlusionTexture" in m for m in document.materials),
}
