"""A small software rasteriser on numpy: a picture of a mesh without a GPU.

Every triangle's bounding box is expanded to pixels, all at once, and a 64-bit minimum of (depth, triangle) per pixel
keeps the nearest. Good for pictures of some hundred thousand triangles; not a renderer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SUPERSAMPLING = 2  # each pixel of the result is the mean of this many squared
SHADOW_SIZE = 1536  # pixels of the shadow map's side
CANDIDATES = 1 << 20  # pixels looked at in one pass: bounds the memory
NOTHING = np.uint64(0xFFFFFFFFFFFFFFFF)
LIGHT = np.array([-0.45, 0.78, 0.44])
SKY, GROUND, SUN = (
    np.array(rgb) for rgb in ((0.42, 0.46, 0.52), (0.30, 0.28, 0.26), (0.85, 0.82, 0.76))
)


@dataclass(frozen=True)
class Camera:
    """A perspective camera: eye and target [3] in model units, vertical field of view in degrees."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float = 30.0


@dataclass(frozen=True)
class Mesh:
    """What is drawn.

    positions, normals: float [V, 3]; triangles: uint32 [T, 3]; colors: float [T, 3], linear RGB in [0, 1];
    outlines: integer [T], or None; a dark line is drawn where neighbouring pixels differ in it.
    """

    positions: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray
    outlines: np.ndarray | None = None


def render(mesh: Mesh, camera: Camera, width: int, height: int) -> np.ndarray:
    """A picture, uint8 [height, width, 4] (sRGB and coverage), of a mesh lit by a sun with shadow and by the sky."""
    width, height = width * SUPERSAMPLING, height * SUPERSAMPLING
    view = _look_at(np.array(camera.eye), np.array(camera.target))
    eye_space = (mesh.positions - np.array(camera.eye)) @ view.T
    focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    distance = -eye_space[:, 2:]
    # The depth is -1 / distance, because only that is linear over the picture.
    screen = np.concatenate(
        [eye_space[:, :2] * [focal, -focal] / distance + [width / 2, height / 2], -1 / distance], 1
    )
    planes = _planes(screen, mesh.triangles)
    hit = _nearest_triangles(screen, mesh.triangles, planes, width, height)
    pixels = np.flatnonzero(hit >= 0)
    triangle = hit[pixels]
    corners = mesh.triangles[triangle]
    weights = (
        _barycentric(_at(planes[triangle], pixels % width, pixels // width)) / distance[corners, 0]
    )
    weights /= weights.sum(axis=1, keepdims=True)
    normals = _unit(_interpolate(mesh.normals, corners, weights))
    points = _interpolate(mesh.positions, corners, weights)
    shade = _shade(mesh, points, normals, np.array(camera.eye))
    picture = np.zeros((height * width, 4))
    picture[pixels, :3] = np.clip(mesh.colors[triangle] * shade, 0, 1)
    picture[pixels, 3] = 1
    if mesh.outlines is not None:
        picture[_outline(mesh.outlines, hit.reshape(height, width)), :3] *= 0.25
    return _downsampled(picture.reshape(height, width, 4))


def _look_at(eye, target):
    """Rows: the camera's right, up and backward directions."""
    backward = _unit(eye - target)
    right = _unit(np.cross([0.0, 1.0, 0.0], backward))
    return np.stack([right, np.cross(backward, right), backward])


def _planes(screen, triangles):
    """[T, 3, 3]: two barycentric weights and the depth, each as factors of (x, y, 1); edge-on triangles weigh -1."""
    a, b, c = (screen[triangles[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    area = ab[:, 0] * ac[:, 1] - ac[:, 0] * ab[:, 1]
    planes = np.zeros((len(triangles), 3, 3))
    planes[:, 0, 2] = -1
    seen = area != 0
    planes[seen, 0, :2] = np.column_stack([(b - c)[:, 1], (c - b)[:, 0]])[seen] / area[seen, None]
    planes[seen, 1, :2] = np.column_stack([ac[:, 1], -ac[:, 0]])[seen] / area[seen, None]
    planes[seen, :2, 2] = -np.einsum(
        "tik,tk->ti", planes[seen, :2, :2], c[seen, :2]
    )  # both are 0 at corner c
    planes[:, 2] = planes[:, 0] * (a - c)[:, 2:] + planes[:, 1] * (b - c)[:, 2:]
    planes[:, 2, 2] += c[:, 2]
    return planes


def _at(planes, column, row):
    """Planes [n, 3, 3] at the centres of pixels: [n, 3]."""
    return (
        planes[..., 0] * (column + 0.5)[:, None]
        + planes[..., 1] * (row + 0.5)[:, None]
        + planes[..., 2]
    )


def _barycentric(values):
    """The three weights of [n, 3] = (first weight, second weight, depth)."""
    return np.column_stack([values[:, :2], 1 - values[:, 0] - values[:, 1]])


def _nearest_triangles(screen, triangles, planes, width, height):
    """int64 [height * width]: the nearest triangle at each pixel's centre, or -1; screen: [V, 3], depth negative."""
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


def _draw(nearest, planes, low, extent, chosen, width):
    """Lowers nearest, [pixels] of (depth bits, triangle), by the triangles of a slice."""
    count = extent[chosen].prod(axis=1)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, np.repeat(extent[chosen, 0], count))
    column += np.repeat(low[chosen, 0], count)
    row += np.repeat(low[chosen, 1], count)
    values = _at(np.repeat(planes[chosen], count, axis=0), column, row)
    # The small tolerance keeps a pixel centre on a shared edge from falling between its two triangles.
    inside = (
        (values[:, 0] >= -1e-9)
        & (values[:, 1] >= -1e-9)
        & (values[:, 0] + values[:, 1] <= 1 + 1e-9)
    )
    triangle = np.repeat(np.arange(chosen.start, chosen.stop), count)[inside]
    # A negative float's bits grow towards minus infinity, which is the near side: turned round, they sort.
    depth = ~values[inside, 2].astype(np.float32).view(np.uint32)
    key = depth.astype(np.uint64) << np.uint64(32) | triangle.astype(np.uint64)
    np.minimum.at(nearest, row[inside] * width + column[inside], key)


def _interpolate(values, corners, weights):
    return sum(values[corners[:, k]] * weights[:, k : k + 1] for k in range(3))


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _shade(mesh, points, normals, eye):
    """Light that points [n, 3] send to the eye per unit of their colour: [n, 3]."""
    light = _unit(LIGHT)
    sun = np.maximum(normals @ light, 0) * _sunlit(mesh, points, normals, light)
    half = _unit(_unit(eye - points) + light)
    gloss = 0.25 * np.maximum(np.sum(normals * half, axis=1), 0) ** 40 * (sun > 0)
    up = normals[:, 1:2] * 0.5 + 0.5
    return GROUND * (1 - up) + SKY * up + SUN * (sun + gloss)[:, None]


def _sunlit(mesh, points, normals, light):
    """Share of the sun that reaches points [n, 3]: a shadow map, averaged over 3 x 3 of its pixels."""
    axes = _look_at(light, np.zeros(3))
    seen = mesh.positions @ axes.T
    low, scale = seen.min(axis=0), (SHADOW_SIZE - 3) / np.ptp(seen, axis=0)[:2].max()

    def project(at):
        flat = at @ axes.T - low
        return np.column_stack([flat[:, :2] * scale + 1.5, -1 - flat[:, 2]])

    planes = _planes(project(mesh.positions), mesh.triangles)
    hit = _nearest_triangles(
        project(mesh.positions), mesh.triangles, planes, SHADOW_SIZE, SHADOW_SIZE
    )
    pixels = np.flatnonzero(hit >= 0)
    depth = np.full(SHADOW_SIZE * SHADOW_SIZE, np.inf)
    depth[pixels] = _at(planes[hit[pixels]], pixels % SHADOW_SIZE, pixels // SHADOW_SIZE)[:, 2]
    # Points are lifted by two pixels, and compared with as much slack, so that a surface does not shade itself.
    slack = 2 / scale
    at = project(points + normals * slack)
    column, row = at[:, 0].astype(np.int64), at[:, 1].astype(np.int64)
    lit = np.zeros(len(points))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = np.clip(row + dy, 0, SHADOW_SIZE - 1) * SHADOW_SIZE + np.clip(
                column + dx, 0, SHADOW_SIZE - 1
            )
            lit += depth[near] >= at[:, 2] - slack
    return lit / 9


def _outline(labels, hit):
    """Flat indices of the pixels whose right or lower neighbour shows another label."""
    label = np.where(hit >= 0, labels[hit], -1)
    edge = np.zeros(hit.shape, bool)
    edge[:, :-1] |= label[:, 1:] != label[:, :-1]
    edge[:-1] |= label[1:] != label[:-1]
    return np.flatnonzero(edge & (hit >= 0))


def _downsampled(picture):
    """Mean over the samples of each pixel, colours weighted by coverage, and linear light to sRGB."""
    height, width = picture.shape[0] // SUPERSAMPLING, picture.shape[1] // SUPERSAMPLING
    mean = picture.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 4).mean(axis=(1, 3))
    color = mean[..., :3] / np.maximum(mean[..., 3:], 1e-9)
    srgb = np.where(
        color <= 0.0031308, 12.92 * color, 1.055 * np.maximum(color, 1e-9) ** (1 / 2.4) - 0.055
    )
    return np.round(np.concatenate([srgb, mean[..., 3:]], axis=2) * 255).astype(np.uint8)
