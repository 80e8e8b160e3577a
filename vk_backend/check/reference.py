"""Which pictures of a scene are right: its triangles, decoded and rasterised on the CPU."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..gpu.targets import NO_ID
from ..scene.camera import Camera
from ..scene.scene import Scene

# A pixel may show a triangle whose edge is so near to its centre, in pixels: Vulkan demands 4 bits
# of subpixel precision.
EDGE = 1 / 16
DEPTH = 2e-5  # from the last bits of positions
BATCH = 1 << 22  # pairs of a triangle and a pixel at a time
COLOR = 2  # of 255, from rounding


@dataclass(frozen=True)
class Pairs:
    """Triangles at pixels that they may cover.

    pixel: int64[n], its number; instance, number: uint32[n], as in a picture's ids; depth:
    float64[n] at the pixel's centre; slack: float64[n], by which the depth may be off; inside:
    bool[n], the triangle surely covers the centre.
    """

    pixel: np.ndarray
    instance: np.ndarray
    number: np.ndarray
    depth: np.ndarray
    slack: np.ndarray
    inside: np.ndarray


class Reference:
    """The triangles at each pixel of a scene's picture.

    two_sided: backs of triangles are visible, whatever the material says, as for rays.
    """

    def __init__(
        self, scene: Scene, camera: Camera, width: int, height: int, *, two_sided: bool = False
    ):
        self._size = width, height
        parts = [
            part
            for number in range(len(scene.instances))
            for part in _pairs_of(scene, number, camera, width, height, two_sided)
        ]
        fields = ("pixel", "instance", "number", "depth", "slack", "inside")
        self._pairs = Pairs(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))
        # The farthest depth that may be the nearest surface's, at each pixel.
        self._nearest = np.full(width * height, np.inf)
        sure = self._pairs.inside
        np.minimum.at(
            self._nearest,
            self._pairs.pixel[sure],
            (self._pairs.depth + self._pairs.slack)[sure],
        )

    def wrong_pixels(self, depth: np.ndarray, ids: np.ndarray | None) -> int:
        """The number of pixels that show no triangle that may be nearest there.

        depth: float32[height, width]; ids: uint32[height, width, 2]; None: only surfaces count, not
        which triangle they belong to.
        """
        p, shown = self._pairs, depth.ravel().astype(np.float64)
        fits = np.abs(p.depth - shown[p.pixel]) <= p.slack
        fits &= p.depth - p.slack <= self._nearest[p.pixel]
        if ids is not None:
            flat = ids.reshape(-1, 2)
            fits &= (flat[p.pixel] == np.column_stack([p.instance, p.number])).all(axis=1)
        right = np.zeros(len(shown), bool)
        right[p.pixel[fits]] = True
        empty = shown >= 1.0
        if ids is not None:
            empty &= (ids.reshape(-1, 2) == NO_ID).all(axis=1)
        right |= empty & np.isinf(self._nearest)
        return int(np.count_nonzero(~right))

    @property
    def covered(self) -> int:
        """The number of pixels that surely show a surface."""
        return int(np.count_nonzero(np.isfinite(self._nearest)))


def _pairs_of(
    scene: Scene, number: int, camera: Camera, width: int, height: int, two_sided: bool
) -> list[Pairs]:
    """The pairs of an instance."""
    instance = scene.instances[number]
    decoded = scene.primitives[instance.primitive].decoded()
    matrix = camera.world_to_clip(width, height) @ instance.matrix
    points = np.column_stack([decoded.positions, np.ones(len(decoded.positions))]) @ matrix.T
    to_pixels = np.array([width / 2, height / 2])
    points[:, :2] = (points[:, :2] + points[:, 3:]) * to_pixels  # pixel coordinates times w
    corners = points[decoded.triangles]
    ids = decoded.ids()
    # As of homogeneous coordinates: positive if the front is seen. y is down.
    area = np.linalg.det(corners[:, :, [0, 1, 3]])
    if instance.mirrored:
        area = -area
    sides = two_sided or scene.materials[instance.material].double_sided
    kept = (area != 0) if sides else (area < 0)
    corners, ids = corners[kept], ids[kept]
    low, high = _boxes(corners, width, height)
    counts = np.maximum(high - low, 0).prod(axis=1)
    result = []
    ends = np.cumsum(counts)
    begin = 0
    while begin < len(counts):
        before = int(ends[begin - 1]) if begin else 0
        end = max(int(np.searchsorted(ends, before + BATCH)), begin + 1)
        rows = slice(begin, end)
        result.append(
            _covered(corners[rows], ids[rows], low[rows], high[rows], number, (width, height))
        )
        begin = end
    return result


def _boxes(corners: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(first, end), int64[n, 2]: columns and rows of pixels that triangles may cover."""
    size = np.array([width, height])
    w = corners[..., 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        places = corners[..., :2] / w[..., None]
    low = np.floor(places.min(axis=1) - 0.5 - EDGE)
    high = np.floor(places.max(axis=1) - 0.5 + EDGE) + 1
    crossing = (w <= 0).any(axis=1)  # they surround the eye's plane: any pixel
    low[crossing], high[crossing] = 0, size
    behind = (w <= 0).all(axis=1)
    high[behind] = 0
    return np.clip(low, 0, size).astype(np.int64), np.clip(high, 0, size).astype(np.int64)


def _covered(
    corners: np.ndarray,
    ids: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    instance: int,
    size: tuple[int, int],
) -> Pairs:
    """Pairs of triangles and the pixels of their boxes that they may cover.

    By edge functions of homogeneous coordinates (Olano and Greer, Triangle Scan Conversion Using 2D
    Homogeneous Coordinates), which need no clipping.
    """
    spans = np.maximum(high - low, 0)
    counts = spans.prod(axis=1)
    triangle = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(counts) - counts, counts)
    columns = np.maximum(spans[triangle, 0], 1)
    x, y = low[triangle, 0] + place % columns, low[triangle, 1] + place // columns
    edges = np.linalg.inv(corners[:, :, [0, 1, 3]].transpose(0, 2, 1))  # rows: edge functions
    centers = np.column_stack([x + 0.5, y + 0.5, np.ones(len(x))])
    values = np.einsum("nij,nj->ni", edges[triangle], centers)
    lengths = np.linalg.norm(edges[:, :, :2], axis=2)[triangle]
    least = (values / np.maximum(lengths, 1e-300)).min(axis=1)
    planes = np.einsum("nij,ni->nj", edges, corners[..., 2])  # depth is linear in x and y
    depth = (planes[triangle] * centers).sum(axis=1)
    slack = DEPTH + EDGE * np.abs(planes[:, :2]).sum(axis=1)[triangle]
    kept = (least >= -EDGE) & (depth >= -slack) & (depth <= 1 + slack)
    inside = (least >= EDGE) & (depth >= slack) & (depth <= 1 - slack)
    return Pairs(
        (y * size[0] + x)[kept],
        np.full(np.count_nonzero(kept), instance, np.uint32),
        ids[triangle[kept]].astype(np.uint32),
        depth[kept],
        slack[kept],
        inside[kept],
    )


def wrong_colors(
    color: np.ndarray, ids: np.ndarray, other: np.ndarray, other_ids: np.ndarray
) -> tuple[int, int]:
    """(pixels that differ by more than COLOR, pixels compared): those that show one triangle.

    color, other: uint8[height, width, 4]; ids: uint32[height, width, 2].
    """
    same = (ids == other_ids).all(axis=2)
    difference = np.abs(color.astype(int) - other).max(axis=2)
    return int(np.count_nonzero(same & (difference > COLOR))), int(np.count_nonzero(same))
