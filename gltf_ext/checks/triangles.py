"""Compares triangles as multisets: the encoder may reorder vertices and triangles."""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.compression.extension import Compressed, malformed_from
from gltf_ext.compression.primitives import Primitive
from gltf_ext.compression.streams import quantise_like


def with_streams(
    source: Primitive, compressed: Compressed
) -> list[tuple[str, np.ndarray, list[Stream]]]:
    """(name, source values, streams) of each attribute, in the order of named_streams."""
    arrays = dict(source.arrays)
    return [
        (name, arrays[name], [compressed.streams[s] for s in indices])
        for name, indices, _ in compressed.named_streams
    ]


def match(source: Primitive, compressed: Compressed) -> tuple[int, int, int, np.ndarray]:
    """Matches vertices and triangles that are equal after quantisation.

    Returns (missing triangles, extra triangles, triangles that the grid collapses, the decoded
    vertex of each source vertex or -1).
    """
    with malformed_from(compressed.where):
        triangles, decoded = _codec.decode(compressed.blob)
    quantised = [
        columns
        for name, values, streams in with_streams(source, compressed)
        for columns in quantise_like(name, values, streams, source.attributes)
    ]
    order = [s for _, indices, _ in compressed.named_streams for s in indices]
    count = source.vertex_count
    elements = sum(columns.shape[1] for columns in quantised)
    # Source vertices, then decoded ones: equal rows get one id.
    rows = np.empty((count + compressed.vertex_count, elements), np.uint32)
    start = 0
    for values, stream in zip(quantised, order):
        end = start + values.shape[1]
        rows[:count, start:end], rows[count:, start:end] = values, decoded[stream]
        start = end
    ids, unique = _codec.weld(rows.view(np.uint8))
    decoded_vertex = np.full(unique, -1, np.int64)
    decoded_vertex[ids[count:]] = np.arange(compressed.vertex_count)
    missing, extra = multiset_difference(
        rotated(ids[source.indices]), rotated(ids[count + triangles])
    )
    collapsed = _degenerate(quantised[0], source.indices) - _degenerate(
        source.attributes["POSITION"], source.indices
    )
    return missing, extra, collapsed, decoded_vertex[ids[:count]]


def _degenerate(positions: np.ndarray, triangles: np.ndarray) -> int:
    """Number of triangles with two corners at one position."""
    a, b, c = _codec.weld(np.ascontiguousarray(positions).view(np.uint8))[0][triangles].T
    return int(np.count_nonzero((a == b) | (b == c) | (c == a)))


def rotated(triangles: np.ndarray) -> np.ndarray:
    """Each triangle rotated to a canonical order: its smallest corner first."""
    a, b, c = triangles.T
    turn = np.where((b < a) & (b <= c), 1, np.where((c < a) & (c < b), 2, 0))
    # Two equal smallest corners: (x, x, y), never (x, y, x).
    turn = np.where((a == c) & (a < b), 2, turn)
    return np.ascontiguousarray(
        np.stack([np.choose((turn + k) % 3, (a, b, c)) for k in range(3)], axis=1)
    )


def multiset_difference(first: np.ndarray, second: np.ndarray) -> tuple[int, int]:
    """(rows only in first, rows only in second), counted with multiplicity."""
    ids, unique = _codec.weld(np.concatenate([first, second]).view(np.uint8))
    surplus = np.bincount(ids[: len(first)], minlength=unique) - np.bincount(
        ids[len(first) :], minlength=unique
    )
    return int(surplus[surplus > 0].sum()), int(-surplus[surplus < 0].sum())
