"""Models of other formats, and trimesh as a reader of compressed files."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh

import gltf_ext
import gltf_ext.trimesh_handler
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model, read_meshes
from gltf_ext.sources.primitives import EXTENSION
from gltf_ext.sources.row_arrays import MemoryRows
from tests.helpers.gltf_builder import Builder, everything, glb_bytes, glb_parts, grid_mesh


@pytest.fixture(scope="module")
def sphere():
    return trimesh.creation.icosphere(3)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_formats(sphere, tmp_path, suffix):
    original = tmp_path / f"in{suffix}"
    sphere.export(original)
    report = gltf_ext.compress(original, tmp_path / "out.glb")
    assert report["totals"]["triangles"] == len(sphere.faces) and report["totals"][
        "source_vertices"
    ] == len(sphere.vertices)
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]


def test_obj_with_normals_and_texture_coordinates(tmp_path):
    (tmp_path / "in.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nvn 0 0 1\n"
        "f 1/1/1 2/2/1 4/4/1 3/3/1\n"
    )
    gltf_ext.compress(tmp_path / "in.obj", tmp_path / "out.glb")
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert len(primitive.indices) == 2 and {"POSITION", "TEXCOORD_0"} <= set(primitive.attributes)
    assert gltf_ext.verify(tmp_path / "in.obj", tmp_path / "out.glb")["ok"]


def test_ply_colors_are_exact(sphere, tmp_path):
    colored = sphere.copy()
    colored.visual.vertex_colors = np.random.default_rng(0).integers(
        0, 256, (len(sphere.vertices), 4), dtype=np.uint8
    )
    colored.export(tmp_path / "in.ply")
    gltf_ext.compress(tmp_path / "in.ply", tmp_path / "out.glb")
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert sorted(map(tuple, primitive.attributes["COLOR_0"].tolist())) == sorted(
        map(tuple, colored.visual.vertex_colors.tolist())
    )


@pytest.mark.parametrize(
    "name, content",
    [
        ("a.obj", "v 1 2\nf 1 2 3\n"),
        ("a.obj", ""),
        ("a.stl", ""),
        ("a.ply", "ply\nformat nope"),
        ("a.fbx", "x"),
        ("a", "x"),
        ("a.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n"),
    ],
)
def test_unreadable_models_are_refused(tmp_path, name, content):
    (tmp_path / name).write_text(content)
    with pytest.raises(gltf_ext.MeshletError) as caught:
        gltf_ext.compress(tmp_path / name, tmp_path / "out.glb")
    assert caught.value.path == str(tmp_path / name) and "\n" not in str(caught.value)
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("a.obj", b"\xff\xfe\x00\x01\x80" * 9, "is not text"),
        ("a.obj", b"", "is empty; export it again"),
        ("a.stl", bytes(80) + (9).to_bytes(4, "little") + bytes(60), "is cut off"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\n"
            b"property float x\nproperty float y\nproperty float z\n"
            b"end_header\n0 0 0\n",
            "holds no triangles",
        ),
    ],
)
def test_reasons_are_plain(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(gltf_ext.MeshletError) as caught:
        gltf_ext.compress(tmp_path / name, tmp_path / "out.glb")
    assert message in str(caught.value) and "Error" not in str(caught.value)


def test_a_missing_material_is_a_warning(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    warnings = gltf_ext.compress(tmp_path / "a.obj", tmp_path / "out.glb")["warnings"]
    assert any("no.mtl" in warning for warning in warnings)


@pytest.fixture(scope="module")
def compressed(tmp_path_factory):
    """Two primitives: one with everything, one plain and used twice."""
    folder = tmp_path_factory.mktemp("trimesh")
    attributes, triangles, targets = everything()
    builder = Builder()
    builder.mesh(attributes, triangles, targets)
    positions, plain = grid_mesh(9, 9)
    builder.mesh({"POSITION": positions * 3}, plain)
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1}, {"mesh": 1, "translation": [5, 0, 0]}]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2]}]
    gltf_ext.compress(builder.write(folder / "in.glb"), folder / "out.glb")
    return folder / "out.glb"


@pytest.fixture(scope="module")
def packed(compressed):
    path = compressed.with_name("packed.glb")
    gltf_ext.transcode(compressed, path)
    assert open_model(path).was_packed
    return path


@pytest.mark.parametrize("form", ["compressed", "packed"])
def test_trimesh_loads_the_decoded_values(form, request):
    path = request.getfixturevalue(form)
    scene = trimesh.load_scene(path)
    assert len(scene.graph.nodes_geometry) == 3
    for mesh, primitive in zip(scene.geometry.values(), gltf_ext.load(path), strict=True):
        np.testing.assert_array_equal(mesh.faces, primitive.indices)
        np.testing.assert_allclose(mesh.vertices, primitive.attributes["POSITION"])
        assert np.ptp(mesh.vertices, axis=0).min() > 0
        for name, values in primitive.attributes.items():
            if name.startswith("_") and name != "_FRAME":
                np.testing.assert_array_equal(
                    np.reshape(mesh.vertex_attributes[name], values.shape), values
                )


def test_trimesh_loads_a_packed_file_with_levels(tmp_path):
    pytest.importorskip("meshoptimizer")
    builder = Builder()
    positions, triangles = grid_mesh(60, 60)
    builder.mesh({"POSITION": positions}, triangles)
    path = tmp_path / "out.glb"
    gltf_ext.compress(builder.write(tmp_path / "in.glb"), path, lod=True, transport=True)
    assert open_model(path).was_packed
    (mesh,) = trimesh.load_scene(path).geometry.values()
    (primitive,) = gltf_ext.load(path)
    np.testing.assert_array_equal(mesh.faces, primitive.indices)
    np.testing.assert_allclose(mesh.vertices, primitive.attributes["POSITION"])


def damage_bytes(properties, binary):
    begin = properties["bufferViews"][0].get("byteOffset", 0)
    binary[begin + 5 : begin + 40] = b"\xff" * 35


def cut_off(properties, binary):
    properties["bufferViews"][0]["byteLength"] -= 4


def forget_a_stream(properties, binary):
    primitive = properties["meshes"][0]["primitives"][0]
    del primitive["extensions"][EXTENSION]["attributes"]["NORMAL"]


def forget_the_view(properties, binary):
    del properties["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["bufferView"]


def count_more_vertices(properties, binary):
    primitive = properties["meshes"][0]["primitives"][0]
    for accessor in primitive["attributes"].values():
        properties["accessors"][accessor]["count"] += 1


def count_more_indices(properties, binary):
    primitive = properties["meshes"][0]["primitives"][0]
    properties["accessors"][primitive["indices"]]["count"] += 3


@pytest.mark.parametrize("form", ["compressed", "packed"])
@pytest.mark.parametrize(
    "damage",
    [
        damage_bytes,
        cut_off,
        forget_a_stream,
        forget_the_view,
        count_more_vertices,
        count_more_indices,
    ],
)
def test_trimesh_loads_no_zeros(form, damage, request, tmp_path):
    """trimesh swallows the exceptions of handlers."""
    properties, binary = glb_parts(request.getfixturevalue(form))
    damage(properties, binary)
    path = tmp_path / "damaged.glb"
    path.write_bytes(glb_bytes(properties, bytes(binary)))
    with pytest.raises(gltf_ext.MeshletError, match=r"cannot be decoded: .+; the file is damaged"):
        trimesh.load_scene(path)
    left = trimesh.load_scene(path, ignore_broken=True).geometry.values()
    assert len(left) == 1 and all(mesh.area > 1 for mesh in left)


@pytest.mark.parametrize(
    "imports",
    [
        "import gltf_ext, trimesh, gltf_ext.trimesh_handler",
        "import gltf_ext.trimesh_handler, trimesh",
        "import trimesh, gltf_ext.trimesh_handler",
    ],
)
def test_the_order_of_imports_does_not_matter(compressed, imports):
    code = f"{imports}\nprint(trimesh.load_scene({str(compressed)!r}).area)"
    area = float(
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
    )
    assert area == pytest.approx(trimesh.load_scene(compressed).area) and area > 1


@pytest.mark.parametrize("imports", ["import trimesh, gltf_ext", "import gltf_ext, trimesh"])
def test_only_the_handlers_import_registers(imports):
    code = (
        f"import sys\nbefore = list(sys.meta_path)\n{imports}\n"
        "import trimesh.exchange.gltf.extensions as e\n"
        "print(e._handlers['primitive_preprocess'], sys.meta_path == before)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "EXT_meshlet_edgebreaker" not in result.stdout and "True" in result.stdout, result


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.obj", b"v 0 0 0\nf" + b" 1" * 3000 + b"\n"),
        ("a.obj", b"v 0 0 0\nf" + b" 1 \\\n" * 1200 + b" 1\n"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n"
         + b" " * 5000 + b"0\n"),
    ],
)  # fmt: skip
def test_lines_longer_than_memory_are_refused(tmp_path, monkeypatch, name, text):
    monkeypatch.setattr("gltf_ext.sources.text.block_bytes", lambda file: 100)
    monkeypatch.setattr("gltf_ext.sources.text.LONGEST_LINE", 4500)
    (tmp_path / name).write_bytes(text)
    with pytest.raises(MeshletError, match="has a line of more than 4,500 bytes; export it again"):
        read_meshes(tmp_path / name, MemoryRows)
