"""compress: any model -> .glb with EXT_meshlet_edgebreaker."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pygltflib

from gltf_ext import _codec
from gltf_ext.compression.extension import EXTENSION, read_compressed
from gltf_ext.compression.inspection import inspect_document
from gltf_ext.compression.primitives import (
    Dropped,
    Primitive,
    check_finite,
    position_ids,
    read_primitive,
    store_primitive,
    triangle_primitives,
    weld,
)
from gltf_ext.compression.streams import (
    MAX_STREAMS,
    Bits,
    Grid,
    Plan,
    dequantise,
    plan_primitive,
    position_grid,
)
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import bounds, described_by, index_accessor, set_bounds
from gltf_ext.gltf.buffer_layout import pack, unknown_index_holders
from gltf_ext.gltf.document import (
    Document,
    check_output,
    copied,
    glb_parts,
    named_indices,
    refuse_overwriting,
    write_files,
)
from gltf_ext.gltf.draco import DRACO
from gltf_ext.gltf.images import embed_images
from gltf_ext.gltf.importers import open_model
from gltf_ext.progress import progress_bar

LOSSY_BEFORE = (EXTENSION, DRACO, "KHR_mesh_quantization")
LARGEST_NUMBER = 1e9
MIN_POSITION_BITS, DEFAULT_POSITION_BITS = 4, 12
# Extensions of a primitive that describe the order of its triangles or vertices, which compression changes.
ORDER_DEPENDENT = (
    "FB_ngon_encoding",
    "CESIUM_primitive_outline",
    "EXT_mesh_manifold",
    "EXT_mesh_polygon",
)


@dataclass(frozen=True)
class Options:
    """Options of `compress`; see there."""

    position_bits: int | None = None
    normal_bits: int = 8
    texcoord_bits: int = 12
    color_bits: int = 8
    weight_bits: int = 8
    step: float | None = None
    grid: str = "mesh"
    max_triangles: int = 64
    lambda_: float | None = None
    iterations: int | None = None
    fill: float | None = None
    weight: str = "paper"
    fallback: bool = False
    threads: int = 0
    progress: bool = False

    def __post_init__(self) -> None:
        if self.step is not None and self.position_bits is not None:
            raise MeshletError(
                "step and position_bits both set the position step",
                "give one",
                options=("step", "position_bits"),
            )
        if self.position_bits is None:
            object.__setattr__(self, "position_bits", DEFAULT_POSITION_BITS)
        for name, low, high in (
            ("position_bits", MIN_POSITION_BITS, 24),
            ("normal_bits", 4, 16),
            ("texcoord_bits", 4, 16),
            ("color_bits", 4, 16),
            ("weight_bits", 4, 16),
            ("max_triangles", 16, 64),
            ("threads", 0, 1024),
        ):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or not low <= value <= high:
                raise MeshletError(f"{name} is {value!r}", f"use {low} to {high}", options=(name,))
        for name, choices in (("grid", ("mesh", "scene")), ("weight", ("paper", "choe"))):
            if getattr(self, name) not in choices:
                raise MeshletError(
                    f"{name} is {getattr(self, name)!r}",
                    f"use {' or '.join(choices)}",
                    options=(name,),
                )
        if self.fill is not None and not (_is_number(self.fill) and 0.25 <= self.fill <= 1.0):
            raise MeshletError(f"fill is {self.fill!r}", "use 0.25 to 1", options=("fill",))
        for name in ("step", "lambda_", "iterations"):
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and 0 < value <= LARGEST_NUMBER):
                raise MeshletError(
                    f"{name} is {value!r}",
                    f"use a number above 0 and up to {LARGEST_NUMBER:g}",
                    options=(name,),
                )

    @property
    def bits(self) -> Bits:
        return Bits(
            self.position_bits,
            self.normal_bits,
            self.texcoord_bits,
            self.color_bits,
            self.weight_bits,
        )

    @property
    def encoder(self) -> dict[str, Any]:
        """Keyword arguments of _codec.encode."""
        given = {"lambda_": self.lambda_, "iterations": self.iterations, "fill": self.fill}
        return {
            "max_triangles": self.max_triangles,
            "weight": self.weight,
            "threads": self.threads,
            **{name: value for name, value in given.items() if value is not None},
        }


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating))


def _checked(options: dict[str, Any]) -> Options:
    unknown = sorted(set(options) - {option.name for option in fields(Options)})
    if unknown:
        raise MeshletError(
            f"{unknown[0]} is not an option of compress", "see help(gltf_ext.compress)"
        )
    return Options(**options)


@dataclass
class Job:
    """A distinct primitive to encode and the document's primitives that it stands for."""

    source: Primitive
    users: list[pygltflib.Primitive]
    dropped: Dropped
    grid: Grid | None = None
    reason_kept: str = ""
    generation: dict = field(default_factory=dict)


def compress(input: str | os.PathLike, output: str | os.PathLike, **options: Any) -> dict[str, Any]:
    """Compress a .glb, .gltf, .obj, .ply or .stl file into a .glb with EXT_meshlet_edgebreaker.

    Options: position_bits (4 to 24), normal_bits, texcoord_bits, color_bits, weight_bits (4 to 16): bits per
    component (position_bits 12, unless a step is given); step: position step in model units; grid: "mesh" or "scene", what shares one
    position grid; max_triangles (16 to 64) per meshlet; lambda_, iterations, fill, weight ("paper" or "choe"): meshlet
    generation; fallback: also write plain buffers (into OUTPUT's name with .fallback.bin) for readers without the
    extension; threads: 0 for one per processor, the result is the same; progress: draw a bar on a terminal.

    Returns a report: input, output, input_bytes, output_bytes, fallback_bytes, totals, fallback_files and primitives as `inspect` has them,
    generation (summed histogram of regions by triangles before halving, largest number of iterations),
    dropped (counts of what is not in the result), kept (primitives left as they were, with the reason), warnings.
    Raises MeshletError when the input cannot be compressed, OSError when a file cannot be read or written.
    """
    settings, output = _checked(options), Path(output)
    check_output(output, input)
    fallback_path = output.with_name(output.stem + ".fallback.bin")
    try:
        document = open_model(input)
        read = [Path(input), *document.files()]
        report = _compress_document(document, settings, Path(input).name)
        binary, fallback = pack(document)
        if fallback:
            document.buffers[1].uri = quote(os.fsencode(fallback_path.name))
        report = {**inspect_document(document), **report}
        parts = glb_parts(document, binary)
    except MeshletError as error:
        error.path = error.path or str(input)
        raise
    input_bytes = os.path.getsize(input)
    contents = {fallback_path: fallback, output: parts} if fallback else {output: parts}
    refuse_overwriting(read, list(contents))
    write_files(contents)
    output_bytes = sum(map(len, parts))
    if output_bytes >= input_bytes:
        report["warnings"].append("the file grew; the original is smaller")
    if not fallback and fallback_path.exists():
        report["warnings"].append(
            f"{fallback_path.name} is not part of this result; delete it if nothing needs it"
        )
    return {
        "input": str(input),
        "output": str(output),
        "input_bytes": input_bytes,
        "output_bytes": output_bytes,
        "fallback_bytes": sum(map(len, fallback)),
        **report,
    }


def _compress_document(document: Document, options: Options, title: str) -> dict[str, Any]:
    warnings = [*document.import_warnings, *_lossy_before(document)]
    jobs = _jobs(document, options)
    if not jobs:
        raise MeshletError("holds no triangles", "there is nothing to compress")
    with progress_bar(title, options.progress) as advance:
        done, total = 0.0, sum(len(job.source.indices) for job in jobs)
        for job in jobs:
            share = len(job.source.indices) / max(total, 1)
            _encode_job(
                document,
                job,
                options,
                advance and (lambda f, base=done, share=share: advance(base + share * f)),
            )
            done += share
    warnings += _coarse_grids(jobs)
    encoded = [job for job in jobs if not job.reason_kept]
    if not encoded:
        raise MeshletError(
            f"none of its triangle primitives can be compressed ({jobs[0].reason_kept})",
            "there is nothing to compress",
        )
    document.forget_extension(EXTENSION)
    document.use_extension(EXTENSION, required=not options.fallback)
    warnings += embed_images(document) + _settle_extensions(document, encoded)
    dropped = Dropped()
    for job in jobs:
        dropped.add(job.dropped)
    kept = [
        {"mesh": j.source.mesh, "primitive": j.source.primitive, "reason": j.reason_kept}
        for j in jobs
        if j.reason_kept
    ]
    return {
        "generation": _generation(encoded),
        "dropped": vars(dropped),
        "kept": kept,
        "warnings": warnings,
    }


def _lossy_before(document: Document) -> list[str]:
    found = [name for name in LOSSY_BEFORE if name in document.extensionsUsed]
    return (
        [
            f"the input is already quantised ({', '.join(found)}): errors add up; compress the original if there is one"
        ]
        if found
        else []
    )


# --- collecting ---


def _jobs(document: Document, options: Options) -> list[Job]:
    """One job per distinct primitive (same indices, attributes and targets) and position grid."""
    sources: dict[tuple, tuple[Primitive, Dropped]] = {}
    places = []
    for mesh, index, primitive in triangle_primitives(document):
        identity = _identity(primitive)
        if identity not in sources:
            sources[identity] = _source(document, mesh, index)
        places.append((mesh if options.grid == "mesh" else None, primitive, identity))
    grids = _grids([(group, sources[identity][0]) for group, _, identity in places], options)
    jobs: dict[tuple, Job] = {}
    for group, primitive, identity in places:
        source, dropped = sources[identity]
        job = jobs.setdefault(
            (identity, grids.get(group)), Job(source, [], dropped, grids.get(group))
        )
        job.users.append(primitive)
    return list(jobs.values())


def _identity(primitive: pygltflib.Primitive) -> tuple:
    """Equal for primitives with the same data."""
    compression = [repr((primitive.extensions or {}).get(name)) for name in (EXTENSION, DRACO)]
    groups = [primitive.attributes, *primitive.targets]
    return (
        primitive.mode,
        primitive.indices,
        *compression,
        *(tuple(sorted(named_indices(g).items())) for g in groups),
    )


def _source(document: Document, mesh: int, index: int) -> tuple[Primitive, Dropped]:
    if EXTENSION in (document.meshes[mesh].primitives[index].extensions or {}):
        source, dropped = read_compressed(document, mesh, index).decode(), Dropped()
    else:
        source, dropped = read_primitive(document, mesh, index)
    source, more = weld(source)
    dropped.add(more)
    check_finite(source)
    return source, dropped


def _grids(grouped: list[tuple[int | None, Primitive]], options: Options) -> dict[int | None, Grid]:
    """One position grid per group of primitives with float positions."""
    boxes: dict[int | None, tuple[np.ndarray, np.ndarray]] = {}
    for group, source in grouped:
        positions = source.attributes["POSITION"]
        if not len(source.indices) or positions.dtype.kind != "f":
            continue
        low, high = bounds(positions)
        if group in boxes:
            low, high = np.minimum(low, boxes[group][0]), np.maximum(high, boxes[group][1])
        boxes[group] = low, high
    return {group: _grid(low, high, options) for group, (low, high) in boxes.items()}


def _grid(low: np.ndarray, high: np.ndarray, options: Options) -> Grid:
    grid = position_grid(low, high, options.position_bits, options.step)
    if options.step is not None and _is_coarse(low, high, grid):
        extent = float((high - low).max())
        raise MeshletError(
            f"step {options.step:g} leaves fewer than {MIN_POSITION_BITS} bits for positions in a box of {extent:g}",
            f"use a step of at most {extent / 2 ** (MIN_POSITION_BITS - 1):.3g}",
        )
    return grid


def _is_coarse(low: np.ndarray, high: np.ndarray, grid: Grid) -> bool:
    """Whether a box with an extent spans fewer steps than the fewest position bits can number."""
    return 0.0 < (high - low).max() < (2 ** (MIN_POSITION_BITS - 1) - 0.5) * grid.step


def _coarse_grids(jobs: list[Job]) -> list[str]:
    """Warnings for meshes that are small on a grid that they share."""
    boxes: dict[int, list] = {}
    for job in jobs:
        if job.grid is not None and len(job.source.indices):
            boxes.setdefault(job.source.mesh, []).append(
                (*bounds(job.source.attributes["POSITION"]), job.grid)
            )
    return [
        f"mesh {mesh}: fewer than {MIN_POSITION_BITS} bits are left for its positions; use --grid mesh or a smaller step"
        for mesh, parts in boxes.items()
        if _is_coarse(
            np.min([p[0] for p in parts], axis=0),
            np.max([p[1] for p in parts], axis=0),
            parts[0][2],
        )
    ]


# --- encoding ---


def _encode_job(
    document: Document, job: Job, options: Options, progress: Callable[[float], None] | None
) -> None:
    source = job.source
    if not len(source.indices):
        job.reason_kept = "every triangle is degenerate"
        return
    where = f"mesh {source.mesh} primitive {source.primitive}"
    plan = plan_primitive(source.attributes, source.targets, job.grid, options.bits, where)
    if len(plan.streams) > MAX_STREAMS:
        job.reason_kept = (
            f"it takes {len(plan.streams)} streams, at most {MAX_STREAMS} are possible"
        )
        return
    positions = source.attributes["POSITION"]
    blob, stats = _codec.encode(
        np.ascontiguousarray(source.indices),
        position_ids(positions),
        np.ascontiguousarray(positions, np.float32),
        [s.table_row() for s in plan.streams],
        plan.values,
        progress=progress,
        **options.encoder,
    )
    job.generation = stats["generation"]
    _replace(document, job, plan, blob, stats["vertices"], options.fallback)


def _replace(
    document: Document, job: Job, plan: Plan, blob: bytes, vertex_count: int, fallback: bool
) -> None:
    """Point the job's primitives at the blob, with accessors that describe the decoded data."""
    extension: dict[str, Any] = {
        "bufferView": document.add_view(blob),
        "attributes": plan.attributes,
    }
    if plan.targets:
        extension["targets"] = plan.targets
    if vertex_count != job.source.vertex_count:
        extension["sourceVertices"] = job.source.vertex_count
    first = job.users[0]
    groups = [(first.attributes, plan.attributes), *zip(first.targets, plan.targets)]
    described = [
        pygltflib.Attributes(
            **{
                name: _describe(
                    document, index, streams[name], plan, name == "POSITION", vertex_count
                )
                for name, index in named_indices(group).items()
            }
        )
        for group, streams in groups
    ]
    document.accessors.append(index_accessor(3 * len(job.source.indices), vertex_count))
    indices = len(document.accessors) - 1
    for user in job.users:
        user.mode, user.indices = pygltflib.TRIANGLES, indices
        user.attributes, *user.targets = map(copied, described)
        user.extensions = {**(user.extensions or {}), EXTENSION: dict(extension)}
    if fallback:
        _store_fallback(document, first)


def _describe(
    document: Document,
    source: int,
    first_stream: int,
    plan: Plan,
    with_bounds: bool,
    vertex_count: int,
) -> int:
    """Append an accessor for an attribute's decoded data, of the source accessor's type; returns its index."""
    accessor = described_by(document.accessors[source], vertex_count)
    if with_bounds:
        stream, values = plan.streams[first_stream], plan.values[first_stream]
        low, high = (dequantise(v[None], stream)[0] for v in bounds(values))
        set_bounds(accessor, low, high)
    document.accessors.append(accessor)
    return len(document.accessors) - 1


def _store_fallback(document: Document, primitive: pygltflib.Primitive) -> None:
    """Plain buffer views of the decoded data, marked for the fallback buffer."""
    mesh, index = next(
        (m, p) for m, p, candidate in triangle_primitives(document) if candidate is primitive
    )
    decoded = read_compressed(document, mesh, index).decode()
    store_primitive(document, primitive, decoded, fallback=True)


# --- the rest of the document ---


def _settle_extensions(document: Document, encoded: list[Job]) -> list[str]:
    """Keep extensionsUsed and extensionsRequired right; returns warnings."""
    users = [user for job in encoded for user in job.users]
    for user in users:
        user.extensions.pop(DRACO, None)
    warnings = []
    for name in ORDER_DEPENDENT:
        carriers = [user for user in users if user.extensions.pop(name, None) is not None]
        if carriers or name in document.extensionsUsed:
            warnings.append(
                f"{name} describes the order of triangles, which changes; it is dropped"
            )
            document.forget_extension(name)
    if not any(DRACO in (p.extensions or {}) for mesh in document.meshes for p in mesh.primitives):
        document.forget_extension(DRACO)
    unknown = unknown_index_holders(document)
    if unknown:
        warnings.append(
            f"{', '.join(unknown)} may refer to the original accessors, so their data is kept; "
            "remove the extension for a smaller file"
        )
    return warnings


def _generation(jobs: list[Job]) -> dict[str, Any]:
    histograms = [job.generation["histogram"] for job in jobs]
    return {
        "histogram": [sum(column) for column in zip(*histograms)],
        "iterations": max(job.generation["iterations"] for job in jobs),
    }
