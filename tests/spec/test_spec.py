"""The extension document and its schema."""

import json
import re
from itertools import pairwise

import jsonschema
import pygltflib
import pytest

import gltf_ext
from gltf_meshlet.demo import model as demo_model
from spec import make_vectors, reference_decoder
from spec.make_vectors import EXAMPLE_BEGIN, EXAMPLE_END, ROOT, SPECIFICATION

SCHEMA = ROOT / "spec" / "schema" / "mesh.primitive.EXT_meshlet_edgebreaker.schema.json"
# The parts of the glTF 2.0 schemas that ours refers to.
GLTF_SCHEMAS = {
    "glTFProperty.schema.json": {
        "type": "object",
        "properties": {"extensions": {"type": "object"}, "extras": {}},
    },
    "glTFid.schema.json": {"type": "integer", "minimum": 0},
}
HEADINGS = [
    "Contributors",
    "Status",
    "Dependencies",
    "Overview",
    "Exclusions",
    "glTF Schema Updates",
    "JSON Schema",
    "Conformance",
    "Known Implementations",
    "Interactions with other extensions",
    "Resources",
]


@pytest.fixture(scope="module")
def validator():
    def inline(node):
        """Replaces references by the schemas they name."""
        if isinstance(node, dict):
            if "$ref" in node:
                return GLTF_SCHEMAS[node["$ref"]]
            return {key: inline(value) for key, value in node.items()}
        return [inline(value) for value in node] if isinstance(node, list) else node

    schema = json.loads(SCHEMA.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(inline(schema))


def example_document() -> dict:
    return json.loads(re.search(r"```json\n(.*?)```", SPECIFICATION.read_text(), re.DOTALL)[1])


def test_headings():
    headings = re.findall(r"^## (.*)$", SPECIFICATION.read_text(), re.MULTILINE)
    assert headings[: len(HEADINGS)] == HEADINGS
    assert all(heading.startswith("Appendix") for heading in headings[len(HEADINGS) :])


def test_links_lead_somewhere():
    text = SPECIFICATION.read_text()
    anchors = {
        re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    }
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if target.startswith("#"):
            assert target[1:] in anchors, target
        elif "://" not in target:
            assert (SPECIFICATION.parent / target).exists(), target


def test_example_follows_the_schema(validator):
    document = example_document()
    primitive = document["meshes"][0]["primitives"][0]
    extension = primitive["extensions"]["EXT_meshlet_edgebreaker"]
    validator.validate(extension)
    assert extension["attributes"].keys() == primitive["attributes"].keys()
    assert [target.keys() for target in extension["targets"]] == [
        target.keys() for target in primitive["targets"]
    ]
    assert document["bufferViews"][extension["bufferView"]]["byteLength"] % 4 == 0


def test_compressed_files_follow_the_document(validator, tmp_path):
    """The validity list of the document, on a file that compress wrote."""
    demo_model.write_glb(demo_model.generate(), tmp_path / "in.glb")
    gltf_ext.compress(tmp_path / "in.glb", tmp_path / "out.glb")
    gltf = pygltflib.GLTF2().load(tmp_path / "out.glb")
    assert "EXT_meshlet_edgebreaker" in gltf.extensionsRequired
    for primitive in (primitive for mesh in gltf.meshes for primitive in mesh.primitives):
        extension = primitive.extensions["EXT_meshlet_edgebreaker"]
        validator.validate(extension)
        view = gltf.bufferViews[extension["bufferView"]]
        begin = view.byteOffset or 0
        blob = reference_decoder.decode_view(gltf.binary_blob()[begin : begin + view.byteLength])
        names = {
            name: index for name, index in vars(primitive.attributes).items() if index is not None
        }
        assert extension["attributes"].keys() == names.keys()
        assert begin % 4 == 0 and view.byteStride is None and view.target is None
        assert gltf.accessors[primitive.indices].count == blob.triangles.size
        for index in (primitive.indices, *names.values()):
            assert gltf.accessors[index].bufferView is None
        assert {gltf.accessors[index].count for index in names.values()} == {len(blob.values[0])}
        assert blob.streams[0].kind == reference_decoder.GRID and blob.streams[0].elements == 3


@pytest.mark.parametrize(
    "extension",
    [
        {},
        {"bufferView": 0},
        {"attributes": {"POSITION": 0}},
        {"bufferView": -1, "attributes": {"POSITION": 0}},
        {"bufferView": 0, "attributes": {}},
        {"bufferView": 0, "attributes": {"NORMAL": 1}},
        {"bufferView": 0, "attributes": {"POSITION": 1}},
        {"bufferView": 0, "attributes": {"POSITION": 0, "NORMAL": 0}},
        {"bufferView": 0, "attributes": {"POSITION": 0, "NORMAL": 64}},
        {"bufferView": 0, "attributes": {"POSITION": 0}, "targets": []},
        {"bufferView": 0, "attributes": {"POSITION": 0}, "targets": [{}]},
        {"bufferView": 0, "attributes": {"POSITION": 0}, "sourceVertices": 0},
        {"bufferView": 0, "attributes": {"POSITION": 0}, "equalVertices": 1},
        {"bufferView": 0, "attributes": {"POSITION": 0}, "equalVertices": {}},
    ],
)
def test_schema_refuses(validator, extension):
    assert not validator.is_valid(extension)


def test_worked_example_is_up_to_date():
    document = SPECIFICATION.read_text()
    text = make_vectors.worked_example_text(make_vectors.committed("worked_example"))
    assert document == make_vectors.replace_example(document, text), (
        "run: python -m spec.make_vectors"
    )
    assert document.count(EXAMPLE_BEGIN) == document.count(EXAMPLE_END) == 1


def test_lines_are_short():
    assert [line for line in SPECIFICATION.read_text().split("\n") if len(line) > 160] == []


def test_worked_example_accounts_for_every_bit():
    """Tables and fields have no gaps; a meshlet's data end in the byte before the next one's."""
    blob = make_vectors.committed("worked_example")
    file = reference_decoder.BlobFile(blob)
    for m, (start, end) in enumerate(zip(file.starts, file.ends)):
        fields = make_vectors.meshlet_fields(blob, m)
        assert fields[0].position == 8 * start
        for field, following in pairwise(fields):
            assert field.position + field.width == following.position
        unused = end - -(-(fields[-1].position + fields[-1].width) // 8)
        assert unused == 0 if m < file.meshlet_count - 1 else unused < 4


def test_fields_have_the_same_names_in_the_text_and_in_the_worked_example():
    text = SPECIFICATION.read_text().replace("\N{MINUS SIGN}", "-")
    text = text[text.index("### A.5") : text.index("### A.6")]
    assert [name for name in make_vectors.SECTIONS if name not in text] == []


def test_limits_are_those_of_the_reference_decoder():
    """The limits in the text are the constants of the decoder."""
    text = SPECIFICATION.read_text()
    assert f"q > {reference_decoder.MAX_QUOTIENT} |" in text
    assert f"not stored after {reference_decoder.MAX_HOPS} hops is malformed" in text
    assert f"1 … {reference_decoder.MAX_STREAMS} |" in text
    assert f"0x{reference_decoder.MAGIC:08X}" in text
