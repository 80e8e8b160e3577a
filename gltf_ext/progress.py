"""A progress bar for work longer than a second: drawn on a terminal, silent in a pipe."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

BAR_DELAY = 1.0  # seconds before the bar appears

Advance = Callable[[float], None]  # takes the share of the work done so far, 0 to 1


@contextmanager
def progress_bar(title: str, enabled: bool) -> Iterator[Advance | None]:
    """Yields the function that moves the bar, or None when there is no bar."""
    if not enabled or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(
        total=1.0,
        desc=title,
        delay=BAR_DELAY,
        leave=False,
        bar_format="{desc} {percentage:3.0f}%|{bar}|",
    ) as bar:

        def advance(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield advance


class SharedProgress:
    """Progress of parts that are worked on at the same time. shares: of the whole, summing to 1."""

    def __init__(self, advance: Advance, shares: list[float]) -> None:
        self._advance = advance
        self._shares = shares
        self._done = [0.0] * len(shares)
        self._lock = threading.Lock()

    def part(self, i: int) -> Advance:
        """The function that tells the progress of part i."""

        def advance(fraction: float) -> None:
            with self._lock:
                self._done[i] = fraction
                self._advance(sum(d * share for d, share in zip(self._done, self._shares)))

        return advance
