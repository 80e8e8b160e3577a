"""What back ends do not draw is said in one line, and the manual's table is true."""

from __future__ import annotations

import re
import warnings

import pytest

import gltf_ext
from gltf_ext.sources.importers import open_model
from gltf_scene import features
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder, everything, grid_mesh
from tests.helpers.mitsuba_reference import require

ALL = (
    "lights, skins, morph targets, animations, reflections of metals, metallic-roughness maps, "
    "normal maps, occlusion maps, KHR_materials_clearcoat, KHR_materials_iridescence"
)


def rich(folder):
    """A compressed file with every feature."""
    builder = Builder()
    values, triangles, targets = everything()
    names = ("POSITION", "NORMAL", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0")
    builder.mesh({name: values[name] for name in names}, triangles, targets, material=0)
    texture = {"index": 0}
    pbr = {"roughnessFactor": 0.3, "metallicRoughnessTexture": texture}
    extensions = {name: {} for name in ("KHR_materials_clearcoat", "KHR_materials_iridescence")}
    builder.properties.update(
        images=[{"uri": "none.png"}],
        textures=[{"source": 0}],
        materials=[
            {
                "pbrMetallicRoughness": pbr,
                "normalTexture": texture,
                "occlusionTexture": texture,
                "extensions": {**extensions, "KHR_materials_unlit": {}},
            }
        ],
        animations=[{"channels": [], "samplers": []}],
        skins=[{"joints": [1]}],
        nodes=[
            {"mesh": 0, "skin": 0, "children": [1, 2]},
            {},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        extensionsUsed=["KHR_lights_punctual", "KHR_materials_unlit", *extensions],
    )
    gltf_ext.compress(builder.write(folder / "raw.glb"), folder / "rich.glb")
    return folder / "rich.glb"


def test_each_feature_is_named_once_in_one_line(tmp_path):
    from vk_backend.scene.scene import load_scene

    path = rich(tmp_path)
    document = open_model(path)
    assert features.undrawn(document, {"KHR_materials_unlit"}) == [f"not drawn: {ALL}"]
    assert load_scene(path).warnings.count(f"not drawn: {ALL}") == 1


def test_mitsuba_says_what_it_lacks(tmp_path):
    _, plugin = require("scalar_rgb")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        plugin.scene_dict(rich(tmp_path))
    said = [str(w.message) for w in caught if "not drawn" in str(w.message)]
    lacks = "skins, morph targets, animations, occlusion maps, KHR_materials_iridescence"
    assert len(said) == 1 and said[0].endswith(f"not drawn: {lacks}")


def test_a_plain_file_lacks_nothing(tmp_path):
    builder = Builder()
    positions, triangles = grid_mesh(4, 4)
    builder.mesh({"POSITION": positions}, triangles, material=0)
    builder.properties["materials"] = [{}]  # the default is a rough metal
    assert features.undrawn(open_model(builder.write(tmp_path / "a.glb")), ()) == []


@pytest.mark.parametrize("back_end", ["Vulkan", "Mitsuba"])
def test_the_table_of_the_manual(back_end):
    """It has a row for each feature, and says yes where a back end draws it."""
    from vk_backend.scene.scene import DRAWN

    drawn = DRAWN
    if back_end == "Mitsuba":
        require("scalar_rgb")
        from mitsuba_plugin.scene import DRAWN as drawn
    text = (ROOT / "docs" / "vulkan.md").read_text()
    section = text[text.index("## What is drawn") :].partition("\n## ")[0]
    head, *rows = (
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in re.findall(r"^\|.*\|$", section, re.M)
    )
    column = head.index(back_end)
    cells = {row[0].strip("`"): row[column] for row in rows}
    extensions = {name for name in vars(features).values() if str(name).startswith("KHR_mat")}
    for name in {*features.FEATURES, *extensions} - {features.MATERIALS}:
        assert cells[name].startswith("yes" if name in drawn else "no"), name
