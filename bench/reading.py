"""How fast are .obj, .ply and .stl read, and in how much memory? Beside trimesh.

Writes a table of docs/scale.md. Times are processor time, of one thread, of opening a model as a
glTF document, the least of some runs; trimesh's are of trimesh.load_scene, without the document.
"""

from __future__ import annotations

import argparse
import tempfile
import time
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

PACKAGES = ("gltf-meshlet", "numpy", "trimesh")
DOCUMENT, BLOCK = "scale", "reading"
SIZES = (60_000, 1_000_000)  # triangles
RUNS, LARGE = 3, 20_000_000  # runs of a file with fewer bytes than that; one of others
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
    """Ours and trimesh's."""
    runs = RUNS if Path(path).stat().st_size < LARGE else 1
    return {
        "seconds": least(lambda: open_model(path), 2 * runs),
        "trimesh_seconds": least(lambda: trimesh.load_scene(path, process=False), runs),
    }


def least(run, runs: int) -> float:
    """Seconds of processor time of the fastest run."""
    times = []
    for _ in range(runs):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


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
        "seconds": lambda r: f"{r['seconds']:.3f}",
        "trimesh, seconds": lambda r: f"{r['trimesh_seconds']:.3f}",
        "times faster": lambda r: f"{r['trimesh_seconds'] / r['seconds']:.1f}",
        "memory / file": lambda r: f"{r['peak_bytes'] / r['bytes']:.1f}",
    }
    return f"{origin_line(result)}\n{table(result['rows'], columns)}"
