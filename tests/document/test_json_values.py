"""Numbers of materials and lights: the default replaces what 32-bit floats cannot hold."""

import numpy as np
import pytest

from gltf_ext.document.document import Document
from gltf_scene.materials import Material, read_material
from gltf_scene.scene import read_scene


@pytest.mark.parametrize("value", [1e300, -1e16])
def test_factors(value):
    pbr = {"roughnessFactor": value, "metallicFactor": value, "baseColorFactor": [value] * 4}
    document = Document({"asset": {"version": "2.0"}, "materials": [{"pbrMetallicRoughness": pbr}]})
    material = read_material(document, 0)
    assert (material.roughness, material.metallic) == (Material.roughness, Material.metallic)
    assert material.base_color == Material.base_color


@pytest.mark.parametrize("value", [10**400, 1e300, float("nan"), "1", [], True])
def test_intensities(value):
    lights = {"lights": [{"type": "point", "intensity": value, "color": [1e15, value, 1]}]}
    document = Document(
        {
            "asset": {"version": "2.0"},
            "extensions": {"KHR_lights_punctual": lights},
            "nodes": [{"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        }
    )
    (light,) = read_scene(document).lights
    assert np.isfinite(np.float32(light.color)).all() and light.color == (1e15, 1, 1)
