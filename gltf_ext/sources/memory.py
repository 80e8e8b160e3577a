"""How much of a model memory holds with --max-memory: vertices, triangles of a chunk, chunks."""

from __future__ import annotations

import os

from gltf_ext.errors import MeshletError
from gltf_ext.options import Options

# Bytes of memory for each triangle of a chunk, without and with levels of detail, and for all else.
CHUNK_BYTES, LOD_BYTES, BASE_BYTES = 220, 440, 80 << 20
VERTEX_FRACTION = 0.6  # of the memory but BASE_BYTES, for vertices while triangles are read
BLOCK_BYTES = 64 << 20  # of memory, for each block but one that is read and sorted at a time
SMALLEST_CHUNK = 1 << 16  # triangles; smaller ones are mostly borders
# Several chunks fit memory, so that threads have one each; larger ones give no smaller files.
LARGE_CHUNK, AT_ONCE = 1 << 20, 16
MAX_CHUNKS = 512  # each has an open file
UNEVEN = 1.5  # triangles of a chunk over those that it aims at, which memory is left for


def reading_limits(options: Options) -> tuple[int, int]:
    """Return (bytes of memory that vertices may take at a time, number of blocks at a time)."""
    free = options.memory - BASE_BYTES
    room = int(VERTEX_FRACTION * free)
    return room, min(options.threads or os.cpu_count() or 1, 1 + (free - room) // BLOCK_BYTES)


def chunk_size(options: Options, triangles: int) -> int:
    """Return the number of triangles of a chunk, of so many in all.

    Raises MeshletError if memory does not hold one of MAX_CHUNKS.
    """
    max_triangles = triangles_that_fit(options)
    if triangles > MAX_CHUNKS * max_triangles:
        raise _needs(options, -(-triangles // MAX_CHUNKS))
    return max(max_triangles // AT_ONCE, min(max_triangles, LARGE_CHUNK), triangles // MAX_CHUNKS)


def plan_chunk_memory(options: Options, triangles: int, largest: int = 0) -> tuple[int, int]:
    """Return (number of chunks that fit memory at a time, bytes that one takes with a process).

    largest: triangles of the largest one; up to UNEVEN times the size that chunks aim at is usual.
    """
    max_triangles, size = triangles_that_fit(options), chunk_size(options, triangles)
    if largest > UNEVEN * size:
        size = min(largest, max_triangles)
    return max_triangles // size, BASE_BYTES + (options.memory - BASE_BYTES) * size // max_triangles


def triangles_that_fit(options: Options) -> int:
    """Return the number of triangles that fit memory, see `check_memory`."""
    return (options.memory - BASE_BYTES) // _triangle_bytes(options)


def check_memory(options: Options) -> None:
    """Raise MeshletError for memory that too few triangles fit."""
    if triangles_that_fit(options) < SMALLEST_CHUNK:
        raise _needs(options, SMALLEST_CHUNK)


def _triangle_bytes(options: Options) -> int:
    return LOD_BYTES if options.lod else CHUNK_BYTES


def _needs(options: Options, triangles: int) -> MeshletError:
    """Return the error for less memory than a chunk of so many triangles takes."""
    needed_bytes = BASE_BYTES + triangles * _triangle_bytes(options)
    return too_little(f"max_memory is {options.max_memory}", needed_bytes)


def too_little(problem: str, needed_bytes: int) -> MeshletError:
    """Return the error for a max_memory of fewer bytes than are needed."""
    return MeshletError(problem, f"use at least {-(-needed_bytes >> 20)}M", options=("max_memory",))
