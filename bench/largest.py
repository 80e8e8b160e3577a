"""How long do 500 million triangles take in 8 GB of memory, and how much do threads help?

Writes a table into docs/out-of-core.md. The model is that of bench.out_of_core, and each run has a
process of its own. Rows are printed as they end. `--millions` and `--threads` may be left empty.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.common import call_in_process, origin_line, progress, table
from bench.large_model import write_displaced
from bench.models import real_model
from bench.out_of_core import BITS, MODEL

DOCUMENT, BLOCK = "out-of-core", "largest"
MILLIONS, MEMORY = 500, "8G"
SIDES = 6  # pieces of each edge of the model for the rows of threads: 31 million triangles


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--millions",
        type=int,
        nargs="*",
        default=[MILLIONS],
        metavar="N",
        help=f"millions of triangles (default {MILLIONS})",
    )
    parser.add_argument(
        "--threads",
        type=int,
        nargs="*",
        default=[1, 2],
        metavar="N",
        help="threads for a model of 31 million triangles (default 1 2)",
    )
    parser.add_argument(
        "--memory", default=MEMORY, metavar="BYTES", help=f"--max-memory (default {MEMORY})"
    )
    parser.add_argument(
        "--work-dir", help="folder for models and work files: 72 bytes for each triangle"
    )


def measure(options: argparse.Namespace) -> dict:
    """A row for each run. Each model is made as it is needed, and deleted."""
    count = len(gltf_ext.load(real_model(MODEL))[0].indices)
    models = [(math.ceil(math.sqrt(size * 1e6 / count)), [0]) for size in options.millions]
    models += [(SIDES, options.threads)] if options.threads else []
    rows = []
    for n, runs in models:
        with tempfile.TemporaryDirectory(dir=options.work_dir) as folder:
            source, output = str(Path(folder, "in.gltf")), str(Path(folder, "out.glb"))
            made = call_in_process("bench.largest", "make", n, source)
            progress(json.dumps(made))
            for threads in runs:
                settings = {"lod": True, "position_bits": BITS, "max_memory": options.memory}
                settings |= {"work_dir": folder, "threads": threads}
                row = call_in_process("bench.lod_build", "watched", source, output, settings)
                sha256 = hashlib.sha256(Path(output).read_bytes())
                row |= {**made, "threads": threads, "digest": sha256.hexdigest()}
                row.pop("levels")
                progress(json.dumps(row))
                rows.append(row)
    return {"memory": options.memory, "rows": rows}


def make(n: int, path: str) -> dict:
    """Writes the model with each triangle cut into n x n; returns what that took."""
    started = time.perf_counter()
    write_displaced(real_model(MODEL), n, Path(path))
    size = sum(file.stat().st_size for file in Path(path).parent.iterdir())
    return {"input_bytes": size, "make_seconds": time.perf_counter() - started}


def block(result: dict) -> str:
    """The table of the manual."""
    cores, rows = result["machine"]["cores"], result["rows"]
    of_threads = [row for row in rows if row["threads"]]
    same = len({row["digest"] for row in of_threads}) <= 1
    columns = {
        "triangles": lambda row: f"{row['triangles']:,}",
        "threads": lambda row: str(row["threads"] or cores),
        "seconds": lambda row: f"{row['seconds']:.0f}",
        "million triangles a second": lambda row: f"{row['triangles'] / row['seconds'] / 1e6:.2f}",
        "processor seconds": lambda row: f"{row['cpu_seconds']:.0f}",
        "peak memory": lambda row: f"{row['peak_bytes'] / 2**20:,.0f} MiB",
        "work files": lambda row: f"{row['disk_bytes'] / 1e9:.1f} GB",
        "input": lambda row: f"{row['input_bytes'] / 1e9:.1f} GB",
        "file": lambda row: f"{row['bytes'] / 1e6:.0f} MB",
        "load": lambda row: f"{row['load']:.0f}",
    }
    bytes_ = "The bytes are the same for any number of threads." if same else "THE BYTES DIFFER."
    heading = f"The same model with `--max-memory {result['memory']}`. {bytes_}"
    return f"{origin_line(result)}\n{heading}\n\n{table(rows, columns)}"
