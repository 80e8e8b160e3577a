"""How far a batch is, for people and programs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from gltf_ext.batches.task import FAILED, UNCHANGED, Record
from gltf_ext.progress import Advance, progress_bar

INTERVAL = 10  # seconds between two lines where there is no terminal

Listener = Callable[[dict[str, Any]], None]  # takes an event


class Progress:
    """Counts the files of a batch as they end.

    Attributes:
        total: files of the batch; ended: those that need no more work; failed: of those.
    """

    def __init__(
        self, records: dict[str, Record], total: int, listener: Listener | None, advance: Any
    ) -> None:
        """Take the records that are known, what is called with each event, and what moves a bar."""
        self.total, self.ended = total, len(records)
        self.failed = sum(record["status"] == FAILED for record in records.values())
        self._listener, self._advance = listener, advance
        unchanged = sum(record["status"] == UNCHANGED for record in records.values())
        self.tell("start", files=total, unchanged=unchanged, failed=self.failed)

    def tell(self, event: str, **values: Any) -> None:
        """Give an event to the listener."""
        if self._listener is not None:
            self._listener({"event": event, **values})

    def note(self, record: Record) -> None:
        """Count a file that has ended."""
        self.ended += 1
        self.failed += record["status"] == FAILED
        keys = ("name", "status", "error", "seconds", "input_bytes", "output_bytes")
        values = {key: record[key] for key in keys if key in record}
        self.tell("file", **values, ended=self.ended, files=self.total)
        self.move()

    def move(self) -> None:
        """Move the bar, or print a line if it is time."""
        if self._advance is not None:
            self._advance(self)


@contextmanager
def display(enabled: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Yield what shows the progress: a bar on a terminal, elsewhere a line every ten seconds."""
    if not enabled:
        yield None
    elif sys.stderr is not None and sys.stderr.isatty():
        with progress_bar("batch", True) as advance:
            yield lambda progress: _move(advance, progress)
    else:
        yield _Lines()


def _move(advance: Advance | None, progress: Progress) -> None:
    if advance is not None:
        advance(progress.ended / progress.total)


class _Lines:
    """Prints a line to standard error from time to time."""

    def __init__(self) -> None:
        self._start = self._last = time.monotonic()
        self._first: int | None = None  # files that had ended at the start

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        if self._first is None:
            self._first = progress.ended
        if now - self._last < INTERVAL:
            return
        self._last = now
        failed = f", {progress.failed:,} failed" if progress.failed else ""
        count = progress.ended - self._first
        rest = ""
        if count:
            seconds = (progress.total - progress.ended) * (now - self._start) / count
            rest = f", about {seconds:.0f} s left"
        print(
            f"batch: {progress.ended:,} of {progress.total:,} files{failed}{rest}",
            file=sys.stderr,
            flush=True,
        )
