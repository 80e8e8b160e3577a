"""What a worker of Dask does: some jobs, one after the other, each within a time limit."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from gltf_ext.batches import task
from gltf_ext.batches.task import Job, Record
from gltf_ext.scheduler import within

LONGEST = 10  # seconds after which no further job of a task begins


def work(jobs: list[Job], seconds: float) -> list[Record]:
    """Return the records of the first jobs, of at least one.

    seconds: limit of a job. An error that may pass gives a record with `raised`, a reached limit
    one with `limit`; nothing follows them.
    """
    from distributed import get_worker

    worker = get_worker()
    records: list[Record] = []
    end = time.monotonic() + LONGEST
    with tempfile.TemporaryDirectory(
        dir=worker.local_directory, prefix="gltf-meshlet-", ignore_cleanup_errors=True
    ) as folder:
        for job in jobs:
            records.append(_record(job, Path(folder), seconds))
            if time.monotonic() > end or {"limit", "raised"} & set(records[-1]):
                break
    return records


def _record(job: Job, folder: Path, seconds: float) -> Record:
    start = time.monotonic()
    try:
        record: Record = within(seconds, task.run, job, folder)
    except TimeoutError as error:
        if time.monotonic() - start < seconds:  # of a network
            return {"name": job.name, "raised": _reason(error)}
        problem = f"took longer than its time limit of {seconds:g} seconds"
        return {**job.failure(problem, seconds), "limit": seconds}
    except Exception as error:
        return {"name": job.name, "raised": _reason(error)}
    return record


def _reason(error: BaseException) -> str:
    """Of a task that raised what it does not expect."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or ''}: {error.strerror}; check the path and its permissions"
    return f"{type(error).__name__}: {error}"
