"""The settings: arguments of Blender's operators, as those of Draco; results of each export."""

import json
import os
import stat

import pytest

import gltf_ext
from tests.helpers.gltf_builder import glb_json

pytestmark = pytest.mark.full
EXTENSION = "EXT_meshlet_edgebreaker"


@pytest.fixture
def ball(blender):
    """A scene with an icosphere."""
    blender("primitive", "ico_sphere", subdivisions=5)


def bits(path, name="POSITION"):
    (primitive,) = gltf_ext.inspect(path)["primitives"]
    return primitive["attributes"][name]["bits_per_component"][0]


# --- where they are ---


def test_presets_have_all_settings(blender):
    assert blender("in_presets") == blender("arguments_of", "export")


def test_settings_are_remembered_with_the_others(blender, ball, tmp_path):
    stored = blender("remembered", tmp_path / "a.glb", enabled=True, quality="FILM", step=2.0)
    assert stored["export_meshlet_enabled"] and stored["export_meshlet_step"] == 2.0
    assert "export_meshlet_quality" in stored


def test_settings_of_a_collections_exporter(blender, tmp_path):
    """Its own, whatever the scene's are."""
    blender("primitive", "cube")
    line = blender("export_collection", tmp_path / "a.glb", enabled=True, position_bits=9)[-1]
    assert line.startswith("a.glb: ") and bits(tmp_path / "a.glb") == 9
    assert blender("export_collection", tmp_path / "b.glb", enabled=False) == []
    assert EXTENSION not in json.dumps(glb_json(tmp_path / "b.glb"))


def test_settings_of_the_scene_hold_for_exports_without(blender, ball, tmp_path):
    """As scripts have set them since the first version."""
    of_scene, path = {"enabled": True, "position_bits": 9}, tmp_path / "a.glb"
    assert "times smaller" in blender("export_by_scene", path, of_scene)[-1]
    assert bits(path) == 9
    blender("export_by_scene", path, of_scene, export_meshlet_position_bits=11)
    assert bits(path) == 11
    assert blender("export_by_scene", path, of_scene, export_meshlet_enabled=False) == []
    assert EXTENSION not in json.dumps(glb_json(path))


# --- what they set ---


def test_qualities(blender, ball, tmp_path):
    sizes, found = {}, {}
    for quality in ("FILM", "REALTIME", "WEB"):
        path = tmp_path / f"{quality}.glb"
        blender("export_open", path, quality=quality)
        sizes[quality], found[quality] = path.stat().st_size, bits(path)
        assert gltf_ext.validate(path) == []
    assert sizes["FILM"] > sizes["REALTIME"] > sizes["WEB"]
    assert found["FILM"] == 20 and found["REALTIME"] == found["WEB"] < 16
    assert "EXT_meshlet_transport" in glb_json(tmp_path / "WEB.glb")["extensionsUsed"]
    blender("export_open", tmp_path / "bits.glb", quality="FILM", position_bits=10)
    assert bits(tmp_path / "bits.glb") == 10


@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_a_step_in_millimetres(blender, ball, tmp_path, scale):
    """As the scene shows it, also of an object whose scale is not applied."""
    blender("scale_objects", scale)
    blender("export_open", tmp_path / "a.glb", step=2.0, position_bits=9)
    (primitive,) = gltf_ext.inspect(tmp_path / "a.glb")["primitives"]
    assert primitive["attributes"]["POSITION"]["step"] == [pytest.approx(0.002 / scale)]


def test_one_grid_keeps_neighbours_together(blender, tmp_path):
    """Two strips that share a border: their vertices there are the same afterwards."""
    gaps = {}
    for grid in (False, True):
        blender("neighbours")
        blender("export_open", tmp_path / "a.glb", position_bits=12, scene_grid=grid)
        first, second = (
            {tuple(p) for p in primitive.attributes["POSITION"].tolist()}
            for primitive in gltf_ext.load(tmp_path / "a.glb")
        )
        gaps[grid] = len(first & second)
    assert gaps[False] < 10 and gaps[True] == 101


def test_transport_effort_and_the_limit_of_levels(blender, ball, tmp_path):
    blender("export_open", tmp_path / "a.glb", transport=True, effort="FAST")
    assert "EXT_meshlet_transport" in glb_json(tmp_path / "a.glb")["extensionsUsed"]
    counts = []
    for limit in (0.0, 40.0):
        result = blender("export_open", tmp_path / "a.glb", lod=True, lod_limit=limit)
        (lod,) = gltf_ext.inspect(tmp_path / "a.glb")["lod"]
        counts.append(len(lod["levels"]))
        assert not limit or lod["levels"][-1]["error"] <= 0.04
        assert any(f"{counts[-1]} levels of detail, 5,120 to " in line for line in result)
    assert counts[0] > counts[1] > 1


def test_separate_files(blender, tmp_path):
    """Its textures stay files."""
    blender("textured_sphere")
    result = blender("export_open", tmp_path / "a.gltf", export_format="GLTF_SEPARATE")
    assert "a.gltf: " in result[-1]
    properties = json.loads((tmp_path / "a.gltf").read_text())
    assert EXTENSION in properties["extensionsUsed"]
    assert all((tmp_path / image["uri"]).is_file() for image in properties["images"])
    assert properties["images"] and "a.bin" in os.listdir(tmp_path)
    assert gltf_ext.validate(tmp_path / "a.gltf") == []
    assert blender("import_file", tmp_path / "a.gltf") == ""
    assert blender("contents")["images"] == 1


# --- refusals and results ---


def test_embedded_is_refused(blender, ball, tmp_path):
    (error,) = blender("export_open", tmp_path / "a.gltf", export_format="GLTF_EMBEDDED")
    assert "a.gltf is exported, but not as meshlets: choose glTF Binary or glTF Separate" in error


@pytest.mark.parametrize("name", ["Draco", "Meshopt"])
def test_other_compressions_are_refused(blender, name):
    """The panel says so before the export; Meshopt is an argument since Blender 5.2."""
    assert blender("refusal", "GLB", None) == ""
    assert blender("refusal", "GLB", name).startswith(f"turn off {name}, since")


def test_results_are_of_the_last_export(blender, ball, tmp_path):
    assert "times smaller" in blender("export_open", tmp_path / "a.glb")[-1]
    assert blender("export_open", tmp_path / "b.glb", enabled=False) == []
    blender("export_open", tmp_path / "a.glb")
    blender("failing_export", tmp_path / "c.glb")
    assert blender("shown") == []


def test_dark_colours_keep_their_levels(blender, tmp_path):
    """Of 65 levels of a dark gradient, 8 linear bits left 14, with other hues."""
    measured = []
    for enabled in (False, True):
        blender("dark_gradient")
        blender("export_open", tmp_path / "a.glb", enabled=enabled)
        blender("import_file", tmp_path / "a.glb")
        measured.append(blender("measured_gradient"))
    assert measured[0] == pytest.approx(measured[1], abs=1e-3) and measured[1][0] == 65


def test_links_and_modes_stay(blender, ball, tmp_path):
    real, link = tmp_path / "real.glb", tmp_path / "link.glb"
    real.touch()
    real.chmod(0o664)
    link.symlink_to(real.name)
    blender("export_open", link)
    assert link.is_symlink() and EXTENSION in glb_json(real)["extensionsUsed"]
    assert stat.S_IMODE(real.stat().st_mode) == 0o664


def test_it_works_however_it_is_enabled(blender, tmp_path):
    """Also by addon_utils.enable, which leaves the preferences alone."""
    blender("enable_without_preferences")
    try:
        blender("primitive", "ico_sphere", subdivisions=5)
        assert "times smaller" in blender("export_open", tmp_path / "a.glb")[-1]
        assert blender("import_file", tmp_path / "a.glb") == ""
        assert blender("topology")["triangles"] == 5120
    finally:
        blender("enable")


def test_a_job_shows_progress_and_can_be_cancelled(blender, ball, tmp_path):
    """The work of the dialog, without a window: progress after a second; then a plain file."""
    texts, result = blender("cancelled_job", tmp_path / "a.glb")
    assert texts[0] == "" and texts[1].startswith("Compressing a.glb: ")
    assert result == "Cancelled"
    assert EXTENSION not in json.dumps(glb_json(tmp_path / "a.glb"))
