"""`gltf-meshlet render`: its options, and which renderer they go to.

A renderer is a module with `main(options) -> exit status` that raises MeshletError and OSError; it is imported when it is
asked for, since neither is needed for anything else here. It reads `options.input`, which is compressed, and speaks of
`options.source`, what the user named.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gltf_ext.errors import MeshletError

RENDERERS = {"mitsuba": "mitsuba_plugin.command", "vulkan": "vk_backend.command"}
PATHS = (
    "stream",
    "mesh",
    "mesh-only",
    "geometry",
    "vertex",
    "mesh-plain",
    "rt",
    "rt-plain",
    "rt-triangles",
)
# The options that one renderer alone has, and what they are where they are not given.
OWN_OPTIONS = {
    "mitsuba": {"variant": "scalar_rgb", "spp": 64},
    "vulkan": {
        "path": None,
        "device": None,
        "ring": None,
        "bounces": 0,
        "frames": 1,
        "validate": False,
    },
}
# Of the GPU's paths, those that have an option; None: the path is left to the device, which takes none with rays.
PATHS_WITH = {
    "cache": ("rt",),
    "cache_bytes": ("rt",),
    "bounces": ("rt", "rt-plain", "rt-triangles"),
    "ring": ("stream", None),
}
# Misses cost a GPU far more than a CPU, and a full cache is still a third of what uncompressed triangles take there.
CACHE = {"mitsuba": 0.25, "vulkan": 1.0}
LARGEST_SIDE = 16384  # pixels


def add_arguments(command: argparse.ArgumentParser) -> None:
    """The options of `render`; its input is there already."""
    command.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="picture to write: .png, with Mitsuba .exr and .jpg too",
    )
    command.add_argument(
        "--backend",
        choices=RENDERERS,
        default="mitsuba",
        help="path tracing on the CPU, or the GPU (default %(default)s)",
    )
    command.add_argument(
        "--width", type=int, default=800, metavar="N", help="pixels (default %(default)s)"
    )
    command.add_argument(
        "--height", type=int, default=600, metavar="N", help="pixels (default %(default)s)"
    )
    command.add_argument(
        "--camera", type=int, default=0, metavar="N",
        help="which of the file's cameras (default %(default)s); where there is none, everything is in view",
    )  # fmt: skip
    command.add_argument(
        "--cache", type=float, metavar="X",
        help="share of the decoded geometry that may stay in memory, 0 to 1; with --path rt what stays for certain: slots for two "
        "thirds of the rest come on top (default " + ", ".join(f"{share} with {backend}" for backend, share in CACHE.items()) + ")",
    )  # fmt: skip
    command.add_argument("--cache-bytes", type=int, metavar="N", help="the same in bytes")
    command.add_argument("--json", action="store_true", help="print JSON instead of the line")
    mitsuba, vulkan = (
        command.add_argument_group(f"with --backend {backend}") for backend in RENDERERS
    )
    mitsuba.add_argument(
        "--variant",
        metavar="NAME",
        help=f"of Mitsuba: scalar_* or llvm_* (default {OWN_OPTIONS['mitsuba']['variant']}); llvm_* needs LLVM",
    )
    mitsuba.add_argument(
        "--spp",
        type=int,
        metavar="N",
        help=f"samples per pixel (default {OWN_OPTIONS['mitsuba']['spp']})",
    )
    vulkan.add_argument(
        "--path",
        choices=PATHS,
        help="how it is decoded and drawn; rt*: with ray tracing (default: what suits the device)",
    )
    vulkan.add_argument(
        "--device",
        metavar="DEVICE",
        help="its number, or a part of its name (default: the first GPU)",
    )
    vulkan.add_argument(
        "--ring",
        type=int,
        metavar="N",
        help="meshlets that path stream has decoded at a time, at most (default: 8192)",
    )
    vulkan.add_argument(
        "--bounces", type=int, metavar="N", help="diffuse bounces of the rt paths (default 0)"
    )
    vulkan.add_argument(
        "--frames",
        type=int,
        metavar="N",
        help="frames of a turn round the scene: numbered pictures, or one .gif (default 1)",
    )
    vulkan.add_argument(
        "--validate", action="store_true", default=None, help="with the Vulkan validation layer"
    )


def run(options: argparse.Namespace) -> int:
    """Renders; returns the exit status. Raises MeshletError, OSError."""
    _check(options)
    renderer = _renderer(options.backend)
    with _compressed(options.input) as path:
        try:
            return renderer.main(
                argparse.Namespace(**{**vars(options), "input": path, "source": options.input})
            )
        except MeshletError as error:
            error.path = options.input if error.path == path else error.path
            raise


def _check(options: argparse.Namespace) -> None:
    """What no renderer can do is refused; options that were not given get their values."""
    for name in ("width", "height"):
        if not 1 <= getattr(options, name) <= LARGEST_SIDE:
            raise MeshletError(
                f"{name} is {getattr(options, name)}", f"use 1 to {LARGEST_SIDE}", options=(name,)
            )
    for name, paths in PATHS_WITH.items():
        if (
            options.backend == "vulkan"
            and getattr(options, name) is not None
            and options.path not in paths
        ):
            raise MeshletError(
                f"{name} is for --path {' or '.join(filter(None, paths))}",
                "leave it out or change --path",
                options=(name,),
            )
    if options.cache is None:
        options.cache = CACHE[options.backend]
    if not 0 <= options.cache <= 1:
        raise MeshletError(f"cache is {options.cache}", "use 0 to 1", options=("cache",))
    if options.cache_bytes is not None and options.cache_bytes < 0:
        raise MeshletError(
            f"cache_bytes is {options.cache_bytes}", "use 0 or more", options=("cache_bytes",)
        )
    for backend, defaults in OWN_OPTIONS.items():
        for name, default in defaults.items():
            if getattr(options, name) is None:
                setattr(options, name, default)
            elif backend != options.backend:
                raise MeshletError(
                    f"{name} is for --backend {backend}",
                    "leave it out or change --backend",
                    options=(name,),
                )
    for name, least in (("spp", 1), ("frames", 1), ("bounces", 0), ("ring", 1)):
        if getattr(options, name) is not None and getattr(options, name) < least:
            raise MeshletError(
                f"{name} is {getattr(options, name)}", f"use {least} or more", options=(name,)
            )
    if not Path(options.output).absolute().parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", options.output)


def _renderer(backend: str):
    try:
        return importlib.import_module(RENDERERS[backend])
    except ModuleNotFoundError as error:
        raise MeshletError(
            f"--backend {backend} needs the package {error.name}",
            f"pip install 'gltf-meshlet[{backend}]'",
        ) from None
    except ImportError as error:  # what is wrong, and what to do, in the renderer's own words
        raise MeshletError(str(error)) from None


@contextmanager
def _compressed(path: str) -> Iterator[str]:
    """The file, or a compressed copy of one that is not compressed."""
    from gltf_ext.compression.compressor import compress

    if _is_compressed(path):
        yield path
        return
    print(
        f"gltf-meshlet: {path}: is not compressed; rendering a copy compressed with the default bits",
        file=sys.stderr,
    )
    with tempfile.TemporaryDirectory() as folder:
        copy = str(Path(folder) / f"{Path(path).stem}.glb")
        compress(path, copy, progress=True)
        yield copy


def _is_compressed(path: str) -> bool:
    from gltf_ext.compression.extension import EXTENSION
    from gltf_ext.gltf.importers import open_model

    try:
        meshes = open_model(path).meshes
    except MeshletError as error:
        error.path = error.path or path
        raise
    return any(
        EXTENSION in (primitive.extensions or {})
        for mesh in meshes
        for primitive in mesh.primitives
    )
