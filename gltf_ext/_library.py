"""The native library, codec/c: its structs, functions, statuses and handles."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from ctypes import byref, c_double, c_float, c_size_t, c_uint8, c_uint32, c_uint64, c_void_p
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

BLOB_MAX_STREAMS = 64  # of codec/format/constants.h

PROGRESS = ctypes.CFUNCTYPE(ctypes.c_int, c_void_p, c_float)
# Types of fields and arguments, by a letter each; p is any pointer.
_NUMBERS = (c_uint8, c_uint32, c_uint64, ctypes.c_int32, c_float, c_size_t, c_double)
UInt32s = NDArray[np.uint32]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

_ARRAYS = (c_uint32 * 4, c_uint64 * 5, c_float * 4, c_uint64 * BLOB_MAX_STREAMS)
_TYPES: dict[str, Any] = dict(zip("buqifzdpc45os", (*_NUMBERS, c_void_p, PROGRESS, *_ARRAYS)))
FUNCTIONS = """
close p, get_array pupp, open pzp, get_counts pp, get_page pup, get_stream puup, validate pi,
open_scratch p, get_begins pippz, get_statistics pp, decode pip, decode_range ppqqpp,
decode_meshlets pppzp, encode_described pppp,
weld pzzpp, scan_lines pzppzp, triangulate pzpzp,
build_levels pppp, get_distances pzppqfipp, get_nearest_weights ppzp,
get_unpacked_bytes pzp,
unpack pzipz, pack pzip, join_vertices ppp, get_topology pqqp
"""


def _fields(types: str, names: str) -> list[tuple[str, Any]]:
    return [(name, _TYPES[kind]) for kind, name in zip(types, names.split())]


def address(value: Any) -> Any:
    """Return the address of an array or struct; other values as they are."""
    if isinstance(value, np.ndarray):
        return value.__array_interface__["data"][0]
    is_native = isinstance(value, (ctypes.Array, ctypes.Structure))
    return ctypes.addressof(value) if is_native else value


class Struct(ctypes.Structure):
    """A struct that begins with its size, and keeps the arrays that it points to."""

    def __init__(self, **values: Any) -> None:
        self._values = values
        addresses = {name: address(value) for name, value in values.items()}
        super().__init__(size=ctypes.sizeof(self), **addresses)

    @property
    def _as_parameter_(self) -> Any:
        return byref(self)


def _struct(types: str, names: str) -> type[Struct]:
    return type("Struct", (Struct,), {"_fields_": _fields("u" + types, "size " + names)})


class StreamRow(ctypes.Structure):
    _fields_ = _fields(
        "bbbbbbbbfo",
        "kind elements bits predictor chain_base interior_base anchor_base reserved step offset",
    )


Counts = _struct("uuuqqq", "pages streams suspicious triangles vertices meshlets")
Page = _struct(
    "uqqqqqqqq",
    "data_offset offset bytes triangles vertices meshlets first_triangle first_vertex "
    "first_meshlet",
)
Statistics = _struct(
    "i4qqs5qqqq",
    "iterations histogram connectivity references streams symbols disks owned private foreign",
)
Arrays = _struct(
    "uqqpppppppppuu",
    "first_vertex triangle_room vertex_room triangles integers values triangle_begins "
    "vertex_begins shared attributes bounds triangles_16 attribute_count reserved",
)
MeshletArrays = _struct(
    "uuuppppp",
    "attribute_count triangle_bytes reserved sizes triangles integers attributes bounds",
)
Vertices = _struct(
    "upppppqqqq",
    "stream_count triangles integers elements shared first_vertices triangle_count vertex_count "
    "page_count source_vertices",
)
Topology = _struct("uqqq", "reserved vertices boundary_edges islands")
Mesh = _struct(
    "upqqppppppppqqqppz",
    "stream_count triangles triangle_count vertex_count position_ids positions streams values "
    "order disk_begin meshlet_begin group_begin disk_begin_count meshlet_begin_count "
    "group_begin_count triangles_16 attributes position_stride",
)
MeshletOptions = _struct(
    "uuuifqcp", "effort max_triangles max_vertices threads lambda_ page_bytes progress user"
)
Groups = _struct("ppqq", "triangles begin triangle_count begin_count")
Simplifier = _struct("ppp", "simplify simplify_guarded partition")
LevelsInput = _struct(
    "upppppppqppppqpppuuuuddp",
    "shape_count mesh source_position_ids canonical_vertices seam_points shapes attributes weights "
    "attribute_count locked places normals others other_count finer_groups errors spheres level "
    "first_group group_size chunk reduction error_limit simplifier",
)


class Cancelled(Exception):
    pass


_ERRORS = {3: IndexError, 6: MemoryError, 7: Cancelled, 8: RuntimeError}  # by status


def check(status: int, *_: Any) -> None:
    """Raise the exception of a status."""
    if status:
        raise _ERRORS.get(status, ValueError)(library.gltf_meshlet_error().decode())


def _load() -> ctypes.CDLL:
    names = {"win32": "gltf_meshlet.dll", "darwin": "libgltf_meshlet.dylib"}
    name = names.get(sys.platform, "libgltf_meshlet.so")
    # An editable install has two folders, one of which holds what was compiled.
    paths = [Path(folder, name) for folder in sys.modules["gltf_ext"].__path__]
    path_used = next((path for path in paths if path.exists()), None)
    if path_used is None:
        raise ImportError(f"{name} is not in {paths[0].parent}; install gltf-meshlet again")
    library = ctypes.CDLL(str(path_used))
    library.gltf_meshlet_error.restype = ctypes.c_char_p
    return library


def _function(name: str, types: str) -> Any:
    function = getattr(library, f"gltf_meshlet_{name}")
    function.argtypes, function.errcheck = [_TYPES[t] for t in types], check
    return function


library = _load()  # also has functions of meshoptimizer, in wheels
functions = SimpleNamespace(**{f.split()[0]: _function(*f.split()) for f in FUNCTIONS.split(",")})


class Handle:
    """An object of the library, open until nobody refers to this one."""

    def __init__(self) -> None:
        self._as_parameter_ = c_void_p()

    def __del__(self, close: Callable[[Handle], object] = functions.close) -> None:
        close(self)

    @property
    def out(self) -> Any:
        """Where a function that opens it puts the handle."""
        return byref(self._as_parameter_)


class Result(Handle):
    def array(self, number: int, dtype: type[np.generic] = np.uint32) -> NDArray[Any]:
        """Return a copy of an array."""
        items, size = c_void_p(), c_size_t()
        functions.get_array(self, number, byref(items), byref(size))
        result = np.empty(size.value // np.dtype(dtype).itemsize, dtype)
        ctypes.memmove(address(result), items, size.value)
        return result


def pointers(arrays: Sequence[NDArray[Any]]) -> ctypes.Array[c_void_p]:
    """Return the addresses of arrays, which live as long as the result."""
    addresses = (c_void_p * len(arrays))(*map(address, arrays))
    addresses.arrays = arrays  # type: ignore[attr-defined]
    return addresses


def array_of(values: Any, dtype: type[np.generic], *shape: int) -> NDArray[Any]:
    """Any array as one of this dtype, in C's order. shape: -1 for any length. Raises TypeError."""
    array = np.ascontiguousarray(values, dtype)
    if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape)):
        raise TypeError(f"an array has the shape {array.shape} instead of {shape}")
    return array


def groups_of(triangles: UInt32s, begin: UInt32s) -> Struct:
    """Return the struct of triangles, uint32[T, 3], group after group, and uint32[G + 1] begins."""
    triangles, begin = array_of(triangles, np.uint32, -1, 3), array_of(begin, np.uint32, -1)
    counts = {"triangle_count": len(triangles), "begin_count": len(begin)}
    return Groups(triangles=triangles, begin=begin, **counts)
