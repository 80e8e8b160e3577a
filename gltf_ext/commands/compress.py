"""compress: any model -> .glb or .gltf with EXT_meshlet_edgebreaker."""

from __future__ import annotations

import copy
import functools
import inspect
import os
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ParamSpec, Protocol

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.details import Collapse, collapse_of_source, joins_vertices
from gltf_ext.attributes.equal_vertices import is_soup, table_of
from gltf_ext.attributes.extension import EQUAL_VERTICES, read_compressed
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.attributes.streams import dequantise
from gltf_ext.checks.topology import topologies
from gltf_ext.commands.inspect import inspect_document
from gltf_ext.commands.jobs import Job, coarse_grids, jobs_of
from gltf_ext.commands.losses import (
    collapse_warnings,
    joined_warnings,
    limited,
    range_warnings,
    rounding_warnings,
    steps_of,
)
from gltf_ext.commands.order import drop_numbered
from gltf_ext.commands.result import Result, output_path
from gltf_ext.commands.transcode import pack_compressed
from gltf_ext.document import gltf
from gltf_ext.document.container import fallback_of
from gltf_ext.document.document import Document
from gltf_ext.document.draco import DRACO
from gltf_ext.document.gltf2 import File, Model, name_of
from gltf_ext.document.images import embed_images
from gltf_ext.document.references import KINDS, ambiguous_references
from gltf_ext.encode.primitive import Compression, encode
from gltf_ext.errors import MeshletError, NothingToCompress, blaming
from gltf_ext.lod.document import add_levels, arrange, forget_levels
from gltf_ext.lod.tables import EXTENSION as LEVELS
from gltf_ext.options import Options
from gltf_ext.progress import Advance, progress_bar, shared_progress
from gltf_ext.scheduler import LocalThreads, Runner, runner
from gltf_ext.sources.features import number_features
from gltf_ext.sources.large import open_source
from gltf_ext.sources.primitives import (
    EXTENSION,
    DropCounts,
    all_primitives,
    describe,
    describe_indices,
    store_primitive,
)
from gltf_ext.sources.repair import repair_warnings
from gltf_ext.sources.source import Box

PIXELS = 1000  # of a primitive's longest side, to judge whether its levels pay
DEGENERATE, NOT_FINITE = "every triangle is degenerate", "no triangle has finite positions"
NOTHING = "there is nothing to compress"
LOSSY_BEFORE = (EXTENSION, DRACO, "KHR_mesh_quantization")

Report = dict[str, Any]
P = ParamSpec("P")  # the options of compress, as keyword arguments


class _Command(Protocol[P]):
    """A function of two models with the options as keyword arguments."""

    def __call__(
        self, input: Model, output: File | None = None, *args: P.args, **options: P.kwargs
    ) -> Report: ...


def _with_options(
    declare: Callable[P, Options],
) -> Callable[[Callable[[Model, File | None, Options], Report]], _Command[P]]:
    """Give a function of two models and Options a keyword argument for each option instead.

    Type checkers and editors see the names, types and defaults that Options declares.
    """

    def decorate(function: Callable[[Model, File | None, Options], Report]) -> _Command[P]:
        def command(
            input: Model, output: File | None = None, *args: P.args, **options: P.kwargs
        ) -> Report:
            if args:
                raise TypeError("compress takes two files; name each option: position_bits=14")
            folder = str(Path(output).parent) if output else tempfile.gettempdir()
            return function(input, output, Options.of({"work_dir": folder, **options}))

        signature = inspect.signature(function)
        files = list(signature.parameters.values())[:2]
        options = inspect.signature(declare).parameters.values()
        with_options = signature.replace(parameters=[*files, *options])
        functools.update_wrapper(command, function)
        command.__signature__ = with_options  # type: ignore[attr-defined]
        return command

    return decorate


@_with_options(Options)
def compress(input: Model, output: File | None, settings: Options) -> Report:
    """Compress a .glb, .gltf, .obj, .ply or .stl file into a .glb with EXT_meshlet_edgebreaker.

    The input is a path, or a pygltflib.GLTF2, which stays as it is. Without an output path nothing
    is written, and the result is a new GLTF2 in the report.

    An output that is named .gltf, or does not fit a .glb (4 GiB), becomes a .gltf with .bin files
    of at most 1 GiB; a primitive with more bytes has one of its own.

    Options:
        position_bits: bits of a position along the longest side (4 to 24 or auto, default auto).
        normal_bits: bits of each of the two elements of a normal or tangent (4 to 16 or auto,
            default auto).
        texcoord_bits: bits of each texture coordinate (4 to 16 or auto, default auto).
        color_bits: bits of each colour component that is not stored in 8 bits (4 to 16 or auto,
            default auto).
        weight_bits: bits of each float skin weight (4 to 16 or auto, default auto).
        step: position step in units of the scene, instead of bits: 0.001 is 1 mm if units are
            metres.
        grid: "mesh" or "scene": one position grid per mesh, or one for the whole scene (default
            mesh).
        max_triangles: most triangles in a meshlet (16 to 64, default 64).
        lambda_: above 0 and up to 1000; small values give planar meshlets, large ones compact
            meshlets (default 1.4).
        effort: "fast" or "normal": how long to look for a smaller file; against normal, fast takes
            about 0.6 of the time for 2 % more bytes (default normal).
        page_bytes: largest size of a page, a blob of neighbouring meshlets that decodes alone; 0
            for one blob per primitive, else at least 4096; by default 131072 in primitives of more
            than 131072 triangles, 0 in others; instead of 0, 32768 with levels of detail, and
            131072 in primitives that --max-memory reads in parts (0 to 268435456).
        lod: also write levels of detail (EXT_meshlet_lod), in pages of --page-bytes or 32768 bytes;
            primitives that cannot be simplified have none; from source, needs the package
            meshoptimizer.
        lod_reduction: triangles of level 0 over those of level 1; coarser levels shrink by less
            (1.5 to 16, default 5.0).
        lod_group: meshlets that are simplified together (4 to 128, default 96).
        lod_limit: largest error of a level, in units of the scene; no limit by default.
        fallback: also write plain buffers into OUT.fallback.bin, for readers without the extension.
        images: "embed" or "keep": embed images into the result, or keep them in their files, whose
            relative paths have to hold from where the output lies (default embed).
        transport: pack the result for download, a tenth to a third smaller (EXT_meshlet_transport,
            a draft); readers unpack it when they open it.
        obj_groups: groups (g) of an .obj become nodes, too, below those of its objects (o).
        non_finite: "repair" or "refuse": of values that are NaN or infinite: repair leaves out
            triangles at such positions, computes normals again and sets texture coordinates to 0,
            with a warning each; refuse ends with an error (default repair).
        threads: number of threads, 0 for one per processor; the bytes are the same for any (0 to
            1024, default 0).
        max_memory: work through models larger than memory in chunks; the process stays below so
            many bytes (K, M and G are powers of 1024).
        work_dir: folder for the work files of --max-memory; by default that of the output.
        scheduler: address of a running Dask scheduler, whose workers take the chunks of --max-
            memory and stay below it too, each.
        progress: draw a progress bar on a terminal; or a function, which is called in any thread
            with the share of the work that is done, 0 to 1, and cancels by raising an error.

    Returns a report:
        input, output, input_bytes, output_bytes, fallback_bytes.
        gltf: the new pygltflib.GLTF2, if there is no output path.
        totals, fallback_files, primitives: as `inspect` of the output has them.
        generation: "histogram" counts the regions of [0, 32), [32, 64), [64, 72) and 72 or more
            triangles, before large ones are split; "iterations" is the most of any primitive.
        dropped: counts of vertices and triangles left out.
        kept: primitives left uncompressed: mesh, primitive and reason.
        collapsed: "triangles" without area on the position grid, and their "area_percent".
        steps: attribute -> "step" and "bits", smallest and largest: positions in units of the
            scene, normals as degrees of the largest error, the others in their own units.
        lod: with levels, for each compressed primitive its mesh and primitive, the triangles of
            each level, and the bytes that its levels add.
        warnings: one line each; `compress_warnings` has those of the other entries, too.

    Raises MeshletError when the input cannot be compressed: NothingToCompress, which is one, when
    it has no triangles that can be. Raises OSError when a file cannot be read or written.
    """
    path, name = output_path(output, input), name_of(input)
    if settings.memory and path is None:
        raise MeshletError(
            "max_memory is for files", "name an output file", options=("max_memory",)
        )
    with runner(settings.scheduler, settings.threads) as chunks, blaming(name):
        document, large = open_source(input, settings)
        feature_warnings = number_features(document, large)
        input_files = document.files()
        jobs = jobs_of(document, large, settings)
        encoded = _encode_all(jobs, settings, chunks, Path(name).name)
        for job in encoded:
            _replace(document, job, settings.fallback)
        changes = _finish_document(document, jobs, encoded, settings)
        changes["warnings"] += feature_warnings
        if settings.lod:
            changes["lod"] = _add_all_levels(document, encoded)
            changes["warnings"] += _useless_levels(encoded)
        if settings.transport:
            pack_compressed(document, settings.threads)
        for job in jobs:
            job.source.give_back_copy()
        result = Result.of(document, path)
        contents = inspect_document(document, _statistics_by_view(encoded))
    report = {**result.write(input, input_files), "fallback_bytes": result.fallback_bytes}
    if report["output_bytes"] >= report["input_bytes"]:
        changes["warnings"].append("the file grew; the original is smaller")
    if path:
        changes["warnings"] += _unexpected_files(path, result)
    return {**report, **contents, **changes}


def _unexpected_files(output: Path, result: Result) -> list[str]:
    """Return warnings about a file of another name, and one that remains of an earlier run."""
    *_, model = result.files
    fallback, warnings = fallback_of(output), []
    if model.suffix != output.suffix:
        warnings.append(f"the result does not fit a .glb; it is {model.name}")
    if fallback not in result.files and os.path.exists(fallback):  # also if too long
        warnings.append(
            f"{fallback.name} is not part of this result; delete it if nothing needs it"
        )
    return warnings


def _statistics_by_view(encoded: list[Job]) -> dict[int, dict[str, Any]]:
    """Buffer view -> statistics of its blobs. Call after `pack`, which renumbers the views."""
    return {
        gltf.extension(job.users[0], EXTENSION)["bufferView"]: job.result.statistics
        for job in encoded
    }


def _encode_all(jobs: list[Job], options: Options, chunks: Runner, title: str) -> list[Job]:
    """Encode all jobs; returns those that can be. Raises MeshletError when none can be.

    chunks: runs the chunks of primitives that are larger than memory.
    """
    if not jobs:
        raise NothingToCompress("holds no triangles with a POSITION", NOTHING)
    with progress_bar(title, options.progress) as advance:
        _encode_at_once(jobs, options, chunks, advance)
    encoded = [job for job in jobs if not job.reason_kept]
    if not encoded:
        reason = jobs[0].reason_kept
        raise NothingToCompress(
            f"none of its triangle primitives can be compressed ({reason})", NOTHING
        )
    return encoded


def _encode_at_once(
    jobs: list[Job], options: Options, chunks: Runner, advance: Advance | None
) -> None:
    """Encode several primitives at once, the largest first. A large one uses several threads."""
    threads = options.threads or os.cpu_count() or 1
    counts = [max(job.source.triangle_count, 1) for job in jobs]
    shares = [count / sum(counts) for count in counts]
    progress = shared_progress(advance, shares)

    def encode_job(i: int) -> None:
        count = threads if options.memory else max(1, round(threads * shares[i]))
        _encode_job(jobs[i], options, chunks, count, progress[i])

    if threads == 1 or len(jobs) == 1 or options.memory:
        for i in range(len(jobs)):
            encode_job(i)
        return
    from concurrent.futures import ThreadPoolExecutor  # as slow to load as a small file to encode

    with ThreadPoolExecutor(min(threads, len(jobs))) as pool:
        largest_first = sorted(range(len(jobs)), key=lambda i: -counts[i])
        futures = {i: pool.submit(encode_job, i) for i in largest_first}
        try:
            for i in range(len(jobs)):
                futures[i].result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _equal_vertices(job: Job, record_format: RecordFormat) -> bytes:
    """Return the table of equal vertices; empty if decoders need none to have them as the source.

    With a table, none are joined: sets that count to 0.
    """
    result, source, counts = job.result, job.source, job.result.drop_counts
    has_equal = counts.duplicate_vertices > 0 and not is_soup(
        source.all_corners(), source.vertex_count
    )
    has_copies = result.source_vertices < result.statistics["vertices"]
    if not has_equal and not (has_copies and joins_vertices(source, record_format)):
        return b""
    triangles = record_format.triangles_of(source)
    joinable, _ = _codec.decode_joinable(result.view)
    if not has_equal:
        whole, _, decoded = topologies(triangles, joinable, result.source_vertices)
        if whole == decoded:
            return b""
    table = table_of(triangles, record_format, joinable)
    if table:
        counts.duplicate_vertices = 0
    return table


def _finish_document(
    document: Document, jobs: list[Job], encoded: list[Job], options: Options
) -> dict[str, Any]:
    """Bring images and lists of extensions in order; returns the report on the changes."""
    warnings = [*document.import_warnings, *_lossy_before(document), *coarse_grids(jobs)]
    sources = {id(job.source): job.source for job in encoded}.values()  # jobs may share one
    warnings += repair_warnings(sources)
    document.forget_extension(EXTENSION)
    forget_levels(document)
    document.use_extension(EXTENSION, required=not options.fallback)
    warnings += embed_images(document, also_files=options.images == "embed")
    warnings += _settle_extensions(document, encoded)
    total, losses = _losses(encoded, document.import_rounding, options.chooses_positions)
    warnings += losses
    mesh_of = {id(primitive): mesh for mesh, _, primitive in all_primitives(document)}
    of_jobs = [{**job.location, "reason": job.reason_kept} for job in jobs if job.reason_kept]
    drop_counts = DropCounts()
    for job in jobs:
        drop_counts.add(job.drop_counts)
        drop_counts.add(job.result.drop_counts)
    drop_counts.non_finite_triangles = sum(source.replaced["POSITION"] for source in sources)
    return {
        "generation": _generation(encoded),
        "dropped": vars(drop_counts),
        "kept": [*_without_positions(document), *of_jobs],
        "collapsed": {"triangles": round(total.count), "area_percent": 100 * total.share},
        "steps": steps_of(
            document,
            [
                ({mesh_of[id(user)] for user in job.users}, job.choice, job.result.plan)
                for job in encoded
            ],
        ),
        "warnings": warnings,
    }


def _losses(encoded: list[Job], rounding: float, is_auto: bool) -> tuple[Collapse, list[str]]:
    """Return the triangles that grids collapse, and warnings about what is lost.

    rounding: of positions, when they were read; is_auto: whether the grids were chosen.
    """
    collapses: dict[str, Collapse] = {}
    total, warnings = Collapse(), []
    for job in encoded:
        total.add(job.collapse)
        collapses.setdefault(job.source.where, Collapse()).add(job.collapse)
        warnings += range_warnings(job.choice, job.result.plan)
    steps = [job.grid.step for job in encoded if job.grid]
    lines = [
        *rounding_warnings(rounding, steps),
        *collapse_warnings(collapses, is_auto),
        *joined_warnings([job.source.where for job in encoded if not job.has_one_numbering]),
    ]
    return total, [*lines, *limited(warnings)]


def _without_positions(document: Document) -> list[dict[str, Any]]:
    """Return the place of each triangle primitive that has no positions, and that as the reason."""
    return [
        {"mesh": mesh, "primitive": index, "reason": "it has no POSITION"}
        for mesh, index, primitive in all_primitives(document)
        if gltf.mode(primitive) in gltf.TRIANGLE_MODES and not gltf.has_triangles(primitive)
    ]


def _lossy_before(document: Document) -> list[str]:
    names = [name for name in LOSSY_BEFORE if name in document.extensionsUsed]
    if not names:
        return []
    return [
        f"the input is already quantised ({', '.join(names)}): errors add up; "
        "compress the original if there is one"
    ]


# --- encoding ---


def _encode_job(
    job: Job, options: Options, chunks: Runner, threads: int, progress: Advance | None
) -> None:
    """Set the job's result, or its reason_kept. threads: for a primitive in memory."""
    source, max_streams = job.source, _codec.BLOB_MAX_STREAMS
    if not source.triangle_count:
        _keep(job, NOT_FINITE if source.replaced else DEGENERATE)
        return
    streams = len(source.attributes)  # one or more for each
    if streams <= max_streams:
        if not source.bounds:
            job.drop_counts.degenerate_triangles += source.triangle_count
            _keep(job, DEGENERATE)
            return
        record_format = RecordFormat.of(source, job.grid, job.choice.bits)
        streams = len(record_format.plan.streams)
    if streams > max_streams:
        job.reason_kept = f"it takes {streams} streams, at most {max_streams} are possible"
        return
    own_runner = LocalThreads(threads) if source.is_in_memory else chunks
    if options.lod_limit is not None:
        options = replace(options, lod_limit=options.lod_limit / job.scale)
    job.result = encode(source, record_format, options, own_runner, progress)
    if not job.result.statistics:
        _keep(job, DEGENERATE)
        return
    if source.is_in_memory:
        job.result.equal_vertices = _equal_vertices(job, record_format)
    elif job.has_one_numbering:
        equal = source.used_vertices - job.result.source_vertices
        job.result.drop_counts.duplicate_vertices = equal
    if job.grid and job.choice.sample:
        job.collapse = collapse_of_source(source, job.grid, job.choice.sample)


def _keep(job: Job, reason: str) -> None:
    """Leave a primitive as it is. Raises MeshletError for one that is larger than memory."""
    job.reason_kept = reason
    if not job.source.is_in_memory:  # the document may not have it
        raise MeshletError(f"{job.source.where}: {reason}", "repair the model first")


def _replace(document: Document, job: Job, fallback: bool) -> None:
    """Point the job's primitives at the view, with accessors that describe the decoded data."""
    result, first = job.result, job.users[0]
    vertex_count: int = result.statistics["vertices"]
    extension: dict[str, Any] = {"bufferView": document.add_view(result.view)}
    described, streams = [], []
    for i, names in enumerate(gltf.attribute_sets(first)):
        before = f"targets[{i - 1}]." if i else ""
        streams.append({name: result.plan.attributes[before + name].start for name in names})
        box = _decoded_box(result, streams[i]["POSITION"]) if "POSITION" in names else None
        described.append(describe(document, names, vertex_count, box))
    extension["attributes"], *targets = streams
    if targets:
        extension["targets"] = targets
    if vertex_count != result.source_vertices:
        extension["sourceVertices"] = result.source_vertices
    if result.equal_vertices:
        extension[EQUAL_VERTICES] = {"bufferView": document.add_view(result.equal_vertices)}
    indices = describe_indices(document, result.statistics["triangles"], vertex_count)
    for user in job.users:
        if gltf.mode(user) != gltf.TRIANGLES:
            user["mode"] = gltf.TRIANGLES
        user["indices"] = indices
        gltf.set_attribute_sets(user, described)
        gltf.set_extension(user, EXTENSION, copy.deepcopy(extension))  # numbers change in place
    if fallback:
        mesh, index = next((m, p) for m, p, user in all_primitives(document) if user is first)
        decoded = read_compressed(document, mesh, index).decode()
        store_primitive(document, first, decoded, fallback=True)


def _decoded_box(result: Compression, stream: int = 0) -> Box:
    """Return the box of a stream of positions as it decodes; by default of POSITION."""
    low, high = dequantise(result.bounds[stream], result.plan.streams[stream])
    return low, high


def _add_all_levels(document: Document, encoded: list[Job]) -> list[dict[str, Any]]:
    """Add the levels of all jobs. Returns a report of each compressed primitive."""
    report = []
    for job in encoded:
        triangles = [job.result.statistics["triangles"]]
        levels = {"triangles": triangles, "stuck_triangles": list(triangles), "bytes": 0}
        if job.result.levels:
            add_levels(document, job.users, job.result.levels)
            levels = {**job.result.levels.report, "bytes": job.result.levels.byte_count}
        report.append({**job.location, **levels})
    if any(job.result.levels for job in encoded):
        document.use_extension(LEVELS, required=False)
        arrange(document)
    return report


def _useless_levels(encoded: list[Job]) -> list[str]:
    """Warn if a viewer holds more bytes with levels than without.

    It shows each primitive with only PIXELS pixels and one pixel of error.
    """
    from gltf_ext.lod.cuts import cut_at_error, held_bytes  # commands without levels start faster

    bytes_without_levels = bytes_with_levels = 0
    for job in encoded:
        if not job.result.levels:
            continue
        tables = job.result.levels.tables
        size = float(np.ptp(_decoded_box(job.result), axis=0).max())
        bytes_without_levels += len(job.result.view)
        bytes_with_levels += held_bytes(tables, cut_at_error(tables, size / PIXELS))
    if bytes_with_levels < bytes_without_levels or not bytes_without_levels:
        return []
    return [
        f"levels of detail do not pay: for one pixel of error in {PIXELS} a viewer loads "
        f"{bytes_with_levels:,} bytes, and {bytes_without_levels:,} without levels"
    ]


# --- the rest of the document ---


def _settle_extensions(document: Document, encoded: list[Job]) -> list[str]:
    """Correct extensionsUsed and extensionsRequired; return warnings."""
    for job in encoded:
        for user in job.users:
            gltf.pop_extension(user, DRACO)
    compressed = {id(user): job.counts for job in encoded for user in job.users}
    warnings = drop_numbered(document, compressed)
    if not any(gltf.has_extension(p, DRACO) for _, _, p in all_primitives(document)):
        document.forget_extension(DRACO)
    unknown = sorted({name for kind in KINDS for name in ambiguous_references(document, kind)})
    if unknown:
        warnings.append(
            f"{', '.join(unknown)} may refer to original accessors or buffer views, so their data "
            "is kept; remove the extension for a smaller file"
        )
    return warnings


def _generation(jobs: list[Job]) -> dict[str, Any]:
    """Return the histograms summed, and the largest number of iterations."""
    generations = [job.result.statistics["generation"] for job in jobs]
    return {
        "histogram": [sum(column) for column in zip(*(g["histogram"] for g in generations))],
        "iterations": max(g["iterations"] for g in generations),
    }
