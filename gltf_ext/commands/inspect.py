"""inspect: the contents of a compressed file, and where its bits go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any
from urllib.parse import unquote_to_bytes

from gltf_ext import _codec
from gltf_ext.attributes.extension import Compressed, malformed_from, require_compressed
from gltf_ext.attributes.streams import OCT
from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.gltf2 import Model, name_of, size_of
from gltf_ext.errors import blaming
from gltf_ext.portable import file_name
from gltf_ext.sources.attribute_names import semantic
from gltf_ext.sources.importers import open_model

INDEX_BYTES_PER_TRIANGLE = 12
CATEGORY_OF = {"POSITION": "positions", "NORMAL": "normals", "TEXCOORD": "texcoords"}
# The categories of bits, as people read them.
CATEGORY_LABELS = {
    "connectivity": "connectivity",
    "references_and_headers": "references and headers",
    "positions": "positions",
    "normals": "normals",
    "texcoords": "texture coordinates",
    "other": "other attributes",
}
SUMMED = (
    "triangles",
    "vertices",
    "source_vertices",
    "meshlets",
    "blobs",
    "components",
    "raw_bytes",
    "blob_bytes",
    "json_bytes",
    "table_bytes",
)
# Counts that the report does not show.
INTERNAL = ("category_bits", "symbol_counts", "blob_bytes", "json_bytes", "table_bytes")

Statistics = Mapping[str, Any]  # of a view, as _codec.describe gives them


def inspect(path: Model) -> dict[str, Any]:
    """Return statistics of a compressed file.

    Args:
        path: of the file, or a pygltflib.GLTF2.

    Returns:
        file, file_bytes.
        totals: primitives that share a buffer view count once.
            triangles, vertices (decoded), source_vertices (after welding), meshlets.
            blobs: one for each primitive, or its pages.
            components: disks: connected components of the meshlets' triangles.
            raw_bytes: source vertices at the accessors' component sizes, and 12 per triangle.
            compressed_bytes: the extension's buffer views and JSON objects.
            ratio: raw_bytes / compressed_bytes.
            mean_triangles_per_meshlet.
            bits_per_triangle: of each category of bits, and "total".
            symbols: shares of C, L, E, R and S.
        fallback_files: name -> bytes of each file of plain buffers for other readers.
        primitives: the same as totals for each, with mesh, primitive, name and attributes: bits
            and step of each stream (None for a direction) and bits per vertex. Another user of a
            buffer view has only its place and "shares_buffer_view_of".
        lod: for each primitive with levels of detail: mesh, primitive, pages, root_pages,
            largest_page, page_bytes, table_bytes, and levels, finest first: triangles to draw,
            stored_triangles (in groups of that level), clusters, groups, stuck_triangles (not
            simplified), bytes, and error in units of POSITION.

    Raises:
        MeshletError: the file is malformed or not compressed.
        OSError: the file cannot be read.
    """
    from gltf_ext.lod.reports import describe_levels  # compress, which starts faster, needs none

    file_bytes = size_of(path)
    with blaming(name_of(path)):
        document = open_model(path)
        contents = inspect_document(document, {})
        contents["lod"] = describe_levels(document)
    return {"file": name_of(path), "file_bytes": file_bytes, **contents}


def inspect_document(
    document: Document, statistics_by_view: Mapping[int, Statistics]
) -> dict[str, Any]:
    """totals, fallback_files and primitives of `inspect`, for a document in memory.

    statistics_by_view: known statistics of these buffer views. Decodes all others.
    """
    descriptions: dict[int, dict[str, Any]] = {}
    primitives = []
    all_compressed = require_compressed(document)
    for compressed in all_compressed:
        first = descriptions.get(compressed.view)
        if first is None:
            with malformed_from(compressed.where):
                statistics = statistics_by_view.get(compressed.view)
                first = _describe(compressed, statistics or _codec.describe(compressed.blob))
            descriptions[compressed.view] = first
            primitives.append(first)
            continue
        # Another user of the same bytes adds its JSON object only.
        first["json_bytes"] += compressed.json_bytes
        sharing = {"shares_buffer_view_of": [first["mesh"], first["primitive"]]}
        primitives.append({**_place(compressed), **sharing})
    for described in descriptions.values():
        described.update(_figures(described))
    return {
        "totals": _totals(list(descriptions.values())),
        "fallback_files": _fallback_files(document, all_compressed),
        "primitives": [_public(p) for p in primitives],
    }


def _fallback_files(document: Document, all_compressed: list[Compressed]) -> dict[str, int]:
    """Return name -> bytes of files with plain buffers, for readers without the extension."""
    users = [document.primitive(c.mesh, c.primitive) for c in all_compressed]
    accessors = {
        index for u in users for names in gltf.attribute_sets(u) for index in names.values()
    } | {user["indices"] for user in users}
    views = [document.accessors[index].get("bufferView") for index in accessors]
    used = {
        item(document.bufferViews, view, "bufferView").get("buffer")
        for view in views
        if view is not None
    }
    uris = {index: buffer.get("uri", "") for index, buffer in enumerate(document.buffers)}
    return {
        file_name(unquote_to_bytes(uri)): document.buffers[index].get("byteLength", 0)
        for index, uri in uris.items()
        if index in used and uri and not uri.startswith("data:")
    }


def _place(compressed: Compressed) -> dict[str, Any]:
    return {"mesh": compressed.mesh, "primitive": compressed.primitive, "name": compressed.name}


def _describe(compressed: Compressed, statistics: Statistics) -> dict[str, Any]:
    """Return the counts of one primitive."""
    all_bits = statistics["bits"]
    category_bits = Counter(
        connectivity=all_bits["connectivity"], references_and_headers=all_bits["references"]
    )
    attributes, vertex_bytes = {}, 0
    for name, indices, (dtype, components) in compressed.named_streams:
        bits = sum(all_bits["streams"][s] for s in indices)
        category_bits[CATEGORY_OF.get(semantic(name), "other")] += bits
        vertex_bytes += dtype.itemsize * components
        streams = [compressed.streams[s] for s in indices]
        attributes[name] = {
            "bits_per_component": [stream.bits for stream in streams],
            "bits_per_vertex": bits / compressed.vertex_count,
            "step": [None if stream.kind == OCT else stream.step for stream in streams],
        }
    index_bytes = INDEX_BYTES_PER_TRIANGLE * compressed.triangle_count
    return {
        **_place(compressed),
        "triangles": compressed.triangle_count,
        "vertices": compressed.vertex_count,
        "source_vertices": compressed.source_vertices,
        **{name: statistics[name] for name in ("meshlets", "blobs", "components")},
        "raw_bytes": vertex_bytes * compressed.source_vertices + index_bytes,
        "blob_bytes": len(compressed.blob),
        "json_bytes": compressed.json_bytes,
        "table_bytes": compressed.table_bytes,
        "attributes": attributes,
        "category_bits": category_bits,
        "symbol_counts": statistics["symbols"],
    }


def _figures(described: dict[str, Any]) -> dict[str, Any]:
    """Ratios and shares from the counts of one primitive, or of all together."""
    triangles = described["triangles"]
    beside_blobs = described["json_bytes"] + described["table_bytes"]
    compressed = described["blob_bytes"] + beside_blobs
    bits = {name: described["category_bits"][name] for name in CATEGORY_LABELS}
    bits["references_and_headers"] += 8 * beside_blobs
    symbols = described["symbol_counts"]
    symbol_total = max(sum(symbols.values()), 1)
    return {
        "compressed_bytes": compressed,
        "ratio": described["raw_bytes"] / compressed,
        "mean_triangles_per_meshlet": triangles / described["meshlets"],
        "bits_per_triangle": {
            **{category: b / triangles for category, b in bits.items()},
            "total": 8 * compressed / triangles,
        },
        "symbols": {symbol: count / symbol_total for symbol, count in symbols.items()},
    }


def _totals(described: list[dict[str, Any]]) -> dict[str, Any]:
    summed: dict[str, Any] = {name: sum(d[name] for d in described) for name in SUMMED}
    for name in ("category_bits", "symbol_counts"):
        counts: Counter[str] = Counter()
        for d in described:
            counts.update(d[name])
        summed[name] = counts
    return _public({**summed, **_figures(summed)})


def _public(described: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in described.items() if name not in INTERNAL}
