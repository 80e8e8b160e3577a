"""Compares how accessors describe a primitive's attributes with the original."""

from __future__ import annotations

import numpy as np

from gltf_ext.attributes.extension import Compressed
from gltf_ext.attributes.streams import dequantise, to_accessor
from gltf_ext.document import gltf
from gltf_ext.document.accessors import stated_bounds
from gltf_ext.document.document import Document
from gltf_ext.sources.attribute_names import pair_names


def accessor_problems(
    original: Document, document: Document, compressed: Compressed, box: np.ndarray | None
) -> list[str]:
    """Return a line for each accessor with another type, and for a wrong box of positions.

    box: uint32[2, 3]: smallest and largest integers of the positions; None without vertices.
    """
    mesh, index = compressed.mesh, compressed.primitive
    before, after = (
        dict(pair_names(gltf.attribute_sets(d.primitive(mesh, index))))
        for d in (original, document)
    )
    problems = []
    for name in before.keys() & after.keys():
        types = [
            (a.get("componentType"), a.get("type"), bool(a.get("normalized")))
            for a in (original.accessors[before[name]], document.accessors[after[name]])
        ]
        if types[0] != types[1]:
            texts = [f"{t[1]} of {t[0]}{', normalized' if t[2] else ''}" for t in types]
            problems.append(f"{compressed.where}: {name} is {texts[1]}, it was {texts[0]}")
    if box is not None:
        dtype = compressed.attributes["POSITION"][1][0]
        decoded = to_accessor([dequantise(box, compressed.streams[0])], dtype)
        stated = stated_bounds(document.accessors[after["POSITION"]])
        for label, bound, value in zip(("min", "max"), stated, decoded):
            if bound is None or not np.array_equal(bound, value.astype(np.float64)):
                problems.append(
                    f"{compressed.where}: {label} of POSITION is not that of its vertices; "
                    "compress it again"
                )
    return sorted(problems)
