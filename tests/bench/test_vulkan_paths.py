"""bench.vulkan_paths: the paths for comparison show what vk_backend's show."""

from __future__ import annotations

import os

# See tests/vulkan/test_raytracing.py.
os.environ.setdefault("GALLIVM_PERF", "nopt")

import numpy as np
import pytest

from tests.helpers.rays import (
    HEIGHT,
    NO_HIT,
    WIDTH,
    assert_same_hits,
    broken_scene,
    camera_of,
    mitsuba_hits,
    nearest_hits,
    open_device,
    several,
    transparent,
)
from tests.helpers.vulkan_scenes import open_renderer, zoo

TRACERS = {"rt-paper": {"cache": 0.25}, "rt-triangles": {}}


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene.scene import load_scene

    return load_scene(zoo(tmp_path_factory.mktemp("zoo") / "zoo.glb"))


@pytest.fixture(scope="module")
def device():
    yield from open_device()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene.scene import load_scene

    return load_scene(several(tmp_path_factory.mktemp("scene")))


@pytest.fixture(scope="module")
def expected(scene):
    return nearest_hits(scene, camera_of(scene))


def tracer(device, scene, path, *, cache: float = 0.25, **options):
    """cache: share of the decoded meshlets."""
    from bench.vulkan_paths import TRACERS
    from vk_backend.renderer import cache_bytes

    bytes_ = cache_bytes(scene, "rt", cache)
    return TRACERS[path](device, scene, cache=bytes_, **options)


# --- raster paths ---


def test_plain_meshlets_hold_the_same_triangles(drawn):
    from bench.vulkan_paths import plain_meshlets

    for primitive in drawn.primitives:
        decoded = primitive.decoded()
        rows, words = plain_meshlets(decoded)
        triangles = []
        for row, count in zip(rows, decoded.meshlet_triangles):
            vertices, own = int(row["counts"]) & 255, int(row["counts"]) >> 8
            assert own == count <= 64 and vertices <= 64
            local = words[int(row["first"]) + vertices :][:own]
            corners = np.stack([local & 255, local >> 8 & 255, local >> 16], axis=1)
            triangles.append(words[int(row["first"]) :][:vertices][corners])
        assert (np.concatenate(triangles) == decoded.triangles).all()
        assert (np.diff(decoded.ids().astype(np.int64)) > 0).all()


def test_timed_pictures_are_those_of_the_renderer(renderer, drawn):
    from bench.vulkan_paths import POOLED, RASTER_PATHS, TimedDrawing

    camera = drawn.cameras[0]
    whole = renderer.render(drawn, camera, "vertex", WIDTH, HEIGHT, ids=False)
    pictures = [(whole.color.astype(int), whole.depth)]
    for path in RASTER_PATHS:
        cache = 1 << 20 if path in (POOLED, "stream") else None
        timed = TimedDrawing(renderer.device, drawn, camera, path, WIDTH, HEIGHT, cache=cache)
        assert timed.run() > 0 and timed.run() > 0
        targets = timed.targets
        color, depth = targets.color.read(np.uint8, 4), targets.depth.read(np.float32, 1)[..., 0]
        pictures.append((color.astype(int), depth))
        timed.free()
    for color, depth in pictures[1:]:
        assert np.abs(depth - pictures[0][1]).max() <= 2e-5, "rounding"
        assert (np.abs(color - pictures[0][0]).max(axis=2) > 2).mean() < 1e-2


@pytest.mark.parametrize("overlap", [False, True])
def test_a_timed_frame_can_be_run_again(renderer, drawn, overlap, monkeypatch):
    from bench.vulkan_paths import TimedDrawing
    from vk_backend.decode.decoder import Decoder

    if overlap:
        monkeypatch.setattr("vk_backend.raster.stream.OVERLAPPED", 0)
    cache = 20 * Decoder.slot_bytes(drawn)
    registered = []
    for _ in range(2):
        timed = TimedDrawing(
            renderer.device, drawn, drawn.cameras[0], "stream", WIDTH, HEIGHT, cache=cache
        )
        assert len(timed.drawing.batches) > 4
        assert timed.run() > 0 and timed.run() > 0
        found = timed.targets.color.read(np.uint8, 4)
        timed.free()
        registered.append(len(renderer.device._closing))
    assert registered[0] == registered[1], "everything but pipelines is freed"
    whole = renderer.render(drawn, drawn.cameras[0], "stream", WIDTH, HEIGHT, ids=False)
    assert (found == whole.color).all()


def test_ids_of_uncompressed_meshlets(renderer, drawn, monkeypatch):
    """In several draws: a draw has at most MAX_WORKGROUPS workgroups."""
    from bench.vulkan_paths import PlainDrawing
    from vk_backend.frame_commands import FrameCommands
    from vk_backend.gpu.targets import Targets

    monkeypatch.setattr("vk_backend.raster.graphics.MAX_WORKGROUPS", 1)
    targets = Targets(renderer.device, WIDTH, HEIGHT, ids=True)
    drawing = PlainDrawing(renderer.device, drawn)
    drawing.look(drawn.cameras[0], WIDTH, HEIGHT)
    FrameCommands(drawing, targets).run()
    whole = renderer.render(drawn, drawn.cameras[0], "mesh", WIDTH, HEIGHT)
    assert (targets.ids.read(np.uint32, 2) == whole.ids).all()
    assert drawing.resident_bytes > 0
    drawing.free()
    targets.free()


# --- ray tracing ---


@pytest.mark.parametrize("path", TRACERS)
def test_hits(path, device, scene, expected):
    traced = tracer(device, scene, path, **TRACERS[path])
    for _ in range(2):  # with the initial cache, and with one updated from the first frame
        assert_same_hits(traced.render(camera_of(scene), WIDTH, HEIGHT), expected, scene)
    traced.free()


def test_paper_hits_what_mitsuba_hits(device, scene):
    traced = tracer(device, scene, "rt-paper", cache=0.25)
    picture = traced.render(camera_of(scene), WIDTH, HEIGHT)
    assert_same_hits(picture, mitsuba_hits(scene, camera_of(scene)), scene)
    traced.free()


def test_paper_without_a_cache(device, scene, expected):
    """Rays of rt-paper need no slot."""
    traced = tracer(device, scene, "rt-paper", cache=0.0)
    assert traced.slots == 0
    assert_same_hits(traced.render(camera_of(scene), WIDTH, HEIGHT), expected, scene)
    traced.free()


def test_paper_keeps_what_most_rays_tested(device, scene):
    traced = tracer(device, scene, "rt-paper", cache=0.3)
    traced.time(camera_of(scene, 2.0), WIDTH, HEIGHT)
    counts = traced.cached()["tests"]
    traced.time(camera_of(scene), WIDTH, HEIGHT)
    held = traced.cached()["slot"] < traced.slots
    assert held.sum() == traced.slots < np.count_nonzero(counts)
    assert counts[held].min() >= counts[~held].max() > 0
    traced.free()


def test_paper_and_hostile_blobs(device, scene):
    traced = tracer(device, broken_scene(scene), "rt-paper", bounces=1, samples=1, cache=0.25)
    for _ in range(2):
        picture = traced.render(camera_of(scene), 16, 12)
        assert picture.color.shape == (12, 16, 4) and len(np.unique(picture.ids[..., 0])) > 2
    traced.free()


@pytest.mark.parametrize("mode", ("MASK", "BLEND"))
def test_transparent_surfaces(mode, device, tmp_path):
    """Rays of rt and of rt-triangles hit the same."""
    from vk_backend.scene.scene import load_scene

    transparent_scene = load_scene(transparent(tmp_path, mode))
    instances = []
    for path in ("rt", "rt-triangles"):
        traced = tracer(device, transparent_scene, path, cache=1.0)
        picture = traced.render(camera_of(transparent_scene), WIDTH, HEIGHT)
        instances.append(picture.ids[..., 0])
        traced.free()
    if mode == "MASK":
        assert np.mean(instances[0] != instances[1]) < 1e-3
    else:
        first, second = (np.mean(i < 3) for i in instances)
        assert set(np.unique(instances[1])) == {0, 1, 2, 3, NO_HIT}
        assert first == pytest.approx(second, abs=0.05)
