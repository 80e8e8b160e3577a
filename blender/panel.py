# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the glTF export dialog."""

import textwrap

from .exporter import last_result, refusal

LINE_CHARACTERS = 30  # of a label in the side bar of the file browser, as wide as it opens


def draw_export(context, layout):
    """Draws the panel; Blender's exporter calls it below its own panels."""
    settings = context.scene.gltf_meshlet
    header, body = layout.panel("gltf_meshlet", default_closed=False)
    header.use_property_split = False
    header.prop(settings, "enabled", text="")
    header.label(text="Meshlet Compression")
    if not body:
        return
    refused = _refusal(context)
    if refused:
        _draw_text(body, f"Not possible: {refused}", "ERROR")
    _draw_options(body.column(), settings, settings.enabled and not refused)
    for text in last_result:
        _draw_text(body, text, "INFO")


def register():
    """Adds the panel: the dialog does so by itself, but not the exporters of collections."""
    from io_scene_gltf2 import exporter_extension_layout_draw

    exporter_extension_layout_draw[__package__] = draw_export


def unregister():
    """Removes the panel, which the exporter would keep."""
    from io_scene_gltf2 import exporter_extension_layout_draw

    exporter_extension_layout_draw.pop(__package__, None)


def _refusal(context):
    """As exporter.refusal. The exporters of collections tell only when they export."""
    operator = getattr(context.space_data, "active_operator", None)
    if operator is None:
        return ""
    return refusal(operator.export_format, operator.export_draco_mesh_compression_enable)


def _draw_options(layout, settings, enabled):
    layout.enabled = enabled
    bits = layout.column(align=True)
    for name in ("position_bits", "normal_bits", "texcoord_bits", "color_bits", "weight_bits"):
        bits.prop(settings, name)
    layout.label(text="Bits of 0 are chosen by themselves")
    layout.prop(settings, "fallback")
    layout.prop(settings, "lod")


def _draw_text(layout, text, icon):
    """Wraps the text at the width of a side bar; Blender's labels have one line."""
    lines = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, LINE_CHARACTERS)):
        lines.label(text=line, icon="BLANK1" if number else icon)
