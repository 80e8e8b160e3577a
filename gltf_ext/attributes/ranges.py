"""Errors in the units of the eye: texels, 8-bit steps of a colour; from which on they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext._codec import Stream
from gltf_ext.attributes.choice import texels_of
from gltf_ext.attributes.streams import GRID
from gltf_ext.document.looks import Look
from gltf_ext.sources.attribute_names import local_name, semantic

SLACK = 1.5  # of an error that bits promise


@dataclass(frozen=True)
class Limit:
    """The largest error of a component that bits promise.

    Attributes:
        error: in the attribute's units, as stored.
        unit: one of `name` in these units.
    """

    error: float
    unit: float
    name: str

    def is_exceeded(self, error: float) -> bool:
        """Return whether the error of a component shows."""
        return error > SLACK * self.error

    def text(self, error: float) -> str:
        """Return an error in the unit."""
        return f"{error / self.unit:.3g} {self.name}"


def full_scale(dtype: np.dtype) -> float:
    """Return the stored value that stands for one."""
    return 1.0 if dtype.kind == "f" else float(np.iinfo(dtype).max)


def visible_error(name: str, stream: Stream, look: Look, dtype: np.dtype) -> Limit | None:
    """Return what bits promise: half a step of the unit range, a texel, an 8-bit step of a colour.

    The larger counts. A whole step of weights, which are rounded so that their sum stays. None for
    other attributes than texture coordinates, colours and weights on grids, and for integers that
    are exact.
    """
    kind = semantic(local_name(name))
    if stream.kind != GRID or stream.step == 1.0 or kind not in ("TEXCOORD", "COLOR", "WEIGHTS"):
        return None
    scale = full_scale(dtype)
    unit, label = shading_unit(name, look, dtype)
    steps = 1.0 if kind == "WEIGHTS" else 0.5
    return Limit(max(steps * scale / (2**stream.bits - 1), unit), unit, label)


def shading_unit(name: str, look: Look, dtype: np.dtype) -> tuple[float, str]:
    """Return a unit of the eye, in the attribute's units as stored, and its name.

    A texel of texture coordinates, a degree of normals, an 8-bit step of colours and weights.
    """
    kind = semantic(local_name(name))
    if kind == "TEXCOORD":
        return full_scale(dtype) / texels_of(local_name(name), look), "texels"
    return (1.0, "degrees") if kind == "NORMAL" else (full_scale(dtype) / 255, "8-bit steps")
