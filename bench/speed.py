"""How fast? Encoding and decoding over size beside the peers, on one thread and all; peak memory.

Writes docs/speed.md. The series of models is generated; bunny and dragon, and decoding of the
paper's models, are added. The document names the peers that are missing (see bench/peers.py).
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

from bench import peers
from bench.common import (
    best_in_bold,
    markdown_table,
    origin_line,
    progress,
    spread,
    table,
    versions,
)
from bench.generated import torus
from bench.models import PAPER_MODELS, real_model
from gltf_ext import _codec
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.attributes.streams import Bits
from gltf_ext.sources.primitives import Primitive
from gltf_ext.sources.source import Source
from gltf_meshlet.demo.model import write_glb
from tools import native_build

SERIES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_500_000)
REAL = ("bunny", "dragon")
REPETITIONS = 5
# Above so many triangles fewer repetitions keep the run within minutes.
LARGE, LARGE_REPETITIONS = 500_000, 3
# Seconds for which a codec decodes in its turn: one call may take only half a millisecond.
TURN = 0.05
OURS = "ours"  # with the default effort
# Another effort, as a further codec.
OTHER_EFFORTS = {"ours, fast": "fast"}


# --- ours ---


def encode_ours(
    primitives: list[Primitive], threads: int, effort: str = "normal", page_bytes: int = 0
) -> list[bytes]:
    """What compress does between reading and writing files: one view for each primitive."""
    options = {"threads": threads, "effort": effort, "page_bytes": page_bytes}
    return [_codec.encode(*given, **options)[0] for given in encoder_arguments(primitives)]


def encoder_arguments(primitives: list[Primitive]) -> list[tuple]:
    """The arguments of _codec.encode for each primitive, as compress makes them."""
    sources = [Source.of(primitive) for primitive in primitives]
    grids = peers.position_grids(primitives, Bits())
    arguments = []
    for source in sources:
        source.read_bounds()
        form = RecordFormat.of(source, grids[source.mesh], Bits())
        arguments.append(form.encoder_input_of(form.vertices_of(form.triangles_of(source))))
    return arguments


# --- peers ---


def installed_peers() -> tuple[list, list[str]]:
    """(the installed peers, a line for each missing one).

    Draco at its default and its fastest level, Corto, gltfpack.
    """
    corto, gltfpack = partial(peers.Corto, ("delta",)), partial(peers.Gltfpack, True)
    draco = [partial(peers.Draco, level) for level in (7, 0)]
    found, missing = peers.available([*draco, corto, gltfpack])
    if importlib.util.find_spec("meshoptimizer") is None:
        found = [peer for peer in found if not isinstance(peer, peers.Gltfpack)]
        missing.append("meshopt-compressed glTF: decoding needs pip install --pre meshoptimizer")
    return found, missing


def timed_encode(peer, parts: list) -> tuple[list[bytes], float]:
    """(buffers, seconds); gltfpack's seconds are of its whole command.

    Corto's command reports its own time without reading and writing files.
    """
    if isinstance(peer, peers.Corto):
        return peer.encode_timed(parts)
    return timed(lambda: peer.encode(parts))


def timed(function: Callable[[], Any]) -> tuple[Any, float]:
    """(what the function returns, seconds)."""
    start = time.perf_counter()
    result = function()
    return result, time.perf_counter() - start


# --- one model ---


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    found, missing = installed_peers()
    models, paper_models = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in inputs(folder):
            models.append(measure_model(path, folder, found))
            progress(f"{path.stem}, {models[-1]['triangles']:,} triangles")
        for model in PAPER_MODELS:
            paper_models.append(measure_decoding(real_model(model), folder, found))
            progress(f"{model}, decoding")
    return {
        "repetitions": REPETITIONS,
        "large": {"triangles": LARGE, "repetitions": LARGE_REPETITIONS},
        "peers": {peer.name: peer.version for peer in found},
        "missing": missing,
        "models": models,
        "paper_models": paper_models,
    }


def inputs(folder: Path) -> Iterator[Path]:
    """The models; each is generated just before its turn."""
    for triangles in SERIES:
        write_glb([torus(triangles)], folder / "torus.glb")
        yield folder / "torus.glb"
    yield from map(real_model, REAL)


def measure_model(path: Path, scratch: Path, found: list) -> dict:
    """Everything about one model; the codecs take turns."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    triangles = sum(len(part.triangles) for part in parts)
    repetitions = LARGE_REPETITIONS if triangles > LARGE else REPETITIONS
    encoded, buffers = _encoding(primitives, parts, found, repetitions)
    decoded, meshlet_microseconds = _decoding(buffers, found, repetitions, scratch)
    return {
        "model": path.stem,
        "triangles": triangles,
        "vertices": sum(len(part.positions) for part in parts),
        "raw_bytes": sum(part.raw_bytes for part in parts),
        "encode": encoded,
        "decode": decoded,
        "one_meshlet_microseconds": meshlet_microseconds,
        "command": measure_command(path, scratch, repetitions),
    }


def _encoding(
    primitives: list[Primitive], parts: list, found: list, repetitions: int
) -> tuple[dict[str, dict], dict[str, list[bytes]]]:
    """(seconds and bytes by codec, its buffers); the codecs take turns."""
    ours = {
        OURS: (1, "normal"),
        "all threads": (0, "normal"),
        **{codec: (1, effort) for codec, effort in OTHER_EFFORTS.items()},
    }
    seconds: dict[str, list[float]] = {name: [] for name in (*ours, *(p.name for p in found))}
    buffers: dict[str, list[bytes]] = {}
    for _ in range(repetitions):
        for name, (threads, effort) in ours.items():
            buffers[name], spent = timed(lambda t=threads, e=effort: encode_ours(primitives, t, e))
            seconds[name].append(spent)
        for peer in found:
            buffers[peer.name], spent = timed_encode(peer, parts)
            seconds[peer.name].append(spent)
    sizes = {
        OURS: sum(map(len, buffers[OURS])),
        **{peer.name: peer.file_bytes(buffers[peer.name]) for peer in found},
        **{codec: sum(map(len, buffers[codec])) for codec in OTHER_EFFORTS},
    }
    encoded = {
        codec: {"seconds": spread(seconds[codec]), "bytes": size} for codec, size in sizes.items()
    }
    encoded[OURS]["all_threads_seconds"] = spread(seconds["all threads"])
    return encoded, buffers


def _decoding(
    buffers: dict[str, list[bytes]], found: list, repetitions: int, scratch: Path
) -> tuple[dict[str, dict], dict]:
    """(seconds by codec, microseconds of one meshlet); the native decoder takes turns too."""
    decoders = {
        OURS: lambda: [_codec.decode_values(blob) for blob in buffers[OURS]],
        **{peer.name: peer.decoder(buffers[peer.name]) for peer in found},
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
        seconds.append(timed(decode)[1])
    return seconds


def measure_decoding(path: Path, scratch: Path, found: list) -> dict:
    """Only the decoding times, of a model of the paper's Figures 8 and 9."""
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives)
    buffers = {
        OURS: encode_ours(primitives, 0),
        **{peer.name: peer.encode(parts) for peer in found},
    }
    return {
        "model": path.stem,
        "triangles": sum(len(part.triangles) for part in parts),
        "decode": _decoding(buffers, found, REPETITIONS, scratch)[0],
    }


@cache
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
    compress = [sys.executable, "-m", "gltf_meshlet", "compress", path, scratch / "out.glb"]
    compress += ["-vp", "12", "-vn", "8", "-vt", "12", "-vc", "8"]  # as bench.common.BITS
    subprocess.run(compress, check=True, stdout=subprocess.DEVNULL, env=environment)
    command = [sys.executable, "-c", LAUNCHER, *compress]
    runs = [
        subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment).stdout.split()
        for _ in range(repetitions)
    ]
    return {
        "seconds": spread([float(seconds) for seconds, _ in runs]),
        "peak_bytes": max(int(peak) for _, peak in runs),
    }


# --- the document ---


def report(result: dict) -> str:
    """docs/speed.md."""
    models = result["models"]
    missing = "".join(f"\nNot measured here: {line}." for line in result["missing"])
    return f"""# Speed

{origin_line(result)}
Positions have 12 bits, normals 8 + 8, texture coordinates 12. Medians of {result["repetitions"]}
runs ({result["large"]["repetitions"]} above {result["large"]["triangles"]:,} triangles), in which
the codecs take turns; bench/results/speed.json also has minimum and maximum. Models named torus are
generated.
Peers: {versions(result["peers"])}.{missing}

{_decoding_section(result)}
{_encoding_section(models)}
{_command_section(models)}"""


def _decoding_section(result: dict) -> str:
    models = result["models"]
    peers_of = _peers(models)
    native = ("native_seconds", "seconds", "all_threads_seconds")
    headings = ("ours, native", "ours, from Python", "ours, meshlets alone, all threads")

    def seconds(row: dict) -> list[dict]:
        ours = [row["decode"][OURS][key] for key in native]
        return [*ours, *(row["decode"][codec]["seconds"] for codec in peers_of)]

    def against(codec: str) -> Callable[[dict], str]:
        return lambda row: f"{ratio(row, codec):.2f}"

    rates = [[*_name(row), *_rates(row, seconds(row), ".1f")] for row in models]
    ratios = {
        **NAME,
        **{f"against {codec}": against(codec) for codec in peers_of},
        "one meshlet": lambda row: f"{row['one_meshlet_microseconds']['median']:.2f}",
    }
    return f"""## Decoding, million triangles per second

All attributes, to float arrays, on one thread unless the column says otherwise. All columns take
turns, each for at least {1000 * TURN:.0f} ms. The fastest of each row is in bold.

* Native: the C++ call, into preallocated memory.
* From Python: into new numpy arrays, as the peers do. (Corto: into preallocated arrays. Meshopt: to
  integers, which is its form for drawing.)
* All threads: each meshlet alone, as a renderer decodes, on {result["machine"]["cores"]} threads.
  The peers decode a mesh on one thread only.

{markdown_table([*NAME, *headings, *peers_of], rates)}
The models of Figures 8 and 9 of [the paper](../README.md#the-paper), or their
[stand-ins](results.md#the-models): milliseconds on one thread, means as in the paper.

{_paper_table(result, peers_of)}
Our decoding speed over each peer's, on one thread, from Python; below 1 the peer is faster. Last
column: microseconds to decode one meshlet, in random order.

{table(models, ratios)}"""


def _encoding_section(models: list[dict]) -> str:
    codecs = list(models[0]["encode"])
    others = [codec for codec in codecs if codec in OTHER_EFFORTS] + _peers(models)

    def seconds(row: dict) -> list[dict]:
        ours = row["encode"][OURS]
        others_of = (row["encode"][codec]["seconds"] for codec in others)
        return [ours["seconds"], ours["all_threads_seconds"], *others_of]

    def times_smaller(codec: str) -> Callable[[dict], str]:
        return lambda row: f"{row['raw_bytes'] / row['encode'][codec]['bytes']:.1f}"

    rates = [[*_name(row), *_rates(row, seconds(row), ".2f")] for row in models]
    sizes = {**NAME, **{codec: times_smaller(codec) for codec in codecs}}
    headings = ("ours, one thread", "ours, all threads")
    return f"""## Encoding, million triangles per second

From arrays to bytes in memory, including welding and quantisation. Corto's time is the one that its
command prints, for one of its two normal modes. gltfpack's is the whole command, including files.
All peers, and effort fast, use one thread. The fastest of each row
is in bold.

{markdown_table([*NAME, *headings, *others], rates)}
Compression ratio of these encodings; raw is 4 bytes per float and per index:

{table(models, sizes)}"""


def _command_section(models: list[dict]) -> str:
    def seconds(row: dict) -> float:
        return row["command"]["seconds"]["median"]

    def megabytes(row: dict) -> str:
        count = row["command"]["peak_bytes"]
        return f"{count / 1e6:.1f}" if count < 1e8 else f"{count / 1e6:.0f}"

    columns: dict[str, Callable[[dict], str]] = {
        **NAME,
        "seconds": lambda row: f"{seconds(row):.2f}",
        "million triangles per second": lambda row: f"{row['triangles'] / seconds(row) / 1e6:.2f}",
        "peak, MB": megabytes,
        "bytes per triangle": lambda r: f"{r['command']['peak_bytes'] / r['triangles']:.0f}",
    }
    return f"""## `gltf-meshlet compress` as a whole process

On all threads, including start-up and files. Peak memory is that of the whole process.

{table(models, columns)}"""


def _peers(models: list[dict]) -> list[str]:
    return [codec for codec in models[0]["decode"] if codec != OURS]


def ratio(row: dict, codec: str) -> float:
    """The speed of our decoding over a peer's, both from Python on one thread."""
    return row["decode"][codec]["seconds"]["median"] / row["decode"][OURS]["seconds"]["median"]


def _paper_table(result: dict, others: list[str]) -> str:
    def mean(codec: str, key: str = "mean_seconds") -> Callable[[dict], str]:
        return lambda row: f"{1000 * row['decode'][codec][key]:.1f}"

    ours = {"ours, native": mean(OURS, "native_mean_seconds"), "ours, from Python": mean(OURS)}
    columns = {**NAME, **ours, **{codec: mean(codec) for codec in others}}
    return table(result["paper_models"], columns)


NAME: dict[str, Callable[[dict], str]] = {
    "model": lambda row: row["model"],
    "triangles": lambda row: f"{row['triangles']:,}",
}


def _name(row: dict) -> list[str]:
    return [text(row) for text in NAME.values()]


def _rates(row: dict, seconds: list[dict], form: str) -> list[str]:
    """Million triangles per second, the fastest in bold."""
    return best_in_bold([row["triangles"] / spent["median"] / 1e6 for spent in seconds], form)
