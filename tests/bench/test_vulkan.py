"""bench.models and bench.vulkan_raster: subdivided models, and percentiles."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

import gltf_ext
from bench import common, models, vulkan_decode, vulkan_raster, vulkan_raytracing
from bench.generated import torus
from bench.large_model import write_displaced
from gltf_meshlet.demo.model import write_glb


def test_subdivided_triangles_lie_on_the_same_surface(tmp_path):
    write_glb([torus(300)], tmp_path / "torus.glb")
    (before,) = gltf_ext.load(tmp_path / "torus.glb")
    write_displaced(tmp_path / "torus.glb", 2, tmp_path / "fine.glb", noise=0.0)
    (fine,) = gltf_ext.load(tmp_path / "fine.glb")
    assert len(fine.indices) == 4 * len(before.indices)

    def areas(mesh):
        a, b, c = mesh.attributes["POSITION"][mesh.indices].transpose(1, 0, 2).astype(float)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1)

    np.testing.assert_allclose(areas(fine).sum(), areas(before).sum(), rtol=1e-5)


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


@pytest.mark.parametrize("module", [vulkan_decode, vulkan_raster, vulkan_raytracing])
def test_a_measurement_without_models_ends_before_it_begins(module):
    with pytest.raises(SystemExit, match=r"^bench: name at least one model$"):
        common.answer(module, [])


def test_floor_and_ceiling_face_each_other(tmp_path):
    (mesh,) = gltf_ext.load(vulkan_raster.ground(tmp_path))
    a, b, c = mesh.attributes["POSITION"][mesh.indices].transpose(1, 0, 2).astype(float)
    assert len(a) == 4 and (np.cross(b - a, c - a)[:, 1] * a[:, 1] < 0).all()


def test_frames_are_given_by_percentiles():
    assert vulkan_raster.percentiles(range(11)) == {"median": 5.0, "low": 1.0, "high": 9.0}
