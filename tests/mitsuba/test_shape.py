"""The shape against Mitsuba's own meshes of the decompressed file."""

from __future__ import annotations

import functools

import numpy as np
import pytest

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
    sheet,
)
from tests.helpers.mitsuba_reference import shapes_of as compressed_shapes

MODELS = (
    "bunny.glb",
    "suzanne.glb",
    "materialball.glb",
    "dragon.glb",
    "sponza_like.glb",
    "DamagedHelmet.glb",
)
SMALL = ("bunny.glb", "DamagedHelmet.glb")
CLOSED = ("igea.glb", "chinesedragon.glb")
POSITION, NORMAL, UV = 1e-5, 1e-3, 1e-4  # allowed errors; POSITION of the bounding box's diagonal
EQUAL_PIXELS = 0.9999


@pytest.fixture(params=["triangles", "cache"])
def shapes_of(request):
    """Makes compressed shapes of one way to find triangles."""
    return functools.partial(compressed_shapes, accel=request.param)


def compare_aovs(
    expected: np.ndarray, found: np.ndarray, diagonal: float, texcoords: bool = True
) -> float:
    """Share of the pixels whose position, shading normal and texture coordinates agree.

    Without texture coordinates Mitsuba returns barycentric ones, which floats cannot hold to 1e-4
    on a tiny triangle.
    """
    position, normal, uv = (
        np.abs(expected[..., s] - found[..., s]).max(axis=2)
        for s in (slice(0, 3), slice(3, 6), slice(9, 11))
    )
    return float(
        np.mean(
            (position <= POSITION * diagonal) & (normal <= NORMAL) & ((uv <= UV) | (not texcoords))
        )
    )


def diagonal_of(scene) -> float:
    return float(np.linalg.norm(np.array(scene.bbox().extents()).ravel()))


@pytest.mark.parametrize("variant", VARIANTS)
def test01_create(variant, tmp_path):
    mi, plugin = require(variant)
    path, primitives = sheet(tmp_path)
    shape = mi.load_dict({"type": "meshlet_edgebreaker", "filename": str(path), "cache": 0.5})
    assert shape.primitive_count() == plugin.statistics(shape)["meshlets"] > 1
    assert plugin.statistics(shape)["triangles"] == len(primitives[0].indices)
    low, high = (
        primitives[0].attributes["POSITION"].min(axis=0),
        primitives[0].attributes["POSITION"].max(axis=0),
    )
    assert np.allclose(np.array(shape.bbox().min).ravel(), low) and np.allclose(
        np.array(shape.bbox().max).ravel(), high
    )
    assert "triangles = " in str(shape)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test02_xml(variant, tmp_path):
    mi, _ = require(variant)
    path, _ = sheet(tmp_path)
    text = '<shape {}type="meshlet_edgebreaker"><string name="filename" value="{}"/></shape>'
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0">' + text.format("", path.name) + "</scene>"
    )
    assert (
        len(mi.load_file(str(tmp_path / "scene.xml")).shapes()) == 1
    )  # a path relative to the scene
    assert mi.load_string(text.format('version="3.0.0" ', path)).primitive_count() > 1


@pytest.mark.parametrize("variant", VARIANTS)
def test03_surface_interaction(variant, tmp_path, shapes_of):
    _mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    expected = scene(meshes_of(primitives), AOVS)
    found = scene(shapes_of(path, primitives), AOVS)
    a, b = picture(expected), picture(found)
    assert np.isfinite(b).all() and (b[..., :3] != 0).any()
    assert compare_aovs(a, b, diagonal_of(expected)) == 1
    assert np.allclose(a[..., 11:], b[..., 11:], rtol=1e-3, atol=1e-3)  # dp_du, dp_dv


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize(
    "options",
    [{"flip_normals": True}, {"face_normals": True}, {"flip_normals": True, "face_normals": True}],
)
def test04_normals(variant, options, tmp_path, shapes_of):
    require(variant)
    path, primitives = sheet(tmp_path)
    a = picture(
        scene(
            meshes_of(primitives, properties=options, normals=not options.get("face_normals")), AOVS
        )
    )
    b = picture(scene(shapes_of(path, primitives, **options), AOVS))
    assert np.allclose(a[..., 3:9], b[..., 3:9], atol=NORMAL)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test05_to_world(variant, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    to_world = (
        mi.ScalarTransform4f().translate([3, -2, 1]).rotate([1, 2, 3], 40).scale([2, 0.5, 1.5])
    )
    matrix = np.array(to_world.matrix, np.float64).reshape(4, 4)
    expected = scene(meshes_of(primitives, matrix=matrix), AOVS)
    a, b = picture(expected), picture(scene(shapes_of(path, primitives, to_world=to_world), AOVS))
    assert compare_aovs(a, b, diagonal_of(expected)) >= 0.999


@pytest.mark.parametrize("variant", VARIANTS)
def test06_vertex_color(variant, tmp_path, shapes_of):
    require(variant)
    path, primitives = sheet(tmp_path)
    bsdf = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    integrator = {"type": "path", "max_depth": 2}
    a = picture(scene(meshes_of(primitives, properties={"bsdf": bsdf}), integrator), spp=16)
    b = picture(scene(shapes_of(path, primitives, bsdf=bsdf), integrator), spp=16)
    assert np.abs(a - b).max() < 1e-2 and a.std() > 0.05


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test07_custom_attributes(variant, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(
        tmp_path, ("POSITION", "_HEAT", "COLOR_0", "COLOR_1", "COLOR_2", "_FRAME", "_ID")
    )
    shape = mi.load_dict(shapes_of(path, primitives)["shape_0"])
    for name, there in (
        ("vertex_heat", True),
        ("vertex_id", True),
        ("vertex_color_1", True),
        ("vertex_alpha", True),
        ("vertex_color_2", True),
        ("vertex_frame", False),
        ("vertex_nothing", False),
    ):
        assert bool(np.all(np.array(shape.has_attribute(name)))) == there, name
    attributes, corner = primitives[0].attributes, primitives[0].indices[100]
    center = attributes["POSITION"][corner].mean(axis=0)
    up = mi.load_dict({"type": "scene", "shape": shape}).ray_intersect(
        mi.Ray3f(mi.Point3f(*np.add(center, (0, 0, 1)).tolist()), mi.Vector3f(0, 0, -1))
    )
    assert float(np.ravel(shape.eval_attribute_1("vertex_heat", up))[0]) == pytest.approx(
        float(attributes["_HEAT"][corner].mean()), rel=1e-3, abs=10
    )
    color = attributes["COLOR_1"][corner].mean(axis=0) / 255
    assert np.allclose(
        np.array(shape.eval_attribute_3("vertex_color_1", up)).ravel(), color, atol=1e-3
    )
    alpha = attributes["COLOR_0"][corner, 3].mean()
    assert float(np.ravel(shape.eval_attribute_1("vertex_alpha", up))[0]) == pytest.approx(
        float(alpha), abs=1e-3
    )


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test08_instances(variant, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)

    def group(shapes):
        places = [
            mi.ScalarTransform4f().translate([0, 1.2 * i, 0]).rotate([0, 1, 0], 25 * i)
            for i in range(3)
        ]
        return {
            "group": {"type": "shapegroup", **shapes},
            **{
                f"instance_{i}": {
                    "type": "instance",
                    "group": {"type": "ref", "id": "group"},
                    "to_world": t,
                }
                for i, t in enumerate(places)
            },
        }

    integrator = {"type": "path", "max_depth": 3}
    expected = scene(group(meshes_of(primitives)), AOVS)
    a, b = picture(expected), picture(scene(group(shapes_of(path, primitives)), AOVS))
    assert compare_aovs(a, b, diagonal_of(expected)) >= 0.999
    a, b = (
        picture(scene(group(s), integrator), spp=16)
        for s in (meshes_of(primitives), shapes_of(path, primitives))
    )
    assert np.mean(a) == pytest.approx(np.mean(b), rel=1e-2)


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize("radiance", ["constant", "textured"])
def test09_area_emitter(variant, radiance, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    texture = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.random.default_rng(0).random((8, 8, 3)).astype(np.float32)),
        "raw": True,
    }
    emitter = {
        "type": "area",
        "radiance": texture if radiance == "textured" else {"type": "rgb", "value": [2, 1, 0.5]},
    }
    floor = {
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([1, 0.5, -1]).scale(3),
        }
    }
    integrator = {"type": "path", "max_depth": 2}
    options = (
        {"spp": 64, "size": (32, 32)}
        if variant.startswith("scalar")
        else {"spp": 256, "size": (32, 32)}
    )
    flipped = {"flip_normals": True, "face_normals": True}
    a = scene(
        {
            **meshes_of(primitives, properties={"emitter": emitter, **flipped}, normals=False),
            **floor,
        },
        integrator,
        light=False,
        **options,
    )
    b = scene(
        {**shapes_of(path, primitives, emitter=emitter, **flipped), **floor},
        integrator,
        light=False,
        **options,
    )
    a, b = picture(a, seed=1), picture(b, seed=2)
    assert np.mean(b) == pytest.approx(np.mean(a), rel=0.05) and np.mean(a) > 1e-3


@pytest.mark.parametrize("scale", [1, 1e9])
def test09_texture_coordinates_far_from_0(scale, tmp_path, shapes_of):
    """An emitter finds points by texture coordinates that no int of its grid's cells can hold."""
    mi, _ = require("scalar_rgb")
    values, triangles, _ = everything(columns=8, rows=6)
    values["TEXCOORD_0"] = values["POSITION"][:, :2] * np.float32(scale)
    builder = Builder()
    builder.mesh({n: values[n] for n in ("POSITION", "TEXCOORD_0")}, triangles)
    path, primitives = compressed(builder.write(tmp_path / "far.glb"), tmp_path)
    shape = mi.load_dict(shapes_of(path, primitives, emitter={"type": "area"})["shape_0"])
    for uv in ([0.3, 0.4], [0.7, 0.1]):
        assert shape.eval_parameterization(uv).is_valid()
    for uv in ([np.nan, 0], [0, np.inf], [-np.inf, np.nan]):
        assert not shape.eval_parameterization(uv).is_valid()


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test10_surface_area(variant, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    p = primitives[0].attributes["POSITION"].astype(np.float64)[primitives[0].indices]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
    shape = mi.load_dict(shapes_of(path, primitives)["shape_0"])
    assert float(np.ravel(shape.surface_area())[0]) == pytest.approx(area, rel=1e-4)


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test11_masks_and_textures(variant, tmp_path, shapes_of):
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    random = np.random.default_rng(1)
    holes = {
        "type": "bitmap",
        "bitmap": mi.Bitmap((random.random((16, 16, 1)) > 0.5).astype(np.float32)),
        "raw": True,
        "filter_type": "nearest",
    }
    colors = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(random.random((16, 16, 3)).astype(np.float32)),
        "raw": True,
    }
    bsdf = {
        "type": "mask",
        "opacity": holes,
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": colors}},
    }
    integrator = {"type": "path", "max_depth": 4}
    a = picture(scene(meshes_of(primitives, properties={"bsdf": bsdf}), integrator), spp=32)
    b = picture(scene(shapes_of(path, primitives, bsdf=bsdf), integrator), spp=32)
    assert np.mean(np.abs(a - b).max(axis=2) < 0.02) > 0.99


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test12_several_shapes(variant, tmp_path, shapes_of):
    """Several compressed shapes and Mitsuba's own in one scene: kernels call many shapes."""
    mi, _ = require(variant)
    path, primitives = sheet(tmp_path)
    move = mi.ScalarTransform4f().translate
    ball = {"ball": {"type": "sphere", "center": [1, 0.5, 0.4], "radius": 0.3}}
    mirror = {"type": "conductor"}
    ours = {
        f"shape_{i}": {
            **shapes_of(path, primitives)["shape_0"],
            "to_world": move([0, i, 0]),
            "bsdf": mirror if i else {"type": "diffuse"},
        }
        for i in range(3)
    }
    matrices = [np.array(move([0, i, 0]).matrix).reshape(4, 4) for i in range(3)]
    theirs = {
        f"shape_{i}": mesh_of(
            primitives[0], m, properties={"bsdf": mirror if i else {"type": "diffuse"}}
        )
        for i, m in enumerate(matrices)
    }
    integrator = {"type": "path", "max_depth": 4}
    a, b = (picture(scene({**s, **ball}, integrator), spp=16) for s in (theirs, ours))
    assert np.mean(np.abs(a - b).max(axis=2) < 0.02) > 0.99


def test13_errors(tmp_path):
    mi, _ = require("scalar_rgb")
    path, _ = sheet(tmp_path)
    damaged = tmp_path / "damaged.glb"
    data = bytearray(path.read_bytes())
    data[-200:] = b"\xff" * 200
    damaged.write_bytes(data)
    for parameters, words in (
        ({"filename": "nowhere.glb"}, "nowhere.glb"),
        ({"filename": str(path), "mesh": 7}, "mesh 7"),
        ({"filename": str(path), "primitive": 0}, "without mesh"),
        ({"filename": str(path), "cache": 2.0}, "between 0 and 1"),
        ({"filename": str(path), "cache_policy": "counts"}, "leave the parameter out"),
        ({"filename": str(path), "decoded": True}, "load_scene"),
        ({"filename": str(path), "accel": "bvh"}, "auto, cache or triangles"),
        ({"filename": str(damaged)}, "damaged"),
        ({"filename": str(damaged), "accel": "cache"}, "damaged"),
    ):
        with pytest.raises(RuntimeError, match=words):
            mi.load_dict({"type": "meshlet_edgebreaker", **parameters})


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize(
    "name", [m if m in SMALL else pytest.param(m, marks=pytest.mark.full) for m in MODELS]
)
def test20_models(variant, name, model, tmp_path, request, shapes_of):
    require(variant)
    path, primitives = compressed(model(name), tmp_path)
    size = (640, 360) if request.config.getoption("--full") else (128, 72)
    expected = scene(meshes_of(primitives), AOVS, size)
    a, b = picture(expected), picture(scene(shapes_of(path, primitives), AOVS, size))
    texcoords = any("TEXCOORD_0" in p.attributes for p in primitives)
    assert compare_aovs(a, b, diagonal_of(expected), texcoords) >= EQUAL_PIXELS
    integrator = {"type": "path", "max_depth": 3}
    spp = 16
    a, b = (
        picture(scene(s, integrator, (64, 36)), spp=spp)
        for s in (meshes_of(primitives), shapes_of(path, primitives))
    )
    noise = np.abs(a - a.mean()).mean() / np.sqrt(a.size * spp)
    assert abs(a.mean() - b.mean()) < 4 * noise + 1e-3 * a.mean()


@pytest.mark.parametrize(
    "name", [pytest.param(m, marks=[] if m == CLOSED[1] else pytest.mark.full) for m in CLOSED]
)
def test30_no_cracks(name, model, tmp_path, request, shapes_of):
    """No ray from inside a closed model leaves it."""
    mi, _ = require("llvm_ad_rgb")
    import drjit as dr

    path, primitives = compressed(model(name), tmp_path)
    shape = mi.load_dict({"type": "scene", **shapes_of(path, primitives)})
    rays, batch = (
        (10_000_000, 1_000_000) if request.config.getoption("--full") else (200_000, 200_000)
    )
    inside = inner_point(mi, dr, mi.load_dict({"type": "scene", **meshes_of(primitives)}))
    leaks = 0
    for seed in range(rays // batch):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, batch)
        ray = mi.Ray3f(mi.Point3f(*inside), mi.warp.square_to_uniform_sphere(sampler.next_2d()))
        leaks += int(dr.count(~shape.ray_test(ray))[0]) + int(
            dr.count(~shape.ray_intersect_preliminary(ray).is_valid())[0]
        )
    assert leaks == 0


def inner_point(mi, dr, reference) -> list[float]:
    """The innermost of a few random points that Mitsuba's own mesh encloses."""
    random = np.random.default_rng(0)
    center, extents = (
        np.array(reference.bbox().center()).ravel(),
        np.array(reference.bbox().extents()).ravel(),
    )
    best, farthest = None, 0.0
    for point in center + (random.random((200, 3)) - 0.5) * extents:
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(1, 512)
        pi = reference.ray_intersect_preliminary(
            mi.Ray3f(
                mi.Point3f(*map(float, point)), mi.warp.square_to_uniform_sphere(sampler.next_2d())
            )
        )
        nearest = float(dr.min(pi.t)[0])
        if dr.all(pi.is_valid()) and nearest > farthest:
            best, farthest = list(map(float, point)), nearest
    assert best is not None
    return best
