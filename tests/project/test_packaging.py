"""What a newcomer meets first: installation, the Makefile, the README, import time."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import gltf_ext

ROOT = Path(__file__).resolve().parent.parent.parent


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
    code = "import sys, gltf_ext; print([name for name in ('trimesh', 'matplotlib', 'DracoPy') if name in sys.modules])"
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


def test_system_packages_are_told_not_installed(tmp_path):
    """Without leave to install, one line names what is missing, in a machine without programs all shader tools."""
    environment = {**os.environ, "GLTF_MESHLET_SYSTEM_PACKAGES": "no", "PATH": str(tmp_path)}
    result = run(sys.executable, ROOT / "tools" / "system_packages.py", env=environment)
    (line,) = result.stdout.splitlines()
    assert (
        result.returncode == 0
        and line.startswith("make: ")
        and "apt install" in line
        and "glslang-tools spirv-tools" in line
    )


@pytest.mark.full
def test_the_wheel_has_all_packages_and_what_builds_the_plugin(tmp_path):
    folder = tmp_path / "wheel"
    source = tmp_path / "source"
    shutil.copytree(
        ROOT,
        source,
        ignore=shutil.ignore_patterns(".venv", "build", ".git", "demo-output", "__pycache__"),
    )
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        folder,
        source,
    ]
    result = run(*command)
    assert result.returncode == 0, result.stderr
    (wheel,) = folder.iterdir()
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = {
        f"mitsuba_plugin/codec/{path.relative_to(ROOT / 'codec')}"
        for path in (ROOT / "codec").glob("*/*.h")
    }
    assert {
        "gltf_meshlet/render_command.py",
        "mitsuba_plugin/build.py",
        "mitsuba_plugin/src/shape.cpp",
        *sources,
    } <= names
    assert "mitsuba_plugin/codec/decode/serial_decoder.glsl" in names
    assert any(name.startswith("vk_backend/") and name.endswith(".spv") for name in names)
    assert not any(
        name.startswith(("tests", "bench", "codec", "mitsuba_plugin/plugins")) for name in names
    )


def test_ci_runs_the_tests():
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    assert "make test" in script.read_text()


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
