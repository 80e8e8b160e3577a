"""MeshletStream in Chromium and Firefox: the pictures of its cuts, holes, the budget."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from gltf_ext import compress, decompress
from gltf_ext.lod import LodPrimitive, open_lod
from tests.helpers import environment
from tests.helpers.browsers import pictures, share_that_differs
from tests.helpers.gltf_builder import Builder

BROWSERS = ["chrome", "firefox"]
PAGES = {"three": "tests/stream.html", "babylon": "tests/stream_babylon.html"}
RENDERERS = {"three": ["", ";webgpu=1"], "babylon": [""]}  # options of the pages
CASES = [
    *((b, "three", name) for b in BROWSERS for name in ("bunny.glb", "DamagedHelmet.glb")),
    *(pytest.param(b, "three", "dragon.glb", marks=pytest.mark.full) for b in BROWSERS),
    ("chrome", "babylon", "DamagedHelmet.glb"),
    ("firefox", "babylon", "bunny.glb"),
]


@pytest.fixture(autouse=True)
def needed():
    for name in ("three", "@babylonjs/loaders"):
        environment.need_npm_package(name)
    environment.need_package("meshoptimizer")


def middle_error(path: Path) -> float:
    """An error between those of groups, so that comparisons are the same in any precision."""
    errors = [p.tables.groups["error"] for p in open_lod(path) if isinstance(p, LodPrimitive)]
    finite = np.unique(np.concatenate(errors))
    finite = finite[np.isfinite(finite)]
    return float(finite[len(finite) // 2 : len(finite) // 2 + 2].astype(np.float64).mean())


@pytest.mark.parametrize(("browser", "engine", "name"), CASES)
def test_same_picture_as_the_decompressed_cut(browser, engine, name, model, tmp_path):
    """In both renderers of three.js."""
    compress(model(name), tmp_path / "model.glb", lod=True)
    error = middle_error(tmp_path / "model.glb")
    decompress(tmp_path / "model.glb", tmp_path / "plain.glb", error=error)
    options = f"ortho=1;error={error!r}"
    streams = [f"model.glb~{options}{renderer}" for renderer in RENDERERS[engine]]
    streamed = pictures(browser, PAGES[engine], tmp_path, *streams)
    assert not any("error" in result for result in streamed), streamed
    corners = (f"{end}{axis}" for end in ("min", "max") for axis in "xyz")
    box = ";".join(f"{corner}={value!r}" for corner, value in zip(corners, streamed[0]["box"]))
    files = [f"plain.glb~{options}{renderer};plain=1;{box}" for renderer in RENDERERS[engine]]
    plain = pictures(browser, PAGES[engine], tmp_path, *files)
    assert not any("error" in result for result in plain), plain
    for one, other, stream, file in zip(streamed, plain, streams, files):
        assert one["warnings"] == []
        assert one["triangles"] == other["triangles"] > 0
        assert np.allclose(one["hit"], other["hit"], atol=1e-5)
        assert share_that_differs(tmp_path, stream, file) < 0.001
    # The renderers filter textures differently.
    if name != "DamagedHelmet.glb":
        assert share_that_differs(tmp_path, streams[0], streams[-1]) < 0.001


def noisy_ball(subdivisions: int, noise: float) -> trimesh.Trimesh:
    ball = trimesh.creation.icosphere(subdivisions, 1.0)
    offsets = np.random.default_rng(1).normal(size=len(ball.vertices)) * noise
    ball.vertices *= (1 + offsets)[:, None]
    return ball


def write_instances(path: Path) -> None:
    """A ball with colours in two nodes, one mirrored, and twice by EXT_mesh_gpu_instancing."""
    ball = noisy_ball(5, 0.01)
    colours = (64 * ball.vertices[:, [0, 1, 2, 0]] + 128).astype(np.uint8)
    attributes = {"POSITION": ball.vertices.astype(np.float32), "COLOR_0": colours}
    builder = Builder()
    builder.mesh(attributes, ball.faces.astype(np.uint32), normalized={"COLOR_0"})
    instances = {
        "TRANSLATION": builder.accessor(np.float32([[3, 0, 0], [-3, 0, 0]])),
        "SCALE": builder.accessor(np.float32([[0.5, 0.5, 0.5], [1, 1.5, 1]])),
    }
    builder.properties |= {
        "nodes": [
            {"mesh": 0, "translation": [0, 3, 0], "scale": [1, -1, 0.5]},
            {"mesh": 0, "rotation": [0.5, 0.5, 0.5, 0.5]},
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": instances}}},
        ],
        "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
    }
    builder.write(path)


def write_two_layouts(path: Path) -> None:
    """Two balls, one of them with colours, so that their vertices lie in different pools."""
    scene = trimesh.Scene()
    for number in range(2):
        ball = noisy_ball(6, 0.005)
        ball.apply_translation([50 * number, 0, 0])
        if number:
            ball.visual.vertex_colors = np.full((len(ball.vertices), 4), 200, np.uint8)
        scene.add_geometry(ball)
    scene.export(path)


def silhouette(path: Path) -> np.ndarray:
    image = np.asarray(Image.open(path).convert("RGB"), np.int16)
    return (abs(image - image[0, 0]) > 2).any(axis=2)


def test_engines_draw_the_same(tmp_path):
    """Instances and colours as each engine's own loader shows them; memory that moves between
    pools; the same triangles of the same pages in both engines."""
    write_instances(tmp_path / "source.glb")
    compress(tmp_path / "source.glb", tmp_path / "instances.glb", lod=True)
    decompress(tmp_path / "instances.glb", tmp_path / "plain.glb")
    write_two_layouts(tmp_path / "source.glb")
    compress(tmp_path / "source.glb", tmp_path / "layouts.glb", lod=True)
    view = "minx=-4;miny=-1;minz=-1;maxx=4;maxy=4;maxz=1"
    near = "minx=-1;miny=-1;minz=-1;maxx=1;maxy=1;maxz=1"
    instances, plain = f"instances.glb~pixels=0;{view}", f"plain.glb~plain=1;{view}"
    layouts = f"layouts.glb~maxBytes=2500000;pixels=0.2;{near}"
    results = {}
    shapes = {}
    for engine, page in PAGES.items():
        results[engine] = pictures("chrome", page, tmp_path, instances, plain, layouts)
        assert not any("error" in result for result in results[engine]), results[engine]
        assert share_that_differs(tmp_path, instances, plain) < 0.001
        shapes[engine] = [silhouette(tmp_path / f"{file}.png") for file in (instances, layouts)]
    for one, other in zip(*shapes.values()):
        assert 0.05 < one.mean() < 0.9
        assert (one != other).mean() < 0.0001
    for one, other in zip(*results.values()):
        assert one["triangles"] == other["triangles"]
        if one["statistics"]:
            for name in ("triangles", "threshold", "resident", "complete"):
                assert one["statistics"][name] == pytest.approx(other["statistics"][name], rel=1e-5)
    assert results["three"][2]["statistics"]["threshold"] > 0.2


@pytest.mark.parametrize(("browser", "engine"), [("chrome", "three"), ("firefox", "babylon")])
def test_picture_comes_back_after_a_lost_context(browser, engine, tmp_path):
    """Of WebGPU: after a lost device, by another renderer."""
    write_two_layouts(tmp_path / "source.glb")
    compress(tmp_path / "source.glb", tmp_path / "layouts.glb", lod=True)
    near = "layouts.glb~maxBytes=4000000;pixels=0.2;minx=-1;miny=-1;minz=-1;maxx=1;maxy=1;maxz=1"
    files = [f"{near}{renderer}" for renderer in RENDERERS[engine]]
    files += [f"{file};lose=1" for file in files]
    results = pictures(browser, PAGES[engine], tmp_path, *files)
    assert not any("error" in result for result in results), results
    half = len(files) // 2
    for kept, lost, one, other in zip(files, files[half:], results, results[half:]):
        assert one["triangles"] == other["triangles"] > 1000
        before, after = (silhouette(tmp_path / f"{file}.png") for file in (kept, lost))
        assert before.mean() > 0.05 and (before != after).mean() < 0.0001
        if engine == "three":  # Babylon.js loses the shading of its own loader's models, too
            assert share_that_differs(tmp_path, kept, lost) < 0.001


def test_babylon_shows_skins_packed_files_left_handed_scenes_and_frees_all(model, tmp_path):
    compress(model("nasty/CesiumMan_skinned.glb"), tmp_path / "skinned.glb", lod=True)
    decompress(tmp_path / "skinned.glb", tmp_path / "plain.glb")
    compress(model("bunny.glb"), tmp_path / "bunny.glb", lod=True, transport=True)
    decompress(tmp_path / "bunny.glb", tmp_path / "whole.glb")
    man = "distance=0.5;minx=-1;miny=0;minz=-1;maxx=1;maxy=1.5;maxz=1"
    ear = "left=1;pixels=0;minx=0;miny=0;minz=-0.1;maxx=0.1;maxy=0.2;maxz=0.1"
    files = [f"skinned.glb~{man}", f"plain.glb~{man};plain=1"]
    files += [f"bunny.glb~{ear}", f"whole.glb~{ear};plain=1", "bunny.glb~end=1"]
    results = pictures("chrome", PAGES["babylon"], tmp_path, *files)
    assert not any("error" in result for result in results), results
    for first, second in ((0, 1), (2, 3)):
        assert results[first]["triangles"] == results[second]["triangles"]
        assert share_that_differs(tmp_path, files[first], files[second]) < 0.001
    assert results[4]["left"] == {"meshes": 0, "geometries": 0, "materials": 0}


@pytest.mark.parametrize("browser", BROWSERS)
def test_flight_has_no_holes_and_keeps_the_budget(browser, tmp_path):
    noisy_ball(7, 0.002).export(tmp_path / "ball.glb")
    compress(tmp_path / "ball.glb", tmp_path / "model.glb", lod=True)
    budgets = (5_000_000, 5_000_000, 64_000_000)
    files = ["model.glb~5000000", "model.glb~5000000~webgpu", "model.glb~64000000"]
    results = pictures(browser, "tests/flight.html", tmp_path, *files)
    for budget, result in zip(budgets, results):
        assert "error" not in result, result["error"]
        assert result["holes"] == 0
        assert result["drawn"] > 40 * 20_000
        assert result["most"] <= budget
    # With WebGPU a copy of what is on the GPU counts, too.
    assert results[1]["threshold"] > results[0]["threshold"] > results[2]["threshold"] == 1
    assert results[1]["triangles"] < results[0]["triangles"] < results[2]["triangles"]
