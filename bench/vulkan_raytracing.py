"""Ray tracing on the GPU: time and memory over the cache's size, beside the uncompressed model.

Needs a GPU and the names of models: python -m bench vulkan_raytracing MODEL.glb ... Writes the
table in docs/vulkan-raytracing.md and docs/vulkan-raytracing.png.

A frame traces 921,600 camera rays (1280 x 720) to their first hit, or adds two diffuse bounces and
a shadow ray at every hit. The camera turns around the model by half a degree a frame, a sixth of a
turn in all, so that the cache has to follow. A frame's time is the GPU's own and includes eviction
and decoding. All configurations take turns frame by frame; slow ones get fewer frames.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.common import (
    DOCS,
    Question,
    markdown_table,
    percentiles,
    progress,
    pyplot,
    replace_block,
)
from bench.models import add_model_files, check_model_files, model_files

WIDTH, HEIGHT = 1280, 720
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)
STEP = 0.5  # degrees between frames
WARM_UP = 24  # untimed frames, so that the cache follows the camera
FRAMES = 120  # timed frames
CLOCKS = 0.7  # seconds of work before the first frame: an idle GPU has a low clock rate
# A configuration gets no more frames once it has LEAST_FRAMES and has taken SLOW milliseconds.
SLOW, LEAST_FRAMES = 1200, 12
BOUNCES = (0, 2)
# Options of RayTracer that the command line can set; None keeps RayTracer's default.
TUNED = ("scratch", "rounds", "strips", "predict", "bounds", "paths", "ahead")


def turntable(scene, width: int, height: int, degrees: float):
    """A camera around the scene's box, turned about the vertical axis through its centre."""
    from vk_backend.camera import DEFAULT_VIEW, Camera

    angle = np.radians(degrees)
    x, y, z = DEFAULT_VIEW
    view = (x * np.cos(angle) + z * np.sin(angle), y, z * np.cos(angle) - x * np.sin(angle))
    return Camera.fit_box(scene.low, scene.high, width, height, view)


def configurations(options: argparse.Namespace) -> list[dict]:
    """All combinations of path, cache size and options; rt-triangles last."""
    rows = []
    for group in options.group:
        for values in itertools.product(*(getattr(options, name) for name in TUNED)):
            given = {name: value for name, value in zip(TUNED, values) if value is not None}
            rows += [
                {"path": "rt", "cache": share, "group": group, **given} for share in options.cache
            ]
        rows.append({"path": "rt-plain", "cache": None, "group": group})
    return [*rows, {"path": "rt-triangles", "cache": None, "group": None}]


def measure(options: argparse.Namespace) -> dict:
    """All models in all configurations."""
    from vk_backend.device import Device
    from vk_backend.pipeline_statistics import capture_statistics

    rows: list[dict] = []
    with Device(options.device) as device, tempfile.TemporaryDirectory() as folder:
        if options.statistics and not capture_statistics(device):
            progress("the driver keeps no statistics of shaders")
        for path in model_files(options, Path(folder)):
            rows += measure_model(device, path, path.stem, options)
        return {
            "device": {"name": device.name, "driver": device.driver},
            "width": options.width,
            "height": options.height,
            "frames": options.frames,
            "rows": rows,
        }


def measure_model(device, path: Path, name: str, options: argparse.Namespace) -> list[dict]:
    """The rows of one model."""
    from vk_backend.raytrace import RayTracer
    from vk_backend.scene import load_scene

    scene = load_scene(path)
    rows, tracers = [], []
    for configuration in configurations(options):
        settings = {
            key: configuration[key]
            for key in ("cache", "group", *TUNED)
            if configuration.get(key) is not None
        }
        tracers.append(
            RayTracer(
                device, scene, configuration["path"], samples=1, marked=options.steps, **settings
            )
        )
        rows.append({"model": name, "triangles": scene.triangles, **configuration})
        if options.statistics:
            print_statistics(device, tracers[-1])
        progress(f"{name}: {label(configuration)} is ready")
    result = []
    cameras = [
        turntable(scene, options.width, options.height, STEP * i)
        for i in range(WARM_UP + options.frames)
    ]
    for bounces in BOUNCES:
        times: list[list[float]] = [[] for _ in tracers]
        steps: list[list[dict[str, float]]] = [[] for _ in tracers]
        for tracer in tracers:
            tracer.set_light(bounces=bounces, shadows=bounces > 0)
        began = time.perf_counter()
        while time.perf_counter() < began + CLOCKS:
            for tracer in tracers:
                tracer.time(cameras[0], options.width, options.height)
        for number, camera in enumerate(cameras):
            for tracer, own, own_steps in zip(tracers, times, steps):
                if len(own) >= LEAST_FRAMES and sum(own) > SLOW:
                    continue
                milliseconds = tracer.time(camera, options.width, options.height)
                if number >= WARM_UP:
                    own.append(milliseconds)
                    if options.steps:
                        own_steps.append(tracer.steps())
        for row, tracer, own, own_steps in zip(rows, tracers, times, steps):
            entry = {**row, "bounces": bounces, "milliseconds": percentiles(own)}
            entry["frames"] = len(own)
            entry["resident_bytes"] = tracer.resident_bytes()
            if tracer.counted:
                entry["statistics"] = tracer.statistics()
            if options.steps:
                entry["steps"] = {
                    name: float(np.median([s[name] for s in own_steps])) for name in own_steps[0]
                }
            result.append(entry)
    for tracer in tracers:
        tracer.free()
    return result


def print_statistics(device, tracer) -> None:
    """Prints the driver's statistics of all shaders, such as registers and stack."""
    from vk_backend.pipeline_statistics import pipeline_statistics

    for pipeline in tracer.pipelines:
        for executable, found in pipeline_statistics(device, pipeline).items():
            values = ", ".join(f"{name} {value:g}" for name, value in found.items())
            progress(f"  {executable}: {values}")


def label(row: dict) -> str:
    """A configuration in words."""
    share = "" if row["cache"] is None else f" cache {row['cache']:.0%}"
    more = "".join(
        f" {name} {row[name]}" for name in ("group", *TUNED) if row.get(name) is not None
    )
    return f"{row['path']}{share}{more}"


def summary(result: dict) -> str:
    """A line per row with its ratios to rt-triangles, and the timed steps of a frame."""
    lines = []
    for model in dict.fromkeys(row["model"] for row in result["rows"]):
        for bounces in BOUNCES:
            rows = [r for r in result["rows"] if (r["model"], r["bounces"]) == (model, bounces)]
            base = rows[-1]  # rt-triangles
            for row in rows:
                lines += _row_lines(row, base)
    return "\n".join(lines)


def _row_lines(row: dict, base: dict) -> list[str]:
    times = row["milliseconds"]
    size, base_size = (sum(r["resident_bytes"].values()) for r in (row, base))
    waiting = row.get("statistics", {}).get("waiting")
    waits = f" waiting {' '.join(map(str, waiting))}" if waiting else ""
    lines = [
        f"{row['model']:14} bounces {row['bounces']} {label(row):44} "
        f"{times['median']:8.3f} ms ({times['low']:.3f} to {times['high']:.3f}) "
        f"{times['median'] / base['milliseconds']['median']:6.2f}x  "
        f"{size / 1e6:8.2f} MB {size / base_size:5.2f}x{waits}"
    ]
    if row.get("steps"):
        steps = ", ".join(f"{name} {1e3 * ms:.0f}" for name, ms in row["steps"].items())
        lines.append(f"  microseconds: {steps}")
    return lines


def cell(row: dict, rows: list[dict]) -> str:
    """A row's time with its spread, and its ratios to rt-triangles and to a full cache."""
    others = [r for r in rows if (r["model"], r["bounces"]) == (row["model"], row["bounces"])]
    base = next(r for r in others if r["path"] == "rt-triangles")
    full = [r for r in others if r["path"] == "rt" and r["cache"] == 1]
    times, median = row["milliseconds"], row["milliseconds"]["median"]
    ratio = median / base["milliseconds"]["median"]
    text = f"{median:.3f} ({times['low']:.3f} to {times['high']:.3f}), {ratio:.2f}x"
    if row["path"] != "rt" or row["cache"] == 1 or not full:
        return text
    return f"{text}, {median / full[0]['milliseconds']['median']:.2f} of full"


def block(result: dict) -> str:
    """The table in docs/vulkan-raytracing.md."""
    lines = []
    for row in (r for r in result["rows"] if r["bounces"] == BOUNCES[0]):
        same = [
            r
            for r in result["rows"]
            if all(r.get(k) == row.get(k) for k in ("model", "path", "cache", "group", *TUNED))
        ]
        base = next(
            r for r in result["rows"] if r["model"] == row["model"] and r["path"] == "rt-triangles"
        )
        size, base_size = (sum(r["resident_bytes"].values()) for r in (row, base))
        found = row.get("statistics")
        slots = "100%" if row["path"] == "rt" else ""
        if found:
            slots = f"{found['slots'] / found['meshlets']:.0%}"
        memory = f"{size / 1e6:.2f} MB, {size / base_size:.2f}x"
        lines.append(
            [
                f"{row['model']}, {label(row)}",
                slots,
                *(cell(r, result["rows"]) for r in same),
                memory,
            ]
        )
    headings = [
        "",
        "slots",
        *(f"{'first hits' if b == 0 else f'{b} bounces'}, ms" for b in BOUNCES),
        "memory",
    ]
    least = min(r["frames"] for r in result["rows"])
    frames = f"{result['frames']} frames" + (
        f" ({least} or more of slow configurations)" if least < result["frames"] else ""
    )
    device = f"{result['device']['name']}, driver {result['device']['driver']}"
    size = (
        f"{result['width']} x {result['height']} pixels, {frames}: median (10 % to 90 %), "
        "ratio to rt-triangles, and where the cache is not full to a full one; "
        "slots: the share of the meshlets that have one, scratch included"
    )
    return (
        markdown_table(headings, lines)
        + f"\n{size}. Measured by `{result['script']}` on {result['date'][:10]}, {device}.\n"
    )


def save_plot(rows: list[dict], path: Path) -> Path:
    """The paper's Figure 5: time over the share of meshlets in the cache."""
    plots = pyplot()
    from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

    figure, axes = plots.subplots(1, len(BOUNCES), figsize=(12, 4.2), layout="constrained")
    for axis, bounces in zip(axes, BOUNCES):
        for color, model in enumerate(dict.fromkeys(r["model"] for r in rows)):
            mine = [r for r in rows if r["model"] == model and r["bounces"] == bounces]
            cached = [r for r in mine if r["path"] == "rt"]
            median = [r["milliseconds"]["median"] for r in cached]
            spread = [
                [abs(r["milliseconds"][k] - r["milliseconds"]["median"]) for r in cached]
                for k in ("low", "high")
            ]
            share = [100 * r["cache"] for r in cached]
            axis.errorbar(
                share, median, yerr=spread, color=f"C{color}", marker="o", markersize=3, label=model
            )
            for line, style in (("rt-plain", ":"), ("rt-triangles", "--")):
                baseline = [r["milliseconds"]["median"] for r in mine if r["path"] == line]
                axis.axhline(baseline[0], color=f"C{color}", linestyle=style, linewidth=0.8)
        axis.set_title("first hits" if bounces == 0 else f"{bounces} bounces, shadows")
        axis.set_xlabel("meshlets in the cache, %")
        axis.set_ylabel("milliseconds per frame")
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5, 7)))
        axis.yaxis.set_minor_locator(NullLocator())
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        lines,
        labels,
        loc="outside right center",
        fontsize=8,
        title="dotted: rt-plain\ndashed: rt-triangles",
        title_fontsize=8,
    )
    figure.savefig(path, dpi=110)
    return path


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_files(parser)
    parser.add_argument("--device", help="number or part of the name (default: the first GPU)")
    parser.add_argument("--width", type=int, default=WIDTH)
    parser.add_argument("--height", type=int, default=HEIGHT)
    parser.add_argument(
        "--frames",
        type=int,
        default=FRAMES,
        help="timed frames of each configuration (default %(default)s)",
    )
    parser.add_argument(
        "--steps",
        action="store_true",
        help="also the median time of each step of a frame, which costs a little time",
    )
    parser.add_argument(
        "--statistics",
        action="store_true",
        help="also the driver's statistics of the shaders: registers, stack",
    )
    _add_swept_options(parser)


def _add_swept_options(parser: argparse.ArgumentParser) -> None:
    """Options of RayTracer; all combinations of their values are measured."""

    def add(name: str, kind: type, about: str, default: tuple = (None,), **more) -> None:
        parser.add_argument(name, type=kind, nargs="+", default=list(default), help=about, **more)

    add("--cache", float, "shares of the meshlets (default %(default)s)", SHARES)
    add("--group", int, "triangles in one box (default 4)", (4,))
    add("--scratch", float, "slots for meshlets that paths wait for, a share of the meshlets")
    add("--rounds", int, "how often waiting paths are resumed")
    add("--strips", int, "parts of the picture that are traced one after the other")
    add("--predict", int, "1: decode meshlets ahead that are near requested ones", choices=(0, 1))
    add("--bounds", int, "0: no boxes around meshlets for waiting paths", choices=(0, 1))
    add("--paths", float, "records of waiting paths, a share of the pixels; 0: all start again")
    add("--ahead", float, "prefetch rays for the next camera, a share of the pixels")


def write_pages(result: dict) -> list[Path]:
    """The table in docs/vulkan-raytracing.md, and docs/vulkan-raytracing.png."""
    page = replace_block(DOCS / "vulkan-raytracing.md", "measurements", block(result))
    return [save_plot(result["rows"], DOCS / "vulkan-raytracing.png"), page]


QUESTION = Question(
    "vulkan_raytracing",
    __doc__,
    measure,
    summary,
    write_pages,
    packages=("numpy", "vulkan"),
    add_options=add_options,
    check=check_model_files,
)


def main() -> None:
    QUESTION.run()


if __name__ == "__main__":
    main()
