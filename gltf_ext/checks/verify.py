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
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.checks.large import Comparison, format_of
from gltf_ext.checks.reports import measure_levels
from gltf_ext.compression.extension import (
    Compressed,
    has_compressed,
    is_compressed,
    malformed_from,
    read_compressed,
    read_triangles,
)
from gltf_ext.compression.options import Options
from gltf_ext.compression.primitives import Primitive, triangle_primitives, weld
from gltf_ext.compression.streams import (
    GRID,
    OCT,
    SIGN,
    WEIGHT_SUM_TOLERANCE,
    octahedral_bound,
    quantise_like,
    semantic,
)
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model
from gltf_ext.out_of_core.opening import Larges, open_large
from gltf_ext.out_of_core.sources import LargePrimitive
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
    for mesh, index in places:
        if (mesh, index) in large:
            with progress_bar(Path(compressed).name, progress) as advance:
                _compare_large(after, large[mesh, index], findings, folder, advance)
            continue
        with blaming(original):
            source = _welded(before, mesh, index)
        with blaming(compressed):
            _compare_primitive(after, source, findings)
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


def _welded(document: Document, mesh: int, index: int) -> Primitive:
    return weld(read_triangles(document, mesh, index)[0])[0]


def _compare_primitive(document: Document, source: Primitive, findings: Findings) -> None:
    """Compares a primitive of the original with the one at the same place of the document."""
    findings.triangles += len(source.indices)
    if not is_compressed(document.meshes[source.mesh].primitives[source.primitive]):
        if not _same_arrays(source, _welded(document, source.mesh, source.primitive)):
            findings.differs(f"{source.where} is not compressed and differs")
        return
    compressed = read_compressed(document, source.mesh, source.primitive)
    if not len(source.indices):
        findings.differs(f"{source.where} has no triangle in the original")
        return
    widths = {name: values.shape[1] for name, values in source.arrays}
    if _has_attributes(source.mesh, widths, compressed, findings):
        _compare_values(source, compressed, findings)


def _compare_large(
    document: Document,
    source: LargePrimitive,
    findings: Findings,
    folder: str,
    advance: Advance | None,
) -> None:
    """The same for a primitive that is read in parts. Values that are quantised to equal integers
    decode to equal values, so that errors need the source only."""
    findings.triangles += source.triangle_count
    if not is_compressed(document.meshes[source.mesh].primitives[source.primitive]):
        findings.differs(f"{source.where} is not compressed, and not compared")
        return
    compressed = read_compressed(document, source.mesh, source.primitive)
    widths = {name: rows.form[1] for name, rows in source.attributes.items()}
    if not _has_attributes(source.mesh, widths, compressed, findings):
        return
    comparison = Comparison(source, compressed, folder)
    comparison.run(advance)
    findings.add_triangles(compressed, comparison.missing, comparison.extra, comparison.collapsed)
    form = format_of(source, compressed)

    def errors_of(vertices: dict[str, np.ndarray]) -> dict[str, Errors]:
        decoded = form.decoded(form.quantised(vertices), tuple(vertices))
        return {
            name: _errors(
                name, values, decoded[name], np.arange(len(values)), form.streams_of(name)
            )
            for name, values in vertices.items()
        }

    errors = {name: Errors() for name in widths}
    for found in source.of_used_vertices(errors_of) if not comparison.missing else ():
        for name, more in found.items():
            errors[name].join(more)
    for name, found in errors.items():
        findings.add_value_errors(source.mesh, compressed, name, found)


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


def _compare_values(source: Primitive, compressed: Compressed, findings: Findings) -> None:
    """Compares the triangles, and all attributes of the vertices that match."""
    missing, extra, collapsed, matches = _match(source, compressed)
    findings.add_triangles(compressed, missing, extra, collapsed)
    decoded = dict(compressed.decode().arrays)
    for name, values, streams in _with_streams(source, compressed):
        errors = _errors(name, values, decoded[name], matches, streams)
        findings.add_value_errors(source.mesh, compressed, name, errors)


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


def _same_arrays(a: Primitive, b: Primitive) -> bool:
    return np.array_equal(a.indices, b.indices) and all(
        n == m and np.array_equal(x, y) for (n, x), (m, y) in zip(a.arrays, b.arrays)
    )


def _with_streams(
    source: Primitive, compressed: Compressed
) -> list[tuple[str, np.ndarray, list[Stream]]]:
    """(name, source values, streams) of each attribute, in the order of named_streams."""
    arrays = dict(source.arrays)
    return [
        (name, arrays[name], [compressed.streams[s] for s in indices])
        for name, indices, _ in compressed.named_streams
    ]


# --- triangles ---


def _match(source: Primitive, compressed: Compressed) -> tuple[int, int, int, np.ndarray]:
    """Matches vertices and triangles that are equal after quantisation.

    Returns (missing triangles, extra triangles, triangles that the grid collapses, the decoded
    vertex of each source vertex or -1).
    """
    with malformed_from(compressed.where):
        triangles, decoded = _codec.decode(compressed.blob)
    quantised = [
        columns
        for name, values, streams in _with_streams(source, compressed)
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
    missing, extra = _multiset_difference(
        _rotated(ids[source.indices]), _rotated(ids[count + triangles])
    )
    collapsed = _degenerate(quantised[0], source.indices) - _degenerate(
        source.attributes["POSITION"], source.indices
    )
    return missing, extra, collapsed, decoded_vertex[ids[:count]]


def _degenerate(positions: np.ndarray, triangles: np.ndarray) -> int:
    """Number of triangles with two corners at one position."""
    a, b, c = _codec.weld(np.ascontiguousarray(positions).view(np.uint8))[0][triangles].T
    return int(np.count_nonzero((a == b) | (b == c) | (c == a)))


def _rotated(triangles: np.ndarray) -> np.ndarray:
    """Each triangle rotated to a canonical order: its smallest corner first."""
    a, b, c = triangles.T
    turn = np.where((b < a) & (b <= c), 1, np.where((c < a) & (c < b), 2, 0))
    # Two equal smallest corners: (x, x, y), never (x, y, x).
    turn = np.where((a == c) & (a < b), 2, turn)
    return np.ascontiguousarray(
        np.stack([np.choose((turn + k) % 3, (a, b, c)) for k in range(3)], axis=1)
    )


def _multiset_difference(first: np.ndarray, second: np.ndarray) -> tuple[int, int]:
    """(rows only in first, rows only in second), counted with multiplicity."""
    ids, unique = _codec.weld(np.concatenate([first, second]).view(np.uint8))
    surplus = np.bincount(ids[: len(first)], minlength=unique) - np.bincount(
        ids[len(first) :], minlength=unique
    )
    return int(surplus[surplus > 0].sum()), int(-surplus[surplus < 0].sum())


# --- errors ---


def _errors(
    name: str, values: np.ndarray, decoded: np.ndarray, matches: np.ndarray, streams: list[Stream]
) -> Errors:
    """Errors of one attribute over the source vertices that have a match."""
    found = matches >= 0
    source, result = values[found].astype(np.float64), decoded[matches[found]].astype(np.float64)
    errors = Errors(box=np.array([values.min(axis=0), values.max(axis=0)], np.float64))
    if not len(source):
        return errors
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
