"""Shapes whose triangles Embree owns: what users of Mitsuba's own meshes rely on."""

from __future__ import annotations

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder, everything
from tests.helpers.mitsuba_reference import (
    AOVS,
    VARIANTS,
    compressed,
    mesh_of,
    meshes_of,
    picture,
    require,
    scene,
    shapes_of,
    sheet,
)

JIT = ("llvm_ad_rgb",)
PATH = {"type": "path", "max_depth": 3}
EQUAL = 1e-4


def rays(mi, primitives, count: int = 2000):
    """Rays from one point to random ones of the model's box."""
    points = primitives[0].attributes["POSITION"]
    low, high = points.min(axis=0), points.max(axis=0)
    target = low + np.random.default_rng(0).random((count, 3)) * (high - low)
    origin = (low + high) / 2 + [0.1, 0.2, 2 * np.linalg.norm(high - low)]
    direction = (target - origin) / np.linalg.norm(target - origin, axis=1, keepdims=True)
    start = np.repeat(origin[:, None], count, axis=1)
    return mi.Point3f(start.astype(np.float32)), mi.Vector3f(direction.T.astype(np.float32))


@pytest.mark.parametrize("variant", JIT)
@pytest.mark.parametrize("field", ["t", "p", "uv", "n", "sh_frame"])
def test01_gradients_through_rays(variant, field, tmp_path):
    mi, _ = require(variant)
    import drjit as dr

    path, primitives = sheet(tmp_path)
    found = []
    for shapes in (meshes_of(primitives), shapes_of(path, primitives)):
        origin, direction = rays(mi, primitives)
        dr.enable_grad(origin, direction)
        shown = mi.load_dict({"type": "scene", **shapes})
        si = shown.ray_intersect(mi.Ray3f(origin, direction))
        value = si.sh_frame.n if field == "sh_frame" else getattr(si, field)
        if field != "t":
            value = dr.dot(value, type(value)(*(1, -0.7, 0.4)[: len(value)]))
        flags = dr.ADFlag.Default | dr.ADFlag.AllowNoGrad
        dr.backward(dr.sum(dr.select(si.is_valid(), value, 0)), flags)
        found.append(np.concatenate([np.array(dr.grad(origin)), np.array(dr.grad(direction))]))
    expected, ours = found
    assert field == "n" or np.abs(expected).max() > 0.01
    np.testing.assert_allclose(ours, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max() + 1e-9)


@pytest.mark.parametrize("variant", JIT)
def test02_gradients_of_a_camera(variant, tmp_path):
    mi, _ = require(variant)
    import drjit as dr

    path, primitives = sheet(tmp_path)
    found = []
    for shapes in (meshes_of(primitives), shapes_of(path, primitives)):
        s = scene(shapes, PATH, (32, 32))
        parameters, moved = mi.traverse(s), mi.Float(0.0)
        dr.enable_grad(moved)
        pose = mi.Transform4f(parameters["sensor.to_world"])
        parameters["sensor.to_world"] = pose @ mi.Transform4f().translate([moved, 0, 0])
        parameters.update()
        dr.backward(dr.sum(mi.render(s, parameters, spp=16, seed=3) ** 2, axis=None))
        found.append(float(dr.grad(moved)[0]))
    assert found[0] != 0 and found[1] == pytest.approx(found[0], rel=1e-3)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test03_preliminary_intersections(variant, tmp_path):
    """Barycentric weights and face numbers are those of the decompressed mesh."""
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    mesh, shape = (
        mi.load_dict({"type": "scene", **s})
        for s in (meshes_of(primitives), shapes_of(path, primitives))
    )
    points = primitives[0].attributes["POSITION"][primitives[0].indices].mean(axis=1)
    for point in points[:: len(points) // 20]:
        x, y, z = map(float, point)
        ray = mi.Ray3f(mi.Point3f(x + 1e-3, y + 2e-3, z + 1), mi.Vector3f(0, 0, -1))
        a, b = (s.ray_intersect_preliminary(ray) for s in (mesh, shape))
        assert np.ravel(a.prim_index) == np.ravel(b.prim_index)
        np.testing.assert_allclose(np.ravel(a.prim_uv), np.ravel(b.prim_uv), atol=EQUAL)
        assert np.ravel(a.t) == pytest.approx(np.ravel(b.t))


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test04_moved_after_loading(variant, tmp_path):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    s = scene(shapes_of(path, primitives), PATH)
    first = picture(s, spp=4)
    parameters = mi.traverse(s)
    assert parameters["shape_0.face_count"] == len(primitives[0].indices)
    assert parameters["shape_0.vertex_count"] > 0
    move = mi.ScalarTransform4f().translate([0.2, 0.1, 0]).rotate([0, 0, 1], 30)
    parameters["shape_0.to_world"] = mi.Transform4f(move.matrix)
    parameters.update()
    shape = s.shapes()[0]
    moved = mi.load_dict({**shapes_of(path, primitives)["shape_0"], "to_world": move})
    assert np.allclose(np.ravel(shape.bbox().min), np.ravel(moved.bbox().min))
    ray = mi.Ray3f(mi.Point3f(1, 0.8, 2), mi.Vector3f(0, 0, -1))
    for scene_of in (s, mi.load_dict({"type": "scene", "shape": moved})):
        hit = scene_of.ray_intersect(ray)
        assert bool(np.ravel(hit.is_valid())[0])
        place = np.ravel(hit.p)
        assert place[2] == pytest.approx(np.ravel(s.ray_intersect(ray).p)[2], abs=1e-6)
    parameters["shape_0.to_world"] = mi.Transform4f()
    parameters.update()
    assert np.array_equal(picture(s, spp=4), first)


@pytest.mark.parametrize("accel", ["triangles", "cache"])
def test05_flipped_texture_coordinates(accel, tmp_path):
    require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    plain, flipped = (
        picture(scene(shapes_of(path, primitives, accel=accel, flip_tex_coords=flip), AOVS))
        for flip in (False, True)
    )
    seen = (plain[..., :3] != 0).any(axis=2)
    np.testing.assert_allclose(flipped[seen][:, 9], plain[seen][:, 9], atol=1e-6)
    np.testing.assert_allclose(flipped[seen][:, 10], 1 - plain[seen][:, 10], atol=1e-6)
    np.testing.assert_allclose(flipped[seen][:, 14:17], -plain[seen][:, 14:17], atol=1e-3)


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize("names", [("POSITION",), ("POSITION", "NORMAL")])
def test06_tangents_without_texture_coordinates(variant, names, tmp_path):
    """Along the edges, as Mitsuba's meshes have them."""
    require(variant)
    path, primitives = sheet(tmp_path, names)
    a, b = (picture(scene(s, AOVS)) for s in (meshes_of(primitives), shapes_of(path, primitives)))
    np.testing.assert_allclose(b[..., 11:], a[..., 11:], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize(
    "bits",
    [{"position_bits": 24}, {"normal_bits": 12}, None],
    ids=["wide positions", "wide normals", "integers"],
)
def test07_wide_forms(variant, bits, tmp_path):
    """Streams that do not fit 16 or 8 bits."""
    require(variant)
    values, triangles, _ = everything(columns=12, rows=8)
    values["TEXCOORD_0"] = values["POSITION"][:, :2] * np.float32(0.5)
    if bits is None:
        values["POSITION"] = np.round(values["POSITION"] * 1000).astype(np.int16)
        values["TEXCOORD_0"] = np.round(values["TEXCOORD_0"] * 30000).astype(np.uint16)
    builder = Builder()
    names = ("POSITION", "NORMAL", "TEXCOORD_0")
    builder.mesh({n: values[n] for n in names}, triangles, normalized=("TEXCOORD_0",))
    builder.properties["extensionsUsed"] = ["KHR_mesh_quantization"]
    source = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(source, tmp_path / "out.glb", **(bits or {}))
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    primitives = gltf_ext.load(tmp_path / "plain.glb")
    for p in primitives:
        if p.attributes["TEXCOORD_0"].dtype == np.uint16:
            p.attributes["TEXCOORD_0"] = p.attributes["TEXCOORD_0"] / np.float32(65535)
    a, b = (
        picture(scene(s, AOVS))
        for s in (meshes_of(primitives), shapes_of(tmp_path / "out.glb", primitives))
    )
    assert (a[..., :3] != 0).any()
    same = np.isclose(b, a, rtol=1e-3, atol=1e-4).all(axis=2)
    assert same.mean() > 0.999


def test08_auto_follows_what_is_asked_for(tmp_path):
    mi, plugin = require("scalar_rgb")
    path, primitives = sheet(tmp_path)

    def blocks(**options) -> int:
        shape = mi.load_dict(shapes_of(path, primitives, **options)["shape_0"])
        return int(plugin.statistics(shape)["block_bytes"])

    assert blocks() == blocks(accel="triangles") == blocks(accel="triangles", cache=0.5) > 0
    assert blocks(cache=1.0) == blocks(cache_bytes=100) == blocks(accel="cache") == 0


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test09_a_whole_file_with_mixed_primitives(variant, tmp_path):
    """One shape for primitives with different grids, places and attributes."""
    require(variant)
    builder = Builder()
    for i, names in enumerate((("NORMAL", "TEXCOORD_0"), ("TEXCOORD_0",), ("NORMAL",), ())):
        values, triangles, _ = everything(columns=8 + i, rows=6)
        values["POSITION"] = values["POSITION"] + np.float32([0, 1.2 * i, 0.1 * i])
        values["TEXCOORD_0"] = values["POSITION"][:, :2] * np.float32(0.3)
        builder.mesh({n: values[n] for n in ("POSITION", *names)}, triangles)
    builder.properties["nodes"] = [{"mesh": i} for i in range(4)]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    path, primitives = compressed(builder.write(tmp_path / "mixed.glb"), tmp_path)
    shape = {"shape": {"type": "meshlet_edgebreaker", "filename": str(path)}}
    meshes = {f"mesh_{i}": mesh_of(p) for i, p in enumerate(primitives)}
    a, b = (picture(scene(s, AOVS, (96, 96))) for s in (meshes, shape))
    same = np.isclose(b, a, rtol=1e-3, atol=1e-3).all(axis=2)
    assert (a[..., :3] != 0).any() and same.mean() > 0.999


@pytest.mark.parametrize("accel", ["triangles", "cache"])
def test10_transforms_that_mirror(accel, tmp_path):
    """As with ply; as under a node of glTF on request."""
    mi, _ = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    mesh_of(primitives[0]).write_ply(str(tmp_path / "mesh.ply"))
    mirror = mi.ScalarTransform4f().scale([-1, 1, 1])
    ours = {**shapes_of(path, primitives, accel=accel)["shape_0"], "to_world": mirror}
    ply = {"type": "ply", "filename": str(tmp_path / "mesh.ply"), "to_world": mirror}
    expected, found, outside = (
        mi.load_dict({"type": "scene", "shape": shape}).ray_intersect(
            mi.Ray3f(mi.Point3f(-0.7, 0.4, 2), mi.Vector3f(0, 0, -1))
        )
        for shape in (ply, ours, {**ours, "keep_outside": True})
    )
    assert expected.is_valid() and found.is_valid()
    np.testing.assert_allclose(found.n, expected.n, atol=EQUAL)
    np.testing.assert_allclose(found.sh_frame.n, expected.sh_frame.n, atol=1e-3)
    np.testing.assert_allclose(outside.n, -found.n, atol=EQUAL)
    np.testing.assert_allclose(outside.sh_frame.n, found.sh_frame.n, atol=EQUAL)


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize("bits", [12, 24])
def test11_smooth_normals(variant, bits, tmp_path):
    """Those that ply computes for a mesh without normals."""
    mi, _ = require(variant)
    values, triangles, _ = everything(columns=20, rows=12)
    builder = Builder()
    builder.mesh({"POSITION": values["POSITION"]}, triangles)
    source = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(source, tmp_path / "out.glb", position_bits=bits)
    gltf_ext.decompress(tmp_path / "out.glb", tmp_path / "plain.glb")
    primitives = gltf_ext.load(tmp_path / "plain.glb")
    mesh_of(primitives[0]).write_ply(str(tmp_path / "mesh.ply"))
    ply = {"shape": {"type": "ply", "filename": str(tmp_path / "mesh.ply")}}
    ours = shapes_of(tmp_path / "out.glb", primitives, smooth_normals=True)
    a, b = (picture(scene(s, AOVS)) for s in (ply, ours))
    assert np.abs(a[..., 3:6] - a[..., 6:9]).max() > 0.01
    np.testing.assert_allclose(b[..., 3:9], a[..., 3:9], atol=1e-3)
    with pytest.raises(RuntimeError, match="no smooth_normals"):
        mi.load_dict({**ours["shape_0"], "accel": "cache"})


@pytest.mark.parametrize("keep_outside", [False, True])
def test12_smooth_normals_turn_with_their_triangles(keep_outside, tmp_path):
    """Under a transform that mirrors, as ply computes them."""
    mi, _ = require("scalar_rgb")
    path, primitives = sheet(tmp_path, ("POSITION",))
    mesh_of(primitives[0]).write_ply(str(tmp_path / "mesh.ply"))
    mirror = mi.ScalarTransform4f().scale([-1, 1, 1])
    ours = shapes_of(path, primitives, smooth_normals=True, keep_outside=keep_outside)["shape_0"]
    ply = {"type": "ply", "filename": str(tmp_path / "mesh.ply")}
    expected, found = (
        mi.load_dict({"type": "scene", "shape": {**shape, "to_world": mirror}}).ray_intersect(
            mi.Ray3f(mi.Point3f(-0.7, 0.4, 2), mi.Vector3f(0, 0, -1))
        )
        for shape in (ply, ours)
    )
    sign = -1 if keep_outside else 1
    np.testing.assert_allclose(sign * found.n, expected.n, atol=EQUAL)
    np.testing.assert_allclose(sign * found.sh_frame.n, expected.sh_frame.n, atol=1e-3)


@pytest.mark.parametrize("accel", ["triangles", "cache"])
def test13_tables_of_emitters_are_bounded(accel, tmp_path):
    """Texture coordinates that repeat over each triangle: each lies in all cells of the table."""
    mi, plugin = require("scalar_rgb")
    values, triangles, _ = everything(columns=120, rows=80)
    values["TEXCOORD_0"] = np.random.default_rng(0).random((len(values["POSITION"]), 2)) * 90
    values["TEXCOORD_0"] = values["TEXCOORD_0"].astype(np.float32)
    builder = Builder()
    builder.mesh({n: values[n] for n in ("POSITION", "TEXCOORD_0")}, triangles)
    path, primitives = compressed(builder.write(tmp_path / "in.glb"), tmp_path)
    shape = shapes_of(path, primitives, accel=accel)["shape_0"]
    shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    light = mi.load_dict(shape)
    assert plugin.statistics(light)["table_bytes"] < 200 * len(triangles)
    found = light.eval_parameterization(mi.Point2f(0.3, 0.6))
    assert found.is_valid()
    np.testing.assert_allclose(np.array(found.uv) % 1, [0.3, 0.6], atol=1e-3)


@pytest.mark.parametrize("accel", ["triangles", "cache"])
def test14_facts_in_traverse(accel, tmp_path):
    mi, _ = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    shape = mi.load_dict(shapes_of(path, primitives, accel=accel)["shape_0"])
    parameters = mi.traverse(shape)
    assert parameters["face_count"] == len(primitives[0].indices)
    points = primitives[0].attributes["POSITION"]
    np.testing.assert_allclose(parameters["bbox.min"], points.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(parameters["bbox.max"], points.max(axis=0), atol=1e-6)
