"""Decoding with WebGPU: both methods of web/webgpu.js, down to the buffers of a renderer.

Needs a GPU, the Python package wgpu and the names of models: python -m bench webgpu FILE.glb ...
Times are the GPU's own. Naga compiles the WGSL, as in Firefox.
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

PACKAGES = ("numpy", "wgpu")
WGSL = ROOT / "web" / "wgsl"
# As in web/webgpu.js: shader -> meshlets of a workgroup.
FIRST = {"connect": 32, "lengths": 8}
METHODS = {
    "interior": {"corners": 8, "chains": 8, "interior": 1},
    "traversal": {"corners": 8, "chains": 8, "traversal": 64, "geo": 2},
}
SPREAD = 16  # threads of connect for each meshlet, with `interior`
SPLIT = ("corners", "chains", "traversal")  # have a row of workgroups for each stream
PASSES = ("lengths", "corners", "chains", "traversal", "geo")  # share a file
INTERIOR_STREAMS, INTERIOR_ELEMENTS = 8, 20
SCRATCH_BYTES = 2**25  # of the values that are decoded at a time
WORKGROUPS = 65535  # of a dispatch
MAX_BYTES = 2**30  # of a buffer
# Fields of the push constants in shaders/web/wgsl.glsl.
PUSH = ("blob_words", "meshlets", "streams", "value_words", "spread", "first")
PUSH_ATTRIBUTE = ("stream", "base", "stride", "field", "integers")
REPEAT = 20  # decodings of a round
WARM_UP, ROUNDS = 6, 4  # rounds: an idle GPU has a low clock rate
BINDING = re.compile(r"@binding\((\d+)\) @group\(0\) var<\w+(?:, (\w+))?>")
TYPES = {"read": "read-only-storage", "read_write": "storage", "": "uniform"}


class WebgpuDevice:
    """A GPU and its compiled shaders. name: a part of the GPU's, or None for the first one."""

    def __init__(self, name: str | None):
        try:
            import wgpu
        except ImportError:
            raise SystemExit("bench: wgpu is not installed (pip install wgpu==0.32.0)") from None
        adapters = [
            a
            for a in wgpu.gpu.enumerate_adapters_sync()
            if a.info["backend_type"] == "Vulkan"
            and (name or "").lower() in a.info["device"].lower()
        ]
        if not adapters:
            raise SystemExit("bench: wgpu finds no such GPU with Vulkan")
        self.info, self.usage = adapters[0].info, wgpu.BufferUsage
        limits = ("max-storage-buffer-binding-size", "max-buffer-size")
        self.device = adapters[0].request_device_sync(
            required_features=["timestamp-query"],
            required_limits={key: min(MAX_BYTES, adapters[0].limits[key]) for key in limits},
        )
        self._pipelines: dict[str, tuple[Any, Any, list[int]]] = {}

    def pipeline(self, name: str) -> tuple[Any, Any, list[int]]:
        """(pipeline, layout of its bind group, numbers of its bindings) of a shader."""
        if name not in self._pipelines:
            code = (WGSL / f"{'passes' if name in PASSES else name}.wgsl").read_text()
            declared = [(int(number), TYPES[access]) for number, access in BINDING.findall(code)]
            layout = self.device.create_bind_group_layout(
                entries=[
                    {"binding": number, "visibility": "COMPUTE", "buffer": {"type": kind}}
                    for number, kind in declared
                ]
            )
            pipeline = self.device.create_compute_pipeline(
                layout=self.device.create_pipeline_layout(bind_group_layouts=[layout]),
                compute={
                    "module": self.device.create_shader_module(code=code),
                    "entry_point": f"{name}_main",
                },
            )
            self._pipelines[name] = pipeline, layout, [number for number, _ in declared]
        return self._pipelines[name]


class WebgpuDecoder:
    """Decodes one blob as decodeToGPU does. Its header must have been checked."""

    def __init__(self, gpu: WebgpuDevice, blob: bytes, meshlets: int, triangles: int, method: str):
        self._gpu = gpu
        elements, places, words = stream_places(blob)
        self._push = {"blob_words": len(blob) // 4, "meshlets": meshlets}
        spread = SPREAD if method == "interior" else 1
        self._push |= {"streams": len(elements), "value_words": words, "spread": spread}
        chunk = min(WORKGROUPS, max(1, SCRATCH_BYTES // (4 * words)))
        sizes = {2: 4 * meshlets, 3: 256 * meshlets, 4: 4 * words * min(chunk, meshlets)}
        sizes |= {5: 48 * meshlets, 6: 64 * meshlets, 7: 4 * meshlets, 8: 20, 9: 8}
        self._buffers = {binding: self._buffer(size) for binding, size in sizes.items()}
        self._buffers[0] = gpu.device.create_buffer_with_data(data=blob, usage=gpu.usage.STORAGE)
        results = [self._buffer(256 * n * meshlets) for n in elements]
        indices = {"buffer": self._buffer(12 * triangles)}
        self._dispatches: list[tuple[Any, Any, tuple[int, int]]] = []
        for name, per in FIRST.items():
            threads = spread if name == "connect" else 1
            self._add(name, math.ceil(meshlets * threads / per))
        for first in range(0, meshlets, chunk):
            count = min(chunk, meshlets - first)
            some = {"first": first, "meshlets": first + count}
            for name, per in METHODS[method].items():
                self._add(name, math.ceil(count / per), **some)
            for s, (base, stride, field) in enumerate(places):
                shape = dict(zip(PUSH_ATTRIBUTE, (s, base, stride, field, 1)))
                place = {"buffer": results[s], "offset": 256 * elements[s] * first}
                self._add("attribute", count, place, **some, **shape)
        self._add("ranges", 1)
        for first in range(0, meshlets, WORKGROUPS):
            self._add("indices", min(WORKGROUPS, meshlets - first), indices, first=first)

    def _buffer(self, size: int) -> Any:
        usage = self._gpu.usage.STORAGE | self._gpu.usage.COPY_SRC
        return self._gpu.device.create_buffer(size=size, usage=usage)

    def _add(self, name: str, groups: int, results: dict | None = None, **push: int) -> None:
        """Adds a dispatch with these push constants besides those of the blob."""
        values = np.zeros(16, np.uint32)
        fields = {**self._push, **push}
        values[:11] = [fields.get(field, 0) for field in (*PUSH, *PUSH_ATTRIBUTE)]
        uniform = self._gpu.device.create_buffer_with_data(
            data=values.tobytes(), usage=self._gpu.usage.UNIFORM
        )
        resources = {
            **{number: {"buffer": buffer} for number, buffer in self._buffers.items()},
            1: {"buffer": uniform},
            10: results,
        }
        pipeline, layout, bindings = self._gpu.pipeline(name)
        group = self._gpu.device.create_bind_group(
            layout=layout, entries=[{"binding": n, "resource": resources[n]} for n in bindings]
        )
        rows = self._push["streams"] if name in SPLIT else 1
        self._dispatches.append((pipeline, group, (groups, rows)))

    def decode(self) -> np.ndarray:
        """float64[REPEAT]: milliseconds of each decoding, on the GPU."""
        device, usage = self._gpu.device, self._gpu.usage
        queries = device.create_query_set(type="timestamp", count=2 * REPEAT)
        times = device.create_buffer(size=16 * REPEAT, usage=usage.QUERY_RESOLVE | usage.COPY_SRC)
        encoder = device.create_command_encoder()
        for i in range(REPEAT):
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
        encoder.resolve_query_set(queries, 0, 2 * REPEAT, times, 0)
        device.queue.submit([encoder.finish()])
        stamps = np.frombuffer(device.queue.read_buffer(times), np.uint64).reshape(-1, 2)
        return (stamps[:, 1] - stamps[:, 0]) / 1e6

    def malformed(self) -> int:
        """Meshlets that the last decoding refused."""
        return int(
            np.frombuffer(self._gpu.device.queue.read_buffer(self._buffers[9]), np.uint32)[0]
        )


def stream_places(blob: bytes) -> tuple[list[int], list[tuple[int, int, int]], int]:
    """(elements, (base, stride, field) of the values) of each stream, and words of a meshlet."""
    from bench.gpu_decoder import packed_shapes

    places, end = [], 0
    for _, field, words in packed_shapes(blob):
        places.append((end, words, field))
        end += 64 * words
    return [elements for elements, _, _ in packed_shapes(blob)], places, end


def measure(options: argparse.Namespace) -> dict:
    """All models with both methods."""
    gpu = WebgpuDevice(options.adapter)
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            row for path in model_files(options, Path(folder)) for row in measure_model(gpu, path)
        ]
    return {"rows": rows, "adapter": f"{gpu.info['device']} ({gpu.info['description']})"}


def measure_model(gpu: WebgpuDevice, path: Path) -> list[dict]:
    """A row per method, of the largest blob of a compressed file. Raises MeshletError."""
    from gltf_ext import _codec
    from gltf_ext.compression.extension import require_compressed
    from gltf_ext.gltf.importers import open_model

    blob = max((b for p in require_compressed(open_model(path)) for b in p.blobs), key=len)
    info = _codec.Decoder(blob)
    elements = stream_places(blob)[0]
    fits = len(elements) <= INTERIOR_STREAMS and sum(elements) <= INTERIOR_ELEMENTS
    rows = []
    for method in METHODS if fits else ["traversal"]:
        decoder = WebgpuDecoder(gpu, blob, info.meshlet_count, info.triangle_count, method)
        rounds = [decoder.decode() for _ in range(WARM_UP + ROUNDS)][WARM_UP:]
        if decoder.malformed():
            raise SystemExit(f"bench: {path}: {method} refuses {decoder.malformed()} meshlets")
        facts = {"model": path.stem, "method": method, "triangles": info.triangle_count}
        times = spread(np.concatenate(rounds).tolist())
        rows.append({**facts, "meshlets": info.meshlet_count, "milliseconds": times})
    return rows


def summary(result: dict) -> str:
    """The table to print."""
    cells = []
    for row in result["rows"]:
        median = row["milliseconds"]["median"]
        rate = row["triangles"] / median / 1e6
        figures = [f"{row['meshlets']:,}", row["method"], f"{median:.3f}", f"{rate:.2f}"]
        cells.append([row["model"], *figures])
    return markdown_table(["model", "meshlets", "method", "ms", "billion triangles/s"], cells)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_model_files(parser)
    parser.add_argument("--adapter", help="part of the GPU's name (default: the first)")


check = check_model_files
