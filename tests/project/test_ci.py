"""Linting and continuous integration: they fail when they should."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers import environment
from tests.helpers.environment import ROOT
from tools.build_wheels import PLATFORMS


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


WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def test_workflows_run_targets_and_tools_that_exist():
    text = "".join(path.read_text() for path in WORKFLOWS)
    targets = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(), re.M).group(1).split()
    called = set(re.findall(r"run: make (\S+)", text))
    assert {"lint", "packages", "fuzz"} <= called <= set(targets)
    tools = re.findall(r"python3? (tools/\w+\.py)", text)
    assert {"tools/release.py", "tools/try_wheel.py"} <= set(tools)
    assert [tool for tool in tools if not (ROOT / tool).exists()] == []
    assert "run: .ci/run" in text


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned_and_jobs_have_a_limit(path):
    """By the digest of a commit, with its release beside it, which dependabot upgrades together."""
    text = path.read_text()
    for line in re.findall(r"uses: (.*)", text):
        assert line.startswith("$/") or re.fullmatch(
            r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", line
        )
    assert "\npermissions: {}\n" in text
    jobs = re.split(r"^  (?=[\w-]+:$)", text.partition("\njobs:\n")[2], flags=re.M)[1:]
    assert jobs
    for job in jobs:
        assert re.search(r"^    (timeout-minutes: \d+|uses: \$/.*)$", job, re.M), job


def test_every_wheel_that_a_runner_can_run_is_tried():
    text = (ROOT / ".github" / "workflows" / "packages.yml").read_text()
    tags = re.findall(r"tag: (\w+) }", text)
    assert sorted(tags) == sorted(tag for tag in PLATFORMS if not tag.startswith("musl"))


@pytest.mark.parametrize(
    ("program", "arguments", "text"),
    [
        (
            "actionlint",
            ["-shellcheck="],
            "on: push\njobs:\n  a:\n    runs-on: ubuntu-24.04\n    steps: [{ rum: x }]\n",
        ),
        (
            "zizmor",
            ["--offline", "--no-progress"],
            "on: push\npermissions: {}\njobs:\n  a:\n    runs-on: ubuntu-24.04\n"
            "    steps: [{ uses: actions/checkout@v4 }]\n",
        ),
        ("hadolint", [], "FROM debian\n"),
    ],
)
def test_faulty_workflows_and_container_files_are_reported(program, arguments, text, tmp_path):
    path = Path(sys.executable).with_name(program)
    if not path.exists():
        environment.missing(f"{program} is not installed; make lint")
    folder = tmp_path / ".github" / "workflows"
    folder.mkdir(parents=True)
    (folder / "a.yml").write_text(text)
    assert run(path, *arguments, folder / "a.yml", cwd=tmp_path).returncode not in (0, 2)
    assert f"$(BIN)/{program} " in (ROOT / "Makefile").read_text()
