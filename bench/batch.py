"""How many models a minute does batch compress, over the number of workers on this machine?

Writes tables of docs/scale.md, from generated models: large ones over the number of workers, and
10,000 small ones on two processors, also with an earlier commit's package, which needs its own
environment (see bench/before_after.py):

    python -m bench batch --before COMMIT ../before/.venv/bin/python
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.common import call_in_process, origin_line, progress, table
from bench.generated import torus
from gltf_meshlet.demo.model import write_glb

PACKAGES = ("gltf-meshlet", "numpy", "distributed")
DOCUMENT, BLOCK = "scale", "batch"
SMALL_TRIANGLES, PROCESSORS = 50, 2  # of the small models
FILES, TRIANGLES = 64, 60_000  # of each: four million triangles together, for up to 16 workers


def add_options(parser: argparse.ArgumentParser) -> None:
    """--workers, --files and --before"""
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], metavar="N")
    parser.add_argument("--files", type=int, default=10_000, metavar="N", help="small models")
    parser.add_argument("--before", nargs=2, metavar=("COMMIT", "PYTHON"))


def measure(options: argparse.Namespace) -> dict:
    """A row for each number of workers, and of the small models for each package."""
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
    return {"load": os.getloadavg()[0], "rows": rows, "small": _small(options)}


def _small(options: argparse.Namespace) -> list[dict]:
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
            row = call_in_process("bench.batch", "run_small", *places, **python)
            rows.append({"package": package, "bytes": len(data), "files": options.files, **row})
    return rows


def run_small(source: str, destination: str) -> dict:
    """Seconds, memory and bytes of a batch on two processors, and of the next one."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])
    before = cpu_seconds()
    report = gltf_ext.batch(source, destination, workers=PROCESSORS)
    assert not report["totals"]["failed"]
    cpu = cpu_seconds() - before
    start = time.perf_counter()
    assert not gltf_ext.batch(source, destination, workers=PROCESSORS)["totals"]["done"]
    return {
        "seconds": report["seconds"],
        "cpu_seconds": cpu,
        "unchanged_seconds": time.perf_counter() - start,
        "driver_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "page_bytes": Path(destination, "batch.html").stat().st_size,
        "load": os.getloadavg()[0],
    }


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
        f"{table(rows, columns)}\n\n{_small_table(result['small'])}"
    )


def _small_table(rows: list[dict]) -> str:
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
        f"{rows[0]['files']:,} files of {rows[0]['bytes']:,} bytes on two processors with two "
        f"workers:\n\n{table(rows, columns)}"
    )
