"""Checks that every cut of a hierarchy covers level 0 once.

The rule: spec/EXT_meshlet_lod.md, section "Replacements". It is checked on the integers of all
pages.
"""

from __future__ import annotations

import numpy as np

from gltf_ext import _codec
from gltf_ext.lod.reading import LodPrimitive
from gltf_ext.lod.tables import Tables
from gltf_ext.progress import Advance
from gltf_ext.ranges import first_of_each
from gltf_ext.work_files import Buckets, hashes

TRIANGLE_BYTES = 16  # of vertices, and of borders, in buckets
CORNERS = np.dtype(("<u4", (2, 3)))
BORDER = np.dtype([("ends", CORNERS), ("cluster", "<u4"), ("sign", "i1")])
EDGE = np.dtype([("ends", CORNERS)])


def check_coverage(
    primitive: LodPrimitive, strict: bool = False, advance: Advance | None = None
) -> None:
    """Check that replacements use vertices of level 0 and keep the borders of their groups.

    Decodes all pages, one at a time.

    Args:
        primitive: with levels.
        strict: require equal borders also where level 0 has surfaces that touch; the specification
            only recommends them there.
        advance: moves the progress bar.

    Raises:
        MeshletError: the check fails, or a page is malformed.
    """
    tables = primitive.tables
    size = TRIANGLE_BYTES * int(tables.pages["triangles"].sum(dtype=np.int64))
    streams = sum(elements for _, elements, _ in primitive.streams[0])
    vertices = Buckets(np.dtype([("row", "<u4", streams), ("is_fine", "?")]), size)
    borders = Buckets(BORDER, size)
    for page in range(len(tables.pages)):
        triangles, values = primitive.decoded(page)
        rows = np.empty(len(values[0]), vertices.dtype)
        rows["row"], rows["is_fine"] = np.concatenate(values, 1), page >= tables.coarse_pages
        vertices.add(rows, hashes(rows["row"]))
        page_borders = _borders(primitive, page, triangles, values[0])
        borders.add(page_borders, hashes(page_borders["ends"].reshape(-1, 6)))
        if advance:
            advance((page + 1) / len(tables.pages))
    for part in vertices.parts():
        numbers, _ = _codec.weld(np.ascontiguousarray(part["row"]).view(np.uint8))
        if not np.isin(numbers[~part["is_fine"]], numbers[part["is_fine"]]).all():
            raise primitive.malformed("a coarse page has a vertex that level 0 does not have")
    keeps_borders = _replacements_keep_borders(tables, borders)
    if not keeps_borders and (strict or not _repeats_edges(primitive)):
        raise primitive.malformed("a replacement has another border than its group")


def _repeats_edges(primitive: LodPrimitive) -> bool:
    """Return whether two triangles of level 0 use an edge in one direction: surfaces touch."""
    tables = primitive.tables
    pages = range(tables.coarse_pages, len(tables.pages))
    count = int(tables.pages["triangles"][tables.coarse_pages :].sum(dtype=np.int64))
    edges = Buckets(EDGE, 3 * EDGE.itemsize * count)
    for page in pages:
        triangles, values = primitive.decoded(page)
        ends = _ends(values[0][triangles])
        page_edges = np.empty(len(ends), EDGE)
        page_edges["ends"] = ends
        edges.add(page_edges, hashes(ends.reshape(-1, 6)))
    return any(
        _codec.weld(part["ends"].reshape(-1, 6).view(np.uint8))[1] < len(part)
        for part in edges.parts()
    )


def _ends(corners: np.ndarray) -> np.ndarray:
    """Return uint32[N, 2, 3]: the ends of the edges, with length, of triangles uint32[T, 3, 3]."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    with_length: np.ndarray = ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]
    return with_length


def _borders(
    primitive: LodPrimitive, page: int, triangles: np.ndarray, cells: np.ndarray
) -> np.ndarray:
    """Return BORDER[N]: the undirected edges that do not cancel within their cluster.

    Args:
        primitive: with levels.
        page: number of a page.
        triangles: uint32[T, 3], cluster after cluster.
        cells: uint32[V, 3]: positions on the grid.
    """
    ids, count = _codec.weld(np.ascontiguousarray(cells).view(np.uint8))
    corners = ids.astype(np.int64)[triangles]
    start, end = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    edge = np.minimum(start, end) * count + np.maximum(start, end)
    begin = primitive.tables.cluster_begin
    first, last = (int(begin[group]) for group in primitive.groups_of(page))
    cluster = np.repeat(np.arange(first, last), 3 * primitive.cluster_triangles[first:last])
    owner, edges, sums = _sum_edges(cluster, edge, np.sign(end - start)[:, None])
    at = cells[first_of_each(ids, count)]
    low, high = at[edges // count], at[edges % count]
    is_turned = _is_less(high, low)
    result = np.empty(len(owner), BORDER)
    result["ends"][:, 0] = np.where(is_turned[:, None], high, low)
    result["ends"][:, 1] = np.where(is_turned[:, None], low, high)
    result["cluster"], result["sign"] = owner, np.where(is_turned, -1, 1) * sums[:, 0]
    return result


def _is_less(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return bool[N]: whether points uint32[N, 3] come before others, by x, then y, then z."""
    result: np.ndarray = a[:, 2] < b[:, 2]
    for axis in (1, 0):
        result = (a[:, axis] < b[:, axis]) | ((a[:, axis] == b[:, axis]) & result)
    return result


def _sum_edges(
    owner: np.ndarray, edge: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sum values int64[N, K] of equal pairs (owner, edge). Drops pairs whose first sum is 0."""
    order = np.lexsort((edge, owner))
    owner, edge, values = owner[order], edge[order], values[order]
    is_new = (np.diff(owner, prepend=-1) != 0) | (np.diff(edge, prepend=-1) != 0)
    starts = np.flatnonzero(is_new)
    sums = np.add.reduceat(values, starts, axis=0) if len(starts) else values
    is_nonzero = sums[:, 0] != 0
    return owner[starts][is_nonzero], edge[starts][is_nonzero], sums[is_nonzero]


def _replacements_keep_borders(tables: Tables, borders: Buckets) -> bool:
    """Return whether replacements keep the borders of their groups, but for the outer border.

    Edges that replacements add there are outer edges for coarser groups.
    """
    changes = [_changes(tables, part) for part in borders.parts()]
    group, leaves, changed_ends, outer = (np.concatenate(arrays) for arrays in zip(*changes))
    all_ends = np.concatenate([changed_ends, outer])
    if not len(changed_ends):
        return True
    edges, _ = _codec.weld(all_ends.view(np.uint8).reshape(len(all_ends), -1))
    points, _ = _codec.weld(all_ends.reshape(-1, 3).view(np.uint8))
    ends = points.reshape(-1, 2)
    outer_edges, outer_ends = (
        np.unique(edges[len(changed_ends) :]),
        np.unique(ends[len(changed_ends) :]),
    )
    edges, ends = edges[: len(changed_ends)], ends[: len(changed_ends)]
    level = tables.group_level[group]
    for current_level in range(tables.level_count):
        joins = (level == current_level) & ~leaves
        if not np.isin(edges[(level == current_level) & leaves], outer_edges).all():
            return False
        if not np.isin(ends[joins], outer_ends).all():
            return False
        outer_edges = np.union1d(outer_edges, edges[joins])
        outer_ends = np.union1d(outer_ends, ends[joins])
    return True


def _changes(
    tables: Tables, borders: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Compare the borders of groups with those of their replacements.

    Args:
        tables: the hierarchy.
        borders: BORDER[N], with all edges that are equal to one of them.

    Returns:
        int64[K], bool[K], CORNERS[K]: the group, whether the group alone has the edge, its ends,
        for each edge on one of the borders only; CORNERS[M]: the outer edges of level 0.
    """
    edge, count = _codec.weld(np.ascontiguousarray(borders["ends"]).reshape(-1, 6).view(np.uint8))
    ends = borders["ends"][first_of_each(edge, count)]
    edge, sign = edge.astype(np.int64), borders["sign"].astype(np.int64)
    group, finer_group = (
        values[borders["cluster"]] for values in (tables.cluster_group, tables.finer_group)
    )
    is_replaced = np.isfinite(tables.groups["error"])[group]
    owner, border, signs = _sum_edges(
        group[is_replaced], edge[is_replaced], sign[is_replaced, None]
    )
    is_replacement = finer_group >= 0
    # Second column: whether the edge is on the border of the group.
    group_of, changed_edges, sums = _sum_edges(
        np.concatenate([finer_group[is_replacement], owner]),
        np.concatenate([edge[is_replacement], border]),
        np.concatenate(
            [
                np.stack(
                    [sign[is_replacement], np.zeros(np.count_nonzero(is_replacement), np.int64)],
                    axis=1,
                ),
                np.concatenate([-signs, np.ones_like(signs)], axis=1),
            ]
        ),
    )
    fine = edge[~is_replacement]
    _, outer_edges, _ = _sum_edges(np.zeros_like(fine), fine, sign[~is_replacement, None])
    return group_of, sums[:, 1] > 0, ends[changed_edges], ends[outer_edges]
