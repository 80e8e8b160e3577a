"""Levels of detail of a large primitive, built level after level in chunks."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gltf_ext.compression.options import Options
from gltf_ext.errors import MeshletError
from gltf_ext.lod import simplifier
from gltf_ext.lod.builder import Builder, Clusters, Hierarchy, Made
from gltf_ext.lod.document import Levels
from gltf_ext.lod.pilot import SMALLEST, Pilot
from gltf_ext.lod.reduction import SHRINK
from gltf_ext.lod.surface import Surface
from gltf_ext.lod.tables import MAX_GROUPS
from gltf_ext.lod.writing import Pages, error_limit_of, paged, surface_of, tables_of
from gltf_ext.out_of_core.chunks import Cells, Corners, are_among, leaves, union
from gltf_ext.out_of_core.records import RecordFormat
from gltf_ext.out_of_core.sources import blocks, chunk_size, reading, share_of_chunk
from gltf_ext.out_of_core.totals import Totals
from gltf_ext.progress import Advance
from gltf_ext.ranges import begins, members
from gltf_ext.scheduler import Runner, in_order
from gltf_ext.work_files import WorkFile, give_back_memory

NO_CLUSTERS = Clusters(np.empty((0, 3), np.uint32), np.zeros(1, np.int64), np.zeros(1, np.int64))
ALL_LEVELS = 1.4  # triangles of all levels over those of level 0, for the progress


# --- a chunk, wherever it is built ---


@dataclass
class Waiting:
    """Clusters that wait for the next level.

    Attributes:
        corners: coarse[T, 3]: their triangles.
        disks, clusters: int64: number of triangles of each disk, and of disks of each cluster.
        refined, error, centre, radius: as in Made.
    """

    corners: np.ndarray
    disks: np.ndarray
    clusters: np.ndarray
    refined: np.ndarray
    error: np.ndarray
    centre: np.ndarray
    radius: np.ndarray

    def made(self, triangles: np.ndarray) -> Made:
        """triangles: uint32[T, 3] of the corners."""
        clusters = Clusters(triangles, begins(self.disks), begins(self.clusters))
        return Made(clusters, self.refined, self.error, self.error, self.centre, self.radius)

    @classmethod
    def of(cls, made: Made, records: np.ndarray) -> Waiting:
        """records: coarse[V], of the vertices."""
        clusters = made.clusters
        disks, counts = np.diff(clusters.disk_begin), np.diff(clusters.cluster_begin)
        corners = records[clusters.triangles]
        return cls(corners, disks, counts, made.refined, made.error, made.centre, made.radius)


@dataclass
class Chunk:
    """A chunk of a level, to be built.

    Attributes:
        first_group: number of the first group that it makes.
        corners: of its triangles; given: its clusters, None in level 0.
        shared: keys of positions that other chunks may have too, in ascending order.
        is_last: whether it is the only one of its level: then all further levels are built.
        must_end: whether there are to be no further levels.
    """

    level: int
    first_group: int
    corners: np.ndarray
    given: Waiting | None
    shared: np.ndarray
    is_last: bool
    must_end: bool = False


@dataclass
class Built:
    """What became of a chunk.

    Attributes:
        count: of its triangles; totals: of level 0.
        hierarchy: without clusters; None for no groups. coarse, fine: their pages.
        triangles: of the groups of each level; stuck: of the builder.
        waiting: clusters for the next level.
    """

    count: int
    totals: Totals
    hierarchy: Hierarchy | None = None
    coarse: Pages = field(default_factory=Pages)
    fine: Pages = field(default_factory=Pages)
    triangles: list[int] = field(default_factory=list)
    stuck: list[int] = field(default_factory=list)
    waiting: Waiting | None = None


def build_chunk(threads: int, form: RecordFormat, options: Options, chunk: Chunk) -> Built:
    """Builds and encodes the groups of a chunk. Raises MeshletError."""
    vertices = form.vertices_of(chunk.corners)
    is_shared = are_among(chunk.shared, vertices.records["0"])
    totals = Totals() if chunk.level else Totals.of(vertices, is_shared)
    built = Built(len(chunk.corners), totals)
    if not len(vertices.triangles):
        return built
    primitive, plan = form.primitive_of(vertices)
    surface = surface_of(primitive, plan, vertices.position_ids)
    surface.fixed = is_shared
    given = chunk.given.made(vertices.triangles) if chunk.given else None
    group_size, page_bytes = options.lod_group, options.lod_page_bytes
    while True:
        pilot = Pilot(plan, surface.position_ids, surface.points, page_bytes)
        builder = _builder(form, options, threads, chunk, surface, given, group_size, pilot)
        if not builder.groups:
            break
        hierarchy = builder.result()
        give_back_memory()
        built.coarse, built.fine = paged(
            hierarchy, surface, plan, vertices.position_ids, page_bytes, threads
        )
        give_back_memory()
        largest = max(map(len, built.coarse.blobs + built.fine.blobs))
        if largest <= page_bytes or group_size <= SMALLEST:
            sizes = np.diff(hierarchy.clusters.triangle_begin)
            counts = np.bincount(hierarchy.level[hierarchy.group], sizes)
            built.triangles = counts.astype(int).tolist()
            hierarchy.clusters = NO_CLUSTERS
            built.hierarchy = hierarchy
            break
        group_size = max(group_size // 2, SMALLEST)  # rare: see the pilot
    built.stuck = builder.stuck
    if len(builder.pending):
        records = form.without_hash(vertices.records)
        built.waiting = Waiting.of(builder.made.chosen(builder.pending), records)
    built.totals.statistics = built.fine.statistics
    return built


def _builder(
    form: RecordFormat,
    options: Options,
    threads: int,
    chunk: Chunk,
    surface: Surface,
    given: Made | None,
    group_size: int,
    pilot: Pilot,
) -> Builder:
    """A builder that has built the chunk's levels."""
    builder = Builder(
        surface,
        options,
        group_size,
        error_limit_of(options, form.plan),
        options.lod_reduction,
        threads,
        given,
        chunk.level,
        chunk.first_group,
        pilot,
    )
    if chunk.must_end:
        builder.end()
    else:
        while builder.add_level(may_end=chunk.is_last) and chunk.is_last:
            pass
    builder.meter = None  # its trees are as large as all else
    if chunk.level == 0 and not chunk.is_last and np.isinf([g[1] for g in builder.groups]).any():
        raise MeshletError(
            f"{form.where}: all triangles of a chunk collapse on the grid",
            "use more position bits or a smaller step",
        )
    return builder


# --- all chunks ---


class Pool:
    """Clusters that wait for the next level. Their triangles are in a work file.

    Attributes:
        triangles: number of all.
    """

    def __init__(self, form: RecordFormat, options: Options) -> None:
        self._form, self._file = form, WorkFile(str(options.work_dir))
        self._threads = reading(options)[1]
        self._added: list[tuple[np.ndarray, ...]] = []
        self.triangles = 0

    def add(self, waiting: Waiting) -> None:
        self._file.append(waiting.corners)
        self.triangles += len(waiting.corners)
        values = (waiting.refined, waiting.error, waiting.centre, waiting.radius)
        self._added.append((waiting.disks, waiting.clusters, *values))

    def close(self) -> None:
        self._file.close()

    def chunks(self, count: int, level: int, first_group: int, must_end: bool) -> Iterator[Chunk]:
        """The clusters in about `count` chunks."""
        disks, in_cluster, *values = (np.concatenate(column) for column in zip(*self._added))
        cluster_begin = begins(in_cluster)
        triangle_begin = begins(disks)[cluster_begin]
        points = np.rint(values[2]).astype(np.int32)  # centres
        cells = Cells.over(points, count, level)
        chunk = cells.of(points)
        shared = self._shared(cells, np.repeat(chunk, np.diff(triangle_begin)))
        for number in range(count):
            chosen = np.flatnonzero(chunk == number)
            if not len(chosen):
                continue
            corners = self._corners(triangle_begin, chosen)
            in_disks = disks[members(cluster_begin, chosen)]
            given = Waiting(corners, in_disks, in_cluster[chosen], *(v[chosen] for v in values))
            yield Chunk(level, first_group, corners, given, shared, count == 1, must_end)

    def _shared(self, cells: Cells, chunk: np.ndarray) -> np.ndarray:
        """uint64: keys of the positions that several chunks may have. chunk: of each triangle."""

        def keys(first: int, last: int) -> np.ndarray:
            return cells.keys_outside(chunk[first:last], self._rows(first, last)["0"])

        parts = blocks(self.triangles) if cells.count > 1 else ()
        return union(in_order(keys, parts, self._threads))

    def _corners(self, triangle_begin: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """coarse[T, 3]: the triangles of clusters, in ascending order of their numbers."""
        starts = np.flatnonzero(np.diff(chosen, prepend=-2) != 1)
        ends = np.append(starts[1:], len(chosen)) - 1
        runs = zip(triangle_begin[chosen[starts]], triangle_begin[chosen[ends] + 1])
        return np.concatenate([self._rows(int(first), int(last)) for first, last in runs])

    def _rows(self, first: int, last: int) -> np.ndarray:
        return self._file.rows(self._form.coarse, 3 * first, 3 * (last - first)).reshape(-1, 3)


class LevelsWriter:
    """Builds and encodes the levels of a primitive.

    Attributes:
        totals: of level 0.
    """

    def __init__(self, form: RecordFormat, options: Options, runner: Runner) -> None:
        """Raises MeshletError without meshoptimizer."""
        simplifier.require_simplifier()
        self.totals = Totals()
        self._form, self._options, self._runner = form, options, runner
        self._folder = str(options.work_dir)
        self._hierarchies: list[Hierarchy] = []  # without clusters
        self._group_count = 0
        # By level; those of the last chunk have all further levels.
        self._pages: dict[int, Pages] = defaultdict(Pages)  # without blobs, which are in the files
        self._files: dict[int, WorkFile] = defaultdict(lambda: WorkFile(self._folder))
        self._triangles: Counter[int] = Counter()  # by level
        self._stuck: Counter[int] = Counter()

    def write(self, corners: Corners, progress: Advance) -> tuple[memoryview, Levels | None]:
        """(the pages of level 0, all other levels; None if simplification leaves too much).

        Raises MeshletError, OSError.
        """
        whole = int(corners.counts.sum())
        done = 0

        def run(level: int, count: int, chunks: Iterator[Chunk], share: tuple[int, int]) -> Pool:
            """Builds all chunks of a level; returns what waits for the next one."""
            nonlocal done
            pool, first_group = Pool(self._form, self._options), self._group_count
            tasks = ((self._form, self._options, chunk) for chunk in chunks)
            at_once, memory = share
            for built in self._runner.map(build_chunk, tasks, min(at_once, count), memory):
                self._add(built, level, first_group, pool)
                done += built.count
                progress(min(done / whole / ALL_LEVELS, 1.0))
            return pool

        share = share_of_chunk(self._options, whole, int(corners.counts.max()))
        pool = run(0, corners.cells.count, _chunks_of(corners), share)
        level, before = 0, whole
        if pool.triangles > SHRINK * whole:
            pool.close()
            return self._files[0].mapped(), None
        while pool.triangles:
            level += 1
            size = chunk_size(self._options, pool.triangles)
            count = leaves(pool.triangles, size, level)
            # Chunks alone never end; if they do not shrink, all do.
            must_end = count > 1 and pool.triangles > SHRINK * before
            before = pool.triangles
            chunks = pool.chunks(count, level, self._group_count, must_end)
            share = share_of_chunk(self._options, pool.triangles)
            following = run(level, count, chunks, share)
            pool.close()
            pool = following
        pool.close()
        has_levels = len(self._pages) > 1
        return self._files[0].mapped(), self._levels() if has_levels else None

    def _add(self, built: Built, level: int, first_group: int, following: Pool) -> None:
        """Writes the groups of a chunk; its replacements go to the next level's pool.

        first_group: the number that the chunk gave its first group.
        """
        self.totals.add(built.totals)
        self._stuck.update({level + k: count for k, count in enumerate(built.stuck)})
        if built.waiting:
            refined = built.waiting.refined
            refined[refined >= first_group] += self._group_count - first_group
            following.add(built.waiting)
        if not built.hierarchy:
            return
        for place, pages in ((max(level, 1), built.coarse), (0, built.fine)):
            if pages.blobs:
                self._files[place].append(b"".join(pages.blobs))
                groups = [self._group_count + numbers for numbers in pages.groups]
                self._pages[place].add(Pages(groups, [], pages.rows))
        self._triangles.update(dict(enumerate(built.triangles)))
        built.hierarchy.group = built.hierarchy.group + self._group_count
        self._hierarchies.append(built.hierarchy)
        self._group_count += len(built.hierarchy.level)
        if self._group_count > MAX_GROUPS:
            raise MeshletError(f"{self._form.where} has more than {MAX_GROUPS} groups", "split it")

    def _levels(self) -> Levels:
        order = sorted(self._pages, reverse=True)
        rows = [row for level in order for row in self._pages[level].rows]
        groups = [g for level in order for g in self._pages[level].groups]
        coarse = WorkFile(self._folder)
        for level in order[:-1]:
            file = self._files[level]
            for first, last in blocks(file.size):
                coarse.append(file.rows(np.dtype("u1"), first, last - first))
            file.close()
        names = ("group", "refined", "level", "error", "centre", "radius")
        joined = {n: np.concatenate([getattr(h, n) for h in self._hierarchies]) for n in names}
        hierarchy = Hierarchy(NO_CLUSTERS, **joined, stuck=[])
        coarse_pages = len(rows) - len(self._pages[0].rows)
        tables = tables_of(hierarchy, groups, rows, coarse_pages, self._form.plan)
        levels = range(max(self._triangles) + 1)
        report = {
            "triangles": [self._triangles[level] for level in levels],
            "stuck_triangles": [self._stuck[level] for level in levels],
        }
        return Levels(tables, coarse.mapped(), report)


def _chunks_of(corners: Corners) -> Iterator[Chunk]:
    """The chunks of level 0."""
    count = corners.cells.count
    for number in range(count):
        rows = corners.take(number)
        yield Chunk(0, 0, rows, None, corners.shared, count == 1)
