"""The node hierarchy of a glTF scene, flattened."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import NOT_VALID
from gltf_ext.errors import MeshletError

# Nodes with several parents are not valid glTF, but common: each may be shown more than once.
# A file of 1 kB could ask for billions of places.
MAX_REPEATED = 2**14
MAX_SIZE = 1e15  # of coordinates: products of two must fit 32-bit floats


def placed_nodes(document: Document) -> Iterator[tuple[gltf.Node, np.ndarray]]:
    """Return (node, world matrix float64[4, 4]) of every node of the default scene, parents first.

    A document without scenes shows all its root nodes; one that names no default scene shows its
    first. Raises MeshletError for a node that is its own ancestor, for too many nodes, and for a
    matrix that is not finite.
    """
    if document.scenes:
        scene = item(document.scenes, document.json.get("scene", 0), "scene")
        roots = scene.get("nodes", [])
    else:
        below = {child for node in document.nodes for child in gltf.children(node)}
        roots = [i for i in range(len(document.nodes)) if i not in below]
    # A node without a matrix ends the children of that node.
    stack: list[tuple[int, np.ndarray | None]] = [(index, np.eye(4)) for index in reversed(roots)]
    ancestors: set[int] = set()
    remaining = len(document.nodes) + MAX_REPEATED
    while stack:
        index, parent = stack.pop()
        if parent is None:
            ancestors.remove(index)
            continue
        node = item(document.nodes, index, "node")
        remaining -= 1
        if index in ancestors or remaining < 0:
            raise MeshletError(
                f"node {index} is its own ancestor, or has too many parents", NOT_VALID
            )
        with np.errstate(over="ignore", invalid="ignore"):
            matrix: np.ndarray = parent @ local_matrix(node)
        require_finite(matrix)
        yield node, matrix
        if gltf.children(node):
            ancestors.add(index)
            stack.append((index, None))
            stack += [(child, matrix) for child in reversed(gltf.children(node))]


def mesh_scales(document: Document) -> dict[int, float]:
    """Return mesh -> the largest scale that nodes show it with; only of meshes that they show.

    A skinned mesh has the scale of its joints, which is taken as 1. Empty if nodes are not valid.
    """
    result: dict[int, float] = {}
    try:
        for node, matrix in placed_nodes(document):
            if "mesh" in node:
                scale = (
                    1.0 if "skin" in node else float(np.linalg.norm(matrix[:3, :3], axis=0).max())
                )
                result[node["mesh"]] = max(scale, result.get(node["mesh"], 0.0))
    except MeshletError:  # of nodes that are not valid: not our concern here
        return {}
    return result


def local_matrix(node: gltf.Node) -> np.ndarray:
    """Return float64[4, 4] from a node's matrix, or its translation, rotation and scale."""
    if "matrix" in node:
        return np.reshape(np.array(node["matrix"], np.float64), (4, 4), order="F")
    translation, scale = node.get("translation", (0, 0, 0)), node.get("scale", (1, 1, 1))
    if "rotation" not in node:  # a tenth of the time
        matrix = np.diag(np.array([*scale, 1.0]))
        matrix[:3, 3] = translation
        return matrix
    values = translation, node["rotation"], scale
    result: np.ndarray = trs_matrices(*(np.array([v], np.float64) for v in values))[0]
    return result


def trs_matrices(translation: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return float64[n, 4, 4]: rotation and scale, then translation.

    translation, scale: float64[n, 3]; rotation: float64[n, 4], quaternions x, y, z, w of any
    length; zero turns nothing.
    """
    lengths = np.linalg.norm(rotation, axis=1, keepdims=True)
    x, y, z, w = (rotation / np.maximum(lengths, 1e-30)).T
    result = np.zeros((len(translation), 4, 4))
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    for row, values in enumerate(rows):
        for column, value in enumerate(values):
            result[:, row, column] = value * scale[:, column]
    result[:, :3, 3] = translation
    result[:, 3, 3] = 1
    return result


def require_finite(matrices: np.ndarray) -> None:
    """Raise MeshletError for numbers that are not finite, or as large as MAX_SIZE."""
    if not (np.abs(matrices) < MAX_SIZE).all():
        raise MeshletError(
            f"a node's transform is not finite, or larger than {MAX_SIZE:g}",
            "export the file again, smaller",
        )
