"""Files that are not what their names say, or lack something: one line that says what it is."""

import json
import struct

import pytest

import gltf_ext
from gltf_meshlet import cli
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_json, glb_parts, grid_mesh

POINTER = b"""version https://git-lfs.github.com/spec/v1
oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393
size 12345
"""
IS_POINTER = "a Git LFS pointer, not the file itself; fetch it: git lfs pull"


def sheet(**properties):
    builder = Builder()
    positions, triangles = grid_mesh(4, 4)
    builder.mesh({"POSITION": positions}, triangles)
    builder.properties.update(properties)
    return builder


def line_of(path, capsys):
    assert cli.main(["compress", str(path), str(path.parent / "out.glb")]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and not (path.parent / "out.glb").exists()
    assert printed.err.startswith(f"gltf-meshlet: {path}: ") and printed.err.count("\n") == 1
    return printed.err.strip()


@pytest.mark.parametrize("suffix", ["glb", "gltf", "obj", "ply", "stl"])
def test_lfs_pointers(tmp_path, capsys, suffix):
    path = tmp_path / f"model.{suffix}"
    path.write_bytes(POINTER)
    assert line_of(path, capsys).endswith(f": is {IS_POINTER}")


def test_lfs_pointers_beside_a_model(tmp_path, capsys):
    path = sheet().write(tmp_path / "in.glb")
    properties, _ = glb_parts(path)
    properties["buffers"][0]["uri"] = "data.bin"
    (tmp_path / "in.gltf").write_text(json.dumps(properties))
    (tmp_path / "data.bin").write_bytes(POINTER)
    line = line_of(tmp_path / "in.gltf", capsys)
    assert line.endswith(f": refers to data.bin, which is {IS_POINTER}")


def test_images_that_are_not_there(tmp_path):
    """The data is embedded, the reference stays, and only the image is missing."""
    images = [{"uri": "missing.png"}, {"uri": "pointer.png"}]
    (tmp_path / "pointer.png").write_bytes(POINTER)
    path = sheet(images=images).write(tmp_path / "in.glb")
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    assert report["warnings"][:2] == [
        "image 0 is not embedded: it refers to missing.png, which cannot be read; "
        "put the file beside it",
        f"image 1 is not embedded: it refers to pointer.png, which is {IS_POINTER}",
    ]
    assert glb_json(tmp_path / "out.glb")["images"] == images


def test_lfs_pointers_beside_an_obj(tmp_path):
    path = tmp_path / "in.obj"
    path.write_text("mtllib in.mtl\nmtllib other.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n"
                    "usemtl red\nf 1/1 2/1 3/1\n")  # fmt: skip
    (tmp_path / "in.mtl").write_text("newmtl red\nmap_Kd red.png\n")
    for name in ("other.mtl", "red.png"):
        (tmp_path / name).write_bytes(POINTER)
    warnings = gltf_ext.compress(path, tmp_path / "out.glb")["warnings"]
    pointer, remedy = IS_POINTER.split("; ")
    assert warnings[:2] == [
        f"red.png: it is {IS_POINTER}, so this texture is left out",
        f"other.mtl is {pointer}, so its materials are left out; {remedy}",
    ]


@pytest.mark.parametrize(
    "properties",
    [
        {"asset": {"version": "1.0"}, "meshes": {"a": {}}, "accessors": {}},
        {"asset": {}, "accessors": {"a": {}}},
        {"bufferViews": {"a": {}}, "techniques": {}},
    ],
)
def test_gltf_1(tmp_path, capsys, properties):
    path = tmp_path / "in.gltf"
    path.write_text(json.dumps(properties))
    remedy = "convert it first: npx gltf-pipeline -i IN -o OUT.glb"
    assert line_of(path, capsys).endswith(f"is glTF 1.0, not glTF 2.0; {remedy}")
    path = tmp_path / "in.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 1, 24, 4, 0) + b"{}  ")
    assert line_of(path, capsys).endswith(f"is .glb version 1, not glTF 2.0; {remedy}")


def test_json_padded_with_nul(tmp_path):
    properties, binary = glb_parts(sheet().write(tmp_path / "in.glb"))
    properties["asset"]["generator"] = "x" * (-len(json.dumps(properties)) % 4 + 1)
    data = glb_bytes(properties, bytes(binary))
    end = data.index(b"BIN\0") - 4
    (tmp_path / "in.glb").write_bytes(data[:end].replace(b"}   ", b"}\0\0\0") + data[end:])
    assert gltf_ext.compress(tmp_path / "in.glb", tmp_path / "out.glb")["totals"]["triangles"] == 18


def test_extensions_that_are_null(tmp_path):
    builder = sheet(extensions=None)
    builder.properties["meshes"][0]["primitives"][0]["extensions"] = None
    builder.properties["nodes"][0]["extensions"] = None
    path = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]


def test_integers_that_are_written_as_floats(tmp_path):
    """In extensions, too: JSON does not tell 1.0 from 1."""
    path = sheet().write(tmp_path / "in.glb")
    gltf_ext.compress(path, tmp_path / "out.glb")
    properties, binary = glb_parts(tmp_path / "out.glb")
    as_floats = json.loads(json.dumps(properties), parse_int=float)
    (tmp_path / "floats.glb").write_bytes(glb_bytes(as_floats, bytes(binary)))
    assert gltf_ext.validate(tmp_path / "floats.glb") == []
    assert gltf_ext.verify(path, tmp_path / "floats.glb")["ok"]


def test_the_size_of_a_gltf_is_that_of_all_its_files(tmp_path):
    properties, binary = glb_parts(sheet().write(tmp_path / "in.glb"))
    properties["buffers"][0]["uri"] = "data.bin"
    (tmp_path / "in.gltf").write_text(json.dumps(properties))
    (tmp_path / "data.bin").write_bytes(binary + bytes(100_000))
    report = gltf_ext.compress(tmp_path / "in.gltf", tmp_path / "out.glb")
    size = (tmp_path / "in.gltf").stat().st_size + (tmp_path / "data.bin").stat().st_size
    assert report["input_bytes"] == size
    assert "the file grew; the original is smaller" not in report["warnings"]
