"""Path visibility draws the pictures of the hardware's rasteriser; each difference has a cause."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import gltf_ext
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import BITS, ball, open_renderer, zoo

WIDTH, HEIGHT = 331, 257
SUBPIXEL = 1 / 256  # both rasterisers round vertices to this part of a pixel
DEPTHS = 4e-6  # two depths of one surface may differ by so much


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from vk_backend.scene.scene import load_scene

    return load_scene(zoo(tmp_path_factory.mktemp("zoo") / "zoo.glb"))


def made(path, positions, triangles, **material):
    """A scene of one mesh, beside an invisible one: with the attributes of zoo's meshes.

    So it shares zoo's pipelines, which a software driver compiles for many seconds.
    """
    from vk_backend.scene.scene import load_scene

    builder = Builder()
    corners = np.asarray(positions, np.float32)
    upward = np.tile(np.float32([0, 1, 0]), (len(corners), 1))
    gray = np.full((len(corners), 4), 0.5, np.float32)
    builder.mesh(
        {"POSITION": corners, "NORMAL": upward, "COLOR_0": gray},
        np.asarray(triangles, np.uint32),
        material=0,
    )
    sheet, cells = grid_mesh(3, 3)
    normals = np.tile(np.float32([0, 0, 1]), (len(sheet), 1))
    builder.mesh(
        {"POSITION": sheet, "NORMAL": normals, "TEXCOORD_0": sheet[:, :2]}, cells, material=1
    )
    builder.properties.update(
        materials=[material, {"alphaMode": "MASK"}],
        nodes=[{"mesh": 0}, {"mesh": 1, "scale": [0, 0, 0]}],
        scenes=[{"nodes": [0, 1]}],
    )
    gltf_ext.compress(builder.write(path.with_name("raw.glb")), path, **BITS)
    return load_scene(path)


def camera_at(eye, target, near, far=100.0, yfov=1.2):
    from vk_backend.scene.camera import Camera

    return Camera.look_at(np.array(eye), np.array(target), near=near, far=far, yfov=yfov)


# --- differences and their causes ---


def edge_distance(scene, camera, ids, pixels, size):
    """float64[n]: pixels from the centres of `pixels` to the nearest edge of their triangle.

    ids: int[n, 2]; infinite where there is no triangle. The edges are lines in homogeneous pixel
    coordinates, so that triangles across the near plane are no special case.
    """
    distances = np.full(len(pixels), np.inf)
    for number, instance in enumerate(scene.instances):
        of = np.flatnonzero(ids[:, 0] == number)
        decoded = scene.primitives[instance.primitive].decoded()
        row = {int(id): triangle for triangle, id in enumerate(decoded.ids())}
        corners = decoded.triangles[[row[int(id)] for id in ids[of, 1]]]
        points = np.concatenate(
            [decoded.positions[corners].astype(np.float64), np.ones((*corners.shape, 1))], axis=-1
        )
        clip = points @ (camera.world_to_clip(*size) @ instance.matrix).T
        flat = np.stack([(clip[..., k] + clip[..., 3]) * size[k] / 2 for k in range(2)], axis=-1)
        flat = np.concatenate([flat, clip[..., 3:]], axis=-1)
        lines = np.cross(flat, np.roll(flat, -1, axis=1))
        centers = np.concatenate([pixels[of] + 0.5, np.ones((len(of), 1))], axis=1)
        from_lines = np.abs(np.einsum("nkc,nc->nk", lines, centers))
        distances[of] = (from_lines / np.linalg.norm(lines[..., :2], axis=-1)).min(axis=1)
    return distances


def causes(scene, camera, picture, reference):
    """Counts of the pixels that show another triangle, by cause: edge, tie, alpha or other.

    edge: the pixel's centre is within SUBPIXEL of an edge of either triangle. tie: the depths are
    as close as those of one triangle. alpha: either triangle lets pixels through.
    """
    different = (picture.ids != reference.ids).any(axis=2)
    pixels = np.argwhere(different)[:, ::-1]
    size = reference.depth.shape[::-1]
    found = [p.ids[different].astype(np.int64) for p in (picture, reference)]
    edge = np.min(
        [edge_distance(scene, camera, ids, pixels, size) for ids in found], axis=0, initial=np.inf
    )
    masked = np.array([scene.materials[i.material].flags & 6 for i in scene.instances] + [0]) > 0
    alpha = np.any([masked[np.minimum(ids[:, 0], len(masked) - 1)] for ids in found], axis=0)
    depths = np.abs(picture.depth - reference.depth)
    tie = depths[different] <= max(DEPTHS, depths[~different].max(initial=0))
    kinds = np.select([edge <= SUBPIXEL, tie, alpha], ["edge", "tie", "alpha"], "other")
    return Counter(kinds.tolist())


def compare(renderer, scene, camera, size=(WIDTH, HEIGHT), most=1e-3):
    """Draws by paths visibility and vertex; every difference has a cause, and there are few."""
    reference = renderer.render(scene, camera, "vertex", *size)
    picture = renderer.render(scene, camera, "visibility", *size)
    counts = causes(scene, camera, picture, reference)
    assert counts["other"] == 0, counts
    assert counts.total() <= max(most * reference.depth.size, 1), counts
    same = (picture.ids == reference.ids).all(axis=2)
    colors = np.abs(picture.color.astype(int) - reference.color)[same]
    assert (colors > 2).mean() <= 1e-3
    return picture


@pytest.mark.parametrize("culling", [True, False])
@pytest.mark.parametrize("camera", [0, 1], ids=["perspective", "orthographic"])
def test_every_difference_has_a_cause(renderer, scene, camera, culling):
    picture = compare(renderer, scene, scene.cameras[camera])
    other = renderer.render(scene, scene.cameras[camera], "visibility", WIDTH, HEIGHT, culling)
    assert (picture.ids == other.ids).all() and (picture.depth == other.depth).all()


def test_causes_find_a_wrong_triangle(renderer, scene):
    from dataclasses import replace

    camera = scene.cameras[0]
    picture = renderer.render(scene, camera, "vertex", WIDTH, HEIGHT)
    assert causes(scene, camera, picture, picture).total() == 0
    ids, depth = picture.ids.copy(), picture.depth.copy()
    y, x = np.argwhere(picture.ids[..., 0] == 0)[500]
    ids[y, x, 1], depth[y, x] = ids[y, x, 1] ^ 1, depth[y, x] + 0.1
    assert causes(scene, camera, replace(picture, ids=ids, depth=depth), picture)["other"] == 1


@pytest.mark.parametrize(
    "name",
    [
        "bunny.glb",
        "suzanne.glb",
        *(
            pytest.param(name, marks=pytest.mark.full)
            for name in ("materialball.glb", "sponza_like.glb", "DamagedHelmet.glb", "engine.glb")
        ),
    ],
)
def test_real_models(renderer, model, tmp_path, name):
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    gltf_ext.compress(model(name), tmp_path / name)
    loaded = load_scene(tmp_path / name)
    compare(renderer, loaded, Camera.fit_box(loaded.low, loaded.high, 2 * WIDTH, 2 * HEIGHT))


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (2000, 5), (3, 1500)])
def test_pictures_of_any_size(renderer, scene, size):
    compare(renderer, scene, scene.cameras[0], size)


@pytest.mark.parametrize("two_sided", [False, True])
def test_triangles_of_any_size_and_shape(renderer, tmp_path, two_sided):
    """Degenerate ones, slivers, some around the camera, some much larger than the picture."""
    random, count = np.random.default_rng(5), 1500
    size = 10 ** random.uniform(-4, 0.5, (count, 1, 1))
    corners = random.uniform(-1, 1, (count, 1, 3)) + random.normal(size=(count, 3, 3)) * size
    corners[::17, 2] = corners[::17, 1]
    corners[3::17, 2] = (corners[3::17, 0] + corners[3::17, 1]) / 2 + 1e-5
    triangles = np.arange(3 * count).reshape(-1, 3)
    soup = made(tmp_path / "soup.glb", corners.reshape(-1, 3), triangles, doubleSided=two_sided)
    for eye in ((2.5, 1.0, 3.0), (0.0, 0.0, 0.1)):
        compare(renderer, soup, camera_at(eye, (0.0, 0.05, -0.3), 0.05), most=2e-3)


def test_there_are_no_holes_between_meshlets(renderer, tmp_path):
    """From inside a ball, with its triangles across the near plane."""
    positions, triangles = ball(60, 40)
    inside = made(tmp_path / "ball.glb", positions, triangles[:, ::-1])
    random = np.random.default_rng(1)
    for near in (1e-4, 1e-2):
        for distance in (0.0, 0.9):
            direction = random.normal(size=3)
            eye = distance * direction / np.linalg.norm(direction)
            camera = camera_at(eye, eye + np.roll(direction, 1), near)
            assert renderer.render(inside, camera, "visibility", WIDTH, HEIGHT).covered.all()


def test_two_triangles_fill_the_picture(renderer, tmp_path):
    for side in (10.0, 1e3, 1e6):
        corners = [[-side, 0, -side], [side, 0, -side], [side, 0, side], [-side, 0, side]]
        ground = made(tmp_path / "ground.glb", corners, [[0, 3, 2], [0, 2, 1]])
        camera = camera_at((0.0, 1.0, 0.0), (0.3, 0.0, 0.5), 0.1, 1e5)
        assert renderer.render(ground, camera, "visibility", WIDTH, HEIGHT).covered.all()


# --- sizes that change nothing ---


def with_batches(patch, renderer, slots):
    """Later drawings have batches of so many slots, and are not those that were made before."""
    from vk_backend.visibility import batched

    patch.setattr(batched, "SLOTS", slots)
    patch.setattr(renderer, "_drawings", {})


@pytest.mark.parametrize("slots", [1, 20, 64])
def test_batches_change_nothing(renderer, scene, monkeypatch, slots):
    for camera in scene.cameras:
        whole = renderer.render(scene, camera, "visibility", WIDTH, HEIGHT, steps=True)
        assert len(renderer.drawing.batches) == 1
        assert set(whole.steps) == {"clear", "decode", "small", "pieces", "resolve"}
        assert whole.milliseconds == pytest.approx(sum(whole.steps.values()))
        with monkeypatch.context() as patch:
            with_batches(patch, renderer, slots)
            parts = renderer.render(scene, camera, "visibility", WIDTH, HEIGHT)
            assert len(renderer.drawing.batches) > 1 and not parts.steps
        assert (parts.ids == whole.ids).all() and (parts.depth == whole.depth).all()
        assert (parts.color == whole.color).all()


@pytest.mark.parametrize(("small", "pieces"), [(0, 1 << 16), (8, 9)])
def test_the_size_of_a_triangle_changes_nothing(renderer, scene, monkeypatch, small, pieces):
    """Neither which shader draws it, nor whether there is room for its pieces."""
    from vk_backend.visibility import rasterizer

    whole = renderer.render(scene, scene.cameras[0], "visibility", WIDTH, HEIGHT)
    monkeypatch.setattr(rasterizer, "SMALL_PIXELS", small)
    monkeypatch.setattr(rasterizer, "MAX_PIECES", pieces)
    monkeypatch.setattr(renderer, "_drawings", {})
    other = renderer.render(scene, scene.cameras[0], "visibility", WIDTH, HEIGHT)
    assert (other.ids == whole.ids).all() and (other.depth == whole.depth).all()


# --- bulk passes ---


@pytest.mark.parametrize("culling", [True, False])
def test_bulk_passes_decode_what_teams_decode(renderer, scene, monkeypatch, culling):
    """In one batch, and in several: no segment is cut."""
    from vk_backend.decode.decoder import BULK, TEAM
    from vk_backend.visibility import batched

    camera = scene.cameras[0]
    arguments = (scene, camera, "visibility", WIDTH, HEIGHT, culling)
    whole = renderer.render(*arguments)
    assert renderer.drawing.decoder.method is TEAM
    monkeypatch.setattr(batched, "BULK_MESHLETS", 0)
    largest = max(p.meshlets for p in scene.primitives)
    for slots, batches in ((1000, 1), (largest, 4)):
        with_batches(monkeypatch, renderer, slots)
        picture = renderer.render(*arguments)
        assert renderer.drawing.decoder.method is BULK
        assert len(renderer.drawing.batches) == batches
        assert (picture.ids == whole.ids).all() and (picture.color == whole.color).all()
        assert (picture.depth == whole.depth).all()


def test_bulk_passes_need_whole_primitives_and_no_other_streams(renderer, scene, tmp_path):
    from tests.helpers.gltf_builder import everything
    from vk_backend.decode.batches import bulk_fits
    from vk_backend.decode.slots import SlotLayout
    from vk_backend.scene.scene import load_scene

    largest, layout = max(p.meshlets for p in scene.primitives), SlotLayout.of(scene)
    assert bulk_fits(scene, layout, largest) and not bulk_fits(scene, layout, largest - 1)
    values, triangles, _ = everything()
    builder = Builder()
    builder.mesh({name: values[name] for name in ("POSITION", "TANGENT", "TEXCOORD_0")}, triangles)
    for bits, names in ((16, "streams"), (23, "floats")):
        gltf_ext.compress(
            builder.write(tmp_path / "raw.glb"), tmp_path / f"{names}.glb", position_bits=bits
        )
        other = load_scene(tmp_path / f"{names}.glb")
        assert not bulk_fits(other, SlotLayout.of(other), 1000), names


def test_segments_for_bulk_passes():
    from vk_backend.decode.batches import BULK_SLOTS, schedule_whole

    counts = [7, 1, 16, 20, 3, 24]
    batches = schedule_whole(counts, 32)
    segments = [segment for batch in batches for segment in batch]
    assert [(s.instance, s.first, s.meshlets) for s in segments] == [
        (i, 0, count) for i, count in enumerate(counts)
    ]
    assert all(s.slot % BULK_SLOTS == 0 for s in segments)
    for batch in batches:
        ends = [s.slot + s.meshlets for s in batch]
        assert all(end <= s.slot for end, s in zip(ends, batch[1:])) and ends[-1] <= 32
    assert len(batches) == 3
