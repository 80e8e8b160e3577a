"""The Mitsuba shape against Mitsuba's own mesh of the same decompressed file: time and memory over the size of the cache.

    python -m bench.mitsuba [--models bunny ...] [--variants ...] [--spp 16] [--width 1280] [--height 720]

Each model and variant runs in a process of its own, one after the other, with nothing else in it. Times are of rendering with a warm
cache and compiled kernels; what loading, building and the first render take beyond that is reported beside them. Memory is what the
process grows by from before a scene is loaded to after it was rendered, the same for both. Writes bench/results/mitsuba.json, the
table in docs/mitsuba.md and docs/mitsuba.png.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import json
import os
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
POLICIES = ("counts", "clock")
COMPARED = (0.25, 0.1)  # fractions at which the policies are compared
INTEGRATORS = {"depth": {"type": "depth"}, "path": {"type": "path", "max_depth": 3}}
VIEW = (0.3, 0.4, 1.0)
REPEATS = 2
WARM_SPP = 2


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", nargs="+", default=MODELS)
    parser.add_argument("--variants", nargs="+", default=VARIANTS)
    parser.add_argument("--fractions", nargs="+", type=float, default=FRACTIONS)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=720)
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(_child(options, *options.child)))
        return
    result = {
        **common.origin("bench.mitsuba", ("mitsuba", "drjit", "numpy")),
        "width": options.width,
        "height": options.height,
        "spp": options.spp,
        "runs": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for model in options.models:
            for variant in options.variants:
                for task in ("time", "memory"):
                    run = _measured(options, task, str(_prepared(model, Path(folder))), variant)
                    result["runs"].append({"model": model, "variant": variant, "task": task, "rows": run})
                    for row in run:
                        print(
                            model,
                            variant,
                            task,
                            {k: round(v, 4) if isinstance(v, float) else v for k, v in row.items()},
                            flush=True,
                        )
    common.write_result("mitsuba", result)
    table = f"{_table(result)}\n{_policy_table(result)}\n{_start_table(result)}"
    print(table)
    _plot(result, common.ROOT / "docs" / "mitsuba.png")
    common.replace_block(common.ROOT / "docs" / "mitsuba.md", "measurements", table + "\n" + common.origin_line(result))


def _prepared(model: str, folder: Path) -> Path:
    """Compresses and decompresses the model; returns the compressed file."""
    compressed = folder / f"{model}.glb"
    if not compressed.exists():
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
        "--fractions",
        *map(str, options.fractions),
    ]
    return json.loads(
        subprocess.run(command, check=True, capture_output=True, text=True, cwd=common.ROOT).stdout.splitlines()[-1]
    )


# --- in the child ----------------------------------------------------------------------------------------------------


def _child(options: argparse.Namespace, task: str, path: str, variant: str) -> list[dict]:
    import mitsuba as mi

    mi.set_variant(variant)
    import mitsuba_plugin  # noqa: F401  registers the shape

    return (_times if task == "time" else _memory)(options, path)


def _shapes(path: str, fraction: float | None, policy: str = POLICIES[0]) -> dict:
    """Mitsuba's own meshes (None), or compressed shapes that share one cache."""
    import mitsuba as mi

    if fraction is None:
        return {f"shape_{i}": _mesh(mi, p) for i, p in enumerate(gltf_ext.load(path.replace(".glb", ".plain.glb")))}
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
                "film": {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 1},
            },
        }
    )


def _render(scene, spp: int, seed: int) -> float:
    import mitsuba as mi

    start = time.perf_counter()
    np.array(mi.render(scene, spp=spp, seed=seed))
    return time.perf_counter() - start


def _times(options: argparse.Namespace, path: str) -> list[dict]:
    import mitsuba_plugin

    rows = []
    settings = [
        (None, None),
        *((f, POLICIES[0]) for f in options.fractions),
        *((f, p) for p in POLICIES[1:] for f in COMPARED if f in options.fractions),
    ]
    for fraction, policy in settings:
        start = time.perf_counter()
        shapes = _shapes(path, fraction, policy)
        row = {"fraction": fraction, "policy": policy, "load": time.perf_counter() - start}
        for name, integrator in INTEGRATORS.items():
            start = time.perf_counter()
            scene = _scene(shapes, integrator, (options.width, options.height))
            row[f"{name}_build"] = time.perf_counter() - start
            cold = _render(scene, WARM_SPP, 0)
            warm = _render(scene, WARM_SPP, 0)
            row[f"{name}_first"] = cold - warm
            mitsuba_plugin.statistics(reset=True)
            row[name] = min(_render(scene, options.spp, seed + 1) for seed in range(REPEATS))
            if fraction is not None:
                figures = mitsuba_plugin.statistics(scene)
                asked = max(figures["hits"] + figures["misses"], 1)
                row[f"{name}_hit_share"] = figures["hits"] / asked
        rows.append(row)
    return rows


def _memory(options: argparse.Namespace, path: str) -> list[dict]:
    """Each scene is rendered in a process of its own, so that what one leaves behind does not count for the next."""
    import mitsuba as mi

    rows = []
    for fraction in (None, *options.fractions):
        code = "import sys, json; from bench import mitsuba as b; print(json.dumps(b.grown(sys.argv[1], sys.argv[2], sys.argv[3])))"
        command = [sys.executable, "-c", code, path, mi.variant(), str(fraction)]
        for _ in range(2):  # the first may have to compile kernels, which Dr.Jit keeps on disk
            result = subprocess.run(command, check=True, capture_output=True, text=True, cwd=common.ROOT)
        rows.append({"fraction": fraction, **json.loads(result.stdout.splitlines()[-1])})
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


# --- report ----------------------------------------------------------------------------------------------------------


def _rows(result: dict):
    """(model, variant, fraction, times, memory) with the native mesh's first (fraction None)."""
    runs = {(r["model"], r["variant"], r["task"]): r["rows"] for r in result["runs"]}
    for model, variant in dict.fromkeys((r["model"], r["variant"]) for r in result["runs"]):
        for times, memory in zip(
            runs[model, variant, "time"], runs[model, variant, "memory"]
        ):  # which has no other policies
            yield model, variant, times["fraction"], times, memory


def _table(result: dict) -> str:
    rows, native = [], None
    for model, variant, fraction, times, memory in _rows(result):
        if fraction is None:
            native = times, memory
        rows.append(
            [
                f"{model}, {variant}, " + ("native mesh" if fraction is None else f"cache {fraction:.0%}"),
                *(f"{times[name]:.2f} s ({times[name] / native[0][name]:.2f}x)" for name in INTEGRATORS),
                f"{memory['bytes'] / 1e6:.1f} MB ({memory['bytes'] / native[1]['bytes']:.2f}x)",
                "" if fraction is None else f"{times['path_hit_share']:.1%}",
            ]
        )
    return common.markdown_table(["", *INTEGRATORS, "memory", "hits (path)"], rows)


def _start_table(result: dict) -> str:
    """What comes before the first picture."""
    rows = [
        [
            f"{model}, {variant}, " + ("native mesh" if fraction is None else f"cache {fraction:.0%}"),
            *(f"{1000 * max(times[key], 0):.0f} ms" for key in ("load", "path_build", "path_first")),
        ]
        for model, variant, fraction, times, _ in _rows(result)
        if fraction in (None, COMPARED[0])
    ]
    return common.markdown_table(["", "load", "acceleration structure", "first render beyond a later one"], rows)


def _policy_table(result: dict) -> str:
    rows = []
    for run in result["runs"]:
        timed = {(row["fraction"], row["policy"]): row for row in run["rows"]} if run["task"] == "time" else {}
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
                                for text in (f"{row[name]:.2f} s", f"{row[f'{name}_hit_share']:.1%}")
                            ),
                        ]
                    )
    return common.markdown_table(["", *(text for name in INTEGRATORS for text in (name, "hits"))], rows)


def _plot(result: dict, path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(13, 4), layout="constrained")
    series: dict[tuple, list] = {}
    native: dict[tuple, tuple] = {}
    for model, variant, fraction, times, memory in _rows(result):
        if fraction is None:
            native[model, variant] = times, memory
        else:
            base_times, base_memory = native[model, variant]
            series.setdefault((model, variant), []).append(
                (
                    fraction,
                    *(times[name] / base_times[name] for name in INTEGRATORS),
                    memory["bytes"] / base_memory["bytes"],
                )
            )
    for (model, variant), points in series.items():
        points = np.array(sorted(points))
        for column, ax in enumerate(axes):
            ax.plot(
                100 * points[:, 0],
                points[:, column + 1],
                "-o" if variant.startswith("scalar") else "--s",
                label=f"{model}, {variant}",
                markersize=4,
            )
    for ax, title in zip(axes, (*(f"time, {name}" for name in INTEGRATORS), "memory")):
        ax.set(
            title=f"{title} (native mesh = 1)",
            xlabel="cache, % of the decoded geometry",
            yscale="log" if title != "memory" else "linear",
        )
        ax.axhline(1, color="gray", linewidth=0.8)
    axes[0].legend(fontsize=7)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
