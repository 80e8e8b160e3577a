"""Every cut is level 0 with whole groups replaced, each once, and has no cracks."""

from dataclasses import replace

import numpy as np
import pytest

import gltf_ext
from gltf_ext.checks.coverage import check_coverage
from gltf_ext.checks.samples import surface_distances
from gltf_ext.lod import Cut, View, cut_at_error, cut_at_level, cut_for_view, error_of, open_lod
from gltf_ext.lod.cuts import active_groups, cut_of
from gltf_ext.lod.tables import reach
from spec import reference_lod
from tests.helpers import environment
from tests.helpers.c_levels import compare_at_random
from tests.helpers.lod import Certifier, random_views

SMALL, LARGE = ("chinesedragon",), ("dragon", "igea", "bunny", "suzanne", "beast", "sponza_like")
MODELS = [*SMALL, *(pytest.param(name, marks=pytest.mark.full) for name in LARGE)]
CUTS, FULL_CUTS = 60, 1000


@pytest.fixture(scope="module", autouse=True)
def simplifier_package():
    environment.need_package("meshoptimizer")


def counted() -> int:
    return FULL_CUTS if environment.full else CUTS


@pytest.fixture(scope="module", params=MODELS)
def primitive(request, tmp_path_factory):
    path = environment.MODELS / f"{request.param}.glb"
    if not path.is_file():
        environment.missing(f"no model {path}")
    output = tmp_path_factory.mktemp("lod") / "out.glb"
    gltf_ext.compress(path, output, lod=True)
    with_levels = [p for p in open_lod(output) if hasattr(p, "tables")]
    return max(with_levels, key=lambda p: p.compressed.triangle_count)


@pytest.fixture(scope="module")
def certifier(primitive):
    return Certifier(primitive)


def is_sound(certifier, drawn):
    return certifier.has_no_cracks(drawn) and certifier.covers_once(drawn)


def needed_and_resident(primitive, view, threshold, random):
    """(groups needed, pages resident): few pages of every other cut, most of the rest."""
    tables = primitive.tables
    needed = View(view[0], view[1]).pixels(tables) > threshold
    share = random.uniform(0.05, 0.98) if random.random() < 0.5 else random.uniform(0.7, 1.0)
    resident = random.random(len(tables.pages)) < share
    resident[: tables.root_pages] = True
    return needed, resident


def test_levels_are_sound(primitive, certifier):
    tables = primitive.tables
    for level in range(tables.level_count):
        assert is_sound(certifier, cut_at_level(tables, level).drawn)
    drawn = cut_at_level(tables, 0).drawn
    assert primitive.cluster_triangles[drawn].sum() == primitive.compressed.triangle_count


def test_c_makes_the_same_cuts(primitive):
    compare_at_random(primitive.tables, 4 * counted())


def test_replacements_keep_borders_and_spheres_nest(primitive):
    """As the specification checks them, on integers and in binary64."""
    check_coverage(primitive, strict=True)
    tables = primitive.tables
    owner, finer = tables.run_owner, tables.run_group
    assert (reach(tables.groups, owner, finer) <= tables.groups["radius"][owner]).all()


def test_random_cuts_are_sound(primitive, certifier):
    random = np.random.default_rng(0)
    tables = primitive.tables
    shares = []
    for eye, pixels, threshold in random_views(primitive, counted(), random):
        cut = cut_for_view(tables, View(eye, pixels), threshold)
        assert is_sound(certifier, cut.drawn)
        shares.append(primitive.cluster_triangles[cut.drawn].sum())
    # The cuts differ; small models have few groups.
    assert len(set(shares)) > min(len(shares) // 10, 2 * len(tables.groups))


def test_cuts_of_random_pages_are_sound(primitive, certifier):
    random = np.random.default_rng(1)
    tables = primitive.tables
    for *view, threshold in random_views(primitive, counted(), random):
        needed, resident = needed_and_resident(primitive, view, threshold, random)
        cut = cut_for_view(tables, View(*view), threshold, resident)
        assert is_sound(certifier, cut.drawn)
        assert resident[cut.pages].all()
        assert not (cut.active & ~needed).any()


def test_errors_and_spheres_make_the_loop_unnecessary(primitive):
    """Needed groups are active; with pages missing, those whose coarser ones are there."""
    random = np.random.default_rng(2)
    tables = primitive.tables
    for *view, threshold in random_views(primitive, counted(), random):
        needed, resident = needed_and_resident(primitive, view, threshold, random)
        assert np.array_equal(active_groups(tables, needed), needed)
        present = active_groups(tables, resident[tables.groups["page"]])
        here = needed & resident[tables.groups["page"]]
        assert np.array_equal(active_groups(tables, here), present & needed)


def test_breaking_the_rule_fails(primitive, certifier):
    """Controls: without the recursion over missing pages, and with errors in random order."""
    random = np.random.default_rng(3)
    tables = primitive.tables
    failed = {"pages": 0, "errors": 0}
    wild = np.exp(random.normal(size=len(tables.groups)) * 1.5)
    for *view, threshold in random_views(primitive, counted(), random):
        needed, resident = needed_and_resident(primitive, view, threshold, random)
        odd = View(*view).pixels(tables) * wild > threshold
        for name, active in (
            ("pages", needed & resident[tables.groups["page"]]),
            ("errors", odd | np.isinf(tables.groups["error"])),
        ):
            finer = tables.finer_group
            drawn = active[tables.cluster_group] & ~(active[finer] & (finer >= 0))
            failed[name] += not is_sound(certifier, drawn)
    assert failed["pages"] > 0 and failed["errors"] > 0


def test_two_layers_are_not_sound(primitive, certifier):
    """Closed is not enough: a coarse level over a fine one."""
    tables = primitive.tables
    both = cut_at_level(tables, 0).drawn | cut_at_level(tables, 1).drawn
    assert not certifier.covers_once(both)
    missing = cut_at_level(tables, 1).drawn.copy()
    # Not a connected component of the model: one with an edge inside the surface.
    is_inside = ~certifier.border[certifier.ends].any(axis=1)
    has_neighbour = np.ravel(abs(certifier.boundary[is_inside]).sum(axis=0)) > 0
    missing[np.flatnonzero(missing & has_neighbour)[0]] = False
    assert not certifier.covers_once(missing) and not certifier.has_no_cracks(missing)


def test_the_reference_reader_finds_the_same_cuts(primitive):
    tables = primitive.tables
    theirs = reference_lod.read(
        tables.to_bytes(),
        len(tables.pages),
        tables.coarse_pages,
        len(tables.groups),
        len(tables.run_group),
    )
    assert [g.level for g in theirs.groups] == tables.group_level.tolist()
    random = np.random.default_rng(4)
    first = np.concatenate([[0], np.cumsum([len(p) for p in _clusters_of_pages(tables)])])
    for *view, threshold in random_views(primitive, 5, random):
        needed, resident = needed_and_resident(primitive, view, threshold, random)
        cut = cut_for_view(tables, View(*view), threshold, resident)
        active = reference_lod.active_groups(theirs, needed.tolist(), resident.tolist())
        assert active == cut.active.tolist()
        drawn = [first[page] + c for page, c in reference_lod.drawn_clusters(theirs, active)]
        assert drawn == np.flatnonzero(cut.drawn).tolist()


def _clusters_of_pages(tables):
    page = tables.groups["page"][tables.cluster_group]
    return [np.flatnonzero(page == p) for p in range(len(tables.pages))]


def test_each_page_decodes_alone(primitive):
    """All other pages overwritten by noise, the same values."""
    random = np.random.default_rng(5)
    tables = primitive.tables
    begin, split = tables.page_begin, len(primitive.coarse)
    whole = bytes(primitive.coarse) + bytes(primitive.compressed.blob)
    page_of = tables.groups["page"][tables.cluster_group]
    for page in random.permutation(len(tables.pages))[: None if environment.full else 10]:
        noise = bytearray(random.bytes(len(whole)))
        noise[begin[page] : begin[page + 1]] = whole[begin[page] : begin[page + 1]]
        compressed = replace(primitive.compressed, blob=bytes(noise[split:]))
        alone = replace(primitive, compressed=compressed, coarse=bytes(noise[:split]))
        drawn = page_of == page
        cut = Cut(np.empty(0, bool), drawn, np.array([page]), np.array([page]))
        for (_, ours), (_, theirs) in zip(alone.mesh(cut).arrays, primitive.mesh(cut).arrays):
            assert np.array_equal(ours, theirs)
        assert np.array_equal(alone.mesh(cut).indices, primitive.mesh(cut).indices)
        other = (page + 1) % len(tables.pages)
        with pytest.raises(gltf_ext.MeshletError):
            alone.mesh(replace(cut, drawn=page_of == other, pages=np.array([other])))


def test_stated_errors_hold_for_cuts(primitive):
    """99.9 % of surface samples, both ways, for the levels and some errors."""
    tables, finest = primitive.tables, primitive.compressed.decode()
    errors = tables.groups["error"].astype(np.float64)
    errors = np.sort(errors[np.isfinite(errors) & (errors > 0)])
    cuts = [cut_at_level(tables, level) for level in range(1, tables.level_count)]
    cuts += [cut_at_error(tables, e) for e in errors[:: max(len(errors) // 4, 1)]]
    for cut in cuts:
        distances = surface_distances(finest, primitive.mesh(cut), 20_000)
        assert (distances <= error_of(tables, cut)).mean() >= 0.999


def test_an_error_of_zero_draws_the_finest_surface(primitive):
    tables = primitive.tables
    cut = cut_at_error(tables, 0.0)
    assert error_of(tables, cut) == 0.0
    is_top = np.isinf(tables.groups["error"])
    assert np.array_equal(cut_of(tables, is_top).active, is_top)
