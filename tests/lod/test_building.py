"""compress with levels: level 0 stays what it was, and every kind of model gets levels."""

import json
from itertools import pairwise

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document.container import read_document
from gltf_ext.encode import levels
from gltf_ext.lod import LodPrimitive, cut_at_level, error_of, open_lod
from gltf_ext.lod import builder as levels_builder
from gltf_ext.lod.tables import EXTENSION
from gltf_ext.lod.writing import _separate_points
from spec import reference_lod
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, wavy_sheet
from tests.helpers.lod import Certifier


@pytest.fixture(scope="module", autouse=True)
def simplifier_package():
    environment.need_package("meshoptimizer")


@pytest.fixture(autouse=True)
def outputs_are_valid(tmp_path):
    """Every file with levels that a test writes is valid; its cuts cover the surface once."""
    yield
    for path in tmp_path.glob("*.glb"):
        if EXTENSION.encode() in path.read_bytes():
            assert gltf_ext.validate(path) == [], path.name


def sheet_file(path, **attributes):
    points, triangles = wavy_sheet(60)
    builder = Builder()
    builder.mesh({"POSITION": points, **attributes}, triangles)
    return builder.write(path)


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    return sheet_file(tmp_path_factory.mktemp("sheet") / "sheet.glb")


@pytest.fixture(scope="module")
def with_levels(sheet):
    output = sheet.with_name("levels.glb")
    gltf_ext.compress(sheet, output, lod=True)
    return output


def test_level_0_is_the_model(sheet, with_levels):
    report = gltf_ext.verify(sheet, with_levels)
    assert report["ok"] and report["triangles_equal"]
    assert len(report["levels"]) >= 3
    assert gltf_ext.validate(with_levels) == []


def test_the_reference_reader_finds_nothing_wrong(tmp_path):
    points, triangles = wavy_sheet(44)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "small.glb")
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True, page_bytes=4096)
    data = (tmp_path / "out.glb").read_bytes()
    (primitive,) = reference_lod.read_file(data)
    assert len(primitive.blobs) > 2
    assert reference_lod.problems(data) == []


def test_levels_shrink_to_little(with_levels):
    (primitive,) = open_lod(with_levels)
    counts = [
        int(primitive.cluster_triangles[cut_at_level(primitive.tables, k).drawn].sum())
        for k in range(primitive.tables.level_count)
    ]
    assert counts[0] == 7200 and counts[-1] <= 200
    assert all(b < 0.5 * a for a, b in pairwise(counts))


@pytest.mark.parametrize("size, pays", [(24, False), (220, True)])
def test_compress_says_where_levels_do_not_pay(tmp_path, size, pays):
    points, triangles = wavy_sheet(size)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "sheet.glb")
    report = gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    assert ("do not pay" in " ".join(report["warnings"])) is not pays


def test_the_extension_is_optional(with_levels):
    document = read_document(with_levels)
    assert EXTENSION in document.extensionsUsed
    assert EXTENSION not in document.extensionsRequired


def test_tables_come_first_then_coarse_pages_then_level_0(with_levels):
    document = read_document(with_levels)
    extensions = document.primitive(0, 0)["extensions"]
    lod = extensions[EXTENSION]
    views = [lod["bufferView"], lod["pages"]["bufferView"]]
    views.append(extensions["EXT_meshlet_edgebreaker"]["bufferView"])
    offsets = [document.bufferViews[view].get("byteOffset", 0) for view in views]
    assert offsets == sorted(offsets) and offsets[0] == 0


def test_a_file_without_its_levels_is_valid(with_levels, tmp_path, khronos):
    document = read_document(with_levels)
    del document.primitive(0, 0)["extensions"][EXTENSION]
    document.forget_extension(EXTENSION)
    from gltf_ext.document.container import model_files
    from gltf_ext.files import write_files

    path = tmp_path / "dropped.glb"
    write_files(model_files(document, path), input_files=())
    assert gltf_ext.validate(path) == []
    assert path.stat().st_size < with_levels.stat().st_size
    for file in (path, with_levels):
        assert khronos([file])[str(file)]["errors"] == []


def test_an_unknown_version_is_ignored(with_levels, tmp_path):
    path = changed(with_levels, tmp_path, version=2, bufferView=12345, pages="new")
    assert gltf_ext.load(path)[0].indices.shape == (7200, 3)
    assert not isinstance(open_lod(path)[0], LodPrimitive)
    report = gltf_ext.decompress(path, tmp_path / "plain.glb", level=3)
    assert report["triangles"] == 7200


def changed(file, folder, **properties):
    """A .gltf beside its buffer, with other properties of the extension object."""
    document = read_document(file)
    document.primitive(0, 0)["extensions"][EXTENSION].update(properties)
    (folder / "buffer.bin").write_bytes(bytes(document.bytes_of_buffer(0)))
    document.buffers[0]["uri"] = "buffer.bin"
    path = folder / "changed.gltf"
    path.write_bytes(document.to_json())
    return path


def test_bytes_do_not_depend_on_threads(sheet, with_levels, tmp_path):
    for threads in (1, 2, 5):
        output = tmp_path / f"{threads}.glb"
        gltf_ext.compress(sheet, output, lod=True, threads=threads)
        assert output.read_bytes() == with_levels.read_bytes()


def test_compressing_again_replaces_the_levels(with_levels, tmp_path):
    plain, again = tmp_path / "plain.glb", tmp_path / "again.glb"
    gltf_ext.compress(with_levels, plain)
    assert EXTENSION not in read_document(plain).extensionsUsed
    assert not isinstance(open_lod(plain)[0], LodPrimitive)
    gltf_ext.compress(with_levels, again, lod=True)
    assert isinstance(open_lod(again)[0], LodPrimitive)
    assert gltf_ext.validate(again) == []


def test_pages_keep_their_limit(sheet, tmp_path):
    output = tmp_path / "out.glb"
    gltf_ext.compress(sheet, output, lod=True, page_bytes=4096)
    (primitive,) = open_lod(output)
    assert primitive.tables.pages["byteLength"].max() <= 4096
    assert len(primitive.tables.pages) > 4


@pytest.mark.parametrize("is_noisy", [False, True])
@pytest.mark.parametrize("page_bytes", [4096, 16384])
def test_a_pilot_saves_building_twice(page_bytes, is_noisy, tmp_path, monkeypatch):
    """Groups of the usual size do not fit into the smaller pages, or not where there is noise."""
    points, _ = wavy_sheet(60)
    noise = np.random.default_rng(0).random((len(points), 4), np.float32)
    noise[np.linalg.norm(points[:, :2] - points[0, :2], axis=1) > 0.5] = 0.5
    sheet = sheet_file(tmp_path / "sheet.glb", **({"_X": noise} if is_noisy else {}))
    fractions = []  # of the progress after each level: it would begin anew

    def spied(*arguments):
        return levels_builder.build_levels(*arguments[:-1], fractions.append)

    monkeypatch.setattr(levels, "build_levels", spied)
    gltf_ext.compress(sheet, tmp_path / "out.glb", lod=True, page_bytes=page_bytes)
    assert len(fractions) > 1 and (np.diff(fractions) > 0).all()
    (primitive,) = open_lod(tmp_path / "out.glb")
    assert primitive.tables.pages["byteLength"].max() <= page_bytes


def test_a_model_of_small_parts_has_no_wild_first_level(tmp_path):
    """Some of its groups lose seven hundredths of its size in a step of five."""
    path = environment.MODELS / "DamagedHelmet.glb"
    if not path.is_file():
        environment.missing(f"no model {path}")
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True, position_bits=12, normal_bits=8)
    (primitive,) = open_lod(tmp_path / "out.glb")
    tables = primitive.tables
    cut = cut_at_level(tables, 1)
    side = np.ptp(primitive.compressed.decode().attributes["POSITION"], axis=0).max()
    assert primitive.cluster_triangles[cut.drawn].sum() < 0.4 * primitive.compressed.triangle_count
    assert error_of(tables, cut) < 0.04 * side


def test_pages_keep_the_order_of_levels(sheet, tmp_path):
    gltf_ext.compress(sheet, tmp_path / "out.glb", lod=True, lod_group=4, page_bytes=4096)
    (primitive,) = open_lod(tmp_path / "out.glb")
    tables = primitive.tables
    assert len(np.unique(tables.group_level)) > 2 and len(tables.pages) > 3
    assert (np.diff(tables.group_level) <= 0).all()
    assert (np.diff(tables.groups["page"].astype(int)) >= 0).all()


def test_groups_of_a_level_come_by_error(sheet, tmp_path):
    gltf_ext.compress(sheet, tmp_path / "out.glb", lod=True, lod_group=4)
    (primitive,) = open_lod(tmp_path / "out.glb")
    tables = primitive.tables
    errors = tables.groups["error"][tables.group_level == 1]
    assert 4 < len(errors) <= 48  # kBlockGroups of level_pages.cpp
    assert (np.diff(errors) <= 0.0).all()


def test_heavy_vertices_get_smaller_groups(tmp_path):
    """Groups that would not fit a page are split."""
    random = np.random.default_rng(0)
    points, _ = wavy_sheet(60)
    extra = {f"_N{i}": random.random((len(points), 4), np.float32) for i in range(8)}
    path = sheet_file(tmp_path / "heavy.glb", **extra)
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    (primitive,) = open_lod(tmp_path / "out.glb")
    assert primitive.tables.pages["byteLength"].max() <= 32768
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]


def test_every_attribute_reaches_every_level(tmp_path):
    random = np.random.default_rng(0)
    points, triangles = wavy_sheet(40)
    count = len(points)
    normals = np.tile(np.float32([0, 0, 1]), (count, 1))
    attributes = {
        "POSITION": points,
        "NORMAL": normals,
        "TANGENT": np.tile(np.float32([1, 0, 0, -1]), (count, 1)),
        "TEXCOORD_0": (points[:, :2] / 40).astype(np.float32),
        "COLOR_0": (random.random((count, 4)) * 255).astype(np.uint8),
        "JOINTS_0": np.zeros((count, 4), np.uint8),
        "WEIGHTS_0": np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
        "_CUSTOM": random.random((count, 1), np.float32),
    }
    lift = np.zeros_like(points)
    lift[:, 2] = 5 * np.sin(points[:, 0])
    builder = Builder()
    builder.mesh(attributes, triangles, targets=[{"POSITION": lift}], normalized={"COLOR_0"})
    path = builder.write(tmp_path / "all.glb")
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    (primitive,) = open_lod(tmp_path / "out.glb")
    finest = primitive.compressed.decode()
    rows = np.hstack([v.astype(np.float64) for _, v in finest.arrays])
    known = {row.tobytes() for row in rows}
    for level in range(1, primitive.tables.level_count):
        mesh = primitive.mesh(cut_at_level(primitive.tables, level))
        values = np.hstack([v.astype(np.float64) for _, v in mesh.arrays])
        assert {row.tobytes() for row in values} <= known  # vertices are picked, not moved


def test_stated_errors_are_near_measured_ones(tmp_path):
    """They are measured against level 0. Sums over the levels would be more than twice as large."""
    points, triangles = wavy_sheet(150)
    points[:, 2] += np.random.default_rng(0).normal(size=len(points)).astype(np.float32)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "rough.glb")
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    levels = gltf_ext.verify(path, tmp_path / "out.glb")["levels"]
    assert len(levels) >= 4
    for level in levels:
        assert level["share_within"] >= 0.999
        assert level["stated_error"] <= 2.0 * level["measured_error"]


def test_errors_hold_with_morph_targets(tmp_path):
    """A target that bends what is flat: the error at weight 1 counts."""
    points, triangles = wavy_sheet(60, height=0.0)
    lift = np.zeros_like(points)
    lift[:, 2] = 3 * np.sin(points[:, 0] / 2) * np.sin(points[:, 1] / 3)
    stated = []
    for targets in ([], [{"POSITION": lift}]):
        builder = Builder()
        builder.mesh({"POSITION": points}, triangles, targets=targets)
        path = builder.write(tmp_path / f"{len(targets)}.glb")
        gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
        (primitive,) = open_lod(tmp_path / "out.glb")
        error = primitive.tables.groups["error"]
        stated.append(error[np.isfinite(error)].max())
    assert stated[0] < 0.1 < stated[1]


def test_small_and_stubborn_primitives_are_reported(tmp_path):
    """A few triangles, and loose ones of which none can go, have one level."""
    points, triangles = wavy_sheet(3)
    loose = np.random.default_rng(0).random((900, 3), np.float32)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    builder.mesh({"POSITION": loose}, np.arange(900, dtype=np.uint32))
    big, faces = wavy_sheet(40)
    builder.mesh({"POSITION": big}, faces)
    builder.properties["nodes"] = [{"mesh": m} for m in range(3)]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2]}]
    path = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    levels = [len(p["triangles"]) for p in report["lod"]]
    assert levels[0] == 1 and levels[2] > 2
    kinds = [isinstance(p, LodPrimitive) for p in open_lod(tmp_path / "out.glb")]
    assert kinds == [n > 1 for n in levels]
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]


def test_triangles_without_extent_stay_in_level_0(tmp_path):
    """A grid so coarse that many triangles collapse."""
    points, triangles = wavy_sheet(60)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "in.glb")
    output = tmp_path / "out.glb"
    gltf_ext.compress(path, output, lod=True, position_bits=5)
    assert gltf_ext.verify(path, output)["triangles_equal"]
    (primitive,) = open_lod(output)
    certifier = Certifier(primitive)
    for level in range(primitive.tables.level_count):
        drawn = cut_at_level(primitive.tables, level).drawn
        assert certifier.has_no_cracks(drawn) and certifier.covers_once(drawn)


def vertices_of_level_1(path, output, **options):
    """(values of the vertices of level 1, number of their positions)."""
    gltf_ext.compress(path, output, lod=True, **options)
    (primitive,) = open_lod(output)
    mesh = primitive.mesh(cut_at_level(primitive.tables, 1))
    rows = np.unique(np.hstack([v.astype(np.float64) for _, v in mesh.arrays]), axis=0)
    return rows, len(np.unique(mesh.attributes["POSITION"], axis=0))


def test_edges_that_lose_their_length_make_no_seams(tmp_path):
    """Normals that differ inside a cell of the grid would be kept, and lock its vertex."""
    random = np.random.default_rng(0)
    points, triangles = wavy_sheet(100)
    points += random.uniform(-0.5, 0.5, points.shape).astype(np.float32)
    normals = (np.float32([0, 0, 3]) + random.normal(size=points.shape)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    path = builder.write(tmp_path / "in.glb")
    rows, positions = vertices_of_level_1(path, tmp_path / "out.glb", position_bits=7)
    assert len(rows) <= 1.05 * positions  # 1.24 if they were


def test_seams_inside_a_cell_stay(tmp_path):
    """Two halves of a sheet with normals of their own: only edges join vertices."""
    points, triangles = wavy_sheet(60)
    is_second = points[triangles[:, 0], 0] + points[triangles[:, 1], 0] >= 60
    faces = triangles + np.uint32(len(points)) * is_second[:, None].astype(np.uint32)
    normals = np.repeat(np.float32([[0, 0, 1], [0, 1, 0]]), len(points), axis=0)
    builder = Builder()
    builder.mesh({"POSITION": np.tile(points, (2, 1)), "NORMAL": normals}, faces)
    path = builder.write(tmp_path / "in.glb")
    rows, positions = vertices_of_level_1(path, tmp_path / "out.glb", position_bits=5)
    assert len(rows) > positions


def test_surfaces_that_touch_on_the_grid_are_simplified_apart(tmp_path):
    """Both sides of a sheet that is thinner than a cell keep normals of their own."""
    points, triangles = wavy_sheet(60)
    count = len(points)
    lower = points - np.float32([0, 0, 0.01])
    normals = np.repeat(np.float32([[0, 0, 1], [0, 0, -1]]), count, axis=0)
    faces = np.concatenate([triangles, triangles[:, ::-1] + np.uint32(count)])
    builder = Builder()
    builder.mesh({"POSITION": np.concatenate([points, lower]), "NORMAL": normals}, faces)
    path, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    gltf_ext.compress(path, output, lod=True, position_bits=8)
    (primitive,) = open_lod(output)
    mesh = primitive.mesh(cut_at_level(primitive.tables, 1))
    assert len(mesh.indices) <= len(faces) / 4
    a, b, c = mesh.attributes["POSITION"][mesh.indices].transpose(1, 0, 2)
    is_up = np.cross(b - a, c - a)[:, 2] > 0
    agrees = (mesh.attributes["NORMAL"][mesh.indices, 2] > 0) == is_up[:, None]
    assert agrees.mean() > 0.99, agrees.mean()


def test_cracks_that_the_grid_closes_stay_closed(tmp_path):
    """Two halves with normals of their own, whose vertices differ by less than a cell."""
    points, triangles = wavy_sheet(60)
    is_second = points[triangles].mean(axis=1)[:, 0] > 30
    faces = triangles + np.uint32(len(points)) * is_second[:, None].astype(np.uint32)
    normals = np.repeat(np.float32([[0, 0, 1], [0, 1, 0]]), len(points), axis=0)
    both = np.concatenate([points, points + np.float32([0, 0.001, 0])])
    builder = Builder()
    builder.mesh({"POSITION": both, "NORMAL": normals}, faces)
    path, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    gltf_ext.compress(path, output, lod=True, position_bits=8)
    (primitive,) = open_lod(output)
    certifier = Certifier(primitive)
    for level in range(primitive.tables.level_count):
        assert certifier.has_no_cracks(cut_at_level(primitive.tables, level).drawn)


@pytest.mark.parametrize("is_flat_shaded, step", [(False, 5.0), (True, 6.25)])
def test_many_seams_take_a_larger_first_step(is_flat_shaded, step, tmp_path):
    points, triangles = wavy_sheet(60)
    corners = triangles.reshape(-1)
    builder = Builder()
    if is_flat_shaded:
        normals = np.cross(*np.diff(points[triangles], axis=1).transpose(1, 0, 2))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.repeat(normals, 3, axis=0).astype(np.float32)
        numbers = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        builder.mesh({"POSITION": points[corners], "NORMAL": normals}, numbers)
    else:
        builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    first, second, *_ = report["lod"][0]["triangles"]
    assert first / second == pytest.approx(step, rel=0.06)


def test_edges_that_a_morph_target_stretches_join_nothing(tmp_path):
    """Vertices that lie in one cell at rest keep apart."""
    points, triangles = wavy_sheet(40)
    side = np.where(np.arange(len(points)) % 2, 1.0, -1.0)
    lift = np.zeros_like(points)
    lift[:, 2] = 3.0 * side
    counts = []
    for targets in ([], [{"POSITION": lift}]):
        builder = Builder()
        builder.mesh({"POSITION": points}, triangles, targets=targets)
        path = builder.write(tmp_path / f"{len(targets)}.glb")
        rows, positions = vertices_of_level_1(path, tmp_path / "out.glb", position_bits=5)
        counts.append(len(rows) - positions)
    assert counts[0] == 0 < counts[1]


def test_an_error_limit_keeps_triangles(sheet, with_levels, tmp_path):
    (free,) = open_lod(with_levels)
    errors = free.tables.groups["error"]
    limit = 0.7 * float(errors[np.isfinite(errors)].max())
    output = tmp_path / "out.glb"
    gltf_ext.compress(sheet, output, lod=True, lod_limit=limit)
    (limited,) = open_lod(output)
    errors = limited.tables.groups["error"]
    assert errors[np.isfinite(errors)].max() <= 1.0001 * limit
    assert limited.tables.level_count < free.tables.level_count


def test_primitives_that_share_data_share_levels(tmp_path):
    points, triangles = wavy_sheet(40)
    builder = Builder()
    first = builder.mesh({"POSITION": points}, triangles)
    builder.properties["meshes"].append({"primitives": [json.loads(json.dumps(first))]})
    path = builder.write(tmp_path / "in.glb")
    gltf_ext.compress(path, tmp_path / "out.glb", lod=True)
    one, two = open_lod(tmp_path / "out.glb")
    assert one.tables.to_bytes() == two.tables.to_bytes()
    assert one.compressed.view == two.compressed.view
    assert gltf_ext.validate(tmp_path / "out.glb") == []


def test_without_the_simplifier_there_is_one_line(sheet, tmp_path, monkeypatch):
    from gltf_ext.lod import simplifier

    monkeypatch.setattr(simplifier, "VERSION", "0.0")
    monkeypatch.setattr(simplifier, "PARTITION", "not_inside")  # as installed without make
    simplifier.library.cache_clear()
    try:
        with pytest.raises(gltf_ext.MeshletError, match="pip install meshoptimizer"):
            gltf_ext.compress(sheet, tmp_path / "out.glb", lod=True)
    finally:
        simplifier.library.cache_clear()
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize("length", [1e16, 1e20, 1e25, 3e38])
def test_morph_targets_beyond_the_grid_keep_their_floats(length, tmp_path):
    points, triangles = wavy_sheet(20)
    moves = np.zeros_like(points, np.float32)
    moves[5], moves[100] = length, -length
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles, [{"POSITION": moves}])
    original, output = builder.write(tmp_path / "in.glb"), tmp_path / "out.glb"
    gltf_ext.compress(original, output, lod=True)
    assert gltf_ext.validate(output) == []
    verified = gltf_ext.verify(original, output)
    assert verified["ok"] and verified["max_error"]["targets[0].POSITION"] == 0


def test_coordinates_near_the_largest_float_have_levels(tmp_path):
    points, triangles = wavy_sheet(40)
    points = points - points.mean(axis=0)
    builder = Builder()
    builder.mesh({"POSITION": (1.6e38 * (points / np.abs(points).max())).astype("f4")}, triangles)
    gltf_ext.compress(builder.write(tmp_path / "in.glb"), tmp_path / "out.glb", lod=True)
    (primitive,) = open_lod(tmp_path / "out.glb")
    assert primitive.tables.level_count > 2


@pytest.mark.parametrize("first, is_parted", [(100, True), (1 << 23, False)])
def test_touching_surfaces_are_parted_where_floats_have_room(first, is_parted):
    """Two triangles that touch at a point; from 2^23 on, one float up is the next cell."""
    x = [first, first + 1, first, first, first - 1, first]
    points = np.array([x, [0, 0, 1, 0, 0, -1], [0] * 6], np.float32).T.copy()
    same_position = np.uint32([0, 1, 2, 0, 3, 4])
    numbers = np.arange(6, dtype=np.uint32)
    triangles = numbers.reshape(2, 3)
    apart = _separate_points(points, same_position, numbers, triangles, numbers)
    assert (len(np.unique(apart, axis=0)) == 6) == is_parted
    assert np.abs(apart - points).max() < 0.5


def test_chunks_and_the_codec_mean_the_same_by_a_level_that_shrinks():
    header = (environment.ROOT / "codec" / "lod" / "reduce_groups.h").read_text()
    assert f"constexpr double kShrink = {levels_builder.SHRINK};" in header
