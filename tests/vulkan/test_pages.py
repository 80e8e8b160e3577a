"""Files with pages: the same pictures and ids as one blob per primitive, on every path."""

from __future__ import annotations

import numpy as np
import pytest

import gltf_ext
from tests.helpers.environment import missing
from tests.helpers.vulkan_scenes import BITS, open_renderer, zoo

WIDTH, HEIGHT = 160, 120
NO_ID = 0xFFFFFFFF
PAGE = 4096
DEPTH_ROUNDING = 2e-5  # a triangle's first corner is another one
COLOR_ROUNDING = 2  # of 255


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """(one blob per primitive, pages) of the same model."""
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene.scene import load_scene

    folder = tmp_path_factory.mktemp("pages")
    one = zoo(folder / "zoo.glb")
    gltf_ext.compress(folder / "raw_zoo.glb", folder / "pages.glb", page_bytes=PAGE, **BITS)
    return load_scene(one), load_scene(folder / "pages.glb")


def shown_corners(scene, ids: np.ndarray) -> np.ndarray:
    """float32[pixels, 9]: the corners of each pixel's triangle in one order, by its whole id."""
    result = np.zeros((*ids.shape[:2], 9), np.float32)
    whole: dict[int, list[int]] = {}  # instance -> primitives of its pages
    for instance in scene.instances:
        if instance.page == 0:
            whole[len(whole)] = []
        whole[len(whole) - 1].append(instance.primitive)
    for number, pages in whole.items():
        corners, names, first = [], [], 0
        for page in pages:
            decoded = scene.primitives[page].decoded()
            corners.append(decoded.positions[decoded.triangles])
            names.append(decoded.ids() + 64 * first)
            first += len(decoded.meshlet_triangles)
        rows, known = np.concatenate(corners), np.concatenate(names)
        order = np.lexsort(rows.transpose(2, 0, 1), axis=-1)
        rows = np.take_along_axis(rows, order[..., None], axis=1).reshape(-1, 9)
        mine = ids[..., 0] == number
        at = np.searchsorted(known, ids[mine, 1])
        np.testing.assert_array_equal(known[at], ids[mine, 1])
        result[mine] = rows[at]
    return result


def test_primitives_and_instances(scenes):
    one, pages = scenes
    assert len(pages.primitives) > len(one.primitives) == 2
    assert [i.page for i in one.instances] == [0] * 4
    assert sum(i.page == 0 for i in pages.instances) == 4
    assert pages.triangles == one.triangles
    meshlets = [0, 0]
    for instance in pages.instances:
        primitive = pages.primitives[instance.primitive]
        assert primitive.first_meshlet == (meshlets[-1] if instance.page else 0)
        meshlets.append(primitive.first_meshlet + primitive.meshlets)
    np.testing.assert_allclose([pages.low, pages.high], [one.low, one.high])


@pytest.mark.parametrize(
    "path", ["vertex", "mesh", "mesh-paper", "stream", "visibility", "geometry"]
)
def test_pictures_and_ids(renderer, scenes, path):
    one, pages = scenes
    camera = one.cameras[0]
    expected, found = (renderer.render(s, camera, path, WIDTH, HEIGHT) for s in (one, pages))
    np.testing.assert_array_equal(found.covered, expected.covered)
    assert set(np.unique(found.ids[found.covered][:, 0])) == {0, 1, 2, 3}
    assert (found.ids[~found.covered] == NO_ID).all()
    np.testing.assert_array_equal(found.ids[..., 0], expected.ids[..., 0])
    np.testing.assert_array_equal(shown_corners(pages, found.ids), shown_corners(one, expected.ids))
    assert np.abs(found.depth - expected.depth).max() <= DEPTH_ROUNDING
    assert np.abs(found.color.astype(int) - expected.color).max() <= COLOR_ROUNDING


@pytest.mark.parametrize("path", ["mesh", "mesh-paper", "stream", "geometry"])
def test_paths_agree_bit_for_bit(renderer, scenes, path):
    _, pages = scenes
    camera = pages.cameras[0]
    expected = renderer.render(pages, camera, "vertex", WIDTH, HEIGHT)
    found = renderer.render(pages, camera, path, WIDTH, HEIGHT)
    np.testing.assert_array_equal(found.ids, expected.ids)
    assert np.abs(found.color.astype(int) - expected.color).max() <= COLOR_ROUNDING


@pytest.mark.parametrize("cache", [0.25, 1.0])
def test_rays(renderer, scenes, cache):
    if "raytracing" not in renderer.device.capabilities:
        missing(f"{renderer.device.name} has no VK_KHR_ray_tracing_pipeline")
    from vk_backend.raytrace.tracer import RayTracer
    from vk_backend.renderer import cache_bytes

    one, pages = scenes
    pictures = []
    for scene in scenes:
        traced = RayTracer(renderer.device, scene, cache=cache_bytes(scene, "rt", cache))
        pictures.append(traced.render(one.cameras[0], WIDTH, HEIGHT))
        traced.free()
    expected, found = pictures
    assert (expected.ids[..., 0] != NO_ID).any()
    np.testing.assert_array_equal(found.ids[..., 0], expected.ids[..., 0])
    np.testing.assert_array_equal(shown_corners(pages, found.ids), shown_corners(one, expected.ids))
    np.testing.assert_allclose(found.t, expected.t, rtol=1e-6)
    assert np.abs(found.color.astype(int) - expected.color).max() <= COLOR_ROUNDING
