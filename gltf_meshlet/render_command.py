"""`gltf-meshlet render`: its options, and the back end that they go to.

A back end is a module with `main(options) -> exit status` that raises MeshletError and OSError.
`options.input` is compressed; messages name `options.source`, the user's file. `options.read` are
all files of the user that were read: pictures must not overwrite them. The module is imported on
use: no other command needs its packages.
"""

from __future__ import annotations

import argparse
import importlib
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from gltf_ext.errors import MeshletError, blaming, printable
from gltf_ext.files import refuse_overwriting
from gltf_ext.options import bytes_of
from gltf_meshlet import STARTED

BACKENDS = {"mitsuba": "mitsuba_plugin.command", "vulkan": "vk_backend.command"}
ACCELS = ("auto", "triangles", "cache")
PATHS = ("visibility", "stream", "mesh", "mesh-paper", "geometry", "vertex", "rt")


def _bytes(text: str) -> int:
    try:
        return bytes_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _cache(text: str) -> int | float:
    """Bytes, or a share of the decoded geometry as a float."""
    if not text.endswith("%"):
        return _bytes(text)
    try:
        fraction = float(text[:-1]) / 100
    except ValueError:
        fraction = -1.0
    if not 0 <= fraction <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no share from 0% to 100%")
    return fraction


class BackendOption(NamedTuple):
    """An option of a single back end. {} in its help is the default; a bool is a switch."""

    help: str
    default: Any = None
    minimum: int | None = None
    type: Callable[[str], Any] = int
    metavar: str = "N"


BACKEND_OPTIONS = {
    "mitsuba": {
        "variant": BackendOption(
            "of Mitsuba: scalar_*; llvm_*, which needs LLVM; or cuda_*, on an NVIDIA GPU "
            "(default {})",
            "scalar_rgb",
            type=str,
            metavar="NAME",
        ),
        "spp": BackendOption("samples per pixel (default {})", 64, minimum=1),
        "accel": BackendOption(
            f"how rays find triangles: {', '.join(ACCELS)} (default {{}}: cache with --cache or if "
            "memory is short, else triangles)",
            "auto",
            type=str,
            metavar="NAME",
        ),
    },
    "vulkan": {
        "path": BackendOption(
            f"how to decode and draw: {', '.join(PATHS)}; rt traces rays "
            "(default: the best for the device)",
            type=str,
            metavar="PATH",
        ),
        "device": BackendOption(
            "number, or a part of the name (default: the first GPU)", type=str, metavar="DEVICE"
        ),
        "pages": BackendOption(
            "with --lod-error: device memory for compressed pages; what does not fit is shown "
            "coarser; K, M or G may follow (default 256M)",
            type=_bytes,
            metavar="BYTES",
        ),
        "bounces": BackendOption("diffuse bounces of path rt (default {})", 0, minimum=0),
        "frames": BackendOption(
            "frames of a turn around the scene: numbered pictures, or one .gif (default {})",
            1,
            minimum=1,
        ),
        "validate": BackendOption("with the Vulkan validation layer", False, type=bool),
    },
}
# The Vulkan paths that have an option. None: the device chooses the path, never rt.
PATHS_WITH: dict[str, tuple[str | None, ...]] = {
    "cache": ("visibility", "stream", "rt", None),
    "bounces": ("rt",),
    "lod_error": ("visibility", "mesh", "mesh-paper", "rt", None),
    "pages": ("visibility", "mesh", "mesh-paper", None),
}
LARGEST_SIDE = 16384  # pixels


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `render`."""
    command.add_argument("input", metavar="SCENE", help="file that compress wrote, or any model")
    _add_shared(command)
    for backend, options in BACKEND_OPTIONS.items():
        group = command.add_argument_group(f"with --backend {backend}")
        for name, option in options.items():
            settings: dict[str, Any] = {"type": option.type, "metavar": option.metavar}
            if option.type is bool:
                settings = {"action": "store_true", "default": None}
            flag = "--" + name.replace("_", "-")
            group.add_argument(flag, help=option.help.format(option.default), **settings)


def _add_shared(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="picture to write: .png, with Mitsuba .exr and .jpg too",
    )
    command.add_argument(
        "--backend",
        choices=BACKENDS,
        default="mitsuba",
        help="path tracing by Mitsuba, or drawing on the GPU by Vulkan (default %(default)s)",
    )
    command.add_argument(
        "--width", type=int, default=800, metavar="N", help="pixels (default %(default)s)"
    )
    command.add_argument(
        "--height", type=int, default=600, metavar="N", help="pixels (default %(default)s)"
    )
    command.add_argument(
        "--camera",
        type=int,
        default=0,
        metavar="N",
        help="number of the file's camera (default %(default)s); a file without cameras is "
        "shown as a whole",
    )
    command.add_argument(
        "--cache",
        type=_cache,
        metavar="SIZE",
        help="memory for decoded geometry: bytes (K, M or G may follow), or a share of all such as "
        "25%% (default: with Mitsuba all, or 25%% by --accel cache; with Vulkan by --path rt "
        "100%%, by others see docs/vulkan.md)",
    )
    command.add_argument(
        "--lod-error",
        type=float,
        metavar="PIXELS",
        help="show what has levels of detail with at most this error (default 0: all triangles); "
        "with Vulkan, by --path visibility, mesh, mesh-paper and rt",
    )
    command.add_argument("--json", action="store_true", help="print JSON instead of the line")


def run(options: argparse.Namespace) -> int:
    """Renders; returns the exit status. Raises MeshletError, OSError."""
    _check(options)
    backend = _backend(options.backend)
    is_compressed, sources = _look_into(options.input)
    refuse_overwriting(sources, [options.output])  # before any work; write_files checks it again
    with _compressed_copy(options.input, is_compressed) as path:
        updates = {
            "input": path,
            "source": options.input,
            "read": sources,
            "started": STARTED,
        }
        backend_arguments = argparse.Namespace(**{**vars(options), **updates})
        try:
            status: int = backend.main(backend_arguments)
            return status
        except MeshletError as error:
            error.path = options.input if error.path == path else error.path
            raise


def _check(options: argparse.Namespace) -> None:
    """Raises MeshletError for options that no back end can take; fills in defaults."""
    for name in ("width", "height"):
        if not 1 <= getattr(options, name) <= LARGEST_SIDE:
            raise _out_of_range(options, name, f"1 to {LARGEST_SIDE}")
    _check_path(options)
    if options.lod_error is None:
        options.lod_error = 0.0
    if not 0 <= options.lod_error < math.inf:
        raise _out_of_range(options, "lod_error", "0 or more")
    if options.pages is not None and not options.lod_error:
        raise MeshletError(
            "pages is for levels of detail",
            "leave it out or add --lod-error",
            options=("pages",),
        )
    _fill_backend_options(options)
    if options.accel not in ACCELS:
        raise MeshletError(f"there is no accel {options.accel}", f"use one of {', '.join(ACCELS)}")
    if options.cache is not None and options.accel == "triangles":
        raise MeshletError(
            "cache is not for --accel triangles",
            "leave one of them out",
            options=("cache",),
        )
    _check_cuda(options)
    if not Path(options.output).absolute().parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", options.output)


def _check_cuda(options: argparse.Namespace) -> None:
    """Raises MeshletError for a cache, which Mitsuba's variants for GPUs do not have."""
    asks = options.cache is not None or options.accel == "cache"
    if options.backend == "mitsuba" and options.variant.startswith("cuda") and asks:
        raise MeshletError(
            f"--variant {options.variant} has no cache",
            "leave --cache and --accel out, or use --variant llvm_ad_rgb",
        )


def _out_of_range(options: argparse.Namespace, name: str, values: str) -> MeshletError:
    return MeshletError(f"{name} is {getattr(options, name)}", f"use {values}", options=(name,))


def _check_path(options: argparse.Namespace) -> None:
    """Raises MeshletError for an unknown path, and for an option that the path does not have."""
    if options.backend != "vulkan":
        return
    if options.path not in (*PATHS, None):
        raise MeshletError(f"there is no path {options.path}", f"there are {', '.join(PATHS)}")
    for name, paths in PATHS_WITH.items():
        if getattr(options, name) is not None and options.path not in paths:
            raise MeshletError(
                f"{name} is for --path {' or '.join(filter(None, paths))}",
                "leave it out or change --path",
                options=(name,),
            )


def _fill_backend_options(options: argparse.Namespace) -> None:
    """Sets the defaults. Raises MeshletError for small values, and options of another back end."""
    for backend, backend_options in BACKEND_OPTIONS.items():
        for name, option in backend_options.items():
            value = getattr(options, name)
            if value is None:
                setattr(options, name, option.default)
            elif backend != options.backend:
                raise MeshletError(
                    f"{name} is for --backend {backend}",
                    "leave it out or change --backend",
                    options=(name,),
                )
            elif option.minimum is not None and not value >= option.minimum:  # also not a number
                raise _out_of_range(options, name, f"{option.minimum} or more")


def _backend(name: str) -> Any:
    """The back end's module. Raises MeshletError when it cannot be imported."""
    try:
        return importlib.import_module(BACKENDS[name])
    except ModuleNotFoundError as error:
        raise MeshletError(
            f"--backend {name} needs the package {error.name}",
            f"pip install 'gltf-meshlet[{name}]'",
        ) from None
    except ImportError as error:  # its message says what to do
        raise MeshletError(str(error)) from None


@contextmanager
def _compressed_copy(path: str, is_compressed: bool) -> Iterator[str]:
    """The file itself if it is compressed, else a temporary compressed copy."""
    import tempfile

    import gltf_ext

    if is_compressed:
        yield path
        return
    print(
        f"gltf-meshlet: {printable(path)}: is not compressed; "
        "rendering a copy compressed with the default bits",
        file=sys.stderr,
    )
    with tempfile.TemporaryDirectory() as folder:
        copy = str(Path(folder) / f"{Path(path).stem}.glb")
        gltf_ext.compress(path, copy, progress=True)
        yield copy


def _look_into(path: str) -> tuple[bool, list[str | Path]]:
    """(whether a file is compressed, the file and all others that it reads)."""
    from gltf_ext.attributes.extension import has_compressed
    from gltf_ext.sources.importers import open_model

    with blaming(path):
        document = open_model(path)
        return has_compressed(document), [path, *document.files()]
