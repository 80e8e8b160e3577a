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
from gltf_ext.batches.memory import estimate
from gltf_ext.batches.page import page
from gltf_ext.batches.storage import STATE, Folder, find_models, output_names, stamp_of
from gltf_ext.batches.task import DONE, FAILED, UNCHANGED, Job, Record
from gltf_ext.compression.options import Options
from gltf_ext.errors import MeshletError
from gltf_ext.progress import Advance, progress_bar
from gltf_ext.scheduler import MEMORY, Workers, connected, require_dask, silence

if TYPE_CHECKING:
    from distributed import Client, Future

REPORT, PAGE = "batch.json", "batch.html"
RETRIES = 2  # of a task that raises, such as for a network that fails
RUN_AGAIN = "run again: what is done is kept"


def batch(
    source: str | Sequence[str],
    destination: str,
    *,
    scheduler: str | Client | None = None,
    workers: int | None = None,
    progress: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Compress and verify many models, a task a file, on Dask distributed.

    A second call does only what failed, changed or is new: each output has a record of its input,
    options, version and digest in the folder .gltf-meshlet of the destination. Outputs appear
    whole or not at all. A file that fails or kills its worker is reported and stops no other.

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
        totals: counts of done, unchanged and failed files; input_bytes, output_bytes, triangles.
        files: one for each model, failed ones first: name, output, status ("done", "unchanged",
            "failed"); error if it failed, else input_digest, output_digest (SHA-256), input_bytes,
            output_bytes, triangles, ratio (of raw floats to compressed geometry),
            max_error_percent (of positions, of the box's diagonal), warnings, thumbnail (PNG in
            base64), seconds.

    Raises MeshletError when nothing can be started or the scheduler is lost, OSError when the
    source or the destination cannot be read or written.
    """
    Options.of({**options, "progress": progress})
    _check_cluster(scheduler, workers)
    start = time.perf_counter()
    goal = Folder(destination)
    folder, models = find_models(source, goal)
    if goal.is_local:
        os.makedirs(goal.at(STATE), exist_ok=True)
    goal.remove_partials()
    jobs = [
        Job(folder.url, name, goal.url, output, options, task.VERSION)
        for name, output in output_names(list(models)).items()
    ]
    records = _finished(goal, jobs, models)
    left = [job for job in jobs if job.name not in records]
    left.sort(key=lambda job: -int(models[job.name].get("size") or 0))
    if left:
        with progress_bar("batch", progress) as advance, _client(scheduler, workers) as client:
            run = _Run(client, folder, models, advance, len(records), len(jobs))
            run.all(left)
            records.update(run.records)
    report = _report(str(source), destination, options, [records[job.name] for job in jobs])
    report["seconds"] = time.perf_counter() - start
    goal.write(REPORT, json.dumps(report, indent=1).encode())
    goal.write(PAGE, page(report).encode())
    return report


def _check_cluster(scheduler: Any, workers: Any) -> None:
    """Raises MeshletError for a value that these options of batch cannot have."""
    if not (scheduler is None or isinstance(scheduler, str) or hasattr(scheduler, "submit")):
        raise MeshletError(
            f"scheduler is {scheduler!r}",
            "use an address such as tcp://192.0.2.1:8786, or a distributed.Client",
            options=("scheduler",),
        )
    count = isinstance(workers, numbers.Integral) and not isinstance(workers, bool)
    if workers is not None and not (count and workers >= 1):
        raise MeshletError(f"workers is {workers!r}", "use 1 or more", options=("workers",))


def _finished(
    goal: Folder, jobs: list[Job], models: Mapping[str, Mapping[str, Any]]
) -> dict[str, Record]:
    """Records of the files that need no work: neither input nor output was touched since."""
    paths = {goal.at(job.record_name): job for job in jobs}
    outputs = _listed(goal)
    known = [path for path in paths if path in outputs]
    texts = goal.fs.cat(known, on_error="omit") if known else {}
    finished = {}
    for path, text in texts.items():
        job = paths[path]
        with contextlib.suppress(ValueError):
            record = json.loads(text)
            output = outputs.get(goal.at(job.output))
            if (
                job.is_current(record)
                and output is not None
                and record["output_stamp"] == stamp_of(output)
                and record["input_stamp"] == stamp_of(models[job.name])
            ):
                finished[job.name] = {**record, "status": UNCHANGED}
    return finished


def _listed(folder: Folder) -> Mapping[str, Mapping[str, Any]]:
    """Path -> fsspec's information on every file in a folder that may not exist yet."""
    folder.fs.invalidate_cache()
    try:
        found: Mapping[str, Mapping[str, Any]] = folder.fs.find(folder.path, detail=True)
    except FileNotFoundError:
        return {}
    return found


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

    if isinstance(scheduler, Client):
        yield scheduler
        return
    if scheduler is not None:
        with connected(scheduler) as client:
            yield client
        return
    silence()
    count = workers or os.cpu_count() or 1
    # A task on a worker that dies fails at once: `_Run` decides what to do with it.
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=0,  # one large file may take more than its worker's share
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
        folder: Folder,
        models: Mapping[str, Mapping[str, Any]],
        advance: Advance | None,
        finished: int,
        total: int,
    ) -> None:
        self.workers, self.folder, self.models = Workers(client, again=RUN_AGAIN), folder, models
        self.advance, self.finished, self.total = advance, finished, total
        self.records: dict[str, Record] = {}
        self.flight: dict[Future, tuple[Job, int]] = {}

    def all(self, jobs: list[Job]) -> None:
        """Runs all jobs. Raises MeshletError when the scheduler or all workers are lost."""
        suspects = self.some(deque(jobs))
        for job in suspects:
            if self.some(deque([job])):
                self.note(job.failed("it killed its worker, twice"))

    def some(self, queue: deque[Job]) -> list[Job]:
        """Runs jobs; returns those whose worker died."""
        from distributed import KilledWorker

        died = []
        while queue or self.flight:
            self.submit(queue)
            for future in self.workers.wait(self.flight):
                job, _ = self.flight.pop(future)
                record, error = self.workers.outcome(future)
                if record is not None:
                    self.note(record)
                elif isinstance(error, KilledWorker):
                    died.append(job)
                else:
                    self.note(job.failed(f"{type(error).__name__}: {error}"))
        return died

    def note(self, record: Record) -> None:
        self.records[record["name"]] = record
        if self.advance is not None:
            self.advance((self.finished + len(self.records)) / self.total)

    def submit(self, queue: deque[Job]) -> None:
        """Submits jobs while workers are free and have the memory; one in any case."""
        threads, memory = self.workers.free()
        while queue and len(self.flight) <= 2 * threads:
            need = estimate(self.folder, queue[0].name, self.models[queue[0].name])
            used = sum(taken for _, taken in self.flight.values())
            if self.flight and memory and used + need > memory:
                return
            job = queue.popleft()
            future = self.workers.submit(_work, job, memory=need, retries=RETRIES)
            self.flight[future] = job, need


def _work(job: Job) -> Record:
    from distributed import get_worker

    return task.run(job, get_worker().local_directory)
