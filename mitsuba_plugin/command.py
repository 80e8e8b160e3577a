"""The render command with Mitsuba: a picture of a compressed file."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from gltf_ext.errors import MeshletError, printable
from gltf_ext.files import write_files
from gltf_ext.progress import progress_bar

from . import llvm
from .native import statistics
from .scene import load_scene

FORMATS = {
    ".png": mi.Bitmap.FileFormat.PNG,
    ".exr": mi.Bitmap.FileFormat.OpenEXR,
    ".jpg": mi.Bitmap.FileFormat.JPEG,
}
# Samples per pixel of a pass. The sampler stratifies within a pass; several passes show progress.
PASS_SPP = 16
MAX_WAVEFRONT = 2**22  # samples of a pass: llvm_* variants keep them all in memory


def main(options: argparse.Namespace) -> int:
    """Renders and writes a picture; returns the exit status, 0.

    options: of gltf_meshlet.render_command. Raises MeshletError, OSError.
    """
    output = Path(options.output)
    suffix = output.suffix.lower()
    if suffix not in FORMATS:
        raise MeshletError(
            "the output has an unknown format", f"use one of {' '.join(FORMATS)}", str(output)
        )
    _set_variant(options.variant)
    try:
        start = time.perf_counter()
        scene = _load(options)
        loaded = time.perf_counter()
        with progress_bar(output.name, True) as advance:
            picture = render(scene, options.width, options.height, options.spp, advance)
        seconds = {"load": loaded - start, "render": time.perf_counter() - loaded}
        content = _encoded(picture, suffix)
    except RuntimeError as error:  # of Mitsuba and Dr.Jit
        raise MeshletError(str(error).strip().splitlines()[-1], path=options.input) from None
    write_files({output: [content]}, options.read)
    meshes = sum(s.face_count() for s in scene.shapes() if isinstance(s, mi.Mesh))
    _report(options, seconds, statistics(scene), meshes)
    return 0


def _set_variant(variant: str) -> None:
    if variant not in mi.variants():
        raise MeshletError(
            f"there is no variant {variant}", f"use one of {' '.join(mi.variants())}"
        )
    if variant.startswith("llvm") and not llvm.choose():
        raise MeshletError(
            f"{variant} needs LLVM {llvm.LEAST_VERSION} or newer",
            f"Debian: apt install libllvm19; elsewhere set {llvm.VARIABLE}; "
            "or use --variant scalar_rgb",
        )
    mi.set_log_level(mi.LogLevel.Error)  # it warns whenever it rounds the number of samples
    try:
        mi.set_variant(variant)
    except ImportError as error:
        if not variant.startswith("cuda"):
            raise
        raise MeshletError(
            f"{variant} needs an NVIDIA GPU and its driver: "
            + str(error).splitlines()[0].split(". ")[0].rstrip("."),
            "use --variant scalar_rgb or llvm_ad_rgb",
        ) from None


def _encoded(picture: np.ndarray, suffix: str) -> bytes:
    """The bytes of a picture file: linear floats in .exr, 8-bit sRGB in the others."""
    bitmap, stream = mi.Bitmap(picture), mi.MemoryStream()
    if suffix != ".exr":
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)
    bitmap.write(stream, FORMATS[suffix])
    data: bytes = stream.raw_buffer()
    return data


def _report(
    options: argparse.Namespace, seconds: dict[str, float], figures: dict[str, int], meshes: int
) -> None:
    """meshes: triangles of ordinary meshes."""
    if options.json:
        names = ("output", "backend", "variant", "width", "height", "spp", "lod_error")
        report = {name: getattr(options, name) for name in names} | {
            "accel": "triangles" if figures["block_bytes"] else "cache",
            "seconds": seconds,
            "statistics": figures,
            "mesh_triangles": meshes,
        }
        print(json.dumps(report, indent=2))
        return
    asked = max(figures["hits"] + figures["misses"], 1)
    kept = (
        f"{figures['block_bytes'] / 1e6:.2f} MB of blocks"
        if figures["block_bytes"]
        else f"cache {figures['resident_bytes'] / 1e6:.2f} MB, "
        f"{100 * figures['hits'] / asked:.1f} % hits"
    )
    print(
        f"{printable(options.output)}: {options.width} x {options.height}, "
        f"{options.spp} samples per pixel in {seconds['render']:.1f} s; "
        f"{figures['triangles']:,} triangles in {figures['compressed_bytes'] / 1e6:.2f} MB, {kept}"
        + (f"; {meshes:,} triangles in ordinary meshes" if meshes else "")
    )


def _load(options: argparse.Namespace) -> mi.Scene:
    size = "cache" if isinstance(options.cache, float) else "cache_bytes"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load_scene(
            options.input,
            width=options.width,
            height=options.height,
            spp=options.spp,
            camera=options.camera,
            accel=options.accel,
            **{size: options.cache},
            lod_error=options.lod_error,
        )
    for warning in caught:
        text = str(warning.message).removeprefix(f"{os.path.abspath(options.input)}: ")
        print(
            f"gltf-meshlet: {printable(options.source)}: warning: {printable(text)}",
            file=sys.stderr,
        )
    return scene


def render(
    scene: mi.Scene,
    width: int,
    height: int,
    spp: int,
    advance: Callable[[float], None] | None = None,
) -> np.ndarray:
    """float32[height, width, 3], linear: the mean of several passes with different seeds.

    advance: called with the share done after each pass.
    """
    passes = min(spp, max(spp // PASS_SPP, -(-width * height * spp // MAX_WAVEFRONT)))
    total = np.zeros(1, np.float32)
    for i in range(passes):
        first, last = spp * i // passes, spp * (i + 1) // passes
        seed: Any = i  # the stub asks for a Dr.Jit array
        rendered = np.array(mi.render(scene, spp=last - first, seed=seed))
        total = total + rendered * np.float32((last - first) / spp)
        if advance:
            advance(last / spp)
    return total
