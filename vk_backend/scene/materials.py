"""Materials as the shaders take them, and the images of their textures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_scene import materials as gltf_materials
from gltf_scene.images import read_image
from gltf_scene.materials import DEFAULT_CUTOFF, TextureUse, read_material

from ..gpu.constants import CONSTANTS


@dataclass(frozen=True)
class Texture:
    """An image and its sampler.

    pixels: uint8[height, width, 4], sRGB and alpha; wrap: glTF's wrapS, wrapT; nearest: unfiltered.
    """

    pixels: np.ndarray
    wrap: tuple[int, int] = (gltf.REPEAT, gltf.REPEAT)
    nearest: bool = False


@dataclass(frozen=True)
class Material:
    """One material, with the members of the shaders' structure; colours are linear.

    flags: MATERIAL_ of scene_constants.h; base_texture, emissive_texture: index of a texture, or
    -1; texcoord_matrix (by columns), texcoord_offset: the transform that both textures share.
    """

    base_color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    emissive: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    metallic: float = 1.0
    roughness: float = 1.0
    alpha_cutoff: float = DEFAULT_CUTOFF
    flags: int = 0
    base_texture: int = -1
    emissive_texture: int = -1
    texcoord_matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 1.0)
    texcoord_offset: tuple[float, ...] = (0.0, 0.0)

    @property
    def double_sided(self) -> bool:
        return bool(self.flags & CONSTANTS["MATERIAL_DOUBLE_SIDED"])

    @property
    def masked(self) -> bool:
        """Whether surfaces may be transparent."""
        return bool(self.flags & (CONSTANTS["MATERIAL_MASK"] | CONSTANTS["MATERIAL_BLEND"]))


class Materials:
    """The materials of a document that its primitives use, and their textures.

    records, textures: in the order of first use; warnings: features that are ignored.
    """

    def __init__(self, document: Document):
        self.records: list[Material] = []
        self.textures: list[Texture] = []
        self.warnings: list[str] = []
        self._document = document
        self._known: dict[int | None, tuple[int, int]] = {}
        self._images: dict[int, np.ndarray | None] = {}
        self._textures: dict[int, int] = {}

    def index(self, number: int | None) -> tuple[int, int]:
        """(index in records, n of the TEXCOORD_n it reads) of a material; None: the default one."""
        if number not in self._known:
            source = read_material(self._document, number)
            self._known[number] = len(self.records), source.texcoord
            self.records.append(self._record(source))
        return self._known[number]

    def _record(self, source: gltf_materials.Material) -> Material:
        base, emissive = self._texture(source.base_texture), self._texture(source.emissive_texture)
        uses = (source.base_texture if base >= 0 else None, source.emissive_texture)
        placed = next((use for use in uses if use is not None), None)
        if emissive >= 0 and _placement(source.emissive_texture) != _placement(placed):
            self.warnings.append(
                "an emissive texture is read with the base colour texture's coordinates"
            )
        _, matrix, offset = _placement(placed)
        return Material(
            source.base_color,
            (*source.emissive, 0.0),
            source.metallic,
            source.roughness,
            source.alpha_cutoff,
            _flags(source),
            base,
            emissive,
            matrix,
            offset,
        )

    def _texture(self, use: TextureUse | None) -> int:
        """Index in textures, or -1 with a warning if its image cannot be used."""
        if use is None:
            return -1
        if use.texture not in self._textures:
            if use.image is None:
                self.warnings.append("a texture without a plain image is left out")
            pixels = None if use.image is None else self._image(use.image)
            self._textures[use.texture] = len(self.textures) if pixels is not None else -1
            if pixels is not None:
                self.textures.append(Texture(pixels, use.wrap, use.nearest))
        return self._textures[use.texture]

    def _image(self, number: int) -> np.ndarray | None:
        """uint8[height, width, 4], or None with a warning."""
        if number not in self._images:
            self._images[number] = None
            try:
                self._images[number] = read_image(self._document, number)
            except MeshletError as error:
                self.warnings.append(f"image {number} is left out: {error.message}")
        return self._images[number]


def _placement(
    use: TextureUse | None,
) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
    """(texture coordinate set, matrix, offset)."""
    if use is None:
        return 0, Material.texcoord_matrix, Material.texcoord_offset
    return use.texcoord, use.matrix, use.offset


def _flags(source: gltf_materials.Material) -> int:
    flags = {
        "MATERIAL_DOUBLE_SIDED": source.double_sided,
        "MATERIAL_MASK": source.alpha_mode == gltf.MASK,
        "MATERIAL_BLEND": source.alpha_mode == gltf.BLEND,
        "MATERIAL_UNLIT": source.unlit,
    }
    return sum(CONSTANTS[name] for name, on in flags.items() if on)
