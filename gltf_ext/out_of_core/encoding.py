"""Encodes a large primitive, chunk after chunk."""

from __future__ import annotations

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
from gltf_ext.out_of_core.sources import LargePrimitive, blocks, chunk_size
from gltf_ext.out_of_core.totals import Totals
from gltf_ext.progress import Advance
from gltf_ext.scheduler import Runner
from gltf_ext.work_files import WorkFile, give_back_memory

UNEVEN = 1.5  # chunks that exceed the aimed size by more do not fit
# Shares of the progress: triangles read, and sorted into chunks; the rest is for encoding.
READ, SORTED = 0.1, 0.2
OUTPUT_BYTES = 8  # of a triangle in the work files, at most, with all levels


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
    limit = chunk_size(options)
    _check_space(source, form, options)
    corners = sorted_corners(source, form, options, limit, progress)

    def rest(share: float) -> None:
        progress(SORTED + (1 - SORTED) * share)

    levels = None
    if options.lod:
        from gltf_ext.out_of_core.levels import LevelsWriter  # slow to load

        writer = LevelsWriter(form, options, limit, runner)
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
    corner_bytes = form.fine.itemsize + options.lod * form.coarse.itemsize
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
    source: LargePrimitive, form: RecordFormat, options: Options, limit: int, progress: Advance
) -> Corners:
    """The triangles as records of their corners, in chunks of at most about `limit`."""
    folder = str(options.work_dir)
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
    for first, last in reversed(list(blocks(whole))):
        result.add(_rows(soup, form, first, last))
        soup.cut(first * size)
        progress(SORTED + (READ - SORTED) * first / whole)
    soup.close()
    if result.counts.max() > UNEVEN * limit:
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
    for done, (names, numbers, low, high) in enumerate(passes):
        table = np.empty(high - low, form.part(names))
        for first, last in blocks(high - low):
            table[first:last] = form.quantised(source.vertices(names, low + first, low + last))
        for first, last in blocks(source.triangle_count):
            if numbers is None:
                low = 3 * first
                table = form.quantised(source.vertices(names, low, 3 * last))
            rows = source.corners(names, numbers, first, last) - low
            if len(passes) == 1:
                corners = table[rows]
            else:
                is_here = (rows >= 0) & (rows < len(table))
                corners = np.zeros(rows.shape, form.fine)
                if done:
                    corners = _rows(soup, form, first, last)
                for field in table.dtype.names or ():
                    corners[field][is_here] = table[field][rows[is_here]]
            yield first, last, corners, (done + 1) / len(passes)


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
        (form, options, runner.threads, corners.take(chunk), corners.shared.keys)
        for chunk in range(corners.cells.count)
    )
    for number, (view, found) in enumerate(runner.map(_encoded, tasks, options.memory), start=1):
        output.append(view)
        totals.add(found)
        progress(corners.counts[:number].sum() / corners.counts.sum())
    return output.mapped(), totals


def _encoded(
    form: RecordFormat, options: Options, threads: int, corners: np.ndarray, shared: np.ndarray
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
        [s.table_row() for s in plan.streams],
        plan.values,
        threads=threads,
        page_bytes=options.page_bytes or DEFAULT_PAGE_BYTES,
        **options.generation,
    )
    give_back_memory()
    return view, totals
