"""A progress bar for work longer than a second: drawn on a terminal, silent in a pipe."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from gltf_ext.errors import printable

BAR_DELAY = 1.0  # seconds before the bar appears

Advance = Callable[[float], None]  # takes the share of the work done so far, 0 to 1


@contextmanager
def progress_bar(title: str, enabled: bool | Advance) -> Iterator[Advance | None]:
    """Yield the function that moves the bar, or None when there is no bar.

    enabled: whether to draw one; or a function to call instead.
    """
    if not isinstance(enabled, bool):
        yield enabled
        return
    if not enabled or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(
        total=1.0,
        desc=printable(title),
        delay=BAR_DELAY,
        leave=False,
        bar_format="{desc} {percentage:3.0f}%|{bar}| {remaining} left",
    ) as bar:

        def advance(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield advance


def shared_progress(advance: Advance | None, shares: list[float]) -> list[Advance | None]:
    """Return a progress function for each of several jobs that run at once.

    shares: the part of the whole progress that each job has, with sum 1.
    """
    if advance is None:
        return [None] * len(shares)
    advance_all, lock = advance, threading.Lock()
    fractions = [0.0] * len(shares)

    def move(i: int, fraction: float) -> None:
        with lock:
            fractions[i] = fraction
            advance_all(sum(d * share for d, share in zip(fractions, shares)))

    return [partial(move, i) for i in range(len(shares))]
