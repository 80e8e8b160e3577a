"""Which parameters? Size and speed over one option of compress at a time.

Writes docs/parameters.md and docs/parameters.png.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.common import (
    markdown_table,
    origin_line,
    progress,
    pyplot,
    spread,
)
from bench.models import add_model_names, torus_and_named
from bench.speed import native
from gltf_ext.compression.extension import require_compressed
from gltf_ext.compression.options import EFFORTS, Options
from gltf_ext.gltf.importers import open_model

PACKAGES = ("gltf-meshlet", "numpy", "matplotlib")
NAMES = ("bunny", "engine", "sponza_like")
GENERATED = 60_000  # triangles of the generated model
REPETITIONS = 3  # of compress
DEFAULTS = {
    "lambda_": 1.4,  # of _codec.encode: compress does not set it
    **{
        option: getattr(Options(), option)
        for option in ("effort", "max_triangles", "position_bits")
    },
}
# While other options change: growing regions has options that the default effort ignores.
EFFORT = "high"
VALUES = {
    "effort": EFFORTS,
    "max_triangles": (16, 24, 32, 40, 48, 56, 64),
    "lambda_": (0.5, 1.0, 1.2, 1.4, 1.6, 2.0, 4.0, 8.0),
    "position_bits": (8, 10, 12, 14, 16, 18, 20),
}
TITLES = {
    "effort": ("Effort", "`--effort`: time spent on a smaller file."),
    "max_triangles": ("Meshlet size", "`--max-triangles`: triangles per meshlet, at most."),
    "lambda_": (
        "Shape of meshlets",
        "`--lambda`: large values make regions compact, small values planar.",
    ),
    "position_bits": ("Position grid", "`-vp`: bits of a position along the longest side."),
}


def measure(options: argparse.Namespace) -> dict:
    """All values of all options, on all models."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for model, path in torus_and_named(options.models, GENERATED, folder).items():
            for option, values in VALUES.items():
                for value in values:
                    measured = measure_options(path, folder, **{"effort": EFFORT, option: value})
                    rows.append({"model": model, "option": option, "value": value, **measured})
                progress(f"{model}, {option}")
    return {"rows": rows}


def measure_options(path: Path, folder: Path, **options) -> dict:
    """Size, and times on this machine, with some options of compress."""
    output, seconds = folder / "out.glb", []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        gltf_ext.compress(path, output, **options)
        seconds.append(time.perf_counter() - start)
    totals = gltf_ext.inspect(output)["totals"]
    timed = native(
        "decode_speed",
        [b for p in require_compressed(open_model(output)) for b in p.blobs],
        folder,
    )
    return {
        **{
            key: totals[key]
            for key in (
                "triangles",
                "meshlets",
                "mean_triangles_per_meshlet",
                "ratio",
                "bits_per_triangle",
            )
        },
        "compress_seconds": spread(seconds),
        "decode_seconds": spread(timed["decode_seconds"]),
        "meshlet_microseconds": spread(timed["meshlet_microseconds"]),
    }


def report(result: dict) -> str:
    """docs/parameters.md."""
    sections = []
    for option, (title, text) in TITLES.items():
        rows = [row for row in result["rows"] if row["option"] == option]
        if not rows:
            continue
        sections.append(f"""## {title}

{text} The default is {DEFAULTS[option]}.

{
            markdown_table(
                [
                    "model, value",
                    "meshlets",
                    "triangles per meshlet",
                    "ratio",
                    "bits per triangle",
                    "compress, seconds",
                    "decode, million triangles per second",
                    "one meshlet, microseconds",
                ],
                [_figures(row) for row in rows],
            )
        }""")
    return f"""# Parameters

{origin_line(result)}
One option of `compress` changes at a time; the others keep their defaults, except that the effort
is {EFFORT}, since the default's meshlets do not depend on all options. Bits per triangle include
everything. "compress" is the whole call on all threads, including files. "decode" is the
C++ call for the whole model on one thread, "one meshlet" the mean for a single meshlet.
{_noise(result)}[choices.md](choices.md) measures the choices that are fixed in the format.

![Ratio and decode speed over the options](parameters.png)

{chr(10).join(sections)}"""


def _noise(result: dict) -> str:
    """How far repeated measurements of the defaults, one per option, lie apart in each model."""

    def span(key: str) -> float:
        """The largest ratio of slowest to fastest."""
        times: dict[str, list[float]] = {}
        for row in result["rows"]:
            if row["option"] != "effort" and row["value"] == DEFAULTS[row["option"]]:
                times.setdefault(row["model"], []).append(row[key]["median"])
        return max(max(of_model) / min(of_model) for of_model in times.values())

    decode, meshlet, compress = (
        f"{span(key):.2f}" for key in ("decode_seconds", "meshlet_microseconds", "compress_seconds")
    )
    return f"""Times are rough: the default rows are the same file, measured again per option,
and differ by up to {decode} times in decoding, {meshlet} in decoding one meshlet and \
{compress} in compressing. Ignore smaller differences.
"""


def _figures(row: dict) -> list[str]:
    mark = " (default)" if row["value"] == DEFAULTS[row["option"]] else ""
    return [
        f"{row['model']}, {row['value']}{mark}",
        f"{row['meshlets']:,}",
        f"{row['mean_triangles_per_meshlet']:.1f}",
        f"{row['ratio']:.2f}",
        f"{row['bits_per_triangle']['total']:.2f}",
        f"{row['compress_seconds']['median']:.2f}",
        f"{row['triangles'] / row['decode_seconds']['median'] / 1e6:.1f}",
        f"{row['meshlet_microseconds']['median']:.2f}",
    ]


def save_plot(result: dict, path: Path) -> Path:
    """Ratio and decode speed over each numeric option."""
    options = [option for option in VALUES if option != "effort"]
    figure, axes = pyplot().subplots(
        2, len(options), figsize=(3.6 * len(options), 6.4), dpi=100, sharex="col"
    )
    for column, option in enumerate(options):
        for model in dict.fromkeys(row["model"] for row in result["rows"]):
            rows = [
                row for row in result["rows"] if (row["model"], row["option"]) == (model, option)
            ]
            values = [row["value"] for row in rows]
            axes[0, column].plot(
                values, [row["ratio"] for row in rows], "-o", markersize=4, label=model
            )
            speeds = [row["triangles"] / row["decode_seconds"]["median"] / 1e6 for row in rows]
            axes[1, column].plot(values, speeds, "-o", markersize=4)
        axes[0, column].set_title(TITLES[option][0], fontsize=10)
        axes[1, column].set_xlabel(option.rstrip("_").replace("_", " "))
        for axis in axes[:, column]:
            axis.axvline(DEFAULTS[option], color="gray", linewidth=0.8, linestyle=":")
            axis.set_ylim(0, 1.06 * axis.get_ylim()[1])
            axis.grid(alpha=0.3)
            if option == "lambda_":
                axis.set_xscale("log")
                axis.set_xticks(VALUES[option], map(str, VALUES[option]), fontsize=8, rotation=60)
                axis.minorticks_off()
    axes[0, 0].set_ylabel("ratio")
    axes[1, 0].set_ylabel("decode, million triangles per second")
    axes[0, 0].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path)
    return path


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, NAMES)
