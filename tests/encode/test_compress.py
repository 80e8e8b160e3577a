"""compress --max-memory: the same model as without, in chunks, below the number of bytes."""

import os
import resource
import shutil
import subprocess
import weakref

import numpy as np
import pytest

import gltf_ext
from gltf_ext import MeshletError
from gltf_ext.checks.coverage import check_coverage
from gltf_ext.commands.result import Result
from gltf_ext.encode import primitive as encoding
from gltf_ext.lod import LodPrimitive, View, cut_for_view, open_lod
from gltf_ext.options import Options
from gltf_ext.sources import large, memory
from gltf_ext.sources.row_arrays import FileRows
from gltf_ext.sources.source import blocks
from gltf_ext.work_files import WorkFile
from gltf_meshlet import cli
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import peak_of, sheet, use_small_chunks
from tests.helpers.lod import Certifier, random_views

SIZE = 128  # quads along a side of the sheet


@pytest.fixture(scope="module")
def tube(tmp_path_factory):
    points, normals, triangles = sheet()
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    return builder.write(tmp_path_factory.mktemp("tube") / "tube.glb")


@pytest.fixture
def small_chunks(monkeypatch):
    """The sheet has nine chunks."""
    use_small_chunks(monkeypatch)


def compress(source, output, **options):
    return gltf_ext.compress(source, output, max_memory="1G", **options)


# --- the result ---


@pytest.mark.parametrize("lod", [False, True], ids=["level 0", "levels"])
def test_the_model_is_the_same(tube, tmp_path, small_chunks, lod):
    if lod:
        environment.need_package("meshoptimizer")
    report = compress(tube, tmp_path / "out.glb", lod=lod)
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    verified = gltf_ext.verify(tube, tmp_path / "out.glb")
    assert verified["ok"] and verified["triangles"] == 2 * SIZE**2
    assert report["totals"] == gltf_ext.inspect(tmp_path / "out.glb")["totals"]
    gltf_ext.compress(tube, tmp_path / "whole.glb", lod=lod)
    whole = gltf_ext.inspect(tmp_path / "whole.glb")["totals"]
    assert report["totals"]["source_vertices"] == whole["source_vertices"] == SIZE**2
    assert report["totals"]["compressed_bytes"] < 1.1 * whole["compressed_bytes"]


def test_cuts_are_closed_and_errors_hold(tube, tmp_path, small_chunks):
    environment.need_package("meshoptimizer")
    compress(tube, tmp_path / "out.glb", lod=True)
    (primitive,) = open_lod(tmp_path / "out.glb")
    assert isinstance(primitive, LodPrimitive)
    assert primitive.tables.level_count >= 4
    check_coverage(primitive, strict=True)
    certifier = Certifier(primitive)
    assert certifier.is_closed
    for eye, pixels, threshold in random_views(primitive, 40, np.random.default_rng(0)):
        drawn = cut_for_view(primitive.tables, View(eye, pixels), threshold).drawn
        assert certifier.has_no_cracks(drawn) and certifier.covers_once(drawn)
    levels = gltf_ext.verify(tube, tmp_path / "out.glb")["levels"]
    assert levels and all(row["measured_error"] <= row["stated_error"] for row in levels)


@pytest.mark.parametrize("lod", [False, True], ids=["level 0", "levels"])
def test_bytes_do_not_depend_on_threads_nor_on_passes(
    tube, tmp_path, small_chunks, monkeypatch, lod
):
    if lod:
        environment.need_package("meshoptimizer")
    outputs = []
    for threads, share in ((1, 0.3), (3, 0.3), (2, 5e-5)):
        # The last share takes several passes over the triangles.
        monkeypatch.setattr(memory, "VERTEX_FRACTION", share)
        compress(tube, tmp_path / "out.glb", lod=lod, threads=threads)
        outputs.append((tmp_path / "out.glb").read_bytes())
    assert outputs[0] == outputs[1] == outputs[2]


def test_small_pages_get_smaller_groups(tube, tmp_path, small_chunks):
    compress(tube, tmp_path / "out.glb", lod=True, page_bytes=4096)
    (primitive,) = open_lod(tmp_path / "out.glb")
    assert primitive.tables.pages["byteLength"].max() <= 4096
    assert gltf_ext.verify(tube, tmp_path / "out.glb")["ok"]


def test_triangles_that_cannot_be_simplified(tmp_path, small_chunks):
    """Chunks of triangles that touch nowhere: level 0 alone, in one chunk and in several."""
    environment.need_package("meshoptimizer")
    corners = np.random.default_rng(0).normal(size=(6000, 1, 3)) * 50
    points = (corners + np.random.default_rng(1).normal(size=(6000, 3, 3))).astype(np.float32)
    builder = Builder()
    for count in (6000, 3000, 3000, 3000):
        builder.mesh({"POSITION": points[:count].reshape(-1, 3)}, None)
    path = builder.write(tmp_path / "in.glb")
    compress(path, tmp_path / "out.glb", lod=True, lod_limit=1e-9)
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    assert not any(hasattr(p, "tables") for p in open_lod(tmp_path / "out.glb"))


def test_attributes_and_small_primitives(tmp_path, small_chunks):
    points, normals, triangles = sheet()
    count = len(points)
    random = np.random.default_rng(0)
    attributes = {
        "POSITION": points,
        "NORMAL": normals,
        "TANGENT": np.c_[normals[:, [1, 2, 0]], np.sign(points[:, 0])].astype(np.float32),
        "TEXCOORD_0": random.uniform(-1, 2, (count, 2)).astype(np.float32),
        "COLOR_0": random.integers(0, 255, (count, 4)).astype(np.uint8),
        "JOINTS_0": random.integers(0, 9, (count, 4)).astype(np.uint8),
        "WEIGHTS_0": np.full((count, 4), 0.25, np.float32),
        "_ID": random.normal(size=(count, 1)).astype(np.float32),
    }
    targets = [
        {"POSITION": 0.1 * points, "NORMAL": 0.2 * normals},
        {"TANGENT": 0.1 * normals[:, ::-1], "TEXCOORD_0": 0.1 * attributes["TEXCOORD_0"]},
    ]
    builder = Builder()
    builder.mesh(attributes, triangles, targets)
    builder.mesh({"POSITION": points[:3] * 2}, np.array([[0, 1, 2]], np.uint32))
    path = builder.write(tmp_path / "in.glb")
    compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert gltf_ext.validate(tmp_path / "out.glb") == []


def test_weights_of_which_one_is_no_share(tmp_path, small_chunks):
    """One of a vertex in one chunk decides how those of all chunks are written."""
    points, _, triangles = sheet()
    weights = np.full((len(points), 4), 0.25, np.float32)
    weights[7] = -1, 2, 0, 0
    builder = Builder()
    builder.mesh({"POSITION": points, "WEIGHTS_0": weights}, triangles)
    path = builder.write(tmp_path / "in.glb")
    report = compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert gltf_ext.verify(path, tmp_path / "out.glb", max_memory="1G")["ok"]
    assert report["totals"]["source_vertices"] == len(points)


@pytest.mark.parametrize("threads", [1, 3])
def test_a_chunk_that_cannot_be_cut(tmp_path, small_chunks, threads):
    """7000 triangles around one point, where a chunk has 4000."""
    points, _, triangles = sheet()
    a, b = np.random.default_rng(0).uniform(-1, 1, (2, 7000, 3)).astype(np.float32)
    around = np.stack([a, b, -a - b], axis=1).reshape(-1, 3)
    builder = Builder()
    builder.mesh({"POSITION": np.concatenate([points[triangles.reshape(-1)], around])}, None)
    path = builder.write(tmp_path / "in.glb")
    compress(path, tmp_path / "out.glb", position_bits=6, threads=threads)
    verified = gltf_ext.verify(path, tmp_path / "out.glb")
    assert verified["triangles_equal"] and verified["errors_within_bits"]
    assert all("boundary edges" in problem for problem in verified["problems"]), "6 bits are few"


def test_more_in_one_place_than_fits(tmp_path, small_chunks):
    corners = np.random.default_rng(0).uniform(-1, 1, (20_000, 3, 3)).astype(np.float32)
    corners[:, 2] = -corners[:, 0] - corners[:, 1]
    builder = Builder()
    builder.mesh({"POSITION": corners.reshape(-1, 3)}, None)
    path = builder.write(tmp_path / "in.glb")
    assert "in one place of the grid" in message(tmp_path, path, max_memory="1G", position_bits=4)


def test_triangles_without_indices(tmp_path, small_chunks):
    points, _, triangles = sheet(64)
    builder = Builder()
    builder.mesh({"POSITION": points[triangles.reshape(-1)]}, None)
    path = builder.write(tmp_path / "in.glb")
    report = compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert report["totals"]["source_vertices"] == 64**2


def write_stl(path, points, triangles):
    rows = np.zeros(
        len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    rows["corners"] = points[triangles]
    path.write_bytes(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())


def write_ply(path, points, triangles):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in "xyz"]
    header += [f"property uchar {name}" for name in ("red", "green", "blue")]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    vertices = np.zeros(len(points), [("p", "<f4", 3), ("c", "u1", 3)])
    vertices["p"], vertices["c"] = points, np.arange(len(points))[:, None] % 200
    faces = np.zeros(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, triangles
    text = "\n".join([*header, "end_header", ""]).encode()
    path.write_bytes(text + vertices.tobytes() + faces.tobytes())


def write_obj(path, points, triangles):
    """Two materials; texture coordinates and normals with numbers of their own."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    lines += [f"vt {k / 100:.3f} {k % 7 / 7:.3f}" for k in range(100)]
    lines += [f"vn {x} {y} {z}" for x, y, z in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    for number, triangle in enumerate(triangles + 1):
        if number in (0, len(triangles) // 2):
            lines.append(f"usemtl material{number}")
        corners = (f"{v}/{v % 100 + 1}/{number % 3 + 1}" for v in triangle)
        lines.append(f"f {' '.join(corners)}")
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(params=[write_stl, write_ply, write_obj], ids=["stl", "ply", "obj"])
def other_format(request, tmp_path, small_chunks, monkeypatch):
    """The file of a sheet in another format than glTF, read in small chunks."""
    points, _, triangles = sheet(64)
    path = tmp_path / f"in.{request.param.__name__[-3:]}"
    request.param(path, points, triangles)
    monkeypatch.setattr(large, "MEMORY_OF_FILE", 1 << 30)
    return path


def test_other_formats(tmp_path, other_format):
    path = other_format
    report = compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    gltf_ext.compress(path, tmp_path / "whole.glb")
    whole = gltf_ext.inspect(tmp_path / "whole.glb")["totals"]
    assert report["totals"]["source_vertices"] == whole["source_vertices"]
    assert sorted(f.name for f in tmp_path.iterdir()) == [path.name, "out.glb", "whole.glb"]
    if path.suffix != ".obj":  # a shorter one is as good
        path.write_bytes(path.read_bytes()[:-5001])  # within a triangle
        assert "cut off" in message(tmp_path, path, max_memory="1G")


def write_glb(path, points, triangles):
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": points}, triangles)
    builder.write(path)


def write_soup(path, points, triangles):
    builder = Builder()
    builder.mesh({"POSITION": points[triangles.reshape(-1)]}, None)
    builder.write(path)


@pytest.mark.parametrize("value", [1e6, np.nan], ids=["far", "NaN"])
@pytest.mark.parametrize("writer", [write_glb, write_soup, write_stl, write_ply, write_obj])
def test_vertices_of_degenerate_triangles_alone_do_not_count(
    tmp_path, small_chunks, monkeypatch, writer, value
):
    monkeypatch.setattr(large, "MEMORY_OF_FILE", 1 << 30)
    points, _, triangles = sheet(64)
    other = len(points)
    points = np.concatenate([points, np.full((1, 3), value, np.float32)])
    more = [[other, other, other], [0, other, other], [other, 0, other]]
    path = tmp_path / f"in.{'glb' if writer == write_soup else writer.__name__[-3:]}"
    writer(path, points, np.concatenate([triangles[:100], np.uint32(more), triangles[100:]]))
    for options in ({}, {"max_memory": "1G"}):
        report = gltf_ext.compress(path, tmp_path / "out.glb", **options)
        assert report["dropped"]["degenerate_triangles"] == len(more)
        verified = gltf_ext.verify(path, tmp_path / "out.glb", **options)
        assert verified["ok"] and verified["triangles"] == len(triangles)
        assert verified["max_error"]["POSITION"] < 0.01 and not verified["collapsed_triangles"]
        assert gltf_ext.validate(tmp_path / "out.glb") == []


def test_many_materials_share_a_work_file(tmp_path, monkeypatch):
    """Each has numbers of three kinds."""
    lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "vt 0 0", "vn 0 0 1"]
    lines += [f"usemtl m{i}\nf 1/1/1 2/1/1 3/1/1" for i in range(100)]
    (tmp_path / "in.obj").write_text("\n".join(lines))
    monkeypatch.setattr(large, "MEMORY_OF_FILE", 1 << 30)
    monkeypatch.setattr(large, "INDEXED_SHARE", 1 << 60)  # none is small
    options = Options.of({"max_memory": "1G", "work_dir": str(tmp_path)})
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 20, limits[1]))
    try:
        _, primitives = large.open_source(tmp_path / "in.obj", options)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    assert len(primitives) == 100


# --- memory ---


@pytest.mark.parametrize(
    ("size", "lod", "megabytes"),
    [
        pytest.param(720, False, 110, id="1 M triangles"),
        pytest.param(1000, True, 240, id="2 M triangles, levels", marks=pytest.mark.full),
        pytest.param(3000, True, 1000, id="18 M triangles, levels", marks=pytest.mark.full),
    ],
)
def test_memory_stays_below_the_number(tmp_path, size, lod, megabytes):
    if lod:
        environment.need_package("meshoptimizer")
    points, normals, triangles = sheet(size)
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    path = builder.write(tmp_path / "in.glb")
    options = ["compress", path, tmp_path / "out.glb", "--threads", "16", *["--lod"] * lod]
    limit = megabytes << 20
    assert peak_of(*options) > limit
    assert peak_of(*options, "--max-memory", f"{megabytes}M") < limit


@pytest.mark.parametrize(("lod", "limit"), [(False, 131072), (True, 32768)])
def test_what_cannot_be_one_blob_has_pages(tube, tmp_path, small_chunks, lod, limit):
    if lod:
        environment.need_package("meshoptimizer")
    for name, size in (("zero", 0), ("default", None), ("limit", limit)):
        compress(tube, tmp_path / f"{name}.glb", lod=lod, page_bytes=size)
    expected = (tmp_path / "limit.glb").read_bytes()
    assert (tmp_path / "zero.glb").read_bytes() == expected
    assert (tmp_path / "default.glb").read_bytes() == expected


# --- errors ---


def message(tmp_path, source, **options):
    """The one line with which compress refuses; nothing is left."""
    before = sorted(tmp_path.iterdir())
    with pytest.raises((MeshletError, OSError)) as caught:
        gltf_ext.compress(source, tmp_path / "out.glb", **options)
    assert sorted(tmp_path.iterdir()) == before
    return str(caught.value)


def test_too_little_memory_is_refused_first(tube, tmp_path):
    text = message(tmp_path, tube, max_memory="1M")
    assert "max_memory is 1M" in text and "use at least" in text
    assert "max_memory is 'lots'" in message(tmp_path, tube, max_memory="lots")
    assert "fallback" in message(tmp_path, tube, max_memory="1G", fallback=True)


def test_memory_that_the_result_does_not_fit_is_refused_first(
    tube, tmp_path, small_chunks, monkeypatch
):
    monkeypatch.setattr(large, "RESULT_BYTES", 1 << 20)
    text = message(tmp_path, tube, max_memory="1G")
    assert "less than the result of 32,768 triangles takes" in text and "at least 32848M" in text


def test_primitives_that_cannot_be_read_in_chunks_are_refused(tmp_path, small_chunks):
    points, _, triangles = sheet(64)
    builder = Builder()
    strip = np.arange(3 * len(triangles), dtype=np.uint32) % len(points)
    builder.mesh({"POSITION": points}, strip, mode=5)
    path = builder.write(tmp_path / "in.glb")
    assert "is a strip or a fan" in message(tmp_path, path, max_memory="1G")


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (lambda points, triangles: points.__setitem__((5, 1), np.nan), "NaN"),
        (lambda points, triangles: triangles.__setitem__((9, 0), 10**6), "reach 1000000"),
    ],
    ids=["NaN", "index"],
)
def test_damage_is_one_line(tmp_path, small_chunks, damage, problem):
    points, _, triangles = sheet(64)
    damage(points, triangles)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "in.glb")
    assert problem in message(tmp_path, path, max_memory="1G", non_finite="refuse")


@pytest.mark.parametrize("name", ["POSITION", "NORMAL"])
def test_a_count_below_zero_is_one_line(tmp_path, small_chunks, name):
    points, normals, triangles = sheet(128)
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    (mesh,) = builder.properties["meshes"]
    accessor = mesh["primitives"][0]["attributes"][name]
    builder.properties["accessors"][accessor]["count"] = -5
    path = builder.write(tmp_path / "in.glb")
    expected = f"{name} of mesh 0 primitive 0 has no valid count"
    assert expected in message(tmp_path, path, max_memory="1G")
    assert expected in message(tmp_path, path)


@pytest.mark.parametrize("lod", [False, True], ids=["level 0", "levels"])
def test_triangles_without_extent_alone_are_one_line(tmp_path, small_chunks, lod):
    if lod:
        environment.need_package("meshoptimizer")
    points, _, _ = sheet(128)
    builder = Builder()
    triangles = np.repeat(np.arange(len(points), dtype=np.uint32), 3).reshape(-1, 3)
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "in.glb")
    assert "every triangle is degenerate" in message(tmp_path, path, max_memory="1G", lod=lod)


def test_an_input_that_changes_is_noticed(tube, tmp_path, small_chunks, monkeypatch):
    path = tmp_path / "in.glb"
    path.write_bytes(tube.read_bytes())
    sort = encoding.sort_corners

    def cut_off(*arguments):
        os.truncate(path, 10_000)
        return sort(*arguments)

    monkeypatch.setattr(encoding, "sort_corners", cut_off)
    assert "changed while it was read" in message(tmp_path, path, max_memory="1G")


LARGE_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\n"
    b"property float y\nproperty float z\nelement face %d\n"
    b"property list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        (
            "a.ply",
            LARGE_PLY % 2_630_000_000,
            "has 2,630,000,000 triangles, more than 1,431,655,765",
        ),
        ("a.ply", LARGE_PLY % 1_000_000_000, "is cut off; get it again"),
    ],
)
def test_too_many_triangles_are_refused_before_they_are_read(
    tmp_path, monkeypatch, name, content, problem
):
    """By what the header says; the file need not have them."""
    monkeypatch.setattr(large, "MEMORY_OF_FILE", 1 << 30)
    (tmp_path / name).write_bytes(content)
    assert problem in message(tmp_path, tmp_path / name, max_memory="1G")


@pytest.mark.parametrize(
    ("name", "start", "size", "problem"),
    [
        (
            "a.stl",
            bytes(80) + (1_500_000_000).to_bytes(4, "little"),
            50 * 1_500_000_000,
            "has 1,500,000,000 triangles, more than 1,431,655,765",
        ),
        (
            "a.ply",
            LARGE_PLY % 1_000_000_000,
            25 * 1_000_000_000,
            "less than the result of 1,000,000,000 triangles",
        ),
    ],
)
def test_a_large_binary_file_is_refused_before_it_is_read(tmp_path, name, start, size, problem):
    with open(tmp_path / name, "wb") as file:
        file.write(start)
        file.truncate(len(start) + size)  # a hole
    if (tmp_path / name).stat().st_blocks > 1000:
        pytest.skip("the file system writes holes out")
    assert problem in message(tmp_path, tmp_path / name, max_memory="1G")


def test_a_work_folder_that_is_not_there(tube, tmp_path, small_chunks):
    missing = str(tmp_path / "missing")
    assert missing in message(tmp_path, tube, max_memory="1G", work_dir=missing)


@pytest.fixture
def few_open_files():
    """As on macOS, but a few: more are open at a time than the soft limit allows."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 20, hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_the_limit_of_open_files_is_raised(
    tube, tmp_path, small_chunks, few_open_files, monkeypatch
):
    monkeypatch.setattr(memory, "LARGE_CHUNK", 400)
    monkeypatch.setattr(memory, "AT_ONCE", 100)
    compress(tube, tmp_path / "out.glb")
    monkeypatch.setattr("gltf_ext.work_files.BUCKET_BYTES", 5000)
    assert gltf_ext.verify(tube, tmp_path / "out.glb", max_memory="1G")["ok"]


def test_a_limit_of_open_files_that_cannot_be_raised(
    tube, tmp_path, small_chunks, few_open_files, monkeypatch, capsys
):
    def refused(*arguments):
        raise ValueError("not allowed to raise maximum limit")

    monkeypatch.setattr(memory, "LARGE_CHUNK", 400)
    monkeypatch.setattr(memory, "AT_ONCE", 100)
    with monkeypatch.context() as patch:
        patch.setattr(resource, "setrlimit", refused)
        arguments = ["compress", str(tube), str(tmp_path / "out.glb"), "--max-memory", "1G"]
        assert cli.main(arguments) == cli.FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert "Too many open files; raise the limit: ulimit -n 1024" in line
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_too_small_is_noticed_first(tube, tmp_path, small_chunks, monkeypatch):
    usage = os.statvfs(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: type("Usage", (), {"free": 1000}))
    assert usage.f_bavail and "1,000 are free" in message(tmp_path, tube, max_memory="1G")


def test_space_for_a_copy_is_checked_before_it_is_made(tmp_path, other_format, monkeypatch):
    free = type("Usage", (), {"free": 1000})
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: free)
    monkeypatch.setattr(FileRows, "add", lambda *arguments: pytest.fail("it was read"))
    text = message(tmp_path, other_format, max_memory="1G")
    assert "work files need" in text and "bytes, 1,000 are free" in text


def test_the_copy_is_gone_when_the_result_is_written(tmp_path, other_format, monkeypatch):
    arrays, encode, counts = weakref.WeakSet(), Result.write, []
    add = FileRows.add

    def adding(array, values):
        arrays.add(array)
        add(array, values)

    def counting(*arguments):
        counts.append(len(arrays))
        return encode(*arguments)

    monkeypatch.setattr(FileRows, "add", adding)
    monkeypatch.setattr(Result, "write", counting)
    compress(other_format, tmp_path / "out.glb")
    assert counts and counts[-1] == 0


@pytest.mark.parametrize("lod", [False, True], ids=["level 0", "levels"])
def test_work_files_stay_below_the_space_that_is_checked(
    tube, tmp_path, small_chunks, monkeypatch, lod
):
    if lod:
        environment.need_package("meshoptimizer")
    monkeypatch.setattr(blocks, "__defaults__", (500,))  # small, as this model is
    files, most = weakref.WeakSet(), 0
    opened, written = WorkFile.__init__, WorkFile.write

    def opening(file, folder=""):
        opened(file, folder)
        files.add(file)

    def writing(file, data, offset):
        nonlocal most
        written(file, data, offset)
        most = max(most, sum(f.size for f in set(files) if not f._file.closed))

    monkeypatch.setattr(WorkFile, "__init__", opening)
    monkeypatch.setattr(WorkFile, "write", writing)
    compress(tube, tmp_path / "out.glb", lod=lod)
    free = type("Usage", (), {"free": most - 1})
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: free)
    text = message(tmp_path, tube, max_memory="1G", lod=lod)
    needed = int(text.split("need ")[1].split(" bytes")[0].replace(",", ""))
    assert most <= needed <= 2 * most


def test_a_disk_that_fills(tube, tmp_path, small_chunks, monkeypatch, capsys):
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, most))
    try:
        status = cli.main(["compress", str(tube), str(tmp_path / "out.glb"), "--max-memory", "1G"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    assert status == cli.FAILED and list(tmp_path.iterdir()) == []
    assert "File too large" in capsys.readouterr().err


@pytest.fixture
def small_disk(tmp_path):
    """A folder on a disk of 32 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(folder)]
    if os.geteuid() or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a small disk needs rights")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("is_output", [False, True], ids=["work files", "output"])
def test_a_disk_that_another_program_fills(
    tube, tmp_path, small_disk, small_chunks, monkeypatch, capsys, is_output
):
    monkeypatch.setattr(encoding, "_check_space", lambda *_: None)
    folders = [tmp_path, small_disk]
    output, work = folders[is_output] / "out.glb", folders[not is_output]
    options = ["--max-memory", "1G", "--work-dir", str(work)]
    assert cli.main(["compress", str(tube), str(output), *options]) == cli.FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert "No space left on device" in line and str(small_disk) in line
    assert list(small_disk.iterdir()) == [] and list(tmp_path.iterdir()) == [small_disk]


@pytest.mark.parametrize("lod", [False, True], ids=["level 0", "levels"])
def test_a_work_folder_that_vanishes(tube, tmp_path, small_chunks, monkeypatch, capsys, lod):
    work, sort = tmp_path / "work", encoding.sort_corners
    work.mkdir()

    def removing(*arguments):
        result = sort(*arguments)
        work.rmdir()  # fails unless it is empty: work files have no names
        return result

    monkeypatch.setattr(encoding, "sort_corners", removing)
    options = ["--max-memory", "1G", "--work-dir", str(work), *["--lod"] * lod]
    status = cli.main(["compress", str(tube), str(tmp_path / "out.glb"), *options])
    (line,) = capsys.readouterr().err.splitlines()
    assert status == cli.FAILED and str(work) in line and "No such file" in line
    assert list(tmp_path.iterdir()) == []


def test_an_output_folder_that_vanishes(tube, tmp_path, small_chunks, monkeypatch, capsys):
    folder, work, encode = tmp_path / "folder", tmp_path / "work", encoding.encode_chunk
    folder.mkdir()
    work.mkdir()

    def removing(*arguments):
        if folder.exists():
            folder.rmdir()
        return encode(*arguments)

    monkeypatch.setattr(encoding, "encode_chunk", removing)
    options = ["--max-memory", "1G", "--work-dir", str(work)]
    assert cli.main(["compress", str(tube), str(folder / "out.glb"), *options]) == cli.FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert str(folder) in line and list(tmp_path.rglob("*")) == [work]


def test_other_inputs_that_change_are_noticed(tmp_path, other_format, monkeypatch):
    add = FileRows.add

    def changing(array, values):
        os.utime(other_format, (1, 1))
        add(array, values)

    monkeypatch.setattr(FileRows, "add", changing)
    assert "changed while it was read" in message(tmp_path, other_format, max_memory="1G")


def test_nothing_is_left_after_an_interrupt(tube, tmp_path, small_chunks, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(encoding, "encode_chunk", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compress(tube, tmp_path / "out.glb")
    assert list(tmp_path.iterdir()) == []
