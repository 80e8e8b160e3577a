"""Lists of ranges: items begin[i] .. begin[i + 1] of an array belong to i."""

from __future__ import annotations

import numpy as np


def begins(counts: np.ndarray) -> np.ndarray:
    """int64[N + 1]: the begins of ranges of these sizes; the last is the sum."""
    result = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=result[1:])
    return result


def members(begin: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """int64: the numbers of all items of the chosen ranges, one range after the other."""
    first, counts = begin[chosen], begin[chosen + 1] - begin[chosen]
    new = begins(counts)
    numbers: np.ndarray = np.arange(new[-1]) + np.repeat(first - new[:-1], counts)
    return numbers


def begins_of(pieces: list[np.ndarray]) -> np.ndarray:
    """int64[N + 1]: the first element of each piece in their concatenation, and the end."""
    return begins(np.array([len(piece) for piece in pieces]))
