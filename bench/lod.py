"""Levels of detail: size, errors, what one pixel needs, and the time and memory to build them.

Writes docs/lod_results.md. Time is processor time of all threads, each model in a process of its
own. A displaced dragon is that of bench/large_model.py. --before compares with the builder of an
earlier commit:

    git worktree add ../before COMMIT && make -C ../before .venv/installed
    ../before/.venv/bin/pip install meshoptimizer==0.2.30a0
    python -m bench lod --before COMMIT ../before/.venv/bin/python
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench import lod_build, lod_errors, lod_peers
from bench.common import (
    call_in_process,
    markdown_table,
    origin_line,
    progress,
    table,
)
from bench.large_model import write_displaced
from bench.models import real_model
from gltf_ext.attributes.extension import Compressed
from gltf_ext.checks.samples import distances_to, sample_surface
from gltf_ext.lod import Cut, LodPrimitive, cut_at_error, cut_at_level, error_of, open_lod
from gltf_ext.lod.cuts import bytes_of_pages, held_bytes, table_bytes
from gltf_ext.sources.primitives import Primitive

PACKAGES = ("gltf-meshlet", "numpy", "meshoptimizer")
NAMES = (
    "dragon",
    "igea",
    "bunny",
    "sponza_like",
    "bistro_like",
    "beast",
    "chinesedragon",
    "engine",
)
DOCUMENT = "lod_results"
DISPLACED = "dragon"
CUTS = (2, 4)  # of each edge
PIXELS = 1000  # of the longest side on the screen
ACCOUNT_OF = f"{DISPLACED} x4, displaced"
ACCOUNT_AT = (1, 2, 4, 8)  # pixels
THRESHOLDS = 0.5 * 16.0 ** (np.arange(25) / 24)  # pixels
SAMPLES = 50_000  # of a level
GROUPS, GROUP_SAMPLES = 20, 5_000  # of a level
WITHIN = 99.9  # percent
# Bytes per input triangle with all levels, as published, or from published file sizes.
PUBLISHED = {
    "Nanite": ("14.4", "Karis, Stubbe, Wihlidal: Nanite, SIGGRAPH 2021, slides on disk size"),
    "vk_lod_clusters": ("15.6", "nvpro-samples, vk_lod_clusters, README: Zorah"),
    "Nexus": ("2.4 to 3.6", "Ponchio, Cignoni: Multiresolution and fast decompression, 2016"),
}

REASONS = """* Borders of groups are locked, and each group keeps the error for itself: a cut draws
  more triangles than a chain of the same measured error, and measures less than it states.
* Coarser clusters are about as many bytes as the drawn ones. Larger steps between levels load
  fewer of them, and draw more triangles. The chain loads none, but serves one error only.
* From two pixels on, tables are a large part of the bytes.
"""


# --- in a process of its own ---


def describe(path: str) -> dict:
    """Size, pages, errors and cuts of a file with levels."""
    primitives = [p for p in open_lod(path) if isinstance(p, LodPrimitive)]
    largest = max(primitives, key=lambda p: p.compressed.triangle_count)
    pages = np.concatenate([p.tables.pages["byteLength"] for p in primitives])
    fine = [p.tables.pages["byteLength"][p.tables.coarse_pages :] for p in primitives]
    triangles = sum(p.compressed.triangle_count for p in primitives)
    top = sum(_drawn(p, cut_at_level(p.tables, 10**6)) for p in primitives)
    stored = sum(len(p.coarse) + len(p.compressed.blob) for p in primitives)
    tables = sum(len(p.tables.to_bytes()) for p in primitives)
    return {
        "page_bytes": stored,
        "table_bytes": tables,
        "bytes_per_triangle": (stored + tables) / triangles,
        "pages": len(pages),
        "largest_page": int(pages.max()),
        "fill": float(np.concatenate(fine).mean() / 32768),
        "top_share": top / triangles,
        "levels": levels(largest),
    }


def _drawn(primitive: LodPrimitive, cut) -> int:
    return int(primitive.cluster_triangles[cut.drawn].sum())


def sweep(files: dict[str, str], chains: dict) -> list[dict]:
    """What cuts of the files and the chains need at each of THRESHOLDS, for the whole scene.

    files: by the begin of the names of their figures. Each primitive counts once, at the largest
    scale at which the scene shows it.
    """
    rows = [Counter({"pixels": float(pixels)}) for pixels in THRESHOLDS]
    scenes = {
        name: {_key(primitive): primitive for primitive in open_lod(path)}
        for name, path in files.items()
    }
    for key, chain in chains["chains"].items():
        for row in rows:
            error = row["pixels"] * chains["longest_side"] / PIXELS / chain["scale"]
            level = lod_peers.within(chain["levels"], error)
            found = {name: needs(scene[key], error) for name, scene in scenes.items()}
            found["chain_"] = {value: level[value] for value in ("triangles", "bytes")}
            for name, values in found.items():
                row.update({f"{name}{value}": size for value, size in values.items()})
    return [dict(row) for row in rows]


def _key(primitive: LodPrimitive | Compressed) -> str:
    compressed = primitive.compressed if isinstance(primitive, LodPrimitive) else primitive
    return f"{compressed.mesh} {compressed.primitive}"


def needs(primitive: LodPrimitive | Compressed, error: float) -> dict[str, int]:
    """Triangles of a primitive at an error in its units, the bytes that a stream holds, pages,
    coarser ones, too, and tables, and those with whole tables."""
    if not isinstance(primitive, LodPrimitive):
        size = len(primitive.blob)
        return {"triangles": primitive.triangle_count, "bytes": size, "whole_bytes": size}
    tables = primitive.tables
    cut = cut_at_error(tables, error)
    return {
        "triangles": _drawn(primitive, cut),
        "bytes": held_bytes(tables, cut),
        "whole_bytes": bytes_of_pages(tables, cut) + table_bytes(tables, len(tables.groups)),
    }


def levels(primitive: LodPrimitive) -> list[dict]:
    """Per level but 0: triangles, the share of samples within the stated error, and the stated
    error of groups over their measured one, median. Distances are measured both ways."""
    tables, finest = primitive.tables, primitive.compressed.decode()
    cuts = [cut_at_level(tables, level) for level in range(1, tables.level_count)]
    meshes = [primitive.mesh(cut) for cut in cuts]
    replacements = [some_replacements(primitive, cut) for cut in cuts]
    points = [sample_surface(mesh, SAMPLES) for mesh in meshes]
    points += [sample_surface(m, GROUP_SAMPLES) for level in replacements for _, m in level]
    # One call, since it builds a tree of the finest level.
    ends = np.cumsum([len(own) for own in points])[:-1]
    distances = np.split(distances_to(np.concatenate(points), finest), ends)
    of_groups = iter(distances[len(cuts) :])
    back = sample_surface(finest, SAMPLES)
    result = []
    for cut, mesh, level, there in zip(cuts, meshes, replacements, distances):
        here = distances_to(back, mesh)
        both = np.concatenate([there, here])
        stated = error_of(tables, cut)
        ratios = {"one_way": [], "both_ways": []}
        for group, replacement in level:
            error = float(tables.groups["error"][group])
            to_finest = percentile(next(of_groups))
            from_finest = percentile(nearest_to(replacement, back, here))
            ratios["one_way"].append(error / to_finest if to_finest else np.inf)
            measured = max(to_finest, from_finest)
            ratios["both_ways"].append(error / measured if measured else np.inf)
        result.append(
            {
                "triangles": len(mesh.indices),
                "stated": stated,
                "measured": percentile(both),
                "within": float((both <= stated).mean()),
                "stated_over_measured": {k: float(np.median(v)) for k, v in ratios.items()},
            }
        )
    return result


def nearest_to(replacement: Primitive, points: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """Distances of the points that are nowhere nearer to the level than to the replacement."""
    own = distances_to(points, replacement)
    return own[own <= distances]


def percentile(distances: np.ndarray) -> float:
    return float(np.percentile(distances, WITHIN)) if len(distances) else 0.0


def some_replacements(primitive: LodPrimitive, cut: Cut) -> list[tuple[int, Primitive]]:
    """(group, replacement) of some groups that a cut replaces."""
    finer = primitive.tables.finer_group
    replaced = np.unique(finer[cut.drawn & (finer >= 0)])
    chosen = replaced[np.linspace(0, len(replaced) - 1, min(len(replaced), GROUPS)).astype(int)]
    parts = (replace(cut, drawn=cut.drawn & (finer == group)) for group in chosen)
    return [(int(g), primitive.mesh(p)) for g, p in zip(chosen, parts) if p.drawn.any()]


# --- the question ---


def add_options(parser: argparse.ArgumentParser) -> None:
    lod_build.add_before(parser)


def check(options: argparse.Namespace) -> None:
    """Ends the program if --before names a Python with the package of this commit."""
    if options.before:
        lod_build.require_other_package("lod", options.before[1])


def measure(options: argparse.Namespace) -> dict:
    """All models beside discrete chains."""
    commit, python = options.before or (None, None)
    cuts = dict.fromkeys(NAMES, 1)
    cuts |= {f"{DISPLACED} x{n * n}, displaced": n for n in CUTS}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        # The largest ones, which come last, begin first.
        tasks = {
            name: pool.submit(call_in_process, "bench.lod", "of_model", name, n, folder, python)
            for name, n in reversed(cuts.items())
        }
        found = {name: tasks[name].result() for name in cuts}
        sweeps = {name: model.pop("sweep") for name, model in found.items()}
    return {"before": commit, "models": found, "sweeps": sweeps}


def of_model(name: str, n: int, folder: str, before: str | None) -> dict:
    """A model with and without levels, its cuts beside the chain's and the earlier builder's.

    n: into how many parts each edge is cut. before: the Python that has the earlier builder.
    """
    progress(name)
    source = real_model(name.partition(" ")[0])
    if n > 1:
        source = write_displaced(source, n, Path(folder, f"{name}.glb"))
    output, files = str(Path(folder, f"{name}.lod.glb")), {}

    def built(output: str, options: dict, **process: str) -> dict:
        names = "bench.lod_build", "build"
        return call_in_process(*names, str(source), output, options, **process)

    model = {"plain": built(output, {}), "lod": built(output, {"lod": True})}
    files[""] = output
    if before:
        files["before_"] = str(Path(folder, f"{name}.before.glb"))
        model["before"] = built(files["before_"], {"lod": True}, python=before)
    chains = call_in_process("bench.lod_peers", "measure", str(source))
    held = call_in_process("bench.lod_errors", "measure", output)
    return {**model, **describe(output), "held": held, "sweep": sweep(files, chains)}


def size_table(result: dict) -> str:
    def peak(model: dict) -> str:
        return f"{model['lod']['peak_bytes'] / model['lod']['triangles']:.0f}"

    def plain_bytes(model: dict) -> str:
        return f"{model['plain']['bytes'] / model['plain']['triangles']:.2f}"

    def slower(model: dict) -> str:
        return f"{model['lod']['cpu_seconds'] / model['plain']['cpu_seconds']:.1f}"

    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda model: model["name"],
        "triangles": lambda model: f"{model['lod']['triangles']:,}",
        "bytes per triangle, level 0 alone": plain_bytes,
        "with levels": lambda model: f"{model['bytes_per_triangle']:.2f}",
        "top level": lambda model: f"{100 * model['top_share']:.2f} %",
        "pages full": lambda model: f"{100 * model['fill']:.0f} %",
        "whole file": lambda model: _megabytes(model["lod"]["bytes"]),
        "over level 0 alone": lambda m: f"{m['lod']['bytes'] / m['plain']['bytes']:.2f}",
        "processor time": lambda model: f"{model['lod']['cpu_seconds']:.1f} s",
        "over that without levels": slower,
        "peak bytes per triangle": peak,
    }
    return table(({"name": name, **model} for name, model in result["models"].items()), columns)


def error_table(result: dict) -> str:
    levels = [
        {"model": name, "level": number, **level}
        for name, model in result["models"].items()
        for number, level in enumerate(model["levels"], start=1)
    ]
    groups = "stated_over_measured"
    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda level: level["model"],
        "level": lambda level: str(level["level"]),
        "triangles": lambda level: f"{level['triangles']:,}",
        "stated error": lambda level: f"{level['stated']:.3g}",
        "measured, 99.9 %": lambda level: f"{level['measured']:.3g}",
        "samples within": lambda level: f"{100 * level['within']:.2f} %",
        "stated over measured, median of groups": lambda level: f"{level[groups]['both_ways']:.2f}",
        "from the level to level 0 alone": lambda level: f"{level[groups]['one_way']:.2f}",
    }
    return table(levels, columns)


def held_table(result: dict) -> str:
    """Whether stated errors hold, for all primitives."""

    def below(shares: list[list[float]]) -> str:
        return f"{sum(sum(pair) / 2 < WITHIN / 100 for pair in shares)} of {len(shares)}"

    def below_on_one(shares: list[list[float]]) -> str:
        return f"{sum(min(pair) < WITHIN / 100 for pair in shares)}"

    def least_on_one(shares: list[list[float]]) -> str:
        return f"{100 * min(map(min, shares)):.2f} %"

    columns: dict[str, Callable[[dict], str]] = {"model": lambda model: model["name"]}
    for kind, title in (("levels", "levels"), ("cuts", "random cuts")):
        for text, value in (
            (f"{title} below {WITHIN} %, both surfaces together", below),
            ("on one of them", below_on_one),
            ("least on one", least_on_one),
        ):
            columns[text + " " * (text in columns)] = lambda model, kind=kind, value=value: value(
                model["held"][kind]
            )
    return table([{"name": name, **model} for name, model in result["models"].items()], columns)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count else ""


def over(rows: list[dict], values: str, others: str) -> list[float]:
    """Ratios of two figures at each threshold."""
    return [row[values] / row[others] for row in rows]


def mean_over(rows: list[dict], values: str, others: str) -> str:
    return f"{statistics.geometric_mean(over(rows, values, others)):.2f}"


def sweep_table(result: dict) -> str:
    def at_one_pixel(rows: list[dict]) -> dict:
        return min(rows, key=lambda row: abs(row["pixels"] - 1.0))

    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda model: model["name"],
        "triangles, times the chain's": lambda m: mean_over(
            m["rows"], "triangles", "chain_triangles"
        ),
        "bytes, times the chain's": lambda m: mean_over(m["rows"], "bytes", "chain_bytes"),
        "with whole tables": lambda m: mean_over(m["rows"], "whole_bytes", "chain_bytes"),
        "triangles at one pixel": lambda m: f"{at_one_pixel(m['rows'])['triangles']:,}",
        "of the chain": lambda m: f"{at_one_pixel(m['rows'])['chain_triangles']:,}",
        "bytes at one pixel": lambda m: _megabytes(at_one_pixel(m["rows"])["bytes"]),
        "of the chain ": lambda m: _megabytes(at_one_pixel(m["rows"])["chain_bytes"]),
    }
    models = [{"name": name, "rows": rows} for name, rows in result["sweeps"].items()]
    return table(models, columns)


def before_section(result: dict) -> str:
    """The earlier builder's figures; nothing if it was not measured."""
    if not result.get("before"):
        return ""
    columns: dict[str, Callable[[dict], str]] = {"model": lambda model: model["name"]}

    def add_comparison(values: str) -> None:
        before, chain = f"before_{values}", f"chain_{values}"
        columns[f"{values}, times the chain's, before"] = lambda m: mean_over(
            m["rows"], before, chain
        )
        columns[f"{values}, now"] = lambda m: mean_over(m["rows"], values, chain)
        columns[f"{values}, now over before, worst error"] = lambda m: (
            f"{max(over(m['rows'], values, before)):.2f}"
        )

    def add_cost(heading: str, value: str) -> None:
        columns[heading] = lambda m: f"{m['lod'][value] / m['before'][value]:.2f}"

    add_comparison("triangles")
    add_comparison("bytes")
    add_cost("file, now over before", "bytes")
    add_cost("processor time", "cpu_seconds")
    add_cost("peak memory", "peak_bytes")
    models = [
        {"name": name, "rows": result["sweeps"][name], **model}
        for name, model in result["models"].items()
    ]
    return (
        f"## Beside the builder of commit {result['before']}\n\n"
        "Measured in the same run, with the same models and chains. Worst error: the one of the "
        f"{len(THRESHOLDS)} where the ratio is largest.\n\n"
        f"{table(models, columns)}\n"
    )


def account(result: dict) -> str:
    """What the bytes of a displaced model are, and why they are more than the chain's."""
    tables = result["models"][ACCOUNT_OF]["table_bytes"]
    sweep = result["sweeps"][ACCOUNT_OF]
    rows = [min(sweep, key=lambda row: abs(row["pixels"] - pixels)) for pixels in ACCOUNT_AT]
    columns: dict[str, Callable[[dict], str]] = {
        "pixels": lambda row: f"{row['pixels']:g}",
        "triangles, times the chain's": lambda r: f"{r['triangles'] / r['chain_triangles']:.2f}",
        "pages, kB": lambda row: f"{(row['whole_bytes'] - tables) / 1e3:.0f}",
        "tables, kB": lambda row: f"{(row['bytes'] - row['whole_bytes'] + tables) / 1e3:.0f}",
        "of all tables, kB": lambda row: f"{tables / 1e3:.0f}",
        "chain, kB": lambda row: f"{row['chain_bytes'] / 1e3:.0f}",
    }
    return f"## Where the rest goes\n\n{ACCOUNT_OF}:\n\n{table(rows, columns)}\n{REASONS}\n"


def report(result: dict) -> str:
    """docs/lod_results.md."""
    published = [[name, *value_and_source] for name, value_and_source in PUBLISHED.items()]
    return (
        "# Levels of detail: results\n\n"
        f"{origin_line(result)}\n"
        "All bytes of pages and tables, at 12 bits for positions, 8 for normals and 12 for texture "
        "coordinates. Processor time counts all threads.\n\n"
        f"{size_table(result)}\n"
        "Published bytes per input triangle of others, with all levels:\n\n"
        f"{markdown_table(['', 'bytes per triangle', 'source'], published)}\n"
        "## Beside discrete chains\n\n"
        "A discrete chain is whole primitives by meshoptimizer, each with half the triangles of "
        "the one before, in files of their own; of each primitive one is loaded, by its "
        f"*measured* error ({WITHIN} % of samples). Ours goes by the stated error, which is "
        "larger, and also serves views in which some of the model is nearer than the rest. "
        f"Geometric means over {len(THRESHOLDS)} errors from {THRESHOLDS[0]:g} to "
        f"{THRESHOLDS[-1]:g} pixels where the longest side of the scene has {PIXELS} pixels: at "
        "one error it matters where the steps of either fall. Bytes are those of all pages that "
        "MeshletStream holds, with coarser ones, and of the tables. Groups are stored from coarse "
        "to fine: it reads them in parts, up to the next finer ones of those that are active. "
        "Tables within the first 32 kB of a file are whole.\n\n"
        f"{sweep_table(result)}\n"
        "![Triangles drawn and bytes held over the error in pixels, beside a discrete chain]"
        "(lod_pixels.png)\n\n"
        f"{before_section(result)}"
        f"{account(result)}"
        "## Stated and measured errors\n\n"
        f"All levels of all primitives, and {lod_errors.CUTS} random cuts: for eyes inside and "
        "outside of the model, about half of them with some of the pages only. Shares of "
        f"{lod_errors.SAMPLES:,} samples of level 0 and as many of the cut that lie within its "
        "stated error.\n\n"
        f"{held_table(result)}\n"
        "Of the largest primitive, in its units, at samples of both surfaces.\n\n"
        f"{error_table(result)}"
    )
