"""Ray tracing: hits are right whatever the cache holds, and the cache keeps to its limits."""

from __future__ import annotations

import os
from collections import Counter
from itertools import count

# Mesa's software renderer would optimise for minutes shaders that run for a second. It reads this
# when it starts.
os.environ.setdefault("GALLIVM_PERF", "nopt")

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder
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
    waves,
)
from tests.helpers.vulkan_scenes import resources_of

MODELS = ("bunny.glb", "sponza_like.glb")
CACHES = (0.1, 0.25, 1.0)
# Tracers that tests share. Paths of "few" sweep over many parts, those of "some" over few.
TRACERS = {
    "few": {"cache": 0.1},
    "some": {"cache": 0.5},
    "all": {"cache": 1.0},
}


@pytest.fixture(scope="module")
def device():
    yield from open_device()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene.scene import load_scene

    return load_scene(several(tmp_path_factory.mktemp("scene")))


@pytest.fixture(scope="module")
def fine_scene(tmp_path_factory):
    """Some hundred meshlets, so that a small cache does not suffice."""
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene.scene import load_scene

    return load_scene(several(tmp_path_factory.mktemp("fine"), name="fine", size=(120, 90)))


def tracer(device, scene, *, cache: float = 0.25, **options):
    """cache: share of the decoded meshlets."""
    from vk_backend.raytrace.tracer import RayTracer
    from vk_backend.renderer import cache_bytes

    return RayTracer(device, scene, cache=cache_bytes(scene, "rt", cache), **options)


@pytest.fixture(scope="module")
def shared(device, scene):
    """Name in TRACERS -> tracer, made on first use: software drivers compile slowly."""
    made = {}

    def find(name: str, bounces: int = 0):
        if name not in made:
            made[name] = tracer(device, scene, **TRACERS[name])
        made[name].set_light(bounces=bounces, shadows=True)
        return made[name]

    yield find
    for traced in made.values():
        traced.free()


@pytest.fixture(scope="module")
def expected(scene):
    return nearest_hits(scene, camera_of(scene))


def assert_same_pictures(picture, other, name: str = "") -> None:
    for part in ("color", "ids", "t", "barycentrics"):
        assert np.array_equal(getattr(picture, part), getattr(other, part)), (name, part)


@pytest.mark.parametrize("name", TRACERS)
def test01_hits(name, shared, scene, expected):
    for _ in range(2):  # with the initial cache, and with one updated from the first frame
        assert_same_hits(shared(name).render(camera_of(scene), WIDTH, HEIGHT), expected, scene)


@pytest.mark.parametrize("bounces", (0, 1))
def test02_cache_changes_nothing(bounces, shared, scene):
    """Identical pictures for all sizes of the cache."""
    cameras = [camera_of(scene, 0.3 * i) for i in range(3)]
    films = [
        [shared(name, bounces).render(camera, WIDTH, HEIGHT) for camera in cameras]
        for name in ("few", "some", "all")
    ]
    for pictures in zip(*films):
        for other in pictures[1:]:
            assert_same_pictures(pictures[0], other)
    assert not np.array_equal(films[0][0].color, films[0][1].color)


def test03_sweeps(device, fine_scene):
    """A sweep has a pass for each part, and the next one begins with the part in the slots."""
    traced = tracer(device, fine_scene, cache=0.21, shadows=False)
    parts = -(-traced.meshlets // traced.slots)
    ends = []
    for _ in range(3):
        traced.render(camera_of(fine_scene), WIDTH, HEIGHT)
        assert traced.parts == traced.passes == parts
        ends.append(traced._part)
    assert ends == [parts - 1, 0, parts - 1]
    traced.set_light(bounces=1, shadows=True)
    traced.render(camera_of(fine_scene), WIDTH, HEIGHT)
    assert traced.passes == 3 * parts and traced._part == 0
    traced.free()


SWEEPING = {"bounces": 2, "samples": 2}


def fine_cameras(scene) -> list:
    return [camera_of(scene, turn) for turn in (0.0, 0.05, 0.2)]


@pytest.fixture(scope="module")
def fine_film(device, fine_scene):
    """The reference of test06: all meshlets cached."""
    traced = tracer(device, fine_scene, cache=1.0, **SWEEPING)
    film = [traced.render(camera, WIDTH, HEIGHT) for camera in fine_cameras(fine_scene)]
    traced.free()
    assert len(np.unique(film[0].color)) > 50
    return film


@pytest.mark.parametrize(
    "settings",
    [{"cache": share} for share in (0.02, 0.25, 0.33, 0.5)],
    ids=str,
)
def test06_sweeping_changes_nothing(settings, device, fine_scene, fine_film):
    """Identical pictures, also where the last part is smaller than the others."""
    traced = tracer(device, fine_scene, **SWEEPING, **settings)
    assert traced.sweeps
    for camera, expected in zip(fine_cameras(fine_scene), fine_film):
        picture = traced.render(camera, WIDTH, HEIGHT)
        assert_same_pictures(picture, expected, str(settings))
    traced.free()


def test06_serial_decoder(device, fine_scene, fine_film, monkeypatch):
    """Identical pictures if a thread each decodes the meshlets of a part, as in large models."""
    monkeypatch.setattr("vk_backend.raytrace.tracer.SERIAL_FILL", 1)
    traced = tracer(device, fine_scene, cache=0.25, **SWEEPING)
    for camera, expected in zip(fine_cameras(fine_scene), fine_film):
        picture = traced.render(camera, WIDTH, HEIGHT)
        assert_same_pictures(picture, expected)
    traced.free()


@pytest.mark.parametrize("place", ("near", "inside", "beside"))
def test06_any_camera(place, device, fine_scene):
    """Identical pictures where the scene fills the picture, or none of it: strips, no rectangle."""
    from dataclasses import replace

    from vk_backend.scene.camera import Camera

    low, high = fine_scene.low, fine_scene.high
    middle, size = (low + high) / 2, (high - low) / 8
    camera = Camera.fit_box(middle - size, middle + size, WIDTH, HEIGHT, (0.1, 0.2, 1.0))
    if place != "near":
        to_world = camera.to_world.copy()
        to_world[:3, 3] = middle if place == "inside" else high + 9 * (high - low)
        camera = replace(camera, to_world=to_world, near=1e-3)
    pictures = []
    for cache in (0.25, 1.0):
        traced = tracer(device, fine_scene, cache=cache, **SWEEPING)
        pictures.append(traced.render(camera, WIDTH, HEIGHT))
        sweeps = 2 * (2 + 1 + 1)  # of a strip: samples, each with two bounces and shadows
        strips = traced.passes / (sweeps * traced.parts)
        assert strips == (0 if cache == 1 else 1 if place == "beside" else 2)
        traced.free()
    assert_same_pictures(*pictures)


def test06_the_rectangle_holds_the_scene(device, fine_scene):
    """Every hit is inside of the rectangle that is swept, and that is not all of the picture."""
    traced = tracer(device, fine_scene, cache=0.5, shadows=False)
    for turn in np.linspace(0, 6, 7):
        camera = camera_of(fine_scene, turn)
        ys, xs = np.nonzero(np.isfinite(traced.render(camera, WIDTH, HEIGHT).t))
        left, top, right, bottom = traced._rectangle(camera)
        assert left <= xs.min() and xs.max() < right and top <= ys.min() and ys.max() < bottom
        assert (right - left) * (bottom - top) < 0.8 * WIDTH * HEIGHT
    traced.free()


def test06_sizes(device, fine_scene, fine_film):
    """Pictures of other sizes and with other lights in between do not change a picture."""
    traced = tracer(device, fine_scene, cache=0.25, **SWEEPING)
    camera = fine_cameras(fine_scene)[0]
    traced.render(camera, 16, 12)
    traced.set_light(bounces=0, shadows=True)
    assert traced.time(camera, WIDTH, HEIGHT) > 0
    traced.set_light(bounces=SWEEPING["bounces"], shadows=True)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), fine_film[0])
    traced.free()


def doubled(folder, material: dict | None = None):
    """A scene in which two instances are in the same place, and every hit is one of both."""
    from vk_backend.scene.scene import load_scene

    builder = Builder()
    builder.mesh(*waves(60, 45))
    if material:
        builder.properties["materials"] = [material]
        builder.properties["meshes"][0]["primitives"][0]["material"] = 0
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 0}, {"mesh": 0, "rotation": [0, 1, 0, 0]}]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2]}]
    output = folder / "doubled.compressed.glb"
    gltf_ext.compress(builder.write(folder / "doubled.glb"), output)
    return load_scene(output)


@pytest.mark.parametrize("cache", (0.1, 0.3, 1.0))
def test07_equal_distances(cache, device, tmp_path):
    """Of instances in the same place rays hit the first one, whatever order they meet them in."""
    scene = doubled(tmp_path)
    traced = tracer(device, scene, cache=cache)
    for turn in (0.0, 0.4, 0.4):
        instances = traced.render(camera_of(scene, turn), WIDTH, HEIGHT).ids[..., 0]
        assert set(np.unique(instances)) == {0, 2, NO_HIT}
    traced.free()


def test07_equal_triangles(device, tmp_path):
    """Of triangles in the same place rays hit the one with the smallest id."""
    from vk_backend.scene.scene import load_scene

    builder = Builder()
    values, triangles = waves(30, 20)
    count = len(values["POSITION"])
    values = {name: np.concatenate([value, value]) for name, value in values.items()}
    builder.mesh(values, np.concatenate([triangles, triangles + count]))
    builder.properties["nodes"] = [{"mesh": 0}]
    builder.properties["scenes"] = [{"nodes": [0]}]
    output = tmp_path / "twice.compressed.glb"
    gltf_ext.compress(builder.write(tmp_path / "twice.glb"), output)
    scene = load_scene(output)
    decoded = scene.primitives[0].decoded()
    corners = np.sort(decoded.positions[decoded.triangles].view("f4,f4,f4").reshape(-1, 3), axis=1)
    smallest: dict[bytes, int] = {}
    for id, own in sorted(zip(decoded.ids(), corners), key=lambda pair: int(pair[0])):
        smallest.setdefault(own.tobytes(), int(id))
    assert 2 * len(smallest) == len(corners)
    for cache in (0.2, 1.0):
        traced = tracer(device, scene, cache=cache)
        picture = traced.render(camera_of(scene), WIDTH, HEIGHT)
        hits = picture.ids[..., 1][picture.ids[..., 0] == 0]
        assert len(hits) > 100 and set(hits.tolist()) <= set(smallest.values())
        traced.free()


def test07_transparent_parts(device, tmp_path):
    """Which surfaces let a ray pass does not depend on the order of parts."""
    from vk_backend.scene.scene import load_scene

    material = {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.4]},
        "doubleSided": True,
    }
    scene = load_scene(several(tmp_path, material, "veils", size=(120, 90)))
    distances = []
    for cache in (0.1, 0.7, 1.0):
        traced = tracer(device, scene, samples=1, shadows=False, cache=cache)
        for turn in (0.2, 0.0):
            picture = traced.render(camera_of(scene, turn), WIDTH, HEIGHT)
        distances.append(picture.t)
        traced.free()
    # Triangles are not compared: Mesa's software renderer keeps the attributes of rejected hits.
    assert np.isfinite(distances[0]).mean() > 0.05
    assert np.array_equal(distances[0], distances[2]) and np.array_equal(*distances[1:])


@pytest.mark.parametrize("share", (0.1, 0.25, 0.5, 0.97))
def test08_bound(share, device, fine_scene):
    """The buffer of decoded meshlets keeps to the limit."""
    from vk_backend.raytrace.tracer import RayTracer

    most = int(share * fine_bytes(fine_scene))
    traced = RayTracer(device, fine_scene, cache=most)
    decoded = traced.resident_bytes()["cache"]
    assert traced.slots * traced.slot_bytes == decoded
    assert 0.8 * most < decoded <= most
    traced.free()


def fine_bytes(scene) -> int:
    """Bytes of all meshlets, decoded."""
    from vk_backend.decode.slots import SlotLayout

    return SlotLayout.of(scene, traced=True).bytes * sum(p.meshlets for p in scene.primitives)


def test08_memory(device, scene):
    """All parts are counted; records grow with the picture, the rest with the model."""
    sizes = {}
    for name in ("few", "some", "all"):
        traced = tracer(device, scene, **TRACERS[name])
        parts = traced.resident_bytes()
        assert parts["records"] == 0
        traced.render(camera_of(scene), WIDTH, HEIGHT)
        bytes_of = traced.resident_bytes()
        pixels = WIDTH * HEIGHT
        assert bytes_of.pop("records") == (0 if name == "all" else 32 * pixels)
        assert parts["model"] >= scene.compressed_bytes and parts["acceleration"] > 0
        sizes[name] = bytes_of["cache"]
        traced.free()
    assert sizes["few"] < sizes["some"] < sizes["all"] == traced.meshlets * traced.slot_bytes


def test08_parts_are_compact():
    """Every part of a cloud of points is near itself: half as large as the cloud, or smaller."""
    from vk_backend.raytrace.geometry import spatial_order

    points = np.random.default_rng(5).random((1000, 3))
    for size in (1, 7, 125, 400, 1000, 2000):
        order = spatial_order(points, size)
        assert np.array_equal(np.sort(order), np.arange(1000))
        boxes = [np.ptp(points[order[i : i + size]], axis=0) for i in range(0, 1000, size)]
        expected = (size / 1000) ** (1 / 3)
        assert np.prod(boxes, axis=1).mean() < 2.5 * max(expected, 0.05) ** 3 or size >= 400


def test09_boxes_of_whole_meshlets(device, scene, expected, monkeypatch):
    monkeypatch.setattr("vk_backend.raytrace.tracer.BOX_TRIANGLES", 64)
    traced = tracer(device, scene, cache=1.0)
    assert_same_hits(traced.render(camera_of(scene), WIDTH, HEIGHT), expected, scene)
    traced.free()


def test10_fine_positions(device, tmp_path):
    """Positions with more bits than packed slots hold."""
    from vk_backend.scene.scene import load_scene

    scene = load_scene(several(tmp_path, position_bits=23))
    traced = tracer(device, scene, cache=1.0)
    assert_same_hits(
        traced.render(camera_of(scene), WIDTH, HEIGHT), nearest_hits(scene, camera_of(scene)), scene
    )
    traced.free()


@pytest.mark.parametrize("mode", ("MASK", "BLEND"))
def test11_transparent(mode, device, tmp_path):
    """Rays pass transparent surfaces."""
    from vk_backend.scene.scene import load_scene

    traced = tracer(device, load_scene(transparent(tmp_path, mode)), cache=1.0)
    instances = traced.render(camera_of(traced.scene), WIDTH, HEIGHT).ids[..., 0]
    traced.free()
    # 0.4 is below the cutoff of one half.
    assert set(np.unique(instances)) == {3, NO_HIT} | ({0, 1, 2} if mode == "BLEND" else set())


@pytest.mark.parametrize(("name", "serial"), (("few", False), ("some", True), ("all", False)))
def test12_hostile(name, serial, device, scene, monkeypatch):
    """Mutated blobs render in bounded time and do not break the device."""
    if serial:
        monkeypatch.setattr("vk_backend.raytrace.tracer.SERIAL_FILL", 1)
    broken = broken_scene(scene)
    traced = tracer(device, broken, bounces=1, samples=1, **TRACERS[name])
    for _ in range(2):
        picture = traced.render(camera_of(scene), 16, 12)
        assert picture.color.shape == (12, 16, 4) and len(np.unique(picture.ids[..., 0])) > 2
    traced.free()


def test13_errors(device, scene, shared, monkeypatch):
    from dataclasses import replace

    from vk_backend.gpu.errors import VulkanError

    traced = shared("some")
    camera = camera_of(scene)
    before = traced.render(camera, WIDTH, HEIGHT)
    with monkeypatch.context() as patch:
        patch.setattr(device, "limits", replace(device.limits, launch_invocations=3100))
        with pytest.raises(VulkanError, match="cannot trace a picture of 64 x 49 pixels"):
            traced.render(camera, WIDTH, 49)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), before)
    with monkeypatch.context() as patch:  # the buffers of the last picture are gone
        patch.setattr(device, "limits", replace(device.limits, buffer_bytes=1 << 14))
        with pytest.raises(VulkanError, match="is too large for"):
            traced.render(camera, 300, 200)
        assert traced._picture == {}
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), before)
    with monkeypatch.context() as patch:
        patch.setattr(type(traced), "_record_fill", lambda *_: 1 // 0)  # the last step
        resources = resources_of(device)
        with pytest.raises(ZeroDivisionError):
            tracer(device, scene, **TRACERS["some"])
        assert resources_of(device) == resources

    with pytest.raises(VulkanError, match="samples of 255 bounces"):
        tracer(device, scene, bounces=255)
    with pytest.raises(VulkanError, match="take too many passes"):
        tracer(device, scene, cache=0.1, samples=60000)
    with pytest.raises(VulkanError, match=r"give it \d+ bytes or more$"):
        tracer(device, scene, cache=0.0)
    with pytest.raises(VulkanError, match="the cache holds 0 of"):
        type(traced)(device, scene, cache=traced.slot_bytes - 1)


def test14_like_mitsuba(shared, scene):
    camera = camera_of(scene)
    hits = mitsuba_hits(scene, camera)
    for name in TRACERS:
        assert_same_hits(shared(name).render(camera, WIDTH, HEIGHT), hits, scene)


def test15_first_sample(device, scene):
    """A pixel's first hit does not depend on the number of samples."""
    pictures = []
    for samples in (2, 3):
        traced = tracer(device, scene, cache=1.0, samples=samples)
        pictures.append(traced.render(camera_of(scene), WIDTH, HEIGHT))
        traced.free()
    assert np.array_equal(pictures[0].t, pictures[1].t) and not np.array_equal(
        pictures[0].color, pictures[1].color
    )


def test16_pipelines(device, scene, shared):
    """Only tracers of the same kind share pipelines."""
    traced = tracer(device, scene, **TRACERS["few"])
    assert traced._rays.handle == shared("few")._rays.handle
    assert traced._rays.handle != shared("all")._rays.handle
    traced.free()


@pytest.mark.full
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("cache", CACHES)
def test17_models(name, cache, device, model, tmp_path):
    from vk_backend.scene.scene import load_scene

    path = tmp_path / name
    gltf_ext.compress(model(name), path)
    scene = load_scene(path)
    camera = camera_of(scene)
    traced = tracer(device, scene, cache=cache)
    traced.render(camera, WIDTH, HEIGHT)
    assert_same_hits(traced.render(camera, WIDTH, HEIGHT), mitsuba_hits(scene, camera), scene)
    traced.free()


def launches_of(device, monkeypatch) -> list[tuple[int, int]]:
    """Records each launch of rays from now on: (number of its submission, rays)."""
    from vk_backend.gpu import vk

    launches: dict[object, list[int]] = {}  # of a command buffer that waits
    submitted: list[tuple[int, int]] = []
    submissions = count()
    trace, submit = device.function("vkCmdTraceRaysKHR"), vk.vkQueueSubmit2

    def traced(commands, *arguments):
        width, height, _ = arguments[-3:]
        launches.setdefault(commands, []).append(width * height)
        trace(commands, *arguments)

    def submitting(queue, number, infos, fence):
        submission = next(submissions)
        for info in infos:
            for i in range(info.commandBufferInfoCount):
                commands = info.pCommandBufferInfos[i].commandBuffer
                submitted.extend((submission, rays) for rays in launches.pop(commands, []))
        submit(queue, number, infos, fence)

    monkeypatch.setitem(device._functions, "vkCmdTraceRaysKHR", traced)
    monkeypatch.setattr(vk, "vkQueueSubmit2", submitting, raising=False)
    return submitted


@pytest.mark.parametrize("name", ["few", "all"])
def test18_submissions_are_short(device, scene, shared, monkeypatch, name):
    """A driver ends a submission that takes seconds: large frames have several."""
    from vk_backend.raytrace import commands as raytrace_commands

    camera = camera_of(scene)
    traced = shared(name, bounces=1)
    levels = 1 if traced.sweeps else 3  # of a pixel in a launch
    whole = traced.render(camera, WIDTH, HEIGHT)
    launches = launches_of(device, monkeypatch)
    traced.render(camera, WIDTH, HEIGHT)
    assert len({submission for submission, _ in launches}) == 1
    launches.clear()
    most = 100 if name == "all" else 3 * WIDTH * HEIGHT
    monkeypatch.setattr(raytrace_commands, "MOST_LEVELS", most)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), whole)
    numbers = Counter()
    for submission, rays in launches:
        numbers[submission] += rays * levels
    assert len(numbers) > 3 and max(numbers.values()) <= most
