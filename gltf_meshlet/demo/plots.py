"""Pictures of what compression did: meshlets in colour, original beside decompressed, and where the bits went.

Needs matplotlib (the "demo" extra).
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402  (the backend must be chosen first)
from PIL import Image  # noqa: E402

from gltf_ext.files import write_files  # noqa: E402
from gltf_meshlet.demo.rasterizer import Camera, Mesh, render  # noqa: E402

PARTS = {  # inspect's keys, the label and the colour of each
    "connectivity": ("connectivity", "#4477aa"),
    "references_and_headers": ("references and headers", "#66ccee"),
    "positions": ("positions", "#228833"),
    "normals": ("normals", "#ccbb44"),
    "texcoords": ("texture coordinates", "#ee6677"),
    "other": ("other", "#aa3377"),
}
RAW_COLOR, COMPRESSED_COLOR = "#bbbbbb", "#333333"
PALETTE_SIZE = 256


def meshlet_colors(meshlets: np.ndarray) -> np.ndarray:
    """Colours float[T, 3] (linear RGB) for meshlet numbers int[T]; successive numbers look different."""
    hue = meshlets * 0.61803398875 % 1
    value = 0.55 + 0.3 * (meshlets * 0.7548776662 % 1)
    wheel = np.clip(np.abs((hue[:, None] + [0, 2 / 3, 1 / 3]) % 1 * 6 - 3) - 1, 0, 1)
    return value[:, None] * (0.45 + 0.55 * wheel)


def save_picture(path: str | Path, mesh: Mesh, camera: Camera, width: int, height: int) -> None:
    """Writes a PNG of the mesh on white, with a palette so that the file stays small."""
    picture = _on_white(render(mesh, camera, width, height))
    content = BytesIO()
    picture.quantize(PALETTE_SIZE, method=Image.Quantize.MAXCOVERAGE).save(content, "png")
    write_files({Path(path): [content.getvalue()]})


def save_comparison(
    path: str | Path, pictures: list[tuple[str, Mesh]], camera: Camera, width: int, height: int
) -> None:
    """Writes a PNG of two meshes seen by one camera, width x height pixels each, and of where the pictures differ."""
    dpi, title_height = 100, 44
    figure, axes = pyplot.subplots(
        1,
        len(pictures) + 1,
        dpi=dpi,
        squeeze=False,
        figsize=(width * (len(pictures) + 1) / dpi, (height + title_height) / dpi),
    )
    figure.subplots_adjust(0, 0, 1, height / (height + title_height), wspace=0)
    drawn = [_on_white(render(mesh, camera, width, height)) for _, mesh in pictures]
    for axis, (title, _), picture in zip(axes[0], pictures, drawn):
        axis.imshow(picture, interpolation="none")
        axis.set_title(title, fontsize=13)
    _draw_difference(figure, axes[0, -1], *(np.asarray(picture, np.int64) for picture in drawn))
    for axis in axes[0]:
        axis.set_axis_off()
    _save_figure(figure, path)


def _draw_difference(figure, axis, before: np.ndarray, after: np.ndarray) -> None:
    """A heat map of the largest difference of each pixel's channels, of 255."""
    difference = np.abs(after - before).max(axis=2)
    heat = axis.imshow(
        difference, cmap="magma_r", vmin=0, vmax=max(int(difference.max()), 1), interpolation="none"
    )
    axis.set_title("difference of the pixels' colours, of 255", fontsize=13)
    figure.colorbar(heat, ax=axis, fraction=0.04, pad=0.01, shrink=0.8, location="left")


def save_size_breakdown(path: str | Path, name: str, totals: dict) -> None:
    """Writes a PNG with the compressed size split into its parts, above it beside the raw size.

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
    for part, (label, color) in PARTS.items():
        if bits[part]:
            split.barh([0], [bits[part]], left=start, color=color, height=0.6, label=label)
            if bits[part] > 0.04 * bits["total"]:
                split.text(start + bits[part] / 2, 0, f"{bits[part]:.1f}", ha="center", va="center")
            start += bits[part]
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


def _save_figure(figure, path) -> None:
    content = BytesIO()
    figure.savefig(content, format="png")
    pyplot.close(figure)
    write_files({Path(path): [content.getvalue()]})
