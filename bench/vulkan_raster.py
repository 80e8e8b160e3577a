"""Drawing compressed meshlets with Vulkan: frame time and memory of all paths, beside the same model uncompressed.

    python -m bench.vulkan_raster MODEL.glb ...      writes bench/results/vulkan_raster.json and, with matplotlib, docs/vulkan-raster.png

The whole model is in view. Times are the GPU's, from before the picture is cleared, and before anything is decoded, to after the last
fragment; all paths take turns frame by frame. Without culling the fragment shader is the cheapest one that uses every attribute; with
culling it is the lit one.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.common import ROOT, markdown_table, origin, percentiles, write_result
from bench.gpu_models import add_models, models_of, parsed
from gltf_ext.errors import MeshletError

PATHS = ("vertex", "mesh-plain", "stream", "mesh", "mesh-only", "geometry")
WIDTH, HEIGHT = 1920, 1080
WARM_UP, FRAMES = 5, 40
BAR = 0.85 / len(PATHS)  # of the plot: width of a path
# What the project aims at without culling: this path's time over that one's, at most.
TARGETS = {
    ("stream", "mesh-plain"): 1.5,
    ("stream", "vertex"): 2.0,
    ("mesh", "mesh-plain"): 1.5,
    ("mesh", "vertex"): 2.0,
    ("mesh", "geometry"): 1 / 2.5,
}
RESIDENT_SHARE, RESIDENT_BYTES = 1.05, 65536
ROUNDING, TIES = (
    2,
    1e-3,
)  # of colours; share of the pixels in which triangles at the same depth may take turns


# --- models ---


def vertex_bytes_with_short_indices(scene) -> int:
    """What path vertex would take with 16-bit indices: cut into draws of at most 65,535 vertices, those on the cuts stored twice."""
    vertices = triangles = 0
    for primitive in scene.primitives:
        rows, words = primitive.decoded().meshlets()
        draw_of = np.full(primitive.vertices, -1)
        draw, used = 0, 0
        for first, counts in zip(rows["first"].tolist(), rows["counts"].tolist()):
            own = words[first : first + (counts & 255)]
            new = int(np.count_nonzero(draw_of[own] != draw))
            if used + new > 65535:
                vertices, draw, used, new = vertices + used, draw + 1, 0, len(own)
            draw_of[own] = draw
            used += new
        vertices += used
        triangles += primitive.triangles
    return 4 * scene.vertex_floats * vertices + 6 * triangles


# --- measuring ---


def check_pictures(device, drawings: dict, targets) -> None:
    """What draws another picture than the first path is not measured."""
    pictures = {}
    for name, drawing in drawings.items():
        layout = targets.color.layout
        drawing.run()
        pictures[name] = targets.color.read(np.uint8, 4).astype(np.int16)
        with device.commands() as commands:
            targets.color.to_layout(commands, layout)  # as the recorded frames find it
    first, reference = next(iter(pictures.items()))
    for name, picture in pictures.items():
        different = (np.abs(picture - reference) > ROUNDING).any(axis=2).mean()
        if different > TIES:
            raise SystemExit(
                f"bench: {name} draws another picture than {first}: {different:.1%} of the pixels differ"
            )


def measure(
    renderer,
    path: Path,
    paths: list[str],
    culling: bool,
    frames: int,
    statistics: bool,
    stream: dict,
) -> list[dict]:
    """A row for each of `paths` that the device has. stream: `ring` and `overlap` of path stream."""
    from vk_backend.camera import Camera
    from vk_backend.raster import Targets
    from vk_backend.renderer import TimedDrawing
    from vk_backend.scene import load_scene
    from vk_backend.statistics import pipeline_statistics

    scene = load_scene(path)
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    targets = Targets(renderer.device, WIDTH, HEIGHT, ids=False)
    drawings: dict[str, TimedDrawing] = {}
    for name in paths:
        try:
            drawings[name] = TimedDrawing(
                renderer.pipelines,
                scene,
                camera,
                name,
                targets,
                culling=culling,
                lit=culling,
                **stream,
            )
        except MeshletError as error:
            print(f"  {name} is left out: {error}", file=sys.stderr)
    check_pictures(renderer.device, drawings, targets)
    times: dict[str, list[float]] = {name: [] for name in drawings}
    for frame in range(WARM_UP + frames):
        for name, drawing in drawings.items():
            milliseconds = drawing.run()
            if frame >= WARM_UP:
                times[name].append(milliseconds)
    facts = {
        "model": path.stem,
        "culling": culling,
        "triangles": scene.triangles,
        "meshlets": sum(scene.primitives[i.primitive].meshlets for i in scene.instances),
        "compressed_bytes": scene.compressed_bytes,
    }
    rows = []
    for name, drawing in drawings.items():
        row = {
            **facts,
            "path": name,
            "milliseconds": percentiles(times[name]),
            "resident_bytes": drawing.drawing.resident_bytes,
        }
        if name == "vertex":
            row["resident_bytes_16bit_indices"] = vertex_bytes_with_short_indices(scene)
        if name == "stream":
            row.update(ring=drawing.drawing.ring.slots, overlap=drawing.drawing.overlaps)
        if statistics:
            row["statistics"] = pipeline_statistics(renderer.device, drawing.drawing.pipeline)
            for shader, pipeline in (
                drawing.drawing.ring.pipelines if drawing.drawing.ring else {}
            ).items():
                row["statistics"][shader] = pipeline_statistics(renderer.device, pipeline)
        rows.append(row)
        drawing.free()
    targets.free()
    return rows


# --- reporting ---


def ratios(rows: list[dict]) -> list[dict]:
    """Per model and culling: the targets' ratios of medians, and whether memory keeps to its limit."""
    found = []
    for key in dict.fromkeys((r["model"], r["culling"]) for r in rows):
        of = {r["path"]: r for r in rows if (r["model"], r["culling"]) == key}
        row = {"model": key[0], "culling": key[1]}
        for (path, over), limit in TARGETS.items():
            if path in of and over in of:
                row[f"{path}/{over}"] = round(
                    of[path]["milliseconds"]["median"] / of[over]["milliseconds"]["median"], 3
                )
        if "mesh" in of:
            limit = RESIDENT_SHARE * of["mesh"]["compressed_bytes"] + RESIDENT_BYTES
            row["resident/limit"] = round(of["mesh"]["resident_bytes"] / limit, 3)
        found.append(row)
    return found


def table(rows: list[dict], culling: bool) -> str:
    """Markdown: a line per model, its time and memory by each path."""
    lines = []
    for model in dict.fromkeys(r["model"] for r in rows):
        of = {r["path"]: r for r in rows if r["model"] == model and r["culling"] == culling}
        if of:
            cells = [
                f"{of[p]['milliseconds']['median']:.3f} / {of[p]['resident_bytes'] / 1e6:.2f}"
                if p in of
                else ""
                for p in PATHS
            ]
            lines.append([model, f"{next(iter(of.values()))['triangles']:,}", *cells])
    return markdown_table(["model", "triangles", *(f"{p}, ms / MB" for p in PATHS)], lines)


def plot(result: dict, output: Path) -> bool:
    """Bars of frame times, and of memory; False where matplotlib is missing."""
    try:
        import matplotlib
    except ImportError:
        return False
    matplotlib.use("Agg")
    from matplotlib import pyplot

    models = list(dict.fromkeys(r["model"] for r in result["rows"]))
    figure, axes = pyplot.subplots(
        3, 1, figsize=(1.2 + 1.6 * len(models), 9), sharex=True, layout="constrained"
    )
    panels = (
        ("ms a frame, no culling", lambda r: None if r["culling"] else r["milliseconds"]["median"]),
        ("ms a frame, culling", lambda r: r["milliseconds"]["median"] if r["culling"] else None),
        ("MB on the device", lambda r: None if r["culling"] else r["resident_bytes"] / 1e6),
    )
    for axis, (label, value) in zip(axes, panels):
        for offset, path in enumerate(PATHS):
            values = [
                next(
                    (
                        value(r)
                        for r in result["rows"]
                        if r["model"] == m and r["path"] == path and value(r) is not None
                    ),
                    np.nan,
                )
                for m in models
            ]
            axis.bar(
                np.arange(len(models)) + BAR * (offset - (len(PATHS) - 1) / 2),
                values,
                0.94 * BAR,
                label=path,
            )
        axis.set_yscale("log")
        axis.set_ylabel(label)
    axes[-1].set_xticks(np.arange(len(models)), models)
    axes[0].legend(ncols=len(PATHS), fontsize=8)
    axes[0].set_title(f"{result['device']['name']}, {WIDTH} x {HEIGHT}")
    figure.savefig(output, dpi=110)
    return True


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m bench.vulkan_raster", description=__doc__.split("\n")[0]
    )
    add_models(parser)
    parser.add_argument(
        "--paths", nargs="+", choices=PATHS, default=list(PATHS), help="(default: all)"
    )
    parser.add_argument(
        "--device", help="its number, or a part of its name (default: the first GPU)"
    )
    parser.add_argument(
        "--ring",
        type=int,
        metavar="N",
        help="slots of path stream, at most (default: the renderer's)",
    )
    parser.add_argument(
        "--overlap",
        action=argparse.BooleanOptionalAction,
        help="path stream decodes on another queue than it draws on (default: as the renderer does)",
    )
    parser.add_argument(
        "--frames", type=int, default=FRAMES, help="timed frames of each path (default %(default)s)"
    )
    parser.add_argument(
        "--statistics",
        action="store_true",
        help="keep what the driver says about registers and memory of each shader",
    )
    parser.add_argument("--no-write", action="store_true", help="print only")
    options = parsed(parser)
    try:
        run(options)
    except (MeshletError, OSError) as error:
        sys.exit(f"bench.vulkan_raster: {error}")


def run(options: argparse.Namespace) -> None:
    """Measures, prints and writes."""
    from vk_backend.renderer import Renderer
    from vk_backend.statistics import capture_statistics
    from vk_backend.stream import RING

    stream = {"ring": RING if options.ring is None else options.ring, "overlap": options.overlap}
    rows: list[dict] = []
    with tempfile.TemporaryDirectory() as folder, Renderer(options.device) as renderer:
        statistics = options.statistics and capture_statistics(renderer.device)
        device = {"name": renderer.device.name, "driver": renderer.device.driver}
        start = time.perf_counter()
        files = models_of(options, Path(folder))
        print(
            f"{device['name']}, driver {device['driver']}; models ready after {time.perf_counter() - start:.0f} s",
            file=sys.stderr,
        )
        for path in files:
            for culling in (False, True):
                rows += measure(
                    renderer, path, options.paths, culling, options.frames, statistics, stream
                )
                print(
                    f"{path.stem}, culling {'on' if culling else 'off'}: {time.perf_counter() - start:.0f} s",
                    file=sys.stderr,
                    flush=True,
                )
    result = origin("bench.vulkan_raster", ("numpy", "vulkan"))
    result.update(
        device=device,
        width=WIDTH,
        height=HEIGHT,
        frames=options.frames,
        rows=rows,
        ratios=ratios(rows),
    )
    for culling in (False, True):
        print(f"culling {'on' if culling else 'off'}\n\n{table(rows, culling)}")
    for row in result["ratios"]:
        print(row)
    if not options.no_write:
        print(f"wrote {write_result('vulkan_raster', result).relative_to(ROOT)}")
        if plot(result, ROOT / "docs" / "vulkan-raster.png"):
            print("wrote docs/vulkan-raster.png")


if __name__ == "__main__":
    main()
