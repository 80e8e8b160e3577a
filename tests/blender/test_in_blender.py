"""The extension, installed from its zip in Blender (bpy): import, export, malformed files."""

import json
import random
import shutil
import struct
import subprocess

import pytest

import gltf_ext
from gltf_ext.options import OPTIONS
from tests.helpers import blender as blender_process
from tests.helpers.environment import MODELS, VECTORS, missing, parameters_or_missing
from tests.helpers.gltf_builder import Builder, everything, glb_bytes, glb_json
from tests.helpers.models import HARD, REFUSED
from tools import blender_python, build_blender

pytestmark = pytest.mark.full
# Blender's importer fails on these, plain or compressed.
BLENDER_REFUSES = {"CubeScaledInstances", "IncorrectVertexArrays"}
MODELS_HERE = [*HARD, *sorted(MODELS.glob("*.glb"))]
IMPORTABLE = parameters_or_missing(
    (
        pytest.param(path, id=path.stem)
        for path in MODELS_HERE
        if path.stem not in REFUSED and "draco" not in path.stem.lower()
    ),
    f"no models in {MODELS}",
)
EXTENSION = "EXT_meshlet_edgebreaker"
NOTHING = dict.fromkeys(("objects", "meshes", "materials", "images", "armatures", "actions"), 0)


def test_blender_lists_the_repository(extension):
    """Its own tool reads index.json, as it does when a user adds the address."""
    (tool,) = blender_python.PYTHON.parent.parent.rglob("bl_pkg/cli/blender_ext.py")
    index = extension.with_name("index.json").as_uri()
    command = [blender_python.PYTHON, tool, "list", "--remote-url", index, "--local-dir", "."]
    result = subprocess.run(command, cwd=extension.parent, capture_output=True, text=True)
    version = build_blender.semantic_version(gltf_ext.__version__)
    assert result.stdout.strip() == f"gltf_meshlet({version}): glTF Meshlet Compression"


def compressed_pair(path, folder):
    """The decompressed file and the compressed one."""
    gltf_ext.compress(path, folder / "in.glb")
    gltf_ext.decompress(folder / "in.glb", folder / "decompressed.glb")
    return folder / "decompressed.glb", folder / "in.glb"


def with_json(path, change, output):
    """A copy of a .glb whose JSON is changed by a function."""
    data = path.read_bytes()
    properties = glb_json(path)
    change(properties)
    start = 20 + struct.unpack_from("<I", data, 12)[0] + 8
    output.write_bytes(glb_bytes(properties, data[start:]))
    return output


def with_blob(path, blob, output):
    """A copy of a .glb in which another blob stands at the end, in place of the first one."""
    data = path.read_bytes()
    properties = glb_json(path)
    start = 20 + struct.unpack_from("<I", data, 12)[0] + 8
    binary = data[start:] + bytes(-len(data[start:]) % 4)
    view = properties["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["bufferView"]
    properties["bufferViews"][view].update(byteOffset=len(binary), byteLength=len(blob))
    properties["buffers"][0]["byteLength"] = len(binary) + len(blob)
    output.write_bytes(glb_bytes(properties, binary + blob + bytes(-len(blob) % 4)))
    return output


def assert_refused(blender, path, reason=""):
    """The import is one error that names the file, and leaves nothing behind."""
    error = blender("import_file", path)
    assert error.startswith("Error: ") and "Traceback" not in error
    assert len(error.splitlines()) == 1
    assert reason in error and str(path) in error
    assert blender("contents") == NOTHING


# --- installation ---


def test_blender_accepts_the_zip(extension):
    """Blender's own check of extensions."""
    code = (
        "import bpy, pathlib, sys; import bl_pkg; "
        "print(pathlib.Path(bl_pkg.__file__).parent / 'cli' / 'blender_ext.py')"
    )
    python = blender_process.need_bpy()
    found = subprocess.run((python, "-c", code), capture_output=True, text=True, check=True)
    command = (python, found.stdout.splitlines()[-1], "validate", extension)
    checked = subprocess.run(command, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_options_have_the_limits_of_compress(blender):
    """Below the least number of bits, they are auto; so they are by default."""
    limits = {o.name: [0, o.limits[1], 0] for o in OPTIONS if o.name.endswith("_bits")}
    assert blender("settings") == limits


def test_nothing_heavy_is_imported(blender, rich, tmp_path):
    result = blender("export", rich, tmp_path)
    assert "times smaller" in result["result"][-1]
    assert blender("about")["unwanted"] == []


# --- import ---


def test_every_attribute_is_imported(blender, rich, tmp_path):
    gltf_ext.decompress(rich, tmp_path / "decompressed.glb")
    compared = blender("compare", tmp_path / "decompressed.glb", rich)
    assert compared["errors"] == ["", ""] and compared["differences"] == []
    assert compared["contents"]["meshes"] == 1


def test_packed_file_is_imported(blender, rich, tmp_path):
    gltf_ext.transcode(rich, tmp_path / "packed.glb")
    compared = blender("compare", rich, tmp_path / "packed.glb")
    assert compared["errors"] == ["", ""] and compared["differences"] == []
    assert compared["contents"]["meshes"] == 1


@pytest.mark.parametrize("path", IMPORTABLE)
def test_imports_what_the_decompressed_file_holds(blender, path, tmp_path):
    compared = blender("compare", *compressed_pair(path, tmp_path))
    plain, ours = compared["errors"]
    assert plain == ours and bool(plain) == (path.stem in BLENDER_REFUSES)
    assert compared["differences"] == []
    assert plain or compared["contents"]["meshes"] > 0


def test_a_plain_file_is_none_of_our_business(blender, model):
    assert blender("import_file", model("nasty/Box.glb")) == ""
    assert blender("contents")["meshes"] == 1


def test_pages_are_imported(blender, model, tmp_path):
    gltf_ext.compress(model("suzanne.glb"), tmp_path / "pages.glb", page_bytes=4096)
    gltf_ext.decompress(tmp_path / "pages.glb", tmp_path / "decompressed.glb")
    compared = blender("compare", tmp_path / "decompressed.glb", tmp_path / "pages.glb")
    assert compared["errors"] == ["", ""] and compared["differences"] == []


def test_primitives_that_share_accessors_keep_their_own_data(blender, tmp_path):
    """Two blobs whose accessors are the same: each primitive gets what its own blob holds."""
    attributes, triangles, _ = everything()
    builder = Builder()
    for scale in (1, 2):
        builder.mesh({"POSITION": attributes["POSITION"] * scale}, triangles)
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1}]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    gltf_ext.compress(builder.write(tmp_path / "two.glb"), tmp_path / "compressed.glb")

    def share(properties):
        first, second = (mesh["primitives"][0] for mesh in properties["meshes"])
        second["attributes"], second["indices"] = first["attributes"], first["indices"]

    shared = with_json(tmp_path / "compressed.glb", share, tmp_path / "shared.glb")
    gltf_ext.decompress(shared, tmp_path / "decompressed.glb")
    compared = blender("compare", tmp_path / "decompressed.glb", shared)
    assert compared["errors"] == ["", ""] and compared["differences"] == []


def test_only_the_blob_counts(blender, rich, tmp_path):
    """A sparse part of an accessor, of no use to a compressed primitive, changes nothing."""

    def add_sparse(properties):
        primitive = first_primitive(properties)
        view = primitive["extensions"][EXTENSION]["bufferView"]
        properties["accessors"][primitive["attributes"]["POSITION"]]["sparse"] = {
            "count": 1,
            "indices": {"bufferView": view, "componentType": 5121},
            "values": {"bufferView": view},
        }

    compared = blender("compare", rich, with_json(rich, add_sparse, tmp_path / "sparse.glb"))
    assert compared["errors"] == ["", ""] and compared["differences"] == []


def test_import_does_not_need_the_fallback(blender, model, tmp_path):
    gltf_ext.compress(model("suzanne.glb"), tmp_path / "in.glb", fallback=True)
    (tmp_path / "in.fallback.bin").unlink()
    gltf_ext.compress(model("suzanne.glb"), tmp_path / "same.glb")
    compared = blender("compare", tmp_path / "same.glb", tmp_path / "in.glb")
    assert compared["errors"] == ["", ""] and compared["differences"] == []


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_broken_models_without_the_extension_are_blenders_own_business(blender, model, name):
    """Whatever Blender makes of them, it lives on and imports the next file."""
    blender("import_file", model(f"nasty/{name}.glb"))
    assert blender("import_file", model("nasty/Box.glb")) == ""
    assert blender("contents")["meshes"] == 1


# --- malformed files ---


@pytest.mark.parametrize(
    "path", [pytest.param(p, id=p.stem) for p in sorted(VECTORS.glob("malformed_*.bin"))]
)
def test_malformed_blobs_are_reported(blender, rich, path, tmp_path):
    assert_refused(blender, with_blob(rich, path.read_bytes(), tmp_path / "bad.glb"))


def first_primitive(properties):
    return properties["meshes"][0]["primitives"][0]


JSON_DAMAGE = {
    "points": (lambda p: first_primitive(p).update(mode=0), "not made of triangles"),
    "strip": (lambda p: first_primitive(p).update(mode=5), "mode 4"),
    "no indices": (lambda p: first_primitive(p).pop("indices"), "mode 4"),
    "no object": (lambda p: first_primitive(p)["extensions"].update({EXTENSION: {}}), "bufferView"),
    "no view": (
        lambda p: first_primitive(p)["extensions"][EXTENSION].update(bufferView=99),
        "bufferView",
    ),
    "no stream": (
        lambda p: first_primitive(p)["extensions"][EXTENSION]["attributes"].pop("NORMAL"),
        "exactly each attribute",
    ),
    "wrong count": (
        lambda p: p["accessors"][first_primitive(p)["attributes"]["POSITION"]].update(count=3),
        "3 elements",
    ),
    "huge count": (
        lambda p: p["accessors"][first_primitive(p)["indices"]].update(count=2**40),
        "elements",
    ),
    "more targets": (lambda p: first_primitive(p)["targets"].pop(), "1 targets"),
}


@pytest.mark.parametrize("name", JSON_DAMAGE)
def test_malformed_json_is_reported(blender, rich, name, tmp_path):
    change, reason = JSON_DAMAGE[name]
    assert_refused(blender, with_json(rich, change, tmp_path / "bad.glb"), reason)


def test_a_damaged_blob_is_reported_although_there_is_a_fallback(blender, model, tmp_path):
    gltf_ext.compress(model("suzanne.glb"), tmp_path / "in.glb", fallback=True)
    bad = with_blob(tmp_path / "in.glb", bytes(64), tmp_path / "bad.glb")
    assert_refused(blender, bad)


def test_random_damage_is_reported_or_decoded(blender, model, tmp_path):
    """200 files with flipped bits: imported as `load` decodes them, or refused as it does."""
    gltf_ext.compress(model("nasty/Box.glb"), tmp_path / "in.glb")
    data = (tmp_path / "in.glb").read_bytes()
    start = 28 + struct.unpack_from("<I", data, 12)[0]
    rng, refused = random.Random(0), 0
    for _ in range(200):
        damaged = bytearray(data)
        damaged[rng.randrange(start, len(data))] ^= 1 << rng.randrange(8)
        (tmp_path / "bad.glb").write_bytes(damaged)
        try:
            gltf_ext.load(tmp_path / "bad.glb")
        except gltf_ext.MeshletError:
            refused += 1
            assert_refused(blender, tmp_path / "bad.glb")
        else:
            assert blender("import_file", tmp_path / "bad.glb") == ""
            assert blender("contents")["meshes"] == 1
    assert 20 < refused < 200


@pytest.mark.parametrize(
    ("failure", "reason"),
    [("import", "the library of this extension cannot be loaded"), ("bug", "unexpected failure")],
)
def test_failures_of_the_library_are_reported(blender, rich, failure, reason):
    """The importer would swallow them and make meshes of zeros."""
    error = blender("import_with_failing_library", rich, failure)
    assert reason in error and str(rich) in error and len(error.splitlines()) == 1
    assert blender("contents") == NOTHING


def test_blender_imports_good_files_after_bad_ones(blender, rich, tmp_path):
    assert_refused(blender, with_blob(rich, b"", tmp_path / "bad.glb"))
    assert blender("import_file", rich) == ""
    assert blender("contents")["meshes"] == 1


# --- export ---


@pytest.mark.parametrize("path", IMPORTABLE)
def test_exports_within_the_bits(blender, khronos, path, tmp_path):
    exported = blender("export", path, tmp_path)
    # Blender reads meshopt since 5.2, where its library is.
    refuses = path.stem in BLENDER_REFUSES or "meshopt" in exported["error"]
    assert bool(exported["error"]) == refuses
    if exported["error"]:
        return
    plain, compressed = tmp_path / "plain.glb", tmp_path / "compressed.glb"
    assert f"{compressed.name}: " in exported["result"][-1]
    verified = gltf_ext.verify(plain, compressed)
    assert verified["ok"], verified["problems"]
    assert gltf_ext.validate(compressed) == []
    report = khronos([plain, compressed])
    assert set(report[str(compressed)]["errors"]) <= set(report[str(plain)]["errors"])
    shapes = blender("compare_shapes", plain, compressed)
    assert shapes["errors"] == ["", ""] and shapes["differences"] == []
    # Half a step of 12 bits along each axis, and rounding of far away positions; auto has more.
    assert max(shapes["distances"].values(), default=0) <= 3**0.5 / 2 / 4095 * 1.05
    assert sorted(file.name for file in tmp_path.iterdir()) == ["compressed.glb", "plain.glb"]


def test_bits_are_passed_on(blender, model, tmp_path):
    sizes = {}
    for bits in (8, 16):
        exported = blender("export", model("suzanne.glb"), tmp_path, position_bits=bits)
        assert exported["error"] == ""
        sizes[bits] = (tmp_path / "compressed.glb").stat().st_size
        errors = gltf_ext.verify(tmp_path / "plain.glb", tmp_path / "compressed.glb")
        assert errors["max_error_percent"]["POSITION"] < 100 / 2**bits
    assert sizes[8] < 0.8 * sizes[16]


def test_fallback_is_written_beside(blender, khronos, model, tmp_path):
    exported = blender("export", model("suzanne.glb"), tmp_path, fallback=True)
    assert "of fallback" in exported["result"][-1]
    compressed = tmp_path / "compressed.glb"
    assert (tmp_path / "compressed.fallback.bin").is_file()
    assert glb_json(compressed)["buffers"][1]["uri"] == "compressed.fallback.bin"
    assert gltf_ext.validate(compressed) == []
    assert khronos([compressed])[str(compressed)]["errors"] == []


def test_levels_are_exported_and_imported(blender, khronos, model, tmp_path):
    """With the simplifier inside the wheel: bpy has no package meshoptimizer."""
    exported = blender("export", model("suzanne.glb"), tmp_path, lod=True)
    assert "compressed.glb: " in exported["result"][-1]
    plain, compressed = tmp_path / "plain.glb", tmp_path / "compressed.glb"
    (lod,) = gltf_ext.inspect(compressed)["lod"]
    triangles = [level["triangles"] for level in lod["levels"]]
    assert len(triangles) > 2 and triangles[-1] < triangles[0] / 3
    verified = gltf_ext.verify(plain, compressed)
    assert verified["ok"], verified["problems"]
    assert gltf_ext.validate(compressed) == []
    assert khronos([compressed])[str(compressed)]["errors"] == []
    shapes = blender("compare_shapes", plain, compressed)
    assert shapes["errors"] == ["", ""] and shapes["differences"] == []


def test_collections_are_compressed_by_their_exporters(blender, model, tmp_path):
    blender("import_file", model("nasty/Box.glb"))
    *_, line = blender("export_collection", tmp_path / "sphere.glb")
    assert line.startswith("sphere.glb: ") and "times smaller" in line
    assert gltf_ext.validate(tmp_path / "sphere.glb") == []


def test_without_compression_the_export_is_blenders_own(blender, model, tmp_path):
    blender("export", model("nasty/Box.glb"), tmp_path)
    assert EXTENSION not in json.dumps(glb_json(tmp_path / "plain.glb"))


def test_draco_is_refused_with_a_reason(blender, model, tmp_path):
    if not blender("about")["draco"]:
        missing("this Blender is built without Draco")
    blender("import_file", model("nasty/Box.glb"))
    (error,) = blender("export_open", tmp_path / "box.glb", draco=True)
    assert "box.glb is exported, but not as meshlets: turn off Draco" in error
    assert "KHR_draco_mesh_compression" in glb_json(tmp_path / "box.glb")["extensionsUsed"]


def test_a_scene_without_triangles_is_exported_plain(blender, model, tmp_path):
    """With a warning: an error would end the script."""
    blender("import_file", model("nasty/empty_nodes.glb"))
    (warning,) = blender("export_open", tmp_path / "empty.glb")
    assert warning.startswith("empty.glb is exported plain: holds no triangles")
    assert glb_json(tmp_path / "empty.glb")["asset"]["version"] == "2.0"
    assert [file.name for file in tmp_path.iterdir()] == ["empty.glb"]


# --- the end ---


def test_without_the_extension_files_are_refused(extension, rich, tmp_path):
    """Turned off, it leaves neither its arguments nor empty meshes behind."""
    folder = tmp_path / "user"
    folder.mkdir()
    with blender_process.running(extension, folder) as other:
        assert len(other("arguments_of", "export")) > len(other("arguments_of", "import")) > 1
        other("disable")
        assert other("arguments_of", "export") == other("arguments_of", "import") == []
        assert f"Extension {EXTENSION} is not available" in other("import_file", rich)
        assert other("contents") == NOTHING
    shutil.rmtree(folder)
