"""How fast in JavaScript? Decoding in Node beside draco3d and meshoptimizer, warm and cold; sizes.

Writes the tables of docs/web.md. Needs web/decoder.wasm (make web) and, in build/node, the npm
packages draco3d, meshoptimizer and gltfpack.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

from bench import peers
from bench.common import ROOT, markdown_table, origin_line, progress, spread
from bench.models import add_model_names, real_model
from bench.speed import OURS, encode_ours, native
from gltf_ext import _codec

PARTS = ("models",)
WEB = ROOT / "web"
WORKER = Path(__file__).with_name("web_worker.mjs")
# What a page loads to decode, by package.
PACKAGE_FILES = {
    OURS: ("decoder.js", "blob.js", "compile.js", "accessors.js", "gltf.js", "decoder.wasm"),
    "draco3d": ("draco_decoder_nodejs.js", "draco_decoder.wasm"),
    "meshoptimizer": ("meshopt_decoder.mjs",),
}
NPM_PACKAGES = tuple(name for name in PACKAGE_FILES if name != OURS)
NAMES = ("bunny", "dragon", "DamagedHelmet")
PAGED = "dragon"  # measured again with pages
PAGE_BYTES = 65536
REPETITIONS = 7
ROUNDS = 3  # of native and WebAssembly decoding in turns
WORKERS = (1, 2)
CODECS = {OURS: "ours", "draco": "Draco, level 7", "meshopt": "meshopt"}


def worker(task: str, given: Path):
    """What web_worker.mjs prints."""
    return json.loads(peers.node(WORKER, WEB, peers.NODE_MODULES, task, given))


def check(options: argparse.Namespace) -> None:
    """Ends the program if something is missing."""
    peers.require_web(NPM_PACKAGES, ("decoder.wasm",))
    for name in options.models:
        real_model(name)


def measure(options: argparse.Namespace) -> dict:
    """All models, and the sizes of the packages."""
    with tempfile.TemporaryDirectory() as folder:
        runs = [(name, 0) for name in options.models]
        runs += [(name, PAGE_BYTES) for name in options.models if name == PAGED]
        models = [measure_model(*run, Path(folder) / str(n)) for n, run in enumerate(runs)]
        return {
            "repetitions": REPETITIONS,
            "rounds": ROUNDS,
            "node": peers.node("-p", "process.version").strip(),
            "packages": {name: package_sizes(name) for name in PACKAGE_FILES},
            "models": models,
        }


def measure_model(name: str, page_bytes: int, folder: Path) -> dict:
    """The seconds of every codec; the codecs take turns."""
    folder.mkdir()
    primitives = peers.read_primitives(real_model(name))
    parts = peers.parts_of(primitives)
    buffers = {
        OURS: encode_ours(primitives, 0, page_bytes=page_bytes),
        "draco": peers.Draco(7).encode(parts),
        "meshopt": peers.Gltfpack(True).encode(parts),
    }
    given: dict = {"repetitions": REPETITIONS, "workers": WORKERS}
    for codec, encoded in buffers.items():
        files = [folder / f"{codec}-{number}" for number in range(len(encoded))]
        for file, buffer in zip(files, encoded):
            file.write_bytes(buffer)
        given[codec] = list(map(str, files))
    (folder / "list.json").write_text(json.dumps(given))
    warm: dict[str, list[float]] = {"native": []}
    cold: dict[str, list[float]] = {codec: [] for codec in CODECS}
    blobs = [v[at : at + size] for v in buffers[OURS] for at, size in _codec.split(v)]
    for _ in range(ROUNDS):
        warm["native"] += native("decode_speed", blobs, folder)["decode_seconds"]
        for codec, seconds in worker("warm", folder / "list.json").items():
            warm.setdefault(codec, []).extend(seconds)
        for codec, seconds in cold.items():
            seconds.append(worker(f"cold-{codec}", folder / "list.json"))
    title = f"{name}, pages of {page_bytes // 1024} kB" if page_bytes else name
    progress(title)
    return {
        "model": title,
        "triangles": sum(len(part.triangles) for part in parts),
        "bytes": {codec: sum(map(len, encoded)) for codec, encoded in buffers.items()},
        "warm": {codec: spread(seconds) for codec, seconds in warm.items()},
        "cold": {codec: spread(seconds) for codec, seconds in cold.items()},
    }


def package_sizes(name: str) -> dict:
    """Bytes of what a page loads to decode, as they are and with Brotli."""
    package = WEB if name == OURS else peers.NODE_MODULES / name
    files = [package / file for file in PACKAGE_FILES[name]]
    script = (
        "process.argv.slice(1).reduce((n, f) => "
        "n + require('zlib').brotliCompressSync(require('fs').readFileSync(f)).length, 0)"
    )
    return {
        "version": json.loads((package / "package.json").read_text())["version"],
        "files": [file.name for file in files],
        "bytes": sum(file.stat().st_size for file in files),
        "brotli_bytes": int(peers.node("-p", script, *files)),
    }


def rate(model: dict, seconds: float) -> str:
    return f"{model['triangles'] / seconds / 1e6:.1f}"


def speed_table(result: dict) -> str:
    """Million triangles per second, best of the repetitions; milliseconds of a cold start."""
    columns = ["native", "ours", *(f"ours, {n} worker{'s' * (n > 1)}" for n in WORKERS)]
    columns += ["draco", "meshopt"]
    headings = ["model", "triangles", *(CODECS.get(column, column) for column in columns)]
    headings += [f"cold: {name}" for name in CODECS.values()]
    rows = []
    for model in result["models"]:
        warm = [rate(model, model["warm"][column]["low"]) for column in columns]
        cold = [f"{1000 * model['cold'][codec]['low']:.0f} ms" for codec in CODECS]
        rows.append([model["model"], f"{model['triangles']:,}", *warm, *cold])
    return markdown_table(headings, rows)


def size_table(result: dict) -> str:
    """Bytes that a page loads."""
    rows = []
    for name in PACKAGE_FILES:
        sizes = result["packages"][name]
        title = "gltf-meshlet" if name == OURS else f"{name} {sizes['version']}"
        files = ", ".join(f"`{file}`" for file in sizes["files"])
        kilobytes = [f"{sizes[key] / 1000:.1f}" for key in ("bytes", "brotli_bytes")]
        rows.append([title, files, *kilobytes])
    return markdown_table(["package", "files", "kB", "kB with Brotli"], rows)


def block(result: dict) -> str:
    """The tables of docs/web.md."""
    return (
        f"{origin_line(result)[:-2]}, Node {result['node']}; best of "
        f"{result['rounds'] * result['repetitions']}, in million triangles per second, to arrays "
        "that can be drawn; meshopt's stay quantised. Native: our C++ decoder on one thread, into "
        "arrays that it reuses; the others make new ones. Cold: "
        "import, compilation and the first decoding in a new process, best of "
        f"{result['rounds']}.\n\n{speed_table(result)}\nWhat a page loads to decode:\n\n"
        f"{size_table(result)}"
    )


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, NAMES)
