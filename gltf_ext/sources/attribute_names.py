"""Names of attributes: their semantics, and those of morph targets as "targets[i].NAME"."""

from __future__ import annotations

import re
from typing import TypeVar

T = TypeVar("T")
OF_TARGET = re.compile(r"targets\[\d+\]\.")  # before the name of a morph target's attribute


def is_of_target(name: str) -> bool:
    """Return whether a name is "targets[i].NAME"."""
    return OF_TARGET.match(name) is not None


def local_name(name: str) -> str:
    """Return the name of an attribute without "targets[i].", if it is of a morph target."""
    return OF_TARGET.sub("", name, count=1) if is_of_target(name) else name


def semantic(name: str) -> str:
    """TEXCOORD_1 -> TEXCOORD; custom names (leading underscore) -> "_"."""
    return "_" if name.startswith("_") else name.rsplit("_", 1)[0]


def pair_names(sets: list[dict[str, T]]) -> list[tuple[str, T]]:
    """Return (name, value) of every attribute, then of the targets as "targets[i].NAME"."""
    return [
        (f"targets[{i - 1}].{name}" if i else name, value)
        for i, values in enumerate(sets)
        for name, value in values.items()
    ]
