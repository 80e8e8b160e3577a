# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds arguments, panels and work to the two operators of Blender's glTF add-on.

Its hooks cannot: they have no arguments, no place after the file is written, and are called only
for add-ons that are enabled in the preferences. So the operators are registered again, with more
arguments and with methods that call the former ones. Disabling the extension undoes that.
"""

from contextlib import contextmanager

import bpy

from . import exporter, panel, settings
from .importer import glTF2ImportUserExtension

_undo = []  # functions that undo a change each


def register():
    from io_scene_gltf2 import ExportGLTF2, ImportGLTF2

    _extend(
        ExportGLTF2,
        settings.arguments(settings.EXPORT, settings.EXPORT_PREFIX),
        {"invoke": _invoke_export, "execute": _execute_export, "draw": _draw_export},
    )
    _extend(
        ImportGLTF2,
        settings.arguments(settings.IMPORT, settings.IMPORT_PREFIX),
        {"unit_import": _unit_import, "draw": _draw_import},
    )


def unregister():
    while _undo:
        _undo.pop()()


def _extend(operator, arguments, methods):
    """Adds arguments, name -> property, and replaces methods, name -> function of the former."""
    names = [name for name in methods if name in vars(operator)]
    own = {name: vars(operator)[name] for name in names}
    with _unregistered(operator):
        operator.__annotations__.update(arguments)
        for name, wrap in methods.items():
            setattr(operator, name, wrap(getattr(operator, name)))

    def undo():
        with _unregistered(operator):
            for name in arguments:
                del operator.__annotations__[name]
            for name in methods:
                delattr(operator, name)  # the other ones are of a base class
            for name, method in own.items():
                setattr(operator, name, method)

    _undo.append(undo)


@contextmanager
def _unregistered(operator):
    """Unregisters an operator while it changes; not if its add-on is disabled."""
    is_registered = "bl_rna" in vars(operator)
    if is_registered:
        bpy.utils.unregister_class(operator)
    yield
    if is_registered:
        bpy.utils.register_class(operator)


# --- export ---


def _invoke_export(former):
    def invoke(self, context, event):
        settings.take_from_scene(self, context.scene)
        return former(self, context, event)

    return invoke


def _execute_export(former):
    def execute(self, context):
        settings.take_from_scene(self, context.scene)
        return exporter.export(self, context, former)

    return execute


def _draw_export(former):
    def draw(self, context):
        former(self, context)
        panel.draw_export(self, self.layout)

    return draw


# --- import ---


def _unit_import(former):
    def unit_import(self, filename, import_settings):
        hooks = import_settings["import_user_extensions"]
        ours = next((h for h in hooks if isinstance(h, glTF2ImportUserExtension)), None)
        if ours is None:  # enabled without the preferences
            ours = glTF2ImportUserExtension()
            hooks.append(ours)
        status = former(self, filename, import_settings)
        for kind, text in ours.messages:
            self.report({kind}, text)
        return status

    return unit_import


def _draw_import(former):
    def draw(self, context):
        former(self, context)
        panel.draw_import(self, self.layout)

    return draw
