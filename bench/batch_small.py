"""How many small models a second does batch compress, and in how much memory of its driver?

Writes a table of docs/scale.md: on two processors, with two workers, also with an earlier commit's
package, which needs its own environment (see bench/before_after.py):

    python -m bench batch_small --before COMMIT ../before/.venv/bin/python
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.batch import cpu_seconds
from bench.common import call_in_process, origin_line, progress, table
from bench.generated import torus
from gltf_meshlet.demo.model import write_glb

PACKAGES = ("gltf-meshlet", "numpy", "distributed")
DOCUMENT, BLOCK = "scale", "batch-small"
SMALL_TRIANGLES, PROCESSORS = 50, 2


def add_options(parser: argparse.ArgumentParser) -> None:
    """--files and --before"""
    parser.add_argument("--files", type=int, default=10_000, metavar="N")
    parser.add_argument("--before", nargs=2, metavar=("COMMIT", "PYTHON"))


def measure(options: argparse.Namespace) -> dict:
    """A row for each package."""
    pythons = {"this commit": {}}
    if options.before:
        commit, python = options.before
        pythons = {commit: {"python": python}, **pythons}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "source")
        source.mkdir()
        write_glb([torus(SMALL_TRIANGLES)], Path(folder, "model.glb"))
        data = Path(folder, "model.glb").read_bytes()
        for i in range(options.files):
            (source / f"{i}.glb").write_bytes(data)
        for package, python in pythons.items():
            progress(f"{options.files:,} files of {len(data):,} bytes, {package}")
            places = (str(source), str(Path(folder, package)))
            row = call_in_process("bench.batch_small", "run", *places, **python)
            rows.append({"package": package, "bytes": len(data), "files": options.files, **row})
    return {"rows": rows}


def run(source: str, destination: str) -> dict:
    """Seconds, memory and bytes of a batch on two processors, and of the next one."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])
    before = cpu_seconds()
    report = gltf_ext.batch(source, destination, workers=PROCESSORS)
    assert not report["totals"]["failed"]
    cpu = cpu_seconds() - before
    seconds = report["seconds"]
    del report  # a program has one at a time
    start = time.perf_counter()
    assert not gltf_ext.batch(source, destination, workers=PROCESSORS)["totals"]["done"]
    return {
        "seconds": seconds,
        "cpu_seconds": cpu,
        "unchanged_seconds": time.perf_counter() - start,
        "driver_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "page_bytes": Path(destination, "batch.html").stat().st_size,
        "load": os.getloadavg()[0],
    }


def block(result: dict) -> str:
    """The table."""
    rows = result["rows"]
    columns = {
        "package": lambda r: r["package"],
        "seconds": lambda r: f"{r['seconds']:.1f}",
        "processor seconds": lambda r: f"{r['cpu_seconds']:.1f}",
        "files a second": lambda r: f"{r['files'] / r['seconds']:.0f}",
        "seconds when nothing changed": lambda r: f"{r['unchanged_seconds']:.1f}",
        "memory of the driver, MB": lambda r: f"{r['driver_bytes'] / 1e6:.0f}",
        "batch.html, MB": lambda r: f"{r['page_bytes'] / 1e6:.1f}",
        "load": lambda r: f"{r['load']:.0f}",
    }
    return (
        f"{origin_line(result)}\n{rows[0]['files']:,} files of {rows[0]['bytes']:,} bytes on "
        f"two processors with two workers:\n\n{table(rows, columns)}"
    )
