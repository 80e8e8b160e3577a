"""The node hierarchy of a glTF scene, flattened."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import Document, item

MAX_PLACED = 1_000_000


def placed(document: Document) -> Iterator[tuple[pygltflib.Node, np.ndarray]]:
    """(node, world matrix float64[4, 4]) of every node of the default scene, parents first.

    A document without scenes shows all its root nodes; one that names no default scene shows its
    first. Raises MeshletError for a node that is its own ancestor.
    """
    if document.scenes:
        roots = item(document.scenes, document.scene or 0, "scene").nodes or []
    else:
        below = {child for node in document.nodes for child in node.children or []}
        roots = [i for i in range(len(document.nodes)) if i not in below]
    # Nodes with several parents are not valid glTF, but common: only cycles are refused.
    stack: list[tuple[int, np.ndarray, frozenset[int]]] = [
        (index, np.eye(4), frozenset()) for index in reversed(roots)
    ]
    count = 0
    while stack:
        index, parent, ancestors = stack.pop()
        node = item(document.nodes, index, "node")
        count += 1
        if index in ancestors or count > MAX_PLACED:
            raise MeshletError(
                f"node {index} is its own ancestor, or there are too many nodes",
                "the file is not valid glTF; export it again",
            )
        matrix: np.ndarray = parent @ local_matrix(node)
        yield node, matrix
        children = node.children or []
        stack += [(child, matrix, ancestors | {index}) for child in reversed(children)]


def local_matrix(node: pygltflib.Node) -> np.ndarray:
    """float64[4, 4] from a node's matrix, or its translation, rotation and scale."""
    if node.matrix is not None and len(node.matrix) == 16:
        return np.reshape(np.array(node.matrix, np.float64), (4, 4), order="F")
    result = np.eye(4)
    rotation = _rotation(node.rotation) if node.rotation is not None else np.eye(3)
    result[:3, :3] = rotation * np.array(
        node.scale if node.scale is not None else (1, 1, 1), np.float64
    )
    if node.translation is not None:
        result[:3, 3] = node.translation
    return result


def _rotation(quaternion: list[float]) -> np.ndarray:
    """float64[3, 3] of a quaternion x, y, z, w of any length."""
    x, y, z, w = np.array(quaternion, np.float64) / max(float(np.linalg.norm(quaternion)), 1e-30)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
