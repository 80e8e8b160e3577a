"""Does batch estimate the memory of a model well, before it is read? For 200 files and more.

Writes a table of docs/scale.md: real models, some also with levels of detail or fallback, and their
triangles as .obj, .ply and .stl.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext.lod.builder  # noqa: F401  a worker has it in memory after its first levels
from bench.common import memory_of_process, origin_line, progress, table
from bench.models import MODELS
from gltf_ext.attributes.extension import read_triangles
from gltf_ext.batches import task
from gltf_ext.batches.memory import estimate
from gltf_ext.batches.task import Job
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model

PACKAGES = ("gltf-meshlet", "numpy", "distributed")
DOCUMENT, BLOCK = "scale", "batch-memory"
SUFFIXES = (".obj", ".ply", ".stl")
MIN_TRIANGLES, MOST_TRIANGLES = 100, 300_000  # of models that are also written in these formats


def measure(options: argparse.Namespace) -> dict:
    """A row for each file and choice of options."""
    import distributed  # noqa: F401  as in a worker

    with tempfile.TemporaryDirectory() as folder:
        write_warm_up(Path(folder))
        rows = [row for model in files(Path(folder)) if (row := _row(*model, Path(folder)))]
    return {"process_bytes": memory_of_process("VmRSS"), "rows": rows}


def write_warm_up(folder: Path) -> None:
    """Does a job: the measured processes are copies of this one, as a worker after its first."""
    model = next(MODELS.glob("*.glb"))
    (folder / "warm").mkdir()
    job = Job(str(model), "a.glb", str(folder / "out"), "a.glb", {}, task.VERSION)
    task.run(job, folder / "warm")


def files(folder: Path) -> Iterator[tuple[Path, dict]]:
    """Models with options of compress. Models are written to the folder when it is their turn."""
    models = sorted(MODELS.rglob("*.glb"), key=lambda path: path.stat().st_size)
    for i, path in enumerate(models):
        progress(path.name)
        yield path, {}
        if i % 2 == 0 and path.stat().st_size < 10e6:
            yield path, {"lod": True}
        if i % 4 == 1:
            yield path, {"fallback": True}
        for suffix in SUFFIXES[: 1 + i % 2]:
            other = folder / f"{path.stem}{suffix}"
            if in_copy(write_as, path, other):
                yield other, {}
                other.unlink()


def in_copy(function: Callable, *arguments: Any) -> Any:
    """Calls a function in a copy of this process; returns what it returns, None if it fails."""
    reader, writer = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.write(writer, json.dumps(function(*arguments)).encode())
        finally:
            os._exit(0)
    os.close(writer)
    with open(reader, "rb") as pipe:
        text = pipe.read()
    os.waitpid(process, 0)
    return json.loads(text or "null")


def write_as(model: Path, path: Path) -> bool:
    """Writes all triangles of a model in the format of the path; False for too few or too many."""
    import trimesh

    try:
        document = open_model(model)
        parts = [
            geometry.attributes["POSITION"][geometry.indices].reshape(-1, 3)
            for m, mesh in enumerate(document.meshes)
            for p in range(len(mesh["primitives"]))
            for geometry, _ in (read_triangles(document, m, p),)
        ]
    except (MeshletError, KeyError):
        return False
    corners = np.concatenate([np.empty((0, 3), np.float32), *parts])
    if not MIN_TRIANGLES <= len(corners) // 3 <= MOST_TRIANGLES:
        return False
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    if path.suffix != ".stl":
        mesh.merge_vertices()
    mesh.export(path)
    return True


def _row(path: Path, options: dict, folder: Path) -> dict | None:
    """The memory of a job at its peak, in a copy of this process; None if the model is refused."""
    result = in_copy(_peak, path, options, folder)
    if result is None or result["status"] != task.DONE:
        return None
    # A copy shows no memory that it has not touched: so what it needs is added to this process.
    peak = memory_of_process("VmRSS") + result["peak_bytes"] - result["start_bytes"]
    size = path.stat().st_size
    return {
        "name": path.name,
        "options": options,
        "bytes": size,
        "triangles": result["triangles"],
        "peak_bytes": max(peak, result["peak_bytes"]),
        "estimate": estimate(str(path), size, options),
    }


def _peak(path: Path, options: dict, folder: Path) -> dict:
    with tempfile.TemporaryDirectory(dir=folder) as work:
        scratch = Path(work, "scratch")
        scratch.mkdir()
        Path("/proc/self/clear_refs").write_text("5")  # resets the peak
        start = memory_of_process("VmRSS")
        job = Job(str(path), path.name, f"{work}/out", "a.glb", options, task.VERSION)
        record = task.run(job, scratch)
        peak = memory_of_process("VmHWM")
    values = {key: record.get(key) for key in ("status", "triangles")}
    return {**values, "start_bytes": start, "peak_bytes": peak}


def block(result: dict) -> str:
    """The largest and the median part of the estimates that was needed, and the largest needs."""
    rows = result["rows"]
    parts = [row["peak_bytes"] / row["estimate"] for row in rows]
    largest = sorted(rows, key=lambda row: -row["peak_bytes"])[:6]
    columns = {
        "file": lambda r: r["name"] + ", ".join(["", *r["options"]]),
        "triangles": lambda r: f"{r['triangles']:,}",
        "needed, MB": lambda r: f"{r['peak_bytes'] / 1e6:.0f}",
        "estimate, MB": lambda r: f"{r['estimate'] / 1e6:.0f}",
        "part": lambda r: f"{r['peak_bytes'] / r['estimate']:.2f}",
    }
    return (
        f"{origin_line(result)}\n{len(rows)} files: a worker needed between {min(parts):.2f} and "
        f"{max(parts):.2f} of the estimate, {statistics.median(parts):.2f} in the median. The "
        f"process alone takes {result['process_bytes'] / 1e6:.0f} MB. The six that need most:\n\n"
        f"{table(largest, columns)}"
    )
