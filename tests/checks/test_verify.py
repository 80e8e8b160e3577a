"""verify and validate find differences and damage."""

import struct

import numpy as np
import pytest

import gltf_ext
from gltf_ext.checks.triangles import (
    IN_COMPRESSED,
    IN_SOURCE,
    OPTIONAL_IN_SOURCE,
    TRIANGLE,
    difference,
    rotated,
)
from tests.helpers.gltf_builder import (
    NORMALIZED,
    Builder,
    everything,
    glb_bytes,
    glb_json,
    glb_parts,
    grid_mesh,
)

EXTENSION = "EXT_meshlet_edgebreaker"


def write(path, attributes, triangles, targets=()):
    builder = Builder()
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    return builder.write(path)


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verify")
    attributes, triangles, targets = everything(1, 9, 8)
    del attributes["_ID"]
    gltf_ext.compress(write(folder / "in.glb", attributes, triangles, targets), folder / "out.glb")
    assert gltf_ext.verify(folder / "in.glb", folder / "out.glb")["ok"]
    return folder, attributes, triangles, targets


def verified(case, attributes=None, triangles=None, targets=None):
    folder, *original = case
    changed = [
        new if new is not None else old
        for new, old in zip((attributes, triangles, targets), original)
    ]
    return gltf_ext.verify(write(folder / "changed.glb", *changed), folder / "out.glb")


def nudged(value):
    """A value that rounds to another integer with any number of bits."""
    if value.dtype.kind == "f":
        return -value if abs(value) > 0.05 else value + np.float32(0.2)
    return value.dtype.type(
        int(value)
        + (300 if value.dtype == np.uint16 and value < 60000 else -5 if value > 100 else 5)
    )


@pytest.mark.parametrize("name", [name for name in everything()[0] if name != "_ID"])
def test_a_changed_vertex_is_noticed(case, name):
    attributes = {**case[1], name: case[1][name].copy()}
    attributes[name][20, 0] = nudged(attributes[name][20, 0])
    report = verified(case, attributes)
    assert not report["ok"] and not report["triangles_equal"] and report["missing_triangles"] > 0


def test_a_flipped_triangle_is_noticed(case):
    triangles = case[2].copy()
    triangles[5] = triangles[5, ::-1]
    report = verified(case, triangles=triangles)
    assert (report["missing_triangles"], report["extra_triangles"], report["ok"]) == (1, 1, False)


def test_rotated_and_reordered_triangles_are_the_same(case):
    triangles = np.roll(case[2], 1, axis=1)[::-1]
    assert verified(case, triangles=triangles)["ok"]


def test_a_missing_and_a_doubled_triangle_are_noticed(case):
    report = verified(case, triangles=np.concatenate([case[2][:-1], case[2][:1]]))
    assert (report["missing_triangles"], report["extra_triangles"]) == (1, 1)


def test_changed_morph_target_is_noticed(case):
    targets = [{n: v.copy() for n, v in t.items()} for t in case[3]]
    targets[1]["POSITION"][3, 2] += 0.05
    assert not verified(case, targets=targets)["ok"]


def test_missing_attribute_is_noticed(case):
    attributes = {n: v for n, v in case[1].items() if n != "_HEAT"}
    report = verified(case, attributes)
    assert (
        not report["triangles_equal"]
        and "attributes differ: _HEAT only in the compressed file" in report["problems"][0]
    )
    assert set(report["max_error"].values()) == {None}


def test_other_model_is_noticed(case, tmp_path):
    builder = Builder()
    for _ in range(2):
        builder.mesh(case[1], case[2])
    report = gltf_ext.verify(builder.write(tmp_path / "two.glb"), case[0] / "out.glb")
    assert (
        not report["ok"]
        and "2 triangle primitives in the original, 1 in the compressed file"
        in report["problems"][0]
    )


def test_wrong_step_is_noticed(case):
    """The same integers, but the step in the stream table is 1 % too large."""
    folder = case[0]
    data = bytearray((folder / "out.glb").read_bytes())
    properties = glb_json(folder / "out.glb")
    view = properties["bufferViews"][
        properties["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["bufferView"]
    ]
    step_at = (
        len(data) - properties["buffers"][0]["byteLength"] + view.get("byteOffset", 0) + 32 + 8
    )
    struct.pack_into("<f", data, step_at, 1.01 * struct.unpack_from("<f", data, step_at)[0])
    (folder / "step.glb").write_bytes(data)
    assert not gltf_ext.verify(folder / "in.glb", folder / "step.glb")["ok"]


def test_rotation_is_canonical():
    for corners in ([1, 2, 3], [3, 2, 1], [1, 1, 2], [2, 2, 1], [4, 4, 4]):
        rotations = np.array([np.roll(corners, k) for k in range(3)], np.uint32)
        assert len({tuple(t) for t in rotated(rotations).tolist()}) == 1
    assert (
        rotated(np.array([[1, 2, 3]], np.uint32)).tolist()
        != rotated(np.array([[3, 2, 1]], np.uint32)).tolist()
    )


def test_differences_are_counted():
    """Of two triangles and one that may be left out, the second, that one and another are there."""
    places = [
        (7, IN_SOURCE),
        (7, IN_SOURCE),
        (8, IN_SOURCE),
        (9, OPTIONAL_IN_SOURCE),
        (10, OPTIONAL_IN_SOURCE),
    ]
    places += [(8, IN_COMPRESSED), (7, IN_COMPRESSED), (9, IN_COMPRESSED), (11, IN_COMPRESSED)]
    assert difference(np.array(places, TRIANGLE)) == (1, 1)
    assert difference(np.array([*places, (9, IN_COMPRESSED)], TRIANGLE)) == (1, 2)


# --- validate and malformed extension objects ---


def changed_json(folder, change):
    """A copy of the compressed file whose JSON change(properties, primitive, extension) edits."""
    path = folder / "out.glb"
    properties = glb_json(path)
    primitive = properties["meshes"][0]["primitives"][0]
    change(properties, primitive, primitive["extensions"][EXTENSION])
    length = glb_json(path)["buffers"][0]["byteLength"]
    data = path.read_bytes()
    (folder / "changed.glb").write_bytes(
        glb_bytes(properties, data[len(data) - length - -length % 4 :])
    )
    return folder / "changed.glb"


CHANGES = {
    "no bufferView": lambda p, m, e: e.pop("bufferView"),
    "bufferView out of range": lambda p, m, e: e.update(bufferView=99),
    "bufferView of a wrong type": lambda p, m, e: e.update(bufferView=True),
    "attributes missing": lambda p, m, e: e.pop("attributes"),
    "attribute missing": lambda p, m, e: e["attributes"].pop("NORMAL"),
    "attribute too many": lambda p, m, e: e["attributes"].update(_MORE=0),
    "stream out of range": lambda p, m, e: e["attributes"].update(NORMAL=64),
    "stream used twice": lambda p, m, e: e["attributes"].update(
        JOINTS_0=e["attributes"]["JOINTS_1"]
    ),
    "position not first": lambda p, m, e: e["attributes"].update(POSITION=1),
    "targets missing": lambda p, m, e: e.pop("targets"),
    "negative source count": lambda p, m, e: e.update(sourceVertices=-1),
    "mode": lambda p, m, e: m.update(mode=5),
    "no indices": lambda p, m, e: m.pop("indices"),
    "index count": lambda p, m, e: p["accessors"][m["indices"]].update(count=3),
    "index type": lambda p, m, e: p["accessors"][m["indices"]].update(componentType=5126),
    "vertex count": lambda p, m, e: p["accessors"][m["attributes"]["NORMAL"]].update(count=3),
    "accessor type": lambda p, m, e: p["accessors"][m["attributes"]["NORMAL"]].update(type="VEC2"),
    "integers of unit vectors": lambda p, m, e: p["accessors"][m["attributes"]["NORMAL"]].update(
        componentType=5120
    ),
    "byteStride": lambda p, m, e: p["bufferViews"][e["bufferView"]].update(byteStride=4),
    "target": lambda p, m, e: p["bufferViews"][e["bufferView"]].update(target=34962),
    "not aligned": lambda p, m, e: p["bufferViews"][e["bufferView"]].update(byteOffset=2),
    "blob cut off": lambda p, m, e: p["bufferViews"][e["bufferView"]].update(
        byteLength=p["bufferViews"][e["bufferView"]]["byteLength"] - 4
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_malformed_extension_objects_are_refused(case, name, tmp_path):
    path = changed_json(case[0], CHANGES[name])
    assert gltf_ext.validate(path)
    for run in (
        gltf_ext.load,
        gltf_ext.inspect,
        lambda p: gltf_ext.decompress(p, tmp_path / "plain.glb"),
        lambda p: gltf_ext.verify(case[0] / "in.glb", p),
    ):
        with pytest.raises(gltf_ext.MeshletError) as caught:
            run(path)
        assert caught.value.path == str(path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("names", ["extensionsUsed", "extensionsRequired"])
def test_validate_checks_the_extension_lists(case, names):
    assert (
        f"{names} lacks {EXTENSION}"
        in gltf_ext.validate(changed_json(case[0], lambda p, m, e: p.pop(names)))[0]
    )


def test_validate_checks_the_bounds(case):
    def change(p, m, e):
        p["accessors"][m["attributes"]["POSITION"]]["max"][0] += 1

    assert gltf_ext.validate(changed_json(case[0], change)) == [
        "mesh 0 primitive 0: max of its POSITION accessor is not that of the decoded data"
    ]


def test_validate_reads_bounds_as_floats(case):
    """Other writers shorten the text of a float; glTF 2.0, 3.6.2.5."""

    def shorten(p, m, e):
        position = p["accessors"][m["attributes"]["POSITION"]]
        for name in ("min", "max"):
            short = [float(str(np.float32(value))) for value in position[name]]
            assert short != position[name]
            position[name] = short

    assert gltf_ext.validate(changed_json(case[0], shorten)) == []


@pytest.mark.parametrize("value", [1e300, None])
def test_validate_reports_impossible_bounds(case, value):
    def change(p, m, e):
        position = p["accessors"][m["attributes"]["POSITION"]]
        position["min"] = [value] * 3 if value else []

    assert gltf_ext.validate(changed_json(case[0], change)) == [
        "mesh 0 primitive 0: min of its POSITION accessor is not that of the decoded data"
    ]


def test_validate_checks_the_fallback(case, tmp_path):
    gltf_ext.compress(case[0] / "in.glb", tmp_path / "out.glb", fallback=True)
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    fallback = tmp_path / "out.fallback.bin"
    data = bytearray(fallback.read_bytes())
    data[-1] ^= 1
    fallback.write_bytes(data)
    assert "is not the decoded data" in gltf_ext.validate(tmp_path / "out.glb")[0]
    fallback.unlink()
    (problem,) = gltf_ext.validate(tmp_path / "out.glb")
    assert "out.fallback.bin, which cannot be read" in problem
    assert gltf_ext.verify(case[0] / "in.glb", tmp_path / "out.glb")["ok"], (
        "the fallback is not needed"
    )


def test_validate_accepts_and_names(case):
    assert gltf_ext.validate(case[0] / "out.glb") == []
    assert "compress it first" in gltf_ext.validate(case[0] / "in.glb")[0]


@pytest.mark.parametrize(
    ("name", "component_type"),
    [("TEXCOORD_0", 5123), ("POSITION", 5122), ("WEIGHTS_0", 5121), ("COLOR_0", 5121)],
)
def test_values_of_another_component_type_are_noticed(tmp_path, name, component_type):
    """The bytes of the compressed data are right, but readers convert them to other values."""
    positions, triangles = grid_mesh(9, 9)
    random = np.random.default_rng(1)
    attributes = {"POSITION": positions + 0.25, "TEXCOORD_0": positions[:, :2] / 9 + 0.25}
    for weights in ("WEIGHTS_0", "COLOR_0"):
        attributes[weights] = random.dirichlet(np.ones(4), len(positions)).astype(np.float32)
    original = write(tmp_path / "in.glb", attributes, triangles)
    gltf_ext.compress(original, tmp_path / "out.glb")
    document, binary = glb_parts(tmp_path / "out.glb")
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"][name]]
    accessor["componentType"] = component_type
    accessor.pop("min", None), accessor.pop("max", None)
    (tmp_path / "changed.glb").write_bytes(glb_bytes(document, binary))
    report = gltf_ext.verify(original, tmp_path / "changed.glb")
    assert not report["ok"] and name in report["problems"][0]


def test_integer_colours_of_targets_are_exact(tmp_path):
    positions, triangles = grid_mesh(9, 9)
    colours = np.random.default_rng(1).integers(0, 2000, (len(positions), 4)).astype(np.uint16)
    target = {"POSITION": positions * np.float32(0.1), "COLOR_0": colours}
    original = write(
        tmp_path / "in.glb", {"POSITION": positions, "COLOR_0": colours}, triangles, [target]
    )
    gltf_ext.compress(original, tmp_path / "out.glb")
    errors = gltf_ext.verify(original, tmp_path / "out.glb")["max_error"]
    assert errors["targets[0].COLOR_0"] == 0.0 < errors["COLOR_0"]


def test_errors_of_the_vertices_that_are_there_are_stated(case):
    """One vertex has moved: its triangles are missing, the figures are those of all others."""
    attributes = {**case[1], "POSITION": case[1]["POSITION"].copy()}
    attributes["POSITION"][20, 0] += 1.0
    report = verified(case, attributes)
    assert not report["ok"] and report["missing_triangles"]
    assert 0.0 < report["max_error"]["POSITION"] < 0.1 and report["max_error_degrees"]["NORMAL"] > 0


def test_what_is_kept_uncompressed_may_have_any_values(tmp_path):
    """compress keeps a primitive with too many attributes as it is, NaN included."""
    positions, triangles = grid_mesh(5, 5)
    many = {f"TEXCOORD_{i}": positions[:, :2].copy() for i in range(70)}
    many["TEXCOORD_3"][2, 0] = np.nan
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    builder.mesh({"POSITION": positions, **many}, triangles)
    original = builder.write(tmp_path / "in.glb")
    report = gltf_ext.compress(original, tmp_path / "out.glb")
    assert len(report["kept"]) == 1
    assert gltf_ext.verify(original, tmp_path / "out.glb")["ok"]
