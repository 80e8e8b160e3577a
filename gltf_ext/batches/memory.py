"""How much memory a job takes, estimated from the first bytes of its model."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Mapping
from typing import Any

from gltf_ext.batches.storage import Folder
from gltf_ext.errors import MeshletError
from gltf_ext.gltf import ply, stl
from gltf_ext.gltf.container import CHUNK_HEADER, GLB_HEADER

# Measured for compress and verify: 201 to 238 bytes of a triangle of a single large primitive, 290
# to 423 with levels of detail, both with the file; less for many small primitives.
PER_TRIANGLE = 425
BASE = 64 << 20  # measured: 34 MB for the process, the rest for small models with textures
HEADER = 1 << 16  # bytes read for the header of a .ply
# Fewest bytes that a triangle takes in a text: an .obj without normals.
PER_TEXT_TRIANGLE = 30


def estimate(folder: Folder, name: str, info: Mapping[str, Any]) -> int:
    """Bytes that compressing and verifying a model takes. Raises OSError."""
    size = int(info.get("size") or 0)
    return BASE + 2 * size + PER_TRIANGLE * _triangles(folder, name, size)


def _triangles(folder: Folder, name: str, size: int) -> int:
    """At least about as many as the file holds; from its size where its header is damaged."""
    suffix = name.rpartition(".")[2].lower()
    path = folder.at(name)
    try:
        if suffix == "glb":
            head = folder.fs.cat_file(path, start=0, end=GLB_HEADER.size + CHUNK_HEADER.size)
            length, _ = CHUNK_HEADER.unpack_from(head, GLB_HEADER.size)
            start = len(head)
            return _of_gltf(folder.fs.cat_file(path, start=start, end=start + min(length, size)))
        if suffix == "gltf":
            return _of_gltf(folder.fs.cat_file(path))
        if suffix == "ply":
            header = ply.read_header(io.BytesIO(folder.fs.cat_file(path, start=0, end=HEADER)))
            return min(size, sum(e.rows for e in header.elements if e.name == "face"))
        if suffix == "stl":
            return size // stl.TRIANGLE.itemsize
    except (MeshletError, struct.error, ValueError, LookupError, TypeError, AttributeError):
        pass  # compress says what is wrong
    return size // PER_TEXT_TRIANGLE


def _of_gltf(text: bytes) -> int:
    """Of all primitives, from their accessors, which say it for compressed ones too."""
    root = json.loads(text)
    counts = [int(accessor["count"]) for accessor in root["accessors"]]
    primitives = [p for mesh in root["meshes"] for p in mesh["primitives"]]
    used = {p.get("indices", p["attributes"]["POSITION"]) for p in primitives}
    return sum(counts[i] // 3 for i in used)
