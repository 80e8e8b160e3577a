"""A level or an error, as users give it, and primitives at that detail."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from gltf_ext.attributes.extension import Compressed
from gltf_ext.document.accessors import stated_bounds
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import mesh_scales
from gltf_ext.errors import MeshletError
from gltf_ext.lod.cuts import cut_at_error, cut_at_level
from gltf_ext.lod.reading import read_lod
from gltf_ext.lod.tables import EXTENSION
from gltf_ext.sources.primitives import Primitive


@dataclass(frozen=True)
class Detail:
    """How much of a primitive to decode: all of it if both are None.

    Attributes:
        level: 0 is the finest.
        error: in units of the scene; is_share: times the longest side of the bounding box.
        scales: mesh -> its scale in the scene.
    """

    level: int | None = None
    error: float | None = None
    is_share: bool = False
    scales: Mapping[int, float] = field(default_factory=dict)

    @classmethod
    def of(cls, level: int | None, error: float | str | None) -> Detail:
        """From a user's level or error. Raises MeshletError."""
        if level is not None and error is not None:
            raise MeshletError(
                "level and error both choose the detail", "give one", options=("level", "error")
            )
        if level is not None and (not _is_count(level)):
            raise MeshletError(f"level is {level!r}", "use 0 or more", options=("level",))
        if error is None:
            return cls(level)
        text = str(error).strip()
        try:
            value = float(text.removesuffix("%"))
        except ValueError:
            value = math.nan
        if not 0.0 <= value < math.inf:
            raise MeshletError(
                f"error is {error!r}", "use a number of model units, or 0.1%", options=("error",)
            )
        is_share = text.endswith("%")
        return cls(None, value / 100.0 if is_share else value, is_share)

    def in_scene(self, document: Document) -> Detail:
        """Return the same for the scales of a document's nodes."""
        if self.error is None or self.is_share:
            return self
        return replace(self, scales=mesh_scales(document))

    def cut(self, document: Document, compressed: Compressed) -> Primitive | None:
        """Return the primitive at this detail; None for all of it. Raises MeshletError."""
        if not self.level and self.error is None:
            return None
        primitive = read_lod(document, compressed)
        if primitive is None:
            return None
        if self.level is not None:
            return primitive.mesh(cut_at_level(primitive.tables, self.level))
        assert self.error is not None
        unit = _longest_side(document, compressed) if self.is_share else 1.0
        scale = self.scales.get(compressed.mesh, 1.0) or 1.0  # 0 shows nothing
        return primitive.mesh(cut_at_error(primitive.tables, self.error * unit / scale))


def _is_count(value: Any) -> bool:
    is_integer = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    return is_integer and bool(value >= 0)


def missing_levels(document: Document) -> list[str]:
    """Return a warning for a user who asks for less detail than a document without levels has."""
    if EXTENSION in document.extensionsUsed:
        return []
    return ["it has no levels of detail, only all triangles; compress the original with --lod"]


def _longest_side(document: Document, compressed: Compressed) -> float:
    """Of the bounding box that the POSITION accessor states."""
    primitive = document.primitive(compressed.mesh, compressed.primitive)
    accessor = document.accessors[primitive["attributes"]["POSITION"]]
    low, high = stated_bounds(accessor)
    if low is None or high is None or len(low) != 3 or len(high) != 3:
        raise MeshletError(
            f"{compressed.where}: POSITION has no bounds", "compress the original again"
        )
    return float((high - low).max())
