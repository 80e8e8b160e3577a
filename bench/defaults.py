"""Do the bits that compress chooses look right? Beside 14, 10 and 12 bits, on twenty real files.

Blender's Draco and glTF-Transform have 14 bits for positions, 10 for normals and 12 for texture
coordinates, and so has gltfpack but for 8 for normals. Each model is drawn with a glossy material,
whole from two sides and close up, from the original and from both compressed files; FLIP says how
much the eye sees of the difference. Writes docs/defaults.md.

Not among them: bistro_like. Small parts of its mesh collapse or join at the bits that are chosen;
`compress` and `verify` name them.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import gltf_ext
from bench.common import origin_line, progress, table
from bench.glossy import SIZE, cameras_of, flip, picture, read_placed
from bench.models import MODELS

PACKAGES = ("gltf-meshlet", "numpy", "flip-evaluator")
PARTS = ("models",)
USUAL = {"position_bits": 14, "normal_bits": 10, "texcoord_bits": 12, "color_bits": 10}
EQUAL = 0.0002  # FLIP errors that differ by less count as equal; they are 0.001 and more
NAMES = (
    "DamagedHelmet",
    "beast",
    "bunny",
    "chinesedragon",
    "engine",
    "igea",
    "materialball",
    "sponza_like",
    "suzanne",
    "nasty/CesiumMilkTruck",
    "nasty/Duck",
    "nasty/Lantern",
    "nasty/SheenCloth_115200",
    "nasty/armor_tangents",
    "nasty/cerberus_tangents",
    "nasty/mosquito_1208comps",
    "nasty/pigman_skinned_37136",
    "nasty/retroufo_77prims",
    "nasty/steampunk_robot_23898",
    "nasty/voyager_1110comps",
)


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.models:
            path = MODELS / f"{name}.glb"
            if not path.is_file():
                raise SystemExit(f"bench: no {name}.glb; set GLTF_MESHLET_MODELS to its folder")
            rows.append(measure_model(name, path, Path(folder) / "out.glb"))
            progress(name)
    return {"rows": rows}


def measure_model(name: str, path: Path, output: Path) -> dict:
    """Size, and FLIP error of each view, of both files."""
    original = read_placed(path)
    cameras = cameras_of(original)
    references = [picture(original, camera) for camera in cameras]
    row = {"model": name.rpartition("/")[2], "triangles": sum(len(p.faces) for p in original)}
    for kind, bits in (("chosen", {}), ("usual", USUAL)):
        report = gltf_ext.compress(path, output, **bits)
        decoded = read_placed(output)
        row[kind] = {
            "bytes": report["totals"]["compressed_bytes"],
            "raw_bytes": report["totals"]["raw_bytes"],
            "flip": [
                flip(reference, picture(decoded, camera))
                for reference, camera in zip(references, cameras)
            ],
            "bits": {name: steps["bits"] for name, steps in report["steps"].items()},
            "collapsed_percent": report["collapsed"]["area_percent"],
        }
    return row


# --- the document ---


def worst(row: dict) -> float:
    """By how much a view of ours has a larger error than the other, at most; below 0 if none."""
    pairs = zip(row["chosen"]["flip"], row["usual"]["flip"])
    return max(chosen - usual for chosen, usual in pairs)


def size(row: dict) -> float:
    """Bytes over those of the other file."""
    return row["chosen"]["bytes"] / row["usual"]["bytes"]


def raw_ratio(rows: list[dict]) -> float:
    """Raw bytes of all models over those of our files."""
    return sum(r["chosen"]["raw_bytes"] for r in rows) / sum(r["chosen"]["bytes"] for r in rows)


def _bits(row: dict, kind: str) -> str:
    values = row["chosen"]["bits"].get(kind, [])
    return " to ".join(map(str, dict.fromkeys(values)))


def _flips(kind: str) -> Callable[[dict], str]:
    return lambda row: ", ".join(f"{value:.4f}" for value in row[kind]["flip"])


COLUMNS: dict[str, Callable[[dict], str]] = {
    "model": lambda row: row["model"],
    "triangles": lambda row: f"{row['triangles']:,}",
    "positions": lambda row: _bits(row, "POSITION"),
    "normals": lambda row: _bits(row, "NORMAL"),
    "texture coordinates": lambda row: _bits(row, "TEXCOORD"),
    "bytes, of 14/10/12": lambda row: f"{size(row):.3f}",
    "FLIP: whole, whole, close": _flips("chosen"),
    "FLIP of 14/10/12": _flips("usual"),
}


def report(result: dict) -> str:
    """docs/defaults.md."""
    rows = result["rows"]
    median = statistics.median(map(size, rows))
    worse = [row["model"] for row in rows if worst(row) > EQUAL]
    means = {
        kind: float(np.mean([row[kind]["flip"] for row in rows])) for kind in ("chosen", "usual")
    }
    verdict = "no worse in any view of any model"
    if worse:
        verdict = f"by at most {max(map(worst, rows)):.4f} worse in a view of {', '.join(worse)}"
    return f"""# Bits that are chosen

{origin_line(result)}
The bits that [`compress` chooses](cli.md#bits-that-are-chosen), beside 14 for positions, 10 for
normals, 12 for texture coordinates and 10 for colours, in the same format. {len(rows)} models:

* bytes of the geometry: {median:.3f} of those of 14/10/12 in the median,
  {min(map(size, rows)):.3f} to {max(map(size, rows)):.3f}; 1/{raw_ratio(rows):.1f} of the raw bytes
  of all;
* FLIP error, 0 for no difference to the eye and 1 at most: {means["chosen"]:.5f} on average, beside
  {means["usual"]:.5f};
  {verdict}
  (differences up to {EQUAL} count as none).

Each model is drawn with a glossy material that reflects a room of lamps and windows, with the
texture of its base colour or a checkerboard of its texture coordinates, {SIZE} x {SIZE} pixels,
whole from two sides and five times as close. Primitives without normals are drawn flat. The error
is that of the picture of the decoded file against that of the original, seen at 67 pixels a degree.
Images of the small models are reduced to a pixel; textures of at most 1,024 texels ask for 12 bits.

{table(rows, COLUMNS)}"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """The option --models."""
    parser.add_argument(
        "--models", nargs="*", default=NAMES, metavar="NAME", help="in GLTF_MESHLET_MODELS"
    )
