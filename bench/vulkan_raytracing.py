"""Ray tracing on the GPU: time and memory over the cache's size, beside the uncompressed model.

Needs a GPU and the names of models: python -m bench vulkan_raytracing MODEL.glb ... Writes the
tables in docs/vulkan-raytracing.md and docs/vulkan-raytracing.png.

A frame traces 921,600 camera rays (1280 x 720) to their first hit, or adds two diffuse bounces and
a shadow ray at every hit. The camera turns around the model by one degree a frame, a sixth of a
turn in all. A frame's time is the GPU's own and includes eviction
and decoding. All configurations take turns frame by frame; slow ones get fewer frames. The last
pictures of path rt are compared bit for bit.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.common import (
    command,
    milliseconds,
    percentiles,
    progress,
    pyplot,
    save_figure,
    table,
)
from bench.models import add_gpu_options, check_model_files, model_files

WIDTH, HEIGHT = 1280, 720
PACKAGES = ("numpy", "vulkan")
SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)  # of the meshlets
PAPER_SHARES = (0.25, 0.5, 1.0)
STEP = 1.0  # degrees between frames
WARM_UP = 8  # untimed frames
FRAMES = 60  # timed frames
CLOCKS = 0.7  # seconds of work before the first frame: an idle GPU has a low clock rate
# A configuration gets no more frames once it has LEAST_FRAMES and has taken SLOW milliseconds.
SLOW, LEAST_FRAMES = 600, 4
BOUNCES = (0, 2)
# What makes a configuration. None: the path has no such thing.
SETTINGS = ("path", "cache", "group")


def turntable(scene, width: int, height: int, degrees: float):
    """A camera around the scene's box, turned about the vertical axis through its centre."""
    from vk_backend.scene.camera import DEFAULT_VIEW, Camera

    angle = np.radians(degrees)
    x, y, z = DEFAULT_VIEW
    view = (x * np.cos(angle) + z * np.sin(angle), y, z * np.cos(angle) - x * np.sin(angle))
    return Camera.fit_box(scene.low, scene.high, width, height, view)


def configurations() -> list[dict]:
    """Path, cache size and triangles per box of all tracers; rt-triangles last."""
    rows = [{"path": "rt", "cache": share, "group": 4} for share in SHARES]
    rows += [{"path": "rt-paper", "cache": share, "group": 64} for share in PAPER_SHARES]
    return [*rows, {"path": "rt-triangles", "cache": None, "group": None}]


def measure(options: argparse.Namespace) -> dict:
    """All models in all configurations."""
    from vk_backend.gpu.device import Device

    rows: list[dict] = []
    with Device(options.device) as device, tempfile.TemporaryDirectory() as folder:
        for path in model_files(options, Path(folder)):
            rows += measure_model(device, path)
        described = {"name": device.name, "driver": device.driver}
        size = {"width": WIDTH, "height": HEIGHT, "frames": FRAMES}
        return {"device": described, **size, "rows": rows}


def measure_model(device, path: Path) -> list[dict]:
    """The rows of one model."""
    from bench.vulkan_paths import TRACERS
    from vk_backend.renderer import cache_bytes
    from vk_backend.scene.scene import load_scene

    scene, name = load_scene(path), path.stem
    rows, tracers = [], []
    for configuration in configurations():
        share = 1.0 if configuration["cache"] is None else configuration["cache"]
        cache = cache_bytes(scene, "rt", share)
        tracers.append(TRACERS[configuration["path"]](device, scene, cache=cache, samples=1))
        rows.append({"model": name, "triangles": scene.triangles, **configuration})
    progress(f"{name}: {len(tracers)} configurations are ready")
    size = WIDTH, HEIGHT
    cameras = [turntable(scene, *size, STEP * i) for i in range(WARM_UP + FRAMES)]
    result = []
    for bounces in BOUNCES:
        for tracer in tracers:
            tracer.set_light(bounces=bounces, shadows=bounces > 0)
        result += measure_light(rows, tracers, cameras, size, bounces)
        progress(f"{name}: {bounces} bounces are measured")
    for tracer in tracers:
        tracer.free()
    return result


def measure_light(rows, tracers, cameras, size: tuple[int, int], bounces: int) -> list[dict]:
    """The rows of a model with so many bounces, completed by what was measured."""
    times: list[list[float]] = [[] for _ in tracers]
    last: dict = {}  # milliseconds of the last frame
    began = time.perf_counter()
    while time.perf_counter() < began + CLOCKS:
        tracers[-1].time(cameras[0], *size)
    for number, camera in enumerate(cameras):
        for tracer, own in zip(tracers, times):
            slow = len(own) >= LEAST_FRAMES and sum(own) > SLOW
            if slow or (1 < number < WARM_UP and last[tracer] > SLOW / WARM_UP):
                continue
            last[tracer] = tracer.time(camera, *size)
            if number >= WARM_UP:
                own.append(last[tracer])
    reference = None
    result = []
    for row, tracer, own in zip(rows, tracers, times):
        entry = {**row, "bounces": bounces, "milliseconds": percentiles(own)}
        entry |= {"frames": len(own), "resident_bytes": tracer.resident_bytes()}
        counts = ("slots", "meshlets", "parts", "passes")
        entry["statistics"] = {name: getattr(tracer, name) for name in counts}
        if row["path"] == "rt":
            picture = tracer.render(cameras[-1], *size)
            parts = [picture.color, picture.ids, picture.t, picture.barycentrics]
            reference = reference or parts
            entry["differing"] = sum(int((a != b).sum()) for a, b in zip(parts, reference))
        result.append(entry)
    return result


def label(row: dict) -> str:
    """A configuration in words."""
    share = "" if row["cache"] is None else f" {row['cache']:.0%}"
    group = f" boxes of {row['group']}" if row["group"] not in (None, 4) else ""
    return f"{row['path']}{share}{group}"


def _model_bytes(row: dict) -> int:
    """Resident bytes that grow with the model."""
    return sum(size for part, size in row["resident_bytes"].items() if part != "records")


def _same(rows: list[dict], row: dict, **changes) -> dict:
    """The row that differs from another one in these fields only."""
    wanted = {**{k: row[k] for k in ("model", "bounces", *SETTINGS)}, **changes}
    return next(r for r in rows if all(r[k] == v for k, v in wanted.items()))


def _triangles(rows: list[dict], row: dict) -> dict:
    return _same(rows, row, path="rt-triangles", cache=None, group=None)


def cell(row: dict, rows: list[dict]) -> str:
    """A row's time with its spread, its ratio to rt-triangles and, of path rt with a cache that is
    not full, its ratio to a full one and the passes of a frame."""
    times, own = row["milliseconds"], milliseconds(row)
    text = f"{own:.3f} ({times['low']:.3f} to {times['high']:.3f}), "
    text += f"{own / milliseconds(_triangles(rows, row)):.2f}x"
    if row["path"] == "rt" and row["cache"] < 1:
        full = milliseconds(_same(rows, row, cache=1.0))
        text += f", {own / full:.2f} of full, {row['statistics']['passes']} passes"
    return text


def block(result: dict) -> str:
    """The table in docs/vulkan-raytracing.md."""
    rows = result["rows"]

    def light(bounces: int) -> Callable[[dict], str]:
        return lambda row: cell(_same(rows, row, bounces=bounces), rows)

    def grows(row: dict) -> str:
        own = _model_bytes(row)
        text = f"{own / 1e6:.2f} MB, {own / _model_bytes(_triangles(rows, row)):.2f}x"
        if row["cache"] not in (None, 1):
            text += f", {own / _model_bytes(_same(rows, row, cache=1.0)):.2f} of full"
        return text

    def records(row: dict) -> int:
        lights = (_same(rows, row, bounces=bounces) for bounces in BOUNCES)
        return max(of["resident_bytes"]["records"] for of in lights)

    def megabytes(count: int, digits: int = 2) -> str:
        return f"{count / 1e6:.{digits}f} MB" if count else ""

    columns = {
        "": lambda row: f"{row['model']}, {label(row)}",
        "first hits, ms": light(BOUNCES[0]),
        f"{BOUNCES[1]} bounces, ms": light(BOUNCES[1]),
        "decoded": lambda row: megabytes(row["resident_bytes"]["cache"]),
        "grows with the model": grows,
        "records": lambda row: megabytes(records(row), 1),
        "total": lambda row: megabytes(_model_bytes(row) + records(row)),
    }
    least = min(r["frames"] for r in rows)
    frames = f"{result['frames']} frames" + (
        f" ({least} or more of slow configurations)" if least < result["frames"] else ""
    )
    device = f"{result['device']['name']}, driver {result['device']['driver']}"
    size = (
        f"{result['width']} x {result['height']} pixels, {frames}: median (10 % to 90 %), "
        "ratio to rt-triangles, and of path rt where the cache is not full the ratio to a full "
        "one and the number of passes. Decoded: all "
        "decoded meshlets that are ever resident. Grows with the model: these, the compressed "
        "bytes, acceleration structures, tables, counters and lists. Records of paths that "
        "sweep grow with the picture"
    )
    lines = table([row for row in rows if row["bounces"] == BOUNCES[0]], columns)
    return f"{lines}\n{size}. Measured by `{command(result)}` on {result['date'][:10]}, {device}.\n"


def save_plot(result: dict, path: Path) -> Path:
    """The paper's Figure 5: time over the share of meshlets that may be decoded."""
    rows, plots = result["rows"], pyplot()
    from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

    figure, axes = plots.subplots(1, len(BOUNCES), figsize=(12, 4.2), layout="constrained")
    for axis, bounces in zip(axes, BOUNCES):
        for color, model in enumerate(dict.fromkeys(r["model"] for r in rows)):
            mine = [r for r in rows if r["model"] == model and r["bounces"] == bounces]
            for kind, group, style, marker in (("rt", 4, "-", "o"), ("rt-paper", 64, "-.", "x")):
                cached = [r for r in mine if (r["path"], r["group"]) == (kind, group)]
                shares = [100 * r["cache"] for r in cached]
                drawn = {"color": f"C{color}", "linestyle": style, "marker": marker}
                drawn["label"] = model if kind == "rt" else None
                axis.plot(shares, list(map(milliseconds, cached)), markersize=3, **drawn)
            baseline = next(milliseconds(r) for r in mine if r["path"] == "rt-triangles")
            axis.axhline(baseline, color=f"C{color}", linestyle="--", linewidth=0.8)
        axis.set(
            title="first hits" if bounces == 0 else f"{bounces} bounces, shadows",
            xlabel="meshlets that may be decoded, %",
            ylabel="milliseconds per frame",
            yscale="log",
        )
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5, 7)))
        axis.yaxis.set_minor_locator(NullLocator())
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    title = "solid: rt\ndash-dotted: the paper's cache\ndashed: rt-triangles"
    place = {"loc": "outside right center", "fontsize": 8, "title_fontsize": 8}
    figure.legend(*axes[0].get_legend_handles_labels(), title=title, **place)
    return save_figure(figure, path, dpi=110)


add_options, check = add_gpu_options, check_model_files
