"""How an attribute's stored numbers become floats, and the boxes that accessors state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format, stated_bounds
from gltf_ext.document.document import Document, item

QUANTIZATION = "KHR_mesh_quantization"
# Integers in these attributes are fractions even in files that forget to say `normalized`: glTF
# and KHR_mesh_quantization allow nothing else.
ALWAYS_NORMALIZED = ("COLOR_", "NORMAL", "TANGENT", "WEIGHTS_")


@dataclass(frozen=True)
class ValueFormat:
    """How an attribute's stored components become floats.

    dtype: of the accessor's components; normalized: integers stand for fractions of the largest.
    """

    dtype: np.dtype
    components: int
    normalized: bool

    @property
    def is_integer(self) -> bool:
        """Whether the values are stored as integers."""
        return self.dtype.kind != "f"

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest integer; zeros for floats."""
        if not self.is_integer:
            return 0.0, 0.0
        limits = np.iinfo(self.dtype)
        return float(limits.min), float(limits.max)

    @property
    def scale(self) -> float:
        """Factor from stored numbers to values, exact in float32."""
        return float(np.float32(1.0 / self.limits[1])) if self.normalized else 1.0

    def to_floats(self, stored: np.ndarray) -> np.ndarray:
        """float32 values of stored components of any shape.

        glTF 2.0, section 3.6.2.2 (Accessor Data Types): max(c / 127, -1) for signed bytes.
        """
        with np.errstate(over="ignore"):  # callers refuse infinite values
            values: np.ndarray = np.asarray(stored).astype(np.float32)
        if not self.normalized:
            return values
        values = np.maximum(values * np.float32(self.scale), np.float32(-1.0))
        return values


def value_format(document: Document, primitive: gltf.Primitive, name: str) -> ValueFormat:
    """Return the format of one of the primitive's attributes. Raises MeshletError.

    Integer texture coordinates are plain integers only if the file declares
    KHR_mesh_quantization; glTF itself allows only normalised ones.
    """
    index = primitive["attributes"][name]
    accessor = item(document.accessors, index, f"the accessor of {name},")
    dtype, components = accessor_format(accessor, name)
    forgotten = name.startswith(ALWAYS_NORMALIZED) or (
        name.startswith("TEXCOORD_") and QUANTIZATION not in document.extensionsUsed
    )
    normalized = dtype.kind != "f" and (accessor.get("normalized", False) or forgotten)
    return ValueFormat(dtype, components, normalized)


def position_box(
    document: Document, primitive: gltf.Primitive
) -> tuple[np.ndarray, np.ndarray] | None:
    """(low, high), float64[3], from the accessor's min and max; None if these are not valid."""
    index = primitive["attributes"].get("POSITION")
    accessor = item(document.accessors, index, "the accessor of POSITION,")
    stated = stated_bounds(accessor)
    if not all(bound is not None and len(bound) == 3 for bound in stated):
        return None
    box = np.array(stated)
    form = value_format(document, primitive, "POSITION")
    if form.normalized:
        box = np.maximum(box * form.scale, -1.0)
    return (box[0], box[1]) if np.isfinite(box).all() and (box[0] <= box[1]).all() else None


def box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the corners of a box, float64[8, 3]."""
    return np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
