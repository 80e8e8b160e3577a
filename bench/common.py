"""The skeleton of all measurements: measure, keep the result as JSON, write documents from it."""

from __future__ import annotations

import argparse
import datetime
import hashlib
import importlib.metadata
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from gltf_ext.errors import MeshletError

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
RESULTS = ROOT / "bench" / "results"
# The measurements write these themselves: changes there do not make a commit "-dirty".
WRITTEN_BY_MEASUREMENTS = (":!docs", ":!bench/results")
PACKAGES = ("gltf-meshlet", "numpy")
# Bits of measurements, ours and the peers': the same everywhere, whatever the defaults become.
BITS = {
    "position_bits": 12,
    "normal_bits": 8,
    "texcoord_bits": 12,
    "color_bits": 8,
    "weight_bits": 8,
}
BITS_TEXT = "12 bits for positions, 8 for normals, 12 for texture coordinates, 8 for colours"
DIGEST = "Figures"  # the text field of a PNG with the digest of what it shows


# --- a question ---


def answer(question: Any, arguments: list[str]) -> None:
    """Answers the question of a module. Errors end the program with one line.

    question: a module, whose docstring begins with the help text, with these names; all but
    `measure` and one of `report`, `block` and `summary`, which is printed, are optional:

    measure(options): returns the figures without their origin; may raise MeshletError or OSError
    report(result): the text of docs/DOCUMENT.md, of which the module writes every line
    block(result): the text between the comments "begin BLOCK" and "end BLOCK" in docs/DOCUMENT.md
    summary(result): a text for docs/results.md
    save_plot(result, path): draws docs/NAME.png and returns the path
    write_pictures(result): draws further pictures and returns their paths
    DOCUMENT: the document's name, by default NAME with hyphens for underscores
    BLOCK: by default "measurements"
    PACKAGES: the packages whose versions a result keeps
    add_options(parser): adds options
    check(options): ends the program if it cannot measure with the options; runs first
    PARTS: names of options; other values than the defaults measure a part, which is only printed
    """
    name = _name(question)
    parser = _parser(question, name)
    options = parser.parse_args(arguments)
    parts = getattr(question, "PARTS", ())
    is_part = any(getattr(options, part) != parser.get_default(part) for part in parts)
    try:
        result = read_result(name) if options.docs_only else _measured(question, options)
        if result is None:
            raise SystemExit(f"bench {name}: bench/results/{name}.json is missing")
        is_written = not (options.no_write or is_part)
        # Before anything that may fail: an hour of measuring must not be lost.
        written = [write_result(name, result)] if is_written and not options.docs_only else []
        texts = (getattr(question, text, None) for text in ("report", "block", "summary"))
        print(next(filter(None, texts))(result))
        if is_written:
            written += documents_of(question, result)
    except (MeshletError, OSError) as error:
        raise SystemExit(f"bench {name}: {error}") from None
    for path in written:
        progress(f"wrote {path.relative_to(ROOT)}")


def documents_of(question: Any, result: dict) -> list[Path]:
    """Writes the documents and pictures of a result; returns their paths."""
    name = _name(question).replace("_", "-")
    document = DOCS / f"{getattr(question, 'DOCUMENT', name)}.md"
    written = []
    if hasattr(question, "save_plot"):
        written.append(question.save_plot(result, DOCS / f"{name}.png"))
    if hasattr(question, "report"):
        document.write_text(question.report(result))
        written.append(document)
    if hasattr(question, "block"):
        block = getattr(question, "BLOCK", "measurements")
        written.append(replace_block(document, block, question.block(result)))
    if hasattr(question, "write_pictures"):
        written += question.write_pictures(result)
    return written


def _name(question: Any) -> str:
    return question.__name__.rpartition(".")[2]


def _parser(question: Any, name: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=f"python -m bench {name}", description=question.__doc__.splitlines()[0]
    )
    if hasattr(question, "add_options"):
        question.add_options(parser)
    parser.add_argument("--no-write", action="store_true", help="only print")
    parser.add_argument(
        "--docs-only",
        action="store_true",
        help=f"measure nothing; write the documents of bench/results/{name}.json",
    )
    return parser


def _measured(question: Any, options: argparse.Namespace) -> dict:
    # Checks and the origin first: a missing package must not end an hour of measuring.
    if hasattr(question, "check"):
        question.check(options)
    packages = getattr(question, "PACKAGES", PACKAGES)
    return {**origin(question.__name__, packages), **question.measure(options)}


_START = time.perf_counter()


def progress(text: str) -> None:
    """Prints a line to stderr with the seconds since the program started."""
    print(f"{time.perf_counter() - _START:6.0f} s  {text}", file=sys.stderr, flush=True)


# The package that is installed comes before that of the checkout: another Python may have another.
_CALL = """
import importlib, json, sys
sys.path.append(sys.path.pop(0))
import gltf_ext
sys.path.insert(0, sys.path.pop())
module, function, arguments = sys.argv[1:]
print(json.dumps(getattr(importlib.import_module(module), function)(*json.loads(arguments))))
"""


def call_in_process(module: str, function: str, *arguments, python: str = sys.executable):
    """Calls a function in a Python process of its own; arguments and the result must fit JSON."""
    command = [python, "-c", _CALL, module, function, json.dumps(arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    if done.returncode:
        raise SystemExit(f"bench: {module}.{function} failed in a process of its own")
    return json.loads(done.stdout.splitlines()[-1])


def memory_of_process(field: str) -> int:
    """Bytes of a field of /proc/self/status: VmRSS, or the peak, VmHWM, of this process alone
    (ru_maxrss would count those of the process that started it)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(f"{field}:"))


# --- the origin of figures ---


def origin(script: str, packages: tuple[str, ...] = PACKAGES) -> dict:
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
    commit = git_output(ROOT, "describe", "--always")
    changed = git_output(ROOT, "status", "--porcelain", "--", ".", *WRITTEN_BY_MEASUREMENTS)
    return commit + ("-dirty" if changed else "") if commit else None


def git_output(folder: Path, *arguments: str) -> str:
    """What git prints in a folder; nothing if it fails."""
    command = ["git", "-C", folder, *arguments]
    return subprocess.run(command, capture_output=True, text=True).stdout.strip()


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


def command(result: dict) -> str:
    """The command that measures a result again."""
    return f"python -m bench {result['script'].removeprefix('bench.')}"


def versions(named: dict[str, str]) -> str:
    """Names with their versions, in words."""
    return ", ".join(f"{name} ({version})" for name, version in named.items()) or "none"


def origin_line(result: dict) -> str:
    """One sentence for a document: where its figures come from and how to get them again."""
    machine = result["machine"]
    commit = f" at commit {result['commit']}" if result["commit"] else ""
    return (
        f"Measured by `{command(result)}` on {result['date'][:10]}{commit}, "
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
    values = np.percentile(list(times), [50, 10, 90]).tolist()
    return {name: round(value, 5) for name, value in zip(("median", "low", "high"), values)}


def milliseconds(row: dict) -> float:
    """The median of a frame on the GPU."""
    return row["milliseconds"]["median"]


def megabytes(row: dict) -> float:
    """Megabytes resident on the GPU; a result has their number or a number per use."""
    resident = row["resident_bytes"]
    return (sum(resident.values()) if isinstance(resident, dict) else resident) / 1e6


def pixels(result: dict) -> str:
    """The size of its pictures."""
    return f"{result['width']} x {result['height']}"


# --- documents ---


def replace_block(path: Path, name: str, text: str) -> Path:
    """Replaces the lines of a Markdown file between <!-- begin NAME --> and <!-- end NAME -->."""
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    before, rest = path.read_text().split(begin)
    path.write_text(before + begin + text + end + rest.split(end, 1)[1])
    return path


def bullets(named: Mapping[str, str]) -> str:
    """A list of names with what is said of them."""
    return "".join(f"* {name}: {text}\n" for name, text in named.items())


def markdown_table(headings: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column is text, the others are figures."""
    headings = list(headings)
    lines = [headings, ["---"] + ["---:"] * (len(headings) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def table(rows: Iterable[Any], columns: Mapping[str, Callable[[Any], str]]) -> str:
    """A Markdown table with a line for each row. columns: the text of a cell, by heading."""
    return markdown_table(columns, [[text(row) for text in columns.values()] for row in rows])


def table_by_model(first: str, rows: list[dict], line: Callable[[dict], str], cell, heading) -> str:
    """A table with a column for each model; `line` names the line of a row."""
    cells = {(line(row), row["model"]): cell(row) for row in rows}
    models = {row["model"]: heading(row) for row in rows}
    return markdown_table(
        [first, *models.values()],
        [
            [name, *(cells.get((name, model), "") for model in models)]
            for name in dict.fromkeys(name for name, _ in cells)
        ],
    )


def best_in_bold(values: Iterable[float | None], form: str, largest: bool = True) -> list[str]:
    """The figures of one row as text, the best one bold; None becomes an empty cell."""
    values = list(values)
    known = [value for value in values if value is not None]
    best = (max if largest else min)(known) if known else None
    return [
        "" if value is None else f"**{value:{form}}**" if value == best else f"{value:{form}}"
        for value in values
    ]


# --- pictures ---


def pyplot():
    """matplotlib.pyplot, drawing to files only. Ends the program if matplotlib is missing."""
    try:
        import matplotlib
    except ImportError:
        raise SystemExit("bench: matplotlib is not installed; pip install matplotlib") from None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def save_figure(figure: Any, path: Path, figures: Any = None, **options: Any) -> Path:
    """Saves a picture; with the digest of its figures, so that a test finds an outdated picture."""
    if figures is not None:
        options["metadata"] = {DIGEST: digest(figures)}
    figure.savefig(path, **options)
    return path


def digest(figures: Any) -> str:
    """The fingerprint of a picture's figures."""
    return hashlib.sha256(json.dumps(figures, sort_keys=True).encode()).hexdigest()
