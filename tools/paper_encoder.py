"""The encoder with regions as in the paper, for bench and for the conformance vectors.

The codec's library does not have them: `encode` builds it with MESHLET_BENCH (needs cmake).
"""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from typing import Any

from gltf_ext import _library
from gltf_ext._codec import encode as encode_by  # bench replaces _codec's
from tools import native_build

PaperOptions = type(
    "PaperOptions",
    (_library.Struct,),
    {
        "_fields_": [
            ("size", ctypes.c_uint32),
            ("as_paper", ctypes.c_uint32),
            ("weight_of_choe", ctypes.c_uint32),
            ("separate_seams", ctypes.c_uint32),
            ("fill", ctypes.c_float),
        ]
    },
)
WEIGHTS = {"paper": 0, "choe": 1}


def encode(
    *mesh: Any,
    as_paper: bool = True,
    fill: float = 0.0,
    weight: str = "paper",
    share_seams: bool = True,
    **options: Any,
) -> tuple[bytes, dict[str, Any]]:
    """`_codec.encode`, with further options.

    as_paper: regions grow anew in each round; else as the effort says. fill: mean share of the
    triangles of a full region, which sets the number of regions; 0 for the default. weight: "paper"
    or "choe", that of Choe et al. share_seams: off stores both sides of seams. Raises ValueError.
    """
    paper = PaperOptions(
        as_paper=as_paper,
        fill=fill,
        weight_of_choe=WEIGHTS[weight],
        separate_seams=not share_seams,
    )

    def function(arrays: Any, common: Any, statistics: Any, out: Any) -> None:
        library = _library_of_bench()
        if library.gltf_meshlet_encode_as_paper(arrays, common, paper, statistics, out):
            raise ValueError(library.gltf_meshlet_error().decode())

    return encode_by(*mesh, **options, function=function)


@functools.cache
def _library_of_bench() -> ctypes.CDLL:
    folder = native_build.build("MESHLET_BENCH")
    library = ctypes.CDLL(str(folder / Path(_library.library._name).name))
    library.gltf_meshlet_error.restype = ctypes.c_char_p
    library.gltf_meshlet_encode_as_paper.argtypes = [ctypes.c_void_p] * 5
    return library
