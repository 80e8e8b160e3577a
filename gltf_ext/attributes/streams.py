"""glTF attributes <-> quantised streams.

Values are in the accessor's stored units: floats as they are, integers before `normalized` divides
them. One attribute takes consecutive streams of at most four elements each; an OCT stream stands
for three components. Streams of each attribute:

| attribute              | float accessor                                 | integer accessor      |
| ---------------------- | ---------------------------------------------- | --------------------- |
| POSITION               | GRID, the mesh's (or file's) step              | exact                 |
| NORMAL; TANGENT        | OCT; OCT, then SIGN                            | exact                 |
| TEXCOORD_n             | GRID, one step for both components             | exact                 |
| COLOR_n                | GRID over [0, 1]                               | 8 bits exact, 16 GRID |
| WEIGHTS_n              | GRID, step 1 / (2^bits - 1), sums kept         | exact                 |
| JOINTS_n, others       | FLOAT32, lossless                              | exact                 |
| morph target, POSITION | GRID, the position step                        | exact                 |
| morph target, others   | GRID, one step, bits of the attribute it moves | exact                 |

Directions lose their length. "Exact" is INTEGER for unsigned components, and GRID with step 1 for
signed ones and for positions; the options for bits do not apply to it. Floats whose bits are EXACT
are FLOAT32.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gltf_ext._codec import GRID_MAX_BITS, STREAM_MAX_ELEMENTS, Stream
from gltf_ext.errors import MeshletError
from gltf_ext.sources.attribute_names import is_of_target, local_name, semantic

GRID, OCT, INTEGER, FLOAT32, SIGN = range(5)
# Skin weights whose sum differs from one by less than this are taken to sum to one.
WEIGHT_SUM_TOLERANCE = 1e-3
EXACT = 32  # bits of an attribute that keeps its floats
SMALLEST_STEP = float(np.finfo(np.float32).tiny)  # GPUs flush smaller ones to zero


@dataclass(frozen=True)
class Bits:
    """Bits per component of the attributes that are quantised.

    by_name: attribute -> its own bits, or EXACT; of morph targets as "targets[i].NAME".
    """

    position: int = 12
    normal: int = 8
    texcoord: int = 12
    color: int = 8
    weight: int = 8
    by_name: Mapping[str, int] = field(default_factory=dict)

    def of(self, name: str) -> int:
        """Bits of an attribute, or of the deltas that move it."""
        bits = {
            "NORMAL": self.normal,
            "TANGENT": self.normal,
            "TEXCOORD": self.texcoord,
            "COLOR": self.color,
            "WEIGHTS": self.weight,
        }.get(semantic(local_name(name)), self.position)
        return self.by_name.get(name, bits)


@dataclass(frozen=True)
class Grid:
    """The position grid: value = offset[c] + q * step. Offset and step are exact in float32."""

    offset: tuple[float, float, float]
    step: float


# --- grids ---


def position_grid(
    low: np.ndarray, high: np.ndarray, bits: int, step: float | None, scale: float = 1.0
) -> Grid:
    """Return the grid of a box low..high (float[3] each).

    Its step is `step` in units of the scene, which shows the box so many times larger (`scale`), or
    the longest side / (2^bits - 1). Raises MeshletError for a step that needs more than 24 bits.
    """
    extent = extent_of(low, high)
    if step is None:
        step_used = _step(extent, bits)
    else:
        step_used = max(float(np.float32(step / scale)), SMALLEST_STEP)
    cells = extent / step_used
    if np.rint(cells) >= 2**GRID_MAX_BITS:
        raise MeshletError(
            f"step {step_used * scale if step is None else step:g} needs more than "
            f"{GRID_MAX_BITS} bits for a box of {extent * scale:g}",
            f"use a step of at least {extent * scale / (2**GRID_MAX_BITS - 1):.3g}",
        )
    x, y, z = (float(v) for v in low)
    return Grid((x, y, z), step_used)


def _step(extent: float, bits: int) -> float:
    """Smallest float32 step whose 2^bits - 1 multiples span the extent (1 for no extent)."""
    if extent <= 0.0:
        return 1.0
    levels = 2**bits - 1
    step = np.float32(max(extent / levels, SMALLEST_STEP))
    while np.rint(extent / float(step)) > levels:
        step = np.nextafter(step, np.float32(np.inf))
    return float(step)


def _needed_bits(largest: int) -> int:
    return max(1, int(largest).bit_length())


def grid_values(values: np.ndarray, stream: Stream) -> np.ndarray:
    """round((value - offset) / step) in float64, as uint32[V, elements] (modulo 2^32).

    Any integer for values that are no number or far beyond the grid, as in a damaged file.
    """
    result: np.ndarray = grid_cells(values, stream.offset, stream.step).astype(np.uint32)
    return result


def grid_cells(values: np.ndarray, offset: tuple[float, ...], step: float) -> np.ndarray:
    """round((value - offset) / step) in float64, as int64[V, elements]."""
    result = np.empty(values.shape, np.int64)
    for c, column_offset in enumerate(offset):
        cells = values[:, c].astype(np.float64)
        with np.errstate(all="ignore"):
            cells -= column_offset
            if step != 1.0:
                cells /= step
            result[:, c] = np.rint(cells, out=cells).astype(np.int64)
    return result


def _fit_bits(name: str, stream: Stream, bounds: np.ndarray) -> Stream:
    """Return the stream with the bits that values within bounds need. Raises MeshletError."""
    integers = grid_values(bounds, stream)
    ends = bounds[1].astype(np.float64) - stream.offset  # integers are modulo 2^32
    bits = max(_needed_bits(integers.max()), _needed_bits(int(ends.max() / stream.step)))
    if bits > GRID_MAX_BITS:
        raise MeshletError(
            f"{name} needs {bits} bits at step {stream.step:g}, "
            f"at most {GRID_MAX_BITS} are possible",
            "use fewer bits or a larger step",
        )
    return replace(stream, bits=bits)


def _exact(name: str, bounds: np.ndarray) -> Stream:
    columns = bounds.shape[1]
    if bounds.dtype.kind == "u" and name != "POSITION":
        return Stream(INTEGER, columns, _needed_bits(bounds.max()))
    return _fit_bits(name, Stream(GRID, columns, 1, 1.0, _floats(bounds[0])), bounds)


def _floats(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def extent_of(low: np.ndarray, high: np.ndarray) -> float:
    """Return the longest side of a box. In float64: floats may be farther apart than any float."""
    return float(np.max(np.asarray(high, np.float64) - low))


def _value_grid(bounds: np.ndarray, bits: int) -> Stream:
    step = _step(extent_of(*bounds), bits)
    return Stream(GRID, bounds.shape[1], bits, step, _floats(bounds[0]))


def _unit_grid(bounds: np.ndarray, bits: int, full_scale: float) -> Stream:
    """[0, full_scale] in 2^bits - 1 steps; the values' own grid when they leave it."""
    if not _is_within(bounds, full_scale):
        return _value_grid(bounds, bits)
    components = bounds.shape[1]
    step = float(np.float32(full_scale / (2**bits - 1)))
    return Stream(GRID, components, bits, step, (0.0,) * components)


def _is_within(bounds: np.ndarray, full_scale: float) -> bool:
    return bool(bounds[0].min() >= 0.0 and bounds[1].max() <= full_scale)


def _delta_grid(name: str, bounds: np.ndarray, step: float) -> Stream:
    """Return a grid on which zero decodes to exactly zero; floats if it would need too many bits.

    Its -offset is a power of two times the step.
    """
    lowest, highest = np.rint(bounds.astype(np.float64) / step)
    below = [2 ** int(-k - 1).bit_length() if k < 0 else 0 for k in lowest]
    if max(highest + below) >= 2**GRID_MAX_BITS:
        # No room for the power of two: zero decodes to within rounding.
        below = [int(-k) for k in lowest]
    if max(highest + below) >= 2**GRID_MAX_BITS:  # displacements far larger than the mesh
        return Stream(FLOAT32, bounds.shape[1], 32)
    offset = tuple(float(np.float32(-b * step)) for b in below)
    return _fit_bits(name, Stream(GRID, bounds.shape[1], 1, step, offset), bounds)


# --- octahedral normals ---


def octahedral(vectors: np.ndarray, bits: int) -> np.ndarray:
    """Directions float[V, 3] of any length -> uint32[V, 2]. Zero becomes +z.

    Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", 2014.
    """
    x, y, z = (vectors[:, c].astype(np.float64) for c in range(3))
    length = np.abs(x) + np.abs(y) + np.abs(z)
    zero = length == 0.0
    if zero.any():
        length[zero] = 1.0
    x /= length
    y /= length
    lower = z < 0.0
    if lower.any():
        folded = (1.0 - np.abs(y)) * np.where(x < 0.0, -1.0, 1.0)
        y = np.where(lower, (1.0 - np.abs(x)) * np.where(y < 0.0, -1.0, 1.0), y)
        x = np.where(lower, folded, x)
    levels = 2**bits - 2  # even: 0 and the axes are exact
    result = np.empty((len(x), 2), np.uint32)
    result[:, 0] = np.rint((x + 1.0) * (0.5 * levels))
    result[:, 1] = np.rint((y + 1.0) * (0.5 * levels))
    return result


def octahedral_directions(integers: np.ndarray, bits: int) -> np.ndarray:
    """Decode directions: uint32[V, 2] -> unit vectors float32[V, 3].

    Uses the binary32 operations of the specification.
    """
    one = np.float32(1.0)
    scale = np.float32(2.0) / np.float32(2**bits - 2)
    x, y = (integers.astype(np.float32) * scale - one).T
    z = one - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, np.float32(0.0))
    x = x - np.copysign(fold, x)
    y = y - np.copysign(fold, y)
    inverse = one / np.sqrt(x * x + y * y + z * z)
    unit: np.ndarray = np.stack([x, y, z], axis=1) * inverse[:, None] + np.float32(0.0)
    return unit


def octahedral_bound(bits: int) -> float:
    """Largest angular error in radians: half a cell, stretched 3 sqrt 2 at a face's centre."""
    half_cell = 1.0 / (2.0**bits - 2.0)
    return 3.0 * math.sqrt(2.0) * half_cell * (1.0 + 2.0 * half_cell)


# --- other kinds ---


def ordered_bits(values: np.ndarray) -> np.ndarray:
    """Return float32 -> uint32 in the same order, without loss."""
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    return np.where(bits >> 31, ~bits, bits ^ np.uint32(0x80000000))


def from_ordered_bits(integers: np.ndarray) -> np.ndarray:
    """Return the inverse of ordered_bits."""
    bits = np.where(integers >> 31, integers ^ np.uint32(0x80000000), ~integers)
    return bits.astype(np.uint32).view(np.float32)


def quantise_weights(sets: list[np.ndarray], bits: int) -> list[np.ndarray]:
    """Skin weights float[V, 4] per set -> uint32[V, 4] per set.

    If a vertex's weights sum to one over all sets, its integers sum to 2^bits - 1: all are rounded
    down, then those with the largest remainders up. Zero weights stay zero.
    """
    levels = 2**bits - 1
    weights = np.concatenate(sets, axis=1).astype(np.float64)
    total = weights.sum(axis=1)
    sums_to_one = (np.abs(total - 1.0) <= WEIGHT_SUM_TOLERANCE) & (weights >= 0.0).all(axis=1)
    result = np.rint(weights * levels)
    exact = weights[sums_to_one] / total[sums_to_one, None] * levels
    floor = np.floor(exact)
    missing_units = levels - floor.sum(axis=1)
    by_remainder = np.argsort(floor - exact, axis=1, kind="stable")
    rank = np.argsort(by_remainder, axis=1, kind="stable")
    result[sums_to_one] = floor + (rank < missing_units[:, None])
    splits = np.cumsum([s.shape[1] for s in sets])[:-1]
    integers = result.astype(np.int64).astype(np.uint32)
    return [np.ascontiguousarray(columns) for columns in np.split(integers, splits, axis=1)]


# --- planning and quantising whole primitives ---


@dataclass
class Plan:
    """How the attributes of a primitive become streams.

    Attributes:
        streams: the stream table.
        attributes: name -> its consecutive streams; of morph targets as "targets[i].NAME".
        keeps_sums: whether skin weights that sum to one do so when they are rounded.
    """

    streams: list[Stream] = field(default_factory=list)
    attributes: dict[str, range] = field(default_factory=dict)
    keeps_sums: bool = True

    def streams_of(self, name: str) -> list[Stream]:
        """Return the streams of an attribute."""
        return [self.streams[s] for s in self.attributes[name]]

    @property
    def position_streams(self) -> list[int]:
        """The stream of POSITION, and those of each morph target's."""
        return [
            streams.start
            for name, streams in self.attributes.items()
            if local_name(name) == "POSITION"
        ]

    def quantise(self, attributes: dict[str, np.ndarray]) -> dict[int, np.ndarray]:
        """Stream -> uint32[n, elements] of vertices.

        attributes: name -> [n, components]; all sets of skin weights, which are rounded together,
            or none.
        """
        result = {}
        with np.errstate(invalid="ignore"):  # vertices without triangles may be no numbers
            weights = self._weights(attributes)
            for name, values in attributes.items():
                first = 0
                for number in self.attributes[name]:
                    stream = self.streams[number]
                    columns = slice(first, first + stream.width)
                    if name in weights:
                        result[number] = weights[name][:, columns]
                    else:
                        result[number] = quantise_columns(values[:, columns], stream)
                    first += stream.width
        return result

    def _weights(self, attributes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return uint32[n, 4] of each set of skin weights that are rounded together."""
        sets = [name for name, values in attributes.items() if _is_float_weights(name, values)]
        result = {}
        for index, name in enumerate(sets if self.keeps_sums else ()):
            stream = self.streams[self.attributes[name].start]
            if stream.kind == GRID:
                bits = round(math.log2(1.0 / stream.step + 1.0))
                rounded = quantise_weights([attributes[other] for other in sets], bits)
                result[name] = rounded[index]
        return result


def plan_streams(bounds: dict[str, np.ndarray], grid: Grid | None, bits: Bits, where: str) -> Plan:
    """Return the streams for attributes within bounds: integers grow with values.

    bounds: name -> [2, components], smallest and largest values; of morph targets as
        "targets[i].NAME". grid: for float positions; where: the primitive's place, for errors.
        Raises MeshletError.
    """
    plan = Plan(keeps_sums=keeps_sums(bounds))
    names = [name for name in bounds if not is_of_target(name)]
    names.sort(key=lambda name: (name != "POSITION", name))
    names += [name for name in bounds if is_of_target(name)]
    try:
        for name in names:
            streams = _streams(name, bounds[name], grid, bits)
            first = len(plan.streams)
            plan.streams += streams
            plan.attributes[name] = range(first, first + len(streams))
    except MeshletError as error:
        raise MeshletError(f"{where}: {error}") from None
    return plan


def keeps_sums(bounds: dict[str, np.ndarray]) -> bool:
    """Return whether all skin weights are in [0, 1]. bounds: as in plan_streams."""
    return all(_is_within(b, 1.0) for name, b in bounds.items() if _is_float_weights(name, b))


def _is_float_weights(name: str, values: np.ndarray) -> bool:
    return semantic(name) == "WEIGHTS" and values.dtype.kind == "f"


def _streams(name: str, bounds: np.ndarray, grid: Grid | None, bits: Bits) -> list[Stream]:
    if not is_of_target(name):
        return _attribute_streams(name, bounds, grid, bits)
    if bounds.dtype.kind == "f":
        return _target_streams(local_name(name), bounds, grid, bits.of(name))
    return [_exact(local_name(name), columns) for columns in _split_columns(bounds)]


def _attribute_streams(
    name: str, bounds: np.ndarray, grid: Grid | None, bits: Bits
) -> list[Stream]:
    kind, is_float, width = semantic(name), bounds.dtype.kind == "f", bounds.shape[1]
    own_bits = bits.of(name)
    if kind == "COLOR" and bounds.dtype == np.uint16:
        return [_unit_grid(bounds, own_bits, np.iinfo(np.uint16).max)]
    if not is_float:
        return [_exact(name, columns) for columns in _split_columns(bounds)]
    if name == "POSITION":
        assert grid is not None  # the caller has one for float positions
        return [_fit_bits(name, Stream(GRID, 3, 1, grid.step, grid.offset), bounds)]
    if (name, width) in (("NORMAL", 3), ("TANGENT", 4)):
        return [Stream(OCT, 2, own_bits), Stream(SIGN, 1, 1)][: width - 2]
    if kind == "TEXCOORD" and own_bits != EXACT:
        return [_value_grid(bounds, own_bits)]
    if kind in ("COLOR", "WEIGHTS") and own_bits != EXACT:
        return [_unit_grid(bounds, own_bits, 1.0)]
    return [Stream(FLOAT32, columns.shape[1], 32) for columns in _split_columns(bounds)]


def _split_columns(bounds: np.ndarray) -> list[np.ndarray]:
    """Columns for streams of at most four elements each."""
    ends = range(STREAM_MAX_ELEMENTS, bounds.shape[1], STREAM_MAX_ELEMENTS)
    return np.split(bounds, ends, axis=1)


def _target_streams(name: str, bounds: np.ndarray, grid: Grid | None, bits: int) -> list[Stream]:
    if bits == EXACT:
        return [Stream(FLOAT32, columns.shape[1], 32) for columns in _split_columns(bounds)]
    step = grid.step if grid is not None and name == "POSITION" else _step(extent_of(*bounds), bits)
    return [_delta_grid(name, columns, step) for columns in _split_columns(bounds)]


def quantise_columns(columns: np.ndarray, stream: Stream) -> np.ndarray:
    """Return uint32[n, elements] of an attribute's components that a stream stands for."""
    if stream.kind == OCT:
        return octahedral(columns, stream.bits)
    if stream.kind == SIGN:
        return (columns >= 0.0).astype(np.uint32)
    if stream.kind == INTEGER:
        return columns.astype(np.uint32)
    if stream.kind == FLOAT32:
        return ordered_bits(columns)
    return grid_values(columns, stream)


def dequantise(integers: np.ndarray, stream: Stream) -> np.ndarray:
    """Return uint32[V, elements] -> float32[V, width], or uint32 for INTEGER.

    Gives the same values as _codec.decode_values.
    """
    if stream.kind == GRID:
        values: np.ndarray = np.array(stream.offset) + integers.astype(np.float64) * stream.step
        return values.astype(np.float32)
    if stream.kind == OCT:
        return octahedral_directions(integers, stream.bits)
    if stream.kind == FLOAT32:
        return from_ordered_bits(integers)
    if stream.kind == SIGN:
        return integers.astype(np.float32) * 2.0 - 1.0
    return integers


def streams_of(first: int, components: int, streams: list[Stream]) -> range:
    """Return the consecutive streams, from `first` on, that fill an accessor's components.

    Raises ValueError when they do not.
    """
    index, width = first, 0
    while width < components:
        if not 0 <= index < len(streams):
            raise ValueError(f"stream {index} does not exist")
        width += streams[index].width
        index += 1
    if width != components:
        raise ValueError(
            f"the streams from {first} have {width} components, the accessor has {components}"
        )
    return range(first, index)


def to_accessor(columns: list[np.ndarray], dtype: np.dtype) -> np.ndarray:
    """Dequantised streams side by side in the accessor's component type.

    Returns [V, components], C-contiguous.
    """
    values = columns[0] if len(columns) == 1 else np.concatenate(columns, axis=1)
    if dtype.kind != "f" and values.dtype.kind == "f":
        limits = np.iinfo(dtype)
        values = np.clip(np.rint(values), limits.min, limits.max)
    return np.ascontiguousarray(values, dtype)
