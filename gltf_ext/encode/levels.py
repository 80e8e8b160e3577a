"""Levels of detail of a primitive, built level after level in chunks; most have one chunk."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.records import RecordFormat, Triangles, Vertices
from gltf_ext.encode.chunks import Cells, Chunks, are_among, leaves, union
from gltf_ext.encode.totals import Totals
from gltf_ext.encode.without_levels import PlainEncoder
from gltf_ext.errors import MeshletError
from gltf_ext.lod.builder import (
    SHRINK,
    ChunkLevels,
    ClusterRanges,
    ClusterSet,
    Hierarchy,
    LevelSettings,
    Pages,
    build_levels,
)
from gltf_ext.lod.document import Levels
from gltf_ext.lod.simplifier import simplifier
from gltf_ext.lod.surface import Surface
from gltf_ext.lod.tables import MAX_GROUPS
from gltf_ext.lod.writing import error_limit_of, make_surface, make_tables
from gltf_ext.options import Options
from gltf_ext.progress import Advance
from gltf_ext.ranges import begins, members
from gltf_ext.scheduler import Runner, in_order
from gltf_ext.sources.memory import chunk_size, plan_chunk_memory, reading_limits
from gltf_ext.sources.source import blocks
from gltf_ext.work_files import Spool, WorkFile, give_back_memory, release

ALL_LEVELS = 1.4  # triangles of all levels over those of level 0, for the progress
BUILD_SHARE = 0.6  # of the progress of a chunk that is alone; the rest is for its pages
# With more vertices than this for each position, the first step is larger: seams hold coarse levels
# back, whose pages would take 0.9 of level 0 (sponza_like) instead of 0.65.
SEAMS, LARGER_STEP = 1.15, 1.25


# --- a chunk, wherever it is built ---


@dataclass
class Remainder:
    """Clusters that the next level groups.

    Attributes:
        corners: coarse[T, 3]: records of their triangles.
        disks, clusters: int64: number of triangles of each disk, and of disks of each cluster.
        finer_group, error, spheres: as in ClusterSet.
    """

    corners: np.ndarray
    disks: np.ndarray
    clusters: np.ndarray
    finer_group: np.ndarray
    error: np.ndarray
    spheres: np.ndarray

    def with_triangles(self, triangles: np.ndarray) -> ClusterSet:
        """triangles: uint32[T, 3] of the corners."""
        ranges = ClusterRanges(triangles, begins(self.disks), begins(self.clusters))
        return ClusterSet(ranges, self.finer_group, self.error, self.spheres)

    @classmethod
    def of(cls, clusters: ClusterSet, records: np.ndarray) -> Remainder:
        """Return a remainder of clusters. records: coarse[V], of their vertices."""
        ranges = clusters.ranges
        disks, counts = np.diff(ranges.disk_begin), np.diff(ranges.cluster_begin)
        corners = records[ranges.triangles]
        origin = clusters.finer_group, clusters.error, clusters.spheres
        return cls(corners, disks, counts, *origin)


@dataclass
class Chunk:
    """A chunk of a level, to be levels.

    Attributes:
        first_group: number of the first group that it makes.
        triangles: its triangles; clusters: of them, None in level 0.
        border_keys: keys of positions that other chunks may have too, in ascending order.
        is_only: whether its level has no other: then all further levels are levels.
        must_end: whether there are to be no further levels.
        advance: moves the progress bar meanwhile; None for the chunks of a work file.
    """

    level: int
    first_group: int
    triangles: Triangles
    clusters: Remainder | None
    border_keys: np.ndarray
    is_only: bool
    must_end: bool = False
    advance: Advance | None = None


@dataclass
class ChunkResult:
    """What became of a chunk.

    Attributes:
        count: of its triangles; totals: of level 0.
        hierarchy: None for no groups. coarse, fine: their pages.
        triangles: of the groups of each level; stuck_triangles: of the builder.
        remainder: clusters for the next level.
    """

    count: int
    totals: Totals
    hierarchy: Hierarchy | None = None
    coarse: Pages = field(default_factory=Pages)
    fine: Pages = field(default_factory=Pages)
    triangles: list[int] = field(default_factory=list)
    stuck_triangles: list[int] = field(default_factory=list)
    remainder: Remainder | None = None


def build_chunk(threads: int, encoder: PlainEncoder, options: Options, chunk: Chunk) -> ChunkResult:
    """Build and encode the groups of a chunk. Raises MeshletError."""
    record_format = encoder.record_format
    count = chunk.triangles.count
    vertices = record_format.vertices_of(chunk.triangles)
    chunk.triangles.clear()
    is_shared = are_among(chunk.border_keys, vertices.records["0"])
    totals = Totals()
    if not chunk.level:
        totals = Totals.of(vertices, is_shared, record_format.plan.position_streams)
    result = ChunkResult(count, totals)
    if not len(vertices.triangles):
        return result
    values = record_format.values_of(vertices.records)
    surface = make_surface(record_format, vertices, values)
    surface.is_locked = is_shared
    levels = _build(record_format, options, threads, chunk, surface, vertices, values)
    if len(levels.hierarchy.group_level):
        if not levels.coarse.groups and not levels.fine.groups:
            encoder_input = record_format.encoder_input_of(vertices)
            view, totals.statistics = encoder.view_of(encoder_input, threads, chunk.advance)
            result.fine = Pages(data=view)
            return result
        result.coarse, result.fine, result.hierarchy = levels.coarse, levels.fine, levels.hierarchy
        result.triangles = levels.triangles
    give_back_memory()
    result.stuck_triangles = levels.stuck_triangles
    if levels.remainder.ranges.count:
        records = record_format.without_hash(vertices.records)
        result.remainder = Remainder.of(levels.remainder, records)
    totals.statistics = levels.statistics
    if chunk.advance:
        chunk.advance(1.0)
    return result


def _build(
    record_format: RecordFormat,
    options: Options,
    threads: int,
    chunk: Chunk,
    surface: Surface,
    vertices: Vertices,
    values: list[np.ndarray],
) -> ChunkLevels:
    """Build the chunk's levels and their pages."""
    has_seams = len(surface.points) > SEAMS * (int(surface.position_ids.max()) + 1)
    one_level = _codec.LAST_LEVEL if chunk.must_end else _codec.ONE_LEVEL
    settings = LevelSettings(
        options.lod_group,
        error_limit_of(options, record_format.plan),
        options.lod_reduction * (LARGER_STEP if has_seams else 1.0),
        options.page_limit_with_levels,
        _codec.ALL_LEVELS if chunk.is_only and not chunk.must_end else one_level,
        chunk.level,
        chunk.first_group,
    )
    advance = chunk.advance
    levels = build_levels(
        surface,
        record_format.plan.streams,
        values,
        vertices.position_ids,
        settings,
        options,
        threads,
        chunk.clusters.with_triangles(surface.triangles) if chunk.clusters else None,
        (lambda fraction: advance(BUILD_SHARE * fraction)) if advance else None,
    )
    if chunk.level == 0 and not chunk.is_only and np.isinf(levels.hierarchy.group_error).any():
        raise MeshletError(
            f"{record_format.where}: all triangles of a chunk collapse on the grid",
            "use more position bits or a smaller step",
        )
    return levels


# --- all chunks ---


class NextLevel:
    """Clusters that wait for a level. Their triangles are in a work file.

    Attributes:
        triangles: number of all.
    """

    def __init__(self, record_format: RecordFormat, options: Options) -> None:
        """Hold no clusters yet. record_format: of the records of their corners."""
        self._record_format, self._options = record_format, options
        self._file: WorkFile | None = None
        self._columns: list[tuple[np.ndarray, ...]] = []
        self.triangles = 0

    def add(self, clusters: Remainder) -> None:
        """Add those of a chunk of the level before. Raises OSError."""
        self._file = self._file or WorkFile(str(self._options.work_dir))
        self._file.append(clusters.corners)
        self.triangles += len(clusters.corners)
        values = (clusters.finer_group, clusters.error, clusters.spheres)
        self._columns.append((clusters.disks, clusters.clusters, *values))

    def close(self) -> None:
        """Give the space on the disk back."""
        if self._file is not None:
            self._file.close()

    def chunks(self, count: int, level: int, first_group: int, must_end: bool) -> Iterator[Chunk]:
        """Return the clusters in about `count` chunks."""
        disks, in_cluster, *values = (np.concatenate(column) for column in zip(*self._columns))
        cluster_begin = begins(in_cluster)
        triangle_begin = begins(disks)[cluster_begin]
        points = np.rint(values[2][:, :3]).astype(np.int32)  # centres
        cells = Cells.over(points, count, level)
        chunk = cells.of(points)
        border_keys = self._border_keys(cells, np.repeat(chunk, np.diff(triangle_begin)))
        for number in range(count):
            selection = np.flatnonzero(chunk == number)
            if not len(selection):
                continue
            corners = self._corners(triangle_begin, selection)
            in_disks = disks[members(cluster_begin, selection)]
            origin = (column[selection] for column in values)
            clusters = Remainder(corners, in_disks, in_cluster[selection], *origin)
            triangles = Triangles(corners.reshape(-1))
            yield Chunk(level, first_group, triangles, clusters, border_keys, count == 1, must_end)

    def _border_keys(self, cells: Cells, chunk: np.ndarray) -> np.ndarray:
        """Return the keys of positions that several chunks may have, uint64.

        chunk: of each triangle.
        """

        def keys(first: int, last: int) -> np.ndarray:
            return cells.keys_outside(chunk[first:last], self._rows(first, last)["0"])

        parts = blocks(self.triangles) if cells.count > 1 else ()
        return union(in_order(keys, parts, reading_limits(self._options)[1]))

    def _corners(self, triangle_begin: np.ndarray, selection: np.ndarray) -> np.ndarray:
        """Return coarse[T, 3]: the triangles of clusters, in ascending order of their numbers."""
        starts = np.flatnonzero(np.diff(selection, prepend=-2) != 1)
        ends = np.append(starts[1:], len(selection)) - 1
        runs = zip(triangle_begin[selection[starts]], triangle_begin[selection[ends] + 1])
        return np.concatenate([self._rows(int(first), int(last)) for first, last in runs])

    def _rows(self, first: int, last: int) -> np.ndarray:
        assert self._file is not None
        return self._file.rows(self._record_format.coarse, 3 * first, 3 * (last - first)).reshape(
            -1, 3
        )


class LevelsWriter:
    """Builds and encodes the levels of a primitive.

    Attributes:
        totals: of level 0.
    """

    def __init__(
        self, encoder: PlainEncoder, options: Options, runner: Runner, folder: str | None
    ) -> None:
        """folder: for work files; None to keep pages in memory.

        Raises MeshletError without meshoptimizer.
        """
        simplifier()
        self.totals = Totals()
        self._encoder, self._options, self._runner = encoder, options, runner
        self._folder = folder
        self._hierarchies: list[Hierarchy] = []
        self._group_count = 0
        # By level; those of the last chunk have all further levels.
        self._pages: dict[int, Pages] = defaultdict(Pages)  # without bytes, which are in the files
        self._files: dict[int, Spool] = defaultdict(lambda: Spool(folder, max_memory=0))
        self._triangles: Counter[int] = Counter()  # by level
        self._stuck_triangles: Counter[int] = Counter()

    def write(self, chunks: Chunks, progress: Advance) -> tuple[memoryview, Levels | None]:
        """Return (the pages of level 0, all other levels; None if simplification leaves too much).

        Raises MeshletError, OSError.
        """
        record_format = self._encoder.record_format
        first_count = last_count = int(chunks.counts.sum())
        run = _Progress(first_count, progress)
        following = self._build(0, _chunks_of(chunks), chunks.memory_plan(self._options), run)
        level = 0
        is_too_much = following.triangles > SHRINK * first_count
        while following.triangles and not is_too_much:
            level += 1
            current = following
            size = chunk_size(self._options, current.triangles)
            count = leaves(current.triangles, size, level)
            # Chunks alone never end; if they do not shrink, all do.
            must_end = count > 1 and current.triangles > SHRINK * last_count
            last_count = current.triangles
            at_once, memory = plan_chunk_memory(self._options, current.triangles)
            following = self._build(
                level,
                current.chunks(count, level, self._group_count, must_end),
                (min(at_once, count), memory),
                run,
            )
            current.close()
        following.close()
        has_levels = len(self._pages) > 1 and not is_too_much
        return self._files[0].contents(), self._levels(record_format) if has_levels else None

    def _build(
        self,
        level: int,
        chunks: Iterator[Chunk],
        memory_plan: tuple[int, int],
        progress: _Progress,
    ) -> NextLevel:
        """Build all chunks of a level; returns what is left for the next one.

        memory_plan: number of chunks at a time, and bytes that one takes.
        """
        following = NextLevel(self._encoder.record_format, self._options)
        first_group = self._group_count
        tasks = ((self._encoder, self._options, chunk) for chunk in chunks)
        for result in self._runner.map(build_chunk, tasks, *memory_plan):
            self._add(result, level, first_group, following)
            progress.add(result.count)
        return following

    def _add(self, result: ChunkResult, level: int, first_group: int, following: NextLevel) -> None:
        """Write the groups of a chunk; its replacements go to the next level.

        first_group: the number that the chunk gave its first group.
        """
        self.totals.add(result.totals)
        self._stuck_triangles.update(
            {level + k: count for k, count in enumerate(result.stuck_triangles)}
        )
        if result.remainder:
            finer = result.remainder.finer_group
            finer[finer >= first_group] += self._group_count - first_group
            following.add(result.remainder)
        for page_level, pages in ((max(level, 1), result.coarse), (0, result.fine)):
            if pages.data:
                self._files[page_level].append(pages.data)
                total = self._pages[page_level]
                total.groups += [self._group_count + numbers for numbers in pages.groups]
                total.rows = np.concatenate([total.rows, pages.rows])
        if not result.hierarchy:
            return
        self._triangles.update(dict(enumerate(result.triangles)))
        result.hierarchy.cluster_group = result.hierarchy.cluster_group + self._group_count
        self._hierarchies.append(result.hierarchy)
        self._group_count += len(result.hierarchy.group_level)
        if self._group_count > MAX_GROUPS:
            where = self._encoder.record_format.where
            raise MeshletError(f"{where} has more than {MAX_GROUPS} groups", "split it")

    def _levels(self, record_format: RecordFormat) -> Levels:
        order = sorted(self._pages, reverse=True)
        rows = np.concatenate([self._pages[level].rows for level in order])
        groups = [g for level in order for g in self._pages[level].groups]
        coarse = Spool(self._folder, max_memory=0)
        for level in order[:-1]:
            pages = self._files[level].contents()
            coarse.append(pages)
            release(pages)
            self._files[level].close()
        columns = map(np.concatenate, zip(*(h.columns for h in self._hierarchies)))
        hierarchy = Hierarchy(*columns)
        coarse_pages = len(rows) - len(self._pages[0].rows)
        tables = make_tables(hierarchy, groups, rows, coarse_pages, record_format.plan)
        levels = range(max(self._triangles) + 1)
        report = {
            "triangles": [self._triangles[level] for level in levels],
            "stuck_triangles": [self._stuck_triangles[level] for level in levels],
        }
        return Levels(tables, coarse.contents(), report)


class _Progress:
    """Counts the triangles of all levels."""

    def __init__(self, triangles: int, advance: Advance) -> None:
        """triangles: triangles of level 0."""
        self._first_count, self._advance, self._count = triangles, advance, 0

    def add(self, triangles: int) -> None:
        self._count += triangles
        self._advance(min(self._count / self._first_count / ALL_LEVELS, 1.0))


def _chunks_of(chunks: Chunks) -> Iterator[Chunk]:
    """Return the chunks of level 0."""
    count = len(chunks.counts)
    for number in range(count):
        triangles = chunks.take(number)
        yield Chunk(0, 0, triangles, None, chunks.border_keys, count == 1, advance=chunks.advance)
