"""glTF materials for Vulkan: what shaders/surface.glsl shades with, and the images that its base colours come from."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document, item

from .constants import CONSTANTS

DEFAULT_CUTOFF = 0.5
MAX_PIXELS = 1 << 26  # of an image; larger ones are left out


@dataclass(frozen=True)
class Texture:
    """An image as glTF's samplers say. pixels: uint8[height, width, 4], sRGB and alpha; wrap: glTF's wrapS, wrapT; nearest: not filtered."""

    pixels: np.ndarray
    wrap: tuple[int, int] = (pygltflib.REPEAT, pygltflib.REPEAT)
    nearest: bool = False


@dataclass(frozen=True)
class Material:
    """One material; colours are linear. texture, emissive_texture: index of a texture, or -1; flags: MATERIAL_ of constants.h.

    texcoord_matrix (two columns), texcoord_offset: where both textures are read.
    """

    base_color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    emissive: tuple[float, ...] = (0.0, 0.0, 0.0)
    metallic: float = 1.0
    roughness: float = 1.0
    alpha_cutoff: float = DEFAULT_CUTOFF
    flags: int = 0
    texture: int = -1
    emissive_texture: int = -1
    texcoord_matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 1.0)
    texcoord_offset: tuple[float, ...] = (0.0, 0.0)

    @property
    def double_sided(self) -> bool:
        return bool(self.flags & CONSTANTS["MATERIAL_DOUBLE_SIDED"])

    def record(self, dtype: np.dtype) -> np.ndarray:
        """scene.MATERIAL[()]"""
        row = np.zeros((), dtype)
        row["base_color"], row["emissive"][:3] = self.base_color, self.emissive
        row["texcoord_matrix"], row["texcoord_offset"] = self.texcoord_matrix, self.texcoord_offset
        row["metallic"], row["roughness"], row["alpha_cutoff"] = (
            self.metallic,
            self.roughness,
            self.alpha_cutoff,
        )
        row["flags"], row["base_texture"], row["emissive_texture"] = (
            self.flags,
            self.texture,
            self.emissive_texture,
        )
        return row


class Materials:
    """The materials of a document that its primitives ask for. records, textures: what was asked for; warnings: what was left out."""

    def __init__(self, document: Document):
        self.records: list[Material] = []
        self.textures: list[Texture] = []
        self.warnings: list[str] = []
        self._document = document
        self._known: dict[int | None, tuple[int, int]] = {}
        self._images: dict[int, np.ndarray | None] = {}
        self._textures: dict[int, int] = {}

    def index(self, number: int | None) -> tuple[int, int]:
        """(index in records, n of the TEXCOORD_n of its texture) of a document's material, or of the default one for None."""
        if number not in self._known:
            material, texcoord = self._read(number)
            self._known[number] = len(self.records), texcoord
            self.records.append(material)
        return self._known[number]

    def _read(self, number: int | None) -> tuple[Material, int]:
        if number is None:
            return Material(), 0
        source = item(self._document.materials, number, "material")
        pbr = source.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
        extensions = source.extensions or {}
        texture, texcoord, matrix, offset = self._placed_texture(pbr.baseColorTexture)
        emissive = self._placed_texture(source.emissiveTexture)
        if texture < 0:
            texcoord, matrix, offset = emissive[1:]
        elif emissive[0] >= 0 and emissive[1:] != (texcoord, matrix, offset):
            self.warnings.append("an emissive texture is read at the base colour texture's place")
        flags = {
            "MATERIAL_DOUBLE_SIDED": bool(source.doubleSided),
            "MATERIAL_MASK": source.alphaMode == pygltflib.MASK,
            "MATERIAL_BLEND": source.alphaMode == pygltflib.BLEND,
            "MATERIAL_UNLIT": "KHR_materials_unlit" in extensions,
        }
        material = Material(
            _numbers(pbr.baseColorFactor, (1.0,) * 4),
            _numbers(source.emissiveFactor, (0.0,) * 3),
            _number(pbr.metallicFactor, 1.0),
            _number(pbr.roughnessFactor, 1.0),
            _number(source.alphaCutoff, DEFAULT_CUTOFF),
            sum(CONSTANTS[name] for name, on in flags.items() if on),
            texture,
            emissive[0],
            matrix,
            offset,
        )
        return material, texcoord

    def _placed_texture(self, info) -> tuple[int, int, tuple[float, ...], tuple[float, ...]]:
        """(texture or -1, n of TEXCOORD_n, KHR_texture_transform's matrix by columns, its offset)."""
        matrix, offset = Material.texcoord_matrix, Material.texcoord_offset
        if info is None:
            return -1, 0, matrix, offset
        transform = (info.extensions or {}).get("KHR_texture_transform", {})
        texcoord = info.texCoord or 0
        if isinstance(transform, dict) and transform:
            texcoord = transform.get("texCoord", texcoord)
            angle, (u, v) = (
                _number(transform.get("rotation"), 0.0),
                _numbers(transform.get("scale"), (1.0, 1.0)),
            )
            c, s = float(np.cos(angle)), float(np.sin(angle))
            matrix, offset = (
                (c * u, -s * u, s * v, c * v),
                _numbers(transform.get("offset"), (0.0, 0.0)),
            )
        if not isinstance(texcoord, int):
            raise MeshletError(
                "a texture's texCoord is not a number",
                "the file is not valid glTF; export it again",
            )
        return self._texture(info.index), texcoord, matrix, offset

    def _texture(self, number: int | None) -> int:
        """Index in textures, or -1 with a warning."""
        if number not in self._textures:
            texture = item(self._document.textures, number, "texture")
            pixels = None if texture.source is None else self._image(texture.source)
            if texture.source is None:
                self.warnings.append("a texture without a plain image is left out")
            self._textures[number] = len(self.textures) if pixels is not None else -1
            if pixels is not None:
                self.textures.append(self._with_sampler(pixels, texture.sampler))
        return self._textures[number]

    def _with_sampler(self, pixels: np.ndarray, number: int | None) -> Texture:
        if number is None:
            return Texture(pixels)
        sampler = item(self._document.samplers, number, "sampler")
        wrap = sampler.wrapS or pygltflib.REPEAT, sampler.wrapT or pygltflib.REPEAT
        return Texture(pixels, wrap, sampler.magFilter == pygltflib.NEAREST)

    def _image(self, number: int) -> np.ndarray | None:
        """uint8[height, width, 4], or None with a warning."""
        if number not in self._images:
            try:
                self._images[number] = self._decoded(item(self._document.images, number, "image"))
            except (
                MeshletError,
                OSError,
                ValueError,
                SyntaxError,
            ) as error:  # what Pillow's readers raise
                reason = str(error).splitlines()[0][:120] if str(error) else "it cannot be read"
                self.warnings.append(f"image {number} is left out: {reason}")
                self._images[number] = None
        return self._images[number]

    def _decoded(self, image: pygltflib.Image) -> np.ndarray:
        from PIL import Image

        data = (
            self._document.read_uri(image.uri)
            if image.uri is not None
            else bytes(self._document.bytes_of_view(image.bufferView))
        )
        with Image.open(io.BytesIO(data)) as opened:
            if opened.width * opened.height > MAX_PIXELS:
                raise MeshletError(f"it has {opened.width} x {opened.height} pixels")
            if opened.mode.startswith("I;16"):
                high = (np.asarray(opened) >> 8).astype(np.uint8)
                opened = Image.fromarray(high)
            return np.asarray(opened.convert("RGBA"))


def _number(value, default: float) -> float:
    """A finite number, or the default."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and np.isfinite(value)
    return float(value) if good else default


def _numbers(values, default: tuple[float, ...]) -> tuple[float, ...]:
    if not isinstance(values, (list, tuple)) or len(values) != len(default):
        return default
    return tuple(_number(v, d) for v, d in zip(values, default))
