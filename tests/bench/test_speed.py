"""bench.speed and bench.parameters measure what compress does; generated models are closed."""

import numpy as np
import pytest

import gltf_ext
from bench import parameters, speed
from bench.common import BITS
from bench.generated import torus
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from gltf_meshlet.demo.model import write_glb


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "torus.glb"
    write_glb([torus(3000)], path)
    return path


def blobs(path):
    return [compressed.blob for compressed in require_compressed(open_model(path))]


def test_what_is_timed_is_what_compress_writes(small, tmp_path):
    gltf_ext.compress(small, tmp_path / "out.glb", **BITS)
    assert speed.encode_ours(gltf_ext.load(small), 1) == blobs(tmp_path / "out.glb")


def test_the_command_is_timed(small, tmp_path):
    measured = speed.measure_command(small, tmp_path, repetitions=1)
    assert measured["seconds"]["median"] > 0 and measured["peak_bytes"] > 1e6


def test_parameters_names_the_default_of_the_encoder(small, tmp_path):
    gltf_ext.compress(small, tmp_path / "default.glb")
    gltf_ext.compress(small, tmp_path / "named.glb", lambda_=parameters.DEFAULTS["lambda_"])
    assert blobs(tmp_path / "default.glb") == blobs(tmp_path / "named.glb")


@pytest.mark.parametrize("option", parameters.VALUES)
def test_parameters_measures_the_defaults_too(option):
    assert parameters.DEFAULTS[option] in parameters.VALUES[option]


# --- the generated model ---


@pytest.mark.parametrize("triangles", [64, 1000, 20_000])
def test_torus_is_closed_and_about_as_large_as_asked_for(triangles):
    part = torus(triangles)
    assert abs(len(part.triangles) - triangles) < 0.15 * triangles
    ids = np.unique(part.positions, axis=0, return_inverse=True)[1].reshape(-1)
    corners = ids[part.triangles]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}


def test_torus_normals_point_out_of_its_triangles():
    part = torus(20_000)
    a, b, c = (part.positions[part.triangles[:, k]].astype(float) for k in range(3))
    faces = np.cross(b - a, c - a)
    assert (np.sum(faces * part.normals[part.triangles].mean(axis=1), axis=1) > 0).mean() > 0.99
    assert np.allclose(np.linalg.norm(part.normals, axis=1), 1, atol=1e-5)
    assert part.texcoords.min() > -1 and part.texcoords.max() < 2
