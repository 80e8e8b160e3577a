"""Blender: time and memory of importing compressed glTF, beside plain glTF and Draco.

Needs the extension (make blender PLATFORM=here) and bpy (make .venv/blender). Blender exports every
model plain, compressed with meshlets and compressed with Draco, at the same bits, and imports the
three files in turns, in a process of its own for each import.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import tempfile
from pathlib import Path

import gltf_ext
from bench.common import ROOT, markdown_table, origin_line, progress
from bench.generated import torus
from bench.models import add_model_names, real_model
from gltf_meshlet.demo.model import write_glb
from tools import blender_python, build_blender, build_wheels

HERE = next(iter(map(build_blender.blender_platform, build_wheels.GROUPS["here"])), None)
EXTENSION = ROOT / "dist" / f"gltf_meshlet-blender-{gltf_ext.__version__}-{HERE}.zip"
PARTS = ("models",)
MODELS = ("suzanne", "DamagedHelmet", "sponza_like", "dragon", "bistro_like")
FORMATS = {"plain": "plain", "meshlets": "ours", "draco": "Draco"}
REPETITIONS = 5


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, MODELS)


def check(options: argparse.Namespace) -> None:
    if not EXTENSION.is_file():
        missing = EXTENSION.relative_to(ROOT)
        raise SystemExit(f"bench blender: no {missing}; run make blender PLATFORM=here")
    if not blender_python.has_bpy():
        raise SystemExit(f"bench blender: {blender_python.MISSING}")
    for name in options.models:
        real_model(name)


def measure(options: argparse.Namespace) -> dict:
    """A row per model; the versions of Blender."""
    with tempfile.TemporaryDirectory() as folder:
        small = Path(folder, "torus.glb")
        write_glb([torus(200)], small)
        small_files, versions = exported(small, Path(folder))
        rows = [measure_model(name, small_files, Path(folder)) for name in options.models]
    return {"blender": versions, "repetitions": REPETITIONS, "models": rows}


def exported(model: Path, folder: Path) -> tuple[dict[str, str], dict]:
    """Format -> the file that Blender exports; the versions."""
    files = {name: str(folder / f"{model.stem}.{name}.glb") for name in FORMATS}
    return files, in_blender(folder, "prepare", str(EXTENSION), str(model), files)


def measure_model(name: str, small: dict[str, str], folder: Path) -> dict:
    """Sizes and times of one model. The formats take turns: other programs disturb all alike."""
    files, _ = exported(real_model(name), folder)
    runs: dict[str, list[dict]] = {form: [] for form in FORMATS}
    for repetition in range(REPETITIONS):
        progress(f"{name}, round {repetition + 1} of {REPETITIONS}")
        for form, path in files.items():
            runs[form].append(in_blender(folder, "measure", str(EXTENSION), small[form], path))
    return {
        "model": name,
        "triangles": runs["plain"][0]["triangles"],
        "formats": {
            form: {
                "bytes": os.path.getsize(files[form]),
                "seconds": min(run["seconds"] for run in found),
                "slowest_seconds": max(run["seconds"] for run in found),
                "first_seconds": min(run["first_seconds"] for run in found),
                "peak_bytes": statistics.median(run["peak_bytes"] for run in found),
            }
            for form, found in runs.items()
        },
    }


def in_blender(folder: Path, function: str, *arguments) -> dict:
    """The result of a function of blender_worker.py. Ends the program if it fails."""
    worker = ROOT / "bench" / "blender_worker.py"
    with tempfile.TemporaryDirectory(dir=folder) as user:
        environment = {**os.environ, "BLENDER_USER_RESOURCES": user}
        done = subprocess.run(
            (blender_python.PYTHON, worker, function, json.dumps(arguments)),
            capture_output=True,
            text=True,
            env=environment,
        )
    if done.returncode:
        raise SystemExit(f"bench blender: {function} failed in Blender\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


# --- report ---


def table(result: dict) -> str:
    """Sizes, times and memory by model and format."""
    headings = ["model", "triangles"]
    for what in ("MB", "seconds", "peak MB"):
        headings += [f"{what}, {form}" for form in FORMATS.values()]
    rows = []
    for row in result["models"]:
        formats = [row["formats"][form] for form in FORMATS]
        rows.append(
            [
                row["model"],
                f"{row['triangles']:,}",
                *(f"{f['bytes'] / 1e6:.2f}" for f in formats),
                *(f"{f['seconds']:.2f}" for f in formats),
                *(f"{f['peak_bytes'] / 1e6:.0f}" for f in formats),
            ]
        )
    return markdown_table(headings, rows)


def block(result: dict) -> str:
    """The table with its origin."""
    blender = result["blender"]
    firsts = [
        min(row["formats"][form]["first_seconds"] for row in result["models"]) for form in FORMATS
    ]
    first = ", ".join(f"{1000 * s:.0f} ms {name}" for s, name in zip(firsts, FORMATS.values()))
    return (
        f"{table(result)}\n"
        f"Seconds are the fastest of {result['repetitions']} imports, each in a new Blender; peak "
        "MB is the median growth of its memory, Blender's mesh included. The first import of a "
        f"small file after Blender starts, which loads the code of its format: {first}.\n\n"
        f"Blender {blender['blender']} as a Python module, Python {blender['blender python']}. "
        f"{origin_line(result)}"
    )
