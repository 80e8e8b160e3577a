"""The Mitsuba shape against Mitsuba's own mesh of the same decompressed file: time and memory over the size of the cache.

    python -m bench.mitsuba [--models bunny ...] [--variants ...] [--fractions ...] [--spp 16] [--repeats 2] [--width 1280] [--height 720]

Each model and variant runs in a process of its own, one after the other, with nothing else in it. Times are of rendering with a warm
cache and compiled kernels; what loading, building and the first render take beyond that is reported beside them. Rounds go through
Mitsuba's own mesh and all sizes of the cache, so that a ratio is of two renders shortly after each other; the median of the rounds
counts. Without any cache a fraction of the samples is enough, for the mesh that is compared with too. Memory is what the process grows
by from before a scene is loaded to after it was rendered, the same for both.

A run of all models and variants writes bench/results/mitsuba.json, the table in docs/mitsuba.md and docs/mitsuba.png; others print.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import gltf_ext
from bench import common

MODELS = ("bunny", "sponza_like", "dragon")
VARIANTS = ("scalar_rgb", "llvm_ad_rgb")
FRACTIONS = (1.0, 0.5, 0.25, 0.1, 0.0)
POLICIES = ("clock", "counts")  # the default first
COMPARED = (0.25, 0.1)  # fractions at which the policies are compared
UNCACHED_SHARE = 8  # without any cache, one of so many samples is rendered
INTEGRATORS = {"depth": {"type": "depth"}, "path": {"type": "path", "max_depth": 3}}
VIEW = (0.3, 0.4, 1.0)
WARM_SPP = 2


def main() -> None:
    options = _options()
    if options.child:
        print(json.dumps(_child(options, *options.child)))
        return
    result = {
        **common.origin("bench.mitsuba", ("mitsuba", "drjit", "numpy")),
        "width": options.width,
        "height": options.height,
        "spp": options.spp,
        "repeats": options.repeats,
        "runs": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for model in options.models:
            for variant in options.variants:
                for task in ("time", "memory"):
                    _progress(f"{model}, {variant}: {task}")
                    rows = _measured(options, task, str(_prepared(model, Path(folder))), variant)
                    result["runs"].append(
                        {"model": model, "variant": variant, "task": task, "rows": rows}
                    )
    tables = (_table, _memory_table, _policy_table, _start_table)
    text = "\n".join(table(result) for table in tables)
    print(text)
    if (tuple(options.models), tuple(options.variants), tuple(options.fractions)) != (
        MODELS,
        VARIANTS,
        FRACTIONS,
    ):
        return
    common.write_result("mitsuba", result)
    _plot(result, common.ROOT / "docs" / "mitsuba.png")
    common.replace_block(
        common.ROOT / "docs" / "mitsuba.md",
        "measurements",
        text + "\n" + common.origin_line(result),
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--models", nargs="+", default=MODELS, help="names of files in the models' folder"
    )
    parser.add_argument("--variants", nargs="+", default=VARIANTS)
    parser.add_argument(
        "--fractions", nargs="+", type=float, default=FRACTIONS, help="sizes of the cache, 0 to 1"
    )
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel")
    parser.add_argument(
        "--repeats", type=int, default=2, help="rounds of timing, of which the median counts"
    )
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=720)
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    return parser.parse_args()


_START = time.perf_counter()


def _progress(text: str) -> None:
    print(f"{time.perf_counter() - _START:6.0f} s  {text}", file=sys.stderr, flush=True)


def _prepared(model: str, folder: Path) -> Path:
    """Compresses and decompresses the model; returns the compressed file."""
    compressed = folder / f"{model}.glb"
    if not compressed.exists():
        if not (common.MODELS / f"{model}.glb").is_file():
            raise SystemExit(
                f"bench.mitsuba: there is no {model}.glb in {common.MODELS}; set GLTF_MESHLET_MODELS"
            )
        gltf_ext.compress(common.MODELS / f"{model}.glb", compressed)
        gltf_ext.decompress(compressed, folder / f"{model}.plain.glb")
    return compressed


def _measured(options: argparse.Namespace, task: str, path: str, variant: str) -> list[dict]:
    command = [
        sys.executable,
        "-m",
        "bench.mitsuba",
        "--child",
        task,
        path,
        variant,
        "--spp",
        str(options.spp),
        "--width",
        str(options.width),
        "--height",
        str(options.height),
        "--repeats",
        str(options.repeats),
        "--fractions",
        *map(str, options.fractions),
    ]
    return _last_line(command)


def _last_line(command: list[str]) -> list | dict:
    """The JSON that a process prints last; what it has to say beside passes through."""
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, cwd=common.ROOT)
    if done.returncode:
        raise SystemExit(f"bench.mitsuba: a measurement failed: {' '.join(command)}")
    return json.loads(done.stdout.splitlines()[-1])


# --- in the child ---


def _child(options: argparse.Namespace, task: str, path: str, variant: str) -> list[dict]:
    import mitsuba as mi

    mi.set_variant(variant)
    import mitsuba_plugin  # noqa: F401  registers the shape

    return (_times if task == "time" else _memory)(options, path)


def _shapes(path: str, fraction: float | None, policy: str = POLICIES[0]) -> dict:
    """Mitsuba's own meshes (None), or compressed shapes that share one cache."""
    import mitsuba as mi

    if fraction is None:
        return {
            f"shape_{i}": _mesh(mi, p)
            for i, p in enumerate(gltf_ext.load(path.replace(".glb", ".plain.glb")))
        }
    return {
        f"shape_{i}": {
            "type": "meshlet_edgebreaker",
            "filename": path,
            "mesh": m,
            "primitive": p,
            "cache": fraction,
            "cache_policy": policy,
            "cache_group": f"bench {fraction} {policy}",
        }
        for i, (m, p) in enumerate(_places(path))
    }


def _places(path: str) -> list[tuple[int, int]]:
    return [(d.mesh, d.primitive) for d in gltf_ext.decoders(path)]


def _mesh(mi, primitive: gltf_ext.Primitive):
    attributes = primitive.attributes
    mesh = mi.Mesh(
        "native",
        len(attributes["POSITION"]),
        len(primitive.indices),
        has_vertex_normals="NORMAL" in attributes,
        has_vertex_texcoords="TEXCOORD_0" in attributes,
    )
    parameters = mi.traverse(mesh)
    parameters["faces"] = primitive.indices.astype(np.uint32).ravel()
    for name, target in (
        ("POSITION", "vertex_positions"),
        ("NORMAL", "vertex_normals"),
        ("TEXCOORD_0", "vertex_texcoords"),
    ):
        if name in attributes:
            parameters[target] = attributes[name].astype(np.float32).ravel()
    parameters.update()
    return mesh


def _scene(shapes: dict, integrator: dict, size: tuple[int, int]):
    import mitsuba as mi

    box = mi.load_dict({"type": "scene", **shapes}).bbox()
    center, extents = np.array(box.center()).ravel(), np.array(box.extents()).ravel()
    origin = center + np.array(VIEW) * np.linalg.norm(extents)
    return mi.load_dict(
        {
            "type": "scene",
            **shapes,
            "integrator": integrator,
            "light": {"type": "constant"},
            "sensor": {
                "type": "perspective",
                "fov": 45,
                "fov_axis": "larger",
                "to_world": mi.ScalarTransform4f().look_at(list(origin), list(center), [0, 1, 0]),
                "film": {
                    "type": "hdrfilm",
                    "width": size[0],
                    "height": size[1],
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "independent", "sample_count": 1},
            },
        }
    )


def _render(scene, spp: int, seed: int) -> float:
    import mitsuba as mi

    start = time.perf_counter()
    np.array(mi.render(scene, spp=spp, seed=seed))
    return time.perf_counter() - start


def _settings(options: argparse.Namespace) -> list[tuple[float | None, str | None]]:
    """(fraction, policy): the native mesh, the default policy at all fractions, the others at some."""
    others = [(f, p) for p in POLICIES[1:] for f in COMPARED if f in options.fractions]
    return [(None, None), *((f, POLICIES[0]) for f in options.fractions), *others]


def _times(options: argparse.Namespace, path: str) -> list[dict]:
    """A row for each setting: seconds (`depth`, `path`), their ratios to the native mesh's, the cache's hits."""
    rows, shapes = [], []
    for fraction, policy in _settings(options):
        start = time.perf_counter()
        shapes.append(_shapes(path, fraction, policy))
        rows.append({"fraction": fraction, "policy": policy, "load": time.perf_counter() - start})
    for name, integrator in INTEGRATORS.items():
        scenes = [_built(options, name, integrator, s, row) for s, row in zip(shapes, rows)]
        _time_rounds(options, name, scenes, rows)
    return rows


def _built(options: argparse.Namespace, name: str, integrator: dict, shapes: dict, row: dict):
    """The scene, its cache warm and its kernels compiled; notes in the row what that took."""
    start = time.perf_counter()
    scene = _scene(shapes, integrator, (options.width, options.height))
    row[f"{name}_build"] = time.perf_counter() - start
    cold = _render(scene, 1, 0)
    row[f"{name}_first"] = cold - _render(scene, 1, 0)
    if row["fraction"]:
        _render(scene, WARM_SPP, 1)
    return scene


def _time_rounds(options: argparse.Namespace, name: str, scenes: list, rows: list[dict]) -> None:
    import mitsuba_plugin

    few = max(1, options.spp // UNCACHED_SHARE)
    seconds: list[list[float]] = [[] for _ in rows]
    ratios: list[list[float]] = [[] for _ in rows]
    mitsuba_plugin.statistics(reset=True)
    for seed in range(options.repeats):
        _progress(f"  {name}, round {seed + 1} of {options.repeats}")
        native = _render(scenes[0], options.spp, seed)
        native_few = _render(scenes[0], few, seed)
        for row, scene, own, to_native in zip(rows, scenes, seconds, ratios):
            if row["fraction"] is None:
                own.append(native)
                continue
            spp, base = (options.spp, native) if row["fraction"] else (few, native_few)
            time_taken = _render(scene, spp, seed)
            own.append(time_taken * options.spp / spp)
            to_native.append(time_taken / base)
    for row, scene, own, to_native in zip(rows, scenes, seconds, ratios):
        row[name] = statistics.median(own)
        row[f"{name}_range"] = [min(own), max(own)]
        if row["fraction"] is None:
            continue
        row[f"{name}_ratio"] = statistics.median(to_native)
        row[f"{name}_ratio_range"] = [min(to_native), max(to_native)]
        figures = mitsuba_plugin.statistics(scene)
        row[f"{name}_hit_share"] = figures["hits"] / max(figures["hits"] + figures["misses"], 1)


def _memory(options: argparse.Namespace, path: str) -> list[dict]:
    """Each scene is rendered in a process of its own, so that what one leaves behind does not count for the next."""
    import mitsuba as mi

    code = "import sys, json; from bench import mitsuba as b; print(json.dumps(b.grown(*sys.argv[1:4])))"
    rows, compiled = [], set()
    for fraction in (None, *options.fractions):
        command = [sys.executable, "-c", code, path, mi.variant(), str(fraction)]
        if (
            fraction is None
        ) not in compiled:  # the first may have to compile kernels, which Dr.Jit keeps on disk
            _last_line(command)
            compiled.add(fraction is None)
        rows.append({"fraction": fraction, **_last_line(command)})
    return rows


def grown(path: str, variant: str, fraction: str) -> dict:
    """Bytes by which this process grows when it loads and renders the scene, and the shape's own account."""
    import mitsuba as mi

    mi.set_variant(variant)
    import mitsuba_plugin

    size = (320, 180)
    warm = {"ball": {"type": "sphere"}, "cube": mi.load_dict({"type": "cube"})}
    _render(_scene(warm, INTEGRATORS["path"], size), 1, 0)
    share = None if fraction == "None" else float(fraction)
    _places(path)  # what reading glTF leaves behind is not the scene's
    before = _resident()
    shapes = _shapes(path, share)
    scene = _scene(shapes, INTEGRATORS["path"], size)
    for seed in range(4):
        _render(scene, 4, seed)
    after = _resident()
    figures = mitsuba_plugin.statistics(scene) if share is not None else {}
    return {"bytes": after - before, **figures}


def _resident() -> int:
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


# --- report ---


def _rows(result: dict):
    """(model, variant, fraction, times, memory) with the native mesh's first (fraction None)."""
    runs = {(r["model"], r["variant"], r["task"]): r["rows"] for r in result["runs"]}
    for model, variant in dict.fromkeys((r["model"], r["variant"]) for r in result["runs"]):
        for times, memory in zip(
            runs[model, variant, "time"], runs[model, variant, "memory"]
        ):  # which has no other policies
            yield model, variant, times["fraction"], times, memory


def _name(model: str, variant: str, fraction: float | None) -> str:
    return f"{model}, {variant}, " + (
        "native mesh" if fraction is None else f"cache {fraction:.0%}"
    )


def _table(result: dict) -> str:
    rows, native = [], None
    for model, variant, fraction, times, memory in _rows(result):
        if fraction is None:
            native = memory["bytes"]
        ratios = (
            ""
            if fraction is None
            else f" ({times[f'{n}_ratio']:.2f}x, {_span(times[f'{n}_ratio_range'])})"
            for n in INTEGRATORS
        )
        rows.append(
            [
                _name(model, variant, fraction),
                *(f"{times[name]:.2f} s{ratio}" for name, ratio in zip(INTEGRATORS, ratios)),
                f"{memory['bytes'] / 1e6:.1f} MB ({memory['bytes'] / native:.2f}x)",
                "" if fraction is None else f"{times['path_hit_share']:.1%}",
            ]
        )
    return common.markdown_table(["", *INTEGRATORS, "memory", "hits (path)"], rows)


def _span(numbers: list[float]) -> str:
    return f"{numbers[0]:.2f} to {numbers[1]:.2f}"


MEMORY_PARTS = {
    "compressed": "compressed_bytes",
    "boxes, tables": "table_bytes",
    "cache": "resident_bytes",
    "decoders": "working_bytes",
}


def _memory_table(result: dict) -> str:
    """What the memory of the compressed scenes consists of, by the shape's own account; the rest is Embree's and Mitsuba's."""
    rows = []
    for model, variant, fraction, _, memory in _rows(result):
        if fraction is None:
            continue
        parts = [memory[key] for key in MEMORY_PARTS.values()]
        rows.append(
            [
                _name(model, variant, fraction),
                *(f"{n / 1e6:.2f} MB" for n in (*parts, memory["bytes"] - sum(parts))),
            ]
        )
    return common.markdown_table(["", *MEMORY_PARTS, "Embree and the rest"], rows)


def _start_table(result: dict) -> str:
    """What comes before the first picture."""
    rows = [
        [
            _name(model, variant, fraction),
            *(
                f"{1000 * max(times[key], 0):.0f} ms"
                for key in ("load", "path_build", "path_first")
            ),
        ]
        for model, variant, fraction, times, _ in _rows(result)
        if fraction in (None, COMPARED[0])
    ]
    return common.markdown_table(
        ["", "load", "acceleration structure", "first render beyond a later one"], rows
    )


def _policy_table(result: dict) -> str:
    rows = []
    for run in result["runs"]:
        timed = (
            {(row["fraction"], row["policy"]): row for row in run["rows"]}
            if run["task"] == "time"
            else {}
        )
        for fraction in COMPARED:
            for policy in POLICIES:
                row = timed.get((fraction, policy))
                if row:
                    rows.append(
                        [
                            f"{run['model']}, {run['variant']}, cache {fraction:.0%}, {policy}",
                            *(
                                text
                                for name in INTEGRATORS
                                for text in (
                                    f"{row[f'{name}_ratio']:.2f}x",
                                    f"{row[f'{name}_hit_share']:.1%}",
                                )
                            ),
                        ]
                    )
    return common.markdown_table(
        ["", *(text for name in INTEGRATORS for text in (name, "hits"))], rows
    )


def _plot(result: dict, path: Path) -> None:
    """Time (above) and memory (below) over the size of the cache, one column for each model."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    models = list(dict.fromkeys(run["model"] for run in result["runs"]))
    figure, axes = pyplot.subplots(
        2,
        len(models),
        figsize=(4 * len(models), 7),
        layout="constrained",
        squeeze=False,
        sharex=True,
    )
    columns = dict(zip(models, axes.T))
    for model, variant in dict.fromkeys((run["model"], run["variant"]) for run in result["runs"]):
        time_ax, memory_ax = columns[model]
        of_this = [row[2:] for row in _rows(result) if row[:2] == (model, variant)]
        points = sorted((row for row in of_this if row[0] is not None), key=lambda row: row[0])
        native = next(memory["bytes"] for fraction, _, memory in of_this if fraction is None)
        shares = [100 * fraction for fraction, *_ in points]
        color = f"C{VARIANTS.index(variant)}" if variant in VARIANTS else None
        for name, line in zip(INTEGRATORS, ("--s", "-o")):
            ratios = [times[f"{name}_ratio"] for _, times, _ in points]
            time_ax.plot(
                shares, ratios, line, color=color, label=f"{variant}, {name}", markersize=4
            )
        memory_ax.plot(
            shares,
            [m["bytes"] / 1e6 for *_, m in points],
            "-o",
            color=color,
            label=variant,
            markersize=4,
        )
        memory_ax.axhline(native / 1e6, color=color, linestyle=":", label=f"{variant}, native mesh")
    for model, (time_ax, memory_ax) in columns.items():
        time_ax.set(title=model, yscale="log")
        time_ax.axhline(1, color="gray", linewidth=0.8)
        memory_ax.set(xlabel="cache, % of the decoded geometry", ylim=(0, None))
    axes[0, 0].set_ylabel("time (native mesh = 1)")
    axes[1, 0].set_ylabel("memory, MB")
    for ax in axes[:, 0]:
        ax.legend(fontsize=7)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    main()
