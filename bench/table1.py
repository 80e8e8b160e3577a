"""The paper's Table 1: sizes of the Stanford Dragon's regions, with and without C(N).

Writes docs/table1.md. C(N) is the paper's penalty for full regions.
"""

from __future__ import annotations

import argparse

from bench import peers
from bench.common import markdown_table, origin_line
from bench.models import real_model
from bench.speed import encoder_arguments
from tools import paper_encoder

# With the default, regions are nearly full and the penalty matters; 0.68 gives about the paper's
# number of regions.
FILLS = (None, 0.68)
WEIGHTS = {"paper": "equation (1) with C(N)", "choe": "without C(N), as Choe et al."}
CLAIMED = {"paper": (1276, 18474, 216, 23), "choe": (1285, 18435, 232, 38)}


def measure(options: argparse.Namespace) -> dict:
    """All combinations of weight and fill."""
    primitives = peers.read_primitives(real_model("dragon"))
    (arguments,) = encoder_arguments(primitives)
    raw_bytes = primitives[0].indices.nbytes
    raw_bytes += sum(values.nbytes for values in primitives[0].attributes.values())
    rows = [
        measure_regions(arguments, raw_bytes, weight, fill) for fill in FILLS for weight in WEIGHTS
    ]
    return {"claimed": CLAIMED, "rows": rows}


def measure_regions(arguments: tuple, raw_bytes: int, weight: str, fill: float | None) -> dict:
    """The histogram of the regions, and the number of meshlets and ratio of the encoded mesh.

    Regions grow as in the paper, not as in today's encoder.
    """
    view, made = paper_encoder.encode(*arguments, weight=weight, fill=fill or 0.0)
    return {
        "weight": weight,
        "fill": fill,
        **made["generation"],
        "meshlets": made["meshlets"],
        "ratio": raw_bytes / len(view),
    }


def table(result: dict) -> str:
    """The paper's histogram and ours."""
    rows = [
        [f"the paper's, {WEIGHTS[weight]}", *map(str, bins), "", ""]
        for weight, bins in CLAIMED.items()
    ]
    for row in result["rows"]:
        fill = "default fill" if row["fill"] is None else f"fill {row['fill']}"
        name = f"ours, {WEIGHTS[row['weight']]}, {fill}"
        rows.append([name, *map(str, (*row["histogram"], row["meshlets"])), f"{row['ratio']:.2f}"])
    headings = ["weight", "[0, 32)", "[32, 64)", "[64, 72)", "72 and more", "meshlets", "ratio"]
    return markdown_table(headings, rows)


def report(result: dict) -> str:
    """docs/table1.md."""
    return f"""# Meshlets by number of triangles, before halving

{origin_line(result)}
Regions of the Stanford Dragon (871,306 triangles) by size, as in Table 1 of [the
paper](../README.md#the-paper), which also cites Choe et al. Fill is the region size that the
initial centres are placed for, as a share of 64. The last two columns describe the encoded mesh,
after refinement, halving and merging.

{table(result)}"""
