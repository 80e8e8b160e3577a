"""Accessors <-> numpy arrays: plain, interleaved, sparse and without a buffer view."""

from __future__ import annotations

import numpy as np
import pygltflib

from gltf_ext.document.document import DAMAGED, Document, item
from gltf_ext.errors import MeshletError

DTYPES: dict[int, np.dtype] = {
    pygltflib.BYTE: np.dtype("i1"),
    pygltflib.UNSIGNED_BYTE: np.dtype("u1"),
    pygltflib.SHORT: np.dtype("<i2"),
    pygltflib.UNSIGNED_SHORT: np.dtype("<u2"),
    pygltflib.UNSIGNED_INT: np.dtype("<u4"),
    pygltflib.FLOAT: np.dtype("<f4"),
}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# An accessor without bytes may claim any count: more must be that of other data.
MAX_ZEROS = 2**12
BOUNDS_ROWS = 256  # that `bounds` compares as one

Format = tuple[np.dtype, int]  # component type and number of components


def accessor_format(accessor: pygltflib.Accessor, name: str) -> Format:
    """The format of an accessor. Raises MeshletError, naming `name`, for one that glTF lacks."""
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
    """The elements of an accessor, [count, components]: a read-only view of the file if possible.

    name: what the accessor holds, for errors; count: the count it must have, of data with bytes.
    Raises MeshletError.
    """
    accessor = item(document.accessors, index, f"the accessor of {name},")
    form = accessor_format(accessor, name)
    if accessor.count is None or accessor.count < 0:
        raise MeshletError(f"{name} has no valid count", DAMAGED)
    if count is not None and accessor.count != count:
        raise MeshletError(
            f"{name} has {accessor.count} elements instead of {count}", "export the model again"
        )
    if accessor.bufferView is not None:
        values = _strided(document, accessor, accessor.count, form, name)
    elif count is not None or accessor.count <= MAX_ZEROS:
        values = np.broadcast_to(np.zeros((), form[0]), (accessor.count, form[1]))
    else:
        raise MeshletError(f"{name} has {accessor.count} elements but no bytes", DAMAGED)
    if accessor.sparse is None:
        return values
    return _with_sparse(document, values, accessor.sparse, name)


def _strided(
    document: Document,
    holder: pygltflib.Accessor | pygltflib.SparseAccessor,
    count: int,
    form: Format,
    name: str,
) -> np.ndarray:
    """`count` elements at the buffer view and offset of an accessor or a part of a sparse one."""
    dtype, components = form
    data = document.bytes_of_view(holder.bufferView)
    size, offset = dtype.itemsize * components, holder.byteOffset or 0
    stride = document.bufferViews[holder.bufferView].byteStride or size
    end = offset + (stride * (count - 1) + size if count else 0)
    if offset < 0 or stride < size or end > len(data):
        raise MeshletError(f"{name} reaches beyond bufferView {holder.bufferView}", DAMAGED)
    if not count:
        return np.zeros((0, components), dtype)
    strides = (stride, dtype.itemsize)
    values: np.ndarray = np.ndarray((count, components), dtype, data, offset, strides)
    return values


def _with_sparse(
    document: Document, values: np.ndarray, sparse: pygltflib.Sparse, name: str
) -> np.ndarray:
    """A copy of the values in which the sparse ones replace theirs."""
    name = f"the sparse part of {name}"
    indices, replacements = sparse.indices, sparse.values
    count = sparse.count or 0
    if indices is None or replacements is None or not 0 <= count <= len(values):
        raise MeshletError(f"{name} is incomplete or too long", DAMAGED)
    index_type = DTYPES.get(indices.componentType)
    if (
        index_type is None
        or index_type.kind != "u"
        or indices.bufferView is None
        or replacements.bufferView is None
    ):
        raise MeshletError(f"{name} has no valid indices", DAMAGED)
    rows = _strided(document, indices, count, (index_type, 1), name)[:, 0]
    if len(rows) and rows.max() >= len(values):
        raise MeshletError(f"{name} has an index out of range", DAMAGED)
    result: np.ndarray = values.copy()
    form = values.dtype, values.shape[1]
    result[rows] = _strided(document, replacements, count, form, name)
    return result


def described_by(accessor: pygltflib.Accessor, count: int) -> pygltflib.Accessor:
    """A new accessor of the same type, name and extras: `count` elements, no buffer view."""
    return pygltflib.Accessor(
        componentType=accessor.componentType,
        type=accessor.type,
        count=count,
        normalized=accessor.normalized,
        name=accessor.name,
        extras=accessor.extras,
    )


def index_accessor(index_count: int, vertex_count: int) -> pygltflib.Accessor:
    """An accessor for triangle indices, of 16 bits if the vertices allow it.

    The largest 16-bit value is reserved for primitive restart.
    """
    wide = vertex_count > np.iinfo(np.uint16).max
    return pygltflib.Accessor(
        componentType=pygltflib.UNSIGNED_INT if wide else pygltflib.UNSIGNED_SHORT,
        type="SCALAR",
        count=index_count,
    )


def set_bounds(accessor: pygltflib.Accessor, low: np.ndarray, high: np.ndarray) -> None:
    """Sets min and max."""
    accessor.min, accessor.max = ([v.item() for v in bound] for bound in (low, high))


def stated_bounds(accessor: pygltflib.Accessor) -> list[np.ndarray | None]:
    """min and max, float64[components] each; None for one that is not stated.

    Numbers of a FLOAT accessor are rounded to 32 bits (glTF 2.0, 3.6.2.5): JSON may hold the
    shortest text that gives the same float.
    """
    rounded = np.float32 if accessor.componentType == pygltflib.FLOAT else np.float64
    with np.errstate(over="ignore"):  # beyond the range of a float: infinite
        return [
            None if bound is None else np.array(bound, rounded).astype(np.float64)
            for bound in (accessor.min, accessor.max)
        ]


def widen_bounds(accessor: pygltflib.Accessor, values: np.ndarray) -> None:
    """Extends min and max by those of more values."""
    rows = [np.array(b, values.dtype) for b in (accessor.min, accessor.max) if b]
    set_bounds(accessor, *bounds(np.stack([*rows, *bounds(values)])))


def bounds(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest value of each column.

    By long rows of many, which numpy does four times as fast as column by column.
    """
    columns = values.shape[1]
    whole = len(values) - len(values) % BOUNDS_ROWS
    long = values[:whole].reshape(-1, BOUNDS_ROWS * columns) if whole else values[:0]
    ends = []
    for least in (np.minimum, np.maximum):
        parts = [least.reduce(long).reshape(-1, columns)] if whole else []
        ends.append(least.reduce(np.concatenate([*parts, values[whole:]])))
    return ends[0], ends[1]


def store(
    document: Document,
    accessor: pygltflib.Accessor,
    values: np.ndarray,
    target: int,
    fallback: bool,
) -> None:
    """Gives the accessor a buffer view of its own with these values, [count, components].

    Rows of vertex attributes are padded to 4 bytes. fallback: see Document.add_view.
    """
    rows = stored_rows(accessor, values, target).reshape(-1)
    store_rows(document, accessor, rows.data, target, fallback)


def add_accessor(document: Document, values: np.ndarray, normalized: bool = False) -> int:
    """The number of a new accessor with a buffer view of its own.

    values: [count, components] of any type of DTYPES for vertices; of uint32 for indices.
    """
    component = next(number for number, dtype in DTYPES.items() if dtype == values.dtype)
    is_index = component == pygltflib.UNSIGNED_INT
    target = pygltflib.ELEMENT_ARRAY_BUFFER if is_index else pygltflib.ARRAY_BUFFER
    columns = values.shape[1]
    accessor = pygltflib.Accessor(
        componentType=component,
        type="SCALAR" if columns == 1 else f"VEC{columns}",
        count=len(values),
        normalized=normalized,
    )
    store(document, accessor, values, target, fallback=False)
    document.accessors.append(accessor)
    return len(document.accessors) - 1


def stored_rows(accessor: pygltflib.Accessor, values: np.ndarray, target: int) -> np.ndarray:
    """uint8[count, stride]: values [count, components] as they lie in the accessor's view."""
    values = np.ascontiguousarray(values, DTYPES[accessor.componentType])
    size = values.dtype.itemsize * values.shape[1]
    rows = values.view(np.uint8).reshape(len(values), size)
    padding = -size % 4 if target == pygltflib.ARRAY_BUFFER else 0
    return np.pad(rows, ((0, 0), (0, padding))) if padding else rows


def store_rows(
    document: Document,
    accessor: pygltflib.Accessor,
    rows: memoryview,
    target: int,
    fallback: bool = False,
) -> None:
    """Gives the accessor a buffer view of its own with all its rows, as `stored_rows` has them."""
    dtype, components = accessor_format(accessor, "an accessor")
    stride = len(rows) // max(accessor.count, 1)
    accessor.bufferView = document.add_view(
        rows,
        fallback=fallback,
        target=target,
        byteStride=stride if stride != dtype.itemsize * components else None,
    )
