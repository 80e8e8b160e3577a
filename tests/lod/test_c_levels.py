"""Levels by the C interface, beside Python: tables that it refuses, cuts, pages, a budget."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gltf_ext import _codec
from gltf_ext._library import Handle
from gltf_ext.errors import MeshletError
from gltf_ext.lod import View, open_lod
from gltf_ext.lod.cuts import cut_of
from gltf_ext.lod.tables import read_tables
from spec import reference_lod
from spec.make_lod_vectors import FOLDER
from tests.helpers.c_levels import (
    CGroup,
    CLevelPage,
    CTables,
    Levels,
    call,
    compare_at_random,
    packed_pages,
    rank_pages,
)

NAMES = sorted(path.stem for path in FOLDER.glob("lod_*.json"))
COUNTS = ("pageCount", "coarsePageCount", "groupCount", "runCount")


def primitives_of(name):
    return [p for p in open_lod(FOLDER / f"{name}.glb") if hasattr(p, "tables")]


def clusters_of(tables, drawn):
    """(page, meshlet) of each drawn cluster, by the number of their group."""
    groups = tables.groups
    pairs = []
    for c in np.flatnonzero(drawn):
        g = tables.cluster_group[c]
        first = int(groups["firstCluster"][g]) + int(c - tables.cluster_begin[g])
        pairs.append([int(groups["page"][g]), first])
    return pairs


def view_of(cut):
    """(camera, threshold, matrix) of a cut of the vectors; orthographic for one at an error."""
    if "camera" not in cut:
        return View(None, 1.0), cut["error"], None
    camera = cut["camera"]
    eye = camera["eye"] and tuple(camera["eye"])
    matrix = cut.get("matrix")
    columns = None if matrix is None else np.array(matrix, np.float64).reshape(4, 4).T
    return View(eye, camera["pixelsPerUnit"]), camera["threshold"], columns


@pytest.mark.parametrize("name", NAMES)
def test_cuts_of_the_vectors(name):
    expected = json.loads((FOLDER / f"{name}.json").read_text())["primitives"]
    for primitive, wanted in zip(primitives_of(name), filter(None, expected)):
        tables = primitive.tables
        levels = Levels.of(tables)
        assert levels.counts.root_pages == wanted["rootPages"]
        for cut in wanted["cuts"]:
            if "level" in cut:
                continue
            view, threshold, matrix = view_of(cut)
            resident = None
            if "resident" in cut:
                resident = np.isin(np.arange(len(tables.pages)), cut["resident"])
            made = levels.cut(tables, view, threshold, resident, matrix)
            assert np.flatnonzero(made.active).tolist() == cut["active"]
            assert clusters_of(tables, made.drawn) == cut["drawn"]


# --- tables ---


def tables_of(path):
    """(bytes, counts) of the tables of a file's extension objects."""
    document, chunk = reference_lod.read_document(path.read_bytes())
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            extension = primitive.get("extensions", {}).get("EXT_meshlet_lod")
            counts = [extension.get(name) for name in COUNTS] if extension else [None]
            if not all(isinstance(n, int) and 0 <= n < 1 << 32 for n in counts):
                continue
            views, number = document["bufferViews"], extension["bufferView"]
            if not 0 <= number < len(views):
                continue
            view = views[number]
            begin = view.get("byteOffset", 0)
            yield bytes(chunk[begin : begin + view["byteLength"]]), tuple(counts)


def is_refused(data, counts):
    """Compares the readers; what only C refuses are counts of pages that no meshlets have."""
    try:
        read_tables(data, *counts)
    except MeshletError:
        with pytest.raises(ValueError):
            Levels(data, counts)
        return True
    try:
        Levels(data, counts)
    except ValueError as error:
        assert "more triangles or vertices than its clusters" in str(error)
        return True
    return False


def test_malformed_tables_are_refused():
    refused = 0
    for name in json.loads((FOLDER / "malformed.json").read_text()):
        for data, counts in tables_of(FOLDER / name):
            refused += is_refused(data, counts)
    assert refused > 10


def test_mutated_tables_are_refused_by_both_or_neither():
    primitive = max(primitives_of("lod_levels"), key=lambda p: len(p.tables.groups))
    tables = primitive.tables
    counts = len(tables.pages), tables.coarse_pages, len(tables.groups), len(tables.run_group)
    original = tables.to_bytes()
    random = np.random.default_rng(1)
    refused = 0
    for _ in range(1500):
        data = bytearray(original)
        for at in random.integers(0, len(data), random.integers(1, 3)):
            data[at] = random.integers(0, 256)
        refused += is_refused(bytes(data), counts)
    for cut in (0, 1, 15, 16, len(original) - 4, len(original) - 1):
        assert is_refused(original[:cut], counts)
    assert 300 < refused < 1500 and not is_refused(original, counts)


# --- pages ---


@pytest.mark.parametrize("name", ["lod_levels", "lod_packed", "lod_several_buffers"])
def test_pages_are_checked(name):
    for primitive in primitives_of(name):
        tables = primitive.tables
        levels, row, group = Levels.of(tables), CLevelPage(), CGroup()
        views = [_codec.View(primitive.page(p)) for p in range(len(tables.pages))]
        for p, view in enumerate(views):
            call("get_level_page", levels, p, row)
            assert row.bytes == len(primitive.page(p)) and row.meshlets == view.meshlet_count
            assert row.is_fine == (p >= tables.coarse_pages)
            begin = tables.page_begin[tables.coarse_pages] if row.is_fine else 0
            assert row.offset == tables.page_begin[p] - begin
            call("check_page", levels, p, view, views[0])
            wrong = (p + 1) % len(views)
            if (row.triangles, row.bytes) != tuple(
                tables.pages[["triangles", "byteLength"]][wrong].tolist()
            ):
                with pytest.raises(ValueError, match="other counts than the tables say"):
                    call("check_page", levels, p, views[wrong], None)
        for g in range(len(tables.groups)):
            call("get_group", levels, g, group)
            assert group.page == tables.groups["page"][g]
            assert list(group.centre) == tables.groups["centre"][g].tolist()
        with pytest.raises(IndexError, match="there is no such page"):
            call("get_level_page", levels, len(views), row)


def test_single_pages_unpack():
    a = np.arange(20 * 19, dtype=np.uint32).reshape(19, 20)[:, :-1].reshape(-1)
    grid = np.stack([np.arange(400) % 20, np.arange(400) // 20, np.arange(400) % 7], axis=1)
    triangles = np.concatenate([[a, a + 1, a + 20], [a + 1, a + 21, a + 20]], axis=1).T
    streams = [_codec.Stream(_codec.KIND_GRID, 3, 5, 1.0)]
    ids, values = np.arange(400, dtype=np.uint32), [grid.astype(np.uint32)]
    arguments = np.ascontiguousarray(triangles, np.uint32), ids, grid.astype(np.float32)
    view, _ = _codec.encode(*arguments, streams, values, page_bytes=200)
    packed = np.frombuffer(_codec.pack(view), np.uint8)
    pages, parts = packed_pages(packed), []
    assert len(pages) > 2
    for page in pages:
        stored = packed[page.offset : page.offset + page.stored_bytes].copy()
        part = np.zeros(page.page_bytes, np.uint8)
        call("unpack_page", None, stored, len(stored), part, len(part))
        parts.append(part.tobytes())
        if page.stored_bytes < page.page_bytes:
            with pytest.raises(ValueError):
                call("unpack_page", None, stored, len(stored) // 2, part, len(part))
    assert b"".join(parts) == view


# --- budget ---


def test_pages_are_ranked_within_a_budget():
    urgency = np.array([np.inf, 3, 0, 8, 3, 0.5])
    sizes = np.array([10, 20, 1000, 30, 40, 1])
    order, affordable = rank_pages(urgency, sizes, 60)
    assert order.tolist() == [0, 3, 1, 4, 5] and affordable == 3
    assert rank_pages(urgency, sizes, 59)[1] == 2
    assert rank_pages(urgency, sizes, 1 << 40)[1] == 5
    assert rank_pages(np.zeros(3), sizes[:3], 10)[0].tolist() == []


# --- cuts beside Python's ---


@pytest.mark.parametrize("name", NAMES)
def test_random_cuts_are_pythons(name):
    for primitive in primitives_of(name):
        compare_at_random(primitive.tables, 40)


def test_nothing_is_drawn_without_root_pages():
    tables = primitives_of("lod_levels")[0].tables
    levels = Levels.of(tables)
    made = levels.cut(tables, View(None, 1.0), 0.0, np.zeros(len(tables.pages), bool))
    assert not made.active.any() and not made.drawn.any()
    assert np.isinf(made.urgency[: tables.root_pages]).all() and np.isinf(made.error)
    assert cut_of(tables, np.ones(len(tables.groups), bool)).drawn.any()


@pytest.mark.parametrize(
    "change",
    [{"threshold": float("nan")}, {"threshold": -1.0}, {"pixels": 0.0}, {"eye": float("inf")}],
)
def test_cameras_are_checked(change):
    tables = primitives_of("lod_levels")[0].tables
    view = View((change.get("eye", 0.0), 0.0, 0.0), change.get("pixels", 1.0))
    with pytest.raises(ValueError):
        Levels.of(tables).cut(tables, view, change.get("threshold", 1.0))


def test_the_largest_threshold_draws_the_top_groups():
    tables = primitives_of("lod_levels")[0].tables
    top = np.isinf(tables.groups["error"])
    for view in (View((0.0, 0.0, 9.0), 1.0), View(None, 1.0)):
        made = Levels.of(tables).cut(tables, view, np.inf)
        np.testing.assert_array_equal(made.active, top)
        assert made.drawn.any() and np.isfinite(made.error)


def test_finer_groups_are_not_more_urgent():
    """With the eye inside of spheres, where the least distance decides."""
    random, inside = np.random.default_rng(3), 0
    for primitive in primitives_of("lod_levels"):
        tables = primitive.tables
        levels, groups, owner = Levels.of(tables), tables.groups, tables.run_owner
        page_of = groups["page"].astype(int)
        for _ in range(200):
            g = random.integers(len(groups))
            eye = groups["centre"][g] + random.normal(size=3) * groups["radius"][g] / 4
            view = View(tuple(map(float, eye)), 1000.0)
            pixels = view.pixels(tables)
            assert (pixels[owner] >= pixels[tables.run_group] * (1 - 1e-9)).all()
            inside += (pixels[np.isfinite(groups["error"])] > 1e6).any()
            urgency = levels.cut(tables, view, 0.0).urgency
            finite = np.isfinite(pixels) & (pixels > 0)
            assert (urgency[page_of[finite]] >= pixels[finite] * (1 - 1e-6)).all()
    assert inside > 100


# --- prefixes ---


def open_prefix(tables, known_groups, run_count=None, **changes):
    """Opens a prefix with so many runs, of all by default."""
    data = np.frombuffer(tables.to_bytes(), np.uint8)
    groups_begin = 16 * len(tables.pages)
    runs_begin = groups_begin + 32 * len(tables.groups)
    head = data[: groups_begin + 32 * known_groups].copy()
    runs = data[runs_begin:].copy()
    fields = {
        "page_count": len(tables.pages),
        "coarse_page_count": tables.coarse_pages,
        "group_count": len(tables.groups),
        "run_count": len(tables.run_group),
        "root_page_count": tables.root_pages,
    }
    run_bytes = len(runs) if run_count is None else 4 * run_count
    arrays = {"bytes": head, "runs": runs, "byte_count": len(head), "run_bytes": run_bytes}
    opened = Handle()
    call("open_levels", CTables(**(fields | changes), **arrays), opened.out)
    return opened


def test_prefixes_that_are_too_short_are_a_mistake_of_the_caller():
    tables = primitives_of("lod_levels")[0].tables
    ends = np.append(tables.pages["firstGroup"][1:], len(tables.groups)).astype(int)
    roots = int(ends[tables.root_pages - 1])
    assert roots < len(tables.groups)
    open_prefix(tables, roots)  # with more runs than it needs
    needed = int(tables.run_begin[roots])
    open_prefix(tables, roots, needed)
    for known in (0, roots - 1):
        with pytest.raises(ValueError, match="the prefix ends before the groups of the root pages"):
            open_prefix(tables, known)
    with pytest.raises(ValueError, match="the prefix has fewer runs than its groups"):
        open_prefix(tables, roots, needed - 1)
    with pytest.raises(ValueError, match="a prefix needs the number of root pages"):
        open_prefix(tables, roots, root_page_count=0)
    open_prefix(tables, len(tables.groups), root_page_count=0)


def test_a_prefix_of_the_groups_needed_is_enough():
    for primitive in primitives_of("lod_levels"):
        tables = primitive.tables
        ends = np.append(tables.pages["firstGroup"][1:], len(tables.groups)).astype(int)
        view, known = View(None, 1e9), int(ends[tables.root_pages - 1])
        steps = 0
        while (levels := Levels.of(tables, known)).cut(tables, view, 0.0).groups_needed > known:
            known = levels.cut(tables, view, 0.0).groups_needed
            assert known in ends
            steps += 1
        assert known == levels.counts.known_groups and steps > 0


def test_pages_that_a_prefix_does_not_know_are_not_checked():
    primitive = primitives_of("lod_levels")[0]
    tables = primitive.tables
    known = int(tables.pages["firstGroup"][tables.root_pages])
    levels, last = Levels.of(tables, known), len(tables.pages) - 1
    view = _codec.View(primitive.page(last))
    with pytest.raises(ValueError, match="the groups of the page are not in the prefix"):
        call("check_page", levels, last, view, None)


# --- matrices ---


@pytest.mark.parametrize("scale", [1e-200, 1e-5, 1e200])
def test_matrices_of_any_scale(scale):
    tables = primitives_of("lod_levels")[0].tables
    matrix = np.diag([scale, scale / 2, scale / 3, 1.0])
    errors = np.unique(tables.groups["error"])
    threshold = float(errors[len(errors) // 2 - 1 :][:2].mean())
    made = Levels.of(tables).cut(tables, View(None, 1.0), threshold * scale, None, matrix)
    plain = Levels.of(tables).cut(tables, View(None, 1.0), threshold)
    np.testing.assert_array_equal(made.active, plain.active)
    with pytest.raises(ValueError, match="the matrix is too large"):
        Levels.of(tables).cut(tables, View(None, 1.0), 1.0, None, np.full((4, 4), 1.7e308))
