"""Python and renderers read levels beyond 4 GiB; tests/web/test_stream.py streams them."""

import pytest

import gltf_ext
from gltf_meshlet import cli
from tests.helpers import environment
from tests.helpers.environment import ROOT
from tests.helpers.large import moved_beyond_4_gib
from tests.helpers.vulkan_scenes import require_vulkan

NEAR = ROOT / "spec" / "lod_vectors" / "lod_levels.glb"


@pytest.fixture
def far(tmp_path):
    return moved_beyond_4_gib(NEAR, tmp_path)


def test_python(far, tmp_path):
    assert gltf_ext.validate(far) == []
    assert gltf_ext.verify(NEAR, far)["ok"]
    near, found = gltf_ext.inspect(NEAR), gltf_ext.inspect(far)
    assert (found["totals"], found["lod"]) == (near["totals"], near["lod"])
    for options in ({}, {"level": 1}, {"error": 1000.0}):
        for source, name in ((NEAR, "near.glb"), (far, "far.glb")):
            gltf_ext.decompress(source, tmp_path / name, **options)
        assert (tmp_path / "far.glb").read_bytes() == (tmp_path / "near.glb").read_bytes()


@pytest.mark.parametrize(
    "options",
    [
        pytest.param(("--backend", "mitsuba", "--spp", "1"), id="mitsuba"),
        pytest.param(("--backend", "vulkan", "--pages", "1M"), id="vulkan"),
    ],
)
def test_renderers(far, tmp_path, options):
    if "vulkan" in options:
        require_vulkan()
    else:
        environment.need_package("mitsuba")

    def picture(source, error):
        output = tmp_path / "picture.png"
        size = ("--width", "32", "--height", "32", "--lod-error", error)
        assert cli.main(["render", str(source), "-o", str(output), *size, *options]) == 0
        return output.read_bytes()

    fine, coarse = picture(NEAR, "1e-6"), picture(NEAR, "1000")
    assert fine != coarse
    assert (picture(far, "1e-6"), picture(far, "1000")) == (fine, coarse)
