"""JSON <-> pygltflib objects, without losing or inventing a property.

pygltflib fills in defaults, drops unknown properties and empty objects inside extras, and crashes
on unexpected types. `from_json` checks the types against pygltflib's own annotations and keeps the
JSON of each object in its attribute `read_from`; `to_json` writes it with what has been set since.
"""

from __future__ import annotations

import dataclasses
import json
import typing
from collections.abc import Callable
from functools import cache
from typing import Any

import pygltflib

from gltf_ext.document.json_values import is_number
from gltf_ext.errors import MeshletError

NOT_VALID = "the file is not valid glTF; export it again"
# Written even when they are empty or equal pygltflib's default.
REQUIRED = {"asset", "version", "attributes"}
# Numbers in the lists that have a fixed length.
LENGTHS = {
    "translation": 3,
    "rotation": 4,
    "scale": 3,
    "matrix": 16,
    "baseColorFactor": 4,
    "emissiveFactor": 3,
}
LARGEST_INTEGER = 2**53 - 1  # JSON readers that keep numbers as 64-bit floats lose larger ones
# These attributes come first, in this order; the others follow in the order of the file.
FIRST_ATTRIBUTES = tuple(vars(pygltflib.Attributes()))
TYPE_NAMES = {list: "an array", dict: "an object", str: "a string", bool: "a boolean"}

Decode = Callable[[Any, str], Any]  # (JSON, its place for errors) -> value


# --- reading ---


def from_json(cls: type, properties: Any, where: str) -> Any:
    """A pygltflib object of class `cls`, with all objects in it.

    where: the object's place in the file, for errors. Raises MeshletError for a wrong type, length
    or number.
    """
    _check(properties, dict, where or "the document")
    decoders = _field_decoders(cls)
    given: dict[str, Any] = {"attributes": {}} if cls is pygltflib.Primitive else {}
    for name, value in properties.items():
        place = f"{where}.{name}" if where else name
        if name == "extensions":
            _check(value, dict, place)
        if name in decoders and value is not None:
            given[name] = decoders[name](value, place)
    result = cls(**given)
    result.read_from = properties
    return result


@cache
def _field_decoders(cls: type) -> dict[str, Decode]:
    hints = typing.get_type_hints(cls)
    decoders = {
        field.name: _decoder(hints[field.name], LENGTHS.get(field.name))
        for field in dataclasses.fields(cls)
    }
    if cls is pygltflib.Accessor:
        decoders["min"] = decoders["max"] = _bounds
    return decoders


def _decoder(hint: Any, length: int | None = None) -> Decode:
    """Checks and converts a value for a type annotation of pygltflib. length: of a list."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is typing.Union:
        return _decoder(arguments[0], length)
    if typing.get_origin(hint) is list:
        decode_item = _decoder(arguments[0])
        return lambda value, where: [
            decode_item(v, f"{where}[{i}]") for i, v in enumerate(_list(value, length, where))
        ]
    if hint is pygltflib.Attributes:
        return _attributes
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return lambda value, where: from_json(hint, value, where)
    if hint is int:
        return lambda value, where: _integer(value, where)
    if hint is float:
        return lambda value, where: _number(value, where)
    if hint in (str, bool):
        return lambda value, where: _check(value, hint, where)
    return lambda value, where: value


def _check(value: Any, kind: type, where: str) -> Any:
    if not isinstance(value, kind):
        raise MeshletError(f"{where} is not {TYPE_NAMES[kind]}", NOT_VALID)
    return value


def _list(value: Any, length: int | None, where: str) -> list[Any]:
    values: list[Any] = _check(value, list, where)
    if length is not None and len(values) != length:
        raise MeshletError(f"{where} has {len(values)} numbers instead of {length}", NOT_VALID)
    return values


def _number(value: Any, where: str) -> int | float:
    if not is_number(value):
        raise MeshletError(f"{where} is not a finite number", NOT_VALID)
    number: int | float = value
    return number


def _bounds(value: Any, where: str) -> list[float]:
    """NaN and infinity are common here; readers compute the bounds where they matter."""
    return [
        v if type(v) is float else _number(v, f"{where}[{i}]")
        for i, v in enumerate(_check(value, list, where))
    ]


def _integer(value: Any, where: str) -> int:
    if not is_number(value) or value != int(value):
        raise MeshletError(f"{where} is not an integer", NOT_VALID)
    if abs(value) > LARGEST_INTEGER:
        raise MeshletError(f"{where} is too large", NOT_VALID)
    return int(value)


def _attributes(properties: Any, where: str) -> dict[str, int]:
    _check(properties, dict, where)
    names = [name for name in FIRST_ATTRIBUTES if name in properties]
    return {
        name: _integer(properties[name], f"{where}.{name}")
        for name in dict.fromkeys([*names, *properties])
    }


# --- writing ---


def to_json(value: Any) -> Any:
    """JSON of a pygltflib object, of a list of them, or of plain JSON."""
    if isinstance(value, list):
        return [to_json(v) for v in value]
    if not dataclasses.is_dataclass(value):
        return value
    source = getattr(value, "read_from", {})
    cls: Any = type(value)
    defaults = _defaults(cls)
    result = {name: v for name, v in source.items() if name not in defaults}
    for name, default in defaults.items():
        current = getattr(value, name)
        is_empty = current is None or current in ([], {})
        is_invented = current == default and name not in source
        if name in REQUIRED or not (is_empty or is_invented):
            result[name] = to_json(current)
    return result


@cache
def _defaults(cls: Any) -> dict[str, Any]:
    return {
        field.name: field.default
        if field.default_factory is dataclasses.MISSING
        else field.default_factory()
        for field in dataclasses.fields(cls)
    }


def minified(value: Any) -> bytes:
    """JSON as it is written into files. Raises ValueError for NaN and infinity."""
    try:
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        return text.encode()
    except UnicodeEncodeError:  # lone surrogates, which only an escape can hold
        return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
