"""gltf_ext.checks.samples: nearest points, and differences in normals and texture coordinates."""

import numpy as np
import pytest

from gltf_ext.checks.samples import (
    LEAST_SHADING,
    SurfacePoints,
    compare_surfaces,
    nearest_points,
    sample_surface,
    shading_differences,
    spread_by_area,
    surface_distances,
)
from gltf_ext.sources.primitives import Primitive
from tests.helpers.vulkan_scenes import ball


@pytest.fixture
def sphere() -> Primitive:
    """A unit sphere with its normals and texture coordinates that follow from the positions."""
    positions, triangles = ball(48, 32)
    attributes = {
        "POSITION": positions.astype(np.float32),
        "NORMAL": positions.astype(np.float32),
        "TEXCOORD_0": positions[:, :2].astype(np.float32),
    }
    return Primitive(0, 0, triangles.astype(np.uint32), attributes)


def changed(primitive: Primitive, **attributes: np.ndarray) -> Primitive:
    return Primitive(0, 0, primitive.indices, {**primitive.attributes, **attributes})


def test_a_surface_has_the_shading_of_itself(sphere):
    found = shading_differences(sphere, sphere, 500)
    assert found.keys() == {"NORMAL", "TEXCOORD_0"}
    assert found["NORMAL"].max() < 0.5 and found["TEXCOORD_0"].max() < 0.01


def test_turned_normals_and_moved_texcoords_are_found(sphere):
    """Normals turned by 10 degrees about z: those at the poles stay, those at the equator move."""
    turn = np.radians(10.0)
    rotation = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    normals = (sphere.attributes["NORMAL"] @ rotation.T).astype(np.float32)
    moved = (sphere.attributes["TEXCOORD_0"] + [0.3, 0.4]).astype(np.float32)
    found = shading_differences(changed(sphere, NORMAL=normals, TEXCOORD_0=moved), sphere, 2000)
    assert 9.5 < found["NORMAL"].max() < 10.5 and found["NORMAL"].min() < 2.0
    np.testing.assert_allclose(found["TEXCOORD_0"], 0.5, atol=0.02)


def test_surfaces_are_compared_at_once(sphere):
    """As by the functions for distances and for shading, which take all samples."""
    coarse = changed(sphere, POSITION=sphere.attributes["POSITION"] * np.float32(1.1))
    points = sample_surface(sphere, 2000)
    distances, shading = compare_surfaces(coarse, sphere, points, 2000)
    expected = surface_distances(sphere, coarse, 2000)
    np.testing.assert_allclose(np.sort(distances), np.sort(expected), atol=1e-6)
    all_samples = shading_differences(coarse, sphere, 2000)
    assert shading.keys() == all_samples.keys()
    for name, differences in shading.items():
        np.testing.assert_allclose(
            differences, all_samples[name][:: 2000 // LEAST_SHADING], atol=1e-9
        )


def test_nearest_points_lie_at_the_stated_distance(sphere):
    points = np.random.default_rng(1).uniform(-2, 2, (300, 3)).astype(np.float32)
    distances, points_on_it = nearest_points(points, sphere)
    assert (points_on_it.weights >= 0).all()
    np.testing.assert_allclose(points_on_it.weights.sum(axis=1), 1.0)
    apart = np.linalg.norm(points_on_it.of(sphere, "POSITION") - points, axis=1)
    np.testing.assert_allclose(apart, distances, atol=1e-5)


def test_places_spread_by_area(sphere):
    points_on_it = spread_by_area(sphere, 4000)
    assert abs(points_on_it.of(sphere, "POSITION").mean(axis=0)).max() < 0.05


def test_a_surface_without_area_has_one_place():
    point = Primitive(0, 0, np.zeros((2, 3), np.uint32), {"POSITION": np.ones((1, 3), np.float32)})
    points_on_it = spread_by_area(point, 100)
    assert isinstance(points_on_it, SurfacePoints) and len(points_on_it.triangle) == 1
    assert shading_differences(point, point, 100) == {}


def test_nearest_points_of_slivers_and_points():
    """Weights minimise the distance, on corners, edges and inside, of degenerate triangles too."""
    random = np.random.default_rng(2)
    positions = random.uniform(-1, 1, (300, 3)).astype(np.float32)
    positions[1] = positions[0]  # an edge of no length
    positions[3:6] = positions[3]  # a point
    positions[8] = 0.25 * positions[6] + 0.75 * positions[7]  # a line
    triangles = np.arange(300, dtype=np.uint32).reshape(-1, 3)
    steps = np.linspace(0, 1, 41)
    grid = np.array([(u, v, 1 - u - v) for u in steps for v in steps if u + v <= 1 + 1e-9])
    for number, triangle in enumerate(triangles):
        one = Primitive(0, 0, triangle[None], {"POSITION": positions})
        points = random.uniform(-2, 2, (20, 3)).astype(np.float32)
        _, points_on_it = nearest_points(points, one)
        assert (points_on_it.weights >= 0).all()
        apart = np.linalg.norm(points_on_it.of(one, "POSITION") - points, axis=1)
        tried = grid @ positions[triangle].astype(np.float64)
        best = np.linalg.norm(points[:, None] - tried[None], axis=2).min(axis=1)
        assert (apart <= best + 1e-6).all(), number
