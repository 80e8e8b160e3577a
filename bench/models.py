"""The models that are measured: real ones by name, files named on the command line, generated ones.

Real models lie in the folder that GLTF_MESHLET_MODELS names, by default shared/models beside the
repository.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import gltf_ext
from bench.common import BITS, ROOT
from bench.generated import torus, write_generated
from bench.large_model import write_displaced
from gltf_ext.attributes.extension import compressed_primitives, require_compressed
from gltf_ext.sources.importers import open_model
from gltf_meshlet.demo.model import write_glb

MODELS = Path(os.environ.get("GLTF_MESHLET_MODELS") or ROOT.parent / "shared" / "models")

# The six models of the paper's comparison and what we have for them.
PAPER_MODELS = {
    "suzanne": "Suzanne, with the paper's counts",
    "bunny": "Stanford Bunny, the paper's number of triangles, an atlas with more seams",
    "materialball": "a shader ball, stands in for Material Ball",
    "sponza_like": "a composite, stands in for Sponza",
    "dragon": "Stanford Dragon, the paper's number of triangles, no texture coordinates",
    "bistro_like": "a composite, stands in for the Bistro interior",
}
OTHER_MODELS = {
    "beast": "a character, texture coordinates with seams",
    "chinesedragon": "a closed statue, texture coordinates on its small second primitive only",
    "DamagedHelmet": "a hard-edged sample model of few triangles",
    "engine": "a CAD engine of 34 primitives, hard edges",
    "igea": "a closed scan",
}


# --- real models ---


def real_models() -> list[Path]:
    """All real models, by name. Ends the program if there are none."""
    found = sorted(MODELS.glob("*.glb"), key=lambda path: path.name.lower())
    return found or _end_without(".glb files")


def all_models() -> Iterator[Path]:
    """The real models, then generated ones, which exist until the last was taken."""
    with tempfile.TemporaryDirectory() as folder:
        yield from [*real_models(), *write_generated(Path(folder))]


def real_model(name: str) -> Path:
    """The file of one real model. Ends the program if it is missing."""
    path = MODELS / f"{name}.glb"
    return path if path.is_file() else _end_without(path.name)


def _end_without(files: str) -> NoReturn:
    raise SystemExit(
        f"bench: no {files} in {os.path.relpath(MODELS)}; "
        "set GLTF_MESHLET_MODELS to a folder of models"
    )


def add_model_names(parser: argparse.ArgumentParser, names: tuple[str, ...]) -> None:
    """The option --models; `names` is its default."""
    text = "real models (default: %(default)s)"
    parser.add_argument("--models", nargs="*", default=names, metavar="NAME", help=text)


def torus_and_named(names: list[str], triangles: int, folder: Path) -> dict[str, Path]:
    """Files by name: a torus of about so many triangles, written to `folder`, and real models."""
    paths = {name: real_model(name) for name in names}
    write_glb([torus(triangles)], folder / "torus.glb")
    return {"torus": folder / "torus.glb", **paths}


def blobs_of(path: Path) -> list[bytes]:
    """All blobs of a compressed file. Raises MeshletError."""
    return [blob for p in require_compressed(open_model(path)) for blob in p.blobs]


# --- files named on the command line, for measurements on a GPU ---


def add_gpu_options(parser: argparse.ArgumentParser) -> None:
    """The arguments that name files, for `model_files`, and the GPU."""
    parser.add_argument(
        "models", nargs="*", type=Path, help=".glb files; uncompressed ones are compressed first"
    )
    parser.add_argument(
        "--subdivide",
        type=Path,
        action="append",
        default=[],
        metavar="MODEL",
        help="also measure this model with four times its triangles",
    )
    parser.add_argument("--device", help="number or part of the name (default: the first GPU)")


def check_model_files(options: argparse.Namespace) -> None:
    """Ends the program if the command line names no model."""
    if not options.models and not options.subdivide:
        raise SystemExit("bench: name at least one model")


def model_files(options: argparse.Namespace, folder: Path) -> list[Path]:
    """Compressed files of the models; new ones are written to `folder`."""
    return [compressed(path, folder) for path in options.models] + [
        subdivided(path, folder) for path in options.subdivide
    ]


def compressed(path: Path, folder: Path) -> Path:
    """The file itself if it is compressed, otherwise a compressed copy in `folder`."""
    if compressed_primitives(open_model(path)):
        return path
    output = folder / f"{path.stem}.glb"
    gltf_ext.compress(path, output, **BITS)
    return output


def subdivided(path: Path, folder: Path) -> Path:
    """A compressed model of the file's first primitive with four times its triangles."""
    raw = write_displaced(path, 2, folder / "raw.glb", noise=0.0)
    output = folder / f"{path.stem}_x4.glb"
    gltf_ext.compress(raw, output, **BITS)
    return output
