"""The functions of meshoptimizer that levels are built with, which the codec's builder calls.

Our wheels contain them, in the library of the codec, with a guard (cmake/simplifier_guard.h); so do
checkouts that `make` installs. Other installations take them, without it, from the PyPI package
meshoptimizer, which is compiled from its sources on the user's machine. Its extension module
exports the C functions. The version is pinned (optional dependencies "lod" in pyproject.toml):
results would change with another one, and later ones have other parameters. Its licence (MIT,
Arseny Kapoulkine) comes with it, and with our wheels.
"""

from __future__ import annotations

import ctypes
import importlib.machinery
import importlib.metadata
import importlib.util
from functools import cache
from pathlib import Path

from gltf_ext._library import Simplifier, Struct
from gltf_ext._library import library as codec_library
from gltf_ext.errors import MeshletError

VERSION = "0.2.30a0"
PARTITION = "meshopt_partitionClusters"  # in a library that has all functions
GUARDED = "meshopt_simplifyGuarded"  # not in the PyPI package


def has_simplifier() -> bool:
    """Return whether meshoptimizer is there, in the codec's library or as a package."""
    inside = hasattr(codec_library, PARTITION)
    return inside or importlib.util.find_spec("meshoptimizer") is not None


def simplifier() -> Struct:
    """Return the functions. Raises MeshletError when meshoptimizer is missing, or another one."""

    def pointer(name: str) -> int | None:
        function = getattr(library(), name, None)
        return function and ctypes.cast(function, ctypes.c_void_p).value

    names = {"simplify": "meshopt_simplifyWithAttributes", "partition": PARTITION}
    pointers = {field: pointer(name) for field, name in names.items()}
    return Simplifier(**pointers, simplify_guarded=pointer(GUARDED))


@cache
def library() -> ctypes.CDLL:
    """Return the library that has the functions. Raises MeshletError as `simplifier`."""
    if hasattr(codec_library, PARTITION):
        return codec_library
    remedy = f"install it: pip install meshoptimizer=={VERSION}"
    spec = importlib.util.find_spec("meshoptimizer")
    if spec is None or spec.origin is None:
        raise MeshletError("levels of detail need the package meshoptimizer", remedy)
    version = importlib.metadata.version("meshoptimizer")
    if version != VERSION:
        raise MeshletError(f"meshoptimizer {version} cannot build levels of detail", remedy)
    folder = Path(spec.origin).parent
    for suffix in importlib.machinery.EXTENSION_SUFFIXES:
        path = folder / f"_meshoptimizer{suffix}"
        if path.exists():
            return ctypes.CDLL(str(path))
    raise MeshletError("the package meshoptimizer lacks its compiled module", remedy)
