"""Lets trimesh load compressed primitives, whichever of the two packages is imported first."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import math
import sys
from typing import Any

EXTENSIONS_MODULE = "trimesh.exchange.gltf.extensions"
EXTENSION = "EXT_meshlet_edgebreaker"


def register() -> None:
    """Register the handler now when trimesh's registry is loaded, else as soon as it will be."""
    module = sys.modules.get(EXTENSIONS_MODULE)
    if module is not None:
        _register_with(module)
    elif not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


def _register_with(module: Any) -> None:
    module.register_handler(EXTENSION, scope="primitive_preprocess")(decode_into_accessors)


class _Finder(importlib.abc.MetaPathFinder):
    """Finds trimesh's registry module once, as the other finders do, and registers after it has run."""

    def find_spec(
        self, name: str, path: Any, target: Any = None
    ) -> importlib.machinery.ModuleSpec | None:
        if name != EXTENSIONS_MODULE:
            return None
        sys.meta_path.remove(self)
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        if spec is not None and spec.loader is not None:
            run = spec.loader.exec_module

            def exec_module(module: Any) -> None:
                run(module)
                _register_with(module)

            spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec


def decode_into_accessors(context: dict[str, Any]) -> None:
    """Handler of scope "primitive_preprocess": replaces the primitive's zero-filled accessors by the decoded arrays.

    A ValueError raised here becomes trimesh's warning.
    """
    from gltf_ext import _codec
    from gltf_ext.compression.streams import Stream, streams_of, to_accessor

    extension, primitive, accessors = context["data"], context["primitive"], context["accessors"]
    blob = bytes(context["views"][extension["bufferView"]])
    streams = [Stream.from_row(row) for row in _codec.Decoder(blob).streams]
    triangles, values = _codec.decode_values(blob)
    groups = [
        (extension["attributes"], primitive["attributes"]),
        *zip(extension.get("targets", []), primitive.get("targets", [])),
    ]
    for first_streams, indices in groups:
        for name, first in first_streams.items():
            placeholder = accessors[indices[name]]
            components = math.prod(placeholder.shape[1:])
            decoded = to_accessor(
                [values[s] for s in streams_of(first, components, streams)], placeholder.dtype
            )
            accessors[indices[name]] = decoded.reshape(placeholder.shape)
    accessors[primitive["indices"]] = triangles.reshape(-1)
