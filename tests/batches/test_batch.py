"""Batches on local clusters and over TCP; workers, clients and schedulers that are killed."""

import hashlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections import Counter

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext import scheduler
from gltf_ext.batches import run as batch_run
from gltf_ext.batches import task
from gltf_ext.batches.finding import find_models, output_names
from gltf_ext.batches.memory import BASE, estimate
from gltf_ext.batches.page import page
from gltf_ext.batches.storage import OUTPUTS as OUTPUT_LIST
from gltf_ext.batches.storage import STATE, Folder, Outputs
from gltf_ext.batches.task import Job
from gltf_meshlet import cli
from tests.helpers.batch_reports import run_job
from tests.helpers.cluster import eventually, finished, free_port, is_open
from tests.helpers.environment import MODELS, ROOT
from tests.helpers.gltf_builder import write_grid

distributed = pytest.importorskip("distributed")
COMMAND = [sys.executable, "-m", "gltf_meshlet", "batch"]
LONG = 1800  # for a hundred models


@pytest.fixture
def source(tmp_path):
    """10 models and one that is damaged; two have the same name but for the suffix."""
    folder = tmp_path / "source"
    (folder / "deep").mkdir(parents=True)
    for i in range(8):
        write_grid(folder / f"{i}.glb", 5 + i)
    write_grid(folder / "deep" / "same.glb")
    (folder / "deep" / "same.obj").write_text(
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"
    )
    (folder / "deep" / "m.mtl").write_text("newmtl m\nKd 1 0 0\nmap_Kd t.png\n")
    Image.new("RGB", (2, 2)).save(folder / "deep" / "t.png")
    (folder / "damaged <b>.stl").write_text("solid")
    (folder / "notes.md").write_text("not a model")
    return folder


OUTPUTS = {*(f"{i}.glb" for i in range(8)), "deep/same.glb.glb", "deep/same.obj.glb"}


def digests(folder):
    """name -> SHA-256 of each output; fails for anything else that lies there."""
    files = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    files = {name: p for name, p in files.items() if not name.endswith(".limit")}
    found = {n: p for n, p in files.items() if not n.startswith(STATE) and n.endswith(".glb")}
    kept = {f"{STATE}/{name}.json" for name in found}
    others = {"batch.json", "batch.html", OUTPUT_LIST}
    assert set(files) - set(found) - others == kept, "records and no more"
    return {n: hashlib.sha256(p.read_bytes()).hexdigest() for n, p in found.items()}


@pytest.fixture
def undisturbed(source, tmp_path):
    """The outputs that each model gives on its own."""
    wanted = {}
    nowhere = Folder(str(tmp_path / "nowhere"))
    models = find_models(str(source), nowhere, Outputs(nowhere)).models
    for name, output in output_names([model.name for model in models]).items():
        if not name.startswith("damaged"):
            path = tmp_path / "single.glb"
            gltf_ext.compress(source / name, path)
            wanted[output] = hashlib.sha256(path.read_bytes()).hexdigest()
    assert set(wanted) == OUTPUTS
    return wanted


# --- programs ---


@pytest.fixture
def environment(tmp_path):
    """Of programs whose workers leave a trace; log() gives the names that were compressed."""

    class Environment(dict):
        def log(self):
            path = tmp_path / "log"
            lines = path.read_text().splitlines() if path.exists() else []
            return [line.split(" ", 1) for line in lines]

    return Environment(
        os.environ,
        BATCH_LOG=str(tmp_path / "log"),
        DASK_DISTRIBUTED__WORKER__PRELOAD=f'["{ROOT}/tests/helpers/batch_preload.py"]',
        PYTHONPATH=str(ROOT),
    )


# --- in one process ---


def test_all_files_and_nothing_twice(source, tmp_path, client, undisturbed):
    report = gltf_ext.batch(str(source), str(tmp_path / "out"), scheduler=client)
    assert digests(tmp_path / "out") == undisturbed
    totals = report["totals"]
    assert (totals["done"], totals["unchanged"], totals["failed"]) == (10, 0, 1)
    failed, first, *_ = report["files"]
    assert failed["name"] == "damaged <b>.stl" and "is cut off" in failed["error"]
    assert first["output_digest"] and first["max_error_percent"] < 0.1 and first["triangles"] == 32
    assert json.loads((tmp_path / "out" / "batch.json").read_text()) == report

    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*.glb*")}
    report = gltf_ext.batch(str(source), str(tmp_path / "out"), scheduler=client)
    assert (report["totals"]["unchanged"], report["totals"]["failed"]) == (10, 1)
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*.glb*")}


def test_what_changed_is_done_again(source, tmp_path, client, monkeypatch):
    def names(**options):
        report = gltf_ext.batch(str(source), str(tmp_path / "out"), scheduler=client, **options)
        return {file["name"] for file in report["files"] if file["status"] == "done"}

    assert len(names()) == 10
    write_grid(source / "1.glb", 20)
    (tmp_path / "out" / "2.glb").unlink()
    os.utime(source / "3.glb", (1, 1))  # touched, but the same bytes
    write_grid(source / "new.glb")
    assert names() == {"1.glb", "2.glb", "new.glb"}
    assert names() == set()
    (tmp_path / "out" / STATE / "4.glb.json").write_text("{")
    assert names() == {"4.glb"}
    assert len(names(position_bits=10)) == 11
    monkeypatch.setattr(task, "VERSION", "9.9")
    assert len(names(position_bits=10)) == 11


def test_storage_that_is_no_disk(source, tmp_path, client, undisturbed):
    fsspec = pytest.importorskip("fsspec")
    memory = fsspec.filesystem("memory")
    memory.put(str(source), "/models", recursive=True)
    report = gltf_ext.batch("memory://models", "memory://results", scheduler=client)
    assert report["totals"]["done"] == 10
    memory.get("/results", str(tmp_path / "got"), recursive=True)
    assert digests(tmp_path / "got") == undisturbed
    report = gltf_ext.batch("memory://models", "memory://results", scheduler=client)
    assert report["totals"]["unchanged"] == 10


@pytest.fixture
def object_store(monkeypatch):
    """A server of S3's protocol on this machine, with the bucket "library"; its environment."""
    s3fs = pytest.importorskip("s3fs")
    s3fs.S3FileSystem.clear_instance_cache()  # has the server of an earlier test
    moto = pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    reset = urllib.request.Request(f"http://{host}:{port}/moto-api/reset", method="POST")
    urllib.request.urlopen(reset).close()  # the servers of a process share their buckets
    variables = {"AWS_ENDPOINT_URL": f"http://{host}:{port}", "AWS_DEFAULT_REGION": "us-east-1"}
    variables |= dict.fromkeys(("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"), "test")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    Folder("s3://library").fs.mkdir("library")
    yield variables
    server.stop()


def test_an_object_store(source, tmp_path, client, undisturbed, object_store):
    bucket = Folder("s3://library")
    bucket.fs.put(str(source), "library/models", recursive=True)
    arguments = ("s3://library/models", "s3://library/results")
    assert gltf_ext.batch(*arguments, scheduler=client)["totals"]["done"] == 10
    bucket.fs.get("library/results", str(tmp_path / "got"), recursive=True)
    assert digests(tmp_path / "got") == undisturbed
    totals = gltf_ext.batch(*arguments, scheduler=client)["totals"]
    assert (totals["done"], totals["unchanged"]) == (0, 10)


def test_globs_lists_and_the_destination_inside(source, tmp_path, client):
    inside = source / "out"
    report = gltf_ext.batch(str(source / "[0-3].glb"), str(inside), scheduler=client)
    assert [file["name"] for file in report["files"]] == ["0.glb", "1.glb", "2.glb", "3.glb"]
    assert gltf_ext.batch(str(source), str(inside), scheduler=client)["totals"]["done"] == 6
    (tmp_path / "list.txt").write_text(f"{source}/0.glb\n\n{source}/deep/same.obj\n")
    for root, start in ((source, ""), (tmp_path, "source/"), (None, f"{source}/"[1:])):
        report = gltf_ext.batch(
            str(tmp_path / "list.txt"), str(tmp_path / "b"), root=root, scheduler=client
        )
        outputs = [file["output"] for file in report["files"]]
        assert outputs == [f"{start}0.glb", f"{start}deep/same.glb"]


def test_a_file_that_changes_while_it_is_read(source, tmp_path, monkeypatch):
    def changing(input, output, **options):
        report = gltf_ext.compress(input, output, **options)
        write_grid(source / "1.glb", 30)
        return report

    monkeypatch.setattr(task, "compress", changing)
    out = str(tmp_path / "out")
    record = run_job(Job(f"{source}/1.glb", "1.glb", out, "1.glb", {}, task.VERSION))
    assert record["status"] == "failed" and "changed while it was read" in record["error"]
    assert not (tmp_path / "out").exists()


def test_a_result_that_does_not_fit_a_glb(source, tmp_path, monkeypatch):
    monkeypatch.setattr("gltf_ext.document.container.MAX_BINARY_BYTES", 10)
    out = str(tmp_path / "out")
    record = run_job(Job(f"{source}/1.glb", "1.glb", out, "1.glb", {}, task.VERSION))
    assert record["status"] == "failed" and "does not fit a .glb" in record["error"]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "source, destination, options, message",
    [
        ("nothing", "out", {}, "holds no models"),
        ("source", "source", {}, "holds the models too"),
        ("source", "out", {"position_bits": 99}, "position_bits"),
        ("source", "nope://out", {}, "Protocol not known"),
        ("source", "out", {"scheduler": "tcp://127.0.0.1:9"}, "no scheduler answers"),
        ("source", "out", {"workers": -1}, "workers is -1; use 1 or more"),
        ("source", "out", {"workers": 0}, "workers is 0; use 1 or more"),
        ("gone", "out", {}, "is not there"),
        ("source/**a.glb", "out", {}, "pattern"),
    ],
)
def test_refused_in_one_line(tmp_path, monkeypatch, source, destination, options, message):
    monkeypatch.setattr(scheduler, "CONNECT", 0.5)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "source").mkdir()
    write_grid(tmp_path / "source" / "a.glb")
    (tmp_path / "nothing").mkdir()
    with pytest.raises(gltf_ext.MeshletError, match=r"^[^\n]*$") as caught:
        gltf_ext.batch(source, destination, **options)
    assert message in str(caught.value)


def test_memory_is_estimated_from_the_header(tmp_path):
    def triangles(name):
        size = (tmp_path / name).stat().st_size
        return (estimate(f"{tmp_path}/{name}", size, {}) - BASE - 2 * size) / 250

    write_grid(tmp_path / "a.glb", 21)
    gltf_ext.compress(tmp_path / "a.glb", tmp_path / "b.glb")
    (tmp_path / "c.obj").write_text("v 0 0 0\n" * 30)
    (tmp_path / "d.glb").write_bytes(b"glTF")
    assert triangles("a.glb") == triangles("b.glb") == 800
    assert 0 < triangles("c.obj") < 10 and triangles("d.glb") == 0
    (tmp_path / "e.gltf").write_text('{"accessors":[{"count":1e999}]}')
    (tmp_path / "f.gltf").write_text("[" * 100_000)
    assert triangles("e.gltf") == 1 and 0 < triangles("f.gltf") < 5000
    assert estimate(f"{tmp_path}/gone.glb", 0, {}) == BASE


def test_memory_has_the_limit_of_max_memory(tmp_path):
    write_grid(tmp_path / "a.glb", 900)
    size = (tmp_path / "a.glb").stat().st_size
    assert estimate(f"{tmp_path}/a.glb", size, {"lod": True}) > 600 << 20
    assert estimate(f"{tmp_path}/a.glb", size, {}) > 400 << 20
    assert estimate(f"{tmp_path}/a.glb", size, {"max_memory": "200M"}) == BASE + (200 << 20)
    assert estimate(f"{tmp_path}/a.glb", size, {"max_memory": "9G"}) > 400 << 20


def test_the_page_escapes_names_and_shows_failures_first(source, tmp_path, client):
    report = gltf_ext.batch(str(source), str(tmp_path / "out"), scheduler=client)
    text = page(report)
    assert "damaged &lt;b&gt;.stl" in text and "<b>" not in text
    assert text.index("is cut off") < text.index("0.glb")
    assert text.count("data:image/png;base64,") == 10


# --- processes that die ---


def test_a_killer_is_reported_once_and_stops_no_other(
    source, tmp_path, environment, start, undisturbed
):
    write_grid(source / "killer.glb")
    with socket.socket() as taken:
        if not is_open(8787):  # Dask's port: that it is taken is nothing to report
            taken.bind(("127.0.0.1", 8787))
            taken.listen()
        out, error = finished(start(*COMMAND, source, "out", "--workers", "2", "--json"), 2)
    # After ten seconds there is a line of progress.
    assert all(line.startswith("batch: ") for line in error.splitlines())
    report = json.loads(out)
    assert digests(tmp_path / "out") == undisturbed
    failed = {file["name"]: file["error"] for file in report["files"] if "error" in file}
    assert set(failed) == {"damaged <b>.stl", "killer.glb"}, failed
    assert "killed its worker" in failed["killer.glb"]
    assert Counter(name for _, name in environment.log())["killer.glb"] == 2
    for memory, tries in ((None, 2), ("500M", 4)):  # an option that changes
        options = ["--max-memory", memory] if memory else []
        out, _ = finished(start(*COMMAND, source, "out", "--workers", "2", "--json", *options), 2)
        failed = {f["name"]: f["error"] for f in json.loads(out)["files"] if "error" in f}
        assert "killed its worker" in failed["killer.glb"]
        assert ("in a former run" in failed["killer.glb"]) == (memory is None)
        assert Counter(name for _, name in environment.log())["killer.glb"] == tries


def test_workers_and_clients_that_are_killed(
    source, tmp_path, environment, start, cluster, undisturbed
):
    """One worker dies; then the client, and another goes on; over TCP."""
    address, *_ = cluster(free_port(), 2, BATCH_WAIT="0.3")
    command = [*COMMAND, source, "out", "--scheduler", address]
    client = start(*command)
    eventually(lambda: len(environment.log()) >= 2)
    os.kill(int(environment.log()[0][0]), signal.SIGKILL)
    records = tmp_path / "out" / STATE
    eventually(lambda: len(list(records.rglob("*.glb.json"))) >= 4)
    client.kill()
    client.wait()
    time.sleep(1)  # tasks that run are not stopped
    done = {p.name.removesuffix(".json") for p in records.rglob("*.glb.json")}
    before = len(environment.log())
    finished(start(*command), 2)
    assert digests(tmp_path / "out") == undisturbed
    again = {name for _, name in environment.log()[before:]}
    assert 4 <= len(done) < 10
    assert not again & done, "nothing that was done is done again"
    before = len(environment.log())
    finished(start(*command), 2)
    assert {name for _, name in environment.log()[before:]} == {"damaged <b>.stl"}


def test_a_scheduler_that_is_killed(source, tmp_path, environment, start, cluster, undisturbed):
    address, scheduler, _ = cluster(free_port(), 1, BATCH_WAIT="0.3")
    client = start(*COMMAND, source, "out", "--scheduler", address)
    eventually(lambda: len(list((tmp_path / "out").rglob("*.glb.json"))) >= 1)
    scheduler.kill()
    _, error = finished(client, 2)
    lines = [line for line in error.splitlines() if not line.startswith("batch: ")]  # progress
    assert lines == ["gltf-meshlet: the scheduler is gone; run again: what is done is kept"]
    address, *_ = cluster(free_port(), 2)
    finished(start(*COMMAND, source, "out", "--scheduler", address), 2)
    assert digests(tmp_path / "out") == undisturbed
    assert max(Counter(name for _, name in environment.log()).values()) <= 2


# --- the command ---


def test_the_command_prints_a_table(source, tmp_path, capsys, client, monkeypatch):
    address = client.scheduler.address
    arguments = ["batch", str(source / "deep"), str(tmp_path / "out"), "-vp", "10"]
    monkeypatch.setattr(batch_run, "_client", lambda *_: _given(client))
    assert cli.main([*arguments, "--scheduler", address]) == 0
    *_, line, totals = capsys.readouterr().out.splitlines()
    assert "same.obj (done)" in line and totals.startswith("2 done, 0 unchanged, 0 failed: ")
    assert cli.main([*arguments, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["options"] == {"position_bits": 10} and report["totals"]["unchanged"] == 2


def _given(client):
    from contextlib import nullcontext

    return nullcontext(client)


# --- 400 files: all models with nasty ones, under four choices of options ---


@pytest.fixture(
    scope="module",
    params=[(), ("-vp", "10"), ("--max-triangles", "32"), ("--effort", "fast")],
    ids=lambda options: " ".join(options) or "default",
)
def expected(request, tmp_path_factory):
    """(options, digests and errors of a run that nothing disturbs)."""
    folder = tmp_path_factory.mktemp("whole")
    command = [*COMMAND, MODELS, folder, "--workers", "2", "--json", *request.param]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert done.returncode == 2, "some are damaged"
    return request.param, digests(folder), errors(json.loads(done.stdout))


def errors(report):
    assert len(report["files"]) >= 100
    return [(file["name"], file.get("error")) for file in report["files"]]


class Disturbed:
    """A batch whose processes are killed. Fails if it does again what was done before a kill.

    folder: its destination.
    """

    def __init__(self, folder, environment):
        self.folder, self.environment = folder, environment
        self._done, self._before = set(), 0

    def records(self):
        self.folder.fs.invalidate_cache()
        found = self.folder.fs.find(self.folder.at(STATE))
        return {path for path in found if ".glb.json" in path}

    def wait(self, count, client):
        eventually(lambda: len(self.records()) >= count, LONG, client, every=0.5)

    def kill_a_worker(self):
        os.kill(int(self.environment.log()[-1][0]), signal.SIGKILL)

    def check(self):
        """Before each start of a client and after the last."""
        log = self.environment.log()
        again = {name for _, name in log[self._before :]}
        assert not again & self._done, "nothing that was done is done again"
        names = {os.path.basename(path).removesuffix(".json") for path in self.records()}
        self._done, self._before = names, len(self.environment.log())


@pytest.mark.full
def test_400_files_on_two_workers(expected, tmp_path, environment, start):
    """A worker dies, then the client with all workers; another client goes on."""
    options, outputs, messages = expected
    command = [*COMMAND, MODELS, "out", "--workers", "2", "--json", *options]
    batch = Disturbed(Folder(str(tmp_path / "out")), environment)
    client = start(*command)
    batch.wait(40, client)
    batch.kill_a_worker()
    batch.wait(60, client)
    client.kill()
    client.communicate()
    batch.check()
    report = json.loads(finished(start(*command), 2, LONG)[0])
    batch.check()
    assert digests(tmp_path / "out") == outputs and errors(report) == messages


@pytest.mark.full
def test_400_files_over_tcp_from_and_to_an_object_store(
    expected, tmp_path, environment, start, cluster, object_store
):
    """A worker dies, then the client, then the scheduler."""
    options, outputs, messages = expected
    bucket = Folder("s3://library")
    bucket.fs.put(str(MODELS), "library/models", recursive=True)
    command = [*COMMAND, "s3://library/models", "s3://library/out", "--json", *options]
    batch = Disturbed(Folder("s3://library/out"), environment)

    def started(address):
        batch.check()
        return start(*command, "--scheduler", address, **object_store)

    address, scheduler, _ = cluster(free_port(), 2, **object_store)
    client = started(address)
    batch.wait(30, client)
    batch.kill_a_worker()
    batch.wait(50, client)
    client.kill()
    client.communicate()
    client = started(address)
    batch.wait(70, client)
    scheduler.kill()
    assert "the scheduler is gone" in finished(client, 2)[1]
    address, *_ = cluster(free_port(), 2, **object_store)
    report = json.loads(finished(started(address), 2, LONG)[0])
    batch.check()
    bucket.fs.get("library/out", str(tmp_path / "got"), recursive=True)
    assert digests(tmp_path / "got") == outputs and errors(report) == messages


def test_grids_of_the_models_differ(source):
    """The test's own models are distinct, so that mixed-up outputs would be found."""
    sizes = [os.path.getsize(source / f"{i}.glb") for i in range(8)]
    assert len(np.unique(sizes)) == 8
