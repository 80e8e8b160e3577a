"""Pictures of a compressed model: meshlets, original beside decompressed, shares of the bits.

Needs matplotlib (the "demo" extra).
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from PIL import Image

from gltf_ext.commands.inspect import CATEGORY_LABELS
from gltf_ext.files import write_files
from gltf_meshlet.demo.rasterizer import Camera, Mesh, rasterize

CATEGORY_COLORS = {
    "connectivity": "#4477aa",
    "references_and_headers": "#66ccee",
    "positions": "#228833",
    "normals": "#ccbb44",
    "texcoords": "#ee6677",
    "other": "#aa3377",
}
RAW_COLOR, COMPRESSED_COLOR = "#bbbbbb", "#333333"
PALETTE_SIZE = 256


def meshlet_colors(meshlets: np.ndarray) -> np.ndarray:
    """Linear RGB float[T, 3] for meshlet numbers int[T]. Successive numbers get different hues."""
    # Multiples of the golden ratio and of the plastic number spread evenly over [0, 1).
    hue = meshlets * 0.61803398875 % 1
    value = 0.55 + 0.3 * (meshlets * 0.7548776662 % 1)
    wheel = np.clip(np.abs((hue[:, None] + [0, 2 / 3, 1 / 3]) % 1 * 6 - 3) - 1, 0, 1)
    colors: np.ndarray = value[:, None] * (0.45 + 0.55 * wheel)
    return colors


def save_picture(path: str | Path, mesh: Mesh, camera: Camera, width: int, height: int) -> None:
    """Writes a PNG of the mesh on white, with a palette to keep the file small."""
    picture = _on_white(rasterize(mesh, camera, width, height))
    content = BytesIO()
    picture.quantize(PALETTE_SIZE, method=Image.Quantize.MAXCOVERAGE).save(content, "png")
    write_files({Path(path): [content.getvalue()]})


def save_comparison(
    path: str | Path, pictures: list[tuple[str, Mesh]], camera: Camera, width: int, height: int
) -> None:
    """Writes a PNG of two meshes seen by one camera, and of the difference of the pictures.

    width, height: pixels of each picture.
    """
    dpi, title_height = 100, 44
    figure, axes = pyplot.subplots(
        1,
        len(pictures) + 1,
        dpi=dpi,
        squeeze=False,
        figsize=(width * (len(pictures) + 1) / dpi, (height + title_height) / dpi),
    )
    figure.subplots_adjust(0, 0, 1, height / (height + title_height), wspace=0)
    drawn = [_on_white(rasterize(mesh, camera, width, height)) for _, mesh in pictures]
    for axis, (title, _), picture in zip(axes[0], pictures, drawn):
        axis.imshow(picture, interpolation="none")
        axis.set_title(title, fontsize=13)
    _draw_difference(figure, axes[0, -1], *(np.asarray(picture, np.int64) for picture in drawn))
    for axis in axes[0]:
        axis.set_axis_off()
    _save_figure(figure, path)


def _draw_difference(figure: Any, axis: Any, before: np.ndarray, after: np.ndarray) -> None:
    """A heat map of the largest difference of each pixel's channels, of 255."""
    difference = np.abs(after - before).max(axis=2)
    heat = axis.imshow(
        difference, cmap="magma_r", vmin=0, vmax=max(int(difference.max()), 1), interpolation="none"
    )
    axis.set_title("difference of the pixels' colours, of 255", fontsize=13)
    figure.colorbar(heat, ax=axis, fraction=0.04, pad=0.01, shrink=0.8, location="left")


def save_size_breakdown(path: str | Path, name: str, totals: dict[str, Any]) -> None:
    """Writes a PNG of the raw and the compressed size, and of the bits of the latter.

    totals: inspect's "totals" (raw_bytes, compressed_bytes, ratio, bits_per_triangle).
    """
    figure, (whole, split) = pyplot.subplots(2, 1, figsize=(9, 4.4), dpi=100)
    bits = totals["bits_per_triangle"]
    sizes = [totals["raw_bytes"] / 1e6, totals["compressed_bytes"] / 1e6]
    whole.barh(["raw", "compressed"], sizes, color=[RAW_COLOR, COMPRESSED_COLOR], height=0.6)
    for row, size in enumerate(sizes):
        whole.text(size, row, f"  {size:.2f} MB", va="center")
    whole.set_title(
        f"{name}: {totals['ratio']:.1f} times smaller, {bits['total']:.1f} bits per triangle",
        loc="left",
    )
    whole.invert_yaxis()
    whole.set_xlabel("MB")
    whole.margins(x=0.12)
    start = 0.0
    for category, color in CATEGORY_COLORS.items():
        if bits[category]:
            split.barh(
                [0],
                [bits[category]],
                left=start,
                color=color,
                height=0.6,
                label=CATEGORY_LABELS[category],
            )
            if bits[category] > 0.04 * bits["total"]:
                split.text(
                    start + bits[category] / 2, 0, f"{bits[category]:.1f}", ha="center", va="center"
                )
            start += bits[category]
    split.set_yticks([])
    split.set_xlim(0, bits["total"])
    split.set_xlabel("bits per triangle")
    split.legend(ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.5), frameon=False)
    for axis in (whole, split):
        axis.spines[["top", "right", "left"]].set_visible(False)
    figure.tight_layout()
    _save_figure(figure, path)


def _on_white(picture: np.ndarray) -> Image.Image:
    white = Image.new("RGBA", picture.shape[1::-1], "white")
    white.alpha_composite(Image.fromarray(picture))
    return white.convert("RGB")


def _save_figure(figure: Any, path: str | Path) -> None:
    content = BytesIO()
    figure.savefig(content, format="png")
    pyplot.close(figure)
    write_files({Path(path): [content.getvalue()]})
