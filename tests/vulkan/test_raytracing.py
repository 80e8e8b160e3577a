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
CACHES = (0.1, 0.25, 1.0)
# Tracers that tests share. Paths of "few" sweep over many parts, those of "some" over few. Rays of
# "paper" decode by themselves.
TRACERS = {
    "few": {"cache": 0.1},
    "some": {"cache": 0.5},
    "all": {"cache": 1.0},
    "paper": {"path": "rt-paper", "cache": 0.25},
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
    """Identical pictures for all sizes of the cache."""
    cameras = [camera_of(scene, 0.3 * i) for i in range(3)]
    films = [
        list(shared(name, bounces).frames(cameras, WIDTH, HEIGHT))
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
        assert traced.statistics() == {
            "slots": traced.slots,
            "meshlets": traced.meshlets,
            "parts": parts,
            "passes": parts,
        }
        ends.append(traced._part)
    assert ends == [parts - 1, 0, parts - 1]
    traced.set_light(bounces=1, shadows=True)
    traced.render(camera_of(fine_scene), WIDTH, HEIGHT)
    assert traced.statistics()["passes"] == 3 * parts and traced._part == 0
    traced.free()


SWEEPING = {"bounces": 2, "samples": 2}


def fine_cameras(scene) -> list:
    return [camera_of(scene, turn) for turn in (0.0, 0.05, 0.2)]


@pytest.fixture(scope="module")
def fine_film(device, fine_scene):
    """The reference of test06: all meshlets cached."""
    traced = tracer(device, fine_scene, cache=1.0, **SWEEPING)
    film = list(traced.frames(fine_cameras(fine_scene), WIDTH, HEIGHT))
    traced.free()
    assert len(np.unique(film[0].color)) > 50
    return film


@pytest.mark.parametrize(
    "settings",
    [{"cache": 0.02}, {"cache": 0.25}, {"cache": 0.5, "group": 8}, {"cache_bytes": 400_000}],
    ids=str,
)
def test06_sweeping_changes_nothing(settings, device, fine_scene, fine_film):
    """Identical pictures, also where the last part is smaller than the others."""
    traced = tracer(device, fine_scene, **SWEEPING, **settings)
    assert traced.sweeps
    for picture, expected in zip(traced.frames(fine_cameras(fine_scene), WIDTH, HEIGHT), fine_film):
        assert_same_pictures(picture, expected, str(settings))
    traced.free()


@pytest.mark.parametrize("place", ("near", "inside", "beside"))
def test06_any_camera(place, device, fine_scene):
    """Identical pictures where the scene fills the picture, or none of it: strips, no rectangle."""
    from dataclasses import replace

    from vk_backend.camera import Camera

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
        strips = traced.statistics()["passes"] / (sweeps * traced.parts)
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
    from vk_backend.scene import load_scene

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
    from vk_backend.scene import load_scene

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
    from vk_backend.scene import load_scene

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
    """The buffer of decoded meshlets keeps to the limit, in bytes and as a share."""
    total = 0
    for limit in ({"cache": share}, {"cache_bytes": int(share * fine_bytes(fine_scene))}):
        traced = tracer(device, fine_scene, **limit)
        decoded = traced.resident_bytes()["cache"]
        assert traced.slots * traced.slot_bytes == decoded
        most = fine_bytes(fine_scene) * share + ("cache" in limit) * traced.slot_bytes
        assert 0.8 * most < decoded <= most
        total += decoded
        traced.free()
    assert total > 0


def fine_bytes(scene) -> int:
    """Bytes of all meshlets, decoded."""
    from vk_backend.slot_layout import SlotLayout

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
    from vk_backend.raytrace_geometry import spatial_order

    points = np.random.default_rng(5).random((1000, 3))
    for size in (1, 7, 125, 400, 1000, 2000):
        order = spatial_order(points, size)
        assert np.array_equal(np.sort(order), np.arange(1000))
        boxes = [np.ptp(points[order[i : i + size]], axis=0) for i in range(0, 1000, size)]
        expected = (size / 1000) ** (1 / 3)
        assert np.prod(boxes, axis=1).mean() < 2.5 * max(expected, 0.05) ** 3 or size >= 400


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


@pytest.mark.parametrize("name", ("few", "some", "all", "paper"))
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
        patch.setattr(device, "limits", replace(device.limits, launch_invocations=3100))
        with pytest.raises(VulkanError, match="cannot trace a picture of 64 x 49 pixels"):
            traced.render(camera, WIDTH, 49)
    assert_same_pictures(traced.render(camera, WIDTH, HEIGHT), before)

    with pytest.raises(VulkanError, match="there is no path"):
        tracer(device, scene, "rt-magic")
    with pytest.raises(VulkanError, match="share from 0 to 1"):
        tracer(device, scene, cache=1.5)
    with pytest.raises(VulkanError, match="samples of 255 bounces"):
        tracer(device, scene, bounces=255)
    with pytest.raises(VulkanError, match="take too many passes"):
        tracer(device, scene, cache=0.1, samples=60000)
    with pytest.raises(VulkanError, match=r"give it \d+ bytes or more, or choose --path rt-paper"):
        tracer(device, scene, cache=0.0)
    with pytest.raises(VulkanError, match="the cache holds 0 of"):
        tracer(device, scene, cache_bytes=traced.slot_bytes - 1)
    with pytest.raises(ValueError, match="group"):
        tracer(device, scene, group=7)


def test13_paper_without_a_cache(device, scene, expected):
    """Rays of rt-paper need no slot."""
    traced = tracer(device, scene, "rt-paper", cache=0.0)
    assert traced.slots == 0
    assert_same_hits(traced.render(camera_of(scene), WIDTH, HEIGHT), expected, scene)
    traced.free()


def test13_paper_keeps_what_most_rays_tested(device, scene):
    traced = tracer(device, scene, "rt-paper", cache=0.3)
    traced.time(camera_of(scene, 2.0), WIDTH, HEIGHT)
    counts = traced._own["counters"].read()
    traced.time(camera_of(scene), WIDTH, HEIGHT)
    held = traced._own["slot_table"].read() < traced.slots
    assert held.sum() == traced.slots < np.count_nonzero(counts)
    assert counts[held].min() >= counts[~held].max() > 0
    traced.free()


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
    for name in ("few", "some", "all", "paper"):
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
    traced = tracer(device, scene, **TRACERS["few"])
    assert traced.pipelines == shared("few").pipelines
    assert not set(traced.pipelines) & {
        p for name in ("all", "paper", "triangles") for p in shared(name).pipelines
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
