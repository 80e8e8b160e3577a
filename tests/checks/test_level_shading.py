"""verify measures how levels shade: angles, texels, steps of colours, flipped corners."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.checks.flips import FlipCounter
from gltf_ext.checks.samples import compare_surfaces, sample_surface
from gltf_ext.lod import LodPrimitive
from gltf_ext.sources.primitives import Primitive
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, grid_mesh

SIDE = 60


def sheet(height=0.0):
    """A smooth sheet of SIDE x SIDE vertices, with all that shades."""
    points, triangles = grid_mesh(SIDE, SIDE)
    points = (points * [1, 1, 0]).astype(np.float32)
    points[:, 2] = height + 0.05 * np.sin(6 * points[:, 0])
    slope = 0.3 * np.cos(6 * points[:, 0])
    normals = np.stack([-slope, 0 * slope, 1 + 0 * slope], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    attributes = {
        "POSITION": points,
        "NORMAL": normals.astype(np.float32),
        "TEXCOORD_0": points[:, :2].copy(),
        "COLOR_0": np.full((len(points), 3), 100, np.uint8),
    }
    return attributes, triangles.astype(np.uint32)


def spoilt(primitive, **attributes):
    return Primitive(0, 0, primitive.indices, {**primitive.attributes, **attributes})


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    environment.need_package("meshoptimizer")
    folder = tmp_path_factory.mktemp("shading")
    builder = Builder()
    attributes, triangles = sheet()
    builder.mesh(attributes, triangles, normalized=("COLOR_0",))
    source, output = builder.write(folder / "in.glb"), folder / "out.glb"
    gltf_ext.compress(source, output, lod=True)
    return source, output


def test_normals_that_are_turned_on_purpose_are_flipped_corners():
    primitive = Primitive(0, 0, sheet()[1], sheet()[0])
    normals = primitive.attributes["NORMAL"].copy()
    vertex = SIDE * (SIDE // 2) + SIDE // 2
    normals[vertex] *= -1
    level = spoilt(primitive, NORMAL=normals)
    corners = int((primitive.indices == vertex).sum())
    flips = FlipCounter(primitive).count(level)
    assert flips.corners == corners == 6
    assert flips.area_share == pytest.approx(corners / len(primitive.indices), rel=0.2)
    assert FlipCounter(primitive).count(primitive).corners == 0
    assert FlipCounter(level).count(level).corners == 0, "the finest level has them, too"


def test_a_thin_part_is_compared_with_the_side_that_faces_the_same_way():
    """A level of the front lies nearer to the back of a part that is thinner than the error."""
    front, triangles = sheet()
    back, _ = sheet(-0.01)
    both = {
        name: np.concatenate([front[name], -back[name] if name == "NORMAL" else back[name]])
        for name in ("POSITION", "NORMAL")
    }
    corners = np.concatenate([triangles, triangles[:, ::-1] + SIDE * SIDE]).astype(np.uint32)
    finest = Primitive(0, 0, corners, both)
    moved = {"POSITION": front["POSITION"] - np.float32([0, 0, 0.008]), "NORMAL": front["NORMAL"]}
    level = Primitive(0, 0, triangles, moved)
    points = sample_surface(finest, 1000)
    assert compare_surfaces(level, finest, points, 1000, 0.01)[1]["NORMAL"].max() < 10.0
    assert compare_surfaces(level, finest, points, 1000)[1]["NORMAL"].max() > 150.0


def test_verify_reports_what_levels_lose(files):
    levels = gltf_ext.verify(*files)["levels"]
    assert len(levels) > 1
    for level in levels:
        seen = {name: shading["seen"] for name, shading in level["shading"].items()}
        units = {name: values["unit"] for name, values in seen.items()}
        assert units == {"NORMAL": "degrees", "TEXCOORD_0": "texels", "COLOR_0": "8-bit steps"}
        for values in seen.values():
            assert 0.0 <= values["p99"] <= values["p99.9"]
        assert seen["NORMAL"]["p99.9"] < 60.0 and seen["COLOR_0"]["p99.9"] < 1e-3
        assert (level["flipped_corners"], level["flipped_area_share"]) == (0, 0.0)


def test_verify_sees_spoilt_shading(files, monkeypatch):
    """Of each level, 1 % of the vertices: normals upside down, colours 20 steps brighter."""
    real = LodPrimitive.mesh

    def mesh(primitive, cut):
        whole = real(primitive, cut)
        some = np.arange(whole.vertex_count) % 100 == 50
        normals, colors = (whole.attributes[name].copy() for name in ("NORMAL", "COLOR_0"))
        normals[some] *= -1
        colors[some] += 20
        return spoilt(whole, NORMAL=normals, COLOR_0=colors)

    before = gltf_ext.verify(*files)["levels"][0]
    monkeypatch.setattr(LodPrimitive, "mesh", mesh)
    level = gltf_ext.verify(*files)["levels"][0]
    assert level["flipped_corners"] > 3 and level["flipped_area_share"] > 0.01
    for name, least in (("NORMAL", 90.0), ("COLOR_0", 10.0)):
        assert level["shading"][name]["seen"]["p99.9"] > least
        assert before["shading"][name]["seen"]["p99.9"] < least / 2
    assert level["shading"]["TEXCOORD_0"] == before["shading"]["TEXCOORD_0"]
