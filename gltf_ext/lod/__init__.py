"""Levels of detail: the extension EXT_meshlet_lod, and cuts through its levels.

`open_lod` reads the levels of a file; `cut_for_view`, `cut_at_error` and `cut_at_level` choose the
clusters to draw and the pages that they need; `LodPrimitive.mesh` decodes them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gltf_ext.lod.cuts import Cut, View, cut_at_error, cut_at_level, cut_for_view, error_of
    from gltf_ext.lod.reading import LodPrimitive, open_lod
    from gltf_ext.lod.tables import Tables

__all__ = [
    "Cut",
    "LodPrimitive",
    "Tables",
    "View",
    "cut_at_error",
    "cut_at_level",
    "cut_for_view",
    "error_of",
    "open_lod",
]

_MODULES = {
    "Cut": "cuts",
    "LodPrimitive": "reading",
    "Tables": "tables",
    "View": "cuts",
    "cut_at_error": "cuts",
    "cut_at_level": "cuts",
    "cut_for_view": "cuts",
    "error_of": "cuts",
    "open_lod": "reading",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
