"""`gltf-meshlet render`: a picture of a compressed file, rendered without decompressing it."""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from pathlib import Path

import mitsuba as mi
import numpy as np

from gltf_ext.errors import MeshletError
from gltf_ext.progress import progress_bar

from .native import statistics
from .scene import load_scene

VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "scalar_spectral", "llvm_ad_spectral")
SUFFIXES = (".png", ".exr", ".jpg")
PASSES = 16  # steps of the progress bar


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command's arguments."""
    parser.add_argument("input", metavar="SCENE.glb", help="compressed .glb or .gltf")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=f"one of {' '.join(SUFFIXES)}")
    parser.add_argument(
        "--variant",
        choices=VARIANTS,
        default=VARIANTS[0],
        help="of Mitsuba (default %(default)s; llvm_* is faster and needs libLLVM)",
    )
    parser.add_argument("--spp", type=int, default=64, metavar="N", help="samples per pixel (default %(default)s)")
    parser.add_argument("--width", type=int, default=800, metavar="N", help="(default %(default)s)")
    parser.add_argument("--height", type=int, default=600, metavar="N", help="(default %(default)s)")
    parser.add_argument(
        "--camera", type=int, default=0, metavar="N", help="which of the file's cameras (default %(default)s)"
    )
    parser.add_argument(
        "--cache",
        type=float,
        default=0.25,
        metavar="X",
        help="share of the decoded geometry that may stay in memory, 0 to 1 (default %(default)s)",
    )
    parser.add_argument("--cache-bytes", type=int, metavar="N", help="the same limit in bytes")


def main(options: argparse.Namespace) -> int:
    """Renders and writes the picture; returns the exit status 0. Raises MeshletError, OSError."""
    output = Path(options.output)
    _check(options, output)
    try:
        mi.set_variant(options.variant)
        scene = _load(options)
        start = time.perf_counter()
        with progress_bar(output.name, True) as advance:
            picture = _render(scene, options.spp, advance)
        seconds = time.perf_counter() - start
    except RuntimeError as error:  # Mitsuba's and Dr.Jit's own
        raise MeshletError(str(error).strip().splitlines()[-1], path=options.input) from None
    partial = output.with_name(
        f".{output.stem}.{os.getpid()}.part{output.suffix}"
    )  # Mitsuba takes the format from the suffix
    try:
        mi.util.write_bitmap(str(partial), mi.Bitmap(picture), write_async=False)
        partial.replace(output)
    finally:
        partial.unlink(missing_ok=True)
    s = statistics(scene)
    asked = max(s["hits"] + s["misses"], 1)
    print(
        f"{output}: {options.width} x {options.height}, {options.spp} samples per pixel in {seconds:.1f} s; {s['triangles']:,} triangles in "
        f"{s['compressed_bytes'] / 1e6:.2f} MB, cache {s['resident_bytes'] / 1e6:.2f} MB, {100 * s['hits'] / asked:.1f} % hits"
    )
    return 0


def _load(options: argparse.Namespace) -> mi.Scene:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load_scene(
            options.input,
            width=options.width,
            height=options.height,
            spp=options.spp,
            camera=options.camera,
            cache=options.cache,
            cache_bytes=options.cache_bytes,
        )
    for warning in caught:
        print(f"gltf-meshlet: warning: {warning.message}", file=sys.stderr)
    return scene


def _check(options: argparse.Namespace, output: Path) -> None:
    if output.suffix.lower() not in SUFFIXES:
        raise MeshletError("the output has an unknown format", f"use one of {' '.join(SUFFIXES)}", str(output))
    for name in ("spp", "width", "height"):
        if getattr(options, name) < 1:
            raise MeshletError(f"--{name} is {getattr(options, name)}", "it must be at least 1")
    if not 0 <= options.cache <= 1:
        raise MeshletError(f"--cache is {options.cache}", "it must be between 0 and 1")
    if options.cache_bytes is not None and options.cache_bytes < 0:
        raise MeshletError(f"--cache-bytes is {options.cache_bytes}", "it must not be negative")


def _render(scene: mi.Scene, spp: int, advance) -> np.ndarray:
    """The mean of passes with different seeds, so that there is progress to report."""
    passes = min(spp, PASSES) if advance else 1
    total = np.zeros(1, np.float32)
    for i in range(passes):
        first, last = spp * i // passes, spp * (i + 1) // passes
        total = total + np.array(mi.render(scene, spp=last - first, seed=i)) * np.float32((last - first) / spp)
        if advance:
            advance(last / spp)
    return total
