# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings: arguments of Blender's glTF operators, as those of Draco are.

So they are in presets of the dialog, in "Remember Export Settings", in the exporters of collections
and in scripts. What a script sets in the scene holds for exports that do not say otherwise.
"""

import bpy

from gltf_ext.options import AUTO, OPTIONS

_OPTIONS = {option.name: option for option in OPTIONS}
_MM = 0.001  # metres, the unit of glTF
BITS = ("position_bits", "normal_bits", "texcoord_bits", "color_bits", "weight_bits")
# Quality -> options of compress. Bits that are not here are chosen for each mesh.
QUALITIES = {
    "FILM": {
        "position_bits": 20,
        "normal_bits": 14,
        "texcoord_bits": 16,
        "color_bits": 16,
        "weight_bits": 16,
    },
    "REALTIME": {},
    "WEB": {"transport": True},
}
QUALITY_ITEMS = (
    ("FILM", "Film", "The finest steps: for close-ups, renders and models that are edited again"),
    (
        "REALTIME",
        "Real Time",
        "Steps that do not show, chosen for each mesh: for games and viewers",
    ),
    ("WEB", "Web", "As Real Time, and packed for download, a tenth to a third smaller"),
)
DETAIL_ITEMS = (
    ("FULL", "Full", "All triangles"),
    ("LEVEL", "Level", "One level of detail; 0 has all triangles"),
    ("ERROR", "Error", "The coarsest mesh with at most an error"),
    ("PROXY", "Proxy", "All triangles in renders and in edit mode, and a level in the viewport"),
    ("OBJECTS", "Objects", "All levels as objects, in collections LOD1, LOD2 and so on"),
)


def _description(name):
    help = _OPTIONS[name].help
    return help[0].upper() + help[1:]


def _bits(name, label):
    """A property with the largest number of bits of `compress`; 0 leaves them to the quality."""
    return bpy.props.IntProperty(
        name=label,
        description=f"{_description(name)}; 0 leaves them to the quality",
        min=0,
        max=_OPTIONS[name].limits[1],
        default=0,
    )


def _millimetres(label, description, default=0.0):
    return bpy.props.FloatProperty(
        name=label, description=description, min=0.0, default=default, precision=3, step=10
    )


# Name -> property of the export; most names are those of gltf_ext.compress.
EXPORT = {
    "enabled": bpy.props.BoolProperty(
        name="Meshlet Compression",
        description="Compress triangle meshes with EXT_meshlet_edgebreaker. "
        "Other programs need support for this extension, or the fallback",
    ),
    "quality": bpy.props.EnumProperty(
        name="Quality",
        description="What the model is for; bits and a step given below count instead",
        items=QUALITY_ITEMS,
        default="REALTIME",
    ),
    "step": _millimetres(
        "Step (mm)",
        "Positions are rounded to multiples of so many millimetres; 0 leaves it to the bits",
    ),
    "position_bits": _bits("position_bits", "Position Bits"),
    "normal_bits": _bits("normal_bits", "Normal"),
    "texcoord_bits": _bits("texcoord_bits", "UV"),
    "color_bits": _bits("color_bits", "Color"),
    "weight_bits": _bits("weight_bits", "Skin Weight"),
    "scene_grid": bpy.props.BoolProperty(
        name="One Scene Grid",
        description="Round positions of all meshes to the same grid: objects that touch, and have "
        "the same origin and scale, stay together",
    ),
    "lod": bpy.props.BoolProperty(name="Levels of Detail", description=_description("lod")),
    "lod_limit": _millimetres(
        "Max Error (mm)", "Levels end at this error in millimetres; 0 sets no limit"
    ),
    "transport": bpy.props.BoolProperty(
        name="Pack for Download", description=_description("transport")
    ),
    "fallback": bpy.props.BoolProperty(name="Fallback", description=_description("fallback")),
    "effort": bpy.props.EnumProperty(
        name="Effort",
        description=_description("effort"),
        items=(
            ("NORMAL", "Normal", "The smallest files"),
            ("FAST", "Fast", "Less time for somewhat larger files"),
        ),
        default="NORMAL",
    ),
}
# Name -> property of the import.
IMPORT = {
    "detail": bpy.props.EnumProperty(
        name="Detail",
        description="How much to import of a file with levels of detail",
        items=DETAIL_ITEMS,
        default="FULL",
    ),
    "level": bpy.props.IntProperty(
        name="Level",
        description="0 is the finest; meshes with fewer take their last",
        min=0,
        default=1,
    ),
    "error": _millimetres("Error (mm)", "The largest distance to the full mesh", 1.0),
}
EXPORT_PREFIX, IMPORT_PREFIX = "export_meshlet_", "import_meshlet_"


def arguments(properties, prefix):
    """Name of an operator's argument -> its property."""
    return {prefix + name: value for name, value in properties.items()}


class MeshletSettings(bpy.types.PropertyGroup):
    """Settings of the scene: scripts set them for exports that do not name theirs."""

    __annotations__ = dict(EXPORT)


def take_from_scene(operator, scene):
    """Gives an export the settings that a script has set in the scene, and it has not."""
    settings = scene.gltf_meshlet
    for name in EXPORT:
        argument = EXPORT_PREFIX + name
        if settings.is_property_set(name) and not operator.properties.is_property_set(argument):
            setattr(operator, argument, getattr(settings, name))


def compress_options(operator):
    """Keyword arguments of gltf_ext.compress for an export."""
    values = {name: getattr(operator, EXPORT_PREFIX + name) for name in EXPORT}
    options = dict(QUALITIES[values["quality"]])
    options.update({name: values[name] for name in BITS if values[name] >= _lowest(name)})
    if values["step"]:
        options.update(step=values["step"] * _MM, position_bits=AUTO)
    if values["lod"] and values["lod_limit"]:
        options["lod_limit"] = values["lod_limit"] * _MM
    if values["transport"]:
        options["transport"] = True
    return {
        **options,
        "lod": values["lod"],
        "fallback": values["fallback"],
        "grid": "scene" if values["scene_grid"] else "mesh",
        "effort": values["effort"].lower(),
        "images": "keep" if operator.export_format == "GLTF_SEPARATE" else "embed",
    }


def detail_options(import_settings):
    """(kind of detail, keyword arguments of gltf_ext.load) of an import."""
    values = {
        name: import_settings.get(IMPORT_PREFIX + name, default)
        for name, default in (("detail", "FULL"), ("level", 0), ("error", 0.0))
    }
    if values["detail"] == "ERROR":
        return "ERROR", {"error": values["error"] * _MM}
    return values["detail"], {"level": values["level"]}


def _lowest(name):
    return _OPTIONS[name].limits[0]


def register():
    bpy.utils.register_class(MeshletSettings)
    bpy.types.Scene.gltf_meshlet = bpy.props.PointerProperty(type=MeshletSettings)


def unregister():
    del bpy.types.Scene.gltf_meshlet
    bpy.utils.unregister_class(MeshletSettings)
