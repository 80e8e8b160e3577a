"""Paths mesh and mesh-paper: what task shaders launch, what they hide, and limits of devices.

tests/vulkan/test_raster.py compares their pictures with those of other paths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gltf_ext.errors import MeshletError
from tests.helpers.culling import Bounds, Pyramid, hidden, in_view
from tests.helpers.vulkan_scenes import hall, hall_flight, open_renderer

SIZE = 331, 257
PATHS = ("mesh", "mesh-paper")


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from vk_backend.scene.scene import load_scene

    return load_scene(hall(tmp_path_factory.mktemp("mesh") / "hall.glb"))


@pytest.fixture
def drawn(renderer, scene, monkeypatch):
    """Function that draws a camera, with occlusion or not."""

    def draw(camera, path, occlusion=True, **options):
        monkeypatch.setattr(renderer, "occlusion", occlusion)
        return renderer.render(scene, camera, path, *SIZE, **options)

    return draw


def expected(renderer, scene, camera, depth=None):
    """Meshlets of all instances: (surely in view, possibly, surely hidden of these, possibly).

    depth: of the picture; None: nothing is hidden.
    """
    words = renderer.drawing.view.buffers.bounds.read(np.uint32)
    rows = renderer.drawing.view.buffers.primitives
    counts = np.zeros(4, int)
    for number, instance in enumerate(scene.instances):
        row = rows[instance.primitive]
        first, meshlets = int(row["first_meshlet"]), int(row["meshlets"])
        box = row["box_low"][:3], row["box_size"][:3]
        bounds = Bounds.of(words[first : first + meshlets], *box)
        surely, possibly = in_view(bounds, scene, number, camera, SIZE)
        counts[:2] += surely.sum(), possibly.sum()
        if depth is not None:
            matrix = camera.world_to_clip(*SIZE) @ instance.matrix
            behind, maybe = hidden(bounds, matrix, Pyramid(depth))
            counts[2:] += (behind & surely).sum(), (maybe & possibly).sum()
    return counts


def assert_same(picture, reference):
    """Of two surfaces at the same depth, either may be drawn; here they have one colour."""
    assert (picture.depth == reference.depth).all()
    assert np.abs(picture.color.astype(int) - reference.color).max() <= 2


def assert_rounded(picture, reference):
    """As tests/vulkan/test_raster.py compares paths; instances 17 and 18, 19 and 20 coincide."""
    assert (picture.covered == reference.covered).all()
    assert np.abs(picture.depth - reference.depth).max() <= 2e-5
    ids = [p.ids - (np.isin(p.ids, (18, 20)) & [True, False]) for p in (picture, reference)]
    different = (ids[0] != ids[1]).any(axis=2)
    assert different.mean() < 1e-3
    colors = np.abs(picture.color.astype(int) - reference.color)[~different]
    assert colors.max() <= 2


@pytest.mark.parametrize("path", PATHS)
def test_counters_are_those_of_the_cpu(renderer, scene, drawn, path):
    total = sum(scene.primitives[i.primitive].meshlets for i in scene.instances)
    exact, launched = 0, set()
    for camera in hall_flight():
        tasks = drawn(camera, path, occlusion=False).tasks
        surely, possibly, *_ = expected(renderer, scene, camera)
        assert tasks.tested == total and tasks.hidden == 0
        assert surely <= tasks.launched <= possibly
        exact += surely == possibly
        launched.add(tasks.launched)
        everything = drawn(camera, path, culling=False).tasks
        assert (everything.launched, everything.hidden) == (total, 0)
    assert exact > 12 and len(launched) > 12


@pytest.mark.parametrize("path", PATHS)
def test_hidden_meshlets_are_those_of_the_cpu(renderer, scene, drawn, path):
    """Of a camera at rest: then the first phase draws the whole picture."""
    exact, most = 0, 0
    for camera in hall_flight()[::2]:
        for _ in range(4):
            picture = drawn(camera, path)
        surely, possibly, behind, maybe = expected(renderer, scene, camera, picture.depth)
        tasks = picture.tasks
        assert surely <= tasks.launched + tasks.hidden <= possibly
        assert behind <= tasks.hidden <= maybe
        exact += behind == maybe and surely == possibly
        most = max(most, tasks.hidden)
    assert exact > 5 and most > 30


@pytest.mark.parametrize("path", PATHS)
def test_what_is_hidden_changes_no_pixel(renderer, drawn, path, monkeypatch):
    monkeypatch.setattr(renderer, "_drawings", {})
    counts = []
    for camera in hall_flight():
        reference = drawn(camera, path, occlusion=False)
        picture = drawn(camera, path)
        assert_same(picture, reference)
        assert picture.tasks.launched + picture.tasks.hidden == reference.tasks.launched
        counts.append(picture.tasks.hidden)
        if len(counts) % 4 == 0:
            assert_rounded(picture, drawn(camera, "vertex"))
    # The first frame has no last one: it hides nothing.
    assert counts[0] == 0 and np.count_nonzero(counts) > 10 and max(counts) > 30


@pytest.mark.parametrize("path", PATHS)
def test_shared_hints_change_no_pixel(renderer, scene, drawn, path, monkeypatch):
    """As with more meshlets than hints."""
    from vk_backend.raster import mesh

    references = [drawn(camera, path, occlusion=False) for camera in hall_flight()[:8]]
    monkeypatch.setattr(mesh, "HINTS", 64)
    monkeypatch.setattr(renderer, "_drawings", {})
    for camera, reference in zip(hall_flight()[:8], references):
        assert_same(drawn(camera, path), reference)
        assert renderer.drawing.hints == 64


def test_commands_can_run_again(renderer, drawn):
    """What was visible is on the device alone."""
    from vk_backend.frame_commands import FrameCommands

    camera = hall_flight()[1]
    for _ in range(3):
        reference = drawn(camera, "mesh")
    frame = FrameCommands(renderer.drawing, renderer._targets, steps=True)
    for _ in range(3):
        assert set(frame.run_steps()) == {"draw", "occlusion"}
        assert renderer.drawing.tasks == reference.tasks
    frame.free()
    assert (renderer._targets.depth.read(np.float32, 1)[..., 0] == reference.depth).all()


@pytest.mark.parametrize("size", [(331, 257), (64, 128), (1, 1), (130, 3)])
def test_the_pyramid_has_the_farthest_depths(renderer, scene, size):
    camera = hall_flight()[0]
    for _ in range(3):  # the first phase draws all that is visible
        picture = renderer.render(scene, camera, "mesh", *size)
    found = renderer._targets.pixels.read(np.float32)
    count = size[0] * size[1]
    assert (found[:count].reshape(picture.depth.shape) == picture.depth).all()
    levels = np.concatenate([level.ravel() for level in Pyramid(picture.depth).levels])
    assert (found[count:] == levels).all()


# --- limits of devices ---


def test_a_small_payload_is_refused(renderer, drawn, monkeypatch):
    limits = renderer.device.limits
    monkeypatch.setattr(renderer, "_drawings", {})
    monkeypatch.setattr(renderer.device, "limits", replace(limits, task_payload_bytes=2403))
    with pytest.raises(MeshletError, match=r"mesh-paper passes 2404 bytes .* at most 2403; choose"):
        drawn(hall_flight()[0], "mesh-paper")
    assert drawn(hall_flight()[0], "mesh").covered.any()


def test_the_payload_takes_room_from_the_team(renderer, scene, drawn, monkeypatch):
    from vk_backend.scene.buffers import team_bytes

    needed = team_bytes(scene.max_elements, scene.max_streams)
    monkeypatch.setattr(renderer, "_drawings", {})
    limits = replace(renderer.device.limits, mesh_total_bytes=needed + 132)
    monkeypatch.setattr(renderer.device, "limits", limits)
    with pytest.raises(MeshletError, match="too many for path mesh-paper"):
        drawn(hall_flight()[0], "mesh-paper")
    assert drawn(hall_flight()[0], "mesh").covered.any()


def test_every_device_has_room_for_the_payloads():
    """The least that VK_EXT_mesh_shader allows, for vertices of a dozen elements."""
    from vk_backend.raster.mesh import MESH_PATHS
    from vk_backend.scene.buffers import team_bytes

    for path in MESH_PATHS:
        assert path.payload <= 16384 and path.payload + team_bytes(12, 8) <= 28672
