"""The structure of .obj files: objects, groups, attributes of faces, lines that are no faces."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.large import open_source
from gltf_ext.sources.source import read_primitive

CORNERS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nv 2 0 0\n"


def write(folder, text):
    path = folder / "a.obj"
    path.write_bytes(text if isinstance(text, bytes) else (CORNERS + text).encode())
    return path


def tree(path, **options):
    """[(names of nodes from the scene on, triangles of each primitive)] of nodes with a mesh."""
    document = open_model(path, **options)
    result = []

    def walk(number, names):
        node = document.nodes[number]
        names = (*names, node["name"])
        if "mesh" in node:
            mesh = document.meshes[node["mesh"]]
            assert mesh["name"] == node["name"]
            counts = [
                len(read_primitive(document, node["mesh"], p)[0].indices)
                for p in range(len(mesh["primitives"]))
            ]
            result.append((names, counts))
        for child in node.get("children", []):
            walk(child, names)

    for number in document.scenes[0]["nodes"]:
        walk(number, ())
    return result


def attributes(path):
    """The names of each primitive's attributes, without POSITION, and its triangles."""
    document = open_model(path)
    result = []
    for m, mesh in enumerate(document.meshes):
        for p in range(len(mesh["primitives"])):
            arrays = read_primitive(document, m, p)[0]
            names = set(arrays.attributes) - {"POSITION"}
            positions = arrays.attributes["POSITION"]
            result.append((names, positions[arrays.indices].tolist()))
    return result


# --- objects and groups ---


def test_objects_are_nodes(tmp_path):
    path = write(tmp_path, "o Body\nusemtl a\nf 1/1 2/2 3/3 4/4\no Front wheel\nf 2/1 5/2 3/3\n")
    assert tree(path) == [(("Body",), [2]), (("Front wheel",), [1])]


def test_objects_without_names_and_before_the_first(tmp_path):
    path = write(tmp_path, "f 1 2 3\no\nf 1 2 3 4\no A\no B\nf 1 2 3\nf 2 3 4\n")
    assert tree(path) == [(("a.obj",), [1]), (("a.obj",), [2]), (("B",), [2])]


def test_objects_of_the_same_name_stay_two(tmp_path):
    path = write(tmp_path, "o A\nf 1 2 3\no B\nf 1 2 3\no A\nf 1 2 3 4\n")
    assert tree(path) == [(("A",), [1]), (("B",), [1]), (("A",), [2])]


def test_materials_of_an_object_are_primitives(tmp_path):
    path = write(
        tmp_path,
        "o A\nusemtl x\nf 1 2 3\nusemtl y\nf 1 2 3 4\nusemtl x\nf 2 3 4\no B\nf 1 2 3\n",
    )
    assert tree(path) == [(("A",), [2, 2]), (("B",), [1])]


def test_groups_are_nodes_on_request(tmp_path):
    path = write(
        tmp_path,
        "g top\nf 1 2 3\no A\nf 1 2 3\ng left arm\nf 1 2 3 4\ng right\nf 1 2 3\ng left arm\n"
        "f 1 3 4\n"
        "o B\ng right\nf 1 2 3\n",
    )
    plain = [(("a.obj",), [1]), (("A",), [5]), (("B",), [1])]
    groups = [
        (("top",), [1]),
        (("A",), [1]),
        (("A", "left arm"), [3]),
        (("A", "right"), [1]),
        (("B", "right"), [1]),
    ]
    assert tree(path) == plain
    assert tree(path, obj_groups=True) == groups
    out = tmp_path / "out.glb"
    for asked, expected in ((False, plain), (True, groups)):
        gltf_ext.compress(path, out, obj_groups=asked)
        names = [primitive["name"] for primitive in gltf_ext.inspect(out)["primitives"]]
        assert names == [path[-1] for path, _ in expected]
        assert gltf_ext.verify(path, out, obj_groups=asked)["ok"]


def test_groups_of_objects_of_one_name_have_two_parents(tmp_path):
    path = write(tmp_path, "o A\ng x\nf 1 2 3\no A\ng y\nf 1 2 3\ng z\nf 1 2 3\n")
    document = open_model(path, obj_groups=True)
    children = [node["children"] for node in document.nodes if node["name"] == "A"]
    assert children == [[0], [1, 2]]


def test_names_of_objects_arrive(tmp_path):
    """In the compressed file, in what trimesh loads, and when it is decompressed."""
    import trimesh

    import gltf_ext.trimesh_handler

    path = write(tmp_path, "o Body\nf 1/1 2/2 3/3 4/4\no Wheel\nf 2/1 5/2 3/3\n")
    report = gltf_ext.compress(path, tmp_path / "out.glb")
    assert [primitive["name"] for primitive in report["primitives"]] == ["Body", "Wheel"]
    assert set(trimesh.load_scene(tmp_path / "out.glb").graph.nodes_geometry) == {"Body", "Wheel"}
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    assert tree(tmp_path / "plain.glb") == [(("Body",), [2]), (("Wheel",), [1])]


def test_a_thousand_objects_take_linear_time(tmp_path):
    """Each with all vertices of the file, this takes 100 times as long."""
    vertices = "".join(f"v {i} {i % 7} {i % 3}\n" for i in range(300_000))
    faces = "".join(
        f"o {i}\nf {300 * i + 1} {300 * i + 2} {300 * i + 3} {300 * i + 8}\n" for i in range(1000)
    )
    document = open_model(write(tmp_path, (vertices + faces).encode()))
    assert len(document.meshes) == 1000
    assert all(
        document.accessors[m["primitives"][0]["attributes"]["POSITION"]]["count"] == 4
        for m in document.meshes
    )


# --- faces without attributes ---


@pytest.mark.parametrize(
    "faces, expected",
    [
        (
            "f 1/1/1 2/2/1 3/3/1 4/4/1\nf 1//1 2//1 5//1\n",
            [({"TEXCOORD_0", "NORMAL"}, 2), ({"NORMAL"}, 1)],
        ),
        ("f 1 2 3\nf 1/1 2/2 3/3\nf 2 3 4\n", [(set(), 2), ({"TEXCOORD_0"}, 1)]),
        (
            "f 1/1 2/2 3/3\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/3/1\nf 1 2 5\n",
            [({"TEXCOORD_0"}, 1), ({"NORMAL"}, 1), ({"TEXCOORD_0", "NORMAL"}, 1), (set(), 1)],
        ),
    ],
)
def test_faces_without_attributes_take_none(tmp_path, faces, expected):
    path = write(tmp_path, "usemtl a\n" + faces)
    found = attributes(path)
    assert [(names, len(triangles)) for names, triangles in found] == expected
    out = tmp_path / "out.glb"
    gltf_ext.compress(path, out)
    assert gltf_ext.verify(path, out)["ok"]


def test_faces_of_which_some_corners_have_attributes(tmp_path):
    path = write(tmp_path, "f 1/1 2/2 3\nf 1/1 2/2 3/3\n")
    assert [names for names, _ in attributes(path)] == [set(), {"TEXCOORD_0"}]
    (warning,) = open_model(path).import_warnings
    assert warning == (
        "1 faces have texture coordinates or normals at some corners only, which are left out"
    )


def test_a_number_beyond_the_texture_coordinates_costs_those_of_its_primitive(tmp_path):
    path = write(tmp_path, "o A\nf 1/1 2/2 3/9\no B\nf 1/1 2/2 3/3\n")
    assert [names for names, _ in attributes(path)] == [set(), {"TEXCOORD_0"}]
    assert open_model(path).import_warnings == (
        "A: a face uses a texture coordinate that is not there; all are left out",
    )


def test_textures_need_texture_coordinates(tmp_path):
    """The other faces have the material without it."""
    from PIL import Image

    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.png")
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 0 1 0\nmap_Ke t.png\nmap_Kd t.png\n")
    path = write(tmp_path, "mtllib m.mtl\nusemtl a\nf 1/1 2/2 3/3\nf 1 2 5\nf 2 3 5\n")
    document = open_model(path)
    first, second = (document.materials[p["material"]] for p in document.meshes[0]["primitives"])
    assert first["emissiveTexture"] and first["emissiveFactor"] == [1, 1, 1]
    assert "emissiveFactor" not in second and "Texture" not in str(second)
    assert first["name"] == second["name"] == "a"
    assert document.import_warnings == (
        "2 triangles have no texture coordinates, so they are shown without the textures of their "
        "materials",
    )


def test_colors_of_some_vertices(tmp_path):
    """The others are white."""
    path = write(
        tmp_path,
        b"v 0 0 0\nv 1 0 0\nv 0 1 0 1 0 0\nv 1 1 0\nv 2 2 0 0 0 1 1\nf 1 2 3\nf 2 3 4\nf 3 4 5\n",
    )
    primitive, _ = read_primitive(open_model(path), 0, 0)
    assert primitive.attributes["COLOR_0"][:, :3].tolist() == [
        [255, 255, 255],
        [255, 255, 255],
        [255, 0, 0],
        [255, 255, 255],
        [0, 0, 255],
    ]


# --- lines ---


def test_bare_carriage_returns_end_lines(tmp_path, monkeypatch):
    from gltf_ext.sources import text

    lines = (CORNERS + "o A\nf 1/1 2/2 3/3 \\\n  4/4\no B\nf 1 2 5\n").encode()
    for end in (b"\r", b"\r\n", b"\r\r\n"):
        if end == b"\r\r\n":
            lines = lines.replace(b"\\\n  ", b"")
        for size in (1 << 20, 1, 7, 50):
            monkeypatch.setattr(text, "MOST_BYTES", size)
            path = write(tmp_path, lines.replace(b"\n", end))
            assert tree(path) == [(("A",), [2]), (("B",), [1])], (end, size)


def test_blocks_of_a_file_with_bare_carriage_returns(tmp_path, monkeypatch):
    """Only a block at a time is in memory."""
    from gltf_ext.sources import text

    monkeypatch.setattr(text, "MOST_BYTES", 100)
    path = write(tmp_path, b"v 0 0 0\r" * 1000)
    with open(path, "rb") as file:
        blocks = list(text.text_blocks(file))
    assert max(map(len, blocks)) < 200 and b"".join(blocks) == b"v 0 0 0\n" * 1000


def test_lines_and_points_are_counted(tmp_path):
    path = write(tmp_path, "l 1 2 3\np 1\np 2 3\nl 1/1 2/2\nf 1 2 3\nsurf 0 1 0 1 1 2 3 4\nf 1 2\n")
    assert open_model(path).import_warnings == (
        "left out, as they have no triangles: 2 lines, 2 points, 1 surfaces",
        "1 faces of fewer than three corners are left out",
    )


# --- larger than memory ---


def test_objects_of_a_large_file(tmp_path):
    """Small ones are in memory, others in work files; each only has vertices of its own."""
    n = 300
    grid = [f"v {i % n} {i // n} {i % 5}\n" for i in range(n * n)]
    faces = [
        f"f {i + 1} {i + 2} {i + n + 2} {i + n + 1}\n" for i in range(n * (n - 1)) if i % n < n - 1
    ]
    text = "".join(["o small\n", "v 0 0 9\nv 1 0 9\nv 0 1 9\nf 1 2 3\n", "o large\n", *grid])
    faces = [f"f {' '.join(str(int(c) + 3) for c in face.split()[1:])}\n" for face in faces]
    path = write(tmp_path, (text + "".join(faces)).encode())
    options = Options.of({"max_memory": "105M", "work_dir": str(tmp_path)})
    document, large = open_source(path, options)
    assert [node["name"] for node in document.nodes] == ["small", "large"]
    assert list(large) == [(1, 0)] and large[1, 0].vertex_count == n * n
    out = tmp_path / "out.glb"
    for limits in ({}, {"max_memory": "105M"}):
        gltf_ext.compress(path, out, **limits)
        assert gltf_ext.verify(path, out, **limits)["ok"]
        assert [p["name"] for p in gltf_ext.inspect(out)["primitives"]] == ["small", "large"]


def test_concave_polygons_of_a_large_file(tmp_path):
    """Their corners are read from work files."""
    points = np.float64([(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)])
    count = 40_000
    places = np.stack([np.arange(count) % 200, np.arange(count) // 200], axis=1) * 5
    rows = (places[:, None] + points).reshape(-1, 2)
    text = "".join(f"v {x:g} {y:g} 0\n" for x, y in rows.tolist())
    draw = np.random.default_rng(0).permutation(count)
    text += "".join(f"f {' '.join(str(5 * i + k + 1) for k in range(5))}\n" for i in draw.tolist())
    path = write(tmp_path, text.encode())
    out = tmp_path / "out.glb"
    gltf_ext.compress(path, out, max_memory="105M", position_bits=20)
    (primitive,) = gltf_ext.load(out)
    corners = primitive.attributes["POSITION"][primitive.indices].astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert len(area) == 3 * count and area.min() > 0
    assert area.sum() / 2 == pytest.approx(10 * count, rel=1e-3)


def test_refused_like_before(tmp_path):
    with pytest.raises(MeshletError, match="a face uses vertex 9 of 5"):
        open_model(write(tmp_path, "o A\nf 1 2 9\n"))
