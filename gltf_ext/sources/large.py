"""Opens models for compress --max-memory: what does not fit memory stays in files."""

from __future__ import annotations

import os
import shutil
from functools import partial
from pathlib import Path

from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.progress import progress_bar, shared_progress
from gltf_ext.sources.file_arrays import check_unchanged, large_primitives, stamp_of
from gltf_ext.sources.importers import MESH_SUFFIXES, document_of, open_model, read_meshes
from gltf_ext.sources.memory import BASE_BYTES, fitting, reading
from gltf_ext.sources.mesh_files import Mesh
from gltf_ext.sources.row_arrays import FileRows
from gltf_ext.sources.source import Rows, Source
from gltf_ext.work_files import WorkFile

# A triangle takes at least 18 bytes in an .obj, .ply or .stl, and 300 while it is encoded.
MEMORY_OF_FILE = 16
SPACE_OF_FILE = 1.5  # of arrays in work files
RESULT_BYTES = 2  # of a triangle, about: the result is mapped into memory at the end
MAX_TRIANGLES = (1 << 32) // 3  # of a primitive: decoders number corners with 32 bits

Larges = dict[tuple[int, int], Source]  # by mesh and primitive


def open_large(path: Path, options: Options) -> tuple[Document, Larges]:
    """Read a document, and its primitives that do not fit memory. Raises MeshletError, OSError."""
    fitting(options)  # check
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        document = open_model(path)
        return document, _read_bounds(large_primitives(document, path, options), path, options)
    size = os.path.getsize(path)
    if MEMORY_OF_FILE * size < options.memory - BASE_BYTES:
        return open_model(path), {}
    folder = str(options.work_dir)
    if shutil.disk_usage(folder).free < SPACE_OF_FILE * size:
        raise MeshletError(
            f"work files need {SPACE_OF_FILE * size:,.0f} bytes",
            "free some space or use another work_dir",
            path=folder,
            options=("work_dir",),
        )
    stamp = stamp_of(path)
    try:
        contents = read_meshes(path, partial(FileRows, WorkFile(folder)))
    finally:
        check_unchanged(path, stamp)
    document = document_of(path, contents, [mesh.sample() for mesh in contents.meshes])
    large = {(m, 0): _large(m, mesh, options) for m, mesh in enumerate(contents.meshes)}
    return document, _read_bounds(large, path, options)


def _large(number: int, mesh: Mesh, options: Options) -> Source:
    attributes: dict[str, Rows] = dict(mesh.attributes)
    return Source(number, 0, attributes, list(mesh.groups), *reading(options))


def _read_bounds(sources: Larges, path: Path, options: Options) -> Larges:
    """Read the bounds of all. Raises MeshletError, also for too many triangles."""
    counts = [primitive.triangle_count for primitive in sources.values()]
    for primitive, count in zip(sources.values(), counts):
        if count > MAX_TRIANGLES:
            raise MeshletError(
                f"{primitive.where} has {count:,} triangles, more than {MAX_TRIANGLES:,}",
                "split the primitive",
            )
    needed_bytes = BASE_BYTES + RESULT_BYTES * sum(counts)
    if options.memory < needed_bytes:
        raise MeshletError(
            f"max_memory is {options.max_memory}, less than the result of {sum(counts):,} "
            "triangles takes",
            f"use at least {-(-needed_bytes >> 20)}M",
            options=("max_memory",),
        )
    with progress_bar(f"reading {path.name}", options.progress) as advance:
        moves = shared_progress(advance, [count / sum(counts) for count in counts])
        for primitive, move in zip(sources.values(), moves):
            primitive.read_bounds(move)
    return sources
