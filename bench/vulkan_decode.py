"""Decoding on the GPU: triangles per second of each decoder, all attributes into plain buffers.

Needs a GPU and the names of models: python -m bench vulkan_decode FILE.glb ... Times are the GPU's
own.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from bench.common import spread, table_by_model
from bench.models import add_gpu_options, blobs_of, check_model_files, model_files

PACKAGES = ("numpy", "vulkan")
REPEAT = 40
WARM_UP = 600  # milliseconds of work before the timed runs: an idle GPU has a low clock rate


def measure(options: argparse.Namespace) -> dict:
    """All models with all methods."""
    from bench.gpu_decoder import METHODS
    from vk_backend.gpu.device import Device

    with tempfile.TemporaryDirectory() as folder, Device(options.device) as device:
        rows = [
            measure_model(device, path, method)
            for path in model_files(options, Path(folder))
            for method in METHODS
        ]
        return {"rows": rows, "device": {"name": device.name, "driver": device.driver}}


def measure_model(device, path: Path, method: str) -> dict:
    """One row, of the largest blob of a compressed file. Raises MeshletError."""
    from bench.gpu_decoder import GpuDecoder, stream_elements
    from gltf_ext import _codec

    blob = max(blobs_of(path), key=len)
    triangles = _codec.Decoder(blob).triangle_count
    elements = stream_elements(blob)
    decoder = GpuDecoder(device, method, len(elements), sum(elements))
    once = decoder.decode(blob, repeat=10).milliseconds.min()
    decoded = decoder.decode(blob, repeat=REPEAT + min(int(WARM_UP / once), 5000))
    if decoded.errors.any():
        raise SystemExit(
            f"bench: {path}: {method} failed on {np.count_nonzero(decoded.errors)} meshlets"
        )
    times = spread(decoded.milliseconds[-REPEAT:].tolist())
    return {
        "model": path.stem,
        "method": method,
        "triangles": triangles,
        "meshlets": len(decoded.errors),
        "compressed_bytes": len(blob),
        "milliseconds": times,
        "triangles_per_second": triangles / times["median"] * 1e3,
    }


def summary(result: dict) -> str:
    """Triangles per second by method and model."""
    cells = table_by_model(
        "method",
        result["rows"],
        lambda row: row["method"],
        lambda row: f"{row['triangles_per_second'] / 1e9:.2f}",
        lambda row: f"{row['model']} ({row['triangles']:,})",
    )
    return f"""Billion triangles per second in compute shaders, all attributes to integers in plain
buffers. Of a model with several primitives, the largest.

{cells}"""


add_options, check = add_gpu_options, check_model_files
