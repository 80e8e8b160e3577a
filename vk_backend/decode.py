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

GROUP = 32  # invocations of a workgroup
INTERIOR_GROUP = 64  # of interior.comp, which has an invocation for each stream of a meshlet
# Method -> (shader, meshlets of a workgroup) in the order in which they run; None: see INTERIOR_GROUP.
METHODS = {
    "single": (("decode.comp", GROUP),),
    "team8": (("connect.comp", GROUP), ("values8.comp", GROUP // 8)),
    "team16": (("connect.comp", GROUP), ("values16.comp", GROUP // 16)),
    "team32": (("connect.comp", GROUP), ("values32.comp", 1)),
    "passes": (
        ("connect.comp", GROUP),
        ("lengths.comp", 8),
        ("corners.comp", 8),
        ("chains.comp", 8),
        ("interior.comp", None),
    ),
    "parallel": (("values_parallel.comp", 1),),
}


@dataclass
class Decoded:
    """What a shader made of every meshlet of a blob.

    triangles: uint32[M, 64], packed a | b << 8 | v << 16 | o << 24; integers: uint32[M, lanes, 64]; triangle_counts, vertex_counts,
    errors: uint32[M]. milliseconds: of the GPU, per repetition.
    """

    triangle_counts: np.ndarray
    vertex_counts: np.ndarray
    errors: np.ndarray
    triangles: np.ndarray
    integers: np.ndarray
    milliseconds: np.ndarray


def stream_components(blob: bytes) -> list[int]:
    """Components of each stream of a blob whose header has been checked."""
    first = CONSTANTS["BLOB_HEADER_BYTES"] + 1
    return [blob[first + CONSTANTS["BLOB_STREAM_BYTES"] * s] for s in range(blob[5])]


def stream_shapes(blob: bytes) -> list[tuple[int, int, int]]:
    """(components, bits of a field, words of a vertex) of each stream's packed values: the rules of shaders/packed_values.glsl."""
    shapes = []
    for s, components in enumerate(stream_components(blob)):
        bits = blob[CONSTANTS["BLOB_HEADER_BYTES"] + 2 + CONSTANTS["BLOB_STREAM_BYTES"] * s]
        field = max(bits, 21) if s == 0 else bits
        field = field if components * field <= 64 else 32
        shapes.append((components, field, -(-components * field // 32)))
    return shapes


def unpacked(values: np.ndarray, shapes: list[tuple[int, int, int]]) -> np.ndarray:
    """uint32[M, lanes, 64] of packed values, uint32[M, 64 * words of a vertex]."""
    rows, at = [], 0
    for components, field, words in shapes:
        part = values[:, at : at + 64 * words].reshape(-1, 64, words).astype(np.uint64)
        at += 64 * words
        if words <= 2:
            bits = part[..., 0] | (part[..., 1] << np.uint64(32) if words == 2 else np.uint64(0))
            rows += [(bits >> np.uint64(c * field)) & np.uint64((1 << field) - 1) for c in range(components)]
        else:
            rows += [part[..., c] for c in range(components)]
    return np.stack(rows, axis=1).astype(np.uint32)


class GpuDecoder:
    """Decodes blobs into plain buffers. method: a key of METHODS; streams, lanes: the most streams, and the most components of all
    streams, that a blob may have. Raises VulkanError."""

    def __init__(self, device: Device, method: str = "passes", streams: int = 8, lanes: int = 20):
        self.device, self.streams, self.lanes = device, streams, lanes
        self._packed = method == "passes"
        # Specialisation constants of meshlet_decoder_prologue.glsl.
        self._passes = [(ComputePipeline(device, name, {0: streams, 1: lanes}), per) for name, per in METHODS[method]]

    def decode(self, blob: bytes, repeat: int = 1) -> Decoded:
        """All streams of all meshlets, `repeat` times for the sake of the times.

        Raises ValueError for a blob whose header or tables are malformed, or with more streams or components than there is room for;
        malformed meshlets are reported in `errors`.
        """
        meshlets = _codec.Decoder(blob).meshlet_count
        components = stream_components(blob)
        lanes = sum(components)
        if len(components) > self.streams or lanes > self.lanes:
            raise ValueError(f"{len(components)} streams of {lanes} components; there is room for {self.streams} and {self.lanes}")
        source = Buffer(self.device, -(-len(blob) // 16) * 16).write(blob)
        shapes = stream_shapes(blob)
        vertex_words = sum(words for _, _, words in shapes)
        # In the order of shaders/decode_push.glsl: summaries, connectivity, triangles, integers, packed values.
        words = (1, 6, 64, 64 * lanes, 64 * vertex_words)
        buffers = [Buffer(self.device, 4 * meshlets * count) for count in words]
        addresses = [buffer.address for buffer in (source, *buffers)]
        data = np.frombuffer(struct.pack("<6Q5I", *addresses, len(blob) // 4, meshlets, len(components), lanes, vertex_words), np.uint8)
        times = Timestamps(self.device, repeat + 1)
        with self.device.commands() as commands:
            times.reset(commands)
            times.mark(commands, 0)
            for i in range(repeat):
                for pipeline, per in self._passes:
                    groups = -(-meshlets // (per or INTERIOR_GROUP // self.streams))
                    pipeline.dispatch(commands, groups, data)
                    self.device.full_barrier(commands)
                times.mark(commands, i + 1)
        summary = buffers[0].read()
        result = Decoded(
            triangle_counts=summary & 255,
            vertex_counts=summary >> 8 & 255,
            errors=summary >> 16,
            triangles=buffers[2].read().reshape(meshlets, 64),
            integers=unpacked(buffers[4].read().reshape(meshlets, -1), shapes) if self._packed else buffers[3].read().reshape(meshlets, lanes, 64),
            milliseconds=times.milliseconds(),
        )
        for buffer in (source, *buffers):
            buffer.free()
        return result
