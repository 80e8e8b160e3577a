"""Compares a primitive in memory with a compressed one: triangles, then values."""

from __future__ import annotations

import numpy as np

from gltf_ext.checks.attribute_errors import errors_of
from gltf_ext.checks.findings import Findings
from gltf_ext.checks.triangles import match, with_streams
from gltf_ext.compression.extension import (
    Compressed,
    is_compressed,
    read_compressed,
    read_triangles,
)
from gltf_ext.compression.primitives import Primitive, weld
from gltf_ext.gltf.document import Document


def read_welded(document: Document, mesh: int, index: int) -> Primitive:
    """A primitive of a document, with each vertex once. Raises MeshletError."""
    return weld(read_triangles(document, mesh, index)[0])[0]


def compare_primitive(document: Document, source: Primitive, findings: Findings) -> None:
    """Compares a primitive of the original with the one at the same place of the document."""
    findings.triangles += len(source.indices)
    if not is_compressed(document.meshes[source.mesh].primitives[source.primitive]):
        if not _same_arrays(source, read_welded(document, source.mesh, source.primitive)):
            findings.differs(f"{source.where} is not compressed and differs")
        return
    compressed = read_compressed(document, source.mesh, source.primitive)
    if not len(source.indices):
        findings.differs(f"{source.where} has no triangle in the original")
        return
    widths = {name: values.shape[1] for name, values in source.arrays}
    if findings.has_attributes(source.mesh, widths, compressed):
        _compare_values(source, compressed, findings)


def _compare_values(source: Primitive, compressed: Compressed, findings: Findings) -> None:
    """Compares the triangles, and all attributes of the vertices that match."""
    missing, extra, collapsed, matches = match(source, compressed)
    findings.add_triangles(compressed, missing, extra, collapsed)
    decoded = dict(compressed.decode().arrays)
    for name, values, streams in with_streams(source, compressed):
        errors = errors_of(name, values, decoded[name], matches, streams)
        findings.add_value_errors(source.mesh, compressed, name, errors)


def _same_arrays(a: Primitive, b: Primitive) -> bool:
    return np.array_equal(a.indices, b.indices) and all(
        n == m and np.array_equal(x, y) for (n, x), (m, y) in zip(a.arrays, b.arrays)
    )
