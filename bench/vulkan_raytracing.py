"""Ray tracing compressed meshlets with Vulkan: time and memory over the size of the cache, beside the same model uncompressed.

    python -m bench.vulkan_raytracing MODEL.glb ...      writes bench/results/vulkan_raytracing.json and the table and plot of docs

921,600 rays a frame (1280 x 720) with nothing but what they hit first, and the same with two diffuse bounces and a shadow ray at every hit.
The camera goes round the model by half a degree a frame, a sixth of a turn, so that the cache has to follow; a frame's time is that of the
GPU and includes choosing what the cache holds and decoding what it lacks. All configurations take turns frame by frame; those that are slow
take fewer.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.common import ROOT, markdown_table, origin, percentiles, replace_block, write_result
from bench.gpu_models import add_models, models_of, parsed

WIDTH, HEIGHT = 1280, 720
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)
STEP = 0.5  # degrees between frames
WARM_UP, FRAMES = 24, 120  # a cache that has followed for a while, through a sixth of a turn
CLOCKS = 0.7  # seconds of work before the first frames, in which the GPU comes to its clock rate
SLOW, LEAST_FRAMES = (
    1200,
    12,
)  # a configuration that has taken so many milliseconds is measured in no more frames, once it has these
BOUNCES = (0, 2)
TUNED = (
    "scratch",
    "rounds",
    "strips",
    "predict",
    "bounds",
    "paths",
    "ahead",
)  # parameters and options; None: what RayTracer chooses


def turntable(scene, width: int, height: int, degrees: float):
    """A camera around the scene's box, turned about the vertical through its centre."""
    from vk_backend.camera import DEFAULT_VIEW, Camera

    angle = np.radians(degrees)
    x, y, z = DEFAULT_VIEW
    view = (x * np.cos(angle) + z * np.sin(angle), y, z * np.cos(angle) - x * np.sin(angle))
    return Camera.fit_box(scene.low, scene.high, width, height, view)


def configurations(options: argparse.Namespace) -> list[dict]:
    rows = []
    for group in options.group:
        for values in itertools.product(*(getattr(options, name) for name in TUNED)):
            given = {name: value for name, value in zip(TUNED, values) if value is not None}
            rows += [
                {"path": "rt", "cache": share, "group": group, **given} for share in options.cache
            ]
        rows.append({"path": "rt-plain", "cache": None, "group": group})
    return [*rows, {"path": "rt-triangles", "cache": None, "group": None}]


def measure(device, path: Path, name: str, options: argparse.Namespace) -> list[dict]:
    """Rows of one model."""
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
        began = time.perf_counter()
        tracers.append(
            RayTracer(
                device, scene, configuration["path"], samples=1, marked=options.steps, **settings
            )
        )
        rows.append({"model": name, "triangles": scene.triangles, **configuration})
        if options.statistics:
            print_statistics(device, tracers[-1])
        print(
            f"{name}: {label(configuration)} set up in {time.perf_counter() - began:.1f} s",
            file=sys.stderr,
            flush=True,
        )
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
    from vk_backend.statistics import pipeline_statistics

    for pipeline in tracer.pipelines:
        for executable, found in pipeline_statistics(device, pipeline).items():
            print(
                f"  {executable}: "
                + ", ".join(f"{name} {value:g}" for name, value in found.items()),
                file=sys.stderr,
            )


def label(row: dict) -> str:
    share = "" if row["cache"] is None else f" cache {row['cache']:.0%}"
    more = "".join(
        f" {name} {row[name]}" for name in ("group", *TUNED) if row.get(name) is not None
    )
    return f"{row['path']}{share}{more}"


def print_table(rows: list[dict]) -> None:
    for model in dict.fromkeys(r["model"] for r in rows):
        for bounces in BOUNCES:
            mine = [r for r in rows if r["model"] == model and r["bounces"] == bounces]
            base = mine[-1]  # rt-triangles
            for row in mine:
                times, size = row["milliseconds"], sum(row["resident_bytes"].values())
                ratio = times["median"] / base["milliseconds"]["median"]
                memory = size / sum(base["resident_bytes"].values())
                waiting = row.get("statistics", {}).get("waiting")
                waits = f" waiting {' '.join(map(str, waiting))}" if waiting else ""
                print(
                    f"{model:14} bounces {bounces} {label(row):44} {times['median']:8.3f} ms ({times['low']:.3f} to {times['high']:.3f})"
                    f" {ratio:6.2f}x  {size / 1e6:8.2f} MB {memory:5.2f}x{waits}"
                )
                if row.get("steps"):
                    print(
                        "  microseconds: "
                        + ", ".join(f"{name} {1e3 * ms:.0f}" for name, ms in row["steps"].items())
                    )


def cell(row: dict, rows: list[dict]) -> str:
    """A row's time with its spread, and as a multiple of rt-triangles and of a full cache, if there was one among the rows."""
    others = [r for r in rows if (r["model"], r["bounces"]) == (row["model"], row["bounces"])]
    base = next(r for r in others if r["path"] == "rt-triangles")
    full = [r for r in others if r["path"] == "rt" and r["cache"] == 1]
    times, median = row["milliseconds"], row["milliseconds"]["median"]
    text = f"{median:.3f} ({times['low']:.3f} to {times['high']:.3f}), {median / base['milliseconds']['median']:.2f}x"
    if row["path"] != "rt" or row["cache"] == 1 or not full:
        return text
    return f"{text}, {median / full[0]['milliseconds']['median']:.2f} of full"


def document(result: dict) -> None:
    """Puts the table into docs/vulkan-raytracing.md."""
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
        slots = (
            f"{found['slots'] / found['meshlets']:.0%}"
            if found
            else "100%"
            if row["path"] == "rt"
            else ""
        )
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
        f"{result['width']} x {result['height']} pixels, {frames}: median (10 % to 90 %), ratio to rt-triangles, and where the cache is"
        " not full to a full one; slots: the share of the meshlets that have one, scratch included"
    )
    text = (
        markdown_table(headings, lines)
        + f"\n{size}. Measured by `{result['script']}` on {result['date'][:10]}, {device}.\n"
    )
    replace_block(ROOT / "docs" / "vulkan-raytracing.md", "measurements", text)


def plot(rows: list[dict], path: Path) -> bool:
    """The paper's Figure 5: time over the share of meshlets in the cache. False where matplotlib is not installed."""
    try:
        import matplotlib
    except ImportError:
        return False
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

    figure, axes = plt.subplots(1, len(BOUNCES), figsize=(12, 4.2), layout="constrained")
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
    plt.close(figure)
    return True


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_models(parser)
    parser.add_argument("--device", help="number or part of the name")
    parser.add_argument("--width", type=int, default=WIDTH)
    parser.add_argument("--height", type=int, default=HEIGHT)
    parser.add_argument(
        "--frames",
        type=int,
        default=FRAMES,
        help="measured frames of each configuration (default %(default)s)",
    )
    parser.add_argument(
        "--group", type=int, nargs="+", default=[4], help="triangles behind one box (default 4)"
    )
    parser.add_argument(
        "--scratch",
        type=float,
        nargs="+",
        default=[None],
        help="slots for what paths wait for, shares of the meshlets",
    )
    parser.add_argument(
        "--rounds", type=int, nargs="+", default=[None], help="how often paths that wait may go on"
    )
    parser.add_argument(
        "--strips",
        type=int,
        nargs="+",
        default=[None],
        help="parts of the picture that are traced one after the other",
    )
    parser.add_argument(
        "--predict",
        type=int,
        choices=(0, 1),
        nargs="+",
        default=[None],
        help="1: meshlets near those that rays needed are decoded ahead",
    )
    parser.add_argument(
        "--bounds",
        type=int,
        choices=(0, 1),
        nargs="+",
        default=[None],
        help="0: no boxes around meshlets for paths that wait",
    )
    parser.add_argument(
        "--paths",
        type=float,
        nargs="+",
        default=[None],
        help="records of paths that wait, a share of the pixels; 0: all start again",
    )
    parser.add_argument(
        "--ahead",
        type=float,
        nargs="+",
        default=[None],
        help="rays that look ahead to where the camera will be, a share of the pixels",
    )
    parser.add_argument(
        "--steps",
        action="store_true",
        help="also the median time of each step of a frame, which takes a little longer",
    )
    parser.add_argument(
        "--statistics",
        action="store_true",
        help="also what the driver tells about the shaders: registers, stack",
    )
    parser.add_argument(
        "--cache",
        type=float,
        nargs="+",
        default=list(SHARES),
        help="shares of the meshlets (default %(default)s)",
    )
    parser.add_argument(
        "--output",
        default="vulkan_raytracing",
        help="name of the result (default %(default)s); -: only print",
    )
    options = parsed(parser)
    from vk_backend.device import Device
    from vk_backend.statistics import capture_statistics

    rows: list[dict] = []
    with Device(options.device) as device, tempfile.TemporaryDirectory() as folder:
        if options.statistics and not capture_statistics(device):
            print("the driver keeps no statistics of shaders", file=sys.stderr)
        for model in models_of(options, Path(folder)):
            rows += measure(device, model, model.stem, options)
            print_table([r for r in rows if r["model"] == model.stem])
            sys.stdout.flush()
        result = origin("bench.vulkan_raytracing", ("numpy", "vulkan"))
        result["device"] = {"name": device.name, "driver": device.driver}
    result.update(
        {"width": options.width, "height": options.height, "frames": options.frames, "rows": rows}
    )
    if options.output != "-":
        write_result(options.output, result)
        document(result)
        if not plot(rows, ROOT / "docs" / "vulkan-raytracing.png"):
            print("no plot: matplotlib is not installed", file=sys.stderr)


if __name__ == "__main__":
    main()
