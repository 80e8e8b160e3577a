"""How much time for how small a file? The encoder's efforts over threads, beside another build.

Writes docs/efforts.md and docs/efforts.png. Times are of the native call on welded, quantised
arrays; a process for each effort and build takes turns with the others and with the peers. A second
build is any gltf_ext._codec, for example of the commit before a change:
--before PATH/TO/_codec.*.so.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bench import peers
from bench.common import (
    markdown_table,
    origin_line,
    progress,
    pyplot,
    read_result,
    spread,
)
from bench.models import real_model
from bench.speed import (
    Stopwatch,
    encoder_arguments,
    installed_peers,
    libraries,
    peak_memory,
    timed_encode,
)
from gltf_ext import _codec
from gltf_ext.compression.options import EFFORTS
from gltf_ext.compression.primitives import Primitive

PACKAGES = ("gltf-meshlet", "numpy", "matplotlib")
NAMES = (
    *("bunny", "suzanne", "engine", "materialball", "beast", "chinesedragon", "DamagedHelmet"),
    *("igea", "sponza_like", "dragon", "bistro_like"),
)
BEFORE = "before"

# Encodes as compress does, several primitives at once.
# Reads {"calls": file of pickled arguments, "effort", "threads"} a line; answers with seconds,
# bytes, and the growth of its memory to its peak. Arguments: the path of the module.
WORKER = """
import importlib.machinery, importlib.util, json, pickle, sys, time
from concurrent.futures import ThreadPoolExecutor
loader = importlib.machinery.ExtensionFileLoader("_codec", sys.argv[1])
codec = importlib.util.module_from_spec(importlib.util.spec_from_loader("_codec", loader))
loader.exec_module(codec)
def memory(key):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(key))
for line in sys.stdin:
    asked = json.loads(line)
    with open(asked["calls"], "rb") as file:
        calls = pickle.load(file)
    threads, total = asked["threads"], sum(len(call[0]) for call in calls)
    calls.sort(key=lambda call: -len(call[0]))
    def encode(call):
        if not asked["effort"]:  # as compress did then: one primitive after another
            return len(codec.encode(*call, threads=threads)[0])
        share = max(1, round(threads * len(call[0]) / total))
        return len(codec.encode(*call, threads=share, effort=asked["effort"])[0])
    clock = time.process_time if threads == 1 else time.perf_counter
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # reset the peak
    before = memory("VmRSS")
    start = clock()
    with ThreadPoolExecutor(threads if asked["effort"] else 1) as pool:
        size = sum(pool.map(encode, calls))
    print(json.dumps([clock() - start, size, memory("VmHWM") - before]), flush=True)
"""


@dataclass(frozen=True)
class Way:
    """A way to encode on some threads: an effort of our build, the build before, or a peer."""

    effort: str
    threads: int


def subdivided(primitive: Primitive) -> Primitive:
    """Each triangle cut into four at the middles of its edges."""
    triangles = primitive.indices.astype(np.int64)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    middle = primitive.vertex_count + number.reshape(-1, 3)
    (a, b, c), (ab, bc, ca) = triangles.T, middle.T
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    indices = np.concatenate([np.stack(three, axis=1) for three in corners])
    attributes = {
        name: np.concatenate([values, values[unique].mean(axis=1, dtype=np.float64)]).astype(
            values.dtype
        )
        for name, values in primitive.attributes.items()
    }
    return Primitive(primitive.mesh, primitive.primitive, indices.astype(np.uint32), attributes, [])


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    found, missing = installed_peers()
    builds = {"": _codec.__file__, **({BEFORE: options.before} if options.before else {})}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.models:
            base, _, times = name.partition("*")
            primitives = peers.read_primitives(real_model(base))
            if times == "4":
                primitives = [subdivided(primitive) for primitive in primitives]
            calls = Path(folder) / "calls.pickle"
            calls.write_bytes(pickle.dumps(encoder_arguments(primitives, Stopwatch())))
            triangles = sum(len(primitive.indices) for primitive in primitives)
            parts = peers.parts_of(primitives)
            ours = measure_ours(calls, builds, options)
            ways = ours + measure_peers(found, parts, options.repetitions, Path(folder))
            rows.append({"model": name, "triangles": triangles, "ways": ways})
            progress(f"{name}, {triangles:,} triangles")
    return {
        "repetitions": options.repetitions,
        "peers": {peer.name: peer.version for peer in found},
        "missing": missing,
        "models": rows,
    }


def measure_ours(calls: Path, builds: dict[str, str], options: argparse.Namespace) -> list[dict]:
    """Seconds, bytes and peak memory of every effort and build."""
    efforts = [*EFFORTS, BEFORE] if BEFORE in builds else EFFORTS
    ways = [Way(effort, count) for effort in efforts for count in options.threads]
    # A process for each way: memory that another one left behind would hide growth.
    workers = {way: _start(builds[BEFORE if way.effort == BEFORE else ""]) for way in ways}
    seconds: dict[Way, list[float]] = {way: [] for way in ways}
    sizes, peaks = {}, dict.fromkeys(ways, 0)
    for _ in range(options.repetitions):
        for way, worker in workers.items():
            effort = "" if way.effort == BEFORE else way.effort
            asked = {**asdict(way), "calls": str(calls), "effort": effort}
            spent, sizes[way], growth = _ask(worker, asked)
            seconds[way].append(spent)
            peaks[way] = max(peaks[way], growth)
    for worker in workers.values():
        worker.communicate()
    return [
        {
            **asdict(way),
            "seconds": spread(seconds[way]),
            "bytes": sizes[way],
            "peak_bytes": peaks[way],
        }
        for way in ways
    ]


def measure_peers(found: list, parts: list, repetitions: int, scratch: Path) -> list[dict]:
    """The same of the peers; those that are commands without memory."""
    rows = []
    for peer in found:
        seconds = []
        for _ in range(repetitions):
            buffers, spent = timed_encode(peer, parts)
            seconds.append(spent)
        row = {
            **asdict(Way(peer.name, 1)),
            "seconds": spread(seconds),
            "bytes": peer.file_bytes(buffers),
        }
        if peer.name in libraries(found):
            row["peak_bytes"] = peak_memory("encode", peer.name, parts, scratch)
        rows.append(row)
    return rows


def _start(module: str) -> subprocess.Popen:
    command = [sys.executable, "-c", WORKER, os.path.abspath(module)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _ask(worker: subprocess.Popen, asked: dict) -> tuple[float, int, int]:
    assert worker.stdin and worker.stdout
    worker.stdin.write(json.dumps(asked) + "\n")
    worker.stdin.flush()
    line = worker.stdout.readline()
    if not line:
        raise SystemExit(f"bench: the encoder ended while it encoded with {asked}")
    seconds, size, growth = json.loads(line)
    return seconds, size, growth


def _reference(ways: dict[Way, dict]) -> tuple[str, dict]:
    """What speed-up and bytes are relative to: its name, and its row on the fewest threads."""
    name = next(name for name in (BEFORE, "high") if any(way.effort == name for way in ways))
    return name, min((row for way, row in ways.items() if way.effort == name), key=_threads)


def _threads(row: dict) -> int:
    return row["threads"]


def _by_way(model: dict) -> dict[Way, dict]:
    return {Way(row["effort"], row["threads"]): row for row in model["ways"]}


def _low(row: dict) -> float:
    return row["seconds"]["low"]


def _ratio_row(model: dict) -> list[str]:
    """Of each effort: speed-up and bytes on the fewest threads, gain from the most."""
    ways = _by_way(model)
    _, base = _reference(ways)
    cells = [model["model"], f"{model['triangles']:,}"]
    for effort in ("normal", "fast", "high"):
        rows = sorted((row for way, row in ways.items() if way.effort == effort), key=_threads)
        alone, most = rows[0], rows[-1]
        change = 100 * (alone["bytes"] / base["bytes"] - 1)
        cells += [f"{_low(base) / _low(alone):.2f}", f"{change:+.2f}"]
        cells.append(f"{_low(alone) / _low(most):.2f}")
    return cells


def _way_rows(model: dict) -> list[list[str]]:
    ways, triangles = _by_way(model), model["triangles"]
    _, base = _reference(ways)
    rows = []
    for way, row in ways.items():
        alone = min((r for w, r in ways.items() if w.effort == way.effort), key=_threads)
        peak = row.get("peak_bytes")
        rows.append(
            [
                f"{model['model']}, {way.effort}",
                str(way.threads),
                f"{triangles / _low(row) / 1e6:.2f}",
                f"{_low(base) / _low(row):.2f}",
                f"{_low(alone) / _low(row):.2f}",
                f"{row['bytes']:,}",
                f"{100 * (row['bytes'] / base['bytes'] - 1):+.2f}",
                "-" if peak is None else f"{peak / triangles:.0f}",
            ]
        )
    return rows


def ratios(result: dict) -> str:
    """The sentence and the table that compare efforts, and their gain from threads."""
    models = result["models"]
    reference, base = _reference(_by_way(models[0]))
    most = max(row["threads"] for row in models[0]["ways"])
    headings = ["model", "triangles"]
    for effort in ("normal", "fast", "high"):
        headings += [effort, "bytes, %", f"{effort}, {most} threads"]
    return f"""Speed-up and bytes are relative to "{reference}" on {base["threads"]} thread; the
columns with {most} threads are each effort's own gain from them.

{markdown_table(headings, [_ratio_row(model) for model in models])}"""


def report(result: dict) -> str:
    """docs/efforts.md, with a section on more cores if efforts_cores.py has measured it."""
    cores = read_result("efforts_cores")
    headings = [
        *("model, encoder", "threads", "million triangles per second", "speed-up"),
        *("against one thread", "bytes", "bytes, %", "peak, bytes per triangle"),
    ]
    missing = "".join(f"\nNot measured here: {line}." for line in result["missing"])
    versions = ", ".join(f"{name} ({version})" for name, version in result["peers"].items())
    return f"""# Efforts of the encoder

{origin_line(result)}
`--effort` chooses how long `compress` looks for a small file. The native call, without files,
welding and quantisation; the fastest of {result["repetitions"]} runs, in which the ways take turns;
CPU time with one thread, else time on the wall. "Before" is another build, where one was given.
Peers, on one thread, as [Speed](speed.md) measures them: {versions or "none"}.{missing}

![Time and memory over size](efforts.png)

A point is a model, a line the power of the triangles that fits an encoder's points best.

{ratios(result)}
Every way. Peak memory is the growth of the process while it encodes, its result included.

{markdown_table(headings, [row for model in result["models"] for row in _way_rows(model)])}\
{cores_section(cores) if cores else ""}"""


def cores_section(result: dict) -> str:
    """The section on more cores, from a result of efforts_cores."""
    return f"""
## On more cores

{origin_line(result)}
{ratios(result)}"""


def save_plot(result: dict, path: Path) -> Path:
    """Seconds and peak memory over triangles, each encoder on its fewest threads.

    A point is a model; a line is the power of the triangles that fits an encoder's points best.
    """
    models = sorted(result["models"], key=lambda model: model["triangles"])
    figure, axes = pyplot().subplots(1, 2, figsize=(11, 4.4), dpi=100)
    encoders = dict.fromkeys(row["effort"] for model in models for row in model["ways"])
    for encoder in encoders:
        points = []
        for model in models:
            rows = [row for row in model["ways"] if row["effort"] == encoder]
            if rows:
                row = min(rows, key=_threads)
                points.append((model["triangles"], _low(row), row.get("peak_bytes", np.nan) / 1e6))
        triangles, seconds, megabytes = zip(*points)
        marker, line = ("o", "-") if encoder in EFFORTS else ("s", "--")
        for axis, values in zip(axes, (seconds, megabytes)):
            (drawn,) = axis.plot(triangles, values, marker, markersize=4, label=encoder)
            ends = np.array((min(triangles), max(triangles)))
            if ends[0] < ends[1] and np.isfinite(values).all():
                slope, base = np.polyfit(np.log(triangles), np.log(values), 1)
                fitted = np.exp(base) * ends**slope
                axis.plot(ends, fitted, line, color=drawn.get_color(), linewidth=1, alpha=0.6)
    for axis, title in zip(axes, ("encoding on one thread, seconds", "peak memory, MB")):
        axis.set(xscale="log", yscale="log", xlabel="triangles")
        axis.set_title(title, fontsize=10)
        axis.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.tight_layout(rect=(0, 0.13, 1, 1))
    figure.legend(handles, labels, frameon=False, ncols=5, loc="lower center")
    figure.savefig(path)
    return path


def add_options(parser: argparse.ArgumentParser, threads: Sequence[int] = (1, 2)) -> None:
    parser.add_argument(
        "--models",
        nargs="+",
        default=list(NAMES),
        metavar="MODEL",
        help="names of models; dragon*4 is dragon with each triangle cut into four",
    )
    parser.add_argument("--threads", nargs="+", type=int, default=threads, metavar="N")
    parser.add_argument("--repetitions", type=int, default=5, metavar="N")
    parser.add_argument(
        "--before", metavar="MODULE", help="another build of gltf_ext/_codec, to compare with"
    )
