"""Checks that every cut of a hierarchy covers level 0 once.

The rule: spec/EXT_meshlet_lod.md, section "Replacements". It is checked on the integers of all
pages.
"""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext.lod.reading import LodPrimitive
from gltf_ext.lod.tables import Tables


def check_coverage(primitive: LodPrimitive, strict: bool = False) -> None:
    """Raises MeshletError unless replacements have vertices of level 0 and the borders of their
    groups. Decodes all pages.

    strict: also where level 0 has surfaces that touch, for which the borders are a recommendation.
    """
    tables = primitive.tables
    triangles: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    first = [0]  # vertex of each page
    for page in range(len(tables.pages)):
        corners, values = _codec.decode(primitive.page(page))
        triangles.append(corners)
        rows.append(np.concatenate(values, axis=1))
        first.append(first[-1] + len(rows[-1]))
    vertices, coarse = np.concatenate(rows), first[tables.coarse_pages]
    numbers, _ = _codec.weld(vertices.view(np.uint8))
    if not np.isin(numbers[:coarse], numbers[coarse:]).all():
        raise primitive.malformed("a coarse page has a vertex that level 0 does not have")
    positions, count = _codec.weld(np.ascontiguousarray(vertices[:, :3]).view(np.uint8))
    begin = tables.cluster_begin[np.append(tables.pages["firstGroup"], len(tables.groups))]
    placed = [
        positions[first[page] : first[page + 1]].astype(np.int64)[corners]
        for page, corners in enumerate(triangles)
    ]
    borders = [
        _borders(
            corners,
            np.arange(begin[page], begin[page + 1]),
            primitive.cluster_triangles[begin[page] : begin[page + 1]],
            count,
        )
        for page, corners in enumerate(placed)
    ]
    joined = [np.concatenate(parts) for parts in zip(*borders)]
    kept = _replacements_keep_borders(tables, joined[0], joined[1], joined[2], count)
    if not kept and (strict or not _repeats_edges(placed[tables.coarse_pages :], count)):
        raise primitive.malformed("a replacement has another border than its group")


def _repeats_edges(pages: list[np.ndarray], count: int) -> bool:
    """Whether triangles int64[T, 3] pass an edge twice in one direction: surfaces touch there."""
    triangles = np.concatenate(pages)
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    edges = np.sort((start * count + end)[start != end])
    return bool((edges[1:] == edges[:-1]).any())


def _borders(
    triangles: np.ndarray, clusters: np.ndarray, cluster_triangles: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(cluster, undirected edge, how often it is passed toward its larger end) of the edges that do
    not cancel in their cluster.

    triangles: int64[T, 3], numbers below count, cluster after cluster.
    """
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    edge = np.minimum(start, end) * count + np.maximum(start, end)
    cluster = np.repeat(clusters, 3 * cluster_triangles)
    owner, edges, sums = _summed(cluster, edge, np.sign(end - start)[:, None])
    return owner, edges, sums[:, 0]


def _summed(
    owner: np.ndarray, edge: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sums values int64[N, K] of equal pairs (owner, edge). Drops pairs whose first sum is 0."""
    order = np.lexsort((edge, owner))
    owner, edge, values = owner[order], edge[order], values[order]
    is_new = (np.diff(owner, prepend=-1) != 0) | (np.diff(edge, prepend=-1) != 0)
    starts = np.flatnonzero(is_new)
    sums = np.add.reduceat(values, starts, axis=0) if len(starts) else values
    kept = sums[:, 0] != 0
    return owner[starts][kept], edge[starts][kept], sums[kept]


def _replacements_keep_borders(
    tables: Tables, cluster: np.ndarray, edge: np.ndarray, sign: np.ndarray, count: int
) -> bool:
    """Whether borders of groups and of their replacements differ along the outer border only.

    Edges that replacements add there are outer edges for coarser groups.
    """
    group, refined = tables.cluster_group[cluster], tables.cluster_refined[cluster]
    is_replaced = np.isfinite(tables.groups["error"])[group]
    owner, border, signs = _summed(group[is_replaced], edge[is_replaced], sign[is_replaced, None])
    is_made = refined >= 0
    # Second column: whether the edge is on the border of the group.
    group_of, changed, sums = _summed(
        np.concatenate([refined[is_made], owner]),
        np.concatenate([edge[is_made], border]),
        np.concatenate(
            [
                np.stack([sign[is_made], np.zeros(np.count_nonzero(is_made), np.int64)], axis=1),
                np.concatenate([-signs, np.ones_like(signs)], axis=1),
            ]
        ),
    )
    leaves, level = sums[:, 1] > 0, tables.group_level[group_of]
    fine = edge[~is_made]
    _, outer, _ = _summed(np.zeros_like(fine), fine, sign[~is_made, None])
    for here in range(tables.level_count):
        ends = np.union1d(outer // count, outer % count)
        joins = changed[(level == here) & ~leaves]
        if not np.isin(changed[(level == here) & leaves], outer).all():
            return False
        if not np.isin(np.concatenate([joins // count, joins % count]), ends).all():
            return False
        outer = np.union1d(outer, joins)
    return True
