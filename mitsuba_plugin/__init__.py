"""Mitsuba 3 renders files with EXT_meshlet_edgebreaker without decompressing them: the shape `meshlet_edgebreaker`.

    import mitsuba as mi, mitsuba_plugin
    mi.set_variant("llvm_ad_rgb")
    scene = mitsuba_plugin.load_scene("scene.glb", cache=0.25)

Importing this package registers the shape, before or after `mi.set_variant`, for `mi.load_dict`, `mi.load_file` and
`mi.load_string`. docs/mitsuba.md has the rest.
"""

from __future__ import annotations

from . import llvm
from .native import statistics
from .scene import load_scene, scene_dict

__all__ = ["load_scene", "scene_dict", "statistics"]

llvm.choose()  # Dr.Jit looks when the first llvm_* variant is set
