"""Wheels: what they contain, and that they work where there is no compiler."""

import os
import platform
import shutil
import subprocess
import sys
import zipfile
from email import message_from_bytes

import pytest
import trimesh

import gltf_ext
from gltf_meshlet.view_server import PAGE
from tests.helpers.environment import ROOT
from tools import blender_python, build_wheels


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, **options)


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
        "gltf_meshlet/cli.py",
        "gltf_scene/scene.py",
        *(f"gltf_meshlet/view_page/{path.name}" for path in PAGE.iterdir()),
        "mitsuba_plugin/build.py",
        "mitsuba_plugin/src/shape.cpp",
        "mitsuba_plugin/codec/decode/serial_decoder.glsl",
        *sources,
    } <= names
    assert any(name.startswith("vk_backend/") and name.endswith(".spv") for name in names)
    assert not any(name.startswith(("tests", "bench", "codec")) for name in names)
    assert [name for name in names if name.endswith(".so")] == ["gltf_ext/libgltf_meshlet.so"]


def works_alone(wheel, folder, *options):
    """Installs in an empty environment; a PATH with nothing but its own programs."""
    venv = folder / "venv"
    assert run(sys.executable, "-m", "venv", venv).returncode == 0
    environment = {**os.environ, "PATH": str(venv / "bin")}
    environment.pop("PYTHONPATH", None)
    installed = run(venv / "bin" / "pip", "install", "-q", wheel, env=environment)
    assert installed.returncode == 0, installed.stderr
    trimesh.creation.torus(2.0, 0.5).export(folder / "torus.obj")
    command = venv / "bin" / "gltf-meshlet"
    for arguments in (
        ("compress", "torus.obj", "torus.glb", *options),
        ("inspect", "torus.glb"),
        ("verify", "torus.obj", "torus.glb"),
        ("decompress", "torus.glb", "plain.glb"),
    ):
        result = run(command, *arguments, cwd=folder, env=environment)
        assert result.returncode == 0, result.stderr


@pytest.mark.full
def test_wheel_has_the_description(wheel):
    """tests/project/test_packaging.py: what is in it."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        description = message_from_bytes(archive.read(name)).get_payload()
    assert f"/v{gltf_ext.__version__}/docs/" in description


@pytest.mark.full
def test_wheel_works_without_a_compiler(wheel, tmp_path):
    works_alone(wheel, tmp_path)


def test_wheel_that_cannot_be_built_is_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(build_wheels, "SIMPLIFIER", "meshoptimizer-0.0.0")
    monkeypatch.setattr(build_wheels, "ROOT", tmp_path)
    monkeypatch.setattr(build_wheels, "digest_of_sources", lambda tools: "")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert build_wheels.main([str(tmp_path), "--only", "win_amd64"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "building win_amd64"
    assert lines[1].startswith("no wheel for win_amd64: ") and len(lines) == 2
    assert not list(tmp_path.glob("*.whl"))


def test_a_wheel_is_built_again_only_if_something_changed(monkeypatch, capsys, tmp_path):
    """In a copy of what wheels are made of, with a function in place of the compiler."""
    source, tag = tmp_path / "source", "win_amd64"
    for name in build_wheels.SOURCES:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).touch()
    (source / "pyproject.toml").write_text('wheel.packages = ["some_package"]')
    module = source / "some_package" / "__init__.py"
    module.parent.mkdir()
    module.touch()
    (source / "build").mkdir()
    path = tmp_path / f"gltf_meshlet-0-py3-none-{tag}.whl"
    built = []

    def build(tag, folder, simplifier):
        built.append(tag)
        path.write_text(f"wheel {len(built)}")
        return path

    monkeypatch.setattr(build_wheels, "ROOT", source)
    monkeypatch.setattr(build_wheels, "build", build)
    monkeypatch.setattr(build_wheels, "find_simplifier", lambda: None)

    def times_after_two_runs():
        for _ in range(2):
            assert build_wheels.main([str(tmp_path), "--only", tag]) == 0
            assert path.name in capsys.readouterr().out
        return len(built)

    assert times_after_two_runs() == 1
    module.write_text("# changed")
    assert times_after_two_runs() == 2
    path.write_text("not what was built")
    assert times_after_two_runs() == 3
    path.unlink()
    assert times_after_two_runs() == 4


def test_simplifier_is_that_of_the_extra():
    requirement = build_wheels.SIMPLIFIER.replace("-", "==")
    assert f'lod = ["{requirement}"]' in (ROOT / "pyproject.toml").read_text()


@pytest.mark.full
def test_wheel_of_make_wheel_builds_levels(tmp_path):
    """By Zig, with meshoptimizer inside: an environment without that package and a compiler."""
    tag = f"manylinux_2_17_{platform.machine()}"
    assert build_wheels.main([str(tmp_path), "--only", tag]) == 0
    (path,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(path).namelist()
    assert any(name.endswith("licenses/meshoptimizer.txt") for name in names)
    works_alone(path, tmp_path, "--lod")


def test_find_python_skips_programs_that_do_not_run(monkeypatch, tmp_path):
    shim = tmp_path / "python3.99"
    shim.write_text("#!/bin/sh\nexit 127\n")
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert blender_python.find_python((3, 99)) is None
    assert blender_python.find_python(sys.version_info[:2]) == sys.executable
