"""Chooses the bits that are `auto`: what the eye needs of each primitive, and little more.

Positions take the grid of their mesh, which its primitives share so that their borders meet. The
constants were measured with `python -m bench defaults`, against 14 bits for positions, 10 for
normals and 12 for texture coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gltf_ext._codec import GRID_MAX_BITS
from gltf_ext.attributes.details import COLLAPSED_PERCENT, Sample, sample_of
from gltf_ext.attributes.streams import EXACT, Bits, Grid, extent_of, position_grid
from gltf_ext.document.looks import Look
from gltf_ext.options import AUTO, Options
from gltf_ext.sources.attribute_names import is_of_target, local_name, semantic
from gltf_ext.sources.source import Box, Source

# Positions. With 13 bits a vertex moves by at most 1/16,000 of the longest side. Without normals,
# the faces' own show more of it. So do surfaces that bend much, whose normals turn by more than
# BENT radians along the longest side, on average: of the files of `bench defaults`, those that turn
# by 20 and more look worse than with 14 and 10 bits, and those that turn by 14 and less do not.
LEAST_POSITION, LEAST_WITHOUT_NORMALS, LEAST_FOR_BENT = 13, 14, 14
BENT = 17.0
# 90 % of the edges have so many steps, and half of those of flat-shaded primitives.
STEPS_OF_SHORT, SHORT, STEPS_OF_FLAT = 2, 0.1, 32
MOST_FOR_FLAT, MOST_FOR_APART = 16, 16  # bits for flat shading, for vertices to stay apart
# Shares of the area: of a mesh, and of each of its primitives as far as MOST_FOR_APART bits help.
MOST_COLLAPSED, MOST_OF_PRIMITIVE = 1e-4, COLLAPSED_PERCENT / 100
# Normals: 11 bits are off by at most 0.12 degrees, and take less than the bit of positions that 14
# and 10 spend instead.
NORMAL, FINE_NORMAL, UNLIT_NORMAL = 11, 12, 8
TANGENT_LESS, LEAST_TANGENT = 2, 8  # bits: a normal map's slopes scale errors of tangents down
GENTLE, GENTLE_SHARE = 1.0, 0.25  # degrees between normals of a triangle; of what is curved
GLOSSY = 0.25  # roughness
# Texture coordinates: steps of a texel, and the texels of a tile whatever its textures, which may
# be placeholders.
STEPS_OF_TEXEL, LEAST_TEXELS = 4, 1024
ABOUT = 1e-3  # bits that a step may lack
COLOR, WEIGHT = 12, 8


@dataclass(frozen=True)
class Choice:
    """A source, how it looks, and its bits but for positions.

    sample: some of its triangles; None without float positions.
    """

    source: Source
    look: Look
    bits: Bits
    sample: Sample | None


def choose(source: Source, look: Look, options: Options) -> Choice:
    """Choose the bits of a source. Raises MeshletError, OSError."""
    sample = sample_of(source) if source.box is not None else None
    return Choice(source, look, _choose_bits(source, look, options, sample), sample)


def _choose_bits(source: Source, look: Look, options: Options, sample: Sample | None) -> Bits:
    """Return the bits of all attributes but POSITION; `auto` for them by the source's bounds."""
    automatic = {
        "NORMAL": options.normal_bits,
        "TEXCOORD": options.texcoord_bits,
        "COLOR": options.color_bits,
        "WEIGHTS": options.weight_bits,
    }
    by_name = {}
    for name, bounds in source.bounds.items():
        kind = semantic(local_name(name))
        if automatic.get(kind) == AUTO and bounds.dtype.kind == "f":
            bits = _bits_of_values(kind, name, bounds, look)
            if bits:
                by_name[name] = bits
    normal = options.normal_bits
    if isinstance(normal, str):
        normal = _normal_bits(sample, look)
        by_name.update(_tangent_bits(source, normal))
    return Bits(
        _number(options.position_bits, LEAST_WITHOUT_NORMALS),
        normal,
        _number(options.texcoord_bits, int(math.log2(STEPS_OF_TEXEL * LEAST_TEXELS))),
        _number(options.color_bits, COLOR),
        _number(options.weight_bits, WEIGHT),
        by_name,
    )


def _number(bits: int | str | None, automatic: int) -> int:
    return bits if isinstance(bits, int) else automatic


# --- values on their own grids ---


def _bits_of_values(kind: str, name: str, bounds: np.ndarray, look: Look) -> int:
    """Return the bits for a step that the eye does not see; 0 for those of the kind."""
    if kind == "TEXCOORD":
        return bits_for(bounds, texcoord_step(local_name(name), look))
    if kind not in ("COLOR", "WEIGHTS"):
        return 0
    if bounds[0].min() >= 0.0 and bounds[1].max() <= 1.0 and not is_of_target(name):
        return 0  # the grid of the unit range is the same for all primitives
    return bits_for(bounds, 1.0 / (2 ** (COLOR if kind == "COLOR" else WEIGHT) - 1))


def texels_of(name: str, look: Look) -> float:
    """Return the texels along one unit of a TEXCOORD_n that its bits are to tell apart."""
    digits = name.rpartition("_")[2]
    texels = look.texels.get(int(digits), 0.0) if digits.isdecimal() else 0.0
    return max(texels, LEAST_TEXELS)


def texcoord_step(name: str, look: Look) -> float:
    """Return the largest step of a TEXCOORD_n that the eye does not see."""
    return 1.0 / (STEPS_OF_TEXEL * texels_of(name, look))


def bits_for(bounds: np.ndarray, step: float) -> int:
    """Return the bits of a grid over bounds, [2, components], with about this step at most.

    One tile in steps of 1/4095 takes 12 bits, not the 13 of 1/4096. EXACT if a grid cannot have as
    many.
    """
    extent = extent_of(*bounds)
    bits = max(1, math.ceil(math.log2(max(extent / step, 1.0)) - ABOUT))
    return bits if bits <= GRID_MAX_BITS else EXACT


def _normal_bits(sample: Sample | None, look: Look) -> int:
    if not look.is_lit:
        return UNLIT_NORMAL
    if sample is None or sample.normals is None:
        return NORMAL
    is_gentle = sample.gentle_share(GENTLE) >= GENTLE_SHARE
    return FINE_NORMAL if is_gentle or look.roughness < GLOSSY else NORMAL


def _tangent_bits(source: Source, normal: int) -> dict[str, int]:
    bits = max(normal - TANGENT_LESS, LEAST_TANGENT)
    return {name: bits for name in source.attributes if local_name(name) == "TANGENT"}


# --- the grid of positions ---


def choose_grid(choices: list[Choice], box: Box) -> Grid:
    """Return the grid of positions that share it. box: around all of them. Raises MeshletError."""
    samples = [each.sample for each in choices if each.sample]
    extent = extent_of(*box)

    def grid_of(bits: int) -> Grid:
        return position_grid(*box, bits, None)

    first = _edge_bits(samples, extent)
    bits = _first_bits(first, GRID_MAX_BITS, lambda bits: _keeps_area(samples, grid_of(bits)))
    last = max(bits, MOST_FOR_APART)
    return grid_of(_first_bits(bits, last, lambda bits: _keeps_each(samples, grid_of(bits))))


def _first_bits(first: int, last: int, is_enough: Callable[[int], bool]) -> int:
    """Return the first number of bits that is enough; `last` if none is before it."""
    return next((bits for bits in range(first, last) if is_enough(bits)), last)


def _edge_bits(samples: list[Sample], extent: float) -> int:
    """Return the bits that give edges enough steps."""
    candidates = [LEAST_FOR_BENT if _are_bent(samples, extent) else LEAST_POSITION]
    edges = [sample.edges() for sample in samples]
    weights = [np.full(len(e), sample.factor) for e, sample in zip(edges, samples)]
    if samples:
        candidates.append(
            _bits_of_edge(
                np.concatenate(edges), np.concatenate(weights), SHORT, extent, STEPS_OF_SHORT
            )
        )
    for sample, lengths, weight in zip(samples, edges, weights):
        if sample.normals is None:
            flat = _bits_of_edge(lengths, weight, 0.5, extent, STEPS_OF_FLAT)
            candidates.append(min(max(flat, LEAST_WITHOUT_NORMALS), MOST_FOR_FLAT))
    return max(candidates)


def _are_bent(samples: list[Sample], extent: float) -> bool:
    """Return whether surfaces with normals bend much on their way along an extent."""
    with_normals = [sample for sample in samples if sample.normals is not None]
    area = sum(sample.factor * float(sample.areas.sum()) for sample in with_normals)
    return extent * sum(sample.turn() for sample in with_normals) > BENT * area


def _bits_of_edge(
    lengths: np.ndarray, weights: np.ndarray, share: float, extent: float, steps: int
) -> int:
    is_long = (lengths > 0.0) & np.isfinite(lengths)
    if not is_long.any():
        return LEAST_POSITION
    short = _quantile(lengths[is_long], weights[is_long], share)
    return min(math.ceil(math.log2(steps * extent / short + 1.0)), GRID_MAX_BITS)


def _keeps_area(samples: list[Sample], grid: Grid) -> bool:
    area = total = 0.0
    for sample in samples:
        collapse = sample.collapse(grid)
        area += sample.factor * collapse.area
        total += sample.factor * collapse.total_area
    return area <= MOST_COLLAPSED * total


def _keeps_each(samples: list[Sample], grid: Grid) -> bool:
    return all(sample.collapse(grid).share < MOST_OF_PRIMITIVE for sample in samples)


def _quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the smallest value such that values up to it have this share of the weights."""
    if weights.min() == weights.max():
        index = max(math.ceil(share * len(values)) - 1, 0)
        return float(np.partition(values, index)[index])  # a tenth of the time of sorting
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    index = int(np.searchsorted(sums, share * sums[-1]))
    return float(values[order[min(index, len(values) - 1)]])
