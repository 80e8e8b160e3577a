"""Small pictures of models: they need meshes and nodes, nothing that only renderers read."""

import io

import numpy as np
import pytest
from PIL import Image, ImageFilter

from gltf_ext.batches.thumbnail import PIXELS, _medians, _weights, thumbnail
from gltf_ext.errors import MeshletError
from gltf_ext.sources.importers import open_model
from tests.helpers.gltf_builder import Builder, grid_mesh


def write_placed(path, **node):
    """A grid of one mesh whose node has more properties, and a camera without numbers."""
    builder = Builder()
    builder.mesh({"POSITION": grid_mesh(9, 9)[0]}, grid_mesh(9, 9)[1])
    builder.properties["cameras"] = [{"type": "perspective"}]
    builder.properties["nodes"] = [{"mesh": 0, **node}]
    return builder.write(path)


def test_a_camera_that_makes_no_picture_is_ignored(tmp_path):
    png = thumbnail(open_model(write_placed(tmp_path / "grid.glb", camera=0)))
    with Image.open(io.BytesIO(png)) as picture:
        assert picture.size == (PIXELS, PIXELS)
        assert picture.convert("LA").getextrema()[1] == (0, 255), "a model and a background"


def test_a_transform_that_is_too_large_is_refused(tmp_path):
    path = write_placed(tmp_path / "grid.glb", scale=[1e16, 1, 1])
    with pytest.raises(MeshletError, match="a node's transform is not finite, or larger"):
        thumbnail(open_model(path))


def test_medians_are_those_of_a_filter():
    picture = np.random.default_rng(1).integers(0, 256, (PIXELS, PIXELS), dtype=np.uint8)
    expected = np.asarray(Image.fromarray(picture).filter(ImageFilter.MedianFilter(3)))
    assert np.array_equal(_medians(picture)[1:-1, 1:-1], expected[1:-1, 1:-1])


def test_points_lie_in_their_triangles():
    weights = _weights(9000)
    assert np.array_equal(weights[:, :5000], _weights(5000)), "the first of the same points"
    assert weights.min() >= 0 and np.allclose(weights.sum(axis=0), 1)
    assert np.allclose(weights.mean(axis=1), 1 / 3, atol=0.01), "spread evenly"
