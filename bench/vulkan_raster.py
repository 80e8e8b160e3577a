"""Drawing on the GPU: frame time and memory of all paths, beside the same model uncompressed.

Needs a GPU and the names of models: python -m bench vulkan_raster MODEL.glb ... Writes
docs/vulkan-raster.png.

The pictures are those of `gltf-meshlet render`: lit, with culling. The whole model is in view. A
frame's time is the GPU's own, from clearing and decoding to the last pixel; all paths take turns
frame by frame. The fast paths also draw while the camera turns, and VIEWS, other cameras and sizes,
with two generated models: `layers` for overdraw, `ground` for a plane that fills the picture.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

import gltf_ext
from bench import peers
from bench.common import (
    BITS,
    megabytes,
    milliseconds,
    percentiles,
    pixels,
    progress,
    pyplot,
    read_result,
    save_figure,
    table_by_model,
)
from bench.generated import vertex_normals
from bench.models import add_gpu_options, check_model_files, model_files
from bench.vulkan_raytracing import turntable
from gltf_ext.errors import MeshletError
from gltf_ext.sources.primitives import Primitive

PACKAGES = ("numpy", "vulkan")
FAST = ("vertex", "stream", "visibility", "visibility-pool")
PATHS = (*FAST, "mesh-plain", "mesh", "mesh-paper", "geometry")
POOL_SHARE = 0.9  # of the bytes of uncompressed vertices and indices, for visibility-pool
LEAST_POOL = 100_000  # bytes: a few slots, for generated models
TURN = 1.0  # degrees a frame
WIDTH, HEIGHT = 1920, 1080
LARGE = 3840, 2160
WARM_UP, FRAMES = 5, 40
WAKE_SECONDS = 0.3  # of drawing before frames are timed: an idle GPU has a low clock
ROUNDING = 2  # difference of colours that counts as equal, of 255
TIES = 1e-3  # share of pixels that may differ: triangles at the same depth


# --- cameras and models ---


def fit_camera(scene, width: int, height: int):
    """The whole scene."""
    from vk_backend.scene.camera import Camera

    return Camera.fit_box(scene.low, scene.high, width, height)


def close_camera(scene, width: int, height: int):
    """From the middle of the scene's box."""
    from vk_backend.scene.camera import Camera

    middle, radius = (scene.low + scene.high) / 2, np.linalg.norm(scene.high - scene.low) / 2
    target = middle + radius * np.array([0.1, 0.05, -1.0])
    return Camera.look_at(middle, target, near=1e-3 * radius, far=4 * radius, yfov=1.2)


# Name -> (camera, size in pixels) of frames besides the usual ones.
VIEWS = {
    "3840 x 2160": (fit_camera, LARGE),
    "from inside": (close_camera, (WIDTH, HEIGHT)),
    "from inside, 3840 x 2160": (close_camera, LARGE),
}
MODEL_VIEWS = ("3840 x 2160", "from inside")
SQUARES_VIEWS = ("from inside", "from inside, 3840 x 2160")


SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def layers(folder: Path) -> Path:
    """A compressed model of squares one behind the other; from inside, 7 fill the picture."""
    places = [z for z in range(-7, 8) if z]
    return _squares([[x, y, z] for z in places for x, y in 40 * SQUARE], folder / "layers.glb")


def ground(folder: Path) -> Path:
    """A compressed model of a floor and a ceiling; from inside, they fill the picture."""
    corners = [[x, y, z] for y, order in ((-1, 1), (1, -1)) for z, x in 500 * SQUARE[::order]]
    return _squares(corners, folder / "ground.glb")


def _squares(places: list, output: Path) -> Path:
    """Writes a compressed model of squares with these corners."""
    corners = np.array(places, np.float64)
    triangles = (np.arange(0, len(corners), 4)[:, None] + [[0, 1, 2, 0, 2, 3]]).reshape(-1, 3)
    attributes = {"POSITION": corners, "NORMAL": vertex_normals(corners, triangles)}
    raw = output.with_name("raw.glb")
    peers.write_primitives([Primitive(0, 0, triangles, attributes)], raw)
    gltf_ext.compress(raw, output, **BITS)
    return output


# --- measuring ---


def check_pictures(drawings: dict) -> None:
    """Ends the program if a path draws another picture than the first one."""
    pictures = {}
    for name, drawing in drawings.items():
        drawing.run()
        pictures[name] = drawing.targets.color.read(np.uint8, 4).astype(np.int16)
    first, reference = next(iter(pictures.items()))
    for name, picture in pictures.items():
        different = (np.abs(picture - reference) > ROUNDING).any(axis=2).mean()
        if different > TIES:
            text = (
                f"{name} draws another picture than {first}: {different:.1%} of the pixels differ"
            )
            raise SystemExit(f"bench: {text}")


def measure(options: argparse.Namespace) -> dict:
    """All models, then the other views."""
    from vk_backend.renderer import Renderer

    rows: list[dict] = []
    views: list[dict] = []
    with tempfile.TemporaryDirectory() as folder, Renderer(options.device) as renderer:
        device = {"name": renderer.device.name, "driver": renderer.device.driver}
        files = model_files(options, Path(folder))
        progress(f"{device['name']}, driver {device['driver']}; models are ready")
        for path in files:
            rows += measure_model(renderer, path, PATHS, (fit_camera, (WIDTH, HEIGHT)))
            progress(path.stem)
        squares = [layers(Path(folder)), ground(Path(folder))]
        for path in [*files, *squares]:
            for name in SQUARES_VIEWS if path in squares else MODEL_VIEWS:
                found = measure_model(renderer, path, FAST, VIEWS[name])
                views += [{"view": name, **row} for row in found]
            progress(f"{path.stem}, other views")
    old = read_result("vulkan_raster") if options.add else None
    if old and old["device"]["name"] == device["name"]:
        new = {row["model"] for row in views}
        rows = [row for row in old["rows"] if row["model"] not in new] + rows
        views = [row for row in old["views"] if row["model"] not in new] + views
    size = {"width": WIDTH, "height": HEIGHT, "frames": FRAMES}
    return {"device": device, **size, "rows": rows, "views": views}


def raw_bytes(scene) -> int:
    """Of uncompressed vertices and indices, of each primitive once."""
    return sum(4 * scene.vertex_floats * p.vertices + 12 * p.triangles for p in scene.primitives)


def measure_model(renderer, path: Path, paths: tuple[str, ...], view: tuple) -> list[dict]:
    """A row for each of `paths` that the device supports. view: a value of VIEWS."""
    from bench.vulkan_paths import POOLED, TimedDrawing
    from vk_backend.raster.mesh import MeshDrawing
    from vk_backend.raster.stream import StreamDrawing
    from vk_backend.scene.scene import load_scene
    from vk_backend.visibility.batched import BatchedDrawing

    scene = load_scene(path)
    camera, size = view
    pool = max(int(POOL_SHARE * raw_bytes(scene)), LEAST_POOL)
    drawings: dict[str, TimedDrawing] = {}
    for name in paths:
        try:
            cache = pool if name == POOLED else None
            drawings[name] = TimedDrawing(
                renderer.device, scene, camera(scene, *size), name, *size, cache=cache
            )
        except MeshletError as error:
            progress(f"  skips {name}: {error}")
    check_pictures(drawings)
    times = frame_times(drawings)
    turning: dict[str, list[float]] = {}
    if camera is fit_camera:
        moving = {name: drawing for name, drawing in drawings.items() if name in FAST}
        cameras = [turntable(scene, *size, TURN * n) for n in range(WARM_UP + FRAMES)]
        turning = frame_times(moving, cameras)
    facts = {
        "model": path.stem,
        "triangles": scene.triangles,
        "meshlets": sum(scene.primitives[i.primitive].meshlets for i in scene.instances),
        "compressed_bytes": scene.compressed_bytes,
    }
    rows = []
    for name, drawing in drawings.items():
        row = {**facts, "path": name, "milliseconds": percentiles(times[name])}
        row["resident_bytes"] = drawing.drawing.resident_bytes
        if isinstance(drawing.drawing, BatchedDrawing | StreamDrawing):
            row.update(ring=drawing.drawing.slots, overlap=drawing.drawing.overlap is not None)
        if name in turning:
            row["turning"] = percentiles(turning[name])
        if name == POOLED:
            row["pool"] = pool
        if isinstance(drawing.drawing, MeshDrawing):
            row["tasks"] = asdict(drawing.drawing.tasks)
        if name in (POOLED, "visibility"):
            runs = [drawing.run_steps() for _ in range(WARM_UP + FRAMES)][WARM_UP:]
            row["steps"] = {step: float(np.median([r[step] for r in runs])) for step in runs[0]}
        rows.append(row)
        drawing.free()
    return rows


def frame_times(drawings: dict, cameras: list | None = None) -> dict[str, list[float]]:
    """Milliseconds of each frame by path; the paths take turns. cameras: of each frame."""
    end = time.monotonic() + WAKE_SECONDS
    while time.monotonic() < end:
        next(iter(drawings.values())).run()
    times: dict[str, list[float]] = {name: [] for name in drawings}
    for frame in range(WARM_UP + FRAMES):
        for name, drawing in drawings.items():
            if cameras:
                drawing.look(cameras[frame])
            spent = drawing.run()
            if frame >= WARM_UP:
                times[name].append(spent)
    return times


# --- reporting ---


def _path(row: dict) -> str:
    return row["path"]


def _launched(row: dict) -> str:
    tasks = row["tasks"]
    return f"{tasks['launched']:,} of {tasks['tested']:,}, {tasks['hidden']:,}"


def summary(result: dict) -> str:
    """Tables by model: milliseconds and memory by path, turning, by step, by picture, counts."""
    rows = result["rows"]
    steps = [
        {**row, "step": step + ", with a pool" * ("pool" in row), "time": time}
        for row in rows
        for step, time in row.get("steps", {}).items()
    ]

    def cells(first: str, of: list[dict], line: Callable, cell: Callable) -> str:
        return table_by_model(first, of, line, cell, lambda row: row["model"])

    tested = [row for row in rows if "tasks" in row]
    tasks = f"""
Meshlets that task shaders launched, then those that were in view but hidden:

{cells("path", tested, _path, _launched)}"""

    return f"""As `gltf-meshlet render` draws, lit and with culling. Milliseconds per frame of
{pixels(result)} pixels (medians), and memory on the GPU.

{cells("path", rows, _path, lambda r: f"{milliseconds(r):.3g}, {megabytes(r):.1f} MB")}
Milliseconds per frame while the camera turns by a degree a frame; `visibility-pool` keeps decoded
meshlets in {POOL_SHARE} of the bytes of the uncompressed model.

{
        cells(
            "path",
            [row for row in rows if "turning" in row],
            _path,
            lambda row: f"{row['turning']['median']:.3g}",
        )
    }
The [steps](vulkan.md#how-it-works) of path visibility:

{cells("step", steps, lambda row: row["step"], lambda row: f"{row['time']:.3f}")}
Milliseconds per frame of other pictures. The squares of `layers` fill the picture seven times.

{
        cells(
            "picture, path",
            result["views"],
            lambda row: f"{row['view']}, {row['path']}",
            lambda row: f"{milliseconds(row):.3g}",
        )
    }{tasks if tested else ""}"""


def save_plot(result: dict, path: Path) -> Path:
    """Bars of frame times and of memory."""
    rows = {(row["model"], row["path"]): row for row in result["rows"]}
    models, measured = (dict.fromkeys(key[k] for key in rows) for k in (0, 1))
    figure, axes = pyplot().subplots(
        2, 1, figsize=(1.2 + 1.6 * len(models), 7), sharex=True, layout="constrained"
    )
    panels = (("ms a frame", milliseconds), ("MB on the device", megabytes))
    names = [name for name in PATHS if name in measured]
    bar = 0.85 / len(names)
    for axis, (label, value) in zip(axes, panels):
        for offset, name in enumerate(names):
            found = [rows.get((model, name)) for model in models]
            values = [value(row) if row else np.nan for row in found]
            places = np.arange(len(models)) + bar * (offset - (len(names) - 1) / 2)
            axis.bar(places, values, 0.94 * bar, label=name)
        axis.set(yscale="log", ylabel=label)
    axes[-1].set_xticks(np.arange(len(models)), models)
    axes[0].legend(ncols=len(names), fontsize=8)
    axes[0].set_title(f"{result['device']['name']}, {WIDTH} x {HEIGHT}")
    return save_figure(figure, path, dpi=110)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_gpu_options(parser)
    parser.add_argument(
        "--add", action="store_true", help="keep the other models of the last result"
    )


check = check_model_files
