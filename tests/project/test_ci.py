"""Linting and continuous integration: they fail when they should."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.helpers import environment
from tests.helpers.environment import ROOT


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, **options)


def test_unformatted_native_source_is_reported_and_formatted(tmp_path):
    pytest.importorskip("clang_format", reason="clang-format is not installed; make lint")
    source = tmp_path / "a.comp"
    source.write_text("void main( ) { int  i=0 ; }\n")
    command = (sys.executable, ROOT / "tools" / "format_native.py")
    result = run(*command, "--check", source)
    assert result.returncode == 1
    assert "a.comp: not formatted; run make format" in result.stdout
    assert run(*command, source).returncode == 0
    assert source.read_text() == "void main() { int i = 0; }\n"
    assert run(*command, "--check", source).returncode == 0


@pytest.mark.parametrize(
    ("source", "status"),
    [("export const a = 'a';\n", 0), ("export const a='a'\n", 1), ("const a = 'a';\n", 1)],
    ids=["clean", "not formatted", "unused"],
)
def test_unformatted_and_faulty_javascript_is_reported(source, status, tmp_path):
    biome = environment.need_npm_package("@biomejs") / ".." / ".bin" / "biome"
    shutil.copy(ROOT / "biome.json", tmp_path)
    (tmp_path / "web").mkdir()
    (tmp_path / "web" / "a.js").write_text(source)
    assert run(biome, "check", "--error-on-warnings", cwd=tmp_path).returncode == status


def test_hooks_format_every_native_source():
    format_native = pytest.importorskip(
        "tools.format_native", reason="needs clang-format; make lint"
    )
    hooks = (ROOT / ".pre-commit-config.yaml").read_text()
    pattern = re.search(r"files: '(.*)'", hooks).group(1)
    names = [path.relative_to(ROOT).as_posix() for path in format_native.native_files()]
    assert names
    assert [name for name in names if not re.search(pattern, name)] == []


@pytest.mark.parametrize(
    ("make", "status", "output"),
    [
        (
            'echo \'<testsuite tests="5" skipped="2"/>\' > build/test-results.xml',
            0,
            "make test-web: 3 tests ran",
        ),
        ('echo \'<testsuite tests="5" skipped="5"/>\' > build/test-results.xml', 1, "no test ran"),
        ("exit 2", 2, ""),
        (":", 1, "test-results.xml"),
    ],
    ids=["passes", "all skipped", "fails", "writes nothing"],
)
def test_ci_fails_if_tests_fail_or_none_runs(make, status, output, tmp_path):
    """.ci/run in a copy, with a program in place of make. A result of an earlier run is there."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "run", tmp_path / ".ci")
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "python").symlink_to(sys.executable)
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "test-results.xml").write_text('<testsuite tests="9" skipped="0"/>')
    fake = tmp_path / "bin" / "make"
    fake.parent.mkdir()
    fake.write_text(
        '#!/bin/sh\ncase "$*-$CI-$GLTF_MESHLET_SYSTEM_PACKAGES" in\n'
        f"test-true-yes | test-web-true-yes) ;; *) exit 3 ;; esac\n{make}\n"
    )
    fake.chmod(0o755)
    environment = {**os.environ, "PATH": f"{fake.parent}{os.pathsep}{os.environ['PATH']}"}
    environment.pop("GLTF_MESHLET_SYSTEM_PACKAGES", None)
    result = subprocess.run(
        [tmp_path / ".ci" / "run"], capture_output=True, text=True, env=environment
    )
    assert result.returncode == status, result.stderr
    assert output in result.stdout + result.stderr


def test_workflow_runs_targets_that_exist():
    text = (ROOT / ".github" / "workflows" / "test.yml").read_text()
    targets = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(), re.M).group(1).split()
    called = re.findall(r"run: make (\S+)", text)
    assert {"lint", "wheel"} <= set(called) <= set(targets)
    assert "run: .ci/run" in text
