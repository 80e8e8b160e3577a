"""The skeleton of all measurements: measure, keep the result as JSON, write pages from it.

A module that answers a question defines a `Question` and a `main` that runs it; `python -m bench`
finds it by its `main`.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import gltf_ext
from gltf_ext.errors import MeshletError

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
RESULTS = ROOT / "bench" / "results"
# The measurements write these themselves: changes there do not make a commit "-dirty".
WRITTEN_BY_MEASUREMENTS = (":!docs", ":!bench/results")


# --- a question ---


def _no_options(parser: argparse.ArgumentParser) -> None:
    pass


def _any_options(options: argparse.Namespace) -> None:
    pass


def _always(options: argparse.Namespace) -> bool:
    return True


@dataclass(frozen=True)
class Question:
    """One thing to measure.

    name: of the module, of bench/results/NAME.json and of `python -m bench NAME`
    about: the module's docstring; its first line is the help text
    measure: returns the figures without their origin; may raise MeshletError or OSError
    summary: the text to print for a result
    write_pages: writes the pages and pictures of a result and returns their paths
    packages: the packages whose versions a result keeps
    add_options: adds the question's own options
    check: ends the program if it cannot measure with the options; runs first
    complete: False if the options measure only a part; such a result is printed, not written
    """

    name: str
    about: str
    measure: Callable[[argparse.Namespace], dict]
    summary: Callable[[dict], str]
    write_pages: Callable[[dict], list[Path]]
    packages: tuple[str, ...] = ("gltf-meshlet", "numpy")
    add_options: Callable[[argparse.ArgumentParser], None] = _no_options
    check: Callable[[argparse.Namespace], None] = _any_options
    complete: Callable[[argparse.Namespace], bool] = _always

    def run(self) -> None:
        """Answers the question with the command line's options. Errors end it with one line."""
        options = self._options()
        try:
            result = read_result(self.name) if options.pages_only else self._measured(options)
            if result is None:
                raise SystemExit(f"bench {self.name}: bench/results/{self.name}.json is missing")
            print(self.summary(result))
            if options.no_write or not self.complete(options):
                return
            written = [] if options.pages_only else [write_result(self.name, result)]
            written += self.write_pages(result)
        except (MeshletError, OSError) as error:
            raise SystemExit(f"bench {self.name}: {error}") from None
        for path in written:
            progress(f"wrote {path.relative_to(ROOT)}")

    def _options(self) -> argparse.Namespace:
        parser = argparse.ArgumentParser(
            prog=f"python -m bench {self.name}", description=self.about.splitlines()[0]
        )
        self.add_options(parser)
        parser.add_argument("--no-write", action="store_true", help="only print")
        parser.add_argument(
            "--pages-only",
            action="store_true",
            help=f"measure nothing; write the pages of bench/results/{self.name}.json",
        )
        return parser.parse_args()

    def _measured(self, options: argparse.Namespace) -> dict:
        # Checks and the origin first: a missing package must not end an hour of measuring.
        self.check(options)
        return {**origin(f"bench.{self.name}", self.packages), **self.measure(options)}


_START = time.perf_counter()


def progress(text: str) -> None:
    """Prints a line to stderr with the seconds since the program started."""
    print(f"{time.perf_counter() - _START:6.0f} s  {text}", file=sys.stderr, flush=True)


_CALL = """
import importlib, json, sys
module, function, arguments = sys.argv[1:]
print(json.dumps(getattr(importlib.import_module(module), function)(*json.loads(arguments))))
"""


def call_in_process(module: str, function: str, *arguments):
    """Calls a function in a Python process of its own; arguments and the result must fit JSON."""
    command = [sys.executable, "-c", _CALL, module, function, json.dumps(arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    if done.returncode:
        raise SystemExit(f"bench: {module}.{function} failed in a process of its own")
    return json.loads(done.stdout.splitlines()[-1])


# --- the origin of figures ---


def origin(script: str, packages: tuple[str, ...] = ("gltf-meshlet", "numpy")) -> dict:
    """The script, date, commit, machine and versions. Ends the program if a package is missing."""
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
    """The commit, with "-dirty" if files differ from it; None outside a checkout."""
    if shutil.which("git") is None:
        return None
    git = ["git", "-C", ROOT]
    commit = subprocess.run(
        [*git, "describe", "--always"], capture_output=True, text=True
    ).stdout.strip()
    changed = subprocess.run(
        [*git, "status", "--porcelain", "--", ".", *WRITTEN_BY_MEASUREMENTS],
        capture_output=True,
        text=True,
    ).stdout.strip()
    return commit + ("-dirty" if changed else "") if commit else None


def _version(package: str) -> str:
    if package == "gltf-meshlet":  # also found if it runs from its folder without an installation
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


def origin_line(result: dict) -> str:
    """One sentence for a page: where its figures come from and how to get them again."""
    machine = result["machine"]
    commit = f" at commit {result['commit']}" if result["commit"] else ""
    return (
        f"Measured by `python -m {result['script']}` on {result['date'][:10]}{commit}, "
        f"{machine['cpu']}, {machine['cores']} cores.\n"
    )


# --- results ---


def write_result(name: str, result: dict) -> Path:
    """Writes bench/results/NAME.json; returns its path."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    return path


def read_result(name: str) -> dict | None:
    """bench/results/NAME.json; None if it has not been measured."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def spread(numbers: list[float]) -> dict[str, float]:
    """Median, lowest and highest of repeated timings."""
    return {"median": statistics.median(numbers), "low": min(numbers), "high": max(numbers)}


def percentiles(times: Iterable[float]) -> dict[str, float]:
    """Median, 10th (low) and 90th (high) percentile of many frame times."""
    low, median, high = np.percentile(list(times), [10, 50, 90])
    return {
        "median": round(float(median), 5),
        "low": round(float(low), 5),
        "high": round(float(high), 5),
    }


# --- pages ---


def write_page(name: str, text: str) -> Path:
    """Writes docs/NAME.md; returns its path."""
    path = DOCS / f"{name}.md"
    path.write_text(text)
    return path


def replace_block(path: Path, name: str, text: str) -> Path:
    """Replaces the lines of a Markdown file between <!-- begin NAME --> and <!-- end NAME -->."""
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    before, rest = path.read_text().split(begin)
    path.write_text(before + begin + text + end + rest.split(end, 1)[1])
    return path


def markdown_table(headings: list[str], rows: list[list[str]]) -> str:
    """A Markdown table; the first column is text, the others are figures."""
    lines = [headings, ["---"] + ["---:"] * (len(headings) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def best_in_bold(values: list[float | None], form: str, largest: bool = True) -> list[str]:
    """The figures of one row as text, the best one bold; None becomes an empty cell."""
    known = [value for value in values if value is not None]
    best = (max if largest else min)(known) if known else None
    return [
        "" if value is None else f"**{value:{form}}**" if value == best else f"{value:{form}}"
        for value in values
    ]


def pyplot():
    """matplotlib.pyplot, drawing to files only. Ends the program if matplotlib is missing."""
    try:
        import matplotlib
    except ImportError:
        raise SystemExit("bench: matplotlib is not installed; pip install matplotlib") from None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
