"""Levels of detail: size, errors, what one pixel needs, and the time and memory to build them.

Writes docs/lod_results.md. Time is processor time of all threads, each model in a process of its
own. A displaced dragon is the dragon with each triangle cut into four, once or twice, and its
vertices moved along their normals by noise.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from trimesh import Trimesh

import gltf_ext
from bench.common import (
    Question,
    call_in_process,
    markdown_table,
    origin_line,
    progress,
    write_page,
)
from bench.models import real_model
from gltf_ext import _codec
from gltf_ext.lod import Cut, LodPrimitive, cut_at_error, cut_at_level, error_of, open_lod
from gltf_ext.lod.reports import sample_surface

NAMES = ("dragon", "igea", "bunny", "sponza_like", "bistro_like")
DISPLACED = "dragon"
NOISE = 0.0004  # of the longest side: about a third of an edge of the dragon's
PIXELS = 1000  # of the longest side on the screen
SAMPLES = 50_000  # of a level
GROUPS, GROUP_SAMPLES = 20, 5_000  # of a level
WITHIN = 99.9  # percent
# Bytes per input triangle with all levels, as published, or from published file sizes.
PUBLISHED = {
    "Nanite": (14.4, "Karis, Stubbe, Wihlidal: Nanite, SIGGRAPH 2021, slides on disk size"),
    "vk_lod_clusters": (15.6, "nvpro-samples, vk_lod_clusters, README: Zorah"),
    "Nexus": (2.4, "Ponchio, Cignoni: Multiresolution and fast decompression, 2016; to 3.6"),
}


# --- models ---


def displaced(path: Path, rounds: int, output: Path) -> Path:
    """Writes the file's first primitive with 4^rounds times its triangles and noise."""
    source = gltf_ext.load(path)[0]
    points = source.attributes["POSITION"].astype(np.float64)
    triangles = source.indices.astype(np.int64)
    size = float(np.ptp(points, axis=0).max())
    for _ in range(rounds):
        points, triangles = cut_into_four(points, triangles)
    normals = vertex_normals(points, triangles)
    heights = np.random.default_rng(1).normal(size=len(points)) * NOISE * size / 2**rounds
    points += normals * heights[:, None]
    mesh = Trimesh(
        points, triangles, vertex_normals=vertex_normals(points, triangles), process=False
    )
    output.write_bytes(mesh.export(file_type="glb", include_normals=True))
    return output


def cut_into_four(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle as four, with new vertices in the middles of the edges."""
    starts, ends = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    keys = np.minimum(starts, ends) * len(points) + np.maximum(starts, ends)
    edges, middle = np.unique(keys, return_inverse=True)
    middles = (points[edges // len(points)] + points[edges % len(points)]) / 2
    ab, bc, ca = (middle.reshape(-1, 3) + len(points)).T
    a, b, c = triangles.T
    # The four stay neighbours in the list.
    pieces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([points, middles]), pieces.reshape(-1, 3)


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """float64[V, 3]: unit normals, or zero."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    faces = np.cross(b - a, c - a)
    sums = np.stack(
        [
            sum(np.bincount(triangles[:, k], faces[:, axis], len(points)) for k in range(3))
            for axis in range(3)
        ],
        axis=1,
    )
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return sums / np.where(length > 0.0, length, 1.0)


# --- in a process of its own ---


def build(input: str, output: str, with_levels: bool) -> dict:
    """Compresses a model. Returns processor time, wall time, peak memory and the report."""
    started = time.perf_counter()
    report = gltf_ext.compress(input, output, lod=with_levels)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "seconds": time.perf_counter() - started,
        "peak_bytes": peak_memory(),
        "bytes": report["output_bytes"],
        "triangles": report["totals"]["triangles"],
        "levels": report.get("lod", []),
    }


def peak_memory() -> int:
    """Bytes. ru_maxrss would count those of the process that started this one."""
    lines = Path("/proc/self/status").read_text().splitlines()
    (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM:"))
    return 1024 * int(peak)


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
        "one_pixel": one_pixel(largest),
        "levels": stated_over_measured(largest),
    }


def _drawn(primitive: LodPrimitive, cut) -> int:
    return int(primitive.cluster_triangles[cut.drawn].sum())


def one_pixel(primitive: LodPrimitive) -> dict:
    """The cut with one pixel of error where the longest side has PIXELS."""
    tables = primitive.tables
    points = primitive.compressed.decode().attributes["POSITION"]
    cut = cut_at_error(tables, float(np.ptp(points, axis=0).max()) / PIXELS)
    needed = int(tables.pages["byteLength"][cut.loaded].sum()) + len(tables.to_bytes())
    return {"triangles": _drawn(primitive, cut), "bytes": needed, "pages": len(cut.loaded)}


def stated_over_measured(primitive: LodPrimitive) -> list[dict]:
    """Per level but 0: triangles, the share of samples within the stated error, and the stated
    error of groups over their measured one, median."""
    tables, finest = primitive.tables, primitive.compressed.decode()
    cuts = [cut_at_level(tables, level) for level in range(1, tables.level_count)]
    meshes = [primitive.mesh(cut) for cut in cuts]
    sampled = [groups_sampled(primitive, cut) for cut in cuts]
    points = [sample_surface(mesh, SAMPLES) for mesh in meshes]
    points += [part for parts in sampled for _, part in parts]
    distances = np.split(
        _codec.surface_distances(
            np.concatenate(points), finest.attributes["POSITION"], finest.indices
        ),
        np.cumsum([len(part) for part in points])[:-1],
    )
    of_groups = iter(distances[len(cuts) :])
    back = sample_surface(finest, SAMPLES)
    result = []
    for cut, mesh, parts, there in zip(cuts, meshes, sampled, distances):
        ratios = []
        for group, _ in parts:
            measured = float(np.percentile(next(of_groups), WITHIN))
            if measured > 0.0:
                ratios.append(float(tables.groups["error"][group]) / measured)
        here = _codec.surface_distances(back, mesh.attributes["POSITION"], mesh.indices)
        both = np.concatenate([there, here])
        stated = error_of(tables, cut)
        result.append(
            {
                "triangles": len(mesh.indices),
                "stated": stated,
                "measured": float(np.percentile(both, WITHIN)),
                "within": float((both <= stated).mean()),
                "stated_over_measured": float(np.median(ratios)) if ratios else None,
            }
        )
    return result


def groups_sampled(primitive: LodPrimitive, cut: Cut) -> list[tuple[int, np.ndarray]]:
    """(group, points on its replacement) of some groups that a cut replaces."""
    refined = primitive.tables.cluster_refined
    replaced = np.unique(refined[cut.drawn & (refined >= 0)])
    chosen = replaced[np.linspace(0, len(replaced) - 1, min(len(replaced), GROUPS)).astype(int)]
    parts = (replace(cut, drawn=cut.drawn & (refined == group)) for group in chosen)
    return [
        (int(group), sample_surface(primitive.mesh(part), GROUP_SAMPLES))
        for group, part in zip(chosen, parts)
        if part.drawn.any()
    ]


# --- the question ---


def measure(options: argparse.Namespace) -> dict:
    models = {}
    with tempfile.TemporaryDirectory() as folder:
        paths = {name: real_model(name) for name in options.models}
        for rounds in options.displaced:
            name = f"{DISPLACED} x{4**rounds}, displaced"
            progress(f"making {name}")
            paths[name] = displaced(real_model(DISPLACED), rounds, Path(folder) / f"{rounds}.glb")
        for name, path in paths.items():
            progress(name)
            output = str(Path(folder) / "out.glb")
            plain = call_in_process("bench.lod", "build", str(path), output, False)
            lod = call_in_process("bench.lod", "build", str(path), output, True)
            models[name] = {"plain": plain, "lod": lod, **describe(output)}
    return {"published": PUBLISHED, "models": models}


def table(result: dict) -> str:
    rows = []
    for name, model in result["models"].items():
        plain, lod, cut = model["plain"], model["lod"], model["one_pixel"]
        rows.append(
            [
                name,
                f"{lod['triangles']:,}",
                f"{plain['bytes'] / plain['triangles']:.2f}",
                f"{model['bytes_per_triangle']:.2f}",
                f"{100 * model['top_share']:.2f} %",
                f"{100 * model['fill']:.0f} %",
                f"{cut['triangles']:,}",
                f"{cut['bytes'] / 1e6:.2f} MB",
                f"{lod['bytes'] / 1e6:.2f} MB",
                f"{lod['cpu_seconds']:.1f} s",
                f"{lod['cpu_seconds'] / plain['cpu_seconds']:.1f}",
                f"{lod['peak_bytes'] / lod['triangles']:.0f}",
            ]
        )
    headings = [
        "model", "triangles", "bytes per triangle, level 0 alone", "with levels", "top level",
        "pages full", "triangles at one pixel", "bytes at one pixel", "whole file",
        "processor time", "over that without levels", "peak bytes per triangle",
    ]  # fmt: skip
    return markdown_table(headings, rows)


def error_table(result: dict) -> str:
    rows = [
        [
            name,
            str(number),
            f"{level['triangles']:,}",
            f"{level['stated']:.3g}",
            f"{level['measured']:.3g}",
            f"{100 * level['within']:.2f} %",
            "" if level["stated_over_measured"] is None else f"{level['stated_over_measured']:.2f}",
        ]
        for name, model in result["models"].items()
        for number, level in enumerate(model["levels"], start=1)
    ]
    headings = [
        "model", "level", "triangles", "stated error", "measured, 99.9 %", "samples within",
        "stated over measured, median of groups",
    ]  # fmt: skip
    return markdown_table(headings, rows)


def write_pages(result: dict) -> list[Path]:
    published = [
        [name, f"{value:.1f}", source] for name, (value, source) in result["published"].items()
    ]
    text = (
        "# Levels of detail: results\n\n"
        f"{origin_line(result)}\n"
        "All bytes of pages and tables, at 12 bits for positions, 8 for normals and 12 for texture "
        f"coordinates. One pixel: the cut whose error is one pixel where the longest side has "
        f"{PIXELS} pixels; the bytes are those of its pages, with coarser ones and the tables. "
        "Processor time counts all threads.\n\n"
        f"{table(result)}\n"
        "Published bytes per input triangle of others, with all levels:\n\n"
        f"{markdown_table(['', 'bytes per triangle', 'source'], published)}\n"
        "## Stated and measured errors\n\n"
        "Of the largest primitive, in its units, at samples of both surfaces.\n\n"
        f"{error_table(result)}"
    )
    return [write_page("lod_results", text)]


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--models", nargs="*", default=NAMES, metavar="NAME", help="real models")
    parser.add_argument(
        "--displaced",
        nargs="*",
        type=int,
        default=[1, 2],
        metavar="N",
        help="rounds of cutting the dragon's triangles into four (default: 1 2)",
    )


QUESTION = Question(
    "lod", __doc__ or "", measure, table, write_pages, ("gltf-meshlet", "numpy", "meshoptimizer"),
    add_options,
)  # fmt: skip


def main() -> None:
    QUESTION.run()
