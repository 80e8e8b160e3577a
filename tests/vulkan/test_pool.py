"""Path visibility with a pool of decoded meshlets draws the pictures that it draws without."""

from __future__ import annotations

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import TEXELS, ball, open_renderer, png

WIDTH, HEIGHT = 331, 257


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Balls behind a wall, behind thin bars and behind a sheet with holes; some sheets coincide."""
    from vk_backend.scene import load_scene

    builder = Builder()
    positions, triangles = ball(60, 36)
    gray = np.full((len(positions), 4), 0.5, np.float32)
    builder.mesh(
        {"POSITION": positions, "NORMAL": positions, "COLOR_0": gray}, triangles, material=0
    )
    sheet, cells = grid_mesh(40, 30)
    normals = np.tile(np.float32([0, 0, 1]), (len(sheet), 1))
    lying = {"POSITION": sheet, "NORMAL": normals}
    builder.mesh({**lying, "TEXCOORD_0": sheet[:, :2]}, cells, material=1)
    builder.mesh({**lying, "TEXCOORD_0": sheet[:, :2]}, cells, material=2)
    place, turned = np.random.default_rng(3), [0.2, 0.4, 0.1, 0.888819441]
    balls = [
        {"mesh": 0, "translation": [*(4 * place.random(2) - 2), -1 - 3 * float(place.random())]}
        | {"scale": ((0.1 + 0.5 * place.random(3)) * (-1, 1, 1)[number % 3]).tolist()}
        | {"rotation": turned}
        for number in range(14)
    ]
    bars = [{"mesh": 1, "translation": [x, -1, 0.5], "scale": [0.01, 2, 1]} for x in (-1.2, 0, 0.9)]
    wall = {"mesh": 1, "translation": [-2, -1, 0.0], "scale": [2.3, 1.4, 1]}
    holes = {"mesh": 2, "translation": [0.4, -0.7, 0.1], "scale": [1.4, 1.5, 1]}
    image = builder.view(png(TEXELS))
    builder.properties.update(
        images=[{"bufferView": image, "mimeType": "image/png"}],
        samplers=[{"magFilter": 9728}],
        textures=[{"source": 0, "sampler": 0}],
        materials=[
            {},
            {"doubleSided": True},
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "doubleSided": True,
                "alphaMode": "MASK",
            },
        ],
        nodes=[*balls, *bars, wall, wall, holes, holes],
        scenes=[{"nodes": list(range(len(balls) + 7))}],
    )
    folder = tmp_path_factory.mktemp("pool")
    gltf_ext.compress(builder.write(folder / "raw.glb"), folder / "hall.glb")
    return load_scene(folder / "hall.glb")


def flight():
    """Cameras from afar, past the wall, through balls, across the near plane; orthographic ones."""
    from vk_backend.camera import Camera

    eyes = [(2.5 * np.sin(t), 0.3 * t, 4 - 1.1 * t) for t in np.linspace(0, 5, 14)]
    eyes += [(0.0, 0.0, 0.03), (-0.5, -0.2, 0.2), (0.1, 0.1, 9.0), (0.1, 0.1, 9.0)]
    target = np.array([0.0, 0.0, -2.0])
    cameras = [
        Camera.look_at(np.array(eye), target, near=near, far=40.0, yfov=1.0)
        for eye, near in zip(eyes, [0.1, 0.01, 1e-3] * len(eyes))
    ]
    flat = [Camera(c.to_world, None, 2.5, 0.1, 40.0) for c in cameras[::5]]
    return [*cameras, *flat, *cameras[:2]]


@pytest.fixture
def drawn(renderer, scene):
    """Function that draws a camera with a pool of some bytes, and with occlusion or not."""

    def draw(camera, pool=None, occlusion=True, size=(WIDTH, HEIGHT), **options):
        renderer.pool, renderer.occlusion = pool, occlusion
        return renderer.render(scene, camera, "visibility", *size, **options)

    yield draw
    renderer.pool, renderer.occlusion = None, True


def assert_same(picture, reference):
    assert (picture.ids == reference.ids).all()
    assert (picture.depth == reference.depth).all()
    assert (picture.color == reference.color).all()


def test_what_is_hidden_changes_no_pixel(drawn):
    hidden = []
    for camera in flight():
        reference = drawn(camera)
        for occlusion in (True, False):
            picture = drawn(camera, 1 << 24, occlusion)
            assert_same(picture, reference)
            assert occlusion or picture.pool.hidden == 0
            hidden += [picture.pool.hidden] * occlusion
    # The first frame has no last one.
    assert hidden[0] == 0 and max(hidden) > 30 and np.count_nonzero(hidden) > 10


def test_a_camera_at_rest_decodes_nothing(drawn):
    camera = flight()[1]
    # The first frame hides nothing; the second begins with all of it, the third with what it saw.
    first, second, third, fourth = (drawn(camera, 1 << 23).pool for _ in range(4))
    assert first.decoded > second.decoded == third.decoded == fourth.decoded == 0
    assert first.hidden == second.hidden == 0 < third.hidden == fourth.hidden
    assert first.triangles == second.triangles > third.triangles == fourth.triangles
    moved = drawn(flight()[2], 1 << 23)
    assert moved.pool.decoded < first.decoded / 2


@pytest.mark.parametrize("slots", [2, 9, 40])
def test_a_pool_that_is_too_small_takes_several_passes(renderer, drawn, slots):
    from vk_backend.pooled import DecodedPool

    sizes = set()
    for camera in flight()[::4]:
        pool = (slots + 1) * DecodedPool.slot_bytes(renderer._scene)
        picture = drawn(camera, pool)
        assert renderer.drawing.ring.slots == slots + 1 and renderer.drawing._passes > 1
        sizes.add(renderer.resident_bytes)
        assert_same(picture, drawn(camera))
    assert len(sizes) == 1


def test_commands_can_run_again(renderer, scene, drawn):
    """What is kept, and what was visible, is on the device alone."""
    from vk_backend.frame_commands import FrameCommands

    camera = flight()[0]
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
        picture = drawn(flight()[0], 1 << 23, size=size)
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
    from vk_backend.errors import VulkanError

    with pytest.raises(VulkanError, match="holds no meshlet; use"):
        drawn(flight()[0], 1000)


def test_without_culling_nothing_is_hidden(drawn):
    camera = flight()[0]
    for _ in range(2):
        picture = drawn(camera, 1 << 22, culling=False)
        assert picture.pool.hidden == 0
    assert_same(picture, drawn(camera))
