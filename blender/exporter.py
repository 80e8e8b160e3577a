# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Export > glTF: compresses the file that Blender's exporter has written."""

from pathlib import Path

import bpy

from . import jobs, proxies, settings
from .compression import compress_in_place, reason, report_lines

# What the last export reported; nothing if it was plain or failed. The panel shows it.
last_result = []
# Blender's other compressions of meshes -> the operator's argument. Meshopt: since Blender 5.2.
OTHERS = {
    "Draco": "export_draco_mesh_compression_enable",
    "Meshopt": "export_meshopt_compression_enable",
}


def export(operator, context, write):
    """Exports by Blender's own method, `write`, then compresses. Returns the status."""
    last_result.clear()
    with proxies.full_detail():
        status = write(operator, context)
    if status != {"FINISHED"} or not operator.export_meshlet_enabled:
        return status
    path = Path(operator.filepath)
    problem = refusal(operator)
    if problem:
        _report(operator, [("ERROR", f"{path.name} is exported, but not as meshlets: {problem}")])
        return status
    job = _start(path, settings.compress_options(operator))
    if operator.options.is_invoke and context.window and not bpy.app.background:
        jobs.wait_in_window(job, lambda waiting: _report(waiting, _result(path, job)))
    else:
        jobs.wait(job, context)
        _report(operator, _result(path, job))
    return status


def refusal(operator):
    """Why an export with these arguments cannot be compressed; empty if it can."""
    if operator.export_format not in ("GLB", "GLTF_SEPARATE"):
        return "choose glTF Binary or glTF Separate; glTF Embedded has no place for meshlets"
    for name, argument in OTHERS.items():
        if getattr(operator, argument, False):
            return f"turn off {name}, since a mesh can have only one compression"
    return ""


def _start(path, options):
    folder = bpy.app.tempdir  # not in the thread

    def work(advance):
        return compress_in_place(path, {**options, "progress": advance}, folder)

    return jobs.Job(path.name, work)


def _result(path, job):
    """(kind, text) of what to report on a compression. A failure keeps the plain file."""
    try:
        report = job.result()
    except jobs.Cancelled:
        return [("WARNING", f"{path.name} is exported, but not compressed: cancelled")]
    except Exception as error:
        return [("ERROR", f"{path.name} is exported, but not compressed: {reason(error)}")]
    if isinstance(report, str):
        return [("WARNING", f"{path.name} is exported plain: {report}")]
    return report_lines(path.name, report)


def _report(operator, result):
    """Reports (kind, text), and returns them."""
    last_result[:] = [text for _, text in result]
    for kind, text in result:
        operator.report({kind}, text)
    return result
