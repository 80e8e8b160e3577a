"""Structures and constants that the host takes from the shaders."""

from __future__ import annotations

import numpy as np
import pytest

from tools import build_shaders
from tools.spirv import (
    DECORATION_OFFSET,
    DECORATION_SPEC_ID,
    OP_DECORATE,
    OP_MEMBER_DECORATE,
    instructions,
    words_of,
)
from vk_backend.gpu.reflection import shipped_reflection, specialization_ids, structure


def test_dtypes_have_the_members_of_structures():
    """Addresses are 64-bit words; structures and arrays are inside of others."""
    assert structure("Segment") == np.dtype(
        [("instance", "<u4"), ("first", "<u4"), ("meshlets", "<u4"), ("slot", "<u4")]
    )
    primitive = structure("Primitive")
    assert primitive["blob"] == np.uint64 and primitive["position"] == structure("Attribute")
    assert primitive["box_low"] == np.dtype(("<f4", 4))
    assert structure("Frame")["world_to_clip"] == np.dtype(("<f4", (4, 4)))
    assert structure("Material")["base_texture"] == np.int32
    assert structure("Box") == np.dtype([("low", "<f4", 3), ("high", "<f4", 3)])


def test_dtypes_have_the_shaders_strides():
    strides = shipped_reflection()["strides"]
    assert {"Primitive", "Instance", "Material", "Segment", "Placed", "Source"} <= set(strides)
    assert {name: structure(name).itemsize for name in strides} == strides


def test_a_structure_without_a_stride_ends_with_its_last_member():
    members = shipped_reflection()["structures"]["RasterPush"]
    assert structure("RasterPush").itemsize == members["jobs"][0] + 8


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
        tuple(sorted(offset for offset, *_ in reflection["structures"][name].values()))
        for name in recorded["structures"]
    }
    assert expected == found
    assert set(recorded["specialization"].values()) == constants


def test_constants_are_found_by_name():
    assert specialization_ids("bounds.comp", {"MAX_STREAMS": 5, "CULLING": 1}) == {0: 5}
    with pytest.raises(ValueError, match="no shader has the constants CULING"):
        specialization_ids("bounds.comp", {"MAX_STREAMS": 5, "CULING": 1})
