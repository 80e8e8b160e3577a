"""The README's chart of the peers: how many times smaller than raw, as a file and in GPU memory.

Reads bench/results/size.json and transport.json; writes docs/peers.png. The picture carries a
digest of its figures, so that a test finds an outdated picture.
"""

from __future__ import annotations

import statistics
from pathlib import Path

from bench.common import DOCS, pyplot, read_result, save_figure
from bench.models import PAPER_MODELS

PACKED = "ours, packed"  # of transport.json
# The README's chart: each codec, and what a renderer does with its files.
PEERS = {
    "ours": "drawn as it is in the file",
    PACKED: "unpacks to ours",
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


def peers(size: dict, transport: dict) -> dict:
    """Times smaller than raw by codec, in the order of PEER_BARS: medians of the paper's models.

    size, transport: results of those measurements. PUBLISHED comes last.
    """
    packed = {row["model"]: row["bytes"]["packed"] for row in transport["models"]}
    rows = []
    for row in size["models"]:
        if row["model"] not in PAPER_MODELS:
            continue
        ours = {**row["codecs"]["ours"], "ratio": row["raw_bytes"] / packed[row["model"]]}
        rows.append({**row["codecs"], PACKED: ours})
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


def draw_peers(size: dict, transport: dict) -> Path:
    """Draws docs/peers.png."""
    bars = peers(size, transport)
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


def draw_all() -> list[Path]:
    """Draws the chart if its results exist; returns its path."""
    size, transport = read_result("size"), read_result("transport")
    return [draw_peers(size, transport)] if size and transport else []
