"""Values of glTF's JSON: numbers that may be wrong, and JSON as it is written."""

from __future__ import annotations

import json
import sys
from typing import Any

NOT_VALID = "the file is not valid glTF; export it again"
LARGEST = 1e15  # of factors and intensities: products of two must fit 32-bit floats


def is_number(value: Any) -> bool:
    """Return whether `value` is a number that fits a 64-bit float: no boolean, infinity or NaN."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max


def number(value: Any, default: float) -> float:
    """`value` as a float if it is a number up to LARGEST, otherwise the default."""
    return float(value) if is_number(value) and abs(value) <= LARGEST else default


def numbers(values: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """As many numbers as the default has; the default replaces those that are missing."""
    if not isinstance(values, (list, tuple)) or len(values) != len(default):
        return default
    return tuple(number(v, d) for v, d in zip(values, default))


def member(value: Any, name: str) -> dict[str, Any]:
    """value[name] if both are JSON objects, otherwise an empty one."""
    result = value.get(name) if isinstance(value, dict) else None
    return result if isinstance(result, dict) else {}


def minified(value: Any) -> bytes:
    """JSON as it is written into files. Raises ValueError for NaN and infinity."""
    try:
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        return text.encode()
    except UnicodeEncodeError:  # lone surrogates, which only an escape can hold
        return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
