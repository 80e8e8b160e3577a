"""glTF materials as Mitsuba BSDFs: metallic-roughness to `principled`, with its textures, alpha, normal map and emission."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document, item

WRAP = {
    pygltflib.REPEAT: "repeat",
    pygltflib.CLAMP_TO_EDGE: "clamp",
    pygltflib.MIRRORED_REPEAT: "mirror",
}
LEAST_ROUGHNESS = 0.03  # principled has no perfect mirror
DEFAULT_IOR = 1.5
DEFAULT_CUTOFF = 0.5


UNLIT = "KHR_materials_unlit"
PRODUCT = "meshlet_product"


def texcoord_set(document: Document, index: int | None) -> int:
    """The number n of the TEXCOORD_n that a material's textures use; Mitsuba's shapes have one, so the base colour's comes first."""
    if index is None:
        return 0
    material = item(document.materials, index, "material")
    pbr = material.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
    infos = (
        pbr.baseColorTexture,
        material.normalTexture,
        pbr.metallicRoughnessTexture,
        material.emissiveTexture,
    )
    return next((_texcoord_set(info) for info in infos if info is not None), 0)


def _texcoord_set(info) -> int:
    return (
        (info.extensions or {}).get("KHR_texture_transform", {}).get("texCoord", info.texCoord or 0)
    )


class Materials:
    """The BSDFs and emitters of a document's materials. warnings: what could not be carried over."""

    def __init__(self, document: Document):
        self.warnings: list[str] = []
        self._document = document
        self._images: dict[int, np.ndarray] = {}
        self._texcoords = 0  # the set that the material in hand uses

    def bsdf(self, index: int | None, has_colors: bool) -> dict[str, Any]:
        """A BSDF dictionary for a material (None: glTF's default); has_colors: the primitive has COLOR_0."""
        material = (
            pygltflib.Material()
            if index is None
            else item(self._document.materials, index, "material")
        )
        extensions = material.extensions or {}
        self._texcoords = texcoord_set(self._document, index)
        pbr = material.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
        factor = _base_color_factor(pbr)
        if UNLIT in extensions:
            if has_colors:
                self._warn("vertex colours of an unlit material are left out")
            black = {"type": "diffuse", "reflectance": _color(np.zeros(3))}
            return self._with_alpha(material, pbr.baseColorTexture, factor[3], black)
        result: dict[str, Any] = {
            "type": "principled",
            "base_color": self._base_color(pbr.baseColorTexture, factor, has_colors),
        }
        result.update(self._metallic_roughness(pbr))
        result.update(_extension_parameters(extensions))
        if material.normalTexture is not None:
            result = self._with_normals(material.normalTexture, result)
        if material.doubleSided and "spec_trans" not in result:
            result = {"type": "twosided", "bsdf": result}
        return self._with_alpha(material, pbr.baseColorTexture, factor[3], result)

    def emission(self, index: int | None) -> dict[str, Any] | None:
        """An area emitter for an emissive material."""
        if index is None:
            return None
        material = item(self._document.materials, index, "material")
        self._texcoords = texcoord_set(self._document, index)
        if UNLIT in (
            material.extensions or {}
        ):  # it shows its colour whatever the lights: it is one
            pbr = material.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
            return {
                "type": "area",
                "radiance": self._base_color(pbr.baseColorTexture, _base_color_factor(pbr), False),
            }
        strength = (
            (material.extensions or {})
            .get("KHR_materials_emissive_strength", {})
            .get("emissiveStrength", 1.0)
        )
        factor = np.array(material.emissiveFactor or (0, 0, 0), np.float64) * strength
        if not factor.any():
            return None
        texture = material.emissiveTexture and self._image(material.emissiveTexture)
        if texture is None:
            return {"type": "area", "radiance": _color(factor)}
        image, parameters = texture
        return {
            "type": "area",
            "radiance": {
                **parameters,
                "bitmap": mi.Bitmap((_linear(image[..., :3]) * factor).astype(np.float32)),
                "raw": False,
            },
        }

    # --- parts of a material ---------------------------------------------------------------------------------------------

    def _base_color(self, info, factor: np.ndarray, has_colors: bool) -> dict[str, Any]:
        color = self._plain_base_color(info, factor)
        if not has_colors:
            return color
        vertex = {"type": "mesh_attribute", "name": "vertex_color"}
        return vertex if color == _color(np.ones(3)) else {"type": PRODUCT, "a": vertex, "b": color}

    def _plain_base_color(self, info, factor: np.ndarray) -> dict[str, Any]:
        """Without vertex colours."""
        texture = info and self._image(info)
        if texture is None:
            return _color(factor[:3])
        image, parameters = texture
        if np.all(factor[:3] == 1):
            return {
                **parameters,
                "bitmap": mi.Bitmap(np.ascontiguousarray(image[..., :3])),
                "raw": False,
            }
        return {
            **parameters,
            "bitmap": mi.Bitmap((_linear(image[..., :3]) * factor[:3]).astype(np.float32)),
            "raw": False,
        }

    def _metallic_roughness(self, pbr) -> dict[str, Any]:
        metallic = 1.0 if pbr.metallicFactor is None else float(pbr.metallicFactor)
        roughness = 1.0 if pbr.roughnessFactor is None else float(pbr.roughnessFactor)
        texture = pbr.metallicRoughnessTexture and self._image(pbr.metallicRoughnessTexture)
        if texture is None:
            return {"metallic": metallic, "roughness": max(roughness, LEAST_ROUGHNESS)}
        image, parameters = texture
        channels = image.astype(np.float32) / 255
        return {
            "metallic": _gray(parameters, channels[..., 2] * metallic),
            "roughness": _gray(
                parameters, np.maximum(channels[..., 1] * roughness, LEAST_ROUGHNESS)
            ),
        }

    def _with_normals(self, info, bsdf: dict[str, Any]) -> dict[str, Any]:
        texture = self._image(info)
        if texture is None:
            return bsdf
        image, parameters = texture
        scale = 1.0 if info.scale is None else float(info.scale)
        normals = image[..., :3].astype(np.float32) / 255
        # Tangent space has v upwards in glTF while texture coordinates go down, as Mitsuba's dp_dv does.
        normals[..., 1] = 1 - normals[..., 1]
        normals[..., :2] = (normals[..., :2] - 0.5) * scale + 0.5
        return {
            "type": "normalmap",
            "normalmap": {**parameters, "bitmap": mi.Bitmap(normals), "raw": True},
            "bsdf": bsdf,
        }

    def _with_alpha(self, material, info, factor: float, bsdf: dict[str, Any]) -> dict[str, Any]:
        mode = material.alphaMode or pygltflib.OPAQUE
        if mode == pygltflib.OPAQUE:
            return bsdf
        cutoff = DEFAULT_CUTOFF if material.alphaCutoff is None else material.alphaCutoff
        texture = info and self._image(info)
        alpha = (
            np.float32(factor)
            if texture is None or texture[0].shape[2] < 4
            else texture[0][..., 3].astype(np.float32) / 255 * np.float32(factor)
        )
        if mode == pygltflib.MASK:
            alpha = (alpha >= cutoff).astype(np.float32)
        opacity = _gray(texture[1], alpha) if alpha.ndim else float(alpha)
        return bsdf if np.all(alpha == 1) else {"type": "mask", "opacity": opacity, "bsdf": bsdf}

    # --- images ----------------------------------------------------------------------------------------------------------

    def _image(self, info) -> tuple[np.ndarray, dict[str, Any]] | None:
        """(uint8[height, width, 3 or 4], the bitmap's other parameters) of a texture reference; None when it cannot be read."""
        transform = (info.extensions or {}).get("KHR_texture_transform", {})
        if _texcoord_set(info) != self._texcoords:
            self._warn(
                "a texture with other texture coordinates than its material's base colour is left out"
            )
            return None
        texture = item(self._document.textures, info.index, "texture")
        if texture.source is None:
            self._warn("a texture without a plain image is left out")
            return None
        image = self._decoded(texture.source)
        if image is None:
            return None
        parameters: dict[str, Any] = {"type": "bitmap", "wrap_mode": "repeat"}
        if texture.sampler is not None:
            sampler = item(self._document.samplers, texture.sampler, "sampler")
            parameters["wrap_mode"] = WRAP.get(sampler.wrapS, "repeat")
            if sampler.magFilter == pygltflib.NEAREST:
                parameters["filter_type"] = "nearest"
        if transform:
            parameters["to_uv"] = _texture_transform(transform)
        return image, parameters

    def _decoded(self, index: int) -> np.ndarray | None:
        if index not in self._images:
            try:
                image = item(self._document.images, index, "image")
                data = (
                    self._document.read_uri(image.uri)
                    if image.uri is not None
                    else bytes(self._document.bytes_of_view(image.bufferView))
                )
                bitmap = mi.Bitmap(_stream(data))
                self._images[index] = _eight_bits(bitmap)
            except (MeshletError, RuntimeError) as error:
                self._warn(f"image {index} is left out: {str(error).splitlines()[-1][:120]}")
                self._images[index] = None
        return self._images[index]

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)


def _stream(data: bytes) -> mi.MemoryStream:
    stream = mi.MemoryStream()
    stream.write(data)
    stream.seek(0)
    return stream


def _eight_bits(bitmap: mi.Bitmap) -> np.ndarray:
    pixels = np.array(bitmap)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    if pixels.shape[2] <= 2:  # grey, perhaps with alpha
        pixels = np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
    return np.ascontiguousarray(pixels)


def _linear(srgb: np.ndarray) -> np.ndarray:
    """uint8 sRGB -> linear float64."""
    value = srgb / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _base_color_factor(pbr: pygltflib.PbrMetallicRoughness) -> np.ndarray:
    """float64[4]"""
    return np.array(
        pbr.baseColorFactor if pbr.baseColorFactor is not None else (1, 1, 1, 1), np.float64
    )


def _color(rgb: np.ndarray) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in rgb]}


def _gray(parameters: dict[str, Any], values: np.ndarray) -> dict[str, Any]:
    return {
        **parameters,
        "bitmap": mi.Bitmap(np.ascontiguousarray(values[..., None], np.float32)),
        "raw": True,
    }


def _texture_transform(transform: dict[str, Any]) -> mi.ScalarTransform3f:
    offset, angle, scale = (
        transform.get("offset", (0, 0)),
        transform.get("rotation", 0.0),
        transform.get("scale", (1, 1)),
    )
    c, s = np.cos(angle), np.sin(angle)
    matrix = (
        np.array([[1, 0, offset[0]], [0, 1, offset[1]], [0, 0, 1]])
        @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        @ np.diag([*scale, 1])
    )
    return mi.ScalarTransform3f(matrix)


def _extension_parameters(extensions: dict[str, Any]) -> dict[str, Any]:
    """What principled has of the factors of glTF's material extensions; their textures are not read."""
    result: dict[str, Any] = {}
    if "KHR_materials_ior" in extensions:
        result["eta"] = max(float(extensions["KHR_materials_ior"].get("ior", DEFAULT_IOR)), 1.001)
    transmission = float(
        extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0.0)
    )
    if transmission > 0:
        result["spec_trans"] = transmission
        result.setdefault("eta", DEFAULT_IOR)
    clearcoat = extensions.get("KHR_materials_clearcoat", {})
    if clearcoat.get("clearcoatFactor", 0.0) > 0:
        result["clearcoat"] = float(clearcoat["clearcoatFactor"])
        result["clearcoat_gloss"] = 1.0 - float(clearcoat.get("clearcoatRoughnessFactor", 0.0))
    if any(extensions.get("KHR_materials_sheen", {}).get("sheenColorFactor", ())):
        result["sheen"] = float(max(extensions["KHR_materials_sheen"]["sheenColorFactor"]))
    return result
