"""Which parameters? Size and speed over one option of compress at a time.

Writes docs/parameters.md.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gltf_ext
from bench.common import BITS, BITS_TEXT, origin_line, progress, spread, table
from bench.models import add_model_names, blobs_of, torus_and_named
from bench.speed import native
from gltf_ext.options import OPTIONS, Options

PARTS = ("models",)
NAMES = ("bunny", "engine", "sponza_like")
GENERATED = 60_000  # triangles of the generated model
REPETITIONS = 3  # of compress
DEFAULTS = {
    "lambda_": 1.4,  # of _codec.encode: compress does not set it
    "position_bits": BITS["position_bits"],  # of measurements: compress chooses
    **{option: getattr(Options(), option) for option in ("effort", "max_triangles")},
}
VALUES = {
    "effort": next(option.choices for option in OPTIONS if option.name == "effort"),
    "max_triangles": (16, 24, 32, 40, 48, 56, 64),
    "lambda_": (0.5, 1.0, 1.2, 1.4, 1.6, 2.0, 4.0, 8.0),
    "position_bits": (8, 10, 12, 14, 16, 18, 20),
}
# Of inspect's totals.
KEPT = ("triangles", "meshlets", "mean_triangles_per_meshlet", "ratio", "bits_per_triangle")
TITLES = {
    "effort": ("Effort", "`--effort`: time spent on a smaller file."),
    "max_triangles": ("Meshlet size", "`--max-triangles`: triangles per meshlet, at most."),
    "lambda_": (
        "Shape of meshlets",
        "`--lambda`: large values make regions compact, small values planar.",
    ),
    "position_bits": ("Position grid", "`-vp`: bits of a position along the longest side."),
}


def _named(row: dict) -> str:
    mark = f" ({_mark(row['option'])})" if row["value"] == DEFAULTS[row["option"]] else ""
    return f"{row['model']}, {row['value']}{mark}"


def _mark(option: str) -> str:
    """What the value in DEFAULTS is: compress chooses the bits of positions."""
    return "elsewhere" if option in BITS else "default"


COLUMNS: dict[str, Callable[[dict], str]] = {
    "model, value": _named,
    "meshlets": lambda row: f"{row['meshlets']:,}",
    "triangles per meshlet": lambda row: f"{row['mean_triangles_per_meshlet']:.1f}",
    "ratio": lambda row: f"{row['ratio']:.2f}",
    "bits per triangle": lambda row: f"{row['bits_per_triangle']['total']:.2f}",
    "compress, seconds": lambda row: f"{row['compress_seconds']['median']:.2f}",
    "decode, million triangles per second": lambda row: (
        f"{row['triangles'] / row['decode_seconds']['median'] / 1e6:.1f}"
    ),
    "one meshlet, microseconds": lambda row: f"{row['meshlet_microseconds']['median']:.2f}",
}


def measure(options: argparse.Namespace) -> dict:
    """All values of all options, on all models."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for model, path in torus_and_named(options.models, GENERATED, folder).items():
            for option, values in VALUES.items():
                for value in values:
                    measured = measure_options(path, folder, **{option: value})
                    rows.append({"model": model, "option": option, "value": value, **measured})
                progress(f"{model}, {option}")
    return {"rows": rows}


def measure_options(path: Path, folder: Path, **options) -> dict:
    """Size, and times on this machine, with some options of compress."""
    output, seconds = folder / "out.glb", []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        gltf_ext.compress(path, output, **{**BITS, **options})
        seconds.append(time.perf_counter() - start)
    totals = gltf_ext.inspect(output)["totals"]
    timed = native("decode_speed", blobs_of(output), folder)
    return {
        **{key: totals[key] for key in KEPT},
        "compress_seconds": spread(seconds),
        "decode_seconds": spread(timed["decode_seconds"]),
        "meshlet_microseconds": spread(timed["meshlet_microseconds"]),
    }


def _default(option: str) -> str:
    """What applies without the option."""
    if option in BITS:
        return f"Other measurements have {DEFAULTS[option]}; by default, `compress` chooses."
    return f"The default is {DEFAULTS[option]}."


def _effort(result: dict) -> str:
    """What the effort was, if not the default."""
    effort = result.get("effort", DEFAULTS["effort"])
    return (
        ""
        if effort == DEFAULTS["effort"]
        else f", and the effort, which was {effort} and has been removed since"
    )


def report(result: dict) -> str:
    """docs/parameters.md."""
    sections = [
        f"""## {title}

{text} {_default(option)}

{table([row for row in result["rows"] if row["option"] == option], COLUMNS)}"""
        for option, (title, text) in TITLES.items()
    ]
    return f"""# Parameters

{origin_line(result)}
One option of `compress` changes at a time; the others keep their defaults, except for bits
({BITS_TEXT}){_effort(result)}.
Bits per triangle include everything. "compress" is the whole call on all threads, including files.
"decode" is the C++ call for the whole model on one thread,
"one meshlet" the mean for a single meshlet.
Times are rough: the default rows of a model are one file, measured again for each option.
[choices.md](choices.md) measures the choices that are fixed in the format.

{chr(10).join(sections)}"""


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, NAMES)
