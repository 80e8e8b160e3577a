"""Small pictures of models for the page of a batch."""

from __future__ import annotations

import functools
import struct
import zlib
from collections.abc import Iterator
from itertools import starmap

import numpy as np

from gltf_ext.attributes.extension import read_compressed, read_triangles
from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.sources.primitives import is_compressed

PIXELS = 64
# Of a scene. Of more, some are left out, so that neither a large model nor one with many instances
# takes much memory or time. Of each primitive at least MIN_TRIANGLES are there.
MAX_TRIANGLES, MAX_PRIMITIVES, MIN_TRIANGLES = 10_000, 500, 20
# Up to so many triangles are filled. Of more, points are drawn, one a triangle and at least
# MIN_SAMPLES: a picture then takes less than a tenth of the time that its model takes.
MAX_FILLED, MIN_SAMPLES = 250, 5000
# Rows: right, up and towards the viewer, who looks down from the front and the right.
VIEW = np.array([[0.82, 0.0, -0.57], [-0.24, 0.91, -0.34], [0.52, 0.41, 0.75]])
LIGHT = np.array([0.3, 0.5, 0.81], np.float32)


def thumbnail(document: Document) -> bytes:
    """Return a PNG of the default scene in grey. Raises MeshletError."""
    instances = list(_instances(document))
    instances = instances[:: 1 + len(instances) // MAX_PRIMITIVES]
    max_triangles = max(MIN_TRIANGLES, MAX_TRIANGLES // max(len(instances), 1))
    keys = dict.fromkeys(key for key, _ in instances)
    triangles_of = {key: _triangles(document, *key, max_triangles) for key in keys}
    corners = [np.empty((3, 0, 3), np.float32)]
    for key, matrix in instances:
        view = (VIEW @ matrix[:3]).astype(np.float32)
        points = triangles_of[key].reshape(-1, 3).T  # as one matrix: 9 times as fast
        corners.append((view[:, :3] @ points + view[:, 3:]).reshape(3, -1, 3))
    return _png(_draw(np.concatenate(corners, axis=1)))


def _png(shades: np.ndarray) -> bytes:
    """Return a PNG of uint8[PIXELS, PIXELS], where 0 is transparent."""
    # Not with PIL, which takes five times longer.
    rows = np.zeros((PIXELS, 1 + PIXELS), np.uint8)  # each starts with its filter, which is none
    rows[:, 1:] = shades
    header = struct.pack(">IIBBBBB", PIXELS, PIXELS, 8, 0, 0, 0, 0)
    chunks = (
        (b"IHDR", header),
        (b"tRNS", b"\0\0"),
        (b"IDAT", zlib.compress(rows.tobytes(), 3)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


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
    """Shades 0 (nothing) to 255, uint8[PIXELS, PIXELS].

    corners: float32[3, T, 3], x, y and z of the corners of triangles, as seen.
    """
    planes = np.ascontiguousarray(corners.transpose(2, 0, 1))  # a tenth of the time afterwards
    (a, b, c), (d, e, f) = planes[1:] - planes[0]
    # np.cross and np.linalg.norm take twice as long.
    normals = np.stack([b * f - c * e, c * d - a * f, a * e - b * d])
    areas = np.sqrt((normals * normals).sum(axis=0))
    visible = (areas > 0) & (areas < np.inf)
    if not visible.all():
        planes, normals, areas = planes[..., visible], normals[:, visible], areas[visible]
    if not len(areas):
        return np.zeros((PIXELS, PIXELS), np.uint8)
    low, high = planes.min(axis=(0, 2)), planes.max(axis=(0, 2))
    scale = (PIXELS - 2) / max((high - low)[:2].max(), 1e-30)
    planes -= ((low + high) / 2)[:, None]
    planes *= (scale * np.array([1, -1, 1], np.float32))[:, None]
    planes[:, :2] += PIXELS / 2
    shades = (60 + 190 * np.abs(LIGHT @ normals) / areas).astype(np.uint8)
    if len(areas) <= MAX_FILLED:
        return _filled(planes, shades)
    return _sampled(planes, shades, areas)


def _filled(planes: np.ndarray, shades: np.ndarray) -> np.ndarray:
    """Return the picture of few triangles, the nearest drawn last.

    planes: float32[3, 3, T], the corners' x, y and z in pixels.
    """
    from PIL import Image, ImageDraw

    order = np.argsort(planes[:, 2].sum(axis=0), kind="stable")
    picture = Image.new("L", (PIXELS, PIXELS))
    draw = ImageDraw.Draw(picture)
    outlines = planes[:, :2].reshape(6, -1).T[order].tolist()
    for outline, shade in zip(outlines, shades[order].tolist()):
        draw.polygon(outline, shade)
    return np.asarray(picture)


def _sampled(planes: np.ndarray, shades: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return the picture of many triangles: of points, spread evenly over them.

    planes: as for few; areas: float32[T].
    """
    count = max(len(areas), MIN_SAMPLES)
    area_sums = np.cumsum(areas, dtype=np.float64)
    ends = np.rint(area_sums * (count / area_sums[-1])).astype(np.intp)  # of each one's points
    triangle = np.repeat(np.arange(len(areas)), np.diff(ends, prepend=0))
    points = np.einsum("cp,cap->ap", _weights(count), planes.take(triangle, axis=2))
    columns, rows = points[:2].astype(np.intp).clip(0, PIXELS - 1)
    depths = points[2] - points[2].min()
    # 16 bits, which are sorted 20 times as fast.
    steps = (depths * (65535 / max(depths.max(), 1e-30))).astype(np.uint16)
    order = np.argsort(steps, kind="stable")  # the nearest are drawn last
    picture = np.zeros((PIXELS, PIXELS), np.uint8)
    picture[rows[order], columns[order]] = shades[triangle[order]]
    for _ in range(2):  # holes that the points leave
        picture = np.where(picture, picture, _medians(picture))
    return _medians(picture)


def _medians(picture: np.ndarray) -> np.ndarray:
    """Return the median of each pixel and its eight neighbours, 0 beyond the border."""
    # A fifth of the time that PIL's filter takes.
    padded = np.pad(picture, 1)
    low, middle, high = _in_order(padded[:-2], padded[1:-1], padded[2:])
    sides = slice(-2), slice(1, -1), slice(2, None)
    lows, middles, highs = ([rows[:, side] for side in sides] for rows in (low, middle, high))
    low, high = functools.reduce(np.maximum, lows), functools.reduce(np.minimum, highs)
    return _in_order(low, _in_order(*middles)[1], high)[1]


def _in_order(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the smallest, the middle and the largest of three, element by element."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    middle = np.minimum(high, c)
    return np.minimum(low, middle), np.maximum(low, middle), np.maximum(high, c)


def _weights(count: int) -> np.ndarray:
    """Return float32[3, count]: of the corners, at points spread evenly over triangles."""
    return _many_weights((count - 1).bit_length())[:, :count]


@functools.cache  # it takes as long as all else of a small picture; there are few counts of bits
def _many_weights(bits: int) -> np.ndarray:
    number = np.arange(1 << bits)
    u, v = (number * step % 1 for step in (0.7548776662466927, 0.5698402909980532))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v)).astype(np.float32)
    return np.stack([1 - u - v, u, v])
