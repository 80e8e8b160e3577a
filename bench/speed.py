"""How fast? Encoding and decoding over size, beside the peers, on one thread and on all, with peak memory and stages.

python -m bench.speed: writes bench/results/speed.json, docs/speed.md and docs/speed.png. The series is generated; bunny and dragon, and
decoding of the paper's models, are measured too where GLTF_MESHLET_MODELS has them. Peers that are not installed are named in the page
(see bench/peers.py).
"""

from __future__ import annotations

import argparse
import ctypes
import functools
import importlib.util
import json
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from bench import peers
from bench.common import (
    MODELS,
    PAPER_MODELS,
    ROOT,
    best_in_bold,
    markdown_table,
    origin,
    origin_line,
    spread,
    write_result,
)
from bench.generated import torus
from gltf_ext import _codec
from gltf_ext.compression.primitives import Primitive, position_ids, weld
from gltf_ext.compression.streams import Bits, plan_primitive, position_grid
from gltf_meshlet.demo.model import write_glb
from tools import native_build

SERIES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_500_000)
REAL = ("bunny", "dragon")
REPETITIONS = 5
LARGE, LARGE_REPETITIONS = 500_000, 3  # triangles; so that a run stays within minutes
OURS = "ours"
# Names in the results of the stages that _codec.encode times.
ENCODER_STAGES = {
    "grow": "grow and refine meshlets",
    "join": "join small meshlets",
    "boundaries": "find boundaries",
    "predict": "predict",
    "write": "write",
}


# --- ours ---


class Stopwatch:
    """Seconds per stage; `lap` names the stage that ends."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        now = time.perf_counter()
        self._add(stage, now - self._last)
        self._last = now

    def insert(self, seconds: dict[str, float]) -> None:
        """Stages since the last lap, as measured elsewhere."""
        for stage, time_of_stage in seconds.items():
            self._add(stage, time_of_stage)
        self._last = time.perf_counter()

    def _add(self, stage: str, seconds: float) -> None:
        self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds


def encode_ours(primitives: list[Primitive], threads: int, watch: Stopwatch) -> list[bytes]:
    """What compress does between reading and writing files: one blob for each primitive."""
    sources = [weld(primitive)[0] for primitive in primitives]
    watch.lap("weld")
    of_mesh: dict[int, list[np.ndarray]] = {}
    for source in sources:
        of_mesh.setdefault(source.mesh, []).append(source.attributes["POSITION"])
    grids = {}
    for mesh, arrays in of_mesh.items():
        positions = np.concatenate(arrays)
        grids[mesh] = position_grid(
            positions.min(axis=0), positions.max(axis=0), Bits().position, None
        )
    return [_encode_one(source, grids[source.mesh], threads, watch) for source in sources]


def _encode_one(source: Primitive, grid, threads: int, watch: Stopwatch) -> bytes:
    plan = plan_primitive(source.attributes, [], grid, Bits(), "")
    positions = source.attributes["POSITION"]
    arguments = (
        np.ascontiguousarray(source.indices),
        position_ids(positions),
        np.ascontiguousarray(positions),
        [stream.table_row() for stream in plan.streams],
        plan.values,
    )
    watch.lap("quantise")
    blob, statistics = _codec.encode(*arguments, threads=threads)
    watch.insert({ENCODER_STAGES[stage]: s for stage, s in statistics["seconds"].items()})
    return blob


# --- peers ---


def peers_here() -> tuple[list, list[str]]:
    """(the peers that are installed, a line for each that is not): Draco at its default and its fastest level, Corto, gltfpack."""
    found, missing = [], []
    for make in (
        lambda: peers.Draco(7),
        lambda: peers.Draco(0),
        lambda: peers.Corto(("delta",)),
        lambda: peers.Gltfpack(True),
    ):
        try:
            found.append(make())
        except peers.PeerMissing as error:
            missing.append(str(error))
    if importlib.util.find_spec("meshoptimizer") is None:
        found = [peer for peer in found if not isinstance(peer, peers.Gltfpack)]
        missing.append("meshopt-compressed glTF: decoding needs pip install --pre meshoptimizer")
    return found, missing


def bare_decoder(peer, buffers: list[bytes]) -> Callable[[], object]:
    """The peer's decoding alone, without what peers.py does to compare its results with the original."""
    if isinstance(peer, peers.Draco):
        import DracoPy

        return lambda: [DracoPy.decode(buffer) for buffer in buffers]
    if isinstance(peer, peers.Corto):
        return _corto_decoder(buffers)
    if isinstance(peer, peers.Gltfpack):
        files = [peers._glb_chunks(buffer) for buffer in buffers]
        return lambda: [
            peers._view_bytes(view, binary)
            for document, binary in files
            for view in document["bufferViews"]
        ]
    raise TypeError(f"no decoder is known for {peer.name}")


def _corto_decoder(buffers: list[bytes]) -> Callable[[], None]:
    library = peers._corto_library(Path(peers.CORTO).with_name("libcortocodec_unity.so"))
    outputs = []
    for buffer in buffers:
        counts = np.zeros(2, np.float32)
        library.DestroyDecoder(library.CreateDecoder(len(buffer), buffer, counts.ctypes.data))
        triangles, vertices = map(int, counts)
        outputs.append([np.zeros((rows, columns), kind) for rows, columns, kind in (
            (vertices, 3, np.float32), (triangles, 3, np.uint32), (vertices, 3, np.float32), (vertices, 4, np.float32),
            (vertices, 2, np.float32))])  # fmt: skip

    def decode() -> None:
        for buffer, arrays in zip(buffers, outputs):
            counts = (ctypes.c_float * 2)()
            decoder = library.CreateDecoder(len(buffer), buffer, ctypes.addressof(counts))
            library.DecodeMesh(decoder, *(array.ctypes.data for array in arrays))
            library.DestroyDecoder(decoder)

    return decode


def timed_encode(peer, parts: list) -> tuple[list[bytes], float]:
    """(buffers, seconds); Corto states its own time, without reading and writing files, gltfpack is timed as the command that it is."""
    if isinstance(peer, peers.Corto):
        return peer.encode_timed(parts)
    start = time.perf_counter()
    buffers = peer.encode(parts)
    return buffers, time.perf_counter() - start


# --- one model ---


def measure(name: str, path: Path, scratch: Path, found: list) -> dict:
    """Everything about one model; the codecs take turns."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    triangles = sum(len(part.triangles) for part in parts)
    repetitions = LARGE_REPETITIONS if triangles > LARGE else REPETITIONS
    encoded, encoder_stages = _encoding(primitives, parts, found, repetitions)
    buffers = {codec: row.pop("buffers") for codec, row in encoded.items()}
    decoded = _decoding(buffers, found, repetitions)
    measured = native("decode_speed", buffers[OURS], scratch)
    stages = native("decode_stages", buffers[OURS], scratch)
    decoded[OURS]["native_seconds"] = spread(measured["decode_seconds"])
    decoded[OURS]["all_threads_seconds"] = spread(measured["parallel_seconds"])
    return {
        "model": name,
        "triangles": triangles,
        "vertices": sum(len(part.positions) for part in parts),
        "raw_bytes": sum(part.raw_bytes for part in parts),
        "encode": encoded,
        "decode": decoded,
        "one_meshlet_microseconds": spread(measured["meshlet_microseconds"]),
        "command": _command(path, scratch, repetitions),
        "memory": {
            "encode": {
                codec: _peak_memory(
                    "encode", codec, primitives if codec == OURS else parts, scratch
                )
                for codec in (OURS, *_libraries(found))
            },
            "decode": {
                codec: _peak_memory("decode", codec, buffers[codec], scratch) for codec in buffers
            },
        },
        "stages": {
            "encode": encoder_stages,
            "decode": {stage: spread(shares) for stage, shares in stages["shares"].items()},
            "decode_avx2": stages["avx2"],
        },
    }


def _encoding(
    primitives: list[Primitive], parts: list, found: list, repetitions: int
) -> tuple[dict[str, dict], dict[str, dict]]:
    """(for each codec its seconds, bytes and buffers; seconds of our encoder's stages on one thread)."""
    seconds: dict[str, list[float]] = {
        OURS: [],
        "all threads": [],
        **{peer.name: [] for peer in found},
    }
    buffers, stages = {}, []
    for _ in range(repetitions):
        for key, threads in (("all threads", 0), (OURS, 1)):
            watch = Stopwatch()
            buffers[OURS] = encode_ours(primitives, threads, watch)
            seconds[key].append(sum(watch.seconds.values()))
        stages.append(watch.seconds)
        for peer in found:
            buffers[peer.name], spent = timed_encode(peer, parts)
            seconds[peer.name].append(spent)
    rows = {
        OURS: {
            "bytes": sum(map(len, buffers[OURS])),
            "all_threads_seconds": spread(seconds.pop("all threads")),
        }
    }
    rows |= {peer.name: {"bytes": peer.file_bytes(buffers[peer.name])} for peer in found}
    encoded = {
        codec: {"seconds": spread(seconds[codec]), "buffers": buffers[codec], **row}
        for codec, row in rows.items()
    }
    return encoded, {stage: spread([run[stage] for run in stages]) for stage in stages[0]}


def _decoding(buffers: dict[str, list[bytes]], found: list, repetitions: int) -> dict[str, dict]:
    decoders = {
        OURS: lambda: [_codec.decode_values(blob) for blob in buffers[OURS]],
        **{peer.name: bare_decoder(peer, buffers[peer.name]) for peer in found},
    }
    seconds: dict[str, list[float]] = {codec: [] for codec in decoders}
    for _ in range(repetitions):
        for codec, decode in decoders.items():
            start = time.perf_counter()
            decode()
            seconds[codec].append(time.perf_counter() - start)
    return {
        codec: {"seconds": spread(spent), "mean_seconds": statistics.mean(spent)}
        for codec, spent in seconds.items()
    }


def measure_decoding(path: Path, scratch: Path, found: list) -> dict:
    """Decoding alone, of a model of the paper's Figures 8 and 9."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    buffers = {
        OURS: encode_ours(primitives, 0, Stopwatch()),
        **{peer.name: peer.encode(parts) for peer in found},
    }
    decoded = _decoding(buffers, found, REPETITIONS)
    native_seconds = native("decode_speed", buffers[OURS], scratch)["decode_seconds"]
    decoded[OURS] |= {
        "native_seconds": spread(native_seconds),
        "native_mean_seconds": statistics.mean(native_seconds),
    }
    return {
        "model": path.stem,
        "triangles": sum(len(part.triangles) for part in parts),
        "decode": decoded,
    }


@functools.cache
def _programs() -> Path:
    return native_build.build("MESHLET_BENCH")


def native(program: str, blobs: list[bytes], scratch: Path) -> dict:
    """What a program of bench/native prints for the blobs."""
    files = [scratch / f"{number}.blob" for number in range(len(blobs))]
    for file, blob in zip(files, blobs):
        file.write_bytes(blob)
    command = [_programs() / program, *files]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


# Run by a small process of its own: Linux counts the memory of the process that starts a program to the program's peak.
LAUNCHER = """
import resource, subprocess, sys, time
start = time.perf_counter()
status = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
sys.exit(status)
"""


def _command(path: Path, scratch: Path, repetitions: int) -> dict:
    """`gltf-meshlet compress` as a user runs it: seconds and peak memory of the whole process."""
    command = [
        sys.executable,
        "-c",
        LAUNCHER,
        sys.executable,
        "-m",
        "gltf_ext",
        "compress",
        path,
        scratch / "out.glb",
    ]
    runs = [
        subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout.split()
        for _ in range(repetitions)
    ]
    return {
        "seconds": spread([float(seconds) for seconds, _ in runs]),
        "peak_bytes": max(int(peak) for _, peak in runs),
    }


# --- peak memory, in a process of its own ---


def _libraries(found: list) -> list[str]:
    """The peers that encode within the process that calls them; the others are commands."""
    return [peer.name for peer in found if isinstance(peer, peers.Draco)]


def _peak_memory(task: str, codec: str, given: list, scratch: Path) -> int:
    """Bytes by which a process grows from before one encoding or decoding, its input loaded, to its peak."""
    path = scratch / "input.pickle"
    path.write_bytes(pickle.dumps(given))
    command = [sys.executable, "-m", "bench.speed", "--child", task, codec, path]
    return int(subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=ROOT).stdout)


def child(task: str, codec: str, given: str) -> int:
    """What _peak_memory measures."""
    data = pickle.loads(Path(given).read_bytes())
    peer = None if codec == OURS else next(peer for peer in peers_here()[0] if peer.name == codec)
    if task == "encode":
        run = (
            (lambda: encode_ours(data, 0, Stopwatch()))
            if peer is None
            else (lambda: peer.encode(data))
        )
    else:
        run = (
            (lambda: [_codec.decode_values(blob) for blob in data])
            if peer is None
            else bare_decoder(peer, data)
        )
    with _growth() as grown:
        kept = run()  # noqa: F841  what is returned counts
    return grown[0]


@contextmanager
def _growth() -> Iterator[list[int]]:
    """A list that gets, at the end, the bytes from the resident size before to the peak since (Linux)."""
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew from here
    before, grown = _status("VmRSS"), [0]
    yield grown
    grown[0] = _status("VmHWM") - before


def _status(key: str) -> int:
    line = next(
        line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key)
    )
    return int(line.split()[1]) * 1024


# --- the page ---


def report(result: dict) -> str:
    """docs/speed.md."""
    models = result["models"]
    codecs = list(models[0]["encode"])
    others = [codec for codec in codecs if codec != OURS]
    encode = [
        [
            *_name(row),
            *_rates(
                row,
                [
                    row["encode"][OURS]["seconds"],
                    row["encode"][OURS]["all_threads_seconds"],
                    *(row["encode"][codec]["seconds"] for codec in others),
                ],
                ".2f",
            ),
        ]
        for row in models
    ]
    decode = [
        [
            *_name(row),
            *_rates(
                row,
                [
                    *(
                        row["decode"][OURS][key]
                        for key in ("native_seconds", "seconds", "all_threads_seconds")
                    ),
                    *(row["decode"][codec]["seconds"] for codec in others),
                ],
                ".1f",
            ),
        ]
        for row in models
    ]
    times = [
        [
            *_name(row),
            *(f"{ratio(row, codec):.2f}" for codec in others),
            f"{row['one_meshlet_microseconds']['median']:.2f}",
        ]
        for row in models
    ]
    sizes = [
        [
            *_name(row),
            *(f"{row['raw_bytes'] / row['encode'][codec]['bytes']:.1f}" for codec in codecs),
        ]
        for row in models
    ]
    measured = [
        (task, codec) for task, of_codec in models[0]["memory"].items() for codec in of_codec
    ]
    memory = [
        [*_name(row), *(_megabytes(row["memory"][task][codec]) for task, codec in measured)]
        for row in models
    ]
    command = []
    for row in models:
        seconds, peak = row["command"]["seconds"]["median"], row["command"]["peak_bytes"]
        command.append(
            [
                *_name(row),
                f"{seconds:.2f}",
                f"{row['triangles'] / seconds / 1e6:.2f}",
                _megabytes(peak),
                f"{peak / row['triangles']:.0f}",
            ]
        )
    build = "with AVX2" if models[0]["stages"]["decode_avx2"] else "without AVX2"
    missing = "".join(f"\nNot measured here: {line}." for line in result["missing"])
    return f"""# Speed

{origin_line(result)}
Positions 12, normals 8 + 8, texture coordinates 12 bits for all. Medians of {result["repetitions"]} runs
({result["large"]["repetitions"]} above {result["large"]["triangles"]:,} triangles) in which the codecs take turns; the JSON file has the lowest and
highest too. Models called torus are generated.
Peers: {_versions(result)}.{missing}

![Speed and memory over size](speed.png)

## Decoding, million triangles per second

To float arrays, all attributes, on one thread. Native: the C++ call, into memory allocated before; from Python: with numpy arrays as
result, as the peers give them (Corto: into arrays allocated before; meshopt: integers, as they are drawn). All threads: every
meshlet decoded on its own, without the others that it shares vertices with, by {result["machine"]["cores"]} threads: the way of a
renderer. The peers decode a mesh on one thread only. The fastest of each row in bold.
Ours from Python and the peers take turns, so that their ratios within a table hold. Native, all threads, and the next table are measured
later, on a machine whose speed varies{_variation(result)}: they do not compare that closely.

{markdown_table(["model", "triangles", "ours, native", "ours, from Python", "ours, meshlets alone, all threads", *others], decode)}
The models of Figures 8 and 9 of [the paper](../README.md#the-paper), or what stands in for them: milliseconds, means of
{result["repetitions"]} runs as there, one thread.

{_paper_table(result, others)}
How many times as fast ours decodes on one thread, from Python, as each peer; below 1 the peer is faster. Last: microseconds for one
meshlet by its number, in random order.

{markdown_table(["model", "triangles", *(f"against {codec}" for codec in others), "one meshlet"], times)}
## Encoding, million triangles per second

From arrays to bytes in memory, welding and quantisation included. Corto's time is what its command states, for one of its two normal
modes; gltfpack's is its whole command with files. All peers use one thread. The fastest of each row in bold.

{markdown_table(["model", "triangles", "ours, one thread", "ours, all threads", *others], encode)}
Raw bytes (4 per float component and index) over encoded bytes of what was encoded:

{markdown_table(["model", "triangles", *codecs], sizes)}
## Peak memory, MB

What a process grows by while it encodes (ours on all threads) or decodes, its input loaded before, its result included (Corto decodes
into arrays from before). The encoders of Corto and gltfpack are commands that load files, and are left out.

{markdown_table(["model", "triangles", *(f"{task}, {codec}" for task, codec in measured)], memory)}
## `gltf-meshlet compress` as a whole process

All threads, starting and files included; peak memory of the process, and bytes of it per triangle.

{markdown_table(["model", "triangles", "seconds", "million triangles per second", "peak, MB", "bytes per triangle"], command)}
## Where the time goes

Percent of encoding on one thread:

{_stage_table(models, "encode")}
Percent of decoding a whole model on one thread ({build}):

{_stage_table(models, "decode")}"""


def _variation(result: dict) -> str:
    """By how much two measurements of the same decoding differ; empty where nothing is measured twice."""
    again = {row["model"]: row["decode"] for row in result["paper_models"]}
    ratios = [
        again[row["model"]][codec][key]["median"] / of_codec[key]["median"]
        for row in result["models"]
        if row["model"] in again
        for codec, of_codec in row["decode"].items()
        for key in ("seconds", "native_seconds")
        if key in of_codec
    ]
    return (
        f" (what is measured twice differs by up to {max(max(ratio, 1 / ratio) for ratio in ratios):.2f} times)"
        if ratios
        else ""
    )


def ratio(row: dict, codec: str) -> float:
    """How many times as fast ours decodes a model as a peer, both from Python on one thread."""
    return row["decode"][codec]["seconds"]["median"] / row["decode"][OURS]["seconds"]["median"]


def _paper_table(result: dict, others: list[str]) -> str:
    rows = []
    for row in result["paper_models"]:
        decode = row["decode"]
        means = [
            decode[OURS]["native_mean_seconds"],
            decode[OURS]["mean_seconds"],
            *(decode[codec]["mean_seconds"] for codec in others),
        ]
        rows.append([*_name(row), *(f"{1000 * mean:.1f}" for mean in means)])
    return markdown_table(
        ["model", "triangles", "ours, native", "ours, from Python", *others], rows
    )


def _versions(result: dict) -> str:
    return ", ".join(f"{name} ({version})" for name, version in result["peers"].items()) or "none"


def _name(row: dict) -> list[str]:
    return [row["model"], f"{row['triangles']:,}"]


def _rates(row: dict, seconds: list[dict], form: str) -> list[str]:
    """Million triangles per second, the fastest in bold."""
    return best_in_bold([row["triangles"] / spent["median"] / 1e6 for spent in seconds], form)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f}" if count < 1e8 else f"{count / 1e6:.0f}"


def _stage_table(models: list[dict], task: str) -> str:
    stages = list(models[0]["stages"][task])
    rows = []
    for row in models:
        medians = [row["stages"][task][stage]["median"] for stage in stages]
        rows.append([*_name(row), *(f"{100 * median / sum(medians):.1f}" for median in medians)])
    return markdown_table(["model", "triangles", *stages], rows)


def save_plot(result: dict, path: Path) -> None:
    """Seconds to encode and to decode, and peak memory of encoding, over triangles, of the generated series."""
    from matplotlib import pyplot

    series = [row for row in result["models"] if row["model"] == "torus"]
    triangles = [row["triangles"] for row in series]
    figure, axes = pyplot.subplots(1, 4, figsize=(17, 4.2), dpi=100)
    for codec in series[0]["encode"]:
        panels = (
            [row["decode"][codec]["seconds"]["median"] for row in series],
            [row["encode"][codec]["seconds"]["median"] for row in series],
            [row["memory"]["encode"].get(codec, np.nan) / 1e6 for row in series],
            [row["memory"]["decode"][codec] / 1e6 for row in series],
        )
        for axis, values in zip(axes, panels):
            style, width = ("-o", 2.2) if codec == OURS else ("--s", 1.2)
            axis.plot(triangles, values, style, markersize=4, linewidth=width, label=codec)
    axes[1].plot(
        triangles,
        [row["encode"][OURS]["all_threads_seconds"]["median"] for row in series],
        "-^",
        markersize=4,
        color="C0",
        alpha=0.5,
        label=f"ours, {result['machine']['cores']} threads",
    )
    titles = (
        "decoding, one thread, seconds",
        "encoding, seconds",
        "peak memory of encoding, MB",
        "peak memory of decoding, MB",
    )
    for axis, title in zip(axes, titles):
        axis.set(xscale="log", yscale="log", xlabel="triangles")
        axis.set_title(title, fontsize=10)
        axis.grid(alpha=0.3)
    handles, labels = axes[1].get_legend_handles_labels()
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.legend(handles, labels, frameon=False, ncols=len(labels), loc="lower center")
    figure.savefig(path)
    pyplot.close(figure)


def inputs(largest: int, folder: Path) -> Iterator[tuple[str, Path]]:
    """(name, path) of the models, each generated when it is its turn."""
    for triangles in SERIES:
        if triangles <= largest:
            path = folder / "torus.glb"
            write_glb([torus(triangles)], path)
            yield "torus", path
    for name in REAL:
        path = MODELS / f"{name}.glb"
        if path.exists():
            yield name, path
        else:
            print(f"no {name}.glb: set GLTF_MESHLET_MODELS to measure it too", file=sys.stderr)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m bench speed", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "--largest",
        type=int,
        default=max(SERIES),
        help="leave out generated models of more triangles",
    )
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(child(*options.child))
        return
    found, missing = peers_here()
    result = {
        **origin("bench.speed", ("gltf-meshlet", "numpy", "matplotlib")),
        "repetitions": REPETITIONS,
        "large": {"triangles": LARGE, "repetitions": LARGE_REPETITIONS},
        "peers": {peer.name: peer.version for peer in found},
        "missing": missing,
        "models": [],
        "paper_models": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, path in inputs(options.largest, Path(folder)):
            start = time.perf_counter()
            row = measure(name, path, Path(folder), found)
            result["models"].append(row)
            print(
                f"{name}, {row['triangles']:,} triangles: {time.perf_counter() - start:.0f} s",
                flush=True,
            )
        for name in PAPER_MODELS:
            path = MODELS / f"{name}.glb"
            if path.exists():
                result["paper_models"].append(measure_decoding(path, Path(folder), found))
                print(f"{name}, decoding", flush=True)
    write_result("speed", result)
    save_plot(result, ROOT / "docs" / "speed.png")
    text = report(result)
    (ROOT / "docs" / "speed.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
