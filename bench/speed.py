"""How fast? Encoding and decoding over size beside the peers, on one thread and all; peak memory.

Writes docs/speed.md and docs/speed.png. The series of models is generated; bunny and dragon, and
decoding of the paper's models, are added if they are in the models' folder. The page names the
peers that are missing (see bench/peers.py).
"""

from __future__ import annotations

import argparse
import ctypes
import functools
import importlib.util
import json
import os
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
    best_in_bold,
    call_in_process,
    markdown_table,
    origin_line,
    progress,
    pyplot,
    spread,
)
from bench.generated import torus
from bench.models import MODELS, PAPER_MODELS
from gltf_ext import _codec
from gltf_ext.compression.primitives import Primitive, position_ids, weld
from gltf_ext.compression.streams import Bits, plan_primitive, position_grid
from gltf_meshlet.demo.model import write_glb
from tools import native_build

PACKAGES = ("gltf-meshlet", "numpy", "matplotlib")
SERIES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_500_000)
REAL = ("bunny", "dragon")
REPETITIONS = 5
# Above so many triangles fewer repetitions keep the run within minutes.
LARGE, LARGE_REPETITIONS = 500_000, 3
# Seconds for which a codec decodes in its turn: one call may take only half a millisecond.
TURN = 0.05
OURS = "ours"  # with the default effort
# Other efforts, as further codecs.
OTHER_EFFORTS = {"ours, fast": "fast", "ours, high": "high"}
# Names in the results of the stages that _codec.encode times.
ENCODER_STAGES = {
    "sort": "sort in space, match edges",
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


def encode_ours(
    primitives: list[Primitive],
    threads: int,
    watch: Stopwatch,
    effort: str = "normal",
    page_bytes: int = 0,
) -> list[bytes]:
    """What compress does between reading and writing files: one view for each primitive."""
    blobs = []
    for arguments in encoder_arguments(primitives, watch):
        blob, statistics = _codec.encode(
            *arguments, threads=threads, effort=effort, page_bytes=page_bytes
        )
        watch.insert({ENCODER_STAGES[stage]: s for stage, s in statistics["seconds"].items()})
        blobs.append(blob)
    return blobs


def encoder_arguments(primitives: list[Primitive], watch: Stopwatch) -> list[tuple]:
    """The arguments of _codec.encode for each primitive, as compress makes them."""
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
    arguments = []
    for source in sources:
        plan = plan_primitive(source.attributes, [], grids[source.mesh], Bits(), "")
        positions = source.attributes["POSITION"]
        arguments.append(
            (
                np.ascontiguousarray(source.indices),
                position_ids(positions),
                np.ascontiguousarray(positions),
                [stream.table_row() for stream in plan.streams],
                plan.values,
            )
        )
    watch.lap("quantise")
    return arguments


# --- peers ---


def installed_peers() -> tuple[list, list[str]]:
    """(the installed peers, a line for each missing one).

    Draco at its default and its fastest level, Corto, gltfpack.
    """
    found, missing = peers.available(
        [
            lambda: peers.Draco(7),
            lambda: peers.Draco(0),
            lambda: peers.Corto(("delta",)),
            lambda: peers.Gltfpack(True),
        ]
    )
    if importlib.util.find_spec("meshoptimizer") is None:
        found = [peer for peer in found if not isinstance(peer, peers.Gltfpack)]
        missing.append("meshopt-compressed glTF: decoding needs pip install --pre meshoptimizer")
    return found, missing


def bare_decoder(peer, buffers: list[bytes]) -> Callable[[], object]:
    """A function that only decodes, without the conversions of peers.py."""
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
        outputs.append(
            [
                np.zeros((vertices, 3), np.float32),  # positions
                np.zeros((triangles, 3), np.uint32),
                np.zeros((vertices, 3), np.float32),  # normals
                np.zeros((vertices, 4), np.float32),  # colours
                np.zeros((vertices, 2), np.float32),  # texture coordinates
            ]
        )

    def decode() -> None:
        for buffer, arrays in zip(buffers, outputs):
            counts = (ctypes.c_float * 2)()
            decoder = library.CreateDecoder(len(buffer), buffer, ctypes.addressof(counts))
            library.DecodeMesh(decoder, *(array.ctypes.data for array in arrays))
            library.DestroyDecoder(decoder)

    return decode


def timed_encode(peer, parts: list) -> tuple[list[bytes], float]:
    """(buffers, seconds); gltfpack's seconds are of its whole command.

    Corto's command reports its own time without reading and writing files.
    """
    if isinstance(peer, peers.Corto):
        return peer.encode_timed(parts)
    start = time.perf_counter()
    buffers = peer.encode(parts)
    return buffers, time.perf_counter() - start


# --- one model ---


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    found, missing = installed_peers()
    models, paper_models = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for model, path in inputs(options.largest, folder):
            row = measure_model(model, path, folder, found)
            models.append(row)
            progress(f"{model}, {row['triangles']:,} triangles")
        for model in PAPER_MODELS:
            path = MODELS / f"{model}.glb"
            if path.exists():
                paper_models.append(measure_decoding(path, folder, found))
                progress(f"{model}, decoding")
    return {
        "repetitions": REPETITIONS,
        "large": {"triangles": LARGE, "repetitions": LARGE_REPETITIONS},
        "peers": {peer.name: peer.version for peer in found},
        "missing": missing,
        "models": models,
        "paper_models": paper_models,
    }


def measure_model(name: str, path: Path, scratch: Path, found: list) -> dict:
    """Everything about one model; the codecs take turns."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    triangles = sum(len(part.triangles) for part in parts)
    repetitions = LARGE_REPETITIONS if triangles > LARGE else REPETITIONS
    encoded, encoder_stages = _encoding(primitives, parts, found, repetitions)
    buffers = {codec: row.pop("buffers") for codec, row in encoded.items() if "buffers" in row}
    decoded, meshlet_microseconds = _decoding(buffers, found, repetitions, scratch)
    stages = native("decode_stages", buffers[OURS], scratch)
    return {
        "model": name,
        "triangles": triangles,
        "vertices": sum(len(part.positions) for part in parts),
        "raw_bytes": sum(part.raw_bytes for part in parts),
        "encode": encoded,
        "decode": decoded,
        "one_meshlet_microseconds": meshlet_microseconds,
        "command": measure_command(path, scratch, repetitions),
        "memory": {
            "encode": {
                codec: peak_memory(
                    "encode", codec, primitives if codec.startswith(OURS) else parts, scratch
                )
                for codec in (OURS, *OTHER_EFFORTS, *libraries(found))
            },
            "decode": {
                codec: peak_memory("decode", codec, buffers[codec], scratch) for codec in buffers
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
    """(seconds, bytes and buffers by codec; seconds of our encoder's stages on one thread)."""
    seconds: dict[str, list[float]] = {
        OURS: [],
        "all threads": [],
        **{codec: [] for codec in OTHER_EFFORTS},
        **{peer.name: [] for peer in found},
    }
    buffers, stages, sizes = {}, [], {}
    for _ in range(repetitions):
        for key, threads in (("all threads", 0), (OURS, 1)):
            watch = Stopwatch()
            buffers[OURS] = encode_ours(primitives, threads, watch)
            seconds[key].append(sum(watch.seconds.values()))
        stages.append(watch.seconds)
        for codec, effort in OTHER_EFFORTS.items():
            watch = Stopwatch()
            sizes[codec] = sum(map(len, encode_ours(primitives, 1, watch, effort)))
            seconds[codec].append(sum(watch.seconds.values()))
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
    encoded |= {
        codec: {"seconds": spread(seconds[codec]), "bytes": size} for codec, size in sizes.items()
    }
    return encoded, {stage: spread([run[stage] for run in stages]) for stage in stages[0]}


def _decoding(
    buffers: dict[str, list[bytes]], found: list, repetitions: int, scratch: Path
) -> tuple[dict[str, dict], dict]:
    """(seconds by codec, microseconds of one meshlet); the native decoder takes turns too."""
    decoders = {
        OURS: lambda: [_codec.decode_values(blob) for blob in buffers[OURS]],
        **{peer.name: bare_decoder(peer, buffers[peer.name]) for peer in found},
    }
    seconds: dict[str, list[float]] = {codec: [] for codec in decoders}
    measured: dict[str, list[float]] = {}
    for _ in range(repetitions):
        for codec, decode in decoders.items():
            seconds[codec] += _one_turn(decode)
        for figure, values in native("decode_speed", buffers[OURS], scratch).items():
            measured.setdefault(figure, []).extend(values)
    decoded = {
        codec: {"seconds": spread(spent), "mean_seconds": statistics.mean(spent)}
        for codec, spent in seconds.items()
    }
    decoded[OURS] |= {
        "native_seconds": spread(measured["decode_seconds"]),
        "native_mean_seconds": statistics.mean(measured["decode_seconds"]),
        "all_threads_seconds": spread(measured["parallel_seconds"]),
    }
    return decoded, spread(measured["meshlet_microseconds"])


def _one_turn(decode: Callable[[], object]) -> list[float]:
    """Seconds of each call, for at least TURN seconds."""
    seconds: list[float] = []
    while sum(seconds) < TURN:
        start = time.perf_counter()
        decode()
        seconds.append(time.perf_counter() - start)
    return seconds


def measure_decoding(path: Path, scratch: Path, found: list) -> dict:
    """Only the decoding times, of a model of the paper's Figures 8 and 9."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    buffers = {
        OURS: encode_ours(primitives, 0, Stopwatch()),
        **{peer.name: peer.encode(parts) for peer in found},
    }
    return {
        "model": path.stem,
        "triangles": sum(len(part.triangles) for part in parts),
        "decode": _decoding(buffers, found, REPETITIONS, scratch)[0],
    }


@functools.cache
def _programs() -> Path:
    return native_build.build("MESHLET_BENCH")


def native(program: str, blobs: list[bytes], scratch: Path) -> dict:
    """Runs a program of bench/native on the blobs; returns the JSON that it prints."""
    files = [scratch / f"{number}.blob" for number in range(len(blobs))]
    for file, blob in zip(files, blobs):
        file.write_bytes(blob)
    command = [_programs() / program, *files]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


# Started by a small process: Linux counts the memory of the starting process to a program's peak.
LAUNCHER = """
import resource, subprocess, sys, time
start = time.perf_counter()
status = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
sys.exit(status)
"""


def measure_command(path: Path, scratch: Path, repetitions: int) -> dict:
    """`gltf-meshlet compress` as a user runs it: seconds and peak memory of the whole process.

    With compiled modules, as an installation has them.
    """
    bytecode = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(scratch / "bytecode")}
    environment = {**os.environ, **bytecode}
    subprocess.run(
        [sys.executable, "-m", "gltf_meshlet", "compress", path, scratch / "out.glb"],
        check=True,
        stdout=subprocess.DEVNULL,
        env=environment,
    )
    command = [
        sys.executable,
        "-c",
        LAUNCHER,
        sys.executable,
        "-m",
        "gltf_meshlet",
        "compress",
        path,
        scratch / "out.glb",
    ]
    runs = [
        subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment).stdout.split()
        for _ in range(repetitions)
    ]
    return {
        "seconds": spread([float(seconds) for seconds, _ in runs]),
        "peak_bytes": max(int(peak) for _, peak in runs),
    }


# --- peak memory, in a process of its own ---


def libraries(found: list) -> list[str]:
    """The peers that encode in the calling process; the others are commands."""
    return [peer.name for peer in found if isinstance(peer, peers.Draco)]


def peak_memory(task: str, codec: str, given: list, scratch: Path) -> int:
    """The growth of a new process in bytes, from the loaded input to the peak of one task."""
    path = scratch / "input.pickle"
    path.write_bytes(pickle.dumps(given))
    return call_in_process("bench.speed", "peak_growth", task, codec, str(path))


def peak_growth(task: str, codec: str, given: str) -> int:
    """Runs in the new process of peak_memory. given: a file of pickled input."""
    data = pickle.loads(Path(given).read_bytes())
    installed = [] if codec.startswith(OURS) else installed_peers()[0]
    peer = next((peer for peer in installed if peer.name == codec), None)
    if task == "encode":
        run = (
            (lambda: encode_ours(data, 0, Stopwatch(), OTHER_EFFORTS.get(codec, "normal")))
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
        kept = run()  # noqa: F841  the returned arrays count
    return grown[0]


@contextmanager
def _growth() -> Iterator[list[int]]:
    """Yields a list whose item is, at the end, the peak's growth in bytes (Linux)."""
    Path("/proc/self/clear_refs").write_text("5")  # reset the peak
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
    missing = "".join(f"\nNot measured here: {line}." for line in result["missing"])
    build = "with AVX2" if models[0]["stages"]["decode_avx2"] else "without AVX2"
    return f"""# Speed

{origin_line(result)}
Positions have 12 bits, normals 8 + 8, texture coordinates 12. Medians of {result["repetitions"]}
runs ({result["large"]["repetitions"]} above {result["large"]["triangles"]:,} triangles), in which
the codecs take turns; bench/results/speed.json also has minimum and maximum. Models named torus are
generated.
Peers: {_versions(result)}.{missing}

![Speed and memory over size](speed.png)

{_decoding_section(result)}
{_encoding_section(models)}
{_memory_section(models)}
{_command_section(models)}
## Where the time goes

Percent of encoding on one thread:

{_stage_table(models, "encode")}
Percent of decoding a whole model on one thread ({build}):

{_stage_table(models, "decode")}"""


def _decoding_section(result: dict) -> str:
    models = result["models"]
    peers_of = _peers(models)
    rates = [
        [
            *_name(row),
            *_rates(
                row,
                [
                    *(
                        row["decode"][OURS][key]
                        for key in ("native_seconds", "seconds", "all_threads_seconds")
                    ),
                    *(row["decode"][codec]["seconds"] for codec in peers_of),
                ],
                ".1f",
            ),
        ]
        for row in models
    ]
    headings = ("ours, native", "ours, from Python", "ours, meshlets alone, all threads")
    ratios = [
        [
            *_name(row),
            *(f"{ratio(row, codec):.2f}" for codec in peers_of),
            f"{row['one_meshlet_microseconds']['median']:.2f}",
        ]
        for row in models
    ]
    against = (f"against {codec}" for codec in peers_of)
    return f"""## Decoding, million triangles per second

All attributes, to float arrays, on one thread unless the column says otherwise. All columns take
turns, each for at least {1000 * TURN:.0f} ms. The fastest of each row is in bold.

* Native: the C++ call, into preallocated memory.
* From Python: into new numpy arrays, as the peers do. (Corto: into preallocated arrays. Meshopt: to
  integers, which is its form for drawing.)
* All threads: each meshlet alone, as a renderer decodes, on {result["machine"]["cores"]} threads.
  The peers decode a mesh on one thread only.

{markdown_table(["model", "triangles", *headings, *peers_of], rates)}
The models of Figures 8 and 9 of [the paper](../README.md#the-paper), or their
[stand-ins](results.md#the-models): milliseconds on one thread, means as in the paper.

{_paper_table(result, peers_of)}
Our decoding speed over each peer's, on one thread, from Python; below 1 the peer is faster. Last
column: microseconds to decode one meshlet, in random order.{_variation(result)}

{markdown_table(["model", "triangles", *against, "one meshlet"], ratios)}"""


def _encoding_section(models: list[dict]) -> str:
    codecs = list(models[0]["encode"])
    others = [codec for codec in codecs if codec in OTHER_EFFORTS] + _peers(models)
    rates = [
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
    sizes = [
        [
            *_name(row),
            *(f"{row['raw_bytes'] / row['encode'][codec]['bytes']:.1f}" for codec in codecs),
        ]
        for row in models
    ]
    headings = ("ours, one thread", "ours, all threads")
    return f"""## Encoding, million triangles per second

From arrays to bytes in memory, including welding and quantisation. Corto's time is the one that its
command prints, for one of its two normal modes. gltfpack's is the whole command, including files.
All peers and [efforts](efforts.md) but the default, normal, use one thread. The fastest of each row
is in bold.

{markdown_table(["model", "triangles", *headings, *others], rates)}
Compression ratio of these encodings; raw is 4 bytes per float and per index:

{markdown_table(["model", "triangles", *codecs], sizes)}"""


def _memory_section(models: list[dict]) -> str:
    measured = [
        (task, codec) for task, of_codec in models[0]["memory"].items() for codec in of_codec
    ]
    rows = [
        [*_name(row), *(_megabytes(row["memory"][task][codec]) for task, codec in measured)]
        for row in models
    ]
    headings = (f"{task}, {codec}" for task, codec in measured)
    return f"""## Peak memory, MB

Growth of the process while it encodes (ours on all threads) or decodes. The input is loaded before,
the result is included (except Corto's, which decodes into preallocated arrays). The encoders of
Corto and gltfpack are commands that load files and are not measured.

{markdown_table(["model", "triangles", *headings], rows)}"""


def _command_section(models: list[dict]) -> str:
    rows = []
    for row in models:
        seconds, peak = row["command"]["seconds"]["median"], row["command"]["peak_bytes"]
        rates = (f"{seconds:.2f}", f"{row['triangles'] / seconds / 1e6:.2f}")
        rows.append([*_name(row), *rates, _megabytes(peak), f"{peak / row['triangles']:.0f}"])
    headings = ("seconds", "million triangles per second", "peak, MB", "bytes per triangle")
    return f"""## `gltf-meshlet compress` as a whole process

On all threads, including start-up and files. Peak memory is that of the whole process.

{markdown_table(["model", "triangles", *headings], rows)}"""


def _peers(models: list[dict]) -> list[str]:
    return [codec for codec in models[0]["decode"] if codec != OURS]


def _variation(result: dict) -> str:
    """How much two measurements of the same decoding differ; empty if nothing is measured twice."""
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
        "\nThe machine's speed varies: what is measured twice on this page differs by up to "
        f"{max(max(ratio, 1 / ratio) for ratio in ratios):.2f} times."
        if ratios
        else ""
    )


def ratio(row: dict, codec: str) -> float:
    """The speed of our decoding over a peer's, both from Python on one thread."""
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


def save_plot(result: dict, path: Path) -> Path:
    """Seconds and peak memory of decoding and encoding over triangles, of the generated series."""
    series = [row for row in result["models"] if row["model"] == "torus"]
    triangles = [row["triangles"] for row in series]
    figure, axes = pyplot().subplots(1, 4, figsize=(17, 4.2), dpi=100)
    for codec in series[0]["encode"]:
        panels = (
            [
                row["decode"][codec]["seconds"]["median"] if codec in row["decode"] else np.nan
                for row in series
            ],
            [row["encode"][codec]["seconds"]["median"] for row in series],
            [row["memory"]["encode"].get(codec, np.nan) / 1e6 for row in series],
            [row["memory"]["decode"].get(codec, np.nan) / 1e6 for row in series],
        )
        for axis, values in zip(axes, panels):
            style, width = ("--s", 1.2)
            if codec.startswith(OURS):
                style, width = ("-o", 2.2) if codec == OURS else (":o", 1.6)
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
    return path


def inputs(largest: int, folder: Path) -> Iterator[tuple[str, Path]]:
    """(name, path) of the models; each is generated just before its turn."""
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


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--largest",
        type=int,
        default=max(SERIES),
        metavar="TRIANGLES",
        help="skip larger generated models (default: %(default)s)",
    )
