"""bench.models and bench.vulkan_raster: subdivided models, memory and ratios."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

import gltf_ext
from bench import common, generated, models, vulkan_decode, vulkan_raster, vulkan_raytracing, webgpu
from bench.generated import torus
from gltf_meshlet.demo.model import write_glb
from tests.helpers.vulkan_scenes import ball, zoo
from vk_backend.scene import load_scene


def test_triangles_cut_into_four_lie_on_the_same_surface():
    positions, triangles = ball(16, 10)
    points, fine = generated.cut_into_four(positions.astype(float), triangles.astype(np.int64))
    edges = {tuple(sorted(e)) for t in triangles.tolist() for e in zip(t, t[1:] + t[:1])}
    assert fine.shape == (4 * len(triangles), 3) and len(points) == len(positions) + len(edges)

    def area(corners):
        sides = corners[:, 1:] - corners[:, :1]
        return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()

    np.testing.assert_allclose(area(points[fine]), area(positions[triangles]), rtol=1e-5)
    normals = generated.vertex_normals(points, fine)
    assert ((normals * points).sum(axis=1) > 0.8).all()


def test_models_are_compressed_and_subdivided(tmp_path):
    write_glb([torus(300)], tmp_path / "torus.glb")
    options = argparse.Namespace(
        models=[tmp_path / "torus.glb"], subdivide=[tmp_path / "torus.glb"]
    )
    (tmp_path / "made").mkdir()
    plain, fine = models.model_files(options, tmp_path / "made")
    assert [path.name for path in (plain, fine)] == ["torus.glb", "torus_x4.glb"]
    assert (
        gltf_ext.inspect(fine)["totals"]["triangles"]
        == 4 * gltf_ext.inspect(plain)["totals"]["triangles"]
    )


@pytest.mark.parametrize("module", [vulkan_decode, vulkan_raster, vulkan_raytracing, webgpu])
def test_a_measurement_without_models_ends_before_it_begins(module):
    with pytest.raises(SystemExit, match=r"^bench: name at least one model$"):
        common.answer(module, [])


def test_webgpu_runs_the_dispatches_of_the_package():
    text = (common.ROOT / "web" / "webgpu.js").read_text()
    for name, steps in {"FIRST =": webgpu.FIRST, **webgpu.METHODS}.items():
        listed = ", ".join(f"{shader}: {meshlets}" for shader, meshlets in steps.items())
        assert f"{name if '=' in name else name + ':'} {{ {listed} }}" in text
    for name in ("SPLIT", "PASSES"):
        listed = ", ".join(f"'{shader}'" for shader in getattr(webgpu, name))
        assert f"const {name} = [{listed}];" in text
    assert f"const SPREAD = {webgpu.SPREAD};" in text
    assert f"const INTERIOR_ELEMENTS = {webgpu.INTERIOR_ELEMENTS};" in text


def test_short_indices_of_a_small_model_need_no_cut(tmp_path):
    scene = load_scene(zoo(tmp_path / "zoo.glb"))
    vertices, triangles = (
        sum(getattr(p, name) for p in scene.primitives) for name in ("vertices", "triangles")
    )
    assert (
        vulkan_raster.vertex_bytes_with_short_indices(scene)
        == 4 * scene.vertex_floats * vertices + 6 * triangles
    )


def test_ratios_are_of_medians_in_one_run():
    def row(path, median):
        return {
            "model": "m",
            "culling": False,
            "path": path,
            "milliseconds": {"median": median},
            "resident_bytes": 130_000,
            "compressed_bytes": 100_000,
        }

    rows = [row("vertex", 1.0), row("mesh-plain", 2.0), row("mesh", 3.0), row("geometry", 9.0)]
    assert vulkan_raster.ratios(rows) == [
        {
            "model": "m",
            "culling": False,
            "mesh/mesh-plain": 1.5,
            "mesh/vertex": 3.0,
            "mesh/geometry": 0.333,
            "resident/limit": 0.762,
        }
    ]
    assert vulkan_raster.percentiles(range(11)) == {"median": 5.0, "low": 1.0, "high": 9.0}
