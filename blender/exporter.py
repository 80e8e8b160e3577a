# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Export > glTF: compresses the file that Blender's exporter has written."""

import tempfile
from pathlib import Path

import bpy

from .importer import reason

# What the last export of this session reported; the panel shows it.
last_result = []


class glTF2ExportUserExtension:
    """Hooks that Blender's glTF exporter calls; it makes one object of this class per export."""

    def gather_gltf_extensions_hook(self, gltf, export_settings):
        """Arranges for the compression; the exporter calls this before it writes the file."""
        settings = bpy.context.scene.gltf_meshlet
        if settings.enabled:
            options = settings.compress_options()
            export_settings["log"] = _CompressingLog(export_settings, options)


class _CompressingLog:
    """Stands in for the exporter's log and compresses the file when it is asked for its messages.

    The exporter reports them to the user after it has written the file. Before Blender 4.4, it has
    no hook at that time; later ones cannot report anything.
    """

    def __init__(self, export_settings, options):
        self._log = export_settings["log"]
        self._export_settings = export_settings
        self._options = options

    def __getattr__(self, name):
        return getattr(self._log, name)

    def messages(self):
        """(kind, text) of the exporter's own messages, and of ours."""
        result = _result(self._export_settings, self._options)
        last_result[:] = [text for _, text in result]
        return [*self._log.messages(), *result]


def refusal(export_format, draco):
    """Why an export with these settings cannot be compressed; empty if it can."""
    if export_format != "GLB":
        return "choose the format glTF Binary (.glb), since compressed meshes go into a single file"
    if draco:
        return "turn off Draco, since a mesh can have only one of the two compressions"
    return ""


def _result(export_settings, options):
    """Compresses the exported file; returns what to report. A failure keeps the plain file."""
    path = Path(export_settings["gltf_filepath"])
    problem = refusal(
        export_settings["gltf_format"], export_settings["gltf_draco_mesh_compression"]
    )
    if not problem:
        from gltf_ext import steps_text

        try:
            report = _compress(path, options)
        except Exception as error:
            problem = reason(error)
    if problem:
        return [("ERROR", f"{path.name} is exported, but not compressed: {problem}")]
    warnings = [("WARNING", f"{path.name}: {text}") for text in _warnings(report)]
    steps = steps_text(report["steps"])
    return [
        *warnings,
        *([("INFO", f"{path.name}: {steps}")] if steps else []),
        ("INFO", _sizes(path, report)),
    ]


def _compress(path, options):
    """Replaces the file; writes the fallback beside it. Raises MeshletError, OSError."""
    import gltf_ext
    from gltf_ext.files import refuse_overwriting, rename_all

    # On the same drive: replacing a file is then one step that happens or not. With the same name:
    # the compressed file refers to its fallback by it.
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".gltf-meshlet-") as folder:
        report = gltf_ext.compress(path, Path(folder, path.name), **options)
        written = sorted(Path(folder).iterdir(), key=lambda file: file.name == path.name)
        files = {path.with_name(file.name): file for file in written}
        refuse_overwriting([path], files.keys() - {path})
        rename_all(files)
    return report


def _sizes(path, report):
    before, after = report["input_bytes"], report["output_bytes"]
    text = f"{path.name}: {_size(before)} → {_size(after)}"
    if after < before:
        text += f", {before / after:.1f} times smaller"
    if report["fallback_bytes"]:
        text += f", and {_size(report['fallback_bytes'])} of fallback"
    return text


def _size(count):
    """With a space at which the panel does not wrap."""
    return f"{count / 1e6:.2f}\u00a0MB" if count >= 1e6 else f"{count / 1e3:.1f}\u00a0kB"


def _warnings(report):
    kept = report["kept"]
    plain = [f"{len(kept)} primitives are not compressed ({kept[0]['reason']})"] if kept else []
    return plain + report["warnings"]
