"""Blobs near 2^29 bytes, whose bit positions nearly have 33 bits, and packed pages near 2^32."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from gltf_ext import _codec
from tests.helpers.environment import ROOT, VECTORS
from tests.helpers.long_blobs import CODES, MAX_BYTES

TOO_LONG = "the blob is longer than 448 MiB"
SMALL = "valid_worked_example.bin"

# Each in a process of its own: a read behind a blob would end it. Prints what readers say.
SCRIPT = """
import ctypes, json, sys
from gltf_ext import _codec
from gltf_ext._library import functions
from tests.helpers import long_blobs
from tests.helpers.environment import VECTORS

def answer(read, *arguments):
    try:
        return read(*arguments)
    except ValueError as error:
        return str(error)

def decoded(read, view):
    triangles, streams = read(view, 1)
    return [triangles.tolist(), [stream.tolist() for stream in streams]]

def first_meshlet(view):
    local, streams = _codec.Decoder(view).decode_meshlet(0)
    return [local.tolist(), [stream.tolist() for stream in streams]]

def answers(view):
    return [
        answer(_codec.validate, view, 1),
        answer(decoded, _codec.decode, view),
        answer(decoded, _codec.decode_values, view),
        answer(first_meshlet, view),
        answer(_codec.split, view),
    ]

def unpack_answers(view):
    size, out = ctypes.c_size_t(), ctypes.c_uint8()
    packed = view.address, len(view.bytes)
    return [
        answer(functions.get_unpacked_bytes, *packed, ctypes.byref(size)),
        answer(functions.unpack, *packed, 1, ctypes.addressof(out), 1),
    ]

kind, *arguments = json.loads(sys.argv[1])
if kind == "stretched":
    small = (VECTORS / arguments[0]).read_bytes()
    print(json.dumps(answers(long_blobs.stretched(small, arguments[1]).bytes)))
elif kind == "wrapping":
    print(json.dumps(answers(long_blobs.wrapping(*arguments).bytes)))
else:
    print(json.dumps(unpack_answers(long_blobs.packed_page(*arguments))))
"""


def answers(*case: Any) -> list[Any]:
    command = [sys.executable, "-c", SCRIPT, json.dumps(case)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"status {done.returncode}\n{done.stderr}"
    return json.loads(done.stdout)


def test_longest_blob_decodes():
    triangles, streams = _codec.decode((VECTORS / SMALL).read_bytes())
    valid, decoded, _, (local, _), blobs = answers("stretched", SMALL, MAX_BYTES)
    assert valid is None
    assert decoded == [triangles.tolist(), [stream.tolist() for stream in streams]]
    assert len(local) > 0 and blobs == [[0, MAX_BYTES]]


@pytest.mark.parametrize("size", [MAX_BYTES + 4, (1 << 29) - 4, 1 << 29])
def test_longer_blob_is_refused(size):
    assert answers("stretched", SMALL, size) == [TOO_LONG] * 5


@pytest.mark.parametrize("code", CODES)
def test_positions_that_would_wrap_are_refused(code):
    assert answers("wrapping", code) == [TOO_LONG] * 5


@pytest.mark.parametrize(
    "resident, packed",
    [
        pytest.param(MAX_BYTES + 4, 0, id="raw"),
        pytest.param(MAX_BYTES + 4, 2 << 20, id="resident"),
        pytest.param(80, MAX_BYTES + 4, id="packed"),
        pytest.param(80, (1 << 32) - 8, id="packed-2^32"),  # with the padding for reads
    ],
)
def test_packed_page_of_impossible_length(resident, packed):
    assert answers("packed", resident, packed) == ["page 0 has an impossible length"] * 2


def test_vertices_of_many_meshlets_are_counted():
    """Meshlets have 64 vertices each at most: 2^32 together. The fourth meshlet is malformed."""
    meshlets, bits = 1 << 26, [0] * 6 + [1] * 3 + [0] * 7
    tables = 32 + 28 + 12 * (meshlets // 32)
    size = tables + 2 * meshlets + 8
    group = np.zeros((meshlets // 32, 3), "<u4")
    group[:, 0] = tables + 64 * np.arange(len(group))
    group[:, 1] = 2  # bytes from a meshlet to the next
    blob = np.zeros(size, np.uint8)
    header = 0x314D4245, 2 | 1 << 8, meshlets, 3 * meshlets, meshlets, size, tables, 0
    bases = 0, 31, 0, 0
    row = struct.pack("<8B5f", _codec.KIND_INTEGER, 1, 1, _codec.PREDICT_COPY, *bases, *[0.0] * 5)
    head = struct.pack("<8I", *header) + row
    blob[: len(head)] = np.frombuffer(head, np.uint8)
    blob[len(head) : tables] = group.view(np.uint8).ravel()
    data = blob[tables:-8].reshape(-1, 2)
    data[:] = np.packbits(bits, bitorder="little")  # a triangle, residuals without bits
    data[3] = 1 << 6, 0  # a Rice parameter of 31 + 1
    with pytest.raises(ValueError, match=r"^meshlet 3: a code's parameter is above 31"):
        _codec.decode(blob.data, 1)
