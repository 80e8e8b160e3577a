"""Levels of detail of a scene: the tables of all primitives, one after another.

Numbers of pages and groups count through all primitives, unless they are "of a primitive".
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gltf_ext import _codec
from gltf_ext.attributes.extension import Compressed
from gltf_ext.errors import MeshletError
from gltf_ext.lod.reading import LodPrimitive, streams_of_blob
from gltf_ext.lod.tables import GROUP, MAX_CLUSTERS, PAGE, RUN_GROUP_BITS, Tables
from gltf_ext.ranges import begins, numbers_of

from ..gpu.constants import CONSTANTS
from ..gpu.reflection import structure
from ..scene.scene import Primitive, Scene

# Of shaders/levels/levels.glsl.
HIERARCHY, BLOCK, PAGE_ROW = map(structure, ("Hierarchy", "Block", "Page"))
MAX_FIRST_CLUSTER = (1 << 16) - 1  # of a group in its page
MAX_DRAWN = 1 << 31  # clusters of all instances at full detail: the shaders' counter has 32 bits


class Hierarchies:
    """The hierarchies of a scene that was loaded with levels.

    Attributes:
        primitives: of each primitive; one without levels has top groups only.
        first_page: int64[primitives + 1]: the first page of each primitive.
        clusters: int64[pages]; sizes: int64[pages], bytes.
        is_root: bool[pages]: always resident.
        all_clusters, top_clusters: of all instances, of all groups and of top groups;
            unique_top_clusters: of top groups, of each primitive once.
        most_at_once: clusters of a frame, of each primitive once. One instance draws no more than
            at full detail; several may need all levels.
    """

    def __init__(self, scene: Scene):
        self._scene = scene
        self.primitives = [_with_levels(p) for p in scene.primitives]
        tables = [p.tables for p in self.primitives]
        self.first_page = begins(np.array([len(t.pages) for t in tables]))
        self.clusters = np.concatenate([np.diff(_first_clusters(t)) for t in tables])
        self.sizes = np.concatenate([t.pages["byteLength"] for t in tables]).astype(np.int64)
        self.is_root = np.concatenate([np.arange(len(t.pages)) < t.root_pages for t in tables])
        self.all_clusters = int(scene.of_instances([t.cluster_begin[-1] for t in tables]).sum())
        if self.all_clusters >= MAX_DRAWN:
            raise MeshletError("its scene has too many instances", "render a part of it")
        instances = np.bincount(scene.instances.primitive, minlength=len(tables))
        self.most_at_once = sum(
            len(t.finer_group) if several else int(np.count_nonzero(t.finer_group < 0))
            for t, several in zip(tables, instances > 1)
        )
        top = [_top_clusters(t) for t in tables]
        self.top_clusters, self.unique_top_clusters = int(scene.of_instances(top).sum()), sum(top)

    def read(self, page: int) -> bytes:
        """The checked blob of a page. Raises MeshletError."""
        blob = self.blob(page)
        self.check(page, blob)
        return blob

    def blob(self, page: int) -> bytes:
        owner = self.owner(page)
        return self.primitives[owner].page(page - int(self.first_page[owner]))

    def check(self, page: int, blob: bytes) -> None:
        """Compares a blob with the tables, and decodes it. Raises MeshletError."""
        owner = self.owner(page)
        primitive, number = self.primitives[owner], page - int(self.first_page[owner])
        primitive.check_page(number, blob)
        try:
            _codec.decode_values(blob, threads=1)
        except ValueError as error:
            raise primitive.malformed(f"page {number}: {error}") from None

    def owner(self, page: int) -> int:
        """The primitive that has a page."""
        return int(np.searchsorted(self.first_page, page, "right")) - 1

    @cached_property
    def coarser(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """(pages, pages that they need): each page has groups that were simplified to groups of the
        other. In layers: the pages of a layer need pages of earlier layers only."""
        pairs = []
        for first, primitive in zip(self.first_page, self.primitives):
            t = primitive.tables
            page = t.groups["page"].astype(np.int64) + first
            pairs.append(np.stack([page[t.run_group], page[t.run_owner]]))
        finer, coarser = np.unique(np.concatenate(pairs, axis=1), axis=1)
        finer, coarser = finer[finer != coarser], coarser[finer != coarser]
        depth = np.zeros(len(self.sizes), np.int64)
        while True:
            before = depth.copy()
            np.maximum.at(depth, finer, depth[coarser] + 1)
            if (depth == before).all():
                break
        layers = [depth[finer] == layer for layer in range(1, depth.max() + 1)]
        return [(finer[layer], coarser[layer]) for layer in layers]

    # --- for the device ---

    @property
    def groups(self) -> np.ndarray:
        """GROUP[groups]"""
        return np.concatenate([p.tables.groups for p in self.primitives])

    @property
    def runs(self) -> np.ndarray:
        """uint32[runs], as in the files."""
        of_each = [
            (p.tables.run_clusters << RUN_GROUP_BITS | p.tables.run_group) for p in self.primitives
        ]
        return np.concatenate(of_each).astype(np.uint32)

    @property
    def rows(self) -> np.ndarray:
        """HIERARCHY[primitives]"""
        tables = [p.tables for p in self.primitives]
        rows = np.zeros(len(tables), HIERARCHY)
        rows["groups"] = [len(t.groups) for t in tables]
        rows["first_group"] = begins(rows["groups"])[:-1]
        rows["first_page"] = self.first_page[:-1]
        rows["first_run"] = begins(np.array([len(t.run_group) for t in tables]))[:-1]
        return rows

    @property
    def pages(self) -> np.ndarray:
        """PAGE_ROW[pages], none of which is resident."""
        rows = np.zeros(len(self.sizes), PAGE_ROW)
        rows["row"] = CONSTANTS["NOT_RESIDENT"]
        first = [_first_clusters(p.tables)[:-1] for p in self.primitives]
        rows["first_cluster"] = np.concatenate(first)
        return rows

    @property
    def blocks(self) -> np.ndarray:
        """BLOCK[blocks]: groups of all instances, CUT_THREADS in each block but the last ones."""
        threads = CONSTANTS["CUT_THREADS"]
        groups = np.array([len(p.tables.groups) for p in self.primitives])
        of_instance = -(-groups // threads)[self._scene.instances.primitive]
        rows = np.zeros(int(of_instance.sum()), BLOCK)
        rows["instance"] = np.repeat(np.arange(len(of_instance)), of_instance)
        rows["first_group"] = numbers_of(np.zeros_like(of_instance), of_instance) * threads
        return rows

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """(low, high), float64[pages, 3] each: boxes around the spheres of each page's groups."""
        low, high = [], []
        for primitive, levels in zip(self._scene.primitives, self.primitives):
            groups, first = levels.tables.groups, levels.tables.pages["firstGroup"]
            centre, radius = groups["centre"].astype(np.float64), groups["radius"][:, None]
            low.append(np.maximum(np.minimum.reduceat(centre - radius, first), primitive.low))
            high.append(np.minimum(np.maximum.reduceat(centre + radius, first), primitive.high))
        return np.concatenate(low), np.maximum(np.concatenate(high), np.concatenate(low))


def _top_clusters(tables: Tables) -> int:
    return int(tables.groups["clusters"][np.isinf(tables.groups["error"])].sum())


def _first_clusters(tables: Tables) -> np.ndarray:
    """int64[pages + 1]: number of each page's first cluster in the primitive."""
    first = np.append(tables.pages["firstGroup"], len(tables.groups))
    result: np.ndarray = tables.cluster_begin[first]
    return result


def _with_levels(primitive: Primitive) -> LodPrimitive:
    """The primitive's levels; one without has top groups only, which are always drawn."""
    source = primitive.source
    assert source is not None
    return source if isinstance(source, LodPrimitive) else _flat(source, primitive)


def _flat(compressed: Compressed, primitive: Primitive) -> LodPrimitive:
    blobs = compressed.blobs
    headers = [_codec.Header(blob) for blob in blobs]
    meshlets = np.array([h.meshlet_count for h in headers])
    of_page = -(-meshlets // MAX_CLUSTERS)
    pages = np.zeros(len(blobs), PAGE)
    pages["byteLength"] = [len(blob) for blob in blobs]
    pages["firstGroup"] = begins(of_page)[:-1]
    pages["triangles"] = [h.triangle_count for h in headers]
    pages["vertices"] = [h.vertex_count for h in headers]
    first = numbers_of(np.zeros_like(of_page), of_page) * MAX_CLUSTERS
    if first.max() > MAX_FIRST_CLUSTER:
        raise MeshletError(
            f"{compressed.where} is large and has no levels of detail",
            "compress the original again with --lod, or render without --lod-error",
        )
    groups = np.zeros(len(first), GROUP)
    groups["centre"] = (primitive.low + primitive.high) / 2
    groups["radius"] = np.linalg.norm(primitive.high - primitive.low) * 0.51  # for rounding
    groups["error"] = np.inf
    groups["page"] = np.repeat(np.arange(len(blobs)), of_page)
    groups["firstCluster"] = first
    groups["clusters"] = np.minimum(meshlets[groups["page"]] - first, MAX_CLUSTERS)
    none = np.zeros(0, np.int64)
    tables = Tables(pages, groups, none, none, 0)
    return LodPrimitive(compressed, tables, memoryview(b""), streams_of_blob(compressed.blob))
