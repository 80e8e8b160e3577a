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
# A page of a coarse level that is emptier than this waits for groups of the next level. Full pages
# make 2 % smaller files, but a cut loads up to a fifth more bytes (igea).
LEAST_SHARE = 0.25
# Groups in a part in which errors decide the order. Dragon with four times its triangles and noise,
# pages for one pixel of error: 1.28 MB with 24 groups, 1.20 with 48, 1.16 with 96. For four pixels
# at the nearest point, mean of 20 cameras: 1.57, 1.60, 1.70 MB.
PART_GROUPS = 48
# Bytes per triangle are measured on runs of so many groups: all of few groups, a part of many.
PILOT_GROUPS, FEW_PILOTS, MOST_PILOTS = 2, 8, 16


def by_error(groups: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Groups of one level along a curve, in parts of PART_GROUPS neighbours; in each part from the
    largest error to the smallest. A cut takes groups above an error: pages that it takes wholly.

    error: of all groups.
    """
    count = -(-len(groups) // PART_GROUPS)
    part = np.arange(len(groups)) * count // max(len(groups), 1)
    ordered: np.ndarray = groups[np.lexsort((-error[groups], part))]
    return ordered


def pack(
    levels: Sequence[np.ndarray], triangles: np.ndarray, limit: int, encode: Encode
) -> tuple[Pages, list[bytes]]:
    """Pages of whole groups, and their blobs. A group that is larger than a page is alone in one.

    levels: groups of each level, in the order in which pages take them; triangles: int64[G], of
    each group. A page may end one level and begin the next, but no group comes before one of a
    level that is earlier in `levels`.
    """
    pages: Pages = []
    blobs: list[bytes] = []
    waiting = np.empty(0, np.int64)
    sizes = np.zeros(len(triangles))
    for number, level in enumerate(levels):
        earlier = waiting
        waiting = np.concatenate([waiting, level])
        sizes[waiting] = triangles[waiting] * _rates(waiting, triangles, encode)
        is_last = number == len(levels) - 1
        while True:
            left_earlier = int(np.isin(waiting, earlier).sum())
            planned = _plan(waiting, sizes, left_earlier, limit)
            # A small page waits for groups of the next level.
            is_small = not is_last and planned and sizes[planned[-1]].sum() < LEAST_SHARE * limit
            rest = planned[-1:] if is_small else []
            planned = planned[: len(planned) - len(rest)]
            if not planned:
                break
            # What does not fit moves to a later page: none of an earlier level behind others.
            now, later = (planned[:1], planned[1:]) if left_earlier else (planned, [])
            new, left = _encode_fitting(now, limit, encode)
            pages += [page for page, _ in new]
            blobs += [blob for _, blob in new]
            waiting = np.concatenate([*left, *later, *rest, np.empty(0, np.int64)])
            if not (is_last or left_earlier):
                break
    return pages, blobs


def _plan(groups: np.ndarray, all_sizes: np.ndarray, earlier: int, limit: int) -> Pages:
    """Shares the list out to pages by estimated size. A page takes the first group that is left,
    then each of the next ones that still fits; the first `earlier` groups in their order."""
    sizes = all_sizes[groups]
    left = list(range(len(groups)))
    pages = []
    while left:
        page, filled = [left[0]], sizes[left[0]]
        for i in left[1:WINDOW]:
            if filled + sizes[i] <= AIM * limit:
                page.append(i)
                filled += sizes[i]
            elif i < earlier:
                break
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
