"""Packs groups into pages: blobs of at most so many bytes that each hold whole groups."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Pages = list[np.ndarray]  # numbers of the groups in each page
Encode = Callable[[Pages], list[bytes]]  # a blob of each page

# Estimated size of a page, as a share of the limit. On scans, sizes are within 3 % of the estimate,
# and the last groups of a page that is too large move to another.
AIM = 0.985
# A page takes its groups from so many: more fill it better, fewer keep neighbours together.
WINDOW = 32
# Bytes per triangle are measured on runs of so many groups: all of few groups, a part of many.
PILOT_GROUPS, FEW_PILOTS, MOST_PILOTS = 2, 8, 16


def pack(
    levels: Sequence[np.ndarray], triangles: np.ndarray, limit: int, encode: Encode
) -> tuple[Pages, list[bytes]]:
    """Pages of whole groups, and their blobs. A group that is larger than a page is alone in one.

    levels: groups of each level, in the order in which pages take them; triangles: int64[G], of
    each group. A page may end one level and begin the next.
    """
    pages: Pages = []
    blobs: list[bytes] = []
    waiting = np.empty(0, np.int64)
    for number, level in enumerate(levels):
        waiting = np.concatenate([waiting, level])
        is_last = number == len(levels) - 1
        while len(waiting):
            planned = _plan(waiting, triangles, limit, encode)
            # A page that is not full waits for groups of the next level.
            rest = [] if is_last else [planned.pop()]
            if planned:
                new, left = _encode_fitting(planned, limit, encode)
                pages += [page for page, _ in new]
                blobs += [blob for _, blob in new]
                rest = [*left, *rest]
            waiting = np.concatenate([*rest, np.empty(0, np.int64)])
            if not is_last:
                break
    return pages, blobs


def _plan(groups: np.ndarray, triangles: np.ndarray, limit: int, encode: Encode) -> Pages:
    """Shares the list out to pages by estimated size. A page takes the first group that is left,
    then each of the next ones that still fits."""
    sizes = triangles[groups] * _rates(groups, triangles, encode)
    left = list(range(len(groups)))
    pages = []
    while left:
        page, filled = [left[0]], sizes[left[0]]
        for i in left[1:WINDOW]:
            if filled + sizes[i] <= AIM * limit:
                page.append(i)
                filled += sizes[i]
        pages.append(groups[page])
        taken = set(page)
        left = [i for i in left[:WINDOW] if i not in taken] + left[WINDOW:]
    return pages


def _rates(groups: np.ndarray, triangles: np.ndarray, encode: Encode) -> np.ndarray:
    """float64: estimated bytes per triangle of each group, from some that are encoded."""
    count = min(-(-len(groups) // PILOT_GROUPS), FEW_PILOTS)
    count = min(max(count, len(groups) // (4 * PILOT_GROUPS)), MOST_PILOTS)
    starts = np.arange(count + 1) * len(groups) // count
    sizes = np.minimum(np.diff(starts), PILOT_GROUPS)
    pilots = [groups[start : start + size] for start, size in zip(starts, sizes)]
    rates = [len(b) / triangles[p].sum() for b, p in zip(encode(pilots), pilots)]
    result: np.ndarray = np.interp(np.arange(len(groups)), starts[:-1] + (sizes - 1) / 2, rates)
    return result


def _encode_fitting(
    pages: Pages, limit: int, encode: Encode
) -> tuple[list[tuple[np.ndarray, bytes]], Pages]:
    """([(page, blob)], groups left over): drops the last groups of pages that are too large."""
    blobs = encode(pages)
    left: Pages = []
    while True:
        large = [i for i, b in enumerate(blobs) if len(b) > limit and len(pages[i]) > 1]
        if not large:
            return list(zip(pages, blobs)), left
        for i in large:
            keep = min(int(len(pages[i]) * limit / len(blobs[i])), len(pages[i]) - 1)
            left.append(pages[i][max(keep, 1) :])
            pages[i] = pages[i][: max(keep, 1)]
        for i, blob in zip(large, encode([pages[i] for i in large])):
            blobs[i] = blob
