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

# Structure of the shaders -> (dtype, members that the dtype leaves out).
MIRRORS: dict[str, tuple[np.dtype, set[str]]] = {
    "Attribute": (scene_buffers.ATTRIBUTE, set()),
    "Primitive": (scene_buffers.PRIMITIVE, set()),
    "Instance": (scene_buffers.INSTANCE, set()),
    "Material": (scene_buffers.MATERIAL, set()),
    "PlainMeshlet": (scene_buffers.PLAIN_MESHLET, set()),
    "Frame": (scene_buffers.FRAME, set()),
    "RasterPush": (raster_layout.RASTER_PUSH, set()),
    "BoundsPush": (raster_layout.BOUNDS_PUSH, set()),
    "Push": (raster_layout.DECODE_PUSH, set()),
    "Segment": (raster_layout.SEGMENT, set()),
    "Connected": (raster_layout.CONNECTED, set()),
    "Places": (raster_layout.PLACES, set()),
    "Placed": (raytrace_layout.PLACED, set()),
    "Source": (raytrace_layout.SOURCE, set()),
    "RaysPush": (raytrace_layout.RAYS_PUSH, set()),
    "BoxesPush": (raytrace_layout.BOXES_PUSH, set()),
    "FillPush": (raytrace_layout.FILL_PUSH, set()),
    "View": (raytrace_layout.VIEW, {"launches"}),
}


def members_of(dtype: np.dtype) -> dict[str, list[int]]:
    """Field -> [offset, bytes]"""
    assert dtype.fields is not None
    return {name: [dtype.fields[name][1], dtype.fields[name][0].itemsize] for name in dtype.fields}


@pytest.mark.parametrize("structure", MIRRORS)
def test_mirror_has_the_shaders_members(structure):
    dtype, left_out = MIRRORS[structure]
    members = dict(shipped_reflection()["structures"][structure])
    for name in left_out:
        del members[name]
    assert members_of(dtype) == members


def test_mirrors_have_the_shaders_strides():
    strides = shipped_reflection()["strides"]
    mirrored = [name for name in MIRRORS if name in strides]
    assert {"Primitive", "Instance", "Material", "Segment", "Placed", "Source"} <= set(mirrored)
    assert {name: MIRRORS[name][0].itemsize for name in mirrored} == {
        name: strides[name] for name in mirrored
    }


def test_launches_follow_the_view():
    offset, _ = shipped_reflection()["structures"]["View"]["launches"]
    assert offset == raytrace_layout.VIEW.itemsize


def test_every_structure_that_the_host_writes_has_a_mirror():
    """All but those that wrap one array, and those that only shaders write."""
    shared = {
        name
        for name, members in shipped_reflection()["structures"].items()
        if not set(members) <= {"at", "of"}
    }
    assert shared - {"Found", "Level", "Hit"} == set(MIRRORS)


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
