"""Cuts space into chunks: a k-d tree over positions on the grid, and the triangles of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gltf_ext.attributes.records import RecordFormat, Triangles
from gltf_ext.options import Options
from gltf_ext.progress import Advance
from gltf_ext.sources.memory import plan_chunk_memory
from gltf_ext.work_files import hashes, open_work_files

SAMPLES = 1 << 18  # of triangles, to place the planes


@dataclass
class Cells:
    """A k-d tree. Leaves are numbered so that neighbours are close.

    Attributes:
        first, count: numbers of the leaves below.
        axis, split: points with less than `split` on the axis are in `low`, the others in `high`;
            all unused in a leaf.
    """

    first: int
    count: int
    axis: int = 0
    split: int = 0
    low: Cells | None = None
    high: Cells | None = None

    @classmethod
    def over(cls, points: np.ndarray, count: int, level: int, first: int = 0) -> Cells:
        """Return a tree with `count` leaves of about equally many of the points, int[N, 3].

        level: of detail. Planes of two levels in a row differ: shared borders are locked, and those
        of one level are to be inside of the next one's chunks.
        """
        if count == 1 or not len(points):
            return cls(first, count)
        axis = int(np.argmax(np.ptp(points, axis=0)))
        below = max(count // (3 if level % 2 else 2), 1)
        middle = len(points) * below // count
        split = int(np.partition(points[:, axis], middle)[middle])
        is_low = points[:, axis] < split
        return cls(
            first,
            count,
            axis,
            split,
            cls.over(points[is_low], below, level, first),
            cls.over(points[~is_low], count - below, level, first + below),
        )

    def of(self, points: np.ndarray) -> np.ndarray:
        """Return int32[N]: the leaf of each point, int[N, 3]."""
        result = np.full(len(points), self.first, np.int32)
        self._fill(points, np.arange(len(points)), result)
        return result

    def keys_outside(self, chunk: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Return uint64: hashes of positions that triangles of several chunks may have.

        These are those of corners outside of the cell of their triangle's chunk.
        chunk: int32[T]; corners: int[T, 3, 3]: positions.
        """
        low, high = (bound[chunk][:, None] for bound in self._boxes)
        is_outside = ((corners < low) | (corners >= high)).any(axis=2)
        return np.unique(hashes(corners[is_outside]))

    @cached_property
    def _boxes(self) -> np.ndarray:
        """int64[2, leaves, 3]: points of a leaf are from the first value on, before the second."""
        boxes = np.empty((2, self.count, 3), np.int64)
        boxes[0], boxes[1] = np.iinfo(np.int64).min, np.iinfo(np.int64).max
        for child, bound, nearer in ((self.low, 1, np.minimum), (self.high, 0, np.maximum)):
            if child is not None:
                rows = slice(child.first - self.first, child.first - self.first + child.count)
                boxes[:, rows] = child._boxes
                column = boxes[bound, rows, self.axis]
                column[:] = nearer(column, self.split)
        return boxes

    def _fill(self, points: np.ndarray, rows: np.ndarray, result: np.ndarray) -> None:
        if self.low is None or self.high is None:
            result[rows] = self.first
            return
        is_high = points[rows, self.axis] >= self.split
        self.low._fill(points, rows[~is_high], result)
        self.high._fill(points, rows[is_high], result)


def leaves(triangles: int, limit: int, level: int) -> int:
    """Return the number of chunks of at most about `limit` triangles."""
    count = -(-triangles // limit)
    return 3 if count == 2 and level % 2 else count


def union(keys: Iterable[np.ndarray]) -> np.ndarray:
    """Return uint64: the different keys, in ascending order."""
    return np.unique(np.concatenate([np.empty(0, np.uint64), *keys]))


def are_among(keys: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return bool[N]: whether several chunks may have a position, int[N, 3].

    keys: uint64, ascending: of such positions.
    """
    if not len(keys):
        return np.zeros(len(positions), bool)
    position_keys = hashes(positions)
    result: np.ndarray = (
        keys[np.minimum(np.searchsorted(keys, position_keys), len(keys) - 1)] == position_keys
    )
    return result


class ChunkFiles:
    """Triangles in work files, by chunk.

    Attributes:
        cells: the chunks; counts: int64: number of triangles of each.
        folder: of the work files; advance: None, since the chunks themselves are the progress.
    """

    advance = None

    def __init__(self, cells: Cells, record_format: RecordFormat, folder: str) -> None:
        """Open a work file for each cell, for records of this form. Raises OSError."""
        self.cells, self.folder = cells, folder
        self.counts = np.zeros(cells.count, np.int64)
        self._record_format = record_format
        self._files = open_work_files(cells.count, folder)
        self._keys: list[np.ndarray] = []

    def sort(self, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sort triangles by chunk.

        Returns (triangles, fine[T, 3], in the order of their chunks, int64: number of those of
        each, uint64: keys of positions that several chunks may have).
        """
        positions = corners["0"].astype(np.int32)
        chunk = self.cells.of(positions.sum(axis=1) // 3)
        order = np.argsort(chunk, kind="stable")
        counts = np.bincount(chunk, minlength=self.cells.count)
        return corners[order], counts, self.cells.keys_outside(chunk, positions)

    def add(self, corners: np.ndarray, counts: np.ndarray, keys: np.ndarray) -> None:
        """Write the corners that `sort` returns to the files of the chunks. Raises OSError."""
        ends = np.cumsum(counts)
        for number in np.flatnonzero(counts):
            self._files[number].append(corners[ends[number] - counts[number] : ends[number]])
        self.counts += counts
        self._keys.append(keys)

    @cached_property
    def border_keys(self) -> np.ndarray:
        """uint64: keys of positions that several chunks may have, once all triangles are added."""
        keys, self._keys = union(self._keys), []
        return keys

    def take(self, chunk: int) -> Triangles:
        """Return the triangles of a chunk, whose file is given back."""
        rows = self._files[chunk].rows(self._record_format.fine, 0, 3 * int(self.counts[chunk]))
        self._files[chunk].close()
        return Triangles(rows)

    def memory_plan(self, options: Options) -> tuple[int, int]:
        """Return (number of chunks that fit memory at a time, bytes for each of them)."""
        return plan_chunk_memory(options, int(self.counts.sum()), int(self.counts.max()))


class OneChunk:
    """All triangles in memory, as the only chunk; see ChunkFiles.

    Attributes:
        advance: moves the progress bar while the chunk is encoded.
    """

    folder = None

    def __init__(self, triangles: Triangles, advance: Advance | None) -> None:
        """Take all triangles of a source."""
        self.counts, self.border_keys = np.array([triangles.count]), np.empty(0, np.uint64)
        self.advance = advance
        self._triangles: Triangles | None = triangles

    def take(self, chunk: int) -> Triangles:
        """Return the triangles, once: only the caller keeps them."""
        triangles, self._triangles = self._triangles, None
        assert triangles is not None and chunk == 0
        return triangles

    def memory_plan(self, options: Options) -> tuple[int, int]:
        """As that of ChunkFiles."""
        return 1, 0


Chunks = ChunkFiles | OneChunk
