"""The host's mirrors of the shaders' structures: same names, offsets, sizes and strides.

Add a row to MIRRORS for each numpy dtype that mirrors a structure of a shader.
"""

from __future__ import annotations

import numpy as np
import pytest

from vk_backend import build_shaders, raster_layout, raytrace_layout, scene_buffers
from vk_backend.reflection import (
    DECORATION_OFFSET,
    DECORATION_SPEC_ID,
    OP_DECORATE,
    OP_MEMBER_DECORATE,
    instructions,
    shipped_reflection,
    specialization_ids,
    words_of,
)

# Structure of the shaders -> dtype.
MIRRORS: dict[str, np.dtype] = {
    "Attribute": scene_buffers.ATTRIBUTE,
    "Primitive": scene_buffers.PRIMITIVE,
    "Instance": scene_buffers.INSTANCE,
    "Material": scene_buffers.MATERIAL,
    "Frame": scene_buffers.FRAME,
    "RasterPush": raster_layout.RASTER_PUSH,
    "BoundsPush": raster_layout.BOUNDS_PUSH,
    "Push": raster_layout.DECODE_PUSH,
    "Segment": raster_layout.SEGMENT,
    "Connected": raster_layout.CONNECTED,
    "Places": raster_layout.PLACES,
    "Placed": raytrace_layout.PLACED,
    "Source": raytrace_layout.SOURCE,
    "RaysPush": raytrace_layout.RAYS_PUSH,
    "BoxesPush": raytrace_layout.BOXES_PUSH,
    "FillPush": raytrace_layout.FILL_PUSH,
}


def members_of(dtype: np.dtype) -> dict[str, list[int]]:
    """Field -> [offset, bytes]"""
    assert dtype.fields is not None
    return {name: [dtype.fields[name][1], dtype.fields[name][0].itemsize] for name in dtype.fields}


@pytest.mark.parametrize("structure", MIRRORS)
def test_mirror_has_the_shaders_members(structure):
    assert members_of(MIRRORS[structure]) == shipped_reflection()["structures"][structure]


def test_mirrors_have_the_shaders_strides():
    strides = shipped_reflection()["strides"]
    mirrored = [name for name in MIRRORS if name in strides]
    assert {"Primitive", "Instance", "Material", "Segment", "Placed", "Source"} <= set(mirrored)
    assert {name: MIRRORS[name].itemsize for name in mirrored} == {
        name: strides[name] for name in mirrored
    }


def test_every_structure_that_the_host_writes_has_a_mirror():
    """All but those that wrap one array, and those that only shaders write."""
    shared = {
        name
        for name, members in shipped_reflection()["structures"].items()
        if not set(members) <= {"at", "of"}
    }
    assert shared - {"Found", "Level", "Hit", "FirstHit", "Box"} == set(MIRRORS)


@pytest.mark.parametrize("module", sorted(shipped_reflection()["modules"]))
def test_reflection_is_that_of_the_shipped_module(module):
    """Its offsets and constants are in the SPIR-V, which has no names."""
    reflection = shipped_reflection()
    words = words_of((build_shaders.OUTPUT / f"{module}.spv").read_bytes())
    offsets: dict[int, dict[int, int]] = {}
    constants = set()
    for p, opcode in instructions(words):
        if opcode == OP_MEMBER_DECORATE and words[p + 3] == DECORATION_OFFSET:
            offsets.setdefault(words[p + 1], {})[words[p + 2]] = words[p + 4]
        if opcode == OP_DECORATE and words[p + 2] == DECORATION_SPEC_ID:
            constants.add(words[p + 3])
    found = {tuple(sorted(members.values())) for members in offsets.values()}
    recorded = reflection["modules"][module]
    expected = {
        tuple(sorted(offset for offset, _ in reflection["structures"][name].values()))
        for name in recorded["structures"]
    }
    assert expected == found
    assert set(recorded["specialization"].values()) == constants


def test_constants_are_found_by_name():
    assert specialization_ids("bounds.comp", {"MAX_STREAMS": 5, "CULLING": 1}) == {0: 5}
    with pytest.raises(ValueError, match="no shader has the constants CULING"):
        specialization_ids("bounds.comp", {"MAX_STREAMS": 5, "CULING": 1})
