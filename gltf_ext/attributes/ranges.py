"""Errors in the units of the eye: texels, 8-bit steps of a colour; from which on they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gltf_ext._codec import Stream
from gltf_ext.attributes.choice import texels_of
from gltf_ext.attributes.streams import GRID
from gltf_ext.document.looks import Look
from gltf_ext.sources.attribute_names import local_name, semantic


@dataclass(frozen=True)
class Limit:
    """The largest error that bits promise.

    Attributes:
        error: in the attribute's units, as stored.
        unit: one of `name` in these units.
    """

    error: float
    unit: float
    name: str

    def text(self, error: float) -> str:
        """Return an error in the unit."""
        return f"{error / self.unit:.3g} {self.name}"


def visible_error(name: str, stream: Stream, look: Look, dtype: np.dtype) -> Limit | None:
    """Return what bits promise: half a step of the unit range, a texel, an 8-bit step of a colour.

    The larger counts. None for other attributes than texture coordinates, colours and weights on
    grids, and for integers that are exact.
    """
    kind = semantic(local_name(name))
    if stream.kind != GRID or stream.step == 1.0 or kind not in ("TEXCOORD", "COLOR", "WEIGHTS"):
        return None
    full_scale = 1.0 if dtype.kind == "f" else float(np.iinfo(dtype).max)
    if kind == "TEXCOORD":
        unit, label = full_scale / texels_of(local_name(name), look), "texels"
    else:
        unit, label = full_scale / 255, "8-bit steps"
    return Limit(max(0.5 * full_scale / (2**stream.bits - 1), unit), unit, label)
