"""Compares a primitive with a compressed one: triangles, then values."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator

import numpy as np

from gltf_ext.attributes.details import areas_of, collapse_of_source, joins_vertices, sample_of
from gltf_ext.attributes.extension import Compressed, read_compressed
from gltf_ext.attributes.join import source_of
from gltf_ext.attributes.ranges import visible_error
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.attributes.streams import Grid
from gltf_ext.checks.accessors import accessor_problems
from gltf_ext.checks.attribute_errors import Errors, errors_of
from gltf_ext.checks.findings import Findings
from gltf_ext.checks.triangles import Comparison, keys_of
from gltf_ext.document.document import Document
from gltf_ext.errors import blaming
from gltf_ext.progress import Advance
from gltf_ext.sources.primitives import is_compressed
from gltf_ext.sources.repair import read_finite_bounds
from gltf_ext.sources.row_arrays import Rows
from gltf_ext.sources.source import Source, blocks


def read_original(document: Document, mesh: int, index: int) -> Source:
    """Return a primitive of a document, in memory, without its bounds. Raises MeshletError."""
    return source_of(document, mesh, index)[0]


def compare(
    documents: tuple[Document, Document],
    source: Source,
    original: str | os.PathLike[str],
    findings: Findings,
    folder: str,
    advance: Advance | None,
) -> None:
    """Compare a primitive of the original with the one at the same place of the other document.

    Values that are quantised to equal integers decode to equal values, so that errors need the
    source and the compressed accessors' types only. Where triangles are missing, only vertices that
    the compressed primitive has count; none of a source that is read in parts.
    documents: the original and the compressed one; original: path of the source, for errors;
    folder: for work files.
    """
    before, document = documents
    mesh, index = source.mesh, source.primitive
    if not is_compressed(document.primitive(mesh, index)):
        findings.triangles += source.triangle_count
        if not _is_same(source, source_of(document, mesh, index)[0]):
            findings.differs(f"{source.where} is not compressed and differs")
        return
    compressed = read_compressed(document, mesh, index)
    if not source.triangle_count:
        findings.differs(f"{source.where} has no triangle in the original")
        return
    widths = {name: record_format[1] for name, record_format in source.formats.items()}
    if not findings.has_attributes(mesh, widths, compressed):
        findings.triangles += source.triangle_count
        return
    if not source.bounds:  # a primitive that is not compressed may have any values
        with blaming(original):
            read_finite_bounds(source)
    first = {name: streams.start for name, streams, _ in compressed.named_streams}
    record_format = RecordFormat.with_streams(source, compressed.streams, first)
    comparison = Comparison(source, record_format, compressed, folder)
    comparison.run(advance)
    findings.triangles += comparison.triangles
    findings.add_triangles(compressed, comparison.missing, comparison.extra)
    findings.problems += accessor_problems(before, document, compressed, comparison.box)
    is_same = not (comparison.missing or comparison.extra)
    # The vertices of a source that is compressed itself are the file's, copies included.
    is_plain = not is_compressed(before.primitive(mesh, index))
    if is_plain and is_same and (counts := comparison.topologies()):
        whole, weld, decoded = counts
        is_of_grid = decoded not in (whole, weld) and joins_vertices(source, record_format)
        findings.add_topology(compressed, whole, decoded, is_of_grid, decoded == weld)
    findings.rounding = before.import_rounding
    _compare_values(source, record_format, compressed, comparison, findings)
    _add_collapse(source, record_format, compressed, findings)


def _add_collapse(
    source: Source, record_format: RecordFormat, compressed: Compressed, findings: Findings
) -> None:
    if source.box is not None:
        stream = record_format.plan.streams[0]
        grid = Grid((stream.offset[0], stream.offset[1], stream.offset[2]), stream.step)
        findings.add_collapse(compressed, collapse_of_source(source, grid, sample_of(source)))


def _compare_values(
    source: Source,
    record_format: RecordFormat,
    compressed: Compressed,
    comparison: Comparison,
    findings: Findings,
) -> None:
    formats = {name: types for name, _, types in compressed.named_streams}
    errors = {name: Errors() for name in formats}
    decoding = dataclasses.replace(record_format, formats=formats)
    if not comparison.missing or source.is_in_memory:
        known_keys = comparison.keys if comparison.missing else None
        for part in _errors_of_parts(source, decoding, known_keys):
            for name, part_errors in part.items():
                if not source.is_in_memory:
                    part_errors.distances.clear()
                errors[name].join(part_errors)
        if source.is_in_memory and known_keys is None:
            _measure_area(source, errors)
    for name, of_values in errors.items():
        stream = record_format.plan.streams_of(name)[0]
        look = findings.look_of(compressed.mesh, compressed.primitive)
        of_values.limit = visible_error(name, stream, look, formats[name][0])
        findings.add_value_errors(compressed.mesh, compressed, name, of_values)


def _measure_area(source: Source, errors: dict[str, Errors]) -> None:
    """Set the errors of most of the area, of a source in memory."""
    ((names, numbers),) = source.numberings
    corners = source.corners(names, numbers, 0, source.triangle_count).astype(np.intp)
    rows = source.attributes["POSITION"]
    areas = areas_of(rows.rows(0, rows.count).astype(np.float64)[corners])
    used = source.used_rows()
    for each in errors.values():
        each.measure_area(used, corners, areas)


def _errors_of_parts(
    source: Source, record_format: RecordFormat, known_keys: np.ndarray | None
) -> Iterator[dict[str, Errors]]:
    """Yield the errors of all attributes of the source's used vertices, part after part.

    Args:
        source: the original.
        record_format: with the types that the values decode to.
        known_keys: uint64: keys of the vertices that count, None for all.
    """

    def of_vertices(vertices: dict[str, np.ndarray]) -> dict[str, Errors]:
        integers = record_format.plan.quantise(vertices)
        if known_keys is not None:
            is_known = np.isin(keys_of([integers[s] for s in sorted(integers)]), known_keys)
            vertices = {name: values[is_known] for name, values in vertices.items()}
            integers = {number: values[is_known] for number, values in integers.items()}
            if not is_known.any():
                return {}
        decoded_values = record_format.dequantise(integers, tuple(vertices))
        return {
            name: errors_of(name, values, decoded_values[name], record_format.plan.streams_of(name))
            for name, values in vertices.items()
        }

    return source.of_used_vertices(of_vertices)


def _is_same(a: Source, b: Source) -> bool:
    """Return whether two sources have the same bytes."""
    if a.attributes.keys() != b.attributes.keys():
        return False
    pairs = [(rows, b.attributes[name]) for name, rows in a.attributes.items()]
    numbers = [(mine, other) for (_, mine), (_, other) in zip(a.numberings, b.numberings)]
    return all(_are_equal(*pair) for pair in [*pairs, *numbers])


def _are_equal(a: Rows | None, b: Rows | None) -> bool:
    if a is None or b is None:
        return a is b
    return (a.count, a.format) == (b.count, b.format) and all(
        a.rows(*part).tobytes() == b.rows(*part).tobytes() for part in blocks(a.count)
    )
