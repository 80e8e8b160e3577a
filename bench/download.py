"""How soon is a model on the screen? Chromium loads it over 10, 50 and 200 Mbit/s.

Writes docs/download.png and a section of docs/web.md. A server limits the rate of the models'
files; pages and libraries come at once. Chromium draws with three.js, without a GPU. Ours and Draco
decode in Workers. All but plain files have 12 bits for positions, 8 for normals and 12 for texture
coordinates.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import gltf_ext
from bench import peers, stream
from bench.common import (
    origin_line,
    progress,
    pyplot,
    save_figure,
    table,
)
from bench.models import real_model
from bench.transport import BITS

NAMES = ("bunny", "dragon")
DOCUMENT, BLOCK = "web", "download"
PARTS = ("models", "rounds")
RATES = (10, 50, 200)  # Mbit/s
ROUNDS = 3  # of each load the fastest counts
# File -> label, colour.
FILES = {
    "plain": ("plain glTF", "#bbbbbb"),
    "meshopt": ("meshopt (gltfpack -c)", "#ccbb44"),
    "draco": ("Draco (level 7)", "#ee6677"),
    "ours": ("ours", "#99bbdd"),
    "packed": ("ours, packed", "#228833"),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("models", nargs="*", default=list(NAMES), help=f"default: {NAMES}")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help=f"default: {ROUNDS}")


def check(options: argparse.Namespace) -> None:
    stream.require_browsers(["Chromium"])


def measure(options: argparse.Namespace) -> dict:
    return {
        "rounds": options.rounds,
        "models": [measure_model(name, options.rounds) for name in options.models],
    }


def measure_model(name: str, rounds: int) -> dict:
    """Bytes of the files; seconds by rate and file."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_files(real_model(name), folder)
        loads = [{"task": "whole", "file": f"{file}.glb"} for file in FILES]
        (folder / "list.json").write_text(json.dumps(loads * rounds))
        seconds: dict[str, dict[str, float]] = {}
        for rate in RATES:
            runs = stream.drive(folder, rate * 125_000)
            seconds[str(rate)] = {
                file: min(run["seconds"] for run in runs if run["file"] == f"{file}.glb")
                for file in FILES
            }
            progress(f"{name}, {rate} Mbit/s")
        return {
            "model": name,
            "bytes": {file: (folder / f"{file}.glb").stat().st_size for file in FILES},
            "seconds": seconds,
        }


def write_files(model: Path, folder: Path) -> None:
    """One file for each of FILES, without materials."""
    plain = folder / "plain.glb"
    peers.write_primitives(peers.read_primitives(model), plain)
    for file, transport in (("ours", False), ("packed", True)):
        gltf_ext.compress(plain, folder / f"{file}.glb", transport=transport, **BITS)
    modules = peers.NODE_MODULES / ".bin"
    position, normal, texcoord = BITS.values()
    draco = [modules / "gltf-transform", "draco", plain, folder / "draco.glb"]
    draco += ["--encode-speed", 3, "--decode-speed", 3]  # Draco's level is 10 minus its speed
    draco += ["--quantize-position", position, "--quantize-normal", normal]
    draco += ["--quantize-texcoord", texcoord]
    meshopt = [modules / "gltfpack", "-c", "-i", plain, "-o", folder / "meshopt.glb"]
    meshopt += ["-vp", position, "-vn", normal, "-vt", texcoord]
    for command in (draco, meshopt):
        subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)


def seconds_table(result: dict) -> str:
    columns = {
        "model": lambda of: of[0]["model"],
        "file": lambda of: FILES[of[1]][0],
        "MB": lambda of: f"{of[0]['bytes'][of[1]] / 1e6:.2f}",
        **{f"{r} Mbit/s": lambda of, r=r: f"{of[0]['seconds'][str(r)][of[1]]:.2f}" for r in RATES},
    }
    return table(((model, file) for model in result["models"] for file in FILES), columns)


def save_plot(result: dict, path: Path) -> Path:
    """Bars of seconds by rate and file, one plot per model."""
    models = result["models"]
    figure, axes = pyplot().subplots(1, len(models), figsize=(9, 4.2), dpi=100, squeeze=False)
    width = 0.17
    for axis, model in zip(axes[0], models):
        for k, (file, (label, color)) in enumerate(FILES.items()):
            places = [place + width * (k - 2) for place in range(len(RATES))]
            values = [model["seconds"][str(rate)][file] for rate in RATES]
            drawn = axis.bar(places, values, width - 0.02, color=color, label=label)
            axis.bar_label(drawn, [f"{v:.2g}" for v in values], padding=2, fontsize=7)
        axis.set_yscale("log")
        axis.set_xticks(range(len(RATES)), [f"{rate} Mbit/s" for rate in RATES])
        axis.set_title(model["model"])
        axis.spines[["top", "right"]].set_visible(False)
    axes[0][0].set_ylabel("seconds until it is drawn")
    axes[0][-1].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    return save_figure(figure, path, result["models"])


def faster_when_packed(result: dict) -> str:
    """At which rates, on which models."""
    found = [
        f"on {model['model']} at {rate} Mbit/s"
        for model in result["models"]
        for rate in RATES
        if model["seconds"][str(rate)]["packed"] < model["seconds"][str(rate)]["ours"]
    ]
    return ", ".join(found) or "at none of these rates"


def block(result: dict) -> str:
    return (
        f"{origin_line(result)}\n"
        "Seconds from the request to the first picture, in headless Chromium with three.js and\n"
        f"without a GPU, the fastest of {result['rounds']} loads. Only the models' files come at\n"
        "the limited rate, without materials; decoders come at once. All have 12 bits for\n"
        "positions, 8 for normals and 12 for texture coordinates, but for the plain file. Packing\n"
        f"is faster than ours unpacked {faster_when_packed(result)}:\n"
        "`GLTFLoader` decodes only when a file is there as a whole, and unpacking adds to that.\n\n"
        "![Seconds until a model is drawn, by rate and format](download.png)\n\n"
        f"{seconds_table(result)}"
    )
