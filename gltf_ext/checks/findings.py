"""What verify has learned so far, and its report."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.attributes.details import BY_GRID, COLLAPSED_PERCENT, Collapse
from gltf_ext.attributes.extension import Compressed
from gltf_ext.checks.attribute_errors import Errors
from gltf_ext.checks.topology import Topology, difference
from gltf_ext.document.looks import Look

OfMeshes = list[tuple[float, list[Errors]]]  # factor from an error to percent, errors; of each mesh


@dataclass
class Findings:
    """The comparison so far.

    look_of: how a primitive, by mesh and index, is used by its materials; errors: attribute -> mesh
    -> errors of its primitives; problems, losses, warnings: one line each; topology: sums of the
    original and of the compressed file, None if none was compared; is_torn: whether they differ for
    another reason than the grid; collapse: triangles without area on the grid; rounding: of doubles
    when the original was read; the rest are counts.
    """

    look_of: Callable[[int, int], Look]

    rounding: float = 0.0
    triangles: int = 0
    missing_triangles: int = 0
    extra_triangles: int = 0
    collapse: Collapse = field(default_factory=Collapse)
    differing_primitives: int = 0
    joined_vertices: int = 0
    topology: tuple[Topology, Topology] | None = None
    is_torn: bool = False
    errors: dict[str, dict[int, list[Errors]]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def add_errors(self, mesh: int, name: str, errors: Errors) -> None:
        """Add the errors of an attribute of a primitive."""
        self.errors.setdefault(name, {}).setdefault(mesh, []).append(errors)

    def add_value_errors(
        self, mesh: int, compressed: Compressed, name: str, errors: Errors
    ) -> None:
        """Add the errors of an attribute of a primitive."""
        self.add_errors(mesh, name, errors)
        if name == "POSITION" and self.rounding:
            self._add_rounding(compressed, errors)
        if errors.over_bound > 1.0:
            self.problems.append(
                f"{compressed.where}: {name} is off by {errors.max:g}, more than its bits allow"
            )
        elif errors.limit and errors.limit.is_exceeded(errors.largest_component):
            self.losses.append(
                f"{compressed.where}: {name} is off by "
                f"{errors.limit.text(errors.largest_component)}, since its values span so much; "
                "compress with auto or more bits"
            )

    def _add_rounding(self, compressed: Compressed, errors: Errors) -> None:
        """Add what reading has lost to the errors of positions: the file has doubles."""
        errors.max += self.rounding
        errors.squares += errors.count * self.rounding**2
        if errors.of_area is not None:
            errors.of_area += self.rounding
        if self.rounding > compressed.streams[0].step / 2:
            self.losses.append(
                f"{compressed.where}: positions of the original are doubles, which 32-bit floats "
                f"round by up to {self.rounding:.2g}: split the model where its parts are far apart"
            )

    def add_collapse(self, compressed: Compressed, collapse: Collapse) -> None:
        """Add the triangles of a primitive that the grid collapses."""
        self.collapse.add(collapse)
        if 100 * collapse.share >= COLLAPSED_PERCENT:
            self.warnings.append(
                f"{compressed.where}: the grid collapses {collapse.triangles_text}, "
                f"{100 * collapse.share:.3g} % of the area: use more position bits"
            )

    def add_triangles(self, compressed: Compressed, missing: int, extra: int) -> None:
        """Add the counts of a primitive."""
        self.missing_triangles += missing
        self.extra_triangles += extra
        if missing or extra:
            self.problems.append(
                f"{compressed.where}: {missing} triangles are missing, {extra} are extra"
            )

    def add_topology(
        self,
        compressed: Compressed,
        before: Topology,
        after: Topology,
        is_of_grid: bool,
        is_joined: bool,
    ) -> None:
        """Add the topology of a primitive.

        is_of_grid: whether the grid makes vertices equal; is_joined: whether all that differs is
        that equal vertices of the original are one.
        """
        sums = self.topology or (Topology(), Topology())
        self.topology = sums[0].plus(after if is_joined else before), sums[1].plus(after)
        changes = difference(before, after)
        if changes and is_joined:
            self.joined_vertices += before.vertices - after.vertices
            self.warnings.append(
                f"{compressed.where}: vertices of the original that are equal in all values are "
                f"joined: {changes}; compress it again, without --max-memory, to have them apart"
            )
        elif changes:
            self.is_torn |= not is_of_grid
            reason = (
                BY_GRID if is_of_grid else "no vertices are equal on the grid: compress it again"
            )
            self.problems.append(f"{compressed.where}: {changes}; {reason}")

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
    topology = findings.topology
    return {
        "ok": not (findings.problems or findings.losses),
        "triangles_equal": not (
            findings.missing_triangles or findings.extra_triangles or findings.differing_primitives
        ),
        "errors_within_bits": all(e.over_bound <= 1.0 for errors in flat.values() for e in errors),
        "triangles": findings.triangles,
        "missing_triangles": findings.missing_triangles,
        "extra_triangles": findings.extra_triangles,
        "collapsed_triangles": round(findings.collapse.count),
        "collapsed_area_percent": 100 * findings.collapse.share,
        "differing_primitives": findings.differing_primitives,
        "is_torn": findings.is_torn,
        "joined_vertices": findings.joined_vertices,
        "topology": topology
        and {"original": vars(topology[0]).copy(), "compressed": vars(topology[1]).copy()},
        "max_error": each(lambda meshes: max(e.max for _, errors in meshes for e in errors)),
        "rms_error": each(lambda meshes: _rms([(1.0, errors) for _, errors in meshes])),
        "max_error_percent": each(lambda meshes: max(e.max * p for p, es in meshes for e in es)),
        "rms_error_percent": each(_rms),
        "max_error_degrees": directions,
        "area_error": {name: _largest_of_area([(1.0, flat[name])]) for name in flat},
        "area_error_percent": {name: _largest_of_area(meshes) for name, meshes in by_name.items()},
        "seen_error": {
            name: seen for name, errors in flat.items() if (seen := _seen(errors)) is not None
        },
        "error_over_bound": each(lambda meshes: max(e.over_bound for _, es in meshes for e in es)),
        "problems": findings.problems,
        "losses": findings.losses,
        "warnings": findings.warnings,
    }


def _largest_of_area(meshes: OfMeshes) -> float | None:
    """Return the largest error of most of the area of a primitive; None if none was measured."""
    measured = [e.of_area * p for p, errors in meshes for e in errors if e.of_area is not None]
    return max(measured) if measured else None


def _seen(errors: list[Errors]) -> dict[str, Any] | None:
    """Return the errors of an attribute whose bits promise a limit, in the limit's unit."""
    limited = [(e, e.limit) for e in errors if e.limit and e.is_compared]
    if not limited:
        return None
    of_area = [e.of_area / limit.unit for e, limit in limited if e.of_area is not None]
    return {
        "unit": limited[0][1].name,
        "max": max(e.max / limit.unit for e, limit in limited),
        "area": max(of_area) if of_area else None,
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
