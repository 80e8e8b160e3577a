"""Encodes the triangles of a chunk as they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.records import EncoderInput, RecordFormat, Triangles
from gltf_ext.encode.chunks import are_among
from gltf_ext.encode.totals import Totals
from gltf_ext.options import Options
from gltf_ext.progress import Advance
from gltf_ext.work_files import give_back_memory


@dataclass
class PlainEncoder:
    """Encodes vertices of a primitive without levels of detail.

    Attributes:
        record_format: of their records.
        generation: keyword arguments of _codec.encode.
        page_limit: bytes of the largest page, 0 for one blob.
    """

    record_format: RecordFormat
    generation: dict[str, Any]
    page_limit: int

    @classmethod
    def of(
        cls, record_format: RecordFormat, options: Options, triangles: int, is_in_memory: bool
    ) -> PlainEncoder:
        """Return an encoder of a primitive of so many triangles. is_in_memory: of its source."""
        limit = options.page_limit_without_levels(triangles, is_in_memory)
        return cls(record_format, options.generation, limit)

    def view_of(
        self, encoder_input: EncoderInput, threads: int, progress: Advance | None
    ) -> tuple[bytes, dict[str, Any]]:
        """Return (blobs, statistics) of _codec.encode."""
        return _codec.encode(
            *encoder_input,
            progress=progress,
            threads=threads,
            page_bytes=self.page_limit,
            **self.generation,
        )


def encode_chunk(
    threads: int,
    encoder: PlainEncoder,
    triangles: Triangles,
    border_keys: np.ndarray,
    progress: Advance | None = None,
) -> tuple[bytes, Totals]:
    """Return the pages of a chunk. border_keys: keys of positions that others have."""
    record_format = encoder.record_format
    vertices = record_format.vertices_of(triangles)
    is_shared = are_among(border_keys, vertices.records["0"])
    totals = Totals.of(vertices, is_shared, record_format.plan.position_streams)
    if not len(vertices.triangles):
        return b"", totals
    encoder_input = record_format.encoder_input_of(vertices)
    del vertices, is_shared
    triangles.clear()
    view, totals.statistics = encoder.view_of(encoder_input, threads, progress)
    give_back_memory()
    return view, totals
