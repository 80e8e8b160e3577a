"""Checks levels of detail for validate."""

from __future__ import annotations

from gltf_ext import _codec
from gltf_ext.attributes.extension import (
    compressed_primitives,
    malformed,
    malformed_from,
    require_unused_by_accessors,
)
from gltf_ext.checks.coverage import check_coverage
from gltf_ext.document import gltf
from gltf_ext.document.document import Document
from gltf_ext.lod.reading import COUNTS, LodPrimitive, read_lod
from gltf_ext.lod.tables import EXTENSION
from gltf_ext.progress import Advance, shared_progress
from gltf_ext.sources.primitives import EXTENSION as EDGEBREAKER
from gltf_ext.sources.primitives import all_primitives, is_compressed


def lod_problems(document: Document, advance: Advance | None = None) -> list[str]:
    """Return problems of the tables, pages and replacements of all primitives, one line each."""
    problems = []
    users = [p for _, _, p in all_primitives(document) if gltf.has_extension(p, EXTENSION)]
    if users and EXTENSION not in document.extensionsUsed:
        problems.append(f"extensionsUsed lacks {EXTENSION}")
    if EXTENSION in document.extensionsRequired:
        problems.append(f"extensionsRequired lists {EXTENSION}, which is optional")
    if not all(map(is_compressed, users)):
        problems.append(f"{EXTENSION} is on a primitive without {EDGEBREAKER}")
    try:
        _check_primitives(document, advance)
    except ValueError as error:
        problems.append(str(error))
    return problems


def _check_primitives(document: Document, advance: Advance | None) -> None:
    """Raise ValueError for the first primitive with levels that are malformed."""
    levels_of: dict[int, list[int]] = {}  # view of level 0 -> its levels' views and counts
    level_0_of: dict[int, int] = {}  # the reverse, for each of these views
    primitives = compressed_primitives(document)
    moves = shared_progress(advance, [1 / len(primitives)] * len(primitives) if primitives else [])
    for compressed, move in zip(primitives, moves):
        primitive = read_lod(document, compressed)
        if primitive is None:
            continue
        where = f"{EXTENSION} of {compressed.where}"
        user = document.primitive(compressed.mesh, compressed.primitive)
        extension = gltf.extension(user, EXTENSION)
        views = [extension["bufferView"], extension["pages"]["bufferView"]]
        references = [*views, *(extension[name] for name in COUNTS)]
        if compressed.view not in levels_of:
            _check_pages(primitive, move)
            require_unused_by_accessors(document, views)
        if levels_of.setdefault(compressed.view, references) != references or any(
            level_0_of.setdefault(view, compressed.view) != compressed.view for view in views
        ):
            raise malformed(where, "it shares some of its buffer views, not all")


def _check_pages(primitive: LodPrimitive, advance: Advance | None) -> None:
    for page in range(len(primitive.tables.pages)):
        primitive.check_page(page)
    with malformed_from(primitive.where):
        _codec.validate(primitive.coarse)
    check_coverage(primitive, advance=advance)
