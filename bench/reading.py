"""How fast are .obj, .ply and .stl read, and in how much memory? Beside trimesh.

Writes a table of docs/scale.md. Times are processor time, of one thread, of opening a model as a
glTF document; trimesh's are of trimesh.load_scene, without the document.
"""

from __future__ import annotations

import argparse
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
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.ply import read_header

PACKAGES = ("gltf-meshlet", "numpy", "trimesh")
DOCUMENT, BLOCK = "scale", "reading"
SIZES = (60_000, 1_000_000)  # triangles
RUNS, RUNS_OF_LARGE, LARGE = 9, 3, 20_000_000  # the last: bytes of a large file
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
        for triangles in SIZES:
            write(triangles, Path(folder))
            for name in FORMATS:
                progress(f"{triangles:,} triangles, {name}")
                path = str(Path(folder) / name)
                row = {"triangles": triangles, "format": name, "bytes": Path(path).stat().st_size}
                peak = call_in_process("bench.reading", "peak", path)
                rows.append({**row, **peak, **call_in_process("bench.reading", "times", path)})
    return {"rows": rows}


def write(triangles: int, folder: Path) -> None:
    """The same torus in all formats."""
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


def times(path: str) -> dict:
    """Ours and trimesh's; of a binary .ply also of its bare arrays."""
    readers = {"": open_model, "trimesh_": partial(trimesh.load_scene, process=False)}
    if path.endswith("binary.ply"):
        readers["bare_"] = bare_arrays
    runs = RUNS_OF_LARGE if Path(path).stat().st_size > LARGE else RUNS
    result = {}
    for name, read in readers.items():
        seconds = [seconds_of(read, path) for _ in range(runs)]
        result[f"{name}seconds"] = min(seconds)
        result[f"{name}median_seconds"] = statistics.median(seconds)
    return result


def seconds_of(read, path: str) -> float:
    """Processor time."""
    start = time.process_time()
    read(path)
    return time.process_time() - start


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


def peak(path: str) -> dict:
    """Bytes of memory that opening takes at its peak, with the document."""
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak, which exec inherits
    before = memory_of_process("VmRSS")
    document = open_model(path)
    assert document.meshes
    return {"peak_bytes": memory_of_process("VmHWM") - before}


def block(result: dict) -> str:
    """The table."""
    columns = {
        "format": lambda r: FORMATS[r["format"]],
        "triangles": lambda r: f"{r['triangles']:,}",
        "file, MB": lambda r: f"{r['bytes'] / 1e6:.1f}",
        "ms": lambda r: milliseconds(r, ""),
        "trimesh, ms": lambda r: milliseconds(r, "trimesh_"),
        "times faster": lambda r: f"{r['trimesh_seconds'] / r['seconds']:.1f}",
        "memory / file": lambda r: f"{r['peak_bytes'] / r['bytes']:.1f}",
    }
    bare = [
        f"{milliseconds(row, 'bare_')} ms of {row['triangles']:,} triangles, "
        f"{row['trimesh_seconds'] / row['bare_seconds']:.1f} times as fast as trimesh"
        for row in result["rows"]
        if "bare_seconds" in row
    ]
    parts = [
        origin_line(result),
        "Times of the fastest run, and in brackets of the median.",
        table(result["rows"], columns),
        f"Merely reading a binary .ply into two arrays takes {' and '.join(bare)}. No reader that "
        "fills arrays can be faster.",
    ]
    return "\n\n".join(parts)


def milliseconds(row: dict, reader: str) -> str:
    return f"{1e3 * row[f'{reader}seconds']:.1f} ({1e3 * row[f'{reader}median_seconds']:.1f})"
