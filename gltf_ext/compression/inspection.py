"""inspect: what a compressed file holds and where its bits go."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from typing import Any
from urllib.parse import unquote_to_bytes

from gltf_ext import _codec
from gltf_ext.compression.extension import Compressed, malformed, require_compressed
from gltf_ext.compression.streams import OCT, semantic
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model

INDEX_BYTES_PER_TRIANGLE = 12
PARTS = ("connectivity", "references_and_headers", "positions", "normals", "texcoords", "other")
PART_OF = {"POSITION": "positions", "NORMAL": "normals", "TEXCOORD": "texcoords"}


def inspect(path: str | os.PathLike) -> dict[str, Any]:
    """Statistics of a compressed file: {"file", "file_bytes", "totals", "primitives"}.

    totals has triangles, vertices (decoded), source_vertices (after welding), meshlets, raw_bytes (source vertices at
    the accessors' component sizes plus 12 bytes per triangle), compressed_bytes (the extension's buffer views and
    JSON objects), ratio, mean_triangles_per_meshlet, bits_per_triangle (parts and their total), symbols (shares of C,
    L, E, R, S). Primitives that share a buffer view count once. primitives has the same for each, with mesh,
    primitive, name and streams; a direction has no step (None). fallback_files has the bytes of each file
    with plain buffers for other readers. Raises MeshletError, OSError.
    """
    try:
        return {
            "file": str(path),
            "file_bytes": os.path.getsize(path),
            **inspect_document(open_model(path)),
        }
    except MeshletError as error:
        error.path = error.path or str(path)
        raise


def inspect_document(document: Document) -> dict[str, Any]:
    """`inspect` for a document in memory: {"totals", "primitives"}."""
    counted: dict[int, dict[str, Any]] = {}
    primitives = []
    for compressed in require_compressed(document):
        if compressed.view in counted:
            # Another user of the same bytes adds its JSON object only.
            counted[compressed.view]["json_bytes"] += compressed.json_bytes
            primitives.append(
                {
                    **_place(compressed),
                    "shares_buffer_view_of": [
                        counted[compressed.view]["mesh"],
                        counted[compressed.view]["primitive"],
                    ],
                }
            )
        else:
            primitives.append(_describe(compressed))
            counted[compressed.view] = primitives[-1]
    for described in counted.values():
        described.update(_figures(described))
    return {
        "totals": _totals(list(counted.values())),
        "fallback_files": _fallback_files(document),
        "primitives": [_public(p) for p in primitives],
    }


def _fallback_files(document: Document) -> dict[str, int]:
    """Name and size of the files that hold plain buffers for readers without the extension."""
    used = {
        document.bufferViews[compressed.view].buffer for compressed in require_compressed(document)
    }
    return {
        os.fsdecode(unquote_to_bytes(buffer.uri)): buffer.byteLength
        for index, buffer in enumerate(document.buffers)
        if index not in used and buffer.uri and not buffer.uri.startswith("data:")
    }


def _place(compressed: Compressed) -> dict[str, Any]:
    return {"mesh": compressed.mesh, "primitive": compressed.primitive, "name": compressed.name}


def _describe(compressed: Compressed) -> dict[str, Any]:
    try:
        description = _codec.describe(compressed.blob)
    except ValueError as error:
        raise malformed(compressed.where, error) from None
    part_bits = Counter(
        {
            "connectivity": description["bits"]["connectivity"],
            "references_and_headers": description["bits"]["references"],
        }
    )
    streams, vertex_bytes = {}, 0
    for name, indices, (dtype, components) in compressed.named_streams:
        bits = sum(description["bits"]["streams"][s] for s in indices)
        part_bits[PART_OF.get(semantic(name), "other")] += bits
        vertex_bytes += dtype.itemsize * components
        streams[name] = {
            "bits_per_component": [compressed.streams[s].bits for s in indices],
            "bits_per_vertex": bits / compressed.vertex_count,
            "step": [
                None if compressed.streams[s].kind == OCT else compressed.streams[s].step
                for s in indices
            ],
        }
    return {
        **_place(compressed),
        "triangles": compressed.triangle_count,
        "vertices": compressed.vertex_count,
        "source_vertices": compressed.source_vertices,
        "meshlets": description["meshlets"],
        "components": description["components"],
        "raw_bytes": vertex_bytes * compressed.source_vertices
        + INDEX_BYTES_PER_TRIANGLE * compressed.triangle_count,
        "blob_bytes": len(compressed.blob),
        "json_bytes": compressed.json_bytes,
        "attributes": streams,
        "part_bits": part_bits,
        "symbol_counts": description["symbols"],
    }


def _figures(described: dict[str, Any]) -> dict[str, Any]:
    """What follows from the counts of a primitive, or of all together."""
    triangles = described["triangles"]
    compressed = described["blob_bytes"] + described["json_bytes"]
    bits = {
        part: described["part_bits"][part]
        + (8 * described["json_bytes"] if part == "references_and_headers" else 0)
        for part in PARTS
    }
    symbols = described["symbol_counts"]
    return {
        "compressed_bytes": compressed,
        "ratio": described["raw_bytes"] / compressed,
        "mean_triangles_per_meshlet": triangles / described["meshlets"],
        "bits_per_triangle": {
            **{part: b / triangles for part, b in bits.items()},
            "total": 8 * compressed / triangles,
        },
        "symbols": {s: n / max(sum(symbols.values()), 1) for s, n in symbols.items()},
    }


def _totals(described: list[dict[str, Any]]) -> dict[str, Any]:
    summed: dict[str, Any] = {
        name: sum(d[name] for d in described)
        for name in (
            "triangles",
            "vertices",
            "source_vertices",
            "meshlets",
            "components",
            "raw_bytes",
            "blob_bytes",
            "json_bytes",
        )
    }
    for name in ("part_bits", "symbol_counts"):
        counts: dict[str, int] = defaultdict(int)
        for d in described:
            for key, value in d[name].items():
                counts[key] += value
        summed[name] = counts
    return _public({**summed, **_figures(summed)})


def _public(described: dict[str, Any]) -> dict[str, Any]:
    return {
        name: value
        for name, value in described.items()
        if name not in ("part_bits", "symbol_counts", "blob_bytes", "json_bytes")
    }
