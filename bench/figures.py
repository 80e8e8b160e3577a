"""Charts of size: the paper's Figures 3 and 7 for our models, and the README's chart of the peers.

Reads bench/results/size.json and paper.json; writes docs/figure3.png, figure7.png and peers.png.
Each picture carries a digest of its figures, so that a test finds an outdated picture.
"""

from __future__ import annotations

import statistics
from pathlib import Path

from bench.common import DOCS, grouped_bars, pyplot, read_result, save_figure
from bench.models import PAPER_MODELS

# The same five parts of both encodings: (label, colour, parts of the paper's, sections of ours)
FIGURE3 = (
    ("triangles", "#4477aa", ("connectivity",), ("connectivity",)),
    ("meshlets and references", "#66ccee", ("meshlets, references, boundaries", "header"),
     ("references", "codes", "headers and tables")),
    ("corners of boundaries", "#aa3377", ("boundary ends",), ("anchors",)),
    ("other vertices of boundaries", "#ccbb44", ("boundary inner vertices",), ("chains",)),
    ("other vertices of meshlets", "#ee7733", ("interior vertices",), ("interior",)),
)  # fmt: skip
COLORS = {
    "ours": "#228833",
    "the paper's encoding": "#ccbb44",
    "Draco, level 7": "#4477aa",
    "Draco, level 10": "#99bbdd",
    "Corto": "#ee6677",
    "quantised glTF": "#bbbbbb",
    "meshopt-compressed glTF": "#666666",
    "meshopt meshlets": "#aa3377",
    "AMD DGF, HPG24": "#66ccee",
}

# The README's chart: each codec, and what a renderer does with its files.
PEERS = {
    "ours": "drawn as it is in the file",
    "meshopt meshlets": "drawn as they are in the file",
    "AMD DGF, HPG24": "drawn as it is in the file",
    "meshopt-compressed glTF": "unpacks to quantised glTF",
    "quantised glTF": "drawn as it is in the file",
    "Draco, level 7": "unpacks to floats",
    "Corto": "unpacks to floats",
}
# Figures that others published, for models of their own: GiB of raw data, on disk, in memory.
# Slide 144 of the SIGGRAPH 2021 course that docs/size.md names.
PUBLISHED = {"Nanite, as published": ("other models, all levels of detail", 25.90, 4.61, 7.67)}
# Its two bars per codec: (key in size.json, label, colour)
PEER_BARS = (
    ("ratio", "as a file", "#99bbdd"),
    ("resident_ratio", "in GPU memory while drawing", "#228833"),
)


def figure3(size: dict, paper: dict) -> dict:
    """Percent of raw by model and encoding: a list in the order of FIGURE3."""
    ours = {row["model"]: row for row in size["models"]}
    theirs = {row["model"]: row for row in paper["rows"] if row["meshlets_of"] == "ours"}
    bars = {}
    for model in (m for m in PAPER_MODELS if m in ours and m in theirs):
        raw_bits = 8 * ours[model]["raw_bytes"] / ours[model]["triangles"]
        bits, sections = theirs[model]["bits_per_triangle"], ours[model]["sections"]
        bars[model] = {
            "the paper's encoding": [
                100 * sum(bits[p] for p in parts) / raw_bits for _, _, parts, _ in FIGURE3
            ],
            "ours": [
                100 * sum(sections[s] for s in kinds) / raw_bits for _, _, _, kinds in FIGURE3
            ],
        }
    return bars


def figure7(size: dict) -> dict:
    """Percent of raw by codec: {"model": {codec: percent}}."""
    return {
        row["model"]: {
            name: 100 / row["codecs"][name]["ratio"] for name in COLORS if name in row["codecs"]
        }
        for model in PAPER_MODELS
        for row in size["models"]
        if row["model"] == model
    }


def peers(size: dict) -> dict:
    """Times smaller than raw by codec, in the order of PEER_BARS: medians of the paper's models.

    PUBLISHED comes last.
    """
    rows = [row["codecs"] for row in size["models"] if row["model"] in PAPER_MODELS]
    measured = {
        codec: [
            statistics.median(codecs[codec][key] for codecs in rows if codec in codecs)
            for key, *_ in PEER_BARS
        ]
        for codec in PEERS
        if any(codec in codecs for codecs in rows)
    }
    published = {
        name: [raw / disk, raw / memory] for name, (_, raw, disk, memory) in PUBLISHED.items()
    }
    return measured | published


def draw_figure3(size: dict, paper: dict) -> Path:
    """Draws docs/figure3.png."""
    bars = figure3(size, paper)
    figure, axis = pyplot().subplots(figsize=(11, 5), dpi=100)
    for place, encodings in enumerate(bars.values()):
        for shift, (name, values) in zip((-0.21, 0.21), encodings.items()):
            bottom, x = 0.0, place + shift
            for (label, color, *_), value in zip(FIGURE3, values):
                shown = label if x < 0 else None
                axis.bar(x, value, 0.38, bottom, color=color, label=shown)
                bottom += value
            title = f"{name.removesuffix(' encoding')}\n{bottom:.1f}"
            axis.text(x, bottom, title, ha="center", va="bottom", fontsize=8)
    axis.set_title(
        "Compressed data in percent of raw, at most 64 triangles per meshlet", loc="left"
    )
    axis.set_xticks(range(len(bars)), bars)
    axis.spines[["top", "right"]].set_visible(False)
    return _finish(figure, axis, bars, "figure3")


def draw_figure7(size: dict) -> Path:
    """Draws docs/figure7.png."""
    bars = figure7(size)
    figure, axis = grouped_bars(bars, (11, 5), 0.85, COLORS)
    for container in axis.containers:
        axis.bar_label(container, fmt="%.0f", fontsize=7)
    axis.set_title("Compressed size in percent of raw", loc="left")
    return _finish(figure, axis, bars, "figure7")


def draw_peers(size: dict) -> Path:
    """Draws docs/peers.png."""
    bars = peers(size)
    notes = PEERS | {name: note for name, (note, *_) in PUBLISHED.items()}
    figure, axis = pyplot().subplots(figsize=(9, 5.6), dpi=100)
    height = 0.38
    for k, (_, label, color) in enumerate(PEER_BARS):
        places = [place + height * k for place in range(len(bars))]
        values = [of_codec[k] for of_codec in bars.values()]
        drawn = axis.barh(places, values, height - 0.02, color=color, label=label)
        axis.bar_label(drawn, [f"{value:.1f}" for value in values], padding=3)
    axis.set_yticks(
        [place + height / 2 for place in range(len(bars))],
        [f"{codec}\n({notes[codec]})" for codec in bars],
    )
    axis.invert_yaxis()
    axis.set_xlabel(f"times smaller than raw floats (median of {len(PAPER_MODELS)} models)")
    axis.margins(x=0.08)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, loc="center right")
    figure.tight_layout()
    return save_figure(figure, DOCS / "peers.png", bars)


def _finish(figure, axis, bars: dict, name: str) -> Path:
    axis.set_ylabel("percent of raw")
    axis.margins(y=0.12)
    axis.legend(ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.08), frameon=False)
    figure.tight_layout()
    return save_figure(figure, DOCS / f"{name}.png", bars)


def draw_all() -> list[Path]:
    """Draws the figures whose results exist; returns their paths."""
    size, paper = read_result("size"), read_result("paper")
    drawn = []
    if size and figure7(size):
        drawn += [draw_figure7(size), draw_peers(size)]
    if size and paper and figure3(size, paper):
        drawn.append(draw_figure3(size, paper))
    return drawn
