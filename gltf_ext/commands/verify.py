"""verify: compares a compressed file with its original, triangle by triangle and value by value.

Both sides are quantised to the compressed file's own grids, then compared as multisets of vertices
and triangles: the encoder may reorder both.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext._codec import Stream
from gltf_ext.compression.extension import (
    Compressed,
    has_compressed,
    is_compressed,
    read_compressed,
    source_of,
)
from gltf_ext.compression.options import Options
from gltf_ext.compression.primitives import triangle_primitives
from gltf_ext.compression.records import RecordFormat
from gltf_ext.compression.sources import Rows, Source, blocks
from gltf_ext.compression.streams import (
    GRID,
    OCT,
    SIGN,
    WEIGHT_SUM_TOLERANCE,
    octahedral_bound,
    semantic,
)
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model
from gltf_ext.lod.reports import measure_levels
from gltf_ext.out_of_core.comparing import Comparison
from gltf_ext.out_of_core.opening import Larges, open_large
from gltf_ext.progress import Advance, progress_bar

# Rounding of positions to float32, and of half a step in float64, relative to the value.
FLOAT_ROUNDING = 2.0**-23
STEP_ROUNDING = 1.0 + 1e-6
# Of stated errors, which are float32.
STATED_ROUNDING = 1.0 + 1e-4


@dataclass
class Errors:
    """Errors of one attribute of one primitive.

    Attributes:
        max, squares, count: largest distance, sum of squared distances, number of vertices.
        over_bound: largest error as a share of the allowed one.
        degrees: largest angle; None unless it is a direction.
        box: float64[2, components]: the original's smallest and largest values; None if the
            attribute was not compared, because the primitives differ.
        compared: whether there was a vertex to compare.
    """

    max: float = 0.0
    squares: float = 0.0
    count: int = 0
    over_bound: float = 0.0
    degrees: float | None = None
    box: np.ndarray | None = None
    compared: bool = False

    def join(self, other: Errors) -> None:
        """Adds the errors of other vertices."""
        self.max, self.over_bound = max(self.max, other.max), max(self.over_bound, other.over_bound)
        self.squares, self.count = self.squares + other.squares, self.count + other.count
        if other.degrees is not None:
            self.degrees = max(self.degrees or 0.0, other.degrees)
        boxes = [box for box in (self.box, other.box) if box is not None]
        self.box = np.stack([np.min(boxes, axis=(0, 1)), np.max(boxes, axis=(0, 1))])
        self.compared |= other.compared

    def add(self, distances: np.ndarray, over_bound: float) -> None:
        if len(distances):
            self.max = max(self.max, float(distances.max()))
        self.squares += float(np.square(distances).sum())
        self.count += len(distances)
        self.over_bound = max(self.over_bound, over_bound)


@dataclass
class Findings:
    """The comparison so far.

    errors: attribute -> mesh -> errors of its primitives; problems: one line each; the rest are
    counts.
    """

    triangles: int = 0
    missing_triangles: int = 0
    extra_triangles: int = 0
    collapsed_triangles: int = 0
    differing_primitives: int = 0
    errors: dict[str, dict[int, list[Errors]]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    def add_errors(self, mesh: int, name: str, errors: Errors) -> None:
        self.errors.setdefault(name, {}).setdefault(mesh, []).append(errors)

    def add_value_errors(
        self, mesh: int, compressed: Compressed, name: str, errors: Errors
    ) -> None:
        """Adds the errors of an attribute of a primitive."""
        self.add_errors(mesh, name, errors)
        if errors.over_bound > 1.0:
            self.problems.append(
                f"{compressed.where}: {name} is off by {errors.max:g}, more than its bits allow"
            )

    def add_triangles(
        self, compressed: Compressed, missing: int, extra: int, collapsed: int
    ) -> None:
        """Adds the counts of a primitive."""
        self.collapsed_triangles += collapsed
        self.missing_triangles += missing
        self.extra_triangles += extra
        if missing or extra:
            self.problems.append(
                f"{compressed.where}: {missing} triangles are missing, {extra} are extra"
            )

    def differs(self, problem: str) -> None:
        """Notes a primitive that cannot be compared."""
        self.differing_primitives += 1
        self.problems.append(problem)


def verify(
    original: str | os.PathLike[str],
    compressed: str | os.PathLike[str],
    *,
    max_memory: str | int | None = None,
    work_dir: str | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Compare a compressed file with the model it was made from.

    max_memory: read models larger than memory in parts; the process stays below about so many
        bytes (K, M and G are powers of 1024). Levels of detail of primitives that are read in parts
        are not measured.
    work_dir: folder for work files; by default that of the system for temporary files.
    progress: draw a progress bar on a terminal.

    Returns:
        ok: triangles_equal and errors_within_bits hold, and there is no other problem.
        triangles_equal: both have the same multiset of triangles, up to rotation, with all
            attributes quantised.
        errors_within_bits: position components are off by at most half a step, the others by at
            most the error that their bits allow.
        max_error, rms_error: attribute -> distance in model or attribute units; of directions the
            distance of unit vectors. None when no vertex could be compared.
        max_error_percent, rms_error_percent: the same in percent of the diagonal of the
            attribute's bounding box over the mesh.
        max_error_degrees: attribute -> largest angle, for directions.
        error_over_bound: attribute -> largest error as a share of the allowed one.
        triangles, missing_triangles, extra_triangles, differing_primitives: counts.
        collapsed_triangles: count of those with two corners on one point of the grid.
        levels: for each level of detail but the finest: mesh, primitive, level, triangles,
            stated_error, measured_error (99.9 % of surface samples are closer to the finest level,
            both ways), rounding (of that distance), largest_distance, share_within (the stated
            error), shading. Lengths in units of POSITION. shading: for normals (degrees) and
            texture coordinates (units of uv) the median and the 95th percentile (p95) of the
            difference to the nearest point of the finest level, at samples of the level. Stated
            errors do not cover it.
        not_measured: mesh and primitive of those whose levels are not measured.
        problems: one line each.

    Raises MeshletError when a file is malformed or the second not compressed, OSError when one
    cannot be read.
    """
    folder = work_dir or tempfile.gettempdir()
    settings = Options.of({"max_memory": max_memory, "work_dir": folder, "progress": progress})
    large: Larges = {}
    if settings.memory:
        with blaming(original):
            before, large = open_large(Path(original), settings)
    else:
        before = _opened(original)
    after = _opened(compressed)
    if not has_compressed(after):
        raise _misplaced(before, str(compressed))
    places = [place[:2] for place in triangle_primitives(before)]
    other_places = [place[:2] for place in triangle_primitives(after)]
    findings = Findings()
    if places != other_places:
        findings.differs(_differing_places(places, other_places))
        places = []
    with progress_bar(Path(compressed).name, progress) as advance:
        for mesh, index in places:
            with blaming(original):
                source = large.get((mesh, index)) or _source(before, mesh, index)
            with blaming(compressed):
                _compare(after, source, findings, folder, advance)
    with blaming(compressed):
        levels, not_measured = measure_levels(after, large=set(large))
    findings.problems += [
        f"mesh {level['mesh']} primitive {level['primitive']}: level {level['level']} is off by "
        f"{level['measured_error']:g}, more than the stated {level['stated_error']:g}"
        for level in levels
        if level["measured_error"] > level["stated_error"] * STATED_ROUNDING + level["rounding"]
    ]
    return {**_report(findings), "levels": levels, "not_measured": not_measured}


def _opened(path: str | os.PathLike[str]) -> Document:
    with blaming(path):
        return open_model(path)


def _misplaced(original: Document, path: str) -> MeshletError:
    """The error for a second file that is not compressed."""
    swapped = ""
    if has_compressed(original):
        swapped = ", but the first file is: the arguments are swapped"
    return MeshletError(
        f"is not compressed{swapped}", "run gltf-meshlet verify ORIGINAL COMPRESSED", path
    )


def _differing_places(places: list[tuple[int, int]], others: list[tuple[int, int]]) -> str:
    differing = sorted(set(places) ^ set(others))
    mesh, index = differing[0]
    return (
        f"{len(places)} triangle primitives in the original, {len(others)} in the compressed file; "
        f"{len(differing)} are only in one, first mesh {mesh} primitive {index}"
    )


def _source(document: Document, mesh: int, index: int) -> Source:
    source, _ = source_of(document, mesh, index)
    source.read_bounds()
    return source


def _compare(
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
    if not _has_attributes(mesh, widths, compressed, findings):
        findings.triangles += source.triangle_count
        return
    first = {name: streams.start for name, streams, _ in compressed.named_streams}
    form = RecordFormat.with_streams(source, compressed.streams, first)
    comparison = Comparison(source, form, compressed, folder)
    comparison.run(advance)
    findings.triangles += comparison.triangles
    findings.add_triangles(compressed, comparison.missing, comparison.extra, comparison.collapsed)
    errors = {name: Errors() for name in widths}
    parts = source.of_used_vertices(partial(_errors_of, form)) if not comparison.missing else ()
    for part in parts:
        for name, more in part.items():
            errors[name].join(more)
    for name in first:
        findings.add_value_errors(mesh, compressed, name, errors[name])


def _errors_of(form: RecordFormat, vertices: dict[str, np.ndarray]) -> dict[str, Errors]:
    """The errors of some vertices, name -> [n, components]."""
    decoded = form.decoded(form.plan.quantise(vertices), tuple(vertices))
    return {
        name: _errors(name, values, decoded[name], form.plan.streams_of(name))
        for name, values in vertices.items()
    }


def _has_attributes(
    mesh: int, widths: dict[str, int], compressed: Compressed, findings: Findings
) -> bool:
    """Whether a compressed primitive has attributes of these numbers of components."""
    differences = _attribute_differences(widths, compressed)
    if differences:
        for name in widths:
            findings.add_errors(mesh, name, Errors())
        findings.differs(f"{compressed.where}: attributes differ: {differences}; not compared")
    return not differences


def _attribute_differences(before: dict[str, int], compressed: Compressed) -> str:
    """The attributes that one side lacks or has with other components; empty for none."""
    after = {name: form[1] for name, _, form in compressed.named_streams}
    changed = [name for name in before if after.get(name, before[name]) != before[name]]
    kinds = (
        ("only in the original", sorted(set(before) - set(after))),
        ("only in the compressed file", sorted(set(after) - set(before))),
        ("with other components", sorted(changed)),
    )
    return ", ".join(f"{' '.join(names)} {kind}" for kind, names in kinds if names)


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


# --- errors ---


def _errors(name: str, values: np.ndarray, decoded: np.ndarray, streams: list[Stream]) -> Errors:
    """Errors of an attribute of vertices, [n, components]."""
    source, result = values.astype(np.float64), decoded.astype(np.float64)
    errors = Errors(box=np.array([values.min(axis=0), values.max(axis=0)], np.float64))
    errors.compared = True
    start = 0
    for stream in streams:
        columns = slice(start, start + stream.width)
        start += stream.width
        if stream.kind == OCT:
            _add_directions(errors, source[:, columns], result[:, columns], stream)
        elif stream.kind == SIGN:
            is_equal = (source[:, columns] >= 0.0) == (result[:, columns] > 0.0)
            errors.add(np.empty(0), 0.0 if is_equal.all() else math.inf)
        elif stream.kind == GRID:
            _add_grid(errors, source[:, columns], result[:, columns], stream, name)
        else:
            with np.errstate(invalid="ignore"):  # of two infinite values
                distances = np.nan_to_num(
                    np.abs(source[:, columns] - result[:, columns]).max(axis=1)
                )
            errors.add(distances, math.inf if distances.any() else 0.0)
    return errors


def _add_grid(
    errors: Errors, source: np.ndarray, result: np.ndarray, stream: Stream, name: str
) -> None:
    difference = np.abs(source - result)
    magnitude = np.maximum(np.abs(source).max(axis=0), np.abs(stream.offset))
    if semantic(name) == "WEIGHTS":
        # Rounded up or down so that the sum stays, after the sum is scaled to one.
        allowed = stream.step + WEIGHT_SUM_TOLERANCE
    else:
        allowed = 0.5 * stream.step * STEP_ROUNDING
    over_bound = (difference / (allowed + FLOAT_ROUNDING * magnitude)).max()
    errors.add(np.sqrt((difference * difference).sum(axis=1)), float(over_bound))


def _add_directions(errors: Errors, source: np.ndarray, result: np.ndarray, stream: Stream) -> None:
    """Distances of unit vectors. Ignores source vectors of length zero: they have no direction."""
    length = np.linalg.norm(source, axis=1)
    usable = length > 0.0
    if usable.any():
        distances = np.linalg.norm(source[usable] / length[usable, None] - result[usable], axis=1)
        angle = 2.0 * math.asin(min(float(distances.max()) / 2.0, 1.0))
        errors.degrees = math.degrees(angle)
        errors.add(distances, angle / (octahedral_bound(stream.bits) + FLOAT_ROUNDING))


# --- report ---

OfMeshes = list[tuple[float, list[Errors]]]  # factor from an error to percent, errors; of each mesh


def _report(findings: Findings) -> dict[str, Any]:
    by_name = {
        name: [(_percent(errors), errors) for errors in meshes.values()]
        for name, meshes in findings.errors.items()
    }
    flat = {name: [e for _, errors in meshes for e in errors] for name, meshes in by_name.items()}

    def each(figure: Callable[[OfMeshes], float]) -> dict[str, float | None]:
        return {
            name: figure(meshes) if any(e.compared for e in flat[name]) else None
            for name, meshes in by_name.items()
        }

    directions = {
        name: max(e.degrees or 0.0 for e in errors)
        for name, errors in flat.items()
        if any(e.degrees is not None for e in errors)
    }
    return {
        "ok": not findings.problems,
        "triangles_equal": not (
            findings.missing_triangles or findings.extra_triangles or findings.differing_primitives
        ),
        "errors_within_bits": all(e.over_bound <= 1.0 for errors in flat.values() for e in errors),
        "triangles": findings.triangles,
        "missing_triangles": findings.missing_triangles,
        "extra_triangles": findings.extra_triangles,
        "collapsed_triangles": findings.collapsed_triangles,
        "differing_primitives": findings.differing_primitives,
        "max_error": each(lambda meshes: max(e.max for _, errors in meshes for e in errors)),
        "rms_error": each(lambda meshes: _rms([(1.0, errors) for _, errors in meshes])),
        "max_error_percent": each(lambda meshes: max(e.max * p for p, es in meshes for e in es)),
        "rms_error_percent": each(_rms),
        "max_error_degrees": directions,
        "error_over_bound": each(lambda meshes: max(e.over_bound for _, es in meshes for e in es)),
        "problems": findings.problems,
    }


def _percent(errors: list[Errors]) -> float:
    """Factor from an error to percent of the diagonal of a mesh's box."""
    boxes = [e.box for e in errors if e.box is not None]
    if not boxes:
        return 0.0
    with np.errstate(invalid="ignore"):  # lossless custom attributes may be infinite
        box = np.max([b[1] for b in boxes], axis=0) - np.min([b[0] for b in boxes], axis=0)
    diagonal = float(np.linalg.norm(box))
    return 100.0 / diagonal if diagonal > 0.0 else 0.0


def _rms(meshes: OfMeshes) -> float:
    """Root mean square over all vertices, the errors of each mesh times its factor."""
    squares = sum(sum(e.squares for e in errors) * scale**2 for scale, errors in meshes)
    return math.sqrt(squares / max(sum(e.count for _, errors in meshes for e in errors), 1))
