"""Points of a scene's surface, from which the default view is fitted.

A bounding box is up to twice as large on the screen as the model in it, so that a view of the box
would leave half of the picture empty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.extension import Compressed, malformed_from, read_compressed
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import MAX_SIZE
from gltf_ext.errors import MeshletError
from gltf_ext.sources.primitives import is_compressed
from gltf_ext.sources.source import read_primitive
from gltf_scene.scene import PlacedPrimitive, value_format

# Decoded for a scene, in 0.05 to 0.3 s; larger scenes give an evenly spread sample.
MAX_MESHLETS = 2048
MAX_POINTS = 1 << 18  # of a scene with many instances


def view_points(document: Document, placed: Sequence[PlacedPrimitive]) -> np.ndarray:
    """float64[n, 3] points in world space: all vertices of scenes of up to MAX_MESHLETS meshlets.

    Raises MeshletError.
    """
    places = list(dict.fromkeys((p.mesh, p.primitive) for p in placed))
    compressed = {
        (mesh, primitive): read_compressed(document, mesh, primitive)
        for mesh, primitive in places
        if is_compressed(document.primitive(mesh, primitive))
    }
    decoders = {place: _codec.Decoder(found.blob) for place, found in compressed.items()}
    meshlets = sum(decoder.meshlet_count for decoder in decoders.values())
    step = max(-(-meshlets // MAX_MESHLETS), 1)
    local = {}
    for place in places:
        if place in compressed:
            points = _meshlet_positions(document, compressed[place], decoders[place], step)
        else:
            points = _plain_positions(document, *place)
        if not (np.abs(points) < MAX_SIZE).all():
            raise MeshletError(
                f"positions are not finite, or larger than {MAX_SIZE:g}",
                "export the file again, smaller",
            )
        local[place] = points
    return _in_world(placed, local)


def _in_world(
    placed: Sequence[PlacedPrimitive], local: dict[tuple[int, int], np.ndarray]
) -> np.ndarray:
    """At most about MAX_POINTS points of all instances, the extremes of each among them."""
    total = sum(len(local[p.mesh, p.primitive]) for p in placed)
    step = max(-(-total // MAX_POINTS), 1)
    points = [np.zeros((0, 3))]
    for p in placed:
        own = local[p.mesh, p.primitive]
        if step > 1 and len(own):
            own = np.concatenate([own[::step], own[own.argmin(axis=0)], own[own.argmax(axis=0)]])
        points.append(own @ p.matrix[:3, :3].T + p.matrix[:3, 3])
    return np.concatenate(points)


def _plain_positions(document: Document, mesh: int, primitive: int) -> np.ndarray:
    """float64[n, 3]: the vertices of an uncompressed primitive, in its coordinates."""
    source = document.primitive(mesh, primitive)
    stored = read_primitive(document, mesh, primitive)[0].attributes["POSITION"]
    return value_format(document, source, "POSITION").to_floats(stored).astype(np.float64)


def _meshlet_positions(
    document: Document, compressed: Compressed, decoder: _codec.Decoder, step: int
) -> np.ndarray:
    """float64[n, 3]: the vertices of every `step`th meshlet, in the primitive's coordinates."""
    stream = compressed.streams[0]
    chosen = range(0, decoder.meshlet_count, step)
    with malformed_from(compressed.where):
        integers = np.concatenate([decoder.decode_meshlet(i)[1][0] for i in chosen])
    values = np.array(stream.offset) + integers.astype(np.float64) * stream.step
    source = document.primitive(compressed.mesh, compressed.primitive)
    form = value_format(document, source, "POSITION")
    return form.to_floats(np.rint(values) if form.is_integer else values).astype(np.float64)
