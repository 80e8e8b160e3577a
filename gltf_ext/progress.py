"""A progress bar for work longer than a second: drawn on a terminal, silent in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

BAR_DELAY = 1.0  # seconds before the bar appears


@contextmanager
def progress_bar(title: str, enabled: bool) -> Iterator[Callable[[float], None] | None]:
    """Yields a function that takes the share of the work done so far (0 to 1), or None when no bar is wanted."""
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
        yield lambda fraction: bar.update(fraction - bar.n)
