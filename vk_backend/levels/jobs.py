"""The list of the clusters to draw, with its counters: shaders/levels/jobs.glsl."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..decode.decoder import Stage
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.memory import STORAGE, Buffer, Owner
from ..gpu.pipelines import push_record
from ..gpu.reflection import structure

CUT, JOB = structure("Cut"), structure("Job")
INDIRECT = STORAGE | vk.VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT


@dataclass(frozen=True)
class PoolStatistics:
    """A frame.

    clusters: to draw, with those that face away or are out of view (without levels of detail:
    meshlets of all instances); decoded: those that were not decoded yet, each once for all
    instances; hidden: those that were not drawn because others hide them; triangles: drawn, of
    clusters that are not culled.
    """

    clusters: int
    decoded: int
    hidden: int
    triangles: int


def counts_of(cut: Any) -> dict[str, int]:
    """The fields of PoolStatistics, of CUT[()] after a frame."""
    return {
        "clusters": int(cut["clusters"]),
        "decoded": int(cut["decoded_total"]) + int(cut["fresh_total"]),
        "hidden": int(cut["hidden"]),
        "triangles": int(cut["triangles"]),
    }


class JobList(Owner):
    """A buffer with CUT[()], then room for `most` rows of JOB.

    table: JOB[jobs] that are there from the start. fields: of CUT.
    """

    def __init__(self, device: Device, most: int, table: np.ndarray | None = None, **fields: Any):
        rows = np.zeros(0, JOB) if table is None else table
        cut = push_record(CUT, capacity=most, clusters=len(rows), **fields)
        buffer = Buffer(device, CUT.itemsize + JOB.itemsize * most, INDIRECT)
        super().__init__(jobs=buffer.write(cut.tobytes() + rows.tobytes()))
        self.buffer = buffer

    def dispatch(self, commands: Any, stage: Stage, pushed: np.ndarray) -> None:
        """Records a dispatch of as many workgroups as the member of CUT with its name says."""
        stage.pipeline.dispatch_indirect(commands, self.buffer, offset(stage.name), pushed)

    def cut(self) -> Any:
        """CUT[()]; waits."""
        return self.buffer.read(CUT, 1)[0]

    def jobs(self) -> np.ndarray:
        """JOB[clusters] of the last frame; waits."""
        return self.buffer.read(JOB, int(self.cut()["clusters"]), CUT.itemsize)


def rows_of(workgroups: int) -> tuple[int, int]:
    """(columns, rows) of at least so many workgroups."""
    columns = CONSTANTS["CUT_COLUMNS"]
    return min(workgroups, columns), -(-workgroups // columns)


def offset(member: str) -> int:
    """Of a member of CUT."""
    assert CUT.fields is not None
    return int(CUT.fields[member][1])
