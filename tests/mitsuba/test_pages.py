"""Files with pages: the same pictures and ids as one blob per primitive."""

from __future__ import annotations

import os

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder, everything
from tests.helpers.mitsuba_reference import AOVS, picture, require, scene

PAGE = 4096
VARIANTS = ("scalar_rgb", "llvm_ad_rgb")
IDS = {"type": "aov", "aovs": "position:position,primitive:prim_index"}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """(one blob, pages) of a sheet in two places, one of them mirrored, and of a mirrored mesh."""
    folder = tmp_path_factory.mktemp("pages")
    values, triangles, _ = everything(columns=60, rows=40)
    names = ("POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0")
    builder = Builder()
    builder.mesh({name: values[name] for name in names}, triangles)
    values, triangles, _ = everything(columns=20, rows=16)
    builder.mesh({name: values[name] for name in names}, triangles)
    builder.properties["nodes"] = [
        {"mesh": 0},
        {"mesh": 0, "translation": [0.2, -1.2, 0.3], "scale": [1, -1, 1]},
        {"mesh": 1, "translation": [0.5, 0.4, 0.6], "scale": [-1, 1, 1]},
    ]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2]}]
    source = builder.write(folder / "in.glb")
    gltf_ext.compress(source, folder / "one.glb")
    gltf_ext.compress(source, folder / "pages.glb", page_bytes=PAGE)
    return folder / "one.glb", folder / "pages.glb"


def shape(path, **options) -> dict:
    bsdf = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    options = {"bsdf": {"type": "twosided", "bsdf": bsdf}, **options}
    return {"shape": {"type": "meshlet_edgebreaker", "filename": os.fspath(path), **options}}


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize(
    "options", [{"cache": 0.1}, {"cache": 1.0}, {"accel": "triangles"}, {"mesh": 0, "primitive": 0}]
)
def test01_surfaces(variant, options, files):
    require(variant)
    expected, found = (picture(scene(shape(path, **options), AOVS)) for path in files)
    assert (expected[..., :3] != 0).any()
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("variant", VARIANTS)
def test02_pictures(variant, files):
    require(variant)
    integrator = {"type": "path", "max_depth": 4}
    expected, found = (picture(scene(shape(path), integrator, spp=64), seed=1) for path in files)
    # Paths that leave an edge by another triangle differ.
    assert np.mean(np.abs(found - expected).max(axis=2) > 0.1) < 0.01
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.parametrize("variant", VARIANTS)
def test03_statistics(variant, files):
    mi, plugin = require(variant)
    one, pages = (plugin.statistics(mi.load_dict(shape(path)["shape"])) for path in files)
    assert pages["triangles"] == one["triangles"] and pages["vertices"] > one["vertices"]
    totals = gltf_ext.inspect(files[1])["totals"]
    assert totals["blobs"] > 4
    sizes = sum(len(view) for view in views(files[1]))
    assert pages["compressed_bytes"] == sizes


@pytest.mark.parametrize("variant", VARIANTS)
def test04_primitive_numbers_count_on(variant, files):
    """With a cache, prim_index is meshlet * 64 + triangle; meshlets count on through all pages."""
    _mi, _ = require(variant)
    found = picture(scene(shape(files[1], mesh=0, primitive=0, accel="cache"), IDS))
    seen = (found[..., :3] != 0).any(axis=2)
    (decoder, _) = gltf_ext.decoders(files[1])
    for position, number in zip(found[seen][:, :3], found[seen][:, 3].astype(int)):
        triangles, attributes = decoder.decode_meshlet(number // 64)
        a, b, c = attributes["POSITION"][triangles[number % 64]].astype(np.float64)
        normal = np.cross(b - a, c - a)
        weights = [
            np.dot(np.cross(y - x, position - x), normal) for x, y in ((a, b), (b, c), (c, a))
        ]
        assert min(weights) >= -1e-3 * np.dot(normal, normal)
        distance = abs(np.dot(position - a, normal)) / np.linalg.norm(normal)
        assert distance < 1e-5


@pytest.mark.parametrize("variant", VARIANTS)
def test05_ordinary_meshes(variant, files):
    """load_scene decodes all pages on request: the same surfaces, mirrored ones too."""
    _, plugin = require(variant)
    options = {"width": 96, "height": 72, "integrator": AOVS}
    for path in files:
        scenes = [plugin.load_scene(path, decoded=decoded, **options) for decoded in (False, True)]
        shown, none = (plugin.statistics(s)["meshlets"] for s in scenes)
        assert shown > none == 0
        expected, found = (picture(s, spp=1, seed=1) for s in scenes)
        assert (expected[..., :3] != 0).any()
        same = np.isclose(found, expected, rtol=1e-3, atol=1e-3).all(axis=2)
        assert same.mean() > 0.995  # rays at edges may hit either side


def views(path) -> list[bytes]:
    from gltf_ext.attributes.extension import compressed_primitives
    from gltf_ext.sources.importers import open_model

    return [compressed.blob for compressed in compressed_primitives(open_model(path))]
