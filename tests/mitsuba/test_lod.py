"""lod_error: primitives at the detail that the camera needs."""

import pytest

from spec.make_lod_vectors import FOLDER
from tests.helpers import environment

LEVELS = FOLDER / "lod_levels.glb"  # 192, 96 and 48 triangles


@pytest.fixture(scope="module", autouse=True)
def variant():
    environment.need_package("mitsuba").set_variant("scalar_rgb")


def triangles(**options):
    import mitsuba_plugin

    scene = mitsuba_plugin.load_scene(LEVELS, width=100, height=100, **options)
    return [shape.face_count() for shape in scene.shapes() if shape.is_mesh()]


def test_more_pixels_of_error_mean_fewer_triangles():
    found = [triangles(lod_error=error)[0] for error in (1e-6, 2.0, 1000.0)]
    assert found[0] == 192 and found[-1] == 48
    assert found == sorted(found, reverse=True)


def test_without_it_the_shape_stays_compressed():
    assert triangles() == [] and triangles(lod_error=0.0) == []
