"""Decoding with WebGPU: the pass decoder in WGSL beside the same passes in SPIR-V.

Needs a GPU, the Python package wgpu and the names of models: python -m bench webgpu FILE.glb ...
Times are the GPU's own, of rounds that alternate between the two. Naga compiles the WGSL, as in
Firefox.
"""

from __future__ import annotations

import argparse
import math
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bench.common import ROOT, markdown_table, spread
from bench.models import add_model_files, check_model_files, model_files

PACKAGES = ("numpy", "vulkan", "wgpu")
WGSL = ROOT / "web" / "wgsl"
# The modules of web/wgsl for GpuDecoder's shaders, as web/webgpu.js chooses them.
SMALL = {"interior": "interior_small"}  # for so many elements:
SMALL_ELEMENTS = 8
WORKGROUPS = 65535  # of a dispatch
ROUNDS = 12
REPEAT = 20  # decodings of a round
WARM_UP = 3  # rounds: an idle GPU has a low clock rate


class WebgpuDecoder:
    """Runs the passes over one blob. Its header must have been checked.

    passes: modules of web/wgsl, with the meshlets of a workgroup. words: of the values of a
    meshlet, in the layout of packed_values.glsl.
    """

    def __init__(
        self,
        blob: bytes,
        passes: list[tuple[str, int]],
        meshlets: int,
        streams: int,
        words: int,
        adapter: str | None,
    ):
        try:
            import wgpu
        except ImportError:
            raise SystemExit("bench: wgpu is not installed (pip install wgpu==0.32.0)") from None
        self._wgpu = wgpu
        self.meshlets = meshlets
        self.device = self._open(adapter, 4 * words * meshlets)
        usage = wgpu.BufferUsage
        storage = usage.STORAGE | usage.COPY_SRC
        sizes = {2: 4, 3: 256, 4: 4 * words, 5: 48, 6: 64}  # by binding, bytes of a meshlet
        self._buffers = {
            binding: self.device.create_buffer(size=size * meshlets, usage=storage)
            for binding, size in sizes.items()
        }
        self._buffers[0] = self.device.create_buffer_with_data(data=blob, usage=storage)
        self._dispatches = [
            dispatch
            for name, per, rows in passes
            for dispatch in self._prepare(name, per, rows, len(blob) // 4, streams, words)
        ]

    def _open(self, name: str | None, largest: int) -> Any:
        adapters = self._wgpu.gpu.enumerate_adapters_sync()
        suitable = [a for a in adapters if a.info["backend_type"] == "Vulkan"]
        if name:
            suitable = [a for a in suitable if name.lower() in a.info["device"].lower()]
        if not suitable:
            raise SystemExit("bench: wgpu finds no such GPU with Vulkan")
        self.adapter = suitable[0].info
        size = max(largest, 2**27)
        return suitable[0].request_device_sync(
            required_features=["timestamp-query"],
            required_limits={"max-storage-buffer-binding-size": size, "max-buffer-size": size},
        )

    def _prepare(
        self, name: str, per: int, rows: int, blob_words: int, streams: int, words: int
    ) -> list:
        """The pipeline, bind group and workgroups of each dispatch of a pass."""
        code = (WGSL / f"{name}.wgsl").read_text()
        pipeline = self.device.create_compute_pipeline(
            layout="auto",
            compute={
                "module": self.device.create_shader_module(code=code),
                "entry_point": "main",
            },
        )
        bindings = [int(n) for n in re.findall(r"@binding\((\d+)\)", code)]
        dispatches = []
        for first in range(0, self.meshlets, WORKGROUPS * per):
            end = min(first + WORKGROUPS * per, self.meshlets)
            # Values lie at (meshlet - first) * words, and so must the binding.
            push = np.zeros(16, np.uint32)
            push[:5] = [blob_words, end, streams, words, first]
            uniform = self.device.create_buffer_with_data(
                data=push.tobytes(), usage=self._wgpu.BufferUsage.UNIFORM
            )
            resources = {
                **{n: {"buffer": buffer} for n, buffer in self._buffers.items()},
                1: {"buffer": uniform},
                4: {"buffer": self._buffers[4], "offset": 4 * words * first},
            }
            group = self.device.create_bind_group(
                layout=pipeline.get_bind_group_layout(0),
                entries=[{"binding": n, "resource": resources[n]} for n in bindings],
            )
            dispatches.append((pipeline, group, (math.ceil((end - first) / per), rows)))
        return dispatches

    def decode(self, repeat: int) -> np.ndarray:
        """float64[repeat]: milliseconds of each decoding, on the GPU."""
        usage = self._wgpu.BufferUsage
        queries = self.device.create_query_set(type="timestamp", count=2 * repeat)
        times = self.device.create_buffer(
            size=16 * repeat, usage=usage.QUERY_RESOLVE | usage.COPY_SRC
        )
        encoder = self.device.create_command_encoder()
        for i in range(repeat):
            compute = encoder.begin_compute_pass(
                timestamp_writes={
                    "query_set": queries,
                    "beginning_of_pass_write_index": 2 * i,
                    "end_of_pass_write_index": 2 * i + 1,
                }
            )
            for pipeline, group, workgroups in self._dispatches:
                compute.set_pipeline(pipeline)
                compute.set_bind_group(0, group)
                compute.dispatch_workgroups(*workgroups)
            compute.end()
        encoder.resolve_query_set(queries, 0, 2 * repeat, times, 0)
        self.device.queue.submit([encoder.finish()])
        stamps = np.frombuffer(self.device.queue.read_buffer(times), np.uint64).reshape(-1, 2)
        return (stamps[:, 1] - stamps[:, 0]) / 1e6

    def read(self, binding: int) -> np.ndarray:
        """uint32[]: a buffer's words."""
        return np.frombuffer(self.device.queue.read_buffer(self._buffers[binding]), np.uint32)


def measure(options: argparse.Namespace) -> dict:
    """All models with both."""
    from vk_backend.device import Device

    with tempfile.TemporaryDirectory() as folder, Device(options.device) as device:
        rows = [
            measure_model(device, path, options.adapter)
            for path in model_files(options, Path(folder))
        ]
        return {"rows": rows, "device": {"name": device.name, "driver": device.driver}}


def measure_model(device: Any, path: Path, adapter: str | None) -> dict:
    """One row, of the largest blob of a compressed file. Raises MeshletError."""
    from gltf_ext import _codec
    from gltf_ext.compression.extension import require_compressed
    from gltf_ext.gltf.importers import open_model
    from vk_backend.gpu_decoder import GpuDecoder, packed_shapes, stream_elements, unpacked

    blob = max((b for p in require_compressed(open_model(path)) for b in p.blobs), key=len)
    info = _codec.Decoder(blob)
    elements, shapes = stream_elements(blob), packed_shapes(blob)
    if len(elements) > 8 or sum(elements) > 20:
        raise SystemExit(f"bench: {path}: the passes in WGSL take 8 streams of 20 elements")
    native = GpuDecoder(device, "passes", len(elements), sum(elements))
    words = 64 * sum(words for _, _, words in shapes)
    small = SMALL if sum(elements) <= SMALL_ELEMENTS else {}
    passes = []
    for step in native.passes(blob):  # in WGSL, connect has a thread per meshlet
        name = step.shader.removesuffix(".comp")
        rows = len(elements) if step.split else 1
        passes.append((small.get(name, name), step.meshlets * step.spread, rows))
    web = WebgpuDecoder(blob, passes, info.meshlet_count, len(elements), words, adapter)
    times: dict[str, list[float]] = {"spirv": [], "wgsl": []}
    for number in range(WARM_UP + ROUNDS):
        decoded = native.decode(blob, repeat=REPEAT)
        both = {"spirv": decoded.milliseconds, "wgsl": web.decode(REPEAT)}
        for name, milliseconds in both.items():
            if number >= WARM_UP:
                times[name].append(float(np.median(milliseconds)))
    same(path, decoded, web.read(2), unpacked(web.read(4).reshape(info.meshlet_count, -1), shapes))
    ratio = np.median(times["wgsl"]) / np.median(times["spirv"])
    return {
        "model": path.stem,
        "triangles": info.triangle_count,
        "meshlets": info.meshlet_count,
        "adapter": f"{web.adapter['device']} ({web.adapter['description']})",
        "milliseconds": {name: spread(values) for name, values in times.items()},
        "ratio": float(ratio),
    }


def same(path: Path, decoded: Any, summaries: np.ndarray, integers: np.ndarray) -> None:
    """Ends the program unless both have decoded the same."""
    counts = decoded.triangle_counts | decoded.vertex_counts << 8 | decoded.errors << 16
    vertex = np.arange(64)[None, None, :] < decoded.vertex_counts[:, None, None]
    if (counts != summaries).any() or ((decoded.integers != integers) & vertex).any():
        raise SystemExit(f"bench: {path}: WGSL and SPIR-V differ")


def summary(result: dict) -> str:
    """The table to print."""
    cells = []
    for row in result["rows"]:
        spirv, wgsl = (row["milliseconds"][name]["median"] for name in ("spirv", "wgsl"))
        rate = row["triangles"] / wgsl / 1e6
        cells.append(
            [
                row["model"],
                f"{row['triangles']:,}",
                f"{spirv:.3f}",
                f"{wgsl:.3f}",
                f"{row['ratio']:.2f}",
                f"{rate:.2f}",
            ]
        )
    columns = ["model", "triangles", "SPIR-V ms", "WGSL ms", "ratio", "WGSL billion triangles/s"]
    return markdown_table(columns, cells)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_files(parser)
    parser.add_argument("--device", help="number or part of the name (default: the first GPU)")
    parser.add_argument("--adapter", help="part of the GPU's name for wgpu (default: its first)")


check = check_model_files
