"""batch: compresses many models, a task a file, on a cluster of Dask distributed."""

from __future__ import annotations

import contextlib
import json
import numbers
import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gltf_ext.batches import task
from gltf_ext.batches.finding import Model
from gltf_ext.batches.memory import estimate
from gltf_ext.batches.page import page
from gltf_ext.batches.planning import PAGE, REPORT, Plan
from gltf_ext.batches.storage import Folder
from gltf_ext.batches.task import DONE, FAILED, UNCHANGED, Job, Record
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.progress import Advance, progress_bar
from gltf_ext.scheduler import MEMORY, Workers, connected, require_dask, silence

if TYPE_CHECKING:
    from distributed import Client, Future

PathText = str | os.PathLike[str]
RETRIES = 2  # of a task that raises, such as for a network that fails
RUN_AGAIN = "run again: what is done is kept"


def batch(
    source: PathText | Sequence[PathText],
    destination: PathText,
    *,
    scheduler: str | Client | None = None,
    workers: int | None = None,
    progress: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Compress and verify many models, a task a file, on Dask distributed.

    A second call does only what failed, changed or is new: each output has a record of all files
    that it was made from, its options, version and digest in the folder .gltf-meshlet of the
    destination. Outputs appear whole or not at all. A file that fails or kills its worker is
    reported and stops no other. No file is overwritten that no batch wrote into the destination,
    nor one that was changed since.

    Args:
        source: a folder with all folders below it, a glob, a file, a .txt with a path or URL in
            each line, or a list of paths or URLs; on a disk or wherever fsspec reads.
        destination: a folder, likewise. Outputs are named as their models, with the suffix .glb.
        scheduler: address of a running scheduler, or a distributed.Client; by default a cluster of
            processes on this machine.
        workers: processes of that cluster; by default one per processor.
        progress: draw a progress bar on a terminal.
        options: of compress. A task takes one thread unless `threads` says more.

    Returns a report, which is also written to batch.json and, as a page, to batch.html:
        source, destination, version, options, seconds.
        totals: counts of done, unchanged and failed files, and of what was left_out; input_bytes,
            output_bytes, triangles.
        files: one for each model, failed ones first: name, output, status ("done", "unchanged",
            "failed"); error if it failed, else source (path or URL of the model), input_digest,
            output_digest (SHA-256), input_bytes, output_bytes, triangles, ratio (of raw floats to
            compressed geometry), max_error_percent (of positions, of the box's diagonal), warnings,
            thumbnail (PNG in base64), seconds; inputs: path from the model's folder -> stamp, of
            all files that were read or not there; outputs: name -> stamp and digest, of all files
            that were written; former: name -> digests, of files that batches with other options
            wrote.
        left_out: path and reason, of what may hold models but was not looked at: a folder that
            cannot be read, a link to a folder, a model in the destination that no batch wrote, a
            line of a list that names no model, or one with the name of another.
        skipped: names of models in the destination that batches wrote there.
        leftover: names of outputs of models that this run does not have.

    Raises MeshletError when nothing can be started or the scheduler is lost, OSError when the
    source or the destination cannot be read or written.
    """
    Options.of({"progress": progress})
    options = Options.json_values(options)
    _check_cluster(scheduler, workers)
    start = time.perf_counter()
    if isinstance(source, str | os.PathLike):
        paths: str | list[str] = os.fspath(source)
    else:
        paths = [os.fspath(entry) for entry in source]
    goal = Folder(os.fspath(destination))
    plan = Plan(paths, goal, options)
    open_jobs = [job for job in plan.jobs if job.name not in plan.records]
    open_jobs.sort(key=lambda job: -plan.models[job.name].size)
    if open_jobs:
        finished_count, total = len(plan.records), len(plan.jobs)
        with progress_bar("batch", progress) as advance, _client(scheduler, workers) as client:
            run = _Run(client, plan.models, advance, finished_count, total)
            run.run_all(open_jobs)
            plan.records.update(run.records)
    files = [plan.records[job.name] for job in plan.jobs]
    plan.outputs.settle(plan.allowed_outputs)
    report = _report(str(paths), os.fspath(destination), options, files)
    report |= plan.remarks
    report["totals"]["left_out"] = len(report["left_out"])
    report["seconds"] = time.perf_counter() - start
    goal.write(REPORT, json.dumps(report, indent=1).encode())
    goal.write(PAGE, page(report).encode())
    return report


def _check_cluster(scheduler: Any, workers: Any) -> None:
    """Raise MeshletError for a value that these options of batch cannot have."""
    if not (scheduler is None or isinstance(scheduler, str)):
        require_dask()
        from distributed import Client

        if not isinstance(scheduler, Client):
            raise MeshletError(
                f"scheduler is {scheduler!r}",
                "use an address such as tcp://192.0.2.1:8786, or a distributed.Client",
                options=("scheduler",),
            )
    count = isinstance(workers, numbers.Integral) and not isinstance(workers, bool)
    if workers is not None and not (count and workers >= 1):
        raise MeshletError(f"workers is {workers!r}", "use 1 or more", options=("workers",))


def _report(
    source: str, destination: str, options: dict[str, Any], files: list[Record]
) -> dict[str, Any]:
    order = (FAILED, DONE, UNCHANGED)
    good = [file for file in files if file["status"] != FAILED]
    return {
        "source": source,
        "destination": destination,
        "version": task.VERSION,
        "options": options,
        "totals": {
            **{status: sum(file["status"] == status for file in files) for status in order},
            **{
                key: sum(file[key] for file in good)
                for key in ("input_bytes", "output_bytes", "triangles")
            },
        },
        "files": sorted(files, key=lambda file: (file["status"] != FAILED, file["name"])),
    }


# --- the cluster ---


@contextlib.contextmanager
def _client(scheduler: str | Client | None, workers: int | None) -> Iterator[Client]:
    require_dask()
    import dask
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    if isinstance(scheduler, str):
        with connected(scheduler) as client:
            yield client
        return
    if scheduler is not None:
        yield scheduler
        return
    silence()
    count = workers or os.cpu_count() or 1
    # A task on a worker that dies fails at once: `_Run` decides what to do with it.
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=0,  # one large file may take more than its worker's part
            resources={MEMORY: MEMORY_LIMIT // count},
            dashboard_address="127.0.0.1:0",  # any free port: a fixed one may be taken
            silence_logs=50,  # CRITICAL
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


class _Run:
    """Keeps the cluster busy with as many tasks as it needs, and collects their records.

    Dask holds a worker's death against every task that it had assigned to the worker. Those are few
    here, and each of them runs again, alone, before its file counts as the one that kills workers.
    """

    def __init__(
        self,
        client: Client,
        models: Mapping[str, Model],
        advance: Advance | None,
        finished_count: int,
        total: int,
    ) -> None:
        self.workers, self.models = Workers(client, retry_advice=RUN_AGAIN), models
        self.advance, self.finished_count, self.total = advance, finished_count, total
        self.records: dict[str, Record] = {}
        self.flight: dict[Future, tuple[Job, int]] = {}

    def run_all(self, jobs: list[Job]) -> None:
        """Run all jobs. Raises MeshletError when the scheduler or all workers are lost."""
        suspects = self.run_some(deque(jobs))
        for job in suspects:
            if self.run_some(deque([job])):
                self.note(job.failure("it killed its worker, twice"))

    def run_some(self, queue: deque[Job]) -> list[Job]:
        """Run jobs; returns those whose worker died."""
        from distributed import KilledWorker

        lost_jobs = []
        while queue or self.flight:
            self.submit(queue)
            for future in self.workers.wait(self.flight):
                job, _ = self.flight.pop(future)
                record, error = self.workers.outcome(future)
                if record is not None:
                    self.note(record)
                elif isinstance(error, KilledWorker):
                    lost_jobs.append(job)
                else:
                    self.note(job.failure(_reason(error)))
        return lost_jobs

    def note(self, record: Record) -> None:
        self.records[record["name"]] = record
        if self.advance is not None:
            self.advance((self.finished_count + len(self.records)) / self.total)

    def submit(self, queue: deque[Job]) -> None:
        """Submit jobs while workers are free and have the memory; one in any case."""
        threads, memory = self.workers.free()
        while queue and len(self.flight) <= 2 * threads:
            job = queue[0]
            size_needed = estimate(job.source, self.models[job.name].size, job.options)
            reserved = sum(size for _, size in self.flight.values())
            if self.flight and memory and reserved + size_needed > memory:
                return
            queue.popleft()
            future = self.workers.submit(_work, job, memory=size_needed, retries=RETRIES)
            self.flight[future] = job, size_needed


def _reason(error: BaseException | None) -> str:
    """Of a task that raised what it does not expect."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or ''}: {error.strerror}; check the path and its permissions"
    return f"{type(error).__name__}: {error}"


def _work(job: Job) -> Record:
    from distributed import get_worker

    return task.run(job, get_worker().local_directory)
