"""Compares a primitive with a compressed one: triangles, then values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gltf_ext.checks.attribute_errors import Errors, errors_of
from gltf_ext.checks.findings import Findings
from gltf_ext.checks.triangles import Comparison
from gltf_ext.compression.extension import is_compressed, read_compressed, source_of
from gltf_ext.compression.records import RecordFormat
from gltf_ext.compression.sources import Rows, Source, blocks
from gltf_ext.gltf.document import Document
from gltf_ext.progress import Advance


def read_original(document: Document, mesh: int, index: int) -> Source:
    """A primitive of a document, in memory, with its bounds. Raises MeshletError."""
    source, _ = source_of(document, mesh, index)
    source.read_bounds()
    return source


def compare(
    document: Document,
    source: Source,
    findings: Findings,
    folder: str,
    advance: Advance | None,
) -> None:
    """Compares a primitive of the original with the one at the same place of the document.

    Values that are quantised to equal integers decode to equal values, so that errors need the
    source only. folder: for work files.
    """
    mesh, index = source.mesh, source.primitive
    if not is_compressed(document.meshes[mesh].primitives[index]):
        findings.triangles += source.triangle_count
        if not _is_same(source, source_of(document, mesh, index)[0]):
            findings.differs(f"{source.where} is not compressed and differs")
        return
    compressed = read_compressed(document, mesh, index)
    if not source.triangle_count:
        findings.differs(f"{source.where} has no triangle in the original")
        return
    widths = {name: form[1] for name, form in source.formats.items()}
    if not findings.has_attributes(mesh, widths, compressed):
        findings.triangles += source.triangle_count
        return
    first = {name: streams.start for name, streams, _ in compressed.named_streams}
    form = RecordFormat.with_streams(source, compressed.streams, first)
    comparison = Comparison(source, form, compressed, folder)
    comparison.run(advance)
    findings.triangles += comparison.triangles
    findings.add_triangles(compressed, comparison.missing, comparison.extra, comparison.collapsed)
    errors = {name: Errors() for name in first}
    for part in _errors_of_parts(source, form) if not comparison.missing else ():
        for name, more in part.items():
            errors[name].join(more)
    for name, of_values in errors.items():
        findings.add_value_errors(mesh, compressed, name, of_values)


def _errors_of_parts(source: Source, form: RecordFormat) -> Iterator[dict[str, Errors]]:
    """The errors of all attributes of the source's used vertices, part after part."""

    def of_vertices(vertices: dict[str, np.ndarray]) -> dict[str, Errors]:
        decoded = form.decoded(form.plan.quantise(vertices), tuple(vertices))
        return {
            name: errors_of(name, values, decoded[name], form.plan.streams_of(name))
            for name, values in vertices.items()
        }

    return source.of_used_vertices(of_vertices)


def _is_same(a: Source, b: Source) -> bool:
    """Whether two sources have the same bytes."""
    if a.attributes.keys() != b.attributes.keys():
        return False
    pairs = [(rows, b.attributes[name]) for name, rows in a.attributes.items()]
    numbers = [(mine, other) for (_, mine), (_, other) in zip(a.indices, b.indices)]
    return all(_are_equal(*pair) for pair in [*pairs, *numbers])


def _are_equal(a: Rows | None, b: Rows | None) -> bool:
    if a is None or b is None:
        return a is b
    return (a.count, a.form) == (b.count, b.form) and all(
        a.rows(*part).tobytes() == b.rows(*part).tobytes() for part in blocks(a.count)
    )
