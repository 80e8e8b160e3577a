"""Scenes with EXT_mesh_gpu_instancing, and the same with a node for each instance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import ball

EXTENSION = "EXT_mesh_gpu_instancing"
OUTER = {"translation": [0.3, -0.2, 0.1], "rotation": [0, 0.28, 0, 0.96], "scale": [1, 1.5, 1]}


def scattered(count: int) -> dict[str, np.ndarray]:
    """TRANSLATION, ROTATION and SCALE of instances; every fifth to seventh is mirrored."""
    random = np.random.default_rng(5)
    turns = random.normal(size=(count, 4))
    scale = random.uniform(0.2, 0.6, (count, 3))
    scale[np.arange(count) % 7 >= 5, 0] *= -1
    return {
        "TRANSLATION": random.uniform(-3, 3, (count, 3)).astype(np.float32),
        "ROTATION": (turns / np.linalg.norm(turns, axis=1, keepdims=True)).astype(np.float32),
        "SCALE": scale.astype(np.float32),
    }


def nodes_of(attributes: dict[str, int]) -> dict[str, Any]:
    """Members of a node with the extension."""
    return {"extensions": {EXTENSION: {"attributes": attributes}}}


def write_instanced(
    path: Path,
    places: dict[str, np.ndarray],
    *,
    explicit: bool = False,
    size: tuple[int, int] = (20, 14),
    **options: Any,
) -> Path:
    """Writes a compressed file: a mesh of two primitives, within a node with a transform.

    explicit: a node for each instance instead of the extension.
    """
    builder = Builder()
    positions, triangles = ball(*size)
    builder.mesh({"POSITION": positions, "NORMAL": positions}, triangles, material=0)
    sheet, cells = grid_mesh(12, 9)
    second = builder.mesh({"POSITION": sheet * np.float32(1.4)}, cells, material=1)
    builder.properties["meshes"].pop()
    builder.properties["meshes"][0]["primitives"].append(second)
    builder.properties["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.3, 0.2, 1], "metallicFactor": 0.0}},
        {"pbrMetallicRoughness": {"metallicFactor": 0.0}, "doubleSided": True},
    ]
    count = len(places["TRANSLATION"])
    if explicit:
        names = {"TRANSLATION": "translation", "ROTATION": "rotation", "SCALE": "scale"}
        below = [
            {"mesh": 0, **{names[name]: values[k].tolist() for name, values in places.items()}}
            for k in range(count)
        ]
    else:
        accessors = {name: builder.accessor(values) for name, values in places.items()}
        below = [{"mesh": 0, **nodes_of(accessors)}]
        builder.properties["extensionsUsed"] = [EXTENSION]
    builder.properties["nodes"] = [*below, {**OUTER, "children": list(range(len(below)))}]
    builder.properties["scenes"] = [{"nodes": [len(below)]}]
    gltf_ext.compress(builder.write(path.with_name(f"raw_{path.name}")), path, **options)
    return path
