"""Compares slots, which hold a decoded meshlet each, with the decoder on the CPU."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gltf_ext import _codec

from ..decode.slots import SlotLayout, packed_field
from ..gpu.constants import CONSTANTS
from ..scene.scene import SHADED, Primitive, Scene

TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
VERTICES = CONSTANTS["MESHLET_VERTICES"]
CORNERS = 0xFFFFFF  # of a triangle's word; decoders use the upper byte
Place = tuple[int, int, int]  # slot, primitive, meshlet


def wrong_meshlets(
    scene: Scene, layout: SlotLayout, slots: np.ndarray, places: Iterable[Place]
) -> tuple[int, int]:
    """(meshlets whose triangles, positions or attributes differ, meshlets compared).

    slots: uint32[slots, words].
    """
    decoders = [_codec.Decoder(p.blob) for p in scene.primitives]
    wrong = compared = 0
    for slot, number, meshlet in places:
        primitive = scene.primitives[number]
        triangles, streams = decoders[number].decode_meshlet(meshlet)
        wrong += not _same(slots[slot], primitive, layout, triangles, streams)
        compared += 1
    return wrong, compared


def _same(
    words: np.ndarray,
    primitive: Primitive,
    layout: SlotLayout,
    triangles: np.ndarray,
    streams: list[np.ndarray],
) -> bool:
    """Whether a slot holds a meshlet. words: uint32[words of a slot]."""
    corners = triangles.astype(np.uint32) << np.array([0, 8, 16], np.uint32)
    count = len(streams[0])
    begin = TRIANGLES + VERTICES * (3 if layout.floats else 2)
    positions = words[TRIANGLES:begin].reshape(VERTICES, -1)[:count]
    attributes = words[begin:].reshape(VERTICES, -1)[:count]
    expected = _attribute_words(primitive, streams)
    return (
        np.array_equal(words[: len(triangles)] & CORNERS, corners.sum(axis=1))
        and np.array_equal(positions, _position_words(primitive, layout, streams[0]))
        and np.array_equal(attributes[:, : expected.shape[1]], expected)
    )


def _position_words(primitive: Primitive, layout: SlotLayout, integers: np.ndarray) -> np.ndarray:
    """uint32[vertices, 2 or 3]"""
    if layout.floats:
        return primitive.attributes["POSITION"].values(integers).view(np.uint32)
    return _packed(integers, CONSTANTS["PACKED_POSITION_BITS"])


def _attribute_words(primitive: Primitive, streams: list[np.ndarray]) -> np.ndarray:
    """uint32[vertices, words]: the attributes besides the position."""
    columns = [np.zeros((len(streams[0]), 0), np.uint32)]
    for role in SHADED[1:]:
        if role in primitive.attributes:
            a = primitive.attributes[role]
            field, _ = packed_field(a.stream.elements, a.stream.bits)
            columns.append(_packed(streams[a.index], field))
    return np.concatenate(columns, axis=1)


def _packed(integers: np.ndarray, bits: int) -> np.ndarray:
    """uint32[n, words]: elements of so many bits side by side, or a word each."""
    elements = integers.shape[1]
    if bits == 32:
        return integers
    shifts = np.arange(elements, dtype=np.uint64) * np.uint64(bits)
    fields = (integers.astype(np.uint64) << shifts).sum(axis=1, dtype=np.uint64)
    words = np.stack([fields & np.uint64(0xFFFFFFFF), fields >> np.uint64(32)], axis=1)
    return words[:, : -(-elements * bits // 32)].astype(np.uint32)
