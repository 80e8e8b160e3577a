"""Installation, the Makefile, the README and import time."""

import importlib.metadata
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gltf_ext
from tests.helpers.environment import ROOT


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **options)


def test_console_script_tells_the_installed_version():
    script = Path(sys.executable).with_name("gltf-meshlet")
    result = run(script, "--version")
    assert result.returncode == 0
    assert importlib.metadata.version("gltf-meshlet") in result.stdout


def test_package_version_is_the_installed_one():
    assert gltf_ext.__version__ == importlib.metadata.version("gltf-meshlet")


def test_links_of_the_readme_lead_somewhere_on_pypi():
    """PyPI's description has addresses where README.md has paths; nothing else differs.

    tests/project/test_wheel.py: the description is in the wheel.
    """
    rendered = run(sys.executable, "-m", "hatch_fancy_pypi_readme")
    assert rendered.returncode == 0, rendered.stderr
    description = rendered.stdout.replace("/v42.0/", f"/v{gltf_ext.__version__}/")  # a stand-in
    links = re.findall(r"\]\(([^)]*)\)", description)
    assert links and all(link.startswith("https://") for link in links)
    base = rf"https://github\.com/[\w-]+/gltf-meshlet/(?:raw|blob)/v{gltf_ext.__version__}/"
    readme = (ROOT / "README.md").read_text()
    assert re.sub(rf"\]\({base}", "](", description).strip() == readme.strip()
    assert re.search(rf"!\[[^\]]*\]\({base}docs/\w+\.png\)", description)


def test_changelog_starts_with_the_version():
    text = (ROOT / "CHANGELOG.md").read_text()
    latest = text[text.index("## [") :].split("\n## [")[0]
    assert gltf_ext.__version__ in latest


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


def test_a_machine_without_a_compiler_gets_one():
    """The backend asks for ziglang, in the version of the extra "web"."""
    backend = ROOT / "tools" / "build_backend.py"
    with_one = {**os.environ, "CXX": "some"}
    assert run(sys.executable, backend, env=with_one).stdout.strip() == ""
    without = {name: value for name, value in os.environ.items() if name != "CXX"}
    asked = run(sys.executable, backend, env={**without, "PATH": ""}).stdout.strip()
    assert f'"{asked}"' in (ROOT / "pyproject.toml").read_text()
    assert asked.startswith("ziglang==")


def test_mitsuba_is_pinned_once():
    """The extra's nanobind is the build system's: one environment has one."""
    text = (ROOT / "pyproject.toml").read_text()
    assert re.search(r"^mitsuba = .*mitsuba==[\d.]+.*drjit==[\d.]+", text, re.M)
    assert len(set(re.findall(r"nanobind==([\d.]+)", text))) == 1


def test_tests_run_the_linter_first():
    """`make -n` prints the commands of a target in their order."""
    commands = run("make", "-n", "test").stdout
    assert 0 <= commands.find("ruff check") < commands.find("-m pytest")


@pytest.mark.parametrize(
    ("argument", "packages"),
    [
        ([], "glslang-tools spirv-tools"),
        (["browsers"], "chromium firefox-esr xvfb xauth"),
        (["platforms"], "wine qemu-user musl"),
    ],
)
def test_system_packages_are_named_not_installed(argument, packages, tmp_path):
    """Without permission to install, one line names what is missing; here, all programs."""
    environment = {**os.environ, "GLTF_MESHLET_SYSTEM_PACKAGES": "no", "PATH": str(tmp_path)}
    command = (sys.executable, ROOT / "tools" / "system_packages.py", *argument)
    result = run(*command, env=environment)
    (line,) = result.stdout.splitlines()
    assert result.returncode == 0
    assert line.startswith("make: ")
    assert "apt install" in line
    assert packages in line
