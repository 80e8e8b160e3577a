"""Small pictures of models for the page of a batch, drawn with numpy."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from gltf_ext.compression.extension import read_triangles
from gltf_ext.gltf.document import TRIANGLE_MODES, item
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.nodes import placed

PIXELS = 96
SAMPLES = 12 * PIXELS * PIXELS  # on all surfaces: more than one for nearly every pixel
MOST_TRIANGLES = 100_000  # of a primitive; of a larger one, some are left out
# Rows: right, up and towards the viewer, who looks down from the front and the right.
VIEW = np.array([[0.82, 0.0, -0.57], [-0.24, 0.91, -0.34], [0.52, 0.41, 0.75]])
LIGHT = np.array([0.3, 0.5, 0.81])


def thumbnail(path: Path) -> bytes:
    """A PNG of the default scene in grey. Raises MeshletError."""
    from PIL import Image

    document = open_model(path)
    corners = [np.empty((0, 3, 3))]
    for node, matrix in placed(document):
        primitives = (
            [] if node.mesh is None else item(document.meshes, node.mesh, "mesh").primitives
        )
        for index, source in enumerate(primitives):
            if source.mode not in TRIANGLE_MODES:
                continue
            primitive, _ = read_triangles(document, node.mesh, index)
            triangles = primitive.indices[:: 1 + len(primitive.indices) // MOST_TRIANGLES]
            positions = primitive.attributes["POSITION"][triangles]
            corners.append(positions @ matrix[:3, :3].T + matrix[:3, 3])
    shades = _draw(np.concatenate(corners) @ VIEW.T)
    png = io.BytesIO()
    Image.fromarray(np.stack([shades, np.where(shades, 255, 0)], axis=-1).astype(np.uint8)).save(
        png, "PNG"
    )
    return png.getvalue()


def _draw(corners: np.ndarray) -> np.ndarray:
    """Shades 0 (nothing) to 255, float64[PIXELS, PIXELS]. corners: float64[T, 3, 3] as seen."""
    shades = np.zeros((PIXELS, PIXELS))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    covered = np.cumsum(areas)
    if not len(covered) or not 0 < covered[-1] < np.inf:
        return shades
    number = np.arange(SAMPLES)
    chosen = np.searchsorted(covered, (number + 0.5) / SAMPLES * covered[-1])
    u, v = number * 0.7548776662466927 % 1, number * 0.5698402909980532 % 1  # evenly spread
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corners[chosen].transpose(1, 0, 2)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    scale = (PIXELS - 2) / max((high - low)[:2].max(), 1e-30)
    places = ((points - (low + high) / 2) * scale)[:, :2] + PIXELS / 2
    columns, rows = places.astype(int).clip(0, PIXELS - 1).T
    brightness = 60 + 190 * np.abs(normals[chosen] @ LIGHT) / areas[chosen]
    order = np.argsort(points[:, 2], kind="stable")  # the nearest are drawn last
    shades[PIXELS - 1 - rows[order], columns[order]] = brightness[order]
    return shades
