"""Draws the scene of the check in every way, in a process of its own: a driver may crash."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..decode.slots import SlotLayout
from ..raster.stream import StreamDrawing
from ..raytrace.tracer import RayTracer
from ..renderer import Picture, Renderer, cache_bytes
from ..scene.camera import Camera
from ..scene.scene import Scene, load_scene
from ..visibility.batched import BatchedDrawing
from .driver import RAYS
from .slots import wrong_meshlets

CHECKED = 640, 480  # pixels of the picture that is checked
TIMED = 1920, 1080  # of GPUs; software renderers draw a picture like the one that is checked
# Of frames that are timed: enough for a median, but a software renderer takes a second for one.
MOST_FRAMES, LEAST_FRAMES, FRAME_SECONDS, WARM_UP = 15, 3, 1.5, 2


@dataclass(frozen=True)
class Way:
    """A way to draw: a path, and options of Renderer or RayTracer.

    cache: bytes, or a share of all as a float. lod_error: of a file with levels, in pixels.
    """

    path: str
    cache: int | float | None = None
    lod_error: float = 0.0

    @property
    def name(self) -> str:
        """As the options of `gltf-meshlet render`."""
        size = (
            f"{self.cache:.0%}" if isinstance(self.cache, float) else f"{(self.cache or 0) >> 20}M"
        )
        cache = f" --cache {size}" if self.cache is not None else ""
        error = f" --lod-error {self.lod_error:g}" if self.lod_error else ""
        return self.path + cache + error


# Less than REFERENCE's EDGE, so that coarser clusters are where the triangles are.
SMALL_ERROR = 0.02
# The uncompressed draw first: others are compared with it.
WAYS = (
    Way("vertex"),
    Way("visibility"),
    Way("visibility", cache=16 << 20),
    Way("visibility", lod_error=SMALL_ERROR),
    Way("stream"),
    Way("mesh"),
    Way("mesh", lod_error=SMALL_ERROR),
    Way("mesh-paper"),
    Way("mesh-paper", lod_error=SMALL_ERROR),
    Way("geometry"),
    Way(RAYS),
    Way(RAYS, cache=0.3),
)


@dataclass(frozen=True)
class Job:
    """device: its number; compressed, levels: files; timed: pixels of the frames that are timed."""

    device: int
    way: Way
    camera: Camera
    compressed: str
    levels: str
    timed: tuple[int, int]


@dataclass(frozen=True)
class Drawn:
    """What a way drew.

    depth: float32[height, width]; ids, color: as in Picture, or None if they cannot be compared
    (with levels meshlets have other numbers; rays meet shadows). first_seconds: until the first
    picture, compilation included. milliseconds: the median of a frame, frames: their number.
    wrong_meshlets, meshlets: of those that are decoded in memory.
    """

    depth: np.ndarray
    ids: np.ndarray | None
    color: np.ndarray | None
    first_seconds: float
    milliseconds: float
    frames: int
    wrong_meshlets: int = 0
    meshlets: int = 0


def draw(job: Job) -> Drawn:
    """Raises MeshletError, and vk.VkError if the driver refuses something."""
    way = job.way
    scene = load_scene(job.levels if way.lod_error else job.compressed, levels=way.lod_error > 0)
    begin = time.monotonic()
    cache = way.cache
    if isinstance(cache, float):
        cache = cache_bytes(scene, way.path, cache)
    with Renderer(job.device, cache=cache) as renderer:
        if way.path == RAYS:
            return _traced(renderer, scene, job, begin)

        def render(width: int, height: int) -> Picture:
            error = way.lod_error or 1.0
            return renderer.render(scene, job.camera, way.path, width, height, lod_error=error)

        picture = render(*CHECKED)
        seconds = time.monotonic() - begin
        wrong = compared = 0
        if isinstance(renderer.drawing, BatchedDrawing | StreamDrawing):
            wrong, compared = _slot_meshlets(scene, renderer.drawing)
        times = _times(lambda: render(*job.timed).milliseconds)
        return Drawn(
            picture.depth,
            None if way.lod_error else picture.ids,
            None if way.lod_error else picture.color,
            seconds,
            statistics.median(times),
            len(times),
            wrong,
            compared,
        )


def _times(frame: Callable[[], float]) -> list[float]:
    """Milliseconds of frames, the first ones left out."""
    begin, times = time.monotonic(), list[float]()
    while len(times) < LEAST_FRAMES or (
        len(times) < MOST_FRAMES and time.monotonic() - begin < FRAME_SECONDS
    ):
        times.append(frame())
    return times[min(WARM_UP, len(times) - 1) :]


def _slot_meshlets(scene: Scene, drawing: BatchedDrawing | StreamDrawing) -> tuple[int, int]:
    """(wrong, compared) meshlets that the slots hold after a frame."""
    # Those that were culled have no triangles.
    counts = drawing.decoder.summaries() & 255
    held: dict[int, tuple[int, int, int]] = {}
    for batch in drawing.batches:
        for segment in batch.segments:
            primitive = int(scene.instances.primitive[segment.instance])
            for k in range(segment.meshlets):
                slot = int(segment.slot) + k
                held[slot] = slot, primitive, int(segment.first) + k
    decoded = [place for place in held.values() if counts[place[0]]]
    return wrong_meshlets(scene, SlotLayout.of(scene), drawing.decoder.slot_words(), decoded)


def _traced(renderer: Renderer, scene: Scene, job: Job, begin: float) -> Drawn:
    tracer = RayTracer(renderer.device, scene, cache=renderer.cache)
    picture = tracer.render(job.camera, *CHECKED)
    seconds = time.monotonic() - begin
    wrong = compared = 0
    if not tracer.sweeps:
        layout = SlotLayout.of(scene, traced=True)
        places = list(_numbered(scene))
        wrong, compared = wrong_meshlets(scene, layout, tracer.slot_words(), places)
    times = _times(lambda: tracer.time(job.camera, *job.timed))
    depth = depths_of_rays(job.camera, picture.t)
    middle = statistics.median(times)
    return Drawn(depth, picture.ids, None, seconds, middle, len(times), wrong, compared)


def _numbered(scene: Scene) -> Iterator[tuple[int, int, int]]:
    """(number among all meshlets, primitive, meshlet of it)"""
    number = 0
    for index, primitive in enumerate(scene.primitives):
        for meshlet in range(primitive.meshlets):
            yield number, index, meshlet
            number += 1


def depths_of_rays(camera: Camera, t: np.ndarray) -> np.ndarray:
    """float32[height, width]: depths as of rasterised pictures, of distances along rays."""
    height, width = t.shape
    y, x = np.mgrid[0:height, 0:width] + 0.5
    clip = np.stack([2 * x / width - 1, 2 * y / height - 1, 0 * x + 0.5, 0 * x + 1], axis=-1)
    through = clip @ camera.clip_to_world(width, height).T
    direction = through[..., :3] / through[..., 3:] - camera.eye[:3]
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    hit = np.isfinite(t)
    points = np.array(camera.eye[:3]) + direction * np.where(hit, t, 1.0)[..., None]
    placed = np.concatenate([points, np.ones((height, width, 1))], axis=-1)
    placed = placed @ camera.world_to_clip(width, height).T
    return np.where(hit, placed[..., 2] / placed[..., 3], 1.0).astype(np.float32)
