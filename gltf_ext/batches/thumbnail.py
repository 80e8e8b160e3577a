"""Small pictures of models for the page of a batch, drawn with numpy."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import starmap
from pathlib import Path

import numpy as np

from gltf_ext.attributes.extension import read_compressed, read_triangles
from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import is_compressed

PIXELS = 96
SAMPLES = 12 * PIXELS * PIXELS  # on all surfaces: more than one for nearly every pixel
# Of a scene. Of more, some are left out, so that neither a large model nor one with many instances
# takes much memory. Of each primitive at least MIN_TRIANGLES are there.
MAX_TRIANGLES, MAX_PRIMITIVES, MIN_TRIANGLES = 200_000, 2000, 100
# Rows: right, up and towards the viewer, who looks down from the front and the right.
VIEW = np.array([[0.82, 0.0, -0.57], [-0.24, 0.91, -0.34], [0.52, 0.41, 0.75]])
LIGHT = np.array([0.3, 0.5, 0.81])


def thumbnail(path: Path) -> bytes:
    """Return a PNG of the default scene in grey. Raises MeshletError."""
    from PIL import Image

    document = open_model(path)
    instances = list(_instances(document))
    instances = instances[:: 1 + len(instances) // MAX_PRIMITIVES]
    max_triangles = max(MIN_TRIANGLES, MAX_TRIANGLES // max(len(instances), 1))
    keys = dict.fromkeys(key for key, _ in instances)
    triangles_of = {key: _triangles(document, *key, max_triangles) for key in keys}
    corners = [np.empty((0, 3, 3))]
    for key, matrix in instances:
        corners.append(triangles_of[key] @ matrix[:3, :3].T + matrix[:3, 3])
    shades = _draw(np.concatenate(corners) @ VIEW.T)
    png = io.BytesIO()
    Image.fromarray(np.stack([shades, np.where(shades, 255, 0)], axis=-1).astype(np.uint8)).save(
        png, "PNG"
    )
    return png.getvalue()


def _instances(document: Document) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """Return ((mesh, primitive), matrix to world space) of each triangle primitive of each node."""
    for node, matrix in placed_nodes(document):
        if "mesh" not in node:
            continue
        mesh = item(document.meshes, node["mesh"], "mesh")
        for index, primitive in enumerate(mesh["primitives"]):
            if gltf.has_triangles(primitive):
                yield (node["mesh"], index), matrix


def _triangles(document: Document, mesh: int, primitive: int, max_triangles: int) -> np.ndarray:
    """Return corners of about `max_triangles` of a primitive's triangles: [t, 3, 3].

    Decodes some blobs of a large primitive at a time.
    """
    if not is_compressed(document.primitive(mesh, primitive)):
        geometry, _ = read_triangles(document, mesh, primitive)
        step = 1 + len(geometry.indices) // max_triangles
        corners: np.ndarray = geometry.attributes["POSITION"][geometry.indices[::step]]
        return corners
    compressed = read_compressed(document, mesh, primitive)
    step, first, pieces = 1 + compressed.triangle_count // max_triangles, 0, []
    for part in starmap(compressed.as_primitive, compressed.parts()):
        positions = part.attributes["POSITION"]
        pieces.append(positions[part.indices[::step] - np.uint32(first)])
        first += len(positions)
    return np.concatenate(pieces)


def _draw(corners: np.ndarray) -> np.ndarray:
    """Shades 0 (nothing) to 255, float64[PIXELS, PIXELS]. corners: float64[T, 3, 3] as seen."""
    shades = np.zeros((PIXELS, PIXELS))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    area_sums = np.cumsum(areas)
    if not len(area_sums) or not 0 < area_sums[-1] < np.inf:
        return shades
    number = np.arange(SAMPLES)
    triangle = np.searchsorted(area_sums, (number + 0.5) / SAMPLES * area_sums[-1])
    u, v = number * 0.7548776662466927 % 1, number * 0.5698402909980532 % 1  # evenly spread
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corners[triangle].transpose(1, 0, 2)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    scale = (PIXELS - 2) / max((high - low)[:2].max(), 1e-30)
    pixels = ((points - (low + high) / 2) * scale)[:, :2] + PIXELS / 2
    columns, rows = pixels.astype(int).clip(0, PIXELS - 1).T
    brightness = 60 + 190 * np.abs(normals[triangle] @ LIGHT) / areas[triangle]
    order = np.argsort(points[:, 2], kind="stable")  # the nearest are drawn last
    shades[PIXELS - 1 - rows[order], columns[order]] = brightness[order]
    return shades
