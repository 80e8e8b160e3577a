"""Uncompressed geometry: for path vertex, measurements and tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec

from ..gpu.constants import CONSTANTS

# Bits of `Scene.attributes` and of the shaders' constant ATTRIBUTES.
HAS_NORMAL = CONSTANTS["HAS_NORMAL"]
HAS_TEXCOORD = CONSTANTS["HAS_TEXCOORD"]
HAS_COLOR = CONSTANTS["HAS_COLOR"]
# Floats of an uncompressed vertex beside its position.
VERTEX_FLOATS = ((HAS_NORMAL, 3), (HAS_TEXCOORD, 2), (HAS_COLOR, 4))


@dataclass(frozen=True)
class Decoded:
    """An uncompressed primitive.

    triangles: uint32[T, 3] in the order of the meshlets; positions: float32[V, 3];
    normals: float32[V, 3] or None; texcoords: float32[V, 2] or None; colors: float32[V, 4] or None;
    meshlet_triangles: int64[M], triangles of each meshlet.
    """

    triangles: np.ndarray
    positions: np.ndarray
    normals: np.ndarray | None
    texcoords: np.ndarray | None
    colors: np.ndarray | None
    meshlet_triangles: np.ndarray

    def vertices(self, attributes: int) -> np.ndarray:
        """float32[V, n]: positions, and the attributes of these HAS_ bits.

        Attributes that the primitive lacks are 0, colours 1.
        """
        count = len(self.positions)
        columns = [self.positions]
        if attributes & HAS_NORMAL:
            columns.append(_or_constant(self.normals, count, 3, 0.0))
        if attributes & HAS_TEXCOORD:
            columns.append(_or_constant(self.texcoords, count, 2, 0.0))
        if attributes & HAS_COLOR:
            columns.append(_or_constant(self.colors, count, 4, 1.0))
        return np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32)

    def ids(self) -> np.ndarray:
        """uint32[T]: meshlet * 64 + number within the meshlet."""
        counts = self.meshlet_triangles
        first = np.repeat(np.cumsum(counts) - counts, counts)
        meshlet = np.repeat(np.arange(len(counts)), counts)
        own = np.arange(len(first)) - first
        return np.asarray(meshlet * CONSTANTS["MESHLET_TRIANGLES"] + own, np.uint32)


def _or_constant(
    values: np.ndarray | None, count: int, elements: int, constant: float
) -> np.ndarray:
    return np.full((count, elements), constant, np.float32) if values is None else values


def meshlet_triangles(blob: bytes) -> np.ndarray:
    """int64[M]: triangles of each meshlet."""
    return _codec.Header(blob).meshlet_triangles.astype(np.int64)
