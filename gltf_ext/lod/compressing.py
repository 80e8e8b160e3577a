"""What `compress` calls: levels for a job, and for the document. Imports nothing heavy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gltf_ext.compression.options import EFFORTS
from gltf_ext.gltf.document import Document
from gltf_ext.lod.tables import EXTENSION
from gltf_ext.progress import Advance

if TYPE_CHECKING:
    from gltf_ext.compression.compressor import Job
    from gltf_ext.compression.options import Options
    from gltf_ext.compression.streams import Plan


def encode_levels(
    job: Job, plan: Plan, options: Options, threads: int, progress: Advance | None
) -> bytes | None:
    """Sets the job's levels and statistics; returns the view of level 0.

    None if the primitive cannot be simplified. Raises MeshletError without meshoptimizer.
    """
    from gltf_ext.lod.writing import LodOptions, encode_with_levels

    encoder = options.encoder
    generation = {k: v for k, v in encoder.items() if k in ("lambda_", "iterations", "fill")}
    generation["max_triangles"] = encoder["max_triangles"]
    generation["effort"] = EFFORTS.index(encoder["effort"])
    generation["paper_weight"] = encoder["weight"] == "paper"
    encoded = encode_with_levels(
        job.source,
        plan,
        LodOptions(
            options.lod_reduction,
            options.lod_group,
            math.inf if options.lod_limit is None else options.lod_limit,
            options.lod_page_bytes,
            threads,
            generation,
        ),
        progress,
    )
    if encoded is None:
        return None
    view, job.statistics, job.levels = encoded
    return view


def forget_levels(document: Document) -> None:
    """Removes all levels: they describe data that is replaced."""
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            (primitive.extensions or {}).pop(EXTENSION, None)
    document.forget_extension(EXTENSION)


def add_levels(document: Document, jobs: list[Job]) -> list[dict[str, Any]]:
    """Adds the levels of all jobs. Returns a report of each compressed primitive."""
    from gltf_ext.lod.writing import arrange, attach

    report = []
    for job in jobs:
        if job.reason_kept:
            continue
        place = {"mesh": job.source.mesh, "primitive": job.source.primitive}
        if job.levels is None:
            triangles, stuck = [len(job.source.indices)], [len(job.source.indices)]
            report.append({**place, "triangles": triangles, "stuck_triangles": stuck})
            continue
        attach(document, job.users, job.levels)
        report.append({**place, **job.levels.report})
    if any(job.levels for job in jobs):
        document.use_extension(EXTENSION, required=False)
        arrange(document)
    return report
