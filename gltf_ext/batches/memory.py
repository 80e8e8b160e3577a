"""How much memory a job takes, estimated from the first bytes of its model."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

from gltf_ext.batches.storage import folder_of
from gltf_ext.document import gltf
from gltf_ext.document.container import CHUNK_HEADER, GLB_HEADER
from gltf_ext.options import Options
from gltf_ext.sources import stl
from gltf_ext.sources.ply_header import read_header

# Measured for compress and verify (bench/batch_memory.py): up to 240 bytes of a triangle of a large
# primitive, 290 to 423 with levels of detail, both with the file; less for many primitives.
PER_TRIANGLE, PER_TRIANGLE_LOD = 250, 425
BASE = 128 << 20  # measured: 85 MB for the process of a worker, the rest for small models
HEADER = 1 << 16  # bytes read for the header of a .ply
# Fewest bytes that a triangle takes in a text: an .obj without normals.
PER_TEXT_TRIANGLE = 30


def estimate(url: str, size: int, options: Mapping[str, Any]) -> int:
    """Return bytes that compressing and verifying a model takes.

    url: its path or URL; size: of the file in bytes; options: of compress.
    """
    try:
        triangles, more = _content(url, size)
    except Exception:  # a file that is gone, hostile or of a network: compress says what is wrong
        triangles, more = size // PER_TEXT_TRIANGLE, 0
    per_triangle = PER_TRIANGLE_LOD if options.get("lod") else PER_TRIANGLE
    full = BASE + 2 * (size + more) + per_triangle * triangles
    limit = Options.of({"max_memory": options.get("max_memory")}).memory
    return min(full, BASE + limit) if limit else full


def _content(url: str, size: int) -> tuple[int, int]:
    """Return (at least about as many triangles as the file holds, bytes of the buffers beside it).

    Raises what a damaged file makes it raise.
    """
    folder, name = folder_of(url)
    match name.rpartition(".")[2].lower():
        case "glb":
            head = folder.read(name, 0, GLB_HEADER.size + CHUNK_HEADER.size)
            length, _ = CHUNK_HEADER.unpack_from(head, GLB_HEADER.size)
            return _of_gltf(folder.read(name, len(head), len(head) + min(length, size)))
        case "gltf":
            return _of_gltf(folder.read(name))
        case "ply":
            header = read_header(io.BytesIO(folder.read(name, 0, HEADER)))
            return min(size, header.rows_of("face")), 0
        case "stl":
            return size // stl.TRIANGLE.itemsize, 0
    return size // PER_TEXT_TRIANGLE, 0


def _of_gltf(text: bytes) -> tuple[int, int]:
    """Return the same, from the accessors, which say it for compressed primitives too."""
    root = json.loads(text)
    counts = [int(accessor["count"]) for accessor in root["accessors"]]
    primitives = [p for mesh in root["meshes"] for p in mesh["primitives"]]
    corners = {
        p.get("indices", p["attributes"].get("POSITION")): p.get("mode", gltf.TRIANGLES)
        for p in primitives
    }
    corners.pop(None, None)
    triangles = sum(
        counts[i] // (3 if mode == gltf.TRIANGLES else 1) for i, mode in corners.items()
    )
    others = [b for b in root.get("buffers", ()) if not b.get("uri", "data:").startswith("data:")]
    return triangles, sum(int(buffer["byteLength"]) for buffer in others)
