"""Batches that an operator leaves alone: what they check, remove, tell, and how long they wait."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from types import SimpleNamespace

import pytest

import gltf_ext
from gltf_ext import scheduler
from gltf_ext.batches import dispatch, progress, task, worker
from gltf_ext.batches.page import ROWS
from gltf_ext.batches.storage import STATE, Folder
from gltf_ext.batches.task import Job
from gltf_meshlet import cli
from tests.helpers.batch_reports import contents, errors, left_out, run_job, statuses
from tests.helpers.cluster import eventually, finished, free_port
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import write_grid

distributed = pytest.importorskip("distributed")
COMMAND = [sys.executable, "-m", "gltf_meshlet", "batch"]


@pytest.fixture
def source(tmp_path):
    for name in ("a.glb", "b.glb", "deep/c.glb"):
        (tmp_path / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        write_grid(tmp_path / "source" / name, 5 + len(name))
    return tmp_path / "source"


@pytest.fixture
def environment(environment, tmp_path):
    preload = f'["{ROOT}/tests/helpers/batch_preload.py"]'
    roles = {f"DASK_DISTRIBUTED__{role}__PRELOAD": preload for role in ("WORKER", "SCHEDULER")}
    return {**environment, **roles, "BATCH_LOG": str(tmp_path / "log")}


def log(tmp_path):
    """The names that workers were about to compress, in order."""
    path = tmp_path / "log"
    return (
        [line.split(" ", 1)[1] for line in path.read_text().splitlines()] if path.exists() else []
    )


def last_report(out):
    return json.loads((out / "batch.json").read_text())


# --- what an output depends on ---


def test_a_record_says_what_the_output_depends_on(source, tmp_path, compress_all):
    (source / "d.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (source / "m.mtl").write_text("newmtl m\nKd 1 0 0\nmap_Kd gone.png\n")
    compress_all(source, tmp_path / "out", position_bits=10)
    record = json.loads((tmp_path / "out" / STATE / "d.glb.json").read_text())
    assert record["inputs"].keys() == {"d.obj", "m.mtl", "gone.png"}
    digests = {name: file["digest"] for name, file in record["inputs"].items()}
    assert digests["m.mtl"] == task.digest_of(source / "m.mtl") and digests["gone.png"] is None
    assert record["options"] == {"position_bits": 10}
    assert (record["version"], record["format"]) == (task.VERSION, task.FORMAT)
    (constant,) = re.findall(r"BLOB_VERSION (\d+)", (ROOT / "codec/format/constants.h").read_text())
    assert int(constant) == task.FORMAT


def test_check_says_what_would_be_done_and_why(source, tmp_path, compress_all, capsys):
    out = tmp_path / "out"

    def reasons(**options):
        before = contents(out) if out.exists() else None
        report = compress_all(source, out, check=True, **options)
        assert before == (contents(out) if out.exists() else None), "nothing is written"
        return {file["name"]: file["reason"] for file in report["todo"]}, report

    assert reasons()[0] == dict.fromkeys(("a.glb", "b.glb", "deep/c.glb"), "is new")
    compress_all(source, out)
    todo, report = reasons()
    assert not todo and report["totals"]["unchanged"] == 3
    write_grid(source / "a.glb", 20)
    (out / "b.glb").unlink()
    (source / "deep" / "c.glb").unlink()
    (source / "link.glb").symlink_to("/nowhere")
    todo, report = reasons()
    assert todo == {"a.glb": "input a.glb has changed", "b.glb": "output b.glb is gone"}
    assert report["gone"] == ["deep/c.glb"] and list(errors(report)) == ["link.glb"]
    assert reasons(position_bits=9)[0]["a.glb"] == "has other options: position_bits default -> 9"
    path = out / STATE / "a.glb.json"
    path.write_text(path.read_text().replace(f'"version": "{task.VERSION}"', '"version": "0.1"'))
    assert "was made by gltf-meshlet 0.1, format 2; this is" in reasons()[0]["a.glb"]
    path.write_text("{")
    assert reasons()[0]["a.glb"] == "has no complete record"
    (source / "link.glb").unlink()
    assert cli.main(["batch", str(source), str(out), "--check"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[-2:] == ["deep/c.glb: its model is gone", "2 to do, 0 unchanged"]


# --- outputs whose models are gone ---


def test_outputs_of_models_that_are_gone_are_removed(source, tmp_path, compress_all):
    out = tmp_path / "out"
    compress_all(source, out, fallback=True)
    shutil.rmtree(source / "deep")
    asked = []
    report = compress_all(source, out, fallback=True, prune=lambda names: asked.append(names))
    assert asked == [["deep/c.fallback.bin", "deep/c.glb"]] == [report["gone"]]
    assert report["removed"] == [] and (out / "deep" / "c.glb").exists()
    report = compress_all(source, out, fallback=True, prune=True)
    assert report["removed"] == asked[0]
    assert not (out / "deep").exists() and not (out / STATE / "deep").exists()
    assert statuses(report) == {"a.glb": "unchanged", "b.glb": "unchanged"}
    assert compress_all(source, out, fallback=True)["leftover"] == []


def test_outputs_that_may_be_wanted_are_not_removed(source, tmp_path, compress_all):
    """Of models that are elsewhere, or on a disk that is not there, or changed by their user."""
    out, other = tmp_path / "out", tmp_path / "other"
    compress_all(source, out)
    other.mkdir()
    write_grid(other / "d.glb")
    report = compress_all(other, out, prune=True)
    assert len(report["leftover"]) == 3 and report["gone"] == []
    shutil.rmtree(source)
    assert compress_all(other, out, prune=True)["gone"] == []
    source.mkdir()
    assert compress_all(other, out, prune=True)["gone"] == []
    write_grid(source / "b.glb")
    (out / "a.glb").write_bytes(b"own work")
    report = compress_all(other, out, prune=True)
    assert report["removed"] == ["deep/c.glb"] and (out / "a.glb").read_bytes() == b"own work"


def test_the_command_asks_before_it_removes(source, tmp_path, compress_all, capsys, monkeypatch):
    arguments = ["batch", str(source), str(tmp_path / "out"), "--prune"]
    compress_all(source, tmp_path / "out")
    (source / "b.glb").unlink()
    assert cli.main(arguments) == 0
    printed = capsys.readouterr()
    assert "1 output of models that are gone: --yes removes them" in printed.err
    assert "which --prune removes" in printed.out and (tmp_path / "out" / "b.glb").exists()
    assert cli.main([*arguments, "--yes"]) == 0
    assert "removed 1 output" in capsys.readouterr().out
    assert not (tmp_path / "out" / "b.glb").exists()


# --- names ---


def test_a_line_of_a_list_changes_no_other_name(source, tmp_path, compress_all):
    entries = [f"{source}/a.glb"]
    (tmp_path / "list.txt").write_text("\n".join(entries))
    (name,) = statuses(compress_all(tmp_path / "list.txt", tmp_path / "out"))
    assert name == f"{source}/a.glb".lstrip("/")
    write_grid(tmp_path / "other.glb")
    (tmp_path / "list.txt").write_text("\n".join([*entries, f"{tmp_path}/other.glb"]))
    assert statuses(compress_all(tmp_path / "list.txt", tmp_path / "out"))[name] == "unchanged"
    report = compress_all(tmp_path / "list.txt", tmp_path / "short", root=str(source))
    assert statuses(report) == {"a.glb": "done"}
    assert left_out(report) == {"other.glb": f"lies outside {source}"}
    with pytest.raises(gltf_ext.MeshletError, match="root is for lists"):
        compress_all(source, tmp_path / "out", root=str(source))


# --- time ---


def test_a_file_that_takes_too_long(source, tmp_path, compress_all, monkeypatch):
    def slow(path, *arguments, **options):
        if path.name == "b.glb":
            time.sleep(2)
        return compress(path, *arguments, **options)

    compress = task.compress
    monkeypatch.setattr(task, "compress", slow)
    report = compress_all(source, tmp_path / "out", time_limit=0.7)
    assert errors(report) == {"b.glb": "took longer than its time limit of 0.7 seconds"}
    assert report["totals"]["done"] == 2 and report["time_limit"] == 0.7
    monkeypatch.setattr(task, "compress", compress)
    report = compress_all(source, tmp_path / "out", time_limit=0.7)
    assert "in a former run" in errors(report)["b.glb"], "it is not tried again"
    report = compress_all(source, tmp_path / "out", check=True)
    assert "time limit of 0.7 seconds" in report["todo"][0]["limit"]
    assert statuses(compress_all(source, tmp_path / "out", time_limit=30))["b.glb"] == "done"


def test_a_job_that_takes_too_long_ends_its_task(tmp_path, monkeypatch):
    """Those before it are done, and none begins after it, though its thread goes on."""
    begun, may_end = [], threading.Event()

    def run(job, folder):
        begun.append(job.name)
        if job.name == "b":
            may_end.wait(30)
        return {"name": job.name, "status": "done"}

    monkeypatch.setattr(task, "run", run)
    place = SimpleNamespace(local_directory=str(tmp_path))
    monkeypatch.setattr(distributed, "get_worker", lambda: place)
    jobs = [Job("x", name, "out", name, {}, task.VERSION) for name in "abc"]
    records = worker.work(jobs, 0.5)
    assert [r["status"] for r in records] == ["done", "failed"] and records[1]["limit"] == 0.5
    may_end.set()
    time.sleep(0.2)
    assert begun == ["a", "b"] and len(worker.work(jobs, 30)) == 3


@pytest.mark.parametrize("limit", [0, -1, "1", float("nan"), float("inf")])
def test_a_time_limit_that_is_none(source, tmp_path, limit):
    with pytest.raises(gltf_ext.MeshletError, match="use seconds above 0"):
        gltf_ext.batch(source, tmp_path / "out", time_limit=limit)


def test_a_worker_that_sleeps_is_started_again(source, tmp_path, start):
    os.rename(source / "a.glb", source / "sleeper.glb")
    command = [*COMMAND, source, "out", "--workers", "1", "--time-limit", "2", "--json"]
    report = json.loads(finished(start(*command), 2)[0])
    assert errors(report) == {"sleeper.glb": "took longer than its time limit of 2 seconds"}
    assert report["totals"]["done"] == 2


@pytest.mark.full
def test_a_worker_that_is_silent(source, tmp_path, environment, monkeypatch):
    """It is stopped, and counts as lost after a while: twice, then the file fails."""
    os.rename(source / "a.glb", source / "stopper.glb")
    monkeypatch.setattr(scheduler, "SILENCE", 3)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    with distributed.dask.config.set({"distributed.worker.preload": _preload(environment)}):
        report = gltf_ext.batch(source, tmp_path / "out", workers=2)
    assert "killed its worker, twice" in errors(report)["stopper.glb"]
    assert report["totals"]["done"] == 2


def _preload(environment):
    return json.loads(environment["DASK_DISTRIBUTED__WORKER__PRELOAD"])


def test_a_scheduler_that_is_silent(source, tmp_path, cluster, monkeypatch):
    address, program, _ = cluster(free_port(), 1, BATCH_WAIT="0.5")
    monkeypatch.setattr(scheduler, "SILENCE", 2)

    def stop(event):
        if event["event"] == "file":
            os.kill(program.pid, signal.SIGSTOP)

    with pytest.raises(gltf_ext.MeshletError, match="has not answered for 2 seconds; run again"):
        gltf_ext.batch(source, tmp_path / "out", scheduler=address, progress=stop)
    report = last_report(tmp_path / "out")
    assert "has not answered for 2 seconds" in report["stopped"]
    assert report["totals"]["done"] >= 1
    assert all(error.startswith("not done: the scheduler") for error in errors(report).values())


def test_a_scheduler_without_workers(source, tmp_path, cluster, monkeypatch):
    address, *_ = cluster(free_port(), 0)
    monkeypatch.setattr(scheduler, "NO_WORKERS", 1)
    with pytest.raises(gltf_ext.MeshletError, match="no workers for 1 seconds"):
        gltf_ext.batch(source, tmp_path / "out", scheduler=address)
    report = last_report(tmp_path / "out")
    assert "no workers for 1 seconds" in report["stopped"] and len(errors(report)) == 3
    assert "Stopped: the scheduler" in (tmp_path / "out" / "batch.html").read_text()


# --- interrupted, killed ---


def test_ctrl_c_ends_with_a_report(source, tmp_path, start):
    command = [*COMMAND, source, "out", "--workers", "2"]
    process = start(*command, BATCH_WAIT="30", session=True)
    eventually(lambda: log(tmp_path))
    assert last_report(tmp_path / "out")["stopped"] == "it has not ended"
    os.killpg(process.pid, signal.SIGINT)
    _, error = finished(process, 130)
    assert "Traceback" not in error
    report = last_report(tmp_path / "out")
    assert report["stopped"] == "it was interrupted" and len(errors(report)) == 3


def test_standard_output_that_is_closed(source, tmp_path):
    command = f"exec {sys.executable} -m gltf_meshlet batch {source} {tmp_path}/out --check >&-"
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("gltf-meshlet: standard output: it is closed; ")


# --- clusters ---


@pytest.mark.parametrize(
    "version, line", [("9.9", "has gltf-meshlet 9.9, this is"), ("none", "has no")]
)
@pytest.mark.parametrize("role", ["WORKER", "SCHEDULER"])
def test_programs_of_other_versions(source, tmp_path, cluster, monkeypatch, role, version, line):
    other = "SCHEDULER" if role == "WORKER" else "WORKER"
    monkeypatch.setattr(scheduler, "NO_WORKERS", 20)
    more = {"BATCH_VERSION": version, f"DASK_DISTRIBUTED__{other}__PRELOAD": "[]"}
    address, *_ = cluster(free_port(), 1, scheduler=more, **more)
    with pytest.raises(gltf_ext.MeshletError, match=line) as caught:
        gltf_ext.batch(source, tmp_path / "out", scheduler=address)
    assert str(caught.value).startswith(f"the {role.lower()}")
    assert "pip install 'gltf-meshlet[batch]==" in str(caught.value)
    assert log(tmp_path) == [], "it is said before the first file"


def test_a_killer_kills_two_workers_of_any_cluster(source, tmp_path, cluster):
    """Dask would try it on four workers, and again on four."""
    os.rename(source / "a.glb", source / "killer.glb")
    address, *_ = cluster(free_port(), 2)
    report = gltf_ext.batch(source, tmp_path / "out", scheduler=address)
    assert report["totals"]["done"] == 2
    error = errors(report)["killer.glb"]
    assert "killed its worker, twice" in error and "lack of memory" in error
    assert "its worker has 1,000 MB" in error
    assert Counter(log(tmp_path))["killer.glb"] == 2


# --- many ---


def test_small_files_share_tasks(tmp_path, compress_all, monkeypatch):
    (tmp_path / "many").mkdir()
    data = write_grid(tmp_path / "grid.glb", 4).read_bytes()
    for i in range(300):
        (tmp_path / "many" / f"{i}.glb").write_bytes(data)
    (tmp_path / "many" / "7.glb").write_bytes(data[:100])
    tasks = []
    submit = scheduler.Workers.submit

    def counting(self, function, *arguments, **options):
        tasks.append(len(arguments[0]))
        return submit(self, function, *arguments, **options)

    monkeypatch.setattr(scheduler.Workers, "submit", counting)
    monkeypatch.setattr(worker, "LONGEST", 600)  # no rest goes back, however slow the machine is
    events = []
    report = compress_all(tmp_path / "many", tmp_path / "out", progress=events.append)
    assert [event for event in events if event["event"] == "lost"] == []
    assert (report["totals"]["done"], report["totals"]["failed"]) == (299, 1)
    assert sum(tasks) == 300 and len(tasks) < 20 and max(tasks) <= dispatch.TASK_JOBS


def test_what_may_pass_is_tried_three_times(source, tmp_path, compress_all, monkeypatch):
    calls = Counter()

    def failing(path, *arguments, **options):
        calls[path.name] += 1
        if path.name == "a.glb" or (path.name == "b.glb" and calls[path.name] < 3):
            raise ConnectionError("the network is down")
        return compress(path, *arguments, **options)

    compress = task.compress
    monkeypatch.setattr(task, "compress", failing)
    report = compress_all(source, tmp_path / "out")
    assert errors(report) == {"a.glb": "ConnectionError: the network is down"}
    assert calls == {"a.glb": 3, "b.glb": 3, "c.glb": 1}


def test_pages_of_many_files(source, tmp_path, compress_all):
    out = tmp_path / "out"
    report = compress_all(source, out)
    file = report["files"][0]
    many = {**report, "files": [{**file, "name": f"{i}.glb"} for i in range(2 * ROWS + 1)]}
    from gltf_ext.batches.reports import write

    write(Folder(str(out)), many)
    texts = [(out / name).read_text() for name in ("batch.html", f"{STATE}/page-2.html")]
    assert all(text.count("<img ") == ROWS and len(text) < 1 << 20 for text in texts)
    assert f'href="{STATE}/page-3.html"' in texts[0] and 'href="../batch.html"' in texts[1]
    assert f'href="../{STATE}/page-3.html"' in texts[1] and "<b>2</b>" in texts[1]
    compress_all(source, out)
    assert not (out / STATE / "page-2.html").exists() and not (out / STATE / "page-3.html").exists()
    assert "<nav" not in (out / "batch.html").read_text()


# --- progress ---


def test_an_event_for_each_file(source, tmp_path, compress_all, capsys):
    (source / "bad.glb").write_bytes(b"glTF")
    events = []
    compress_all(source, tmp_path / "out", progress=events.append)
    assert events[0] == {"event": "start", "files": 4, "unchanged": 0, "failed": 0}
    files = {event["name"]: event["status"] for event in events[1:-1]}
    assert [event["ended"] for event in events[1:-1]] == [1, 2, 3, 4]
    assert Counter(files.values()) == {"done": 3, "failed": 1} and events[-1]["event"] == "end"
    (source / "bad.glb").unlink()
    assert cli.main(["batch", str(source), str(tmp_path / "out"), "--progress", "json"]) == 0
    first, last = map(json.loads, capsys.readouterr().out.splitlines())
    assert first["unchanged"] == 3 and last["totals"]["unchanged"] == 3


def test_a_line_from_time_to_time_in_a_pipe(source, tmp_path, compress_all, capsys, monkeypatch):
    compress_all(source, tmp_path / "out", progress=True)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress, "INTERVAL", 0)
    (source / "bad.glb").write_bytes(b"glTF")
    compress_all(source, tmp_path / "out", position_bits=9, progress=True)
    lines = capsys.readouterr().err.splitlines()
    assert all(re.match(r"batch: \d of 4 files", line) for line in lines) and len(lines) >= 2
    assert lines[-1].startswith("batch: 4 of 4 files, 1 failed, about 0 s left")


# --- a worker's folder ---


def test_a_job_leaves_its_folder_empty(source, tmp_path):
    job = Job(f"{source}/a.glb", "a.glb", str(tmp_path / "out"), "a.glb", {}, task.VERSION)
    assert run_job(job)["status"] == "done"
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    job = Job(f"{source}/b.glb", "b.glb", str(tmp_path / "out"), "b.glb", {}, task.VERSION)
    assert task.run(job, scratch)["status"] == "done" and not [*scratch.iterdir()]


def test_a_job_that_runs_twice_in_a_batch_is_done(source, tmp_path, compress_all, monkeypatch):
    """The worker is lost between the record and the result."""

    def twice(*arguments):
        run(*arguments)
        return run(*arguments)

    run = task.run
    monkeypatch.setattr(task, "run", twice)
    assert compress_all(source, tmp_path / "out")["totals"]["done"] == 3
    assert compress_all(source, tmp_path / "out")["totals"]["unchanged"] == 3


def test_estimates_bound_what_was_measured():
    """The committed result of bench.batch_memory."""
    result = json.loads((ROOT / "bench" / "results" / "batch_memory.json").read_text())
    parts = sorted(row["peak_bytes"] / row["estimate"] for row in result["rows"])
    assert len(parts) >= 200 and parts[-1] <= 1 and parts[len(parts) // 2] >= 0.4
