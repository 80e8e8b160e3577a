"""lod_error: primitives at the detail that a camera needs, beside Mitsuba's meshes of the cuts."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.lod import View, cut_for_view, open_lod
from gltf_ext.lod.reading import LodPrimitive
from gltf_meshlet.cli import main
from spec.make_lod_vectors import FOLDER
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, everything
from tests.helpers.mitsuba_reference import AOVS, mesh_of, picture, require, scene

LEVELS = FOLDER / "lod_levels.glb"  # 192, 96 and 48 triangles
VARIANTS = ("scalar_rgb", "llvm_ad_rgb")
EYE, SCALE = (0.3, 0.4, 3.0), 600.0  # pixels per unit
ERRORS = (0.3, 20.0)  # pixels: several levels in a cut, and the top level
IDS = {"type": "aov", "aovs": "position:position,primitive:prim_index"}
COLORS = {"type": "mesh_attribute", "name": "vertex_color"}
BSDF = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": COLORS}}


def translated(x, y, z, scales=(1.0, 1.0, 1.0)):
    matrix = np.diag([*scales, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix


# Near, far, mirrored, stretched; the last two show the same as the second.
PLACES = (
    translated(0, 0, 0),
    translated(0.5, 1.5, -20),
    translated(0, -1.2, 0.3, (1, -1, 1)),
    translated(-1.5, 0, -5, (1, 2, 0.5)),
    translated(2, 1.5, -20),
    translated(-1.5, 1.5, -20),
)


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    """A wavy sheet with levels, at PLACES, seen by a camera at EYE."""
    environment.need_package("meshoptimizer")
    folder = tmp_path_factory.mktemp("lod")
    values, triangles, _ = everything(columns=90, rows=60)
    points = values["POSITION"]
    points[:, 2] = 0.2 * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1])
    builder = Builder()
    attributes = {
        "POSITION": points,
        "TEXCOORD_0": points[:, :2] * np.float32(0.5),
        "COLOR_0": (0.5 + 0.4 * np.sin(points[:, [0, 1, 0, 1]] * [3, 4, 5, 6])).astype(np.float32),
    }
    builder.mesh(attributes, triangles)
    camera = {"perspective": {"yfov": float(2 * np.arctan(300 / SCALE)), "znear": 0.1}}
    builder.properties["cameras"] = [{"type": "perspective", **camera}]
    builder.properties["nodes"] = [
        *({"mesh": 0, "matrix": matrix.T.ravel().tolist()} for matrix in PLACES),
        {"camera": 0, "translation": list(EYE)},
    ]
    builder.properties["scenes"] = [{"nodes": list(range(len(PLACES) + 1))}]
    source = builder.write(folder / "in.glb")
    gltf_ext.compress(source, folder / "lod.glb", lod=True, page_bytes=8192)
    return folder / "lod.glb"


def cut_at(primitive, matrix, max_pixels):
    """The cut of a place, by the camera in the primitive's coordinates; stretched: by a scale."""
    eye = np.linalg.inv(matrix) @ [*EYE, 1.0]
    scales = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if scales[0] > 1.1 * scales[2]:
        return cut_for_view(primitive.tables, View(EYE, SCALE), max_pixels, matrix=matrix)
    return cut_for_view(primitive.tables, View(tuple(eye[:3]), SCALE), max_pixels)


def meshes_of(primitive, cuts):
    """Mitsuba's own meshes of the cuts at PLACES; mirrors turn triangles around."""
    meshes = {}
    for i, (cut, matrix) in enumerate(zip(cuts, PLACES)):
        mesh = primitive.mesh(cut)
        if np.linalg.det(matrix) < 0:
            mesh = replace(mesh, indices=mesh.indices[:, [0, 2, 1]])
        meshes[f"place_{i}"] = mesh_of(mesh, matrix)
    return meshes


def triangles_of(primitive, cut):
    return int(primitive.cluster_triangles[cut.drawn].sum())


def shape(path, max_pixels, **options):
    lod = {"lod_error": max_pixels, "lod_eye": list(EYE), "lod_pixels_per_unit": SCALE}
    options = {"bsdf": BSDF, **lod, **options}
    return {"type": "meshlet_edgebreaker", "filename": os.fspath(path), **options}


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("max_pixels", ERRORS)
@pytest.mark.parametrize(
    "accel, error",
    [({"cache": 0.1}, 1e-4), ({"accel": "triangles"}, 1e-3)],  # from the grid in one step or in two
    ids=["cache", "triangles"],
)
def test01_surfaces(variant, max_pixels, accel, error, sheet):
    """The whole scene: each place has its own cut."""
    mi, plugin = require(variant)
    (primitive,) = open_lod(sheet)
    cuts = [cut_at(primitive, matrix, max_pixels) for matrix in PLACES]
    reference = meshes_of(primitive, cuts)
    found = {"shape": shape(sheet, max_pixels, **accel)}
    count = sum(triangles_of(primitive, cut) for cut in cuts)
    shown = plugin.statistics(mi.load_dict(found["shape"]))["triangles"]
    assert shown == count < len(PLACES) * primitive.compressed.triangle_count
    expected, seen = (picture(scene(shapes, AOVS, (160, 160))) for shapes in (reference, found))
    assert (expected[..., :3] != 0).any()
    # Derivatives by texture coordinates are noise where those of a triangle are nearly equal.
    regular = np.abs(expected).max(axis=2) < 1e3
    assert regular.mean() > 0.999
    np.testing.assert_allclose(seen[regular], expected[regular], rtol=error, atol=error)


@pytest.mark.parametrize("variant", VARIANTS)
def test02_colours(variant, sheet):
    require(variant)
    (primitive,) = open_lod(sheet)
    mesh = primitive.mesh(cut_at(primitive, np.eye(4), ERRORS[0]))
    reference = mesh_of(mesh, properties={"bsdf": BSDF})
    found = shape(sheet, ERRORS[0], mesh=0, primitive=0)
    expected, seen = (
        picture(scene({"shape": s}, {"type": "direct"}, spp=64), seed=1) for s in (reference, found)
    )
    np.testing.assert_allclose(seen, expected, atol=0.02)


@pytest.mark.parametrize("variant", VARIANTS)
def test03_primitive_numbers(variant, sheet):
    """With a cache prim_index is 64 times the number of a drawn meshlet, in the order of pages, +
    triangle."""
    require(variant)
    (primitive,) = open_lod(sheet)
    cut = cut_at(primitive, np.eye(4), ERRORS[0])
    drawn = []
    for page in cut.pages:
        decoder = _codec.Decoder(primitive.page(page))
        drawn += [decoder.decode_meshlet(int(m)) for m in primitive.drawn_of_page(page, cut.drawn)]
    shown = shape(sheet, ERRORS[0], mesh=0, primitive=0, accel="cache")
    found = picture(scene({"shape": shown}, IDS))
    seen = (found[..., :3] != 0).any(axis=2)
    stream = primitive.compressed.attributes["POSITION"][0]
    grid = primitive.compressed.streams[stream]
    for position, number in zip(found[seen][:, :3], found[seen][:, 3].astype(int)):
        triangles, integers = drawn[number // 64][:2]
        corners = np.asarray(grid.offset[:3]) + integers[stream][triangles[number % 64]] * grid.step
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        edges = ((a, b), (b, c), (c, a))
        weights = [np.dot(np.cross(y - x, position - x), normal) for x, y in edges]
        assert min(weights) >= -1e-3 * np.dot(normal, normal)
        assert abs(np.dot(position - a, normal)) < 1e-5 * np.linalg.norm(normal)


def test04_load_scene_shares_what_is_equal(sheet):
    """Places with the same cut are instances of one shape group."""
    _, plugin = require("scalar_rgb")
    (primitive,) = open_lod(sheet)
    cuts = [cut_at(primitive, matrix, ERRORS[0]) for matrix in PLACES]
    assert (cuts[1].drawn == cuts[4].drawn).all() and (cuts[1].drawn == cuts[5].drawn).all()
    assert (cuts[0].drawn != cuts[1].drawn).any()
    described = plugin.scene.scene_dict(sheet, width=600, height=600, lod_error=ERRORS[0])
    placed = [described[f"node_{i}"] for i in (1, 4, 5)]
    assert [entry["type"] for entry in placed] == ["instance"] * 3
    assert len({entry["group"]["id"] for entry in placed}) == 1
    assert described["node_3_0"]["type"] == "meshlet_edgebreaker"  # stretched
    loaded = plugin.load_scene(sheet, width=600, height=600, lod_error=ERRORS[0])
    shapes = plugin.statistics(loaded)["triangles"]
    different = {cut.drawn.tobytes(): cut for cut in (cuts[i] for i in (0, 1, 2))}
    assert shapes == sum(triangles_of(primitive, cut) for cut in (*different.values(), cuts[3]))


@pytest.mark.parametrize("decoded", [False, True])
def test05_instances_look_like_meshes(sheet, decoded):
    mi, plugin = require("scalar_rgb")
    (primitive,) = open_lod(sheet)
    options = {"width": 96, "height": 96, "integrator": {"type": "aov", "aovs": "p:position"}}
    loaded = plugin.load_scene(sheet, lod_error=1.0, decoded=decoded, **options)
    scale = SCALE * 96 / 600
    cuts = [
        cut_for_view(primitive.tables, View(EYE, scale), 1.0, matrix=matrix) for matrix in PLACES
    ]
    described = plugin.scene.scene_dict(sheet, lod_error=1.0, **options)
    reference = mi.load_dict(
        {
            "type": "scene",
            "sensor": described["sensor"],
            "integrator": described["integrator"],
            **meshes_of(primitive, cuts),
        }
    )
    expected, seen = (picture(s, spp=1, seed=1) for s in (reference, loaded))
    np.testing.assert_allclose(seen, expected, rtol=1e-4, atol=1e-4)


def test06_without_an_eye_the_error_is_a_distance():
    mi, plugin = require("scalar_rgb")
    counts = []
    for error in (0.5, 1.0, 2.5):
        loaded = mi.load_dict(
            {"type": "meshlet_edgebreaker", "filename": os.fspath(LEVELS), "lod_error": error}
        )
        counts.append(plugin.statistics(loaded)["triangles"])
    assert counts == [192, 96, 48]


@pytest.mark.parametrize("name", ["lod_error", "lod_pixels_per_unit"])
@pytest.mark.parametrize("value", [-1.0, float("nan")])
def test07_wrong_numbers_are_refused(name, value):
    mi, _ = require("scalar_rgb")
    entry = {"type": "meshlet_edgebreaker", "filename": os.fspath(LEVELS), name: value}
    with pytest.raises(RuntimeError, match=f"{name} must be 0 or more"):
        mi.load_dict(entry)


def test08_render_takes_an_error(tmp_path, capsys):
    require("scalar_rgb")
    picture = str(tmp_path / "picture.png")
    size = ["--width", "16", "--height", "16", "--spp", "1", "--json"]
    found = []
    for error in ([], ["--lod-error", "1e-6"], ["--lod-error", "1000"]):
        assert main(["render", str(LEVELS), "-o", picture, *size, *error]) == 0
        found.append(json.loads(capsys.readouterr().out)["statistics"]["triangles"])
    assert found == [192, 192, 48]


def test09_files_without_levels_say_so(tmp_path):
    _, plugin = require("scalar_rgb")
    values, triangles, _ = everything()
    builder = Builder()
    builder.mesh({"POSITION": values["POSITION"]}, triangles)
    gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
    with pytest.warns(UserWarning, match="it has no levels of detail"):
        plugin.load_scene(tmp_path / "out.glb", lod_error=1.0)


def test10_a_page_is_checked_once_for_all_places(sheet, monkeypatch):
    environment.need_package("mitsuba")
    from mitsuba_plugin import reader

    checked = []
    check = LodPrimitive.check_page

    def counted(primitive, page):
        checked.append(page)
        check(primitive, page)

    monkeypatch.setattr(LodPrimitive, "check_page", counted)
    parts = reader.read_blobs(str(sheet), None, None, reader.LodView(View(EYE, SCALE), ERRORS[0]))
    assert len(checked) == len({part.blob for part in parts}) < len(parts)
