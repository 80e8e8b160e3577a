"""Programs on this machine: schedulers and workers of Dask, and commands that use them."""

import os
import subprocess
import sys

import pytest

import gltf_ext
from tests.helpers.cluster import eventually, is_open
from tests.helpers.environment import ROOT
from tests.helpers.processes import answer_interrupts


@pytest.fixture
def environment():
    """Of the programs; tests may have their own."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}


@pytest.fixture
def start(environment, tmp_path):
    """Starts a program; all are gone after the test."""
    running = []

    def program(*command, output=subprocess.PIPE, session=False, **more):
        process = subprocess.Popen(
            [str(word) for word in command],
            env={**environment, **more},
            stdout=output,
            stderr=output,
            text=True,
            cwd=tmp_path,
            start_new_session=session,
            preexec_fn=answer_interrupts if session else None,
        )
        running.append(process)
        return process

    yield program
    for process in reversed(running):
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def client():
    """Of a scheduler and a worker in this process."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture
def compress_all(client):
    """compress_all(source, destination, ...): the report of a batch."""
    return lambda *paths, **options: gltf_ext.batch(*map(str, paths), scheduler=client, **options)


@pytest.fixture
def cluster(start):
    """cluster(port, workers): address and processes of a scheduler and workers on TCP ports.

    scheduler: environment of the scheduler; more: of the workers.
    """

    def programs(port, workers, scheduler=None, **more):
        address = f"tcp://127.0.0.1:{port}"
        python = [sys.executable, "-m"]
        options = ["--no-dashboard", "--host", "127.0.0.1"]
        # What they log goes nowhere: a pipe that nobody reads fills, and stops its program.
        quiet = subprocess.DEVNULL
        command = [*python, "distributed.cli.dask_scheduler", *options, "--port", port]
        scheduler = start(*command, output=quiet, **(scheduler or {}))
        eventually(lambda: is_open(port), process=scheduler)
        command = [*python, "distributed.cli.dask_worker", address, *options]
        command += ["--nthreads", "1", "--resources", "memory=1e9"]
        return address, scheduler, [start(*command, output=quiet, **more) for _ in range(workers)]

    return programs
