"""Checks the parsed JSON of a file against the annotations of gltf.py."""

from __future__ import annotations

import typing
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any

from gltf_ext.document.gltf import HAS_INDICES, MAY_BE_INFINITE, Root
from gltf_ext.document.json_values import NOT_VALID, is_number
from gltf_ext.errors import MeshletError

LARGEST_INTEGER = 2**53 - 1  # JSON readers that keep numbers as 64-bit floats lose larger ones
TYPE_NAMES = {list: "an array", dict: "an object", str: "a string", bool: "a boolean"}

Check = Callable[[Any, str], Any]  # (JSON, its place for errors) -> the same, checked


def checked(properties: Any) -> Root:
    """Return a document's JSON with values of the annotated types.

    Properties in their order, without those that are null, integers as int, and all required lists
    and objects. Raises MeshletError for a wrong type, length or number.
    """
    root: Root = _check_of(Root)(properties, "")
    return root


def _check_of(hint: Any, length: int | None = None) -> Check:
    """Return the check of an annotation. length: of a list."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is Annotated:
        special = {MAY_BE_INFINITE: _bounds, HAS_INDICES: _with_integers}
        return special.get(arguments[1]) or _check_of(*arguments)
    if typing.get_origin(hint) is list:
        check_item = _check_of(arguments[0])
        return lambda value, where: [
            check_item(v, f"{where}[{i}]") for i, v in enumerate(_list(value, length, where))
        ]
    if typing.get_origin(hint) is dict:
        check_value = _check_of(arguments[1])
        return lambda value, where: {
            name: check_value(v, f"{where}.{name}")
            for name, v in _of_type(value, dict, where).items()
        }
    if typing.is_typeddict(hint):
        return _object_check(hint)
    if hint is int:
        return _integer
    if hint is float:
        return _number
    if hint in (str, bool):
        return lambda value, where: _of_type(value, hint, where)
    return lambda value, where: value


@cache
def _object_check(cls: Any) -> Check:
    hints = typing.get_type_hints(cls, include_extras=True)
    checks = {name: _check_of(hint) for name, hint in hints.items()}
    required = {
        name: typing.get_origin(hint)
        for name, hint in hints.items()
        if name in cls.__required_keys__
    }

    def check(value: Any, where: str) -> dict[str, Any]:
        result = {}
        for name, v in _of_type(value, dict, where or "the document").items():
            if name not in checks:
                result[name] = v
            elif v is not None:
                result[name] = checks[name](v, f"{where}.{name}" if where else name)
        for name, empty in required.items():
            result.setdefault(name, empty())
        return result

    return check


def _of_type(value: Any, kind: type, where: str) -> Any:
    if not isinstance(value, kind):
        raise MeshletError(f"{where} is not {TYPE_NAMES[kind]}", NOT_VALID)
    return value


def _list(value: Any, length: int | None, where: str) -> list[Any]:
    values: list[Any] = _of_type(value, list, where)
    if length is not None and len(values) != length:
        raise MeshletError(f"{where} has {len(values)} numbers instead of {length}", NOT_VALID)
    return values


def _number(value: Any, where: str) -> int | float:
    if not is_number(value):
        raise MeshletError(f"{where} is not a finite number", NOT_VALID)
    number: int | float = value
    return number


def _bounds(value: Any, where: str) -> list[float]:
    return [
        v if type(v) is float else _number(v, f"{where}[{i}]")
        for i, v in enumerate(_of_type(value, list, where))
    ]


def _integer(value: Any, where: str) -> int:
    if not is_number(value) or value != int(value):
        raise MeshletError(f"{where} is not an integer", NOT_VALID)
    if abs(value) > LARGEST_INTEGER:
        raise MeshletError(f"{where} is too large", NOT_VALID)
    return int(value)


def _with_integers(value: Any, where: str) -> Any:
    """Return the JSON of an extension with integers as int: some writers have floats only."""
    if isinstance(value, dict):
        return {name: _with_integers(v, where) for name, v in value.items()}
    if isinstance(value, list):
        return [_with_integers(v, where) for v in value]
    is_integer = type(value) is float and value.is_integer() and abs(value) <= LARGEST_INTEGER
    return int(value) if is_integer else value
