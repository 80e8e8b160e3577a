"""Which pages are in memory: chooses by the errors on the screen, reads, and evicts by use.

A page stays as long as finer pages that need it: the shaders take a group with a resident page as
one whose coarser groups are all resident.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from gltf_ext.errors import MeshletError

from ..gpu.constants import CONSTANTS
from .hierarchies import Hierarchies

NOT_RESIDENT = CONSTANTS["NOT_RESIDENT"]


@dataclass
class Update:
    """Changes of what is in memory.

    loads: (page, its row, its blob); evicted: pages; pixels: the least error at which all visible
    pages fit, 0 if they fit at the error that was asked for; refused: errors of malformed pages.
    """

    loads: list[tuple[int, int, bytes]] = field(default_factory=list)
    evicted: list[int] = field(default_factory=list)
    pixels: float = 0.0
    refused: list[MeshletError] = field(default_factory=list)


class Residency:
    """Root pages in the first rows, other pages in `slots` rows after these.

    read: page -> its blob; raises MeshletError: then the page, and those that need it, are never
    read again. several: as map, which may read several pages at a time.
    """

    def __init__(
        self,
        hierarchies: Hierarchies,
        slots: int,
        read: Callable[[int], bytes],
        several: Callable[..., Iterable[bytes | MeshletError]] = map,
    ):
        self.read, self._several, self._layers = read, several, hierarchies.coarser
        self._is_root = hierarchies.is_root
        self._is_refused = np.zeros(len(self._is_root), bool)
        self.rows = np.full(len(self._is_root), NOT_RESIDENT)  # of each page
        roots = np.flatnonzero(self._is_root)
        self.rows[roots] = np.arange(len(roots))
        self._pages = np.full(slots, -1)  # of each slot
        self._used = np.zeros(len(self.rows), np.int64)  # update that last wanted each page
        self._updates = 0

    def update(self, pixels: np.ndarray, most: int, ahead: np.ndarray | None = None) -> Update:
        """Reads pages, at most `most`, the largest error first.

        pixels: float32[pages], the error on the screen without each page; 0: not needed. ahead: the
        same where the camera will be. What it needs there alone comes last, into what is left.
        """
        self._updates += 1
        result = Update()
        errors = self._errors(pixels)
        wanted = _largest_first(errors)
        slots = len(self._pages)
        if len(wanted) > slots:
            result.pixels = float(errors[wanted[slots]])
        if ahead is not None:
            later = _largest_first(np.where(errors > 0, np.float32(0), self._errors(ahead)))
            wanted = np.append(wanted, later)
        kept = wanted[:slots]
        self._used[kept] = self._updates
        missing = kept[self.rows[kept] == NOT_RESIDENT][:most].tolist()
        places = iter(self._free_slots())
        for page, blob in zip(missing, self._several(self._read, missing)):
            if self._is_refused[page]:  # a page that it needs is
                continue
            if isinstance(blob, MeshletError):
                self._refuse(page)
                result.refused.append(blob)
            else:
                self._load(page, blob, next(places), result)
        return result

    def _read(self, page: int) -> bytes | MeshletError:
        try:
            return self.read(page)
        except MeshletError as error:
            return error

    def _errors(self, pixels: np.ndarray) -> np.ndarray:
        """float32[pages]: errors, none smaller than those of pages that need the page.

        0: root pages and those that are never read. Sorted by errors, then by number, each page
        comes after those that it needs.
        """
        errors = np.where(self._is_refused, np.float32(0), pixels)
        for finer, coarser in reversed(self._layers):
            np.maximum.at(errors, coarser, errors[finer])
        errors[self._is_root] = 0
        return errors

    def _free_slots(self) -> np.ndarray:
        """Empty slots, then those of pages that are not wanted now: the longest unused first, finer
        pages before those that they need."""
        pages = self._pages
        used = np.where(pages < 0, -1, self._used[pages])
        order = np.lexsort((-pages, used))
        free: np.ndarray = order[used[order] < self._updates]
        return free

    def _load(self, page: int, blob: bytes, slot: int, result: Update) -> None:
        if self._pages[slot] >= 0:
            result.evicted.append(int(self._pages[slot]))
            self.rows[self._pages[slot]] = NOT_RESIDENT
        self._pages[slot] = page
        self.rows[page] = np.count_nonzero(self._is_root) + slot
        result.loads.append((page, int(self.rows[page]), blob))

    def _refuse(self, page: int) -> None:
        """Never reads a page again, nor those that need it."""
        self._is_refused[page] = True
        for finer, coarser in self._layers:
            np.logical_or.at(self._is_refused, finer, self._is_refused[coarser])


def _largest_first(errors: np.ndarray) -> np.ndarray:
    """int64[n]: the pages with an error."""
    chosen = np.flatnonzero(errors > 0)
    return chosen[np.argsort(-errors[chosen], kind="stable")]
