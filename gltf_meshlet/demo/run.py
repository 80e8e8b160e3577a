"""`gltf-meshlet demo`: compresses, decompresses and verifies a generated model; draws pictures."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo.rasterizer import Camera, Mesh
from gltf_meshlet.report_text import compress_summary, inspect_table, verify_text

CAMERA = Camera(eye=(-1.55, 2.9, 5.8), target=(0.0, 0.24, 0.0), field_of_view=25.8)
RENDERED = (512, 384, 36)  # width, height, samples per pixel

Report = dict[str, Any]


@dataclass(frozen=True)
class Files:
    """The models that the demo writes."""

    original: Path
    compressed: Path
    decompressed: Path


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `demo`."""
    command.add_argument(
        "output",
        metavar="FOLDER",
        nargs="?",
        default="demo-output",
        help="where to save (default %(default)s)",
    )


def run(options: argparse.Namespace) -> int:
    """Runs the demo, writes into a folder (created if missing) and prints its reports.

    Returns the exit status. Raises MeshletError, OSError.
    """
    folder = Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    names = ("original", "compressed", "decompressed")
    files = Files(*(folder / f"{name}.glb" for name in names))
    primitives = demo_model.generate()
    demo_model.write_glb(primitives, files.original)
    seconds: dict[str, float] = {}

    def timed(name: str, run: Callable[[], Report]) -> Report:
        start = time.perf_counter()
        report = run()
        seconds[name] = time.perf_counter() - start
        return report

    report = timed("compress", lambda: gltf_ext.compress(files.original, files.compressed))
    timed("decompress", lambda: gltf_ext.decompress(files.compressed, files.decompressed))
    verified = timed("verify", lambda: gltf_ext.verify(files.original, files.compressed))
    inspected = gltf_ext.inspect(files.compressed)
    print(compress_summary(report))
    print(inspect_table(inspected, all_primitives=True))
    print(f"verified: {verify_text(verified)}")
    print("seconds:", ", ".join(f"{name} {value:.2f}" for name, value in seconds.items()))
    saved = [f"{name}.glb" for name in names]
    saved += _save_pictures(folder, primitives, files, inspected["totals"])
    saved += _save_renders(folder, files, inspected["totals"])
    print(f"\nsaved in {folder}: {', '.join(saved)}")
    return 0 if verified["ok"] else 1


def _save_pictures(
    folder: Path, primitives: list[demo_model.Primitive], files: Files, totals: Report
) -> list[str]:
    """Saves the pictures that need matplotlib, if it is there; returns the names of the files."""
    try:
        from gltf_meshlet.demo import plots
    except ImportError as error:
        print(f"no pictures: {error.name} is missing; pip install matplotlib")
        return []
    colors = [primitive.color for primitive in primitives]
    before, after = (_mesh(path, colors) for path in (files.original, files.decompressed))
    meshlets = _meshlet_numbers(files.compressed)
    colored = Mesh(
        after.positions, after.normals, after.triangles, plots.meshlet_colors(meshlets), meshlets
    )
    plots.save_picture(folder / "meshlets.png", colored, CAMERA, 860, 660)
    pictures = [
        (f"original: {totals['raw_bytes'] / 1e6:.2f} MB", before),
        (f"decompressed from {totals['compressed_bytes'] / 1e6:.2f} MB", after),
    ]
    plots.save_comparison(folder / "comparison.png", pictures, CAMERA, 560, 430)
    plots.save_size_breakdown(folder / "size.png", "the demo's model", totals)
    return ["meshlets.png", "comparison.png", "size.png"]


def _save_renders(folder: Path, files: Files, totals: Report) -> list[str]:
    """Saves Mitsuba's pictures of both files, if it is there; returns the names of the files."""
    try:
        from gltf_meshlet.demo import studio
    except ImportError as error:
        print(f"not rendered with Mitsuba: {error}")
        return []
    print("rendering with Mitsuba (a minute)", flush=True)
    raw, compressed = (f"{totals[name] / 1e6:.2f} MB" for name in ("raw_bytes", "compressed_bytes"))
    captions = (f"original, {raw}", f"compressed, {compressed}, decoded where rays meet it")
    names = ["render_original.png", "render_compressed.png"]
    pictures = [studio.picture(p, CAMERA, *RENDERED) for p in (files.original, files.compressed)]
    for name, pixels in zip(names, pictures):
        studio.save(folder / name, pixels)
    studio.save_side_by_side(folder / "render_comparison.png", list(zip(captions, pictures)))
    return [*names, "render_comparison.png"]


def _mesh(path: Path, colors: list[tuple[float, float, float]]) -> Mesh:
    """One mesh of all primitives of a file, in these colours."""
    primitives = gltf_ext.load(path)
    first = np.cumsum([0, *(p.vertex_count for p in primitives)])
    return Mesh(
        np.concatenate([p.attributes["POSITION"] for p in primitives]).astype(np.float64),
        np.concatenate([p.attributes["NORMAL"] for p in primitives]).astype(np.float64),
        np.concatenate([p.indices + start for p, start in zip(primitives, first)]),
        np.repeat(colors, [len(p.indices) for p in primitives], axis=0),
    )


def _meshlet_numbers(path: Path) -> np.ndarray:
    """int64[T]: the meshlet of each triangle of a compressed file, in decoding order."""
    sizes = [
        len(decoder.decode_meshlet(number)[0])
        for decoder in gltf_ext.decoders(path)
        for number in range(decoder.meshlet_count)
    ]
    return np.repeat(np.arange(len(sizes)), sizes)
