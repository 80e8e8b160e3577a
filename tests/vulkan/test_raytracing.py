"""Ray tracing: hits are right whatever the cache holds, and the cache keeps to its limits."""

from __future__ import annotations

import os

# Mesa's software renderer would optimise for minutes shaders that run for a second. It reads this
# when it starts.
os.environ.setdefault("GALLIVM_PERF", "nopt")

import numpy as np
import pytest

import gltf_ext
from tests.helpers.environment import missing
from tests.helpers.gltf_builder import Builder, everything

WIDTH, HEIGHT = 64, 48
NO_HIT = 0xFFFFFFFF
MODELS = ("bunny.glb", "sponza_like.glb")
CACHES = (0.0, 0.25, 1.0)
# Tracers that tests share. Rays of "none" decode by themselves; paths of "some" wait.
TRACERS = {
    "none": {"cache": 0.0, "scratch": 0.0},
    "some": {"cache": 0.25, "scratch": 0.2},
    "all": {"cache": 1.0},
    "plain": {"path": "rt-plain"},
    "triangles": {"path": "rt-triangles"},
}


@pytest.fixture(scope="module")
def device():
    """A device with the validation layer, which must be silent."""
    try:
        from vk_backend.device import Device
        from vk_backend.errors import VulkanError
    except ImportError as error:
        missing(f"Vulkan cannot be used: {error}")
    try:
        made = Device(validation=True)
    except VulkanError as error:
        missing(f"Vulkan cannot be used: {error}")
    if "raytracing" not in made.capabilities:
        made.close()
        missing(f"{made.name} has no VK_KHR_ray_tracing_pipeline")
    yield made
    messages = list(made.messages)
    made.close()
    assert messages == []


def waves(columns: int, rows: int):
    """Attributes and triangles of a folded sheet, which rays cross several times."""
    values, triangles, _ = everything(columns=columns, rows=rows)
    positions = values["POSITION"].copy()
    positions[:, 2] += 0.4 * np.sin(9 * positions[:, 0]).astype(np.float32)
    return {
        "POSITION": positions,
        "NORMAL": values["NORMAL"],
        "TEXCOORD_0": values["TEXCOORD_0"],
    }, triangles


def several(
    folder,
    material: dict | None = None,
    name: str = "several",
    size: tuple[int, int] = (40, 30),
    **options,
):
    """Compresses a sheet with turned, mirrored and stretched instances, and a second mesh."""
    builder = Builder()
    builder.mesh(*waves(*size))
    values, triangles = waves(20, 16)
    builder.mesh(values, triangles)
    if material:
        builder.properties["materials"] = [material]
        builder.properties["meshes"][0]["primitives"][0]["material"] = 0
    builder.properties["nodes"] = [
        {"mesh": 0, "rotation": [0, 0.3826834, 0, 0.9238795]},
        {"mesh": 0, "translation": [0.3, 1, -0.4], "scale": [1, -1, 1]},
        {"mesh": 0, "translation": [-0.5, 0.2, 0.3], "scale": [1.5, 0.5, 2]},
        {"mesh": 1, "translation": [0, 0.1, 0.2], "rotation": [0.5, 0.5, 0.5, 0.5]},
    ]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    output = folder / f"{name}.compressed.glb"
    gltf_ext.compress(builder.write(folder / f"{name}.glb"), output, **options)
    return output


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene import load_scene

    return load_scene(several(tmp_path_factory.mktemp("scene")))


@pytest.fixture(scope="module")
def fine_scene(tmp_path_factory):
    """Some hundred meshlets, so that a small cache does not suffice."""
    pytest.importorskip("vulkan", exc_type=Exception)
    from vk_backend.scene import load_scene

    return load_scene(several(tmp_path_factory.mktemp("fine"), name="fine", size=(120, 90)))


def tracer(device, scene, path="rt", **options):
    from vk_backend.raytrace import RayTracer

    return RayTracer(device, scene, path, **options)


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


def slots_of(traced) -> np.ndarray:
    """uint32[meshlets]: the slot that each meshlet has or is assigned to, or a large number."""
    entries = traced._slot_table.read()
    return np.where(entries < 0xFFFFFFFE, entries & 0x3FFFFFFF, entries)


def camera_of(scene, turn: float = 0.0):
    from vk_backend.camera import Camera

    view = (0.45 * np.cos(turn) + np.sin(turn), 0.35, np.cos(turn) - 0.45 * np.sin(turn))
    return Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT, view)


def rays_of(camera) -> tuple[np.ndarray, np.ndarray]:
    """(origin float64[3], unit directions float64[H, W, 3]) through the pixels' centres."""
    inverse = np.linalg.inv(camera.world_to_clip(WIDTH, HEIGHT))
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    clip = np.stack(
        [2 * x / WIDTH - 1, 2 * y / HEIGHT - 1, np.full_like(x, 0.5), np.ones_like(x)], axis=-1
    )
    through = clip @ inverse.T
    directions = through[..., :3] / through[..., 3:] - camera.eye[:3]
    return np.array(camera.eye[:3]), directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def nearest_hits(scene, camera) -> dict[str, np.ndarray]:
    """Tests all triangles in float64.

    Returns (t, instance, id, barycentrics, t of the nearest hit of any other triangle).
    """
    origin, directions = rays_of(camera)
    d = directions.reshape(-1, 3)
    best = {
        "t": np.full(len(d), np.inf),
        "ids": np.full((len(d), 2), NO_HIT, np.uint32),
        "b": np.zeros((len(d), 2)),
    }
    for number, instance in enumerate(scene.instances):
        decoded = scene.primitives[instance.primitive].decoded()
        points = (
            decoded.positions.astype(np.float64) @ instance.matrix[:3, :3].T
            + instance.matrix[:3, 3]
        )
        for id, corners in zip(decoded.ids(), points[decoded.triangles]):
            first, second = corners[1] - corners[0], corners[2] - corners[0]
            p = np.cross(d, second)
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = 1 / (p @ first)
                s = origin - corners[0]
                u = (p @ s) * inverse
                q = np.cross(s, first)
                v = (d @ q) * inverse
                t = (second @ q) * inverse
                hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best["t"])
            best["t"][hit], best["ids"][hit], best["b"][hit] = (
                t[hit],
                (number, id),
                np.stack([u, v], axis=1)[hit],
            )
    return {
        "t": best["t"].reshape(HEIGHT, WIDTH),
        "ids": best["ids"].reshape(HEIGHT, WIDTH, 2),
        "b": best["b"].reshape(HEIGHT, WIDTH, 2),
    }


@pytest.fixture(scope="module")
def expected(scene):
    return nearest_hits(scene, camera_of(scene))


def assert_same_pictures(picture, other, name: str = "") -> None:
    for part in ("color", "ids", "t", "barycentrics"):
        assert np.array_equal(getattr(picture, part), getattr(other, part)), (name, part)


def assert_same_hits(picture, expected, scene) -> None:
    """The same hits, apart from rays that pass very near an edge."""
    size = float(np.linalg.norm(scene.high - scene.low))
    same = (picture.ids == expected["ids"]).all(axis=-1)
    assert np.count_nonzero(~same) <= 3  # within rounding of an edge
    seen = same & (picture.ids[..., 0] != NO_HIT)
    assert seen.mean() > 0.02
    assert np.abs(picture.t[seen] - expected["t"][seen]).max() < 1e-5 * size
    assert np.abs(picture.barycentrics[seen] - expected["b"][seen]).max() < 5e-3


@pytest.mark.parametrize("name", TRACERS)
def test01_hits(name, shared, scene, expected):
    for _ in range(2):  # with the initial cache, and with one updated from the first frame
        assert_same_hits(shared(name).render(camera_of(scene), WIDTH, HEIGHT), expected, scene)


@pytest.mark.parametrize("bounces", (0, 1))
def test02_cache_changes_nothing(bounces, shared, scene):
    """Identical pictures without a cache, with a small one, and with all meshlets cached."""
    cameras = [camera_of(scene, 0.3 * i) for i in range(3)]
    films = [
        list(shared(name, bounces).frames(cameras, WIDTH, HEIGHT))
        for name in ("none", "some", "all")
    ]
    for pictures in zip(*films):
        for other in pictures[1:]:
            assert_same_pictures(pictures[0], other)
    assert not np.array_equal(films[0][0].color, films[0][1].color)


def test03_cache_follows(device, fine_scene):
    """Slots follow the camera, one meshlet each; then fewer paths wait."""
    scene = fine_scene
    traced = tracer(device, scene, cache_bytes=12 * 4096, scratch=0.5)
    assert 0 < traced.capacity <= 12 * 4096 // traced.slot_bytes
    waiting = []
    for turn in (0.0, 0.0, 0.0, 2.0, 2.0, 4.0, 0.0):
        traced.render(camera_of(scene, turn), WIDTH, HEIGHT)
        statistics = traced.statistics()
        assert (
            statistics["resident"]
            == statistics["slots"]
            == traced.capacity + traced.scratch
            < traced.meshlets
        )
        assert statistics["asked"] >= statistics["needed"] > 0
        table, meshlets = slots_of(traced), traced._slot_meshlets.read()
        numbers = np.flatnonzero(table < traced.capacity + traced.scratch)
        assert len(numbers) == statistics["resident"] == np.count_nonzero(meshlets != NO_HIT)
        assert np.array_equal(meshlets[table[numbers]], numbers)
        waiting.append(statistics["waiting"][0])
    assert waiting[0] > 2 * waiting[2] and waiting[3] > waiting[4]
    traced.free()


def test03_slots_are_filled(device, fine_scene):
    """Initially slots hold meshlets from all over the model, later those that rays needed.

    Of the others, rather those that rays tested.
    """
    from vk_backend.raytrace import COUNTED_RAY

    traced = tracer(device, fine_scene, cache=0.2, scratch=0.65, samples=1, predict=False)
    slots = traced.capacity + traced.scratch
    table, meshlets = slots_of(traced), traced._slot_meshlets.read()
    assert np.array_equal(meshlets, np.arange(slots) * traced.meshlets // slots)
    assert (
        np.array_equal(table[meshlets], np.arange(slots))
        and np.count_nonzero(table < slots) == slots
    )
    for _ in range(6):
        picture = traced.render(camera_of(fine_scene), WIDTH, HEIGHT)
    instances, ids = picture.ids[picture.ids[..., 0] != NO_HIT].T
    primitives = np.array([i.primitive for i in fine_scene.instances])
    seen = np.unique(traced._first_meshlet[primitives[instances]] + ids // 64)
    counters, there = traced._counters.read(), slots_of(traced) < slots
    assert (counters[seen] >= COUNTED_RAY).all() and there[seen].all()
    touched = counters == 1
    assert touched.any() and there[touched].all() and not there[counters == 0].all()
    traced.free()


def test04_prediction(device, fine_scene):
    """If there are enough slots, all meshlets of the last frame are resident: no path waits."""
    camera = camera_of(fine_scene)
    traced = tracer(device, fine_scene, cache=0.1, scratch=0.89, samples=1)
    for bounces in (0, 1):
        traced.set_light(bounces=bounces, shadows=True)
        waiting = []
        for _ in range(5):
            traced.render(camera, WIDTH, HEIGHT)
            waiting.append(sum(traced.statistics()["waiting"]))
        assert (waiting[0] > waiting[1] or bounces) and waiting[-1] == 0
    traced.free()


def test04_looking_ahead(device, fine_scene):
    """Prefetch rays find a model before the camera turns to it, so that fewer paths wait.

    There are none if the camera does not move.
    """
    from dataclasses import replace

    towards = camera_of(fine_scene)

    def at(frame: int):
        angle = 0.04 * (frame - 24)
        turn = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        )
        to_world = towards.to_world.copy()
        to_world[:3, :3] = turn @ to_world[:3, :3]
        return replace(towards, to_world=to_world)

    needed, waiting = {}, {}
    for ahead in (0.0, 0.25):
        traced = tracer(
            device,
            fine_scene,
            cache=0.3,
            scratch=0.4,
            samples=1,
            shadows=False,
            predict=False,
            ahead=ahead,
        )
        needed[ahead], waiting[ahead] = [], 0
        for frame in (0, 0, 1, 1):
            assert np.isinf(traced.render(at(frame), WIDTH, HEIGHT).t).all()
            needed[ahead].append(traced.statistics()["needed"])
        for frame in range(2, 10):
            picture = traced.render(at(frame), WIDTH, HEIGHT)
            waiting[ahead] += sum(traced.statistics()["waiting"])
        assert np.isfinite(picture.t).any()
        traced.free()
    assert needed[0.0] == [0, 0, 0, 0]
    assert needed[0.25][:2] == [0, 0] and needed[0.25][2] > 5 and needed[0.25][3] == 0
    assert 2 * waiting[0.25] < waiting[0.0]


def test04_no_camera_is_too_fast(device, fine_scene):
    """No prefetch if the extrapolated camera overflows or is degenerate in float precision."""
    from dataclasses import replace

    traced = tracer(device, fine_scene, cache=0.3, scratch=0.3, samples=1)
    near = camera_of(fine_scene)

    def moved(by: float, **changes):
        camera = replace(near, to_world=near.to_world.copy(), **changes)
        camera.to_world[:3, 3] += by
        return camera

    for camera in (near, moved(1e38), near):
        traced.render(camera, WIDTH, HEIGHT)
    assert traced._frame_ahead(moved(1e38), WIDTH, HEIGHT)["width"] == 0
    assert traced._frame_ahead(camera_of(fine_scene, 0.01), WIDTH, HEIGHT)["width"] == 0
    ahead = traced._frame_ahead(camera_of(fine_scene, 0.02), WIDTH, HEIGHT)
    assert 0 < ahead["width"] < WIDTH
    for camera in (moved(0, near=0.01), moved(1e4, near=0.01), moved(2e4, near=0.01), near):
        traced.render(camera, WIDTH, HEIGHT)
        assert traced._frame_ahead(camera, WIDTH, HEIGHT)["width"] == 0  # the camera stands still
    traced.free()


@pytest.mark.parametrize("predict", (True, False))
def test05_prediction_alone(predict, device, fine_scene):
    """Without rounds paths decode by themselves; slots are filled only between frames."""
    from vk_backend.raytrace import COUNTED_RAY

    traced = tracer(
        device, fine_scene, cache=0.1, scratch=0.85, samples=1, rounds=0, predict=predict
    )
    kept, coming = [], 0
    for _ in range(4):
        traced.render(camera_of(fine_scene), WIDTH, HEIGHT)
        kept.append(traced.statistics()["kept"])
        coming += traced.statistics()["coming"]
    needed = traced._counters.read() >= COUNTED_RAY
    there = slots_of(traced) < traced.capacity + traced.scratch
    assert there[needed].all() and kept[0] == 0 < kept[1] and kept[3] == 0
    assert (coming > 0) == predict
    traced.free()


WAITING = {"bounces": 2, "samples": 2}
GO_ON, RESTART, BOTH = "paths that wait go on", "they start again", "some go on"


def fine_cameras(scene) -> list:
    return [camera_of(scene, turn) for turn in (0.0, 0.05, 0.2)]


@pytest.fixture(scope="module")
def fine_film(device, fine_scene):
    """The reference of test06: all meshlets cached."""
    traced = tracer(device, fine_scene, cache=1.0, **WAITING)
    film = list(traced.frames(fine_cameras(fine_scene), WIDTH, HEIGHT))
    traced.free()
    assert len(np.unique(film[0].color)) > 50
    return film


# The cases for --full vary the settings of the others.
@pytest.mark.parametrize(
    "settings, outcome",
    [
        pytest.param(
            {"cache": 0.0, "scratch": 0.5, "paths": 1.0},
            GO_ON,
            id="all go on",
            marks=pytest.mark.full,
        ),
        pytest.param(
            {"cache_bytes": 0, "scratch": 0.003, "paths": 0.05, "rounds": 2, "strips": 1},
            None,
            id="one slot",
        ),
        pytest.param(
            {
                "cache": 0.1,
                "scratch": 0.1,
                "rounds": 3,
                "strips": 5,
                "predict": False,
                "bounds": False,
            },
            None,
            id="strips, no bounds",
        ),
        pytest.param({"cache": 0.0, "scratch": 0.5, "paths": 0.0}, RESTART, id="all start again"),
        pytest.param(
            {"cache": 0.0, "scratch": 0.5, "paths": 0.02},
            BOTH,
            id="some start again",
            marks=pytest.mark.full,
        ),
        pytest.param(
            {"cache": 0.0, "scratch": 0.5, "paths": 1.0, "bounds": False},
            GO_ON,
            id="no bounds",
            marks=pytest.mark.full,
        ),
        pytest.param(
            {"cache": 0.0, "scratch": 0.06, "paths": 0.05, "rounds": 3},
            None,
            id="few slots",
            marks=pytest.mark.full,
        ),
        pytest.param(
            {"cache": 0.1, "scratch": 0.2, "ahead": 0.3}, None, id="10 %", marks=pytest.mark.full
        ),
        pytest.param({"cache": 0.25, "scratch": 0.2, "predict": False}, None, id="25 %"),
        pytest.param({"cache": 0.5, "scratch": 0.1}, None, id="50 %", marks=pytest.mark.full),
        pytest.param(
            {"cache": 0.7, "scratch": 0.1}, None, id="few missing", marks=pytest.mark.full
        ),
        pytest.param(
            {"cache": 0.7, "scratch": 0.1, "predict": False},
            None,
            id="few missing, nothing ahead",
            marks=pytest.mark.full,
        ),
    ],
)
def test06_waiting_changes_nothing(settings, outcome, device, fine_scene, fine_film):
    """Identical pictures with any number of slots, whether paths resume or restart.

    outcome: which of the two happens, if that does not depend on timing.
    """
    traced = tracer(device, fine_scene, **WAITING, **settings)
    assert traced.scratch == 1 or traced.scratch > 10
    for picture, expected in zip(traced.frames(fine_cameras(fine_scene), WIDTH, HEIGHT), fine_film):
        assert_same_pictures(picture, expected, str(settings))
    restarted, waiting = (sum(traced.statistics()[name]) for name in ("restarted", "waiting"))
    traced.free()
    assert waiting > 0
    assert outcome in (None, GO_ON if restarted == 0 else RESTART if restarted == waiting else BOTH)


def test06_steps_and_sizes(device, fine_scene, fine_film):
    """Steps match the launches; other sizes and lights in between do not change a picture."""
    traced = tracer(device, fine_scene, cache=0.1, scratch=0.2, marked=True, **WAITING)
    camera = fine_cameras(fine_scene)[0]
    traced.render(camera, 16, 12)
    traced.set_light(bounces=0, shadows=True)
    milliseconds = traced.time(camera, WIDTH, HEIGHT)
    steps = traced.steps()
    assert 0.9 * milliseconds < sum(steps.values()) <= milliseconds
    assert list(steps)[:3] == ["choose", "keep", "rays"] and len(steps) == 3 + 2 * traced.rounds
    traced.set_light(bounces=WAITING["bounces"], shadows=True)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), fine_film[0])
    parts = traced.resident_bytes()["lists"]
    traced.free()
    full = tracer(device, fine_scene, cache=1.0, counted=True, **WAITING)
    assert_same_pictures(full.render(camera, WIDTH, HEIGHT), fine_film[0])
    statistics = full.statistics()
    assert (
        statistics["asked"] >= statistics["needed"] > 0
        and statistics["resident"] == statistics["slots"] == full.meshlets
    )
    assert full.resident_bytes()["lists"] < parts
    full.free()


def test06_strips_alone(device, fine_scene, fine_film):
    """Strips without rounds: rays cannot wait."""
    traced = tracer(device, fine_scene, cache=0.2, scratch=0.1, rounds=0, **WAITING)
    assert traced.strips > 1 and traced.rounds == 0
    for picture, expected in zip(traced.frames(fine_cameras(fine_scene), WIDTH, HEIGHT), fine_film):
        assert_same_pictures(picture, expected)
    traced.free()


def test07_transparent_and_waiting(device, tmp_path):
    """The any-hit shader must not treat a blocked hit as a triangle with alpha."""
    from vk_backend.scene import load_scene

    material = {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.4]},
        "doubleSided": True,
    }
    scene = load_scene(several(tmp_path, material, "veils", size=(120, 90)))
    distances, waiting = [], []
    for settings in ({"cache": 1.0}, {"cache": 0.0, "scratch": 0.7, "rounds": 24, "paths": 1.0}):
        traced = tracer(device, scene, samples=1, shadows=False, **settings)
        distances.append(traced.render(camera_of(scene), WIDTH, HEIGHT).t)
        waiting = traced.statistics().get("waiting", [])
        traced.free()
    assert waiting[0] > 0 and waiting[-1] == 0  # so no path decodes by itself
    # Triangles are not compared: Mesa's software renderer keeps the attributes of rejected hits.
    assert np.isfinite(distances[0]).mean() > 0.05 and np.array_equal(*distances)


def test08_memory(shared, scene):
    """All parts are counted; only the cache grows with its size."""
    sizes = []
    for name, cache in (("none", 0), ("all", 1)):
        traced = shared(name)
        parts = traced.resident_bytes()
        assert parts["model"] >= scene.compressed_bytes and parts["acceleration"] > 0
        sizes.append(parts["cache"])
        assert traced.statistics()["resident"] == traced.capacity == cache * traced.meshlets
    assert sizes[1] >= traced.meshlets * traced.slot_bytes > sizes[0]


def test09_groups(device, scene, expected):
    """Hits with boxes around whole meshlets."""
    traced = tracer(device, scene, cache=1.0, group=64)
    assert_same_hits(traced.render(camera_of(scene), WIDTH, HEIGHT), expected, scene)
    traced.free()


def test10_fine_positions(device, tmp_path):
    """Positions with more bits than packed slots hold."""
    from vk_backend.scene import load_scene

    scene = load_scene(several(tmp_path, position_bits=23))
    traced = tracer(device, scene, cache=1.0)
    assert_same_hits(
        traced.render(camera_of(scene), WIDTH, HEIGHT), nearest_hits(scene, camera_of(scene)), scene
    )
    traced.free()


@pytest.mark.parametrize("mode", ("MASK", "BLEND"))
def test11_transparent(mode, device, tmp_path):
    """Rays pass transparent surfaces and hit the same on every path."""
    from vk_backend.scene import load_scene

    factor = [1, 1, 1, 0.4]
    material = {
        "alphaMode": mode,
        "pbrMetallicRoughness": {"baseColorFactor": factor},
        "doubleSided": True,
    }
    scene = load_scene(several(tmp_path, material, "transparent"))
    camera = camera_of(scene)
    pictures = []
    for path in ("rt", "rt-triangles"):
        traced = tracer(device, scene, path, cache=1.0)
        pictures.append(traced.render(camera, WIDTH, HEIGHT))
        traced.free()
    instances = [p.ids[..., 0] for p in pictures]
    if mode == "MASK":
        assert set(np.unique(instances[0])) == {3, NO_HIT}  # 0.4 is below the cutoff of one half
        assert np.mean(instances[0] != instances[1]) < 1e-3
    else:
        shares = [np.mean(i < 3) for i in instances]
        assert set(np.unique(instances[0])) == {0, 1, 2, 3, NO_HIT} and shares[0] == pytest.approx(
            shares[1], abs=0.05
        )


def broken_blobs(original: bytes, count: int) -> list[bytes]:
    """Changes bits so that the check of the header does not notice."""
    random = np.random.default_rng(7)
    header = 32 + 28 * original[5]
    found: list[bytes] = []
    for attempt in range(100):
        blob = bytearray(original)
        for place in random.integers(header, len(blob) - 8, 1 + attempt % 20):
            blob[place] ^= 1 << int(random.integers(8))
        try:
            gltf_ext._codec.Decoder(bytes(blob))
        except ValueError:
            continue
        found.append(bytes(blob))
        if len(found) == count:
            return found
    raise AssertionError("the header's check finds nearly everything")


@pytest.mark.parametrize("name", ("none", "some", "all"))
def test12_hostile(name, device, scene):
    """Mutated blobs render in bounded time and do not break the device."""
    from dataclasses import replace

    sheet = scene.primitives[0]
    blobs = broken_blobs(sheet.blob, 8)
    primitives = [replace(sheet, blob=blob) for blob in blobs]
    instances = [
        replace(scene.instances[number % 3], primitive=number) for number in range(len(blobs))
    ]
    broken = replace(scene, primitives=primitives, instances=instances)
    traced = tracer(device, broken, bounces=1, samples=1, **TRACERS[name])
    for _ in range(2):
        picture = traced.render(camera_of(scene), 16, 12)
        assert picture.color.shape == (12, 16, 4) and len(np.unique(picture.ids[..., 0])) > 2
    traced.free()


def test13_errors(device, scene, shared, monkeypatch):
    from dataclasses import replace

    from vk_backend.errors import VulkanError

    traced = shared("some")
    camera = camera_of(scene)
    before = traced.render(camera, WIDTH, HEIGHT)
    with monkeypatch.context() as patch:
        patch.setattr(device, "limits", replace(device.limits, launch_width=100_000))
        with pytest.raises(VulkanError, match="cannot trace a picture of 64 x 49 pixels"):
            traced.render(camera, WIDTH, 49)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), before)

    with pytest.raises(VulkanError, match="there is no path"):
        tracer(device, scene, "rt-magic")
    with pytest.raises(VulkanError, match="share from 0 to 1"):
        tracer(device, scene, cache=1.5)
    with pytest.raises(VulkanError, match="at most 2047 bounces"):
        tracer(device, scene, bounces=2048)
    with pytest.raises(ValueError, match="group"):
        tracer(device, scene, group=7)
    with pytest.raises(ValueError, match="not negative"):
        tracer(device, scene, strips=-1)


def mitsuba_hits(scene, camera) -> dict[str, np.ndarray]:
    """Hits of Mitsuba's triangle meshes of the decoded model."""
    from tests.helpers.mitsuba_reference import require

    mi, _ = require("scalar_rgb")
    meshes = {}
    for number, instance in enumerate(scene.instances):
        decoded = scene.primitives[instance.primitive].decoded()
        points = (
            decoded.positions.astype(np.float64) @ instance.matrix[:3, :3].T
            + instance.matrix[:3, 3]
        )
        mesh = mi.Mesh(f"instance{number}", len(points), len(decoded.triangles))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = points.astype(np.float32).ravel()
        parameters["faces"] = decoded.triangles.ravel()
        parameters.update()
        meshes[f"instance{number}"] = mesh
    traced = mi.load_dict({"type": "scene", **meshes})
    names = {shape.id(): number for number, shape in enumerate(meshes.values())}
    ids = [scene.primitives[i.primitive].decoded().ids() for i in scene.instances]
    origin, directions = rays_of(camera)
    found = {
        "t": np.full((HEIGHT, WIDTH), np.inf),
        "ids": np.full((HEIGHT, WIDTH, 2), NO_HIT, np.uint32),
        "b": np.zeros((HEIGHT, WIDTH, 2)),
    }
    for y, x in np.ndindex(HEIGHT, WIDTH):
        hit = traced.ray_intersect_preliminary(
            mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*directions[y, x])), True
        )
        if hit.is_valid():
            number = names[hit.shape.id()]
            found["t"][y, x], found["ids"][y, x] = hit.t, (number, ids[number][hit.prim_index])
            found["b"][y, x] = hit.prim_uv.x, hit.prim_uv.y
    return found


def test14_like_mitsuba(shared, scene):
    camera = camera_of(scene)
    hits = mitsuba_hits(scene, camera)
    for name in ("none", "some", "all"):
        assert_same_hits(shared(name).render(camera, WIDTH, HEIGHT), hits, scene)


def test15_first_sample(device, scene):
    """A pixel's first hit does not depend on the number of samples."""
    pictures = []
    for samples in (2, 3):
        traced = tracer(device, scene, "rt-triangles", samples=samples)
        pictures.append(traced.render(camera_of(scene), WIDTH, HEIGHT))
        traced.free()
    assert np.array_equal(pictures[0].t, pictures[1].t) and not np.array_equal(
        pictures[0].color, pictures[1].color
    )


def test16_pipelines(device, scene, shared):
    """Only tracers of the same kind share pipelines."""
    traced = tracer(device, scene, **TRACERS["none"])
    assert traced.pipelines == shared("none").pipelines
    assert not set(traced.pipelines) & {
        p for name in ("some", "all", "plain", "triangles") for p in shared(name).pipelines
    }
    traced.free()


@pytest.mark.full
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("cache", CACHES)
def test17_models(name, cache, device, model, tmp_path):
    from vk_backend.scene import load_scene

    path = tmp_path / name
    gltf_ext.compress(model(name), path)
    scene = load_scene(path)
    camera = camera_of(scene)
    traced = tracer(device, scene, cache=cache)
    traced.render(camera, WIDTH, HEIGHT)
    assert_same_hits(traced.render(camera, WIDTH, HEIGHT), mitsuba_hits(scene, camera), scene)
    traced.free()
