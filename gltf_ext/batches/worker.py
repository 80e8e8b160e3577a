"""What a worker of Dask does: some jobs, one after the other, each within a time limit."""

from __future__ import annotations

import tempfile
import threading
import time
from pathlib import Path

from gltf_ext.batches import task
from gltf_ext.batches.task import Job, Record

LONGEST = 10  # seconds after which no further job of a task begins


def work(jobs: list[Job], seconds: float) -> list[Record]:
    """Return the records of the first jobs, of at least one.

    seconds: limit of a job. An error that may pass gives a record with `raised`, a reached limit
    one with `limit`; nothing follows them.
    """
    from distributed import get_worker

    with tempfile.TemporaryDirectory(
        dir=get_worker().local_directory, prefix="gltf-meshlet-", ignore_cleanup_errors=True
    ) as folder:
        run = _Run(jobs, Path(folder))
        run.start()
        while not run.has_ended.wait(max(run.start_of_job + seconds - time.monotonic(), 0.0)):
            records = list(run.records)
            if time.monotonic() < run.start_of_job + seconds or len(records) == len(jobs):
                continue  # the next job has begun meanwhile, or the last one has just ended
            run.is_late = True
            problem = f"took longer than its time limit of {seconds:g} seconds"
            failure = jobs[len(records)].failure(problem, seconds)
            return [*records, {**failure, "limit": seconds}]
    return run.records


class _Run(threading.Thread):
    """Does jobs, and is left alone when one of them takes too long.

    One thread for all: one for each would take a twentieth of a small model's time.

    Attributes:
        records: of the jobs that have ended; start_of_job: of the next one, time.monotonic().
        has_ended: whether no further record comes; is_late: whether nobody waits for one any more.
    """

    def __init__(self, jobs: list[Job], folder: Path) -> None:
        super().__init__(daemon=True)
        self._jobs, self._folder = jobs, folder
        self.records: list[Record] = []
        self.start_of_job = time.monotonic()
        self.has_ended, self.is_late = threading.Event(), False

    def run(self) -> None:
        end = time.monotonic() + LONGEST
        for job in self._jobs:
            record = _record(job, self._folder)
            if self.is_late:
                return
            self.start_of_job = time.monotonic()  # before the record is there: see `work`
            self.records.append(record)
            if self.start_of_job > end or "raised" in record:
                break
        self.has_ended.set()


def _record(job: Job, folder: Path) -> Record:
    try:
        return task.run(job, folder)
    except BaseException as error:
        return {"name": job.name, "raised": _reason(error)}


def _reason(error: BaseException) -> str:
    """Of a task that raised what it does not expect."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or ''}: {error.strerror}; check the path and its permissions"
    return f"{type(error).__name__}: {error}"
