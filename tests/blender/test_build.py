"""The zip of the Blender extension: what is in it, what it is made of. Blender is not needed."""

import ast
import hashlib
import json
import zipfile

import pytest

import gltf_ext
from tests.helpers.environment import ROOT
from tools import build_blender, build_wheels

SOURCES = sorted((ROOT / "blender").glob("*.py"))
VERSION = gltf_ext.__version__


def fake_wheel(folder, platform):
    path = folder / f"gltf_meshlet-{VERSION}-py3-none-{platform}.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("gltf_ext/__init__.py", "# same\n")
    return path


@pytest.fixture
def wheels(tmp_path):
    return [fake_wheel(tmp_path, platform) for platform in build_wheels.PLATFORMS]


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


def test_zip_has_the_code_the_licence_and_one_wheel(no_network, tmp_path):
    name = fake_wheel(tmp_path, "manylinux_2_17_x86_64").name
    (path,) = build_blender.build(tmp_path)
    assert path.name == f"gltf_meshlet-blender-{VERSION}-linux-x64.zip"
    names = zipfile.ZipFile(path).namelist()
    code = [source.name for source in SOURCES]
    assert sorted(names) == sorted([*code, "LICENSE", "blender_manifest.toml", f"wheels/{name}"])
    manifest = manifest_of(path)
    assert manifest["platforms"] == ["linux-x64"]
    assert manifest["wheels"] == [f"./wheels/{name}"]
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.2.0"
    assert len(manifest["tagline"]) <= 64


def test_every_platform_of_blender_has_a_zip(wheels, no_network, tmp_path):
    """Blender has no version for musl."""
    platforms = [manifest_of(path)["platforms"] for path in build_blender.build(tmp_path)]
    assert sorted(platforms) == [[name] for name in sorted(build_blender.PLATFORMS.values())]


def test_one_platform_only(wheels, no_network, tmp_path, capsys):
    """As `make blender PLATFORM=here`, although the folder has other wheels."""
    fake_wheel(tmp_path, build_wheels.HERE)
    for only, count in (["manylinux_2_17_aarch64"], 1), (["here"], 1), (["blender"], 6):
        assert len(build_blender.build(tmp_path, only)) == count
    assert build_blender.main([str(tmp_path), "--only", "win_amd64"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.endswith("-windows-x64.zip")


def test_groups_of_platforms():
    assert build_wheels.tags_of(["here", "here"]) == build_wheels.GROUPS["here"]
    assert len(build_wheels.GROUPS["here"]) == 1
    blenders = [tag for tag in build_wheels.PLATFORMS if build_blender.blender_platform(tag)]
    assert build_wheels.tags_of(["blender"]) == blenders


def test_the_wheel_of_this_machine(no_network, tmp_path):
    """Its own compiler makes it, for no other distribution; a zip of all platforms has none."""
    tag = build_wheels.HERE
    assert tag not in build_wheels.PLATFORMS and build_blender.blender_platform(tag)
    name = fake_wheel(tmp_path, tag).name
    (path,) = build_blender.build(tmp_path, ["here"])
    assert manifest_of(path)["wheels"] == [f"./wheels/{name}"]
    with pytest.raises(build_blender.BuildError):
        build_blender.build(tmp_path)


def test_index_describes_every_zip(wheels, no_network, tmp_path):
    """In the terms of the manifests, without what is inside the zips."""
    paths = build_blender.build(tmp_path)
    index = json.loads((tmp_path / "index.json").read_text())
    assert index["version"] == "v1" and index["blocklist"] == []
    assert len(index["data"]) == len(paths)
    for path, entry in zip(paths, index["data"]):
        archive = {name: entry.pop(f"archive_{name}") for name in ("url", "size", "hash")}
        data = path.read_bytes()
        digest = hashlib.sha256(data).hexdigest()
        assert archive == {"url": f"./{path.name}", "size": len(data), "hash": f"sha256:{digest}"}
        manifest = manifest_of(path)
        del manifest["wheels"]
        assert entry == manifest


def test_the_same_input_gives_the_same_bytes(wheels, no_network, tmp_path):
    first = [path.read_bytes() for path in build_blender.build(tmp_path)]
    assert [path.read_bytes() for path in build_blender.build(tmp_path)] == first


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


def test_wheels_for_other_platforms_only(tmp_path, capsys):
    fake_wheel(tmp_path, "musllinux_1_2_x86_64")
    assert "no wheel of" in error_of(tmp_path, capsys)


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
    """The layout of compressed data is none of the extension's business.

    gltf_ext.files has the one rule that no command writes over a file that it reads.
    """
    allowed = {"gltf_ext", "gltf_ext.options", "gltf_ext.files"}
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
