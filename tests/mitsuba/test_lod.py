"""lod_error: primitives at the detail that the camera needs."""

import json

import pytest

from gltf_meshlet.cli import main
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


def test_render_takes_an_error(tmp_path, capsys):
    picture = str(tmp_path / "picture.png")
    size = ["--width", "16", "--height", "16", "--spp", "1", "--json"]
    found = []
    for error in ([], ["--lod-error", "1e-6"], ["--lod-error", "1000"]):
        assert main(["render", str(LEVELS), "-o", picture, *size, *error]) == 0
        report = json.loads(capsys.readouterr().out)
        found.append((report["statistics"]["triangles"], report["mesh_triangles"]))
    assert found == [(192, 0), (0, 192), (0, 48)]
