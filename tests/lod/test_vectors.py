"""Conformance vectors of EXT_meshlet_lod: both readers find the same, and refuse the same."""

import hashlib
import json
import re
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.checks.coverage import check_coverage
from gltf_ext.document.container import read_document
from gltf_ext.lod import View, cut_at_error, cut_at_level, cut_for_view, open_lod
from gltf_ext.lod.cuts import cut_of
from gltf_meshlet import cli
from spec import make_lod_vectors, reference_lod
from spec.make_lod_vectors import FOLDER, VALID
from tests.helpers.environment import ROOT
from tests.helpers.lod import Certifier
from tests.helpers.vulkan_scenes import require_vulkan

SCHEMA = ROOT / "spec" / "schema" / "mesh.primitive.EXT_meshlet_lod.schema.json"
MALFORMED = json.loads((FOLDER / "malformed.json").read_text())


def expected_of(name):
    return json.loads((FOLDER / f"lod_{name}.json").read_text())


def primitives_with_levels(name):
    return [p for p in open_lod(FOLDER / f"lod_{name}.glb") if hasattr(p, "tables")]


def test_folder_and_document_are_up_to_date():
    written = make_lod_vectors.files()
    assert {path.name for path in FOLDER.iterdir()} == set(written)
    for name, content in written.items():
        assert (FOLDER / name).read_bytes() == content, name
    assert make_lod_vectors.DOCUMENT.read_text() == make_lod_vectors.document_with_example()


def test_files_of_the_draft_still_read():
    """The first file with levels, byte for byte."""
    data = (FOLDER / "lod_strip.glb").read_bytes()
    digest = "ef94cccc32ea2ceae89b81d4dce49bc2ac9588671d3c2566535c6a727a8c62c4"
    assert hashlib.sha256(data).hexdigest() == digest


def test_frozen_vectors_stay():
    """All valid ones and what readers find in them; the transport form is still a draft."""
    digest = hashlib.sha256()
    for path in sorted(FOLDER.glob("lod_*")):
        if path.stem != "lod_packed":
            digest.update(path.read_bytes())
    assert digest.hexdigest() == (
        "1f27d34d0aa11c3e98ff9aa179d347b2bf693720c3b7ef9534f50e03b00719e2"
    )


def cut_of_vector(tables, cut):
    """The cut that an entry of a JSON file describes."""
    resident = None
    if "resident" in cut:
        resident = np.isin(np.arange(len(tables.pages)), cut["resident"])
    if "camera" in cut:
        camera = cut["camera"]
        eye = None if camera["eye"] is None else tuple(camera["eye"])
        matrix = np.array(cut["matrix"]).reshape(4, 4).T if "matrix" in cut else None
        view = View(eye, camera["pixelsPerUnit"])
        return cut_for_view(tables, view, camera["threshold"], resident, matrix)
    if "level" in cut:
        return cut_at_level(tables, cut["level"])
    if resident is None:
        return cut_at_error(tables, cut["error"])
    needed = tables.groups["error"] > cut["error"]
    return cut_of(tables, needed & resident[tables.groups["page"]])


def surface(primitive, cut):
    """The integers of the corners of all triangles of a cut, drawn cluster by drawn cluster."""
    found = []
    for page in cut.pages:
        triangles, values = _codec.decode(primitive.page(page))
        joined = np.concatenate(values, axis=1)
        begin = np.cumsum([0, *_codec.Header(primitive.page(page)).meshlet_triangles])
        for m in primitive.drawn_of_page(page, cut.drawn):
            found += joined[triangles[begin[m] : begin[m + 1]]].tolist()
    return found


@pytest.mark.parametrize("name", VALID)
def test_readers_find_what_the_vectors_say(name):
    path = FOLDER / f"lod_{name}.glb"
    assert gltf_ext.validate(path) == []
    for primitive, expected in zip(open_lod(path), expected_of(name)["primitives"], strict=True):
        assert hasattr(primitive, "tables") == (expected is not None)
        if expected is not None:
            assert_found(primitive, expected)


def assert_found(primitive, expected):
    tables = primitive.tables
    assert tables.group_level.tolist() == expected["levels"]
    assert tables.root_pages == expected["rootPages"]
    group = tables.cluster_group
    for cut in expected["cuts"]:
        found = cut_of_vector(tables, cut)
        assert np.flatnonzero(found.active).tolist() == cut["active"]
        drawn = np.flatnonzero(found.drawn)
        first = tables.cluster_begin[tables.pages["firstGroup"][tables.groups["page"][group]]]
        places = [[int(tables.groups["page"][group[c]]), int(c - first[c])] for c in drawn]
        assert places == cut["drawn"]
        assert primitive.cluster_triangles[drawn].sum() == cut["triangles"]
        assert len(primitive.mesh(found).indices) == cut["triangles"]
        if "surface" in cut:
            assert surface(primitive, found) == cut["surface"]


@pytest.mark.parametrize("name, plain", [("several_buffers", "levels"), ("packed", "sheet")])
def test_the_gpu_reads_buffers_and_packed_pages_alike(name, plain, tmp_path):
    require_vulkan()
    options = ["--backend", "vulkan", "--pages", "1M", "--width", "32", "--height", "32"]

    def picture(vector, pixels):
        output = tmp_path / f"{vector}.png"
        source = str(FOLDER / f"lod_{vector}.glb")
        assert cli.main(["render", source, "-o", str(output), "--lod-error", pixels, *options]) == 0
        return output.read_bytes()

    for pixels in ("1e-6", "1000"):
        assert picture(name, pixels) == picture(plain, pixels)


@pytest.mark.parametrize("name", VALID)
def test_every_cut_covers_the_surface_once(name):
    """By a third way: the border of whole cuts, from all pages, for all sets of needed groups."""
    for primitive in primitives_with_levels(name):
        certifier, tables = Certifier(primitive), primitive.tables
        is_top = np.isinf(tables.groups["error"])
        others = np.flatnonzero(~is_top)
        assert len(others) <= 8
        for choice in range(1 << len(others)):
            needed = is_top.copy()
            needed[others] = choice >> np.arange(len(others)) & 1
            drawn = cut_of(tables, needed).drawn
            assert certifier.covers_once(drawn) and certifier.has_no_cracks(drawn)


def test_vectors_tell_rules_apart():
    """Vectors hold mixed cuts, cuts that need the loop, and cuts that missing pages change."""
    cuts = [
        cut for name in VALID for p in expected_of(name)["primitives"] if p for cut in p["cuts"]
    ]
    assert any(len({page for page, _ in cut["drawn"]}) > 2 for cut in cuts)
    (sheet,) = primitives_with_levels("sheet")
    plain = {name: [c for c in expected_of("sheet")["primitives"][0]["cuts"] if name in c]
             for name in ("camera", "resident", "matrix")}  # fmt: skip
    without = [json.dumps(cut["active"]) for cut in plain["camera"] if "resident" not in cut]
    assert len(set(without)) >= 5
    blocked = 0
    for cut in plain["resident"]:
        here = np.isin(sheet.tables.groups["page"], cut["resident"])
        blocked += int(here.sum()) > len(cut["active"])
    assert blocked >= 2  # a page is there, its groups are not active: a coarser page is missing
    for cut in plain["matrix"]:
        still = cut_of_vector(sheet.tables, {k: v for k, v in cut.items() if k != "matrix"})
        assert np.flatnonzero(still.active).tolist() != cut["active"]


def problems(path):
    """What both validators say, one line each."""
    ours, theirs = gltf_ext.validate(path), reference_lod.problems(path.read_bytes())
    assert len(ours) == len(theirs) == 1 and "\n" not in ours[0]
    return ours[0], theirs[0]


def decode_all(path):
    for primitive in open_lod(path):
        for page in range(len(primitive.tables.pages)):
            primitive.check_page(page)
        primitive.mesh(cut_at_level(primitive.tables, 1))


@pytest.mark.parametrize("file", MALFORMED)
def test_malformed_files_are_refused(file):
    path, expected = FOLDER / file, MALFORMED[file]
    _, theirs = problems(path)
    assert theirs == expected["reason"]
    read = {"tables": open_lod, "page": decode_all}.get(expected["foundBy"])
    if read is not None:
        with pytest.raises(gltf_ext.MeshletError) as error:
            read(path)
        assert "\n" not in str(error.value)
    # Level 0 does not need them.
    assert gltf_ext.load(path)[0].indices.shape in ((192, 3), (128, 3))


def test_hierarchies_that_do_not_cover_are_refused():
    """The checks of replacements alone find these files."""
    found = [f for f, e in MALFORMED.items() if e["foundBy"] == "validator" and "replacement" in f]
    assert len(found) >= 5
    for file in found:
        (primitive,) = open_lod(FOLDER / file)
        cut_at_level(primitive.tables, 0)
        assert "replacement" in problems(FOLDER / file)[0] or "vertex" in problems(FOLDER / file)[0]


def schema_without_references():
    schema = json.loads(SCHEMA.read_text())
    schema.pop("allOf")
    for holder in (schema, schema["properties"]["pages"]):
        holder["properties"]["bufferView"] = {"type": "integer", "minimum": 0}
    return schema


@pytest.mark.parametrize("name", [name for name in VALID if name != "unknown_version"])
def test_the_schema_accepts_the_vectors(name):
    schema = schema_without_references()
    validator = jsonschema.Draft202012Validator(schema)
    document = read_document(FOLDER / f"lod_{name}.glb")
    extension = document.primitive(0, 0)["extensions"]["EXT_meshlet_lod"]
    validator.validate(extension)
    for key in schema["required"]:
        with pytest.raises(jsonschema.ValidationError):
            validator.validate({k: v for k, v in extension.items() if k != key})


def test_the_document_names_what_there_is():
    """Each property with its least and largest value, each as in the schema and in both readers."""
    text = make_lod_vectors.DOCUMENT.read_text()
    properties = schema_without_references()["properties"]
    for key in schema_without_references()["required"]:
        (line,) = re.findall(rf"^\| `{key}` \|.*$", text, re.MULTILINE)
        if "minimum" in properties[key] and key != "bufferView":
            assert f"at least {properties[key]['minimum']}" in line
            assert reference_lod.LEAST_COUNTS[key] == properties[key]["minimum"]
    assert properties["groupCount"]["maximum"] == reference_lod.MAX_GROUPS == 2**24


@pytest.mark.parametrize("layers", [1, 2])
def test_borders_are_not_checked_where_surfaces_touch(layers, tmp_path):
    """Clusters of replacements end elsewhere than their groups. With a second layer on one group,
    level 0 passes edges twice in one direction."""
    file, vertices = make_lod_vectors.strip_file(), make_lod_vectors.strip_vertices(48)
    strip = make_lod_vectors.strip
    count = len(vertices.values[0])
    twice = replace(vertices, values=[np.concatenate([vertices.values[0]] * 2)])
    second = [tuple(corner + count for corner in t) for t in strip(30, 40, 1)]
    fine = [strip(0, 24, 1), strip(24, 48, 1), second][: 1 + layers]
    (_, top), (_, groups) = file.pages
    groups[1].clusters = layers
    coarse = make_lod_vectors.blob([strip(0, 20, 2), strip(20, 48, 2)], vertices)
    pages = [(coarse, top), (make_lod_vectors.blob(fine, twice), groups)]
    path = tmp_path / "file.glb"
    path.write_bytes(replace(file, pages=pages).glb())
    assert len(gltf_ext.validate(path)) == len(reference_lod.problems(path.read_bytes()))
    assert (gltf_ext.validate(path) == []) == (layers == 2)
    (primitive,) = open_lod(path)
    with pytest.raises(gltf_ext.MeshletError, match="border"):
        check_coverage(primitive, strict=True)
