"""Compares a primitive that does not fit memory with a compressed one: triangles, then values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gltf_ext import _codec
from gltf_ext.checks.attribute_errors import Errors, errors_of
from gltf_ext.checks.findings import Findings
from gltf_ext.compression.extension import (
    Compressed,
    is_compressed,
    malformed_from,
    parts_of,
    read_compressed,
)
from gltf_ext.compression.streams import Plan
from gltf_ext.gltf.document import Document
from gltf_ext.out_of_core.encoding import gathered
from gltf_ext.out_of_core.records import HASH, RecordFormat
from gltf_ext.out_of_core.sources import LargePrimitive
from gltf_ext.progress import Advance
from gltf_ext.work_files import Buckets, WorkFile, hashes

TRIANGLE = np.dtype([("key", "<u8"), ("is_source", "?")])
READ = 0.5  # of the progress


def compare_large(
    document: Document,
    source: LargePrimitive,
    findings: Findings,
    folder: str,
    advance: Advance | None,
) -> None:
    """Compares a primitive that is read in parts with the one at the same place of the document.

    Values that are quantised to equal integers decode to equal values, so that errors need the
    source only.
    """
    findings.triangles += source.triangle_count
    if not is_compressed(document.meshes[source.mesh].primitives[source.primitive]):
        findings.differs(f"{source.where} is not compressed, and not compared")
        return
    compressed = read_compressed(document, source.mesh, source.primitive)
    widths = {name: rows.form[1] for name, rows in source.attributes.items()}
    if not findings.has_attributes(source.mesh, widths, compressed):
        return
    comparison = Comparison(source, compressed, folder)
    comparison.run(advance)
    findings.add_triangles(compressed, comparison.missing, comparison.extra, comparison.collapsed)
    errors = {name: Errors() for name in widths}
    for part in _errors_of_parts(source, compressed) if not comparison.missing else ():
        for name, more in part.items():
            errors[name].join(more)
    for name, of_values in errors.items():
        findings.add_value_errors(source.mesh, compressed, name, of_values)


def _errors_of_parts(source: LargePrimitive, compressed: Compressed) -> Iterator[dict[str, Errors]]:
    """The errors of all attributes of the source's used vertices, part after part."""
    form = format_of(source, compressed)

    def of_vertices(vertices: dict[str, np.ndarray]) -> dict[str, Errors]:
        decoded = form.decoded(form.quantised(vertices), tuple(vertices))
        return {
            name: errors_of(
                name, values, decoded[name], np.arange(len(values)), form.streams_of(name)
            )
            for name, values in vertices.items()
        }

    return source.of_used_vertices(of_vertices)


def format_of(source: LargePrimitive, compressed: Compressed) -> RecordFormat:
    """The source's vertices on the grids of a compressed primitive with the same attributes."""
    first = {name: stream for name, (stream, _) in compressed.attributes.items()}
    return RecordFormat.with_plan(source, Plan(compressed.streams, [], first))


class Comparison:
    """Triangles by 64-bit hashes of the integers of all streams at their corners.

    Attributes:
        missing, extra: number of triangles that only the source has, and only the compressed one.
        collapsed: of the source's triangles, with two corners on one point of the grid.
    """

    def __init__(self, source: LargePrimitive, compressed: Compressed, folder: str) -> None:
        """folder: for work files."""
        count = source.triangle_count + compressed.triangle_count
        self._source, self._form = source, format_of(source, compressed)
        self._compressed, self._folder = compressed, folder
        self._triangles = Buckets(TRIANGLE, TRIANGLE.itemsize * count, folder)
        self.missing = self.extra = self.collapsed = 0

    def run(self, advance: Advance | None) -> None:
        """Sets the counts. Raises MeshletError, OSError."""
        progress = advance or (lambda share: None)
        fewest, most = self._add_source(lambda share: progress(READ * share))
        repeated = self._add_compressed(lambda share: progress(READ + (1 - READ) * share))
        # Writers may drop a triangle with two equal corners if these were equal in the source too.
        self.missing, self.extra = max(fewest - repeated, 0), max(repeated - most, 0)
        for part in self._triangles.parts():
            keys, numbers = np.unique(part["key"], return_inverse=True)
            surplus = np.bincount(numbers, np.where(part["is_source"], 1, -1), len(keys))
            self.missing += int(surplus[surplus > 0].sum())
            self.extra -= int(surplus[surplus < 0].sum())

    def _add_source(self, progress: Advance) -> tuple[int, int]:
        """Returns the least and the largest number of triangles with two equal corners that the
        compressed primitive may have."""
        form, soup = self._form, WorkFile(self._folder)
        fewest = most = 0
        for first, last, corners, share in gathered(self._source, form, soup):
            progress(share * last / self._source.triangle_count)
            if share < 1.0:
                soup.write(corners, 3 * first * form.fine.itemsize)
                continue
            streams = [corners[str(s)] for s in range(len(form.plan.streams))]
            is_same = _repeats(corners[HASH])
            self.collapsed += int(np.count_nonzero(_repeats(_keys(streams[:1])) & ~is_same))
            keys = _keys(streams)
            is_repeated = self._add(keys, True)
            most += int(np.count_nonzero(is_repeated))
            fewest += int(np.count_nonzero(is_repeated & ~is_same))
        soup.close()
        return fewest, most

    def _add_compressed(self, progress: Advance) -> int:
        """Returns the number of triangles with two equal corners."""
        repeated = done = 0
        for part in parts_of(self._compressed.blob):
            with malformed_from(self._compressed.where):
                triangles, values = _codec.decode(part)
            repeated += int(np.count_nonzero(self._add(_keys(values)[triangles], False)))
            done += len(part)
            progress(done / len(self._compressed.blob))
        return repeated

    def _add(self, corners: np.ndarray, is_source: bool) -> np.ndarray:
        """corners: uint64[T, 3]. Returns bool[T]: triangles with equal corners, left out."""
        is_repeated = _repeats(corners)
        kept = corners[~is_repeated]
        turn = np.argmin(kept, axis=1)  # the smallest corner goes first
        columns = [kept[np.arange(len(kept)), (turn + k) % 3] for k in range(3)]
        rows = np.empty(len(kept), TRIANGLE)
        rows["key"], rows["is_source"] = hashes(np.stack(columns, axis=1)), is_source
        self._triangles.add(rows, rows["key"] >> np.uint64(32))
        return is_repeated


def _keys(streams: list[np.ndarray]) -> np.ndarray:
    """uint64[...]: hashes of vertices, of integers [..., elements] of each stream."""
    rows = np.concatenate(streams, axis=-1)
    return hashes(rows.reshape(-1, rows.shape[-1])).reshape(rows.shape[:-1])


def _repeats(corners: np.ndarray) -> np.ndarray:
    """bool[T]: whether two of the three values of a triangle are equal."""
    a, b, c = corners.T
    result: np.ndarray = (a == b) | (b == c) | (c == a)
    return result
