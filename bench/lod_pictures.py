"""Pictures of docs/lod.md: the levels of the dragon, and what a pixel error needs.

    python -m bench lod_pictures

Draws docs/lod.png (four levels in the colours of their meshlets) and docs/lod_pixels.png (triangles
and bytes over the error, from bench/results/lod.json) of the dragon.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import gltf_ext
from bench.common import BITS, DOCS, pyplot, read_result
from bench.models import real_model
from gltf_ext.lod import Cut, LodPrimitive, cut_at_level, open_lod
from gltf_meshlet.demo.model import meshlet_colors
from tools.rasterizer import Camera, Mesh, rasterize

LEVELS = (0, 1, 2, 3)
WIDTH, HEIGHT = 1000, 840  # of one level, before it is cropped
PIXELS = 1000  # of the longest side


def coloured(primitive: LodPrimitive, cut: Cut) -> Mesh:
    """The cut with a colour for each meshlet."""
    mesh = primitive.mesh(cut)
    drawn = np.flatnonzero(cut.drawn)
    meshlet = np.repeat(drawn, primitive.cluster_triangles[drawn])
    positions = mesh.attributes["POSITION"].astype(np.float64)
    return Mesh(
        positions, mesh.attributes["NORMAL"], mesh.indices, meshlet_colors(meshlet), meshlet
    )


def draw_levels(primitive: LodPrimitive, path: Path) -> None:
    """Saves a picture of LEVELS in two rows, with titles, cropped to the model."""
    points = primitive.compressed.decode().attributes["POSITION"]
    low, high = points.min(axis=0), points.max(axis=0)
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    eye = centre + np.array([0.35, 0.25, 1.6]) * size
    camera = Camera(tuple(eye.tolist()), tuple(centre.tolist()))
    plots = pyplot()
    figure, axes = plots.subplots(2, len(LEVELS) // 2, figsize=(10, 8.2), layout="constrained")
    pictures = []
    for level in LEVELS:
        mesh = coloured(primitive, cut_at_level(primitive.tables, level))
        pixels = rasterize(mesh, camera, WIDTH, HEIGHT)
        pictures.append((f"level {level}: {len(mesh.triangles):,} triangles", pixels))
    rows, columns = np.nonzero(np.any([pixels[..., 3] for _, pixels in pictures], axis=0))
    shown = (slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1))
    for ax, (title, pixels) in zip(axes.ravel(), pictures):
        ax.imshow(pixels[shown])
        ax.set_title(title)
        ax.axis("off")
    figure.savefig(path, dpi=100)
    Image.open(path).convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE).save(path)


def draw_needs(rows: list[dict], path: Path) -> None:
    """Saves a plot of triangles and bytes over the error in pixels, from `bench lod`'s sweep."""
    plots = pyplot()
    figure, axes = plots.subplots(1, 2, figsize=(10, 4), layout="constrained", sharex=True)
    pixels = [row["pixels"] for row in rows]
    for ax, title, values, unit in (
        (axes[0], "triangles drawn", "triangles", 1),
        (axes[1], "MB held", "bytes", 1e6),
    ):
        for name, column, style in (
            ("levels of detail", values, "o-"),
            ("those of the earlier builder", f"before_{values}", "^:"),
            ("discrete chain, whole models", f"chain_{values}", "s--"),
        ):
            if column not in rows[0]:
                continue  # measured without --before
            ax.loglog(pixels, [row[column] / unit for row in rows], style, markersize=3, label=name)
        ax.axvline(1.0, color="gray", linewidth=0.8, linestyle=":")
        ax.set_title(f"dragon: {title}")
        ax.set_xlabel(f"error in pixels, longest side {PIXELS} pixels")
        ax.set_xticks([0.5, 1, 2, 4, 8], minor=False)
        ax.set_xticks([], minor=True)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_major_formatter("{x:,.10g}")
        ax.grid(True, which="major", alpha=0.3)
    axes[0].legend()
    figure.savefig(path, dpi=100)


def draw_all() -> list[Path]:
    """docs/lod.png and docs/lod_pixels.png."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out.glb"
        gltf_ext.compress(real_model("dragon"), output, lod=True, **BITS)
        primitive = open_lod(output)[0]
    if not isinstance(primitive, LodPrimitive):
        raise SystemExit("bench lod_pictures: the model has no levels")
    draw_levels(primitive, levels := DOCS / "lod.png")
    draw_needs(read_result("lod")["sweeps"]["dragon"], needs := DOCS / "lod_pixels.png")
    return [levels, needs]
