"""All raster paths draw the same picture, and it is right."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import gltf_ext
from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder, everything, grid_mesh
from tests.helpers.vulkan_scenes import TEXELS, UNLIT, one_sheet, open_renderer, png, zoo

WIDTH, HEIGHT = 160, 120
NO_ID = 0xFFFFFFFF
PATHS = (
    "mesh",
    "mesh-paper",
    "stream",
    "geometry",
)  # tests/vulkan/test_visibility.py compares visibility
SMALL_RING = 20
DEPTH_ROUNDING = 2e-5  # from the last bits of positions
COLOR_ROUNDING = 2  # of 255


@pytest.fixture(scope="module")
def renderer(request):
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from vk_backend.scene.scene import load_scene

    return load_scene(zoo(tmp_path_factory.mktemp("zoo") / "zoo.glb"))


def assert_same(picture, reference):
    """Equal up to rounding; ids may differ at pixels where two triangles have the same depth."""
    assert (picture.covered == reference.covered).all()
    assert np.abs(picture.depth - reference.depth).max() <= DEPTH_ROUNDING
    different = (picture.ids != reference.ids).any(axis=2)
    assert different.mean() < 1e-3
    colors = np.abs(picture.color.astype(int) - reference.color)[~different]
    assert colors.max() <= COLOR_ROUNDING


# --- all paths draw one picture ---


@pytest.mark.parametrize("camera", [0, 1], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("path", PATHS)
def test_paths_agree(renderer, scene, path, camera):
    reference = renderer.render(scene, scene.cameras[camera], "vertex", WIDTH, HEIGHT)
    assert_same(renderer.render(scene, scene.cameras[camera], path, WIDTH, HEIGHT), reference)
    assert set(np.unique(reference.ids[reference.covered][:, 0])) == {0, 1, 2, 3}
    assert (reference.ids[~reference.covered] == NO_ID).all()


@pytest.mark.parametrize("path", PATHS)
def test_pictures_without_ids_are_the_same(renderer, scene, path):
    """Their pipelines differ: nothing reads the numbers of triangles."""
    camera = scene.cameras[0]
    whole, plain = (
        renderer.render(scene, camera, path, WIDTH, HEIGHT, ids=i) for i in (True, False)
    )
    assert (plain.depth == whole.depth).all() and (plain.color == whole.color).all()


@pytest.mark.parametrize("path", ["mesh", "mesh-paper", "stream"])
def test_large_models_are_drawn_in_parts(renderer, model, tmp_path, path, monkeypatch):
    """A draw has at most MAX_WORKGROUPS workgroups."""
    from vk_backend.decode.decoder import Decoder
    from vk_backend.raster import graphics
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    gltf_ext.compress(model("bunny.glb"), tmp_path / "bunny.glb")
    scene = load_scene(tmp_path / "bunny.glb")
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    whole = renderer.render(scene, camera, path, WIDTH, HEIGHT)
    monkeypatch.setattr(graphics, "MAX_WORKGROUPS", 7)
    # Another ring, so that nothing of the first picture is left in its slots.
    monkeypatch.setattr(renderer, "cache", 8000 * Decoder.slot_bytes(scene))
    assert scene.primitives[0].meshlets > 2 * 7 * 32
    parts = renderer.render(scene, camera, path, WIDTH, HEIGHT)
    assert (parts.ids == whole.ids).all() and (parts.color == whole.color).all()


@pytest.mark.parametrize("name", ["bunny.glb", "suzanne.glb"])
@pytest.mark.parametrize("path", PATHS)
def test_paths_agree_on_real_models(renderer, model, tmp_path, path, name):
    _compare(renderer, model(name), tmp_path, path)


@pytest.mark.full
@pytest.mark.parametrize(
    "name", ["materialball.glb", "sponza_like.glb", "DamagedHelmet.glb", "engine.glb", "dragon.glb"]
)
@pytest.mark.parametrize("path", PATHS)
def test_paths_agree_on_more_models(renderer, model, tmp_path, path, name):
    _compare(renderer, model(name), tmp_path, path)


def _compare(renderer, source, folder, path):
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    gltf_ext.compress(source, folder / "model.glb")
    scene = load_scene(folder / "model.glb")
    camera = Camera.fit_box(scene.low, scene.high, 2 * WIDTH, 2 * HEIGHT)
    reference = renderer.render(scene, camera, "vertex", 2 * WIDTH, 2 * HEIGHT)
    assert_same(renderer.render(scene, camera, path, 2 * WIDTH, 2 * HEIGHT), reference)


# --- path stream: reused slots ---


@pytest.mark.parametrize("sections", [1, 2])
@pytest.mark.parametrize("slots", [1, 5, 8, 24, 100])
def test_batches_hold_every_meshlet_once_and_in_order(slots, sections):
    from vk_backend.decode.batches import schedule

    counts = [7, 1, 0, 16]
    batches = schedule(counts, slots, sections)
    meshlets = [
        (s.instance, s.first + i) for batch in batches for s in batch for i in range(s.meshlets)
    ]
    assert meshlets == [
        (instance, m) for instance, count in enumerate(counts) for m in range(count)
    ]
    for number, batch in enumerate(batches):
        begin = number % sections * slots
        used = [s.slot + i for s in batch for i in range(s.meshlets)]
        assert used == list(range(begin, begin + len(used))) and len(used) <= slots
    assert len(batches) == -(-sum(counts) // slots)


def test_large_scenes_get_a_ring_of_two_sections():
    """From OVERLAPPED meshlets on, with at most a third in each."""
    from vk_backend.raster.stream import OVERLAPPED, RING, division

    assert division(OVERLAPPED - 1, RING) == (1, RING)
    assert division(OVERLAPPED, RING) == (2, -(-OVERLAPPED // 3))
    assert division(9000, RING) == (2, 3000)
    assert division(9001, RING) == (2, 3001)
    assert division(10**6, RING) == (2, RING // 2)
    assert division(10**6, 101) == (2, 50)
    assert division(10**6, 1) == (1, 1), "one slot has no halves"


def test_the_manual_names_the_default_slots():
    from vk_backend.raster.stream import RING
    from vk_backend.visibility.batched import SLOTS

    text = (ROOT / "docs" / "vulkan.md").read_text()
    assert f"{SLOTS:,} with `visibility`, {RING:,} with `stream`" in " ".join(text.split())


@pytest.mark.parametrize("culling", [True, False], ids=["culling", "all of it"])
@pytest.mark.parametrize(
    ("ring", "overlap"),
    [(1, False), (SMALL_RING, False), (64, False), (1, True), (7, True), (64, True), (1000, True)],
)
def test_the_ring_changes_nothing(renderer, scene, monkeypatch, ring, overlap, culling):
    """The picture depends neither on the ring's size nor on overlap, nor on an earlier picture."""
    from vk_backend.decode.decoder import Decoder
    from vk_backend.raster import stream

    meshlets = sum(scene.primitives[i.primitive].meshlets for i in scene.instances)
    assert meshlets > 64, "several batches, or one"
    for camera in scene.cameras:
        whole = renderer.render(scene, camera, "stream", WIDTH, HEIGHT, culling=culling)
        assert renderer.drawing.slots == meshlets
        with monkeypatch.context() as patch:
            patch.setattr(renderer, "cache", ring * Decoder.slot_bytes(scene))
            patch.setattr(stream, "OVERLAPPED", 0 if overlap else meshlets + 1)
            patch.setattr(renderer, "_drawings", {})  # not those of another `overlap`
            parts = renderer.render(scene, camera, "stream", WIDTH, HEIGHT, culling=culling)
            assert bool(renderer.drawing.overlap) == (overlap and ring > 1)
            sections, slots = stream.division(meshlets, ring)
            assert renderer.drawing.slots == min(sections * slots, meshlets)
        other = renderer.render(scene, camera, "mesh", WIDTH, HEIGHT, culling=culling)
        for picture in (whole, parts):
            assert (picture.ids == other.ids).all() and (picture.depth == other.depth).all()
            assert np.abs(picture.color.astype(int) - other.color).max() <= COLOR_ROUNDING


@pytest.mark.parametrize(
    "queues", [("only", "only"), ("graphics", "compute")], ids=["one queue", "two queues"]
)
@pytest.mark.parametrize("batches", [1, 2, 3, 8])
def test_overlapped_batches_wait_for_each_other(queues, batches):
    """Runs several frames in random orders that the semaphores allow.

    A batch must find its slots free and be decoded before it is drawn; decoding must run ahead.
    """
    from types import SimpleNamespace

    from vk_backend.frame_commands import overlapped

    graphics, compute = queues
    ring = SimpleNamespace(
        sections=2, decoded=SimpleNamespace(value=0), drawn=SimpleNamespace(value=0)
    )
    commands = [
        (graphics, "start"),
        *(c for i in range(batches) for c in ((compute, ("decode", i)), (graphics, ("draw", i)))),
    ]
    random, ahead = np.random.default_rng(3), 0
    for _ in range(20):
        submissions = overlapped(commands, ring)
        waiting = {queue: [s for s in submissions if s.queue == queue] for queue in queues}
        reached = {
            id(ring.decoded): ring.decoded.value - batches,
            id(ring.drawn): ring.drawn.value - batches - 1,
        }
        done = []
        while any(waiting.values()):
            ready = [
                q
                for q, s in waiting.items()
                if s and (not s[0].wait or reached[id(s[0].wait[0])] >= s[0].wait[1])
            ]
            assert ready, "deadlock"
            submission = waiting[ready[random.integers(len(ready))]].pop(0)
            if submission.commands != "start":
                kind, i = submission.commands
                assert "start" in done
                assert (
                    ("draw", i - 2) in done or i < 2 if kind == "decode" else ("decode", i) in done
                )
                ahead = max(
                    ahead, sum(d[0] == "decode" for d in done) - sum(d[0] == "draw" for d in done)
                )
            done.append(submission.commands)
            timeline, value, _ = submission.signal
            assert value == reached[id(timeline)] + 1
            reached[id(timeline)] = value
        assert len(done) == 1 + 2 * batches
    assert ahead == min(batches, 2), "decoding is ahead of drawing by the ring's sections"


ALL_SHOWN = ("NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0")


# Each row compiles the shaders anew, up to 20 s in a software driver.
@pytest.mark.parametrize(
    ("position_bits", "names"),
    [
        pytest.param(23, ALL_SHOWN, id="23 bits, all attributes"),
        pytest.param(16, (), id="16 bits, positions"),
        pytest.param(16, ALL_SHOWN, id="16 bits, all attributes", marks=pytest.mark.full),
        pytest.param(23, (), id="23 bits, positions", marks=pytest.mark.full),
    ],
)
def test_slots_hold_what_shading_needs(renderer, tmp_path, names, position_bits):
    """With positions too fine for a slot's integers, unused streams in between, positions only."""
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    values, triangles, _ = everything()
    builder = Builder()
    builder.mesh({name: values[name] for name in ("POSITION", *names)}, triangles)
    gltf_ext.compress(
        builder.write(tmp_path / "raw.glb"), tmp_path / "sheet.glb", position_bits=position_bits
    )
    scene = load_scene(tmp_path / "sheet.glb")
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    reference = renderer.render(scene, camera, "vertex", WIDTH, HEIGHT)
    assert reference.covered.any()
    assert_same(renderer.render(scene, camera, "stream", WIDTH, HEIGHT), reference)


@pytest.mark.parametrize(
    ("bits", "words"),
    [
        pytest.param(32, 3 + 2 + 4, id="float32"),
        pytest.param(20, 2 + 2 + 4, id="20 bits", marks=pytest.mark.full),
    ],
)
def test_slots_hold_attributes_of_more_than_64_bits(renderer, tmp_path, monkeypatch, bits, words):
    """Other encoders may write wide normals, texture coordinates and colours."""
    from gltf_ext.attributes import streams as attributes
    from vk_backend.decode.slots import SlotLayout
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    usual = attributes._attribute_streams

    def wide(name, bounds, *rest):
        if name == "POSITION":
            return usual(name, bounds, *rest)
        if bits < 32:
            return [attributes._own_grid(bounds, bits)]
        return [attributes.Stream(attributes.FLOAT32, bounds.shape[1], 32)]

    monkeypatch.setattr(attributes, "_attribute_streams", wide)
    values, triangles, _ = everything()
    builder = Builder()
    builder.mesh(
        {name: values[name] for name in ("POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0")}, triangles
    )
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), tmp_path / "sheet.glb")
    scene = load_scene(tmp_path / "sheet.glb")
    found = {name: a.stream.bits for name, a in scene.primitives[0].attributes.items()}
    del found["POSITION"]
    assert found == {"NORMAL": bits, "TEXCOORD": bits, "COLOR": bits}
    assert SlotLayout.of(scene).attribute_words == words
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    reference = renderer.render(scene, camera, "vertex", WIDTH, HEIGHT)
    assert (
        reference.covered.any()
        and len(np.unique(reference.color[reference.covered], axis=0)) > 1000
    )
    assert_same(renderer.render(scene, camera, "stream", WIDTH, HEIGHT), reference)


def test_a_cache_without_slots_is_refused(renderer, scene, monkeypatch):
    monkeypatch.setattr(renderer, "cache", 100)
    for path in ("stream", "visibility"):
        with pytest.raises(
            MeshletError, match=r"^a cache of 100 bytes holds no meshlet; use \d{4} or more"
        ):
            renderer.render(scene, scene.cameras[0], path, WIDTH, HEIGHT)


# --- the picture is right ---


def software_picture(scene, camera, width, height):
    """Draws the decoded model with numpy in float64.

    Returns (ids int64[height, width, 2], -1 for none; depth float64[height, width]; certain
    bool[height, width]: rounding cannot decide the pixel, because neither a triangle's edge nor a
    second surface is near its centre).
    """
    ids, depth = np.full((height, width, 2), -1), np.full((height, width), np.inf)
    certain = np.ones((height, width), bool)
    for number, instance in enumerate(scene.instances):
        decoded = scene.primitives[instance.primitive].decoded()
        points = np.column_stack(
            [decoded.positions.astype(np.float64), np.ones(len(decoded.positions))]
        )
        clip = points @ (camera.world_to_clip(width, height) @ instance.matrix).T
        screen = (clip[:, :3] / clip[:, 3:] * [width / 2, height / 2, 1]) + [
            width / 2,
            height / 2,
            0,
        ]
        masked = scene.materials[instance.material].base_texture >= 0
        for triangle, id in zip(decoded.triangles, decoded.ids()):
            a, b, c = screen[triangle]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            # Front faces are counter-clockwise with y up: the area is negative with y down.
            front = area < 0 if not instance.mirrored else area > 0
            if area == 0 or not (front or scene.materials[instance.material].double_sided):
                continue
            low = np.clip(
                np.floor(np.minimum(np.minimum(a, b), c)[:2]).astype(int), 0, [width, height]
            )
            high = np.clip(
                np.ceil(np.maximum(np.maximum(a, b), c)[:2]).astype(int), 0, [width, height]
            )
            x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
            if not x.size:
                continue
            wb = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area
            wc = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area
            weights = np.stack([1 - wb - wc, wb, wc], axis=-1)
            edges = np.linalg.norm([(c - b)[:2], (a - c)[:2], (b - a)[:2]], axis=1)
            inset = (weights * abs(area) / edges).min(
                axis=-1
            )  # pixels from the nearest edge, negative outside
            inside, near = inset >= 0, np.abs(inset) < 0.05
            z = weights @ [a[2], b[2], c[2]]
            if masked:
                over_w = weights / clip[triangle, 3]
                place = over_w @ decoded.texcoords[triangle] / over_w.sum(axis=-1, keepdims=True)
                u, v = (
                    np.floor(place[..., 0] * 2).astype(int) % 2,
                    (place[..., 1] >= 0.5).astype(int),
                )
                near |= (np.abs(place * 2 - np.rint(place * 2)) < 0.05).any(axis=-1)
                inside &= TEXELS[v, u, 3] > 127
            view = np.s_[low[1] : high[1], low[0] : high[0]]
            touches = near & (z < depth[view] + 1e-4)
            certain[view] &= ~touches
            closer = inside & (z < depth[view])
            certain[view] &= ~(inside & (np.abs(z - depth[view]) < 1e-4))
            depth[view] = np.where(closer, z, depth[view])
            ids[view] = np.where(closer[..., None], [number, id], ids[view])
    return ids, depth, certain


@pytest.mark.parametrize("camera", [0, 1], ids=["perspective", "orthographic"])
def test_picture_is_what_numpy_draws(renderer, scene, camera):
    picture = renderer.render(scene, scene.cameras[camera], "vertex", WIDTH, HEIGHT)
    ids, depth, certain = software_picture(scene, scene.cameras[camera], WIDTH, HEIGHT)
    covered = ids[..., 0] >= 0
    assert certain[covered].mean() > 0.6 and certain[~covered].mean() > 0.9
    assert (picture.covered == covered)[certain].all()
    both = certain & covered
    assert (picture.ids[both] == ids[both]).all()
    np.testing.assert_allclose(picture.depth[both], depth[both], atol=1e-4)


def test_depth_is_mitsuba_s(renderer, tmp_path):
    """Compares rays through the pixels' centres, apart from silhouettes."""
    from tests.helpers.mitsuba_reference import require
    from vk_backend.scene.scene import load_scene

    path = zoo(tmp_path / "zoo.glb")
    mi, plugin = require("scalar_rgb")
    scene, width, height = load_scene(path), 48, 36
    camera = scene.cameras[0]
    picture = renderer.render(scene, camera, "geometry", width, height)
    traced = plugin.load_scene(str(path), width=width, height=height)
    distance = np.full((height, width), np.inf)
    forward = -camera.to_world[:3, 2]
    back = np.linalg.inv(camera.world_to_clip(width, height))
    for y in range(height):
        for x in range(width):
            target = back @ [2 * (x + 0.5) / width - 1, 2 * (y + 0.5) / height - 1, 1.0, 1.0]
            direction = target[:3] / target[3] - camera.to_world[:3, 3]
            direction /= np.linalg.norm(direction)
            ray = mi.Ray3f(mi.Point3f(*camera.to_world[:3, 3]), mi.Vector3f(*direction))
            found = traced.ray_intersect_preliminary(ray, False)
            if found.is_valid():
                distance[y, x] = float(found.t) * float(direction @ forward)
    # Without the sheet, instance 3: ray_intersect_preliminary ignores its alpha mask.
    seen = picture.covered & np.isfinite(distance) & (picture.ids[..., 0] != 3)
    drawn = camera.distance(picture.depth)
    inner = np.zeros_like(seen)
    inner[1:-1, 1:-1] = True
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        inner &= np.abs(np.roll(drawn, shift, (0, 1)) - drawn) < 0.3
    checked = seen & inner
    assert checked.sum() > 100
    np.testing.assert_allclose(drawn[checked], distance[checked], rtol=2e-4)


# --- materials ---


def _sheet_picture(renderer, path, material, **attributes):
    from vk_backend.scene.scene import load_scene

    scene = load_scene(one_sheet(path, material, **attributes))
    return renderer.render(scene, scene.cameras[0], "vertex", 16, 16)


SIDE = np.linspace(0, 1, 9)
PLACES = np.stack(np.meshgrid(SIDE, SIDE), axis=-1).reshape(-1, 2)


def _srgb(linear):
    linear = np.asarray(linear, np.float64)
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_unlit_base_color(renderer, tmp_path):
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.1, 0.9, 1.0]},
        "extensions": UNLIT,
    }
    picture = _sheet_picture(renderer, tmp_path / "sheet.glb", material)
    assert picture.covered.all()
    np.testing.assert_allclose(
        picture.color[..., :3], np.broadcast_to(_srgb([0.5, 0.1, 0.9]), (16, 16, 3)), atol=1
    )


def test_unlit_texture_has_its_texels_in_place(renderer, tmp_path):
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "extensions": UNLIT}
    picture = _sheet_picture(renderer, tmp_path / "sheet.glb", material, TEXCOORD_0=PLACES)
    # v grows upwards on this sheet, and v = 0 is the image's first row.
    quarters = picture.color[[12, 12, 3, 3], [3, 12, 3, 12], :3]
    assert (quarters == TEXELS.reshape(4, 4)[:, :3]).all()


def test_vertex_colors_are_interpolated(renderer, tmp_path):
    colors = np.column_stack([PLACES, np.zeros(81), np.ones(81)])
    picture = _sheet_picture(
        renderer, tmp_path / "sheet.glb", {"extensions": UNLIT}, COLOR_0=colors
    )
    centers = (np.arange(16) + 0.5) / 16
    np.testing.assert_allclose(picture.color[8, :, 0], _srgb(centers), atol=4)
    np.testing.assert_allclose(picture.color[:, 8, 1], _srgb(centers[::-1]), atol=4)


def test_mask_cuts_and_blend_covers_its_share(renderer, tmp_path):
    texture = {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "extensions": UNLIT,
        "alphaMode": "MASK",
    }
    picture = _sheet_picture(renderer, tmp_path / "sheet.glb", texture, TEXCOORD_0=PLACES)
    assert picture.covered.sum() == 3 * 64 and not picture.covered[:8, 8:].any()
    for alpha in (0.0, 0.25, 0.75, 1.0):
        material = {
            "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, alpha]},
            "alphaMode": "BLEND",
        }
        assert _sheet_picture(renderer, tmp_path / "sheet.glb", material).covered.mean() == alpha


def test_light_falls_from_the_viewer_s_side(renderer, tmp_path):
    """Flat normals if there are none, light on both sides of a sheet, and emission."""
    white = {"pbrMetallicRoughness": {"metallicFactor": 0.0}}
    plain = _sheet_picture(renderer, tmp_path / "sheet.glb", white).color[8, 8, :3].astype(int)
    normals = np.tile([0.0, 0.0, 1.0], (81, 1))
    for direction in (normals, -normals):
        lit = _sheet_picture(renderer, tmp_path / "sheet.glb", white, NORMAL=direction).color[
            8, 8, :3
        ]
        assert np.abs(lit - plain).max() <= COLOR_ROUNDING
    glowing = (
        _sheet_picture(renderer, tmp_path / "sheet.glb", {**white, "emissiveFactor": [1, 0, 0]})
        .color[8, 8, :3]
        .astype(int)
    )
    assert glowing[0] > plain[0] + 10 and np.abs(glowing[1:] - plain[1:]).max() <= COLOR_ROUNDING


# --- culling ---

directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)


@pytest.mark.parametrize("path", ["mesh", "mesh-paper", "stream", "visibility"])
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    eye=directions,
    target=directions,
    distance=st.floats(0.3, 9),
    yfov=st.floats(0.1, 2),
    orthographic=st.booleans(),
)
def test_culling_drops_nothing_visible(
    renderer, scene, path, eye, target, distance, yfov, orthographic
):
    from vk_backend.scene.camera import Camera

    origin, shape = (
        np.array(eye) * distance,
        {"xmag": distance / 2} if orthographic else {"yfov": yfov},
    )
    if np.linalg.norm(origin - target) < 0.1:
        return
    camera = Camera.look_at(origin, target, near=0.05, far=30.0, **shape)
    all_of_it, culled = (
        renderer.render(scene, camera, path, 80, 60, culling=culling) for culling in (False, True)
    )
    assert (all_of_it.ids == culled.ids).all() and (all_of_it.depth == culled.depth).all()


def test_bounds_hold_their_meshlets(renderer, scene):
    """The sphere holds every vertex and the cone every normal; most meshlets have a cone."""
    renderer.render(scene, scene.cameras[0], "mesh", 16, 16)
    words = renderer.drawing.view.buffers.bounds.read(np.uint32)
    at, cones = 0, 0
    for primitive in scene.primitives:
        decoded = primitive.decoded()
        first = 0
        diagonal = np.linalg.norm(primitive.high - primitive.low)
        for count in decoded.meshlet_triangles:
            word = int(words[at])
            corners = decoded.positions[decoded.triangles[first : first + count]].astype(np.float64)
            at, first = at + 1, first + count
            cell = np.array([word, word >> 5, word >> 10]) & 31
            center = primitive.low + (primitive.high - primitive.low) * (cell + 0.5) / 32
            k = word >> 15 & 7
            if k:
                assert np.linalg.norm(corners - center, axis=-1).max() <= diagonal * 2.0**-k
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals = normals[np.linalg.norm(normals, axis=1) > 0]
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            if word >> 28 < 15:
                cones += 1
                x, y = (np.array([word >> 18, word >> 23]) & 31) * 2 / 30 - 1
                z = 1 - abs(x) - abs(y)
                fold = max(-z, 0)
                axis = np.array([x - np.copysign(fold, x), y - np.copysign(fold, y), z])
                axis /= np.linalg.norm(axis)
                cosines = normals @ axis
                assert cosines.min() > 0
                assert np.sqrt(np.maximum(1 - cosines**2, 0)).max() <= (word >> 28) / 14 + 1e-9
    assert at == len(words) and cones > 0.5 * len(words)


# --- memory and hostile bytes ---


def test_vertices_of_too_many_components_are_refused(renderer, tmp_path):
    """Teams need shared memory per element. Paths without teams draw the scene."""
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    sets = 60
    positions, triangles = grid_mesh(6, 5)
    builder = Builder()
    builder.mesh(
        {"POSITION": positions, **{f"TEXCOORD_{i}": positions[:, :2] for i in range(sets)}},
        triangles,
        material=0,
    )
    builder.properties.update(
        images=[{"bufferView": builder.view(png(TEXELS)), "mimeType": "image/png"}],
        textures=[{"source": 0}],
        materials=[
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 9}}}
        ],  # TEXCOORD_9 is the last attribute by name
    )
    gltf_ext.compress(builder.write(tmp_path / "raw.glb"), tmp_path / "sheet.glb")
    scene = load_scene(tmp_path / "sheet.glb")
    camera = Camera.fit_box(scene.low, scene.high, 16, 16)
    for path in ("visibility", "stream", "mesh", "mesh-paper"):
        with pytest.raises(
            MeshletError,
            match=f"^a vertex has {scene.max_elements} elements .* too many for path {path}",
        ):
            renderer.render(scene, camera, path, 16, 16)
    assert renderer.render(scene, camera, "vertex", 16, 16).covered.any()
    if "raytracing" in renderer.device.capabilities:
        from vk_backend.raytrace.tracer import RayTracer

        with pytest.raises(MeshletError, match="too many for path rt on"):
            RayTracer(renderer.device, scene)


def test_resident_memory_is_the_file_s(renderer, model, tmp_path):
    from vk_backend.scene.camera import Camera
    from vk_backend.scene.scene import load_scene

    gltf_ext.compress(model("bunny.glb"), tmp_path / "bunny.glb")
    scene = load_scene(tmp_path / "bunny.glb")
    renderer.render(scene, Camera.fit_box(scene.low, scene.high, 16, 16), "mesh", 16, 16)
    most = 1.05 * scene.compressed_bytes + 65536
    assert scene.compressed_bytes < renderer.resident_bytes <= most


def test_resident_memory_has_the_ring(renderer, scene, monkeypatch):
    """Per slot: positions, at most ten words of attributes, 64 triangles, 52 bytes for decoding."""
    from vk_backend.decode.decoder import Decoder
    from vk_backend.decode.slots import SlotLayout

    renderer.render(scene, scene.cameras[0], "mesh", 16, 16)
    without, slot = renderer.resident_bytes, SlotLayout.of(scene).bytes
    assert 4 * 64 * 3 < slot <= 4 * 64 * (1 + 2 + 10)
    for ring in (SMALL_RING, 64):
        monkeypatch.setattr(renderer, "cache", ring * Decoder.slot_bytes(scene))
        renderer.render(scene, scene.cameras[0], "stream", 16, 16)
        assert 0 <= renderer.resident_bytes - without - ring * (slot + 52) < 4096


def mutated(blob: bytes, random: np.random.Generator) -> bytes | None:
    """Changes bytes after the stream table; None if the check of the header rejects the result."""
    changed = bytearray(blob)
    first = 32 + 28 * blob[5]
    for _ in range(random.integers(1, 6)):
        place = random.integers(first, len(blob) - 8)
        changed[place] = random.choice(
            [0, 255, 127, int(random.integers(256)), changed[place] ^ 1 << int(random.integers(8))]
        )
    try:
        _codec.Decoder(bytes(changed))
    except ValueError:
        return None
    return bytes(changed)


@pytest.mark.parametrize(
    ("path", "ring"),
    [
        *((path, None) for path in (*PATHS, "visibility")),
        ("stream", SMALL_RING),
        ("visibility", "batches"),
        ("visibility", "bulk"),
    ],
)
def test_mutated_blobs_draw_something_and_come_back(renderer, scene, monkeypatch, path, ring):
    from vk_backend.decode.decoder import Decoder
    from vk_backend.visibility import batched

    monkeypatch.setattr(renderer, "_drawings", {})
    if ring == "bulk":
        monkeypatch.setattr(batched, "BULK_MESHLETS", 0)
    elif ring == "batches":
        monkeypatch.setattr(batched, "SLOTS", SMALL_RING)
    elif ring:
        monkeypatch.setattr(renderer, "cache", ring * Decoder.slot_bytes(scene))
    random = np.random.default_rng(5)
    reference = renderer.render(scene, scene.cameras[0], path, 32, 24)
    drawing = renderer.drawing
    blobs = [p.blob for p in scene.primitives]
    drawn = different = 0
    while drawn < 200:
        broken = [mutated(blob, random) for blob in blobs]
        if None in broken:
            continue
        drawing.view.buffers.blobs.write(b"".join(broken))
        picture = renderer.render(scene, scene.cameras[0], path, 32, 24)
        drawn, different = drawn + 1, different + int((picture.ids != reference.ids).any())
    drawing.view.buffers.blobs.write(b"".join(blobs))
    assert different > 20
    assert (renderer.render(scene, scene.cameras[0], path, 32, 24).ids == reference.ids).all()
