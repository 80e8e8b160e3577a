"""Hostile blobs: counts and widths of headers do not make the decoder take memory."""

from __future__ import annotations

import struct
import subprocess
import sys

import numpy as np
import pytest

from gltf_ext import _codec

MESHLETS = 1 << 22
STREAM_ROW = struct.pack(
    "<8B5f", _codec.KIND_GRID, 3, 1, _codec.PREDICT_COPY, *[0] * 4, 1, *[0] * 4
)
ALLOWED = 64 << 20, 40  # bytes, and bytes for each byte of the file

SCRIPT = """
import resource, sys
import numpy  # before memory is limited
from pathlib import Path
from gltf_ext import _codec
blob, allowed = Path(sys.argv[1]).read_bytes(), int(sys.argv[2])
status = Path("/proc/self/status").read_text()
taken = int(status.split("VmSize:")[1].split()[0]) * 1024
resource.setrlimit(resource.RLIMIT_AS, (taken + allowed, resource.RLIM_INFINITY))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
def many(blob, threads):
    opened = _codec.Decoder(blob)
    opened.decode_meshlet(opened.meshlet_count - 1)
    _codec.describe(blob)
    raise ValueError
for read in (_codec.decode, _codec.decode_values, _codec.validate, many):
    try:
        read(blob, 1)
    except ValueError:
        continue
    sys.exit(f"{read} accepts the blob")
print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""


def hostile(delta_width: int, first: bytes, vertices: int) -> bytes:
    """Meshlets of one byte each, which run into those behind them."""
    groups = MESHLETS // 32
    begin = 32 + len(STREAM_ROW) + 12 * groups
    table = np.zeros((groups, 3), "<u4")
    table[:, 0] = begin + 32 * np.arange(groups)
    table[:, 1] = 1  # byte from a meshlet to the next
    table[:, 2] = delta_width << 5
    data = first * MESHLETS
    triangles = MESHLETS * ((first[0] & 63) + 1)
    size = -(-(begin + len(data) + 8) // 4) * 4
    header = struct.pack(
        "<4sI6I", b"EBM1", 2 | 1 << 8, triangles, vertices, MESHLETS, size, begin, 0
    )
    return (header + STREAM_ROW + table.tobytes() + data).ljust(size, b"\0")


@pytest.mark.parametrize(
    "delta_width, first, vertices",
    [
        pytest.param(24, b"\0", 3, id="history"),  # meshlets of a triangle, far references
        pytest.param(24, b"\0", 3 * MESHLETS, id="vertices"),
        pytest.param(0, b"\xff", 64 * MESHLETS, id="triangles"),  # meshlets of 64 triangles
    ],
)
def test_a_header_takes_no_memory(delta_width, first, vertices, tmp_path):
    blob = hostile(delta_width, first, vertices)
    (tmp_path / "blob").write_bytes(blob)
    allowed = ALLOWED[0] + ALLOWED[1] * len(blob)
    command = [sys.executable, "-c", SCRIPT, tmp_path / "blob", allowed]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) <= allowed


def test_many_small_meshlets_with_far_references():
    """More meshlets than the decoder expects for this size, in random order."""
    columns, rows = 101, 81
    y, x = np.divmod(np.arange(columns * rows, dtype=np.uint32), columns)
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = (
        np.stack([a, a + 1, a + columns, a + 1, a + columns + 1, a + columns], axis=1)
        .reshape(-1, 3)
        .astype(np.uint32)
    )
    values = np.stack([x, y, x * y % 7], axis=1).astype(np.uint32)
    stream = _codec.Stream(_codec.KIND_GRID, 3, 8, 1.0)
    count = len(triangles)
    begins = np.arange(count + 1, dtype=np.uint32)
    order = np.random.default_rng(1).permutation(count).astype(np.uint32)
    view, _ = _codec.encode(
        triangles,
        np.arange(len(values), dtype=np.uint32),
        values.astype(np.float32),
        [stream],
        [values],
        meshlets=(order, begins, begins, np.array([0, count], np.uint32)),
    )
    assert count > 4096 and len(view) < 64 * count
    _codec.validate(view)
    decoded, (found,) = _codec.decode(view)
    keys = [
        np.sort((v @ [1, 1 << 8, 1 << 16])[t], axis=1)
        for v, t in ((values, triangles), (found, decoded))
    ]
    np.testing.assert_array_equal(*(np.unique(k, axis=0) for k in keys))
    decoder = _codec.Decoder(view)
    for m in range(0, count, 97):
        local, (integers,) = decoder.decode_meshlet(m)
        np.testing.assert_array_equal(found[decoded[m]], integers[local[0]])
