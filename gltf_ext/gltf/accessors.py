"""Accessors <-> numpy arrays: plain, interleaved, sparse and without a buffer view."""

from __future__ import annotations

import numpy as np
import pygltflib

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.document import DAMAGED, Document, item

DTYPES: dict[int, np.dtype] = {
    pygltflib.BYTE: np.dtype("i1"),
    pygltflib.UNSIGNED_BYTE: np.dtype("u1"),
    pygltflib.SHORT: np.dtype("<i2"),
    pygltflib.UNSIGNED_SHORT: np.dtype("<u2"),
    pygltflib.UNSIGNED_INT: np.dtype("<u4"),
    pygltflib.FLOAT: np.dtype("<f4"),
}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# A file without bytes for it may ask for at most this many zeros.
MAX_ZERO_ELEMENTS = 2**24


def accessor_format(accessor: pygltflib.Accessor, name: str) -> tuple[np.dtype, int]:
    """(component dtype, components) of an accessor; name is for the error."""
    if accessor.componentType not in DTYPES or accessor.type not in COMPONENTS:
        raise MeshletError(
            f"{name} has component type {accessor.componentType} and type {accessor.type}",
            "export the model again",
        )
    dtype, components = DTYPES[accessor.componentType], COMPONENTS[accessor.type]
    if accessor.type.startswith("MAT") and dtype.itemsize < 4:
        raise MeshletError(
            f"{name} is an integer matrix, which is not supported", "store it as floats"
        )
    return dtype, components


def read_accessor(
    document: Document, index: int, name: str, count: int | None = None
) -> np.ndarray:
    """The accessor's elements [count, components], a read-only view of the file where possible.

    name: what the accessor holds, for errors; count: the count it must have.
    """
    accessor = item(document.accessors, index, f"the accessor of {name},")
    dtype, components = accessor_format(accessor, name)
    if accessor.count is None or accessor.count < 0:
        raise MeshletError(f"{name} has no valid count", DAMAGED)
    if count is not None and accessor.count != count:
        raise MeshletError(
            f"{name} has {accessor.count} elements instead of {count}", "export the model again"
        )
    if accessor.bufferView is not None:
        values = _strided(
            document,
            accessor.bufferView,
            accessor.byteOffset,
            accessor.count,
            dtype,
            components,
            name,
        )
    elif accessor.count * components <= MAX_ZERO_ELEMENTS:
        values = np.zeros((accessor.count, components), dtype)
    else:
        raise MeshletError(f"{name} has {accessor.count} elements but no bytes", DAMAGED)
    return (
        values if accessor.sparse is None else _with_sparse(document, values, accessor.sparse, name)
    )


def _strided(
    document: Document,
    view_index: int,
    offset: int | None,
    count: int,
    dtype: np.dtype,
    components: int,
    name: str,
) -> np.ndarray:
    data = document.bytes_of_view(view_index)
    size, offset = dtype.itemsize * components, offset or 0
    stride = document.bufferViews[view_index].byteStride or size
    if (
        offset < 0
        or stride < size
        or offset + (stride * (count - 1) + size if count else 0) > len(data)
    ):
        raise MeshletError(f"{name} reaches beyond bufferView {view_index}", DAMAGED)
    if not count:
        return np.zeros((0, components), dtype)
    return np.ndarray((count, components), dtype, data, offset, (stride, dtype.itemsize))


def _with_sparse(
    document: Document, values: np.ndarray, sparse: pygltflib.Sparse, name: str
) -> np.ndarray:
    what = f"the sparse part of {name}"
    if (
        sparse.indices is None
        or sparse.values is None
        or not 0 <= (sparse.count or 0) <= len(values)
    ):
        raise MeshletError(f"{what} is incomplete or too long", DAMAGED)
    index_type = DTYPES.get(sparse.indices.componentType)
    if (
        index_type is None
        or index_type.kind != "u"
        or sparse.indices.bufferView is None
        or sparse.values.bufferView is None
    ):
        raise MeshletError(f"{what} has no valid indices", DAMAGED)
    rows = _strided(
        document,
        sparse.indices.bufferView,
        sparse.indices.byteOffset,
        sparse.count,
        index_type,
        1,
        what,
    )[:, 0]
    if len(rows) and rows.max() >= len(values):
        raise MeshletError(f"{what} has an index out of range", DAMAGED)
    result = values.copy()
    result[rows] = _strided(
        document,
        sparse.values.bufferView,
        sparse.values.byteOffset,
        sparse.count,
        values.dtype,
        values.shape[1],
        what,
    )
    return result


def described_by(accessor: pygltflib.Accessor, count: int) -> pygltflib.Accessor:
    """A new accessor of the same type, name and extras, for `count` elements, without a buffer view."""
    return pygltflib.Accessor(
        componentType=accessor.componentType,
        type=accessor.type,
        count=count,
        normalized=accessor.normalized,
        name=accessor.name,
        extras=accessor.extras,
    )


def index_accessor(index_count: int, vertex_count: int) -> pygltflib.Accessor:
    """An accessor for triangle indices; the largest 16-bit value is reserved for primitive restart."""
    wide = vertex_count > np.iinfo(np.uint16).max
    return pygltflib.Accessor(
        componentType=pygltflib.UNSIGNED_INT if wide else pygltflib.UNSIGNED_SHORT,
        type="SCALAR",
        count=index_count,
    )


def set_bounds(accessor: pygltflib.Accessor, low: np.ndarray, high: np.ndarray) -> None:
    accessor.min, accessor.max = ([v.item() for v in bound] for bound in (low, high))


def bounds(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest value of each column."""
    return values.min(axis=0), values.max(axis=0)


def store(
    document: Document,
    accessor: pygltflib.Accessor,
    values: np.ndarray,
    target: int,
    fallback: bool,
) -> None:
    """Give the accessor a buffer view of its own with these values; vertex attributes are padded to 4 bytes."""
    values = np.ascontiguousarray(values, DTYPES[accessor.componentType])
    size = values.dtype.itemsize * values.shape[1]
    stride = size + -size % 4 if target == pygltflib.ARRAY_BUFFER else size
    rows = values.view(np.uint8).reshape(len(values), size)
    if stride != size:
        rows = np.pad(rows, ((0, 0), (0, stride - size)))
    accessor.bufferView = document.add_view(
        rows.reshape(-1), target=target, byteStride=stride if stride != size else None
    )
    document.bufferViews[-1].fallback = fallback
