"""What all measurements share: where the models are, what a result file says about its origin, Markdown tables."""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import platform
import shutil
import statistics
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import gltf_ext
from gltf_ext.compression.extension import compressed_primitives
from gltf_ext.gltf.importers import open_model

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "bench" / "results"
FIGURES = (":!docs", ":!bench/results", ":!README.md")  # what measurements themselves change
MODELS = Path(os.environ.get("GLTF_MESHLET_MODELS", ROOT.parent / "shared" / "models"))

# The six models of the paper's comparison and what we have for them.
PAPER_MODELS = {
    "suzanne": "Suzanne, with the paper's counts",
    "bunny": "Stanford Bunny, the paper's number of triangles, an atlas with more seams",
    "materialball": "a shader ball, stands in for Material Ball",
    "sponza_like": "a composite, stands in for Sponza",
    "dragon": "Stanford Dragon, the paper's number of triangles, no texture coordinates",
    "bistro_like": "a composite, stands in for the Bistro interior",
}
OTHER_MODELS = {
    "beast": "a character, texture coordinates with seams",
    "chinesedragon": "a closed statue, texture coordinates on its small second part only",
    "DamagedHelmet": "a hard-edged sample model of few triangles",
    "engine": "a CAD engine of 34 parts, hard edges",
    "igea": "a closed scan",
}


def models() -> list[Path]:
    """The real models, by name; ends the program with one line when there are none."""
    found = sorted(MODELS.glob("*.glb"), key=lambda path: path.name.lower())
    if not found:
        raise SystemExit(
            f"bench: no .glb files in {os.path.relpath(MODELS)}; set GLTF_MESHLET_MODELS to a folder of models"
        )
    return found


def origin(script: str, packages: tuple[str, ...] = ("gltf-meshlet", "numpy")) -> dict:
    """Where figures come from: the script, date, commit, machine and versions. Ends the program where a package is missing."""
    return {
        "script": script,
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "commit": os.environ.get("GLTF_MESHLET_COMMIT") or _commit(),
        "machine": {"cpu": _cpu_name(), "cores": os.cpu_count(), "system": platform.platform()},
        "versions": {
            "python": platform.python_version(),
            **{name: _version(name) for name in packages},
        },
    }


def _commit() -> str | None:
    """The checked-out commit, "-dirty" where files differ from it; None outside a checkout, where GLTF_MESHLET_COMMIT may name it."""
    if shutil.which("git") is None:
        return None
    git = ["git", "-C", ROOT]
    commit = subprocess.run(
        [*git, "describe", "--always"], capture_output=True, text=True
    ).stdout.strip()
    changed = subprocess.run(
        [*git, "status", "--porcelain", "--", ".", *FIGURES], capture_output=True, text=True
    ).stdout.strip()
    return commit + ("-dirty" if changed else "") if commit else None


def _version(package: str) -> str:
    if package == "gltf-meshlet":  # also where it runs from its folder
        return gltf_ext.__version__
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        raise SystemExit(f"bench: {package} is not installed; pip install {package}") from None


def _cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def write_result(name: str, result: dict) -> Path:
    """Writes bench/results/NAME.json; returns its path."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    return path


def read_result(name: str) -> dict | None:
    """bench/results/NAME.json; None where it has not been measured."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def spread(numbers: list[float]) -> dict[str, float]:
    """What a result keeps of repeated timings."""
    return {"median": statistics.median(numbers), "low": min(numbers), "high": max(numbers)}


def percentiles(times: Iterable[float]) -> dict[str, float]:
    """What a result keeps of many frame times: median, and the 10th and 90th percentiles."""
    low, median, high = np.percentile(list(times), [10, 50, 90])
    return {
        "median": round(float(median), 5),
        "low": round(float(low), 5),
        "high": round(float(high), 5),
    }


def compressed(path: Path, folder: Path) -> Path:
    """The file itself where it is compressed, else a compressed copy in `folder`."""
    if compressed_primitives(open_model(path)):
        return path
    output = folder / f"{path.stem}.glb"
    gltf_ext.compress(path, output)
    return output


def best_in_bold(values: list[float | None], form: str, largest: bool = True) -> list[str]:
    """Figures of one row as text, the best one bold; None is left blank."""
    known = [value for value in values if value is not None]
    best = (max if largest else min)(known) if known else None
    return [
        "" if value is None else f"**{value:{form}}**" if value == best else f"{value:{form}}"
        for value in values
    ]


def markdown_table(headings: list[str], rows: list[list[str]]) -> str:
    """A Markdown table whose first column is text and whose others are figures."""
    lines = [headings, ["---"] + ["---:"] * (len(headings) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def origin_line(result: dict) -> str:
    """One sentence that says where a table's figures come from and how to get them again."""
    machine = result["machine"]
    commit = f" at commit {result['commit']}" if result["commit"] else ""
    return (
        f"Measured by `python -m {result['script']}` on {result['date'][:10]}{commit}, "
        f"{machine['cpu']}, {machine['cores']} cores.\n"
    )


def replace_block(path: Path, name: str, text: str) -> None:
    """Replaces what stands in a Markdown file between <!-- begin NAME --> and <!-- end NAME -->."""
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    before, rest = path.read_text().split(begin)
    path.write_text(before + begin + text + end + rest.split(end, 1)[1])
