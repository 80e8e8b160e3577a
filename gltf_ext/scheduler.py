"""Tasks on threads or on the workers of Dask: files of a batch, chunks of a large model."""

from __future__ import annotations

import contextlib
import importlib.metadata
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from gltf_ext.errors import MeshletError

if TYPE_CHECKING:
    from distributed import Client, Future
    from distributed.security import Security

CONNECT = 10  # seconds for the scheduler to answer
NO_WORKERS = 120  # seconds without any worker before giving up
SILENCE = 300  # seconds without an answer of a scheduler or a worker before it counts as lost
FETCH = 30  # seconds for a result that a worker has
PACKAGE = "gltf-meshlet"
MEMORY = "memory"  # the name of the workers' resource, in bytes
GONE = "the scheduler is gone"
RUN_AGAIN = "run again"


def require_dask() -> None:
    """Raise MeshletError unless Dask is installed."""
    try:
        import distributed  # noqa: F401  whether it is there
    except ImportError:
        raise MeshletError("this needs Dask", "pip install 'gltf-meshlet[batch]'") from None


def silence() -> None:
    """Keep Dask's own messages off the terminal: errors of this module say what failed."""
    # asyncio tells of what Dask's coroutines raise while Ctrl-C ends them.
    for logger in ("distributed", "distributed.client", "asyncio"):
        logging.getLogger(logger).setLevel(logging.CRITICAL)


def within(seconds: float, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a function returns, in a thread that is left alone when the time is over.

    Raises TimeoutError, and what the function raises.
    """
    from concurrent.futures import Future
    from concurrent.futures import TimeoutError as NotInTime

    result: Future[Any] = Future()

    def call() -> None:
        try:
            result.set_result(function(*arguments))
        except BaseException as error:
            result.set_exception(error)

    threading.Thread(target=call, daemon=True).start()
    try:
        return result.result(seconds)
    except NotInTime as error:  # no TimeoutError in Python 3.10
        raise TimeoutError(str(error)) from None


def require_package(client: Client) -> None:
    """Raise MeshletError unless the scheduler has this version of the package."""
    try:
        version = within(CONNECT, client.run_on_scheduler, importlib.metadata.version, PACKAGE)
    except importlib.metadata.PackageNotFoundError:
        version = ""
    except Exception as error:  # of other versions of Dask or Python, of a network
        problem = f"the scheduler answers with {type(error).__name__}: {error}"
        raise MeshletError(problem, "use the same versions of Dask and Python on all") from None
    if version != importlib.metadata.version(PACKAGE):
        raise MeshletError(other_version("the scheduler", version))


def other_version(who: str, version: str) -> str:
    """Return the line for a program of a cluster without this version of the package."""
    ours = importlib.metadata.version(PACKAGE)
    has = f"has {PACKAGE} {version}, this is {ours}" if version else f"has no {PACKAGE}"
    return f"{who} {has}; pip install '{PACKAGE}[batch]=={ours}' there"


@contextlib.contextmanager
def connected(address: str) -> Iterator[Client]:
    """Return a client of a running scheduler. Raises MeshletError."""
    require_dask()
    silence()
    import asyncio  # slow to load

    from distributed import Client

    try:
        security = _security(address)
        _check_answer(address, security)
        client = Client(address, timeout=CONNECT, security=security)
    except (TypeError, RuntimeError) as error:  # of Dask's TLS: without certificates, or too few
        problem = f"Dask does not connect to it: {error}"
        raise MeshletError(problem, "set distributed.comm.tls of Dask", address) from None
    except (OSError, ValueError, TimeoutError, asyncio.TimeoutError):
        problem = "no scheduler answers at this address"
        raise MeshletError(problem, "start one: dask scheduler", address) from None
    with client:
        yield client


def _security(address: str) -> Security:
    """Return the security settings of Dask's configuration, which clients use by default."""
    import dask
    from distributed.security import Security
    from distributed.utils import import_term

    loader = dask.config.get("distributed.client.security-loader", None)
    security: Security | None = import_term(loader)({"address": address}) if loader else None
    return security or Security()


def _check_answer(address: str, security: Security) -> None:
    """Raise OSError, ValueError or TimeoutError unless a program of Dask answers.

    A client would wait for ever for a web server, or for a scheduler that is stopped.
    """
    import asyncio
    from concurrent.futures import ThreadPoolExecutor

    from distributed.comm import connect

    async def ask() -> None:
        certificates = security.get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=CONNECT, **certificates), CONNECT)
        await comm.close()

    with ThreadPoolExecutor(1) as pool:  # this thread may have a loop that runs
        pool.submit(lambda: asyncio.run(ask())).result()


def in_order(
    function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]], threads: int
) -> Iterator[Any]:
    """Results in the order of the tasks. Raises what a task raises.

    Tasks are taken while one of the threads is free and few results wait for an earlier one.
    """
    from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait  # slow to load

    flight: deque[Any] = deque()
    with ThreadPoolExecutor(threads) as pool:
        for task in tasks:
            flight.append(pool.submit(function, *task))
            while len(running := [f for f in flight if not f.done()]) >= threads:
                wait(running, return_when=FIRST_COMPLETED)
            if len(flight) > 2 * threads:
                wait([flight[0]])
            while flight and flight[0].done():
                yield flight.popleft().result()
        while flight:
            yield flight.popleft().result()


class LocalThreads:
    """Runs functions on threads of this process."""

    def __init__(self, threads: int) -> None:
        """Share so many threads among tasks."""
        self._threads = threads

    def map(
        self,
        function: Callable[..., Any],
        tasks: Iterable[tuple[Any, ...]],
        at_once: int,
        memory: int,
    ) -> Iterator[Any]:
        """As Workers.map, at most `at_once` tasks at a time, which share the threads."""
        lanes = min(at_once, self._threads)
        if lanes == 1:
            return (function(self._threads, *task) for task in tasks)
        return in_order(partial(function, -(-self._threads // lanes)), tasks, lanes)


class Workers:
    """Runs functions on the workers of a scheduler.

    Attributes:
        retry_advice: what errors say to do when scheduler or workers are lost.
        unfit: address -> line, of workers without this version of the package.
    """

    def __init__(self, client: Client, threads: int = 1, retry_advice: str = RUN_AGAIN) -> None:
        self._threads, self.retry_advice = threads, retry_advice
        self._client = client
        self._last_seen = time.monotonic()
        self._latest: dict[str, dict[str, Any]] = {}  # the workers that were seen last
        self.unfit: dict[str, str] = {}
        self._checks: dict[str, Future | None] = {}  # address -> task; None: has the package

    def fit(self) -> dict[str, Mapping[str, Any]]:
        """Return address -> what Dask tells, of the workers with this version of the package.

        Each new worker is asked for its version first. Raises MeshletError.
        """
        self._workers()
        for address in self._latest:
            if address not in self._checks:
                self._checks[address] = self._client.submit(
                    importlib.metadata.version,
                    PACKAGE,
                    pure=False,
                    workers=[address],
                    allow_other_workers=False,
                    priority=1,
                )
            check = self._checks[address]
            if check is not None and check.done():
                error = check.exception()
                version = check.result() if error is None else ""
                if version != importlib.metadata.version(PACKAGE):
                    self.unfit[address] = other_version(f"the worker {address}", version)
                self._checks[address] = None
        checked = {a for a, check in self._checks.items() if check is None} - set(self.unfit)
        return {address: w for address, w in self._latest.items() if address in checked}

    def free(self) -> tuple[int, int]:
        """Return (threads of all workers, bytes of memory that they declare, 0 for none)."""
        workers = self._workers()
        return sum(w["nthreads"] for w in workers), sum(memory_of(w) for w in workers)

    def _workers(self) -> list[dict[str, Any]]:
        try:
            info = within(SILENCE, partial(self._client.scheduler_info, n_workers=-1))
        except TimeoutError:
            problem = f"the scheduler has not answered for {SILENCE} seconds"
            raise MeshletError(problem, self.retry_advice) from None
        except (OSError, RuntimeError):  # the connection, or what has it, is closed
            raise MeshletError(GONE, self.retry_advice) from None
        if "workers" not in info:  # the connection has ended
            raise MeshletError(GONE, self.retry_advice)
        self._latest = info["workers"]
        if self._latest:
            self._last_seen = time.monotonic()
        return list(self._latest.values())

    def submit(
        self, function: Callable[..., Any], *arguments: Any, memory: int, worker: str | None = None
    ) -> Future:
        """Start a task.

        It waits for a worker that declares enough memory, or the most that any worker declares.
        On a worker that is named, it never runs anywhere else, also if the worker dies.

        Args:
            function: called with `arguments`.
            arguments: of the function.
            memory: bytes that the task takes.
            worker: address of the worker that runs it; by default, any.
        """
        import dask

        if worker is None:
            largest = max(map(memory_of, self._workers()), default=0)
        else:
            largest = memory_of(self._latest[worker])
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 TiB"}):
            return self._client.submit(
                function,
                *arguments,
                pure=False,
                workers=worker and [worker],
                resources={MEMORY: min(memory, largest)} if largest else None,
            )

    def restart(self, address: str) -> None:
        """Let a worker's nanny start it again, if it has one. Its tasks are lost."""
        if self._latest.get(address, {}).get("nanny"):
            options = {"timeout": CONNECT, "raise_for_error": False}
            with contextlib.suppress(Exception):  # it may be gone already
                within(CONNECT, partial(self._client.restart_workers, [address], **options))

    def wait(self, tasks: Iterable[Future], seconds: float = 5) -> list[Future]:
        """Return those that have ended, after at most so many seconds. Raises MeshletError."""
        from concurrent.futures import CancelledError

        from distributed import TimeoutError, wait

        try:
            return list(wait(list(tasks), seconds, "FIRST_COMPLETED").done)
        except TimeoutError:
            self.check_workers()
            return []
        except CancelledError:
            raise MeshletError(GONE, self.retry_advice) from None

    def outcome(self, task: Future, is_pinned: bool = False) -> tuple[Any, BaseException | None]:
        """Return (result, error) of a task, which is forgotten. Raises MeshletError.

        is_pinned: it runs on one worker only; a TimeoutError says that this one has died since.
        """
        from concurrent.futures import CancelledError

        from distributed import TimeoutError

        while True:
            try:
                error = task.exception(FETCH if is_pinned else NO_WORKERS)
                result = None if error else task.result(FETCH if is_pinned else NO_WORKERS)
                task.release()  # it would run again if its worker died
                return result, error
            except TimeoutError as late:  # its worker died, and it runs again unless it is pinned
                self.check_workers()
                if is_pinned:
                    return None, late
            except (OSError, CancelledError):  # not of the task: it could not be fetched
                raise MeshletError(GONE, self.retry_advice) from None

    def check_workers(self) -> None:
        """Raise MeshletError when there have been no workers for a long time."""
        self._workers()
        if time.monotonic() - self._last_seen > NO_WORKERS:
            problem = f"the scheduler has had no workers for {NO_WORKERS} seconds"
            raise MeshletError(problem, self.retry_advice)

    def map(
        self,
        function: Callable[..., Any],
        tasks: Iterable[tuple[Any, ...]],
        at_once: int,
        memory: int,
    ) -> Iterator[Any]:
        """Yield the results of function(threads, *task) in the order of the tasks.

        Tasks are taken while workers are free. A task whose worker dies runs on another one.

        Args:
            function: called on a worker.
            tasks: further arguments of each call.
            at_once: unused here; see LocalThreads.map.
            memory: bytes that a task takes.

        Raises:
            MeshletError: a task fails.
        """
        flight: deque[Future] = deque()
        for task in tasks:
            while len(flight) > self.free()[0]:
                yield self._result(flight.popleft())
            flight.append(self.submit(function, self._threads, *task, memory=memory))
        while flight:
            yield self._result(flight.popleft())

    def _result(self, task: Future) -> Any:
        from distributed import KilledWorker

        result, error = self.outcome(task)
        if isinstance(error, KilledWorker):
            raise MeshletError("a task killed its workers", "give them more memory")
        if error is not None and not isinstance(error, MeshletError):
            raise MeshletError(
                f"a worker failed: {type(error).__name__}: {error}", self.retry_advice
            )
        if error is not None:
            raise error
        return result


Runner = LocalThreads | Workers


@contextlib.contextmanager
def runner(address: str | None, threads: int) -> Iterator[Runner]:
    """Run functions on the workers of a scheduler, in this process without an address.

    threads: that each may use; 0 for all processors here, one there. Raises MeshletError.
    """
    if address is None:
        yield LocalThreads(threads or os.cpu_count() or 1)
    else:
        with connected(address) as client:
            yield Workers(client, threads or 1)


def memory_of(worker: Mapping[str, Any]) -> int:
    """Return the bytes of memory that a worker declares as a resource, 0 for none."""
    return int(worker["resources"].get(MEMORY, 0))
