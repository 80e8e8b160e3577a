"""Ray tracing with Mitsuba: time and memory of compressed shapes beside Mitsuba's own mesh.

Shapes with resident triangles (`accel` = `triangles`), and with caches of several sizes.

Writes the tables in docs/mitsuba.md and docs/mitsuba.png if all models and variants are measured;
otherwise only prints.

Each model and variant runs alone, in a process of its own. Times are processor time of all threads,
of rendering with a warm cache and compiled kernels; the cost of loading, building and the first
render is reported separately. Each round renders Mitsuba's own mesh and all kinds of shapes, so
that a ratio compares two renders shortly after each other; the median of the rounds counts. Renders
without a cache are slow: they and the mesh they are compared with get fewer samples. Memory is the
growth of the process from before a scene is loaded to after it was rendered.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import gltf_ext
from bench import common
from bench.common import BITS, call_in_process, memory_of_process, progress
from bench.models import add_model_names, real_model

PACKAGES = ("mitsuba", "drjit", "numpy")
PARTS = ("models",)
MODELS = ("bunny", "sponza_like", "dragon")
VARIANTS = ("scalar_rgb", "llvm_ad_rgb")
NATIVE, TRIANGLES = "native mesh", "triangles"
CACHES = {f"cache {fraction:.0%}": fraction for fraction in (1.0, 0.25, 0.1, 0.0)}
KINDS = (NATIVE, TRIANGLES, *CACHES)
STARTED = (NATIVE, TRIANGLES, "cache 25%")  # whose start is shown
WIDTH, HEIGHT = 1280, 720
SPP = 16  # samples per pixel
UNCACHED_SPP = 2  # without a cache, which is slow
REPEATS = 3  # rounds of timing; their median counts
INTEGRATORS = {"depth": {"type": "depth"}, "path": {"type": "path", "max_depth": 3}}
VIEW = (0.3, 0.4, 1.0)
WARM_SPP = 2
ATTRIBUTES = ("POSITION", "NORMAL", "TEXCOORD_0")  # of Mitsuba's own mesh
BEFORE_SHARES = "0948bb5"  # the commit of a result from before caches gave shares back


def measure(options: argparse.Namespace) -> dict:
    """All models and variants."""
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        for model in options.models:
            path = str(_prepared(model, Path(folder)))
            for variant in VARIANTS:
                for task, function in (("time", "times"), ("memory", "memory")):
                    progress(f"{model}, {variant}: {task}")
                    rows = call_in_process("bench.mitsuba", function, path, variant)
                    run = {"model": model, "variant": variant, "task": task, "rows": rows}
                    runs.append(run)
    return {"width": WIDTH, "height": HEIGHT, "spp": SPP, "repeats": REPEATS, "runs": runs}


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, MODELS)


def _prepared(model: str, folder: Path) -> Path:
    """Compresses and decompresses the model; returns the compressed file."""
    compressed = folder / f"{model}.glb"
    gltf_ext.compress(real_model(model), compressed, **BITS)
    gltf_ext.decompress(compressed, folder / f"{model}.plain.glb")
    return compressed


# --- in a process of its own ---


def _use(variant: str) -> None:
    import mitsuba as mi

    mi.set_variant(variant)
    import mitsuba_plugin  # noqa: F401  registers the shape


def _shapes(path: str, kind: str) -> dict:
    """Mitsuba's own meshes, or compressed shapes; those with a cache share it."""
    if kind == NATIVE:
        from mitsuba_plugin.scene import ordinary_mesh

        return {
            f"shape_{i}": ordinary_mesh("native", p.indices, *map(p.attributes.get, ATTRIBUTES))
            for i, p in enumerate(gltf_ext.load(path.replace(".glb", ".plain.glb")))
        }
    options: dict = {"accel": "triangles"}
    if kind in CACHES:
        options = {"accel": "cache", "cache": CACHES[kind], "cache_group": f"bench {kind}"}
    return {
        f"shape_{i}": {
            "type": "meshlet_edgebreaker",
            "filename": path,
            "mesh": m,
            "primitive": p,
            **options,
        }
        for i, (m, p) in enumerate(_places(path))
    }


def _places(path: str) -> list[tuple[int, int]]:
    return [(d.mesh, d.primitive) for d in gltf_ext.decoders(path)]


def _scene(shapes: dict, integrator: dict, size: tuple[int, int]):
    import mitsuba as mi

    loaded = {k: mi.load_dict(s) if isinstance(s, dict) else s for k, s in shapes.items()}
    box = loaded[next(iter(loaded))].bbox()
    for shape in loaded.values():
        box.expand(shape.bbox())
    center, extents = np.array(box.center()).ravel(), np.array(box.extents()).ravel()
    origin = center + np.array(VIEW) * np.linalg.norm(extents)
    film = {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "box"}}
    sensor = {
        "type": "perspective",
        "fov": 45,
        "fov_axis": "larger",
        "to_world": mi.ScalarTransform4f().look_at(list(origin), list(center), [0, 1, 0]),
        "film": film,
        "sampler": {"type": "independent", "sample_count": 1},
    }
    light = {"type": "constant"}
    scene = {"type": "scene", **loaded, "integrator": integrator, "light": light, "sensor": sensor}
    return mi.load_dict(scene)


def _render(scene, spp: int, seed: int) -> float:
    import mitsuba as mi

    start = time.process_time()
    np.array(mi.render(scene, spp=spp, seed=seed))
    return time.process_time() - start


def times(path: str, variant: str) -> list[dict]:
    """A row per kind: seconds, ratios to the native mesh's seconds, the cache's hits."""
    _use(variant)
    rows, shapes = [], []
    for kind in KINDS:
        start = time.process_time()
        shapes.append(_shapes(path, kind))
        rows.append({"kind": kind, "load": time.process_time() - start})
    for name in INTEGRATORS:
        _time_rounds(name, [_built(name, s, row) for s, row in zip(shapes, rows)], rows)
    return rows


def _built(name: str, shapes: dict, row: dict):
    """A scene with a warm cache and compiled kernels; adds the seconds this took to the row."""
    start = time.process_time()
    scene = _scene(shapes, INTEGRATORS[name], (WIDTH, HEIGHT))
    row[f"{name}_build"] = time.process_time() - start
    cold = _render(scene, 1, 0)
    row[f"{name}_first"] = cold - _render(scene, 1, 0)
    if CACHES.get(row["kind"]):
        _render(scene, WARM_SPP, 1)
    return scene


def _time_rounds(name: str, scenes: list, rows: list[dict]) -> None:
    """Renders all scenes in turns; adds their times to the rows. The first is the native mesh."""
    import mitsuba_plugin

    seconds: list[list[float]] = [[] for _ in rows]
    ratios: list[list[float]] = [[] for _ in rows]
    mitsuba_plugin.statistics(reset=True)
    for seed in range(REPEATS):
        progress(f"  {name}, round {seed + 1} of {REPEATS}")
        native = {spp: _render(scenes[0], spp, seed) for spp in (SPP, UNCACHED_SPP)}
        seconds[0].append(native[SPP])
        for row, scene, own, to_native in list(zip(rows, scenes, seconds, ratios))[1:]:
            spp = SPP if CACHES.get(row["kind"], 1.0) else UNCACHED_SPP
            time_taken = _render(scene, spp, seed)
            own.append(time_taken * SPP / spp)
            to_native.append(time_taken / native[spp])
    for row, scene, own, to_native in zip(rows, scenes, seconds, ratios):
        row[name] = statistics.median(own)
        if to_native:
            row[f"{name}_ratio"] = statistics.median(to_native)
            row[f"{name}_ratio_range"] = [min(to_native), max(to_native)]
            figures = mitsuba_plugin.statistics(scene)
            row[f"{name}_hit_share"] = figures["hits"] / max(figures["hits"] + figures["misses"], 1)


def memory(path: str, variant: str) -> list[dict]:
    """A row per kind. A process per scene: leftovers of one do not count for the next."""
    rows = []
    for kind in KINDS:
        # The first of each kind may have to compile kernels, which Dr.Jit keeps on disk.
        if kind not in CACHES or kind == next(iter(CACHES)):
            call_in_process("bench.mitsuba", "growth", path, variant, kind)
        rows.append(
            {"kind": kind, **call_in_process("bench.mitsuba", "growth", path, variant, kind)}
        )
    return rows


def growth(path: str, variant: str, kind: str) -> dict:
    """Bytes by which this process grows when it loads and renders a scene, and statistics."""
    _use(variant)
    import mitsuba as mi

    import mitsuba_plugin

    size = (320, 180)
    warm = {"ball": {"type": "sphere"}, "cube": mi.load_dict({"type": "cube"})}
    _render(_scene(warm, INTEGRATORS["path"], size), 1, 0)
    _places(path)  # leftovers of reading glTF do not count for the scene
    before = resident_bytes()
    shapes = _shapes(path, kind)
    scene = _scene(shapes, INTEGRATORS["path"], size)
    for seed in range(4):
        _render(scene, 4, seed)
    after = resident_bytes()
    figures = mitsuba_plugin.statistics(scene) if kind != NATIVE else {}
    return {"bytes": after - before, **figures}


def resident_bytes() -> int:
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return memory_of_process("VmRSS")


# --- report ---

Row = tuple[str, str, str, dict, dict]  # model, variant, kind, times, memory
Cell = Callable[[Row], str]


def kind_of(row: dict) -> str:
    """Older results have shares of a cache in place of kinds."""
    fraction = row.get("fraction")
    return row.get("kind") or (NATIVE if fraction is None else f"cache {fraction:.0%}")


def _rows(result: dict) -> Iterator[Row]:
    """(model, variant, kind, row of times, row of memory); the native mesh first."""
    runs = {(r["model"], r["variant"], r["task"]): r["rows"] for r in result["runs"]}
    for model, variant in dict.fromkeys((r["model"], r["variant"]) for r in result["runs"]):
        # zip drops the times of another policy of eviction, which older results have at the end.
        for timed, grown in zip(runs[model, variant, "time"], runs[model, variant, "memory"]):
            yield model, variant, kind_of(timed), timed, grown


def _name(row: Row) -> str:
    return ", ".join(row[:3])


def _table(result: dict) -> str:
    native = {row[:2]: row[4]["bytes"] for row in _rows(result) if row[2] == NATIVE}

    def time_of(name: str) -> Cell:
        def cell(row: Row) -> str:
            times, seconds = row[3], f"{row[3][name]:.2f} s"
            if row[2] == NATIVE:
                return seconds
            low, high = times[f"{name}_ratio_range"]
            return f"{seconds} ({times[f'{name}_ratio']:.2f}x, {low:.2f} to {high:.2f})"

        return cell

    def memory(row: Row) -> str:
        return f"{row[4]['bytes'] / 1e6:.1f} MB ({row[4]['bytes'] / native[row[:2]]:.2f}x)"

    columns: dict[str, Cell] = {
        "": _name,
        **{name: time_of(name) for name in INTEGRATORS},
        "memory": memory,
        "hits (path)": lambda row: f"{row[3]['path_hit_share']:.1%}" if "cache" in row[2] else "",
    }
    return common.table(_rows(result), columns)


MEMORY_USES = {
    "blocks": "block_bytes",
    "compressed": "compressed_bytes",
    "boxes, tables": "table_bytes",
    "cache": "resident_bytes",
    "decoders": "working_bytes",
}


def _used(row: Row, use: str) -> int:
    """Bytes of a use. Resident shapes have given their compressed bytes and decoders back."""
    if row[2] == TRIANGLES and use != "block_bytes":
        return 0
    return int(row[4].get(use, 0))


def _memory_table(result: dict) -> str:
    """The memory of the compressed scenes by use; the rest is Embree's and Mitsuba's."""

    def megabytes(*keys: str) -> Cell:
        return lambda row: f"{sum(_used(row, key) for key in keys) / 1e6:.2f} MB"

    def rest(row: Row) -> str:
        known = sum(_used(row, key) for key in MEMORY_USES.values())
        return f"{(row[4]['bytes'] - known) / 1e6:.2f} MB"

    rows = [row for row in _rows(result) if row[2] != NATIVE]
    uses = {
        use: megabytes(key)
        for use, key in MEMORY_USES.items()
        if any(key in row[4] for row in rows)  # older results have no blocks
    }
    return common.table(rows, {"": _name, **uses, "Embree and the rest": rest})


def _start_table(result: dict) -> str:
    """The time before the first picture."""

    def milliseconds(key: str) -> Cell:
        return lambda row: f"{1000 * max(row[3][key], 0):.0f} ms"

    columns = {
        "": _name,
        "load": milliseconds("load"),
        "acceleration structure": milliseconds("path_build"),
        "first render beyond a later one": milliseconds("path_first"),
    }
    rows = (row for row in _rows(result) if row[2] in STARTED)
    return common.table(rows, columns)


def save_plot(result: dict, path: Path) -> Path:
    """Time (above) and memory (below) over the size of the cache, one column per model."""

    def share(kind: str) -> float:
        return float(kind.removeprefix("cache ").rstrip("%")) / 100

    models = list(dict.fromkeys(run["model"] for run in result["runs"]))
    settings = {"layout": "constrained", "squeeze": False, "sharex": True}
    size = (4 * len(models), 7)
    figure, axes = common.pyplot().subplots(2, len(models), figsize=size, **settings)
    columns = dict(zip(models, axes.T))
    for model, variant in dict.fromkeys((run["model"], run["variant"]) for run in result["runs"]):
        time_ax, memory_ax = columns[model]
        rows = [row[2:] for row in _rows(result) if row[:2] == (model, variant)]
        points = sorted((share(kind), *row) for kind, *row in rows if "cache" in kind)
        shares = [100 * fraction for fraction, *_ in points]
        color = f"C{VARIANTS.index(variant)}"
        for name, line in zip(INTEGRATORS, ("--s", "-o")):
            ratios = [times[f"{name}_ratio"] for _, times, _ in points]
            label = f"{variant}, {name}"
            time_ax.plot(shares, ratios, line, color=color, label=label, markersize=4)
        megabytes = [memory["bytes"] / 1e6 for *_, memory in points]
        memory_ax.plot(shares, megabytes, "-o", color=color, label=variant, markersize=4)
        for kind, line in ((NATIVE, ":"), (TRIANGLES, "-.")):
            for own, _, memory in rows:
                drawn = {"color": color, "linestyle": line, "label": f"{variant}, {kind}"}
                if own == kind:
                    memory_ax.axhline(memory["bytes"] / 1e6, **drawn)
    for model, (time_ax, memory_ax) in columns.items():
        time_ax.set(title=model, yscale="log")
        time_ax.axhline(1, color="gray", linewidth=0.8)
        memory_ax.set(xlabel="cache, % of the decoded geometry", ylim=(0, None))
    axes[0, 0].set_ylabel("time (native mesh = 1)")
    axes[1, 0].set_ylabel("memory, MB")
    for ax in axes[:, 0]:
        ax.legend(fontsize=7)
    return common.save_figure(figure, path, dpi=110)


def block(result: dict) -> str:
    """The tables in docs/mitsuba.md."""
    tables = (_table, _memory_table, _start_table)
    text = "\n".join(table(result) for table in tables) + "\n" + common.origin_line(result)
    return f"{outdated(result)}\n{text}" if outdated(result) else text


def outdated(result: dict) -> str:
    """Why a result must not be relied on any more; empty if it may."""
    if not result["commit"].startswith(BEFORE_SHARES):
        return ""
    return (
        "**Outdated**: measured before a shape gave its share of a cache group back. With a part "
        "of the meshlets cached, renders take longer today than these figures say.\n"
    )
