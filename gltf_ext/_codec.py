"""The native codec of EXT_meshlet_edgebreaker: codec/c with numpy arrays.

Functions that take a blob raise ValueError, with one sentence, if it is malformed. Calls release
the interpreter's lock. `threads`: 0 means one per processor.
"""

from __future__ import annotations

import ctypes
import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_float, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gltf_ext._joinable import Joinable
from gltf_ext._library import BLOB_MAX_STREAMS as BLOB_MAX_STREAMS
from gltf_ext._library import (
    PROGRESS,
    Arrays,
    Cancelled,
    Counts,
    Doubles,
    Floats,
    Handle,
    LevelsInput,
    Mesh,
    MeshletArrays,
    MeshletOptions,
    Page,
    Result,
    Statistics,
    StreamRow,
    Struct,
    UInt32s,
    address,
    array_of,
    check,
    functions,
    groups_of,
    library,
    pointers,
)

# Constants of the format, under the names of codec/format/constants.h.
KIND_GRID, KIND_OCT, KIND_INTEGER, KIND_FLOAT32, KIND_SIGN = range(5)
PREDICT_PARALLELOGRAM, PREDICT_MEAN, PREDICT_COPY, PREDICT_DAMPED = range(4)
PREDICT_GEO, PREDICT_AFFINE = 4, 5
PREDICT_MAX_BITS = GRID_MAX_BITS = 24
OCT_MIN_BITS, OCT_MAX_BITS = 2, 16
STREAM_MAX_ELEMENTS, STREAM_MAX_BITS = 4, 32
MESHLET_TRIANGLES = MESHLET_VERTICES = 64

Bytes = bytes | memoryview


@dataclass(frozen=True)
class Stream:
    """A row of a blob's stream table (appendix A.3 of the specification).

    kind: KIND_. elements: integers per vertex, 1 to 4. bits: of each, 1 to 32. step, offset (a
    float for each element, or none for 0): GRID's value = offset + integer * step. predictor:
    PREDICT_, or -1 to let the encoder choose.
    """

    kind: int
    elements: int
    bits: int
    step: float = 0.0
    offset: tuple[float, ...] = ()
    predictor: int = -1

    @property
    def width(self) -> int:
        """Accessor components that the stream stands for."""
        return 3 if self.kind == KIND_OCT else self.elements


def _number_of(name: str, names: Mapping[str, int], problem: str) -> int:
    if name not in names:
        raise ValueError(problem)
    return names[name]


# --- views ---


class View(Handle):
    """Compressed bytes that are open. Checks headers and tables. Raises ValueError, TypeError."""

    def __init__(self, view: Bytes) -> None:
        super().__init__()
        if not isinstance(view, (bytes, memoryview)):
            raise TypeError(f"compressed data are bytes, not {type(view).__name__}")
        self._bytes, self._counts = np.frombuffer(view, np.uint8), Counts()
        functions.open(address(self._bytes), len(self._bytes), self.out)
        functions.get_counts(self, self._counts)
        self.triangle_count: int = self._counts.triangles
        self.vertex_count: int = self._counts.vertices
        self.meshlet_count: int = self._counts.meshlets

    @functools.cached_property
    def streams(self) -> list[Stream]:
        """The stream table of the first blob. Predictors of others may differ."""
        streams, row = [], StreamRow()
        for s in range(self._counts.streams):
            functions.get_stream(self, 0, s, byref(row))
            offset = tuple(row.offset[: row.elements])
            streams.append(
                Stream(row.kind, row.elements, row.bits, row.step, offset, row.predictor)
            )
        return streams

    def blobs(self) -> list[Struct]:
        blobs = [Page() for _ in range(self._counts.pages)]
        for b, blob in enumerate(blobs):
            functions.get_page(self, b, blob)
        return blobs

    def decode(self, threads: int, as_values: bool) -> tuple[UInt32s, list[NDArray[Any]]]:
        arrays = self._arrays(as_values)
        lists = {"values" if as_values else "integers": pointers(arrays)}
        return self._fill(threads, **lists), arrays

    def decode_joinable(self, threads: int) -> tuple[Joinable, list[NDArray[Any]]]:
        integers, values = self._arrays(False), self._arrays(True)
        shared = np.empty(self.vertex_count, np.uint32)
        lists = {"integers": pointers(integers), "values": pointers(values)}
        triangles = self._fill(threads, shared=shared, **lists)
        first = np.array([blob.first_vertex for blob in self.blobs()], np.uint64)
        return Joinable(triangles, integers, first, shared), values

    def _arrays(self, as_values: bool) -> list[NDArray[Any]]:
        """Return an array for each stream, not initialised."""
        if self._counts.suspicious:
            functions.validate(self, 0)
        arrays = []
        for stream in self.streams:
            elements = stream.width if as_values else stream.elements
            dtype = np.float32 if as_values and stream.kind != KIND_INTEGER else np.uint32
            arrays.append(np.empty((self.vertex_count, elements), dtype))
        return arrays

    def _fill(self, threads: int, **arrays: Any) -> UInt32s:
        triangles = np.empty((self.triangle_count, 3), np.uint32)
        room = {"triangle_room": self.triangle_count, "vertex_room": self.vertex_count}
        functions.decode(self, threads, Arrays(triangles=triangles, **room, **arrays))
        return triangles

    def description(self, s: Struct) -> dict[str, Any]:
        """Return the result of `describe` for these Statistics."""
        bits = {"connectivity": s.connectivity, "references": s.references}
        return {
            "blobs": self._counts.pages,
            "triangles": self.triangle_count,
            "vertices": self.vertex_count,
            "meshlets": self.meshlet_count,
            "components": s.disks,
            "bits": {**bits, "streams": s.streams[: self._counts.streams]},
            "symbols": dict(zip("CLERS", s.symbols)),
            "references": {"owned": s.owned, "private": s.private, "foreign": s.foreign},
        }


class Header(View):
    """The header and tables of a blob. Decodes nothing."""

    def __init__(self, blob: Bytes) -> None:
        super().__init__(blob)
        if self._counts.pages > 1:
            raise ValueError("the header's byte length is not the blob's")
        begins = np.empty(self.meshlet_count + 1, np.uint32)
        functions.get_begins(self, 1, begins.ctypes, None, len(begins))
        self.meshlet_triangles: UInt32s = np.diff(begins)  # of each meshlet


class Decoder(View):
    """Decodes single meshlets of a view, numbered on through its blobs.

    It holds a scratch, so only one thread may use it at a time; another one gets a ValueError.

    Attributes:
        buffers: the arrays that decode_kept writes, (uint8[64, 3], [uint32[64, elements] per
            stream]).
    """

    def __init__(self, view: Bytes) -> None:
        super().__init__(view)
        self._scratch = Handle()
        functions.open_scratch(self._scratch.out)
        elements = [stream.elements for stream in self.streams]
        integers = np.empty(MESHLET_VERTICES * sum(elements), np.uint32)
        ends = np.cumsum(elements) * MESHLET_VERTICES
        streams = [a.reshape(MESHLET_VERTICES, -1) for a in np.split(integers, ends[:-1])]
        self.buffers = np.empty((MESHLET_TRIANGLES, 3), np.uint8), streams
        self._numbers = (c_uint32 * 3)()  # of a meshlet, of its triangles, of its vertices
        meshlet = ctypes.addressof(self._numbers)
        self._arrays_of_one = MeshletArrays(
            sizes=meshlet + 4, triangles=self.buffers[0], integers=integers
        )
        handles = self._as_parameter_.value, self._scratch._as_parameter_.value
        arguments = *handles, meshlet, 1, ctypes.addressof(self._arrays_of_one)
        # Converts the arguments once, for a function without types and check: to do it in each call
        # would take a tenth of the time.
        function = library["gltf_meshlet_decode_meshlets"]
        self._decode = functools.partial(function, *map(c_void_p.from_param, arguments))

    def decode_kept(self, index: int) -> tuple[int, int]:
        """Decode a meshlet to the beginnings of the arrays in `buffers`, without making new ones.

        Returns its numbers of triangles and vertices. Raises IndexError, ValueError.
        """
        if not 0 <= index < self.meshlet_count:
            raise IndexError("no such meshlet")
        numbers = self._numbers
        numbers[0] = operator.index(index)
        if status := self._decode():
            check(status)
        # Unpacking a ctypes array ends with an IndexError, which takes 0.45 us.
        return numbers[1], numbers[2]

    def decode_meshlet(self, index: int) -> tuple[NDArray[np.uint8], list[UInt32s]]:
        """Return (triangles: uint8[t, 3] local ids, [uint32[v, elements] per stream]).

        Raises IndexError, ValueError.
        """
        triangles, vertices = self.decode_kept(index)
        local, streams = self.buffers
        return local[:triangles].copy(), [stream[:vertices].copy() for stream in streams]


def decode(view: Bytes, threads: int = 0) -> tuple[UInt32s, list[UInt32s]]:
    """Decode a view: one blob or several. Threads share out blobs, and parts of large ones.

    Returns (triangles: uint32[T, 3], [uint32[V, elements] per stream]).
    """
    return View(view).decode(threads, False)


def decode_values(view: Bytes, threads: int = 0) -> tuple[UInt32s, list[NDArray[Any]]]:
    """Return (triangles: uint32[T, 3], [values per stream]).

    Values are uint32[V, elements] for INTEGER, float32[V, 3] unit vectors for OCT, float32[V,
    elements] otherwise.
    """
    return View(view).decode(threads, True)


def decode_joinable(view: Bytes, threads: int = 0) -> tuple[Joinable, list[NDArray[Any]]]:
    """Return (triangles and integers, to join vertices; values per stream, as decode_values)."""
    return View(view).decode_joinable(threads)


def split(view: Bytes) -> list[tuple[int, int]]:
    """Return (offset, size) of each blob of a view. Checks all headers."""
    return [(blob.offset, blob.bytes) for blob in View(view).blobs()]


def describe(view: Bytes) -> dict[str, Any]:
    """Return counts and numbers of bits; the entries of 'bits' sum to 8 * len(view)."""
    handle, statistics = View(view), Statistics()
    functions.get_statistics(handle, statistics)
    return handle.description(statistics)


def validate(view: Bytes, threads: int = 0) -> None:
    """Raise ValueError if a blob of the view is malformed in any way.

    Decodes every meshlet alone, and so detects errors that `decode` may accept.
    """
    functions.validate(View(view), threads)


# --- views packed for download ---


def pack(view: bytes, threads: int = 0) -> bytes:
    """Return the view as EXT_meshlet_transport stores it."""
    result = Result()
    functions.pack(view, len(view), threads, result.out)
    return result.array(0, np.uint8).tobytes()


def unpacked_bytes(packed: bytes) -> int:
    """Return the length of the view that was packed, by the table of its pages."""
    size = c_size_t()
    functions.get_unpacked_bytes(packed, len(packed), byref(size))
    return size.value


def unpack(packed: bytes, threads: int = 0) -> bytes:
    """Return the view that was packed. It is still to be validated."""
    view = np.empty(unpacked_bytes(packed), np.uint8)
    functions.unpack(packed, len(packed), threads, view.ctypes, len(view))
    return view.tobytes()


# --- the encoder ---


def weld(rows: NDArray[np.uint8]) -> tuple[UInt32s, int]:
    """Give bit-identical rows one number, in order of first occurrence.

    rows: uint8[N, stride]. Returns (numbers: uint32[N], number of different rows).
    """
    rows = array_of(rows, np.uint8, -1, -1)
    numbers, count = np.empty(len(rows), np.uint32), c_uint32()
    functions.weld(rows.ctypes, *rows.shape, numbers.ctypes, byref(count))
    return numbers, count.value


def scan_lines(
    text: bytes, keywords: Mapping[str, str]
) -> list[tuple[NDArray[Any], UInt32s, UInt32s]]:
    """Return the lines that start with each keyword, in any case; all lines if it is empty.

    keywords: in lower case, with the words after each. 'numbers'; 'corners': each word is 1 to 3
    integers between slashes, and gives 3; 0 for one that is not there; 'any': not read. Returns for
    each (numbers: float64[N], of corners int32[N], numbers of each line: uint32[L], their offsets
    in the text: uint32[L]). Raises ValueError, with the line, for a word that is not a number.
    """
    kinds = {"any": 0, "numbers": 1, "corners": 2}
    problem = "words are 'any', 'numbers' or 'corners'"
    words = np.array([_number_of(kind, kinds, problem) for kind in keywords.values()], np.uint32)
    names = (ctypes.c_char_p * len(keywords))(*(name.encode() for name in keywords))
    result = Result()
    functions.scan_lines(text, len(text), names, words.ctypes, len(keywords), result.out)
    types = [np.int32 if kind == "corners" else np.float64 for kind in keywords.values()]
    return [
        (result.array(3 * i, dtype), result.array(3 * i + 1), result.array(3 * i + 2))
        for i, dtype in enumerate(types)
    ]


def triangulate(points: NDArray[np.float32], sizes: NDArray[np.integer[Any]]) -> UInt32s:
    """uint32[T, 3]: corners of triangles, numbered over all polygons, one polygon after the other.

    points: float32[corners, 3], one polygon after the other; sizes: corners of each polygon, of
    which those with fewer than 3 give no triangle. Convex polygons become fans around their first
    corner, others lose their ears.
    """
    points = array_of(points, np.float32, -1, 3)
    sizes = np.ascontiguousarray(sizes, np.uint32)
    result = Result()
    functions.triangulate(points.ctypes, len(points), sizes.ctypes, len(sizes), result.out)
    return result.array(0).reshape(-1, 3)


def _row_of(stream: Stream) -> StreamRow:
    """Return the stream as C has it, which checks it. -1 becomes GLTF_MESHLET_CHOOSE_PREDICTOR."""
    integers = stream.kind, stream.elements, stream.bits, stream.predictor
    if not all(-1 <= number < 255 for number in integers):
        raise ValueError(f"{stream} has a number that is not from -1 to 254")
    if len(stream.offset) > STREAM_MAX_ELEMENTS:
        raise ValueError(f"{stream} has more than {STREAM_MAX_ELEMENTS} offsets")
    offset = (c_float * STREAM_MAX_ELEMENTS)(*stream.offset)
    return StreamRow(*map(operator.index, integers), step=stream.step, offset=offset)


def _options(max_triangles: int, max_vertices: int, effort: str, **fields: Any) -> Struct:
    if not (1 <= max_triangles <= MESHLET_TRIANGLES and 3 <= max_vertices <= MESHLET_VERTICES):
        raise ValueError("a meshlet holds 1 to 64 triangles and 3 to 64 vertices")
    number = _number_of(effort, {"normal": 0, "fast": 1}, "effort is 'fast' or 'normal'")
    sizes = {"max_triangles": max_triangles, "max_vertices": max_vertices}
    return MeshletOptions(effort=number, **sizes, **fields)


def _mesh(
    triangles: UInt32s,
    position_ids: UInt32s,
    positions: Floats,
    streams: Sequence[Stream],
    values: Sequence[UInt32s],
    meshlets: dict[str, Any],
) -> Struct:
    """Return the struct of a mesh. meshlets: its fields for those. Raises ValueError."""
    positions = array_of(positions, np.float32, -1, 3)
    position_ids = array_of(position_ids, np.uint32, -1)
    if len(position_ids) != len(positions):
        raise ValueError("position_ids and positions differ in length")
    triangles = array_of(triangles, np.uint32, -1, 3)
    values = [array_of(v, np.uint32, -1, -1) for v in values]
    if len(streams) != len(values):
        raise ValueError("streams and values differ in number")
    if any(v.shape != (len(positions), s.elements) for v, s in zip(values, streams)):
        raise ValueError("a stream's values have the wrong shape")
    table = (StreamRow * len(streams))(*map(_row_of, streams))
    lists = {"triangles": triangles, "streams": table, "values": pointers(values)}
    counts = {"triangle_count": len(triangles), "stream_count": len(streams)}
    vertices = {"position_ids": position_ids, "positions": positions}
    return Mesh(vertex_count=len(positions), **vertices, **lists, **counts, **meshlets)


def encode(
    triangles: UInt32s,
    position_ids: UInt32s,
    positions: Floats,
    streams: Sequence[Stream],
    values: Sequence[UInt32s],
    max_triangles: int = 64,
    max_vertices: int = 64,
    lambda_: float = 0.0,
    threads: int = 0,
    progress: Callable[[float], object] | None = None,
    page_bytes: int = 0,
    meshlets: tuple[UInt32s, UInt32s | None, UInt32s, UInt32s | None] | None = None,
    effort: str = "normal",
    function: Callable[..., object] = functions.encode_described,
) -> tuple[bytes, dict[str, Any]]:
    """Encode one primitive.

    triangles: uint32[T, 3], no index twice in a triangle. position_ids: uint32[V], below V, equal
    where positions are. positions: float32[V, 3]. values: uint32[V, elements] per stream. lambda_:
    0 means the default. progress: called with a fraction from 0 to 1; what it raises cancels.
    page_bytes: 0 for one blob, else pages, blobs of at most so many bytes. meshlets: those of the
    caller, as uint32 arrays (triangles, disk begins, meshlet begins, group begins; each of the
    begins ends with the number of its items). Without disk begins, meshlets are any triangles, by
    begins of those, and are split as need be; without group begins, they are one group. Pages then
    hold whole groups in their order; without page_bytes, each holds one. effort: 'fast' or
    'normal'. function: gltf_meshlet_encode_described, or another (tools/paper_encoder.py).

    Returns (view, statistics): those of describe, and 'generation': {'histogram', 'iterations'}.
    Raises ValueError or TypeError for bad arguments.
    """
    order = {} if meshlets is None else _order(meshlets, len(triangles))
    mesh = _mesh(triangles, position_ids, positions, streams, values, order)
    options = _options(
        max_triangles,
        max_vertices,
        effort,
        threads=threads,
        lambda_=lambda_,
        page_bytes=page_bytes,
    )
    statistics, result = Statistics(), Result()
    _run(options, progress, lambda: function(mesh, options, statistics, result.out))
    view = result.array(0, np.uint8).tobytes()
    return view, _describe(view, statistics)


def _describe(view: bytes, statistics: Struct) -> dict[str, Any]:
    """Return a view's statistics as the encoder counted them."""
    generation = {"histogram": tuple(statistics.histogram), "iterations": statistics.iterations}
    return {**View(view).description(statistics), "generation": generation}


def _order(meshlets: tuple[UInt32s | None, ...], triangle_count: int) -> dict[str, Any]:
    """Return the fields of a mesh for the caller's meshlets. Raises ValueError."""
    names = ("order", "disk_begin", "meshlet_begin", "group_begin")
    parts = {name: part for name, part in zip(names, meshlets) if part is not None}
    arrays = {name: array_of(part, np.uint32, -1) for name, part in parts.items()}
    if len(arrays["order"]) != triangle_count:
        raise ValueError("the meshlets do not hold each triangle once")
    counts = {f"{name}_count": len(arrays[name]) for name in names[1:] if name in arrays}
    return {**arrays, **counts}


def _run(
    options: Struct, progress: Callable[[float], object] | None, function: Callable[[], object]
) -> None:
    """Call a function whose options have a progress callback; raises what the callback raises."""
    raised: list[BaseException] = []

    def call(_: object, fraction: float) -> int:
        try:
            progress(fraction)  # type: ignore[misc]
        except BaseException as error:
            raised.append(error)
        return len(raised)

    if progress is not None:
        options.progress = PROGRESS(call)
    try:
        function()
    except Cancelled:
        raise raised[0] from None


# --- levels of detail ---


ONE_LEVEL, ALL_LEVELS, LAST_LEVEL = range(3)  # what build_levels makes of a chunk


def build_levels(
    triangles: UInt32s,
    position_ids: UInt32s,
    positions: Floats,
    streams: Sequence[Stream],
    values: Sequence[UInt32s],
    clusters: tuple[UInt32s, UInt32s] | None,
    simplifier: Struct,
    page_bytes: int = 0,
    max_triangles: int = 64,
    lambda_: float = 0.0,
    effort: str = "normal",
    threads: int = 0,
    progress: Callable[[float], object] | None = None,
    **fields: Any,
) -> tuple[Result, Callable[[bytes], dict[str, Any]]]:
    """Build levels of detail and encode them in pages.

    page_bytes: 0 for a page for each group, of any size. clusters: (begins of disks, begins of
    meshlets) in the triangles; None to make those of level 0. fields: the others of
    gltf_meshlet_levels_input. Other arguments as in `encode`.

    Returns the arrays of gltf_meshlet_build_levels, and a function that takes the pages of level 0
    and returns statistics as `encode`. Raises ValueError for bad arguments.
    """
    mesh = _mesh(triangles, position_ids, positions, streams, values, _clusters(clusters))
    sizes = {"lambda_": lambda_, "threads": threads, "page_bytes": page_bytes}
    options = _options(max_triangles, MESHLET_VERTICES, effort, **sizes)
    levels = LevelsInput(mesh=mesh, simplifier=simplifier, **fields)
    statistics, result = Statistics(), Result()
    _run(options, progress, lambda: functions.build_levels(levels, options, statistics, result.out))
    return result, lambda view: _describe(view, statistics)


def _clusters(begins: tuple[UInt32s, UInt32s] | None) -> dict[str, Any]:
    """Return the fields of a mesh for begins of disks and meshlets."""
    if begins is None:
        return {}
    disks, meshlets = (array_of(begin, np.uint32, -1) for begin in begins)
    counts = {"disk_begin_count": len(disks), "meshlet_begin_count": len(meshlets)}
    return {"disk_begin": disks, "meshlet_begin": meshlets, **counts}


def surface_distances(
    points: Floats, positions: Floats, triangles: UInt32s, enough: float = 0.0, threads: int = 0
) -> tuple[Floats, UInt32s]:
    """Measure the distance of points to triangles.

    Args:
        points: float32[N, 3].
        positions: float32[V, 3]: of the triangles' vertices.
        triangles: uint32[T, 3].
        enough: any triangle that is no farther than this will do instead of the nearest.
        threads: number of threads, 0 for all processors.

    Returns:
        float32[N]: the distance of each point; uint32[N]: the triangle.

    Raises:
        ValueError: arrays do not fit each other.
    """
    points, positions = array_of(points, np.float32, -1, 3), array_of(positions, np.float32, -1, 3)
    surface = groups_of(triangles, np.array([0, len(triangles)], np.uint32))
    surface_points = positions.ctypes, len(positions), enough, threads
    distances, nearest = np.empty(len(points), np.float32), np.empty(len(points), np.uint32)
    functions.get_distances(
        points.ctypes, len(points), surface, *surface_points, distances.ctypes, nearest.ctypes
    )
    return distances, nearest


def nearest_weights(points: Doubles, corners: Doubles) -> Doubles:
    """Return float64[N, 3]: corner weights of the nearest point of each triangle.

    points: float64[N, 3]; corners: float64[N, 3, 3].
    """
    points = array_of(points, np.float64, -1, 3)
    corners = array_of(corners, np.float64, len(points), 3, 3)
    weights = np.empty_like(points)
    functions.get_nearest_weights(points.ctypes, corners.ctypes, len(points), weights.ctypes)
    return weights
