"""How do formats of meshlets compare? Positions and triangles alone: size, and speed of decoding.

Ours, meshoptimizer's meshlets and AMD DGF at 12 bits; bench/meshlet_peers.py says what they need.
Writes their section of docs/size.md. Times are of the processor, not of the clock, so that other
programs disturb them little.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

from bench import meshlet_peers, peers
from bench.common import best_in_bold, markdown_table, origin_line, progress, spread, versions
from bench.models import all_models
from bench.speed import native
from gltf_ext import _codec

DOCUMENT, BLOCK = "size", "meshlet_formats"
OURS = "ours"
NEWER = """\
meshoptimizer 1.3.0 and DGF SDK 1.2.0 are newer; their sources could not be fetched. The newest
commit of meshoptimizer that could be (v1.2-96-gb5b2c439, August 2026) has the same code for
meshlets as v1.2, and gave the same bytes for suzanne, bunny and engine."""
SINGLE = "ours, meshlet by meshlet"
# What others have published, on models of their own: name, bytes, per triangle of, with, source
PUBLISHED = (
    ("Nanite", "9.3 in memory, 5.6 on disk", "any level of detail",
     "[SIGGRAPH 2021 course]"
     "(https://advances.realtimerendering.com/s2021/Karis_Nanite_SIGGRAPH_Advances_2021_final.pdf),"
     " slide 144: 882 million triangles of all levels in 7.67 and 4.61 GiB"),
    ("Nanite", "19.0 in memory, 11.4 on disk", "the model",
     "the same slide: 433 million triangles before levels of detail"),
    ("Nanite", "14.4 on disk", "the model",
     "[Unreal Engine's manual]"
     "(https://dev.epicgames.com/documentation/unreal-engine/nanite-technical-details), "
     "Valley of the Ancient"),
    ("vk_lod_clusters", "15.6 on disk", "the model",
     "[its README](https://github.com/nvpro-samples/vk_lod_clusters), commit 70506fd: Zorah, 1.63 "
     "billion triangles in a cache file of 25.5 GB, written with `--compressed 1`"),
)  # fmt: skip


# --- measurements ---


def measure(options: argparse.Namespace) -> dict:
    """All models in all formats."""
    formats, missing = meshlet_peers.available()
    rows = []
    for path in all_models():
        rows.append(measure_model(path, formats))
        progress(path.stem)
    return {
        "peers": {peer.name: peer.version for peer in formats},
        "missing": missing,
        "rows": rows,
    }


def measure_model(path: Path, formats: list) -> dict:
    """One model in ours and other formats: bytes, and times of decoding on one thread."""
    primitives = peers.read_primitives(path, {"POSITION": peers.ATTRIBUTES["POSITION"]})
    totals, blobs = meshlet_peers.compressed(primitives)
    meshlets = sum(_codec.Decoder(blob).meshlet_count for blob in blobs)
    with tempfile.TemporaryDirectory() as folder:
        times = native("decode_speed", blobs, Path(folder))
    one_by_one = [meshlets * t / 1e6 for t in times["meshlet_microseconds"]]
    ours = sum(map(len, blobs)), meshlets
    measured = {
        OURS: figures(*ours, times["decode_seconds"]),
        SINGLE: figures(*ours, one_by_one),
    }
    integers = meshlet_peers.integers_of(primitives)
    for peer in formats:
        run = peer.run(integers)
        measured[peer.name] = figures(run.bytes, run.meshlets, run.decode_seconds)
    return {"model": path.stem, "triangles": totals["triangles"], "formats": measured}


def figures(size: int, meshlets: int, seconds: list[float]) -> dict:
    return {"bytes": size, "meshlets": meshlets, "decode_seconds": spread(seconds)}


# --- the section ---


def position_tables(rows: list[dict]) -> str:
    """Bits per triangle, and decoding speed, of positions and triangles alone."""
    names = list(dict.fromkeys(name for row in rows for name in row["formats"]))
    formats = [name for name in names if name != SINGLE]

    def values(names: list[str], figure: Callable[[dict, dict], float]) -> list[list]:
        return [
            [figure(row, row["formats"][n]) if n in row["formats"] else None for n in names]
            for row in rows
        ]

    def table(names: list[str], figure: Callable, form: str, most: bool) -> str:
        cells = [best_in_bold(of_row, form, largest=most) for of_row in values(names, figure)]
        lines = [[row["model"], *texts] for row, texts in zip(rows, cells)]
        return markdown_table(["model", *names], lines)

    columns = zip(*values(formats, lambda row, of: row["triangles"] / of["meshlets"]))
    full = {
        name: statistics.median(count for count in column if count is not None)
        for name, column in zip(formats, columns)
    }
    bits = table(formats, lambda row, of: 8 * of["bytes"] / row["triangles"], ".2f", False)
    rate = table(
        names, lambda row, of: row["triangles"] / of["decode_seconds"]["low"] / 1e6, ".0f", True
    )
    return f"""{bits}
Triangles per meshlet or block, median of the models: \
{", ".join(f"{name} {count:.1f}" for name, count in full.items())}.

Million triangles per second on one thread of the CPU, fastest of seven runs, into the vertices of
each meshlet as floats;
ours also as a whole, into vertices that all meshlets share:

{rate}"""


def published_table() -> str:
    return markdown_table(
        ["format", "bytes", "per triangle of", "source"], [list(row) for row in PUBLISHED]
    ).replace("---:", "---")


def block(result: dict) -> str:
    """The section of docs/size.md."""
    return f"""## Positions and triangles alone

{origin_line(result)}
Formats that a GPU decodes meshlet by meshlet, without other attributes. Measured with
{versions(result["peers"])}.
{NEWER}

Bits per triangle, all data that decoding needs:

{position_tables(result["rows"])}
Published by others, not measured here: for models, precisions and attributes of their
own, with levels of detail (see [ours](lod_results.md)):

{published_table()}"""
