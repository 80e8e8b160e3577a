"""The constants that the host and the shaders share, from the headers that both read.

build_shaders.py copies the headers beside the SPIR-V that was built with them.
"""

from __future__ import annotations

import re
from importlib import resources

DEFINITION = re.compile(r"^#define (\w+) (0x[0-9A-Fa-f]+|\d+)u?\b", re.MULTILINE)


def read_constants(text: str) -> dict[str, int]:
    """Name -> value of every `#define NAME integer`."""
    return {name: int(value, 0) for name, value in DEFINITION.findall(text)}


def _shipped_constants() -> dict[str, int]:
    headers = [
        file
        for file in (resources.files("vk_backend") / "spirv").iterdir()
        if file.name.endswith(".h")
    ]
    return {
        name: value
        for header in sorted(headers, key=lambda file: file.name)
        for name, value in read_constants(header.read_text(encoding="utf-8")).items()
    }


CONSTANTS = _shipped_constants()
