"""Lists of ranges: items begin[i] .. begin[i + 1] of an array belong to i. Numbered items."""

from __future__ import annotations

import numpy as np


def begins(counts: np.ndarray) -> np.ndarray:
    """int64[N + 1]: the begins of ranges of these sizes; the last is the sum."""
    result = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=result[1:])
    return result


def numbers_of(first: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """int64: the numbers in [first[i], first[i] + counts[i]) of each i, one range after another."""
    begin = begins(counts)
    numbers: np.ndarray = np.arange(begin[-1]) + np.repeat(first - begin[:-1], counts)
    return numbers


def members(begin: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """int64: the numbers of all items of the chosen ranges, one range after the other."""
    return numbers_of(begin[chosen], begin[chosen + 1] - begin[chosen])


def begins_of(pieces: list[np.ndarray]) -> np.ndarray:
    """int64[N + 1]: the first element of each piece in their concatenation, and the end."""
    return begins(np.array([len(piece) for piece in pieces]))


def occurring(numbers: np.ndarray, count: int) -> np.ndarray:
    """int64: the different numbers, in [0, count), in order. Faster than np.unique."""
    found = np.zeros(count, bool)
    found[numbers.astype(np.intp, copy=False)] = True  # half the time of uint32 as an index
    return np.flatnonzero(found)


def renumbered(numbers: np.ndarray, chosen: np.ndarray, count: int) -> np.ndarray:
    """uint32: the place in `chosen` of each number; both in [0, count)."""
    place = np.empty(count, np.uint32)
    place[chosen] = np.arange(len(chosen), dtype=np.uint32)
    result: np.ndarray = place[numbers]
    return result


def first_of_each(numbers: np.ndarray, count: int) -> np.ndarray:
    """uint32[count]: the first place of each number in [0, count), as _codec.weld gives them."""
    first = np.empty(count, np.uint32)
    first[numbers[::-1]] = np.arange(len(numbers) - 1, -1, -1, dtype=np.uint32)
    return first
