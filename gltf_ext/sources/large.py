"""Opens models for compress --max-memory: what does not fit memory stays in files."""

from __future__ import annotations

import os
import shutil
from functools import partial
from pathlib import Path

from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, is_path
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.progress import progress_bar, shared_progress
from gltf_ext.sources.file_arrays import check_unchanged, large_primitives, stamp_of
from gltf_ext.sources.importers import MESH_SUFFIXES, document_of, open_model, read_meshes
from gltf_ext.sources.memory import BASE_BYTES, fitting, reading
from gltf_ext.sources.mesh_files import MeshFile, MeshPrimitive
from gltf_ext.sources.repair import read_finite_bounds
from gltf_ext.sources.row_arrays import FileRows
from gltf_ext.sources.source import Source
from gltf_ext.work_files import WorkFile

# A triangle takes at least 18 bytes in an .obj, .ply or .stl, and 300 while it is encoded.
MEMORY_OF_FILE = 16
# Of the triangles that memory holds while they are encoded: those of small primitives of such a
# file, which take a sixth of that before and meanwhile.
INDEXED_SHARE = 4
SPACE_OF_FILE = 1.5  # of arrays in work files
RESULT_BYTES = 2  # of a triangle, about: the result is mapped into memory at the end
MAX_TRIANGLES = (1 << 32) // 3  # of a primitive: decoders number corners with 32 bits

Larges = dict[tuple[int, int], Source]  # by mesh and primitive


def open_large(model: Model, options: Options) -> tuple[Document, Larges]:
    """Read a document, and its primitives that do not fit memory. Raises MeshletError, OSError.

    Only files stay where they are: a GLTF2 is in memory.
    """
    fitting(options)  # check
    if not is_path(model):
        raise MeshletError(
            "max_memory is for files, not for a GLTF2", "save it first", options=("max_memory",)
        )
    path = Path(model)
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        document = open_model(path)
        return document, _read_bounds(large_primitives(document, path, options), path, options)
    size = os.path.getsize(path)
    if MEMORY_OF_FILE * size < options.memory - BASE_BYTES:
        return open_model(path, options.obj_groups), {}
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
        contents = read_meshes(path, partial(FileRows, WorkFile(folder)), options.obj_groups)
    finally:
        check_unchanged(path, stamp)
    large = _large(contents, options)
    in_files = {id(primitive) for primitive in large.values()}
    sources = {place: _source(*place, primitive, options) for place, primitive in large.items()}
    document = document_of(
        path, contents, lambda p: p.sample() if id(p) in in_files else p.indexed()
    )
    return document, _read_bounds(sources, path, options)


def _large(contents: MeshFile, options: Options) -> dict[tuple[int, int], MeshPrimitive]:
    """Choose the primitives that stay in files: all but the smallest, which memory holds."""
    limit, total = fitting(options) // INDEXED_SHARE, 0
    large = {}
    for m, p, primitive in sorted(contents.places(), key=lambda place: place[2].triangle_count):
        total += max(primitive.triangle_count, *(r.count for r in primitive.attributes.values()))
        if total > limit:
            large[m, p] = primitive
    return dict(sorted(large.items()))


def _source(mesh: int, index: int, primitive: MeshPrimitive, options: Options) -> Source:
    attributes = dict(primitive.attributes)
    return Source(mesh, index, attributes, list(primitive.groups), *reading(options))


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
            read_finite_bounds(primitive, options.non_finite, move)
    return sources
