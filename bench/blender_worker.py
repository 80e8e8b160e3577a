"""Runs inside Blender for bench/blender.py: python blender_worker.py FUNCTION ARGUMENTS

ARGUMENTS is a JSON array. The last line that it prints is the result as JSON.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import bpy

BITS = {
    "position": 12,
    "normal": 8,
    "texcoord": 12,
    "color": 8,
    "generic": 8,
}  # as bench.common.BITS


def install(extension: str) -> None:
    bpy.ops.extensions.package_install_files(
        filepath=extension, repo="user_default", enable_on_install=True
    )


def prepare(extension: str, model: str, outputs: dict[str, str]) -> dict:
    """Exports a model in each format, all at the same bits; returns the versions."""
    install(extension)
    open_empty()
    bpy.ops.import_scene.gltf(filepath=model)
    draco = {f"export_draco_{name}_quantization": bits for name, bits in BITS.items()}
    names = ("position", "normal", "texcoord", "color")
    ours = {f"export_meshlet_{name}_bits": BITS[name] for name in names}
    for name, path in outputs.items():
        bpy.ops.export_scene.gltf(
            filepath=path,
            export_format="GLB",
            export_draco_mesh_compression_enable=name == "draco",
            export_meshlet_enabled=name == "meshlets",
            **draco,
            **ours,
        )
    return {"blender": bpy.app.version_string, "blender python": sys.version.split()[0]}


def measure(extension: str, small: str, model: str) -> dict:
    """Seconds and peak bytes of one import, after that of a small file of the same format.

    first_seconds: of the small file, which loads modules.
    """
    install(extension)
    first_seconds = seconds_of_import(small)
    open_empty()
    before = memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    seconds = seconds_of_import(model)
    triangles = sum(len(mesh.polygons) for mesh in bpy.data.meshes)
    peak = memory("VmHWM") - before
    return {
        "seconds": seconds,
        "peak_bytes": peak,
        "first_seconds": first_seconds,
        "triangles": triangles,
    }


def seconds_of_import(path: str) -> float:
    open_empty()
    start = time.perf_counter()
    bpy.ops.import_scene.gltf(filepath=path)
    return time.perf_counter() - start


def open_empty() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def memory(field: str) -> int:
    """Bytes of a field of /proc/self/status."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(f"{field}:"))


if __name__ == "__main__":
    result = {"prepare": prepare, "measure": measure}[sys.argv[1]](*json.loads(sys.argv[2]))
    sys.stdout.write("\n" + json.dumps(result) + "\n")
    sys.stdout.flush()
    os._exit(0)  # Blender's own clean-up takes seconds
