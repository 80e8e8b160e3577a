"""What verify has learned so far, and its report."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.attributes.extension import Compressed
from gltf_ext.checks.attribute_errors import Errors

OfMeshes = list[tuple[float, list[Errors]]]  # factor from an error to percent, errors; of each mesh


@dataclass
class Findings:
    """The comparison so far.

    errors: attribute -> mesh -> errors of its primitives; problems: one line each; the rest are
    counts.
    """

    triangles: int = 0
    missing_triangles: int = 0
    extra_triangles: int = 0
    collapsed_triangles: int = 0
    differing_primitives: int = 0
    errors: dict[str, dict[int, list[Errors]]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    def add_errors(self, mesh: int, name: str, errors: Errors) -> None:
        """Add the errors of an attribute of a primitive."""
        self.errors.setdefault(name, {}).setdefault(mesh, []).append(errors)

    def add_value_errors(
        self, mesh: int, compressed: Compressed, name: str, errors: Errors
    ) -> None:
        """Add the errors of an attribute of a primitive."""
        self.add_errors(mesh, name, errors)
        if errors.over_bound > 1.0:
            self.problems.append(
                f"{compressed.where}: {name} is off by {errors.max:g}, more than its bits allow"
            )

    def add_triangles(
        self, compressed: Compressed, missing: int, extra: int, collapsed: int
    ) -> None:
        """Add the counts of a primitive."""
        self.collapsed_triangles += collapsed
        self.missing_triangles += missing
        self.extra_triangles += extra
        if missing or extra:
            self.problems.append(
                f"{compressed.where}: {missing} triangles are missing, {extra} are extra"
            )

    def differs(self, problem: str) -> None:
        """Note a primitive that cannot be compared."""
        self.differing_primitives += 1
        self.problems.append(problem)

    def has_attributes(self, mesh: int, widths: dict[str, int], compressed: Compressed) -> bool:
        """Return whether a compressed primitive has attributes of these numbers of components.

        Notes the differences otherwise.
        """
        differences = _attribute_differences(widths, compressed)
        if differences:
            for name in widths:
                self.add_errors(mesh, name, Errors())
            self.differs(f"{compressed.where}: attributes differ: {differences}; not compared")
        return not differences


def _attribute_differences(old_widths: dict[str, int], compressed: Compressed) -> str:
    """Return the attributes that one side lacks or has with other components; empty for none."""
    new_widths = {name: format_[1] for name, _, format_ in compressed.named_streams}
    changed_names = [
        name for name in old_widths if new_widths.get(name, old_widths[name]) != old_widths[name]
    ]
    kinds = (
        ("only in the original", sorted(set(old_widths) - set(new_widths))),
        ("only in the compressed file", sorted(set(new_widths) - set(old_widths))),
        ("with other components", sorted(changed_names)),
    )
    return ", ".join(f"{' '.join(names)} {kind}" for kind, names in kinds if names)


def report_of(findings: Findings) -> dict[str, Any]:
    """Return the report of verify, without levels of detail."""
    by_name = {
        name: [(_percent(errors), errors) for errors in meshes.values()]
        for name, meshes in findings.errors.items()
    }
    flat = {name: [e for _, errors in meshes for e in errors] for name, meshes in by_name.items()}

    def each(figure: Callable[[OfMeshes], float]) -> dict[str, float | None]:
        return {
            name: figure(meshes) if any(e.is_compared for e in flat[name]) else None
            for name, meshes in by_name.items()
        }

    directions = {
        name: max(e.degrees or 0.0 for e in errors)
        for name, errors in flat.items()
        if any(e.degrees is not None for e in errors)
    }
    return {
        "ok": not findings.problems,
        "triangles_equal": not (
            findings.missing_triangles or findings.extra_triangles or findings.differing_primitives
        ),
        "errors_within_bits": all(e.over_bound <= 1.0 for errors in flat.values() for e in errors),
        "triangles": findings.triangles,
        "missing_triangles": findings.missing_triangles,
        "extra_triangles": findings.extra_triangles,
        "collapsed_triangles": findings.collapsed_triangles,
        "differing_primitives": findings.differing_primitives,
        "max_error": each(lambda meshes: max(e.max for _, errors in meshes for e in errors)),
        "rms_error": each(lambda meshes: _rms([(1.0, errors) for _, errors in meshes])),
        "max_error_percent": each(lambda meshes: max(e.max * p for p, es in meshes for e in es)),
        "rms_error_percent": each(_rms),
        "max_error_degrees": directions,
        "error_over_bound": each(lambda meshes: max(e.over_bound for _, es in meshes for e in es)),
        "problems": findings.problems,
    }


def _percent(errors: list[Errors]) -> float:
    """Factor from an error to percent of the diagonal of a mesh's box."""
    boxes = [e.box for e in errors if e.box is not None]
    if not boxes:
        return 0.0
    with np.errstate(invalid="ignore"):  # lossless custom attributes may be infinite
        box = np.max([b[1] for b in boxes], axis=0) - np.min([b[0] for b in boxes], axis=0)
    diagonal = float(np.linalg.norm(box))
    return 100.0 / diagonal if diagonal > 0.0 else 0.0


def _rms(meshes: OfMeshes) -> float:
    """Root mean square over all vertices, the errors of each mesh times its factor."""
    squares = sum(sum(e.squares for e in errors) * scale**2 for scale, errors in meshes)
    return math.sqrt(squares / max(sum(e.count for _, errors in meshes for e in errors), 1))
