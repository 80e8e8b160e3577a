"""Programs that tests start. None of them outlives its test."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

ENDS = 60.0  # seconds for a program to end by itself


@contextmanager
def running(
    command: Sequence[Any], *, ends: float = ENDS, **options: Any
) -> Iterator[subprocess.Popen]:
    """A program for the duration of the block. options: of subprocess.Popen.

    After the block its input ends, and it has to end too; otherwise it is killed, and the test
    fails with subprocess.TimeoutExpired. It is killed at once when the block raises.
    """
    words = list(map(str, command))
    with subprocess.Popen(words, preexec_fn=answer_interrupts, **options) as process:
        try:
            yield process
            if process.stdin:
                process.stdin.close()
            process.wait(ends)
        finally:
            process.kill()


def answer_interrupts() -> None:
    """Lets Ctrl-C end the program. A shell starts commands in the background with SIGINT ignored,
    children inherit that, and Python then never raises KeyboardInterrupt."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
