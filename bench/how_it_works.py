"""How does the format work? One meshlet in four panels: cut, walk, predict, store.

Writes docs/how_it_works.png. The model is bench/generated.py's torus at the default options; the
meshlet is an ordinary one (see `choose`), decoded by spec/reference_decoder.py. All shapes and
figures come from the compressed bytes. The picture carries a digest of its figures, so that a test
finds an outdated picture.
"""

from __future__ import annotations

import tempfile
import textwrap
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from unittest import mock

import numpy as np
from matplotlib import patheffects
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import gltf_ext
from bench.common import DOCS, pyplot, save_figure
from bench.generated import torus
from bench.size import FIELDS
from gltf_ext.commands.inspect import INDEX_BYTES_PER_TRIANGLE
from gltf_ext.compression.extension import require_compressed
from gltf_ext.gltf.importers import open_model
from gltf_meshlet.demo import model as demo_model
from gltf_meshlet.demo.plots import meshlet_colors
from gltf_meshlet.demo.rasterizer import LIGHT, Camera, Mesh, rasterize
from spec import predictors, reference_decoder
from spec.reference_decoder import FOREIGN, OWNED, PRIVATE, Decoder, Meshlet, dequantise

TRIANGLES = 6000  # few, so that meshlets look large
TITLES = ("Cut", "Walk", "Predict", "Store")

# Layout
SIZE, DPI = (16, 6.6), 100  # inches, pixels per inch
BOTTOM, TOP, WIDTH = 0.39, 0.92, 0.24  # the panels, in shares of the picture's height and width
LINE = 0.222 / SIZE[1]  # height of a text line, in shares of the picture's height
LETTERS_PER_LINE = 44
TITLE, TEXT, SMALL = 17, 12.5, 12  # points

# Camera
DISTANCE = 3.0  # from the eye to the model, in widths of the model
VIEW = 18.5  # field of view in degrees

# The colours of Okabe and Ito, which colour-blind readers can tell apart
BLUE = "#0072b2"
ORANGE = "#e69f00"
GREEN = "#009e73"
RED = "#d55e00"
PURPLE = "#cc79a7"
SKY = "#56b4e9"
YELLOW = "#f0e442"
INK = "#222222"
GRAY = "#aaaaaa"
PALE = "#f2f2f2"
HIGHLIGHT = (0.03, 0.03, 0.03)  # linear RGB
LETTERS = {
    "C": (SKY, "a new vertex inside: goes right"),
    "R": (GREEN, "nothing new on the right: goes left"),
    "L": (YELLOW, "nothing new on the left: goes right"),
    "S": (PURPLE, "splits: goes right, later left"),
    "E": (RED, "nothing new on either side: ends"),
}
RUNS = {
    OWNED: (BLUE, "boundary stored here"),
    FOREIGN: (ORANGE, "boundary read from a neighbour"),
    PRIVATE: (PURPLE, "boundary that both sides store"),
}
ANCHOR = {
    "marker": "s",
    "markersize": 11,
    "color": BLUE,
    "markeredgecolor": INK,
    "markeredgewidth": 1.5,
    "linestyle": "none",
}
CORNER = {**ANCHOR, "color": "white", "markeredgecolor": ORANGE, "markeredgewidth": 2.5}
GUESS = {
    "marker": "o",
    "markersize": 8,
    "color": "white",
    "markeredgecolor": INK,
    "markeredgewidth": 1.5,
    "linestyle": "none",
}
HALO = patheffects.withStroke(linewidth=2.5, foreground="white")
# Parts of a meshlet's bits: label, colour and the first words of their fields' names
SECTIONS = {
    "head": (GRAY, ("T - 1", "refs", "LOOPS", "PRIVATE", "SEAMS")),
    "symbols": (INK, FIELDS["connectivity"]),
    "references": (ORANGE, FIELDS["references"]),
    "choice of codes": (GRAY, FIELDS["codes"]),
    "anchors": (BLUE, FIELDS["anchors"]),
    "chains": (BLUE, FIELDS["chains"]),
    "interior: unary": (GREEN, ("unary of interior",)),
    "interior: low bits": (GREEN, ("low of interior",)),
}
PLACE = "entry, padding"  # the meshlet's entry in its group, and the unused bits at its end


# --- the meshlet ---


@dataclass(frozen=True)
class Example:
    """One meshlet, decoded.

    flat: float64[V, 2], the points projected onto their least-squares plane, seen from outside
    axes: float64[3, 3], rows: right, up, and towards the viewer
    center: float64[3], the mean of the points
    """

    decoder: Decoder
    meshlet: Meshlet
    flat: np.ndarray
    axes: np.ndarray
    center: np.ndarray

    def flattened(self, points: np.ndarray) -> np.ndarray:
        """Projects points [..., 3] onto the plane: [..., 2]."""
        return (points - self.center) @ self.axes[:2].T


def compressed_model() -> Decoder:
    """The model, from a file that `compress` writes with its default options."""
    with tempfile.TemporaryDirectory() as folder:
        source, output = Path(folder) / "in.glb", Path(folder) / "out.glb"
        demo_model.write_glb([torus(TRIANGLES)], source)
        gltf_ext.compress(source, output)
        (compressed,) = require_compressed(open_model(output))
    return Decoder(compressed.blob)


def choose(decoder: Decoder) -> Example:
    """The flat meshlet that shows everything with the most typical number of bits per triangle."""
    mean = 8 * len(decoder.file.data) / decoder.file.triangle_count
    candidates = [
        m for m in range(decoder.file.meshlet_count) if _shows_everything(decoder.file.meshlet(m))
    ]
    examples = [example for m in candidates if _lies_flat(example := flatten(decoder, m))]
    if not examples:
        raise SystemExit(
            "bench: no meshlet of the model has every letter and kind of border and lies flat; "
            "change TRIANGLES"
        )
    return min(
        examples,
        key=lambda e: abs(sum(section_bits(e).values()) / e.meshlet.triangle_count - mean),
    )


def _shows_everything(meshlet: Meshlet) -> bool:
    """All five letters and all kinds of runs in one disk, no seams, no runs shared with itself."""
    foreign = [reference for reference in meshlet.references if reference.kind == FOREIGN]
    return (
        set(meshlet.symbols) == set(LETTERS)
        and {reference.kind for reference in meshlet.references} == set(RUNS)
        and len(meshlet.connectivity.disks) == 1
        and not meshlet.has_seams
        and all(reference.owner != meshlet.index for reference in foreign)
    )


def _lies_flat(example: Example) -> bool:
    """True if no triangle flips in the projection and the light falls on the meshlet."""
    a, b, c = example.flat[np.array(example.meshlet.connectivity.triangles)].transpose(1, 2, 0)
    areas = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    return bool(areas.min() > 0 and example.axes[2] @ LIGHT > 0.5 * np.linalg.norm(LIGHT))


def decoded(decoder: Decoder, m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(triangles int[T, 3], points float64[V, 3], normals float64[V, 3]) of meshlet m."""
    triangles, values = decoder.meshlet(m)
    points, normals = (
        dequantise(decoder.file.streams[s], np.array(values[s])).astype(np.float64) for s in (0, 1)
    )
    return np.array(triangles), points, normals


def flatten(decoder: Decoder, m: int) -> Example:
    """Projects meshlet m onto its least-squares plane, with y as far up as the plane allows."""
    triangles, points, _ = decoded(decoder, m)
    center = points.mean(axis=0)
    corners = points[triangles]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    normal = np.linalg.svd(points - center)[2][2]
    normal *= np.sign(normal @ outward)
    right = np.cross([0.0, 1.0, 0.0], normal)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(normal, right), normal])
    return Example(decoder, decoder.file.meshlet(m), (points - center) @ axes[:2].T, axes, center)


def section_bits(example: Example) -> dict[str, int]:
    """Bits of each of SECTIONS, and of PLACE."""
    names: Counter = Counter()

    class CountingReader(reference_decoder.BitReader):
        def read(self, width, name):
            names[name] += width
            return super().read(width, name)

    file, m = example.decoder.file, example.meshlet.index
    with mock.patch.object(reference_decoder, "BitReader", CountingReader):
        Meshlet(file, m)  # reads all but the interior again
        example.decoder.meshlet(m)  # reads the interior; the decoder keeps the rest
    bits = {
        label: sum(n for name, n in names.items() if name.startswith(starts))
        for label, (_, starts) in SECTIONS.items()
    }
    data = 8 * (file.ends[m] - file.starts[m])
    group = file.groups[m // reference_decoder.MESHLETS_PER_GROUP]
    bits[PLACE] = group.entry_width + data - names.total()
    return bits


def raw_bits(example: Example) -> int:
    """Bits of the same triangles as plain glTF: 3 indices each, 32 bits per component of a vertex.

    Vertices of earlier meshlets do not count again.
    """
    decoder, meshlet = example.decoder, example.meshlet
    runs = [decoder.boundary(decoder.file.meshlet(m)) for m in range(meshlet.index + 1)]
    vertices = meshlet.connectivity.vertex_count - len(decoder.alias(meshlet, runs))
    elements = sum(
        3 if stream.kind == reference_decoder.OCT else stream.elements for stream in meshlet.streams
    )
    return 32 * elements * vertices + 8 * INDEX_BYTES_PER_TRIANGLE * meshlet.triangle_count


def figures(example: Example) -> dict:
    """Every number that the picture states."""
    raw, sections = raw_bits(example), section_bits(example)
    file = example.decoder.file
    return {
        "meshlet": example.meshlet.index,
        "meshlets": file.meshlet_count,
        "triangles": example.meshlet.triangle_count,
        "symbols": example.meshlet.symbols,
        "raw": raw,
        "sections": sections,
        "total": sum(sections.values()),
        "mean": 8 * len(file.data) / file.triangle_count,
    }


# --- the picture ---


def draw(path: Path) -> dict:
    """Writes the picture, 1600 pixels wide; returns its figures."""
    example = choose(compressed_model())
    numbers = figures(example)
    figure = pyplot().figure(figsize=SIZE, dpi=DPI)
    panels = [figure.add_axes((0.005 + 0.25 * k, BOTTOM, WIDTH, TOP - BOTTOM)) for k in range(4)]
    for k, (panel, title) in enumerate(zip(panels, TITLES)):
        panel.set_axis_off()
        figure.text(
            0.005 + 0.25 * k, 0.945, f"{k + 1}  {title}", fontsize=TITLE, weight="bold", color=INK
        )
    draw_model(panels[0], example, numbers)
    draw_walk(panels[1], example)
    draw_prediction(panels[2], example)
    draw_bits(panels[3], numbers)
    save_figure(figure, path, numbers, pil_kwargs={"optimize": True})
    return numbers


def draw_model(axis, example: Example, numbers: dict) -> None:
    """The model with coloured meshlets; the example is the dark one."""
    decoder = example.decoder
    triangles, points, normals = zip(
        *(decoded(decoder, m) for m in range(decoder.file.meshlet_count))
    )
    first = np.cumsum([0] + [len(p) for p in points])
    meshlet = np.repeat(np.arange(len(points)), [len(t) for t in triangles])
    colors = 0.3 + 0.7 * meshlet_colors(meshlet)
    colors[meshlet == example.meshlet.index] = HIGHLIGHT
    mesh = Mesh(
        np.concatenate(points),
        np.concatenate(normals),
        np.concatenate([t + n for t, n in zip(triangles, first)]),
        colors,
        meshlet,
    )
    center = (mesh.positions.min(axis=0) + mesh.positions.max(axis=0)) / 2
    towards = example.axes[2] + [0.0, 0.6, 0.0]
    eye = center + DISTANCE * np.ptp(mesh.positions, axis=0).max() * towards / np.linalg.norm(
        towards
    )
    axis.imshow(
        rasterize(mesh, Camera(tuple(eye), tuple(center), VIEW), 384, 384), interpolation="none"
    )
    _caption(
        axis,
        f"The mesh is cut into meshlets of at most 64 triangles, here {numbers['meshlets']}. Each "
        "is decoded on its own, when "
        f"it is needed. The dark one has {numbers['triangles']} triangles: see the next panels.",
    )


def draw_walk(axis, example: Example) -> None:
    """The flat meshlet with the letter of each triangle and the walk over them."""
    triangles = np.array(example.meshlet.connectivity.triangles)
    _mesh(axis, example, [LETTERS[symbol][0] for symbol in example.meshlet.symbols], alpha=0.4)
    middles = example.flat[triangles].mean(axis=1)
    steps = np.stack([middles[:-1], middles[1:]], axis=1)
    adjacent = np.array([len(set(s) & set(t)) == 2 for s, t in pairwise(triangles)])
    axis.add_collection(LineCollection(steps[adjacent], colors=INK, linewidths=1.0))
    axis.add_collection(
        LineCollection(steps[~adjacent], colors=INK, linewidths=1.0, linestyles=":")
    )
    for symbol, middle in zip(example.meshlet.symbols, middles):
        axis.text(
            *middle,
            symbol,
            ha="center",
            va="center",
            fontsize=SMALL,
            weight="bold",
            color=INK,
            path_effects=[HALO],
        )
    axis.plot(
        *middles[0],
        "o",
        markersize=19,
        markerfacecolor="none",
        markeredgecolor=INK,
        markeredgewidth=1.8,
    )
    legend = [
        (Patch(facecolor=color, alpha=0.4, edgecolor=GRAY), f"{letter}  {words}")
        for letter, (color, words) in LETTERS.items()
    ]
    legend.append(
        (Line2D([], [], color=INK, linewidth=1.0, linestyle=":"), "back to the left of an S")
    )
    _caption(
        axis,
        "A walk over the triangles starts at the circle. One symbol of 1 to 4 bits per triangle "
        "says where it goes next.",
        legend,
    )


def draw_prediction(axis, example: Example) -> None:
    """The flat meshlet: its border by kind of run, its anchors, and one prediction inside."""
    decoder, meshlet, flat = example.decoder, example.meshlet, example.flat
    _mesh(axis, example, PALE)
    runs = decoder.boundary(meshlet)
    for reference, run in zip(meshlet.references, runs):
        color = RUNS[reference.kind][0]
        axis.plot(
            *flat[run].T,
            "-o",
            color=color,
            linewidth=4.5,
            markersize=7,
            markeredgecolor="white",
            solid_capstyle="butt",
        )
    for j, run in enumerate(runs):
        axis.plot(*flat[run[0]], **(ANCHOR if meshlet.stores_corner(j, 0) else CORNER))
    inside = [v for v, *_ in decoder.traversed(meshlet, runs)]
    axis.plot(*flat[inside].T, "o", color=GREEN, markersize=6, markeredgecolor="white")
    v, a, b, o, predicted = ordinary_prediction(example)
    axis.fill(*flat[[a, o, b]].T, color=YELLOW, alpha=0.6, linewidth=0)
    axis.plot(*np.stack([flat[a], predicted, flat[b]]).T, "--", color=INK, linewidth=1.5)
    axis.annotate(
        "",
        flat[v],
        predicted,
        arrowprops={"arrowstyle": "-|>", "color": RED, "linewidth": 2, "shrinkA": 4, "shrinkB": 1},
    )
    axis.plot(*predicted, **GUESS)
    legend = [(Line2D([], [], color=color, linewidth=4.5), words) for color, words in RUNS.values()]
    legend += [
        (Line2D([], [], **ANCHOR), "corner stored here (anchor)"),
        (Line2D([], [], **CORNER), "corner read from a neighbour"),
        (Line2D([], [], **GUESS), "prediction; the arrow is stored"),
    ]
    _caption(
        axis,
        "Positions are predicted: along a boundary by steps toward its end, inside by completing "
        "the yellow triangle to a parallelogram. Only the differences are stored.",
        legend,
    )


def ordinary_prediction(example: Example) -> tuple[int, int, int, int, np.ndarray]:
    """(v, a, b, o, predicted) of a vertex inside with a fairly long residual, the upper quartile.

    predicted: float64[2], projected.
    """
    decoder, meshlet = example.decoder, example.meshlet
    stream, values = meshlet.streams[0], decoder.meshlet(meshlet.index)[1][0]
    order = decoder.traversed(meshlet, decoder.boundary(meshlet))
    inside = {v for v, *_ in order}
    found = []
    for v, a, b, o in order:
        if inside >= {a, b, o}:
            predicted = np.array(predictors.apex(stream.predictor, values, values, a, b, o, v))
            found.append(
                (v, a, b, o, example.flattened(dequantise(stream, predicted).astype(np.float64)))
            )
    return sorted(found, key=lambda row: np.linalg.norm(example.flat[row[0]] - row[4]))[
        3 * len(found) // 4
    ]


def draw_bits(axis, numbers: dict) -> None:
    """Above: bars of the plain and the compressed meshlet. Below: the sections of the latter."""
    triangles, raw, total = numbers["triangles"], numbers["raw"], numbers["total"]
    whole = axis.inset_axes((0.0, 0.74, 0.97, 0.26))
    colors = [color for color, _ in SECTIONS.values()] + [GRAY]
    sizes = list(numbers["sections"].values())
    whole.barh([0], [raw], color=GRAY, height=0.42)
    whole.barh([1] * len(sizes), sizes, left=np.cumsum(sizes) - sizes, color=colors, height=0.42)
    for row, (name, bits, digits) in enumerate(
        (("as plain glTF", raw, 0), ("compressed", total, 1))
    ):
        whole.text(
            0,
            row - 0.32,
            f"{name}: {bits:,} bits, {bits / triangles:.{digits}f} per triangle",
            fontsize=TEXT,
            color=INK,
        )
    whole.text(
        total, 1.0, f"  {raw / total:.1f} times smaller", va="center", fontsize=TEXT, color=INK
    )
    whole.set_ylim(1.25, -0.75)
    parts = axis.inset_axes((0.46, 0.0, 0.4, 0.66))
    parts.barh(range(len(sizes)), sizes, color=colors, height=0.7)
    for row, (name, bits) in enumerate(numbers["sections"].items()):
        parts.text(bits, row, f" {bits:,}", va="center", fontsize=TEXT, color=INK)
        parts.text(0, row, f"{name} ", va="center", ha="right", fontsize=TEXT, color=INK)
    parts.invert_yaxis()
    for inset in (whole, parts):
        inset.set_axis_off()
    _caption(
        axis,
        "Positions, normals and texture coordinates. Small differences take few bits. Each has a "
        "unary part and low bits, stored apart so that each GPU thread finds its own. "
        f"The whole model: {numbers['mean']:.1f} bits per triangle.",
    )


def _mesh(axis, example: Example, colors, alpha: float = 1.0) -> None:
    """The projected triangles, filled, in the middle of the axis."""
    corners = example.flat[np.array(example.meshlet.connectivity.triangles)]
    axis.add_collection(PolyCollection(corners, facecolors=colors, edgecolors="none", alpha=alpha))
    axis.add_collection(PolyCollection(corners, facecolors="none", edgecolors=GRAY, linewidths=0.8))
    low, high = example.flat.min(axis=0), example.flat.max(axis=0)
    shape = np.array([WIDTH * SIZE[0], (TOP - BOTTOM) * SIZE[1]])
    reach = 0.54 * shape * ((high - low) / shape).max()
    (left, bottom), (right, top) = (low + high) / 2 - reach, (low + high) / 2 + reach
    axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")


def _caption(axis, text: str, legend: list | None = None) -> None:
    """Text below an axis, and below it a legend of (handle, words) lines."""
    left = axis.get_position(True).x0
    lines = textwrap.wrap(text, LETTERS_PER_LINE)
    axis.figure.text(
        left, BOTTOM - 0.02, "\n".join(lines), fontsize=TEXT, color=INK, va="top", linespacing=1.3
    )
    if legend:
        handles, words = zip(*legend)
        axis.figure.legend(
            handles,
            words,
            loc="upper left",
            bbox_to_anchor=(left - 0.004, BOTTOM - 0.025 - LINE * len(lines)),
            fontsize=SMALL,
            frameon=False,
            handlelength=1.6,
            labelspacing=0.3,
            borderpad=0.2,
        )


def draw_all() -> list[Path]:
    """docs/how_it_works.png."""
    draw(path := DOCS / "how_it_works.png")
    return [path]
