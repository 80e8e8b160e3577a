"""Opens models for compress --max-memory: what does not fit memory stays in files."""

from __future__ import annotations

import os
from pathlib import Path

from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import Model, is_path, name_of
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.progress import progress_bar, shared_progress
from gltf_ext.sources.file_arrays import check_unchanged, large_primitives, stamp_of
from gltf_ext.sources.importers import (
    MESH_SUFFIXES,
    document_of,
    open_model,
    read_meshes,
    triangles_in_header,
)
from gltf_ext.sources.limits import check_triangle_count
from gltf_ext.sources.memory import (
    BASE_BYTES,
    check_memory,
    reading_limits,
    too_little,
    triangles_that_fit,
)
from gltf_ext.sources.mesh_files import MeshFile, MeshPrimitive
from gltf_ext.sources.ply_header import most_triangles
from gltf_ext.sources.repair import read_finite_bounds
from gltf_ext.sources.row_arrays import rows_in_files
from gltf_ext.sources.source import Source
from gltf_ext.work_files import check_space

# A triangle takes at least 18 bytes in an .obj, .ply or .stl, and 300 while it is encoded. Polygons
# of a binary .ply, and indices of less than four bytes, take less: they are counted.
MEMORY_OF_FILE, MEMORY_OF_TRIANGLE = 16, 300
# Of the triangles that memory holds while they are encoded: those of small primitives of such a
# file, which take a sixth of that before and meanwhile.
INDEXED_SHARE = 4
SPACE_OF_FILE = 1.5  # of arrays in work files
RESULT_BYTES = 2  # of a triangle, about: the result is mapped into memory at the end

Larges = dict[tuple[int, int], Source]  # by mesh and primitive


def open_source(model: Model, options: Options) -> tuple[Document, Larges]:
    """Read a document, and with max_memory its primitives that do not fit that.

    Raises MeshletError, OSError. Only files stay where they are: a GLTF2 is in memory.
    """
    if not options.memory:
        return _open_whole(model, options), {}
    check_memory(options)
    if not is_path(model):
        raise MeshletError(
            "max_memory is for files, not for a GLTF2", "save it first", options=("max_memory",)
        )
    path = Path(model)
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        document = open_model(path)
        _check_unread_fit(document, options)
        return document, _read_bounds(large_primitives(document, path, options), path, options)
    if _memory_of(path) < options.memory - BASE_BYTES:
        return _open_whole(path, options), {}
    contents = _copy(path, options)
    large = _large(contents, options)
    in_files = {id(primitive) for primitive in large.values()}
    sources = {
        numbers: _source(*numbers, primitive, options) for numbers, primitive in large.items()
    }
    document = document_of(
        path, contents, lambda p: p.sample() if id(p) in in_files else p.indexed()
    )
    return document, _read_bounds(sources, path, options)


def _memory_of(path: Path) -> int:
    """Return the memory that an .obj, .ply or .stl takes, about. Raises MeshletError, OSError."""
    triangles = most_triangles(path) if path.suffix.lower() == ".ply" else 0
    return max(MEMORY_OF_FILE * os.path.getsize(path), MEMORY_OF_TRIANGLE * triangles)


def _open_whole(model: Model, options: Options) -> Document:
    """Read a model into memory, which may take long for a text."""
    with progress_bar(f"reading {Path(name_of(model)).name}", options.progress) as advance:
        return open_model(model, options.obj_groups, advance)


def _copy(path: Path, options: Options) -> MeshFile:
    """Read an .obj, .ply or .stl into work files. Raises MeshletError, OSError.

    Checks before what can be known before: the triangles that a header counts, the space on disk.
    """
    folder = str(options.work_dir)
    _check_result_fits(triangles_in_header(path), options)
    check_space(folder, int(SPACE_OF_FILE * os.path.getsize(path)))
    stamp = stamp_of(path)
    try:
        with progress_bar(f"copying {path.name}", options.progress) as advance:
            return read_meshes(path, rows_in_files(folder), options.obj_groups, advance)
    finally:
        check_unchanged(path, stamp)


def _large(contents: MeshFile, options: Options) -> dict[tuple[int, int], MeshPrimitive]:
    """Choose the primitives that stay in files: all but the smallest, which memory holds."""
    limit, total = triangles_that_fit(options) // INDEXED_SHARE, 0
    large = {}
    for m, p, primitive in sorted(
        contents.numbered_primitives(), key=lambda row: row[2].triangle_count
    ):
        total += max(primitive.triangle_count, *(r.count for r in primitive.attributes.values()))
        if total > limit:
            large[m, p] = primitive
    return dict(sorted(large.items()))


def _source(mesh: int, index: int, primitive: MeshPrimitive, options: Options) -> Source:
    attributes = dict(primitive.attributes)
    numberings = list(primitive.numberings)
    return Source(mesh, index, attributes, numberings, *reading_limits(options), is_copy=True)


def _read_bounds(sources: Larges, path: Path, options: Options) -> Larges:
    """Read the bounds of all. Raises MeshletError, also for too many triangles."""
    counts = [primitive.triangle_count for primitive in sources.values()]
    for primitive, count in zip(sources.values(), counts):
        check_triangle_count(count, primitive.where)
    _check_result_fits(sum(counts), options)
    with progress_bar(f"reading {path.name}", options.progress) as advance:
        moves = shared_progress(advance, [count / sum(counts) for count in counts])
        for primitive, move in zip(sources.values(), moves):
            read_finite_bounds(primitive, options.non_finite, move)
    return sources


def _check_unread_fit(document: Document, options: Options) -> None:
    """Raise MeshletError when memory does not hold what is decoded as it is read."""
    needed_bytes = BASE_BYTES + document.unread_bytes
    if document.unread_bytes and options.memory < needed_bytes:
        problem = f"its data that meshopt compressed take {document.unread_bytes:,} bytes"
        raise too_little(problem, needed_bytes)


def _check_result_fits(triangles: int, options: Options) -> None:
    """Raise MeshletError when memory does not hold the result of so many triangles."""
    needed_bytes = BASE_BYTES + RESULT_BYTES * triangles
    if options.memory < needed_bytes:
        raise too_little(
            f"max_memory is {options.max_memory}, less than the result of {triangles:,} "
            "triangles takes",
            needed_bytes,
        )
