"""The readers of .obj, .ply and .stl: what they keep, blocks of any size, what they refuse."""

import builtins
import codecs
import io
import os
import random
import tracemalloc
from functools import partial
from pathlib import Path, PureWindowsPath

import numpy as np
import pytest
import trimesh
from PIL import Image

import gltf_ext
from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from gltf_ext.portable import is_relative
from gltf_ext.sources import text
from gltf_ext.sources.importers import open_model, read_meshes, referenced_files
from gltf_ext.sources.mesh_files import is_there
from gltf_ext.sources.row_arrays import FileRows, MemoryRows, RowArray
from gltf_ext.sources.source import read_primitive
from gltf_ext.work_files import WorkFile

OBJ = b"""# a quad and a triangle with a seam, then two faces of other materials
mtllib m.mtl
o thing
v 0 0 0
v 1 0 0 1.0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0.25
vt 1 1
vn 0 0 1
vn 0 0 -1
f 1/1/1 2/2/1 \\
  3/3/1 4/1/1
usemtl red
f 1/1/2 3/3/2 2/2/2
usemtl two words
v 0 0 5
f -1//-1 -2//-1 -3//-2
f 5 4 3 # no normal
"""


def ply(order: str) -> bytes:
    """A triangle and a quad with colours; then a triangle."""
    header = (
        f"ply\nformat {order} 1.0\ncomment TextureFile t.png\nelement vertex 5\n"
        "property double x\nproperty float y\nproperty float z\nproperty float16 u\n"
        "property uchar v\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nelement edge 0\nproperty int vertex1\n"
        "element face 3\nproperty list uchar int vertex_indices\nproperty ushort flag\nend_header\n"
    )
    vertices = [(i, i * i, 0.5, 0.25, 1, 10 * i, 0, 255) for i in range(5)]
    faces = [(0, 1, 2), (0, 1, 2, 3), (2, 3, 4)]
    if order == "ascii":
        rows = [*vertices, *((len(face), *face, 7) for face in faces)]
        return (header + "\n".join(" ".join(map(str, row)) for row in rows)).encode()
    end = "<" if "little" in order else ">"
    vertex = np.dtype(
        [(n, end + t) for n, t in zip("xyzuvrgb", ["f8", "f4", "f4", "f2", "u1", "u1", "u1", "u1"])]
    )
    body = np.array(vertices, vertex).tobytes()
    for face in faces:
        body += bytes([len(face)]) + np.array(face, end + "i4").tobytes()
        body += np.array(7, end + "u2").tobytes()
    return header.encode() + body


STL = b"".join(
    b"Solid %s\n"
    % name
    + b" facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   VERTEX 1e0 0 0\n   vertex 0 +1 0\n"
    b"  endloop\n endfacet\n" * 2 + b"endsolid %s\n" % name
    for name in (b"first one", b"b")
)
BINARY_STL = (
    bytes(80)
    + (2).to_bytes(4, "little")
    + 2 * (np.float32([0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0]).tobytes() + b"ab")
)
FILES = {
    "a.obj": OBJ,
    "a.ply": ply("ascii"),
    "little.ply": ply("binary_little_endian"),
    "big.ply": ply("binary_big_endian"),
    "a.stl": STL,
    "b.stl": BINARY_STL,
}


@pytest.fixture
def folder(tmp_path):
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.png")
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.bmp")
    (tmp_path / "m.mtl").write_text(
        "newmtl red\nKd 1 0.5 0\nNs 98\nmap_Kd t.bmp\nnewmtl two words\nNewmtl unused\nKd x\n"
    )
    return tmp_path


# Only some vertices have colours; only some faces texture coordinates at their corners.
TWO_VERTEX_ELEMENTS = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element vertex 1
property float x
property float y
property float z
element face 2
property list uchar int vertex_index
property list uchar float texcoord
end_header
0 0 0 1 2 3
1 0 0 4 5 6
0 1 0 7 8 9
1 1 0
3 0 1 2 6 0 0 1 0 0 1
3 2 1 3 6 0 1 1 0 1 1
"""
TWO_FACE_ELEMENTS = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_index
property list uchar float texcoord
element face 1
property list uchar int vertex_index
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2 6 0 0 1 0 0 1
3 2 1 0
"""


TWO_TYPES = b"""ply
format ascii 1.0
element vertex 1
property float x
property float y
property float z
property uchar foo
element vertex 2
property float x
property float y
property float z
property float foo
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1
1 0 0 1
0 1 0 1
3 0 1 2
"""


def read(path):
    """(name of the mesh, of the material) -> (triangles, attributes) of each primitive.

    Further primitives of the same names have a number as well.
    """
    document = open_model(path)
    result = {}
    for m, mesh in enumerate(document.meshes):
        for p, primitive in enumerate(mesh["primitives"]):
            number = primitive.get("material")
            names = (
                mesh["name"],
                None if number is None else document.materials[number].get("name"),
            )
            arrays = read_primitive(document, m, p)[0]
            key = (*names, p) if names in result else names
            result[key] = (arrays.indices, arrays.attributes)
    return result


def corners(mesh, attribute="POSITION"):
    triangles, attributes = mesh
    return attributes[attribute][triangles].tolist()


def test_obj(folder):
    meshes = read(folder / "a.obj")
    assert list(meshes) == [
        ("thing", None),
        ("thing", "red"),
        ("thing", "two words"),
        ("thing", "two words", 3),
    ]
    quad = meshes["thing", None]
    assert corners(quad) == [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 1, 0], [0, 1, 0]],
    ]
    assert corners(quad, "TEXCOORD_0")[0] == [[0, 1], [1, 0.75], [1, 0]]
    assert set(corners(quad, "NORMAL")[1][0]) == {0, 1}
    assert len(meshes["thing", "red"][1]["POSITION"]) == 3
    for key, normal in ((("thing", "two words"), {"NORMAL"}), (("thing", "two words", 3), set())):
        assert corners(meshes[key]) == [[[0, 0, 5], [0, 1, 0], [1, 1, 0]]]
        assert set(meshes[key][1]) == {"POSITION", *normal}


def test_obj_materials(folder):
    document = open_model(folder / "a.obj")
    numbers = [p.get("material") for m in document.meshes for p in m["primitives"]]
    red, other = document.materials
    assert numbers == [None, 0, 1, 1] and (red["name"], other["name"]) == ("red", "two words")
    pbr = red["pbrMetallicRoughness"]
    assert pbr["baseColorFactor"] == [1, 0.5, 0, 1]
    assert pbr["roughnessFactor"] == pytest.approx(0.02**0.25)
    assert pbr["baseColorTexture"]["index"] == 0
    data = bytes(document.bytes_of_view(document.images[0]["bufferView"]))
    with Image.open(io.BytesIO(data)) as image:  # glTF has no .bmp
        assert image.format == "PNG" and image.getpixel((0, 0))[:3] == (255, 0, 0)
    assert document.import_warnings == ()
    assert document.files() == [folder / "m.mtl", folder / "t.bmp"]


def test_obj_keywords_in_any_case(tmp_path):
    (tmp_path / "a.obj").write_text("V 0 0 0\nv 1 0 0\nV 0 1 0\nVN 0 0 1\nF 1//1 2//1 3//1\n")
    ((triangles, attributes),) = read(tmp_path / "a.obj").values()
    assert triangles.tolist() == [[0, 1, 2]] and attributes["NORMAL"].tolist() == [[0, 0, 1]] * 3


@pytest.mark.parametrize("name", [b"o \\", b"usemtl \\", b"usemtl a\\"])
def test_no_backslash_continues_a_name(tmp_path, name):
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + name + b"\nf 1 2 3\n")
    ((triangles, _),) = read(tmp_path / "a.obj").values()
    assert triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("line", [b"\\\n", b"\\\nusemtl\n", b"v \\\n"])
def test_continued_lines_take_linear_time(line):
    """Where time is quadratic, this takes ten minutes."""
    scanned = _codec.scan_lines(line * (1 << 20), {"usemtl": "any"})
    assert len(scanned[0][2]) == (1 << 20) * (b"usemtl" in line)


@pytest.mark.parametrize("name", ["a.obj", "a.stl"])
def test_a_byte_order_mark_is_left_out(folder, tmp_path, name):
    expected = read(folder / name)
    data = (folder / name).read_bytes().removeprefix(codecs.BOM_UTF8)
    (tmp_path / name).write_bytes(codecs.BOM_UTF8 + data)
    for (triangles, attributes), found in zip(expected.values(), read(tmp_path / name).values()):
        assert np.array_equal(triangles, found[0])
        assert np.array_equal(attributes["POSITION"], found[1]["POSITION"])


def test_obj_colors(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0 1 0.5 0\nv 1 0 0 0 0 2\nv 0 1 0 0 0 nan\nf 1 2 3\n")
    ((_, attributes),) = read(path).values()
    assert attributes["COLOR_0"].tolist() == [
        [255, 128, 0, 255],
        [0, 0, 255, 255],
        [0, 0, 0, 255],
    ]


def test_obj_texture_coordinates_without_v(tmp_path):
    """It is 0 then."""
    (tmp_path / "a.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5\nvt 0.25 0.75 1\nvt 1\nf 1/1 2/2 3/3\n"
    )
    ((_, attributes),) = read(tmp_path / "a.obj").values()
    assert attributes["TEXCOORD_0"].tolist() == [[0.5, 1], [0.25, 0.25], [1, 1]]


SMALL = ("1e-400", "-1E-99999999999999999999", f"0.{'0' * 400}1", f".{'0' * 400}1e+50")
LARGE = ("1e400", "1e+99999999999999999999", f"-1{'0' * 400}e-50")


def test_numbers_that_no_double_holds(tmp_path):
    """Those near 0 are 0; large ones are refused."""
    path = tmp_path / "a.obj"
    for number in SMALL:
        path.write_text(f"v {number} 1 2\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        ((_, attributes),) = read(path).values()
        assert attributes["POSITION"][0].tolist() == [0, 1, 2], number
    for number in LARGE:
        path.write_text(f"v {number} 1 2\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with pytest.raises(MeshletError, match="is not a line of numbers"):
            open_model(path)


@pytest.mark.parametrize(
    "line",
    [
        "mtllib a.mtl b.mtl",
        "mtllib a.mtl my b.MTL",
        'mtllib "a.mtl"\nmtllib "my b.MTL"',
        "mtllib .\\a.mtl sub\\b.mtl",
        "mtllib one two",
    ],
)
def test_obj_several_libraries(tmp_path, line):
    (tmp_path / "sub").mkdir()
    for names, material in (
        (("a.mtl", "one"), "a"),
        (("b.mtl", "my b.MTL", "two", "sub/b.mtl"), "b"),
    ):
        for name in names:
            (tmp_path / name).write_bytes(codecs.BOM_UTF8 + b"newmtl %s\n" % material.encode())
    (tmp_path / "a.obj").write_text(
        line + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n"
    )
    document = open_model(tmp_path / "a.obj")
    assert [material["name"] for material in document.materials] == ["a", "b"]
    assert document.import_warnings == ()
    named = {path for path in referenced_files(tmp_path / "a.obj") if path.is_file()}
    assert named >= set(document.files()) and len(document.files()) >= 2


def test_obj_libraries_that_are_not_there(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib x.mtl y z.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert [line.split(" is ")[0] for line in open_model(tmp_path / "a.obj").import_warnings] == [
        "x.mtl",
        "y z.mtl",
    ]


@pytest.mark.parametrize(
    "words, lost",
    [
        ("-s 1 1 1 t.png", ""),
        ("-blendu on -Bm 0.5 -imfchan r -texres 9 -type sphere t.png", ""),
        ("-s 2 t.png", ""),
        ("-o 0 0 0 -s 1 3 -clamp on -cc on t.png", "-cc"),
        ("-mm 0 1 -t 0.5 0.5 0.5 -cc off t.png", "-t"),
        ("-clamp off my t.png", ""),
        ("-s 1 1 1 1", ""),
        ('"t.png"', ""),
        ("-s 1 1 1 .\\t.png", ""),
        ("sub\\t.png", ""),
    ],
)
def test_obj_texture_options(tmp_path, words, lost):
    """The file is found behind them; those that are lost and change the picture are named."""
    (tmp_path / "sub").mkdir()
    for name in ("t.png", "my t.png", "1", "sub/t.png"):
        Image.new("RGB", (2, 2)).save(tmp_path / name, "PNG")
    (tmp_path / "m.mtl").write_text(f"newmtl m\nmap_Kd {words}\n")
    (tmp_path / "a.obj").write_text(f"mtllib m.mtl\n{TRIANGLE}")
    document = open_model(tmp_path / "a.obj")
    assert len(document.images) == 1
    assert document.import_warnings == (
        (f"m: its texture is shown without {lost}",) if lost else ()
    )
    named = {path for path in referenced_files(tmp_path / "a.obj") if path.is_file()}
    assert named >= set(document.files()) and len(document.files()) == 2


def test_obj_with_indices_of_missing_normals(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3/3\n")
    document = open_model(tmp_path / "a.obj")
    assert len(document.import_warnings) == 2 and "normal" in document.import_warnings[1]
    assert set(document.primitive(0, 0)["attributes"]) == {"POSITION"}


@pytest.mark.parametrize("name", ["a.ply", "little.ply", "big.ply"])
def test_ply(folder, name):
    ((triangles, attributes),) = read(folder / name).values()
    assert triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [2, 3, 4]]
    assert attributes["POSITION"].tolist() == [[i, i * i, 0.5] for i in range(5)]
    assert attributes["COLOR_0"].tolist() == [[10 * i, 0, 255, 255] for i in range(5)]
    document = open_model(folder / name)
    assert len(document.images) == 1 and document.files() == [folder / "t.png"]


def test_ply_with_values_at_corners(tmp_path):
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_index\n"
        "property list uchar float texcoord\nproperty float red\nproperty float green\n"
        "property float blue\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
        "3 0 1 2 6 0 0 1 0 0 1 1 0 0\n3 2 1 3 6 0 1 1 0 1 1 0 0 1\n"
    )
    ((triangles, attributes),) = read(tmp_path / "a.ply").values()
    colors = attributes["COLOR_0"][triangles][:, :, :3].tolist()
    assert colors == [[[255, 0, 0]] * 3, [[0, 0, 255]] * 3] and len(attributes["POSITION"]) == 6
    assert attributes["TEXCOORD_0"][triangles[1]].tolist() == [[0, 0], [1, 1], [1, 0]]


@pytest.mark.parametrize("name, names", [("a.stl", ["first one", "b"]), ("b.stl", ["b.stl"])])
def test_stl(folder, name, names):
    meshes = read(folder / name)
    assert list(meshes) == [(name, None) for name in names]
    for mesh in meshes.values():
        assert corners(mesh) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 2


@pytest.mark.parametrize("name", FILES)
def test_blocks_of_any_size_give_the_same(folder, monkeypatch, name):
    whole = read(folder / name)
    for size in (1, 7, 50, 120):
        monkeypatch.setattr(text, "MOST_BYTES", size)
        parts = read(folder / name)
        assert parts.keys() == whole.keys()
        for key, (triangles, attributes) in whole.items():
            np.testing.assert_array_equal(parts[key][0], triangles)
            for attribute, values in attributes.items():
                np.testing.assert_array_equal(parts[key][1][attribute], values)


def test_rows_of_bytes_share_a_work_file_with_larger_ones(tmp_path):
    """An odd number of bytes leaves the rows after it at bytes that their numbers do not divide."""
    file = WorkFile(str(tmp_path))
    added: dict[RowArray, list[np.ndarray]] = {FileRows(file): [] for _ in range(3)}
    for number, (array, blocks) in enumerate([*added.items()] * 4):
        dtype = (np.uint8, np.float32, np.int16)[number % 3]
        values = np.arange(3 * number, 3 * number + 5, dtype=dtype).reshape(-1, 1)
        array.add(values)
        blocks.append(values)
    for array, blocks in added.items():
        np.testing.assert_array_equal(array.rows(0, array.count), np.concatenate(blocks))
        np.testing.assert_array_equal(array.rows(3, 7), np.concatenate(blocks)[3:7])


@pytest.mark.parametrize("name", FILES)
def test_rows_in_work_files_are_those_in_memory(folder, monkeypatch, name):
    monkeypatch.setattr(text, "MOST_BYTES", 50)
    stores = (MemoryRows, partial(FileRows, WorkFile(str(folder))))
    contents, stored_contents = (read_meshes(folder / name, rows) for rows in stores)
    assert contents.warnings == stored_contents.warnings
    assert contents.others == stored_contents.others
    names, other_names = ([m.name for m in c.meshes] for c in (contents, stored_contents))
    assert names == other_names
    primitives, others = (
        [p for _, _, p in c.numbered_primitives()] for c in (contents, stored_contents)
    )
    assert len(primitives) == len(others)
    for mesh, other in zip(primitives, others):
        assert ([names for names, _ in mesh.numberings], mesh.triangle_count) == (
            [names for names, _ in other.numberings],
            other.triangle_count,
        )
        for attribute, rows in mesh.attributes.items():
            stored = other.attributes[attribute]
            assert (stored.format, stored.count) == (rows.format, rows.count)
            last = rows.count - 1, rows.count
            np.testing.assert_array_equal(stored.rows(*last), rows.rows(*last))
        indexed, expected = other.indexed(), mesh.indexed()
        np.testing.assert_array_equal(indexed.triangles, expected.triangles)
        assert indexed.attributes.keys() == expected.attributes.keys()
        for attribute, values in expected.attributes.items():
            np.testing.assert_array_equal(indexed.attributes[attribute], values)


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "b.ply", "a.stl", "b.stl"])
def test_memory_is_at_most_three_times_the_file(tmp_path, name):
    mesh = trimesh.creation.icosphere(subdivisions=6)  # 80,000 triangles
    kind = {"a.stl": {"file_type": "stl_ascii"}, "a.ply": {"encoding": "ascii"}}.get(name, {})
    mesh.export(tmp_path / name, **kind)
    tracemalloc.start()
    open_model(tmp_path / name)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * (tmp_path / name).stat().st_size


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("a.obj", b"v 0 0 0\nf 1 2 3\n", "a face uses vertex 3 of 1"),
        ("a.obj", b"v 0 0 0\nf 1 1 -2\n", "a face uses a vertex before the first"),
        ("a.obj", b"v 0 0 0\nf 1 0 1\n", "a face uses vertex 0"),
        ("a.obj", b"v 0 0 x\xff\nf 1 1 1\n", '"v 0 0 x?" is not a line of numbers'),
        ("a.obj", b"v 0 0 0\nf 1/1/1/1 1 1\n", "is not a line of numbers"),
        ("a.obj", b"v 0 0\nf 1 1 1\n", "has a vertex of 2 numbers"),
        ("a.obj", b"f 1 2 99999999999\n", "is not a line of numbers"),
        ("a.ply", b"obj\n", "is not a .ply"),
        ("a.ply", b"ply\nformat ascii 1.0\n", "has a header that does not end"),
        ("a.ply", ply("ascii")[:-20], "too short"),
        ("a.ply", ply("ascii").replace(b"face 3", b"face 4"), "is cut off"),
        ("a.ply", ply("binary_little_endian")[:-1], "is cut off"),
        ("a.ply", ply("ascii").replace(b"3 0 1 2 7", b"3 0 1 9 7"), "a face uses vertex 9 of 5"),
        ("a.ply", ply("ascii").replace(b"vertex 5", b"vertex 5" + b"0" * 30), "is no .ply's"),
        ("a.ply", ply("ascii").replace(b"vertex 5", b"vertex 5" + b"0" * 5000), "is no .ply's"),
        (
            "a.ply",
            ply("ascii").replace(b"vertex 5", b"vertex 3000000000"),
            "has 3,000,000,000 vertices, more than 2,147,483,647; split the model",
        ),
        (
            "a.ply",
            ply("binary_big_endian").replace(b"list uchar int", b"list int double"),
            "is cut off",
        ),
        ("a.ply", ply("ascii").replace(b"3 0 1 2 7", b"3 0 1 -2 7"), "a face uses vertex -2 of 5"),
        ("a.ply", TWO_TYPES, "has values of _FOO of different types"),
        ("a.ply", TWO_VERTEX_ELEMENTS, "has 3 values of COLOR_0 instead of 4"),
        ("a.ply", TWO_FACE_ELEMENTS, "has 3 values of TEXCOORD_0 instead of 6"),
        ("a.obj", b"f 1 2 3\n", "a face uses vertex 3 of 0"),
        ("a.stl", BINARY_STL[:-1], "is cut off"),
        ("a.stl", STL[:-20], "is cut off"),
        ("a.stl", STL.replace(b"1e0 0 0", b"1e0 0"), "is not 3 numbers"),
        ("a.stl", STL.replace(b"   vertex 0 0 0\n", b""), "has a facet that is no triangle"),
    ],
)
def test_refused_in_one_line(tmp_path, name, content, message):
    """Alike in memory and in work files."""
    (tmp_path / name).write_bytes(content)
    for new_rows in (MemoryRows, partial(FileRows, WorkFile(str(tmp_path)))):
        with pytest.raises(MeshletError, match=r"^[^\n]*$") as caught:
            read_meshes(tmp_path / name, new_rows)
        assert message in str(caught.value)


def test_numbers_of_5000_digits_in_files_that_only_name_others(tmp_path):
    digits = b"9" * 5000
    (tmp_path / "a.ply").write_bytes(ply("ascii").replace(b"vertex 5", b"vertex " + digits))
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\nmtllib a.mtl\n")
    (tmp_path / "a.mtl").write_bytes(b"newmtl a\nmap_Kd -s %s -mm %s a.png\n" % (digits, digits))
    (tmp_path / "a.gltf").write_bytes(b'{"asset": {"version": "2.0"}, "scene": %s}' % digits)
    with pytest.raises(MeshletError, match=r"is no \.ply's"):
        referenced_files(tmp_path / "a.ply")
    with pytest.raises(MeshletError, match="JSON cannot be read"):
        referenced_files(tmp_path / "a.gltf")
    assert tmp_path / "a.mtl" in referenced_files(tmp_path / "a.obj")


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "little.ply"])
def test_more_vertices_than_numbers_are_refused(folder, monkeypatch, name):
    monkeypatch.setattr("gltf_ext.sources.limits.MAX_VERTICES", 4)
    message = "vertices, more than 4; split the model"
    with pytest.raises(MeshletError, match=message):
        read_meshes(folder / name, MemoryRows)


def test_values_at_corners_that_become_vertices_are_counted(folder, monkeypatch):
    monkeypatch.setattr("gltf_ext.sources.limits.MAX_VERTICES", 2)
    open_model(folder / "b.stl")
    (folder / "colored.stl").write_bytes(BINARY_STL.replace(b"ab", b"a\xff"))
    with pytest.raises(MeshletError, match="corners, more than 2; split the model"):
        open_model(folder / "colored.stl")


@pytest.mark.parametrize("name", FILES)
def test_reading_moves_the_progress(folder, monkeypatch, name):
    monkeypatch.setattr(text, "LEAST_BYTES", 50)
    monkeypatch.setattr(text, "MOST_BYTES", 50)
    fractions = []
    open_model(folder / name, advance=fractions.append)
    assert len(fractions) > 1 and 0 <= min(fractions) <= max(fractions) == 1


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_raise_nothing_else(folder, name):
    draw = random.Random(5)
    for _ in range(100):
        content = bytearray(FILES[name])
        for _ in range(draw.randint(1, 4)):
            at = draw.randrange(len(content))
            content[at : at + draw.randint(0, 3)] = draw.choice(
                [b"", b"9", b"-", b"/", b"\n", b"\\\n", b"999999", b"\xff\xff", b" ", b"e", b"\0"]
            )
        (folder / name).write_bytes(content)
        try:
            read(folder / name)
        except MeshletError as error:
            assert "\n" not in str(error)


def test_agrees_with_trimesh(tmp_path):
    mesh = trimesh.creation.torus(2.0, 0.5)
    for name, options in (("a.ply", {"encoding": "ascii"}), ("b.ply", {}), ("a.obj", {})):
        mesh.export(tmp_path / name, **options)
        ((triangles, attributes),) = read(tmp_path / name).values()
        np.testing.assert_array_equal(triangles, mesh.faces)
        np.testing.assert_allclose(attributes["POSITION"], mesh.vertices, atol=1e-6)


# --- files that a model names ---

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
LOSSES = {
    "library": "its materials are left out",
    "texture": "this texture is left out",
    "ply": "this texture is left out",
}
TRIANGLE_PLY = (
    "ply\nformat ascii 1.0\ncomment TextureFile {}\nelement vertex 3\nproperty float x\n"
    "property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 0 0\n1 0 0 0 0\n0 1 0 0 0\n3 0 1 2\n"
)


def write_naming(folder, kind, name):
    """A model that names a file as its library, or as its texture; returns its path."""
    path = folder / ("a.ply" if kind == "ply" else "a.obj")
    if kind == "ply":
        path.write_text(TRIANGLE_PLY.format(name))
    elif kind == "library":
        path.write_text(f"mtllib {name}\n{TRIANGLE}")
    else:
        path.write_text(f"mtllib m.mtl\n{TRIANGLE}")
        (folder / "m.mtl").write_text(f"newmtl m\nmap_Kd {name}\n")
    return path


KINDS_OF_NAMES = ["library", "texture", "ply"]


def touched_files(monkeypatch):
    """The paths that the system is asked about from now on."""
    touched = []

    def noting(function):
        def call(path, *arguments, **options):
            touched.append(os.fspath(path))
            return function(path, *arguments, **options)

        return call

    for module, name in ((os, "stat"), (builtins, "open"), (io, "open"), (os.path, "isfile")):
        monkeypatch.setattr(module, name, noting(getattr(module, name)))
    return touched


@pytest.mark.parametrize("kind", KINDS_OF_NAMES)
def test_files_by_absolute_paths_are_not_read(tmp_path, kind):
    """Not even looked for: a path may lead to another machine."""
    (tmp_path / "secret").mkdir()
    (tmp_path / "model").mkdir()
    secret = tmp_path / "secret" / "m.mtl"
    secret.write_text("newmtl m\n")
    if kind != "library":
        secret = tmp_path / "secret" / "t.png"
        Image.new("RGB", (2, 2)).save(secret)
    path = write_naming(tmp_path / "model", kind, secret)
    document = open_model(path)
    (warning,) = document.import_warnings
    assert warning == f"{secret} is not a relative path, so {LOSSES[kind]}"
    assert not document.images and secret not in document.files()
    assert secret not in referenced_files(path)


@pytest.mark.parametrize("kind", KINDS_OF_NAMES)
@pytest.mark.parametrize(
    "name", ["//evil/share/x.mtl", "\\\\evil\\share\\x.mtl", "C:x.png", "d:/x.png"]
)
def test_files_on_other_machines_and_drives_of_windows(tmp_path, monkeypatch, kind, name):
    path = write_naming(tmp_path, kind, name)
    on_windows = partial(is_relative, kind=PureWindowsPath)
    monkeypatch.setattr("gltf_ext.portable.is_relative", on_windows)
    touched = touched_files(monkeypatch)
    (warning,) = open_model(path).import_warnings
    assert "is not a relative path" in warning
    files = {"a.obj", "a.ply", "m.mtl", "x.mtl", "x.png"}  # the last two, beside the model
    assert {file.name for file in referenced_files(path)} <= files
    assert all(Path(name).parent == tmp_path for name in touched)
    assert {os.path.basename(name) for name in touched} <= files


@pytest.mark.parametrize("kind", KINDS_OF_NAMES)
@pytest.mark.parametrize("name", ["x" * 256, f"{'x' * 300}/t.png", "ü" * 200])
def test_files_of_names_that_are_too_long(tmp_path, kind, name):
    """Longer than any file's."""
    path = write_naming(tmp_path, kind, name)
    (warning,) = open_model(path).import_warnings
    assert "xx" in warning or "üü" in warning
    assert f"is not there, so {LOSSES[kind]}" in warning and len(warning) < 500
    assert {file.name for file in referenced_files(path) if is_there(file)} <= {"m.mtl"}
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    assert warning in report["warnings"]
