"""load and decoders: decoded geometry as numpy arrays, whole or one meshlet at a time."""

from __future__ import annotations

import os

import numpy as np

from gltf_ext import _codec
from gltf_ext.compression.extension import (
    EXTENSION,
    Compressed,
    malformed,
    read_compressed,
    require_compressed,
)
from gltf_ext.compression.primitives import Primitive, read_primitive, triangle_primitives
from gltf_ext.compression.streams import dequantise, to_accessor
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.importers import open_model


def load(path: str | os.PathLike) -> list[Primitive]:
    """Every triangle primitive of a file in order of (mesh, primitive), compressed ones decoded.

    Each has mesh, primitive, indices (uint32[T, 3]), attributes (name -> [V, components] in the accessor's component
    type) and targets (the same per morph target). Raises MeshletError, OSError.
    """
    try:
        document = open_model(path)
        return [
            read_compressed(document, m, p).decode()
            if EXTENSION in (primitive.extensions or {})
            else read_primitive(document, m, p)[0]
            for m, p, primitive in triangle_primitives(document)
        ]
    except MeshletError as error:
        error.path = error.path or str(path)
        raise


class MeshletDecoder:
    """Decodes single meshlets of one compressed primitive.

    mesh, primitive: its place in the document; meshlet_count, triangle_count, vertex_count: of the whole primitive.
    """

    def __init__(self, compressed: Compressed):
        self._compressed = compressed
        self._decoder = _codec.Decoder(compressed.blob)
        self.mesh, self.primitive = compressed.mesh, compressed.primitive
        self.meshlet_count: int = self._decoder.meshlet_count
        self.triangle_count: int = self._decoder.triangle_count
        self.vertex_count: int = self._decoder.vertex_count

    def decode_meshlet(self, index: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """(triangles: uint8[t, 3] into the meshlet's own vertices, attributes: name -> [v, components]).

        Morph-target deltas are named "targets[i].NAME". Raises IndexError for a number out of range, MeshletError
        for malformed bytes.
        """
        if not 0 <= index < self.meshlet_count:
            raise IndexError(f"meshlet {index} does not exist, there are {self.meshlet_count}")
        try:
            triangles, quantised = self._decoder.decode_meshlet(index)
        except ValueError as error:
            raise malformed(self._compressed.where, error) from None
        values = [dequantise(q, stream) for q, stream in zip(quantised, self._compressed.streams)]
        return triangles, {
            name: to_accessor([values[s] for s in streams], dtype)
            for name, streams, (dtype, _) in self._compressed.named_streams
        }


def decoders(path: str | os.PathLike) -> list[MeshletDecoder]:
    """A decoder for each compressed primitive of a file, in order of (mesh, primitive)."""
    try:
        return [MeshletDecoder(compressed) for compressed in require_compressed(open_model(path))]
    except MeshletError as error:
        error.path = error.path or str(path)
        raise
