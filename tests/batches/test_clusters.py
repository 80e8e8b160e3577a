"""Clusters as the manual starts them: by SSH on this machine, SLURM with commands that play it."""

import asyncio
import os
import signal
import stat
import sys
import threading

import pytest

import gltf_ext
from tests.helpers.batch_reports import statuses
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import write_grid

distributed = pytest.importorskip("distributed")
PYTHON = {"PYTHONPATH": str(ROOT)}


@pytest.fixture
def source(tmp_path):
    (tmp_path / "source").mkdir()
    for i in range(3):
        write_grid(tmp_path / "source" / f"{i}.glb", 5 + i)
    return tmp_path / "source"


def check(source, destination, client):
    """Compresses all models on a cluster."""
    report = gltf_ext.batch(source, destination, scheduler=client)
    assert statuses(report) == {f"{i}.glb": "done" for i in range(3)}


# --- SSH ---


@pytest.fixture
def ssh_port(monkeypatch):
    """A port of an SSH server on this machine that runs every command without asking who it is."""
    asyncssh = pytest.importorskip("asyncssh")
    loop = asyncio.new_event_loop()

    class Open(asyncssh.SSHServer):
        def begin_auth(self, username):
            return False

    async def copy(reader, writer):
        while data := await reader.read(1 << 16):
            writer.write(data.decode())

    async def run(process):
        child = await asyncio.create_subprocess_shell(
            process.command,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env={**os.environ, **PYTHON},
            start_new_session=True,
        )
        children.append(child)
        await asyncio.gather(copy(child.stdout, process.stdout), copy(child.stderr, process.stderr))
        process.exit(await child.wait())

    async def listen():
        return await asyncssh.listen(
            "127.0.0.1",
            0,
            server_factory=Open,
            server_host_keys=[asyncssh.generate_private_key("ssh-ed25519")],
            process_factory=run,
        )

    children = []
    server = loop.run_until_complete(listen())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield server.get_port()

    async def end():
        for child in children:
            if child.returncode is None:
                os.killpg(child.pid, signal.SIGKILL)
        server.close()
        await asyncio.gather(*(child.wait() for child in children), server.wait_closed())
        await asyncio.sleep(0.1)  # for what the connections still tell each other

    asyncio.run_coroutine_threadsafe(end(), loop).result(60)
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()


def test_machines_by_ssh(source, tmp_path, ssh_port):
    with (
        distributed.SSHCluster(
            ["127.0.0.1", "127.0.0.1"],
            connect_options={"port": ssh_port, "known_hosts": None, "username": "user"},
            worker_options={"nthreads": 1},
            scheduler_options={"dashboard": False},
            remote_python=sys.executable,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        check(source, tmp_path / "out", client)


# --- SLURM ---

# As SLURM, it copies the script: dask-jobqueue deletes its own once this has returned, which may be
# before the job opens it.
SBATCH = """#!/bin/sh
cp "$1" "$0.job" || exit 1
setsid sh "$0.job" > "$0.log" 2>&1 &
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
for job in "$@"; do kill -- "-$job"; done
"""


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """Commands in the PATH that submit and cancel a job as SLURM's do, on this machine.

    Prints what the job has logged, which pytest shows if the test fails.
    """
    pytest.importorskip("dask_jobqueue")
    (tmp_path / "bin").mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        path = tmp_path / "bin" / name
        path.write_text(text)
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tmp_path}/bin{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    yield
    log = tmp_path / "bin" / "sbatch.log"
    print(log.read_text() if log.is_file() else "sbatch has started no job")


def loopback():
    """The name of this machine's network interface that is not on the network."""
    import psutil

    addresses = psutil.net_if_addrs().items()
    return next(name for name, each in addresses if "127.0.0.1" in {a.address for a in each})


def test_jobs_of_slurm(source, tmp_path, slurm):
    from dask_jobqueue import SLURMCluster

    with (
        SLURMCluster(
            cores=1,
            memory="4GB",
            worker_extra_args=["--resources", "memory=4e9"],
            local_directory=str(tmp_path),
            log_directory=str(tmp_path),
            interface=loopback(),
            scheduler_options={"dashboard_address": None},
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        script = cluster.job_script()
        assert "#SBATCH --mem=4G" in script and "memory=4e9" in script
        cluster.scale(jobs=1)
        check(source, tmp_path / "out", client)


# --- Kubernetes ---


def test_pods_of_kubernetes():
    """There is no cluster of it here: what would be created has the image and the resource."""
    operator = pytest.importorskip("dask_kubernetes.operator")
    spec = operator.make_cluster_spec(
        name="batch",
        image="registry/gltf-meshlet",
        n_workers=20,
        worker_command="dask-worker --nthreads 1 --resources memory=4e9",
    )
    worker = spec["spec"]["worker"]
    (container,) = worker["spec"]["containers"]
    assert (container["image"], worker["replicas"]) == ("registry/gltf-meshlet", 20)
    assert container["args"][:5] == ["dask-worker", "--nthreads", "1", "--resources", "memory=4e9"]
