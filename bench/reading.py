"""How fast are .obj, .ply and .stl read, and in how much memory? Beside trimesh.

Writes a table of docs/scale.md. Times are processor time, of one thread, of opening a model as a
glTF document; trimesh's are of trimesh.load_scene, without the document.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from bench.common import (
    call_in_process,
    memory_of_process,
    origin_line,
    progress,
    table,
)
from bench.generated import torus
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.ply_header import read_header

PACKAGES = ("gltf-meshlet", "numpy", "trimesh")
DOCUMENT, BLOCK = "scale", "reading"
SIZES = (60_000, 1_000_000)  # triangles
SMALL, RUNS = 64, 3  # triangles of a small model; processes
FORMATS = {
    "full.obj": ".obj with texture coordinates and normals",
    "plain.obj": ".obj with positions only",
    "text.ply": ".ply, text",
    "binary.ply": ".ply, binary",
    "text.stl": ".stl, text",
    "binary.stl": ".stl, binary",
}


def measure(options: argparse.Namespace) -> dict:
    """A row for each format and size."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for triangles in (SMALL, *SIZES):
            write(triangles, Path(folder, str(triangles)))
        for triangles in SIZES:
            for name in FORMATS:
                progress(f"{triangles:,} triangles, {name}")
                paths = [str(Path(folder, str(size), name)) for size in (SMALL, triangles)]
                row = {"triangles": triangles, "format": name, "bytes": os.path.getsize(paths[1])}
                readers = [r for r in READERS if r != "bare" or name == "binary.ply"]
                rows.append({**row, **{reader: run(reader, paths) for reader in readers}})
    return {"rows": rows}


def run(reader: str, paths: list[str]) -> dict:
    """The fastest and the median time of some processes, and the most memory of any."""
    runs = [call_in_process("bench.reading", "opened", reader, *paths) for _ in range(RUNS)]
    seconds = [run["seconds"] for run in runs]
    peak = max(run["peak_bytes"] for run in runs)
    return {"least": min(seconds), "median": statistics.median(seconds), "peak_bytes": peak}


def opened(reader: str, small: str, path: str) -> dict:
    """Processor time and memory at its peak of opening a model, after a small one."""
    read = READERS[reader]
    read(small)
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak, which exec inherits
    before, start = memory_of_process("VmRSS"), time.process_time()
    model = read(path)
    seconds = time.process_time() - start
    assert model is not None
    return {"seconds": seconds, "peak_bytes": memory_of_process("VmHWM") - before}


def write(triangles: int, folder: Path) -> None:
    """The same torus in all formats."""
    folder.mkdir()
    part = torus(triangles)
    mesh = trimesh.Trimesh(part.positions, part.triangles, process=False)
    for name, kind in (("text", "ascii"), ("binary", "binary")):
        mesh.export(folder / f"{name}.ply", encoding=kind, vertex_normal=False)
    mesh.export(folder / "text.stl", file_type="stl_ascii")
    mesh.export(folder / "binary.stl")
    corners = part.triangles + 1
    points = lines("v {:.6f} {:.6f} {:.6f}", part.positions)
    (folder / "plain.obj").write_text(points + lines("f {} {} {}", corners))
    others = lines("vt {:.6f} {:.6f}", part.texcoords) + lines(
        "vn {:.6f} {:.6f} {:.6f}", part.normals
    )
    faces = lines("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}", corners)
    (folder / "full.obj").write_text(points + others + faces)


def lines(form: str, rows: np.ndarray) -> str:
    """A line of text for each row."""
    return "".join(f"{form}\n".format(*row) for row in rows.tolist())


def bare_arrays(path: str) -> tuple[np.ndarray, np.ndarray]:
    """What any reader of trimesh's binary .ply must do: read it into two arrays. No checks."""
    row, whole = np.dtype([("length", "u1"), ("corners", "<i4", 3)]), "V12"
    with open(path, "rb") as file:
        vertices, faces = (element.rows for element in read_header(file).elements)
        positions = np.fromfile(file, "<f4", 3 * vertices)
        corners = np.empty(faces, whole)
        for first in range(0, faces, 1 << 13):
            rows = np.frombuffer(file.read(row.itemsize << 13), row)
            corners[first : first + len(rows)] = rows.getfield(whole, 1)
    return positions, corners.view("<i4")


READERS = {
    "ours": open_model,
    "trimesh": partial(trimesh.load_scene, process=False),
    "bare": bare_arrays,
}


def block(result: dict) -> str:
    """The table."""
    columns = {
        "format": lambda r: FORMATS[r["format"]],
        "triangles": lambda r: f"{r['triangles']:,}",
        "file, MB": lambda r: f"{r['bytes'] / 1e6:.1f}",
        "ms": lambda r: milliseconds(r["ours"]),
        "trimesh, ms": lambda r: milliseconds(r["trimesh"]),
        "times faster": lambda r: f"{r['trimesh']['least'] / r['ours']['least']:.1f}",
        "memory / file": lambda r: f"{r['ours']['peak_bytes'] / r['bytes']:.1f}",
    }
    bare = [
        f"{milliseconds(row['bare'])} ms for {row['triangles']:,} triangles, "
        f"{row['trimesh']['least'] / row['bare']['least']:.1f} times as fast as trimesh"
        for row in result["rows"]
        if "bare" in row
    ]
    parts = [
        origin_line(result),
        f"The fastest of {RUNS} processes, each after a small model; in brackets the median.",
        table(result["rows"], columns),
        f"Merely reading a binary .ply into two arrays takes {', and '.join(bare)}. No reader can "
        "be much faster than that.\n",
    ]
    return "\n\n".join(parts)


def milliseconds(times: dict) -> str:
    return f"{1e3 * times['least']:.1f} ({1e3 * times['median']:.1f})"
