"""Numbers from glTF's JSON that pygltflib leaves unchecked, such as those inside extensions."""

from __future__ import annotations

import math
from typing import Any


def number(value: Any, default: float) -> float:
    """`value` as a float if it is a finite number, otherwise the default."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if good else default


def numbers(values: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """As many finite numbers as the default has; the default replaces those that are missing."""
    if not isinstance(values, (list, tuple)) or len(values) != len(default):
        return default
    return tuple(number(v, d) for v, d in zip(values, default))


def member(value: Any, name: str) -> dict[str, Any]:
    """value[name] if both are JSON objects, otherwise an empty one."""
    found = value.get(name) if isinstance(value, dict) else None
    return found if isinstance(found, dict) else {}
