"""Decoding on the GPU into plain buffers: the oracle of the shaders' decoders, and their raw throughput."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from gltf_ext import _codec

from .constants import CONSTANTS
from .device import Device
from .memory import Buffer
from .pipelines import ComputePipeline, Timestamps
from .slots import PACKED_BITS, packed_field
from .stream import CONNECTED_BYTES

GROUP = 32  # invocations of a workgroup
PASS_GROUP = 64  # of one of the passes of shaders/meshlet_passes.glsl
# Method -> (shader, meshlets of a workgroup) in the order in which they run; None: as many as have an invocation for each stream.
METHODS = {
    "single": (("decode.comp", GROUP),),
    "team8": (("connect.comp", GROUP), ("values8.comp", GROUP // 8)),
    "team16": (("connect.comp", GROUP), ("values16.comp", GROUP // 16)),
    "team32": (("connect.comp", GROUP), ("values32.comp", 1)),
    "passes": (
        ("connect.comp", GROUP),
        ("lengths.comp", PASS_GROUP // 8),
        ("corners.comp", PASS_GROUP // 8),
        ("chains.comp", PASS_GROUP // 8),
        ("interior.comp", None),
    ),
    "parallel": (("values_parallel.comp", 1),),
}


@dataclass
class Decoded:
    """What a shader made of every meshlet of a blob.

    triangles: uint32[M, 64], packed a | b << 8 | v << 16 | o << 24; integers: uint32[M, components of all streams, 64];
    triangle_counts, vertex_counts, errors: uint32[M], 0 the errors of what is well formed. milliseconds: of the GPU, per repetition.
    """

    triangle_counts: np.ndarray
    vertex_counts: np.ndarray
    errors: np.ndarray
    triangles: np.ndarray
    integers: np.ndarray
    milliseconds: np.ndarray


def stream_elements(blob: bytes) -> list[int]:
    """Components of each stream of a blob whose header has been checked."""
    return [components for components, _ in _stream_table(blob)]


def _stream_table(blob: bytes) -> list[tuple[int, int]]:
    """(components, bits) of each stream of a blob whose header has been checked."""
    rows = (
        CONSTANTS["BLOB_HEADER_BYTES"] + CONSTANTS["BLOB_STREAM_BYTES"] * s for s in range(blob[5])
    )
    return [(blob[row + 1], blob[row + 2]) for row in rows]


def packed_shapes(blob: bytes) -> list[tuple[int, int, int]]:
    """(components, bits of a field, words of a vertex) of each stream's packed values: the rules of shaders/packed_values.glsl."""
    shapes = []
    for s, (components, bits) in enumerate(_stream_table(blob)):
        shapes.append(
            (components, *packed_field(components, max(bits, PACKED_BITS) if s == 0 else bits))
        )
    return shapes


def unpacked(values: np.ndarray, shapes: list[tuple[int, int, int]]) -> np.ndarray:
    """uint32[M, components of all streams, 64] of packed values, uint32[M, 64 * words of a vertex]."""
    rows, at = [], 0
    for components, field, words in shapes:
        part = values[:, at : at + 64 * words].reshape(-1, 64, words).astype(np.uint64)
        at += 64 * words
        if words <= 2:
            bits = part[..., 0] | (part[..., 1] << np.uint64(32) if words == 2 else np.uint64(0))
            rows += [
                (bits >> np.uint64(c * field)) & np.uint64((1 << field) - 1)
                for c in range(components)
            ]
        else:
            rows += [part[..., c] for c in range(components)]
    return np.stack(rows, axis=1).astype(np.uint32)


class GpuDecoder:
    """Decodes blobs into plain buffers.

    method: a key of METHODS; streams, elements: the most streams, 64 or fewer, and the most components of all streams, that a blob may have.
    Raises VulkanError.
    """

    def __init__(
        self, device: Device, method: str = "passes", streams: int = 8, elements: int = 20
    ):
        self.device, self.streams, self.elements = device, streams, elements
        self._packs = method == "passes"
        constants = {0: streams, 1: elements}  # of meshlet_decoder_prologue.glsl
        self._passes = [
            (ComputePipeline.of(device, name, constants), per or PASS_GROUP // streams)
            for name, per in METHODS[method]
        ]

    def decode(self, blob: bytes, repeat: int = 1) -> Decoded:
        """All streams of all meshlets, `repeat` times for the sake of the times.

        Raises ValueError for a blob whose header or tables are malformed, or with more streams or components than there is room for;
        malformed meshlets are reported in `errors`.
        """
        meshlets = _codec.Decoder(blob).meshlet_count
        components = stream_elements(blob)
        elements = sum(components)
        if len(components) > self.streams or elements > self.elements:
            raise ValueError(
                f"{len(components)} streams of {elements} components; there is room for {self.streams} and {self.elements}"
            )
        shapes = packed_shapes(blob)
        value_words = 64 * (sum(words for _, _, words in shapes) if self._packs else elements)
        source = Buffer(self.device, len(blob)).write(blob)
        # In the order of shaders/decode_push.glsl: summaries, connectivity, triangles, values.
        summaries, _, triangles, values = results = [
            Buffer(self.device, 4 * words * meshlets)
            for words in (1, CONNECTED_BYTES // 4, 64, value_words)
        ]
        addresses = [buffer.address for buffer in (source, *results)]
        data = np.frombuffer(
            struct.pack(
                "<5Q4I", *addresses, len(blob) // 4, meshlets, len(components), value_words
            ),
            np.uint8,
        )
        milliseconds = self._run(data, meshlets, repeat)
        summary, integers = summaries.read(), values.read().reshape(meshlets, -1)
        result = Decoded(
            triangle_counts=summary & 255,
            vertex_counts=summary >> 8 & 255,
            errors=summary >> 16,
            triangles=triangles.read().reshape(meshlets, 64),
            integers=unpacked(integers, shapes)
            if self._packs
            else integers.reshape(meshlets, elements, 64),
            milliseconds=milliseconds,
        )
        for buffer in (source, *results):
            buffer.free()
        return result

    def _run(self, data: np.ndarray, meshlets: int, repeat: int) -> np.ndarray:
        """Decodes `repeat` times; float64[repeat], milliseconds. data: push constants."""
        times = Timestamps(self.device, repeat + 1)
        with self.device.commands() as commands:
            times.reset(commands)
            times.mark(commands, 0)
            for i in range(repeat):
                for pipeline, per in self._passes:
                    pipeline.dispatch(commands, -(-meshlets // per), data)
                    self.device.full_barrier(commands)
                times.mark(commands, i + 1)
        return times.milliseconds()
