"""Decodes blobs on the GPU into plain buffers, to test the shaders' decoders and to time them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import bench.compiled_shaders  # noqa: F401  before their structures
from gltf_ext import _codec
from vk_backend.decode.slots import PACKED_POSITION_BITS, packed_field
from vk_backend.gpu.constants import CONSTANTS
from vk_backend.gpu.device import Device
from vk_backend.gpu.errors import VulkanError
from vk_backend.gpu.memory import Buffer
from vk_backend.gpu.pipelines import ComputePipeline, Timestamps, push_record
from vk_backend.gpu.reflection import structure
from vk_backend.scene.buffers import team_bytes

PUSH = structure("Push", "bench")
CONNECTED = structure("Connected", "bench")
PLACES = structure("Places", "bench")

GROUP = 32  # threads of a workgroup
PASS_GROUP = 64  # of the passes that use shaders/decoders/passes.glsl


@dataclass(frozen=True)
class Pass:
    """A dispatch. meshlets: of a workgroup; split: there is a row of workgroups per stream."""

    shader: str
    meshlets: int
    split: bool = False


CONNECT = Pass("connect.comp", GROUP)
BOUNDARY = (
    CONNECT,
    Pass("lengths.comp", PASS_GROUP // 8),
    Pass("corners.comp", PASS_GROUP // 8, split=True),
    Pass("chains.comp", PASS_GROUP // 8, split=True),
)
# In the order in which they run. `interior` and `traversal` are those of web/webgpu.js.
METHODS: dict[str, tuple[Pass, ...]] = {
    "serial": (Pass("serial.comp", GROUP),),
    "team": (CONNECT, Pass("values.comp", 1)),
    "parallel": (Pass("values_parallel.comp", 1),),
    "interior": (*BOUNDARY, Pass("interior.comp", 1)),
    "traversal": (
        *BOUNDARY,
        Pass("traversal.comp", PASS_GROUP, split=True),
        Pass("geo.comp", PASS_GROUP // 32),
    ),
}
SPREAD = 16  # threads of connect.comp for each meshlet, with `interior`: see web/webgpu.js
PACKED = ("interior", "traversal")  # write shaders/decoders/packed_values.glsl's layout


@dataclass
class Decoded:
    """All M meshlets of a blob, decoded.

    triangles: uint32[M, 64], packed a | b << 8 | v << 16 | o << 24.
    integers: uint32[M, elements of all streams, 64].
    triangle_counts, vertex_counts, errors: uint32[M]; an error of 0 means well formed.
    milliseconds: float64[repetitions], on the GPU.
    """

    triangle_counts: np.ndarray
    vertex_counts: np.ndarray
    errors: np.ndarray
    triangles: np.ndarray
    integers: np.ndarray
    milliseconds: np.ndarray


def stream_elements(blob: bytes) -> list[int]:
    """Elements of each stream. The blob's header must have been checked."""
    return [elements for elements, _ in _stream_table(blob)]


def _stream_table(blob: bytes) -> list[tuple[int, int]]:
    """(elements, bits) of each stream. The blob's header must have been checked."""
    header, size = CONSTANTS["BLOB_HEADER_BYTES"], CONSTANTS["BLOB_STREAM_BYTES"]
    rows = (header + size * s for s in range(blob[5]))
    return [(blob[row + 1], blob[row + 2]) for row in rows]


def packed_shapes(blob: bytes) -> list[tuple[int, int, int]]:
    """(elements, bits of a field, words of a vertex) of each stream's packed values.

    Same rules as shaders/decoders/packed_values.glsl: positions take at least 21 bits per axis.
    """
    shapes = []
    for s, (elements, bits) in enumerate(_stream_table(blob)):
        least = PACKED_POSITION_BITS if s == 0 else 0
        shapes.append((elements, *packed_field(elements, max(bits, least))))
    return shapes


def unpacked(values: np.ndarray, shapes: list[tuple[int, int, int]]) -> np.ndarray:
    """Unpacks the values of all streams.

    values: uint32[M, 64 * words of a vertex]. Returns uint32[M, elements of all streams, 64].
    """
    rows, at = [], 0
    for elements, field, words in shapes:
        own = values[:, at : at + 64 * words].reshape(-1, 64, words).astype(np.uint64)
        at += 64 * words
        if words <= 2:
            bits = own[..., 0] | (own[..., 1] << np.uint64(32) if words == 2 else np.uint64(0))
            rows += [
                (bits >> np.uint64(c * field)) & np.uint64((1 << field) - 1)
                for c in range(elements)
            ]
        else:
            rows += [own[..., c] for c in range(elements)]
    return np.stack(rows, axis=1).astype(np.uint32)


class GpuDecoder:
    """Decodes blobs into plain buffers.

    method: a key of METHODS. streams: of a blob, at most; 64 or fewer. elements: of all streams
    of a blob, at most. Raises VulkanError if memory is short, or if a workgroup's shared memory
    is too small for a vertex of these elements (`serial` and `traversal` need none).
    """

    def __init__(
        self, device: Device, method: str = "traversal", streams: int = 8, elements: int = 20
    ):
        shares = method not in ("serial", "traversal")
        if shares and team_bytes(elements, streams) > device.limits.compute_shared_bytes:
            problem = f"{elements} elements per vertex are too many for the decoder {method}"
            raise VulkanError(f"{problem} on {device.name}", "use the decoder serial")
        self.device, self.streams, self.elements = device, streams, elements
        self._method, self._packs = method, method in PACKED
        self._spread = SPREAD if method == "interior" else 1

    def decode(self, blob: bytes, repeat: int = 1) -> Decoded:
        """Decodes all streams of all meshlets, `repeat` times to time it.

        Malformed meshlets are reported in `errors`. Raises ValueError if the blob's header or
        tables are malformed, or it has more streams or elements than there is room for.
        """
        meshlets = _codec.Decoder(blob).meshlet_count
        streams, elements = len(stream_elements(blob)), sum(stream_elements(blob))
        if streams > self.streams or elements > self.elements:
            raise ValueError(
                f"{streams} streams of {elements} elements; "
                f"there is room for {self.streams} and {self.elements}"
            )
        shapes = packed_shapes(blob)
        value_words = 64 * (sum(words for _, _, words in shapes) if self._packs else elements)
        source = Buffer(self.device, len(blob)).write(blob)
        sizes = {
            "summaries": CONSTANTS["SUMMARY_BYTES"],
            "connectivity": CONNECTED.itemsize,
            "places": PLACES.itemsize,
            "triangles": 4 * CONSTANTS["MESHLET_TRIANGLES"],
            "values": 4 * value_words,
        }
        results = {name: Buffer(self.device, size * meshlets) for name, size in sizes.items()}
        data = push_record(
            PUSH,
            blob=source.address,
            blob_words=len(blob) // 4,
            meshlets=meshlets,
            streams=streams,
            value_words=value_words,
            spread=self._spread,
            **{name: buffer.address for name, buffer in results.items()},
        )
        milliseconds = self._run(data, meshlets, repeat)
        summary = results["summaries"].read()
        integers = results["values"].read().reshape(meshlets, -1)
        values = unpacked(integers, shapes) if self._packs else integers
        result = Decoded(
            triangle_counts=summary & 255,
            vertex_counts=summary >> 8 & 255,
            errors=summary >> 16,
            triangles=results["triangles"].read().reshape(meshlets, -1),
            integers=values.reshape(meshlets, elements, 64),
            milliseconds=milliseconds,
        )
        for buffer in (source, *results.values()):
            buffer.free()
        return result

    def _run(self, data: np.ndarray, meshlets: int, repeat: int) -> np.ndarray:
        """float64[repeat]: milliseconds of each run. data: push constants."""
        constants = {"MAX_STREAMS": self.streams, "MAX_ELEMENTS": self.elements}
        steps = []
        for step in METHODS[self._method]:
            pipeline = ComputePipeline.of(self.device, f"bench:{step.shader}", constants)
            threads = meshlets * (self._spread if step == CONNECT else 1)
            steps.append((pipeline, -(-threads // step.meshlets), step.split))
        times = Timestamps(self.device, repeat + 1)
        with self.device.commands() as commands:
            times.reset(commands)
            times.mark(commands, 0)
            for i in range(repeat):
                for pipeline, groups, split in steps:
                    streams = int(data["streams"]) if split else 1
                    pipeline.dispatch(commands, groups, data, streams)
                    self.device.compute_barrier(commands)
                times.mark(commands, i + 1)
        return times.milliseconds()
