"""EXT_mesh_gpu_instancing looks the same as a node for each instance, by every path."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from tests.helpers.gltf_builder import Builder
from tests.helpers.instances import nodes_of, scattered, write_instanced
from tests.helpers.rays import open_device
from tests.helpers.vulkan_scenes import ball, open_renderer

WIDTH, HEIGHT = 160, 120
PATHS = ("visibility", "stream", "mesh", "mesh-paper", "geometry", "vertex")
COUNT = 40


@pytest.fixture(scope="module")
def renderer(request):
    yield from open_renderer()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same scene with the extension, and with a node for each instance."""
    folder = tmp_path_factory.mktemp("instancing")
    places = scattered(COUNT)
    return (
        write_instanced(folder / "one.glb", places),
        write_instanced(folder / "nodes.glb", places, explicit=True),
    )


@pytest.fixture(scope="module")
def scenes(files):
    from vk_backend.scene.scene import load_scene

    return [load_scene(file) for file in files]


def camera_of(scene, width: int = WIDTH, height: int = HEIGHT):
    from vk_backend.scene.camera import Camera

    return Camera.fit_box(scene.low, scene.high, width, height)


def assert_same_place(ids, other, scenes):
    """Both ids name the same meshlet and triangle of a primitive, in the same place."""
    seen = ids[..., 0] != 0xFFFFFFFF
    assert (seen == (other[..., 0] != 0xFFFFFFFF)).all() and seen.mean() > 0.05
    assert (ids[seen][:, 1] == other[seen][:, 1]).all()
    first, second = (
        (scene.instances.matrix[own[seen][:, 0]], scene.instances.primitive[own[seen][:, 0]])
        for scene, own in zip(scenes, (ids, other))
    )
    np.testing.assert_allclose(first[0], second[0], atol=1e-6)
    assert (first[1] == second[1]).all()
    assert len(np.unique(ids[seen][:, 0])) > COUNT // 2


@pytest.mark.parametrize("path", PATHS)
def test_pictures_are_those_of_explicit_nodes(renderer, scenes, path):
    camera = camera_of(scenes[0])
    one, nodes = (renderer.render(s, camera, path, WIDTH, HEIGHT) for s in scenes)
    assert (one.color == nodes.color).mean() > 0.999
    np.testing.assert_allclose(one.depth, nodes.depth, atol=1e-6)
    assert_same_place(one.ids, nodes.ids, scenes)
    plain = renderer.render(scenes[0], camera, path, WIDTH, HEIGHT, ids=False)
    assert (plain.color == one.color).all()


@pytest.mark.parametrize("path", ["mesh", "stream", "vertex", "geometry"])
def test_instances_that_are_alike_take_few_draws(renderer, scenes, path, monkeypatch):
    from vk_backend.gpu import vk
    from vk_backend.raster import graphics

    names = {"vertex": "vkCmdDrawIndexed", "geometry": "vkCmdDraw"}
    calls = []
    device = renderer.device
    if path in names:
        real = getattr(vk, names[path])
        monkeypatch.setattr(vk, names[path], lambda *a: calls.append(real(*a)), raising=False)
    else:
        draw = device.function("vkCmdDrawMeshTasksEXT")
        monkeypatch.setitem(
            device._functions, "vkCmdDrawMeshTasksEXT", lambda *a: calls.append(draw(*a))
        )
    camera = camera_of(scenes[0])
    renderer.render(scenes[0], camera, path, WIDTH, HEIGHT)
    runs = len(scenes[0].instances.runs)
    assert runs < COUNT  # several mirrored ones in a row, and two primitives
    phases = 2 if path == "mesh" else 1
    assert len(calls) == runs * phases
    whole = renderer.render(scenes[0], camera, path, WIDTH, HEIGHT)
    monkeypatch.setattr(graphics, "MAX_WORKGROUPS", 7)
    parts = renderer.render(scenes[0], camera, path, WIDTH, HEIGHT)
    assert (parts.ids == whole.ids).all() and (parts.color == whole.color).all()


@pytest.fixture
def recorded(monkeypatch):
    """The names of the commands that are recorded, without barriers and bindings."""
    from vk_backend.gpu import vk

    names: list[str] = []
    for name in ("vkCmdDispatch", "vkCmdDispatchIndirect"):
        real = getattr(vk, name)
        monkeypatch.setattr(
            vk, name, lambda *a, real=real, name=name: (names.append(name), real(*a))[1]
        )
    return names


def test_commands_of_a_frame_do_not_grow_with_instances(renderer, recorded, tmp_path):
    """Of 20,000, which batches would decode in several parts."""
    from vk_backend.frame_commands import FrameCommands
    from vk_backend.renderer import PATHS
    from vk_backend.scene.drawing import Options
    from vk_backend.scene.scene import load_scene
    from vk_backend.visibility.batched import SLOTS, BatchedDrawing

    scene = load_scene(write_instanced(tmp_path / "many.glb", scattered(10_000), size=(8, 6)))
    assert scene.instance_meshlets.sum() > SLOTS > sum(p.meshlets for p in scene.primitives)
    counts = []
    for make in (PATHS["visibility"][0], BatchedDrawing):
        recorded.clear()
        drawing = make(renderer.device, scene, Options(ids=False))
        drawing.look(camera_of(scene), WIDTH, HEIGHT)
        targets = drawing.targets(renderer.device, WIDTH, HEIGHT, ids=False)
        frame = FrameCommands(drawing, targets)
        counts.append(len(recorded))
        frame.free()
        targets.free()
        drawing.free()
    kept, batched = counts
    assert kept <= 20 and batched > 5  # of each batch


def test_many_instances_decode_each_meshlet_once(renderer, scenes, monkeypatch):
    from vk_backend.visibility import pooled

    camera, meshlets = camera_of(scenes[0]), sum(p.meshlets for p in scenes[0].primitives)
    whole = renderer.render(scenes[0], camera, "visibility", WIDTH, HEIGHT)
    assert whole.pool is None
    monkeypatch.setattr(pooled, "SLOTS", meshlets)
    monkeypatch.setattr(renderer, "_drawings", {})
    for decoded in (meshlets, 0):
        picture = renderer.render(scenes[0], camera, "visibility", WIDTH, HEIGHT)
        assert picture.pool.decoded == decoded
        assert (picture.ids == whole.ids).all() and (picture.color == whole.color).all()


def test_meshlets_are_kept_if_many_instances_share_them(scenes, monkeypatch):
    from vk_backend.visibility import pooled

    assert not pooled.is_shared(scenes[0]), "all fit the slots"
    monkeypatch.setattr(pooled, "SLOTS", sum(p.meshlets for p in scenes[0].primitives))
    assert pooled.is_shared(scenes[0])
    monkeypatch.setattr(pooled, "MOST_TABLES", 1000)
    assert not pooled.is_shared(scenes[0]), "the tables would be too large"


@pytest.mark.parametrize("ring", [7, 50])
@pytest.mark.parametrize("path", ["stream", "visibility"])
def test_a_small_ring(renderer, scenes, path, ring, monkeypatch):
    from vk_backend.raster import stream
    from vk_backend.visibility import batched

    camera = camera_of(scenes[0])
    whole = renderer.render(scenes[0], camera, path, WIDTH, HEIGHT)
    monkeypatch.setattr(batched, "SLOTS", ring)
    monkeypatch.setattr(stream, "RING", ring)
    monkeypatch.setattr(renderer, "_drawings", {})
    parts = renderer.render(scenes[0], camera, path, WIDTH, HEIGHT)
    assert (parts.ids == whole.ids).all() and (parts.color == whole.color).all()


def test_a_pool(renderer, scenes, monkeypatch):
    camera = camera_of(scenes[0])
    whole = renderer.render(scenes[0], camera, "visibility", WIDTH, HEIGHT)
    monkeypatch.setattr(renderer, "cache", 1 << 20)
    for _ in range(2):
        pooled = renderer.render(scenes[0], camera, "visibility", WIDTH, HEIGHT)
        assert (pooled.ids == whole.ids).all() and (pooled.color == whole.color).all()


@pytest.mark.parametrize("path", ["visibility", "mesh"])
def test_levels(renderer, tmp_path, path):
    from vk_backend.scene.scene import load_scene

    places = scattered(COUNT)
    options = {"lod": True, "size": (90, 60)}
    files = [
        write_instanced(tmp_path / f"{explicit}.glb", places, explicit=explicit, **options)
        for explicit in (False, True)
    ]
    pictures = []
    for file in files:
        scene = load_scene(file, levels=True)
        camera = camera_of(scene)
        pictures.append(renderer.render(scene, camera, path, WIDTH, HEIGHT, lod_error=0.5))
    one, nodes = pictures
    assert (one.color == nodes.color).mean() > 0.999
    np.testing.assert_allclose(one.depth, nodes.depth, atol=1e-5)
    assert one.levels.triangles == nodes.levels.triangles > 0


def test_ray_tracing(files, scenes, tmp_path):
    from vk_backend.raytrace.tracer import RayTracer
    from vk_backend.renderer import cache_bytes

    for device in open_device():
        pictures = []
        for scene in scenes:
            for cache in (1.0, 0.4):
                bytes_ = cache_bytes(scene, "rt", cache)
                tracer = RayTracer(device, scene, cache=bytes_)
                pictures.append(tracer.render(camera_of(scene), 64, 48))
                tracer.free()
        one, swept, nodes, _ = pictures
        np.testing.assert_allclose(one.t, nodes.t, rtol=1e-5)
        assert (one.color == nodes.color).mean() > 0.99
        assert (swept.color == one.color).all() and (swept.ids == one.ids).all()
        same = (one.ids[..., 1] == nodes.ids[..., 1]).mean()
        assert same > 0.999  # of hits at the same distance, any


def test_too_many_triangles_for_rays(scenes):
    """Hits have keys of 32 bits."""
    from vk_backend.raytrace.geometry import Geometry, Piece

    large = [replace(p, meshlets=1 << 20) for p in scenes[0].primitives]
    geometry = Geometry.__new__(Geometry)
    geometry._scene = replace(scenes[0], primitives=large)
    pieces = [Piece(0, p, 0, 1) for p in range(len(large))]
    with pytest.raises(MeshletError, match=r"triangles are too many to trace; split the scene"):
        geometry._placed_rows(pieces)
    geometry._scene = scenes[0]
    table, part, piece = geometry._placed_rows(pieces)
    assert len(table) == len(part) == len(piece) == len(scenes[0].instances)


def test_cuts_for_rays_are_limited(files, monkeypatch):
    from vk_backend.levels import cut_scene
    from vk_backend.scene.scene import load_scene

    monkeypatch.setattr(cut_scene, "MAX_CUTS", 3)
    scene = load_scene(files[0], levels=True)
    with pytest.raises(MeshletError, match=r"instances are too many to choose levels for rays"):
        cut_scene.cut_scene(scene, camera_of(scene), 64, 48, 1.0)


def test_a_million_instances(renderer, tmp_path):
    """No Python object for each: seconds to load, and few draws."""
    from vk_backend.scene.scene import load_scene

    side = 1000
    x, z = np.meshgrid(np.arange(side), np.arange(side))
    moves = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3).astype(np.float32)
    positions, triangles = ball(6, 5)
    builder = Builder()
    builder.mesh({"POSITION": positions * np.float32(0.4)}, triangles)
    translation = builder.accessor(moves)
    builder.properties["nodes"][0] |= nodes_of({"TRANSLATION": translation})
    builder.properties["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), tmp_path / "many.glb")
    begin = time.process_time()
    scene = load_scene(tmp_path / "many.glb")
    camera = camera_of(scene)
    assert len(scene.instances) == 1_000_000 and len(scene.instances.runs) == 1
    assert scene.triangles == 1_000_000 * len(triangles)
    assert len(scene.view_points) < 1 << 19
    assert scene.low[0] == pytest.approx(-0.4, abs=1e-3)
    assert scene.high[0] == pytest.approx(999.4, abs=1e-3)
    picture = renderer.render(scene, camera, "vertex", WIDTH, HEIGHT)
    assert time.process_time() - begin < 120
    seen = np.unique(picture.ids[picture.covered][:, 0])
    assert len(seen) > 1000 and seen.max() > 900_000
