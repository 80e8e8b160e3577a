"""How many models a minute does batch compress, over the number of workers on this machine?

Writes a table of docs/scale.md, from generated models.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import tempfile
from pathlib import Path

import gltf_ext
from bench.common import origin_line, progress, table
from bench.generated import torus
from gltf_meshlet.demo.model import write_glb

PACKAGES = ("gltf-meshlet", "numpy", "distributed")
DOCUMENT, BLOCK = "scale", "batch"
FILES, TRIANGLES = 64, 60_000  # of each: four million triangles together, for up to 16 workers


def add_options(parser: argparse.ArgumentParser) -> None:
    """--workers"""
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], metavar="N")


def measure(options: argparse.Namespace) -> dict:
    """A row for each number of workers."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        source.mkdir()
        for i in range(FILES):
            write_glb([torus(TRIANGLES + 100 * i)], source / f"{i}.glb")
        for workers in options.workers:
            progress(f"{workers} workers")
            before = cpu_seconds()
            report = gltf_ext.batch(str(source), str(Path(folder) / str(workers)), workers=workers)
            assert report["totals"]["done"] == FILES
            digests = "".join(file["output_digest"] for file in report["files"])
            rows.append(
                {
                    "workers": workers,
                    "seconds": report["seconds"],
                    "cpu_seconds": cpu_seconds() - before,
                    "work_seconds": sum(file["seconds"] for file in report["files"]),
                    "triangles": report["totals"]["triangles"],
                    "digest": hashlib.sha256(digests.encode()).hexdigest(),
                }
            )
    return {"load": os.getloadavg()[0], "rows": rows}


def cpu_seconds() -> float:
    """Processor time of this process and of those that it has waited for, as workers are."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def block(result: dict) -> str:
    """The table."""
    rows = result["rows"]
    same = len({row["digest"] for row in rows}) == 1
    columns = {
        "workers": lambda r: str(r["workers"]),
        "seconds": lambda r: f"{r['seconds']:.1f}",
        "files a minute": lambda r: f"{60 * FILES / r['seconds']:.0f}",
        "triangles a second": lambda r: f"{r['triangles'] / r['seconds']:,.0f}",
        "seconds in tasks": lambda r: f"{r['work_seconds']:.1f}",
        "processor seconds": lambda r: f"{r['cpu_seconds']:.1f}",
    }
    bytes_ = "The bytes are the same for all." if same else "THE BYTES DIFFER."
    return (
        f"{origin_line(result)}\n{FILES} generated models with {rows[0]['triangles']:,} triangles "
        f"together, compressed, verified and drawn, with the start of the cluster. {bytes_} "
        f"Processes that wanted a processor, others included: {result['load']:.0f} on average.\n\n"
        f"{table(rows, columns)}"
    )
