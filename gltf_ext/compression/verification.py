"""verify: does a compressed file hold the original's triangles, and how far is every attribute off?

Both sides are brought onto the compressed file's own grids; vertices and triangles are then compared as multisets,
so the encoder's order of triangles and vertices does not matter.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext.compression.extension import (
    EXTENSION,
    Compressed,
    malformed,
    read_compressed,
)
from gltf_ext.compression.primitives import Primitive, read_primitive, triangle_primitives, weld
from gltf_ext.compression.streams import (
    FLOAT32,
    GRID,
    INTEGER,
    OCT,
    SIGN,
    WEIGHT_SUM_TOLERANCE,
    Stream,
    octahedral_bound,
    quantise_like,
    semantic,
)
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import open_model

# Rounding of positions to float32, and of half a step in float64, relative to the value.
FLOAT_ROUNDING = 2.0**-23
STEP_ROUNDING = 1.0 + 1e-6


@dataclass
class Errors:
    """Errors of one attribute in one mesh.

    max, squares, count: largest distance, sum of squared distances, vertices; over_bound: largest error as a share
    of what is allowed; degrees: largest angle, for directions; low, high: the box of the original's values;
    compared: whether there was a vertex to compare.
    """

    max: float = 0.0
    squares: float = 0.0
    count: int = 0
    over_bound: float = 0.0
    degrees: float | None = None
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    compared: bool = False

    def add(self, other: Errors) -> None:
        self.max, self.over_bound = max(self.max, other.max), max(self.over_bound, other.over_bound)
        self.squares, self.count = self.squares + other.squares, self.count + other.count
        self.degrees = (
            other.degrees if self.degrees is None else max(self.degrees, other.degrees or 0.0)
        )
        self.compared = self.compared or other.compared
        self.low = other.low if self.low is None else np.minimum(self.low, other.low)
        self.high = other.high if self.high is None else np.maximum(self.high, other.high)

    @property
    def percent(self) -> float:
        """Factor from an error to percent of the box's diagonal."""
        with np.errstate(invalid="ignore"):  # lossless custom attributes may be infinite
            diagonal = float(np.linalg.norm(self.high - self.low)) if self.low is not None else 0.0
        return 100.0 / diagonal if diagonal > 0.0 else 0.0


def verify(original: str | os.PathLike, compressed: str | os.PathLike) -> dict[str, Any]:
    """Compare a compressed file with the model it was made from.

    Returns ok (all of the following hold), triangles_equal (the same multiset of cyclically rotated, quantised
    corners with all attributes), errors_within_bits (position components off by at most half a step, the others by
    what their bits allow), max_error, rms_error (attribute -> distance, in model or attribute units; directions as
    the distance of unit vectors; None when no vertex could be compared), max_error_percent, rms_error_percent (of the diagonal of the attribute's bounding
    box over the mesh), max_error_degrees (directions), error_over_bound (largest share of the allowed
    error), triangles, missing_triangles, extra_triangles,
    collapsed_triangles (two of whose corners the grid made one), differing_primitives, problems (one line each). Raises MeshletError, OSError.
    """
    originals, document = _opened(original), _opened(compressed)
    if not _is_compressed(document):
        raise _misplaced(originals, str(compressed))
    places = triangle_primitives(originals)
    problems: list[str] = []
    errors: dict[tuple[int, str], Errors] = {}
    counts = {
        "triangles": 0,
        "missing_triangles": 0,
        "extra_triangles": 0,
        "collapsed_triangles": 0,
        "differing_primitives": 0,
    }
    others = triangle_primitives(document)
    if [place[:2] for place in places] != [place[:2] for place in others]:
        problems.append(_differing_places(places, others))
        counts["differing_primitives"], places = 1, []
    for mesh, index, _ in places:
        try:
            source = _source(originals, mesh, index)
        except MeshletError as error:
            error.path = error.path or str(original)
            raise
        try:
            problems += _compare_place(document, source, errors, counts)
        except MeshletError as error:
            error.path = error.path or str(compressed)
            raise
    return _report(problems, errors, counts)


def _is_compressed(document: Document) -> bool:
    return any(
        EXTENSION in (p.extensions or {}) for mesh in document.meshes for p in mesh.primitives
    )


def _misplaced(original: Document, path: str) -> MeshletError:
    """The error for a second file that is not compressed: what to run instead."""
    swapped = (
        ", but the first file is: the arguments are swapped" if _is_compressed(original) else ""
    )
    return MeshletError(
        f"is not compressed{swapped}", "run gltf-meshlet verify ORIGINAL COMPRESSED", path
    )


def _differing_places(places: list[tuple], others: list[tuple]) -> str:
    differing = sorted({place[:2] for place in places} ^ {place[:2] for place in others})
    mesh, index = differing[0]
    return (
        f"{len(places)} triangle primitives in the original, {len(others)} in the compressed file; "
        f"{len(differing)} are only in one, first mesh {mesh} primitive {index}"
    )


def _opened(path: str | os.PathLike) -> Document:
    try:
        return open_model(path)
    except MeshletError as error:
        error.path = error.path or str(path)
        raise


def _source(document: Document, mesh: int, index: int) -> Primitive:
    if EXTENSION in (document.meshes[mesh].primitives[index].extensions or {}):
        return weld(read_compressed(document, mesh, index).decode())[0]
    return weld(read_primitive(document, mesh, index)[0])[0]


def _compare_place(
    document: Document,
    source: Primitive,
    errors: dict[tuple[int, str], Errors],
    counts: dict[str, int],
) -> list[str]:
    """Compare one primitive, adding to errors and counts; returns what is wrong."""
    where = f"mesh {source.mesh} primitive {source.primitive}"
    primitive = document.meshes[source.mesh].primitives[source.primitive]
    counts["triangles"] += len(source.indices)
    if EXTENSION not in (primitive.extensions or {}):
        same = _same_arrays(
            source, weld(read_primitive(document, source.mesh, source.primitive)[0])[0]
        )
        counts["differing_primitives"] += not same
        return [] if same else [f"{where} is not compressed and differs"]
    compressed = read_compressed(document, source.mesh, source.primitive)
    if not len(source.indices):
        counts["differing_primitives"] += 1
        return [f"{where} has no triangle in the original"]
    differences = _attribute_differences(source, compressed)
    if differences:
        counts["differing_primitives"] += 1
        for name, _ in source.arrays:
            errors.setdefault((source.mesh, name), Errors())
        return [f"{where}: attributes differ: {differences}; not compared"]
    missing, extra, collapsed, matches = _match(source, compressed)
    counts["collapsed_triangles"] += collapsed
    counts["missing_triangles"] += missing
    counts["extra_triangles"] += extra
    problems = (
        [f"{where}: {missing} triangles are missing, {extra} are extra"] if missing or extra else []
    )
    decoded = dict(compressed.decode().arrays)
    for (name, values), (_, streams, _) in zip(
        _ordered(source, compressed), compressed.named_streams
    ):
        found = _errors(
            name, values, decoded[name], matches, [compressed.streams[s] for s in streams]
        )
        errors.setdefault((source.mesh, name), Errors()).add(found)
        if found.over_bound > 1.0:
            problems.append(f"{where}: {name} is off by {found.max:g}, more than its bits allow")
    return problems


def _attribute_differences(source: Primitive, compressed: Compressed) -> str:
    """The attributes that one side lacks or has with other components; empty for none."""
    before = {name: values.shape[1] for name, values in source.arrays}
    after = {name: form[1] for name, _, form in compressed.named_streams}
    kinds = (
        ("only in the original", sorted(set(before) - set(after))),
        ("only in the compressed file", sorted(set(after) - set(before))),
        (
            "with other components",
            sorted(n for n in before if after.get(n, before[n]) != before[n]),
        ),
    )
    return ", ".join(f"{' '.join(names)} {kind}" for kind, names in kinds if names)


def _same_arrays(a: Primitive, b: Primitive) -> bool:
    return np.array_equal(a.indices, b.indices) and all(
        n == m and np.array_equal(x, y) for (n, x), (m, y) in zip(a.arrays, b.arrays)
    )


def _ordered(source: Primitive, compressed: Compressed) -> list[tuple[str, np.ndarray]]:
    """The source's arrays in the order of compressed.named_streams."""
    arrays = dict(source.arrays)
    return [(name, arrays[name]) for name, _, _ in compressed.named_streams]


# --- triangles ---


def _match(source: Primitive, compressed: Compressed) -> tuple[int, int, int, np.ndarray]:
    """(missing triangles, extra triangles, triangles collapsed by the grid, decoded vertex for each source vertex, -1 for none)."""
    try:
        triangles, decoded = _codec.decode(compressed.blob)
    except ValueError as error:
        raise malformed(compressed.where, error) from None
    quantised = [
        part
        for (name, values), (_, streams, _) in zip(
            _ordered(source, compressed), compressed.named_streams
        )
        for part in quantise_like(
            name, values, [compressed.streams[s] for s in streams], source.attributes
        )
    ]
    order = [s for _, streams, _ in compressed.named_streams for s in streams]
    count = source.vertex_count
    rows = np.empty(
        (count + compressed.vertex_count, sum(q.shape[1] for q in quantised)), np.uint32
    )
    start = 0
    for values, stream in zip(quantised, order):
        end = start + values.shape[1]
        rows[:count, start:end], rows[count:, start:end] = values, decoded[stream]
        start = end
    ids, unique = _codec.weld(rows.view(np.uint8))
    holder = np.full(unique, -1, np.int64)
    holder[ids[count:]] = np.arange(compressed.vertex_count)
    missing, extra = _multiset_difference(
        _rotated(ids[source.indices]), _rotated(ids[count + triangles])
    )
    collapsed = _degenerate(quantised[0], source.indices) - _degenerate(
        source.attributes["POSITION"], source.indices
    )
    return missing, extra, collapsed, holder[ids[:count]]


def _degenerate(positions: np.ndarray, triangles: np.ndarray) -> int:
    """How many triangles have two corners at one position."""
    a, b, c = _codec.weld(np.ascontiguousarray(positions).view(np.uint8))[0][triangles].T
    return int(np.count_nonzero((a == b) | (b == c) | (c == a)))


def _rotated(triangles: np.ndarray) -> np.ndarray:
    """Each triangle turned so that its smallest corner comes first; with two smallest ones, in one way too."""
    a, b, c = triangles.T
    turn = np.where((b < a) & (b <= c), 1, np.where((c < a) & (c < b), 2, 0))
    # Of two equal smallest corners the one followed by the other leads: (x, x, y), never (x, y, x).
    turn = np.where((a == c) & (a < b), 2, turn)
    return np.ascontiguousarray(
        np.stack([np.choose((turn + k) % 3, (a, b, c)) for k in range(3)], axis=1)
    )


def _multiset_difference(first: np.ndarray, second: np.ndarray) -> tuple[int, int]:
    """(rows of first that second lacks, rows of second that first lacks), counted with multiplicity."""
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
    source, result = values[found], decoded[matches[found]]
    total = Errors(
        low=values.min(axis=0).astype(np.float64), high=values.max(axis=0).astype(np.float64)
    )
    if not len(source):
        return total
    total.compared = True
    if streams[0].kind in (INTEGER, FLOAT32):
        _add_exact(total, source, result)
        return total
    source, result = source.astype(np.float64), result.astype(np.float64)
    start = 0
    for stream in streams:
        part = slice(start, start + stream.width)
        {OCT: _add_direction, SIGN: _add_sign, GRID: _add_grid}[stream.kind](
            total, source[:, part], result[:, part], stream, name
        )
        start += stream.width
    return total


def _add_exact(total: Errors, source: np.ndarray, result: np.ndarray) -> None:
    total.count += len(source)
    if not np.array_equal(
        np.ascontiguousarray(source).view(np.uint8), np.ascontiguousarray(result).view(np.uint8)
    ):
        total.max = float(np.nanmax(np.abs(source.astype(np.float64) - result)))
        total.over_bound = np.inf


def _add_distances(total: Errors, distances: np.ndarray, over_bound: float) -> None:
    total.max, total.over_bound = (
        max(total.max, float(distances.max())),
        max(total.over_bound, over_bound),
    )
    total.squares += float(np.square(distances).sum())
    total.count += len(distances)


def _add_grid(
    total: Errors, source: np.ndarray, result: np.ndarray, stream: Stream, name: str
) -> None:
    difference = np.abs(source - result)
    magnitude = np.maximum(np.abs(source).max(axis=0), np.abs(stream.offset))
    # Skin weights are rounded so that their sum stays: by up to a whole step, and what the sum was off.
    allowed = (
        stream.step + WEIGHT_SUM_TOLERANCE
        if semantic(name) == "WEIGHTS"
        else 0.5 * stream.step * STEP_ROUNDING
    )
    _add_distances(
        total,
        np.sqrt((difference * difference).sum(axis=1)),
        float((difference / (allowed + FLOAT_ROUNDING * magnitude)).max()),
    )


def _add_sign(
    total: Errors, source: np.ndarray, result: np.ndarray, stream: Stream, name: str
) -> None:
    if ((source >= 0.0) != (result > 0.0)).any():
        total.over_bound = np.inf


def _add_direction(
    total: Errors, source: np.ndarray, result: np.ndarray, stream: Stream, name: str
) -> None:
    """Between unit vectors; source vectors of length zero have no direction to lose."""
    length = np.linalg.norm(source, axis=1)
    usable = length > 0.0
    if usable.any():
        distances = np.linalg.norm(source[usable] / length[usable, None] - result[usable], axis=1)
        angle = 2.0 * float(np.arcsin(min(distances.max() / 2.0, 1.0)))
        total.degrees = float(np.degrees(angle))
        _add_distances(total, distances, angle / (octahedral_bound(stream.bits) + FLOAT_ROUNDING))


def _report(
    problems: list[str], errors: dict[tuple[int, str], Errors], counts: dict[str, int]
) -> dict[str, Any]:
    by_name: dict[str, list[Errors]] = {}
    for (_, name), found in errors.items():
        by_name.setdefault(name, []).append(found)

    def each(figure) -> dict[str, Any]:
        return {
            name: figure(group) if any(e.compared for e in group) else None
            for name, group in by_name.items()
        }

    def rms(group: list[Errors], scaled: bool) -> float:
        squares = sum(e.squares * (e.percent**2 if scaled else 1.0) for e in group)
        return float(np.sqrt(squares / max(sum(e.count for e in group), 1)))

    directions = {
        name: max(e.degrees or 0.0 for e in group)
        for name, group in by_name.items()
        if any(e.degrees is not None for e in group)
    }
    return {
        "ok": not problems,
        "triangles_equal": not (
            counts["missing_triangles"]
            or counts["extra_triangles"]
            or counts["differing_primitives"]
        ),
        "errors_within_bits": all(e.over_bound <= 1.0 for e in errors.values()),
        **counts,
        "max_error": each(lambda g: max(e.max for e in g)),
        "rms_error": each(lambda g: rms(g, False)),
        "max_error_percent": each(lambda g: max(e.max * e.percent for e in g)),
        "rms_error_percent": each(lambda g: rms(g, True)),
        "max_error_degrees": directions,
        "error_over_bound": each(lambda g: max(e.over_bound for e in g)),
        "problems": problems,
    }
