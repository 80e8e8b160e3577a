"""What is shipped uses nothing that Windows lacks, and no encoding that depends on the machine."""

import ast
import subprocess
import sys

import pytest

from tests.helpers.environment import ROOT, need_package

SHIPPED = ("gltf_ext", "gltf_meshlet", "mitsuba_plugin", "vk_backend", "blender")
LACKING = "has no attribute"
# Names that Windows lacks, also behind a test that does not exclude Windows.
SAMPLE = """
import fcntl, mmap, os, resource, signal, sys
def read(file: int) -> bytes:
    fcntl.flock(file, fcntl.LOCK_EX)
    resource.getrlimit(resource.RLIMIT_AS)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    if sys.platform != "win32":
        os.sched_getaffinity(0)
    return os.pread(file, mmap.MADV_DONTNEED, 0)
"""
SAMPLE_FINDS = {"flock", "LOCK_EX", "getrlimit", "RLIMIT_AS", "SIGHUP", "pread", "MADV_DONTNEED"}


def lacking(*arguments):
    """What mypy finds missing in the modules of Python for Windows, a line each."""
    need_package("mypy")
    command = [sys.executable, "-m", "mypy", "--platform", "win32", "--ignore-missing-imports"]
    cache = ROOT / "build" / "mypy-windows"
    result = subprocess.run(
        [*command, "--cache-dir", cache, *arguments], cwd=ROOT, capture_output=True, text=True
    )
    assert result.returncode in (0, 1), result.stdout + result.stderr
    return [line for line in result.stdout.splitlines() if f"Module {LACKING}" in line]


def test_the_search_finds_what_windows_lacks(tmp_path):
    sample = tmp_path / "sample.py"
    sample.write_text(SAMPLE)
    assert {line.split(f'{LACKING} "')[1].split('"')[0] for line in lacking(sample)} == SAMPLE_FINDS


def test_nothing_that_windows_lacks_is_used():
    assert lacking(*(word for package in SHIPPED for word in ("-p", package))) == []


@pytest.mark.parametrize("package", SHIPPED)
def test_text_files_have_an_encoding(package):
    """Windows takes its code page by default."""
    found = [
        f"{path.relative_to(ROOT)}:{call.lineno}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and opens_text(call)
        if not any(keyword.arg == "encoding" for keyword in call.keywords)
    ]
    assert found == []


def opens_text(call):
    """Whether a call is of read_text, write_text, or of open without "b" in its mode."""
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    if name in ("read_text", "write_text"):
        return True
    if name != "open" or getattr(getattr(call.func, "value", None), "id", "") in NOT_FILES:
        return False
    modes = [a.value for a in call.args[:2] if isinstance(a, ast.Constant)]
    return not any(isinstance(mode, str) and "b" in mode for mode in modes)


NOT_FILES = ("os", "webbrowser", "Image", "functions", "lief")


def test_the_search_finds_text_files():
    calls = {"open(p)": True, "open(p, 'rb')": False, "p.open('w')": True, "p.read_text()": True}
    for text, expected in calls.items():
        assert opens_text(ast.parse(text).body[0].value) == expected, text
