"""Decoding on the GPU into plain buffers: the oracle of the shaders' decoders, and their raw throughput."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
import vulkan as vk

from gltf_ext import _codec

from .device import Device
from .memory import Buffer
from .pipelines import ComputePipeline, Timestamps

GROUP = 32  # invocations of a workgroup
# Method -> (shader, meshlets of a workgroup) in the order in which they run; None: 64 invocations over meshlets and streams.
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


def stream_lanes(blob: bytes) -> list[int]:
    """Components of each stream of a blob whose header has been checked."""
    streams = blob[5]
    return [blob[32 + 28 * s + 1] for s in range(streams)]


def decode_on_gpu(device: Device, blob: bytes, method: str = "team8", repeat: int = 1) -> Decoded:
    """Decodes all streams of all meshlets. method: a key of METHODS.

    Raises ValueError for a blob whose header or tables are malformed; malformed meshlets are reported in `errors`.
    """
    meshlets = _codec.Decoder(blob).meshlet_count
    lanes = stream_lanes(blob)
    total = sum(lanes)
    source = Buffer(device, len(blob)).write(blob)
    summaries = Buffer(device, 4 * meshlets)
    connectivity = Buffer(device, 16 * meshlets)
    triangles = Buffer(device, 4 * 64 * meshlets)
    integers = Buffer(device, 4 * 64 * total * meshlets)
    lengths = Buffer(device, 4 * 64 * meshlets)
    pipelines = [(ComputePipeline(device, name, {0: len(lanes), 1: total}), per) for name, per in METHODS[method]]
    data = np.frombuffer(
        struct.pack(
            "<6Q4I",
            source.address,
            summaries.address,
            connectivity.address,
            triangles.address,
            integers.address,
            lengths.address,
            len(blob) // 4,
            meshlets,
            len(lanes),
            total,
        ),
        np.uint8,
    )
    times = Timestamps(device, repeat + 1)
    with device.commands() as commands:
        times.reset(commands)
        times.mark(commands, 0)
        for i in range(repeat):
            for pipeline, per in pipelines:
                groups = -(-meshlets // per) if per else -(-meshlets * len(lanes) // 64)
                pipeline.dispatch(commands, groups, data)
                device.full_barrier(commands)
            times.mark(commands, i + 1)
    summary = summaries.read()
    result = Decoded(
        triangle_counts=summary & 255,
        vertex_counts=summary >> 8 & 255,
        errors=summary >> 16,
        triangles=triangles.read().reshape(meshlets, 64),
        integers=integers.read().reshape(meshlets, total, 64),
        milliseconds=times.milliseconds(),
    )
    for buffer in (source, summaries, connectivity, triangles, integers, lengths):
        buffer.free()
    return result
