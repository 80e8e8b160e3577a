"""The Mitsuba 3 shape `meshlet_edgebreaker`: renders EXT_meshlet_edgebreaker files compressed.

    import mitsuba as mi, mitsuba_plugin
    mi.set_variant("llvm_ad_rgb")
    scene = mitsuba_plugin.load_scene("scene.glb", cache=0.25)

Importing this package registers the shape, before or after `mi.set_variant`, for `mi.load_dict`,
`mi.load_file` and `mi.load_string`. The manual is docs/mitsuba.md.
"""

from __future__ import annotations

from . import llvm
from .native import statistics
from .scene import load_scene, scene_dict

__all__ = ["load_scene", "scene_dict", "statistics"]

llvm.choose()  # Dr.Jit reads the variable when the first llvm_* variant is set
