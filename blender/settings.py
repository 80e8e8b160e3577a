# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The export options, stored in the scene and so in the .blend file."""

import bpy

from gltf_ext.options import AUTO, OPTIONS

_OPTIONS = {option.name: option for option in OPTIONS}


def _description(name):
    help = _OPTIONS[name].help
    return help[0].upper() + help[1:]


def _bits(name, label):
    """A property with the largest number of bits of `compress`; below its least, they are auto."""
    low, high = _OPTIONS[name].limits
    return bpy.props.IntProperty(
        name=label,
        description=f"{_description(name)}; below {low}, they are chosen for each mesh",
        min=0,
        max=high,
        default=0,
    )


class MeshletSettings(bpy.types.PropertyGroup):
    """Options of gltf_ext.compress, with their names there; `enabled` turns compression on."""

    enabled: bpy.props.BoolProperty(
        name="Meshlet Compression",
        description="Compress triangle meshes with EXT_meshlet_edgebreaker. "
        "Other programs need support for this extension, or the fallback",
    )
    position_bits: _bits("position_bits", "Position Bits")
    normal_bits: _bits("normal_bits", "Normal")
    texcoord_bits: _bits("texcoord_bits", "UV")
    color_bits: _bits("color_bits", "Color")
    weight_bits: _bits("weight_bits", "Skin Weight")
    fallback: bpy.props.BoolProperty(name="Fallback", description=_description("fallback"))
    lod: bpy.props.BoolProperty(name="Levels of Detail", description=_description("lod"))

    def compress_options(self):
        """Keyword arguments of gltf_ext.compress."""
        names = MeshletSettings.__annotations__
        return {name: self._value(name) for name in names if name != "enabled"}

    def _value(self, name):
        """The value of an option; bits below the least are auto."""
        value, limits = getattr(self, name), _OPTIONS[name].limits
        return AUTO if limits and value < limits[0] else value


def register():
    bpy.utils.register_class(MeshletSettings)
    bpy.types.Scene.gltf_meshlet = bpy.props.PointerProperty(type=MeshletSettings)


def unregister():
    del bpy.types.Scene.gltf_meshlet
    bpy.utils.unregister_class(MeshletSettings)
