# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compresses a file that Blender has exported, in its place; without Blender's own modules."""

import tempfile
from pathlib import Path


def compress_in_place(path, options, folder):
    """Replaces a .glb, or a .gltf and its .bin; writes the fallback beside.

    options: of gltf_ext.compress. folder: for unfinished files, elsewhere: if the process is
    killed, nothing remains beside the file. Returns the report of gltf_ext.compress, or a text that
    says why the plain file stays. Raises MeshletError, OSError, what options["progress"] raises.
    """
    import gltf_ext
    from gltf_ext.files import refuse_overwriting, write_files

    # With the same name: the compressed file refers to its other files by it.
    with tempfile.TemporaryDirectory(dir=folder) as unfinished:
        try:
            report = gltf_ext.compress(path, Path(unfinished, path.name), **options)
        except gltf_ext.NothingToCompress as error:
            return reason(error)
        grew = report["output_bytes"] >= report["input_bytes"]
        if grew and not (options.get("lod") or options.get("fallback")):
            return f"compressed it would be larger ({size_text(report['output_bytes'])})"
        written = sorted(Path(unfinished).iterdir(), key=lambda file: file.name == path.name)
        files = {path.with_name(file.name): [file.read_bytes()] for file in written}
    plain = {path} if path.suffix.lower() == ".glb" else {path, path.with_suffix(".bin")}
    refuse_overwriting(plain, files.keys() - plain)
    write_files(files, [])
    for file in plain - files.keys():  # if there are several .bin files, none has its name
        file.unlink(missing_ok=True)
    return report


def reason(error):
    """One line for the user, without the file."""
    if isinstance(error, ImportError):
        text = f"the library of this extension cannot be loaded ({error}); install it again"
    else:  # a MeshletError has a message
        text = getattr(error, "message", "") or f"{type(error).__name__}: {error}"
    return " ".join(text.split())


# --- what to tell the user ---


def report_lines(name, report):
    """(kind, text) of a report of gltf_ext.compress, for a file of this name."""
    from gltf_ext import compress_warnings, steps_text

    warnings = [("WARNING", f"{name}: {text}") for text in compress_warnings(report)]
    sizes = f"{name}: {_sizes(report)}"
    texts = (steps_text(report["steps"]), _collapsed(report), _levels(report), sizes)
    return [*warnings, *(("INFO", text) for text in texts if text)]


def _sizes(report):
    before, after = report["input_bytes"], report["output_bytes"]
    text = f"{size_text(before)} → {size_text(after)}"
    if after < before:
        text += f", {before / after:.1f} times smaller"
    if report["fallback_bytes"]:
        text += f", and {size_text(report['fallback_bytes'])} of fallback"
    return text


def _levels(report):
    """What the levels cost."""
    if not any(primitive["bytes"] for primitive in report.get("lod", [])):
        return ""
    triangles = [primitive["triangles"] for primitive in report["lod"]]
    most, least = sum(counts[0] for counts in triangles), sum(counts[-1] for counts in triangles)
    size = size_text(sum(primitive["bytes"] for primitive in report["lod"]))
    count = max(map(len, triangles))
    return f"{count} levels of detail, {most:,} to {least:,} triangles; the coarser take {size}"


def _collapsed(report):
    """Triangles that are there without area; a warning tells of those that are not there."""
    collapsed = report["collapsed"]
    if not collapsed["triangles"]:
        return ""
    share = f"{collapsed['area_percent']:.2g} % of the area"
    return f"{collapsed['triangles']:,} triangles collapse by the step, {share}"


def size_text(count):
    """With a space at which the panel does not wrap."""
    return f"{count / 1e6:.2f}\u00a0MB" if count >= 1e6 else f"{count / 1e3:.1f}\u00a0kB"
