"""Conformance vectors of EXT_meshlet_lod: both readers find the same, and refuse the same."""

import json

import jsonschema
import numpy as np
import pytest

import gltf_ext
from gltf_ext.gltf.container import read_document
from gltf_ext.lod import cut_at_error, open_lod
from spec import make_lod_vectors
from spec.make_lod_vectors import FOLDER, MALFORMED, VALID
from tests.helpers.environment import ROOT

SCHEMA = ROOT / "spec" / "schema" / "mesh.primitive.EXT_meshlet_lod.schema.json"


def test_folder_and_document_are_up_to_date():
    written = make_lod_vectors.files()
    assert {path.name for path in FOLDER.iterdir()} == set(written)
    for name, content in written.items():
        assert (FOLDER / name).read_bytes() == content, name
    assert make_lod_vectors.DOCUMENT.read_text() == make_lod_vectors.document_with_example()


@pytest.mark.parametrize("name", VALID)
def test_readers_find_what_the_vectors_say(name):
    path = FOLDER / f"lod_{name}.glb"
    expected = json.loads((FOLDER / f"lod_{name}.json").read_text())
    assert gltf_ext.validate(path) == []
    (primitive,) = open_lod(path)
    tables = primitive.tables
    assert tables.group_level.tolist() == expected["levels"]
    group = tables.cluster_group
    for cut in expected["cuts"]:
        found = cut_at_error(tables, cut["error"])
        assert np.flatnonzero(found.active).tolist() == cut["active"]
        drawn = np.flatnonzero(found.drawn)
        first = tables.cluster_begin[tables.pages["firstGroup"][tables.groups["page"][group]]]
        places = [[int(tables.groups["page"][group[c]]), int(c - first[c])] for c in drawn]
        assert places == cut["drawn"]


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_tables_are_refused(name):
    path = FOLDER / f"malformed_{name}.glb"
    with pytest.raises(gltf_ext.MeshletError, match="EXT_meshlet_lod") as error:
        open_lod(path)
    assert "\n" not in str(error.value)
    assert len(gltf_ext.validate(path)) == 1
    # Level 0 does not need them.
    assert gltf_ext.load(path)[0].indices.shape == (192, 3)


@pytest.mark.parametrize("name", VALID)
def test_the_schema_accepts_the_vectors(name):
    schema = json.loads(SCHEMA.read_text())
    for reference in ("bufferView",):
        schema["properties"][reference].pop("allOf")
        schema["properties"]["pages"]["properties"][reference].pop("allOf")
    schema.pop("allOf")
    validator = jsonschema.Draft202012Validator(schema)
    document = read_document(FOLDER / f"lod_{name}.glb")
    extension = document.meshes[0].primitives[0].extensions["EXT_meshlet_lod"]
    validator.validate(extension)
    for key in schema["required"]:
        with pytest.raises(jsonschema.ValidationError):
            validator.validate({k: v for k, v in extension.items() if k != key})


def test_the_document_names_what_there_is():
    text = make_lod_vectors.DOCUMENT.read_text()
    schema = json.loads(SCHEMA.read_text())
    for key in schema["required"]:
        assert f"| `{key}` |" in text
