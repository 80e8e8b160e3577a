"""The constants of shaders/constants.h, from the copy beside the SPIR-V that was built with them."""

from __future__ import annotations

import re
from importlib import resources

DEFINITION = re.compile(r"^#define (\w+) (0x[0-9A-Fa-f]+|\d+)u?\b", re.MULTILINE)


def read_constants(text: str) -> dict[str, int]:
    """Name -> value of every `#define NAME integer`."""
    return {name: int(value, 0) for name, value in DEFINITION.findall(text)}


CONSTANTS = read_constants((resources.files(__package__) / "spirv" / "constants.h").read_text())
