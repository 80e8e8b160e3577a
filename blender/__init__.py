# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender extension: glTF import and export with EXT_meshlet_edgebreaker.

Blender's glTF add-on (io_scene_gltf2) looks in this module for the class with the import's hooks,
by its name. Everything else is added to its two operators: operators.py.
"""

from . import jobs, operators, settings
from .importer import glTF2ImportUserExtension

__all__ = ["glTF2ImportUserExtension", "register", "unregister"]


def register():
    settings.register()
    jobs.register()
    operators.register()


def unregister():
    operators.unregister()
    jobs.unregister()
    settings.unregister()
