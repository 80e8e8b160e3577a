"""Ranges, numbers and triangles in arrays.

Ranges of an array are given by their begins: items begin[i] to begin[i + 1] belong to range i.
"""

from __future__ import annotations

import numpy as np


def begins(counts: np.ndarray) -> np.ndarray:
    """Return the begins of ranges of these sizes, and their sum: int64[N + 1]."""
    result = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=result[1:])
    return result


def numbers_of(first: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return int64: the numbers in [first[i], first[i] + counts[i]), range after range."""
    begin = begins(counts)
    numbers: np.ndarray = np.arange(begin[-1]) + np.repeat(first - begin[:-1], counts)
    return numbers


def members(begin: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Return int64: the numbers of the items of some ranges, range after range."""
    return numbers_of(begin[ranges], begin[ranges + 1] - begin[ranges])


def begins_of(pieces: list[np.ndarray]) -> np.ndarray:
    """Return the begins of pieces in their concatenation, and its length: int64[N + 1]."""
    return begins(np.array([len(piece) for piece in pieces]))


def occurring(numbers: np.ndarray, count: int) -> np.ndarray:
    """Return the different numbers, in [0, count), ascending: int64. Faster than np.unique."""
    occurs = np.zeros(count, bool)
    occurs[numbers.astype(np.intp, copy=False)] = True  # half the time of uint32 as an index
    return np.flatnonzero(occurs)


def renumbered(numbers: np.ndarray, old_numbers: np.ndarray, count: int) -> np.ndarray:
    """Return uint32: the index of each number in `old_numbers`; all are in [0, count)."""
    new_number = np.empty(count, np.uint32)
    new_number[old_numbers] = np.arange(len(old_numbers), dtype=np.uint32)
    result: np.ndarray = new_number[numbers]
    return result


def first_of_each(numbers: np.ndarray, count: int) -> np.ndarray:
    """Return uint32[count]: the index of the first occurrence of each number in [0, count).

    Each number occurs, as in the result of _codec.weld.
    """
    first = np.empty(count, np.uint32)
    first[numbers[::-1]] = np.arange(len(numbers) - 1, -1, -1, dtype=np.uint32)
    return first


def has_repeats(triangles: np.ndarray) -> np.ndarray:
    """Return bool[T]: whether two of the three values of a triangle, [T, 3], are equal."""
    a, b, c = triangles.T
    result: np.ndarray = (a == b) | (b == c) | (c == a)
    return result
