"""The native library: loads it, reads glTF files for it, and returns its statistics."""

from __future__ import annotations

import ctypes
from typing import Any

import mitsuba
import numpy as np

from gltf_ext.lod.cuts import View

from . import build, reader
from .lod import LodView
from .materials import PRODUCT

PLUGIN = "meshlet_edgebreaker"
NO_STREAM = 2**32 - 1


class SelectionRow(ctypes.Structure):
    """python_api.h's Selection."""

    _fields_ = [
        ("mesh", ctypes.c_int32),
        ("primitive", ctypes.c_int32),
        ("to_world", ctypes.c_float * 12),
        ("lod_error", ctypes.c_float),
        ("pixels_per_unit", ctypes.c_float),
        ("eye", ctypes.c_float * 3),
        ("has_eye", ctypes.c_uint32),
    ]


CACHE_FIGURES = (
    "hits",
    "misses",
    "evictions",
    "decoded",
    "refused",
    "resident_bytes",
    "resident_entries",
    "limit_bytes",
)
SHAPE_FIGURES = (
    "triangles",
    "meshlets",
    "vertices",
    "compressed_bytes",
    "table_bytes",
    "decoded_bytes",
    "block_bytes",
)


class StatisticsRow(ctypes.Structure):
    """python_api.cpp's StatisticsRow."""

    _fields_ = [(name, ctypes.c_uint64) for name in (*CACHE_FIGURES, *SHAPE_FIGURES, "cache")]


READER = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.POINTER(SelectionRow), ctypes.c_void_p)


def load() -> ctypes.CDLL:
    """Loads the library; registers the shape and the texture for each variant it has.

    Compiles it on first use. Raises ImportError with one line.
    """
    path = build.library()
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise ImportError(f"cannot load the Mitsuba plugin: {error}; delete {path}") from None
    library.meshlet_mitsuba_version.restype = ctypes.c_char_p
    built = library.meshlet_mitsuba_version().decode()
    if built != mitsuba.__version__:
        raise ImportError(
            f"{path} was compiled for Mitsuba {built}, this is {mitsuba.__version__}; delete it"
        )
    library.meshlet_set_reader.argtypes = [READER]
    library.meshlet_fail.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
    library.meshlet_add_blob.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint64]
    library.meshlet_add_blob.restype = ctypes.c_uint32
    library.meshlet_add_primitive.argtypes = [
        ctypes.c_void_p,
        ctypes.c_uint32,
        ctypes.POINTER(ctypes.c_float),
        ctypes.POINTER(reader.Attribute),
        ctypes.c_uint32,
        ctypes.POINTER(ctypes.c_uint32),
        ctypes.c_uint32,
    ]
    library.meshlet_statistics.argtypes = [
        ctypes.c_uint64,
        ctypes.POINTER(StatisticsRow),
        ctypes.c_int,
    ]
    library.meshlet_fits_memory.argtypes = [ctypes.c_uint64]
    library.meshlet_shapes.argtypes = [ctypes.POINTER(ctypes.c_uint64), ctypes.c_uint32]
    library.meshlet_shapes.restype = ctypes.c_uint32
    library.meshlet_working_bytes.restype = ctypes.c_uint64
    library.meshlet_set_reader(_reader)
    library.meshlet_register(PLUGIN.encode())
    library.meshlet_register_product(PRODUCT.encode())
    return library


def _read(filename: bytes, selection: Any, request: int) -> None:
    """Adds the blobs of a file to a request. The library calls it from any thread."""
    try:
        row = selection.contents
        to_world = np.vstack([np.reshape(row.to_world, (3, 4)), [0.0, 0.0, 0.0, 1.0]])
        mesh, primitive = (None if n < 0 else n for n in (row.mesh, row.primitive))
        blobs = reader.read_blobs(filename.decode(), mesh, primitive, _lod_view(row), to_world)
        numbers: dict[int, int] = {}
        widths = reader.widths_of([placed.others for placed in blobs])
        for placed in blobs:
            if id(placed.blob) not in numbers:
                numbers[id(placed.blob)] = library.meshlet_add_blob(
                    request, placed.blob, len(placed.blob)
                )
            rows = [
                _row(attribute) for attribute in (placed.position, placed.normal, placed.texcoord)
            ]
            rows += [_row(placed.others.get(name), name, width) for name, width in widths.items()]
            matrix = (ctypes.c_float * 12)(*placed.matrix[:3].ravel())
            chosen = (ctypes.c_uint32 * len(placed.chosen))(*placed.chosen)
            library.meshlet_add_primitive(
                request,
                numbers[id(placed.blob)],
                matrix,
                (reader.Attribute * len(rows))(*rows),
                len(rows),
                chosen,
                len(chosen),
            )
    except Exception as error:  # exceptions must not reach the native code
        library.meshlet_fail(request, f"{error}".encode(errors="replace") or repr(error).encode())


def _lod_view(row: SelectionRow) -> LodView | None:
    """None for all triangles."""
    if row.lod_error == 0.0:
        return None
    x, y, z = row.eye
    return LodView(View((x, y, z) if row.has_eye else None, row.pixels_per_unit), row.lod_error)


_reader = READER(_read)  # kept alive: the library holds only a pointer


def _row(attribute: reader.Attribute | None, name: str = "", components: int = 0) -> Any:
    """An attribute for the library; NO_STREAM if there is none, or one of another width."""
    if attribute is not None and components in (0, attribute.components):
        return attribute
    return reader.Attribute(
        name.encode(errors="replace"), NO_STREAM, components, 0, components, 1.0
    )


def statistics(shape: Any = None, *, reset: bool = False) -> dict[str, int]:
    """Counts and sizes of a shape, of a scene, or (None) of all existing shapes.

    hits, misses, evictions: of the cache of decoded meshlets; decoded: meshlets decoded while
    rendering; refused: decoded meshlets that did not enter the cache.
    resident_bytes, resident_entries: content of the cache; limit_bytes: its limit.
    triangles, meshlets: those shown; vertices, compressed_bytes: of their blobs; table_bytes:
    boxes, areas, the tables of caches and emitters; decoded_bytes: of all meshlets if they were in
    the cache; block_bytes: of those that are resident, by `accel` = `triangles`.
    working_bytes: memory that all threads of the process decode in, whatever the limit.
    Shapes that share a cache count it once. May be called during a render; reset: zero the counts.
    """
    total = dict.fromkeys((*CACHE_FIGURES, *SHAPE_FIGURES), 0)
    caches: set[int] = set()
    row = StatisticsRow()
    for cache_id in _cache_ids(shape):
        if library.meshlet_statistics(cache_id, ctypes.byref(row), int(reset)):
            for name in SHAPE_FIGURES if row.cache in caches else total:
                total[name] += getattr(row, name)
            caches.add(row.cache)
    total["working_bytes"] = library.meshlet_working_bytes()
    return total


def fits_memory(triangles: int) -> bool:
    """Whether half of the memory that is free holds so many, as `accel` = `auto` sees it."""
    return bool(library.meshlet_fits_memory(triangles))


def _cache_ids(shape: Any) -> list[int]:
    if shape is None:
        room = (ctypes.c_uint64 * 65536)()
        return list(room[: library.meshlet_shapes(room, len(room))])
    parameters = mitsuba.traverse(shape)
    names = list(dict(parameters))
    return [int(parameters[name]) for name in names if name.rpartition(".")[2] == "cache_id"]


library = load()
