"""How soon is a picture there, in how much memory? MeshletStream in browsers, beside whole files.

Writes docs/stream_results.md. A server limits the rate of the models' files, all connections
together; pages and libraries come at once. Browsers draw without a GPU.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

import gltf_ext
from bench import peers
from bench.common import BITS, ROOT, markdown_table, origin_line, progress, table
from bench.large_model import write_displaced
from bench.lod import DISPLACED
from bench.models import real_model
from gltf_ext.document.accessors import stated_bounds
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.lod import LodPrimitive, View, cut_for_view, open_lod
from gltf_ext.lod.cuts import held_bytes
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import all_primitives

DRIVER = Path(__file__).with_name("stream_driver.mjs")
PARTS = ("browsers", "frames")
DOCUMENT = "stream_results"
PACKAGES = ("gltf-meshlet", "numpy", "meshoptimizer")
RATE = 2_500_000  # bytes per second: 20 Mbit/s
BUDGETS = (64_000_000, 8_000_000)
BROWSERS = {"Chromium": "chromium", "Firefox": "firefox-esr"}  # name -> program
COPIES = 2  # of decoded pages
FRAMES = 300
REST_SECONDS = 60
PIXELS = 1000  # of the longest side, and of the picture
FIELD_OF_VIEW = 40.0  # degrees
SCENE = (
    *("dragon", "igea", "bunny", "beast", "chinesedragon", "engine", "suzanne"),
    *("materialball", "DamagedHelmet", "sponza_like"),
)
CUTS = 4  # of each edge of the dragon
INSTANCES = 200


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--browsers", nargs="+", choices=BROWSERS, default=list(BROWSERS))
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument(
        "--files", metavar="FOLDER", help="keep the compressed files there, and use those there are"
    )
    parser.add_argument("--peers", action="store_true", help="also Draco and meshopt, whole")


def check(options: argparse.Namespace) -> None:
    """Ends the program if something is missing."""
    require_browsers(options.browsers)


def require_browsers(names: Iterable[str]) -> None:
    """Ends the program if a browser is missing, or what drives it."""
    peers.require_web(("three", "puppeteer-core"), ("decoder.wasm",))
    for name in names:
        for program in (BROWSERS[name], *display_of(name)[:1]):
            if not shutil.which(program):
                raise SystemExit(f"bench: {program} is not installed")


def display_of(browser: str) -> tuple[str, ...]:
    """The command that gives a browser a display. Firefox has WebGL on a display only."""
    return ("xvfb-run", "-a") if browser == "Firefox" else ()


def measure(options: argparse.Namespace) -> dict:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(options.files or temporary)
        source = folder / "source.glb"
        needed = [folder / "model.glb", *([source] if options.peers else [])]
        if not all(path.is_file() for path in needed):
            progress("compressing")
            write_displaced(real_model(DISPLACED), CUTS, source)
            gltf_ext.compress(source, folder / "model.glb", lod=True, **BITS)
        scene_side = write_scene(folder)
        settings: list[dict] = [
            {"task": "first", "file": "model.glb", "maxBytes": BUDGETS[0]},
            {"task": "whole", "file": "model.glb"},
        ]
        if options.peers:
            written = write_peers(source, folder)
            settings += [{"task": "whole", "file": name} for name in written]
        flights = (("model.glb", longest_side(folder / "model.glb")), ("scene.gltf", scene_side))
        settings += [
            {
                "task": "flight",
                "file": name,
                "side": side,
                "maxBytes": budget,
                "frames": options.frames,
                "restSeconds": REST_SECONDS,
            }
            for name, side in flights
            for budget in BUDGETS
        ]
        (folder / "list.json").write_text(json.dumps(settings))
        runs = [run for browser in options.browsers for run in drive(folder, browser=browser)]
        for run in runs:
            if run["task"] == "flight":
                run["best"] = best_error(folder / run["file"], run)
                del run["setting"]
        return {
            "rate": RATE,
            "triangles": gltf_ext.inspect(folder / "model.glb")["totals"]["triangles"],
            "bytes": {p.name: p.stat().st_size for p in folder.glob("*.glb")},
            "cut_bytes": cut_bytes(folder / "model.glb"),
            "runs": runs,
        }


def drive(folder: Path, rate: int = RATE, browser: str = "Chromium") -> list[dict]:
    """What stream_driver.mjs prints for the settings in list.json. rate: bytes per second."""
    program = shutil.which(BROWSERS[browser])
    settings = (browser, program, folder, rate, folder / "list.json")
    given = (DRIVER, ROOT, peers.NODE_MODULES, *settings)
    return json.loads(peers.node(*given, display=display_of(browser)))


def longest_side(path: Path) -> float:
    document = open_model(path)
    sides = [
        high - low
        for _, _, p in all_primitives(document)
        for low, high in zip(*stated_bounds(document.accessors[p["attributes"]["POSITION"]]))
    ]
    return float(max(sides))


def cut_bytes(path: Path) -> int:
    """Bytes of the pages and the tables that one pixel needs, seen as the page sees it."""
    (primitive,) = (p for p in open_lod(path) if isinstance(p, LodPrimitive))
    tables = primitive.tables
    points = primitive.compressed.decode().attributes["POSITION"]
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max())
    x, y, z = (low + high) / 2
    view = View.perspective((x, y, z + 1.375 * size), FIELD_OF_VIEW, PIXELS)
    return held_bytes(tables, cut_for_view(tables, view, 1.0))


def best_error(path: Path, run: dict) -> float:
    """The error in pixels of the best cut that fits into a flight's budget at its end.

    Its pages have two copies, as in three.js, beside the tables and the memory of Workers. No byte
    is kept free for pages on the way, and nothing out of view is finer than the coarsest level.
    """
    setting = run["setting"]
    view = View(
        tuple(setting["eye"]), View.perspective((0, 0, 0), FIELD_OF_VIEW, PIXELS).pixels_per_unit
    )
    planes = np.array(setting["planes"])
    offset = np.eye(4)
    offset[:3, 3] = setting["offset"]
    matrices: dict[int, list[np.ndarray]] = {}
    for node, matrix in placed_nodes(open_model(path)):
        if "mesh" in node:
            matrices.setdefault(node["mesh"], []).append(offset @ matrix)
    pixels, sizes = [], []
    for one in open_lod(path):
        if not isinstance(one, LodPrimitive):
            continue
        groups, pages = one.tables.groups, one.tables.pages
        largest = np.where(np.isinf(groups["error"]), np.inf, 0.0)
        for matrix in matrices.get(one.compressed.mesh, []):
            centre = groups["centre"] @ matrix[:3, :3].T + matrix[:3, 3]
            radius = groups["radius"] * np.linalg.norm(matrix[:3, :3], 2)
            inside = (centre @ planes[:, :3].T + planes[:, 3] >= -radius[:, None]).all(axis=1)
            largest = np.maximum(largest, np.where(inside, view.pixels(one.tables, matrix), 0.0))
        pixels.append(np.maximum.reduceat(largest, pages["firstGroup"]))
        vertex_bytes = setting["vertexBytes"][one.compressed.where]
        sizes.append(vertex_bytes * pages["vertices"].astype(np.int64) + 12 * pages["triangles"])
    order = np.argsort(-np.concatenate(pixels))
    held = COPIES * np.cumsum(np.concatenate(sizes)[order])
    free = run["budget"] - run["memory"]["tables"] - run["memory"]["wasm"]
    first = int(np.searchsorted(held, free, side="right"))  # the first page that does not fit
    return max(1.0, float(np.concatenate(pixels)[order][first])) if first < len(order) else 1.0


def write_peers(source: Path, folder: Path) -> list[str]:
    """The source by gltf-transform with Draco, and by gltfpack with meshopt, where they can."""
    modules = peers.NODE_MODULES / ".bin"
    commands = {
        "draco.glb": [modules / "gltf-transform", "draco", source, folder / "draco.glb"],
        "meshopt.glb": [modules / "gltfpack", "-c", "-i", source, "-o", folder / "meshopt.glb"],
    }
    for name, command in commands.items():
        progress(name)
        if not (folder / name).is_file():
            subprocess.run(list(map(str, command)), stdout=subprocess.DEVNULL)
    return [name for name in commands if (folder / name).is_file()]


def write_scene(folder: Path) -> float:
    """Writes scene.gltf: INSTANCES nodes of the models of SCENE, on a square, with .bin files.

    Returns the length of a side of the square. Each model has a size of 1. No textures.
    """
    scene: dict = {"asset": {"version": "2.0"}, "scene": 0}
    lists: dict[str, list] = {n: [] for n in ("buffers", "bufferViews", "accessors", "meshes")}
    sizes = []
    for name in SCENE:
        path = folder / f"{name}.gltf"
        if not path.is_file():
            gltf_ext.compress(real_model(name), path, lod=True, **BITS)
        sizes.append(longest_side(path))
        append_model(path, lists)
    side = int(INSTANCES**0.5 + 1)
    nodes = [
        {
            "mesh": n % len(SCENE),
            "translation": [n % side - side / 2, 0.0, n // side - side / 2],
            "scale": [1.0 / sizes[n % len(SCENE)]] * 3,
        }
        for n in range(INSTANCES)
    ]
    scene |= lists | {"nodes": nodes, "scenes": [{"nodes": list(range(INSTANCES))}]}
    names = ["EXT_meshlet_edgebreaker"]
    scene |= {"extensionsUsed": [*names, "EXT_meshlet_lod"], "extensionsRequired": names}
    (folder / "scene.gltf").write_text(json.dumps(scene))
    return float(side)


def append_model(path: Path, lists: dict[str, list]) -> None:
    """Adds the primitives of a .gltf with one buffer as one mesh."""
    properties = json.loads(path.read_text())
    views, accessors = len(lists["bufferViews"]), len(lists["accessors"])
    for view in properties["bufferViews"]:
        lists["bufferViews"].append(view | {"buffer": len(lists["buffers"])})
    lists["buffers"] += properties["buffers"]
    for accessor in properties["accessors"]:
        if "bufferView" in accessor:
            accessor["bufferView"] += views
        lists["accessors"].append(accessor)
    primitives = [p for mesh in properties["meshes"] for p in mesh["primitives"]]
    for primitive in primitives:
        primitive.pop("material", None)
        primitive["indices"] += accessors
        primitive["attributes"] = {k: v + accessors for k, v in primitive["attributes"].items()}
        compressed = primitive["extensions"]["EXT_meshlet_edgebreaker"]
        compressed["bufferView"] += views
        if levels := primitive["extensions"].get("EXT_meshlet_lod"):
            levels["bufferView"] += views
            levels["pages"]["bufferView"] += views
    lists["meshes"].append({"primitives": primitives})


def first_table(result: dict) -> str:
    rows = []
    for run in result["runs"]:
        if run["task"] == "first":
            for name in ("first", "last"):
                part = run[name]
                error = part.get("pixels", part.get("threshold"))
                row = [run["browser"], f"streamed, {name} picture"]
                row += [f"{part['bytes'] / 1e6:.2f} MB", f"{part['seconds']:.1f} s"]
                rows.append([*row, f"{error:.1f}"])
        elif run["task"] == "whole":
            size = f"{result['bytes'][run['file']] / 1e6:.2f} MB"
            seconds = f"{run['seconds']:.1f} s" if "seconds" in run else run["error"]
            rows.append([run["browser"], f"whole, {run['file']}", size, seconds, "0"])
    return markdown_table(["browser", "", "bytes", "time", "error in pixels"], rows)


def peers_line(result: dict) -> str:
    names = {run["file"] for run in result["runs"] if run["task"] == "whole"}
    if names == {"model.glb"}:
        return ""
    line = "Whole files have all triangles; meshopt.glb is of gltfpack -c"
    if "draco.glb" in names:
        return line + ", draco.glb of gltf-transform.\n\n"
    return line + ". Draco's encoder in gltf-transform runs out of memory on this model.\n\n"


def flight_table(result: dict) -> str:
    columns: dict[str, Callable[[dict], str]] = {
        "browser": lambda run: run["browser"],
        "file": lambda run: run["file"],
        "budget": lambda run: f"{run['budget'] / 1e6:.0f} MB",
        "most": lambda run: f"{run['most'] / 1e6:.2f} MB",
        "at rest: error in pixels": lambda run: f"{run['error']:.2f}",
        "of the best cut that fits": lambda run: f"{run['best']:.2f}",
        "complete": lambda run: "yes" if run["complete"] else "no",
        "triangles": lambda run: f"{run['triangles']:,}",
        "fetched": lambda run: f"{run['fetched'] / 1e6:.2f} MB",
        "update, median": lambda run: f"{run['updateMedian']:.2f} ms",
        "longest": lambda run: f"{run['updateMost']:.0f} ms",
        "tasks over 50 ms": lambda run: "-" if run["longTasks"] is None else str(run["longTasks"]),
        "JavaScript heap": lambda run: f"{run['heap'] / 1e6:.0f} MB" if run["heap"] else "-",
    }
    return table((run for run in result["runs"] if run["task"] == "flight"), columns)


def report(result: dict) -> str:
    """docs/stream_results.md."""
    return (
        "# Streaming: results\n\n"
        f"{origin_line(result)}\n"
        f"{result['triangles']:,} triangles (the dragon, displaced) in a picture of {PIXELS} "
        f"pixels, at {result['rate'] / 1e6:g} MB per second. Browsers draw without a GPU. One "
        f"pixel needs pages and tables of {result['cut_bytes'] / 1e6:.2f} MB.\n\n"
        f"{first_table(result)}\n{peers_line(result)}"
        "## Flights\n\n"
        f"Around the model, and over {INSTANCES} instances of {len(SCENE)} models (`scene.gltf`), "
        f"then at rest for at most {REST_SECONDS} s; nothing is drawn in flight. Most: the largest "
        "sum of GPU buffers, arrays and the memory of Workers that the stream counts in any "
        "frame. The best cut that fits has its pages twice beside the tables and the memory of "
        "Workers, no memory for pages on the way, and nothing out of view. Update is the choice of "
        "detail, requests and copies of a frame. Tasks over 50 ms are all of the page's since the "
        "stream was made; Firefox tells neither these nor its heap.\n\n"
        f"{flight_table(result)}"
    )
