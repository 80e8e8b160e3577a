"""Streaming in Node, without an engine: cuts, malformed files, faults of servers, the budget."""

from __future__ import annotations

import json
import subprocess
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from gltf_ext import compress, transcode
from gltf_ext.lod import cut_at_error, open_lod
from gltf_ext.lod.cuts import known_groups
from tests.helpers import environment, streams
from tests.helpers.environment import ROOT
from tests.helpers.large import moved_beyond_4_gib

WEB = ROOT / "web"
VECTORS = ROOT / "spec" / "lod_vectors"
MOST_MINIFIED = 60_000  # bytes of MeshletStream
MOST_KILOBYTES = 40  # of what a page downloads to stream, with Brotli, without three.js
MUTANTS = 300
ALL_MUTANTS = 20_000  # with --full


stream = partial(streams.stream, "stream.mjs")


def test_cuts_are_those_of_the_vectors():
    files = sorted(VECTORS.glob("lod_*.glb"))
    assert len(files) > 5
    given = [path for file in files for path in (file, file.with_suffix(".json"))]
    assert stream("cuts", *given) == []


@pytest.fixture(scope="module")
def many_groups(tmp_path_factory) -> Path:
    """Small groups, so that the tables are larger than the first request, as of a large model."""
    environment.need_package("meshoptimizer")
    folder = tmp_path_factory.mktemp("ball")
    ball = trimesh.creation.icosphere(7, 1.0)
    ball.vertices *= (1 + np.random.default_rng(1).normal(size=len(ball.vertices)) * 0.002)[:, None]
    ball.export(folder / "ball.glb")
    # Bits of which the views of these tests know which groups they need.
    bits = {"position_bits": 12, "normal_bits": 8}
    options = {"page_bytes": 4096, "lod_group": 4, **bits}
    compress(folder / "ball.glb", folder / "lod.glb", lod=True, **options)
    return folder / "lod.glb"


def test_groups_are_known_by_whole_pages(many_groups):
    """A page of which the last groups are unknown would be decoded with too few clusters."""
    assert stream("wholePages", many_groups) == []


def test_tables_are_read_as_far_as_the_view_needs_them(many_groups):
    result = stream("tableParts", many_groups)
    far, near = result["far"], result["near"]
    assert result["view"] > 2 * 32768
    assert far["bytes"] < result["view"] / 20 and far["requests"] <= 2 and far["known"] < 0.2
    assert near["known"] > 0.9 and near["requests"] <= 12


def test_cuts_are_those_of_whole_tables(many_groups):
    result = stream("tableFlight", many_groups)
    assert result["wrong"] == []
    known = result["known"]
    assert known[0] < 0.2 and known == sorted(known) and len(set(known)) > 2


def test_levels_are_those_of_whole_tables(many_groups):
    """They are counted from level 0."""
    shown, expected = stream("shownLevels", many_groups)
    assert shown == expected and len(shown) > 1


def test_tables_within_a_budget(many_groups):
    """Which groups are known does not change what fits."""
    result = stream("budget", many_groups, 4_000_000)
    assert result["most"] <= 4_000_000
    assert result["same"] is True
    assert result["threshold"] > 1


def test_first_picture_that_does_not_fit(many_groups):
    """What follows it fits anyway."""
    result = stream("budget", many_groups, 1_400_000)
    assert result["most"] <= 1_400_000
    assert result["same"] is True
    assert 1 < result["threshold"] < 30


def test_later_parts_of_tables_that_are_malformed(many_groups):
    result = stream("laterMalformed", many_groups)
    assert result["far"] == {"complete": True, "refused": [], "warnings": [], "broken": []}
    assert result["near"]["broken"] == ["its levels are malformed"]
    assert result["near"]["refused"] == ["EXT_meshlet_lod has a group without clusters"]


def test_later_parts_of_tables_that_fail(many_groups):
    """They are read again as pages are."""
    results = stream("laterFaults", many_groups)
    assert all(result["broken"] == [] for result in results.values())
    assert [result["complete"] for result in results.values()] == [True, True, False]
    refused = results["404 1000000000"]
    assert [text[-23:] for text in refused["warnings"]] == 3 * ["the server answered 404"]
    assert refused["triangles"] > 0


def test_tables_of_other_files_are_read_though_one_fails(many_groups):
    """And those of that one, once the server gives them, if the view asks for another part."""
    result = stream("twoFiles", many_groups)
    assert result["broken"] == []
    assert [text[-30:] for text in result["warnings"]] == 3 * ["b.bin: the server answered 403"]
    fine, failing = result["known"]
    assert fine > failing
    assert result["recovered"] == {"complete": True, "known": [1, 1]}


def test_first_bytes_of_a_file_are_kept_for_unknown_groups_only(many_groups):
    results = stream("heads", many_groups)
    for at in results:
        is_needed = at["known"] < at["groups"] and at["next"] < 32768
        assert at["held"] == 32768 * is_needed, at
    assert results[0]["held"] > 0
    assert any(at["held"] == 0 and at["known"] < at["groups"] for at in results)


def test_held_tables_are_as_measured(many_groups):
    """`held_bytes`, which measurements and warnings use, counts the groups that a stream reads."""
    (primitive,) = open_lod(many_groups)
    errors = np.geomspace(0.009, 0.014, 9).tolist()
    expected = [known_groups(primitive.tables, cut_at_error(primitive.tables, e)) for e in errors]
    assert stream("knownGroups", many_groups, *errors) == expected
    assert len(set(expected)) > 3


def test_counts_beyond_those_of_the_clusters_are_refused():
    reasons = stream("counts", VECTORS / "lod_levels.glb")
    assert len(reasons) == 8
    assert set(reasons) == {
        "EXT_meshlet_lod has a page with more triangles or vertices than its clusters can have"
    }


def test_packed_tables_are_refused():
    reasons = stream("packedTables", VECTORS / "lod_levels.glb")
    assert reasons == ["EXT_meshlet_lod has tables that are packed"]


def test_malformed_vectors():
    """Levels are refused, or pages; a page is never drawn that is not as the tables say."""
    reasons = json.loads((VECTORS / "malformed.json").read_text())
    results = stream("malformed", *sorted(VECTORS.glob("malformed_*.glb")))
    assert set(results) == set(reasons)
    for name, result in results.items():
        assert result.get("ours", True), (name, result)
        found = reasons[name]["foundBy"]
        told = result.get("refused", []) + result.get("warnings", []) + result.get("broken", [])
        if found != "validator" and not name.startswith("malformed_not_compressed"):
            assert told or "error" in result, (name, result)
        if found == "tables" and "not_compressed" not in name:
            assert result.get("refused") or "error" in result, (name, result)


def test_packed_files_stream_as_unpacked_ones(bunny, tmp_path):
    transcode(bunny, tmp_path / "packed.glb")
    assert stream("same", bunny, tmp_path / "packed.glb") is True
    assert stream("budget", tmp_path / "packed.glb", 9_000_000)["most"] <= 9_000_000


def test_levels_beyond_4_gib_stream(tmp_path):
    near = VECTORS / "lod_levels.glb"
    assert stream("same", near, moved_beyond_4_gib(near, tmp_path)) is True


def test_faults_of_servers(bunny):
    """The picture is complete and the same with each of them, and each is told."""
    results = stream("faults", bunny)
    assert len(results) > 8
    for name, result in results.items():
        assert (result["drawn"], result["complete"], result["broken"]) == (True, True, []), name
        assert bool(result["warnings"]) == (name != "none"), name
    for name in ("ignores ranges", "ignores later ranges"):
        assert "does not answer ranges, so that the whole file" in results[name]["warnings"][0]
    assert "compresses its answers" in results["compresses ranges"]["warnings"][0]
    (hidden,) = results["hides its headers"]["warnings"]
    assert "Access-Control-Expose-Headers: Content-Range, ETag" in hidden


def test_whole_files_that_stall_are_read_again(bunny):
    for result in stream("stalls", bunny).values():
        assert (result["all"], result["aborted"]) == (True, "stopped")
        assert result["warnings"][-1] == "no answer for 0.3 seconds; trying again"


def test_refusals_changes_and_offline(bunny, model, tmp_path):
    compress(model("suzanne.glb"), tmp_path / "other.glb", lod=True)
    results = stream("refusals", bunny, tmp_path / "other.glb")
    assert results["404"].endswith("the server answered 404")
    assert results["403"].endswith("the server answered 403")
    assert results["416"].endswith("the file is empty")
    assert results["changed"] and "the file has changed" in results["changed"][0]
    assert results["offline"] == {"complete": False, "warned": True}
    assert results["back"] is True


def test_requests_of_what_has_left_the_view_are_cancelled(bunny):
    result = stream("cancels", bunny)
    assert result["before"] > 0
    assert (result["after"], result["warnings"]) == (0, [])


def test_streams_end_before_they_are_open(bunny):
    results = stream("endsEarly", bunny)
    assert results["aborted"] == "aborted"
    assert results["opening"] == results["restarting"] == "the stream is disposed"
    assert results["requests"] == 0


def test_first_picture_has_a_shape(bunny):
    """The coarsest level alone would be 13 pixels off."""
    first = stream("first", bunny)
    assert first["error"] < 6
    assert first["fetched"] <= 150_000
    assert first["share"] < 0.5
    assert first["warnings"] == []


def test_budget_is_kept_and_the_end_does_not_depend_on_the_path(bunny):
    errors = []
    for budget in (3_000_000, 4_000_000, 64_000_000):
        result = stream("budget", bunny, budget)
        assert result["most"] <= budget
        assert result["same"] is True
        assert result["triangles"] > 1000
        errors.append(result["threshold"])
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > errors[-1] == 1


def test_workers_that_outgrow_the_budget():
    """What the stream had to forget for them is read once again, no more."""
    result = stream("grown")
    assert result["resident"] == 40
    assert max(result["reads"]) <= 2


def test_pages_that_were_given_up_are_not_read_with_their_neighbours():
    result = stream("givenUp")
    assert result["resident"] == 37
    assert [page for page, reads in enumerate(result["reads"]) if reads == 0] == [1, 2, 30]


def test_refused_root_pages_break_the_stream():
    result = stream("refusedRoot")
    assert result["broken"][0] == "the server answered 404"
    assert len(result["warnings"]) == result["reads"][3] == 3


def test_pages_that_kill_their_workers_are_given_up(bunny):
    """Other Workers take their place, and all else is drawn."""
    result = stream("killers", bunny)
    assert (len(result["load"]), result["error"]) == (1, [])
    assert (result["kills"], result["missing"]) == (3, 1)
    (warning,) = result["warning"]
    assert warning == (
        f"mesh 0 primitive 0: page {result['number']}: a decoder's Worker failed: out of memory"
    )


def test_restarts_end(bunny):
    """Of a stream whose file changes soon after each picture."""
    result = stream("flapping", bunny, 0)
    (error,) = result["error"]
    assert "the file has changed" in error
    assert len(result["warning"]) == 5 and len(result["load"]) == 6
    assert stream("flapping", bunny, 61)["error"] == []


def test_dead_workers_break_the_stream():
    result = stream("dead")
    assert result["broken"][0] == "a Worker failed"
    assert result["warnings"] == []


@pytest.fixture(scope="module")
def two_layouts(tmp_path_factory) -> Path:
    """Two balls, one of them with colours, so that vertices lie in different pools. Tables are
    read in parts."""
    environment.need_package("meshoptimizer")
    folder = tmp_path_factory.mktemp("layouts")
    scene = trimesh.Scene()
    for number, x in enumerate((0.0, 50.0)):
        ball = trimesh.creation.icosphere(6, 1.0)
        noise = np.random.default_rng(number).normal(size=len(ball.vertices)) * 0.005
        ball.vertices = ball.vertices * (1 + noise)[:, None] + [x, 0, 0]
        if number:
            ball.visual.vertex_colors = np.full((len(ball.vertices), 4), 200, np.uint8)
        scene.add_geometry(ball)
    scene.export(folder / "balls.glb")
    groups = {"page_bytes": 4096, "lod_group": 4}
    compress(folder / "balls.glb", folder / "lod.glb", lod=True, **groups)
    return folder / "lod.glb"


def test_memory_moves_to_the_layout_in_view(two_layouts):
    result = stream("budget", two_layouts, 4_000_000)
    assert result["resized"] > 0
    assert result["most"] <= 4_000_000
    assert result["same"] is True
    assert result["threshold"] > 1


def test_pages_that_draw_on_demand_see_all(bunny, two_layouts):
    """Pages that update only after `onChange`."""
    assert stream("onDemand", bunny, 64_000_000) is True
    assert stream("onDemand", two_layouts, 4_000_000) is True


def test_mutants_are_refused_or_drawn(request, tmp_path):
    count = ALL_MUTANTS if request.config.getoption("--full") else MUTANTS
    transcode(VECTORS / "lod_levels.glb", tmp_path / "packed.glb")
    files = (VECTORS / "lod_levels.glb", VECTORS / "lod_streams.glb", tmp_path / "packed.glb")
    for seed, file in enumerate(files):
        ends = stream("mutants", file, count // 2, seed)
        assert sum(ends[end] for end in ("refused", "failed", "opened")) == count // 2
        assert min(ends["failed"], ends["opened"]) > count / 20 and ends["refused"] > 0
        assert ends["most"] < 8_000_000


def loaded_at_once(meta: dict[str, Any], name: str) -> set[str]:
    """The files that a page loads with one of a bundle: not those that it imports when it needs
    them."""
    files, waiting = set(), [name]
    while waiting:
        file = waiting.pop()
        files.add(file)
        imports = meta["outputs"][file]["imports"]
        needed = {i["path"] for i in imports if i["kind"] == "import-statement"}
        waiting += needed & set(meta["outputs"]) - files
    return files


def test_download_is_small(tmp_path):
    """Library, Worker and decoder in bundles, compressed by Brotli; three.js is the page's own.
    The transport form does not count, nor what decodes primitives without levels for the page."""
    program = environment.need_npm_package("esbuild") / "bin" / "esbuild"
    options = ["--bundle", "--minify", "--format=esm", "--splitting", "--log-level=error"]
    options += [f"--external:{name}" for name in ("three", "three/*", "*/transport.js")]
    downloaded = [WEB / "decoder.wasm"]
    for name, source in (("stream", "three.js"), ("worker", "worker.js")):
        folder, meta = tmp_path / name, tmp_path / f"{name}.json"
        given = [f"{name}={WEB / 'stream' / source}", f"--outdir={folder}", f"--metafile={meta}"]
        subprocess.run([program, *given, *options], check=True, cwd=tmp_path)
        files = loaded_at_once(json.loads(meta.read_text()), f"{name}/{name}.js")
        downloaded += [tmp_path / file for file in sorted(files)]
        if name == "stream":  # before compression
            assert sum((tmp_path / file).stat().st_size for file in files) <= MOST_MINIFIED
    script = "process.stdout.write(String(require('zlib').brotliCompressSync(" + (
        "require('fs').readFileSync(process.argv[1])).length))"
    )
    sizes = [int(subprocess.check_output(["node", "-e", script, file])) for file in downloaded]
    assert sum(sizes) <= 1000 * MOST_KILOBYTES, sizes
