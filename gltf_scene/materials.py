"""glTF materials as plain data: factors, and references to textures with their transforms."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import NOT_VALID, member, number, numbers
from gltf_ext.errors import MeshletError

DEFAULT_CUTOFF = 0.5
UNLIT = "KHR_materials_unlit"


@dataclass(frozen=True)
class TextureUse:
    """One use of a texture by a material.

    image: index of the image, or None if the texture has no plain one; texcoord: n of the
    TEXCOORD_n it reads; matrix (by columns), offset: of KHR_texture_transform, texture coordinates
    = matrix * (u, v) + offset; wrap: glTF's wrapS and wrapT; nearest: not filtered.
    """

    texture: int
    image: int | None
    texcoord: int = 0
    matrix: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 1.0)
    offset: tuple[float, ...] = (0.0, 0.0)
    wrap: tuple[int, int] = (gltf.REPEAT, gltf.REPEAT)
    nearest: bool = False


@dataclass(frozen=True)
class Material:
    """A glTF material; colours are linear.

    emissive: emissiveFactor times KHR_materials_emissive_strength; extensions: the JSON of the
    material's extensions.
    """

    base_color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    emissive: tuple[float, ...] = (0.0, 0.0, 0.0)
    alpha_mode: str = gltf.OPAQUE
    alpha_cutoff: float = DEFAULT_CUTOFF
    double_sided: bool = False
    unlit: bool = False
    normal_scale: float = 1.0
    base_texture: TextureUse | None = None
    emissive_texture: TextureUse | None = None
    metallic_roughness_texture: TextureUse | None = None
    normal_texture: TextureUse | None = None
    extensions: dict[str, Any] = field(default_factory=dict)

    @property
    def texcoord(self) -> int:
        """N of the TEXCOORD_n that the back ends read; they have one set per primitive.

        The textures that show most come first: base colour, emission, then the others.
        """
        uses = (
            self.base_texture,
            self.emissive_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
        )
        return next((use.texcoord for use in uses if use is not None), 0)


def read_material(document: Document, index: int | None) -> Material:
    """Return a material of the document, glTF's default one for None. Raises MeshletError."""
    if index is None:
        return Material()
    source = item(document.materials, index, "material")
    pbr = source.get("pbrMetallicRoughness", {})
    extensions = source.get("extensions", {})
    strength = member(extensions, "KHR_materials_emissive_strength").get("emissiveStrength")
    emissive = numbers(source.get("emissiveFactor"), (0.0,) * 3)
    normal = source.get("normalTexture")
    return Material(
        base_color=numbers(pbr.get("baseColorFactor"), (1.0,) * 4),
        metallic=number(pbr.get("metallicFactor"), 1.0),
        roughness=number(pbr.get("roughnessFactor"), 1.0),
        emissive=tuple(v * number(strength, 1.0) for v in emissive),
        alpha_mode=source.get("alphaMode", gltf.OPAQUE),
        alpha_cutoff=number(source.get("alphaCutoff"), DEFAULT_CUTOFF),
        double_sided=source.get("doubleSided", False),
        unlit=UNLIT in extensions,
        normal_scale=1.0 if normal is None else number(normal.get("scale"), 1.0),
        base_texture=_texture_use(document, pbr.get("baseColorTexture")),
        emissive_texture=_texture_use(document, source.get("emissiveTexture")),
        metallic_roughness_texture=_texture_use(document, pbr.get("metallicRoughnessTexture")),
        normal_texture=_texture_use(document, normal),
        extensions=extensions,
    )


def _texture_use(document: Document, info: gltf.TextureInfo | None) -> TextureUse | None:
    if info is None:
        return None
    index = info.get("index", -1)
    texture = item(document.textures, index, "texture")
    transform = member(info.get("extensions"), "KHR_texture_transform")
    texcoord = transform.get("texCoord", info.get("texCoord", 0))
    if not isinstance(texcoord, int):
        raise MeshletError("a texture's texCoord is not a number", NOT_VALID)
    wrap, nearest = _sampler(document, texture.get("sampler"))
    return TextureUse(
        index,
        texture.get("source"),
        texcoord,
        _transform_matrix(transform),
        numbers(transform.get("offset"), (0.0, 0.0)),
        wrap,
        nearest,
    )


def _transform_matrix(transform: dict[str, Any]) -> tuple[float, float, float, float]:
    """Rotation times scale, by columns. A positive angle turns u towards -v, which is up."""
    angle = number(transform.get("rotation"), 0.0)
    u, v = numbers(transform.get("scale"), (1.0, 1.0))
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return (c * u, -s * u, s * v, c * v)


def _sampler(document: Document, index: int | None) -> tuple[tuple[int, int], bool]:
    """Return ((wrapS, wrapT), whether it takes the nearest texel)."""
    if index is None:
        return TextureUse.wrap, False
    sampler = item(document.samplers, index, "sampler")
    wrap = sampler.get("wrapS", gltf.REPEAT), sampler.get("wrapT", gltf.REPEAT)
    return wrap, sampler.get("magFilter") == gltf.NEAREST
