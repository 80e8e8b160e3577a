"""The levels of a document: adds them to its primitives, orders its buffer views, removes levels.

Imports nothing heavy: `compress` without levels needs it too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.document.references import map_views, pinned_numbers
from gltf_ext.lod.tables import EXTENSION, VERSION, Tables
from gltf_ext.sources.primitives import EXTENSION as EDGEBREAKER
from gltf_ext.sources.primitives import all_primitives


@dataclass
class Levels:
    """The levels of a primitive, encoded.

    Attributes:
        tables: as in the file; pages: the blobs of all levels but level 0.
        report: triangles of each level, as `compress` reports them.
    """

    tables: Tables
    pages: bytes | memoryview
    report: dict[str, Any]

    @property
    def byte_count(self) -> int:
        """What they add to a file, without JSON."""
        return len(self.tables.to_bytes()) + len(self.pages)


def add_levels(document: Document, users: list[gltf.Primitive], levels: Levels) -> None:
    """Give the primitives their levels."""
    tables = levels.tables
    tables_view, pages_view = document.add_view(tables.to_bytes()), document.add_view(levels.pages)
    extension = {
        "version": VERSION,
        "bufferView": tables_view,
        "pageCount": len(tables.pages),
        "coarsePageCount": tables.coarse_pages,
        "groupCount": len(tables.groups),
        "runCount": len(tables.run_group),
        "rootPageCount": tables.root_pages,
    }
    for user in users:
        pages = {"bufferView": pages_view}
        gltf.set_extension(user, EXTENSION, {**extension, "pages": pages})


def arrange(document: Document) -> None:
    """Order the buffer views: tables, coarse pages, level 0, everything else.

    Those whose numbers may stand in an unknown extension stay where they are.
    """
    rank = np.full(len(document.bufferViews), 3)
    for _, _, primitive in all_primitives(document):
        extension = gltf.extension(primitive, EXTENSION)
        if extension:
            rank[extension["bufferView"]] = 0
            rank[extension["pages"]["bufferView"]] = 1
            rank[gltf.extension(primitive, EDGEBREAKER)["bufferView"]] = 2
    numbers = np.arange(len(rank))
    is_free = ~np.isin(numbers, list(pinned_numbers(document, "bufferview")))
    free, order = numbers[is_free], numbers.copy()
    order[free] = free[np.argsort(rank[free], kind="stable")]
    new_index = np.empty(len(order), np.int64)
    new_index[order] = np.arange(len(order))
    map_views(document, lambda index: int(new_index[index]))
    document.arrange_views(order.tolist())


def forget_levels(document: Document) -> None:
    """Remove all levels: they describe data that is replaced."""
    for _, _, primitive in all_primitives(document):
        gltf.pop_extension(primitive, EXTENSION)
    document.forget_extension(EXTENSION)
