"""The distinct primitives of a document, as jobs of compress with their bits and grids."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext._codec import GRID_MAX_BITS
from gltf_ext.attributes.choice import Choice, choose, choose_grid
from gltf_ext.attributes.details import Collapse
from gltf_ext.attributes.join import source_of
from gltf_ext.attributes.streams import SMALLEST_STEP, Grid, extent_of, position_grid
from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.draco import DRACO
from gltf_ext.document.looks import Looks
from gltf_ext.document.nodes import mesh_scales
from gltf_ext.encode.primitive import Compression
from gltf_ext.errors import MeshletError
from gltf_ext.options import MIN_POSITION_BITS, Options
from gltf_ext.sources.large import Larges
from gltf_ext.sources.primitives import EXTENSION, DropCounts, triangle_primitives
from gltf_ext.sources.repair import read_finite_bounds
from gltf_ext.sources.source import Box, Source

TOO_SMALL = "they are too small for 32-bit floats: scale the model up, and its node down"


@dataclass
class Job:
    """A distinct primitive to encode.

    Attributes:
        choice: the primitive, in memory or in its file, and its bits.
        users: the document's primitives that it stands for.
        drop_counts: counts of vertices and triangles left out.
        grid: of its positions; None if they are integers.
        reason_kept: why it is not compressed; empty if it is.
        collapse: its triangles that the grid collapses.
        result: what it became.
        has_one_numbering: whether all its attributes have the same numbers, as in memory.
        scale: the largest that nodes show it with.
        counts: of its vertices, triangles and corners, as in the document.
    """

    choice: Choice
    users: list[gltf.Primitive]
    drop_counts: DropCounts
    grid: Grid | None = None
    reason_kept: str = ""
    collapse: Collapse = field(default_factory=Collapse)
    result: Compression = field(default_factory=Compression)
    scale: float = 0.0

    def __post_init__(self) -> None:
        """Count before the source gives its rows back."""
        triangles = self.source.triangle_count + self.source.replaced["POSITION"]
        self.has_one_numbering = len(self.source.numberings) == 1
        self.counts = {self.source.vertex_count, triangles, 3 * triangles}

    @property
    def source(self) -> Source:
        """The primitive."""
        return self.choice.source

    @property
    def location(self) -> dict[str, int]:
        """For reports."""
        return {"mesh": self.source.mesh, "primitive": self.source.primitive}


Identity = tuple[Any, ...]  # equal for primitives with the same data


def jobs_of(document: Document, large: Larges, options: Options) -> list[Job]:
    """One job per distinct primitive (same indices, attributes and targets) and position grid."""
    sources: dict[Identity, tuple[Source, DropCounts]] = {}
    uses = []
    for mesh, index, primitive in triangle_primitives(document):
        identity = _identity(primitive)
        if identity not in sources and (mesh, index) in large:
            sources[identity] = large[mesh, index], DropCounts()
        elif identity not in sources:
            sources[identity] = _source(document, mesh, index, options.non_finite)
        uses.append((mesh if options.grid == "mesh" else None, primitive, identity))
    choices = _choices(document, sources, uses, options)
    scales = mesh_scales(document)
    grids = _grids([(key, choices[identity]) for key, _, identity in uses], scales, options)
    jobs: dict[tuple[Identity, Grid | None], Job] = {}
    for key, primitive, identity in uses:
        drop_counts = sources[identity][1]
        grid = grids.get(key)
        job = jobs.setdefault((identity, grid), Job(choices[identity], [], drop_counts, grid))
        job.users.append(primitive)
        job.scale = max(job.scale, _scale_of(key, scales))
    return list(jobs.values())


def _scale_of(key: int | None, scales: Mapping[int, float]) -> float:
    """Return the scale of a mesh in the scene, or without a key the largest one."""
    scale = max(scales.values(), default=1.0) if key is None else scales.get(key, 1.0)
    return scale or 1.0  # with 0 it shows nothing


def _choices(
    document: Document,
    sources: dict[Identity, tuple[Source, DropCounts]],
    uses: list[tuple[int | None, gltf.Primitive, Identity]],
    options: Options,
) -> dict[Identity, Choice]:
    """Choose the bits of each distinct primitive, by how all its users look."""
    looks = Looks(document)
    users: dict[Identity, list[gltf.Primitive]] = {}
    for _, primitive, identity in uses:
        users.setdefault(identity, []).append(primitive)
    result = {}
    for identity, (source, _) in sources.items():
        result[identity] = choose(source, looks.of(users[identity]), options)
    return result


def _grids(
    choices: list[tuple[int | None, Choice]], scales: Mapping[int, float], options: Options
) -> dict[int | None, Grid]:
    """Key -> the grid of all its primitives."""
    boxes = boxes_of([(key, each.source) for key, each in choices])
    by_key: dict[int | None, dict[int, Choice]] = {}
    for key, each in choices:
        by_key.setdefault(key, {})[id(each)] = each
    return {
        key: _grid(box, list(by_key[key].values()), _scale_of(key, scales), options)
        for key, box in boxes.items()
    }


def _identity(primitive: gltf.Primitive) -> Identity:
    compression = [repr(gltf.extension(primitive, name)) for name in (EXTENSION, DRACO)]
    names = (tuple(sorted(names.items())) for names in gltf.attribute_sets(primitive))
    return (gltf.mode(primitive), primitive.get("indices"), *compression, *names)


def _source(
    document: Document, mesh: int, index: int, non_finite: str
) -> tuple[Source, DropCounts]:
    source, drop_counts = source_of(document, mesh, index)
    if len(source.attributes) <= _codec.BLOB_MAX_STREAMS:  # else it stays uncompressed
        read_finite_bounds(source, non_finite)
    return source, drop_counts


def boxes_of(sources: list[tuple[int | None, Source]]) -> dict[int | None, Box]:
    """Key -> box of all its primitives that have triangles and float positions."""
    boxes: dict[int | None, Box] = {}
    for key, source in sources:
        if box := source.box:
            low, high = box
            old_box = boxes.get(key, (low, high))
            boxes[key] = np.minimum(low, old_box[0]), np.maximum(high, old_box[1])
    return boxes


def _grid(box: Box, choices: list[Choice], scale: float, options: Options) -> Grid:
    if options.chooses_positions:
        return choose_grid(choices, box)
    bits = options.position_bits if isinstance(options.position_bits, int) else GRID_MAX_BITS
    grid = position_grid(*box, bits, options.step, scale)
    if options.step is not None and _is_coarse(box, grid):
        extent = scale * extent_of(*box)
        raise MeshletError(
            f"step {options.step:g} leaves fewer than {MIN_POSITION_BITS} bits for positions "
            f"in a box of {extent:g}",
            f"use a step of at most {extent / 2 ** (MIN_POSITION_BITS - 1):.3g}",
        )
    return grid


def _is_coarse(box: Box, grid: Grid) -> bool:
    """Return whether a box that is not a point needs fewer than MIN_POSITION_BITS on the grid."""
    extent = extent_of(*box)
    return 0.0 < extent < (2.0 ** (MIN_POSITION_BITS - 1) - 0.5) * grid.step


def coarse_grids(jobs: list[Job]) -> list[str]:
    """Warnings for meshes that are small on the grid that they share."""
    boxes = boxes_of([(job.source.mesh, job.source) for job in jobs])
    grids: dict[int | None, Grid] = {
        job.source.mesh: job.grid for job in reversed(jobs) if job.grid
    }
    return [
        f"mesh {mesh}: fewer than {MIN_POSITION_BITS} bits are left for its positions; "
        + (TOO_SMALL if grids[mesh].step <= SMALLEST_STEP else "use --grid mesh or a smaller step")
        for mesh, box in boxes.items()
        if _is_coarse(box, grids[mesh])
    ]
