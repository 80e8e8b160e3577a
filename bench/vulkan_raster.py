"""Drawing on the GPU: frame time and memory of all paths, beside the same model uncompressed.

Needs a GPU and the names of models: python -m bench vulkan_raster MODEL.glb ... Writes
docs/vulkan-raster.png.

The whole model is in view. A frame's time is the GPU's own, from clearing and decoding to the last
fragment; all paths take turns frame by frame. Without culling the fragment shader is the cheapest
that uses every attribute; with culling it is lit.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from bench.common import markdown_table, percentiles, progress, pyplot
from bench.models import add_model_files, check_model_files, model_files
from gltf_ext.errors import MeshletError

PACKAGES = ("numpy", "vulkan")
PATHS = ("vertex", "mesh-plain", "stream", "mesh", "geometry")
WIDTH, HEIGHT = 1920, 1080
WARM_UP, FRAMES = 5, 40
BAR = 0.85 / len(PATHS)  # the width of a bar in the plot
# The project's goals without culling: the largest ratio of one path's time to another's.
TARGETS = {
    ("stream", "mesh-plain"): 1.5,
    ("stream", "vertex"): 2.0,
    ("mesh", "mesh-plain"): 1.5,
    ("mesh", "vertex"): 2.0,
    ("mesh", "geometry"): 1 / 2.5,
}
RESIDENT_SHARE, RESIDENT_BYTES = 1.05, 65536
ROUNDING = 2  # difference of colours that counts as equal, of 255
TIES = 1e-3  # share of pixels that may differ: triangles at the same depth


# --- models ---


def vertex_bytes_with_short_indices(scene) -> int:
    """Bytes that path vertex would take with 16-bit indices.

    The model is cut into draws of at most 65,535 vertices; vertices on the cuts are duplicated.
    """
    from bench.vulkan_paths import plain_meshlets

    vertices = triangles = 0
    for primitive in scene.primitives:
        rows, words = plain_meshlets(primitive.decoded())
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
    """Ends the program if a path draws another picture than the first one."""
    pictures = {}
    for name, drawing in drawings.items():
        layout = targets.color.layout
        drawing.run()
        pictures[name] = targets.color.read(np.uint8, 4).astype(np.int16)
        with device.commands() as commands:
            targets.color.to_layout(commands, layout)  # the layout that recorded frames expect
    first, reference = next(iter(pictures.items()))
    for name, picture in pictures.items():
        different = (np.abs(picture - reference) > ROUNDING).any(axis=2).mean()
        if different > TIES:
            raise SystemExit(
                f"bench: {name} draws another picture than {first}: "
                f"{different:.1%} of the pixels differ"
            )


def measure(options: argparse.Namespace) -> dict:
    """All models, with and without culling."""
    from bench.pipeline_statistics import capture_statistics
    from vk_backend.renderer import Renderer
    from vk_backend.ring import RING

    stream = {"ring": RING if options.ring is None else options.ring, "overlap": options.overlap}
    rows: list[dict] = []
    with tempfile.TemporaryDirectory() as folder, Renderer(options.device) as renderer:
        statistics = options.statistics and capture_statistics(renderer.device)
        device = {"name": renderer.device.name, "driver": renderer.device.driver}
        files = model_files(options, Path(folder))
        progress(f"{device['name']}, driver {device['driver']}; models are ready")
        for path in files:
            for culling in (False, True):
                rows += measure_model(
                    renderer, path, options.paths, culling, options.frames, statistics, stream
                )
                progress(f"{path.stem}, culling {'on' if culling else 'off'}")
    return {
        "device": device,
        "width": WIDTH,
        "height": HEIGHT,
        "frames": options.frames,
        "rows": rows,
        "ratios": ratios(rows),
    }


def measure_model(
    renderer,
    path: Path,
    paths: list[str],
    culling: bool,
    frames: int,
    statistics: bool,
    stream: dict,
) -> list[dict]:
    """A row for each of `paths` that the device supports. stream: options of path stream."""
    from bench.pipeline_statistics import pipeline_statistics
    from bench.vulkan_paths import TimedDrawing
    from vk_backend.camera import Camera
    from vk_backend.scene import load_scene
    from vk_backend.targets import Targets

    scene = load_scene(path)
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    targets = Targets(renderer.device, WIDTH, HEIGHT, ids=False)
    drawings: dict[str, TimedDrawing] = {}
    for name in paths:
        try:
            drawings[name] = TimedDrawing(
                renderer.device,
                scene,
                camera,
                name,
                targets,
                culling=culling,
                lit=culling,
                **stream,
            )
        except MeshletError as error:
            progress(f"  skips {name}: {error}")
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
    """Per model and culling: ratios of median times, and of memory to its limit."""
    found = []
    for key in dict.fromkeys((r["model"], r["culling"]) for r in rows):
        of = {r["path"]: r for r in rows if (r["model"], r["culling"]) == key}
        row = {"model": key[0], "culling": key[1]}
        for path, over in TARGETS:
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
    """A row per model: time and memory by path."""
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


def save_plot(result: dict, path: Path) -> Path:
    """Bars of frame times and of memory."""
    models = list(dict.fromkeys(r["model"] for r in result["rows"]))
    figure, axes = pyplot().subplots(
        3, 1, figsize=(1.2 + 1.6 * len(models), 9), sharex=True, layout="constrained"
    )
    panels = (
        ("ms a frame, no culling", lambda r: None if r["culling"] else r["milliseconds"]["median"]),
        ("ms a frame, culling", lambda r: r["milliseconds"]["median"] if r["culling"] else None),
        ("MB on the device", lambda r: None if r["culling"] else r["resident_bytes"] / 1e6),
    )
    for axis, (label, value) in zip(axes, panels):
        for offset, name in enumerate(PATHS):
            values = [
                next(
                    (
                        value(r)
                        for r in result["rows"]
                        if r["model"] == m and r["path"] == name and value(r) is not None
                    ),
                    np.nan,
                )
                for m in models
            ]
            axis.bar(
                np.arange(len(models)) + BAR * (offset - (len(PATHS) - 1) / 2),
                values,
                0.94 * BAR,
                label=name,
            )
        axis.set_yscale("log")
        axis.set_ylabel(label)
    axes[-1].set_xticks(np.arange(len(models)), models)
    axes[0].legend(ncols=len(PATHS), fontsize=8)
    axes[0].set_title(f"{result['device']['name']}, {WIDTH} x {HEIGHT}")
    figure.savefig(path, dpi=110)
    return path


def summary(result: dict) -> str:
    """The tables and ratios to print."""
    tables = [
        f"culling {'on' if culling else 'off'}\n\n{table(result['rows'], culling)}"
        for culling in (False, True)
    ]
    return "\n".join([*tables, *map(str, result["ratios"])])


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_files(parser)
    parser.add_argument(
        "--paths", nargs="+", choices=PATHS, default=list(PATHS), help="(default: all)"
    )
    parser.add_argument("--device", help="number or part of the name (default: the first GPU)")
    parser.add_argument(
        "--ring", type=int, metavar="N", help="most slots of path stream (default: the renderer's)"
    )
    parser.add_argument(
        "--overlap",
        action=argparse.BooleanOptionalAction,
        help="path stream decodes on a second queue (default: the renderer's choice)",
    )
    parser.add_argument(
        "--frames", type=int, default=FRAMES, help="timed frames of each path (default %(default)s)"
    )
    parser.add_argument(
        "--statistics", action="store_true", help="keep the driver's statistics of each shader"
    )


check = check_model_files
