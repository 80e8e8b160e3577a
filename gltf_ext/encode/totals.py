"""Sums over the chunks of a primitive."""

from __future__ import annotations

from typing import Any

import numpy as np

from gltf_ext.attributes.records import Vertices
from gltf_ext.document.accessors import bounds
from gltf_ext.sources.primitives import DropCounts


class Totals:
    """What a chunk, or several, add up to.

    Attributes:
        statistics: as _codec.encode gives them for one view.
        drop_counts: what is left out.
        bounds: uint32[2, 3] of each stream of positions, on the grid.
    """

    def __init__(self) -> None:
        """Of nothing yet."""
        self.statistics: dict[str, Any] = {}
        self.drop_counts = DropCounts()
        self.bounds: dict[int, np.ndarray] = {}
        self._inner = 0  # vertices that one chunk has
        self._border_records: list[np.ndarray] = []

    @classmethod
    def of(cls, vertices: Vertices, is_shared: np.ndarray, streams: list[int]) -> Totals:
        """Of a chunk, without statistics.

        is_shared: bool[V]: vertices that others may have; streams: of positions.
        """
        totals = cls()
        totals.drop_counts = vertices.drop_counts
        records = vertices.records
        if len(records):
            totals.bounds = {s: np.stack(bounds(records[str(s)])) for s in streams}
            totals._inner = int(np.count_nonzero(~is_shared))
            if totals._inner < len(records):
                rows = np.ascontiguousarray(records[is_shared])
                totals._border_records.append(np.unique(rows.view(f"V{rows.dtype.itemsize}")))
        return totals

    def add(self, other: Totals) -> None:
        """Add other chunks."""
        self.drop_counts.add(other.drop_counts)
        for stream, ends in other.bounds.items():
            rows = np.concatenate([self.bounds.get(stream, ends), ends])
            self.bounds[stream] = np.stack(bounds(rows))
        self._inner += other._inner
        self._border_records += other._border_records
        if other.statistics:
            self.add_statistics(other.statistics)

    def add_statistics(self, other: dict[str, Any]) -> None:
        """Add those of pages with the same streams, as _codec.encode gives them."""
        sums = self.statistics
        if not sums:
            self.statistics = other
            return
        counts = [(sums, other), *((sums[k], other[k]) for k in ("bits", "symbols", "references"))]
        for total, addend in counts:
            for name, value in addend.items():
                if isinstance(value, int):
                    total[name] += value
        sums["bits"]["streams"] = np.add(sums["bits"]["streams"], other["bits"]["streams"]).tolist()
        total, addend = sums["generation"], other["generation"]
        total["histogram"] = np.add(total["histogram"], addend["histogram"]).tolist()
        total["iterations"] = max(total["iterations"], addend["iterations"])

    @property
    def source_vertices(self) -> int:
        """Number of different vertices."""
        shared = np.unique(np.concatenate(self._border_records)) if self._border_records else ()
        return self._inner + len(shared)
