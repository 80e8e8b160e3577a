"""Batches that run again: after errors, from other sources, over files that users put there."""

import errno
import json
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import gltf_ext
from gltf_ext.batches import finding, storage
from gltf_ext.batches.finding import find_models
from gltf_ext.batches.storage import OUTPUTS, STATE, Folder, Outputs
from tests.helpers.batch_reports import errors, statuses
from tests.helpers.gltf_builder import write_grid

pytest.importorskip("distributed")
fsspec = pytest.importorskip("fsspec")
TRIANGLE = "v 0 0 {}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NOT_ITS = "is not as a batch wrote it"


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "source"
    folder.mkdir()
    write_grid(folder / "a.glb")
    return folder


@pytest.fixture
def memory():
    """A storage that is no disk, empty."""
    storage = fsspec.filesystem("memory")
    storage.store.clear()
    yield storage
    storage.store.clear()


def triangle(path, z=0):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(TRIANGLE.format(z))
    return path


# --- errors ---


def refuse(monkeypatch, kind, method, ending):
    """Lets a method of a class fail for files whose names have an ending."""
    original = getattr(kind, method)

    def failing(self, name, *arguments, **options):
        if name.endswith(ending):
            raise OSError(errno.ENOSPC, "No space left on device", name)
        return original(self, name, *arguments, **options)

    monkeypatch.setattr(kind, method, failing)


@pytest.mark.parametrize("changed", [False, True])
def test_a_record_that_cannot_be_written(source, tmp_path, compress_all, monkeypatch, changed):
    """The outputs are there: the next run must know them as its own."""
    out = tmp_path / "out"
    if changed:
        compress_all(source, out)
        write_grid(source / "a.glb", 12)
    refuse(monkeypatch, storage.Folder, "write", ".glb.json")
    assert "No space left" in errors(compress_all(source, out))["a.glb"]
    assert (out / "a.glb").exists()
    monkeypatch.undo()
    assert statuses(compress_all(source, out)) == {"a.glb": "done"}
    assert statuses(compress_all(source, out)) == {"a.glb": "unchanged"}


def test_a_worker_that_dies_between_an_output_and_its_record(
    source, tmp_path, compress_all, monkeypatch
):
    """The output is another one than that of the former record."""
    out = tmp_path / "out"
    compress_all(source, out)
    former = (out / "a.glb").read_bytes()
    write_grid(source / "a.glb", 12)

    def dying(self, name, data):
        if name.endswith(".glb.json") and (out / "a.glb").read_bytes() != former:
            raise OSError(errno.EIO, "killed", name)
        write(self, name, data)

    write = storage.Folder.write
    monkeypatch.setattr(storage.Folder, "write", dying)
    assert "killed" in errors(compress_all(source, out))["a.glb"]
    assert (out / "a.glb").read_bytes() != former
    monkeypatch.undo()
    assert statuses(compress_all(source, out)) == {"a.glb": "done"}
    assert statuses(compress_all(source, out)) == {"a.glb": "unchanged"}


def test_an_output_that_cannot_be_written_after_another(source, memory, compress_all, monkeypatch):
    refuse(monkeypatch, type(memory), "pipe_file", "/a.glb")
    report = compress_all(source, "memory://out", fallback=True)
    assert "No space left" in errors(report)["a.glb"] and memory.exists("/out/a.fallback.bin")
    monkeypatch.undo()
    assert statuses(compress_all(source, "memory://out", fallback=True)) == {"a.glb": "done"}


def test_files_that_users_put_where_a_job_failed(source, tmp_path, compress_all):
    out = tmp_path / "out"
    (source / "a.glb").write_bytes(b"no model")
    assert "a.glb" in errors(compress_all(source, out))
    (out / "a.glb").write_bytes(b"own work")
    write_grid(source / "a.glb")
    assert "no batch wrote it" in errors(compress_all(source, out))["a.glb"]
    assert (out / "a.glb").read_bytes() == b"own work"


def test_all_outputs_of_a_model_or_none_are_replaced(source, tmp_path, compress_all, monkeypatch):
    """Another program holds the .glb open, as on Windows."""
    out = tmp_path / "out"
    compress_all(source, out, fallback=True)
    before = {name: (out / name).read_bytes() for name in ("a.glb", "a.fallback.bin")}
    write_grid(source / "a.glb", 12)

    def hold(path, target):
        if str(target) == f"{out}/a.glb":
            raise PermissionError(13, "in use", str(target))
        replace(path, target)

    replace = os.replace
    monkeypatch.setattr(os, "replace", hold)
    assert "in use" in errors(compress_all(source, out, fallback=True))["a.glb"]
    monkeypatch.undo()
    assert {name: (out / name).read_bytes() for name in before} == before
    assert not [*(out / STATE).glob("*.part"), *(out / STATE).glob("*.former")]
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "done"}
    assert (out / "a.fallback.bin").read_bytes() != before["a.fallback.bin"]


def test_a_storage_that_fails_for_one_reference(memory, tmp_path, compress_all, monkeypatch):
    for name in "ab":
        text = f"mtllib {name}.mtl\nusemtl m\n{TRIANGLE.format(0)}"
        memory.pipe_file(f"/in/{name}.obj", text.encode())
        memory.pipe_file(f"/in/{name}.mtl", b"newmtl m\nKd 1 0 0\n")
    info = type(memory).info  # with times of another type than in its lists
    monkeypatch.setattr(
        type(memory),
        "info",
        lambda *args: {**info(*args), "created": info(*args)["created"].timestamp()},
    )
    compress_all("memory://in", tmp_path / "out")
    refuse(monkeypatch, type(memory), "info", "b.mtl")
    report = compress_all("memory://in", tmp_path / "out")
    assert statuses(report) == {"a.obj": "unchanged", "b.obj": "failed"}
    assert "No space left" in errors(report)["b.obj"]


# --- other sources ---


def size_only(path):
    return str(os.path.getsize(path)) if os.path.isfile(path) else None


@pytest.mark.parametrize("by", ["address", "stamp"])
def test_another_source_of_the_same_size_and_time(tmp_path, compress_all, monkeypatch, by):
    first = triangle(tmp_path / "one" / "a.obj", 1)
    second = triangle(tmp_path / ("two" if by == "address" else "one") / "a.obj", 1)
    if by == "address":
        for module in (finding, storage):
            monkeypatch.setattr(module, "stamp_of_file", size_only)
    os.utime(first, (1, 1))
    compress_all(first.parent, tmp_path / "out")
    before = (tmp_path / "out" / "a.glb").read_bytes()
    triangle(second, 2)
    os.utime(second, (1, 1))
    assert statuses(compress_all(second.parent, tmp_path / "out")) == {"a.obj": "done"}
    assert (tmp_path / "out" / "a.glb").read_bytes() != before


def test_the_same_bytes_elsewhere_are_not_compressed_again(tmp_path, compress_all):
    for name in ("one", "two"):
        triangle(tmp_path / name / "a.obj")
    compress_all(tmp_path / "one", tmp_path / "out")
    for _ in range(2):
        report = compress_all(tmp_path / "two", tmp_path / "out")
        assert statuses(report) == {"a.obj": "unchanged"}
        assert report["files"][0]["source"] == str(tmp_path / "two" / "a.obj")


# --- options ---


@pytest.mark.parametrize(
    "given, plain",
    [
        ({"work_dir": Path("/tmp")}, {"work_dir": "/tmp"}),
        ({"position_bits": np.int64(11)}, {"position_bits": 11}),
        ({"lambda_": np.float32(1.5), "step": np.float64(0.01)}, {"lambda_": 1.5, "step": 0.01}),
        ({"effort": np.str_("fast"), "step": None}, {"effort": "fast", "step": None}),
    ],
)
def test_options_of_other_types(source, tmp_path, compress_all, given, plain):
    report = compress_all(source, tmp_path / "out", **given)
    assert statuses(report) == {"a.glb": "done"} and report["options"] == plain
    assert json.loads((tmp_path / "out" / "batch.json").read_text()) == report
    for options in (given, plain):
        report = compress_all(source, tmp_path / "out", **options)
        assert statuses(report) == {"a.glb": "unchanged"}


def test_a_pool_of_threads_is_no_cluster(source, tmp_path):
    with ThreadPoolExecutor() as pool, pytest.raises(gltf_ext.MeshletError, match="use an address"):
        gltf_ext.batch(source, tmp_path / "out", scheduler=pool)


# --- names ---


def found_in(*entries):
    nowhere = Folder("/nowhere")
    found = find_models(list(entries), nowhere, Outputs(nowhere))
    return {model.url: model.name for model in found.models}, found.left_out


def test_colons_in_names(tmp_path, client):
    models = [triangle(tmp_path / "in" / name, z) for z, name in enumerate(("a:b.obj", "ab.obj"))]
    report = gltf_ext.batch(models, tmp_path / "out", scheduler=client)
    assert {os.path.basename(name) for name in statuses(report)} == {"a:b.obj", "ab.obj"}
    assert report["totals"]["done"] == 2


def test_addresses_of_several_storages(memory, tmp_path, client):
    path = triangle(tmp_path / "x.obj")
    memory.pipe_file(str(path), path.read_bytes())
    report = gltf_ext.batch([path, f"memory:/{path}"], tmp_path / "out", scheduler=client)
    assert statuses(report) == {f"{path}"[1:]: "done", f"memory{path}": "done"}
    names, _ = found_in("nope://x/y/a.glb", "nope2://x/y/a.glb")
    assert set(names.values()) == {"nope/x/y/a.glb", "nope2/x/y/a.glb"}


def test_addresses_that_give_the_same_name():
    names, left = found_in("nope://x/a.glb", "nope://x//a.glb", "nope://y/a.glb")
    assert sorted(names.values()) == ["nope/x/a.glb", "nope/y/a.glb"]
    ((other, reason),) = left.items()
    assert {other, *names} == {"nope://x/a.glb", "nope://x//a.glb", "nope://y/a.glb"}
    assert reason.startswith("has the name nope/x/a.glb, as nope://x/") and "by itself" in reason


def test_paths_with_a_zero_byte(source, tmp_path, client):
    entries = [source / "a.glb", f"{source}/no\0/b.glb", f"{source}/no\0.glb"]
    report = gltf_ext.batch(entries, tmp_path / "out", scheduler=client)
    assert statuses(report)[f"{source}/a.glb"[1:]] == "done"
    assert list(errors(report).values()) == ["is no path; check it"] * 2
    for paths in ((f"{source}\0", tmp_path / "out"), (source, f"{tmp_path}/o\0")):
        with pytest.raises(gltf_ext.MeshletError, match="null"):
            gltf_ext.batch(*paths, scheduler=client)


# --- globs ---


def test_what_no_pattern_can_match_is_not_looked_at(tmp_path, compress_all, monkeypatch):
    triangle(tmp_path / "one" / "x" / "a.obj")
    triangle(tmp_path / "one" / "y" / "deep" / "a.obj")
    triangle(tmp_path / "two" / "x" / "b.obj")
    for link in ("link", "one/link", "one/y/link"):
        (tmp_path / link).symlink_to(tmp_path / "two")
    seen = []
    scandir = os.scandir
    monkeypatch.setattr(os, "scandir", lambda path: seen.append(path) or scandir(path))

    def names(pattern):
        seen.clear()
        report = compress_all(tmp_path / pattern, tmp_path / "out" / "put")
        return [*statuses(report)], [item["path"] for item in report["left_out"]]

    assert names("o*e/x/*.obj") == (["one/x/a.obj"], [])
    assert f"{tmp_path}/one/x" in seen and not {f"{tmp_path}/two", f"{tmp_path}/one/y"} & {*seen}
    assert names("one/[xl]*/*.obj") == (["x/a.obj"], [f"{tmp_path}/one/link"])
    assert names("*/y/**/*.obj") == (
        ["one/y/deep/a.obj"],
        [f"{tmp_path}/link", f"{tmp_path}/one/y/link"],
    )


# --- files of users ---


def test_fallbacks_that_no_batch_wrote_are_kept(source, tmp_path, compress_all):
    out = tmp_path / "out"
    compress_all(source, out)
    (out / "a.fallback.bin").write_bytes(b"own work")
    report = compress_all(source, out, fallback=True)
    assert "a.fallback.bin exists, and no batch wrote it" in errors(report)["a.glb"]
    assert (out / "a.fallback.bin").read_bytes() == b"own work"


@pytest.mark.parametrize("listed", [None, "{", '"a.glb"', '{"a.glb": 1}'])
def test_the_list_of_outputs_is_lost(source, tmp_path, compress_all, listed):
    out = tmp_path / "out"
    compress_all(source, out, fallback=True)
    (out / OUTPUTS).unlink()
    if listed is not None:
        (out / OUTPUTS).write_text(listed)
    write_grid(source / "a.glb", 12)
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "done"}


@pytest.mark.parametrize("where", ["disk", "memory"])
@pytest.mark.parametrize("name", ["a.glb", "a.fallback.bin"])
def test_outputs_that_users_replaced_are_kept(source, tmp_path, memory, compress_all, where, name):
    out = str(tmp_path / "out") if where == "disk" else "memory://out"
    folder = Folder(out)
    compress_all(source, out, fallback=True)
    folder.write(name, b"own work")
    for change in (lambda: None, lambda: write_grid(source / "a.glb", 12)):
        change()
        report = compress_all(source, out, fallback=True)
        assert f"{name} {NOT_ITS}" in errors(report)["a.glb"]
        assert folder.read(name) == b"own work"
    folder.fs.rm_file(folder.at(name))
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "done"}
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "unchanged"}


def test_an_output_of_former_options_that_a_user_replaced(source, tmp_path, compress_all):
    out = tmp_path / "out"
    for fallback in (True, False, True, False, False):
        report = compress_all(source, out, fallback=fallback)
    assert statuses(report) == {"a.glb": "unchanged"}
    (out / "a.fallback.bin").write_bytes(b"own work")
    assert NOT_ITS in errors(compress_all(source, out, fallback=True))["a.glb"]
    assert (out / "a.fallback.bin").read_bytes() == b"own work"


def test_files_that_another_batch_is_writing_are_kept(source, tmp_path, compress_all, monkeypatch):
    state = tmp_path / "out" / STATE
    state.mkdir(parents=True)
    for name in ("a.part", "b.former"):
        (state / name).write_bytes(b"")
    now = time.time
    for days, there in ((0.9, {"a.part", "b.former"}), (1.1, set())):
        monkeypatch.setattr(time, "time", lambda days=days: now() + days * 86400)
        compress_all(source, tmp_path / "out")
        assert {p.name for p in state.iterdir()} == {"a.glb.json", "outputs.json", *there}
