"""pygltflib's GLTF2 objects <-> documents, without losing or inventing a property.

pygltflib's own functions that read and write files drop properties that they do not know, and empty
objects. Here, such properties of an object are in its attribute `other_properties`; another keeps
the names of all that the file has, in its order.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import sys
import typing
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeGuard

from gltf_ext.document.buffer_layout import pack
from gltf_ext.document.container import json_of, parse_json
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError

if TYPE_CHECKING:
    import pygltflib

File: TypeAlias = "str | os.PathLike[str]"
Model: TypeAlias = "File | pygltflib.GLTF2"
OTHERS, NAMES = "other_properties", "_property_names"
STATED = ("version", "generator")  # written even if they are pygltflib's defaults
DATA_URI = "data:application/octet-stream;base64,"


# --- reading ---


def is_path(model: Model) -> TypeGuard[File]:
    """Return whether the model is a path. Raises TypeError for what is no model at all."""
    if isinstance(model, (str, os.PathLike)):
        return True
    import pygltflib

    if not isinstance(model, pygltflib.GLTF2):
        raise TypeError(f"a model is a path or a pygltflib.GLTF2, not {type(model).__name__}")
    return False


def name_of(model: Model) -> str:
    """Return the path, or that of the file from which the object was loaded, for messages."""
    if is_path(model):
        return str(model)
    name = getattr(model, "_name", "")
    return str(Path(getattr(model, "_path", ""), name)) if name else "GLTF2"


def size_of(model: Model) -> int:
    """Return the bytes of the file, or of its JSON and blob. Raises MeshletError, OSError."""
    if is_path(model):
        return os.path.getsize(model)
    in_memory: Any = model
    return len(_text(in_memory)) + len(in_memory.binary_blob() or b"")


def read_gltf2(model: pygltflib.GLTF2) -> Document:
    """Return a document of an object in memory, which stays as it is.

    Relative uris refer to the folder from which it was loaded, else to the current one. Raises
    MeshletError for a malformed object.
    """
    blob = model.binary_blob()
    binary = None if blob is None else memoryview(bytes(blob))
    return parse_json(_text(model), binary, Path(getattr(model, "_path", "")))


def _text(model: pygltflib.GLTF2) -> bytes:
    try:
        return json.dumps(_json_of(model), separators=(",", ":")).encode()
    except (TypeError, ValueError, RecursionError):
        raise MeshletError(
            "the GLTF2 holds values that JSON cannot",
            "use Python's own numbers, lists and dictionaries",
        ) from None


def _json_of(value: Any) -> Any:
    import pygltflib

    if isinstance(value, (list, tuple)):
        return [_json_of(v) for v in value]
    if isinstance(value, dict):
        return {name: _json_of(v) for name, v in value.items()}
    if isinstance(value, pygltflib.Attributes):
        return {name: v for name, v in vars(value).items() if v is not None}
    if not dataclasses.is_dataclass(value):
        return value
    names, others = getattr(value, NAMES, ()), getattr(value, OTHERS, {})
    defaults = {field.name: _default(field) for field in dataclasses.fields(value)}
    result = {}
    for name in dict.fromkeys([*names, *others, *defaults]):
        if name in others:
            result[name] = _json_of(others[name])
            continue
        v = getattr(value, name, None)
        is_implied = v in (defaults.get(name), {}) and name not in (*names, *STATED)
        if v is not None and v != [] and not is_implied:  # glTF has no empty lists
            result[name] = _json_of(v)
    return result


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is dataclasses.MISSING:
        return field.default
    return field.default_factory()


# --- writing ---


def to_gltf2(document: Document) -> tuple[pygltflib.GLTF2, int, int]:
    """Return (new object, bytes of its JSON and binary blob, bytes of the fallback).

    All buffers are one, in the binary blob. A fallback is another, in a data: uri.
    """
    import pygltflib

    (pieces, *_), fallback = pack(document, sys.maxsize, sys.maxsize)
    binary, fallback_bytes = b"".join(pieces), b"".join(fallback)
    size = len(json_of(document)) + len(binary)
    if fallback_bytes:
        document.buffers[-1]["uri"] = DATA_URI + base64.b64encode(fallback_bytes).decode()
    result = _object(pygltflib.GLTF2, document.json)
    result.set_binary_blob(binary)
    result._path = document.base
    return result, size, len(fallback_bytes)


def _object(cls: Any, properties: Any) -> Any:
    """Return an object of one of pygltflib's classes, with all objects in it."""
    hints = _hints(cls)
    values = {name: _value(hints[name], v) for name, v in properties.items() if name in hints}
    if "generator" in hints:
        values.setdefault("generator", None)  # else the object claims pygltflib
    result = cls(**values)
    others = {name: v for name, v in properties.items() if name not in hints}
    if others:
        setattr(result, OTHERS, others)
    setattr(result, NAMES, tuple(properties))
    return result


@cache
def _hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _value(hint: Any, value: Any) -> Any:
    """Return a value as an attribute of the annotated type."""
    import pygltflib

    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is typing.Union:
        return _value(arguments[0], value)
    if typing.get_origin(hint) is list:
        return [_value(arguments[0], v) for v in value]
    if hint is pygltflib.Attributes:
        result = pygltflib.Attributes()
        others = {name: None for name in vars(result) if name not in value}
        result.__dict__ = {**value, **others}  # in the order of the file
        return result
    return _object(hint, value) if dataclasses.is_dataclass(hint) else value
