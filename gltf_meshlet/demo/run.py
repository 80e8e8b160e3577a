"""`gltf-meshlet demo`: a first look. Generates a model, compresses, decompresses and verifies it, and draws pictures."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import gltf_ext
from gltf_meshlet.cli import PART_LABELS
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo.rasterizer import Camera, Mesh

CAMERA = Camera(eye=(-1.55, 2.9, 5.8), target=(0.0, 0.24, 0.0), field_of_view=25.8)
RENDERED = (512, 384, 36)  # width, height, samples per pixel


def main(output_dir: str | Path = "demo-output") -> int:
    """Runs the demo into a folder (made when missing) and prints a table; returns an exit status."""
    folder = Path(output_dir)
    folder.mkdir(parents=True, exist_ok=True)
    original, compressed, decompressed = (
        folder / f"{name}.glb" for name in ("original", "compressed", "decompressed")
    )
    parts = demo_model.generate()
    demo_model.write_glb(parts, original)
    seconds = {}
    for name, run in (
        ("compress", lambda: gltf_ext.compress(original, compressed)),
        ("decompress", lambda: gltf_ext.decompress(compressed, decompressed)),
        ("verify", lambda: gltf_ext.verify(original, compressed)),
    ):
        start = time.perf_counter()
        outcome = run()
        seconds[name] = time.perf_counter() - start
    totals = gltf_ext.inspect(compressed)["totals"]
    print(_table(totals, outcome, seconds))
    pictures = _save_pictures(folder, parts, compressed, decompressed, totals) + _save_renders(
        folder, original, compressed, totals
    )
    print(
        f"\nsaved in {folder}: {', '.join([original.name, compressed.name, decompressed.name, *pictures])}"
    )
    return 0 if outcome["ok"] else 1


def _table(totals: dict, verified: dict, seconds: dict) -> str:
    bits = totals["bits_per_triangle"]
    rows = [
        ("triangles, vertices", f"{totals['triangles']:,}, {totals['vertices']:,}"),
        (
            "meshlets",
            f"{totals['meshlets']:,} of {totals['mean_triangles_per_meshlet']:.1f} triangles on average",
        ),
        ("raw", f"{totals['raw_bytes']:,} bytes"),
        (
            "compressed",
            f"{totals['compressed_bytes']:,} bytes, {totals['ratio']:.2f} times smaller",
        ),
        ("bits per triangle", f"{bits['total']:.2f}"),
        *(
            (f"  {PART_LABELS.get(name, name.replace('_', ' '))}", f"{value:.2f}")
            for name, value in bits.items()
            if value and name != "total"
        ),
        *(
            (
                f"largest error, {name}",
                f"{value:.3g}, {verified['max_error_percent'][name]:.3g} % of the box's diagonal",
            )
            for name, value in verified["max_error"].items()
            if name not in verified["max_error_degrees"]
        ),
        *(
            (f"largest error, {name}", f"{value:.2f} degrees")
            for name, value in verified["max_error_degrees"].items()
        ),
        (
            "verified",
            "yes: the same triangles, every error within its bits" if verified["ok"] else "NO",
        ),
        ("seconds", ", ".join(f"{name} {value:.2f}" for name, value in seconds.items())),
    ]
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:{width}}  {text}" for label, text in rows)


def _save_pictures(
    folder: Path, parts, compressed: Path, decompressed: Path, totals: dict
) -> list[str]:
    """Draws what can be drawn; returns the names of the files written."""
    try:
        from gltf_meshlet.demo import plots
    except ImportError as error:
        print(f"no pictures: {error.name} is missing; pip install matplotlib")
        return []
    primitives = gltf_ext.load(decompressed)
    colors = np.repeat(
        [part.color for part in parts], [len(part.triangles) for part in parts], axis=0
    )
    before = _mesh([(part.positions, part.normals, part.triangles) for part in parts], colors)
    triangle_counts = [len(primitive.indices) for primitive in primitives]
    after = _mesh(
        [
            (primitive.attributes["POSITION"], primitive.attributes["NORMAL"], primitive.indices)
            for primitive in primitives
        ],
        np.repeat([part.color for part in parts], triangle_counts, axis=0),
    )
    meshlets = _meshlet_numbers(compressed)
    colored = Mesh(
        after.positions, after.normals, after.triangles, plots.meshlet_colors(meshlets), meshlets
    )
    plots.save_picture(folder / "meshlets.png", colored, CAMERA, 860, 660)
    plots.save_comparison(
        folder / "comparison.png",
        [
            (f"original: {totals['raw_bytes'] / 1e6:.2f} MB", before),
            (f"decompressed from {totals['compressed_bytes'] / 1e6:.2f} MB", after),
        ],
        CAMERA,
        560,
        430,
    )
    plots.save_size_breakdown(folder / "size.png", "the demo's model", totals)
    return ["meshlets.png", "comparison.png", "size.png"]


def _save_renders(folder: Path, original: Path, compressed: Path, totals: dict) -> list[str]:
    """The compressed file and the original as Mitsuba renders them; returns the names of the files written."""
    try:
        from gltf_meshlet.demo import studio as studio
    except ImportError as error:
        print(f"not rendered with Mitsuba: {error}")
        return []
    print("rendering with Mitsuba (a minute)", flush=True)
    captions = {
        "render_original": (original, f"original, {totals['raw_bytes'] / 1e6:.2f} MB"),
        "render_compressed": (
            compressed,
            f"compressed, {totals['compressed_bytes'] / 1e6:.2f} MB, decoded where rays meet it",
        ),
    }
    drawn = {name: studio.picture(path, CAMERA, *RENDERED) for name, (path, _) in captions.items()}
    for name, pixels in drawn.items():
        studio.save(folder / f"{name}.png", pixels)
    studio.save_side_by_side(
        folder / "render_comparison.png",
        [(caption, drawn[name]) for name, (_, caption) in captions.items()],
    )
    return [*(f"{name}.png" for name in captions), "render_comparison.png"]


def _mesh(pieces, colors) -> Mesh:
    """One mesh of pieces (positions, normals, triangles), with its triangles' colours."""
    first = np.cumsum([0] + [len(positions) for positions, _, _ in pieces])
    return Mesh(
        np.concatenate([positions for positions, _, _ in pieces]).astype(np.float64),
        np.concatenate([normals for _, normals, _ in pieces]).astype(np.float64),
        np.concatenate([triangles + start for (_, _, triangles), start in zip(pieces, first)]),
        colors,
    )


def _meshlet_numbers(path: Path) -> np.ndarray:
    """For each triangle of a compressed file, in the order it decodes, the number of its meshlet: int64 [T]."""
    sizes = [
        len(decoder.decode_meshlet(number)[0])
        for decoder in gltf_ext.decoders(path)
        for number in range(decoder.meshlet_count)
    ]
    return np.repeat(np.arange(len(sizes)), sizes)
