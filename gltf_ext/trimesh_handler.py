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
from gltf_ext.attributes.extension import EQUAL_VERTICES
from gltf_ext.attributes.join import decode_view
from gltf_ext.attributes.streams import streams_of, to_accessor
from gltf_ext.commands.decompress import decompress
from gltf_ext.document.document import DAMAGED
from gltf_ext.document.transport import is_packed, unpack
from gltf_ext.errors import MeshletError
from gltf_ext.sources.primitives import EXTENSION


class _Undecoded:
    """Takes the place of an array that cannot be decoded: any use of it raises the reason."""

    def __init__(self, error: MeshletError) -> None:
        self._error = error

    def __getattr__(self, name: str) -> Any:
        raise self._error

    def __len__(self) -> int:
        raise self._error

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise self._error


def decode_into_accessors(context: dict[str, Any]) -> None:
    """Replace the zeros in the primitive's accessors by the decoded arrays.

    context: trimesh's PrimitivePreprocessContext. If the primitive cannot be decoded, loading it
    raises MeshletError. trimesh swallows what a handler raises and would go on with the zeros.
    """
    try:
        arrays = _decode(context)
    except Exception as error:
        problem = str(error) if isinstance(error, ValueError) else repr(error)
        refusal = _Undecoded(
            MeshletError(f"a primitive with {EXTENSION} cannot be decoded: {problem}", DAMAGED)
        )
        primitive = context["primitive"]
        numbers = [primitive.get("indices"), *primitive["attributes"].values()]
        arrays = dict.fromkeys((n for n in numbers if n is not None), refusal)
    for number, array in arrays.items():
        context["accessors"][number] = array


def _decode(context: dict[str, Any]) -> dict[int, Any]:
    """Return number of an accessor -> its decoded array, for all accessors of the primitive."""
    extension, primitive, accessors = context["data"], context["primitive"], context["accessors"]
    view = bytes(context["views"][extension["bufferView"]])
    blob = unpack(view) if is_packed(view) else view
    table = extension.get(EQUAL_VERTICES)
    equal_vertices = None if table is None else bytes(context["views"][table["bufferView"]])
    decoder = _codec.Decoder(blob)
    streams, indices = decoder.streams, primitive["indices"]
    _require_count(accessors[indices], 3 * decoder.triangle_count)
    triangles, values = decode_view(blob, extension.get("sourceVertices"), equal_vertices)
    arrays = {indices: triangles.reshape(-1, *accessors[indices].shape[1:])}
    sets = [
        (extension["attributes"], primitive["attributes"]),
        *zip(extension.get("targets", []), primitive.get("targets", []), strict=True),
    ]
    for first_streams, names in sets:
        for name, number in names.items():
            placeholder = accessors[number]
            _require_count(placeholder, decoder.vertex_count)
            components = math.prod(placeholder.shape[1:])
            columns = [values[s] for s in streams_of(first_streams[name], components, streams)]
            array = to_accessor(columns, placeholder.dtype)
            arrays[number] = array.reshape(-1, *placeholder.shape[1:])
    return arrays


def _require_count(placeholder: Any, count: int) -> None:
    """Raise ValueError unless an accessor has as many elements as the blobs."""
    if len(placeholder) != count:
        raise ValueError(f"an accessor has {len(placeholder)} elements instead of {count}")


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
