"""Triangle meshlets compressed with EXT_meshlet_edgebreaker: glTF extension, codec and command line.

Importing this package is cheap and lets trimesh, whenever it is imported, load compressed files.
"""

from __future__ import annotations

import importlib
from typing import Any

from . import trimesh_handler

__version__ = "0.2.0.dev0"

_HOME = {
    "compress": "compression.compressor",
    "decompress": "compression.decompressor",
    "inspect": "compression.inspection",
    "verify": "compression.verification",
    "validate": "compression.validation",
    "load": "compression.loading",
    "decoders": "compression.loading",
    "MeshletDecoder": "compression.loading",
    "Primitive": "compression.primitives",
    "MeshletError": "errors",
}
__all__ = sorted(_HOME)

trimesh_handler.register()


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
