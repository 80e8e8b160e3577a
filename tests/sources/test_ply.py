"""What .ply files hold beside positions and faces: colours, strips, other values, line ends."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_ext.sources import large, text
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.ply_header import most_triangles
from gltf_ext.sources.source import read_primitive

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FACES = "element face 2\nproperty list uchar int vertex_indices\n"
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8",
}  # fmt: skip


def ply(properties, rows, order="ascii", faces=((0, 1, 2), (0, 2, 3))):
    """A .ply whose vertices have more properties, as [(type, name)], with these rows."""
    lines = "".join(f"property {kind} {name}\n" for kind, name in properties)
    header = (
        f"ply\nformat {order} 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        f"property float z\n{lines}{FACES}end_header\n"
    ).encode()
    whole = [(*point, *row) for point, row in zip(POINTS, rows)]
    if order == "ascii":
        lists = [(len(face), *face) for face in faces]
        return header + "\n".join(" ".join(map(str, row)) for row in [*whole, *lists]).encode()
    end = "<" if "little" in order else ">"
    kinds = ["float"] * 3 + [kind for kind, _ in properties]
    vertex = np.dtype([(f"f{i}", end + TYPES[kind]) for i, kind in enumerate(kinds)])
    body = np.array(whole, vertex).tobytes()
    for face in faces:
        body += bytes([len(face)]) + np.array(face, end + "i4").tobytes()
    return header + body


def read(folder, content):
    """The only primitive, and warnings."""
    (folder / "a.ply").write_bytes(content if isinstance(content, bytes) else content.encode())
    document = open_model(folder / "a.ply")
    return read_primitive(document, 0, 0)[0], document.import_warnings


# --- colours ---

NAMES = [
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ("ambient_red", "ambient_green", "ambient_blue"),
]
ORDERS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_colors_by_name(tmp_path, names, alpha, order):
    colors = [(255, 0, 0, 9), (0, 255, 0, 8), (0, 0, 255, 7), (1, 2, 3, 255)]
    names = (*names, names[0].replace("red", "alpha") if "red" in names[0] else "a")
    count = 4 if alpha else 3
    properties = [("uchar", name) for name in names[:count]]
    primitive, warnings = read(tmp_path, ply(properties, [c[:count] for c in colors], order))
    expected = [c if alpha else (*c[:3], 255) for c in colors]
    assert primitive.attributes["COLOR_0"].tolist() == [list(c) for c in expected]
    assert set(primitive.attributes) == {"POSITION", "COLOR_0"} and warnings == ()


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    "kind, most",
    [
        ("int", 255), ("uint", 255), ("short", 255), ("ushort", 255), ("float", 255.0),
        ("double", 255.0), ("float", 1.0), ("double", 1.0), ("ushort", 65535), ("int", 65535),
        ("uint", 2**32 - 1), ("uchar", 255), ("char", 127),
    ],
)  # fmt: skip
def test_colors_by_range(tmp_path, kind, most, order):
    half = most / 2 if isinstance(most, float) else most // 2
    rows = [(most, 0, 0), (0, half, 0), (0, 0, most), (most, most, 0)]
    content = ply([(kind, name) for name in NAMES[0]], rows, order)
    primitive, _ = read(tmp_path, content)
    assert primitive.attributes["COLOR_0"][:, :3].tolist() == [
        [255, 0, 0],
        [0, pytest.approx(127.5, abs=1.5), 0],
        [0, 0, 255],
        [255, 255, 0],
    ]


def test_float_colors_with_fractions_beyond_1_are_clamped(tmp_path):
    rows = [(1.5, 0.5, 0), (0, 0.25, 0), (0, 0, 1), (2, float("nan"), 0)]
    primitive, _ = read(tmp_path, ply([("float", name) for name in NAMES[0]], rows))
    assert primitive.attributes["COLOR_0"][:, :3].tolist() == [
        [255, 128, 0],
        [0, 64, 0],
        [0, 0, 255],
        [255, 0, 0],
    ]


def test_the_whole_file_tells_the_range(tmp_path, monkeypatch):
    """Also where the first block has dark colours only."""
    monkeypatch.setattr(text, "MOST_BYTES", 16)
    rows = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (255, 128, 0)]
    primitive, _ = read(tmp_path, ply([("float", name) for name in NAMES[0]], rows))
    assert primitive.attributes["COLOR_0"][:, :3].tolist() == [list(row) for row in rows]


def test_colors_of_faces_by_name_and_range(tmp_path):
    primitive, warnings = read(
        tmp_path,
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        f"property float z\n{FACES}property int r\nproperty int g\nproperty int b\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 128\n",
    )
    colors = primitive.attributes["COLOR_0"][primitive.indices][:, :, :3]
    assert colors.tolist() == [[[255, 0, 0]] * 3, [[0, 0, 128]] * 3] and warnings == ()


# --- values of the file's own ---


@pytest.mark.parametrize("order", ORDERS)
def test_scalars_are_attributes(tmp_path, order):
    properties = [
        ("float", "quality"), ("int", "label"), ("uchar", "flags"), ("short", "Some-Value"),
        ("ushort", "count"), ("char", "sign"), ("double", "confidence"), ("float", "nx"),
    ]  # fmt: skip
    rows = [(i / 4, i - 1, 200 + i, -300 * i, 60_000 + i, -i, i / 8, i) for i in range(4)]
    primitive, warnings = read(tmp_path, ply(properties, rows, order))
    expected = {
        "_QUALITY": "<f4", "_LABEL": "<f4", "_FLAGS": "|u1", "_SOME_VALUE": "<i2",
        "_COUNT": "<u2", "_SIGN": "|i1", "_CONFIDENCE": "<f4", "_NX": "<f4",
    }  # fmt: skip
    found = {n: v.dtype.str for n, v in primitive.attributes.items() if n != "POSITION"}
    assert found == expected and warnings == ()
    for number, name in enumerate(expected):
        assert primitive.attributes[name][:, 0].tolist() == [row[number] for row in rows]


def test_scalars_stay_through_compress(tmp_path):
    properties = [("float", "quality"), ("uchar", "label"), ("short", "depth")]
    rows = [(0.1 * i, 3 * i, -7 * i) for i in range(4)]
    read(tmp_path, ply(properties, rows))
    out = tmp_path / "out.glb"
    gltf_ext.compress(tmp_path / "a.ply", out)
    assert gltf_ext.verify(tmp_path / "a.ply", out)["ok"]
    (primitive,) = gltf_ext.load(out)
    for name, column in zip(("_QUALITY", "_LABEL", "_DEPTH"), zip(*rows)):
        stored = np.unique(primitive.attributes[name])
        np.testing.assert_array_equal(stored, np.unique(np.array(column, stored.dtype)))
    gltf_ext.compress(tmp_path / "a.ply", out, max_memory="105M")
    assert gltf_ext.verify(tmp_path / "a.ply", out)["ok"]


def test_what_is_left_is_named(tmp_path):
    _, warnings = read(
        tmp_path,
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty int id\nproperty float a-b\nproperty float a_b\n"
        "property list uchar int near\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
        f"element camera 0\nproperty float view\n{FACES}property float quality\nproperty int n\n"
        "end_header\n0 0 0 1 0 0 0\n1 0 0 2 0 0 0\n1 1 0 3 0 0 0\n0 1 0 16777217 0 0 0\n0 1\n"
        "3 0 1 2 0.5 1\n3 0 2 3 0.5 1\n",
    )
    assert warnings == (
        "left out: a_b of vertices, near of vertices, 1 rows of edge, quality of face, n of face",
        "rounded to floats: id",
    )


def test_many_scalars(tmp_path):
    """As many as leave streams for the others."""
    properties = [("float", f"f_rest_{i}") for i in range(70)]
    primitive, warnings = read(tmp_path, ply(properties, [range(70)] * 4))
    assert len(primitive.attributes) == 33 and warnings[0].startswith("left out: f_rest_32 of")
    report = gltf_ext.compress(tmp_path / "a.ply", tmp_path / "out.glb")
    assert not report["kept"]


# --- strips ---

STRIPS = "element tristrips {}\nproperty list int int vertex_indices\n"


def strips(*lists, order="ascii"):
    header = (
        f"ply\nformat {order} 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
        f"property float z\n{STRIPS.format(len(lists))}end_header\n"
    )
    points = [(i // 2, i % 2, 0) for i in range(6)]
    if order == "ascii":
        rows = [*points, *((len(numbers), *numbers) for numbers in lists)]
        return header + "\n".join(" ".join(map(str, row)) for row in rows) + "\n"
    body = np.float32(points).tobytes()
    for numbers in lists:
        body += np.array([len(numbers), *numbers], "<i4").tobytes()
    return header.encode() + body


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize(
    "lists, expected",
    [
        ([(0, 1, 2, 3)], [[0, 1, 2], [2, 1, 3]]),
        ([(0, 1, 2, 3, -1, 2, 3, 4, 5)], [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]),
        ([(0, 1, 2, -1), (-1, 1, 2, 3), ()], [[0, 1, 2], [1, 2, 3]]),
        ([(0, 1, -1, 2, 3, -1, 1, 2, 3)], [[1, 2, 3]]),
        ([(0, 1, 2), (3, 2, 4, 5)], [[0, 1, 2], [3, 2, 4], [4, 2, 5]]),
        ([(0, 1, 2, 2, 3, 3, 4, 5)], [[0, 1, 2], [4, 3, 5]]),
    ],
)
def test_strips(tmp_path, lists, expected, order):
    primitive, warnings = read(tmp_path, strips(*lists, order=order))
    assert primitive.indices.tolist() == expected and warnings == ()


def test_strips_face_one_way(tmp_path):
    primitive, _ = read(tmp_path, strips((0, 2, 1, 3, 5, 4)[:4]))
    corners = primitive.attributes["POSITION"][primitive.indices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()


@pytest.mark.parametrize("lists", [((0, 1, 6),), ((0, 1, 2), (9, 1, 2))])
def test_numbers_of_strips_are_checked(tmp_path, lists):
    with pytest.raises(MeshletError, match=f"a face uses vertex {max(map(max, lists))} of 6"):
        read(tmp_path, strips(*lists))


# --- line ends ---


@pytest.mark.parametrize("end", ["\r", "\r\n", "\n", "\r \r"])
def test_line_ends(tmp_path, monkeypatch, end):
    content = ply([("uchar", n) for n in NAMES[0]], [(1, 2, 3)] * 4).decode()
    if end == "\r \r":
        header, _, body = content.partition("end_header\n")
        content = header + "end_header\n" + body.replace("\n", "\n \n")
        end = "\r"
    for size in (1 << 20, 1, 30):
        monkeypatch.setattr(text, "MOST_BYTES", size)
        primitive, _ = read(tmp_path, content.replace("\n", end))
        assert primitive.indices.tolist() == [[0, 1, 2], [0, 2, 3]]
        assert primitive.attributes["COLOR_0"].tolist() == [[1, 2, 3, 255]] * 4


@pytest.mark.parametrize("end", [b"\r", b"\r\n", b"\n"])
@pytest.mark.parametrize("first", [10, 13, 32, 7])
@pytest.mark.parametrize("order", ORDERS[1:])
def test_line_ends_before_binary_data(tmp_path, end, first, order):
    """Data may begin with the byte of a line's end."""
    content = ply([("uchar", "first")], [(first,)] * 4, order)
    header, _, body = content.partition(b"end_header\n")
    properties = header.replace(b"property float x\n", b"").replace(
        b"property uchar first\n", b"property float x\n"
    )
    vertices = np.frombuffer(body[: 4 * 13], np.uint8).reshape(4, 13)
    moved = np.roll(vertices, 1, axis=1).tobytes() + body[4 * 13 :]
    properties = header.replace(b"property uchar first\n", b"").replace(
        b"property float x\n", b"property uchar first\nproperty float x\n"
    )
    header = (properties + b"end_header\n").replace(b"\n", end)
    primitive, _ = read(tmp_path, header + moved)
    assert primitive.attributes["_FIRST"].tolist() == [[first]] * 4
    assert primitive.indices.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("order", ORDERS)
def test_shorter_faces_at_the_end(tmp_path, order):
    """Of a binary file, they are fewer bytes than a row of those before."""
    content = ply([], [()] * 4, order, faces=((0, 1, 2, 3), (0, 1, 2)))
    assert len(read(tmp_path, content)[0].indices) == 3


def test_vertices_count_from_0_in_errors(tmp_path):
    with pytest.raises(MeshletError, match="a face uses vertex 4 of 4"):
        read(tmp_path, ply([], [()] * 4, faces=((0, 1, 4), (0, 2, 3))))


def test_a_texture_needs_texture_coordinates(tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2)).save(tmp_path / "t.png")
    content = ply([], [()] * 4).replace(
        b"element vertex", b"comment TextureFile t.png\nelement vertex"
    )
    _, warnings = read(tmp_path, content)
    assert not open_model(tmp_path / "a.ply").images
    assert warnings == ("it has no texture coordinates, so its texture is left out",)


@pytest.mark.parametrize("length", ["9223372036854775807", "9.3e18", "-1", "nan", "4"])
def test_lengths_of_lists_that_cannot_be(tmp_path, length):
    path = tmp_path / "in.ply"
    path.write_bytes(ply([], [()] * 4).replace(b"\n3 0 2 3", f"\n{length} 0 2 3".encode()))
    with pytest.raises(MeshletError, match="has a row of face that is too short; export it again"):
        open_model(path)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("change", [(b"face 2", b"face 1000000000"), (b"vertex 4", b"vertex 99")])
def test_rows_that_the_file_has_no_bytes_for(tmp_path, monkeypatch, order, change):
    """Before anything is read."""
    monkeypatch.setattr("gltf_ext.sources.ply.blocks", None)
    content = ply([], [()] * 4, order)
    assert change[0] in content
    with pytest.raises(MeshletError, match="is cut off; get it again"):
        read(tmp_path, content.replace(*change))


@pytest.mark.parametrize("faces", [((0, 1, 2), (0, 2, 3)), ((0, 1, 2, 3) * 20,) * 2])
def test_the_most_triangles_of_the_bytes_of_a_file(tmp_path, faces):
    path = tmp_path / "in.ply"
    path.write_bytes(ply([], [()] * 4, "binary_big_endian", faces))
    count = sum(len(face) - 2 for face in faces)
    assert most_triangles(path) == count
    assert large._memory_of(path) == max(300 * count, 16 * path.stat().st_size)
    path.write_bytes(ply([], [()] * 4, "ascii", faces))
    assert most_triangles(path) == 0
