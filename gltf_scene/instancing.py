"""EXT_mesh_gpu_instancing: the places of a node's instances, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format, read_accessor
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import NOT_VALID, member
from gltf_ext.document.nodes import require_finite, trs_matrices
from gltf_ext.errors import MeshletError
from gltf_scene.values import ValueFormat

INSTANCING = "EXT_mesh_gpu_instancing"
# Attribute -> its components, its value if there is none. Others are the application's.
ATTRIBUTES: dict[str, tuple[int, tuple[float, ...]]] = {
    "TRANSLATION": (3, (0, 0, 0)),
    "ROTATION": (4, (0, 0, 0, 1)),
    "SCALE": (3, (1, 1, 1)),
}
ROTATION_INTEGERS = ("int8", "int16")  # fractions
# Primitives in their places, in all: matrices of 128 bytes. A small file could ask for billions.
MAX_PLACES = 1 << 22


def instance_count(document: Document, node: gltf.Node) -> int | None:
    """Instances of a node's mesh; None without the extension. Raises MeshletError.

    Reads no more than the counts of accessors.
    """
    if not gltf.has_extension(node, INSTANCING):
        return None
    accessors = {
        name: item(document.accessors, index, f"the accessor of {name},")
        for name, index in _accessors(node).items()
    }
    counts = {accessor.get("count") for accessor in accessors.values()}
    if len(counts) != 1:
        said = ", ".join(f"{name} has {a.get('count')}" for name, a in accessors.items())
        raise MeshletError(
            f"attributes of {INSTANCING} differ in number: {said or 'none'}", NOT_VALID
        )
    (count,) = counts
    if not isinstance(count, int) or count < 1:
        raise MeshletError(f"{INSTANCING} has {count} instances", NOT_VALID)
    return count


def instance_matrices(document: Document, node: gltf.Node, matrix: np.ndarray) -> np.ndarray:
    """float64[n, 4, 4]: object to world, of each instance; of the node without the extension.

    matrix: the node's. Raises MeshletError for attributes that are not valid, and for transforms
    that are not finite.
    """
    count = instance_count(document, node)
    if count is None:
        return matrix[None]
    numbers = _accessors(node)
    values = [_values(document, name, numbers.get(name), count) for name in ATTRIBUTES]
    with np.errstate(over="ignore", invalid="ignore"):
        matrices: np.ndarray = matrix @ trs_matrices(*values)
    require_finite(matrices)
    return matrices


def _accessors(node: gltf.Node) -> dict[str, Any]:
    """Attribute -> number of its accessor, those of the application included."""
    return member(member(node.get("extensions"), INSTANCING), "attributes")


def _values(document: Document, name: str, index: Any, count: int) -> np.ndarray:
    """Return float64[count, components]. index: of the accessor, None for the default."""
    components, default = ATTRIBUTES[name]
    if index is None:
        return np.broadcast_to(np.array(default, np.float64), (count, components))
    dtype, columns = accessor_format(document.accessors[index], name)
    fits = dtype.kind == "f" or (name == "ROTATION" and dtype.name in ROTATION_INTEGERS)
    if columns != components or not fits:
        raise MeshletError(
            f"{name} of {INSTANCING} has {columns} components of type {dtype.name}", NOT_VALID
        )
    value_format = ValueFormat(dtype, components, dtype.kind != "f")
    return value_format.to_floats(read_accessor(document, index, name, count)).astype(np.float64)
