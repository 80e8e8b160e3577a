# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels in the dialogs of glTF."""

import textwrap

from .exporter import last_result, refusal
from .settings import BITS

LINE_CHARACTERS = 30  # of a label in the side bar of the file browser, as wide as it opens


def draw_export(operator, layout):
    """Draws the panel below those of Blender's exporter, also in the exporters of collections."""
    header, body = layout.panel("gltf_meshlet", default_closed=False)
    header.use_property_split = False
    header.prop(operator, "export_meshlet_enabled", text="")
    header.label(text="Meshlet Compression")
    if not body:
        return
    refused = refusal(operator) if operator.export_meshlet_enabled else ""
    if refused:
        _draw_text(body, f"Not possible: {refused}", "ERROR")
    _draw_options(body.column(), operator, operator.export_meshlet_enabled and not refused)
    for text in last_result:
        _draw_text(body, text, "INFO")


def draw_import(operator, layout):
    """Draws the choice of detail below the options of Blender's importer."""
    header, body = layout.panel("gltf_meshlet_import", default_closed=False)
    header.label(text="Meshlet Levels of Detail")
    if not body:
        return
    body.prop(operator, "import_meshlet_detail")
    if operator.import_meshlet_detail in ("LEVEL", "PROXY"):
        body.prop(operator, "import_meshlet_level")
    if operator.import_meshlet_detail == "ERROR":
        body.prop(operator, "import_meshlet_error")


def _draw_options(layout, operator, enabled):
    layout.enabled = enabled
    layout.prop(operator, "export_meshlet_quality")
    layout.prop(operator, "export_meshlet_step")
    bits = layout.column(align=True)
    for name in BITS:
        row = bits.row()
        row.active = name != "position_bits" or not operator.export_meshlet_step
        row.prop(operator, f"export_meshlet_{name}")
    layout.label(text="Bits of 0 follow the quality")
    layout.prop(operator, "export_meshlet_scene_grid")
    layout.prop(operator, "export_meshlet_lod")
    if operator.export_meshlet_lod:
        layout.prop(operator, "export_meshlet_lod_limit")
    layout.prop(operator, "export_meshlet_transport")
    layout.prop(operator, "export_meshlet_fallback")
    layout.prop(operator, "export_meshlet_effort")


def _draw_text(layout, text, icon):
    """Wraps the text at the width of a side bar; Blender's labels have one line."""
    lines = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, LINE_CHARACTERS)):
        lines.label(text=line, icon="BLANK1" if number else icon)
