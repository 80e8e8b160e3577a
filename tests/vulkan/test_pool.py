"""Path visibility with a pool of decoded meshlets draws the pictures that it draws without."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import hall, hall_flight, open_renderer

WIDTH, HEIGHT = 331, 257


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from vk_backend.scene.scene import load_scene

    return load_scene(hall(tmp_path_factory.mktemp("pool") / "hall.glb"))


@pytest.fixture
def drawn(renderer, scene):
    """Function that draws a camera with a pool of some bytes, and with occlusion or not."""

    def draw(camera, pool=None, occlusion=True, size=(WIDTH, HEIGHT), **options):
        renderer.cache, renderer.occlusion = pool, occlusion
        return renderer.render(scene, camera, "visibility", *size, **options)

    yield draw
    renderer.cache, renderer.occlusion = None, True


def assert_same(picture, reference):
    assert (picture.ids == reference.ids).all()
    assert (picture.depth == reference.depth).all()
    assert (picture.color == reference.color).all()


def test_what_is_hidden_changes_no_pixel(drawn):
    hidden = []
    for camera in hall_flight():
        reference = drawn(camera)
        for occlusion in (True, False):
            picture = drawn(camera, 1 << 24, occlusion)
            assert_same(picture, reference)
            assert occlusion or picture.pool.hidden == 0
            hidden += [picture.pool.hidden] * occlusion
    # The first frame has no last one.
    assert hidden[0] == 0 and max(hidden) > 30 and np.count_nonzero(hidden) > 10


def test_a_camera_at_rest_decodes_nothing(drawn):
    camera = hall_flight()[1]
    # The first frame hides nothing; the second begins with all of it, the third with what it saw.
    first, second, third, fourth = (drawn(camera, 1 << 23).pool for _ in range(4))
    assert first.decoded > second.decoded == third.decoded == fourth.decoded == 0
    assert first.hidden == second.hidden == 0 < third.hidden == fourth.hidden
    assert first.triangles == second.triangles > third.triangles == fourth.triangles
    moved = drawn(hall_flight()[2], 1 << 23)
    assert moved.pool.decoded < first.decoded / 2


@pytest.mark.parametrize("slots", [2, 9, 40])
def test_a_pool_that_is_too_small_takes_several_passes(renderer, scene, drawn, slots):
    from vk_backend.visibility.pooled import slot_bytes

    sizes = set()
    for camera in hall_flight()[::4]:
        pool = (slots + 1) * slot_bytes(scene)
        picture = drawn(camera, pool)
        assert renderer.drawing.slots == slots and renderer.drawing.passes > 1
        sizes.add(renderer.resident_bytes)
        assert_same(picture, drawn(camera))
    assert len(sizes) == 1


def test_commands_can_run_again(renderer, scene, drawn):
    """What is kept, and what was visible, is on the device alone."""
    from vk_backend.frame_commands import FrameCommands

    camera = hall_flight()[0]
    for _ in range(2):
        reference = drawn(camera, 1 << 22)
    drawing = renderer.drawing
    frame = FrameCommands(drawing, renderer._targets, steps=True)
    for _ in range(3):
        assert set(frame.run_steps()) == {
            *("clear", "cull", "decode", "small", "pieces", "occlusion", "resolve")
        }
        assert drawing.statistics.decoded == 0 < drawing.statistics.hidden
    frame.free()
    assert (renderer._targets.depth.read(np.float32, 1)[..., 0] == reference.depth).all()


@pytest.mark.parametrize("size", [(WIDTH, HEIGHT), (64, 128), (1, 1), (130, 3)])
def test_the_pyramid_has_the_farthest_depths(renderer, drawn, size):
    for _ in range(2):  # the second frame draws all in its first phase
        picture = drawn(hall_flight()[0], 1 << 23, size=size)
    tiles = -(-size[0] // 64), -(-size[1] // 64)
    offset = 8 * size[0] * size[1]
    found = renderer._targets.pixels.buffer.read(np.float32, offset=offset)
    depth = np.zeros((64 * tiles[1], 64 * tiles[0]), np.float32)
    depth[: size[1], : size[0]] = picture.depth
    for side in (4, 8, 16, 32, 64):
        level = depth.reshape(64 * tiles[1] // side, side, -1, side).max(axis=(1, 3)).ravel()
        assert (found[: len(level)] == level).all()
        found = found[len(level) :]
    assert len(found) == 0


def test_a_pool_needs_a_slot(drawn):
    from vk_backend.gpu.errors import VulkanError

    with pytest.raises(VulkanError, match="holds no meshlet; use"):
        drawn(hall_flight()[0], 1000)


def test_without_culling_nothing_is_hidden(drawn):
    camera = hall_flight()[0]
    for _ in range(2):
        picture = drawn(camera, 1 << 22, culling=False)
        assert picture.pool.hidden == 0
    assert_same(picture, drawn(camera))


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_share_is_that_of_the_slots(tmp_path, share):
    """In each path's bytes, and besides the spare slot, which the smallest model needs too."""
    from vk_backend.decode.decoder import Decoder
    from vk_backend.decode.slots import SlotLayout, slots_in
    from vk_backend.renderer import cache_bytes
    from vk_backend.scene.scene import load_scene
    from vk_backend.visibility.pooled import slot_bytes

    for side in (2, 40):
        positions, triangles = grid_mesh(side, side)
        builder = Builder()
        builder.mesh({"POSITION": positions}, triangles)
        gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb")
        scene = load_scene(tmp_path / "out.glb")
        slots = math.ceil(share * sum(p.meshlets for p in scene.primitives))
        for path, bytes_, spare in (
            ("visibility", slot_bytes(scene), 1),
            ("stream", Decoder.slot_bytes(scene), 0),
            ("rt", SlotLayout.of(scene, traced=True).bytes, 0),
        ):
            assert slots_in(cache_bytes(scene, path, share), bytes_, spare) == slots, path
