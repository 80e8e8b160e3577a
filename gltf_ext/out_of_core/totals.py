"""Sums over the chunks of a primitive."""

from __future__ import annotations

from typing import Any

import numpy as np

from gltf_ext.out_of_core.records import Vertices


class Totals:
    """What a chunk, or several, add up to.

    Attributes:
        statistics: as _codec.encode gives them for one view.
        dropped: number of triangles with a repeated vertex.
        low, high: uint32[3]: bounds of the positions on the grid.
    """

    def __init__(self) -> None:
        self.statistics: dict[str, Any] = {}
        self.dropped = 0
        self.low, self.high = np.full(3, 2**32 - 1, np.uint32), np.zeros(3, np.uint32)
        self._inner = 0  # vertices that one chunk has
        self._shared: list[np.ndarray] = []

    @classmethod
    def of(cls, vertices: Vertices, is_shared: np.ndarray) -> Totals:
        """Of a chunk, without statistics. is_shared: bool[V]: vertices that others may have."""
        totals = cls()
        totals.dropped = vertices.dropped
        records = vertices.records
        if len(records):
            totals.low, totals.high = records["0"].min(axis=0), records["0"].max(axis=0)
            totals._inner = int(np.count_nonzero(~is_shared))
            rows = np.ascontiguousarray(records[is_shared])
            totals._shared.append(np.unique(rows.view(f"V{rows.dtype.itemsize}")))
        return totals

    def add(self, other: Totals) -> None:
        """Adds other chunks."""
        self.dropped += other.dropped
        self.low, self.high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        self._inner += other._inner
        self._shared += other._shared
        if other.statistics:
            self.add_statistics(other.statistics)

    def add_statistics(self, found: dict[str, Any]) -> None:
        """found: as _codec.encode gives them, of pages with the same streams."""
        sums = self.statistics
        if not sums:
            self.statistics = found
            return
        counts = [(sums, found), *((sums[k], found[k]) for k in ("bits", "symbols", "references"))]
        for total, more in counts:
            for name, value in more.items():
                if isinstance(value, int):
                    total[name] += value
        sums["bits"]["streams"] = np.add(sums["bits"]["streams"], found["bits"]["streams"]).tolist()
        total, more = sums["generation"], found["generation"]
        total["histogram"] = np.add(total["histogram"], more["histogram"]).tolist()
        total["iterations"] = max(total["iterations"], more["iterations"])

    @property
    def source_vertices(self) -> int:
        """Number of different vertices."""
        return self._inner + len(np.unique(np.concatenate(self._shared)))
