"""Reads EXT_meshlet_lod: the tables and pages of each primitive, and meshes of cuts."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._joinable import Joinable
from gltf_ext.attributes.extension import (
    Compressed,
    bytes_of,
    compressed_primitives,
    malformed,
    malformed_from,
    require_compressed,
)
from gltf_ext.attributes.join import decode, without_copies
from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, name_of
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.lod.cuts import Cut
from gltf_ext.lod.tables import EXTENSION, VERSION, Tables, read_tables
from gltf_ext.ranges import begins, members
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import Primitive
from gltf_ext.work_files import release

COUNTS = ("pageCount", "coarsePageCount", "groupCount", "runCount")
# The stream table of a blob: kind, elements and bits; predictor, bases; step and offset.
STREAM = np.dtype([("kind", "u1", 3), ("codes", "u1", 5), ("grid", "<f4", 5)])
STREAM_COUNT_AT, HEADER_BYTES = 5, 32


@dataclass
class LodPrimitive:
    """A compressed primitive with levels.

    Attributes:
        compressed: level 0, as EXT_meshlet_edgebreaker describes it.
        tables: the hierarchy.
        coarse: the bytes of the coarse pages, one after the other.
        streams: the fields of the stream table that all pages have in common.
    """

    compressed: Compressed
    tables: Tables
    coarse: memoryview
    streams: tuple[Any, ...]
    _checked_pages: set[int] = field(default_factory=set, init=False, repr=False)  # checked pages

    def page(self, number: int) -> bytes:
        """Return the blob of a page."""
        begin = self.tables.page_begin
        first, last = int(begin[number]), int(begin[number + 1])
        if number < self.tables.coarse_pages:
            return bytes(self.coarse[first:last])
        return bytes(self.compressed.blob[first - len(self.coarse) : last - len(self.coarse)])

    @cached_property
    def cluster_triangles(self) -> np.ndarray:
        """int64[C]: number of triangles of each cluster. Reads all pages' headers."""
        of_pages = [
            _codec.Header(self.page(p)).meshlet_triangles for p in range(len(self.tables.pages))
        ]
        counts = np.concatenate(of_pages).astype(np.int64)
        if len(counts) != self.tables.cluster_begin[-1]:
            raise self.malformed("its pages do not have the clusters of its groups")
        return counts

    def drawn_triangles(self, cut: Cut) -> int:
        """Return number of triangles of a cut."""
        return int(self.cluster_triangles[cut.drawn].sum())

    @property
    def where(self) -> str:
        """Its place, for errors."""
        return f"{EXTENSION} of {self.compressed.where}"

    def malformed(self, problem: str) -> MeshletError:
        """Return the error for a primitive that breaks the specification."""
        return malformed(self.where, problem)

    def mesh(self, cut: Cut) -> Primitive:
        """Return the triangles of a cut with all attributes. Decodes the pages of its clusters.

        Vertices that are equal in several pages or levels are there once. Raises MeshletError.
        """
        tables = self.tables
        fine = tables.cluster_begin[self.groups_of(tables.coarse_pages)[0]]
        if cut.drawn[fine:].all() and cut.pages[0] >= tables.coarse_pages:
            for page in cut.pages:
                self.drawn_of_page(int(page), cut.drawn)
            return decode(self.compressed)
        triangles: list[np.ndarray] = []
        integers: list[list[np.ndarray]] = []
        values: list[list[np.ndarray]] = []
        first = [0]
        for page in cut.pages:
            part, of_streams = self._drawn_of(int(page), cut.drawn)
            vertex_ids, local = np.unique(part.triangles, return_inverse=True)
            triangles.append(local.reshape(-1, 3).astype(np.uint32) + np.uint32(first[-1]))
            integers.append([v[vertex_ids] for v in part.integers])
            values.append([v[vertex_ids] for v in of_streams])
            first.append(first[-1] + len(vertex_ids))
        whole = Joinable(
            np.concatenate(triangles),
            [np.concatenate(column) for column in zip(*integers)],
            np.array(first[:-1], np.uint64),
        )
        of_cut = [np.concatenate(column) for column in zip(*values)]
        return self.compressed.as_primitive(*without_copies(whole, of_cut, source_vertices=0))

    def drawn_of_page(self, page: int, drawn: np.ndarray) -> np.ndarray:
        """Return the numbers of a page's meshlets that a cut draws, int64. Raises MeshletError.

        Checks the page the first time.

        Args:
            page: number of the page.
            drawn: bool[C], of the cut.
        """
        if page not in self._checked_pages:
            self.check_page(page)
            self._checked_pages.add(page)
        begin = self.tables.cluster_begin
        first, last = self.groups_of(page)
        return np.flatnonzero(drawn[begin[first] : begin[last]])

    def _drawn_of(self, page: int, drawn: np.ndarray) -> tuple[Joinable, list[np.ndarray]]:
        """Return (triangles to draw in the page's vertices, its values)."""
        selection, blob = self.drawn_of_page(page, drawn), self.page(page)
        with malformed_from(f"{self.where}: page {page}"):
            part, values = _codec.decode_joinable(blob, threads=1)
        triangle_begin = begins(_codec.Header(blob).meshlet_triangles)
        part.triangles = part.triangles[members(triangle_begin, selection)]
        return part, values

    def check_page(self, number: int, blob: bytes | None = None) -> None:
        """Compare a page's header with the tables and level 0. Raises MeshletError.

        blob: the page, if it has been read.
        """
        blob = self.page(number) if blob is None else blob
        with malformed_from(f"{self.where}: page {number}"):
            header = _codec.Header(blob)
        row, begin = self.tables.pages[number], self.tables.cluster_begin
        first, last = self.groups_of(number)
        stated_counts = (row["triangles"], row["vertices"], begin[last] - begin[first])
        if (header.triangle_count, header.vertex_count, header.meshlet_count) != stated_counts:
            raise self.malformed(f"page {number} has other counts than the tables say")
        if streams_of_blob(blob) != self.streams:
            raise self.malformed(f"page {number} has other streams than level 0")

    def decoded(self, number: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return (triangles, integers of the streams) of a page, as _codec.decode returns them.

        Releases mapped memory of the file. Raises MeshletError.
        """
        with malformed_from(f"{self.where}: page {number}"):
            result = _codec.decode(self.page(number), threads=1)
        release(self.coarse)
        release(self.compressed.blob)
        return result

    def groups_of(self, page: int) -> tuple[int, int]:
        """Return the page's first group, and the next page's."""
        first = np.append(self.tables.pages["firstGroup"], len(self.tables.groups))
        return int(first[page]), int(first[page + 1])


def streams_of_blob(blob: bytes | memoryview) -> tuple[Any, ...]:
    """Return (kind, elements and bits; step and offset) of a blob's streams.

    Predictors and bases may differ between pages.
    """
    table = np.frombuffer(blob, STREAM, count=blob[STREAM_COUNT_AT], offset=HEADER_BYTES)
    return table["kind"].tolist(), table["grid"].tolist()


def open_lod(path: Model) -> list[LodPrimitive | Compressed]:
    """Read every compressed primitive of a file, in order of (mesh, primitive).

    Args:
        path: of a .glb or .gltf, or a pygltflib.GLTF2.

    Returns:
        The primitives with their levels; those without levels as `Compressed`.

    Raises:
        MeshletError: the file or its tables are malformed.
        OSError: the file cannot be read.
    """
    with blaming(name_of(path)):
        document = open_model(path)
        return [read_lod(document, c) or c for c in require_compressed(document)]


def read_lod(document: Document, compressed: Compressed) -> LodPrimitive | None:
    """Return the primitive's levels; None without the extension, or with another version of it.

    Checks the tables, and that they describe all blobs of level 0. Raises MeshletError.
    """
    primitive = document.primitive(compressed.mesh, compressed.primitive)
    extension = gltf.extension(primitive, EXTENSION)
    if extension is None:
        return None
    where = f"{EXTENSION} of {compressed.where}"
    if not isinstance(extension, dict):
        raise malformed(where, "is not an object")
    version = extension.get("version")
    if isinstance(version, bool) or not isinstance(version, int):
        raise malformed(where, "has no valid version")
    if version != VERSION:
        return None
    try:
        counts = [_count(extension, name) for name in COUNTS]
        tables = read_tables(bytes_of(document, extension), *counts)
        if extension.get("rootPageCount", tables.root_pages) != tables.root_pages:
            raise ValueError(f"{EXTENSION} has another rootPageCount than its groups")
        coarse = bytes_of(document, extension.get("pages"))
        _check_lengths(tables, coarse, compressed)
    except ValueError as error:
        text = error.message if isinstance(error, MeshletError) else str(error)
        raise MeshletError(f"{compressed.where}: {text}") from None
    return LodPrimitive(compressed, tables, coarse, streams_of_blob(compressed.blob))


def levels_of(document: Document) -> list[LodPrimitive]:
    """Return the primitives with levels, one of those that share data. Raises MeshletError."""
    by_view: dict[int, LodPrimitive] = {}
    for compressed in compressed_primitives(document):
        primitive = read_lod(document, compressed)
        if primitive is not None:
            by_view.setdefault(compressed.view, primitive)
    return list(by_view.values())


def _count(extension: dict[str, Any], name: str) -> int:
    value = extension.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 32:
        raise MeshletError(f"{EXTENSION} has no valid {name}", "compress the original again")
    return value


def _check_lengths(tables: Tables, coarse: memoryview, compressed: Compressed) -> None:
    """Raise ValueError unless the pages are exactly the blobs of both views."""
    sizes = tables.pages["byteLength"]
    for kind, data, expected in (
        ("coarse pages", coarse, sizes[: tables.coarse_pages]),
        ("pages of level 0", compressed.blob, sizes[tables.coarse_pages :]),
    ):
        if [size for _, size in _codec.split(data)] != expected.tolist():
            raise ValueError(
                f"{EXTENSION} does not describe its {kind}; compress the original again"
            )
