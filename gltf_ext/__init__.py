"""Triangle meshlets compressed with the glTF extension EXT_meshlet_edgebreaker.

Importing this package is cheap: each function loads its module on first use. To let trimesh load
compressed files, `import gltf_ext.trimesh_handler`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gltf_ext.batches.run import batch
    from gltf_ext.checks.validate import validate
    from gltf_ext.checks.verify import verify
    from gltf_ext.commands.compress import compress
    from gltf_ext.commands.decompress import decompress
    from gltf_ext.commands.inspect import inspect
    from gltf_ext.commands.load import MeshletDecoder, decoders, load
    from gltf_ext.commands.losses import compress_warnings, steps_text
    from gltf_ext.commands.transcode import transcode
    from gltf_ext.errors import MeshletError, NothingToCompress
    from gltf_ext.sources.primitives import Primitive

__version__ = "0.2.0.dev0"
__all__ = [
    "MeshletDecoder",
    "MeshletError",
    "NothingToCompress",
    "Primitive",
    "batch",
    "compress",
    "compress_warnings",
    "decoders",
    "decompress",
    "inspect",
    "load",
    "steps_text",
    "transcode",
    "validate",
    "verify",
]

_MODULES = {
    "MeshletDecoder": "commands.load",
    "MeshletError": "errors",
    "NothingToCompress": "errors",
    "Primitive": "sources.primitives",
    "batch": "batches.run",
    "compress": "commands.compress",
    "compress_warnings": "commands.losses",
    "decoders": "commands.load",
    "decompress": "commands.decompress",
    "inspect": "commands.inspect",
    "load": "commands.load",
    "steps_text": "commands.losses",
    "transcode": "commands.transcode",
    "validate": "checks.validate",
    "verify": "checks.verify",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_MODULES])
