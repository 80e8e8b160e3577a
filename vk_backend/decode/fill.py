"""Decodes meshlets by their numbers into slots: for the ray tracer, whose slots hold a part each.

shaders/decoders/slots.glsl describes a slot.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.pipelines import ComputePipeline, push_record
from ..gpu.reflection import structure

FILL_PUSH = structure("FillPush")
SERIAL_FILL = 12_000  # meshlets; from here on a thread each is faster than a team each (docs)


class Filler:
    """The team decoder and the serial decoder. constants: of the slots and the capacities."""

    def __init__(self, device: Device, constants: Mapping[str, int]):
        self._device = device
        self._team, self._serial = (
            ComputePipeline.of(device, name, constants)
            for name in ("rt_fill.comp", "rt_fill_serial.comp")
        )

    def decode(self, commands: Any, first: int, count: int, **addresses: int) -> None:
        """Records the decoding of `count` meshlets from number `first` on into the first slots.

        addresses: frame, sources (of all numbers) and cache (of the slots). A barrier follows. A
        malformed meshlet has no triangles.
        """
        data = push_record(FILL_PUSH, first=first, count=count, **addresses)
        if count < SERIAL_FILL:
            self._team.dispatch(commands, min(count, MAX_WORKGROUPS), data)
        else:
            self._serial.dispatch(commands, min(-(-count // 32), MAX_WORKGROUPS), data)
        self._device.full_barrier(commands)
