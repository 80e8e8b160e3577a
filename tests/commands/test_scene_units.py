"""Steps and errors in units of the scene: nodes scale meshes."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document.container import read_document
from gltf_ext.document.nodes import mesh_scales
from gltf_ext.lod import open_lod
from spec.make_lod_vectors import FOLDER
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_parts, grid_mesh

LEVELS = FOLDER / "lod_levels.glb"  # 192, 96 and 48 triangles, errors 1 and 2


def scaled(path, *scales, size=9, **node):
    """The same mesh, shown by a node of each scale."""
    positions, triangles = grid_mesh(size, size)
    builder = Builder()
    for _ in scales:
        builder.mesh({"POSITION": positions}, triangles)
    nodes = [{"mesh": i, "scale": [s] * 3, **node} for i, s in enumerate(scales)]
    builder.properties.update(nodes=nodes, scenes=[{"nodes": [*range(len(scales))]}])
    return builder.write(path)


def steps(path):
    primitives = gltf_ext.inspect(path)["primitives"]
    return [primitive["attributes"]["POSITION"]["step"][0] for primitive in primitives]


def test_a_step_is_as_large_as_nodes_show_it(tmp_path):
    source, output = scaled(tmp_path / "in.glb", 0.01, 100.0, 1.0), tmp_path / "out.glb"
    report = gltf_ext.compress(source, output, step=0.001)
    assert steps(output) == pytest.approx([0.1, 1e-5, 0.001])
    assert report["steps"]["POSITION"]["step"] == pytest.approx([0.001, 0.001])
    assert gltf_ext.verify(source, output)["ok"]


def test_one_grid_has_the_step_of_the_largest_scale(tmp_path):
    source, output = scaled(tmp_path / "in.glb", 0.5, 4.0), tmp_path / "out.glb"
    gltf_ext.compress(source, output, step=0.01, grid="scene")
    assert steps(output) == pytest.approx([0.0025, 0.0025])


@pytest.mark.parametrize("scale", [1.0, 1000.0])
def test_errors_on_steps_are_in_the_same_units(scale, tmp_path):
    source = scaled(tmp_path / "in.glb", scale)
    positions, _ = grid_mesh(9, 9)
    extent = scale * float(np.ptp(positions, axis=0).max())
    with pytest.raises(gltf_ext.MeshletError, match=f"for a box of {extent:g}"):
        gltf_ext.compress(source, tmp_path / "out.glb", step=1e-9 * scale)
    with pytest.raises(gltf_ext.MeshletError, match=f"in a box of {extent:g}"):
        gltf_ext.compress(source, tmp_path / "out.glb", step=extent)


def with_scale(path, scale):
    """The file of levels, which a node scales."""
    properties, binary = glb_parts(LEVELS)
    properties["nodes"][0]["scale"] = [scale] * 3
    path.write_bytes(glb_bytes(properties, bytes(binary)))
    return path


@pytest.mark.parametrize(("scale", "error"), [(1.0, 1.0), (10.0, 10.0), (0.01, 0.01)])
def test_an_error_is_as_large_as_nodes_show_it(scale, error, tmp_path):
    path = with_scale(tmp_path / "in.glb", scale)
    for factor, triangles in (0.99, 192), (1.0, 96), (2.0, 48):
        (primitive,) = gltf_ext.load(path, error=factor * error * 1.0001)
        assert len(primitive.indices) == triangles
        report = gltf_ext.decompress(path, tmp_path / "out.glb", error=factor * error * 1.0001)
        assert report["triangles"] == triangles
    (share,) = gltf_ext.load(path, error="100%")
    assert len(share.indices) == 48


def test_load_takes_a_level():
    counts = [len(gltf_ext.load(LEVELS, level=k)[0].indices) for k in (None, 0, 1, 2, 9)]
    assert counts == [192, 192, 96, 48, 48]
    with pytest.raises(gltf_ext.MeshletError, match="give one"):
        gltf_ext.load(LEVELS, level=1, error=1)


def test_levels_end_at_an_error_of_the_scene(tmp_path):
    points, triangles = grid_mesh(40, 40)
    points = points.copy()
    points[:, 2] = 0.05 * np.sin(9 * points[:, 0]) * np.cos(7 * points[:, 1])
    errors = []
    for scale in (1.0, 100.0):
        builder = Builder()
        builder.mesh({"POSITION": points}, triangles)
        builder.properties["nodes"][0]["scale"] = [scale] * 3
        source, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
        gltf_ext.compress(source, output, lod=True, lod_limit=0.02 * scale)
        groups = open_lod(output)[0].tables.groups["error"]
        errors.append(groups[np.isfinite(groups)].max())
        assert errors[-1] <= 0.02
    assert errors[0] == errors[1] > 0


def test_what_levels_cost(tmp_path):
    points, triangles = grid_mesh(40, 40)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    builder.mesh({"POSITION": points[:3]}, np.array([0, 1, 2], np.uint32))
    report = gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb", lod=True)
    lod = gltf_ext.inspect(tmp_path / "out.glb")["lod"]
    level_0 = sum(entry["levels"][0]["bytes"] for entry in lod)
    whole = sum(entry["page_bytes"] + entry["table_bytes"] for entry in lod)
    assert [entry["bytes"] for entry in report["lod"]] == [whole - level_0, 0]


def test_scales_of_meshes(tmp_path):
    scales = (2.0, 0.5)
    document = read_document(scaled(tmp_path / "in.glb", *scales))
    assert mesh_scales(document) == pytest.approx(dict(enumerate(scales)))
    document = read_document(scaled(tmp_path / "skin.glb", 3.0, skin=0))
    assert mesh_scales(document) == {0: 1.0}
    path = scaled(tmp_path / "loop.glb", 3.0, children=[0])
    assert mesh_scales(read_document(path)) == {}
