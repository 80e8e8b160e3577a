"""The functions of meshoptimizer that levels are built with, called through ctypes.

Our wheels contain them, in the library of the codec, with a guard (cmake/simplifier_guard.h); so do
checkouts that `make` installs. Other installations take them, without it, from the PyPI package
meshoptimizer, which is compiled from its sources on the user's machine. Its extension
module exports the C functions; its Python part wraps neither partitionClusters nor, with locked
vertices, simplifyWithAttributes. ctypes releases the interpreter lock during a call. The version is
pinned (optional dependencies "lod" in pyproject.toml): results would change with another one, and
later ones have other parameters. Its licence (MIT, Arseny Kapoulkine) comes with it, and with our
wheels.
"""

from __future__ import annotations

import ctypes
import importlib.machinery
import importlib.metadata
import importlib.util
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext._library import library as codec_library
from gltf_ext.errors import MeshletError

VERSION = "0.2.30a0"
# meshopt_SimplifySparse: triangles use few of the vertices. meshopt_SimplifyErrorAbsolute.
SPARSE, ERROR_ABSOLUTE = 2, 4
LARGEST_ERROR = 1e30
PARTITION = "meshopt_partitionClusters"  # in a library that has all functions
GUARDED = "meshopt_simplifyGuarded"  # not in the PyPI package

# Of the guard: the place of each vertex, begins of the places, normals at them; see
# cmake/simplifier_guard.h.
Guard = tuple[np.ndarray, np.ndarray, np.ndarray]
# The cosine of the largest angle between a triangle and the normal that fits best at its corner.
LEAST_COSINE = 0.01


def require_simplifier() -> None:
    """Raise MeshletError when meshoptimizer is missing or of another version."""
    _library()


def has_simplifier() -> bool:
    """Return whether meshoptimizer is there, in the codec's library or as a package."""
    inside = hasattr(codec_library, PARTITION)
    return inside or importlib.util.find_spec("meshoptimizer") is not None


@cache
def _library() -> ctypes.CDLL:
    if hasattr(codec_library, PARTITION):
        return _typed(codec_library)
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
            return _typed(ctypes.CDLL(str(path)))
    raise MeshletError("the package meshoptimizer lacks its compiled module", remedy)


def _typed(library: ctypes.CDLL) -> ctypes.CDLL:
    library.meshopt_simplifyWithAttributes.restype = ctypes.c_size_t
    library.meshopt_partitionClusters.restype = ctypes.c_size_t
    if hasattr(library, GUARDED):
        getattr(library, GUARDED).restype = ctypes.c_size_t
    return library


def _pointer(array: np.ndarray, dtype: type[np.generic]) -> ctypes.c_void_p:
    assert array.flags.c_contiguous and array.dtype == dtype
    return array.ctypes.data_as(ctypes.c_void_p)


def simplify(
    triangles: np.ndarray,
    positions: np.ndarray,
    attributes: np.ndarray,
    weights: np.ndarray,
    locked: np.ndarray,
    target: int,
    error_limit: float = math.inf,
    guard: Guard | None = None,
) -> tuple[np.ndarray, float]:
    """Collapse edges onto existing vertices until at most `target` triangles are left.

    triangles: uint32[T, 3]; positions: float32[V, 3]; attributes: float32[V, A] with weights
    float32[A], which count in the choice of edges, A at most 32 (meshoptimizer checks nothing);
    locked: uint8[V], 1 for vertices that stay;
    error_limit: the largest error that a collapse may have, in the units of positions;
    guard: refuses collapses that turn a triangle against all normals at one of its corners, where
    the library has it: the PyPI package has not.

    Returns uint32[N, 3], and the largest error of a collapse.
    """
    result = np.empty(triangles.size, np.uint32)
    error = ctypes.c_float()
    attribute_count = len(weights)
    library = _library()
    function = library.meshopt_simplifyWithAttributes
    more: tuple[Any, ...] = ()
    if guard is not None and hasattr(library, GUARDED):
        places, begin, normals = guard
        function, more = (
            getattr(library, GUARDED),
            (
                _pointer(places, np.uint32),
                _pointer(begin, np.uint32),
                _pointer(normals, np.float32),
                ctypes.c_float(LEAST_COSINE),
            ),
        )
    count = function(
        _pointer(result, np.uint32),
        _pointer(triangles, np.uint32),
        ctypes.c_size_t(triangles.size),
        _pointer(positions, np.float32),
        ctypes.c_size_t(len(positions)),
        ctypes.c_size_t(positions.strides[0]),
        _pointer(attributes, np.float32) if attribute_count else None,
        ctypes.c_size_t(attributes.strides[0] if attribute_count else 0),
        _pointer(weights, np.float32) if attribute_count else None,
        ctypes.c_size_t(attribute_count),
        _pointer(locked, np.uint8),
        ctypes.c_size_t(3 * target),
        ctypes.c_float(min(error_limit, LARGEST_ERROR)),
        ctypes.c_uint(SPARSE | ERROR_ABSOLUTE),
        ctypes.byref(error),
        *more,
    )
    return result[:count].reshape(-1, 3), float(error.value)


def partition(indices: np.ndarray, counts: np.ndarray, vertices: int, size: int) -> np.ndarray:
    """Group clusters that share vertices, about `size` in a group.

    indices: uint32, the vertices of one cluster after the other; counts: uint32 per cluster.
    Returns the group of each cluster, uint32[N].
    """
    groups = np.zeros(len(counts), np.uint32)
    _library().meshopt_partitionClusters(
        _pointer(groups, np.uint32),
        _pointer(indices, np.uint32),
        ctypes.c_size_t(len(indices)),
        _pointer(counts, np.uint32),
        ctypes.c_size_t(len(counts)),
        ctypes.c_size_t(vertices),
        ctypes.c_size_t(size),
    )
    return groups
