"""Is compress as fast, as small and as modest in memory as at an earlier commit?

Prints a table; writes no document. Each run has a process of its own, and those of the two commits
alternate. The earlier commit needs its own environment:

    git worktree add ../before COMMIT && make -C ../before .venv/installed
    ../before/.venv/bin/pip install meshoptimizer==0.2.30a0
    python -m bench before_after --before COMMIT ../before/.venv/bin/python

The large models are the dragon with each triangle cut into n x n, as in bench.out_of_core.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from itertools import product
from pathlib import Path

from bench import lod_build
from bench.common import call_in_process, markdown_table, origin_line, progress
from bench.large_model import write_displaced
from bench.models import real_model, real_models
from bench.out_of_core import BITS, MEMORY, MODEL

PACKAGES = ("gltf-meshlet", "numpy", "meshoptimizer")
FIGURES = ("seconds", "cpu_seconds", "group_bytes", "verify_seconds", "bytes")


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--before", nargs=2, metavar=("COMMIT", "PYTHON"), required=True)
    parser.add_argument("--repeats", type=int, default=5, metavar="N", help="runs of small models")
    parser.add_argument("--models", nargs="*", help="names of small models (default: all)")
    parser.add_argument(
        "--sides",
        type=int,
        nargs="*",
        default=[4, 11],
        metavar="N",
        help="cut triangles of the large model into N x N: 4 gives 14 M triangles, 11 105 M",
    )
    parser.add_argument("--work-dir", help="folder for models and work files")


def check(options: argparse.Namespace) -> None:
    """Ends the program if --before names a Python with the package of this commit."""
    lod_build.require_other_package("before_after", options.before[1])


def measure(options: argparse.Namespace) -> dict:
    """Rows of both commits: small models as they are and with levels, large ones in chunks."""
    commit, python = options.before
    sources = [real_model(name) for name in options.models] if options.models else real_models()
    with tempfile.TemporaryDirectory(dir=options.work_dir) as folder:
        rows = [
            _row(source, {"lod": lod}, python, folder, options.repeats)
            for source, lod in product(sources, (False, True))
        ]
        for side in options.sides:
            source = Path(folder, f"{MODEL}_x{side * side}.gltf")
            write_displaced(real_model(MODEL), side, source)
            chunks = {"lod": True, "position_bits": BITS, "max_memory": MEMORY}
            rows.append(_row(source, {**chunks, "work_dir": folder}, python, folder, 1))
    return {"before": commit, "rows": rows}


def _row(source: Path, settings: dict, python: str, folder: str, repeats: int) -> dict:
    """Medians of alternating runs with the Python of the earlier commit and with this one."""
    progress(f"{source.stem} {settings}")
    output = str(Path(folder, "out.glb"))
    pythons = {"before": {"python": python}, "after": {}}
    runs: dict[str, list[dict]] = {name: [] for name in pythons}
    for _, (name, other) in product(range(repeats), pythons.items()):
        module, places = "bench.lod_build", (str(source), output)
        run = call_in_process(module, "watched", *places, settings, **other)
        progress(f"{name}: {run['seconds']:.2f} s, {run['group_bytes'] >> 20} MiB")
        run |= call_in_process(module, "verified", *places, settings.get("max_memory"), **other)
        runs[name].append(run)
    first = runs["after"][0]
    return {
        "model": source.stem,
        "lod": settings["lod"],
        "triangles": first["triangles"],
        "load": max(run["load"] for name in runs for run in runs[name]),
        **{
            name: {figure: statistics.median(run[figure] for run in of) for figure in FIGURES}
            for name, of in runs.items()
        },
    }


def summary(result: dict) -> str:
    """A table of both commits, with ratios of after to before, and their medians."""
    heading = [
        *("model", "levels", "triangles", "seconds", "processor seconds", "memory, MiB"),
        *("verify, seconds", "bytes"),
    ]
    lines = [
        [
            row["model"],
            "yes" if row["lod"] else "no",
            f"{row['triangles']:,}",
            *(_pair(row, figure) for figure in FIGURES),
        ]
        for row in result["rows"]
    ]
    ratios = [
        f"{statistics.median(_ratio(row, figure) for row in result['rows']):.3f}"
        for figure in FIGURES
    ]
    lines.append(["median of ratios", "", "", *ratios])
    return (
        f"{origin_line(result)} Before: {result['before']}.\n\n"
        f"Each cell: before, after, after / before.\n\n{markdown_table(heading, lines)}"
    )


def _ratio(row: dict, figure: str) -> float:
    return row["after"][figure] / row["before"][figure]


def _pair(row: dict, figure: str) -> str:
    before, after = row["before"][figure], row["after"][figure]
    if figure == "group_bytes":
        before, after = before / 2**20, after / 2**20
    form = ",.0f" if figure in ("bytes", "group_bytes") else ".2f"
    return f"{before:{form}}, {after:{form}}, {_ratio(row, figure):.3f}"
