"""Mitsuba with levels of detail beside full detail: time and memory.

Writes a table into docs/mitsuba.md. Each row runs in a process of its own. Memory is the growth of
the process from before the scene is loaded to after it was rendered, as in bench.mitsuba.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gltf_ext
from bench.common import BITS, ROOT, call_in_process, origin_line, progress, table
from bench.large_model import write_displaced
from bench.models import real_model

PACKAGES = ("gltf-meshlet", "numpy", "mitsuba", "drjit", "meshoptimizer")
DOCUMENT, BLOCK = "mitsuba", "levels"
MODEL, CUTS = "dragon", (1, 2, 4)  # of each edge, with noise
VARIANT = "scalar_rgb"
SIZE = 1000  # width and height of the picture in pixels; the model fills 85 %
SPP = 4
INTEGRATOR = {"type": "path", "max_depth": 3}
PIXELS = 1.0
WARM_UP = ROOT / "spec" / "lod_vectors" / "lod_strip.glb"
# (heading, lod_error, ordinary meshes)
ROWS = (
    ("mesh, full detail", 0.0, True),
    ("shape, full detail", 0.0, False),
    ("mesh, one pixel", PIXELS, True),
    ("shape, one pixel", PIXELS, False),
)


def measure(_: argparse.Namespace) -> dict:
    """MODEL with its triangles cut, with levels."""
    models = {}
    with tempfile.TemporaryDirectory() as folder:
        for n in CUTS:
            source, output = real_model(MODEL), Path(folder, f"{n}.lod.glb")
            if n > 1:
                source = write_displaced(source, n, Path(folder, f"{n}.glb"))
            gltf_ext.compress(source, output, lod=True, **BITS)
            name = f"{MODEL} x{n * n}, displaced" if n > 1 else MODEL
            models[name] = rows_of(str(output))
    return {"models": models}


def rows_of(path: str) -> list[dict]:
    """A row for each of ROWS, for a file with levels."""
    rows = []
    for heading, lod_error, decoded in ROWS:
        progress(f"Mitsuba: {heading}")
        found = call_in_process("bench.lod_mitsuba", "render", path, lod_error, decoded)
        rows.append({"heading": heading, **found})
    return rows


def render(path: str, lod_error: float, decoded: bool) -> dict:
    """Seconds to load and render, bytes that stay, triangles of the scene."""
    import mitsuba as mi

    mi.set_variant(VARIANT)
    import mitsuba_plugin
    from bench.mitsuba import resident_bytes

    options = {"width": SIZE, "height": SIZE, "integrator": INTEGRATOR, "cache": 0.25}
    # What Mitsuba keeps after its first picture does not count for the scene.
    mi.render(mitsuba_plugin.load_scene(str(WARM_UP), **options), spp=1).numpy()
    before, start = resident_bytes(), time.perf_counter()
    scene = mitsuba_plugin.load_scene(path, lod_error=lod_error, decoded=decoded, **options)
    loaded = time.perf_counter()
    mi.render(scene, spp=SPP, seed=0).numpy()
    rendered = time.perf_counter()
    after = resident_bytes()
    figures = mitsuba_plugin.statistics(scene)
    meshes = sum(s.face_count() for s in scene.shapes() if isinstance(s, mi.Mesh))
    return {
        "load": loaded - start,
        "render": rendered - loaded,
        "bytes": after - before,
        "triangles": meshes + figures["triangles"],
        "compressed_bytes": figures["compressed_bytes"],
        "cache_bytes": figures["resident_bytes"],
    }


def block(result: dict) -> str:
    """The table of the manual."""
    rows = [
        {"name": name, "first": rows[0]["bytes"], **row}
        for name, rows in result["models"].items()
        for row in rows
    ]

    def megabytes(name: str) -> Callable[[dict], str]:
        return lambda row: f"{row[name] / 1e6:.2f} MB" if row[name] else ""

    columns: dict[str, Callable[[dict], str]] = {
        "": lambda row: f"{row['name']}, {row['heading']}",
        "triangles": lambda row: f"{row['triangles']:,}",
        "load": lambda row: f"{row['load']:.1f} s",
        "render": lambda row: f"{row['render']:.1f} s",
        "memory": lambda r: f"{r['bytes'] / 1e6:.1f} MB ({r['bytes'] / r['first']:.2f}x)",
        "compressed": megabytes("compressed_bytes"),
        "cache": megabytes("cache_bytes"),
    }
    return (
        f"{origin_line(result)}\n"
        f"{SIZE} x {SIZE} pixels, {SPP} samples per pixel, `path` of depth "
        f"{INTEGRATOR['max_depth']}, {VARIANT}, the model whole in the picture, cache 25 %. Shape: "
        "compressed in memory, decoded where rays meet it. Mesh: an ordinary mesh (`decoded`). "
        "Load contains the acceleration structure. Memory is the growth of the process.\n\n"
        f"{table(rows, columns)}"
    )
