"""How exact? Errors, surface distance, rendered difference and size at 8 to 16 bits.

Writes docs/quality.md and docs/quality_models.png, a model at each setting.

Attribute errors are those of `verify`, which pairs each original vertex with its decoded one. The
surface distance does not pair vertices: it measures points on one surface, and its vertices, to the
other surface, both ways.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from trimesh import Trimesh

import gltf_ext
from bench.common import BITS as PINNED
from bench.common import DOCS, markdown_table, origin_line, progress, pyplot, save_figure, table
from bench.models import add_model_names, real_model, torus_and_named
from gltf_ext import _codec
from gltf_ext.sources.primitives import Primitive
from tools.rasterizer import Camera, Mesh, rasterize

PACKAGES = ("gltf-meshlet", "numpy", "matplotlib", "trimesh")
PARTS = ("models",)
NAMES = ("bunny", "suzanne", "DamagedHelmet")
GENERATED = 60_000  # triangles of the generated model
PICTURED = "bunny"
BITS = (8, 10, 12, 14, 16)
SHOWN = ("POSITION", "NORMAL", "TEXCOORD_0")
TEXELS = 4096  # along a side of the texture
SAMPLES = 20_000  # random points on a surface, and at most as many of its vertices
WIDTH, HEIGHT = 640, 480  # of the rendered difference
COLOR = (0.62, 0.60, 0.56)
Column = Callable[[tuple[dict, dict]], str]  # the cell of a model and one of its rows
SKY = 255  # a white background


# --- distance between surfaces ---


def sampled(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Points on a surface, and some of its vertices.

    positions: float[V, 3]; triangles: int[T, 3]
    """
    vertices = np.random.default_rng(1).permutation(np.unique(triangles))[:SAMPLES]
    mesh = Trimesh(positions, triangles, process=False)
    return np.concatenate([mesh.sample(SAMPLES, seed=1), positions[vertices]])


def surface_distance(one: Mesh, other: Mesh) -> dict:
    """The largest and the root mean square distance over both directions."""
    both = np.concatenate([_distances(one, other), _distances(other, one)])
    return {"hausdorff": float(both.max()), "rms": float(np.sqrt(np.square(both).mean()))}


def _distances(source: Mesh, target: Mesh) -> np.ndarray:
    """Exact distances from points of one surface to the other."""
    distances, _ = _codec.surface_distances(
        np.ascontiguousarray(sampled(source.positions, source.triangles), np.float32),
        np.ascontiguousarray(target.positions, np.float32),
        np.ascontiguousarray(target.triangles, np.uint32),
    )
    return distances


# --- pictures ---


def joined(primitives: list[Primitive]) -> Mesh:
    """All primitives as one grey mesh."""
    first = np.cumsum([0] + [primitive.vertex_count for primitive in primitives])
    triangles = np.concatenate(
        [primitive.indices.astype(np.int64) + start for primitive, start in zip(primitives, first)]
    )
    positions, normals = (
        np.concatenate([primitive.attributes[name] for primitive in primitives]).astype(np.float64)
        for name in ("POSITION", "NORMAL")
    )
    return Mesh(positions, normals, triangles, np.full((len(triangles), 3), COLOR))


def camera_on(positions: np.ndarray, closer: float = 1.0, lift: float = 0.0) -> Camera:
    """A camera that shows the bounding box, `closer` times as near.

    lift moves the target up, in halves of the box's height.
    """
    low, high = positions.min(axis=0), positions.max(axis=0)
    radius = float(np.linalg.norm(high - low)) / 2
    target = (low + high) / 2 + [0.0, lift * (high - low)[1] / 2, 0.0]
    direction = np.array([0.35, 0.25, 1.0]) / np.linalg.norm([0.35, 0.25, 1.0])
    return Camera(tuple(target + direction * radius * 3.6), tuple(target), 30.0 / closer)


def on_white(picture: np.ndarray) -> np.ndarray:
    """Composites RGBA, uint8[height, width, 4], over white: float[height, width, 3]."""
    alpha = picture[..., 3:] / 255.0
    return picture[..., :3] * alpha + SKY * (1 - alpha)


def rendered_difference(before: np.ndarray, after: np.ndarray) -> dict:
    """PSNR in dB (None if equal), mean and largest difference of two pictures of 0 to 255."""
    difference = np.abs(after - before)
    mean_square = float(np.square(difference).mean())
    return {
        "psnr": 10 * np.log10(255**2 / mean_square) if mean_square else None,
        "mean": float(difference.mean()),
        "largest": float(difference.max()),
    }


# --- measurements ---


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = torus_and_named(options.models, GENERATED, folder)
        return {"models": [measure_model(name, path, folder) for name, path in paths.items()]}


def measure_model(name: str, path: Path, folder: Path) -> dict:
    """All settings of one model."""
    originals = gltf_ext.load(path)
    mesh = joined(originals)
    box = np.ptp(mesh.positions, axis=0)
    camera = camera_on(mesh.positions)
    picture = on_white(rasterize(mesh, camera, WIDTH, HEIGHT))
    rows = []
    for bits in BITS:
        output, all_bits = folder / f"{name}-{bits}.glb", folder / f"{name}-{bits}-all.glb"
        totals = compressed(path, output, position_bits=bits)
        alike = compressed(path, all_bits, position_bits=bits, normal_bits=bits, texcoord_bits=bits)
        decoded = joined(gltf_ext.load(output))
        after = on_white(rasterize(decoded, camera, WIDTH, HEIGHT))
        row = {
            "bits": bits,
            **totals,
            "alike": alike,
            "errors": attribute_errors(gltf_ext.verify(path, all_bits)),
            "surface": surface_distance(mesh, decoded),
            "rendered": rendered_difference(picture, after),
        }
        rows.append(row)
        progress(f"{name}, {bits} bits")
    sizes = {"triangles": len(mesh.triangles), "longest_side": float(box.max())}
    return {"model": name, **sizes, "rows": rows}


def compressed(path: Path, output: Path, **options) -> dict:
    """The sizes of the file that compress writes with these options."""
    gltf_ext.compress(path, output, **{**PINNED, **options})
    totals = gltf_ext.inspect(output)["totals"]
    return {key: totals[key] for key in ("compressed_bytes", "ratio", "bits_per_triangle")}


def attribute_errors(verified: dict) -> dict:
    """Largest and rms errors: positions in model units, normals in degrees, texcoords in texels."""
    if not verified["ok"]:
        raise SystemExit(f"bench: verify failed: {'; '.join(verified['problems'])}")
    largest, rms = dict(verified["max_error"]), dict(verified["rms_error"])
    if "NORMAL" in largest:
        largest["NORMAL"] = verified["max_error_degrees"]["NORMAL"]
        # A chord between unit vectors.
        rms["NORMAL"] = float(np.degrees(2 * np.arcsin(rms["NORMAL"] / 2)))
    if "TEXCOORD_0" in largest:
        largest["TEXCOORD_0"] *= TEXELS
        rms["TEXCOORD_0"] *= TEXELS
    return {name: {"max": largest[name], "rms": rms[name]} for name in SHOWN if name in largest}


# --- the document ---


def report(result: dict) -> str:
    """docs/quality.md."""
    rows = [(model, row) for model in result["models"] for row in model["rows"]]

    def percent(length: Callable[[dict], float]) -> Column:
        return lambda of: f"{100 * length(of[1]) / of[0]['longest_side']:.4f}"

    def error(name: str, key: str, form: str = ".3f") -> Column:
        return lambda of: f"{of[1]['errors'][name][key]:{form}}" if name in of[1]["errors"] else ""

    def bits(name: str) -> Column:
        return lambda of: _unless_zero(of[1]["alike"]["bits_per_triangle"][name], ".2f")

    positions: dict[str, Column] = {
        "model, bits": lambda of: f"{of[0]['model']}, {of[1]['bits']}",
        "largest, %": percent(lambda row: row["errors"]["POSITION"]["max"]),
        "rms, %": percent(lambda row: row["errors"]["POSITION"]["rms"]),
        "largest, units": error("POSITION", "max", ".3g"),
        "Hausdorff, %": percent(lambda row: row["surface"]["hausdorff"]),
        "surface rms, %": percent(lambda row: row["surface"]["rms"]),
        "PSNR, dB": lambda of: _unless_zero(of[1]["rendered"]["psnr"], ".1f", "equal"),
        "pixel": lambda of: f"{of[1]['rendered']['largest']:.0f}",
        "positions": lambda of: f"{of[1]['bits_per_triangle']['positions']:.2f}",
        "ratio": lambda of: f"{of[1]['ratio']:.2f}",
    }
    # Two columns have the same heading, hence no mapping.
    attributes: list[tuple[str, Column]] = [
        ("model, bits", positions["model, bits"]),
        ("normals, largest", error("NORMAL", "max")),
        ("rms", error("NORMAL", "rms")),
        ("bits", bits("normals")),
        ("uv, largest", error("TEXCOORD_0", "max")),
        ("rms", error("TEXCOORD_0", "rms")),
        ("bits", bits("texcoords")),
        ("ratio", lambda of: f"{of[1]['alike']['ratio']:.2f}"),
    ]
    cells = [[text(of) for _, text in attributes] for of in rows]
    models: dict[str, Column] = {
        "model": lambda of: of[0]["model"],
        "triangles": lambda of: f"{of[0]['triangles']:,}",
        "longest side, units": lambda of: f"{of[0]['longest_side']:.4g}",
        "ratio at 12 bits": lambda of: f"{of[1]['ratio']:.2f}",
    }
    defaults = [of for of in rows if of[1]["bits"] == PINNED["position_bits"]]
    points, pixels = f"{SAMPLES:,}", f"{WIDTH} x {HEIGHT}"
    return f"""# Quality

{origin_line(result)}
## Positions

Positions have the number of bits after the model's name, normals 8 + 8, texture coordinates 12.
Columns:

* error of vertices: largest and RMS in percent of the bounding box's longest side, largest in model
  units;
* distance between the two surfaces, in percent: sampled at {points} points and as many vertices
  of each. The largest is the (sampled) Hausdorff distance;
* rendered picture of {pixels} pixels against the original's: PSNR, and the largest
  difference of a pixel, of 255. Normals of 8 bits limit both;
* bits per triangle of the positions, and ratio of the whole file.

{table(rows, positions)}
![{PICTURED} at {len(BITS)} settings](quality_models.png)

{PICTURED}: original, and positions of {", ".join(map(str, BITS))} bits; whole, and close up.

## Normals and texture coordinates

All attributes have the number of bits after the model's name (normals: each of two elements).
Errors of normals are in degrees, of texture coordinates in texels of a {TEXELS} x {TEXELS} texture.
"bits" are bits per triangle; the ratio is of the whole file.

{markdown_table([heading for heading, _ in attributes], cells)}
## The models

{table(defaults, models)}"""


def _unless_zero(value: float | None, form: str, otherwise: str = "") -> str:
    return f"{value:{form}}" if value else otherwise


def write_pictures(result: dict) -> list[Path]:
    """docs/quality_models.png: the original and each setting with sizes, whole and close up.

    Compresses the model again.
    """
    rows = next(model["rows"] for model in result["models"] if model["model"] == PICTURED)
    with tempfile.TemporaryDirectory() as folder:
        drawn = _titled_meshes(real_model(PICTURED), rows, Path(folder) / "out.glb")
    before = drawn[0][1]
    views = camera_on(before.positions), camera_on(before.positions, closer=5, lift=0.8)
    size = 330
    height = len(views) * size + 46  # the pictures and the titles above them, in pixels
    figure, axes = pyplot().subplots(
        len(views), len(drawn), dpi=100, figsize=(len(drawn) * size / 100, height / 100)
    )
    figure.subplots_adjust(0, 0, 1, len(views) * size / height, wspace=0.01, hspace=0.01)
    for column, (title, mesh) in enumerate(drawn):
        axes[0, column].set_title(title, fontsize=11)
        for axis, view in zip(axes[:, column], views):
            axis.imshow(
                on_white(rasterize(mesh, view, size, size)).astype(np.uint8), interpolation="none"
            )
            axis.set_axis_off()
    return [save_figure(figure, DOCS / "quality_models.png")]


def _titled_meshes(original: Path, rows: list[dict], output: Path) -> list[tuple[str, Mesh]]:
    """The original and its decoded meshes at all settings, each with its title."""
    raw = rows[0]["compressed_bytes"] * rows[0]["ratio"]
    drawn = [(f"original\n{raw / 1e6:.3f} MB", joined(gltf_ext.load(original)))]
    for row in rows:
        default = ", as elsewhere" if row["bits"] == PINNED["position_bits"] else ""
        size = f"{row['compressed_bytes'] / 1e6:.3f} MB, {row['ratio']:.1f} times smaller"
        gltf_ext.compress(original, output, **{**PINNED, "position_bits": row["bits"]})
        drawn.append((f"{row['bits']} bits{default}\n{size}", joined(gltf_ext.load(output))))
    return drawn


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_names(parser, NAMES)
