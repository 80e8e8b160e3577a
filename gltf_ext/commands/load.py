"""load and decoders: decoded geometry as numpy arrays, all or one meshlet at a time."""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.extension import (
    Compressed,
    malformed_from,
    read_compressed,
    require_compressed,
)
from gltf_ext.attributes.join import decode
from gltf_ext.attributes.streams import dequantise, to_accessor
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, name_of
from gltf_ext.errors import blaming
from gltf_ext.lod.detail import Detail
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import Primitive, is_compressed, triangle_primitives
from gltf_ext.sources.source import read_primitive


def load(
    path: Model, *, level: int | None = None, error: float | str | None = None
) -> list[Primitive]:
    """Read every triangle primitive of a file in order of (mesh, primitive), decoded.

    Each vertex of a compressed primitive's source is there once, also where the file has copies.

    Args:
        path: of a .glb or .gltf, compressed or not, or of an .obj, .ply or .stl; or a
            pygltflib.GLTF2.
        level: of detail, as `decompress` takes it; by default, and of primitives without levels,
            all triangles.
        error: likewise.

    Returns:
        The primitives, with arrays in the component types of their accessors.

    Raises:
        MeshletError: the file is malformed.
        OSError: the file cannot be read.
    """
    detail = Detail.of(level, error)
    with blaming(name_of(path)):
        document = open_model(path)
        detail = detail.in_scene(document)
        return [
            _decode_at(detail, document, m, p)
            if is_compressed(primitive)
            else read_primitive(document, m, p)[0]
            for m, p, primitive in triangle_primitives(document)
        ]


def _decode_at(detail: Detail, document: Document, mesh: int, index: int) -> Primitive:
    compressed = read_compressed(document, mesh, index)
    return detail.cut(document, compressed) or decode(compressed)


class MeshletDecoder:
    """Decodes single meshlets of one compressed primitive.

    Attributes:
        mesh, primitive: its place in the document.
        meshlet_count, triangle_count, vertex_count: of the whole primitive.
    """

    def __init__(self, compressed: Compressed) -> None:
        self._compressed = compressed
        self._decoder = _codec.Decoder(compressed.blob)
        self.mesh, self.primitive = compressed.mesh, compressed.primitive
        self.meshlet_count: int = self._decoder.meshlet_count
        self.triangle_count: int = self._decoder.triangle_count
        self.vertex_count: int = self._decoder.vertex_count

    def decode_meshlet(self, index: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Decode the meshlet with this number.

        Returns (triangles, attributes): uint8[t, 3] into the meshlet's own vertices, and name ->
        [v, components] in the accessor's component type. Morph-target deltas are named
        "targets[i].NAME". Raises IndexError for a number out of range, MeshletError for malformed
        bytes.
        """
        if not 0 <= index < self.meshlet_count:
            raise IndexError(f"meshlet {index} does not exist, there are {self.meshlet_count}")
        with malformed_from(self._compressed.where):
            triangles, quantised = self._decoder.decode_meshlet(index)
        values = [dequantise(q, stream) for q, stream in zip(quantised, self._compressed.streams)]
        return triangles, {
            name: to_accessor([values[s] for s in streams], dtype)
            for name, streams, (dtype, _) in self._compressed.named_streams
        }


def decoders(path: Model) -> list[MeshletDecoder]:
    """Return a decoder for each compressed primitive of a file, in order of (mesh, primitive).

    Raises MeshletError when the file is malformed or not compressed, OSError when it cannot be
    read.
    """
    with blaming(name_of(path)):
        return [MeshletDecoder(compressed) for compressed in require_compressed(open_model(path))]
