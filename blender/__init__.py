# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender extension: glTF import and export with EXT_meshlet_edgebreaker.

Blender's glTF add-on (io_scene_gltf2) looks in this module for the two classes with its hooks and
for `draw_export`, by their names.
"""

from . import panel, settings
from .exporter import glTF2ExportUserExtension
from .importer import glTF2ImportUserExtension
from .panel import draw_export

__all__ = [
    "draw_export",
    "glTF2ExportUserExtension",
    "glTF2ImportUserExtension",
    "register",
    "unregister",
]


def register():
    settings.register()
    panel.register()


def unregister():
    panel.unregister()
    settings.unregister()
