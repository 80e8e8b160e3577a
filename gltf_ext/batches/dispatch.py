"""Hands the jobs of a batch to workers, and decides what to do when these die."""

from __future__ import annotations

import contextlib
import time
from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gltf_ext import scheduler
from gltf_ext.batches.memory import estimate
from gltf_ext.batches.planning import Plan
from gltf_ext.batches.progress import Progress
from gltf_ext.batches.task import Job, Record, record_limit
from gltf_ext.batches.worker import LONGEST, work
from gltf_ext.errors import MeshletError
from gltf_ext.scheduler import Workers, memory_of

if TYPE_CHECKING:
    from distributed import Client, Future

TRIES = 3  # of a job that raises, such as for a network that fails
# A task has models of so many bytes together, at most so many: the way to a worker and back takes
# 5 ms, a model of 1.6 kB 8 ms.
TASK_BYTES, TASK_JOBS = 1 << 18, 32
TICK = 1.0  # seconds between two looks at the workers
FORMER = "in a former run; it is tried again when the model, an option or this limit changes"
KILLED = "it killed its worker, twice: most likely for lack of memory"


@dataclass
class _Task:
    """Some jobs on a worker.

    Attributes:
        jobs: in the order in which they run.
        memory: bytes that the largest takes, 0 before they are estimated.
        worker: address; empty before it has one.
    """

    jobs: list[Job]
    memory: int = 0
    worker: str = ""


class Dispatch:
    """Keeps the workers of a cluster busy with few tasks each, and collects the records.

    Every task belongs to a worker from the start. When the worker dies, all jobs of its tasks run
    again at the end, one at a time, before one of them counts as the one that kills workers.

    Attributes:
        records: by the names of the models.
    """

    def __init__(
        self, client: Client, plan: Plan, progress: Progress, time_limit: float, advice: str
    ) -> None:
        self.records: dict[str, Record] = {}
        self._plan, self._progress, self._limit = plan, progress, time_limit
        self._workers = Workers(client, retry_advice=advice)
        self._flight: dict[Future, _Task] = {}
        self._tries: Counter[str] = Counter()
        self._heard: dict[str, float] = {}  # worker -> time of its last result, or first task
        self._silent: set[str] = set()

    def run(self) -> None:
        """Run all jobs. Raises MeshletError when the scheduler or all workers are lost."""
        threads, memory = self._wait_for_workers()
        limits = {"memory": memory, "seconds": self._limit}
        for job in self._plan.open_jobs():
            record = self._plan.limited.get(job.name)
            if record is not None and record["limits"].items() <= limits.items():
                self._note(job.failure(f"{record['error']} ({FORMER})"))
        jobs = [job for job in self._plan.open_jobs() if job.name not in self.records]
        suspects = self._run_some(deque(self._tasks(jobs, len(jobs) // (4 * threads))))
        for job in suspects:
            task = _Task([job])
            if self._run_some(deque([task])):
                record = job.failure(f"{KILLED}; {_advice(task.memory, memory)}")
                self._note_limit(job, record, {"memory": memory})

    def _wait_for_workers(self) -> tuple[int, int]:
        """Return (threads of all workers, the most memory of one), once one has the package."""
        while not (workers := self._workers.fit()):
            self._refuse_unfit()
            self._workers.check_workers()
            time.sleep(0.05)
        self._refuse_unfit()
        memory = max(memory_of(w) or int(w.get("memory_limit") or 0) for w in workers.values())
        return sum(w["nthreads"] for w in workers.values()), memory

    def _refuse_unfit(self) -> None:
        for line in self._workers.unfit.values():
            raise MeshletError(line)

    # --- tasks ---

    def _tasks(self, jobs: Iterable[Job], most: int) -> list[_Task]:
        """Return tasks: of a large model each, then of several small ones, at most so many."""
        tasks: list[_Task] = []
        chunk: list[Job] = []
        size = 0
        for job in sorted(jobs, key=lambda job: -self._plan.models[job.name].size):
            size += self._plan.models[job.name].size
            if chunk and (size > TASK_BYTES or len(chunk) >= min(most, TASK_JOBS)):
                tasks.append(_Task(chunk))
                chunk, size = [], self._plan.models[job.name].size
            chunk.append(job)
        return tasks + [_Task(chunk)] * bool(chunk)

    def _estimate(self, task: _Task) -> int:
        models = self._plan.models
        return max(estimate(j.source, models[j.name].size, j.options) for j in task.jobs)

    def _run_some(self, queue: deque[_Task]) -> list[Job]:
        """Run tasks; returns the jobs of those whose worker died."""
        from distributed import KilledWorker

        lost_jobs: list[Job] = []
        while queue or self._flight:
            workers = self._workers.fit()
            lost_jobs += self._of_lost_workers(workers)
            self._submit(queue, {a: w for a, w in workers.items() if a not in self._silent})
            if not self._flight:
                self._workers.check_workers()
                time.sleep(0.05)
            for future in self._workers.wait(self._flight, TICK) if self._flight else ():
                task = self._flight.pop(future)
                records, error = self._workers.outcome(future, is_pinned=True)
                self._heard[task.worker] = time.monotonic()
                if records is not None:
                    self._collect(task, records, queue)
                elif isinstance(error, KilledWorker | TimeoutError):
                    lost_jobs += self._note_loss(task, type(error).__name__)
                else:
                    raised = [f"{type(error).__name__}: {error}"] * len(task.jobs)
                    self._again(task.jobs, raised, queue)
            self._progress.move()
        return lost_jobs

    def _submit(self, queue: deque[_Task], workers: Mapping[str, Mapping[str, Any]]) -> None:
        """Submit tasks while a worker is free and has the memory; one in any case."""
        total_memory = sum(map(memory_of, workers.values()))
        while queue and workers:
            task = queue[0]
            task.memory = task.memory or self._estimate(task)
            reserved = sum(other.memory for other in self._flight.values())
            if self._flight and total_memory and reserved + task.memory > total_memory:
                return
            address = self._free_worker(task, workers)
            if address is None:
                return
            queue.popleft()
            task.worker = address
            if address not in self._busy():
                self._heard[address] = time.monotonic()
            future = self._workers.submit(
                work, task.jobs, self._limit, memory=task.memory, worker=address
            )
            self._flight[future] = task

    def _busy(self) -> set[str]:
        return {task.worker for task in self._flight.values()}

    def _free_worker(self, task: _Task, workers: Mapping[str, Mapping[str, Any]]) -> str | None:
        """Return the address of the worker with the fewest tasks a thread, if it can take it."""
        counts = Counter(other.worker for other in self._flight.values())
        reserved: Counter[str] = Counter()
        for other in self._flight.values():
            reserved[other.worker] += other.memory
        fitting = [
            (counts[address] / worker["nthreads"], address)
            for address, worker in workers.items()
            if counts[address] < 2 * worker["nthreads"]
            and (
                not counts[address]
                or not memory_of(worker)
                or reserved[address] + task.memory <= memory_of(worker)
            )
        ]
        return min(fitting)[1] if fitting else None

    # --- results ---

    def _collect(self, task: _Task, records: list[Record], queue: deque[_Task]) -> None:
        """Note the records of a task; what it has not begun goes to the end of the queue."""
        for job, record in zip(task.jobs, records):
            if "raised" in record:
                self._again([job], [record["raised"]], queue)
            elif "limit" in record:
                self._note_limit(job, record, {"seconds": self._limit})
                self._workers.restart(task.worker)  # the job goes on there
            else:
                self._note(record)
        if rest := task.jobs[len(records) :]:
            queue.append(_Task(rest))

    def _again(self, jobs: list[Job], reasons: list[str], queue: deque[_Task]) -> None:
        """Queue jobs that raised something, unless they have done so too often."""
        for job, reason in zip(jobs, reasons):
            self._tries[job.name] += 1
            if self._tries[job.name] < TRIES:
                queue.append(_Task([job]))
            else:
                self._note(job.failure(reason))

    def _of_lost_workers(self, workers: Mapping[str, Any]) -> list[Job]:
        """Return the jobs of workers that are gone, or of which nothing has come for too long."""
        deadline = time.monotonic() - self._limit - LONGEST - scheduler.SILENCE
        self._silent |= {a for a in self._busy() if self._heard[a] < deadline}
        jobs = []
        for future, task in list(self._flight.items()):
            is_lost = task.worker not in workers or task.worker in self._silent
            if is_lost and future.status != "error":
                del self._flight[future]
                with contextlib.suppress(Exception):
                    future.cancel()
                silent = "is silent" if task.worker in self._silent else "is gone"
                jobs += self._note_loss(task, silent)
        return jobs

    def _note_loss(self, task: _Task, reason: str) -> list[Job]:
        """Return the jobs of a task whose worker died, which is an event."""
        names = [job.name for job in task.jobs]
        self._progress.tell("lost", worker=task.worker, reason=reason, names=names)
        return task.jobs

    def _note(self, record: Record) -> None:
        self.records[record["name"]] = record
        self._progress.note(record)

    def _note_limit(self, job: Job, record: Record, limits: dict[str, Any]) -> None:
        """Note a file that reached a limit; a record of it keeps it from being tried in vain."""
        with contextlib.suppress(Exception):  # of any storage: then it is tried again
            record_limit(job, record, limits)
        self._note(record)


def _advice(needed_bytes: int, memory: int) -> str:
    has = f", its worker has {memory / 1e6:,.0f} MB" if memory else ""
    return f"it may take {needed_bytes / 1e6:,.0f} MB{has}: give workers more, or use --max-memory"
