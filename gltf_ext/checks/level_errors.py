"""Measures how far levels of detail are from the finest one, in space and in shading."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np

from gltf_ext.attributes.ranges import shading_unit
from gltf_ext.checks.flips import FlipCounter
from gltf_ext.checks.samples import compare_surfaces, sample_surface
from gltf_ext.document.document import Document
from gltf_ext.document.looks import Look, Looks
from gltf_ext.lod.cuts import cut_at_level, error_of
from gltf_ext.lod.reading import LodPrimitive, levels_of

# Samples of a surface, for measured errors: by its triangles, within these bounds. Fewer than the
# least say little about the WITHIN percent of them.
SAMPLES_PER_TRIANGLE, LEAST_SAMPLES, MOST_SAMPLES = 8, 2_000, 50_000
WITHIN = 99.9  # percent of the samples that a stated error must hold
# Of measured distances, which are float32, relative to the largest coordinate: on planes, 2^-19.5
# beyond the stated error was seen.
DISTANCE_ROUNDING = 2.0**-18
# Of stated errors, which are float32.
STATED_ROUNDING = 1.0 + 1e-4
SHADING = 95  # percent: where texture coordinates jump, the nearest point may lie across a seam
HIGH = (99.0, 99.9)  # percent, in units of the eye

Report = dict[str, Any]


def measure_levels(
    document: Document, most_samples: int = MOST_SAMPLES, large: Container[tuple[int, int]] = ()
) -> tuple[list[Report], list[Report]]:
    """Measure distances and differences in shading between each level and the finest one.

    Raises MeshletError.

    Args:
        document: compressed.
        most_samples: largest number of sample points on each surface.
        large: (mesh, primitive) of primitives that are not measured.

    Returns:
        A report for each level but the finest; mesh and primitive of those that are not measured.
    """
    levels, unmeasured = list[Report](), list[Report]()
    looks = Looks(document)
    for primitive in levels_of(document):
        location = (primitive.compressed.mesh, primitive.compressed.primitive)
        if location in large:
            unmeasured.append(dict(zip(("mesh", "primitive"), location)))
        else:
            look = looks.of([document.primitive(*location)])
            levels += _measure(primitive, most_samples, look)
    return levels, unmeasured


def _measure(primitive: LodPrimitive, most_samples: int, look: Look) -> list[Report]:
    finest = primitive.compressed.decode()
    largest = float(np.abs(finest.attributes["POSITION"]).max(initial=0.0))
    by_size = SAMPLES_PER_TRIANGLE * len(finest.indices)
    samples = min(max(by_size, LEAST_SAMPLES), most_samples)
    points = sample_surface(finest, samples)
    flip_counter = FlipCounter(finest)
    result = []
    for level in range(1, primitive.tables.level_count):
        cut = cut_at_level(primitive.tables, level)
        mesh = primitive.mesh(cut)
        stated_error = error_of(primitive.tables, cut)
        distances, shading = compare_surfaces(mesh, finest, points, samples, stated_error)
        flips = flip_counter.count(mesh)
        result.append(
            {
                "mesh": primitive.compressed.mesh,
                "primitive": primitive.compressed.primitive,
                "level": level,
                "triangles": primitive.drawn_triangles(cut),
                "stated_error": stated_error,
                "measured_error": float(np.percentile(distances, WITHIN)),
                "rounding": largest * DISTANCE_ROUNDING,
                "largest_distance": float(distances.max()),
                "share_within": float((distances <= stated_error).mean()),
                "shading": {
                    name: _shading_report(
                        differences, *shading_unit(name, look, finest.attributes[name].dtype)
                    )
                    for name, differences in shading.items()
                },
                "flipped_corners": flips.corners,
                "flipped_area_share": flips.area_share,
            }
        )
    return result


def _shading_report(differences: np.ndarray, unit: float, label: str) -> Report:
    """Return percentiles of differences, and high ones in a unit of the eye."""
    median, high, *highest = np.percentile(differences, [50, SHADING, *HIGH]).tolist()
    seen = {f"p{percent:g}": value / unit for percent, value in zip(HIGH, highest)}
    return {"median": median, f"p{SHADING}": high, "seen": {"unit": label, **seen}}


def level_problems(levels: list[Report]) -> list[str]:
    """Return a line for each level that is off by more than it states."""
    return [
        f"mesh {level['mesh']} primitive {level['primitive']}: level {level['level']} is off by "
        f"{level['measured_error']:g}, more than the stated {level['stated_error']:g}"
        for level in levels
        if level["measured_error"] > level["stated_error"] * STATED_ROUNDING + level["rounding"]
    ]
