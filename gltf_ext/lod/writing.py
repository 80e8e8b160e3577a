"""Encodes the levels of a primitive: its surface, pages of groups, tables."""

from __future__ import annotations

import math

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.records import RecordFormat, Vertices, weld_rows
from gltf_ext.attributes.streams import Plan
from gltf_ext.lod.builder import Hierarchy
from gltf_ext.lod.shading import ATTRIBUTE_WEIGHTS, choices_of, shading_columns
from gltf_ext.lod.surface import Surface, longest_side
from gltf_ext.lod.tables import GROUP, Tables, reach
from gltf_ext.options import Options
from gltf_ext.ranges import begins, first_of_each, members, occurring
from gltf_ext.sources.attribute_names import is_of_target, local_name, semantic

MORPH_WEIGHT = 1.0
MAX_WEIGHTED = 16  # floats per vertex that count in the choice of edges


def error_limit_of(options: Options, plan: Plan) -> float:
    """Return lod_limit in cells of the grid, minus the rounding error; infinite without a limit."""
    limit = math.inf if options.lod_limit is None else options.lod_limit
    return (limit - _position_rounding(plan)) / plan.streams[0].step


def _position_rounding(plan: Plan) -> float:
    """Return the largest rounding error of a distance, since decoded positions are floats.

    In units of POSITION. Without it, 1.5 % of a part of bistro_like lay 4e-7 beyond its stated
    error of 0.329.
    """
    reach = [
        np.abs(stream.offset).max(initial=0.0) + 2.0**stream.bits * stream.step
        for stream in (plan.streams[n] for n in plan.position_streams)
    ]
    largest = reach[0] + max(reach[1:], default=0.0)
    return math.ldexp(2.0, math.frexp(largest)[1] - 24)  # two steps of a float there


# --- the surface ---


def make_surface(
    record_format: RecordFormat, vertices: Vertices, values: list[np.ndarray]
) -> Surface:
    """Return the surface of a primitive.

    Args:
        record_format: of the vertices.
        vertices: V of them, with their triangles.
        values: uint32[V, elements] of each stream.
    """
    ids, count = weld_rows(record_format.without_hash(vertices.records))
    first = first_of_each(ids, count)
    points = values[0].astype(np.float32)
    step = record_format.plan.streams[0].step
    names = tuple(
        name
        for name in record_format.plan.attributes
        if is_of_target(name) and local_name(name) == "POSITION"
    )
    moves = [
        (move / step).astype(np.float32)
        for move in record_format.attributes_of(vertices, values, names).values()
    ]
    columns = shading_columns(record_format, vertices, values)
    attributes, weights = _weighted_attributes(columns, len(points), moves, longest_side(points))
    position_ids, _ = weld_rows(values[0])
    morphed = [points + move for move in moves]
    triangles, original_ids = vertices.triangles, vertices.position_ids
    canonical = _join_short_edges(first[ids], triangles, position_ids, morphed)
    return Surface(
        triangles,
        points,
        position_ids,
        canonical,
        _separate_points(points, position_ids, canonical, triangles, original_ids),
        attributes,
        weights,
        morphed,
        choices=choices_of(record_format, columns, values),
    )


def _join_short_edges(
    vertex: np.ndarray, triangles: np.ndarray, position_ids: np.ndarray, morphed: list[np.ndarray]
) -> np.ndarray:
    """Map all vertices that edges of length zero connect to one of them.

    Such vertices usually differ in normals only, because the grid is coarser than the mesh. They
    would be seams, which hold simplification back: with a noisy scan of 14 M triangles at 12 bits,
    one pixel needed four times the triangles.

    Args:
        vertex: uint32[V]: the representative of each vertex so far.
        triangles: uint32[T, 3].
        position_ids: uint32[V]: equal for equal positions at rest.
        morphed: float32[V, 3] for each morph target: an edge must have length zero with all.

    Returns:
        uint32[V]: the representative of each vertex.
    """
    edges = [(triangles[:, i], triangles[:, (i + 1) % 3]) for i in range(3)]
    is_short = [position_ids[start] == position_ids[end] for start, end in edges]
    a, b = (
        np.concatenate([edge[k][short] for edge, short in zip(edges, is_short)]) for k in range(2)
    )
    for points in morphed:
        is_still = (np.rint(points[a]) == np.rint(points[b])).all(axis=1)
        a, b = a[is_still], b[is_still]
    result: np.ndarray = _connect(vertex[a], vertex[b], len(vertex))[vertex]
    return result


def _connect(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """Return uint32[count]: the lowest number that pairs (a, b) connect each number with."""
    lowest: np.ndarray = np.arange(count, dtype=np.uint32)
    while (lowest[a] != lowest[b]).any():
        lower = np.minimum(lowest[a], lowest[b])
        np.minimum.at(lowest, lowest[a], lower)
        np.minimum.at(lowest, lowest[b], lower)
        lowest = lowest[lowest]
    return lowest


def _separate_points(
    points: np.ndarray,
    position_ids: np.ndarray,
    canonical: np.ndarray,
    triangles: np.ndarray,
    original_ids: np.ndarray,
) -> np.ndarray:
    """Move points by a few units in the last place where only the grid joins vertices.

    The simplifier treats vertices at one position as sides of a seam, and keeps those that do not
    look like one. Where folds of a noisy scan touch on the grid, they would stay in all levels: a
    quarter of the 6,332 triangles of a level of dragon with four times its triangles and noise.

    Args:
        points: float32[V, 3]: positions on the grid.
        position_ids: uint32[V], equal where points are.
        canonical: uint32[V]: canonical vertices, as in Surface.
        triangles: uint32[T, 3].
        original_ids: uint32[V], equal for equal positions before quantisation.

    Returns:
        float32[V, 3]: the points, or `points` itself if none moves.
    """
    first = first_of_each(original_ids, int(original_ids.max()) + 1)
    seam = canonical != canonical[first[original_ids]]
    ends = canonical[seam], canonical[first[original_ids[seam]]]
    side = _connect(*ends, len(points))[canonical]
    sides = np.bincount(position_ids[occurring(side, len(points))])
    if sides.max() == 1:
        return points
    borders = _touching_borders(side[triangles], position_ids, sides > 1)
    side = _connect(*borders, len(points))[side]
    numbers = occurring(side, len(points))
    numbers = numbers[np.argsort(position_ids[numbers], kind="stable")]
    counts = np.bincount(position_ids[numbers])
    rank = np.zeros(len(points), np.int32)
    rank[numbers] = np.arange(len(numbers)) - np.repeat(begins(counts)[:-1], counts)
    if rank.max() * np.spacing(np.abs(points[:, 0]).max()) >= 0.5:
        return points  # From about 2^21 cells on, floats leave no room between neighbours.
    moved_points: np.ndarray = points.copy()
    moved_points[:, 0].view(np.int32)[...] += rank[side]
    return moved_points


def _touching_borders(
    triangles: np.ndarray, position_ids: np.ndarray, is_shared: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Find vertices of borders that lie on each other: of a crack that the grid closes.

    Args:
        triangles: uint32[T, 3].
        position_ids: uint32[V].
        is_shared: bool[P]: positions of several vertices.

    Returns:
        Pairs of vertices at equal positions, uint32[N] each.
    """
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    is_candidate = is_shared[position_ids[start]] | is_shared[position_ids[end]]
    start, end = start[is_candidate], end[is_candidate]
    low, high = np.minimum(start, end), np.maximum(start, end)
    edge, count = _codec.weld(np.stack([low, high], axis=1).view(np.uint8))
    passes = np.bincount(edge, np.sign(end.astype(np.int64) - start), count)
    is_border = passes[edge] != 0
    start, end = start[is_border], end[is_border]
    is_turned = position_ids[start] > position_ids[end]
    ends = np.where(is_turned, [end, start], [start, end])
    position, count = _codec.weld(np.ascontiguousarray(position_ids[ends].T).view(np.uint8))
    first_ends = ends[:, first_of_each(position, count)[position]]
    return ends.reshape(-1), first_ends.reshape(-1)


def _weighted_attributes(
    shading: dict[str, np.ndarray], count: int, moves: list[np.ndarray], extent: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the attributes that count in the choice of edges: float32[V, A], float32[A].

    Args:
        shading: as shading_columns returns it.
        count: number of vertices V.
        moves: float32[V, 3] of each morph target.
        extent: the longest side of the box around the points.
    """
    columns = [np.empty((count, 0), np.float32)]
    weights: list[float] = []
    inputs = [(column, ATTRIBUTE_WEIGHTS[semantic(name)]) for name, column in shading.items()]
    inputs += [(move / np.float32(max(extent, 1.0)), MORPH_WEIGHT) for move in moves]
    for column, weight in inputs:
        if len(weights) + column.shape[1] <= MAX_WEIGHTED:
            columns.append(column)
            weights += [weight] * column.shape[1]
    return np.ascontiguousarray(np.concatenate(columns, axis=1)), np.array(weights, np.float32)


# --- tables ---


class _GroupRanges:
    """The clusters of each group.

    Attributes:
        order: int64[C]: clusters by group, then by their finer group: runs.
        begin: int64[G + 1]: the first cluster of each group in `order`, and C.
    """

    def __init__(self, hierarchy: Hierarchy) -> None:
        self.order = np.lexsort((hierarchy.finer_group, hierarchy.cluster_group))
        self.begin = begins(
            np.bincount(hierarchy.cluster_group, minlength=len(hierarchy.group_level))
        )

    def numbers_of(self, groups: np.ndarray) -> np.ndarray:
        """Return the clusters of some groups, group after group: int64."""
        numbers: np.ndarray = self.order[members(self.begin, groups)]
        return numbers


def make_tables(
    hierarchy: Hierarchy,
    page_groups: list[np.ndarray],
    rows: np.ndarray,
    coarse_pages: int,
    plan: Plan,
) -> Tables:
    """Make the tables, with groups in the order of the pages and lengths in units of POSITION.

    Args:
        hierarchy: all clusters and groups.
        page_groups: int64 for each page: the numbers of its groups.
        rows: PAGE[P], without firstGroup.
        coarse_pages: number of pages before those of level 0.
        plan: the primitive's streams.
    """
    stream = plan.streams[0]
    order = np.concatenate(page_groups)  # old numbers, in the new order
    new_number = np.empty(len(order), np.int64)
    new_number[order] = np.arange(len(order))
    ranges = _GroupRanges(hierarchy)
    clusters = ranges.numbers_of(order)
    sizes = np.diff(ranges.begin)[order]
    owner = np.repeat(np.arange(len(order)), sizes)
    finer_group = hierarchy.finer_group[clusters]
    is_coarse = finer_group >= 0
    starts = is_coarse & np.append(True, (np.diff(owner) != 0) | (np.diff(finer_group) != 0))
    run_owner, run_group = owner[starts], new_number[finer_group[starts]]
    run_of_cluster = np.cumsum(starts)[is_coarse] - 1
    groups = np.zeros(len(order), GROUP)
    groups["clusters"] = sizes
    groups["runs"] = np.bincount(run_owner, minlength=len(order))
    groups["firstRun"] = begins(groups["runs"])[:-1]
    page = np.repeat(np.arange(len(page_groups)), [len(p) for p in page_groups])
    groups["page"] = page
    first_group = np.searchsorted(page, np.arange(len(page_groups)))
    cluster_begin = begins(sizes)
    groups["firstCluster"] = cluster_begin[:-1] - cluster_begin[first_group][page]
    error = hierarchy.group_error[order]
    groups["error"] = _round_up(
        error * stream.step + np.where(error > 0, _position_rounding(plan), 0)
    )
    centre = np.array(stream.offset) + hierarchy.group_centre[order] * stream.step
    groups["centre"] = centre
    centre_error = np.linalg.norm(groups["centre"] - centre, axis=1)
    groups["radius"] = _round_up(hierarchy.group_radius[order] * stream.step + centre_error)
    _nest(groups, hierarchy.group_level[order], run_owner, run_group)
    pages = rows.copy()
    pages["firstGroup"] = first_group
    counts = np.bincount(run_of_cluster, minlength=len(run_group))
    return Tables(pages, groups, run_group, counts, coarse_pages)


def _round_up(values: np.ndarray) -> np.ndarray:
    """Round float64 values up to float32."""
    rounded = values.astype(np.float32)
    result: np.ndarray = np.where(
        rounded < values, np.nextafter(rounded, np.float32(np.inf)), rounded
    )
    return result


def _nest(
    groups: np.ndarray, level: np.ndarray, run_owner: np.ndarray, run_group: np.ndarray
) -> None:
    """Enlarge spheres until each encloses those of its runs, despite rounding."""
    for current_level in range(1, int(level.max()) + 1):
        runs = level[run_owner] == current_level
        owner, finer = run_owner[runs], run_group[runs]
        np.maximum.at(groups["radius"], owner, _round_up(reach(groups, owner, finer)))
