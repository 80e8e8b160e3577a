"""Encodes a primitive, chunk after chunk; most have one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.attributes.records import RecordFormat
from gltf_ext.attributes.streams import Plan
from gltf_ext.encode.chunks import SAMPLES, Cells, ChunkFiles, Chunks, OneChunk, leaves
from gltf_ext.encode.totals import Totals
from gltf_ext.encode.without_levels import PlainEncoder, encode_chunk
from gltf_ext.errors import MeshletError
from gltf_ext.lod.document import Levels
from gltf_ext.options import Options
from gltf_ext.progress import Advance
from gltf_ext.scheduler import Runner
from gltf_ext.sources.memory import UNEVEN, chunk_size, triangles_that_fit
from gltf_ext.sources.primitives import DropCounts
from gltf_ext.sources.row_arrays import Rows
from gltf_ext.sources.source import Source, blocks
from gltf_ext.work_files import Spool, WorkFile, check_space

# Shares of the progress: triangles read, and sorted into chunks; the rest is for encoding.
READ_END, SORT_END = 0.1, 0.2
# In the work files, at most: bytes of a triangle's results with all levels; triangles of two levels
# in a row over those of level 0, whose chunks are gone by then (SHRINK each).
OUTPUT_BYTES, LEVELS_SHARE = 8, 1.5


@dataclass
class Compression:
    """What a primitive became.

    Attributes:
        plan: its streams; view: the blobs of level 0.
        bounds: uint32[2, 3] of each stream of positions, on the grid.
        statistics: as _codec.encode gives them; empty if no triangle is left.
        source_vertices: number of different vertices; drop_counts: what is left out.
        levels: all others; None without levels of detail.
        equal_vertices: the table of attributes/equal_vertices.py; empty for none.
    """

    plan: Plan = field(default_factory=Plan)
    view: bytes | memoryview = b""
    bounds: dict[int, np.ndarray] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    source_vertices: int = 0
    drop_counts: DropCounts = field(default_factory=DropCounts)
    levels: Levels | None = None
    equal_vertices: bytes = b""


def encode(
    source: Source,
    record_format: RecordFormat,
    options: Options,
    runner: Runner,
    advance: Advance | None,
) -> Compression:
    """Encode a primitive in chunks, which are the runner's tasks. Raises MeshletError, OSError."""
    chunks: Chunks
    progress: Advance = _silent
    encoder = PlainEncoder.of(record_format, options, source.triangle_count, source.is_in_memory)
    if source.is_in_memory:
        chunks = OneChunk(record_format.triangles_of(source), advance)
    else:
        progress = advance or _silent
        _check_space(source, record_format, options)
        chunks = sort_corners(source, record_format, options, progress)

    def encode_progress(fraction: float) -> None:
        progress(SORT_END + (1 - SORT_END) * fraction)

    levels = None
    if options.lod:
        from gltf_ext.encode.levels import LevelsWriter  # slow to load, as meshoptimizer is

        writer = LevelsWriter(encoder, options, runner, chunks.folder)
        view, levels = writer.write(chunks, encode_progress)
        totals = writer.totals
    else:
        view, totals = _encode_without_levels(encoder, chunks, options, runner, encode_progress)
    return Compression(
        record_format.plan,
        view,
        totals.bounds,
        totals.statistics,
        totals.source_vertices,
        totals.drop_counts,
        levels,
    )


def _silent(fraction: float) -> None:
    """Progress that nobody watches."""


def _check_space(source: Source, record_format: RecordFormat, options: Options) -> None:
    """Raise MeshletError when the work files do not fit their disk."""
    of_levels = math.ceil(LEVELS_SHARE * record_format.coarse.itemsize) if options.lod else 0
    corner_bytes = max(record_format.fine.itemsize, of_levels)
    needed_bytes = (3 * corner_bytes + OUTPUT_BYTES) * source.triangle_count
    check_space(str(options.work_dir), needed_bytes)


# --- triangles, sorted into chunks ---


def sort_corners(
    source: Source, record_format: RecordFormat, options: Options, progress: Advance
) -> ChunkFiles:
    """Return the triangles as records of their corners, in chunks."""
    folder, limit = str(options.work_dir), chunk_size(options, source.triangle_count)
    size, total = 3 * record_format.fine.itemsize, source.triangle_count
    corner_file, sample = WorkFile(folder), []
    stride = max(total // SAMPLES, 1)
    for first, last, corners, fraction in gather_corners(source, record_format, corner_file):
        corner_file.write(corners, first * size)
        if fraction == 1.0:
            positions = corners[-first % stride :: stride]["0"]
            sample.append(positions.astype(np.int32).sum(axis=1) // 3)
        progress(READ_END * fraction * last / total)
    cells = Cells.over(np.concatenate(sample), leaves(total, limit, 0), 0)
    result = ChunkFiles(cells, record_format, folder)

    # From the end: the file shrinks as those of the chunks grow.
    parts = list(blocks(total))[::-1]
    rows_by_chunk = source.in_order(
        lambda *part: result.sort(_rows(corner_file, record_format, *part)), parts
    )
    for (first, _), rows in zip(parts, rows_by_chunk):
        result.add(*rows)
        corner_file.truncate(first * size)
        progress(SORT_END + (READ_END - SORT_END) * first / total)
    corner_file.close()
    if result.counts.max() > UNEVEN * triangles_that_fit(options):
        raise MeshletError(
            f"{source.where} has {result.counts.max():,} triangles in one place of the grid",
            "use more position bits or more memory",
            options=("max_memory",),
        )
    return result


def gather_corners(
    source: Source, record_format: RecordFormat, corner_file: WorkFile
) -> Iterator[tuple[int, int, np.ndarray, float]]:
    """Yield (first, last, corners: fine[last - first, 3], fraction of the passes) of triangles.

    Vertices are in memory as far as they fit. Then each pass over the triangles completes the
    records that the one before has written to `corner_file`.
    """
    passes = [
        (names, numbers, low, high)
        for names, numbers in source.numberings
        for low, high in (
            blocks(source.attributes[names[0]].count, source.room // record_format.fine.itemsize)
            if numbers
            else [(0, 0)]
        )
    ]
    parts = list(blocks(source.triangle_count))
    for index, (names, numbers, low, high) in enumerate(passes):
        table = _Table(source, record_format, names, numbers, low, high, len(passes) == 1)
        tasks = ((corner_file if index else None, *part) for part in parts)
        for (first, last), corners in zip(parts, source.in_order(table.corners, tasks)):
            yield first, last, corners, (index + 1) / len(passes)
        del table  # before the next one is made


class _Table:
    """Records of some vertices."""

    def __init__(
        self,
        source: Source,
        record_format: RecordFormat,
        names: tuple[str, ...],
        numbers: Rows | None,
        low: int,
        high: int,
        is_all: bool,
    ) -> None:
        """Read vertices.

        names, numbers: one of source.numberings; low, high: of the vertices; is_all: whether
        these are all of the primitive.
        """
        self._source, self._record_format, self._names, self._numbers = (
            source,
            record_format,
            names,
            numbers,
        )
        self._low, self._is_all = low, is_all
        self._records = np.empty(high - low, record_format.part(names))
        for _ in source.in_order(self._read_block, blocks(high - low)):
            pass

    def _read_block(self, first: int, last: int) -> None:
        low = self._low
        vertices = self._source.vertices(self._names, low + first, low + last)
        self._record_format.quantise_into(self._records[first:last], vertices)

    def corners(self, corner_file: WorkFile | None, first: int, last: int) -> np.ndarray:
        """Return the corners of triangles: fine[last - first, 3].

        Vertices that the table does not have are as in the work file `corner_file`.
        """
        low, records = self._low, self._records
        if self._numbers is None:
            low = 3 * first
            vertices = self._source.vertices(self._names, low, 3 * last)
            records = self._record_format.quantise(vertices)
        rows = self._source.corners(self._names, self._numbers, first, last).astype(np.int64)
        rows -= low
        if self._is_all:
            all_corners: np.ndarray = records[rows]
            return all_corners
        is_here = (rows >= 0) & (rows < len(records))
        record_format = self._record_format
        corners = (
            _rows(corner_file, record_format, first, last)
            if corner_file
            else np.zeros(rows.shape, record_format.fine)
        )
        for stream in records.dtype.names or ():
            corners[stream][is_here] = records[stream][rows[is_here]]
        return corners


def _rows(corner_file: WorkFile, record_format: RecordFormat, first: int, last: int) -> np.ndarray:
    """Return fine[last - first, 3]: corners of triangles."""
    return corner_file.rows(record_format.fine, 3 * first, 3 * (last - first)).reshape(-1, 3)


# --- without levels of detail ---


def _encode_without_levels(
    encoder: PlainEncoder, chunks: Chunks, options: Options, runner: Runner, progress: Advance
) -> tuple[memoryview, Totals]:
    """Encode each chunk by itself."""
    counts, totals = chunks.counts, Totals()
    output = Spool(chunks.folder, max_memory=0)
    tasks = (
        (encoder, chunks.take(number), chunks.border_keys, chunks.advance)
        for number in range(len(counts))
    )
    results = runner.map(encode_chunk, tasks, *chunks.memory_plan(options))
    for number, (view, chunk_totals) in enumerate(results, start=1):
        output.append(view)
        totals.add(chunk_totals)
        progress(counts[:number].sum() / counts.sum())
    return output.contents(), totals
