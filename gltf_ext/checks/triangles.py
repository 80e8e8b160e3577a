"""Compares triangles as multisets: the encoder may reorder vertices and triangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gltf_ext import _codec
from gltf_ext._joinable import Joinable
from gltf_ext.attributes.extension import Compressed, malformed_from, parts_of
from gltf_ext.attributes.records import HASH, RecordFormat, Triangles, weld_rows
from gltf_ext.checks.topology import Topology, topologies
from gltf_ext.document.accessors import bounds
from gltf_ext.encode.primitive import gather_corners
from gltf_ext.progress import Advance
from gltf_ext.ranges import has_repeats
from gltf_ext.sources.source import Source, blocks
from gltf_ext.work_files import Buckets, WorkFile, hashes

# Of a triangle, and where it is: in the source, in the source but a writer may leave it out because
# two corners are equal, or in the compressed primitive.
TRIANGLE = np.dtype([("key", "<u8"), ("origin", "u1")])
IN_SOURCE, OPTIONAL_IN_SOURCE, IN_COMPRESSED = range(3)
READ_END = 0.5  # of the progress


class Comparison:
    """Triangles by 64-bit hashes of the integers of all streams at their corners.

    Attributes:
        triangles: number of the source's, without those that a writer may leave out.
        missing, extra: number of triangles that only the source has, and only the compressed one.
        box: uint32[2, 3]: smallest and largest integers of the compressed primitive's positions.
        keys: of the compressed primitive's vertices, uint64[V].
        source_triangles, joinable: both sides, quantised; as `keys` None for a source that is read
            in parts, where they might not fit memory.
    """

    def __init__(
        self, source: Source, record_format: RecordFormat, compressed: Compressed, folder: str
    ) -> None:
        """Compare nothing yet: `run` does.

        Args:
            source: the original.
            record_format: of the source, on the grids of the compressed primitive.
            compressed: the primitive to compare.
            folder: for work files.
        """
        count = source.triangle_count + compressed.triangle_count
        self._source, self._record_format = source, record_format
        self._compressed, self._folder = compressed, folder
        self._buckets = Buckets(TRIANGLE, TRIANGLE.itemsize * count, folder)
        self.triangles = self.missing = self.extra = 0
        self.box: np.ndarray | None = None
        self.keys: np.ndarray | None = None
        self.source_triangles: Triangles | None = None
        self.joinable: Joinable | None = None

    def run(self, advance: Advance | None) -> None:
        """Set the counts. Raises MeshletError, OSError."""
        progress = advance or (lambda fraction: None)
        self._add_source(lambda fraction: progress(READ_END * fraction))
        self._add_compressed(lambda fraction: progress(READ_END + (1 - READ_END) * fraction))
        for rows in self._buckets.parts():
            missing, extra = difference(rows)
            self.missing += missing
            self.extra += extra

    def topologies(self) -> tuple[Topology, Topology, Topology] | None:
        """Return those of both sides, as checks/topology.py does; None if it is read in parts.

        Raises MeshletError.
        """
        if self.source_triangles is None or self.joinable is None:
            return None
        with malformed_from(self._compressed.where):
            return topologies(
                self.source_triangles,
                self.joinable,
                self._compressed.source_vertices,
                self._compressed.equal_vertices,
            )

    def _add_source(self, progress: Advance) -> None:
        for keys, positions, fraction in self._source_corners():
            progress(fraction)
            is_optional = has_repeats(positions) & has_repeats(keys)
            self.triangles += len(keys) - int(np.count_nonzero(is_optional))
            self._add(keys, np.where(is_optional, OPTIONAL_IN_SOURCE, IN_SOURCE))

    def _source_corners(self) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
        """Yield keys of vertices and of positions, [T, 3] each, and the progress."""
        source, record_format = self._source, self._record_format
        if source.is_in_memory:
            triangles = record_format.triangles_of(source)
            columns = self._columns(triangles.records)
            self.source_triangles = triangles
            for first, last in blocks(triangles.count):
                rows = triangles.corners_between(first, last)
                keys, positions = (column[rows] for column in columns)
                yield keys, positions, last / triangles.count
            return
        corner_file = WorkFile(self._folder)
        for first, last, corners, fraction in gather_corners(source, record_format, corner_file):
            if fraction < 1.0:
                corner_file.write(corners, 3 * first * record_format.fine.itemsize)
            else:
                yield *self._columns(corners), last / source.triangle_count
        corner_file.close()

    def _columns(self, records: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the keys of _source_corners, of records [...]."""
        streams = [records[str(s)] for s in range(len(self._record_format.plan.streams))]
        return keys_of(streams), records[HASH]

    def _add_compressed(self, progress: Advance) -> None:
        for triangles, integers, fraction in self._decoded():
            keys = np.empty(len(integers[0]), np.uint64)
            for first, last in blocks(len(keys)):
                keys[first:last] = keys_of([values[first:last] for values in integers])
            for first, last in blocks(len(triangles)):
                self._add(keys[triangles[first:last]], IN_COMPRESSED)
            self._widen(integers[0])
            if self._source.is_in_memory:
                self.keys = keys
            progress(fraction)

    def _decoded(self) -> Iterator[tuple[np.ndarray, list[np.ndarray], float]]:
        """Yield triangles and integers of the compressed primitive, and the progress."""
        view = self._compressed.blob
        if self._source.is_in_memory:
            with malformed_from(self._compressed.where):
                self.joinable, _ = _codec.decode_joinable(view)
            yield self.joinable.triangles, self.joinable.integers, 1.0
            return
        byte_count = 0
        for part in parts_of(view):
            with malformed_from(self._compressed.where):
                triangles, integers = _codec.decode(part)
            byte_count += len(part)
            yield triangles, integers, byte_count / len(view)

    def _widen(self, positions: np.ndarray) -> None:
        """Make the box contain positions: uint32[n, 3]."""
        rows = [positions] if self.box is None else [positions, self.box]
        if len(positions):
            self.box = np.stack(bounds(np.concatenate(rows)))

    def _add(self, corners: np.ndarray, origin: np.ndarray | int) -> None:
        """corners: uint64[T, 3]."""
        rows = np.empty(len(corners), TRIANGLE)
        rows["key"], rows["origin"] = hashes(rotated(corners)), origin
        self._buckets.add(rows, rows["key"])


def difference(rows: np.ndarray) -> tuple[int, int]:
    """Return (number of triangles that only the source has, and only the compressed primitive).

    rows: TRIANGLE[N], those of equal keys all.
    """
    numbers, count = weld_rows(rows["key"].reshape(-1, 1))
    needed_counts, optional_counts, compressed_counts = (
        np.bincount(numbers[rows["origin"] == origin], minlength=count)
        for origin in (IN_SOURCE, OPTIONAL_IN_SOURCE, IN_COMPRESSED)
    )
    missing_counts = np.maximum(needed_counts - compressed_counts, 0)
    extra_counts = np.maximum(compressed_counts - needed_counts - optional_counts, 0)
    return int(missing_counts.sum()), int(extra_counts.sum())


def rotated(triangles: np.ndarray) -> np.ndarray:
    """Return each triangle, [T, 3], rotated to a canonical order: its smallest corner first."""
    a, b, c = triangles.T
    turn = np.where((b < a) & (b <= c), 1, np.where((c < a) & (c < b), 2, 0))
    # Two equal smallest corners: (x, x, y), never (x, y, x).
    turn = np.where((a == c) & (a < b), 2, turn)
    return np.stack([np.choose((turn + k) % 3, (a, b, c)) for k in range(3)], axis=1)


def keys_of(streams: list[np.ndarray]) -> np.ndarray:
    """Return uint64[...]: hashes of vertices, of integers [..., elements] of each stream."""
    rows = np.concatenate(streams, axis=-1)
    return hashes(rows.reshape(-1, rows.shape[-1])).reshape(rows.shape[:-1])
