"""Points of a scene's surface, from which the default view is fitted.

A bounding box is up to twice as large on the screen as the model in it, so that a view of the box
would leave half of the picture empty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gltf_ext import _codec
from gltf_ext.compression.extension import EXTENSION, malformed, read_compressed
from gltf_ext.compression.primitives import read_primitive
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.scene import MAX_SIZE, PlacedPrimitive, value_format

# Decoded for a scene, in 0.05 to 0.3 s; larger scenes give an evenly spread sample.
MAX_MESHLETS = 2048
MAX_POINTS = 1 << 18  # of a scene with many instances


def view_points(document: Document, placed: Sequence[PlacedPrimitive]) -> np.ndarray:
    """float64[n, 3] points in world space: all vertices of scenes of up to MAX_MESHLETS meshlets.

    Raises MeshletError.
    """
    places = dict.fromkeys((p.mesh, p.primitive) for p in placed)
    meshlets = max(MAX_MESHLETS // max(len(places), 1), 1)
    local = {place: _checked(_primitive_points(document, *place, meshlets)) for place in places}
    share = max(MAX_POINTS // max(len(placed), 1), 8)
    points = []
    for p in placed:
        own = local[p.mesh, p.primitive]
        own = own[:: -(-len(own) // share)] if len(own) else own
        points.append(own @ p.matrix[:3, :3].T + p.matrix[:3, 3])
    return np.concatenate(points) if points else np.zeros((0, 3))


def _checked(points: np.ndarray) -> np.ndarray:
    if not (np.abs(points) < MAX_SIZE).all():
        raise MeshletError(
            f"positions are not finite, or larger than {MAX_SIZE:g}",
            "export the file again, smaller",
        )
    return points


def _primitive_points(document: Document, mesh: int, primitive: int, meshlets: int) -> np.ndarray:
    """float64[n, 3] vertices in the primitive's coordinates, of at most so many meshlets."""
    source = document.meshes[mesh].primitives[primitive]
    form = value_format(document, source, "POSITION")
    if EXTENSION not in (source.extensions or {}):
        stored = read_primitive(document, mesh, primitive)[0].attributes["POSITION"]
        return form.to_floats(stored).astype(np.float64)
    compressed = read_compressed(document, mesh, primitive)
    stream = compressed.streams[0]
    decoder = _codec.Decoder(compressed.blob)
    chosen = range(0, decoder.meshlet_count, -(-decoder.meshlet_count // meshlets))
    try:
        integers = np.concatenate([decoder.decode_meshlet(i)[1][0] for i in chosen])
    except ValueError as error:
        raise malformed(compressed.where, error) from None
    values = np.array(stream.offset) + integers.astype(np.float64) * stream.step
    return form.to_floats(np.rint(values) if form.is_integer else values).astype(np.float64)
