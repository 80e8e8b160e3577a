"""Levels of detail: how they shade, in numbers and in pictures at 1, 2 and 4 pixels of error.

Writes docs/lod_shading.md. --before compares with the builder of an earlier commit, as `bench lod`.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench import lod_build
from bench.common import BITS_TEXT, call_in_process, origin_line, progress, table
from bench.generated import GENERATED, write_generated
from bench.glossy import flip
from bench.models import real_models
from gltf_ext.checks.flips import FlipCounter
from gltf_ext.checks.samples import compare_surfaces
from gltf_ext.lod import LodPrimitive, cut_at_error, open_lod
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import Primitive
from gltf_scene.scene import read_scene
from tools.rasterizer import Camera, visible_surface

PACKAGES = ("gltf-meshlet", "numpy", "meshoptimizer", "flip-evaluator")
DOCUMENT = "lod_shading"
# Nobody has looked at these while the builder was tuned.
UNTUNED = ("suzanne", "materialball", "DamagedHelmet", *GENERATED)
SHARES = tuple(0.0005 * 2**k for k in range(8))  # errors, in longest sides of a primitive
COARSE = (0.03, 0.4)  # of the triangles of level 0, in cuts that count
SAMPLES = 20_000  # of a surface
ANGLES = (15, 30, 60)  # degrees
PIXELS = (1, 2, 4)
SIZE, SAMPLES_OF_PIXEL = 192, 4  # of a picture; along an axis
OFF = 8 / 255  # of a pixel that is off
EDGE = 2  # pixels around an edge of depth that count apart
FIELD = 20.0  # degrees
DIRECTIONS = ((0.35, 0.25, 1.0), (-0.8, 0.5, -0.6), (0.5, -0.4, 0.9))  # towards the cameras
LAMPS = np.array([[-0.5, 0.7, 0.5], [0.8, 0.3, -0.5], [0.0, -0.6, 0.8]])  # towards them
AMBIENT, LAMP = 0.15, 0.4  # light


# --- in a process of its own ---


@dataclass
class Placed:
    """A primitive with levels, its finest one, and a matrix for each place in the scene."""

    levels: LodPrimitive
    finest: Primitive
    matrices: list[np.ndarray]

    @property
    def scale(self) -> float:
        """The largest of its places."""
        return max(float(np.linalg.norm(matrix[:3, :3], 2)) for matrix in self.matrices)


@dataclass
class Scene:
    """The primitives of a file that have levels and normals."""

    primitives: list[Placed]

    @classmethod
    def read(cls, path: str) -> Scene:
        places = {
            (p.mesh, p.primitive): p.matrices for p in read_scene(open_model(path)).primitives
        }
        levels = [p for p in open_lod(path) if isinstance(p, LodPrimitive)]
        found = [(p, places.get((p.compressed.mesh, p.compressed.primitive))) for p in levels]
        placed = [Placed(p, p.compressed.decode(), list(m)) for p, m in found if m is not None]
        return cls([p for p in placed if "NORMAL" in p.finest.attributes])

    def cut(self, error: Callable[[Placed], float]) -> list[Primitive]:
        """The coarsest cuts with these errors."""
        return [p.levels.mesh(cut_at_error(p.levels.tables, error(p))) for p in self.primitives]

    def at_size(self, pixels: float, longest: float, across: float) -> list[Primitive]:
        """The cuts at so many pixels of error, where the longest side has `across` of them."""
        return self.cut(lambda placed: pixels * longest / across / placed.scale)

    def joined(self, meshes: list[Primitive]) -> Primitive:
        """The meshes of the primitives at their places, as one."""
        parts = [
            (mesh.attributes, mesh.indices, matrix)
            for placed, mesh in zip(self.primitives, meshes)
            for matrix in placed.matrices
        ]
        first = np.cumsum([0, *(len(attributes["POSITION"]) for attributes, _, _ in parts)])
        points = [a["POSITION"].astype(float) @ m[:3, :3].T + m[:3, 3] for a, _, m in parts]
        normals = [a["NORMAL"].astype(float) @ np.linalg.pinv(m[:3, :3]) for a, _, m in parts]
        attributes = {"POSITION": np.concatenate(points), "NORMAL": np.concatenate(normals)}
        corners = [indices.astype(np.int64) + start for (_, indices, _), start in zip(parts, first)]
        return Primitive(0, 0, np.concatenate(corners), attributes)

    @property
    def triangles(self) -> int:
        return sum(len(p.finest.indices) for p in self.primitives)


def of_file(path: str, sizes: list[float] | None) -> dict:
    """Flips, angles and pictures of a file with levels. sizes: of pictures, as pictures_of."""
    scene = Scene.read(path)
    if not scene.primitives:
        return {"cuts": [], "pictures": []}
    return {"cuts": cuts_of(scene), "pictures": pictures_of(scene, sizes)}


def longest_side(primitive: Primitive) -> float:
    return float(np.ptp(primitive.attributes["POSITION"], axis=0).max())


def cuts_of(scene: Scene) -> list[dict]:
    """Of cuts at each of SHARES: triangles, flips and angles over all primitives."""
    counters = [FlipCounter(placed.finest) for placed in scene.primitives]
    return [cut_of(scene, counters, share) for share in SHARES]


def cut_of(scene: Scene, counters: list[FlipCounter], share: float) -> dict:
    nowhere = np.zeros((1, 3), np.float32)  # distances from level 0 do not matter here
    meshes = scene.cut(lambda placed: share * longest_side(placed.finest))
    angles, texcoords, weights, flips = [], [], [], 0
    for mesh, placed, counter in zip(meshes, scene.primitives, counters):
        finest, error = placed.finest, share * longest_side(placed.finest)
        shading = compare_surfaces(mesh, finest, nowhere, SAMPLES, error)[1]
        angles.append(shading["NORMAL"])
        # Primitives count by their triangles: their units may differ.
        weights.append(np.full(len(angles[-1]), len(finest.indices) / len(angles[-1])))
        texcoords.append(shading.get("TEXCOORD_0", np.zeros(len(angles[-1]))))
        flips += counter.count(mesh).corners
    angle, weight = np.concatenate(angles), np.concatenate(weights)
    triangles = sum(len(mesh.indices) for mesh in meshes)
    return {
        "share": share,
        "triangles": triangles,
        "of_level_0": triangles / scene.triangles,
        "flips": flips,
        "angle": percentiles(angle, weight),
        "above": [float(weight[angle > a].sum() / weight.sum()) for a in ANGLES],
        "texcoord": percentiles(np.concatenate(texcoords), weight),
    }


def percentiles(values: np.ndarray, weights: np.ndarray) -> list[float]:
    """The values that 99 and 99.9 % of the weight do not exceed."""
    order = np.argsort(values)
    sums = np.cumsum(weights[order]) / weights.sum()
    places = np.minimum(np.searchsorted(sums, (0.99, 0.999)), len(order) - 1)
    return values[order[places]].tolist()


# --- pictures ---


@dataclass
class Picture:
    """colours: float32[SIZE, SIZE, 3], sRGB; nearest, farthest: float[SIZE, SIZE]: depths in each
    pixel, infinite at the background."""

    colours: np.ndarray
    nearest: np.ndarray
    farthest: np.ndarray


def pictures_of(scene: Scene, sizes: list[float] | None) -> list[dict]:
    """For each of PIXELS the share of the model's pixels that are off, over DIRECTIONS.

    sizes: pixels of the longest side for each of them; None for those of size_of.
    """
    whole = scene.joined([placed.finest for placed in scene.primitives])
    longest = longest_side(whole)
    rows = []
    for number, pixels in enumerate(PIXELS):
        across = sizes[number] if sizes else size_of(scene, pixels, longest)
        meshes = scene.at_size(pixels, longest, across)
        level = scene.joined(meshes)
        cameras = [camera_of(whole, direction, longest, across) for direction in DIRECTIONS]
        views = [difference(picture(whole, c), picture(level, c)) for c in cameras]
        inner, edges, flips = (list(column) for column in zip(*views))
        rows.append(
            {
                "pixels": pixels,
                "longest_side_pixels": across,
                "triangles": len(level.indices),
                "of_level_0": len(level.indices) / len(whole.indices),
                "off": float(np.mean(inner)),
                "off_worst": max(inner),
                "off_at_edges": float(np.mean(edges)),
                "flip": float(np.mean(flips)),
            }
        )
    return rows


def size_of(scene: Scene, pixels: float, longest: float) -> float:
    """Pixels of the longest side: the most at which the cut has COARSE[1] of the triangles."""
    across = 4096.0
    while across > 64:
        meshes = scene.at_size(pixels, longest, across)
        if sum(len(mesh.indices) for mesh in meshes) <= COARSE[1] * scene.triangles:
            break
        across /= 2**0.5
    return across


def camera_of(
    whole: Primitive, direction: tuple[float, float, float], longest: float, across: float
) -> Camera:
    """One that sees the longest side as so many pixels; near, if that is more than a picture."""
    positions = whole.attributes["POSITION"].astype(np.float64)
    towards = np.array(direction) / np.linalg.norm(direction)
    target = (positions.min(axis=0) + positions.max(axis=0)) / 2
    if across > SIZE:
        target = positions[np.argmax(positions @ towards)]
    distance = longest * SIZE / across / 2 / np.tan(np.radians(FIELD) / 2)
    return Camera(tuple(target + distance * towards), tuple(target), FIELD)


def picture(mesh: Primitive, camera: Camera) -> Picture:
    side = SIZE * SAMPLES_OF_PIXEL
    positions = mesh.attributes["POSITION"].astype(np.float64)
    view = np.array(camera.target) - camera.eye
    depth_of = (positions - camera.eye) @ view / np.linalg.norm(view)
    is_before = (depth_of > 0.01 * np.linalg.norm(view))[mesh.indices].all(axis=1)
    faces = mesh.indices[is_before].astype(np.int64)
    surface = visible_surface(positions, faces, camera, side, side)
    normals = surface.interpolate(mesh.attributes["NORMAL"].astype(np.float64))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    lamps = LAMPS / np.linalg.norm(LAMPS, axis=1, keepdims=True)
    light = np.zeros(side * side)
    # One-sided: what faces away from its normal is as dark as in a renderer that trusts normals.
    light[surface.pixels] = AMBIENT + LAMP * np.maximum(normals @ lamps.T, 0.0).sum(axis=1)
    depth = np.full(side * side, np.inf)
    depth[surface.pixels] = surface.interpolate(depth_of[:, None])[:, 0]
    blocks = SIZE, SAMPLES_OF_PIXEL, SIZE, SAMPLES_OF_PIXEL
    grey = np.minimum(light.reshape(blocks).mean(axis=(1, 3)), 1.0) ** (1 / 2.2)
    depth = depth.reshape(blocks)
    colours = np.repeat(grey.astype(np.float32)[..., None], 3, axis=2)
    return Picture(colours, depth.min(axis=(1, 3)), depth.max(axis=(1, 3)))


def difference(reference: Picture, test: Picture) -> tuple[float, float, float]:
    """(Share of the model's pixels that are off, away from edges and near them; FLIP)."""
    is_off = np.abs(reference.colours - test.colours).max(axis=2) > OFF
    is_inside = np.isfinite(reference.farthest) & np.isfinite(test.farthest)
    is_inside &= ~near_edge(reference.farthest)
    is_edge = (np.isfinite(reference.nearest) | np.isfinite(test.nearest)) & ~is_inside
    return (
        float(is_off[is_inside].mean()) if is_inside.any() else 0.0,
        float(is_off[is_edge].mean()) if is_edge.any() else 0.0,
        flip(reference.colours, test.colours),
    )


def near_edge(depth: np.ndarray) -> np.ndarray:
    """bool[SIZE, SIZE]: whether a pixel lies within EDGE pixels of a jump in depth."""
    finite = np.isfinite(depth)
    jump = 0.02 * np.ptp(depth[finite]) if finite.any() else 0.0
    known = np.where(finite, depth, 1e30)
    is_edge = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        is_jump = np.abs(np.diff(known, axis=axis)) > jump
        pad = [(0, 0), (0, 0)]
        for side in ((0, 1), (1, 0)):
            pad[axis] = side
            is_edge |= np.pad(is_jump, pad)
    for _ in range(EDGE - 1):
        grown = is_edge.copy()
        for axis in (0, 1):
            grown |= np.roll(is_edge, 1, axis) | np.roll(is_edge, -1, axis)
        is_edge = grown
    return is_edge


# --- the question ---


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--models", nargs="*", metavar="NAME", help="some of the models")
    lod_build.add_before(parser)


def check(options: argparse.Namespace) -> None:
    """Ends the program if --before names a Python with the package of this commit."""
    if options.before:
        lod_build.require_other_package("lod_shading", options.before[1])


def measure(options: argparse.Namespace) -> dict:
    """All models, with the builder and with the earlier one: pictures of equal sizes."""
    commit, python = options.before or (None, None)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        paths = [*real_models(), *write_generated(Path(folder))]
        chosen = [p for p in paths if not options.models or p.stem in options.models]
        rows = list(pool.map(lambda path: row_of(path, Path(folder), python), chosen))
    return {"before": commit, "rows": rows}


def row_of(path: Path, folder: Path, python: str | None) -> dict:
    progress(path.stem)
    row, sizes = {"model": path.stem}, None
    if python:
        row["before"] = of_model(path, folder, sizes, {"python": python})
        sizes = [picture["longest_side_pixels"] for picture in row["before"]["pictures"]]
    return {**row, "now": of_model(path, folder, sizes, {})}


def of_model(path: Path, folder: Path, sizes: list[float] | None, process: dict) -> dict:
    output, options = str(folder / f"{path.stem}.lod.glb"), {"lod": True}
    built = call_in_process("bench.lod_build", "build", str(path), output, options, **process)
    built.pop("levels")
    return {**built, **call_in_process("bench.lod_shading", "of_file", output, sizes)}


def report(result: dict) -> str:
    """docs/lod_shading.md."""
    rows = [
        {"builder": name, "model": row["model"], **row[key]}
        for row in result["rows"]
        for key, name in (("before", result["before"]), ("now", "this one"))
        if key in row and row[key]["cuts"]
    ]
    low, high = COARSE
    untuned = [row["model"] for row in result["rows"] if row["model"] in UNTUNED]
    return (
        "# Levels of detail: shading\n\n"
        f"{origin_line(result)}\n"
        f"At {BITS_TEXT}. Models that the builder was not tuned on: {', '.join(untuned)}.\n\n"
        "## Flips and angles\n\n"
        f"Cuts at errors of {100 * SHARES[0]:g} to {100 * SHARES[-1]:g} % of a primitive's longest "
        f"side that have {low:.0%} to {high:.0%} of the triangles of level 0; sums and means over "
        "them. Flips: corners whose normal points against the triangle, where level 0 has none. "
        f"Angles to the normal of level 0, by area. {SAMPLES // 8:,} samples of a primitive.\n\n"
        f"{shading_table(rows)}\n"
        "## Pictures\n\n"
        f"{SIZE} x {SIZE} pixels of {SAMPLES_OF_PIXEL**2} samples, three views, lit from three "
        "sides, without textures; at the largest size at which the cut has at most "
        f"{high:.0%} of the triangles. Share of the model's pixels off by more than 8 of 255, "
        f"and of those within {EDGE} pixels of an edge of depth, which do not count there; FLIP: 0 "
        "for no difference to the eye.\n\n"
        f"{picture_table(rows)}"
    )


def shading_table(rows: list[dict]) -> str:
    def coarse(row: dict) -> list[dict]:
        return [c for c in row["cuts"] if COARSE[0] <= c["of_level_0"] <= COARSE[1]]

    def mean(value: Callable[[dict], float]) -> Callable[[dict], str]:
        return lambda row: f"{np.mean([value(c) for c in coarse(row)] or [0]):.3g}"

    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda row: row["model"],
        "builder": lambda row: row["builder"],
        "file": lambda row: f"{row['bytes'] / 1e6:.3f} MB",
        "processor time": lambda row: f"{row['cpu_seconds']:.1f} s",
        "triangles of all cuts": lambda row: f"{sum(c['triangles'] for c in row['cuts']):,}",
        "flips": lambda row: f"{sum(c['flips'] for c in coarse(row)):,}",
        "99 % of angles": mean(lambda c: c["angle"][0]),
        "99.9 %": mean(lambda c: c["angle"][1]),
        **{
            f"over {a} degrees, %": mean(lambda c, k=k: 100 * c["above"][k])
            for k, a in enumerate(ANGLES)
        },
    }
    return table(rows, columns)


def picture_table(rows: list[dict]) -> str:
    lines = [
        {"model": row["model"], "builder": row["builder"], **line}
        for row in rows
        for line in row["pictures"]
    ]
    columns: dict[str, Callable[[dict], str]] = {
        "model": lambda line: line["model"],
        "builder": lambda line: line["builder"],
        "pixels of error": lambda line: f"{line['pixels']}",
        "longest side, pixels": lambda line: f"{line['longest_side_pixels']:.0f}",
        "triangles": lambda line: f"{line['triangles']:,}",
        "off": lambda line: f"{100 * line['off']:.2f} %",
        "worst view": lambda line: f"{100 * line['off_worst']:.2f} %",
        "at edges": lambda line: f"{100 * line['off_at_edges']:.2f} %",
        "FLIP": lambda line: f"{line['flip']:.4f}",
    }
    return table(lines, columns)
