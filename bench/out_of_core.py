"""Models larger than memory: size, errors, time and memory in chunks, beside those in one piece.

Writes a table into docs/out-of-core.md. The model is the dragon with each triangle cut into n x n
and noise: it reads dragon.glb, and nothing else. Each run has a process of its own; positions have
16 bits.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import gltf_ext
from bench.common import call_in_process, origin_line, progress, table
from bench.large_model import write_displaced
from bench.lod import levels, percentile
from bench.models import real_model
from gltf_ext.checks.samples import distances_to, sample_surface
from gltf_ext.lod import LodPrimitive, open_lod
from gltf_ext.lod.cuts import Cut, cut_at_level, error_of

PACKAGES = ("gltf-meshlet", "numpy", "meshoptimizer")
MODEL, BITS = "dragon", 16
SIDES, LARGE = (2, 4), 8  # n; from LARGE on in chunks only
MEMORY, SMALL_MEMORY = "2G", {1: "200M", 2: "500M"}  # by n
IN_BOX, SAMPLES = 2_000_000, 200_000  # triangles of level 0 in the box of large models; points


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sides",
        type=int,
        nargs="+",
        metavar="N",
        default=SIDES,
        help="cut triangles into N x N: 11 gives 105 M triangles, 17 252 M; from "
        f"{LARGE} on in chunks only",
    )
    parser.add_argument(
        "--memory", default=MEMORY, metavar="BYTES", help=f"--max-memory (default {MEMORY})"
    )
    parser.add_argument(
        "--work-dir", help="folder for models and work files: 72 bytes for each triangle"
    )


def measure(options: argparse.Namespace) -> dict:
    """Each model with --max-memory; the smaller ones also without."""
    models = []
    with tempfile.TemporaryDirectory(dir=options.work_dir) as folder:
        for n in options.sides:
            progress(f"n = {n}")
            source = str(write_displaced(real_model(MODEL), n, Path(folder, "in.gltf")))
            output = str(Path(folder, "out.glb"))
            model: dict = {"n": n, "memory": SMALL_MEMORY.get(n, options.memory)}
            whole = {"lod": True, "position_bits": BITS}
            chunks = {**whole, "max_memory": model["memory"]}
            chunks["work_dir"] = folder
            model["chunks"] = call_in_process("bench.lod_build", "watched", source, output, chunks)
            model["problems"] = call_in_process(
                "bench.out_of_core", "problems", source, output, model["memory"]
            )
            errors = "levels_in_box" if n >= LARGE else "levels_of"
            model["levels"] = call_in_process("bench.out_of_core", errors, output)
            if n < LARGE:
                model["whole"] = call_in_process("bench.lod_build", "build", source, output, whole)
            models.append(model)
    return {"models": models}


def problems(source: str, output: str, memory: str) -> list[str]:
    """What `validate` and `verify --max-memory` find; the former also cuts that are not closed."""
    verified = gltf_ext.verify(source, output, max_memory=memory)
    return gltf_ext.validate(output) + verified["problems"]


def levels_of(path: str) -> list[dict]:
    """Stated and measured errors of all levels."""
    (primitive,) = open_lod(path)
    assert isinstance(primitive, LodPrimitive)
    return levels(primitive)


def levels_in_box(path: str) -> list[dict]:
    """Stated and measured errors of levels in a box around the middle group of level 0.

    Points are of a box of 3/4 of its size; levels with errors of an eighth of it are left out.
    """
    (primitive,) = open_lod(path)
    assert isinstance(primitive, LodPrimitive)
    tables = primitive.tables
    centres = tables.groups["centre"].astype(np.float64)
    finest = np.flatnonzero(tables.group_level == 0)
    middle = centres[finest[len(finest) // 2]]
    distances = np.abs(centres - middle).max(axis=1)
    group = tables.cluster_group
    sizes = np.bincount(group, primitive.cluster_triangles)[finest]
    nearest = np.argsort(distances[finest])
    covered = np.searchsorted(np.cumsum(sizes[nearest]), IN_BOX)
    half = float(distances[finest][nearest[min(covered, len(nearest) - 1)]])
    is_near = (distances <= half + tables.groups["radius"])[group]

    def near(cut: Cut) -> tuple[object, np.ndarray]:
        drawn = cut.drawn & is_near
        pages = np.unique(tables.groups["page"][group[drawn]])
        mesh = primitive.mesh(replace(cut, drawn=drawn, pages=pages))
        points = sample_surface(mesh, SAMPLES)
        return mesh, points[np.abs(points - middle).max(axis=1) <= 0.75 * half]

    fine, of_fine = near(cut_at_level(tables, 0))
    result = []
    for level in range(1, tables.level_count):
        cut = cut_at_level(tables, level)
        stated = error_of(tables, cut)
        if stated > half / 8:
            break
        coarse, of_coarse = near(cut)
        both = np.concatenate([distances_to(of_coarse, fine), distances_to(of_fine, coarse)])
        result.append(
            {
                "triangles": int(primitive.cluster_triangles[cut.drawn].sum()),
                "stated": stated,
                "measured": percentile(both),
                "within": float((both <= stated).mean()),
            }
        )
    return result


def block(result: dict) -> str:
    """The tables of the manual."""
    rows = [
        {"model": model, "run": run, **model[run]}
        for model in result["models"]
        for run in ("whole", "chunks")
        if run in model
    ]

    def share(row: dict) -> str:
        whole = row["model"].get("whole")
        return f"{row['bytes'] / whole['bytes']:.3f}" if whole else ""

    runs = {
        "triangles": lambda row: f"{row['triangles']:,}",
        "`--max-memory`": lambda row: row["model"]["memory"] if row["run"] == "chunks" else "",
        "file": lambda row: f"{row['bytes'] / 1e6:.2f} MB",
        "over that in one piece": share,
        "peak memory": lambda row: f"{row['peak_bytes'] / 2**20:,.0f} MiB",
        "of all processes": lambda row: (
            f"{row['group_bytes'] / 2**20:,.0f} MiB" if "group_bytes" in row else ""
        ),
        "processor time": lambda row: f"{row['cpu_seconds']:.0f} s",
        "per million triangles": lambda row: f"{row['cpu_seconds'] / row['triangles'] * 1e6:.1f} s",
        "work files": lambda row: (
            f"{row['disk_bytes'] / 1e9:.1f} GB" if "disk_bytes" in row else ""
        ),
        "load": lambda row: f"{row['load']:.0f}" if "load" in row else "",
    }
    errors = {
        "triangles of level 0": lambda row: f"{row['of']:,}",
        "level": lambda row: str(row["level"]),
        "triangles": lambda row: f"{row['triangles']:,}",
        "stated error": lambda row: f"{row['stated']:.3g}",
        "measured, 99.9 %": lambda row: f"{row['measured']:.3g}",
        "samples within": lambda row: f"{100 * row['within']:.2f} %",
    }
    of_levels = [
        {"of": model["chunks"]["triangles"], "level": number, **level}
        for model in result["models"]
        for number, level in enumerate(model.get("levels", []), start=1)
    ]
    parts = [
        origin_line(result),
        "The dragon with each triangle cut into n x n and noise, with levels of detail and "
        "positions of 16 bits:",
        table(rows, runs),
        "Load: processes that wanted one of the processors, on average, others included. Processor "
        "time grows with it, as caches are shared.",
        *(found_by_checks(model) for model in result["models"] if "problems" in model),
        "Errors of the files made in chunks. Of models that are made in chunks only, they are "
        "those of a box of two million triangles.",
        table(of_levels, errors),
    ]
    return "\n\n".join(parts)


def found_by_checks(model: dict) -> str:
    """The sentence on `validate` and `verify`."""
    triangles = f"Of {model['chunks']['triangles']:,} triangles, `validate` and `verify`"
    if model["problems"]:
        return f"{triangles} FIND {len(model['problems'])} PROBLEMS: {model['problems'][0]}."
    return (
        f"{triangles} find no problem: every cut is closed where the source is, and no position is "
        "further off than promised."
    )
