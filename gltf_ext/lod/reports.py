"""What inspect reports on levels of detail."""

from __future__ import annotations

from typing import Any

import numpy as np

from gltf_ext.document.document import Document
from gltf_ext.lod.cuts import cut_at_level, error_of
from gltf_ext.lod.reading import LodPrimitive, levels_of

Report = dict[str, Any]


def describe_levels(document: Document) -> list[Report]:
    """Return the report of inspect on each primitive with levels. Raises MeshletError.

    Primitives that share data are reported once.
    """
    return [_describe(primitive) for primitive in levels_of(document)]


def _describe(primitive: LodPrimitive) -> Report:
    tables = primitive.tables
    triangles = primitive.cluster_triangles
    level = tables.group_level[tables.cluster_group]
    is_stuck = _stuck_clusters(primitive)
    page = tables.groups["page"][tables.cluster_group].astype(np.int64)
    fraction = triangles / np.bincount(page, triangles)[page]
    cluster_bytes = tables.pages["byteLength"][page] * fraction
    return {
        "mesh": primitive.compressed.mesh,
        "primitive": primitive.compressed.primitive,
        "table_bytes": len(tables.to_bytes()),
        "page_bytes": int(tables.page_begin[-1]),
        "pages": len(tables.pages),
        "root_pages": tables.root_pages,
        "largest_page": int(tables.pages["byteLength"].max()),
        "levels": [
            {
                "triangles": primitive.drawn_triangles(cut_at_level(tables, k)),
                "stored_triangles": int(triangles[level == k].sum()),
                "clusters": int((level == k).sum()),
                "groups": int((tables.group_level == k).sum()),
                "stuck_triangles": int(triangles[is_stuck & (level == k)].sum()),
                "bytes": round(float(cluster_bytes[level == k].sum())),
                "error": error_of(tables, cut_at_level(tables, k)),
            }
            for k in range(tables.level_count)
        ],
    }


def _stuck_clusters(primitive: LodPrimitive) -> np.ndarray:
    """Return bool[C]: clusters that could not be simplified in the level that formed them.

    They are copied from level 0, or grouped again one level later or more.
    """
    tables = primitive.tables
    group, finer_group = tables.cluster_group, tables.finer_group
    is_copied = (finer_group < 0) & (tables.groups["error"][group] == 0.0)
    is_late = (finer_group >= 0) & (tables.group_level[group] > tables.group_level[finer_group] + 1)
    is_stuck: np.ndarray = is_copied | is_late
    return is_stuck
