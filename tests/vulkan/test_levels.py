"""Levels of detail: cuts, pictures, pools, missing and malformed pages.

By path visibility; then by mesh and mesh-paper, which take their clusters from the same cut.
"""

from __future__ import annotations

import threading
import warnings

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

import gltf_ext
from gltf_ext.checks.samples import distances_to
from gltf_ext.errors import MeshletError
from gltf_ext.lod.cuts import Cut, cut_of
from tests.helpers.culling import Bounds, in_view
from tests.helpers.environment import need_package
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import ball, open_renderer

WIDTH, HEIGHT = 331, 257
AROUND = np.ones((3, 3), bool)  # pixels within one pixel
PLACES = (  # of the ball: near, far and mirrored, stretched
    np.diag([1.0, 1.0, 1.0, 1.0]),
    np.array([[-1.0, 0, 0, 4], [0, 1, 0, 2], [0, 0, 1, -9], [0, 0, 0, 1]]),
    np.array([[1.0, 0, 0, -3], [0, 2, 0, 1], [0, 0, 0.5, -6], [0, 0, 0, 1]]),
)
EYES = (((0, 0, 5), (0, 0, 0)), ((0.3, 0.5, 1.4), (0, 0, 0)), ((-6, 2, -3), (0, 0, -5)))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A closed ball with bumps at PLACES, a sheet beside it, and a small one without levels."""
    need_package("meshoptimizer")
    builder = Builder()
    positions, triangles = ball(160, 90)
    bumps = 1 + 0.03 * np.sin(9 * positions[:, :1]) * np.cos(8 * positions[:, 1:2])
    colors = np.full((len(positions), 4), 0.5, np.float32)
    builder.mesh(
        {"POSITION": positions * bumps, "NORMAL": positions, "COLOR_0": colors},
        triangles,
        material=0,
    )
    for columns, rows in ((90, 60), (3, 3)):
        sheet, cells = grid_mesh(columns, rows)
        sheet[:, 2] = 0.02 * np.sin(12 * sheet[:, 0])
        normals = np.tile(np.float32([0, 0, 1]), (len(sheet), 1))
        attributes = {"POSITION": sheet, "NORMAL": normals, "TEXCOORD_0": sheet[:, :2]}
        builder.mesh(attributes, cells, material=1)
    builder.properties.update(
        materials=[{}, {"doubleSided": True, "alphaMode": "MASK"}],
        nodes=[
            *({"mesh": 0, "matrix": place.T.ravel().tolist()} for place in PLACES),
            {"mesh": 1, "translation": [-3, -2, -3], "scale": [4, 4, 1]},
            {"mesh": 2, "translation": [1, -1.5, 1]},
        ],
        scenes=[{"nodes": list(range(len(PLACES) + 2))}],
    )
    folder = tmp_path_factory.mktemp("levels")
    path = builder.write(folder / "raw.glb")
    gltf_ext.compress(path, folder / "lod.glb", lod=True, page_bytes=4096)
    return folder / "lod.glb"


@pytest.fixture(scope="module")
def renderer():
    yield from open_renderer()


@pytest.fixture(scope="module")
def scene(file):
    from vk_backend.scene.scene import load_scene

    return load_scene(file, levels=True)


@pytest.fixture(scope="module")
def whole(file, renderer):
    """Camera number -> the picture at full detail."""
    from vk_backend.scene.scene import load_scene

    scene = load_scene(file)
    return [renderer.render(scene, camera_at(n), None, WIDTH, HEIGHT) for n in range(len(EYES))]


@pytest.fixture
def pooled(renderer):
    """Function that draws with a pool of some bytes, anew."""

    def draw(scene, bytes_, camera, **options):
        renderer.pages = bytes_
        return renderer.render(scene, camera, None, WIDTH, HEIGHT, **options)

    yield draw
    renderer.pages = None


def chosen_clusters(renderer):
    """uint32[n, 2]: (instance, cluster of its primitive) of the last frame."""
    jobs = renderer.drawing.jobs.jobs()
    return np.stack([jobs["instance"], jobs["number"]], axis=1)


def camera_at(number):
    from vk_backend.scene.camera import Camera

    eye, target = map(np.array, EYES[number])
    return Camera.look_at(eye, target, near=0.1, far=100.0, yfov=0.8)


def outside(tables, camera, matrix, factor):
    """bool[groups]: whether the sphere, its radius times a factor, is outside the view."""
    rows = camera.world_to_clip(WIDTH, HEIGHT) @ matrix
    planes = [rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1]]
    planes = np.array([*planes, rows[2], rows[3] - rows[2]])
    centre = tables.groups["centre"].astype(np.float64)
    distances = centre @ planes[:, :3].T + planes[:, 3]
    sizes = np.linalg.norm(planes[:, :3], axis=1) * tables.groups["radius"][:, None] * factor
    return (distances < -sizes).any(axis=1)


def errors_on_screen(tables, camera, matrix):
    """float64[groups], in pixels, by the formula of the specification."""
    scale = np.linalg.norm(matrix[:3, :3], 2)
    centre = tables.groups["centre"].astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    distance = np.linalg.norm(centre - camera.to_world[:3, 3], axis=1)
    nearest = np.maximum(distance - tables.groups["radius"] * scale, camera.near)
    return tables.groups["error"] * scale * camera.pixels_per_unit(WIDTH, HEIGHT) / nearest


def expected_cut(hierarchies, scene, number, camera, pixels):
    """(clusters of an instance's cut, those of groups that are surely out of view, surely not)"""
    tables = hierarchies.primitives[scene.instances[number].primitive].tables
    matrix = scene.instances[number].matrix
    errors = errors_on_screen(tables, camera, matrix)
    assert np.abs(errors / pixels - 1).min() > 1e-5, "float32 may decide otherwise"
    drawn = cut_of(tables, errors > pixels).drawn
    group = tables.cluster_group
    out = outside(tables, camera, matrix, 1.01)[group]
    maybe = outside(tables, camera, matrix, 0.99)[group]
    return set(np.flatnonzero(drawn & ~maybe)), set(np.flatnonzero(drawn & ~out))


def check_cut(renderer, scene, camera, pixels):
    """Draws with levels; asserts that clusters of all instances are those of the rule."""
    renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=pixels)
    chosen = chosen_clusters(renderer)
    assert len(np.unique(chosen, axis=0)) == len(chosen)
    for instance in range(len(scene.instances)):
        found = set(chosen[chosen[:, 0] == instance, 1])
        surely, possibly = expected_cut(
            renderer.drawing.levels.hierarchies, scene, instance, camera, pixels
        )
        assert surely <= found <= possibly


@pytest.mark.parametrize("number", range(len(EYES)))
@pytest.mark.parametrize("pixels", [0.4, 1.5, 20.0])
def test_cut_is_that_of_the_specification(renderer, scene, number, pixels):
    check_cut(renderer, scene, camera_at(number), pixels)


@pytest.mark.parametrize("pixels", [0.4, 2.0, 10.0])
def test_eye_in_spheres(renderer, scene, pixels):
    """The least distance is one for all groups: the near plane."""
    from vk_backend.scene.camera import Camera

    eye, target = np.array([0.9, 0.1, 0.2]), np.array([0.0, 0.0, 0.0])
    camera = Camera.look_at(eye, target, near=0.3, far=100.0, yfov=0.8)
    check_cut(renderer, scene, camera, pixels)


def assert_within_a_pixel(picture, whole):
    """Surfaces cover the same pixels, but for one at their edges."""
    assert not (picture.covered & ~binary_dilation(whole.covered, AROUND)).any()
    assert not (binary_erosion(whole.covered, AROUND, border_value=1) & ~picture.covered).any()


def world_points(picture, camera, pixels):
    """(float64[n, 3] points that the pixels show, float64[n] size of a pixel there)"""
    row, column = np.nonzero(pixels)
    ndc = np.stack([(column + 0.5) / WIDTH, (row + 0.5) / HEIGHT], axis=1) * 2 - 1
    clip = np.column_stack([ndc, picture.depth[pixels], np.ones(len(ndc))])
    points = clip @ camera.clip_to_world(WIDTH, HEIGHT).T
    points = points[:, :3] / points[:, 3:]
    away = np.linalg.norm(points - camera.to_world[:3, 3], axis=1)
    return points, away / camera.pixels_per_unit(WIDTH, HEIGHT)


@pytest.mark.parametrize("number", [0, 1])
def test_surfaces_are_within_a_pixel_of_each_other(renderer, scene, whole, number):
    """At least 99.9 % of the pixels of the first ball, in both pictures."""
    camera = camera_at(number)
    picture = renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=1.0)
    primitive = renderer.drawing.levels.hierarchies.primitives[0]
    chosen = chosen_clusters(renderer)
    drawn = np.zeros(len(primitive.tables.cluster_group), bool)
    drawn[chosen[chosen[:, 0] == 0, 1]] = True
    pages = np.unique(primitive.tables.groups["page"][primitive.tables.cluster_group[drawn]])
    shown = primitive.mesh(Cut(np.zeros(0, bool), drawn, pages, pages))
    full = primitive.compressed.decode()
    for one, other in ((picture, full), (whole[number], shown)):
        of_ball = one.ids[..., 0] == 0
        points, pixel = world_points(one, camera, of_ball)
        distances = distances_to(points.astype(np.float32), other)
        assert len(points) > 5000 and (distances <= pixel).mean() >= 0.999


@pytest.mark.parametrize("number", range(len(EYES)))
def test_pictures_are_within_a_pixel_of_full_detail(renderer, scene, whole, number):
    camera = camera_at(number)
    picture = renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=1.0)
    levels = picture.levels
    assert levels.allowed_pixels == levels.shown_pixels == 1.0 and levels.missing_pages == 0
    assert 0 < levels.triangles < scene.triangles / 2
    assert_within_a_pixel(picture, whole[number])
    both = picture.covered & whole[number].covered
    near, far = (camera.distance(p.depth) for p in (picture, whole[number]))
    pixel = far / camera.pixels_per_unit(WIDTH, HEIGHT)
    # A pixel aside, a surface that is seen at an angle is nearer or farther by a few.
    close = np.abs(near - far) < 8 * pixel
    assert close[both].mean() > 0.98
    assert (picture.ids[picture.covered][:, 0] < len(scene.instances)).all()


def test_instances_keep_their_numbers(renderer, scene, whole):
    picture = renderer.render(scene, camera_at(0), None, WIDTH, HEIGHT, lod_error=0.5)
    same = (picture.ids[..., 0] == whole[0].ids[..., 0]) | ~picture.covered | ~whole[0].covered
    assert same.mean() > 0.99


def root_bytes(renderer, scene):
    from vk_backend.levels.hierarchies import Hierarchies

    h = Hierarchies(scene)
    return int(h.sizes[h.is_root].sum()), int(h.sizes.sum())


def test_small_pools_raise_the_error(renderer, scene, whole, pooled):
    from vk_backend.gpu.errors import VulkanError

    camera = camera_at(1)
    roots, everything = root_bytes(renderer, scene)
    with pytest.raises(VulkanError, match=f"use {roots}"):
        pooled(scene, roots - 1, camera)
    last = np.inf
    for bytes_ in (roots, roots + 5 * 4096, roots + 20 * 4096, everything * 2):
        picture = pooled(scene, bytes_, camera, lod_error=0.3)
        allowed = picture.levels.allowed_pixels
        assert picture.levels.shown_pixels == allowed <= last
        again = pooled(scene, bytes_, camera, lod_error=0.3)
        assert again.levels.read_bytes == 0 and again.levels.allowed_pixels == allowed
        assert (again.covered == picture.covered).all()
        assert not (binary_erosion(whole[1].covered, iterations=6) & ~picture.covered).any()
        last = allowed
    assert last == np.float32(0.3)


def test_a_moving_camera_evicts_by_use(renderer, scene, pooled):
    roots, _ = root_bytes(renderer, scene)
    sizes = set()
    for number in (0, 1, 2, 1, 0):
        picture = pooled(scene, roots + 10 * 4096, camera_at(number), lod_error=0.5)
        pool = renderer.drawing.levels.pool
        assert picture.levels.missing_pages == 0
        assert (pool.is_resident == (pool.residency.rows != 0xFFFFFFFF)).all()
        sizes.add(renderer.resident_bytes)
    assert len(sizes) == 1


def assert_no_hole(picture, whole, pixels=6):
    assert not (binary_erosion(whole.covered, iterations=pixels) & ~picture.covered).any()


def opened(renderer, file):
    """(scene, its Residency) before any page but the root pages was read."""
    from vk_backend.scene.scene import load_scene

    scene = load_scene(file, levels=True)
    picture = renderer.render(scene, camera_at(0), None, WIDTH, HEIGHT, lod_error=1e6)
    residency = renderer.drawing.levels.pool.residency
    assert picture.levels.read_bytes == 0 and (residency.rows != 0xFFFFFFFF).sum() <= 3
    return scene, residency


@pytest.mark.parametrize("frames_ahead", [0, 1])
def test_pages_are_read_where_the_camera_goes(renderer, file, monkeypatch, frames_ahead):
    """Of the next picture of a camera that comes nearer, no page is missing."""
    from vk_backend.levels import motion
    from vk_backend.scene.camera import Camera

    monkeypatch.setattr(motion, "LEAD_SECONDS", 1e9)
    monkeypatch.setattr(motion, "LEAD_FRAMES", frames_ahead)
    scene, _ = opened(renderer, file)

    def picture(distance, wait):
        eye = np.array([0.0, 0.0, distance])
        camera = Camera.look_at(eye, np.zeros(3), near=0.1, far=100.0, yfov=0.8)
        return renderer.render(scene, camera, None, WIDTH, HEIGHT, wait=wait).levels

    picture(9.0, wait=True)
    levels = picture(6.0, wait=False)
    while levels.missing_pages or renderer.drawing.levels.is_reading:
        levels = picture(6.0, wait=False)
    picture(6.0, wait=False)  # uploads what was read last
    levels = picture(3.0, wait=False)
    if frames_ahead:
        assert levels.missing_pages == 0 and levels.shown_pixels == 1.0
    else:
        assert levels.missing_pages > 0 and levels.shown_pixels > 1.0


def test_a_slot_for_each_cluster_is_never_too_few(renderer, scene, monkeypatch):
    """However many are used, all fit: the allowed error stays."""
    from vk_backend.levels import choice

    camera = camera_at(0)
    renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=0.3)
    cut = renderer.drawing.jobs.cut()
    assert cut["slots"] == renderer.drawing.levels.hierarchies.most_at_once
    listed, used = cut["clusters"] / cut["capacity"], cut["used"] / cut["slots"]
    assert listed < used
    monkeypatch.setattr(choice, "FULL", (listed + used) / 2)
    for _ in range(2):
        picture = renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=0.3, wait=False)
    assert picture.levels.allowed_pixels == np.float32(0.3)


def test_an_error_beyond_floats_shows_the_coarsest_level(renderer, file):
    from vk_backend.scene.scene import load_scene

    scene = load_scene(file, levels=True)
    pictures = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for pixels in (1e6, 1e39):
            pictures.append(
                renderer.render(scene, camera_at(0), None, WIDTH, HEIGHT, lod_error=pixels)
            )
    assert (pictures[0].ids == pictures[1].ids).all()


def test_frames_do_not_wait_for_pages(renderer, file, whole):
    """Pages arrive late: each frame shows coarser clusters instead, never the background."""
    camera, gate = camera_at(1), threading.Semaphore(0)
    renderer.pages = 1 << 20
    try:
        scene, residency = opened(renderer, file)
        read = residency.read

        def late(page):
            gate.acquire()
            return read(page)

        residency.read = late
        missing = []
        for _ in range(12):
            gate.release()
            picture = renderer.render(scene, camera, None, WIDTH, HEIGHT, wait=False)
            assert_no_hole(picture, whole[1])
            missing.append(picture.levels.missing_pages)
        assert missing[0] > 0 and picture.levels.shown_pixels > 1.0
        gate.release(10_000)
        last = renderer.render(scene, camera, None, WIDTH, HEIGHT)
    finally:
        gate.release(10_000)
        renderer.pages = None
    assert missing == sorted(missing, reverse=True)
    assert last.levels.missing_pages == 0 and last.levels.shown_pixels == 1.0
    assert_within_a_pixel(last, whole[1])


def test_failed_pages_leave_coarser_ones(renderer, file, whole):
    for seed in range(3):
        scene, residency = opened(renderer, file)
        read, random = residency.read, np.random.default_rng(seed)

        def fail(page, read=read, random=random):
            if random.random() < 0.3:
                raise MeshletError(f"page {page} is damaged")
            return read(page)

        residency.read = fail
        picture = renderer.render(scene, camera_at(1), None, WIDTH, HEIGHT, lod_error=0.3)
        assert renderer.refused_pages and picture.levels.missing_pages > 0
        assert_no_hole(picture, whole[1])


def test_too_many_clusters_raise_the_error(renderer, file, whole, monkeypatch):
    from vk_backend.levels import choice
    from vk_backend.scene.scene import load_scene

    monkeypatch.setattr(choice, "CLUSTERS", 120)
    scene = load_scene(file, levels=True)
    picture = renderer.render(scene, camera_at(1), None, WIDTH, HEIGHT, lod_error=0.2)
    assert picture.levels.clusters <= 120 and picture.levels.allowed_pixels > 0.2
    assert_no_hole(picture, whole[1])


def test_decoded_clusters_stay(renderer, file, scene, whole):
    """Pictures do not depend on what was decoded before; a camera at rest decodes nothing."""
    from vk_backend.scene.scene import load_scene

    pictures = [renderer.render(scene, camera_at(n), None, WIDTH, HEIGHT) for n in (0, 1, 2, 1, 1)]
    assert pictures[-1].levels.decoded == 0 < pictures[-1].levels.clusters
    fresh = renderer.render(
        load_scene(file, levels=True), camera_at(1), None, WIDTH, HEIGHT, lod_error=1.0
    )
    for picture in pictures[3:]:
        assert (picture.ids == fresh.ids).all(axis=2).mean() > 0.999  # ties
        assert (picture.depth == fresh.depth).all()


@pytest.mark.parametrize("slots", [1, 100, 200])
def test_few_slots_raise_the_error(renderer, file, whole, slots):
    from vk_backend.scene.scene import load_scene
    from vk_backend.visibility.pooled import slot_bytes

    try:
        scene = load_scene(file, levels=True)
        renderer.cache = (slots + 1) * slot_bytes(scene)
        pictures = [
            renderer.render(scene, camera_at(n), None, WIDTH, HEIGHT, lod_error=0.3)
            for n in (0, 1, 2, 1)
        ]
    finally:
        renderer.cache = None
    for number, picture in zip((0, 1, 2, 1), pictures):
        assert picture.levels.allowed_pixels > 0.3
        # One slot is too few: there are as many as the coarsest level needs.
        assert_no_hole(picture, whole[number], 6 if slots > 1 else 60)


def test_instances_share_decoded_clusters(renderer, file):
    from vk_backend.scene.scene import load_scene

    scene = load_scene(file, levels=True)
    picture = renderer.render(scene, camera_at(2), None, WIDTH, HEIGHT, lod_error=1e3, wait=False)
    chosen = chosen_clusters(renderer)
    balls = chosen[chosen[:, 0] < len(PLACES)]
    assert len(np.unique(balls[:, 0])) > 1
    assert picture.levels.decoded <= len(np.unique(balls[:, 1])) + len(chosen) - len(balls)


def test_hidden_clusters_change_no_pixel(renderer, scene):
    """In a flight around and through the balls, at several errors."""
    from vk_backend.scene.camera import Camera

    hidden = []
    for number, t in enumerate(np.linspace(0, 2 * np.pi, 24)):
        eye = np.array([4 * np.sin(t), np.cos(3 * t), 3.5 * np.cos(t)])
        near = (0.1, 0.01)[number % 2]
        camera = Camera.look_at(eye, np.array([0.0, 0.5, -3.0]), near=near, far=100.0, yfov=0.8)
        if number % 5 == 4:
            camera = Camera(camera.to_world, None, 4.0, near, 100.0)
        pictures = []
        for renderer.occlusion in (False, True):
            picture = renderer.render(
                scene, camera, None, WIDTH, HEIGHT, lod_error=(0.5, 2.0)[number // 12]
            )
            pictures.append(picture)
        without, picture = pictures
        assert (picture.depth == without.depth).all()
        assert (picture.ids == without.ids).all(axis=2).mean() > 0.9995  # ties
        assert without.levels.hidden == 0 <= without.levels.triangles - picture.levels.triangles
        hidden.append(picture.levels.hidden)
    assert np.count_nonzero(hidden) > 6 and max(hidden) > 10


@pytest.mark.parametrize("number", [0, 2])
def test_rays_meet_the_cut_of_the_camera(renderer, scene, whole, number):
    """The same clusters as path visibility, each instance with its own cut."""
    from vk_backend.levels.cut_scene import cut_scene
    from vk_backend.raytrace.tracer import RayTracer
    from vk_backend.renderer import cache_bytes

    camera = camera_at(number)
    cut = cut_scene(scene, camera, WIDTH, HEIGHT, 1.5)
    assert cut.triangles < scene.triangles / 2 and not cut.has_levels
    tracer = RayTracer(renderer.device, cut)
    traced = tracer.render(camera, WIDTH, HEIGHT)
    tracer.free()
    drawn = renderer.render(scene, camera, None, WIDTH, HEIGHT, lod_error=1.5)
    covered = traced.ids[..., 0] != 0xFFFFFFFF
    both = covered & drawn.covered
    assert both.sum() > 0.99 * (covered | drawn.covered).sum()
    clusters = [ids[both] // np.uint32([1, 64]) for ids in (traced.ids, drawn.ids)]
    assert (clusters[0] == clusters[1]).all(axis=1).mean() > 0.995
    parts = RayTracer(renderer.device, cut, cache=cache_bytes(cut, "rt", 0.3))
    assert (parts.render(camera, WIDTH, HEIGHT).ids == traced.ids).all()
    parts.free()


def test_the_default_path_has_levels(renderer, scene, monkeypatch):
    """On a device without 64-bit atomics, paths stream and vertex are no choice."""
    from vk_backend.gpu.errors import VulkanError

    has = renderer.device.capabilities
    monkeypatch.setattr(renderer.device, "capabilities", has - {"atomics64"})
    assert renderer.default_path(scene) == "mesh"
    assert renderer.render(scene, camera_at(0), None, WIDTH, HEIGHT).tasks is not None
    monkeypatch.setattr(renderer.device, "capabilities", has - {"atomics64", "mesh"})
    message = r"neither 64-bit atomics nor mesh shaders.*; choose another --device, or leave out"
    with pytest.raises(VulkanError, match=message):
        renderer.render(scene, camera_at(0), None, WIDTH, HEIGHT)


def test_other_paths_have_no_levels(renderer, scene):
    from vk_backend.gpu.errors import VulkanError

    with pytest.raises(VulkanError, match="no levels"):
        renderer.render(scene, camera_at(0), "vertex", WIDTH, HEIGHT)


def mutated(blob, random):
    """Page bytes with three other bytes, not in the header, which the host always checks."""
    changed = np.frombuffer(blob, np.uint8).copy()
    at = random.integers(len(blob) // 8, len(blob), 3)
    changed[at] ^= random.integers(1, 256, 3, np.uint8)
    return changed.tobytes()


@pytest.mark.parametrize("checked", [False, True])
def test_mutated_pages(renderer, file, whole, checked):
    """The shaders stay in bounds even if the host checks nothing. If it does, it refuses pages."""
    scene, residency = opened(renderer, file)
    hierarchies, random = renderer.drawing.levels.hierarchies, np.random.default_rng(5)

    def read(page):
        blob = hierarchies.blob(page)
        if not checked:
            return mutated(blob, random)
        for _ in range(20):  # few mutations leave a page well-formed
            if page % 3 == 0:
                hierarchies.check(page, mutated(blob, random))
        return blob

    residency.read = read
    picture = renderer.render(scene, camera_at(1), None, WIDTH, HEIGHT, lod_error=0.3)
    assert np.isfinite(picture.depth).all()
    if checked:
        assert renderer.refused_pages
        assert_no_hole(picture, whole[1])


def test_mutated_tables(renderer, file, tmp_path):
    """Tables are refused, or describe a hierarchy that the shaders can draw."""
    from gltf_ext.lod import open_lod
    from vk_backend.scene.scene import load_scene

    data, random, drawn = file.read_bytes(), np.random.default_rng(7), 0
    tables = open_lod(file)[0].tables.to_bytes()
    begin = data.index(tables)
    assert data.count(tables) == 1
    for number in range(60):
        mutated = bytearray(data)
        at = begin + int(random.integers(0, len(tables)))
        mutated[at] ^= 1 << int(random.integers(0, 8))
        path = tmp_path / f"{number}.glb"
        path.write_bytes(mutated)
        try:
            scene = load_scene(path, levels=True)
            picture = renderer.render(scene, camera_at(1), None, WIDTH, HEIGHT, lod_error=0.5)
        except MeshletError:
            continue
        assert np.isfinite(picture.depth).all()
        drawn += 1
    assert drawn > 0


# --- paths mesh and mesh-paper ---

MESH_PATHS = ("mesh", "mesh-paper")


def visible_jobs(renderer, scene, camera):
    """(surely, possibly): how many of the clusters that were chosen last are in view."""
    from vk_backend.scene.buffers import PRIMITIVE

    jobs, pool = renderer.drawing.jobs.jobs(), renderer.drawing.levels.pool
    rows = pool.rows.read(PRIMITIVE)[jobs["row"]]
    words = pool._bounds.read(np.uint32)[rows["first_meshlet"] + jobs["meshlet"]]
    bounds = Bounds.of(words, rows["box_low"][:, :3], rows["box_size"][:, :3])
    counts = np.zeros(2, int)
    for number in range(len(scene.instances)):
        own = jobs["instance"] == number
        part = Bounds(
            *(getattr(bounds, name)[own] for name in ("center", "radius", "axis", "sine"))
        )
        counts += [found.sum() for found in in_view(part, scene, number, camera, (WIDTH, HEIGHT))]
    return counts


def assert_same_surfaces(picture, reference):
    """Two rasterisers, and clusters in another order: ids differ where depths are the same."""
    assert (picture.covered != reference.covered).mean() < 2e-4
    both = picture.covered & reference.covered
    assert (np.abs(picture.depth - reference.depth)[both] <= 2e-5).mean() > 0.9995
    assert (picture.ids == reference.ids).all(axis=2).mean() > 0.9995
    near = np.abs(picture.color.astype(int) - reference.color).max(axis=2) <= 2
    assert near.mean() > 0.9995


@pytest.mark.parametrize("pixels", [0.4, 1.5])
@pytest.mark.parametrize("path", MESH_PATHS)
def test_mesh_paths_draw_the_cut(renderer, scene, path, pixels):
    """The clusters and pictures of path visibility; counters as of a test on the CPU."""
    for number in range(len(EYES)):
        camera = camera_at(number)
        reference = renderer.render(scene, camera, "visibility", WIDTH, HEIGHT, lod_error=pixels)
        expected = set(map(tuple, chosen_clusters(renderer)))
        for _ in range(3):
            picture = renderer.render(scene, camera, path, WIDTH, HEIGHT, lod_error=pixels)
            assert set(map(tuple, chosen_clusters(renderer))) == expected
            assert_same_surfaces(picture, reference)
            tasks, levels = picture.tasks, picture.levels
            assert tasks.tested == levels.clusters == len(expected)
            surely, possibly = visible_jobs(renderer, scene, camera)
            assert surely <= tasks.launched + tasks.hidden <= possibly
            assert levels.triangles <= 64 * tasks.launched and levels.hidden == tasks.hidden
            assert levels.missing_pages == 0


@pytest.mark.parametrize("path", MESH_PATHS)
def test_mesh_paths_hide_no_visible_cluster(renderer, scene, path, monkeypatch):
    from vk_backend.scene.camera import Camera

    hidden = []
    for t in np.linspace(0, 2 * np.pi, 16):
        eye = np.array([4 * np.sin(t), np.cos(3 * t), 3.5 * np.cos(t)])
        camera = Camera.look_at(eye, np.array([0.0, 0.5, -3.0]), near=0.1, far=100.0, yfov=0.8)
        pictures = []
        for occlusion in (False, True):
            monkeypatch.setattr(renderer, "occlusion", occlusion)
            picture = renderer.render(scene, camera, path, WIDTH, HEIGHT, lod_error=0.5)
            pictures.append(picture)
        without, picture = pictures
        assert (picture.depth == without.depth).all()
        assert (picture.ids == without.ids).all(axis=2).mean() > 0.9995  # ties
        assert without.tasks.hidden == 0
        assert without.tasks.launched == picture.tasks.launched + picture.tasks.hidden
        hidden.append(picture.tasks.hidden)
    assert np.count_nonzero(hidden) > 4 and max(hidden) > 10


@pytest.mark.parametrize("path", MESH_PATHS)
def test_mesh_paths_without_ids(renderer, scene, path):
    """The fragment shader needs a triangle's instance even then."""
    whole, plain = (
        renderer.render(scene, camera_at(0), path, WIDTH, HEIGHT, ids=ids) for ids in (True, False)
    )
    assert (plain.depth == whole.depth).all()
    assert (plain.color == whole.color).all(axis=2).mean() > 0.9995  # ties


@pytest.mark.parametrize("path", MESH_PATHS)
def test_mesh_paths_keep_to_their_pools(renderer, scene, whole, path, monkeypatch):
    roots, _ = root_bytes(renderer, scene)
    monkeypatch.setattr(renderer, "pages", roots + 5 * 4096)
    sizes = set()
    for number in (0, 1, 2, 1):
        picture = renderer.render(scene, camera_at(number), path, WIDTH, HEIGHT, lod_error=0.3)
        assert picture.levels.shown_pixels == picture.levels.allowed_pixels > 0.3
        assert_no_hole(picture, whole[number])
        sizes.add(renderer.resident_bytes)
    assert len(sizes) == 1


def test_mesh_paths_free_their_buffers(renderer, file):
    from vk_backend.gpu.memory import Buffer
    from vk_backend.scene.scene import load_scene

    live = []
    for _ in range(3):  # a new scene frees the drawings of the last one
        scene = load_scene(file, levels=True)
        renderer.render(scene, camera_at(0), "mesh", WIDTH, HEIGHT)
        owners = [getattr(action, "__self__", None) for action in renderer.device._closing]
        live.append(sum(isinstance(owner, Buffer) for owner in owners))
    assert live[1] == live[2]


@pytest.mark.parametrize("path", MESH_PATHS)
def test_mesh_paths_with_mutated_pages(renderer, file, path):
    from vk_backend.scene.scene import load_scene

    scene = load_scene(file, levels=True)
    renderer.render(scene, camera_at(0), path, WIDTH, HEIGHT, lod_error=1e6)
    hierarchies, random = renderer.drawing.levels.hierarchies, np.random.default_rng(5)
    renderer.drawing.levels.pool.residency.read = lambda page: mutated(
        hierarchies.blob(page), random
    )
    for number in (1, 2, 0):
        picture = renderer.render(scene, camera_at(number), path, WIDTH, HEIGHT, lod_error=0.3)
        assert np.isfinite(picture.depth).all()
