"""How much memory a job takes, estimated from the first bytes of its model."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

from gltf_ext.batches.storage import folder_of
from gltf_ext.document.container import CHUNK_HEADER, GLB_HEADER
from gltf_ext.options import Options
from gltf_ext.sources import ply, stl

# Measured for compress and verify: 201 to 238 bytes of a triangle of a single large primitive, 290
# to 423 with levels of detail, both with the file; less for many small primitives.
PER_TRIANGLE = 425
BASE = 64 << 20  # measured: 34 MB for the process, the rest for small models with textures
HEADER = 1 << 16  # bytes read for the header of a .ply
# Fewest bytes that a triangle takes in a text: an .obj without normals.
PER_TEXT_TRIANGLE = 30


def estimate(url: str, size: int, options: Mapping[str, Any]) -> int:
    """Return bytes that compressing and verifying a model takes.

    url: its path or URL; size: of the file in bytes; options: of compress.
    """
    try:
        triangles = _triangles(url, size)
    except Exception:  # a file that is gone, hostile or of a network: compress says what is wrong
        triangles = size // PER_TEXT_TRIANGLE
    full = BASE + 2 * size + PER_TRIANGLE * triangles
    limit = Options.of({"max_memory": options.get("max_memory")}).memory
    return min(full, BASE + limit) if limit else full


def _triangles(url: str, size: int) -> int:
    """At least about as many as the file holds. Raises what a damaged file makes it raise."""
    folder, name = folder_of(url)
    match name.rpartition(".")[2].lower():
        case "glb":
            head = folder.read(name, 0, GLB_HEADER.size + CHUNK_HEADER.size)
            length, _ = CHUNK_HEADER.unpack_from(head, GLB_HEADER.size)
            return _of_gltf(folder.read(name, len(head), len(head) + min(length, size)))
        case "gltf":
            return _of_gltf(folder.read(name))
        case "ply":
            header = ply.read_header(io.BytesIO(folder.read(name, 0, HEADER)))
            return min(size, header.rows_of("face"))
        case "stl":
            return size // stl.TRIANGLE.itemsize
    return size // PER_TEXT_TRIANGLE


def _of_gltf(text: bytes) -> int:
    """Of all primitives, from their accessors, which say it for compressed ones too."""
    root = json.loads(text)
    counts = [int(accessor["count"]) for accessor in root["accessors"]]
    primitives = [p for mesh in root["meshes"] for p in mesh["primitives"]]
    corner_accessors = {p.get("indices", p["attributes"].get("POSITION")) for p in primitives}
    return sum(counts[i] // 3 for i in corner_accessors - {None})
