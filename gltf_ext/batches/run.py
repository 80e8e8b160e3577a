"""batch: compresses many models, a task a file, on a cluster of Dask distributed."""

from __future__ import annotations

import contextlib
import numbers
import os
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from gltf_ext import scheduler as dask_scheduler
from gltf_ext.batches import reports
from gltf_ext.batches.dispatch import Dispatch
from gltf_ext.batches.planning import Plan
from gltf_ext.batches.progress import Listener, Progress, display
from gltf_ext.batches.pruning import gone_outputs, prune_outputs
from gltf_ext.batches.storage import Folder
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.scheduler import MEMORY, connected, require_dask, require_package, silence

if TYPE_CHECKING:
    from distributed import Client

PathText = str | os.PathLike[str]
TIME_LIMIT = 3600.0  # seconds of a file
RUN_AGAIN = "run again: what is done is kept"
TRIMMED = 16 << 20  # free bytes that a worker gives back to the system


def batch(
    source: PathText | Sequence[PathText],
    destination: PathText,
    *,
    root: PathText | None = None,
    scheduler: str | Client | None = None,
    workers: int | None = None,
    time_limit: float = TIME_LIMIT,
    check: bool = False,
    prune: Callable[[list[str]], bool] | bool = False,
    progress: Listener | bool = False,
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
        root: of a list: the folder below which the names of outputs start. By default, they are
            whole paths.
        scheduler: address of a running scheduler, or a distributed.Client; by default a cluster of
            processes on this machine.
        workers: processes of that cluster; by default one per processor.
        time_limit: seconds for a file, after which it fails.
        check: write nothing; the report says what would be done and why.
        prune: remove outputs whose models are gone, or a function that is called with their names
            and returns whether to remove them.
        progress: draw a progress bar on a terminal, and elsewhere print a line to standard error
            every ten seconds; or a function that is called with each event, a dictionary.
        options: of compress. A task takes one thread unless `threads` says more.

    Returns a report, which is also written to batch.json and, as a page, to batch.html:
        source, destination, version, options, time_limit, seconds.
        stopped: what ended the run before all files had ended, such as a scheduler that is lost;
            empty if nothing did.
        totals: counts of done, unchanged and failed files, and of what was left_out; input_bytes,
            output_bytes, triangles.
        files: one for each model, failed ones first: name, output, status ("done", "unchanged",
            "failed"); error if it failed, else source (path or URL of the model), input_digest,
            output_digest (SHA-256), input_bytes, output_bytes, triangles, ratio (of raw floats to
            compressed geometry), max_error_percent (of positions, of the box's diagonal), warnings,
            thumbnail (PNG in base64), seconds; inputs: path from the model's folder -> stamp and
            digest, of all files that were read or not there; outputs: name -> stamp and digest, of
            all files that were written; former: name -> digests, of files that batches with other
            options wrote.
        left_out: path and reason, of what may hold models but was not looked at: a folder that
            cannot be read, a link to a folder, a model in the destination that no batch wrote, a
            line of a list that names no model, or one with the name of another.
        skipped: names of models in the destination that batches wrote there.
        leftover: names of outputs of models that this run does not have.
        gone, removed: of these, whose models are gone, and those that were removed.
        todo: with `check`, name and reason of each file that would be done.

    Raises MeshletError when nothing can be started, or when the scheduler or all workers are lost:
    then the report is written all the same. Raises OSError when the source or the destination
    cannot be read or written.
    """
    listener = progress if callable(progress) else None
    if listener is None:
        Options.of({"progress": progress})
    options = Options.json_values(options)
    _check_arguments(scheduler, workers, time_limit)
    start = time.perf_counter()
    if isinstance(source, str | os.PathLike):
        paths: str | list[str] = os.fspath(source)
    else:
        paths = [os.fspath(entry) for entry in source]
    goal = Folder(os.fspath(destination))
    plan = Plan(paths, goal, options, os.fspath(root) if root is not None else None)
    report = reports.head(str(paths), os.fspath(destination), options, time_limit)
    orphans = gone_outputs(goal, plan)
    plan.remarks["gone"] = sorted(name for files in orphans.values() for name in files)
    if check:
        return reports.of_check(report, plan)
    plan.begin()
    stop: BaseException | None = None
    with display(progress is True) as show:
        status = Progress(plan.records, len(plan.jobs), listener, show)
        if plan.open_jobs():
            reports.write(goal, reports.of_run(report, plan, "", start, "it has not ended"))
            stop = _run(plan, status, scheduler, workers, time_limit)
    removed = prune_outputs(goal, orphans, prune) if stop is None else []
    plan.outputs.settle(plan.allowed_outputs)
    report = reports.of_run(report, plan, _reason(stop), start)
    report["removed"] = removed
    reports.write(goal, report)
    status.tell("end", totals=report["totals"], stopped=report["stopped"])
    if stop is not None:
        raise stop
    return report


def _run(
    plan: Plan,
    status: Progress,
    scheduler: str | Client | None,
    workers: int | None,
    time_limit: float,
) -> BaseException | None:
    """Do the jobs of a plan; returns what ended it before all had ended."""
    try:
        with _client(scheduler, workers) as client:
            dispatch = Dispatch(client, plan, status, time_limit, RUN_AGAIN)
            try:
                dispatch.run()
            finally:
                plan.records.update(dispatch.records)
    except (MeshletError, OSError, KeyboardInterrupt) as error:
        return error
    return None


def _reason(stop: BaseException | None) -> str:
    if stop is None:
        return ""
    return "it was interrupted" if isinstance(stop, KeyboardInterrupt) else str(stop)


def _check_arguments(scheduler: Any, workers: Any, time_limit: Any) -> None:
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
    is_number = isinstance(time_limit, numbers.Real) and not isinstance(time_limit, bool)
    if not (is_number and 0 < time_limit < float("inf")):
        problem = f"time_limit is {time_limit!r}"
        raise MeshletError(problem, "use seconds above 0", options=("time_limit",))


# --- the cluster ---


@contextlib.contextmanager
def _client(scheduler: str | Client | None, workers: int | None) -> Iterator[Client]:
    require_dask()
    import dask
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    if isinstance(scheduler, str):
        with connected(scheduler) as client:
            require_package(client)
            yield client
        return
    if scheduler is not None:
        require_package(scheduler)
        yield scheduler
        return
    silence()
    count = workers or os.cpu_count() or 1
    preload = [*dask.config.get("distributed.worker.preload"), "gltf_ext.batches.interrupts"]
    # A task on a worker that dies fails at once: `Dispatch` decides what to do with it.
    settings = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-ttl": f"{dask_scheduler.SILENCE} s",
        # Of small models both take time: to look at all threads a hundred times a second, and to
        # give 64 kB back to the system, which are needed again at once.
        "distributed.worker.profile.enabled": False,
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": TRIMMED,
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=0,  # one large file may take more than its worker's part
            resources={MEMORY: MEMORY_LIMIT // count},
            dashboard_address="127.0.0.1:0",  # any free port: a fixed one may be taken
            silence_logs=50,  # CRITICAL
            preload=preload,
            preload_argv=[[]] * len(preload),
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
