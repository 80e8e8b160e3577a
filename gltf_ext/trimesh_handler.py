"""Importing this module lets trimesh load files with EXT_meshlet_edgebreaker.

It imports trimesh and registers a handler of scope "primitive_preprocess"; the order of other
imports does not matter. Needs trimesh 4.11, the first version with a registry of handlers. trimesh
passes no options to handlers: `load` here takes a level of detail.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import trimesh
from trimesh.exchange.gltf.extensions import register_handler

from gltf_ext import _codec
from gltf_ext.commands.decompress import decompress
from gltf_ext.compression.extension import EXTENSION
from gltf_ext.compression.streams import streams_of, to_accessor


def decode_into_accessors(context: dict[str, Any]) -> None:
    """Replaces the zeros in the primitive's accessors by the decoded arrays.

    context: trimesh's PrimitivePreprocessContext. trimesh turns a ValueError into a warning.
    """
    extension, primitive, accessors = context["data"], context["primitive"], context["accessors"]
    blob = bytes(context["views"][extension["bufferView"]])
    streams = _codec.Decoder(blob).streams
    triangles, values = _codec.decode_values(blob)
    sets = [
        (extension["attributes"], primitive["attributes"]),
        *zip(extension.get("targets", []), primitive.get("targets", [])),
    ]
    for first_streams, indices in sets:
        for name, first in first_streams.items():
            placeholder = accessors[indices[name]]
            components = math.prod(placeholder.shape[1:])
            used = [values[s] for s in streams_of(first, components, streams)]
            decoded = to_accessor(used, placeholder.dtype)
            accessors[indices[name]] = decoded.reshape(placeholder.shape)
    accessors[primitive["indices"]] = triangles.reshape(-1)


def load(
    path: str | os.PathLike[str],
    *,
    level: int | None = None,
    error: float | str | None = None,
    **options: Any,
) -> Any:
    """trimesh.load of a compressed file at a level of detail, or with at most this error.

    level, error: as gltf_ext.decompress takes them; options: of trimesh.load. Raises MeshletError
    when the file is malformed or not compressed, OSError when it cannot be read.
    """
    with TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.glb"
        decompress(path, plain, level=level, error=error)
        return trimesh.load(plain, **options)


register_handler(EXTENSION, scope="primitive_preprocess")(decode_into_accessors)
