"""glTF materials as Mitsuba BSDFs and emitters; metallic-roughness becomes `principled`."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.json_values import member, number, numbers
from gltf_ext.errors import MeshletError
from gltf_scene.images import read_image
from gltf_scene.materials import Material, TextureUse, read_material

WRAP = {
    gltf.REPEAT: "repeat",
    gltf.CLAMP_TO_EDGE: "clamp",
    gltf.MIRRORED_REPEAT: "mirror",
}
LEAST_ROUGHNESS = 0.03  # principled has no perfect mirror
DEFAULT_IOR = 1.5
LEAST_IOR = 1.001
WHITE = (1.0, 1.0, 1.0)
PRODUCT = "meshlet_product"  # the native texture that multiplies two others


class Materials:
    """The BSDFs and emitters of a document's materials.

    two_sided: single-sided materials reflect light on their backs, too; warnings: features that are
    ignored.
    """

    def __init__(self, document: Document, two_sided: bool = True):
        self.warnings: list[str] = []
        self._document, self._two_sided = document, two_sided
        self._images: dict[int, np.ndarray | None] = {}

    def bsdf(self, index: int | None, has_colors: bool) -> dict[str, Any]:
        """A BSDF dictionary for a material; index: None for glTF's default material.

        has_colors: the primitive has COLOR_0. Raises MeshletError.
        """
        material = read_material(self._document, index)
        if material.unlit:
            if has_colors:
                self._warn("vertex colours of an unlit material are left out")
            black = {"type": "diffuse", "reflectance": _color((0.0, 0.0, 0.0))}
            return self._with_alpha(material, black)
        result: dict[str, Any] = {
            "type": "principled",
            "base_color": self._base_color(material, has_colors),
            **self._metallic_roughness(material),
            **_extension_parameters(material.extensions),
        }
        transmissive = "spec_trans" in result
        result = self._with_normals(material, result)
        if (material.double_sided or self._two_sided) and not transmissive:
            result = {"type": "twosided", "bsdf": result}
        return self._with_alpha(material, result)

    def emission(self, index: int | None) -> dict[str, Any] | None:
        """An area emitter for a material that emits light, otherwise None. Raises MeshletError."""
        material = read_material(self._document, index)
        if material.unlit:  # shows its colour whatever the lights: it is an emitter
            return {"type": "area", "radiance": self._plain_base_color(material)}
        if not any(material.emissive):
            return None
        found = self._image(material, material.emissive_texture)
        if found is None:
            return {"type": "area", "radiance": _color(material.emissive)}
        image, parameters = found
        return {"type": "area", "radiance": _tinted(image, parameters, material.emissive)}

    # --- parts of a material ---

    def _base_color(self, material: Material, has_colors: bool) -> dict[str, Any]:
        color = self._plain_base_color(material)
        if not has_colors:
            return color
        vertex = {"type": "mesh_attribute", "name": "vertex_color"}
        return vertex if color == _color(WHITE) else {"type": PRODUCT, "a": vertex, "b": color}

    def _plain_base_color(self, material: Material) -> dict[str, Any]:
        """Without vertex colours."""
        factor = material.base_color[:3]
        found = self._image(material, material.base_texture)
        if found is None:
            return _color(factor)
        image, parameters = found
        if factor != WHITE:
            return _tinted(image, parameters, factor)
        bitmap = mi.Bitmap(image[..., :3].copy())
        return {**parameters, "bitmap": bitmap, "raw": False}

    def _metallic_roughness(self, material: Material) -> dict[str, Any]:
        metallic, roughness = material.metallic, max(material.roughness, LEAST_ROUGHNESS)
        found = self._image(material, material.metallic_roughness_texture)
        if found is None:
            return {"metallic": metallic * mirror_share(roughness), "roughness": roughness}
        image, parameters = found
        channels = image.astype(np.float32) / 255
        rough = np.maximum(channels[..., 1] * material.roughness, LEAST_ROUGHNESS)
        metal = channels[..., 2] * metallic * mirror_share(rough)
        return {"metallic": _gray(parameters, metal), "roughness": _gray(parameters, rough)}

    def _with_normals(self, material: Material, bsdf: dict[str, Any]) -> dict[str, Any]:
        found = self._image(material, material.normal_texture)
        if found is None:
            return bsdf
        image, parameters = found
        normals = image[..., :3].astype(np.float32) / 255
        # glTF's tangent space has v upwards; texture coordinates go down, as Mitsuba's dp_dv does.
        normals[..., 1] = 1 - normals[..., 1]
        normals[..., :2] = (normals[..., :2] - 0.5) * material.normal_scale + 0.5
        return {
            "type": "normalmap",
            "normalmap": {**parameters, "bitmap": mi.Bitmap(normals), "raw": True},
            "bsdf": bsdf,
        }

    def _with_alpha(self, material: Material, bsdf: dict[str, Any]) -> dict[str, Any]:
        if material.alpha_mode == gltf.OPAQUE:
            return bsdf
        alpha: np.ndarray = np.array(material.base_color[3], np.float32)
        parameters: dict[str, Any] = {}
        found = self._image(material, material.base_texture)
        if found is not None and (found[0][..., 3] != 255).any():
            image, parameters = found
            alpha = image[..., 3].astype(np.float32) / 255 * alpha
        if material.alpha_mode == gltf.MASK:
            alpha = (alpha >= material.alpha_cutoff).astype(np.float32)
        if np.all(alpha == 1):
            return bsdf
        opacity = _gray(parameters, alpha) if alpha.ndim else float(alpha)
        return {"type": "mask", "opacity": opacity, "bsdf": bsdf}

    # --- images ---

    def _image(
        self, material: Material, use: TextureUse | None
    ) -> tuple[np.ndarray, dict[str, Any]] | None:
        """(uint8[height, width, 4], parameters of a `bitmap` texture) of a texture.

        None, with a warning, if it cannot be used; None for no texture.
        """
        if use is None:
            return None
        if use.texcoord != material.texcoord:
            self._warn(
                "a texture with other texture coordinates than its material's base colour "
                "is left out"
            )
            return None
        if use.image is None:
            self._warn("a texture without a plain image is left out")
            return None
        image = self._decoded(use.image)
        return None if image is None else (image, _bitmap_parameters(use))

    def _decoded(self, index: int) -> np.ndarray | None:
        """uint8[height, width, 4], or None with a warning."""
        if index not in self._images:
            self._images[index] = None
            try:
                self._images[index] = read_image(self._document, index)
            except MeshletError as error:
                self._warn(f"image {index} is left out: {error.message}")
        return self._images[index]

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)


def mirror_share(roughness: Any) -> Any:
    """Share of a metal's light that `principled` reflects as a metal; the rest is diffuse.

    principled follows one reflection between the facets of a rough surface. The light of all
    further ones is missing, and a white metal of roughness 1 (glTF's default material) is dark
    grey. 1 - roughness^4, as in shaders/raster/shading.glsl, gives it back in the base colour.
    """
    return 1.0 - roughness**4


def _bitmap_parameters(use: TextureUse) -> dict[str, Any]:
    parameters: dict[str, Any] = {"type": "bitmap", "wrap_mode": WRAP.get(use.wrap[0], "repeat")}
    if use.nearest:
        parameters["filter_type"] = "nearest"
    if (use.matrix, use.offset) != (TextureUse.matrix, TextureUse.offset):
        to_uv = np.eye(3, dtype=np.float32)
        to_uv[:2, :2] = np.reshape(use.matrix, (2, 2)).T
        to_uv[:2, 2] = use.offset
        parameters["to_uv"] = mi.ScalarTransform3f(to_uv)
    return parameters


def _linear(srgb: np.ndarray) -> np.ndarray:
    """float64 of uint8 sRGB."""
    value = srgb / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _tinted(
    image: np.ndarray, parameters: dict[str, Any], factor: tuple[float, ...]
) -> dict[str, Any]:
    """A texture of the image's colours times a linear factor."""
    colors = (_linear(image[..., :3]) * np.array(factor)).astype(np.float32)
    return {**parameters, "bitmap": mi.Bitmap(colors), "raw": False}


def _color(rgb: tuple[float, ...]) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in rgb]}


def _gray(parameters: dict[str, Any], values: np.ndarray) -> dict[str, Any]:
    bitmap = mi.Bitmap(np.ascontiguousarray(values[..., None], np.float32))
    return {**parameters, "bitmap": bitmap, "raw": True}


def _extension_parameters(extensions: dict[str, Any]) -> dict[str, Any]:
    """Parameters of principled for the factors of material extensions; textures are ignored."""
    result: dict[str, Any] = {}
    if "KHR_materials_ior" in extensions:
        ior = number(member(extensions, "KHR_materials_ior").get("ior"), DEFAULT_IOR)
        result["eta"] = max(ior, LEAST_IOR)
    transmission = member(extensions, "KHR_materials_transmission")
    if number(transmission.get("transmissionFactor"), 0.0) > 0:
        result["spec_trans"] = number(transmission.get("transmissionFactor"), 0.0)
        result.setdefault("eta", DEFAULT_IOR)
    clearcoat = member(extensions, "KHR_materials_clearcoat")
    if number(clearcoat.get("clearcoatFactor"), 0.0) > 0:
        result["clearcoat"] = number(clearcoat.get("clearcoatFactor"), 0.0)
        roughness = number(clearcoat.get("clearcoatRoughnessFactor"), 0.0)
        result["clearcoat_gloss"] = 1.0 - roughness
    sheen = numbers(member(extensions, "KHR_materials_sheen").get("sheenColorFactor"), (0.0,) * 3)
    if any(sheen):
        result["sheen"] = max(sheen)
    return result
