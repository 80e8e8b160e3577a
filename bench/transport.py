"""How small packed for download? EXT_meshlet_transport beside ours, Draco, Brotli and Zstandard.

Writes a section of docs/size.md. Files as `compress` writes them; all bytes of the extensions
count, their JSON and page tables too. Speeds: thread's processor time, of alternating runs the
fastest, on one thread, without reading files. Two threads and WebAssembly (web/unpacker.wasm in
Node): time that passes, likewise, beside one thread. Takes a minute and a half; needs two idle
cores.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gltf_ext
from bench import figures, peers
from bench.common import (
    ROOT,
    origin_line,
    progress,
    table,
)
from bench.models import all_models
from gltf_ext import _codec
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.attributes.streams import Bits
from gltf_ext.document.json_values import minified
from gltf_ext.document.transport import TRANSPORT
from gltf_ext.sources.importers import open_model
from spec import reference_transport

DOCUMENT, BLOCK = "size", "transport"
RUNS = 15
WORKER = Path(__file__).with_name("transport_worker.mjs")
SEVERAL_PAGES = 4  # of a view: enough for two threads
LEVELS = (7, 10)
PACKAGES = ("brotli", "zstandard", "DracoPy")
BITS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12}  # as bench/size.py


def check(options: argparse.Namespace) -> None:
    """Ends the program if something is missing."""
    peers.require_web(files=["unpacker.wasm"])
    if missing := [name for name in PACKAGES if not importlib.util.find_spec(name)]:
        raise SystemExit(f"bench: pip install {' '.join(missing)}")


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    rows = []
    load = os.getloadavg()[0]
    for path in all_models():
        rows.append(measure_model(path))
        progress(f"{path.stem}: {rows[-1]['bytes']['packed'] / rows[-1]['bytes']['draco_7']:.3f}")
    return {"draco": peers.Draco().version, "runs": RUNS, "load": load, "models": rows}


def measure_model(path: Path) -> dict:
    """Bytes and million triangles per second of one model."""
    import brotli  # docs/size.md is written without them
    import zstandard

    primitives = peers.read_primitives(path)
    with tempfile.TemporaryDirectory() as folder:
        source, output = Path(folder) / "in.glb", Path(folder) / "out.glb"
        peers.write_primitives(primitives, source)
        begin = time.process_time()
        gltf_ext.compress(source, output, threads=1, **BITS)
        compress_seconds = time.process_time() - begin
        compressed = require_compressed(open_model(output))
    views = [bytes(c.blob) for c in compressed]
    json_bytes = sum(c.json_bytes for c in compressed)
    begin = time.process_time()
    packed = [_codec.pack(view, threads=1) for view in views]
    pack_seconds = time.process_time() - begin
    triangles = sum(c.triangle_count for c in compressed)
    packed_json = sum(
        len(minified({"extensions": {TRANSPORT: {"byteLength": len(view)}}})) for view in views
    )
    sizes = {
        "ours": sum(map(len, views)) + json_bytes,
        "packed": sum(map(len, packed)) + json_bytes + packed_json,
        "brotli": sum(len(brotli.compress(view)) for view in views) + json_bytes,
        "zstd": sum(len(zstandard.compress(view, 19)) for view in views) + json_bytes,
    }
    parts = peers.parts_of(primitives, Bits(*BITS.values()))
    work: dict[str, Callable[[], object]] = {
        "packed": lambda: [_codec.unpack(data, threads=1) for data in packed]
    }
    for level in LEVELS:
        draco = peers.Draco(level)
        buffers = draco.encode(parts, Bits(*BITS.values()))
        sizes[f"draco_{level}"] = sum(map(len, buffers))
        if level == LEVELS[0]:
            work["draco"] = draco.decoder(buffers)
    return {
        "model": path.stem,
        "triangles": triangles,
        "pages": sum(len(page_sizes(data)) for data in packed),
        "threads_2_most": most_times(packed),
        "bytes": sizes,
        "speed": {name: triangles / t / 1e6 for name, t in fastest(work).items()},
        "wall_seconds": wall_seconds(packed),
        "compress_seconds": compress_seconds,
        "pack_seconds": pack_seconds,
    }


def page_sizes(packed: bytes) -> list[int]:
    """The resident bytes of the pages of a packed view."""
    return [size for _, size in reference_transport.page_table(packed)]


def most_times(packed: list[bytes]) -> float:
    """How many times as fast two threads can be that take page after page, as the unpacker's do."""
    total = longer = 0
    for view in packed:
        loads = [0, 0]
        for size in page_sizes(view):
            loads[loads.index(min(loads))] += size
        total += sum(loads)
        longer += max(loads)
    return total / longer


def fastest(
    work: dict[str, Callable[[], object]], clock: Callable[[], float] = time.thread_time
) -> dict[str, float]:
    """Seconds of each function: of alternating runs the fastest."""
    seconds = dict.fromkeys(work, float("inf"))
    for _ in range(RUNS):
        for name, run in work.items():
            begin = clock()
            run()
            seconds[name] = min(seconds[name], clock() - begin)
    return seconds


def wall_seconds(packed: list[bytes]) -> dict[str, float]:
    """Seconds that pass until packed views are unpacked: with one thread, in WebAssembly and, for
    views of several pages, with two threads."""
    work: dict[str, Callable[[], object]] = {
        f"threads_{n}": lambda n=n: [_codec.unpack(data, threads=n) for data in packed]
        for n in (1, 2)
    }
    if max(len(page_sizes(data)) for data in packed) < SEVERAL_PAGES:
        del work["threads_2"]
    seconds = fastest(work, time.perf_counter)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder, str(i)) for i in range(len(packed))]
        for path, data in zip(paths, packed):
            path.write_bytes(data)
        sizes = [[str(p), _codec.unpacked_bytes(data)] for p, data in zip(paths, packed)]
        Path(folder, "list.json").write_text(json.dumps(sizes))
        spent = peers.node(WORKER, ROOT / "web", Path(folder, "list.json"), RUNS)
        return {**seconds, "wasm": float(spent)}


# --- the document ---


def ratio(row: dict, other: str) -> float:
    return row["bytes"]["packed"] / row["bytes"][other]


def times(row: dict, way: str) -> str:
    """How many times as fast as one native thread."""
    seconds = row["wall_seconds"]
    return f"{seconds['threads_1'] / seconds[way]:.2f}" if way in seconds else ""


def most(row: dict) -> str:
    """How many times as fast two threads could be; empty where that was not measured."""
    return f"{row['threads_2_most']:.2f}" if "threads_2" in row["wall_seconds"] else ""


def block(result: dict) -> str:
    """The section of docs/size.md."""
    rows = result["models"]
    medians = {
        name: statistics.median(ratio(row, name) for row in rows) for name in rows[0]["bytes"]
    }
    largest = max(rows, key=lambda row: ratio(row, "draco_7"))
    others = {"of ours": "ours", "of Brotli": "brotli", "of Zstandard": "zstd"}
    others |= {f"of Draco {level}": f"draco_{level}" for level in LEVELS}
    sizes = table(
        rows,
        {
            "model": lambda row: row["model"],
            "ours": lambda row: f"{row['bytes']['ours']:,}",
            "packed": lambda row: f"{row['bytes']['packed']:,}",
            **{of: lambda row, n=name: f"{ratio(row, n):.3f}" for of, name in others.items()},
        },
    )
    speeds = table(
        rows,
        {
            "model": lambda row: row["model"],
            "pages": lambda row: str(row["pages"]),
            "unpack": lambda row: f"{row['speed']['packed']:.2f}",
            "Draco 7": lambda row: f"{row['speed']['draco']:.2f}",
            "2 threads": lambda row: times(row, "threads_2"),
            "at most": most,
            "WebAssembly": lambda row: times(row, "wasm"),
            "pack / compress": lambda row: f"{row['pack_seconds'] / row['compress_seconds']:.2f}",
        },
    )
    speed = statistics.median(row["speed"]["packed"] for row in rows)
    times_draco = [row["speed"]["packed"] / row["speed"]["draco"] for row in rows]
    speed_line = (
        f"Median of unpacking: {speed:.1f};\nbeside Draco at level 7 {min(times_draco):.2f} to "
        f"{max(times_draco):.2f} times as fast, median {statistics.median(times_draco):.2f}."
    )
    if result["load"] > 1:
        speed_line += (
            f"\nOther work kept the machine busy (load {result['load']:.0f}), which slows all of "
            "it: compare only\nthe columns of unpacking and Draco."
        )
    return f"""## Packed for download

{origin_line(result)}
`compress --transport` packs the bytes of a file
([EXT_meshlet_transport](../spec/EXT_meshlet_transport.md), a draft); they unpack to the same bytes.
On the median of the models packed files take {medians["ours"]:.2f} of the bytes of ours,
{medians["draco_7"]:.2f} of Draco's at level 7 and {medians["draco_10"]:.2f} at level 10; at most
{ratio(largest, "draco_7"):.2f} of level 7 ({largest["model"]}). All bytes of the extensions count,
JSON and page tables too; files as `compress` writes them.

{sizes}
Million triangles per second on one thread, the fastest of {result["runs"]} alternating runs, and
the time of packing over that of compressing. {speed_line}
Unpacked bytes are ready for the GPU; Draco's result is a mesh of floats. Two threads and
WebAssembly (in Node): how many times the speed of one native thread, two threads on views of
{SEVERAL_PAGES} pages and more. A thread takes whole pages, and a model's last one is small: "at
most" is what that allows.

{speeds}"""


def write_pictures(result: dict) -> list[Path]:
    """The README's chart."""
    return figures.draw_all()
