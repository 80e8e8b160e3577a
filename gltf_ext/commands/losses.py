"""What quantisation loses: the steps that `compress` prints, and its warnings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.attributes.choice import Choice
from gltf_ext.attributes.details import COLLAPSED_PERCENT, Collapse
from gltf_ext.attributes.ranges import full_scale, visible_error
from gltf_ext.attributes.streams import GRID, OCT, Plan, octahedral_bound
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import mesh_scales
from gltf_ext.sources.attribute_names import is_of_target, semantic

MAX_NAMED = 3  # places that a warning names
# Semantic -> what its step is printed as.
LABELS = {
    "POSITION": "positions {} scene units",
    "NORMAL": "normals {} degrees",
    "TEXCOORD": "texture coordinates {}",
    "COLOR": "colours {}",
}


@dataclass
class Steps:
    """The smallest and the largest step of a kind of attribute, and the bits of both."""

    steps: list[float] = field(default_factory=list)
    bits: list[int] = field(default_factory=list)

    def add(self, step: float, bits: int) -> None:
        """Add those of a primitive."""
        self.steps = [min([step, *self.steps]), max([step, *self.steps])]
        self.bits = [min([bits, *self.bits]), max([bits, *self.bits])]


def steps_of(
    document: Document, encoded: Iterable[tuple[set[int], Choice, Plan]]
) -> dict[str, dict[str, Any]]:
    """Return semantic -> "step" and "bits", smallest and largest of all primitives.

    Positions in units of the scene: as large as nodes show them. Normals in degrees, the largest
    error. Integers as shares of their full scale. Of attributes on grids and of directions; none of
    exact ones.

    Args:
        document: the model.
        encoded: meshes that show it, values and streams of each primitive.
    """
    scales = mesh_scales(document)
    result: dict[str, Steps] = {}
    for meshes, choice, plan in encoded:
        of_mesh = {scales.get(mesh, 1.0) for mesh in meshes}
        for name in plan.attributes:
            if is_of_target(name) or semantic(name) not in LABELS:
                continue
            stream, kind = plan.streams_of(name)[0], semantic(name)
            units = (
                of_mesh
                if kind == "POSITION"
                else {1.0 / full_scale(choice.source.bounds[name].dtype)}
            )
            if stream.kind == OCT:
                steps = [float(np.degrees(octahedral_bound(stream.bits)))]
            elif stream.kind == GRID and stream.step != 1.0:
                steps = [stream.step * unit for unit in units]
            else:
                continue
            for step in steps:
                result.setdefault(kind, Steps()).add(step, stream.bits)
    return {name: {"step": each.steps, "bits": each.bits} for name, each in result.items()}


def steps_text(steps: dict[str, dict[str, Any]]) -> str:
    """Return the steps in one line; empty without any."""
    parts = []
    for kind, label in LABELS.items():
        if kind in steps:
            lengths = dict.fromkeys(f"{step:.2g}" for step in steps[kind]["step"])
            bits = dict.fromkeys(str(bits) for bits in steps[kind]["bits"])
            parts.append(f"{label.format(' to '.join(lengths))} ({' to '.join(bits)} bits)")
    return f"steps: {', '.join(parts)}" if parts else ""


# --- warnings ---


def compress_warnings(report: dict[str, Any]) -> list[str]:
    """Return the warnings of a report of `compress`, one line each.

    Also what is not in the result, what is not compressed, and what has no levels.
    """
    kinds = (
        ("degenerate_triangles", "degenerate triangles are dropped"),
        ("incomplete_triangles", "primitives end in an incomplete triangle, which is dropped"),
    )
    counts = report["dropped"]
    return [
        *report["warnings"],
        *_level_warnings(report.get("lod", [])),
        *(f"{counts[name]:,} {text}" for name, text in kinds if counts[name]),
        *(
            f"mesh {p['mesh']} primitive {p['primitive']} is left as it is: {p['reason']}"
            for p in report["kept"]
        ),
    ]


def _level_warnings(primitives: list[dict[str, Any]]) -> list[str]:
    single = [p for p in primitives if len(p["triangles"]) == 1]
    if not single:
        return []
    triangles = sum(p["triangles"][0] for p in single)
    return [
        f"{len(single):,} primitive{'' if len(single) == 1 else 's'} with {triangles:,} "
        f"triangle{'' if triangles == 1 else 's'} cannot be simplified and have one level"
    ]


def rounding_warnings(rounding: float, steps: list[float]) -> list[str]:
    """Warn of doubles that 32-bit floats round by more than a grid does. steps: of grids."""
    if not steps or rounding <= min(steps) / 2:
        return []
    return [
        f"positions are doubles that 32-bit floats round by up to {rounding:.2g}, more than the "
        "position grid does; split the model where its parts are far apart"
    ]


def collapse_warnings(collapses: dict[str, Collapse], is_auto: bool) -> list[str]:
    """Warn of primitives that lose COLLAPSED_PERCENT of their area.

    collapses: by primitive; is_auto: whether the grid was chosen.
    """
    shares = {where: 100 * each.share for where, each in collapses.items()}
    worst = sorted((w for w in shares if shares[w] >= COLLAPSED_PERCENT), key=lambda w: -shares[w])
    if not worst:
        return []
    places = ", ".join(
        f"{collapses[where].triangles_text} of {where} ({shares[where]:.3g} % of its area)"
        for where in worst[:MAX_NAMED]
    )
    more = f" and some of {len(worst) - MAX_NAMED:,} more" if len(worst) > MAX_NAMED else ""
    return [
        f"the position grid collapses {places}{more}; use {'' if is_auto else 'auto, '}"
        "more position bits, or split the model where its parts are far apart"
    ]


def joined_warnings(places: list[str]) -> list[str]:
    """Warn of primitives whose equal vertices are joined, but not counted. places: of these."""
    if not places:
        return []
    more = f" and {len(places) - MAX_NAMED:,} more" if len(places) > MAX_NAMED else ""
    return [
        f"{', '.join(places[:MAX_NAMED])}{more}: read in parts, so vertices that are equal in all "
        "values are joined; compress the model without --max-memory to have them apart"
    ]


def range_warnings(choice: Choice, plan: Plan) -> list[str]:
    """Warn of attributes whose range is so large that the step of their bits shows."""
    warnings = []
    for name in plan.attributes:
        if name not in choice.source.bounds:
            continue
        stream, bounds = plan.streams_of(name)[0], choice.source.bounds[name]
        low, high = bounds[0].min(), bounds[1].max()
        limit = visible_error(name, stream, choice.look, bounds.dtype)
        if limit is not None and limit.is_exceeded(stream.step / 2):
            warnings.append(
                f"{name} of {choice.source.where} reaches from {low:g} to {high:g}, "
                f"so {stream.bits} bits leave steps of {limit.text(stream.step)}; use auto or more"
            )
    return warnings


def limited(warnings: list[str]) -> list[str]:
    """Return some of the warnings of one kind, and how many more there are."""
    more = len(warnings) - MAX_NAMED
    return [*warnings[:MAX_NAMED], *([f"the same of {more:,} more attributes"] if more > 0 else [])]
