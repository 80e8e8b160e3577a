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
from gltf_scene.scene import PlacedPrimitive
from gltf_scene.values import value_format

# Decoded for a scene, in 0.05 to 0.3 s; larger scenes give an evenly spread sample.
MAX_MESHLETS = 2048
MAX_POINTS = 1 << 18  # of a scene with many instances
# Unit vectors, about 15 degrees apart, spread by the golden ratio.
_TURNS = np.arange(256) * 2.399963229728653
_HEIGHTS = 1 - (np.arange(256) + 0.5) / 128
_RADII = np.sqrt(1 - _HEIGHTS**2)
DIRECTIONS = np.column_stack([_RADII * np.cos(_TURNS), _HEIGHTS, _RADII * np.sin(_TURNS)])


def view_points(document: Document, instances: Sequence[PlacedPrimitive]) -> np.ndarray:
    """Return points in world space, float64[n, 3]. Raises MeshletError.

    They are all vertices of scenes of up to MAX_MESHLETS meshlets, and a sample of larger scenes.
    """
    locations = list(dict.fromkeys((p.mesh, p.primitive) for p in instances))
    compressed = {
        (mesh, primitive): read_compressed(document, mesh, primitive)
        for mesh, primitive in locations
        if is_compressed(document.primitive(mesh, primitive))
    }
    decoders = {
        location: _codec.Decoder(compressed_primitive.blob)
        for location, compressed_primitive in compressed.items()
    }
    meshlets = sum(decoder.meshlet_count for decoder in decoders.values())
    step = max(-(-meshlets // MAX_MESHLETS), 1)
    local = {}
    for location in locations:
        if location in compressed:
            points = _meshlet_positions(document, compressed[location], decoders[location], step)
        else:
            points = _plain_positions(document, *location)
        if not (np.abs(points) < MAX_SIZE).all():
            raise MeshletError(
                f"positions are not finite, or larger than {MAX_SIZE:g}",
                "export the file again, smaller",
            )
        local[location] = points
    return _in_world(instances, local)


def _in_world(
    instances: Sequence[PlacedPrimitive], local: dict[tuple[int, int], np.ndarray]
) -> np.ndarray:
    """At most about MAX_POINTS points of all instances, the extremes of each among them.

    Of very many instances, only those that reach farthest into DIRECTIONS.
    """
    total = sum(len(local[p.mesh, p.primitive]) * len(p.matrices) for p in instances)
    step = max(-(-total // MAX_POINTS), 1)
    points = [np.zeros((0, 3))]
    for p in instances:
        own = local[p.mesh, p.primitive]
        if step > 1 and len(own):
            own = np.concatenate([own[::step], own[own.argmin(axis=0)], own[own.argmax(axis=0)]])
        matrices = p.matrices
        if len(own) * len(matrices) > MAX_POINTS:
            matrices = matrices[_outermost(matrices, own)]
        moved = np.matmul(own, matrices[:, :3, :3].transpose(0, 2, 1)) + matrices[:, None, :3, 3]
        points.append(moved.reshape(-1, 3))
    return np.concatenate(points)


def _outermost(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return int64[m]: the instances that reach farthest into each of DIRECTIONS, as spheres.

    matrices: float64[n, 4, 4]; points: float64[m, 3] of the primitive.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    centers = matrices[:, :3, :3] @ ((low + high) / 2) + matrices[:, :3, 3]
    sides = np.linalg.norm(matrices[:, :3, :3], axis=1) * (high - low) / 2
    radii = np.linalg.norm(sides, axis=1)
    farthest = [(centers @ direction + radii).argmax() for direction in DIRECTIONS]
    return np.unique(farthest)


def _plain_positions(document: Document, mesh: int, primitive: int) -> np.ndarray:
    """Return float64[n, 3]: the vertices of an uncompressed primitive, in its coordinates."""
    source = document.primitive(mesh, primitive)
    positions = read_primitive(document, mesh, primitive)[0].attributes["POSITION"]
    return value_format(document, source, "POSITION").to_floats(positions).astype(np.float64)


def _meshlet_positions(
    document: Document, compressed: Compressed, decoder: _codec.Decoder, step: int
) -> np.ndarray:
    """Return the local vertices of every `step`th meshlet, float64[n, 3]."""
    stream = compressed.streams[0]
    meshlets = range(0, decoder.meshlet_count, step)
    with malformed_from(compressed.where):
        integers = np.concatenate([decoder.decode_meshlet(i)[1][0] for i in meshlets])
    values = np.array(stream.offset) + integers.astype(np.float64) * stream.step
    source = document.primitive(compressed.mesh, compressed.primitive)
    format_ = value_format(document, source, "POSITION")
    return format_.to_floats(np.rint(values) if format_.is_integer else values).astype(np.float64)
