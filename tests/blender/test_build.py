"""The zip of the Blender extension: what is in it, what it is made of. Blender is not needed."""

import ast
import base64
import csv
import hashlib
import io
import zipfile

import pytest

import gltf_ext
from tests.helpers.environment import ROOT
from tools import build_blender, build_wheels

SOURCES = sorted((ROOT / "blender").glob("*.py"))
VERSION = gltf_ext.__version__


def fake_wheel(folder, tags, module):
    """A wheel with one compiled module; tags: Python, ABI, platform."""
    path = folder / f"gltf_meshlet-{VERSION}-{tags}.whl"
    information = f"gltf_meshlet-{VERSION}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("gltf_ext/__init__.py", "# same\n")
        archive.writestr(f"gltf_ext/{module}", module)
        archive.writestr(f"{information}/WHEEL", f"Wheel-Version: 1.0\nTag: {tags}\n")
        archive.writestr(f"{information}/RECORD", "old")
    return path


@pytest.fixture
def wheels(tmp_path):
    return [
        fake_wheel(tmp_path, "cp311-cp311-manylinux_2_28_x86_64", "_codec.cpython-311.so"),
        fake_wheel(tmp_path, "cp312-abi3-manylinux_2_28_x86_64", "_codec.abi3.so"),
    ]


@pytest.fixture
def no_network(monkeypatch):
    monkeypatch.setattr(build_blender, "download", lambda folder: [])


def manifest_of(path):
    """The manifest's values; a parser of TOML would need Python 3.11."""
    text = zipfile.ZipFile(path).read("blender_manifest.toml").decode()
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    source = "\n".join(lines).replace("permissions = { files =", "permissions = dict(files=")
    values = {}
    exec(source.replace(" }", ")"), {"dict": dict}, values)
    return values


# --- the zip ---


def test_zip_has_the_code_the_licence_and_one_wheel(wheels, no_network, tmp_path):
    path = build_blender.build(tmp_path)
    names = zipfile.ZipFile(path).namelist()
    wheel = f"wheels/gltf_meshlet-{VERSION}-py3-none-manylinux_2_28_x86_64.whl"
    code = [source.name for source in SOURCES]
    assert sorted(names) == sorted([*code, "LICENSE", "blender_manifest.toml", wheel])
    manifest = manifest_of(path)
    assert manifest["platforms"] == ["linux-x64"]
    assert manifest["wheels"] == [f"./{wheel}"]
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.2.0"
    assert len(manifest["tagline"]) <= 64


def test_platforms_are_those_of_the_wheels(wheels, no_network, tmp_path):
    for tag, module in (("cp311-cp311", "a.pyd"), ("cp312-abi3", "b.pyd")):
        fake_wheel(tmp_path, f"{tag}-win_amd64", module)
    manifest = manifest_of(build_blender.build(tmp_path))
    assert manifest["platforms"] == ["linux-x64", "windows-x64"]
    assert [name.rpartition("-")[2] for name in manifest["wheels"]] == [
        "manylinux_2_28_x86_64.whl",
        "win_amd64.whl",
    ]


def test_the_same_input_gives_the_same_bytes(wheels, no_network, tmp_path):
    first = build_blender.build(tmp_path).read_bytes()
    assert build_blender.build(tmp_path).read_bytes() == first


def test_merged_wheel_holds_both_modules_and_lists_its_files(wheels, tmp_path):
    (tmp_path / "merged").mkdir()
    merged = zipfile.ZipFile(build_blender.merge(wheels, tmp_path / "merged"))
    modules = [name for name in merged.namelist() if name.endswith(".so")]
    assert modules == ["gltf_ext/_codec.cpython-311.so", "gltf_ext/_codec.abi3.so"]
    information = f"gltf_meshlet-{VERSION}.dist-info"
    assert b"\nTag: py3-none-manylinux_2_28_x86_64\n" in merged.read(f"{information}/WHEEL")
    rows = list(csv.reader(io.StringIO(merged.read(f"{information}/RECORD").decode())))
    assert [row[0] for row in rows] == merged.namelist()
    for name, digest, size in rows[:-1]:
        data = merged.read(name)
        expected = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        assert (digest, size) == (f"sha256={expected}", str(len(data)))


@pytest.mark.parametrize(
    ("version", "semantic"),
    [("0.2.0.dev0", "0.2.0-dev0"), ("1.0.0rc1", "1.0.0-rc1"), ("1.2.3", "1.2.3")],
)
def test_version_is_semantic(version, semantic):
    assert build_blender.semantic_version(version) == semantic


# --- errors: one line and a status ---


def error_of(folder, capsys):
    assert build_blender.main([str(folder)]) == 1
    assert not list(folder.glob("*.zip"))
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_without_wheels(tmp_path, capsys):
    assert "no wheel of" in error_of(tmp_path, capsys)


@pytest.mark.parametrize("missing", range(len(build_wheels.TAGS)))
def test_with_a_wheel_for_one_python_only(wheels, missing, tmp_path, capsys):
    wheels[missing].unlink()
    tag = list(build_wheels.TAGS)[missing]
    assert f"no wheel {tag} for manylinux_2_28_x86_64" in error_of(tmp_path, capsys)


def test_platform_that_blender_does_not_have(no_network, tmp_path, capsys):
    for tag in ("cp311-cp311", "cp312-abi3"):
        fake_wheel(tmp_path, f"{tag}-linux_mips", "a.so")
    assert "no name for the platform linux_mips" in error_of(tmp_path, capsys)


def test_package_index_that_does_not_answer(wheels, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(build_blender, "REQUIREMENTS", ("gltf-meshlet-does-not-exist",))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert "cannot download gltf-meshlet-does-not-exist" in error_of(tmp_path, capsys)


# --- the code ---


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_files_name_their_licence(path):
    assert "SPDX-License-Identifier: GPL-3.0-or-later" in path.read_text().splitlines()[1]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_only_public_functions_of_the_package_are_used(path):
    """The layout of compressed data is none of the extension's business."""
    allowed = {"gltf_ext", "gltf_ext.compression.options"}
    for node in ast.walk(ast.parse(path.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module]
        assert {name for name in names if name.startswith("gltf_ext")} <= allowed
        is_use = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
        if is_use and node.value.id == "gltf_ext":
            assert node.attr in gltf_ext.__all__


def test_licence_is_the_gpl_and_the_rest_stays_mit():
    assert "GNU GENERAL PUBLIC LICENSE" in (ROOT / "blender" / "LICENSE").read_text()[:200]
    assert (ROOT / "LICENSE").read_text().startswith("MIT License")
    project = (ROOT / "pyproject.toml").read_text()
    assert 'license = "MIT"' in project and 'sdist.exclude = ["blender"]' in project
