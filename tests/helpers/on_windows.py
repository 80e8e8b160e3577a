"""What users of Windows do: python on_windows.py SCENARIO, for a Python for Windows.

In a folder with in.glb, of 1.5 M triangles, and small.glb. Ends with a traceback if something is
not as it should be.
"""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

SECONDS = 600  # for a command
FAILED = 2  # exit status
# Each writes its last argument but options.
LARGE = (
    ("compress", "in.glb", "out.glb"),
    ("verify", "in.glb", "out.glb"),
    ("verify", "in.glb", "out.glb", "--max-memory", "200M"),
    ("validate", "out.glb"),
    ("decompress", "out.glb", "plain.glb"),
    ("compress", "in.glb", "chunks.glb", "--max-memory", "200M"),
    ("verify", "in.glb", "chunks.glb"),
    ("compress", "in.glb", "levels.glb", "--lod"),
    ("validate", "levels.glb"),
    ("decompress", "levels.glb", "coarse.glb", "--error", "0.1%"),
    ("compress", "in.glb", "chunked_levels.glb", "--lod", "--max-memory", "400M"),
    ("validate", "chunked_levels.glb"),
)
# A signal ends it once the file appears. Wine without a terminal delivers no Ctrl-C; a thread that
# waits for input would stop libraries from loading.
VIEW = """
import _thread, os, signal, sys, threading, time
from gltf_meshlet.cli import main
stop, name, *arguments = sys.argv[1:]
def end():
    while not os.path.exists(stop):
        time.sleep(0.05)
    _thread.interrupt_main(getattr(signal, name))
threading.Thread(target=end, daemon=True).start()
sys.exit(main(arguments))
"""
# Holds a file until its input ends, shared as most programs share a file that they read.
HOLD = "import sys; file = open(sys.argv[1], 'rb'); print('held', flush=True); sys.stdin.read()"
# Likewise, shared with nobody.
LOCK = """
import ctypes, sys
assert ctypes.windll.kernel32.CreateFileW(sys.argv[1], 0x80000000, 0, None, 3, 0, None) > 0
print("held", flush=True)
sys.stdin.read()
"""


def command(*arguments, status=0):
    """Runs a command of gltf-meshlet; returns its error output."""
    result = subprocess.run(
        [sys.executable, "-m", "gltf_meshlet", *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=SECONDS,
    )
    errors = result.stderr.decode("utf-8", "replace")
    assert result.returncode == status, (arguments, result.returncode, result.stdout, errors)
    assert "Traceback" not in errors, errors
    return errors


@contextlib.contextmanager
def python(code, *arguments):
    """Runs code with pipes for its input and output; the end of its input ends it."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    words = [sys.executable, "-c", code, *map(str, arguments)]
    with subprocess.Popen(words, **pipes) as process:
        try:
            yield process
            process.communicate(timeout=SECONDS)
        finally:
            process.kill()


@contextlib.contextmanager
def held(path, code=HOLD):
    """Another program has the file open."""
    with python(code, path) as process:
        assert process.stdout.readline().strip() == b"held", process.stderr.read()
        yield process


# --- scenarios ---


def large():
    """Prints nothing; the caller compares what is written."""
    for arguments in LARGE:
        command(*arguments)


def batch():
    """A large and a small model, twice: the second time there is nothing to do."""
    Path("models").mkdir()
    shutil.copy("in.glb", "models/large.glb")
    shutil.copy("small.glb", "models/small ü.glb")
    for expected in ("done", "unchanged"):
        command("batch", "models", "results", "--workers", 2)
        assert statuses() == {"large.glb": expected, "small ü.glb": expected}
    command("validate", "results/small ü.glb")
    shutil.copy("results/large.glb", "batched.glb")


def paths():
    """Spaces, umlauts, other scripts, drive letters, slashes of both kinds, long paths."""
    here = Path.cwd()
    long = os.path.join(*["a long name of a folder that has more"] * 9)
    for folder in ("with spaces and (more) Möbel äöüß 模型 модель", long):
        there = here / folder
        there.mkdir(parents=True)
        source, output = there / "Stühle 1.glb", there / "out é.gltf"
        shutil.copy("small.glb", source)
        command("compress", source, output)
        command("validate", str(output).replace("\\", "/"))
        command("verify", source, output)
        command("decompress", output, there / "plain.glb")
        command("transcode", output, there / "packed.glb")
        command("inspect", "--json", output)
        command("compress", source, there / "chunks.glb", "--max-memory", "200M")
        command("view", output, "--export", there / "Seite")
        assert (there / "Seite" / "index.html").is_file()
        command("batch", there, there / "results", "--workers", 1)
        names = {path.name for path in (there / "results").glob("*.glb")}
        assert "Stühle 1.glb" in names, names
    assert max(len(str(path)) for path in here.rglob("*")) > 350
    assert here.drive and str(here).startswith(here.drive + "\\")
    os.chdir(here.drive + "\\")
    command("validate", os.path.relpath(output))
    command("validate", str(output).removeprefix(here.drive))
    command("compress", "C:nothing.glb", here / "new.glb", status=2)
    assert not (here / "new.glb").exists()


def uris():
    """A model cannot name files on another drive or another machine."""
    command("compress", "small.glb", "out.gltf")
    document = json.loads(Path("out.gltf").read_bytes())
    for uri in ("C:/out.bin", "C:out.bin", "%5C%5Chost%5Cshare%5Cout.bin", "C%3A%5Cout.bin"):
        document["buffers"][0]["uri"] = uri
        Path("bad.gltf").write_text(json.dumps(document))
        errors = command("decompress", "bad.gltf", "bad.glb", status=2)
        assert "not a relative path" in errors, errors
    assert not Path("bad.glb").exists()
    Path("elsewhere").mkdir()
    there = Path("elsewhere/there.mtl").resolve()
    there.write_text("newmtl m\n")
    for name in (there, there.as_posix(), f"{there.drive}there.mtl", "//host/share/x.mtl"):
        triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        Path("names.obj").write_text(f"mtllib {name}\n{triangle}", encoding="utf-8")
        errors = command("compress", "names.obj", "names.glb")
        assert "is not a relative path, so its materials are left out" in errors, errors


def closed_pipe():
    """Whoever reads the output has seen enough: no message."""
    command("compress", "small.glb", "out.glb")
    words = [sys.executable, "-m", "gltf_meshlet", "inspect", "--json", "out.glb"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, **pipes) as process:
        try:
            process.stdout.close()
            errors = process.stderr.read()
            process.wait(SECONDS)
        finally:
            process.kill()
    assert (process.returncode, errors) == (FAILED, b""), (process.returncode, errors)


def in_use():
    """An output or an input that another program has open."""
    command("compress", "small.glb", "out.gltf")
    before = {path.name: path.read_bytes() for path in Path().glob("out.*")}
    assert sorted(before) == ["out.bin", "out.gltf"]
    for name in before:  # all files of a model are as before, or none
        with held(name):
            errors = command("compress", "small.glb", "out.gltf", "-vp", 9, status=2)
        check_line(errors, name)
        assert {path.name: path.read_bytes() for path in Path().glob("out.*")} == before
    with held("out.bin") as program:  # it closes the file while the command waits
        threading.Timer(1, program.stdin.close).start()
        program.stdin = None
        start = time.monotonic()
        command("compress", "small.glb", "out.gltf", "-vp", 9)
        print(f"waited {time.monotonic() - start:.1f} s")
    assert Path("out.bin").read_bytes() != before["out.bin"]
    with held("small.glb"):  # to read beside another reader is fine
        command("compress", "small.glb", "beside.glb")
    with held("small.glb", LOCK):
        check_line(command("compress", "small.glb", "new.glb", status=2), "small.glb")
        check_line(command("validate", "small.glb", status=2), "small.glb")
    with held("beside.glb", LOCK):
        errors = command("decompress", "beside.glb", "new.glb", status=2)
        check_line(errors, "beside.glb")
        check_line(command("compress", "small.glb", "beside.glb", status=2), "beside.glb")
    assert not Path("new.glb").exists() and not list(Path().glob(".*"))


def batch_in_use():
    """An output that is in use fails alone, is as before, and is done the next time."""
    Path("models").mkdir()
    for name in ("a.glb", "b.glb"):
        shutil.copy("small.glb", Path("models", name))
    words = ("batch", "models", "results", "--workers", 1)
    command(*words)
    before = Path("results", "a.glb").read_bytes()
    with held("results/a.glb"):
        command(*words, "-vp", 9, status=2)
    assert Path("results", "a.glb").read_bytes() == before
    assert statuses() == {"a.glb": "failed", "b.glb": "done"}
    command(*words, "-vp", 9)
    assert statuses() == {"a.glb": "done", "b.glb": "unchanged"}
    assert not list(Path("results").rglob("*.part"))


def statuses():
    """Name -> status, of the last batch."""
    report = json.loads(Path("results", "batch.json").read_bytes())
    return {file["name"]: file["status"] for file in report["files"]}


def check_line(errors, name):
    """One line that names the file and what to do."""
    lines = errors.strip().splitlines()
    assert len(lines) == 1 and name in lines[0] and "close other programs" in lines[0], errors


def view():
    """Starts, serves, refuses a second server on its port, stops; its folder is deleted."""
    for number in ("SIGINT", "SIGBREAK", "SIGTERM"):
        stop = f"stop by {number}"
        with python(VIEW, stop, number, "view", "small.glb", "--no-browser") as process:
            line = process.stdout.readline().decode()
            address = line.split()[1]
            assert address.startswith("http://127.0.0.1:") and "Ctrl-C" in line, line
            with urllib.request.urlopen(address + "models.json", timeout=60) as answer:
                (model,) = json.loads(answer.read())["models"]
            asked = urllib.request.Request(
                address + model["compressed"]["file"], headers={"Range": "bytes=0-3"}
            )
            with urllib.request.urlopen(asked, timeout=60) as answer:
                assert (answer.status, answer.read()) == (206, b"glTF")
            port = address.split(":")[2].split("/")[0]
            errors = command("view", "small.glb", "--no-browser", "--port", port, status=2)
            assert f"port {port} cannot be used" in errors and errors.count("\n") == 1, errors
            assert len(work_folders()) == 1
            Path(stop).touch()
        expected = {"SIGINT": 0, "SIGBREAK": 128 + 21, "SIGTERM": 128 + 15}[number]
        assert process.returncode == expected, (number, process.returncode)
        assert work_folders() == []


def work_folders():
    return list(Path(tempfile.gettempdir()).glob("gltf-meshlet-view-*"))


if __name__ == "__main__":
    scenarios = (large, batch, paths, uris, closed_pipe, in_use, batch_in_use, view)
    {scenario.__name__: scenario for scenario in scenarios}[sys.argv[1]]()
