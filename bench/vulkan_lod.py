"""Levels of detail on the GPU: frame time, memory and bytes read in flights over large scenes.

Needs a GPU: python -m bench vulkan_lod. Makes the scenes itself: the dragon with each triangle cut
into n x n and noise, alone or many times in a grid. --keep FOLDER keeps the compressed models for
the next run, --make only makes them. A frame is timed by the GPU, and drawn with the pages that are
there; the flight waits for none. Each scene is flown through twice: as fast as frames come, which
times them, and at --rate frames a second, which shows how late pages are for a viewer. While the
host prepares a frame the GPU fills memory: without work its clock falls to a third. Pictures of
EXACT are compared with full detail: points that pixels show, in either picture, with the surface of
the other.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from bench.common import BITS, progress, table
from bench.large_model import write_displaced
from bench.models import real_model
from gltf_ext.document.accessors import stated_bounds
from gltf_ext.document.container import model_files
from gltf_ext.files import write_files
from gltf_ext.sources.importers import open_model

PACKAGES = ("gltf-meshlet", "numpy", "vulkan")
PARTS = ("scenes", "width", "make", "load", "rate")
MODEL = "dragon"
# (cuts of each edge, triangles of all instances): one instance of 1, 14 and 105 million triangles;
# then 12 instances of each, which look alike, so that only the triangles behind a picture grow;
# then many.
SCENES = (
    *((1, 0), (4, 0), (11, 0)),
    *((1, 10**7), (4, 16 * 10**7), (11, 12 * 10**8)),
    *((4, 10**9), (4, 10**10), (4, 16 * 10**9)),
)
POOL = 128  # MB of compressed pages and decoded clusters
POOLS, POOL_SCENE = (16, 32, 64), (4, 10**9)  # smaller ones, of one scene
PAGES_SHARE = 0.4  # of the pool; the rest is for decoded clusters
LOAD, LOAD_BYTES = 40, 1 << 28  # fills of so many bytes between frames: some milliseconds
EXACT = (1, 0)  # the scene whose full detail is drawn, too
MOMENTS, SAMPLES = 5, 20_000  # of EXACT: pictures, pixels of each
PIXELS = 1.0  # allowed error
SPACING = 1.2  # of instances in the grid, times the model's longest side
WAKE_FRAMES = 20  # before frames are timed: an idle GPU has a low clock
# The flight: (time, direction from the target, its distance). Targets and distances are in the
# radius of the middle instance; of the whole scene where the distance is marked so.
KEYS = (
    (0.0, (1.2, 0.9, 1.6), 2.2, True),
    (0.4, (0.8, 0.4, 1.4), 2.5, False),
    (0.55, (0.2, 0.3, 1.0), 0.9, False),
    (0.7, (-0.8, 0.3, 0.8), 1.1, False),
    (1.0, (-1.0, 0.7, 1.2), 1.8, True),
)


def camera_at(moment: float, low: np.ndarray, high: np.ndarray, size: float):
    """The camera of the flight at a moment from 0 to 1.

    low, high: the scene's box; size: the longest side of its middle instance.
    """
    from vk_backend.scene.camera import Camera

    radius = 0.6 * size
    whole = max(np.linalg.norm(high - low) / 2, radius)
    times = [key[0] for key in KEYS]
    distances = np.log([d * (whole if of_scene else radius) for _, _, d, of_scene in KEYS])
    rays = np.array([np.array(ray) / np.linalg.norm(ray) for _, ray, _, _ in KEYS])
    at = int(np.clip(np.searchsorted(times, moment, "right") - 1, 0, len(KEYS) - 2))
    share = np.clip((moment - times[at]) / (times[at + 1] - times[at]), 0, 1)
    share = share * share * (3 - 2 * share)  # slow at the keys
    ray = rays[at] + share * (rays[at + 1] - rays[at])
    distance = np.exp(distances[at] + share * (distances[at + 1] - distances[at]))
    target = (low + high) / 2
    eye = target + ray / np.linalg.norm(ray) * distance
    return Camera.look_at(eye, target, near=0.01 * radius, far=8 * whole, yfov=0.8)


# --- scenes ---


def model(cuts: int, folder: Path) -> Path:
    """The compressed displaced model, with levels; made unless it is there."""
    path = folder / f"{MODEL}_{cuts}.lod.glb"
    if not path.exists():
        raw = write_displaced(real_model(MODEL), cuts, folder / "raw.glb")
        gltf_ext.compress(raw, path, lod=True, **BITS)
        raw.unlink()
        progress(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB")
    return path


def placed(path: Path, count: int, output: Path) -> Path:
    """Writes a model's file with `count` instances in a square grid, turned differently."""
    document = open_model(path)
    position = document.primitive(0, 0)["attributes"]["POSITION"]
    low, high = stated_bounds(document.accessors[position])
    side = int(np.ceil(np.sqrt(count)))
    step = SPACING * float((high - low).max())
    document.nodes.clear()
    for number in range(count):
        angle = 0.0 if count == 1 else number * 2.4
        turn = [0.0, float(np.sin(angle / 2)), 0.0, float(np.cos(angle / 2))]
        place = step * np.array([number % side - side // 2, 0.0, number // side - side // 2])
        document.nodes.append({"mesh": 0, "translation": place.tolist(), "rotation": turn})
    document.json["scene"], document.scenes[:] = 0, [{"nodes": list(range(count))}]
    write_files(model_files(document, output), input_files=())
    return output


# --- measuring ---


class Load:
    """Work that keeps the GPU's clock up while the host prepares a frame."""

    def __init__(self, device: Any, fills: int):
        from vk_backend.gpu import vk
        from vk_backend.gpu.memory import Buffer

        self._device = device
        self._buffer = Buffer(device, LOAD_BYTES if fills else 4)
        self._commands = device.record()
        for _ in range(fills):
            vk.vkCmdFillBuffer(self._commands, self._buffer.handle, 0, LOAD_BYTES, 0)
        device.full_barrier(self._commands)
        vk.vkEndCommandBuffer(self._commands)

    def begin(self) -> None:
        """Starts the work; the next frame begins after it."""
        from vk_backend.gpu import vk

        buffers = [vk.VkCommandBufferSubmitInfo(commandBuffer=self._commands)]
        info = vk.VkSubmitInfo2(commandBufferInfoCount=1, pCommandBufferInfos=buffers)
        vk.vkQueueSubmit2(self._device.graphics.handle, 1, [info], None)

    def free(self) -> None:
        from vk_backend.gpu import vk

        graphics = self._device.graphics
        vk.vkFreeCommandBuffers(self._device.handle, graphics.pool, 1, [self._commands])
        self._buffer.free()


class Flight:
    """A scene in a pool, drawn frame by frame without copies to the host.

    pool: bytes of compressed pages and decoded clusters. fills: of Load, between frames.
    """

    def __init__(
        self, device: Any, path: Path, pool: int, size: tuple[int, int], occlusion: bool, fills: int
    ):
        from vk_backend.scene.drawing import Options
        from vk_backend.scene.scene import load_scene
        from vk_backend.visibility.pooled import PooledDrawing

        self.width, self.height = size
        self.scene = load_scene(path, levels=True)
        primitive = self.scene.primitives[0]
        self.size = float((primitive.high - primitive.low).max())
        pages = int(PAGES_SHARE * pool)
        options = Options(cache=pool - pages, pages=pages, occlusion=occlusion)
        self.drawing = PooledDrawing(device, self.scene, options)
        self._targets = self.drawing.targets(device, *size, False)
        self._load = Load(device, fills)

    def draw(self, moment: float, wait: bool = False) -> dict[str, Any]:
        """Draws a frame. wait: for the pages that it lacks, for the next one."""
        from vk_backend.frame_commands import FrameCommands

        self._load.begin()
        camera = camera_at(moment, self.scene.low, self.scene.high, self.size)
        self.drawing.look(camera, self.width, self.height, PIXELS)
        frame = FrameCommands(self.drawing, self._targets, steps=True)
        steps = frame.run_steps()
        frame.free()
        finished = self.drawing.finish(wait)
        return {
            "milliseconds": sum(steps.values()),
            "steps": steps,
            "is_finished": finished,
            **asdict(self.drawing.statistics),
        }

    def settle(self) -> None:
        """Draws the first view until nothing is missing, then some more, to wake the GPU."""
        while not self.draw(0.0, wait=True)["is_finished"]:
            pass
        for _ in range(WAKE_FRAMES):
            self.draw(0.0)

    def free(self) -> None:
        self.drawing.free()
        self._targets.free()
        self._load.free()


def measure_flight(
    device: Any, path: Path, pool: int, occlusion: bool, options: argparse.Namespace
) -> dict:
    """Figures of a flight."""
    size = options.width, options.height
    warm = Flight(device, path, pool, size, occlusion, options.load)  # compiles the pipelines
    warm.draw(0.0)
    warm.free()
    began = time.perf_counter()
    flight = Flight(device, path, pool, size, occlusion, options.load)
    flight.draw(0.0)
    first_seconds = time.perf_counter() - began
    flight.settle()
    complete_seconds = time.perf_counter() - began
    free = flown(flight, options.frames, 0.0)
    result = {
        "triangles": flight.scene.triangles,
        "instances": len(flight.scene.instances),
        "unique_triangles": sum(p.triangles for p in flight.scene.primitives),
        "file_bytes": path.stat().st_size,
        "pool": pool,
        "occlusion": occlusion,
        "device_bytes": flight.drawing.resident_bytes,
        "first_seconds": first_seconds,
        "complete_seconds": complete_seconds,
        "frames": summarised(free),
    }
    flight.free()
    # Anew: the pool holds nearly all pages of the first flight.
    flight = Flight(device, path, pool, size, occlusion, options.load)
    flight.settle()
    result["paced"] = summarised(flown(flight, options.frames, options.rate))
    flight.free()
    return result


def flown(flight: Flight, count: int, rate: float) -> list[dict[str, Any]]:
    """The frames of a flight. rate: frames a second; 0: as fast as they come."""
    frames: list[dict[str, Any]] = []
    begin = time.perf_counter()
    for number in range(count):
        frames.append(flight.draw(number / (count - 1)))
        due = begin + (number + 1) / rate if rate else 0.0
        time.sleep(max(0.0, due - time.perf_counter()))
    return frames


def compared(renderer: Any, path: Path, options: argparse.Namespace) -> dict:
    """Shares of the sampled pixels of a scene of one instance that are within one pixel."""
    from gltf_ext.checks.samples import distances_to
    from gltf_ext.lod.cuts import Cut
    from vk_backend.scene.scene import load_scene

    size, none = (options.width, options.height), np.zeros(0, bool)
    flown, whole = load_scene(path, levels=True), load_scene(path)
    random, extent = np.random.default_rng(1), float((whole.high - whole.low).max())
    cameras = [camera_at(t, whole.low, whole.high, extent) for t in np.linspace(0.0, 1.0, MOMENTS)]
    shares = []
    full = [renderer.render(whole, camera, "visibility", *size) for camera in cameras]
    for camera, exact in zip(cameras, full):
        picture = renderer.render(flown, camera, "visibility", *size, lod_error=PIXELS)
        chosen = renderer.drawing.jobs.jobs()["number"]
        primitive = renderer.drawing.levels.hierarchies.primitives[0]
        drawn = np.zeros(len(primitive.tables.cluster_group), bool)
        drawn[chosen] = True
        pages = np.unique(primitive.tables.groups["page"][primitive.tables.cluster_group[drawn]])
        shown = primitive.mesh(Cut(none, drawn, pages, pages))
        for one, other in ((picture, primitive.compressed.decode()), (exact, shown)):
            points, pixel = sampled_points(one, camera, random)
            distances = distances_to(points, other)
            shares.append(float((distances <= pixel).mean()))
    return {
        "pictures": len(shares),
        "least_share": min(shares),
        "mean_share": float(np.mean(shares)),
    }


def sampled_points(picture: Any, camera: Any, random: Any) -> tuple[np.ndarray, np.ndarray]:
    """(float32[n, 3] points that pixels show, float64[n] size of a pixel there)"""
    height, width = picture.depth.shape
    covered = np.argwhere(picture.covered)
    row, column = covered[random.integers(0, len(covered), min(SAMPLES, len(covered)))].T
    ndc = np.stack([(column + 0.5) / width, (row + 0.5) / height], axis=1) * 2 - 1
    clip = np.column_stack([ndc, picture.depth[row, column], np.ones(len(ndc))])
    points = clip @ camera.clip_to_world(width, height).T
    points = points[:, :3] / points[:, 3:]
    away = np.linalg.norm(points - camera.to_world[:3, 3], axis=1)
    return points.astype(np.float32), away / camera.pixels_per_unit(width, height)


def summarised(frames: list[dict]) -> dict:
    """The figures of a flight's frames that the tables show."""
    columns = {name: [frame[name] for frame in frames] for name in frames[0]}
    times, allowed = columns["milliseconds"], np.array(columns["allowed_pixels"])
    shown = np.array(columns["shown_pixels"])
    return {
        "count": len(frames),
        "median": float(np.median(times)),
        "percentile_99": float(np.percentile(times, 99)),
        "steps": {s: float(np.median([f["steps"][s] for f in frames])) for s in frames[0]["steps"]},
        "triangles": float(np.median(columns["triangles"])),
        "most_triangles": int(np.max(columns["triangles"])),
        "clusters": float(np.median(columns["clusters"])),
        "decoded": float(np.median(columns["decoded"])),
        "hidden": float(np.median(columns["hidden"])),
        "read_bytes": int(np.sum(columns["read_bytes"])),
        "share_at_error": float((allowed <= np.float32(PIXELS)).mean()),
        "worst_allowed": float(allowed.max()),
        "share_shown": float((shown <= np.float32(PIXELS)).mean()),
        "worst_shown": float(shown.max()),
        "share_complete": float((np.array(columns["missing_pages"]) == 0).mean()),
    }


def measure(options: argparse.Namespace) -> dict:
    """All scenes, and one of them in pools of several sizes."""
    from vk_backend.renderer import Renderer

    rows = []
    with tempfile.TemporaryDirectory() as temporary, Renderer(options.device) as renderer:
        folder = options.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        device = {"name": renderer.device.name, "driver": renderer.device.driver}
        sources = {cuts: model(cuts, folder) for cuts, _ in options.scenes}
        wanted = [(scene, POOL, True) for scene in options.scenes] if not options.make else []
        if wanted and POOL_SCENE in options.scenes:
            wanted += [(POOL_SCENE, pool, True) for pool in POOLS] + [(POOL_SCENE, POOL, False)]
        for (cuts, total), pool, occlusion in wanted:
            own = gltf_ext.inspect(sources[cuts])["totals"]["triangles"]
            path = placed(sources[cuts], max(1, -(-total // own)), Path(temporary) / "scene.glb")
            row = measure_flight(renderer.device, path, pool * 10**6, occlusion, options)
            if (cuts, total) == EXACT:
                row["exact"] = compared(renderer, path, options)
            rows.append(row)
            progress(f"{row['triangles'] / 1e6:,.0f} M triangles, pool of {pool} MB")
    return {
        "device": device,
        "width": options.width,
        "height": options.height,
        "pixels": PIXELS,
        "rate": options.rate,
        "rows": rows,
    }


def summary(result: dict) -> str:
    """Tables of the flights, and of the steps of a frame."""
    if not result["rows"]:
        return "the models are made"
    flights = {
        "triangles": lambda row: f"{row['triangles'] / 1e6:,.0f} M",
        "instances": lambda row: f"{row['instances']:,}",
        "file": lambda row: f"{row['file_bytes'] / 1e6:.0f} MB",
        "pool": lambda row: f"{row['pool'] / 1e6:.0f} MB",
        "on the device": lambda row: f"{row['device_bytes'] / 1e6:.0f} MB",
        "ms, median": lambda row: f"{row['frames']['median']:.2f}",
        "99 %": lambda row: f"{row['frames']['percentile_99']:.2f}",
        "triangles drawn": lambda row: f"{row['frames']['triangles'] / 1e6:.2f} M",
        "clusters": lambda row: f"{row['frames']['clusters']:,.0f}",
        "hidden": lambda row: f"{row['frames']['hidden']:,.0f}" if row["occlusion"] else "off",
        "decoded in a frame": lambda row: f"{row['frames']['decoded']:,.0f}",
        "read": lambda row: f"{row['frames']['read_bytes'] / 1e6:.1f} MB",
        "frames at one pixel": lambda row: f"{100 * row['frames']['share_at_error']:.0f} %",
        "worst allowed": lambda row: f"{row['frames']['worst_allowed']:.2f} px",
        "without missing pages": lambda row: f"{100 * row['frames']['share_complete']:.0f} %",
        "first picture": lambda row: f"{1000 * row['first_seconds']:.0f} ms",
        "nothing missing": lambda row: f"{1000 * row['complete_seconds']:.0f} ms",
    }
    if "paced" in result["rows"][0]:  # older results lack it
        rate = f"{result['rate']:g} Hz"
        flights |= {
            "show one pixel": lambda row: f"{100 * row['frames']['share_shown']:.1f} %",
            "worst shown": lambda row: f"{row['frames']['worst_shown']:.2f} px",
            f"show one pixel at {rate}": lambda row: f"{100 * row['paced']['share_shown']:.1f} %",
            f"worst shown at {rate}": lambda row: f"{row['paced']['worst_shown']:.2f} px",
        }
    flights["pixels within one of full detail"] = lambda row: (
        f"{100 * row['exact']['least_share']:.2f} %" if "exact" in row else ""
    )
    names = list(result["rows"][0]["frames"]["steps"])
    steps = {"triangles": flights["triangles"], "pool": flights["pool"]}
    for name in names:  # without occlusion culling there is one step less
        steps[name] = lambda row, n=name: f"{row['frames']['steps'].get(n, 0):.3f}"
    return table(result["rows"], flights) + "\n" + table(result["rows"], steps)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of this question."""

    def scene(text: str) -> tuple[int, int]:
        cuts, _, total = text.partition(":")
        return int(cuts), int(float(total or 0))

    parser.add_argument(
        "--scenes",
        nargs="+",
        type=scene,
        default=SCENES,
        metavar="N[:TRIANGLES]",
        help="each triangle in N x N, in a grid of so many triangles (default: all)",
    )
    parser.add_argument("--device", metavar="DEVICE", help="number, or a part of the name")
    parser.add_argument("--frames", type=int, default=300, metavar="N", help="of a flight")
    parser.add_argument(
        "--rate",
        type=float,
        default=60.0,
        metavar="N",
        help="frames a second of the second flight; the first draws as fast as it can",
    )
    parser.add_argument("--width", type=int, default=1920, metavar="N", help="pixels")
    parser.add_argument("--height", type=int, default=1080, metavar="N", help="pixels")
    parser.add_argument(
        "--load", type=int, default=LOAD, metavar="N", help="fills of memory between frames"
    )
    parser.add_argument("--make", action="store_true", help="only make the models, for --keep")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="for the compressed models")
