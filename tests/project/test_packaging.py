"""Installation, the Makefile, wheels, continuous integration, the README and import time."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import trimesh

import gltf_ext
from tests.helpers.environment import ROOT
from tools import build_wheels


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **options)


def test_console_script_tells_the_installed_version():
    script = Path(sys.executable).with_name("gltf-meshlet")
    result = run(script, "--version")
    assert result.returncode == 0
    assert importlib.metadata.version("gltf-meshlet") in result.stdout


def test_package_version_is_the_installed_one():
    assert gltf_ext.__version__ == importlib.metadata.version("gltf-meshlet")


def test_importing_the_package_is_light():
    heavy = ("trimesh", "matplotlib", "DracoPy")
    code = f"import sys, gltf_ext; print([name for name in {heavy} if name in sys.modules])"
    assert run(sys.executable, "-c", code).stdout.strip() == "[]"


def test_make_help_lists_every_command():
    targets = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(), re.M).group(1).split()
    listed = run("make", "help").stdout
    for target in targets:
        assert f"make {target}" in listed, target


def test_build_tools_of_the_makefile_are_those_of_pyproject():
    requires = re.search(
        r"^requires = \[(.*)\]$", (ROOT / "pyproject.toml").read_text(), re.M
    ).group(1)
    tools = re.search(r"^BUILD_TOOLS := (.*)$", (ROOT / "Makefile").read_text(), re.M).group(1)
    for requirement in re.findall(r'"([^"]+)"', requires):
        assert f'"{requirement}"' in tools


def test_mitsuba_is_pinned_once():
    """The extra's nanobind is the build system's: one environment has one."""
    text = (ROOT / "pyproject.toml").read_text()
    assert re.search(r"^mitsuba = .*mitsuba==[\d.]+.*drjit==[\d.]+", text, re.M)
    assert len(set(re.findall(r"nanobind==([\d.]+)", text))) == 1


def test_tests_run_the_linter_first():
    """`make -n` prints the commands of a target in their order."""
    commands = run("make", "-n", "test").stdout
    assert 0 <= commands.find("ruff check") < commands.find("-m pytest")


def test_system_packages_are_named_not_installed(tmp_path):
    """Without permission to install, one line names what is missing; here, all shader tools."""
    environment = {**os.environ, "GLTF_MESHLET_SYSTEM_PACKAGES": "no", "PATH": str(tmp_path)}
    result = run(sys.executable, ROOT / "tools" / "system_packages.py", env=environment)
    (line,) = result.stdout.splitlines()
    assert result.returncode == 0
    assert line.startswith("make: ")
    assert "apt install" in line
    assert "glslang-tools spirv-tools" in line


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


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel for this Python, not repaired, built from a copy of the project."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = (".venv", "build", "dist", ".git", "demo-output", "__pycache__")
    source = folder / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*ignored))
    command = (sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation")
    result = run(*command, "-w", folder, source)
    assert result.returncode == 0, result.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.mark.full
def test_wheel_contains_all_packages_and_the_sources_of_the_plugin(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = {
        f"mitsuba_plugin/codec/{path.relative_to(ROOT / 'codec')}"
        for path in (ROOT / "codec").glob("*/*.h")
    }
    assert {
        "gltf_meshlet/render.py",
        "mitsuba_plugin/build.py",
        "mitsuba_plugin/src/shape.cpp",
        "mitsuba_plugin/codec/decode/serial_decoder.glsl",
        *sources,
    } <= names
    assert any(name.startswith("vk_backend/") and name.endswith(".spv") for name in names)
    assert not any(name.startswith(("tests", "bench", "codec")) for name in names)
    assert [name for name in names if name.endswith(".so") and "_codec" not in name] == []


@pytest.mark.full
def test_wheel_works_without_a_compiler(wheel, tmp_path):
    """An empty environment, and a PATH with nothing but its own programs."""
    venv = tmp_path / "venv"
    assert run(sys.executable, "-m", "venv", venv).returncode == 0
    environment = {**os.environ, "PATH": str(venv / "bin")}
    environment.pop("PYTHONPATH", None)
    installed = run(venv / "bin" / "pip", "install", "-q", wheel, env=environment)
    assert installed.returncode == 0, installed.stderr
    trimesh.creation.torus(2.0, 0.5).export(tmp_path / "torus.obj")
    command = venv / "bin" / "gltf-meshlet"
    for arguments in (
        ("compress", "torus.obj", "torus.glb"),
        ("inspect", "torus.glb"),
        ("verify", "torus.obj", "torus.glb"),
    ):
        result = subprocess.run(
            [command, *arguments], capture_output=True, text=True, cwd=tmp_path, env=environment
        )
        assert result.returncode == 0, result.stderr


def test_wheels_that_cannot_be_built_are_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(build_wheels, "find_python", lambda version: None)
    assert build_wheels.main([str(tmp_path)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "no wheel for cp311: python3.11 is not installed",
        "no wheel for cp312-abi3: python3.12 or python3.13 or python3.14 is not installed",
    ]


def test_find_python_skips_programs_that_do_not_run(monkeypatch, tmp_path):
    shim = tmp_path / "python3.99"
    shim.write_text("#!/bin/sh\nexit 127\n")
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert build_wheels.find_python((3, 99)) is None
    assert build_wheels.find_python(sys.version_info[:2]) == sys.executable


@pytest.mark.parametrize(
    ("make", "status", "output"),
    [
        ('echo \'<testsuite tests="5" skipped="2"/>\' > build/test-results.xml', 0, "3 tests ran"),
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
    fake.write_text(f'#!/bin/sh\ntest "$*" = test && test "$CI" = true || exit 3\n{make}\n')
    fake.chmod(0o755)
    environment = {**os.environ, "PATH": f"{fake.parent}{os.pathsep}{os.environ['PATH']}"}
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


def test_readme_shows_the_commands_and_its_links_resolve():
    text = (ROOT / "README.md").read_text()
    for command in ("make demo", "make test", "gltf-meshlet compress", "gltf-meshlet verify"):
        assert command in text
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert target.startswith("https://") or (ROOT / target).exists(), target


def test_readme_names_no_option_that_does_not_exist():
    usage = run(Path(sys.executable).with_name("gltf-meshlet"), "compress", "-h").stdout
    options = re.findall(
        r"(?:gltf-meshlet compress .*|^\| `.*`.*)$", (ROOT / "README.md").read_text(), re.M
    )
    for option in re.findall(r"(?<=[ `])--?[a-z][a-z-]*", " ".join(options)):
        assert option in usage, option


def test_readme_python_example_is_valid():
    for block in re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S):
        compile(block, "README.md", "exec")
        for name in re.findall(r"gltf_ext\.(\w+)\(", block):
            assert hasattr(gltf_ext, name), name
