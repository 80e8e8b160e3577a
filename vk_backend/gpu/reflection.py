"""The layouts of structures and the ids of constants in the shaders that are shipped.

SPIR-V is shipped without names: tools/build_shaders.py writes these to spirv/reflection.json. The
host takes the ids of specialisation constants and the dtypes of structures from there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

PACKAGE = "vk_backend"  # has the modules whose names do not say a package


def split_name(module: str) -> tuple[str, str]:
    """(package, module) of NAME, a module of this package, or PACKAGE:NAME."""
    package, _, name = module.rpartition(":")
    return package or PACKAGE, name


def specialization_ids(module: str, constants: Mapping[str, int]) -> dict[int, int]:
    """Id -> value of the constants that a shipped module has, from name -> value.

    module: see split_name. Raises ValueError for a name that no module has.
    """
    package, name = split_name(module)
    modules = shipped_reflection(package)["modules"]
    known = {
        constant
        for other in (*shipped_reflection()["modules"].values(), *modules.values())
        for constant in other["specialization"]
    }
    unknown = sorted(set(constants) - known)
    if unknown:
        raise ValueError(f"no shader has the constants {', '.join(unknown)}")
    ids = modules[name]["specialization"]
    return {ids[constant]: value for constant, value in constants.items() if constant in ids}


@cache
def shipped_reflection(package: str = PACKAGE) -> dict[str, Any]:
    """The contents of a package's spirv/reflection.json; see tools/build_shaders.py."""
    path = resources.files(package) / "spirv" / "reflection.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


@cache
def structure(name: str, package: str = PACKAGE) -> np.dtype:
    """The dtype of a structure of a package's shaders: same members, offsets and size."""
    found = shipped_reflection(package)
    members = found["structures"][name]
    names, offsets, formats = sorted(members, key=members.get), [], []
    for offset, kind, *lengths in map(members.get, names):
        inner = structure(kind, package) if kind in found["structures"] else np.dtype(kind)
        offsets.append(offset)
        formats.append(np.dtype((inner, tuple(lengths))))
    end = offsets[-1] + formats[-1].itemsize
    size = found["strides"].get(name, end)
    return np.dtype({"names": names, "offsets": offsets, "formats": formats, "itemsize": size})
