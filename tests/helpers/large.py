"""Large models, and the memory that commands take for them."""

import json
import resource
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from gltf_ext.encode import primitive as encoding
from gltf_ext.sources import file_arrays, large, memory
from tests.helpers.processes import running

SIZE = 128  # quads along a side of the sheet


def use_small_chunks(monkeypatch, most=8000):
    """Primitives of more than `most` triangles are large; half of these are a chunk, so that two
    are worked on at a time."""
    for module in (memory, file_arrays, large, encoding):
        monkeypatch.setattr(module, "triangles_that_fit", lambda options: most)
    monkeypatch.setattr(memory, "LARGE_CHUNK", most // 2)
    monkeypatch.setattr(memory, "SMALLEST_CHUNK", 1)


def sheet(size=SIZE):
    """(points, normals, triangles) of a closed wavy tube; vertices are in the order of a file."""
    u, v = np.meshgrid(np.arange(size), np.arange(size), indexing="ij")
    a, b = 2 * np.pi * u / size, 2 * np.pi * v / size
    radius = 1 + 0.1 * np.sin(7 * a + 3 * b) + 0.05 * np.cos(9 * b)
    points = np.stack(
        [(3 + radius * np.cos(b)) * np.cos(a), (3 + radius * np.cos(b)) * np.sin(a)], axis=2
    )
    points = np.concatenate([points, (radius * np.sin(b))[..., None]], axis=2).reshape(-1, 3)
    normals = points - 3 * np.stack([np.cos(a), np.sin(a), 0 * a], axis=2).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    w, x = (u + 1) % size, (v + 1) % size
    corners = [u * size + v, w * size + v, w * size + x, u * size + v, w * size + x, u * size + x]
    triangles = np.stack(corners, axis=2).reshape(-1, 3)
    return points.astype(np.float32), normals.astype(np.float32), triangles.astype(np.uint32)


def peak_of(*arguments):
    """Runs a command; returns the most bytes that its group of processes held."""
    command = [sys.executable, "-m", "gltf_meshlet", *map(str, arguments)]
    with running(command, stdout=subprocess.DEVNULL, start_new_session=True) as process:
        peak = 0
        while process.poll() is None:
            peak = max(peak, resident(process.pid))
            time.sleep(0.005)
    assert process.returncode == 0
    return peak


def resident(group):
    """Bytes that the processes of a group hold now."""
    total = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        total += int(fields[21]) * resource.getpagesize() if int(fields[2]) == group else 0
    return total


def moved_beyond_4_gib(source, folder):
    """A .glb as a .gltf in `folder` whose buffer views lie beyond 4 GiB of a .bin that is mostly a
    hole, which takes no space on the disk."""
    data = source.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    properties, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    begin = (1 << 32) + (1 << 20)
    for view in properties["bufferViews"]:
        view["byteOffset"] = begin + view.get("byteOffset", 0)
    properties["buffers"] = [{"uri": "beyond.bin", "byteLength": begin + len(binary)}]
    with open(folder / "beyond.bin", "wb") as file:
        file.seek(begin)
        file.write(binary)
    if (folder / "beyond.bin").stat().st_blocks * 512 > begin / 2:
        pytest.skip("the file system writes holes out")
    (folder / "beyond.gltf").write_text(json.dumps(properties))
    return folder / "beyond.gltf"
