"""How much time for how small a file? The encoder's efforts over threads, beside another build.

Writes docs/efforts.md. Times are of the native call on welded, quantised arrays; a process for
each build takes turns with the others. A second build is any gltf_ext._codec, for example of
the commit before a change: --before PATH/TO/_codec.*.so.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bench import peers
from bench.common import Question, markdown_table, origin_line, progress, spread, write_page
from bench.models import real_model
from bench.speed import Stopwatch, encoder_arguments
from gltf_ext import _codec
from gltf_ext.compression.options import EFFORTS
from gltf_ext.compression.primitives import Primitive

NAMES = (
    *("bunny", "suzanne", "engine", "materialball", "beast", "chinesedragon", "DamagedHelmet"),
    *("igea", "sponza_like", "dragon", "bistro_like"),
)
MAX_TRIANGLES = 100_000  # for effort max, which takes minutes on larger models
BEFORE = "before"

# Encodes as compress does, several primitives at once.
# Reads {"calls": file of pickled arguments, "effort", "threads"} a line; answers with seconds and
# bytes. Arguments: the path of the module.
WORKER = """
import importlib.machinery, importlib.util, json, pickle, sys, time
from concurrent.futures import ThreadPoolExecutor
loader = importlib.machinery.ExtensionFileLoader("_codec", sys.argv[1])
codec = importlib.util.module_from_spec(importlib.util.spec_from_loader("_codec", loader))
loader.exec_module(codec)
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
    start = clock()
    with ThreadPoolExecutor(threads if asked["effort"] else 1) as pool:
        size = sum(pool.map(encode, calls))
    print(json.dumps([clock() - start, size]), flush=True)
"""


@dataclass(frozen=True)
class Way:
    """A way to encode: an effort of our build, or the build before ("before"), on some threads."""

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
            rows.append(
                measure_model(name, triangles, calls, builds, options.threads, options.repetitions)
            )
            progress(f"{name}, {triangles:,} triangles")
    return {
        "repetitions": options.repetitions,
        "models": rows,
    }


def measure_model(
    name: str,
    triangles: int,
    calls: Path,
    builds: dict[str, str],
    threads: list[int],
    repetitions: int,
) -> dict:
    """Seconds of every way, and its bytes."""
    efforts = [effort for effort in EFFORTS if effort != "max" or triangles <= MAX_TRIANGLES]
    ways = [Way(effort, count) for effort in efforts for count in threads]
    ways += [Way(BEFORE, count) for count in threads if BEFORE in builds]
    seconds: dict[Way, list[float]] = {way: [] for way in ways}
    sizes = {}
    workers = {build: _start(path) for build, path in builds.items()}
    for _ in range(repetitions):
        for way in ways:
            before = way.effort == BEFORE
            asked = {**asdict(way), "calls": str(calls), "effort": "" if before else way.effort}
            spent, sizes[way] = _ask(workers[BEFORE if before else ""], asked)
            seconds[way].append(spent)
    for worker in workers.values():
        worker.communicate()
    return {
        "model": name,
        "triangles": triangles,
        "ways": [
            {**asdict(way), "seconds": spread(seconds[way]), "bytes": sizes[way]} for way in ways
        ],
    }


def _start(module: str) -> subprocess.Popen:
    command = [sys.executable, "-c", WORKER, os.path.abspath(module)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _ask(worker: subprocess.Popen, asked: dict) -> tuple[float, int]:
    assert worker.stdin and worker.stdout
    worker.stdin.write(json.dumps(asked) + "\n")
    worker.stdin.flush()
    line = worker.stdout.readline()
    if not line:
        raise SystemExit(f"bench: the encoder ended while it encoded with {asked}")
    seconds, size = json.loads(line)
    return seconds, size


def report(result: dict) -> str:
    """docs/efforts.md."""
    rows = []
    for model in result["models"]:
        by_way = {Way(w["effort"], w["threads"]): w for w in model["ways"]}
        first = min(way.threads for way in by_way)
        reference = BEFORE if Way(BEFORE, first) in by_way else "high"
        base = by_way[Way(reference, first)]
        for way, row in by_way.items():
            alone = by_way[Way(way.effort, first)]["seconds"]["low"]
            rows.append(
                [
                    f"{model['model']}, {way.effort}",
                    str(way.threads),
                    f"{model['triangles'] / row['seconds']['low'] / 1e6:.2f}",
                    f"{base['seconds']['low'] / row['seconds']['low']:.2f}",
                    f"{alone / row['seconds']['low']:.2f}",
                    f"{row['bytes']:,}",
                    f"{100 * (row['bytes'] / base['bytes'] - 1):+.2f}",
                ]
            )
    headings = [
        *("model, effort", "threads", "million triangles per second", "speed-up"),
        *("against one thread", "bytes", "bytes, %"),
    ]
    return f"""# Efforts of the encoder

{origin_line(result)}
`--effort` chooses how long `compress` looks for a small file. The native call, without files,
welding and quantisation; the fastest of {result["repetitions"]} runs, in which the ways take turns;
CPU time with one thread, else time on the wall. Effort max is measured up to {MAX_TRIANGLES:,}
triangles. "Before" is another build, where one was given. Speed-up and bytes are relative to it, or
else to effort high, on the fewest threads. [Speed](speed.md) has the efforts beside other codecs.

{markdown_table(headings, rows)}"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--models",
        nargs="+",
        default=list(NAMES),
        metavar="MODEL",
        help="names of models; dragon*4 is dragon with each triangle cut into four",
    )
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2], metavar="N")
    parser.add_argument("--repetitions", type=int, default=5, metavar="N")
    parser.add_argument(
        "--before", metavar="MODULE", help="another build of gltf_ext/_codec, to compare with"
    )


def write_pages(result: dict) -> list[Path]:
    """docs/efforts.md."""
    return [write_page("efforts", report(result))]


QUESTION = Question(
    "efforts",
    __doc__,
    measure,
    report,
    write_pages,
    add_options=add_options,
)


def main() -> None:
    QUESTION.run()


if __name__ == "__main__":
    main()
