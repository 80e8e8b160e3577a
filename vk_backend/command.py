"""`gltf-meshlet render` with `--backend vulkan`."""

from __future__ import annotations

import argparse
import io
import json
import statistics
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from gltf_ext.errors import MeshletError, printable
from gltf_ext.files import write_files
from gltf_ext.lod.detail import missing_levels
from gltf_ext.progress import progress_bar

from .gpu import vk
from .gpu.errors import VulkanError
from .gpu.pipelines import Compiler
from .renderer import PATHS, Picture, Renderer, cache_bytes
from .scene.background import before_sky
from .scene.camera import Camera
from .scene.scene import Scene, load_scene

if TYPE_CHECKING:
    from .raytrace.rays import TracedPicture

GIF_MILLISECONDS = 50  # per picture of an animation

Draw = Callable[[Camera], "Picture | TracedPicture"]


def main(options: argparse.Namespace) -> int:
    """Renders and writes the pictures; returns the exit status 0.

    options: those of gltf_meshlet.render_command; started: time.perf_counter() at the command's
    start. Raises MeshletError or OSError; then it writes
    nothing.
    """
    try:
        return _render(options)
    except vk.VkError as error:  # with no better message from the code that failed
        raise VulkanError(
            f"the driver refused: {type(error).__name__}",
            "update it, or choose another --device or --path",
        ) from None


def _render(options: argparse.Namespace) -> int:
    output = Path(options.output)
    _check_output(output, options.frames)
    scene = load_scene(options.input, levels=options.lod_error > 0)
    missing = missing_levels(scene.document) if scene.has_levels else []
    for warning in scene.warnings + missing:
        print(f"gltf-meshlet: warning: {printable(warning)}", file=sys.stderr)
    cameras = _turn(scene, _camera(scene, options), options.frames)
    pictures: list[np.ndarray] = []
    times: list[float] = []
    drawn: list[Picture] = []  # of paths other than rt
    with ExitStack() as stack:
        renderer = stack.enter_context(
            Renderer(options.device, options.validate, pages=options.pages)
        )
        path = options.path or _default_path(renderer, scene)
        if path == "rt" and scene.has_levels:
            from .levels.cut_scene import cut_scene

            size = options.width, options.height
            scene = cut_scene(scene, cameras[0], *size, options.lod_error)
        draw, resident = _drawing(renderer, scene, path, options)
        advance = stack.enter_context(progress_bar(output.name, True))
        for number, camera in enumerate(cameras, start=1):
            picture = draw(camera)
            pictures.append(before_sky(picture.color, camera))
            times.append(picture.milliseconds)
            if number == 1:
                first_seconds = time.perf_counter() - options.started
                pipelines = Compiler.of(renderer.device).statistics()
            if isinstance(picture, Picture):
                drawn.append(picture)
            if advance:
                advance(number / len(cameras))
        report = {
            "output": options.output,
            "backend": "vulkan",
            "path": path,
            "device": renderer.device.name,
            "width": options.width,
            "height": options.height,
            "frames": options.frames,
            "milliseconds": statistics.median(times),
            "steps": _median_steps(drawn),
            "triangles": scene.triangles,
            "compressed_bytes": scene.compressed_bytes,
            "resident_bytes": resident(),
            "first_picture_seconds": first_seconds,
            "pipelines": pipelines,
        }
        kept = [asdict(picture.pool) for picture in drawn if picture.pool]
        if kept:
            report["levels" if scene.has_levels else "pool"] = kept
        tasks = [asdict(picture.tasks) for picture in drawn if picture.tasks]
        if tasks:
            report["tasks"] = tasks
        warnings = [f"{e}; a coarser level is shown" for e in renderer.refused_pages]
        said = list(dict.fromkeys(renderer.device.messages))
    write_files(_files(output, pictures), options.read)
    for warning in warnings:
        print(f"gltf-meshlet: warning: {printable(warning)}", file=sys.stderr)
    for message in said:
        print(f"gltf-meshlet: validation: {' '.join(message.split())}", file=sys.stderr)
    print(json.dumps(report, indent=2) if options.json else _line(report))
    return 0


def _median_steps(pictures: list[Picture]) -> dict[str, float]:
    steps = pictures[0].steps if pictures else {}
    return {s: statistics.median(p.steps[s] for p in pictures) for s in steps}


def _check_output(output: Path, frames: int) -> None:
    suffixes = (".png",) if frames == 1 else (".png", ".gif")
    if output.suffix.lower() not in suffixes:
        raise MeshletError(
            "the output has an unknown format", f"use {' or '.join(suffixes)}", str(output)
        )


def _camera(scene: Scene, options: argparse.Namespace) -> Camera:
    if not scene.cameras:
        if options.frames > 1:  # the scene turns: no side of it may leave the picture
            return Camera.fit_box(scene.low, scene.high, options.width, options.height)
        return Camera.fit(scene, options.width, options.height)
    if not 0 <= options.camera < len(scene.cameras):
        raise MeshletError(
            f"camera {options.camera} does not exist",
            f"there are {len(scene.cameras)}",
            options=("camera",),
        )
    camera: Camera = scene.cameras[options.camera]
    return camera


def _turn(scene: Scene, camera: Camera, frames: int) -> list[Camera]:
    """`frames` cameras on a circle around the centre of the scene, from the given one on."""
    center = (scene.low + scene.high) / 2
    cameras = []
    for angle in 2 * np.pi * np.arange(frames) / frames:
        turn = np.eye(4)
        turn[0, 0] = turn[2, 2] = np.cos(angle)
        turn[0, 2], turn[2, 0] = np.sin(angle), -np.sin(angle)
        turn[:3, 3] = center - turn[:3, :3] @ center
        cameras.append(replace(camera, to_world=turn @ camera.to_world) if angle else camera)
    return cameras


def _default_path(renderer: Renderer, scene: Scene) -> str:
    path = renderer.default_path(scene)
    if path == "vertex":
        print(
            f"gltf-meshlet: {renderer.device.name} has neither 64-bit atomics nor mesh shaders; "
            "the model is decompressed and drawn by path vertex",
            file=sys.stderr,
        )
    return path


def _cache_bytes(scene: Scene, path: str, cache: int | float | None) -> int | None:
    """cache: bytes, or a share as a float."""
    if not isinstance(cache, float):
        return cache
    if scene.has_levels:
        raise VulkanError("with levels of detail the cache is a number of bytes", "for example 64M")
    return cache_bytes(scene, path, cache)


def _drawing(
    renderer: Renderer, scene: Scene, path: str, options: argparse.Namespace
) -> tuple[Draw, Callable[[], int]]:
    """(function that draws with a path, function that returns its bytes of device memory)"""
    renderer.cache = _cache_bytes(scene, path, options.cache)
    if path in PATHS:

        def draw(camera: Camera) -> Picture:
            return renderer.render(
                scene,
                camera,
                path,
                options.width,
                options.height,
                ids=False,
                steps=options.json,
                lod_error=options.lod_error,
            )

        return draw, lambda: renderer.resident_bytes
    from .raytrace.tracer import RayTracer

    tracer = RayTracer(renderer.device, scene, cache=renderer.cache, bounces=options.bounces)

    def trace(camera: Camera) -> TracedPicture:
        return tracer.render(camera, options.width, options.height)

    return trace, lambda: sum(tracer.resident_bytes().values())


def _files(output: Path, pictures: list[np.ndarray]) -> dict[Path, list[bytes]]:
    """Path -> contents of the output files: one picture, numbered ones, or an animation."""
    if output.suffix.lower() == ".gif":
        return {output: [_animation(pictures)]}
    if len(pictures) == 1:
        return {output: [_png(pictures[0])]}
    digits = len(str(len(pictures)))
    return {
        output.with_name(f"{output.stem}_{number:0{digits}}{output.suffix}"): [_png(picture)]
        for number, picture in enumerate(pictures, start=1)
    }


def _png(picture: np.ndarray) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG")
    return file.getvalue()


def _animation(pictures: list[np.ndarray]) -> bytes:
    """The bytes of a .gif that repeats."""
    file = io.BytesIO()
    frames = [Image.fromarray(picture).convert("RGB") for picture in pictures]
    frames[0].save(
        file, "GIF", save_all=True, append_images=frames[1:], duration=GIF_MILLISECONDS, loop=0
    )
    return file.getvalue()


def _line(report: dict[str, Any]) -> str:
    first, pipelines = report["first_picture_seconds"], report["pipelines"]["seconds"]
    frames = f"{report['frames']} frames, " if report["frames"] > 1 else ""
    if "levels" in report:
        last = report["levels"][-1]
        levels = f"{last['triangles']:,} drawn at {last['shown_pixels']:.3g} pixels of error, "
    else:
        levels = ""
    return (
        f"{printable(report['output'])}: {report['width']} x {report['height']}, {frames}"
        f"path {report['path']} on {report['device']}, {report['milliseconds']:.2f} ms a frame; "
        f"{report['triangles']:,} triangles, {levels}"
        f"{report['compressed_bytes'] / 1e6:.2f} MB compressed, "
        f"{report['resident_bytes'] / 1e6:.2f} MB on the device; first picture after "
        f"{first:.1f} s (pipelines {pipelines:.1f} s)"
    )
