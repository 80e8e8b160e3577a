"""
The native codec of EXT_meshlet_edgebreaker.

Functions that take a blob raise ValueError, with one sentence, if it is malformed.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy
import numpy.typing

KIND_GRID: int = 0

KIND_OCT: int = 1

KIND_INTEGER: int = 2

KIND_FLOAT32: int = 3

KIND_SIGN: int = 4

PREDICT_PARALLELOGRAM: int = 0

PREDICT_MEAN: int = 1

PREDICT_COPY: int = 2

PREDICT_DAMPED: int = 3

PREDICT_GEO: int = 4

PREDICT_AFFINE: int = 5

PREDICT_MAX_BITS: int = 24

GRID_MAX_BITS: int = 24

OCT_MIN_BITS: int = 2

OCT_MAX_BITS: int = 16

STREAM_MAX_ELEMENTS: int = 4

STREAM_MAX_BITS: int = 32

BLOB_MAX_STREAMS: int = 64

MESHLET_TRIANGLES: int = 64

MESHLET_VERTICES: int = 64

def generate_in_groups(
    triangles: numpy.typing.NDArray[numpy.uint32],
    triangle_begin: numpy.typing.NDArray[numpy.uint32],
    position_ids: numpy.typing.NDArray[numpy.uint32],
    positions: numpy.typing.NDArray[numpy.float32],
    max_triangles: int = 64,
    lambda_: float = 0.0,
    effort: str = "normal",
    threads: int = 0,
) -> tuple[
    numpy.typing.NDArray[numpy.uint32],
    numpy.typing.NDArray[numpy.uint32],
    numpy.typing.NDArray[numpy.uint32],
    numpy.typing.NDArray[numpy.uint32],
]:
    """
    Makes meshlets that never cross groups. Group g: triangles triangle_begin[g] ..
    triangle_begin[g + 1]. Other arguments as in encode; position_ids: any numbers, equal where
    positions are. Returns (uint32[T], numbers of the triangles
    in order, disk begins, meshlet begins, group begins), the begins as encode takes them.
    Raises ValueError.
    """

class ReplacementErrors:
    """Level 0, to measure what replaces parts of it. Keeps its arrays."""

    def __init__(
        self,
        shapes: list[numpy.typing.NDArray[numpy.float32]],
        triangles: numpy.typing.NDArray[numpy.uint32],
        begin: numpy.typing.NDArray[numpy.uint32],
        vertex_share: float,
        threads: int = 0,
    ) -> None:
        """
        shapes: float32[V, 3] each: positions at rest, and with each morph target. triangles,
        begin: level 0 in groups. vertex_share: the share of its area that its vertices stand for.
        Raises ValueError.
        """

    def measure(
        self,
        before: numpy.typing.NDArray[numpy.uint32],
        before_begin: numpy.typing.NDArray[numpy.uint32],
        after: numpy.typing.NDArray[numpy.uint32],
        after_begin: numpy.typing.NDArray[numpy.uint32],
        chosen: numpy.typing.NDArray[numpy.uint32],
        carried: numpy.typing.NDArray[numpy.uint32],
        carried_begin: numpy.typing.NDArray[numpy.uint32],
        areas: numpy.typing.NDArray[numpy.float32],
    ) -> tuple[
        numpy.typing.NDArray[numpy.float32],
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.float32],
    ]:
        """
        Measures chosen groups of triangles that others replace. before, after: uint32[T, 3]
        with begins, of whole levels. carried: vertices of level 0 that are gone, in the chosen
        groups; areas: float32, of level 0 that each one stands for. Returns (float32: the
        distance between each chosen replacement and level 0 that 99.9 % of either surface keeps,
        vertices to carry on, for each the triangle of its group's `after` that is nearest, their
        begins, their areas). Raises ValueError.
        """

def surface_distances(
    points: numpy.typing.NDArray[numpy.float32],
    positions: numpy.typing.NDArray[numpy.float32],
    triangles: numpy.typing.NDArray[numpy.uint32],
    threads: int = 0,
) -> numpy.typing.NDArray[numpy.float32]:
    """
    Returns float32[N]: the distance of each point (float32[N, 3]) to the nearest triangle.
    Raises ValueError.
    """

def hilbert_order(
    points: numpy.typing.NDArray[numpy.float32],
) -> numpy.typing.NDArray[numpy.uint32]:
    """
    Returns uint32[N]: the numbers of points (finite float32[N, 3]) along a Hilbert curve.
    """

def weld(rows: numpy.typing.NDArray[numpy.uint8]) -> tuple[numpy.typing.NDArray[numpy.uint32], int]:
    """
    Gives bit-identical rows one number, in order of first occurrence. rows: uint8[N, stride].
    Returns (numbers: uint32[N], number of different rows).
    """

def encode(
    triangles: numpy.typing.NDArray[numpy.uint32],
    position_ids: numpy.typing.NDArray[numpy.uint32],
    positions: numpy.typing.NDArray[numpy.float32],
    streams: Sequence[Mapping[str, Any]],
    values: Sequence[numpy.typing.NDArray[numpy.uint32]],
    max_triangles: int = 64,
    max_vertices: int = 64,
    lambda_: float = 0.0,
    fill: float = 0.0,
    weight: str = "paper",
    share_seams: bool = True,
    threads: int = 0,
    progress: Callable[[float], object] | None = None,
    page_bytes: int = 0,
    meshlets: tuple[
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.uint32],
        numpy.typing.NDArray[numpy.uint32],
    ]
    | None = None,
    effort: str = "normal",
) -> tuple[bytes, dict[str, Any]]:
    """
    Encodes one primitive.

    triangles: uint32[T, 3], no index twice in a triangle. position_ids: uint32[V], equal where
    positions are. positions: float32[V, 3]. streams: dicts of kind, components (integers per
    vertex), bits, step, offset, predictor (-1: the encoder chooses). values: uint32[V,
    components] per stream. lambda_, fill: 0 means the default. weight: 'paper' or 'choe'. Fill
    and weight are there to measure the paper's Table 1, share_seams to measure its gain. threads:
    0 means one per processor. progress: called with a fraction from 0 to 1. page_bytes: 0 for
    one blob, else pages, blobs of at most so many bytes. meshlets: those of the caller, as
    uint32 arrays (triangles, disk begins, meshlet begins, group begins; each of the begins ends
    with the number of its items). Pages then hold whole groups in their order; without
    page_bytes, each holds one. effort: 'fast', 'normal' or 'high'.

    Returns (view, statistics): those of describe, and 'generation': {'histogram',
    'iterations'}. Raises ValueError for bad arguments.
    """

def decode(
    view: bytes, threads: int = 0
) -> tuple[numpy.typing.NDArray[numpy.uint32], list[numpy.typing.NDArray[numpy.uint32]]]:
    """
    Decodes a view: one blob or several, one on each thread (0: one thread per processor).
    Returns (triangles: uint32[T, 3], [uint32[V, components] per stream]).
    """

def decode_values(
    view: bytes, threads: int = 0
) -> tuple[numpy.typing.NDArray[numpy.uint32], list[numpy.typing.NDArray[Any]]]:
    """
    Returns (triangles: uint32[T, 3], [values per stream]): uint32[V, components] for INTEGER,
    float32[V, 3] unit vectors for OCT, float32[V, components] otherwise.
    """

def split(view: bytes) -> list[tuple[int, int]]:
    """Returns (offset, size) of each blob of a view. Checks all headers."""

def describe(view: bytes) -> dict[str, Any]:
    """
    Returns counts, streams and numbers of bits; the entries of 'bits' sum to 8 * len(view).
    """

def validate(view: bytes, threads: int = 0) -> None:
    """
    Raises ValueError if a blob of the view is malformed in any way. Decodes every meshlet
    alone, and so finds errors that decode may accept.
    """

class StreamHeader:
    """A row of a blob's stream table."""

    @property
    def kind(self) -> int:
        """One of KIND_."""

    @property
    def elements(self) -> int:
        """Integers per vertex, 1 to 4."""

    @property
    def bits(self) -> int:
        """Bits per element, 1 to 32."""

    @property
    def predictor(self) -> int:
        """One of PREDICT_."""

    @property
    def chain_base(self) -> int:
        """Base of the parameters of chains' codes."""

    @property
    def interior_base(self) -> int:
        """Base of the parameters of interiors' codes."""

    @property
    def anchor_base(self) -> int:
        """Base of the widths of further anchors."""

    @property
    def step(self) -> float:
        """GRID: value = offset + integer * step."""

    @property
    def offset(self) -> list[float]:
        """One float per element."""

class Header:
    """The header and tables of a blob; see read_header."""

    @property
    def triangle_count(self) -> int: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def meshlet_count(self) -> int: ...
    @property
    def data_offset(self) -> int:
        """Byte offset of the meshlets' data: the size of header and tables."""

    @property
    def streams(self) -> list[StreamHeader]: ...
    @property
    def meshlet_triangles(self) -> numpy.typing.NDArray[numpy.uint32]:
        """uint32[meshlet_count]: number of triangles of each meshlet."""

def read_header(blob: bytes) -> Header:
    """Reads and checks header and tables; decodes nothing."""

class Decoder:
    """
    Decodes single meshlets of a view, numbered on through its blobs. Not thread-safe.
    """

    def __init__(self, view: bytes) -> None: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def meshlet_count(self) -> int: ...
    @property
    def streams(self) -> list[dict[str, Any]]:
        """The stream table as dicts, as encode takes them."""

    def decode_meshlet(
        self, index: int
    ) -> tuple[numpy.typing.NDArray[numpy.uint8], list[numpy.typing.NDArray[numpy.uint32]]]:
        """
        Returns (triangles: uint8[t, 3] local ids, [uint32[v, components] per stream]). Raises
        IndexError.
        """

    def decode_many(self, indices: numpy.typing.NDArray[numpy.uint32]) -> int:
        """
        Decodes the meshlets of these numbers (uint32[n]) without making arrays, for timing.
        Returns the number of their triangles. Raises IndexError.
        """
