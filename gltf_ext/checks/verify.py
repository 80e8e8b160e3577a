"""verify: compares a compressed file with its original: triangles, topology and values.

Both sides are quantised to the compressed file's own grids, then compared as multisets of vertices
and triangles: the encoder may reorder both.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from gltf_ext.attributes.extension import has_compressed
from gltf_ext.checks.accessors import moved_nodes
from gltf_ext.checks.findings import Findings, report_of
from gltf_ext.checks.level_errors import level_problems, measure_levels
from gltf_ext.checks.primitives import compare, read_original
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, name_of
from gltf_ext.document.looks import Looks
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.options import Options
from gltf_ext.progress import progress_bar
from gltf_ext.sources.features import number_features
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.large import open_source
from gltf_ext.sources.primitives import triangle_primitives


def verify(
    original: Model,
    compressed: Model,
    *,
    max_memory: str | int | None = None,
    work_dir: str | None = None,
    obj_groups: bool = False,
    progress: bool = False,
) -> dict[str, Any]:
    """Compare a compressed file with the model it was made from: paths, or pygltflib.GLTF2s.

    Args:
        original: path of the model.
        compressed: path of the compressed file.
        max_memory: read models larger than memory in parts; the process stays below about so many
            bytes (K, M and G are powers of 1024). Levels of detail of primitives that are read in
            parts are not measured.
        work_dir: folder for work files; by default that of the system for temporary files.
        obj_groups: for an .obj that was compressed with it.
        progress: draw a progress bar on a terminal.

    Returns:
        ok: triangles_equal and errors_within_bits hold, and there are no other problems or losses.
        triangles_equal: both have the same multiset of triangles, up to rotation, with all
            attributes quantised.
        errors_within_bits: position components are off by at most half a step, the others by at
            most the error that their bits allow.
        topology: "original" and "compressed" -> vertices, boundary_edges (of one triangle only) and
            islands (parts that no vertex connects), summed over the primitives that were compared;
            None if none was. Not compared: those read in parts, those whose original is
            compressed, those with other triangles.
        max_error, rms_error: attribute -> distance in model or attribute units; of directions the
            distance of unit vectors; of positions in an .obj or .ply to the doubles of the file.
            None when no vertex could be compared.
        max_error_percent, rms_error_percent: the same in percent of the diagonal of the
            attribute's bounding box over the mesh.
        max_error_degrees: attribute -> largest angle, for directions.
        error_over_bound: attribute -> largest error as a fraction of the allowed one.
        triangles, missing_triangles, extra_triangles, differing_primitives: counts.
        collapsed_triangles, collapsed_area_percent: those without area on the grid; estimated of
            primitives that are read in parts.
        is_torn: whether the topology differs although the grid makes no vertices equal.
        area_error: attribute -> the error that 99.9 % of the area stays within, in the units of
            max_error, in the worst primitive; None where triangles are missing or read in parts.
        area_error_percent: the same in percent, as max_error_percent.
        seen_error: attribute -> "unit" ("texels" of the largest texture, at least 1024 in a tile;
            "8-bit steps" of colours and weights), "max" and "area" in it; of values that are
            rounded.
        levels: for each level of detail but the finest: mesh, primitive, level, triangles,
            stated_error, measured_error (99.9 % of surface samples are closer to the finest level,
            both ways), rounding (of that distance), largest_distance, share_within (the stated
            error), shading, flipped_corners (whose normal points against the triangle, at positions
            where the finest level has none), flipped_area_share (of triangles with one). Lengths in
            units of POSITION. shading: for normals (degrees), texture coordinates (units of uv) and
            colours the median and the 95th percentile (p95) of the difference to the nearest point
            of the finest level that faces the same way, at samples of the level, spread by area;
            "seen" has "unit" (degrees, texels, 8-bit steps), "p99" and "p99.9" in it. Stated errors
            do not cover it.
        not_measured: mesh and primitive of those whose levels are not measured.
        problems: one line each; losses: the same for what bits lose so that it shows: a value that
            is off by over a texel or an 8-bit step since others are far away. warnings: the
            collapsed area of primitives, from 0.1 % on.

    Raises:
        MeshletError: a file is malformed, or the second one is not compressed.
        OSError: a file cannot be read.
    """
    folder = work_dir or tempfile.gettempdir()
    options = Options.of(
        {
            "max_memory": max_memory,
            "work_dir": folder,
            "obj_groups": obj_groups,
            "progress": progress,
        }
    )
    return compare_files(original, compressed, options)


def compare_files(
    original: Model, compressed: Model, options: Options, document: Document | None = None
) -> dict[str, Any]:
    """Return the report of verify.

    options: max_memory, work_dir, obj_groups and progress. document: of the compressed file, if it
    has been read already; it stays as it is.
    """
    original_name, compressed_name = name_of(original), name_of(compressed)
    with blaming(original_name):
        original_document, large = open_source(original, options)
        number_features(original_document, large)  # as `compress` does
    with blaming(compressed_name):
        compressed_document = document or open_model(compressed)
    if not has_compressed(compressed_document):
        raise _misplaced(original_document, compressed_name)
    looks = Looks(original_document)
    findings = Findings(lambda mesh, index: looks.of([original_document.primitive(mesh, index)]))
    documents = original_document, compressed_document
    with progress_bar(Path(compressed_name).name, options.progress) as advance:
        for mesh, index in _primitives_of_both(original_document, compressed_document, findings):
            with blaming(original_name):
                source = large.get((mesh, index)) or read_original(original_document, mesh, index)
            with blaming(compressed_name):
                compare(documents, source, original_name, findings, str(options.work_dir), advance)
    findings.problems += moved_nodes(*documents)
    with blaming(compressed_name):
        levels, not_measured = measure_levels(compressed_document, large=set(large))
    findings.problems += level_problems(levels)
    return {**report_of(findings), "levels": levels, "not_measured": not_measured}


def _misplaced(original: Document, path: str) -> MeshletError:
    """Return the error for a second file that is not compressed."""
    swapped = ""
    if has_compressed(original):
        swapped = ", but the first file is: the arguments are swapped"
    return MeshletError(
        f"is not compressed{swapped}", "run gltf-meshlet verify ORIGINAL COMPRESSED", path
    )


def _primitives_of_both(
    original: Document, compressed: Document, findings: Findings
) -> list[tuple[int, int]]:
    """Return (mesh, primitive) of all triangle primitives; none, and a finding, if files differ."""
    numbers = [row[:2] for row in triangle_primitives(original)]
    compressed_numbers = [row[:2] for row in triangle_primitives(compressed)]
    if numbers == compressed_numbers:
        return numbers
    findings.differs(_differing_primitives(numbers, compressed_numbers))
    return []


def _differing_primitives(
    numbers: list[tuple[int, int]], compressed_numbers: list[tuple[int, int]]
) -> str:
    differing = sorted(set(numbers) ^ set(compressed_numbers))
    mesh, index = differing[0]
    return (
        f"{len(numbers)} triangle primitives in the original, {len(compressed_numbers)} in the "
        "compressed file; "
        f"{len(differing)} are only in one, first mesh {mesh} primitive {index}"
    )
