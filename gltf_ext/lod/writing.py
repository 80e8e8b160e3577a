"""Encodes the levels of a primitive: its surface, pages of groups, tables."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import Stream
from gltf_ext.attributes.records import RecordFormat, Vertices, weld_rows
from gltf_ext.attributes.streams import Plan
from gltf_ext.lod.builder import Hierarchy
from gltf_ext.lod.surface import Surface, longest_side
from gltf_ext.lod.tables import GROUP, PAGE, Tables, reach
from gltf_ext.options import Options
from gltf_ext.ranges import begins, first_of_each, members, occurring
from gltf_ext.sources.attribute_names import is_of_target, local_name, semantic

# Weights of attributes in the choice of edges, beside positions in a box of size 1. Normals: at 0.2
# igea draws 1.25 times the triangles, dragon and beast 1.1 times, over 25 errors. At one pixel of
# error pictures are as near to full detail (700 x 700: 39.6 and 39.7 dB of igea).
ATTRIBUTE_WEIGHTS = {"NORMAL": 0.05, "TEXCOORD": 0.5, "COLOR": 0.5}
MORPH_WEIGHT = 1.0
MOST_WEIGHED = 16  # floats per vertex that count in the choice of edges
# Groups in a block, in which errors decide the order. Dragon with four times its triangles and
# noise, pages for one pixel of error: 1.28 MB with 24 groups, 1.20 with 48, 1.16 with 96. For four
# pixels at the nearest point, mean of 20 cameras: 1.57, 1.60, 1.70 MB.
BLOCK_GROUPS = 48
# The last page of a coarse level takes groups of the next level if it is emptier than this. Full
# pages make 2 % smaller files, but a cut loads up to a fifth more bytes (igea).
LEAST_SHARE = 0.25


def error_limit_of(options: Options, plan: Plan) -> float:
    """lod_limit in cells of the grid, less what stated errors are raised by; infinite without."""
    limit = math.inf if options.lod_limit is None else options.lod_limit
    return (limit - _rounding_of(plan)) / plan.streams[0].step


def _rounding_of(plan: Plan) -> float:
    """By how much distances differ between the grid and decoded positions, which are floats.

    In units of POSITION. Without it 1.5 % of a part of bistro_like lay 4e-7 beyond its stated error
    of 0.329.
    """
    reach = [
        np.abs(stream.offset).max(initial=0.0) + 2.0**stream.bits * stream.step
        for stream in (plan.streams[n] for n in plan.position_streams)
    ]
    largest = reach[0] + max(reach[1:], default=0.0)
    return math.ldexp(2.0, math.frexp(largest)[1] - 24)  # two steps of a float there


# --- the surface ---


def surface_of(form: RecordFormat, vertices: Vertices, values: list[np.ndarray]) -> Surface:
    """The surface of vertices, whose values are uint32[V, elements] of each stream."""
    ids, count = weld_rows(form.without_hash(vertices.records))
    first = first_of_each(ids, count)
    points = values[0].astype(np.float32)
    step = form.plan.streams[0].step
    shifts = tuple(
        name
        for name in form.plan.attributes
        if is_of_target(name) and local_name(name) == "POSITION"
    )
    moves = [
        (move / step).astype(np.float32)
        for move in form.attributes_of(vertices, values, shifts).values()
    ]
    attributes, weights = _weighed(form, vertices, values, moves, longest_side(points))
    same_position, _ = weld_rows(values[0])
    morphed = [points + move for move in moves]
    triangles, original_ids = vertices.triangles, vertices.position_ids
    canonical = _joined(first[ids], triangles, same_position, morphed)
    return Surface(
        triangles,
        points,
        same_position,
        canonical,
        _apart(points, same_position, canonical, triangles, original_ids),
        attributes,
        weights,
        morphed,
    )


def _joined(
    vertex: np.ndarray, triangles: np.ndarray, same_position: np.ndarray, morphed: list[np.ndarray]
) -> np.ndarray:
    """vertex, uint32[V], but one for all that edges without length join.

    Such vertices differ, in normals as a rule, only because the grid is coarser than the mesh. Kept
    apart they would be seams, which hold simplification back: with a noisy scan of 14 M triangles
    at 12 bits, one pixel needed four times the triangles. same_position: numbers of positions at
    rest. An edge must have no length with any morph target either.
    """
    sides = [(triangles[:, i], triangles[:, (i + 1) % 3]) for i in range(3)]
    short = [same_position[start] == same_position[end] for start, end in sides]
    a, b = (np.concatenate([side[k][s] for side, s in zip(sides, short)]) for k in range(2))
    for points in morphed:
        still = (np.rint(points[a]) == np.rint(points[b])).all(axis=1)
        a, b = a[still], b[still]
    result: np.ndarray = _connected(vertex[a], vertex[b], len(vertex))[vertex]
    return result


def _connected(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """uint32[count]: the least number that pairs (a, b) of numbers connect each one with."""
    least: np.ndarray = np.arange(count, dtype=np.uint32)
    while (least[a] != least[b]).any():
        lower = np.minimum(least[a], least[b])
        np.minimum.at(least, least[a], lower)
        np.minimum.at(least, least[b], lower)
        least = least[least]
    return least


def _apart(
    points: np.ndarray,
    same_position: np.ndarray,
    canonical: np.ndarray,
    triangles: np.ndarray,
    original_ids: np.ndarray,
) -> np.ndarray:
    """points, but different by a few units in the last place where only the grid joins vertices.

    The simplifier takes vertices at one position for sides of a seam, and keeps those that do not
    look like one. Where folds of a noisy scan touch on the grid, they would stay in all levels: a
    quarter of the 6,332 triangles of a level of dragon with four times its triangles and noise.
    canonical: as in Surface; original_ids: numbers of positions before they were quantised.
    """
    first = first_of_each(original_ids, int(original_ids.max()) + 1)
    seam = canonical != canonical[first[original_ids]]
    ends = canonical[seam], canonical[first[original_ids[seam]]]
    side = _connected(*ends, len(points))[canonical]
    sides = np.bincount(same_position[occurring(side, len(points))])
    if sides.max() == 1:
        return points
    borders = _touching_borders(side[triangles], same_position, sides > 1)
    side = _connected(*borders, len(points))[side]
    numbers = occurring(side, len(points))
    numbers = numbers[np.argsort(same_position[numbers], kind="stable")]
    counts = np.bincount(same_position[numbers])
    rank = np.zeros(len(points), np.int32)
    rank[numbers] = np.arange(len(numbers)) - np.repeat(begins(counts)[:-1], counts)
    if rank.max() * np.spacing(np.abs(points[:, 0]).max()) >= 0.5:
        return points  # From about 2^21 cells on, floats leave no room between neighbours.
    apart: np.ndarray = points.copy()
    apart[:, 0].view(np.int32)[...] += rank[side]
    return apart


def _touching_borders(
    triangles: np.ndarray, same_position: np.ndarray, is_shared: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of vertices, uint32[N] each, where borders of triangles lie on each other.

    Such borders are those of a crack that the grid closes.
    is_shared: bool[P]: positions of several vertices.
    """
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    kept = is_shared[same_position[start]] | is_shared[same_position[end]]
    start, end = start[kept], end[kept]
    low, high = np.minimum(start, end), np.maximum(start, end)
    edge, count = _codec.weld(np.stack([low, high], axis=1).view(np.uint8))
    passes = np.bincount(edge, np.sign(end.astype(np.int64) - start), count)
    is_border = passes[edge] != 0
    start, end = start[is_border], end[is_border]
    turned = same_position[start] > same_position[end]
    ends = np.where(turned, [end, start], [start, end])
    place, count = _codec.weld(np.ascontiguousarray(same_position[ends].T).view(np.uint8))
    other = ends[:, first_of_each(place, count)[place]]
    return ends.reshape(-1), other.reshape(-1)


def _weighed(
    form: RecordFormat,
    vertices: Vertices,
    values: list[np.ndarray],
    moves: list[np.ndarray],
    extent: float,
) -> tuple[np.ndarray, np.ndarray]:
    """(values, weights) of the attributes that count in the choice of edges."""
    columns = [np.empty((len(values[0]), 0), np.float32)]
    weights: list[float] = []
    names = tuple(
        name
        for name in form.plan.attributes
        if semantic(name) in ATTRIBUTE_WEIGHTS
        and (name != "NORMAL" or form.formats[name][0].kind == "f")
    )
    weighed = [
        (
            decoded if name == "NORMAL" else _unit(decoded.astype(np.float32)),
            ATTRIBUTE_WEIGHTS[semantic(name)],
        )
        for name, decoded in form.attributes_of(vertices, values, names).items()
    ]
    weighed += [(move / np.float32(max(extent, 1.0)), MORPH_WEIGHT) for move in moves]
    for decoded, weight in weighed:
        if len(weights) + decoded.shape[1] <= MOST_WEIGHED:
            columns.append(decoded)
            weights += [weight] * decoded.shape[1]
    return np.ascontiguousarray(np.concatenate(columns, axis=1)), np.array(weights, np.float32)


def _unit(values: np.ndarray) -> np.ndarray:
    """The values, scaled to a box of size 1 unless they are smaller."""
    size = np.float32(max(longest_side(values), 1.0))
    scaled: np.ndarray = values / size
    return scaled


# --- encoding ---


@dataclass
class Pages:
    """Pages, one after the other.

    Attributes:
        groups: the places of the groups in each; blobs: of each.
        rows: PAGE[1] of each, without firstGroup.
        statistics: as _codec.encode gives them, of the last packing.
    """

    groups: list[np.ndarray] = field(default_factory=list)
    blobs: list[bytes] = field(default_factory=list)
    rows: list[np.ndarray] = field(default_factory=list)
    statistics: dict[str, Any] = field(default_factory=dict)

    def add(self, other: Pages) -> None:
        """Adds other pages."""
        self.groups += other.groups
        self.blobs += other.blobs
        self.rows += other.rows

    def take_last(self) -> np.ndarray:
        """Removes the last page; returns its groups."""
        self.blobs.pop()
        self.rows.pop()
        return self.groups.pop()


def _pack(
    hierarchy: Hierarchy,
    groups: np.ndarray,
    limit: int,
    streams: list[Stream],
    threads: int,
    triangles: np.ndarray,
    ids: np.ndarray,
    positions: np.ndarray,
    values: list[np.ndarray],
) -> Pages:
    """Packs groups, in this order, into pages of at most `limit` bytes.

    A group that is larger than a page is alone in one.
    triangles: of all clusters; ids, positions, values: of their vertices.
    """
    ranges = _GroupRanges(hierarchy)
    numbers = ranges.numbers_of(groups)
    clusters = hierarchy.clusters.chosen(numbers)
    group_begin = begins(np.diff(ranges.begin)[groups])
    used = triangles[members(hierarchy.clusters.triangle_begin, numbers)]
    view, statistics = _codec.encode(
        np.ascontiguousarray(used),
        ids,
        positions,
        streams,
        values,
        threads=threads,
        meshlets=(
            np.arange(len(used), dtype=np.uint32),
            clusters.disk_begin.astype(np.uint32),
            clusters.cluster_begin.astype(np.uint32),
            group_begin.astype(np.uint32),
        ),
        page_bytes=limit,
    )
    blobs = [view[start : start + size] for start, size in _codec.split(view)]
    headers = [_codec.Header(blob) for blob in blobs]
    ends = np.cumsum([header.meshlet_count for header in headers])
    rows = [
        np.array([(len(blob), 0, header.triangle_count, header.vertex_count)], PAGE)
        for blob, header in zip(blobs, headers)
    ]
    pieces = np.split(groups, np.searchsorted(group_begin, ends[:-1]))
    return Pages(pieces, blobs, rows, statistics)


class _GroupRanges:
    """The clusters of groups."""

    def __init__(self, hierarchy: Hierarchy) -> None:
        self.clusters = hierarchy.clusters
        # By group, then by the group that they were made from: runs.
        self.order = np.lexsort((hierarchy.refined, hierarchy.group))
        self.begin = begins(np.bincount(hierarchy.group, minlength=len(hierarchy.level)))

    def numbers_of(self, groups: np.ndarray) -> np.ndarray:
        """int64: the groups' clusters, one group after the other."""
        numbers: np.ndarray = self.order[members(self.begin, groups)]
        return numbers


def _separate(hierarchy: Hierarchy, surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices of their own for each level.

    Returns (vertices of the source, uint32 position ids of them, uint32[T, 3] all triangles in new
    vertices; those of level 0 are zeros).
    """
    clusters = hierarchy.clusters
    fine = np.count_nonzero(hierarchy.refined < 0)
    first = int(clusters.triangle_begin[fine])
    corners = clusters.triangles[first:].reshape(-1)
    # Of clusters; arrays of all corners are the most memory that paged takes.
    counts = 3 * np.diff(clusters.triangle_begin)[fine:]
    level, made_from = hierarchy.level[hierarchy.group[fine:]], hierarchy.refined[fine:]
    is_clashing = _clashing(corners, counts, level, made_from)[made_from]
    layer = np.where(is_clashing, int(level.max()) + 1 + made_from, level)
    count = len(surface.points)
    local, made = _numbered(_keys(layer * count, counts, corners))
    corner_of = np.empty(made, np.uint32)
    corner_of[local] = np.arange(len(corners), dtype=np.uint32)
    triangles = np.zeros((len(clusters.triangles), 3), np.uint32)
    triangles[first:] = local.reshape(-1, 3)
    vertices = corners[corner_of].astype(np.int64)
    level_of = np.repeat(level.astype(np.uint16), counts)[corner_of]
    ids, _ = _numbered(level_of.astype(np.int64) * count + surface.position_ids[vertices])
    return vertices, ids, triangles


def _keys(base: np.ndarray, counts: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """int64: numbers of corners plus that of their cluster in `base`."""
    keys = np.repeat(base, counts)
    keys += numbers
    return keys


def _numbered(keys: np.ndarray) -> tuple[np.ndarray, int]:
    """(uint32 numbers of equal int64 keys, how many there are). Faster than np.unique."""
    ids, count = _codec.weld(keys.view(np.uint8).reshape(-1, 8))
    return ids, count


def _clashing(
    corners: np.ndarray, counts: np.ndarray, level: np.ndarray, made_from: np.ndarray
) -> np.ndarray:
    """bool[G]: groups whose replacement has an edge that two triangles of a level pass one way.

    Meshlets were made in each replacement alone, where such an edge may lie inside a disk.
    counts, level, made_from: of clusters.
    """
    count = int(corners.max()) + 1
    keys = _keys(level * count, counts, corners)
    keys *= count
    keys += np.roll(corners.reshape(-1, 3), -1, axis=1).reshape(-1)
    numbers, _ = _numbered(keys)
    twice = np.flatnonzero((np.bincount(numbers) > 1)[numbers])
    clashing = np.zeros(int(made_from.max()) + 1, bool)
    clashing[made_from[np.searchsorted(np.cumsum(counts), twice, "right")]] = True
    return clashing


def paged(
    hierarchy: Hierarchy,
    surface: Surface,
    streams: list[Stream],
    values: list[np.ndarray],
    ids: np.ndarray,
    limit: int,
    threads: int,
) -> tuple[Pages, Pages]:
    """Encodes all groups, level 0 with the vertices of the surface, all others with their own.

    values: uint32[V, elements] of each stream; ids: uint32[V]: numbers of positions in level 0,
    before they were quantised. Returns (pages of coarse levels, pages of level 0).
    Surfaces of two levels lie on each other. So that no edge has four triangles, each level has its
    own vertices, and so do replacements of groups with an edge that the level has already.
    """
    levels = np.unique(hierarchy.level)[::-1]
    coarse, fine = Pages(), Pages()
    if levels[0] > 0:
        vertices, own_ids, triangles = _separate(hierarchy, surface)
        own_values = [np.ascontiguousarray(v[vertices]) for v in values]
        data = triangles, own_ids, surface.points[vertices], own_values
    for level in levels[levels > 0]:
        groups = _by_error(np.flatnonzero(hierarchy.level == level), hierarchy.error)
        if coarse.blobs and len(coarse.blobs[-1]) < LEAST_SHARE * limit:
            groups = np.concatenate([coarse.take_last(), groups])
        coarse.add(_pack(hierarchy, groups, limit, streams, threads, *data))
    # The groups of level 0, the most, stay along the curve: the errors of what replaces them differ
    # little, and neighbours in one page share vertices.
    finest = np.flatnonzero(hierarchy.level == 0)
    if len(finest):
        data = hierarchy.clusters.triangles, ids, surface.points, values
        fine = _pack(hierarchy, finest, limit, streams, threads, *data)
    return coarse, fine


def _by_error(groups: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Groups of one level along a curve, in blocks of BLOCK_GROUPS neighbours, ordered by error.

    Each block goes from the largest error to the smallest: a cut takes all groups above an error,
    and so mostly whole pages. error: of all groups.
    """
    count = -(-len(groups) // BLOCK_GROUPS)
    block = np.arange(len(groups)) * count // max(len(groups), 1)
    ordered: np.ndarray = groups[np.lexsort((-error[groups], block))]
    return ordered


# --- tables ---


def tables_of(
    hierarchy: Hierarchy,
    pages_of: list[np.ndarray],
    rows: list[np.ndarray],
    coarse: int,
    plan: Plan,
) -> Tables:
    """The tables of the groups in the order of the pages, in units of POSITION.

    pages_of: the groups of each page; rows: PAGE[1] of each; coarse: the number of coarse pages.
    Does not use the triangles of the hierarchy.
    """
    stream = plan.streams[0]
    order = np.concatenate(pages_of)  # old numbers, in the new order
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    ranges = _GroupRanges(hierarchy)
    clusters = ranges.numbers_of(order)
    sizes = np.diff(ranges.begin)[order]
    owner = np.repeat(np.arange(len(order)), sizes)
    refined = hierarchy.refined[clusters]
    is_coarse = refined >= 0
    starts = is_coarse & np.append(True, (np.diff(owner) != 0) | (np.diff(refined) != 0))
    run_owner, run_group = owner[starts], number[refined[starts]]
    run_of_cluster = np.cumsum(starts)[is_coarse] - 1
    groups = np.zeros(len(order), GROUP)
    groups["clusters"] = sizes
    groups["runs"] = np.bincount(run_owner, minlength=len(order))
    groups["firstRun"] = begins(groups["runs"])[:-1]
    page = np.repeat(np.arange(len(pages_of)), [len(p) for p in pages_of])
    groups["page"] = page
    first_group = np.searchsorted(page, np.arange(len(pages_of)))
    cluster_begin = begins(sizes)
    groups["firstCluster"] = cluster_begin[:-1] - cluster_begin[first_group][page]
    error = hierarchy.error[order]
    groups["error"] = _rounded_up(error * stream.step + np.where(error > 0, _rounding_of(plan), 0))
    centre = np.array(stream.offset) + hierarchy.centre[order] * stream.step
    groups["centre"] = centre
    moved = np.linalg.norm(groups["centre"] - centre, axis=1)
    groups["radius"] = _rounded_up(hierarchy.radius[order] * stream.step + moved)
    _nest(groups, hierarchy.level[order], run_owner, run_group)
    pages = np.concatenate(rows)
    pages["firstGroup"] = first_group
    counts = np.bincount(run_of_cluster, minlength=len(run_group))
    return Tables(pages, groups, run_group, counts, coarse)


def _rounded_up(values: np.ndarray) -> np.ndarray:
    """float32 values that are not smaller."""
    rounded = values.astype(np.float32)
    up: np.ndarray = np.where(rounded < values, np.nextafter(rounded, np.float32(np.inf)), rounded)
    return up


def _nest(
    groups: np.ndarray, level: np.ndarray, run_owner: np.ndarray, run_group: np.ndarray
) -> None:
    """Enlarges spheres until each holds those of its runs, despite rounding."""
    for here in range(1, int(level.max()) + 1):
        runs = level[run_owner] == here
        owner, finer = run_owner[runs], run_group[runs]
        np.maximum.at(groups["radius"], owner, _rounded_up(reach(groups, owner, finer)))
