"""The sources of shaders and their includes, for the builds of SPIR-V and of WGSL."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "shaders"
INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)


def include_folders() -> tuple[Path, ...]:
    """Where compilers look for includes."""
    return SOURCES, ROOT / "codec", ROOT / "bench" / "shaders"


def closure(source: Path) -> list[Path]:
    """A source and all files that it includes, each once.

    Raises RuntimeError if one is missing.
    """
    found = [source]
    for path in found:
        for name in INCLUDE.findall(path.read_text()):
            places = [folder / name for folder in include_folders()]
            included = next((place for place in places if place.exists()), None)
            if included is None:
                raise RuntimeError(f"{path}: cannot find {name}, which it includes")
            if included not in found:
                found.append(included)
    return found
