"""The paper's own encoding on our models, beside what the paper claims of it.

Writes docs/paper.md. The encoding's tests decode models again.
"""

from __future__ import annotations

import argparse

from bench import paper_encoding
from bench.common import bullets, markdown_table, origin_line, progress
from bench.models import PAPER_MODELS, all_models
from bench.peers import DEFAULT_BITS, Part, read_parts
from gltf_ext.attributes.streams import Bits

# Options of our encoder that give about the paper's number of meshlets (43 triangles each on the
# dragon), and our defaults.
FILLS = {"the paper's": 0.68, "ours": 0.0}
CLAIMS = {
    "symbols": {"C": "24-29", "R": "34-42", "E": "12-17", "L": "5-12", "S": "9-14"},
    "connectivity": "2.19-2.22",
    "boundaries_per_meshlet": "2.9",
    "references_per_meshlet": "5.5",
    "extra_bits_per_meshlet": "about 400",
    "index_bits_per_triangle": "11.63",
    "difference_gain": "1.23-1.34",
    "vertex_ratio_once": "3.7",
    "vertex_ratio": "3.1",
    "ratio": "4.26-4.35",
    "connectivity_share": "under 5",
}
INDEX_BITS = 96  # of a triangle in the raw model


def measure(options: argparse.Namespace) -> dict:
    """All models, with meshlets as full as the paper's and as ours."""
    rows: list[dict] = []
    without_texcoords = []
    for path in all_models():
        parts = read_parts(path)
        if any(part.texcoords is None for part in parts):
            without_texcoords.append(path.stem)
        for meshlets in FILLS:
            rows.append(measure_model(path.stem, parts, meshlets))
            progress(f"{path.stem}, meshlets as {meshlets}: {rows[-1]['ratio']:.2f}")
    return {"claims": CLAIMS, "without_texcoords": without_texcoords, "rows": rows}


def measure_model(name: str, parts: list[Part], meshlets: str, bits: Bits = DEFAULT_BITS) -> dict:
    """The encoding of one model; meshlets: a key of FILLS."""
    meshes = [paper_encoding.mesh_of(part, bits, FILLS[meshlets]) for part in parts]
    encoded = paper_encoding.encode_meshes(meshes, bits)
    raw_bytes = sum(part.raw_bytes for part in parts)
    return {
        "model": name,
        "meshlets_of": meshlets,
        "raw_bytes": raw_bytes,
        "file_bytes": len(encoded.data),
        "ratio": raw_bytes / len(encoded.data),
        "m": encoded.m,
        **stated_figures(encoded, raw_bytes),
    }


def stated_figures(encoded: paper_encoding.Encoded, raw_bytes: int) -> dict:
    """The figures that the paper states."""
    counts, bits = encoded.counts, encoded.bits
    triangles, meshlets = counts["triangles"], counts["meshlets"]
    tables = bits["meshlets, references, boundaries"]
    bits_once = bits["boundary inner vertices"] + bits["interior vertices"]
    raw_vertex_bits = 8 * raw_bytes - INDEX_BITS * triangles
    written = counts["inner"] + counts["interior"]
    position_bits = 3 * Bits().position
    return {
        "counts": counts,
        "bits_per_triangle": {part: count / triangles for part, count in bits.items()},
        "symbols": {symbol: count / triangles for symbol, count in encoded.symbols.items()},
        "connectivity_share": bits["connectivity"] / sum(bits.values()),
        "triangles_per_meshlet": triangles / meshlets,
        "boundaries_per_meshlet": counts["boundaries"] / meshlets,
        "references_per_meshlet": counts["references"] / meshlets,
        "extra_bits_per_meshlet": tables / meshlets,
        "index_bits_per_triangle": (bits["connectivity"] + tables) / triangles,
        "difference_gain": position_bits * written / encoded.difference_bits,
        "vertex_bits_once": bits_once / written,
        "vertex_ratio_once": raw_vertex_bits / counts["vertices"] / (bits_once / written),
        "vertex_ratio": raw_vertex_bits / (bits_once + bits["boundary ends"]),
    }


# --- the document ---


def report(result: dict) -> str:
    """docs/paper.md."""
    sections = "\n".join(
        f"## On meshlets as full as {whose}\n\n{_tables(result, whose)}" for whose in FILLS
    )
    without = ", ".join(result["without_texcoords"]) or "none"
    return f"""# The paper's encoding

{origin_line(result)}
The encoding of [the paper](../README.md#the-paper), implemented in `bench/paper_encoding.py`, which
also lists the choices that the paper leaves open. Positions have 12 bits, normals 8 + 8, texture
coordinates 12. Its tests decode models again to the same triangles and integers.

* The first row of each table is the paper's claim.
* Meshlets are made by our encoder. If a meshlet of ours has several disks, each disk is a meshlet
  here.
* The paper's models have normals and texture coordinates. These of ours lack texture coordinates,
  at least in part, and so have less raw data per vertex: {without}.
* The paper does not say how it writes negative differences. We use the smaller form, zigzag (0, -1,
  1, -2, ...).

{sections}
## Where the data is

In the paper, uncompressed attributes of boundaries take almost as much as all compressed data; here
the ends of boundaries take {_ends_share(result)} of its encoding.

## The paper's models

{bullets(PAPER_MODELS)}"""


def _tables(result: dict, whose: str) -> str:
    rows = [row for row in result["rows"] if row["meshlets_of"] == whose]
    claims = result["claims"]

    def table(columns: list[tuple]) -> str:
        """columns: (heading, the claim, row -> text)."""
        headings, claimed, texts = zip(*columns)
        body = [[row["model"], *(text(row) for text in texts)] for row in rows]
        return markdown_table(["model", *headings], [["*claimed*", *claimed], *body])

    def column(heading: str, claim: str, key: str, form: str = ".2f", factor: float = 1) -> tuple:
        return heading, claim, lambda row: f"{factor * row[key]:{form}}"

    def claimed_column(heading: str, key: str, form: str = ".2f", factor: float = 1) -> tuple:
        return column(heading, claims[key], key, form, factor)

    def connectivity_bits(row: dict) -> str:
        return f"{row['bits_per_triangle']['connectivity']:.2f}"

    symbols = [
        (f"{s} %", claims["symbols"][s], lambda row, s=s: f"{100 * row['symbols'][s]:.1f}")
        for s in "CRELS"
    ]
    connectivity = table([
        ("triangles per meshlet", "at most 64", lambda row: f"{row['triangles_per_meshlet']:.1f}"),
        *symbols,
        ("symbols, bits per triangle", claims["connectivity"], connectivity_bits),
        claimed_column("% of the file", "connectivity_share", ".1f", 100),
        claimed_column("boundaries per meshlet", "boundaries_per_meshlet"),
        claimed_column("references per meshlet", "references_per_meshlet"),
        claimed_column("tables, bits per meshlet", "extra_bits_per_meshlet", ".0f"),
        claimed_column("symbols and tables, bits per triangle", "index_bits_per_triangle"),
    ])  # fmt: skip
    vertices = table([
        column("m", "", "m", "d"),
        claimed_column("differences: times smaller", "difference_gain"),
        column("vertices written once: bits", "about 69", "vertex_bits_once", ".1f"),
        claimed_column("times smaller", "vertex_ratio_once"),
        claimed_column("with both ends of boundaries", "vertex_ratio"),
        ("all: times smaller", claims["ratio"], lambda row: f"**{row['ratio']:.2f}**"),
    ])  # fmt: skip
    return f"{connectivity}\n{vertices}"


def _ends_share(result: dict) -> str:
    """Smallest to largest share of boundary ends in the files of the paper's models."""
    shares = [
        100 * row["bits_per_triangle"]["boundary ends"] / sum(row["bits_per_triangle"].values())
        for row in result["rows"]
        if row["meshlets_of"] == "ours" and row["model"] in PAPER_MODELS
    ]
    return f"{min(shares):.0f} to {max(shares):.0f} %" if shares else "nothing"
