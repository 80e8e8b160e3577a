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
    accessors = _accessors(document, node)
    if accessors is None:
        return None
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
    """float64[n, 4, 4]: object to world, of a node with the extension.

    matrix: the node's. Raises MeshletError for attributes that are not valid, and for transforms
    that are not finite.
    """
    count = instance_count(document, node)
    assert count is not None
    values = [
        _values(document, node, name, count, components, otherwise)
        for name, (components, otherwise) in ATTRIBUTES.items()
    ]
    with np.errstate(over="ignore", invalid="ignore"):
        matrices: np.ndarray = matrix @ trs_matrices(*values)
    require_finite(matrices)
    return matrices


def _accessors(document: Document, node: gltf.Node) -> dict[str, Any] | None:
    """Attribute -> its accessor, those of the application included."""
    if not gltf.has_extension(node, INSTANCING):
        return None
    attributes = member(member(node.get("extensions"), INSTANCING), "attributes")
    return {
        name: item(document.accessors, index, f"the accessor of {name},")
        for name, index in attributes.items()
    }


def _values(
    document: Document,
    node: gltf.Node,
    name: str,
    count: int,
    components: int,
    otherwise: tuple[float, ...],
) -> np.ndarray:
    """Return float64[count, components]."""
    attributes = member(member(node.get("extensions"), INSTANCING), "attributes")
    if name not in attributes:
        return np.broadcast_to(np.array(otherwise, np.float64), (count, components))
    accessor = item(document.accessors, attributes[name], f"the accessor of {name},")
    dtype, columns = accessor_format(accessor, name)
    fits = dtype.kind == "f" or (name == "ROTATION" and dtype.name in ROTATION_INTEGERS)
    if columns != components or not fits:
        raise MeshletError(
            f"{name} of {INSTANCING} has {columns} components of type {dtype.name}", NOT_VALID
        )
    form = ValueFormat(dtype, components, dtype.kind != "f")
    stored = read_accessor(document, attributes[name], name, count)
    return form.to_floats(stored).astype(np.float64)
