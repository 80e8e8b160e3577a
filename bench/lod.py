"""Levels of detail: size, errors, what one pixel needs, and the time and memory to build them.

Writes docs/lod_results.md. Time is processor time of all threads, each model in a process of its
own. A displaced dragon is that of bench/large_model.py.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import gltf_ext
from bench import lod_mitsuba, lod_peers
from bench.common import (
    call_in_process,
    markdown_table,
    memory_of_process,
    origin_line,
    progress,
    table,
)
from bench.large_model import write_displaced
from bench.models import real_model
from gltf_ext.compression.extension import Compressed
from gltf_ext.compression.primitives import Primitive
from gltf_ext.lod import Cut, LodPrimitive, cut_at_error, cut_at_level, error_of, open_lod
from gltf_ext.lod.cuts import held_bytes
from gltf_ext.lod.samples import nearest_places, sample_surface

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

# Measured once, beside a chain whose errors were known to 6 %.
ACCOUNT = """## Where the rest goes

Dragon x4, displaced, measured once (2026-11-23, after the tables above: errors at points spread by
area). It draws 1.83 times the chain's triangles and loads 4.93 times its bytes; 2.05 and 5.48 with
the builder of the tables above.

Triangles, times those of the chain and of a chain with the cut's own measured error; the allowed
error over that one; kB of clusters that are drawn, of coarser ones, of others in the loaded pages,
of tables, and of the chain:

| pixels | triangles | at its error | slack | drawn | coarser | others | tables | chain |
| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
| 1 | 1.36 | 1.23 | 1.21 | 363 | 344 | 30 | 40 | 259 |
| 2 | 1.09 | 1.20 | 1.28 | 84 | 84 | 0 | 40 | 68 |
| 4 | 2.26 | 1.49 | 1.57 | 47 | 45 | 0 | 40 | 19 |
| 7 | 2.49 | 2.49 | 1.29 | 28 | 26 | 15 | 40 | 10 |

* Locked borders and single groups cost 1.2 to 1.5 times the triangles of a chain of the same
  measured error. Groups of 160 meshlets instead of 96 were better here, but worse on sponza_like.
* The measured error is 0.64 to 0.83 of the allowed one, since each group keeps it and since levels
  are steps. On this model a fifth less error costs 1.6 times the triangles. The chain loses 1.3 to
  1.8 times to its own steps of two.
* Coarser clusters are as many bytes as the drawn ones, since levels shrink by 2.25. Larger steps
  load fewer of them, and draw more triangles. The chain loads none, but serves one error only.
* From two pixels on, tables are a fifth to a third of the bytes. A reader of only the groups that
  it needs, which the format allows, would load 4.21 times the chain's bytes instead of 4.93, and
  3.97 without any tables. MeshletStream begins with the first groups, but reads the rest soon
  after, so bytes here contain all of the tables.

At most 4.0 times the bytes is out of reach on displaced models: at four pixels and more the chain
is a file of 10 to 20 kB, and our tables alone are larger.
"""


# --- in a process of its own ---


def build(input: str, output: str, options: dict) -> dict:
    """Compresses a model. Returns processor time, wall time, peak memory and the report."""
    started = time.perf_counter()
    report = gltf_ext.compress(input, output, **options)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "seconds": time.perf_counter() - started,
        "peak_bytes": memory_of_process("VmHWM"),
        "bytes": report["output_bytes"],
        "triangles": report["totals"]["triangles"],
        "levels": report.get("lod", []),
    }


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


def sweep(path: str, chains: dict) -> list[dict]:
    """Triangles and bytes of the cut and of the chains at each of THRESHOLDS, for the whole scene.

    Bytes are those of the pages that a reader holds, with coarser ones and the tables. Each
    primitive counts once, at the largest scale at which the scene shows it.
    """
    rows = []
    primitives = [(p, chains["chains"].get(_key(p))) for p in open_lod(path)]
    pixel = chains["longest_side"] / PIXELS
    for pixels in THRESHOLDS:
        row = {"pixels": float(pixels), "triangles": 0, "bytes": 0}
        row |= {"chain_triangles": 0, "chain_bytes": 0}
        for primitive, chain in primitives:
            if chain is None:
                continue  # not in the scene
            error = float(pixels) * pixel / chain["scale"]
            triangles, size = needs(primitive, error)
            level = lod_peers.within(chain["levels"], error)
            row["triangles"] += triangles
            row["bytes"] += size
            row["chain_triangles"] += level["triangles"]
            row["chain_bytes"] += level["bytes"]
        rows.append(row)
    return rows


def _key(primitive: LodPrimitive | Compressed) -> str:
    compressed = primitive.compressed if isinstance(primitive, LodPrimitive) else primitive
    return f"{compressed.mesh} {compressed.primitive}"


def needs(primitive: LodPrimitive | Compressed, error: float) -> tuple[int, int]:
    """(triangles, bytes) of a primitive at an error in its units."""
    if not isinstance(primitive, LodPrimitive):
        return primitive.triangle_count, len(primitive.blob)
    tables = primitive.tables
    cut = cut_at_error(tables, error)
    return _drawn(primitive, cut), held_bytes(tables, cut)


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
    distances = np.split(distances_to(finest, np.concatenate(points)), ends)
    of_groups = iter(distances[len(cuts) :])
    back = sample_surface(finest, SAMPLES)
    result = []
    for cut, mesh, level, there in zip(cuts, meshes, replacements, distances):
        here = distances_to(mesh, back)
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


def distances_to(mesh: Primitive, points: np.ndarray) -> np.ndarray:
    return nearest_places(points, mesh)[0]


def nearest_to(replacement: Primitive, points: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """Distances of the points that are nowhere nearer to the level than to the replacement."""
    own = distances_to(replacement, points)
    return own[own <= distances]


def percentile(distances: np.ndarray) -> float:
    return float(np.percentile(distances, WITHIN)) if len(distances) else 0.0


def some_replacements(primitive: LodPrimitive, cut: Cut) -> list[tuple[int, Primitive]]:
    """(group, replacement) of some groups that a cut replaces."""
    refined = primitive.tables.cluster_refined
    replaced = np.unique(refined[cut.drawn & (refined >= 0)])
    chosen = replaced[np.linspace(0, len(replaced) - 1, min(len(replaced), GROUPS)).astype(int)]
    parts = (replace(cut, drawn=cut.drawn & (refined == group)) for group in chosen)
    return [(int(g), primitive.mesh(p)) for g, p in zip(chosen, parts) if p.drawn.any()]


# --- the question ---


def measure(options: argparse.Namespace) -> dict:
    """All models beside discrete chains; the dragons also in Mitsuba."""
    models, sweeps, pictures = {}, {}, {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, source in sources(folder):
            progress(name)
            output = str(folder / f"{source.stem}.lod.glb")
            plain = call_in_process("bench.lod", "build", str(source), output, {})
            lod = call_in_process("bench.lod", "build", str(source), output, {"lod": True})
            models[name] = {"plain": plain, "lod": lod, **describe(output)}
            chains = call_in_process("bench.lod_peers", "measure", str(source))
            sweeps[name] = sweep(output, chains)
            if name.startswith(DISPLACED):
                pictures[name] = {"rows": lod_mitsuba.measure(output)}
    return {"models": models, "sweeps": sweeps, "mitsuba": pictures}


def sources(folder: Path) -> Iterator[tuple[str, Path]]:
    """(name, file) of the real models and of displaced dragons."""
    for name in NAMES:
        yield name, real_model(name)
    for n in CUTS:
        made = write_displaced(real_model(DISPLACED), n, folder / f"{DISPLACED}_{n}.glb")
        yield f"{DISPLACED} x{n * n}, displaced", made


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


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count else ""


def sweep_table(result: dict) -> str:
    def mean(rows: list[dict], values: str) -> str:
        ratios = [row[values] / row[f"chain_{values}"] for row in rows]
        return f"{statistics.geometric_mean(ratios):.2f}"

    def at_one_pixel(rows: list[dict]) -> dict:
        return min(rows, key=lambda row: abs(row["pixels"] - 1.0))

    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda model: model["name"],
        "triangles, times the chain's": lambda model: mean(model["rows"], "triangles"),
        "bytes, times the chain's": lambda model: mean(model["rows"], "bytes"),
        "triangles at one pixel": lambda m: f"{at_one_pixel(m['rows'])['triangles']:,}",
        "of the chain": lambda m: f"{at_one_pixel(m['rows'])['chain_triangles']:,}",
        "bytes at one pixel": lambda m: _megabytes(at_one_pixel(m["rows"])["bytes"]),
        "of the chain ": lambda m: _megabytes(at_one_pixel(m["rows"])["chain_bytes"]),
    }
    models = [{"name": name, "rows": rows} for name, rows in result["sweeps"].items()]
    return table(models, columns)


def mitsuba_table(result: dict) -> str:
    rows = [
        {"name": name, "first": model["rows"][0]["bytes"], **row}
        for name, model in result["mitsuba"].items()
        for row in model["rows"]
    ]
    columns: dict[str, Callable[[dict], str]] = {
        "": lambda row: f"{row['name']}, {row['heading']}",
        "triangles": lambda row: f"{row['triangles']:,}",
        "load": lambda row: f"{row['load']:.1f} s",
        "render": lambda row: f"{row['render']:.1f} s",
        "memory": lambda r: f"{r['bytes'] / 1e6:.1f} MB ({r['bytes'] / r['first']:.2f}x)",
        "compressed": lambda row: _megabytes(row["compressed_bytes"]),
        "cache": lambda row: _megabytes(row["cache_bytes"]),
    }
    return table(rows, columns)


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
        "a reader holds, with coarser ones and the tables.\n\n"
        f"{sweep_table(result)}\n"
        "![Triangles drawn and bytes held over the error in pixels, beside a discrete chain]"
        "(lod_pixels.png)\n\n"
        f"{ACCOUNT}\n"
        "## Mitsuba\n\n"
        f"{lod_mitsuba.SIZE} x {lod_mitsuba.SIZE} pixels, {lod_mitsuba.SPP} samples per pixel, "
        f"`path` of depth {lod_mitsuba.INTEGRATOR['max_depth']}, {lod_mitsuba.VARIANT}, the "
        "model whole in the picture, cache 25 %. Shape: compressed in memory, decoded where rays "
        "meet it. Mesh: an ordinary mesh (`decoded`). Load contains the acceleration structure. "
        "Memory is the growth of the process.\n\n"
        f"{mitsuba_table(result)}\n"
        "## Stated and measured errors\n\n"
        "Of the largest primitive, in its units, at samples of both surfaces.\n\n"
        f"{error_table(result)}"
    )
