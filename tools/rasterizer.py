"""A small software rasteriser on numpy, for pictures of the documentation on any machine.

Expands the bounding boxes of many triangles to pixels at once; a 64-bit minimum of (depth,
triangle) per pixel keeps the nearest triangle. Fast enough for some hundred thousand triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SUPERSAMPLING = 2  # samples per pixel and axis
SHADOW_SIZE = 1536  # pixels along a side of the shadow map
CANDIDATES = 1 << 20  # pixels tested in one pass: bounds the memory
NOTHING = np.uint64(0xFFFFFFFFFFFFFFFF)
LIGHT = np.array([-0.45, 0.78, 0.44])  # towards the sun
# Radiance, linear RGB.
SKY = np.array([0.42, 0.46, 0.52])
GROUND = np.array([0.30, 0.28, 0.26])
SUN = np.array([0.85, 0.82, 0.76])


@dataclass(frozen=True)
class Camera:
    """A perspective camera. eye, target: in model units; field_of_view: vertical, in degrees."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float = 30.0


@dataclass(frozen=True)
class Mesh:
    """The mesh to draw.

    Attributes:
        positions, normals: float[V, 3].
        triangles: uint32[T, 3].
        colors: float[T, 3], linear RGB in [0, 1].
        outlines: integer[T] or None; a dark line separates pixels with different integers.
    """

    positions: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray
    outlines: np.ndarray | None = None


@dataclass(frozen=True)
class Surface:
    """What the pixels of a picture show.

    Attributes:
        pixels: int64[n]: those that show a triangle, numbered row by row.
        triangles: int64[n]; corners: [n, 3] of these; weights: float[n, 3] of the corners.
    """

    pixels: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    weights: np.ndarray

    def interpolate(self, values: np.ndarray) -> np.ndarray:
        """Values of vertices, [V, k], at the pixels: [n, k]."""
        terms = [values[self.corners[:, k]] * self.weights[:, k : k + 1] for k in range(3)]
        total: np.ndarray = terms[0] + terms[1] + terms[2]
        return total


def rasterize(mesh: Mesh, camera: Camera, width: int, height: int) -> np.ndarray:
    """A picture of a mesh lit by the sky and by a sun that casts shadows.

    Returns uint8[height, width, 4]: sRGB and coverage.
    """
    width, height = width * SUPERSAMPLING, height * SUPERSAMPLING
    surface = visible_surface(mesh.positions, mesh.triangles, camera, width, height)
    normals = _unit(surface.interpolate(mesh.normals))
    points = surface.interpolate(mesh.positions)
    shade = _shade(mesh, points, normals, np.array(camera.eye))
    picture = np.zeros((height * width, 4))
    picture[surface.pixels, :3] = np.clip(mesh.colors[surface.triangles] * shade, 0, 1)
    picture[surface.pixels, 3] = 1
    if mesh.outlines is not None:
        hit = np.full(height * width, -1)
        hit[surface.pixels] = surface.triangles
        picture[_outline(mesh.outlines, hit.reshape(height, width)), :3] *= 0.25
    return _downsampled(picture.reshape(height, width, 4))


def visible_surface(
    positions: np.ndarray, triangles: np.ndarray, camera: Camera, width: int, height: int
) -> Surface:
    """The nearest triangle at each pixel's centre. positions: float[V, 3]; triangles: [T, 3]."""
    view = _look_at(np.array(camera.eye), np.array(camera.target))
    eye_space = (positions - np.array(camera.eye)) @ view.T
    focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    distance = -eye_space[:, 2:]
    # The depth is -1 / distance: linear over the picture.
    screen = np.concatenate(
        [eye_space[:, :2] * [focal, -focal] / distance + [width / 2, height / 2], -1 / distance], 1
    )
    planes = _planes(screen, triangles)
    hit = _nearest_triangles(screen, triangles, planes, width, height)
    pixels = np.flatnonzero(hit >= 0)
    corners = triangles[hit[pixels]]
    weights = (
        _barycentric(_at(planes[hit[pixels]], pixels % width, pixels // width))
        / distance[corners, 0]
    )
    weights /= weights.sum(axis=1, keepdims=True)
    return Surface(pixels, hit[pixels], corners, weights)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """The vectors [..., 3], none of them zero, with length 1."""
    result: np.ndarray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def _look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Rows: the camera's right, up and backward directions."""
    backward = _unit(eye - target)
    right = _unit(np.cross([0.0, 1.0, 0.0], backward))
    return np.stack([right, np.cross(backward, right), backward])


def _planes(screen: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """[T, 3, 3]: two barycentric weights and the depth, each as factors of (x, y, 1).

    The weights of a triangle seen edge-on are -1.
    """
    a, b, c = (screen[triangles[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    area = ab[:, 0] * ac[:, 1] - ac[:, 0] * ab[:, 1]
    planes = np.zeros((len(triangles), 3, 3))
    planes[:, 0, 2] = -1
    seen = area != 0
    planes[seen, 0, :2] = np.column_stack([(b - c)[:, 1], (c - b)[:, 0]])[seen] / area[seen, None]
    planes[seen, 1, :2] = np.column_stack([ac[:, 1], -ac[:, 0]])[seen] / area[seen, None]
    # Both weights are 0 at corner c.
    planes[seen, :2, 2] = -np.einsum("tik,tk->ti", planes[seen, :2, :2], c[seen, :2])
    planes[:, 2] = planes[:, 0] * (a - c)[:, 2:] + planes[:, 1] * (b - c)[:, 2:]
    planes[:, 2, 2] += c[:, 2]
    return planes


def _at(planes: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """The values [n, 3] of planes [n, 3, 3] at the centres of pixels."""
    values: np.ndarray = (
        planes[..., 0] * (column + 0.5)[:, None]
        + planes[..., 1] * (row + 0.5)[:, None]
        + planes[..., 2]
    )
    return values


def _barycentric(values: np.ndarray) -> np.ndarray:
    """All three weights [n, 3] from (first weight, second weight, depth) [n, 3]."""
    return np.column_stack([values[:, :2], 1 - values[:, 0] - values[:, 1]])


def _nearest_triangles(
    screen: np.ndarray, triangles: np.ndarray, planes: np.ndarray, width: int, height: int
) -> np.ndarray:
    """int64[height * width]: the nearest triangle at each pixel's centre, or -1.

    screen: [V, 3], column, row and depth, which is negative.
    """
    corners = screen[triangles, :2]
    low = np.clip(np.ceil(corners.min(axis=1) - 0.5), 0, [width, height]).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1) + 0.5), 0, [width, height]).astype(np.int64)
    extent = np.maximum(high - low, 0)
    ends = np.cumsum(extent.prod(axis=1))
    nearest = np.full(width * height, NOTHING)
    first = 0
    while first < len(triangles):
        before = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, before + CANDIDATES, side="right")))
        _draw(nearest, planes, low, extent, slice(first, last), width)
        first = last
    return np.where(nearest != NOTHING, (nearest & np.uint64(0xFFFFFFFF)).astype(np.int64), -1)


def _draw(
    nearest: np.ndarray,
    planes: np.ndarray,
    low: np.ndarray,
    extent: np.ndarray,
    chosen: slice,
    width: int,
) -> None:
    """Draws a slice of the triangles into nearest, [pixels] of (depth bits, triangle).

    low, extent: [T, 2], the bounding boxes in pixels.
    """
    count = extent[chosen].prod(axis=1)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, np.repeat(extent[chosen, 0], count))
    column += np.repeat(low[chosen, 0], count)
    row += np.repeat(low[chosen, 1], count)
    values = _at(np.repeat(planes[chosen], count, axis=0), column, row)
    # The tolerance gives a pixel centre on a shared edge to at least one of the two triangles.
    inside = (
        (values[:, 0] >= -1e-9)
        & (values[:, 1] >= -1e-9)
        & (values[:, 0] + values[:, 1] <= 1 + 1e-9)
    )
    triangle = np.repeat(np.arange(chosen.start, chosen.stop), count)[inside]
    # The bits of negative floats grow towards minus infinity, the near side: ~ sorts near first.
    depth = ~values[inside, 2].astype(np.float32).view(np.uint32)
    key = depth.astype(np.uint64) << np.uint64(32) | triangle.astype(np.uint64)
    np.minimum.at(nearest, row[inside] * width + column[inside], key)


def _shade(mesh: Mesh, points: np.ndarray, normals: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Light [n, 3] that points [n, 3] send to the eye per unit of their colour."""
    light = _unit(LIGHT)
    sun = np.maximum(normals @ light, 0) * _sunlit(mesh, points, normals, light)
    half = _unit(_unit(eye - points) + light)
    gloss = 0.25 * np.maximum(np.sum(normals * half, axis=1), 0) ** 40 * (sun > 0)
    up = normals[:, 1:2] * 0.5 + 0.5
    light_out: np.ndarray = GROUND * (1 - up) + SKY * up + SUN * (sun + gloss)[:, None]
    return light_out


def _sunlit(mesh: Mesh, points: np.ndarray, normals: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Share [n] of the sun that reaches points [n, 3]: a shadow map, filtered over 3 x 3 pixels."""
    axes = _look_at(light, np.zeros(3))
    seen = mesh.positions @ axes.T
    low, scale = seen.min(axis=0), (SHADOW_SIZE - 3) / np.ptp(seen, axis=0)[:2].max()

    def project(at: np.ndarray) -> np.ndarray:
        flat = at @ axes.T - low
        return np.column_stack([flat[:, :2] * scale + 1.5, -1 - flat[:, 2]])

    planes = _planes(project(mesh.positions), mesh.triangles)
    hit = _nearest_triangles(
        project(mesh.positions), mesh.triangles, planes, SHADOW_SIZE, SHADOW_SIZE
    )
    pixels = np.flatnonzero(hit >= 0)
    depth = np.full(SHADOW_SIZE * SHADOW_SIZE, np.inf)
    depth[pixels] = _at(planes[hit[pixels]], pixels % SHADOW_SIZE, pixels // SHADOW_SIZE)[:, 2]
    # Offset the points by two pixels along the normal to avoid self-shadowing.
    slack = 2 / scale
    at = project(points + normals * slack)
    column, row = at[:, 0].astype(np.int64), at[:, 1].astype(np.int64)
    lit = np.zeros(len(points))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near_row = np.clip(row + dy, 0, SHADOW_SIZE - 1)
            near = near_row * SHADOW_SIZE + np.clip(column + dx, 0, SHADOW_SIZE - 1)
            lit += depth[near] >= at[:, 2] - slack
    return lit / 9


def _outline(labels: np.ndarray, hit: np.ndarray) -> np.ndarray:
    """Flat indices of the pixels whose right or lower neighbour has another label."""
    label = np.where(hit >= 0, labels[hit], -1)
    edge = np.zeros(hit.shape, bool)
    edge[:, :-1] |= label[:, 1:] != label[:, :-1]
    edge[:-1] |= label[1:] != label[:-1]
    return np.flatnonzero(edge & (hit >= 0))


def _downsampled(picture: np.ndarray) -> np.ndarray:
    """Averages the samples of each pixel, weighted by coverage, and converts to sRGB."""
    height, width = picture.shape[0] // SUPERSAMPLING, picture.shape[1] // SUPERSAMPLING
    mean = picture.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 4).mean(axis=(1, 3))
    color = mean[..., :3] / np.maximum(mean[..., 3:], 1e-9)
    srgb = np.where(
        color <= 0.0031308, 12.92 * color, 1.055 * np.maximum(color, 1e-9) ** (1 / 2.4) - 0.055
    )
    rounded: np.ndarray = np.round(np.concatenate([srgb, mean[..., 3:]], axis=2) * 255)
    return rounded.astype(np.uint8)
