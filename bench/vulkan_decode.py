"""Raw decoding on the GPU: triangles per second of every way to decode a blob into plain buffers, all attributes, by its own clock.

Writes bench/results/vulkan_decode.json. For a machine with a GPU: python -m bench.vulkan_decode FILE.glb ...
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from gltf_ext.errors import MeshletError

from .common import markdown_table, origin, spread, write_result
from .gpu_models import add_models, models_of, parsed

REPEAT = 40
WARM_UP = (
    600  # milliseconds of work before what counts: an idle GPU runs at a fraction of its clock
)


def measure(device, path: Path, method: str) -> dict:
    """A row: the largest primitive of a compressed file. Raises MeshletError."""
    from gltf_ext.compression.extension import require_compressed
    from gltf_ext.gltf.importers import open_model
    from vk_backend.gpu_decoder import GpuDecoder, stream_elements

    primitive = max(require_compressed(open_model(path)), key=lambda p: p.triangle_count)
    components = stream_elements(primitive.blob)
    decoder = GpuDecoder(device, method, len(components), sum(components))
    once = decoder.decode(primitive.blob, repeat=10).milliseconds.min()
    decoded = decoder.decode(primitive.blob, repeat=REPEAT + min(int(WARM_UP / once), 5000))
    if decoded.errors.any():
        raise SystemExit(
            f"bench: {path}: {np.count_nonzero(decoded.errors)} meshlets did not decode with {method}"
        )
    times = spread(decoded.milliseconds[-REPEAT:].tolist())
    return {
        "model": path.stem,
        "method": method,
        "triangles": primitive.triangle_count,
        "meshlets": len(decoded.errors),
        "compressed_bytes": len(primitive.blob),
        "milliseconds": times,
        "triangles_per_second": primitive.triangle_count / times["median"] * 1e3,
    }


def table(rows: list[dict]) -> str:
    cells = [
        [
            row["model"],
            f"{row['triangles']:,}",
            row["method"],
            f"{row['milliseconds']['median']:.3f}",
            f"{row['triangles_per_second'] / 1e9:.2f}",
        ]
        for row in rows
    ]
    return markdown_table(["model", "triangles", "method", "ms", "billion triangles/s"], cells)


def main() -> None:
    from vk_backend.gpu_decoder import METHODS

    parser = argparse.ArgumentParser(
        prog="python -m bench.vulkan_decode", description=__doc__.splitlines()[0]
    )
    add_models(parser)
    parser.add_argument(
        "--methods", nargs="+", choices=METHODS, default=list(METHODS), help="(default: all)"
    )
    parser.add_argument(
        "--device", help="its number, or a part of its name (default: the first GPU)"
    )
    parser.add_argument("--no-write", action="store_true", help="print only")
    options = parsed(parser)
    try:
        run(options)
    except (MeshletError, OSError) as error:
        sys.exit(f"bench.vulkan_decode: {error}")


def run(options: argparse.Namespace) -> None:
    """Measures, prints and writes."""
    from vk_backend.device import Device

    with tempfile.TemporaryDirectory() as folder, Device(options.device) as device:
        rows = [
            measure(device, path, method)
            for path in models_of(options, Path(folder))
            for method in options.methods
        ]
        result = {**origin("bench.vulkan_decode", ("numpy", "vulkan")), "rows": rows}
        result["device"] = {"name": device.name, "driver": device.driver}
    print(table(rows))
    if not options.no_write:
        print(f"wrote {write_result('vulkan_decode', result)}")


if __name__ == "__main__":
    main()
