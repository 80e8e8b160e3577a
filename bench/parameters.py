"""Which parameters? Size and speed over the options of compress, one at a time, the others at their defaults.

python -m bench.parameters: writes bench/results/parameters.json, docs/parameters.md and docs/parameters.png.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import gltf_ext
from bench.common import MODELS, ROOT, markdown_table, origin, origin_line, spread, write_result
from bench.generated import torus
from bench.speed import native
from gltf_ext.compression.extension import require_compressed
from gltf_ext.compression.options import Options
from gltf_ext.gltf.importers import open_model
from gltf_meshlet.demo.model import write_glb

NAMES = ("bunny", "engine", "sponza_like")
GENERATED = 60_000  # triangles of the generated model
REPETITIONS = 3  # of compress
# _codec.encode's defaults, which compress leaves to it.
ENCODER_DEFAULTS = {"lambda_": 1.4, "fill": 0.96, "iterations": 12}
DEFAULTS = {
    **{
        option: getattr(Options(), option)
        for option in ("max_triangles", "position_bits", "weight")
    },
    **ENCODER_DEFAULTS,
}
VALUES = {
    "max_triangles": (16, 24, 32, 40, 48, 56, 64),
    "lambda_": (0.5, 1.0, 1.2, 1.4, 1.6, 2.0, 4.0, 8.0),
    "fill": (0.5, 0.6, 0.68, 0.75, 0.85, 0.92, 0.96, 1.0),
    "iterations": (1, 2, 4, 8, 12, 24),
    "weight": ("paper", "choe"),
    "position_bits": (8, 10, 12, 14, 16, 18, 20),
}
TITLES = {
    "max_triangles": ("Meshlet size", "`--max-triangles`: most triangles in a meshlet."),
    "lambda_": (
        "Shape of meshlets",
        "`--lambda`: the larger, the more compact the regions, the smaller, the more planar.",
    ),
    "fill": ("Fill", "`--fill`: what regions are spread for, as a share of the largest meshlet."),
    "iterations": (
        "Iterations",
        "`--iterations`: most rounds of growing regions and moving their centres.",
    ),
    "weight": (
        "Weight",
        "`--weight`: with the penalty of [the paper](../README.md#the-paper) for full regions, or without, as Choe et al. have it.",
    ),
    "position_bits": ("Position grid", "`-vp`: bits of a position along the longest side."),
}


def measure(path: Path, folder: Path, **options) -> dict:
    """Size, and times on this machine, with some options of compress."""
    output, seconds = folder / "out.glb", []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        gltf_ext.compress(path, output, **options)
        seconds.append(time.perf_counter() - start)
    totals = gltf_ext.inspect(output)["totals"]
    timed = native(
        "decode_speed",
        [compressed.blob for compressed in require_compressed(open_model(output))],
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
One option of `compress` at a time, the others at their defaults. Bits per triangle include everything; compress is the whole call with
files on all threads; decoding is the C++ call for the whole model on one thread, and for one meshlet by its number on average.
{_noise(result)}What the choices are worth that the format makes for everybody is in [choices.md](choices.md).

![Ratio and decode speed over the options](parameters.png)

{chr(10).join(sections)}"""


def _noise(result: dict) -> str:
    """How far the rows of the defaults, which are measured once for each option, lie apart in each model."""

    def span(key: str) -> float:
        """Slowest over fastest, at most."""
        times: dict[str, list[float]] = {}
        for row in result["rows"]:
            if row["value"] == DEFAULTS[row["option"]]:
                times.setdefault(row["model"], []).append(row[key]["median"])
        return max(max(of_model) / min(of_model) for of_model in times.values())

    decode, meshlet, compress = (
        f"{span(key):.2f}" for key in ("decode_seconds", "meshlet_microseconds", "compress_seconds")
    )
    return f"""Times are no more than a hint: the rows of the defaults are the same file, measured anew for each option, and lie up to
{decode} times apart in decoding, {meshlet} in decoding one meshlet and {compress} in compressing. Smaller differences mean nothing.
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


def save_plot(result: dict, path: Path) -> None:
    """Ratio, and decode speed, over each option that is a number."""
    from matplotlib import pyplot

    options = [option for option in VALUES if option != "weight"]
    figure, axes = pyplot.subplots(
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
            if option in ("lambda_", "iterations"):
                axis.set_xscale("log")
                axis.set_xticks(VALUES[option], map(str, VALUES[option]), fontsize=8, rotation=60)
                axis.minorticks_off()
    axes[0, 0].set_ylabel("ratio")
    axes[1, 0].set_ylabel("decode, million triangles per second")
    axes[0, 0].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m bench parameters", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "--models",
        nargs="*",
        default=NAMES,
        help="real models to measure besides the generated one",
    )
    names = parser.parse_args().models
    result = {**origin("bench.parameters", ("gltf-meshlet", "numpy", "matplotlib")), "rows": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_glb([torus(GENERATED)], folder / "torus.glb")
        paths = {"torus": folder / "torus.glb", **{name: MODELS / f"{name}.glb" for name in names}}
        missing = [name for name, path in paths.items() if not path.exists()]
        if missing:
            raise SystemExit(
                f"bench: no {missing[0]}.glb; set GLTF_MESHLET_MODELS to a folder of models, or choose with --models"
            )
        for model, path in paths.items():
            for option, values in VALUES.items():
                for value in values:
                    result["rows"].append(
                        {
                            "model": model,
                            "option": option,
                            "value": value,
                            **measure(path, folder, **{option: value}),
                        }
                    )
                print(f"{model}, {option}", flush=True)
    write_result("parameters", result)
    save_plot(result, ROOT / "docs" / "parameters.png")
    text = report(result)
    (ROOT / "docs" / "parameters.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
