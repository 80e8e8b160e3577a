"""`gltf-meshlet demo`: compresses, decompresses and verifies a generated model; draws pictures."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo.rasterizer import Camera, Mesh
from gltf_meshlet.report_text import labelled_parts

CAMERA = Camera(eye=(-1.55, 2.9, 5.8), target=(0.0, 0.24, 0.0), field_of_view=25.8)
RENDERED = (512, 384, 36)  # width, height, samples per pixel

Report = dict[str, Any]


@dataclass(frozen=True)
class Files:
    """The models that the demo writes."""

    original: Path
    compressed: Path
    decompressed: Path


def main(output_dir: str | Path = "demo-output") -> int:
    """Runs the demo, writes into a folder (created if missing) and prints a table.

    Returns the exit status. Raises MeshletError, OSError.
    """
    folder = Path(output_dir)
    folder.mkdir(parents=True, exist_ok=True)
    names = ("original", "compressed", "decompressed")
    files = Files(*(folder / f"{name}.glb" for name in names))
    parts = demo_model.generate()
    demo_model.write_glb(parts, files.original)
    seconds: dict[str, float] = {}

    def timed(name: str, run: Callable[[], Report]) -> Report:
        start = time.perf_counter()
        report = run()
        seconds[name] = time.perf_counter() - start
        return report

    timed("compress", lambda: gltf_ext.compress(files.original, files.compressed))
    timed("decompress", lambda: gltf_ext.decompress(files.compressed, files.decompressed))
    verified = timed("verify", lambda: gltf_ext.verify(files.original, files.compressed))
    totals = gltf_ext.inspect(files.compressed)["totals"]
    print(_table(totals, verified, seconds))
    saved = [f"{name}.glb" for name in names]
    saved += _save_pictures(folder, parts, files, totals)
    saved += _save_renders(folder, files, totals)
    print(f"\nsaved in {folder}: {', '.join(saved)}")
    return 0 if verified["ok"] else 1


def _table(totals: Report, verified: Report, seconds: dict[str, float]) -> str:
    bits = totals["bits_per_triangle"]
    mean = f"{totals['mean_triangles_per_meshlet']:.1f} triangles on average"
    smaller = f"{totals['ratio']:.2f} times smaller"
    verdict = "yes: the same triangles, every error within its bits" if verified["ok"] else "NO"
    rows = [
        ("triangles, vertices", f"{totals['triangles']:,}, {totals['vertices']:,}"),
        ("meshlets", f"{totals['meshlets']:,} of {mean}"),
        ("raw", f"{totals['raw_bytes']:,} bytes"),
        ("compressed", f"{totals['compressed_bytes']:,} bytes, {smaller}"),
        ("bits per triangle", f"{bits['total']:.2f}"),
        *((f"  {label}", f"{value:.2f}") for label, value in labelled_parts(bits)),
        *_error_rows(verified),
        ("verified", verdict),
        ("seconds", ", ".join(f"{name} {value:.2f}" for name, value in seconds.items())),
    ]
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:{width}}  {text}" for label, text in rows)


def _error_rows(verified: Report) -> list[tuple[str, str]]:
    """Distances, then angles."""
    degrees = verified["max_error_degrees"]
    percent = verified["max_error_percent"]
    distances = [
        (
            f"largest error, {name}",
            f"{value:.3g}, {percent[name]:.3g} % of the box's diagonal",
        )
        for name, value in verified["max_error"].items()
        if name not in degrees
    ]
    angles = [(f"largest error, {name}", f"{value:.2f} degrees") for name, value in degrees.items()]
    return distances + angles


def _save_pictures(
    folder: Path, parts: list[demo_model.Part], files: Files, totals: Report
) -> list[str]:
    """Saves the pictures that need matplotlib, if it is there; returns the names of the files."""
    try:
        from gltf_meshlet.demo import plots
    except ImportError as error:
        print(f"no pictures: {error.name} is missing; pip install matplotlib")
        return []
    before = _mesh(
        [(part.positions, part.normals, part.triangles) for part in parts],
        _colors(parts, [len(part.triangles) for part in parts]),
    )
    primitives = gltf_ext.load(files.decompressed)
    after = _mesh(
        [(p.attributes["POSITION"], p.attributes["NORMAL"], p.indices) for p in primitives],
        _colors(parts, [len(p.indices) for p in primitives]),
    )
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
    captioned = []
    names = []
    for name, path, caption in (
        ("render_original.png", files.original, f"original, {raw}"),
        (
            "render_compressed.png",
            files.compressed,
            f"compressed, {compressed}, decoded where rays meet it",
        ),
    ):
        pixels = studio.picture(path, CAMERA, *RENDERED)
        studio.save(folder / name, pixels)
        captioned.append((caption, pixels))
        names.append(name)
    studio.save_side_by_side(folder / "render_comparison.png", captioned)
    return [*names, "render_comparison.png"]


def _colors(parts: list[demo_model.Part], triangle_counts: list[int]) -> np.ndarray:
    """Each part's colour for each of its triangles."""
    return np.repeat([part.color for part in parts], triangle_counts, axis=0)


def _mesh(pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray]], colors: np.ndarray) -> Mesh:
    """One mesh of pieces (positions, normals, triangles), with its triangles' colours."""
    first = np.cumsum([0] + [len(positions) for positions, _, _ in pieces])
    return Mesh(
        np.concatenate([positions for positions, _, _ in pieces]).astype(np.float64),
        np.concatenate([normals for _, normals, _ in pieces]).astype(np.float64),
        np.concatenate([triangles + start for (_, _, triangles), start in zip(pieces, first)]),
        colors,
    )


def _meshlet_numbers(path: Path) -> np.ndarray:
    """int64[T]: the meshlet of each triangle of a compressed file, in decoding order."""
    sizes = [
        len(decoder.decode_meshlet(number)[0])
        for decoder in gltf_ext.decoders(path)
        for number in range(decoder.meshlet_count)
    ]
    return np.repeat(np.arange(len(sizes)), sizes)
