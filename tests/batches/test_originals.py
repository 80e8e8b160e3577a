"""Batches lose nothing: originals, files that changed, entries that are bad or left out."""

import json
import os
import socket
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from PIL import Image

import gltf_ext
from gltf_ext import scheduler
from gltf_ext.batches import dispatch, finding, storage, task, thumbnail
from gltf_ext.batches.finding import output_names
from gltf_ext.batches.page import page
from gltf_ext.batches.storage import OUTPUTS, STATE
from gltf_ext.batches.task import Job
from gltf_ext.sources.importers import open_model
from gltf_meshlet import cli
from tests.helpers.batch_reports import contents, errors, left_out, run_job, statuses
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh, write_grid

pytest.importorskip("distributed")
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n"


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "source"
    folder.mkdir()
    write_grid(folder / "a.glb")
    return folder


# --- originals ---


@pytest.mark.parametrize("destination", ["source/../source", "link", "source/.", "inner/.."])
def test_the_sources_folder_under_another_name(source, tmp_path, compress_all, destination):
    (tmp_path / "link").symlink_to(source)
    (tmp_path / "inner").symlink_to(source / "sub")
    (source / "sub").mkdir()
    before = contents(source)
    with pytest.raises(gltf_ext.MeshletError, match="holds the models too"):
        compress_all(source, tmp_path / destination)
    assert contents(source) == before


def test_originals_in_a_destination_inside_the_source(source, compress_all):
    inside = source / "sub"
    inside.mkdir()
    (source / "b.obj").write_text(TRIANGLE + "f 1 2 3\n")
    original = write_grid(inside / "b.glb", 5).read_bytes()
    write_grid(inside / "other.glb", 6)
    for status in ("done", "unchanged"):
        report = compress_all(source, inside)
        assert statuses(report) == {"a.glb": status, "b.obj": "failed"}
        assert "b.glb exists, and no batch wrote it" in errors(report)["b.obj"]
        assert set(left_out(report)) == {"b.glb", "other.glb"}
        assert report["totals"]["left_out"] == 2
        assert (inside / "b.glb").read_bytes() == original
    assert report["skipped"] == ["a.glb"]
    (inside / "b.glb").unlink()
    report = compress_all(source, inside)
    assert statuses(report) == {"a.glb": "unchanged", "b.obj": "done"}
    assert set(left_out(report)) == {"other.glb"}


def test_files_that_no_batch_wrote_are_kept(source, tmp_path, compress_all):
    """In a destination apart from the source, also where a side file would be."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "a.fallback.bin").write_bytes(b"of another model")
    assert "a.fallback.bin exists" in errors(compress_all(source, out, fallback=True))["a.glb"]
    assert (out / "a.fallback.bin").read_bytes() == b"of another model"
    assert not (out / "a.glb").exists()
    (out / "a.fallback.bin").unlink()
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "done"}
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "unchanged"}


def test_reports_that_no_batch_wrote_are_kept(source, tmp_path, compress_all):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "batch.json").write_text("mine")
    with pytest.raises(gltf_ext.MeshletError, match=r"batch\.json: exists, and no batch wrote it"):
        compress_all(source, tmp_path / "out")
    assert (tmp_path / "out" / "batch.json").read_text() == "mine"


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_an_output_that_is_a_model_by_a_link(source, tmp_path, compress_all, link):
    """The former output was replaced by a link to a model of the run."""
    out = tmp_path / "out"
    compress_all(source, out)
    original = write_grid(source / "b.glb", 5).read_bytes()
    (out / "a.glb").unlink()
    link(source / "b.glb", out / "a.glb")
    report = compress_all(source, out)
    assert "a.glb is the model b.glb" in errors(report)["a.glb"]
    assert statuses(report)["b.glb"] == "done"
    assert (source / "b.glb").read_bytes() == original and (out / "a.glb").samefile(
        source / "b.glb"
    )


def test_a_file_that_the_model_reads(source, tmp_path):
    """The destination's former output is a texture of the model."""
    out = tmp_path / "out"
    out.mkdir()
    Image.new("RGB", (2, 2)).save(source / "pixels.png")
    os.link(source / "pixels.png", out / "b.glb")
    (source / "b.obj").write_text(f"mtllib m.mtl\nusemtl m\n{TRIANGLE}f 1/1 2/1 3/1\n")
    (source / "m.mtl").write_text("newmtl m\nmap_Kd pixels.png\n")
    before = contents(source)
    record = run_job(Job(f"{source}/b.obj", "b.obj", str(out), "b.glb", {}, task.VERSION))
    assert record["status"] == "failed" and "is the input too" in record["error"]
    assert contents(source) == before


def test_names_that_lead_out_of_the_destination(source, tmp_path, client):
    """A list's names are from the real folder that holds all."""
    (tmp_path / "deep" / "er").mkdir(parents=True)
    above = write_grid(tmp_path / "above.glb", 5)
    entries = [str(source / "a.glb"), str(tmp_path / "deep" / "er" / ".." / ".." / "above.glb")]
    before = above.read_bytes()
    report = gltf_ext.batch(entries, str(tmp_path / "deep" / "er"), scheduler=client)
    names = {f"{tmp_path}/{name}"[1:] for name in ("above.glb", "source/a.glb")}
    assert statuses(report) == dict.fromkeys(names, "done")
    assert above.read_bytes() == before
    assert (tmp_path / "deep" / "er" / f"{tmp_path}/above.glb"[1:]).exists()
    assert [finding.is_safe(n) for n in ("a/b.glb", "../b.glb", f"{STATE}/b.glb", "a//b.glb")] == [
        True,
        False,
        False,
        False,
    ]


# --- outputs ---


@pytest.mark.parametrize(
    "names, outputs",
    [
        (["a.obj", "b.obj"], ["a.glb", "b.glb"]),
        (["a.obj", "a.glb"], ["a.obj.glb", "a.glb.glb"]),
        (["a.obj", "a.glb", "a.obj.glb"], ["a.obj.2.glb", "a.glb.glb", "a.obj.glb.glb"]),
        (["x.obj", "x.glb/y.obj"], ["x.obj.glb", "x.glb/y.glb"]),
        (
            ["x.obj", "x.glb/y.obj", "x.obj.glb/z.stl"],
            ["x.obj.2.glb", "x.glb/y.glb", "x.obj.glb/z.glb"],
        ),
        (["A.obj", "a.obj"], ["A.glb", "a.glb"]),
    ],
)
def test_no_two_models_share_an_output(names, outputs):
    assert list(output_names(names).values()) == outputs


def test_outputs_differ_where_case_does_not_count():
    assert output_names(["A.obj", "a.obj"], ignore_case=True) == {
        "A.obj": "A.obj.2.glb",
        "a.obj": "a.obj.3.glb",
    }


def test_a_destination_where_case_does_not_count(source, tmp_path, compress_all, monkeypatch):
    (source / "A.obj").write_text(TRIANGLE + "f 1 2 3\n")
    monkeypatch.setattr(storage.Folder, "ignores_case", lambda _: True)
    for status in ("done", "unchanged"):
        report = compress_all(source, tmp_path / "out")
        assert statuses(report) == {"A.obj": status, "a.glb": status}
        assert {file["output"] for file in report["files"]} == {"A.obj.glb", "a.glb.glb"}


def test_models_of_the_same_name_and_a_folder(source, tmp_path, compress_all):
    write_grid(source / "a.obj.glb", 5)
    for name in ("a.obj", "x.obj", "x.glb/y.obj"):
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_text(TRIANGLE + "f 1 2 3\n")
    report = compress_all(source, tmp_path / "out")
    assert set(statuses(report).values()) == {"done"}
    outputs = {file["output"]: file["triangles"] for file in report["files"]}
    assert len(outputs) == 5
    for output, triangles in outputs.items():
        assert gltf_ext.inspect(tmp_path / "out" / output)["totals"]["triangles"] == triangles


def test_an_output_that_is_a_folder(source, tmp_path, compress_all):
    (tmp_path / "out" / "a.glb").mkdir(parents=True)
    write_grid(source / "b.glb")
    report = compress_all(source, tmp_path / "out")
    assert statuses(report) == {"a.glb": "failed", "b.glb": "done"}
    assert "is a folder" in errors(report)["a.glb"]


def test_outputs_of_a_batch_that_was_killed_are_its_own(
    source, tmp_path, compress_all, monkeypatch
):
    """It is killed between an output and its record."""
    out = tmp_path / "out"

    def killed(folder, name, data):
        if name.startswith(STATE) and name != OUTPUTS:
            raise Killed
        write(folder, name, data)

    class Killed(BaseException):
        pass

    def run(self):
        for job in self._plan.open_jobs():
            run_job(job)

    write = storage.Folder.write
    monkeypatch.setattr(storage.Folder, "write", killed)
    monkeypatch.setattr(dispatch.Dispatch, "run", run)
    with pytest.raises(Killed):
        compress_all(source, out)
    monkeypatch.undo()
    assert (out / "a.glb").exists() and not (out / STATE / "a.glb.json").exists()
    assert statuses(compress_all(source, out)) == {"a.glb": "done"}


def test_outputs_of_models_that_are_gone_are_named(source, tmp_path, compress_all):
    write_grid(source / "b.glb")
    compress_all(source, tmp_path / "out", fallback=True)
    (source / "b.glb").unlink()
    report = compress_all(source, tmp_path / "out", fallback=True)
    assert report["leftover"] == ["b.fallback.bin", "b.glb"]
    assert (tmp_path / "out" / "b.glb").exists()


# --- what changed ---


@pytest.fixture
def library(source):
    """Models that read other files: a .gltf with a .bin, an .obj with materials and a texture."""
    positions, triangles = grid_mesh(6, 6)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    properties = glb_json(builder.write(source / "b.glb"))
    size = properties["buffers"][0]["byteLength"]
    (source / "b.bin").write_bytes((source / "b.glb").read_bytes()[-size:])
    (source / "b.glb").unlink()
    properties["buffers"][0]["uri"] = "b.bin"
    (source / "b.gltf").write_text(json.dumps(properties))
    (source / "c.obj").write_text(f"mtllib m.mtl\nusemtl m\n{TRIANGLE}f 1/1 2/1 3/1\n")
    (source / "m.mtl").write_text("newmtl m\nKd 1 0 0\nmap_Kd t.png\n")
    Image.new("RGB", (2, 2)).save(source / "t.png")
    return source


def change_byte(path):
    data = bytearray(path.read_bytes())
    data[0] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    "change, again",
    [
        (lambda folder: change_byte(folder / "b.bin"), {"b.gltf"}),
        (lambda folder: (folder / "m.mtl").write_text("newmtl m\nKd 0 1 0\n"), {"c.obj"}),
        (lambda folder: Image.new("RGB", (3, 3)).save(folder / "t.png"), {"c.obj"}),
        (lambda folder: (folder / "t.png").unlink(), {"c.obj"}),
        (lambda folder: os.utime(folder / "b.bin", (1, 1)), set()),
    ],
)
def test_what_reads_a_file_that_changed_is_made_again(
    library, tmp_path, compress_all, change, again
):
    assert set(statuses(compress_all(library, tmp_path / "out")).values()) == {"done"}
    assert set(statuses(compress_all(library, tmp_path / "out")).values()) == {"unchanged"}
    before = (tmp_path / "out" / "c.glb").read_bytes()
    change(library)
    report = compress_all(library, tmp_path / "out")
    assert {name for name, status in statuses(report).items() if status == "done"} == again
    assert not errors(report)
    assert ("c.obj" in again) == ((tmp_path / "out" / "c.glb").read_bytes() != before)
    assert set(statuses(compress_all(library, tmp_path / "out")).values()) == {"unchanged"}


def test_a_file_that_was_missing(library, tmp_path, compress_all):
    texture = (library / "t.png").read_bytes()
    (library / "t.png").unlink()
    compress_all(library, tmp_path / "out")
    (library / "t.png").write_bytes(texture)
    assert statuses(compress_all(library, tmp_path / "out"))["c.obj"] == "done"


def test_a_link_to_a_model_that_changed(source, tmp_path, compress_all):
    model = write_grid(tmp_path / "b.glb", 5)
    (source / "b.glb").symlink_to(model)
    compress_all(source, tmp_path / "out")
    change_byte(model)
    write_grid(model, 6)
    assert statuses(compress_all(source, tmp_path / "out")) == {
        "a.glb": "unchanged",
        "b.glb": "done",
    }


@pytest.mark.parametrize("name", ["a.glb", "a.fallback.bin"])
@pytest.mark.parametrize("harm", [None, lambda path: os.truncate(path, 5), change_byte])
def test_an_output_that_is_damaged_or_gone(source, tmp_path, compress_all, name, harm):
    """A damaged one may be a user's own work: it is made again when it is deleted."""
    out = tmp_path / "out"
    compress_all(source, out, fallback=True)
    before = contents(out)[(out / name).relative_to(out)]
    if harm is not None:
        harm(out / name)
        after = contents(out)[(out / name).relative_to(out)]
        error = errors(compress_all(source, out, fallback=True))["a.glb"]
        assert error.startswith(f"its output {name} is not as a batch wrote it; move it, or delete")
        assert contents(out)[(out / name).relative_to(out)] == after != before
    (out / name).unlink()
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "done"}
    assert (out / name).read_bytes() == before
    assert statuses(compress_all(source, out, fallback=True)) == {"a.glb": "unchanged"}


def test_outputs_that_were_copied_are_not_made_again(source, tmp_path, compress_all):
    out = tmp_path / "out"
    compress_all(source, out)
    os.utime(out / "a.glb", (1, 1))
    report = compress_all(source, out)
    assert statuses(report) == {"a.glb": "unchanged"}


@pytest.mark.parametrize(
    "record",
    ["[]", "{}", "null", '{"outputs": {}, "former": {"a.glb": 3}}', "[" * 100_000],
)
def test_a_record_that_is_damaged(source, tmp_path, compress_all, record):
    out = tmp_path / "out"
    compress_all(source, out)
    (out / STATE / "a.glb.json").write_text(record)
    assert statuses(compress_all(source, out)) == {"a.glb": "done"}


# --- bad entries ---


def bad_entries(folder):
    """name -> a part of its error."""
    (folder / "link.glb").symlink_to("/nowhere/model.glb")
    (folder / "loop.glb").symlink_to("loop.glb")
    os.mkfifo(folder / "pipe.glb")
    with socket.socket(socket.AF_UNIX) as listener:
        before = os.getcwd()
        os.chdir(folder)  # the path of a socket is short
        listener.bind("socket.glb")
        os.chdir(before)
    (folder / "infinite.gltf").write_text('{"accessors":[{"count":1e999}]}')
    (folder / "nested.gltf").write_text("[" * 100_000)
    (folder / "empty.glb").write_bytes(b"")
    return {
        "link.glb": "is a link to nothing",
        "loop.glb": "cannot be read",
        "pipe.glb": "is a pipe",
        "socket.glb": "is a pipe or a device",
        "infinite.gltf": "",
        "nested.gltf": "cannot be read",
        "empty.glb": "is empty",
    }


def test_bad_entries_fail_alone(source, tmp_path, compress_all):
    expected = bad_entries(source)
    report = compress_all(source, tmp_path / "out")
    found = errors(report)
    assert set(found) == set(expected) and statuses(report)["a.glb"] == "done"
    for name, error in expected.items():
        assert error in found[name] and len(found[name].splitlines()) == 1
    assert json.loads((tmp_path / "out" / "batch.json").read_text()) == report


def test_a_folder_that_a_pattern_matches(source, tmp_path, compress_all):
    (source / "x.glb").mkdir()
    report = compress_all(source / "*.glb", tmp_path / "out")
    assert statuses(report) == {"a.glb": "done", "x.glb": "failed"}
    assert "is a folder" in errors(report)["x.glb"]
    assert statuses(compress_all(source, tmp_path / "all")) == {"a.glb": "done"}


def test_a_model_that_is_deleted_midway(source, tmp_path, compress_all, monkeypatch):
    write_grid(source / "b.glb", 5)

    def deleting(*arguments):
        (source / "b.glb").unlink(missing_ok=True)
        return estimate(*arguments)

    estimate = dispatch.estimate
    monkeypatch.setattr(dispatch, "estimate", deleting)
    report = compress_all(source, tmp_path / "out")
    assert statuses(report) == {"a.glb": "done", "b.glb": "failed"}
    assert "is not there" in errors(report)["b.glb"]


def test_a_model_that_may_not_be_read(source, tmp_path, compress_all, monkeypatch):
    write_grid(source / "b.glb", 5)

    def refuse(path, *arguments, **options):
        if os.path.basename(path) == "b.glb":
            raise PermissionError(13, "Permission denied", str(path))
        return compress(path, *arguments, **options)

    compress = task.compress
    monkeypatch.setattr(task, "compress", refuse)
    report = compress_all(source, tmp_path / "out")
    assert errors(report) == {
        "b.glb": f"{source}/b.glb: Permission denied; check the path and its permissions"
    }


def test_a_thumbnail_that_fails_loses_nothing(source, tmp_path, compress_all, monkeypatch):
    def fail(path):
        assert not (tmp_path / "out" / "a.glb").exists()
        raise MemoryError

    monkeypatch.setattr(task, "thumbnail", fail)
    report = compress_all(source, tmp_path / "out")
    assert statuses(report) == {"a.glb": "done"} and report["files"][0]["thumbnail"] == ""
    assert "<img" not in page(report)


def test_a_thumbnail_of_many_instances(tmp_path, monkeypatch):
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    path = builder.write(tmp_path / "a.glb")
    plain = thumbnail.thumbnail(open_model(path))
    gltf_ext.compress(path, tmp_path / "b.glb", page_bytes=4096)
    assert len(thumbnail.thumbnail(open_model(tmp_path / "b.glb"))) > len(plain) // 2
    decoded = []
    read = thumbnail._triangles
    monkeypatch.setattr(thumbnail, "_triangles", lambda *args: decoded.append(args) or read(*args))
    builder.properties["nodes"] = [{"mesh": 0, "translation": [i, 0, 0]} for i in range(5000)]
    builder.properties["scenes"] = [{"nodes": list(range(5000))}]
    assert thumbnail.thumbnail(open_model(builder.write(tmp_path / "many.glb")))
    ((_, _, _, most),) = decoded
    assert most == thumbnail.MAX_TRIANGLES // 455, "of every eleventh instance"


# --- what is left out ---


def test_what_is_left_out_is_named(source, tmp_path, compress_all, monkeypatch, capsys):
    (source / "secret").mkdir()
    (source / "linked").symlink_to(tmp_path)
    (source / "._a.glb").write_bytes(b"metadata of macOS")

    def scan(path):
        if isinstance(path, str) and os.path.basename(path) == "secret":
            raise PermissionError(13, "Permission denied", path)
        return scandir(path)

    scandir = os.scandir
    monkeypatch.setattr(finding.os, "scandir", scan)
    report = compress_all(source, tmp_path / "out")
    assert statuses(report) == {"a.glb": "done"}
    assert left_out(report) == {
        "secret": "cannot be read: Permission denied",
        "linked": "is a link to a folder; name the folder by itself",
    }
    assert "secret" in page(report) and "1 done" in page(report)
    monkeypatch.setattr(gltf_ext, "batch", lambda *_, **__: report)
    assert cli.main(["batch", str(source), str(tmp_path / "out")]) == 2
    printed = capsys.readouterr().out
    assert "secret: left out: it cannot be read" in printed and "2 left out" in printed


def test_a_list_with_bad_lines(source, tmp_path, compress_all):
    (source / "notes.md").write_text("no model")
    (source / "models").mkdir()
    caf = os.fsdecode(b"caf\xe9.glb")
    write_grid(source / caf)
    lines = ["\ufeff" + str(source / "a.glb"), f"{source}/gone.glb", f"{source}/models"]
    lines += [f"{source}/notes.md", "nope://x/b.glb", "", f"{source}/{caf}", f"{source}/a.glb"]
    text = "\r\n".join(lines).encode(errors="surrogateescape")
    (tmp_path / "list.txt").write_bytes(text)
    report = compress_all(tmp_path / "list.txt", tmp_path / "out")
    done = [name for name, status in statuses(report).items() if status == "done"]
    assert sorted(os.path.basename(name) for name in done) == ["a.glb", caf]
    found = {os.path.basename(name): error for name, error in errors(report).items()}
    assert set(found) == {"gone.glb", "b.glb"}
    assert "check the path" in found["gone.glb"] and "rotocol" in found["b.glb"]
    assert set(left_out(report)) == {"models", "notes.md"}


# --- names ---


@pytest.mark.parametrize(
    "name",
    [
        "model[1].glb",
        "50% #1?.glb",
        os.fsdecode(b"caf\xe9.glb"),
        "\x1b[2J\n.glb",
        "n" * 251 + ".glb",
    ],
)
def test_any_name(source, tmp_path, compress_all, capsys, monkeypatch, name):
    os.rename(source / "a.glb", source / name)
    out = tmp_path / "out [1]"
    assert statuses(compress_all(source, out)) == {name: "done"}
    report = compress_all(source, out)
    assert statuses(report) == {name: "unchanged"}
    monkeypatch.setattr(gltf_ext, "batch", lambda *_, **__: report)
    assert cli.main(["batch", str(source), str(out)]) == 0
    printed = capsys.readouterr().out
    assert "\x1b" not in printed and len(printed.splitlines()) == 2
    assert "\x1b" not in (out / "batch.html").read_text()


def test_a_source_with_brackets(tmp_path, compress_all):
    for folder in ("s [1]", "s 1"):
        (tmp_path / folder).mkdir()
    write_grid(tmp_path / "s [1]" / "a.glb")
    assert statuses(compress_all(tmp_path / "s [1]", tmp_path / "out")) == {"a.glb": "done"}


def test_names_are_from_the_source(source, tmp_path, compress_all):
    (source / "a.glb").unlink()
    (source / "one").mkdir()
    write_grid(source / "one" / "a.glb")
    assert statuses(compress_all(source, tmp_path / "out")) == {"one/a.glb": "done"}
    (source / "two").mkdir()
    write_grid(source / "two" / "a.glb")
    report = compress_all(source, tmp_path / "out")
    assert statuses(report) == {"one/a.glb": "unchanged", "two/a.glb": "done"}


# --- web servers ---


@pytest.fixture
def web(library):
    """The address of a server of the models, without their times."""
    pytest.importorskip("aiohttp")

    class Handler(SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=library))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()
    thread.join()


def test_addresses_of_a_web_server(library, web, tmp_path, compress_all):
    names = ["a.glb", "b.gltf", "c.obj", "gone.glb"]
    (tmp_path / "list.txt").write_text("".join(f"{web}/{name}\n" for name in names))
    report = compress_all(tmp_path / "list.txt", tmp_path / "out", root=web)
    wanted = dict.fromkeys(names[:3], "done") | {"gone.glb": "failed"}
    assert statuses(report) == wanted and "is not there" in errors(report)["gone.glb"]
    report = compress_all(tmp_path / "list.txt", tmp_path / "out", root=web)
    assert report["totals"]["unchanged"] == 3
    change_byte(library / "b.bin")
    os.utime(library / "b.bin", (1, 1))
    report = compress_all(tmp_path / "list.txt", tmp_path / "out", root=web)
    assert statuses(report) == {**wanted, "a.glb": "unchanged", "c.obj": "unchanged"}
    assert not (library / "out").exists()


def test_a_web_server_is_no_scheduler(source, web, tmp_path, monkeypatch):
    monkeypatch.setattr(scheduler, "CONNECT", 1)
    address = web.replace("http:", "tcp:")
    with pytest.raises(gltf_ext.MeshletError, match="no scheduler answers at this address"):
        gltf_ext.batch(source, tmp_path / "out", scheduler=address)


# --- memory ---


def test_max_memory_reaches_verify(source, tmp_path, compress_all, monkeypatch):
    limits = []

    def noting(original, output, options, document):
        limits.append(options)
        return compare_files(original, output, options, document)

    compare_files = task.compare_files
    monkeypatch.setattr(task, "compare_files", noting)
    compress_all(source, tmp_path / "out", max_memory="500M", work_dir=str(tmp_path))
    compress_all(source, tmp_path / "out")
    assert (limits[0].max_memory, limits[0].work_dir) == ("500M", str(tmp_path))
    assert limits[1].max_memory is None
