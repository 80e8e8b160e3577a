"""Loaded by the workers of this machine's own cluster: Ctrl-C ends the driver, which ends them."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Ignore what a terminal sends to all of its programs. Dask calls this in each worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
