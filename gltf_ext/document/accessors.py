"""Accessors <-> numpy arrays: plain, interleaved, sparse and without a buffer view."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import DAMAGED, Document, item
from gltf_ext.errors import EXPORT_AGAIN, MeshletError

DTYPES: dict[int, np.dtype] = {
    gltf.BYTE: np.dtype("i1"),
    gltf.UNSIGNED_BYTE: np.dtype("u1"),
    gltf.SHORT: np.dtype("<i2"),
    gltf.UNSIGNED_SHORT: np.dtype("<u2"),
    gltf.UNSIGNED_INT: np.dtype("<u4"),
    gltf.FLOAT: np.dtype("<f4"),
}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# An accessor without bytes may claim any count: more must be that of other data.
MAX_ZEROS = 2**12
BOUNDS_ROWS = 256  # that `bounds` compares as one

Format = tuple[np.dtype, int]  # component type and number of components


def accessor_format(accessor: gltf.Accessor, name: str) -> Format:
    """Return the format of an accessor. Raises MeshletError with `name` for an invalid one."""
    component, kind = accessor.get("componentType"), accessor.get("type")
    if component not in DTYPES or kind not in COMPONENTS:
        raise MeshletError(f"{name} has component type {component} and type {kind}", EXPORT_AGAIN)
    dtype, components = DTYPES[component], COMPONENTS[kind]
    if kind.startswith("MAT") and dtype.itemsize < 4:
        raise MeshletError(
            f"{name} is an integer matrix, which is not supported", "store it as floats"
        )
    return dtype, components


def element_count(accessor: gltf.Accessor, name: str, count: int | None) -> int:
    """Return the number of elements of an accessor. Raises MeshletError with `name`.

    count: what it must be, unless that is None.
    """
    elements = accessor.get("count", -1)
    if elements < 0:
        raise MeshletError(f"{name} has no valid count", DAMAGED)
    if count is not None and elements != count:
        raise MeshletError(f"{name} has {elements} elements instead of {count}", EXPORT_AGAIN)
    return elements


def read_accessor(
    document: Document, index: int, name: str, count: int | None = None
) -> np.ndarray:
    """Return the elements of an accessor, [count, components]: if possible a read-only view.

    name: of the accessor, for errors; count: the count that it must have, if it has bytes. Raises
    MeshletError.
    """
    accessor = item(document.accessors, index, f"the accessor of {name},")
    format_ = accessor_format(accessor, name)
    elements = element_count(accessor, name, count)
    if "bufferView" in accessor:
        values = _strided(document, accessor, elements, format_, name)
    elif count is not None or elements <= MAX_ZEROS:
        values = np.broadcast_to(np.zeros((), format_[0]), (elements, format_[1]))
    else:
        raise MeshletError(f"{name} has {elements} elements but no bytes", DAMAGED)
    if "sparse" not in accessor:
        return values
    return _with_sparse(document, values, accessor["sparse"], name)


def _strided(
    document: Document,
    holder: gltf.Accessor | gltf.SparseIndices | gltf.SparseValues,
    count: int,
    format_: Format,
    name: str,
) -> np.ndarray:
    """`count` elements at the buffer view and offset of an accessor or a part of a sparse one."""
    (dtype, components), view = format_, holder["bufferView"]
    data = document.bytes_of_view(view)
    size, offset = dtype.itemsize * components, gltf.byte_offset(holder)
    stride = gltf.stride(document.bufferViews[view], size)
    end = offset + (stride * (count - 1) + size if count else 0)
    if offset < 0 or stride < size or end > len(data):
        raise MeshletError(f"{name} reaches beyond bufferView {view}", DAMAGED)
    if not count:
        return np.zeros((0, components), dtype)
    strides = (stride, dtype.itemsize)
    values: np.ndarray = np.ndarray((count, components), dtype, data, offset, strides)
    return values


def _with_sparse(
    document: Document, values: np.ndarray, sparse: gltf.Sparse, name: str
) -> np.ndarray:
    """Return a copy of the values in which the sparse ones replace theirs."""
    name = f"the sparse part of {name}"
    indices, replacements = sparse.get("indices"), sparse.get("values")
    count = sparse.get("count", 0)
    if indices is None or replacements is None or not 0 <= count <= len(values):
        raise MeshletError(f"{name} is incomplete or too long", DAMAGED)
    index_type = DTYPES.get(indices.get("componentType", -1))
    if (
        index_type is None
        or index_type.kind != "u"
        or "bufferView" not in indices
        or "bufferView" not in replacements
    ):
        raise MeshletError(f"{name} has no valid indices", DAMAGED)
    rows = _strided(document, indices, count, (index_type, 1), name)[:, 0]
    if len(rows) and rows.max() >= len(values):
        raise MeshletError(f"{name} has an index out of range", DAMAGED)
    result: np.ndarray = values.copy()
    format_ = values.dtype, values.shape[1]
    result[rows] = _strided(document, replacements, count, format_, name)
    return result


def described_by(accessor: gltf.Accessor, count: int) -> gltf.Accessor:
    """Return a new accessor of the same type, name and extras: `count` elements, no buffer view."""
    same = ("componentType", "count", "type", "normalized", "name", "extras")
    result: Any = {name: value for name, value in accessor.items() if name in same}
    result["count"] = count
    described: gltf.Accessor = result
    return described


def index_accessor(index_count: int, vertex_count: int) -> gltf.Accessor:
    """Return an accessor for triangle indices, of 16 bits if the vertices allow it.

    The largest 16-bit value is reserved for primitive restart.
    """
    wide = vertex_count > np.iinfo(np.uint16).max
    return {
        "componentType": gltf.UNSIGNED_INT if wide else gltf.UNSIGNED_SHORT,
        "count": index_count,
        "type": "SCALAR",
    }


def set_bounds(accessor: gltf.Accessor, low: np.ndarray, high: np.ndarray) -> None:
    """Set min and max."""
    accessor["min"], accessor["max"] = ([v.item() for v in bound] for bound in (low, high))


def drop_infinite_bounds(accessor: gltf.Accessor) -> None:
    """Remove min and max that are not finite, as those of an accessor with such values."""
    if not all(map(math.isfinite, [*accessor.get("min", []), *accessor.get("max", [])])):
        accessor.pop("min", None)
        accessor.pop("max", None)


def stated_bounds(accessor: gltf.Accessor) -> list[np.ndarray | None]:
    """Min and max, float64[components] each; None for one that is not stated.

    Numbers of a FLOAT accessor are rounded to 32 bits (glTF 2.0, 3.6.2.5): JSON may hold the
    shortest text that gives the same float.
    """
    rounded = np.float32 if accessor.get("componentType") == gltf.FLOAT else np.float64
    with np.errstate(over="ignore"):  # beyond the range of a float: infinite
        return [
            None if bound is None else np.array(bound, rounded).astype(np.float64)
            for bound in (accessor.get("min"), accessor.get("max"))
        ]


def widen_bounds(accessor: gltf.Accessor, values: np.ndarray) -> None:
    """Extend min and max by those of more values."""
    rows = [np.array(b, values.dtype) for b in (accessor.get("min"), accessor.get("max")) if b]
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
    accessor: gltf.Accessor,
    values: np.ndarray,
    target: int,
    fallback: bool,
) -> None:
    """Give the accessor a buffer view of its own with these values, [count, components].

    Rows of vertex attributes are padded to 4 bytes. fallback: see Document.add_view.
    """
    rows = stored_rows(accessor, values, target).reshape(-1)
    store_rows(document, accessor, rows.data, target, fallback)


def add_accessor(document: Document, values: np.ndarray, normalized: bool = False) -> int:
    """Return the number of a new accessor with a buffer view of its own.

    values: [count, components] of any type of DTYPES for vertices; of uint32 for indices.
    """
    component = next(number for number, dtype in DTYPES.items() if dtype == values.dtype)
    is_index = component == gltf.UNSIGNED_INT
    target = gltf.ELEMENT_ARRAY_BUFFER if is_index else gltf.ARRAY_BUFFER
    columns = values.shape[1]
    accessor: gltf.Accessor = {
        "componentType": component,
        "count": len(values),
        "type": "SCALAR" if columns == 1 else f"VEC{columns}",
    }
    if normalized:
        accessor["normalized"] = True
    store(document, accessor, values, target, fallback=False)
    document.accessors.append(accessor)
    return len(document.accessors) - 1


def stored_rows(accessor: gltf.Accessor, values: np.ndarray, target: int) -> np.ndarray:
    """Return uint8[count, stride]: values, [count, components], as in the accessor's view."""
    values = np.ascontiguousarray(values, DTYPES[accessor["componentType"]])
    size = values.dtype.itemsize * values.shape[1]
    rows = values.view(np.uint8).reshape(len(values), size)
    padding = -size % 4 if target == gltf.ARRAY_BUFFER else 0
    return np.pad(rows, ((0, 0), (0, padding))) if padding else rows


def store_rows(
    document: Document,
    accessor: gltf.Accessor,
    rows: memoryview,
    target: int,
    fallback: bool = False,
) -> None:
    """Give the accessor a buffer view of its own with all its rows, as `stored_rows` has them."""
    dtype, components = accessor_format(accessor, "an accessor")
    view: gltf.BufferView = {"target": target}
    stride = len(rows) // max(accessor["count"], 1)
    if stride != dtype.itemsize * components:
        view["byteStride"] = stride
    accessor["bufferView"] = document.add_view(rows, fallback=fallback, properties=view)
