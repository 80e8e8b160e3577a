"""The Mitsuba plugin's library: compiled on first use, kept in the cache. Mitsuba is not needed."""

import importlib.util
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests.helpers.environment import ROOT

VERSIONS = "mitsuba-1.2.3-drjit-4.5.6-cpython-311-x86_64"


class Plugin:
    """A copy of mitsuba_plugin/build.py whose compiler only counts its runs."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch):
        self.package = folder / "site-packages" / "mitsuba_plugin"
        shutil.copytree(ROOT / "mitsuba_plugin" / "src", self.package / "src")
        for name in ("build.py", "CMakeLists.txt"):
            shutil.copy(ROOT / "mitsuba_plugin" / name, self.package)
        (self.package / "codec" / "decode").mkdir(parents=True)
        (self.package / "codec" / "CMakeLists.txt").write_text("")
        self.header = self.package / "codec" / "decode" / "header.h"
        self.header.write_text("// one\n")
        spec = importlib.util.spec_from_file_location("plugin_build", self.package / "build.py")
        self.module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.module)
        self.compiled = 0
        self.cache = folder / "cache" / "gltf-meshlet"
        monkeypatch.setenv("XDG_CACHE_HOME", str(self.cache.parent))
        monkeypatch.setattr(self.module, "_environment", lambda: VERSIONS)
        self.check_machine = self.module._check_machine
        monkeypatch.setattr(self.module, "_check_machine", lambda: None)
        monkeypatch.setattr(self.module.importlib.metadata, "version", lambda name: "1.2.3")
        monkeypatch.setattr(self.module, "_compile", self.compile)

    def compile(self, folder, advance):
        time.sleep(0.1)  # long enough for two threads to meet
        self.compiled += 1
        library = folder / self.module.LIBRARY
        library.write_text(f"library {self.compiled}")
        return library


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    return Plugin(tmp_path, monkeypatch)


def test_a_processor_that_mitsuba_s_wheel_does_not_run_on_is_named(plugin, monkeypatch):
    monkeypatch.setattr(plugin.module.platform, "machine", lambda: "aarch64")
    with pytest.raises(ImportError, match=r"cannot be compiled: it needs an x86-64.* aarch64$"):
        plugin.check_machine()


def test_first_use_compiles_and_says_so(plugin, capsys):
    path = plugin.module.library()
    assert path.read_text() == "library 1"
    assert path.is_relative_to(plugin.cache) and VERSIONS in str(path)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("gltf-meshlet: compiling the Mitsuba plugin for Mitsuba 1.2.3, once")


def test_second_use_finds_the_library_in_silence(plugin, capsys):
    first = plugin.module.library()
    capsys.readouterr()
    assert plugin.module.library() == first
    assert plugin.compiled == 1
    assert capsys.readouterr().err == ""


def test_changed_source_is_compiled_again(plugin):
    first = plugin.module.library()
    plugin.header.write_text("// two\n")
    second = plugin.module.library()
    assert second != first and second.read_text() == "library 2"
    plugin.header.write_text("// one\n")
    assert plugin.module.library() == first and plugin.compiled == 2


def test_other_versions_have_their_own_library(plugin, monkeypatch):
    first = plugin.module.library()
    monkeypatch.setattr(plugin.module, "_environment", lambda: "mitsuba-1.2.4")
    assert plugin.module.library() != first and plugin.compiled == 2


def test_concurrent_first_uses_compile_once(plugin, capsys):
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(plugin.module.library())) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert plugin.compiled == 1 and len(found) == 4 and len(set(found)) == 1
    assert capsys.readouterr().err.count("waiting for another process") == 3


def test_only_recently_used_libraries_stay(plugin):
    paths = []
    for i in range(plugin.module.KEPT + 2):
        plugin.header.write_text(f"// {i}\n")
        paths.append(plugin.module.library())
        os.utime(paths[-1], (i, i))
    plugin.header.write_text("// last\n")
    paths.append(plugin.module.library())
    assert [path.is_file() for path in paths] == [False] * 3 + [True] * plugin.module.KEPT


def test_failed_compilation_is_one_line_with_the_log(tmp_path):
    """Runs cmake with a compiler that always fails."""
    for name in ("mitsuba", "nanobind", "cmake"):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed; pip install 'gltf-meshlet[mitsuba]'")
    compiler = tmp_path / "c++"
    compiler.write_text("#!/bin/sh\necho broken: error: always fails\nexit 1\n")
    compiler.chmod(0o755)
    package = tmp_path / "mitsuba_plugin"  # not the checkout: its build folder stays as it is
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "mitsuba_plugin", package, ignore=ignored)
    shutil.copytree(ROOT / "codec", package / "codec", ignore=ignored)
    environment = {**os.environ, "CXX": str(compiler), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    result = subprocess.run(
        [sys.executable, package / "build.py"], capture_output=True, text=True, env=environment
    )
    assert result.returncode == 1
    started, failed = result.stderr.splitlines()
    assert "compiling" in started
    assert failed.startswith("gltf-meshlet: the Mitsuba plugin cannot be compiled: ")
    assert "is not able to compile" in failed and "GCC 12" in failed
    log = Path(failed.rpartition("log: ")[2])
    assert "always fails" in log.read_text()
    assert not list((tmp_path / "cache").rglob("*.so"))
    assert not list(log.parent.glob("CMakeCache.txt"))  # another CXX counts next time


def test_failed_compilation_is_not_repeated_by_one_process(plugin, monkeypatch):
    def fail(folder, advance):
        plugin.compiled += 1
        plugin.module._fail("no luck")

    monkeypatch.setattr(plugin.module, "_compile", fail)
    for _ in range(2):
        with pytest.raises(ImportError, match="cannot be compiled: no luck"):
            plugin.module.library()
    assert plugin.compiled == 1


def test_cache_that_cannot_be_written_is_one_line(plugin, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(ImportError, match="set XDG_CACHE_HOME to a folder that is writable"):
        plugin.module.library()
