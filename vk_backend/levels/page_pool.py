"""The pool of compressed pages in device memory: root pages, then slots of equal size.

A resident page has a row in the table of primitives, through which the shaders find its blob, the
bounds of its meshlets and how to dequantise it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from gltf_ext.ranges import begins

from ..decode.bounds import bounds_pipeline, record_bounds
from ..gpu import vk
from ..gpu.allocator import UPLOAD
from ..gpu.constants import CONSTANTS
from ..gpu.device import Device
from ..gpu.errors import VulkanError
from ..gpu.memory import Buffer
from ..scene.buffers import PRIMITIVE, primitive_record
from ..scene.scene import Scene
from .hierarchies import PAGE_ROW, Hierarchies
from .residency import Residency, Update

UPLOADS = 64  # pages of a frame, at most
# Pages that are read and tested at a time: one takes 0.6 ms, 64 would take more than two frames.
READERS = 4
NOT_RESIDENT = CONSTANTS["NOT_RESIDENT"]
UNDECODED = CONSTANTS["UNDECODED"]


class PagePool:
    """The pages of a scene that was loaded with levels.

    size: bytes for compressed pages, rounded down to whole pages. Raises VulkanError if it does not
    hold the root pages, MeshletError if one of these is malformed.
    """

    def __init__(self, device: Device, scene: Scene, hierarchies: Hierarchies, size: int):
        self._device, self._scene, self._hierarchies = device, scene, hierarchies
        h = hierarchies
        roots, others = np.flatnonzero(h.is_root), ~h.is_root
        root_bytes = int(h.sizes[roots].sum())
        if size < root_bytes:
            raise VulkanError(
                f"a pool of {size} bytes does not hold the coarsest pages", f"use {root_bytes}"
            )
        self._slot_bytes = int(h.sizes[others].max(initial=4))
        slots = min((size - root_bytes) // self._slot_bytes, int(np.count_nonzero(others)))
        self._readers = ThreadPoolExecutor(READERS)
        self.residency = Residency(h, slots, h.read, self._readers.map)
        self.is_resident = h.is_root.copy()
        # The first byte, and the bounds of the first meshlet, of each row.
        room = np.full(slots, self._slot_bytes), np.full(slots, h.clusters[others].max(initial=0))
        self._blob_begin = begins(np.append(h.sizes[roots], room[0]))
        self._bounds_begin = begins(np.append(h.clusters[roots], room[1]))
        self._blobs = Buffer(device, int(self._blob_begin[-1]))
        self._bounds = Buffer(device, CONSTANTS["BOUNDS_BYTES"] * int(self._bounds_begin[-1]))
        self.rows = Buffer(device, PRIMITIVE.itemsize * (len(roots) + slots))
        self._templates = [primitive_record(p) for p in scene.primitives]
        self._boxes = h.boxes()
        pages = h.pages
        pages["row"][roots] = np.arange(len(roots))
        self.pages = Buffer(device, pages.nbytes).write(pages)
        # Of the slot of each meshlet: see shaders/levels/jobs.glsl.
        self.decoded = Buffer(device, 4 * int(self._bounds_begin[-1]))
        self.decoded.write(np.full(int(self._bounds_begin[-1]), UNDECODED, np.uint32))
        # Of a page: the blob, the row, and its number and that of the page that it replaces.
        self._uploads = min(UPLOADS, max(slots, 1))
        staged = self._slot_bytes + PRIMITIVE.itemsize + 8
        self._staging = Buffer(device, self._uploads * staged, memory=UPLOAD)
        self._bounds_pipeline = bounds_pipeline(device, scene)
        self._upload_roots(roots)

    @property
    def buffers(self) -> dict[str, Buffer]:
        """All buffers; they stay the same."""
        own = {"pages": self.pages, "rows": self.rows, "decoded": self.decoded}
        return own | {"blobs": self._blobs, "bounds": self._bounds, "staging": self._staging}

    def end_reading(self) -> None:
        """Ends the threads; no update may come afterwards."""
        self._readers.shutdown()

    def _upload_roots(self, roots: np.ndarray) -> None:
        blobs = [self._hierarchies.read(int(page)) for page in roots]
        rows = [self._row(int(page), row, blobs[row]) for row, page in enumerate(roots)]
        self._blobs.write(b"".join(blobs))
        self.rows.write(np.array(rows, PRIMITIVE))
        with self._device.commands() as commands:
            # The rows and blobs, which earlier submissions have copied, are read by address.
            self._device.full_barrier(commands)
            for row, page in enumerate(roots):
                self._record_bounds(commands, int(page), row)
            # Later submissions read the bounds.
            self._device.full_barrier(commands)

    def record(self, commands: Any, update: Update) -> None:
        """Records the copies of pages that were read, no more than fit, and their bounds."""
        if not update.loads:
            return
        blobs, rows, places = [], [], []
        row_at = self._uploads * self._slot_bytes
        place_at = row_at + self._uploads * PRIMITIVE.itemsize
        # No page is in both lists: only pages that are not wanted are evicted. So the copies need
        # no order.
        changes = [(page, NOT_RESIDENT) for page in update.evicted]
        changes += [(page, row) for page, row, _ in update.loads]
        for i, (page, row, blob) in enumerate(update.loads):
            at = i * self._slot_bytes
            self._staging.write(blob, at)
            blobs.append(_region(at, int(self._blob_begin[row]), len(blob)))
            at = row_at + i * PRIMITIVE.itemsize
            self._staging.write(self._row(page, row, blob).tobytes(), at)
            rows.append(_region(at, row * PRIMITIVE.itemsize, PRIMITIVE.itemsize))
            first, end = (4 * int(self._bounds_begin[r]) for r in (row, row + 1))
            vk.vkCmdFillBuffer(commands, self.decoded.handle, first, end - first, UNDECODED)
        for i, (page, row) in enumerate(changes):
            self.is_resident[page] = row != NOT_RESIDENT
            self._staging.write(np.uint32(row).tobytes(), place_at + 4 * i)
            places.append(_region(place_at + 4 * i, page * PAGE_ROW.itemsize, 4))
        for buffer, regions in ((self._blobs, blobs), (self.rows, rows), (self.pages, places)):
            vk.vkCmdCopyBuffer(commands, self._staging.handle, buffer.handle, len(regions), regions)
        # Shaders read them by their addresses, which the validation layer does not see.
        self._device.full_barrier(commands)
        for page, row, _ in update.loads:
            self._record_bounds(commands, page, row)

    def _record_bounds(self, commands: Any, page: int, row: int) -> None:
        meshlets = int(self._hierarchies.clusters[page])
        table = {"primitives": self.rows.address, "primitive": row}
        record_bounds(commands, self._bounds_pipeline, meshlets, **table)

    def _row(self, page: int, row: int, blob: bytes) -> np.ndarray:
        """PRIMITIVE[()] of a page."""
        h = self._hierarchies
        record: np.ndarray = self._templates[h.owner(page)].copy()
        record["blob"] = self._blobs.address + int(self._blob_begin[row])
        record["blob_words"] = len(blob) // 4
        record["meshlets"] = h.clusters[page]
        first = record["first_meshlet"] = int(self._bounds_begin[row])
        record["bounds"] = self._bounds.address + CONSTANTS["BOUNDS_BYTES"] * first
        low, high = (box[page] for box in self._boxes)
        record["box_low"][:3], record["box_size"][:3] = low, high - low
        return record


def _region(source: int, target: int, size: int) -> Any:
    return vk.VkBufferCopy(srcOffset=source, dstOffset=target, size=size)
