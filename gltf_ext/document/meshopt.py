"""Reads buffer views with EXT_meshopt_compression or KHR_meshopt_compression.

From their plain fallback where the file has it, else with an optional package: meshopt, which has
wheels, or meshoptimizer, which is compiled from its sources. Filters are undone here.
"""

from __future__ import annotations

import functools
import importlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import DAMAGED, Document, NewBytes, item
from gltf_ext.document.json_values import member
from gltf_ext.errors import MeshletError

NAMES = ("EXT_meshopt_compression", "KHR_meshopt_compression")
OURS = "EXT_meshlet_"
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
LARGEST_STRIDE = 256
# A decoder allocates what the JSON claims: at most so many bytes for each that it reads. A block of
# 256 equal elements takes a quarter of a byte for each byte of one element.
BYTES_PER_BYTE, LEAST_BYTES = 2048, 1 << 16
# All views, some of which may share data: for each byte of their buffers, and beside.
SUM_PER_BYTE, LEAST_SUM = 64, 64 << 20
FILTER_ROWS = 1 << 16  # whose filter is undone at a time


def unpack_meshopt(document: Document) -> None:
    """Give views that meshopt has compressed their plain bytes, and remove the extension.

    They are decoded when they are read. Without a decoder they keep the extension; then reading
    their bytes is an error. Raises MeshletError.
    """
    meshlets = _views_of_meshlets(document)
    views = [
        (index, view, name)
        for index, view in enumerate(document.bufferViews)
        for name in NAMES
        if gltf.has_extension(view, name) and index not in meshlets
    ]
    sums: Counter[int] = Counter()
    for index, view, name in views:
        extension = view["extensions"].pop(name)
        if not _has_fallback(document, index):
            if _decoder() is None:
                view["extensions"][name] = extension
                continue
            stream = _stream(document, index, extension)
            sums[stream.buffer] += stream.decoded_bytes
            read = functools.partial(_decode, document, stream, f"bufferView {index}")
            document.new_bytes[index] = NewBytes(read, False)
        if not view["extensions"]:
            del view["extensions"]
    _require_few(document, sums)
    document.unread_bytes = sums.total()
    if any("meshopt" in key for view in document.bufferViews for key in view.get("extensions", {})):
        return
    for name in NAMES:
        for buffer in document.buffers:
            gltf.pop_extension(buffer, name)
        document.forget_extension(name)


def _views_of_meshlets(document: Document) -> set[int]:
    """Return the views of our extensions, which no other one may compress."""
    extensions = [
        extension
        for mesh in document.meshes
        for primitive in mesh["primitives"]
        for name, extension in primitive.get("extensions", {}).items()
        if name.startswith(OURS) and isinstance(extension, dict)
    ]
    names = ("pages", "equalVertices")
    holders = [h for one in extensions for h in (one, *(member(one, n) for n in names))]
    return {number for holder in holders if isinstance(number := holder.get("bufferView"), int)}


def _require_few(document: Document, sums: Counter[int]) -> None:
    """Raise MeshletError for views that take far more than their buffers. sums: of each buffer."""
    excess = sum(
        max(0, count - SUM_PER_BYTE * document.buffers[buffer].get("byteLength", 0))
        for buffer, count in sums.items()
    )
    if excess > LEAST_SUM:
        raise MeshletError(
            f"its meshopt data claim to be {sums.total():,} bytes, far more than they can", DAMAGED
        )


def _has_fallback(document: Document, index: int) -> bool:
    """Return whether the plain bytes of a view are there."""
    buffer = item(document.buffers, document.bufferViews[index].get("buffer"), "buffer")
    holders = (member(buffer.get("extensions"), name) for name in NAMES)
    if any(holder.get("fallback") for holder in holders) and "uri" not in buffer:
        return False  # the buffer has no bytes
    try:
        document.bytes_of_view(index)
    except MeshletError:  # the fallback may be left out
        return False
    return True


@dataclass(frozen=True)
class _Stream:
    """What the extension says of a view's data, checked."""

    buffer: int
    start: int
    length: int
    count: int
    stride: int
    mode: str
    filter: str

    @property
    def decoded_bytes(self) -> int:
        return self.count * self.stride


def _stream(document: Document, index: int, extension: Any) -> _Stream:
    """Check an extension. Raises MeshletError."""
    fields = extension if isinstance(extension, dict) else {}
    keys = ("buffer", "byteOffset", "byteLength", "count", "byteStride")
    numbers: list[Any] = [fields.get(key, 0 if key == "byteOffset" else None) for key in keys]
    mode, filter_ = fields.get("mode"), fields.get("filter", "NONE")
    where = f"bufferView {index}"
    if (
        any(type(number) is not int or number < 0 for number in numbers)
        or mode not in MODES
        or not isinstance(filter_, str)
    ):
        raise MeshletError(f"{where} is not valid meshopt data", DAMAGED)
    buffer, start, length, count, stride = numbers
    stream = _Stream(buffer, start, length, count, stride, mode, filter_)
    item(document.buffers, stream.buffer, "buffer")
    is_attribute = mode == MODES[0]
    if (
        not 0 < stream.stride <= LARGEST_STRIDE
        or (stream.stride % 4 if is_attribute else stream.stride not in (2, 4))
        or stream.decoded_bytes > max(LEAST_BYTES, BYTES_PER_BYTE * stream.length)
        or document.bufferViews[index].get("byteLength") != stream.decoded_bytes
    ):
        raise MeshletError(f"{where} is not valid meshopt data", DAMAGED)
    if filter_ != "NONE" and not (is_attribute and _is_filter_of(filter_, stream.stride)):
        raise MeshletError(f"{where} has no valid meshopt filter ({filter_:.20})", DAMAGED)
    return stream


def _decode(document: Document, stream: _Stream, where: str) -> memoryview:
    """Decode a view. Raises MeshletError."""
    decode = _decoder()
    assert decode is not None
    source: gltf.BufferView = {
        "buffer": stream.buffer,
        "byteOffset": stream.start,
        "byteLength": stream.length,
    }
    data = document.bytes_at(source, where)
    try:
        rows = decode(stream.mode, bytes(data), stream.count, stream.stride)
    except Exception:  # the packages raise several
        raise MeshletError(f"{where}: its meshopt data cannot be decoded", DAMAGED) from None
    if stream.filter != "NONE":
        rows = np.array(rows)
        for first in range(0, len(rows), FILTER_ROWS):  # each takes many times its bytes
            some = slice(first, first + FILTER_ROWS)
            rows[some] = _unfiltered(rows[some], stream.filter)
    return memoryview(rows.tobytes())


Decoder = Callable[[str, bytes, int, int], np.ndarray]  # of mode, data, count and stride


@functools.cache
def _decoder() -> Decoder | None:
    """Return a function for the bytes of elements, uint8[count, stride]; None without a package."""
    for name, decoder in (("meshopt", _with_meshopt), ("meshoptimizer", _with_meshoptimizer)):
        try:
            importlib.import_module(name)
        except Exception:  # it is not there, or broken
            continue
        return decoder
    return None


def _with_meshopt(mode: str, data: bytes, count: int, stride: int) -> np.ndarray:
    import meshopt

    rows = np.ascontiguousarray(meshopt.decode_gltf_buffer(data, count, stride, mode))
    return _bytes(rows.reshape(count, -1))


def _with_meshoptimizer(mode: str, data: bytes, count: int, stride: int) -> np.ndarray:
    import meshoptimizer

    if mode == MODES[0]:
        rows = meshoptimizer.decode_vertex_buffer(count, stride, data, np.dtype(f"V{stride}"))
        return _bytes(rows.reshape(count, 1))
    name = "decode_index_buffer" if mode == MODES[1] else "decode_index_sequence"
    # The package has room for indices of four bytes only.
    numbers = getattr(meshoptimizer, name)(count, 4, data).astype(f"<u{stride}")
    return _bytes(numbers.reshape(count, 1))


# --- filters: appendix B of KHR_meshopt_compression ---


def _is_filter_of(name: str, stride: int) -> bool:
    """Return whether a filter is one of elements of so many bytes, which are a multiple of 4."""
    strides = {"QUATERNION": (8,), "OCTAHEDRAL": (4, 8), "COLOR": (4, 8)}
    return name == "EXPONENTIAL" or stride in strides.get(name, ())


def _unfiltered(rows: np.ndarray, name: str) -> np.ndarray:
    """Return the elements, uint8[count, stride], with a filter undone."""
    bits = 8 * rows.shape[1] // 4
    with np.errstate(all="ignore"):  # results for invalid elements are unspecified
        if name == "EXPONENTIAL":
            return _exponential(rows.view("<i4"))
        if name == "QUATERNION":
            return _quaternions(rows.view("<i2").astype(np.float64))
        if name == "OCTAHEDRAL":
            return _octahedral(rows.view(f"<i{bits // 8}"))
        return _colors(rows.view(f"<u{bits // 8}"))


def _exponential(values: np.ndarray) -> np.ndarray:
    result = np.ldexp(((values << 8) >> 8).astype(np.float64), values >> 24).astype("<f4")
    return _bytes(result)


def _octahedral(values: np.ndarray) -> np.ndarray:
    x, y, one = (column.astype(np.float64) for column in values.T[:3])
    x, y = x / one, y / one
    z = 1.0 - np.abs(x) - np.abs(y)
    fold = np.minimum(z, 0.0)
    vectors = np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=1)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    result = values.copy()
    result[:, :3] = _rounded(vectors * np.iinfo(values.dtype).max)
    return _bytes(result)


def _quaternions(values: np.ndarray) -> np.ndarray:
    words = values[:, 3].astype(np.int64)
    parts = values[:, :3] / (words | 3)[:, None] / np.sqrt(2.0)
    largest = np.sqrt(np.maximum(0.0, 1.0 - (parts * parts).sum(axis=1, keepdims=True)))
    result = np.empty((len(values), 4), "<i2")
    places = ((words & 3)[:, None] + [1, 2, 3, 4]) % 4
    scaled = _rounded(np.concatenate([parts, largest], axis=1) * 32767.0)
    result[np.arange(len(values))[:, None], places] = scaled
    return _bytes(result)


def _colors(values: np.ndarray) -> np.ndarray:
    luma, alpha = values[:, 0].astype(np.int64), values[:, 3].astype(np.int64)
    orange, green = values.view(values.dtype.str.replace("u", "i"))[:, 1:3].T.astype(np.int64)
    full = alpha.copy()
    for shift in (1, 2, 4, 8):
        full |= full >> shift
    alpha &= full >> 1
    alpha = alpha << 1 | alpha & 1
    colors = np.stack([luma + orange - green, luma + green, luma - orange - green, alpha], axis=1)
    limit = np.iinfo(values.dtype).max
    scaled = _rounded(colors * (limit / np.maximum(full, 1))[:, None])
    return _bytes(np.clip(scaled, 0, limit).astype(values.dtype))


def _rounded(values: np.ndarray) -> np.ndarray:
    """To the nearest integers, halves away from zero; 0 for what is no number."""
    rounded = np.trunc(values + np.copysign(0.5, values))
    result: np.ndarray = np.nan_to_num(rounded, posinf=0.0, neginf=0.0)
    return result


def _bytes(rows: np.ndarray) -> np.ndarray:
    """Return uint8[count, stride]."""
    result: np.ndarray = np.ascontiguousarray(rows).view(np.uint8)
    return result
