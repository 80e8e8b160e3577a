"""Reports of inspect and verify on levels of detail."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np

from gltf_ext.checks.samples import shading_differences, surface_distances
from gltf_ext.gltf.document import Document
from gltf_ext.lod.cuts import Cut, cut_at_level, error_of
from gltf_ext.lod.reading import LodPrimitive, levels_of

SAMPLES = 50_000  # of a surface, for measured errors
WITHIN = 99.9  # percent of the samples that a stated error must hold
# Of measured distances, which are float32, relative to the largest coordinate: on planes, 2^-19.5
# beyond the stated error was seen.
DISTANCE_ROUNDING = 2.0**-18
SHADING = 95  # percent: where texture coordinates jump, the nearest place may lie across a seam

Report = dict[str, Any]


def describe_levels(document: Document) -> list[Report]:
    """What inspect shows of each primitive with levels. Primitives that share data count once.

    Raises MeshletError.
    """
    return [_describe(primitive) for primitive in _distinct(document)]


def _distinct(document: Document) -> list[LodPrimitive]:
    """The primitives with levels, one of those that share data. Raises MeshletError."""
    by_view: dict[int, LodPrimitive] = {}
    for primitive in levels_of(document):
        by_view.setdefault(primitive.compressed.view, primitive)
    return list(by_view.values())


def _describe(primitive: LodPrimitive) -> Report:
    tables = primitive.tables
    triangles = primitive.cluster_triangles
    level = tables.group_level[tables.cluster_group]
    waits = _waiting(primitive)
    page = tables.groups["page"][tables.cluster_group].astype(np.int64)
    share = triangles / np.bincount(page, triangles)[page]
    page_bytes = tables.pages["byteLength"][page] * share
    return {
        **_place(primitive),
        "table_bytes": len(tables.to_bytes()),
        "page_bytes": int(tables.page_begin[-1]),
        "pages": len(tables.pages),
        "root_pages": tables.root_pages,
        "largest_page": int(tables.pages["byteLength"].max()),
        "levels": [
            {
                "triangles": _drawn_triangles(primitive, cut_at_level(tables, k)),
                "stored_triangles": int(triangles[level == k].sum()),
                "clusters": int((level == k).sum()),
                "groups": int((tables.group_level == k).sum()),
                "stuck_triangles": int(triangles[waits & (level == k)].sum()),
                "bytes": round(float(page_bytes[level == k].sum())),
                "error": error_of(tables, cut_at_level(tables, k)),
            }
            for k in range(tables.level_count)
        ],
    }


def _place(primitive: LodPrimitive) -> Report:
    return {"mesh": primitive.compressed.mesh, "primitive": primitive.compressed.primitive}


def _drawn_triangles(primitive: LodPrimitive, cut: Cut) -> int:
    return int(primitive.cluster_triangles[cut.drawn].sum())


def _waiting(primitive: LodPrimitive) -> np.ndarray:
    """bool[C]: clusters that could not be simplified where they were made: copied from level 0, or
    grouped again one level up or more."""
    tables = primitive.tables
    group, refined = tables.cluster_group, tables.cluster_refined
    copied = (refined < 0) & (tables.groups["error"][group] == 0.0)
    later = (refined >= 0) & (tables.group_level[group] > tables.group_level[refined] + 1)
    waiting: np.ndarray = copied | later
    return waiting


# --- verify ---


def measure_levels(
    document: Document, samples: int = SAMPLES, large: Container[tuple[int, int]] = ()
) -> tuple[list[Report], list[Report]]:
    """(stated errors, distances and differences in shading at surface samples, for each level but
    0; mesh and primitive of those that are `large`, which are not measured).

    Raises MeshletError.
    """
    levels, left = list[Report](), list[Report]()
    for primitive in _distinct(document):
        if (primitive.compressed.mesh, primitive.compressed.primitive) in large:
            left.append(_place(primitive))
        else:
            levels += _measure(primitive, samples)
    return levels, left


def _measure(primitive: LodPrimitive, samples: int) -> list[Report]:
    finest = primitive.compressed.decode()
    largest = float(np.abs(finest.attributes["POSITION"]).max(initial=0.0))
    result = []
    for level in range(1, primitive.tables.level_count):
        cut = cut_at_level(primitive.tables, level)
        mesh = primitive.mesh(cut)
        distances = surface_distances(finest, mesh, samples)
        stated = error_of(primitive.tables, cut)
        result.append(
            {
                **_place(primitive),
                "level": level,
                "triangles": _drawn_triangles(primitive, cut),
                "stated_error": stated,
                "measured_error": float(np.percentile(distances, WITHIN)),
                "rounding": largest * DISTANCE_ROUNDING,
                "largest_distance": float(distances.max()),
                "share_within": float((distances <= stated).mean()),
                "shading": {
                    name: dict(zip(("median", f"p{SHADING}"), np.percentile(found, [50, SHADING])))
                    for name, found in shading_differences(mesh, finest, samples).items()
                },
            }
        )
    return result
