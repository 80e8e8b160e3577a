"""How materials use a primitive: the textures of its texture coordinates, its gloss.

Reads leniently: what is not as glTF has it counts as not there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.images import size_in_header
from gltf_ext.document.json_values import member, number, numbers
from gltf_ext.errors import MeshletError

LARGEST_IMAGE = 16384  # pixels along a side that a GPU takes; a header may claim more
VARIANTS, TRANSFORM = "KHR_materials_variants", "KHR_texture_transform"
MAX_DEPTH = 8  # of a material's JSON, whose objects hold references to textures


@dataclass
class Look:
    """How the materials of a primitive use it.

    Attributes:
        texels: n of TEXCOORD_n -> texels of the largest texture along one unit of it.
        roughness: of the glossiest material; a texture's is not known.
        is_lit: whether any material uses normals.
    """

    texels: dict[int, float] = field(default_factory=dict)
    roughness: float = 1.0
    is_lit: bool = False


class Looks:
    """The looks of a document's primitives."""

    def __init__(self, document: Document) -> None:
        """Read nothing yet."""
        self._document = document
        self._sizes: dict[int, float] = {}  # of images

    def of(self, primitives: list[gltf.Primitive]) -> Look:
        """Return the look of the data that some primitives share."""
        look = Look()
        for primitive in primitives:
            for index in _materials(primitive):
                self._add(look, _at(self._document.materials, index))
        return look

    def _add(self, look: Look, material: Any) -> None:
        pbr = member(material, "pbrMetallicRoughness")
        if "metallicRoughnessTexture" not in pbr:
            look.roughness = min(look.roughness, number(pbr.get("roughnessFactor"), 1.0))
        look.is_lit |= "KHR_materials_unlit" not in member(material, "extensions")
        for info in _texture_infos(material):
            transform = member(member(info, "extensions"), TRANSFORM)
            texcoord = transform.get("texCoord", info.get("texCoord", 0))
            scale = max(map(abs, numbers(transform.get("scale"), (1.0, 1.0))))
            if isinstance(texcoord, int):
                texels = self._texels(info["index"]) * scale
                look.texels[texcoord] = max(look.texels.get(texcoord, 0.0), texels)

    def _texels(self, texture: Any) -> float:
        """Return the length of the longer side of a texture's largest image; 0 if it has none."""
        value = _at(self._document.textures, texture)
        holders = [value, *(v for v in member(value, "extensions").values())]
        sources = [holder.get("source") for holder in holders if isinstance(holder, dict)]
        return max((self._size(source) for source in sources), default=0.0)

    def _size(self, index: Any) -> float:
        image = _at(self._document.images, index)
        if not image:
            return 0.0
        if index not in self._sizes:
            self._sizes[index] = min(self._read_size(image), LARGEST_IMAGE)
        return self._sizes[index]

    def _read_size(self, image: Any) -> float:
        try:
            if "uri" in image:
                data = self._document.read_uri(image["uri"])
            else:
                data = bytes(self._document.bytes_of_view(image.get("bufferView")))
            return max(size_in_header(data))
        except (MeshletError, OSError, ValueError):
            return 0.0


def _materials(primitive: gltf.Primitive) -> list[Any]:
    """Return the indices of a primitive's materials, those of its variants too; None for none."""
    mappings = member(member(primitive, "extensions"), VARIANTS).get("mappings", [])
    mappings = mappings if isinstance(mappings, list) else []
    variants = [mapping.get("material") for mapping in mappings if isinstance(mapping, dict)]
    return [primitive.get("material"), *variants]


def _at(items: list[Any], index: Any) -> Any:
    """Return the item of a list; an empty object if there is none."""
    is_index = isinstance(index, int) and not isinstance(index, bool)
    value = items[index] if is_index and 0 <= index < len(items) else {}
    return value if isinstance(value, dict) else {}


def _texture_infos(value: Any, depth: int = 0) -> Iterator[dict[str, Any]]:
    """Yield the references to textures in a material, those of its extensions too."""
    if isinstance(value, dict) and depth < MAX_DEPTH:
        for name, inner in value.items():
            if name.endswith("Texture") and isinstance(inner, dict) and "index" in inner:
                yield inner
            elif name != "extras":
                yield from _texture_infos(inner, depth + 1)
