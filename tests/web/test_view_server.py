"""gltf-meshlet view: its server, beside hostile requests, and its files."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from types import SimpleNamespace
from urllib.parse import quote

import pytest

import gltf_ext
from gltf_ext.attributes.extension import has_compressed
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model
from gltf_meshlet import view_command, view_server
from gltf_meshlet.cli import main
from gltf_meshlet.view_models import prepare, prepare_upload
from gltf_meshlet.view_server import ViewServer
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh
from tests.helpers.processes import running

LIMIT = 1_000_000  # bytes of an upload


@pytest.fixture
def original(tmp_path):
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    return builder.write(tmp_path / "in.glb")


@pytest.fixture
def work(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    return folder


@pytest.fixture
def server(original, work):
    with ViewServer(prepare(original, None, work), work, max_upload=LIMIT) as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        yield running
        running.shutdown()
        thread.join()


def ask(server, path, method="GET", body=None, headers=(), host=None):
    """Status, headers and body of an answer. path: as it is sent."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{server.server_port}")
    for name, value in headers:
        connection.putheader(name, value)
    if body is not None:
        connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body)
    response = connection.getresponse()
    answer = response.status, dict(response.getheaders()), response.read()
    connection.close()
    return answer


def page(server, name, **options):
    return ask(server, f"/{server.token}/{name}", **options)


def upload(server, name, content, **options):
    status, _, body = page(
        server, f"compress?name={quote(name)}", method="POST", body=content, **options
    )
    return status, json.loads(body)


# --- what is served ---


def test_page_and_model(server, original):
    status, headers, body = page(server, "")
    assert status == 200 and b"<!doctype html>" in body
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert page(server, "view.js")[1]["Content-Type"] == "text/javascript"
    (model,) = json.loads(page(server, "models.json")[2])["models"]
    assert model["name"] == "in.glb"
    assert model["original"]["bytes"] == original.stat().st_size
    assert page(server, model["original"]["file"])[2] == original.read_bytes()
    compressed = page(server, model["compressed"]["file"])[2]
    assert len(compressed) == model["compressed"]["bytes"] and compressed[:4] == b"glTF"


def test_ranges(server, original):
    (model,) = json.loads(page(server, "models.json")[2])["models"]
    name, content = model["original"]["file"], original.read_bytes()
    size = len(content)
    for asked, begin, end in (("4-11", 4, 12), ("4-", 4, size), (f"0-{10 * size}", 0, size)):
        status, headers, body = page(server, name, headers=[("Range", f"bytes={asked}")])
        assert (status, body) == (206, content[begin:end])
        assert headers["Content-Range"] == f"bytes {begin}-{end - 1}/{size}"
        assert headers["Content-Length"] == str(end - begin)
    status, headers, body = page(server, name, headers=[("Range", f"bytes={size}-")])
    assert (status, headers["Content-Range"], body) == (416, f"bytes */{size}", b"")
    for other in ("bytes=-5", "bytes=1-2,4-5", "lines=1-2", "bytes=\u0661-\u0662"):
        assert page(server, name, headers=[("Range", other.encode())])[::2] == (200, content)
    etag = page(server, name)[1]["ETag"]
    assert page(server, name, headers=[("Range", "bytes=0-1")])[1]["ETag"] == etag


def test_listens_on_this_machine_only(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.address == f"http://127.0.0.1:{server.server_port}/{server.token}/"
    assert len(server.token) >= 22  # 128 bits


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/index.html",
        "/view.js",
        "/models.json",
        "/TOKEN",
        "/TOKENx/",
        "/wrong/",
        "/../TOKEN/",
        "/%00/",
        "/t%C3%B6ken/",
        "/TOKEN%2f",
        "http://elsewhere/",
    ],
)
def test_wrong_token(server, path):
    status, _, body = ask(server, path.replace("TOKEN", server.token))
    assert status == 403
    assert server.token.encode() not in body


@pytest.mark.parametrize(
    "name",
    [
        "../view_server.py",
        "../../etc/passwd",
        "..%2f..%2fetc%2fpasswd",
        "/etc/passwd",
        "first/../../view_server.py",
        "first/",
        "first",
        "upload-1/compressed.glb",
        "view.js/",
        "%2e%2e/cli.py",
        "view.js%00",
        "\\..\\cli.py",
        "__init__.py",
    ],
)
def test_names_outside_the_table(server, name):
    status, _, body = page(server, name)
    assert (status, json.loads(body)) == (404, {"error": "there is no such file"})


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "[::1]:80", ":", " "]
)
def test_wrong_host(server, host):
    assert page(server, "", host=host)[0] == 403
    assert upload_status(server, host=host) == 403


def upload_status(server, **options):
    return upload(server, "a.obj", b"v 0 0 0\n", **options)[0]


def test_hosts_of_this_machine(server):
    """A tunnel may have another port."""
    for host in ("localhost", "localhost:9000", f"127.0.0.1:{server.server_port}"):
        assert page(server, "", host=host)[0] == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://localhost"])
def test_other_origins_write_nothing(server, origin, work):
    before = sorted(work.iterdir())
    assert upload_status(server, headers=[("Origin", origin)]) == 403
    assert sorted(work.iterdir()) == before


def test_other_methods_are_refused(server):
    for method in ("PUT", "DELETE", "OPTIONS", "HEAD"):
        assert page(server, "", method=method)[0] == 501
    assert page(server, "view.js", method="POST", body=b"")[0] == 404


# --- uploads ---


def test_upload_is_compressed(server, original, tmp_path):
    status, model = upload(server, "mine.glb", original.read_bytes())
    assert status == 200 and model["name"] == "mine.glb" and model["seconds"] > 0
    (tmp_path / "got.glb").write_bytes(page(server, model["compressed"]["file"])[2])
    assert gltf_ext.verify(original, tmp_path / "got.glb")["ok"]
    assert page(server, model["original"]["file"])[2] == original.read_bytes()


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_uploads_of_other_formats_come_back_as_glb(server, tmp_path, suffix):
    import trimesh

    path = tmp_path / f"torus{suffix}"
    trimesh.creation.torus(2.0, 0.5).export(path)
    status, model = upload(server, path.name, path.read_bytes())
    assert status == 200, model
    assert page(server, model["original"]["file"])[2][:4] == b"glTF"


def test_only_the_last_upload_is_kept(server, original, work):
    first = upload(server, "a.glb", original.read_bytes())[1]
    folders = len(list(work.iterdir()))
    second = upload(server, "b.glb", original.read_bytes())[1]
    assert page(server, first["compressed"]["file"])[0] == 404
    assert page(server, second["compressed"]["file"])[0] == 200
    assert len(list(work.iterdir())) == folders


@pytest.mark.parametrize(
    "name",
    [
        "../../escape.glb",
        "/etc/cron.d/x.glb",
        "a\0b.glb",
        "\u202egnp.glb",
        "x" * 5000 + ".glb",
        "<script>alert(1)</script>.glb",
        ".glb",
        "con.glb",
        "line\r\nbreak.glb",
    ],
)
def test_hostile_names(server, original, work, tmp_path, name):
    """The name is shown; no path is made of it."""
    before = {path for path in tmp_path.rglob("*") if work not in path.parents}
    status, model = upload(server, name, original.read_bytes())
    assert status in (200, 415), model
    assert status == 415 or model["name"] == name
    assert {path for path in tmp_path.rglob("*") if work not in path.parents} == before


@pytest.mark.parametrize(
    "name, content, status, problem",
    [
        ("a.exe", b"MZ", 415, "use one of .glb"),
        ("", b"", 415, "use one of .glb"),
        ("a.glb", b"", 422, "is empty"),
        ("a.glb", b"glTF nonsense", 422, "version"),
        ("a.gltf", b"[" * 100_000, 422, "JSON"),
        ("a.stl", b"solid", 422, "is cut off"),
        ("a.ply", b"ply\nformat ascii 1.0\n", 422, "has a header that does not end"),
        ("a.obj", b"v 0 0 0\n", 422, "holds no triangles"),
    ],
)
def test_refused_uploads_are_one_line_and_leave_nothing(
    server, work, name, content, status, problem
):
    before = sorted(work.iterdir())
    found, answer = upload(server, name, content)
    assert found == status and problem in answer["error"]
    assert "\n" not in answer["error"] and str(work) not in answer["error"]
    assert sorted(work.iterdir()) == before
    assert page(server, "")[0] == 200


def test_large_uploads_are_refused_unread(server):
    path = f"/{server.token}/compress?name=a.glb"
    for length in (LIMIT + 1, 10**30, "9" * 5000):
        headers = [("Content-Length", str(length))]
        status, _, body = ask(server, path, method="POST", headers=headers)
        assert status == 413 and "use gltf-meshlet compress" in json.loads(body)["error"]
    for length in ("-1", "many", "1e3", ""):
        headers = [("Content-Length", length)]
        assert ask(server, path, method="POST", headers=headers)[0] == 411
    assert ask(server, path, method="POST")[0] == 411
    answers = [
        ask(server, path, method="POST", headers=[("Content-Length", zeros)])
        for zeros in ("0", "0" * 5000)
    ]
    assert answers[0][::2] == answers[1][::2] and answers[0][0] < 500


def test_an_upload_that_breaks_off_leaves_nothing(server, work):
    before = sorted(work.iterdir())
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    connection.putrequest("POST", f"/{server.token}/compress?name=a.glb")
    connection.putheader("Content-Length", "1000")
    connection.endheaders(b"glTF")
    connection.close()
    deadline = time.monotonic() + 20
    while upload_status(server) == 503 or sorted(work.iterdir()) != before:
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_uploads_read_no_buffer_of_this_machine(server, tmp_path):
    (tmp_path / "secret.bin").write_bytes(b"1234")
    buffers = [{"uri": "../../secret.bin", "byteLength": 4}]
    gltf = json.dumps({"asset": {"version": "2.0"}, "buffers": buffers}).encode()
    status, answer = upload(server, "a.gltf", gltf)
    assert status == 422 and "refers to other files" in answer["error"]


@pytest.mark.parametrize(
    "line",
    ["mtllib red.mtl", "# mtllib red.mtl", "  mtllib\tred.mtl", "MTLLIB red.mtl", "MtlLib red.mtl"],
)
def test_uploads_read_no_material_library(work, line):
    """Not even one that lies beside the upload."""
    (work / "red.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (work / "upload.obj").write_text(f"{line}\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    model = prepare_upload(work / "upload.obj", "a.obj", work)
    assert "materials" not in glb_json(work / "compressed.glb")
    assert any("its materials are left out" in warning for warning in model.warnings)


def test_one_upload_at_a_time(server, original, monkeypatch):
    begun, end = threading.Event(), threading.Event()
    compress = view_server.prepare_upload

    def slow(*arguments):
        begun.set()
        assert end.wait(30)
        return compress(*arguments)

    monkeypatch.setattr(view_server, "prepare_upload", slow)
    results = []
    first = threading.Thread(
        target=lambda: results.append(upload(server, "a.glb", original.read_bytes())[0])
    )
    first.start()
    assert begun.wait(30)
    assert upload_status(server) == 503
    assert page(server, "models.json")[0] == 200  # reading goes on
    end.set()
    first.join()
    assert results == [200]


# --- preparing ---


def test_compressed_file_is_served_as_it_is(original, work, tmp_path):
    gltf_ext.compress(original, tmp_path / "small.glb")
    model = prepare(tmp_path / "small.glb", None, work)
    assert model.compressed.path == tmp_path / "small.glb"
    assert model.original is None and list(work.iterdir()) == []
    model = prepare(tmp_path / "small.glb", original, work)
    assert model.original.path == original


def test_gltf_with_files_becomes_a_glb(original, work, tmp_path):
    """Compressed or not; its size counts the files."""
    for source in (original, tmp_path / "small.glb"):
        if source != original:
            gltf_ext.compress(original, source)
        properties = glb_json(source)
        length = properties["buffers"][0]["byteLength"]
        start = source.read_bytes().index(b"BIN\0") + 4
        (tmp_path / "data.bin").write_bytes(source.read_bytes()[start : start + length])
        properties["buffers"][0]["uri"] = "data.bin"
        (tmp_path / "in.gltf").write_text(json.dumps(properties))
        folder = work / source.stem
        folder.mkdir()
        model = prepare(tmp_path / "in.gltf", None, folder)
        assert has_compressed(open_model(model.compressed.path))
        made = model.compressed if source != original else model.original
        assert open_model(made.path).files() == []
        assert made.source_bytes == (tmp_path / "in.gltf").stat().st_size + length
        assert gltf_ext.verify(original, model.compressed.path)["ok"]


def test_original_is_for_compressed_files(original, work):
    with pytest.raises(MeshletError, match="leave out --original"):
        prepare(original, original, work)


# --- the command ---


def test_export(original, tmp_path, capsys):
    folder = tmp_path / "site"
    assert main(["view", str(original), "--export", str(folder)]) == 0
    assert str(folder) in capsys.readouterr().out
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    page_names = {path.name for path in view_server.PAGE.iterdir()}
    assert names == page_names | {"models.json", "model/compressed.glb", "model/original.glb"}
    listed = json.loads((folder / "models.json").read_text())
    assert listed["server"] is False
    assert gltf_ext.verify(original, folder / listed["models"][0]["compressed"]["file"])["ok"]
    assert os.stat(folder).st_mode & 0o055 == 0o055  # a web server's user can read it
    assert {path.name for path in tmp_path.iterdir()} == {"in.glb", "site"}


@pytest.mark.parametrize(
    "arguments, problem",
    [
        (["in.glb", "--export", "in.glb"], "in.glb: exists; name a new folder"),
        (["in.glb", "--export", "no/site"], "its folder does not exist; create it first"),
        (["in.glb", "--port", "70000"], "--port is 70000; use 0 to 65535"),
        (["in.glb", "--original", "in.glb"], "is not compressed, so it is the original"),
        (["missing.glb"], "No such file"),
        (["bad.glb", "--export", "site"], "bad.glb: "),
    ],
)
def test_errors_are_one_line(original, tmp_path, monkeypatch, capsys, arguments, problem):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.glb").write_bytes(b"glTF nonsense")
    assert main(["view", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert problem in line
    assert {path.name for path in tmp_path.iterdir()} == {"in.glb", "bad.glb"}


def test_names_and_warnings_do_not_control_the_terminal(original, tmp_path, capsys, monkeypatch):
    """Of the model, of what is in it, of the exported page, and of errors of the server."""
    model, site = tmp_path / "\x1b[2J.obj", tmp_path / "\x1b[3J"
    model.write_text("mtllib \x1b[4J.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert main(["view", str(model), "--export", str(site)]) == 0

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(ViewServer, "serve_forever", interrupted)
    assert main(["view", str(model), "--no-browser"]) == 0
    try:
        raise ValueError("\x1b[5J")
    except ValueError:
        ViewServer.handle_error(None, None, None)
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err
    for shown in ("[2J", "[3J"):
        assert f"\\x1b{shown}" in out
    for shown in ("[2J", "[4J", "[5J"):
        assert f"\\x1b{shown}" in err


def test_a_port_in_use_is_one_line(original, server, capsys):
    assert main(["view", str(original), "--no-browser", "--port", str(server.server_port)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--port {server.server_port} cannot be used" in line


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_command_prints_the_address_and_deletes_its_folder(original, tmp_path, number):
    (tmp_path / "tmp").mkdir()
    command = [sys.executable, "-m", "gltf_meshlet", "view", str(original), "--no-browser"]
    environment = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with running(command, env=environment, **pipes) as process:
        line = process.stdout.readline()
        assert re.search(r": http://127\.0\.0\.1:\d+/[\w-]{20,}/ \(Ctrl-C stops\)\n$", line)
        assert len(list((tmp_path / "tmp").iterdir())) == 1
        process.send_signal(number)
        _, errors = process.communicate(timeout=120)
    assert process.returncode == (0 if number == signal.SIGINT else 128 + number)
    assert errors == "" and list((tmp_path / "tmp").iterdir()) == []


@pytest.mark.parametrize(
    "system, variables, expected",
    [
        ("win32", {}, True),
        ("darwin", {}, True),
        ("linux", {}, False),
        ("linux", {"DISPLAY": ":0"}, True),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, True),
        ("linux", {"BROWSER": "firefox"}, True),
    ],
)
def test_where_a_browser_is(monkeypatch, system, variables, expected):
    monkeypatch.setattr(view_command.sys, "platform", system)
    monkeypatch.setattr(view_command.os, "environ", variables)
    assert view_command._has_display() == expected


def test_windows_lacks_a_signal_and_has_another(monkeypatch):
    """SIGBREAK ends the command there: Ctrl-Break, and a terminal that is closed."""
    caught = {}
    names = {"SIGTERM": 15, "SIGBREAK": 21, "signal": caught.__setitem__}
    monkeypatch.setattr(view_command, "signal", SimpleNamespace(**names))
    view_command._exit_on_signals()
    assert sorted(caught) == [15, 21]
    with pytest.raises(SystemExit) as ended:
        caught[21](21, None)
    assert ended.value.code == 128 + 21


@pytest.mark.parametrize("display", [{"BROWSER": "echo opened %s"}, {}])
def test_browser_is_opened_where_there_is_one(original, display):
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    }
    command = [sys.executable, "-u", "-m", "gltf_meshlet", "view", str(original)]
    environment |= display
    with running(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        address = process.stdout.readline().split()[1]
        if display:
            assert process.stdout.readline() == f"opened {address}\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=120)[0] == ""
