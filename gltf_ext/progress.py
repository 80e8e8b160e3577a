"""A progress bar for work longer than a second: drawn on a terminal, silent in a pipe."""

from __future__ import annotations

import sys
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
