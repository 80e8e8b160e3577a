"""The tables of EXT_meshlet_lod: pages, groups and runs, in memory and as bytes.

Layout: spec/EXT_meshlet_lod.md, section "Tables".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gltf_ext.errors import MeshletError
from gltf_ext.ranges import begins, members

EXTENSION = "EXT_meshlet_lod"
VERSION = 1
MAX_GROUPS = 1 << 24
MAX_CLUSTERS = 255  # of a group: 8 bits

PAGE = np.dtype(
    [("byteLength", "<u4"), ("firstGroup", "<u4"), ("triangles", "<u4"), ("vertices", "<u4")]
)
GROUP = np.dtype(
    [
        ("centre", "<f4", 3),
        ("radius", "<f4"),
        ("error", "<f4"),
        ("firstRun", "<u4"),
        ("page", "<u4"),
        ("firstCluster", "<u2"),
        ("clusters", "u1"),
        ("runs", "u1"),
    ]
)
RUN_BYTES = 4
RUN_GROUP_BITS = 24  # of 32; the rest is the number of clusters


@dataclass
class Tables:
    """The hierarchy of one primitive, as in the file.

    Attributes:
        pages: PAGE[P]; coarse pages first, then those of level 0.
        groups: GROUP[G], coarse to fine. Errors and spheres in units of POSITION.
        run_group, run_clusters: int64[R]: each run of clusters that were made from one finer group.
        coarse_pages: number of pages that do not belong to level 0.
    """

    pages: np.ndarray
    groups: np.ndarray
    run_group: np.ndarray
    run_clusters: np.ndarray
    coarse_pages: int

    def to_bytes(self) -> bytes:
        """Return the tables as bytes, as in the file."""
        runs = (self.run_clusters << RUN_GROUP_BITS | self.run_group).astype("<u4")
        return b"".join([self.pages.tobytes(), self.groups.tobytes(), runs.tobytes()])

    @cached_property
    def run_begin(self) -> np.ndarray:
        """int64[G + 1]: the first run of each group."""
        return begins(self.groups["runs"])

    @cached_property
    def cluster_begin(self) -> np.ndarray:
        """int64[G + 1]: the first cluster of each group, counted through all pages."""
        return begins(self.groups["clusters"])

    @cached_property
    def run_owner(self) -> np.ndarray:
        """int64[R]: the group that each run belongs to."""
        return np.repeat(np.arange(len(self.groups)), self.groups["runs"])

    @cached_property
    def cluster_group(self) -> np.ndarray:
        """int64[C]: the group of each cluster."""
        return np.repeat(np.arange(len(self.groups)), self.groups["clusters"])

    @cached_property
    def finer_group(self) -> np.ndarray:
        """int64[C]: the group that each cluster was made from, -1 in level 0."""
        result = np.full(int(self.cluster_begin[-1]), -1)
        coarse = members(self.cluster_begin, np.flatnonzero(self.groups["runs"]))
        result[coarse] = np.repeat(self.run_group, self.run_clusters)
        return result

    @cached_property
    def group_level(self) -> np.ndarray:
        """int64[G]: 0 for groups without runs, else one more than the highest level of the runs."""
        level = np.zeros(len(self.groups), np.int64)
        for g in range(len(self.groups) - 1, -1, -1):
            runs = self.run_group[self.run_begin[g] : self.run_begin[g + 1]]
            if len(runs):
                level[g] = level[runs].max() + 1
        return level

    @property
    def level_count(self) -> int:
        """Number of levels, the finest included."""
        return int(self.group_level.max()) + 1

    @cached_property
    def root_pages(self) -> int:
        """Pages at the start that hold all groups that nothing replaces: always resident."""
        top = np.isinf(self.groups["error"])
        return int(self.groups["page"][top].max()) + 1

    @cached_property
    def page_begin(self) -> np.ndarray:
        """int64[P + 1]: byte offsets of pages, as if both buffer views followed on."""
        return begins(self.pages["byteLength"])


def reach(groups: np.ndarray, owner: np.ndarray, finer: np.ndarray) -> np.ndarray:
    """Return the least radii with which spheres of groups enclose those of finer ones: float64[R].

    The specification defines each rounding of this sum.

    Args:
        groups: GROUP[G].
        owner: int64[R]: the coarser group of each pair.
        finer: int64[R]: the finer group.
    """
    centre = groups["centre"].astype(np.float64)
    x, y, z = (centre[owner] - centre[finer]).T
    distance: np.ndarray = np.sqrt((x * x + y * y) + z * z)
    result: np.ndarray = distance + groups["radius"][finer]
    return result


def read_tables(
    data: bytes | memoryview, pages: int, coarse: int, groups: int, runs: int
) -> Tables:
    """Tables from bytes, checked. The others: numbers of pages, coarse pages, groups and runs.

    Raises MeshletError for anything that the specification forbids.
    """
    if not 0 < coarse < pages or not 2 <= groups <= MAX_GROUPS or runs < 1:
        raise _malformed("has counts that cannot be")
    size = pages * PAGE.itemsize + groups * GROUP.itemsize + RUN_BYTES * runs
    if len(data) != size:
        raise _malformed(f"has tables of {len(data)} bytes instead of {size}")
    page_end = pages * PAGE.itemsize
    group_end = page_end + groups * GROUP.itemsize
    packed = np.frombuffer(data, "<u4", offset=group_end)
    tables = Tables(
        np.frombuffer(data[:page_end], PAGE),
        np.frombuffer(data[page_end:group_end], GROUP),
        (packed & ((1 << RUN_GROUP_BITS) - 1)).astype(np.int64),
        (packed >> RUN_GROUP_BITS).astype(np.int64),
        coarse,
    )
    _check_pages(tables)
    _check_groups(tables)
    _check_runs(tables)
    return tables


def _malformed(problem: str) -> MeshletError:
    return MeshletError(f"{EXTENSION} {problem}", "compress the original again")


def _check_pages(tables: Tables) -> None:
    pages, groups = tables.pages, tables.groups
    if (pages["byteLength"] % 4).any() or (pages["byteLength"] == 0).any():
        raise _malformed("has a page whose length is 0 or not a multiple of 4")
    first = np.append(pages["firstGroup"].astype(np.int64), len(groups))
    if first[0] != 0 or (np.diff(first) <= 0).any():
        raise _malformed("has pages without groups, or not in the order of their groups")
    if (groups["page"] != np.repeat(np.arange(len(pages)), np.diff(first))).any():
        raise _malformed("has groups that are not in the page that lists them")


def _check_groups(tables: Tables) -> None:
    groups = tables.groups
    if (groups["clusters"] == 0).any():
        raise _malformed("has a group without clusters")
    expected = (
        tables.cluster_begin[:-1] - tables.cluster_begin[tables.pages["firstGroup"]][groups["page"]]
    )
    if (groups["firstCluster"] != expected).any():
        raise _malformed("has groups whose clusters do not follow on")
    if (groups["firstRun"] != tables.run_begin[:-1]).any():
        raise _malformed("has groups whose runs do not follow on")
    if tables.run_begin[-1] != len(tables.run_group):
        raise _malformed("has runs that belong to no group")
    if not (np.isfinite(groups["centre"]).all() and np.isfinite(groups["radius"]).all()):
        raise _malformed("has a sphere that is not finite")
    if not ((groups["radius"] >= 0).all() and (groups["error"] >= 0).all()):
        raise _malformed("has a radius or an error that is negative or no number")
    is_fine = groups["page"] >= tables.coarse_pages
    if ((groups["runs"] == 0) != is_fine).any():
        raise _malformed("has groups of level 0 in other pages than those of level 0")


def _check_runs(tables: Tables) -> None:
    groups, owner, finer = tables.groups, tables.run_owner, tables.run_group
    if (finer >= len(groups)).any() or (finer <= owner).any():
        raise _malformed("has a run of a group that is not finer")
    if (tables.run_clusters == 0).any():
        raise _malformed("has a run without clusters")
    sums = np.bincount(owner, tables.run_clusters, len(groups))
    if (sums != np.where(groups["runs"] > 0, groups["clusters"], 0)).any():
        raise _malformed("has runs that do not make up the clusters of their group")
    is_replaced = np.zeros(len(groups), bool)
    is_replaced[finer] = True
    if (np.isfinite(groups["error"]) != is_replaced).any():
        raise _malformed("has groups with a finite error that nothing replaces, or the reverse")
    if (groups["error"][owner] < groups["error"][finer]).any():
        raise _malformed("has an error that is larger than that of a coarser group")
    if (reach(groups, owner, finer) > groups["radius"][owner]).any():
        raise _malformed("has a sphere that reaches beyond that of a coarser group")
