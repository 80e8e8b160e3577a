"""Encodes a large primitive, chunk after chunk."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext.compression.options import DEFAULT_PAGE_BYTES, Options
from gltf_ext.compression.streams import Plan
from gltf_ext.errors import MeshletError
from gltf_ext.lod.document import Levels
from gltf_ext.out_of_core.chunks import SAMPLES, Cells, Corners, are_among, leaves
from gltf_ext.out_of_core.records import RecordFormat
from gltf_ext.out_of_core.sources import (
    UNEVEN,
    LargePrimitive,
    Rows,
    blocks,
    chunk_size,
    fitting,
    share_of_chunk,
)
from gltf_ext.out_of_core.totals import Totals
from gltf_ext.progress import Advance
from gltf_ext.scheduler import Runner
from gltf_ext.work_files import WorkFile, give_back_memory

# Shares of the progress: triangles read, and sorted into chunks; the rest is for encoding.
READ, SORTED = 0.1, 0.2
# In the work files, at most: bytes of a triangle's results with all levels; triangles of two levels
# in a row over those of level 0, whose chunks are gone by then (gltf_ext.lod.builder.SHRINK each).
OUTPUT_BYTES, LEVELS_SHARE = 8, 1.5


@dataclass
class Encoded:
    """A large primitive, encoded.

    Attributes:
        plan: its streams, with the bounds of positions as values; view: the pages of level 0.
        levels: all others; None without levels of detail.
        statistics: as _codec.encode gives them.
        source_vertices: number of different vertices; dropped: of triangles.
    """

    plan: Plan
    view: memoryview
    levels: Levels | None
    statistics: dict[str, Any]
    source_vertices: int
    dropped: int


def encode_large(
    source: LargePrimitive,
    form: RecordFormat,
    options: Options,
    runner: Runner,
    advance: Advance | None,
) -> Encoded:
    """Encodes a primitive in chunks, which are the runner's tasks. Raises MeshletError, OSError."""
    progress = advance or (lambda share: None)
    _check_space(source, form, options)
    corners = sorted_corners(source, form, options, progress)

    def rest(share: float) -> None:
        progress(SORTED + (1 - SORTED) * share)

    levels = None
    if options.lod:
        from gltf_ext.out_of_core.levels import LevelsWriter  # slow to load

        writer = LevelsWriter(form, options, runner)
        view, levels = writer.write(corners, rest)
        totals = writer.totals
    else:
        view, totals = _level_0(form, corners, options, runner, rest)
    if not totals.statistics:
        raise MeshletError(f"{form.where}: every triangle is degenerate", "repair the model first")
    values = [np.stack([totals.low, totals.high]), *form.plan.values[1:]]
    return Encoded(
        replace(form.plan, values=values),
        view,
        levels,
        totals.statistics,
        totals.source_vertices,
        totals.dropped,
    )


def _check_space(source: LargePrimitive, form: RecordFormat, options: Options) -> None:
    """Raises MeshletError when the work files do not fit their disk."""
    folder = str(options.work_dir)
    of_levels = math.ceil(LEVELS_SHARE * form.coarse.itemsize) if options.lod else 0
    corner_bytes = max(form.fine.itemsize, of_levels)
    needed = (3 * corner_bytes + OUTPUT_BYTES) * source.triangle_count
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise MeshletError(
            f"work files need {needed:,} bytes, {free:,} are free",
            "free some space or use another work_dir",
            path=folder,
            options=("work_dir",),
        )


# --- triangles, sorted into chunks ---


def sorted_corners(
    source: LargePrimitive, form: RecordFormat, options: Options, progress: Advance
) -> Corners:
    """The triangles as records of their corners, in chunks."""
    folder, limit = str(options.work_dir), chunk_size(options, source.triangle_count)
    size, whole = 3 * form.fine.itemsize, source.triangle_count
    soup, sample = WorkFile(folder), []
    stride = max(whole // SAMPLES, 1)
    for first, last, corners, share in gathered(source, form, soup):
        soup.write(corners, first * size)
        if share == 1.0:
            chosen = corners[-first % stride :: stride]["0"]
            sample.append(chosen.astype(np.int32).sum(axis=1) // 3)
        progress(READ * share * last / whole)
    cells = Cells.over(np.concatenate(sample), leaves(whole, limit, 0), 0)
    result = Corners(cells, form, folder)

    # From the end: the file shrinks as those of the chunks grow.
    parts = list(blocks(whole))[::-1]
    for (first, _), found in zip(
        parts,
        source.in_order(lambda *part: result.sorted(_rows(soup, form, *part)), parts),
    ):
        result.add(*found)
        soup.cut(first * size)
        progress(SORTED + (READ - SORTED) * first / whole)
    soup.close()
    if result.counts.max() > UNEVEN * fitting(options):
        raise MeshletError(
            f"{source.where} has {result.counts.max():,} triangles in one place of the grid",
            "use more position bits or more memory",
            options=("max_memory",),
        )
    return result


def gathered(
    source: LargePrimitive, form: RecordFormat, soup: WorkFile
) -> Iterator[tuple[int, int, np.ndarray, float]]:
    """(first, last, their corners: fine[last - first, 3], share of the passes) of triangles.

    Vertices are in memory as far as they fit. Then each pass over the triangles completes the
    records that the one before has written to `soup`.
    """
    passes = [
        (names, numbers, low, high)
        for names, numbers in source.indices
        for low, high in (
            blocks(source.attributes[names[0]].count, source.room // form.fine.itemsize)
            if numbers
            else [(0, 0)]
        )
    ]
    parts = list(blocks(source.triangle_count))
    for done, (names, numbers, low, high) in enumerate(passes):
        table = _Table(source, form, names, numbers, low, high, len(passes) == 1)
        tasks = ((soup if done else None, *part) for part in parts)
        for (first, last), corners in zip(parts, source.in_order(table.corners, tasks)):
            yield first, last, corners, (done + 1) / len(passes)
        del table  # before the next one is made


class _Table:
    """Records of some vertices."""

    def __init__(
        self,
        source: LargePrimitive,
        form: RecordFormat,
        names: tuple[str, ...],
        numbers: Rows | None,
        low: int,
        high: int,
        is_all: bool,
    ) -> None:
        """names, numbers: one of source.indices; low, high: of the vertices; is_all: whether these
        are all of the primitive."""
        self._source, self._form, self._names, self._numbers = source, form, names, numbers
        self._low, self._is_all = low, is_all
        self._records = np.empty(high - low, form.part(names))
        for _ in source.in_order(self._read, blocks(high - low)):
            pass

    def _read(self, first: int, last: int) -> None:
        self._records[first:last] = self._quantised(self._low + first, self._low + last)

    def _quantised(self, first: int, last: int) -> np.ndarray:
        return self._form.quantised(self._source.vertices(self._names, first, last))

    def corners(self, before: WorkFile | None, first: int, last: int) -> np.ndarray:
        """fine[last - first, 3]: the corners of triangles as far as they are here, others as
        before."""
        low, records = self._low, self._records
        if self._numbers is None:
            low = 3 * first
            records = self._quantised(low, 3 * last)
        rows = self._source.corners(self._names, self._numbers, first, last) - low
        if self._is_all:
            all_corners: np.ndarray = records[rows]
            return all_corners
        is_here = (rows >= 0) & (rows < len(records))
        form = self._form
        corners = _rows(before, form, first, last) if before else np.zeros(rows.shape, form.fine)
        for field in records.dtype.names or ():
            corners[field][is_here] = records[field][rows[is_here]]
        return corners


def _rows(soup: WorkFile, form: RecordFormat, first: int, last: int) -> np.ndarray:
    """fine[last - first, 3]: corners of triangles."""
    return soup.rows(form.fine, 3 * first, 3 * (last - first)).reshape(-1, 3)


# --- without levels of detail ---


def _level_0(
    form: RecordFormat, corners: Corners, options: Options, runner: Runner, progress: Advance
) -> tuple[memoryview, Totals]:
    """Encodes each chunk by itself."""
    output, totals = WorkFile(str(options.work_dir)), Totals()
    tasks = (
        (form, options, corners.take(chunk), corners.shared) for chunk in range(corners.cells.count)
    )
    share = share_of_chunk(options, int(corners.counts.sum()), int(corners.counts.max()))
    for number, (view, found) in enumerate(runner.map(_encoded, tasks, *share), start=1):
        output.append(view)
        totals.add(found)
        progress(corners.counts[:number].sum() / corners.counts.sum())
    return output.mapped(), totals


def _encoded(
    threads: int, form: RecordFormat, options: Options, corners: np.ndarray, shared: np.ndarray
) -> tuple[bytes, Totals]:
    """The pages of a chunk. corners: fine[T, 3]; shared: keys of positions that others have."""
    vertices = form.vertices_of(corners)
    totals = Totals.of(vertices, are_among(shared, vertices.records["0"]))
    if not len(vertices.triangles):
        return b"", totals
    primitive, plan = form.primitive_of(vertices)
    view, totals.statistics = _codec.encode(
        primitive.indices,
        vertices.position_ids,
        np.ascontiguousarray(primitive.attributes["POSITION"], np.float32),
        plan.streams,
        plan.values,
        threads=threads,
        page_bytes=options.page_bytes or DEFAULT_PAGE_BYTES,
        **options.generation,
    )
    give_back_memory()
    return view, totals
