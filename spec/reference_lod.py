"""Reference reader of EXT_meshlet_lod, in plain Python.

Written from spec/EXT_meshlet_lod.md alone; read it beside that text. It checks `gltf_ext.lod` and
shares no code with it. Programs should use `gltf_ext.lod` instead.

Malformed tables raise ValueError with one sentence that names the error.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field

PAGE = struct.Struct("<4I")
GROUP = struct.Struct("<5f2IH2B")
RUN = struct.Struct("<I")
MAX_GROUPS = 1 << 24
ROUNDING = 1e-5


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


@dataclass
class Page:
    byte_length: int
    first_group: int
    triangles: int
    vertices: int


@dataclass
class Group:
    """runs: (group that is replaced, number of clusters)."""

    centre: tuple[float, float, float]
    radius: float
    error: float
    page: int
    first_cluster: int
    clusters: int
    runs: list[tuple[int, int]] = field(default_factory=list)
    level: int = 0


@dataclass
class Tables:
    pages: list[Page]
    coarse_pages: int
    groups: list[Group]


def read(
    data: bytes, page_count: int, coarse_page_count: int, group_count: int, run_count: int
) -> Tables:
    """The tables of a buffer view. The numbers are those of the extension object."""
    _require(0 < coarse_page_count < page_count, "there are no pages of level 0, or no others")
    _require(0 < group_count <= MAX_GROUPS, "the number of groups is out of range")
    size = PAGE.size * page_count + GROUP.size * group_count + RUN.size * run_count
    _require(len(data) == size, "the length of the view is not that of the tables")
    position = PAGE.size * page_count
    pages = [Page(*row) for row in PAGE.iter_unpack(data[:position])]
    groups_end = position + GROUP.size * group_count
    rows = list(GROUP.iter_unpack(data[position:groups_end]))
    words = [word for (word,) in RUN.iter_unpack(data[groups_end:])]
    _check_pages(pages, group_count)
    groups: list[Group] = []
    next_run = 0
    for x, y, z, radius, error, first_run, page, first_cluster, clusters, runs in rows:
        _require(first_run == next_run, "a group's first run is not the next one")
        next_run += runs
        _require(next_run <= run_count, "a group's runs are outside the table")
        group = Group((x, y, z), radius, error, page, first_cluster, clusters)
        group.runs = [(w & 0xFFFFFF, w >> 24) for w in words[first_run:next_run]]
        groups.append(group)
    _require(next_run == run_count, "runs are left over")
    tables = Tables(pages, coarse_page_count, groups)
    _check_groups(tables)
    _check_runs(groups)
    for group in reversed(groups):
        group.level = 1 + max((groups[r].level for r, _ in group.runs), default=-1)
    return tables


def _check_pages(pages: list[Page], group_count: int) -> None:
    previous = -1
    for page in pages:
        _require(page.byte_length > 0, "a page has no bytes")
        _require(page.byte_length % 4 == 0, "a page's length is not a multiple of 4")
        _require(page.first_group > previous, "the pages' groups do not increase")
        previous = page.first_group
    _require(pages[0].first_group == 0, "page 0 does not begin with group 0")
    _require(previous < group_count, "the last page has no groups")


def _check_groups(tables: Tables) -> None:
    page, next_cluster = -1, 0
    for number, group in enumerate(tables.groups):
        if page + 1 < len(tables.pages) and tables.pages[page + 1].first_group == number:
            page, next_cluster = page + 1, 0
        _require(group.page == page, "a group is not in the page that lists it")
        _require(group.clusters > 0, "a group has no clusters")
        _require(group.first_cluster == next_cluster, "a group's first cluster is not the next one")
        next_cluster += group.clusters
        _require(all(map(math.isfinite, (*group.centre, group.radius))), "a sphere is not finite")
        _require(group.radius >= 0, "a radius is negative")
        _require(group.error >= 0, "an error is negative or not a number")
        is_coarse = page < tables.coarse_pages
        _require(bool(group.runs) == is_coarse, "only groups of coarse pages have runs")


def _check_runs(groups: list[Group]) -> None:
    replaced = set()
    for number, group in enumerate(groups):
        for finer, clusters in group.runs:
            _require(number < finer < len(groups), "a run names a group that is not finer")
            _require(clusters > 0, "a run has no clusters")
            replaced.add(finer)
            other = groups[finer]
            _require(group.error >= other.error, "a coarser group has a smaller error")
            reach = math.dist(group.centre, other.centre) + other.radius
            scale = max(map(abs, group.centre)) + group.radius
            _require(
                reach <= group.radius + ROUNDING * scale, "a coarser sphere does not hold a finer"
            )
        if group.runs:
            total = sum(clusters for _, clusters in group.runs)
            _require(total == group.clusters, "the runs are not the clusters of their group")
    for number, group in enumerate(groups):
        _require(
            math.isfinite(group.error) == (number in replaced),
            "a group has a finite error without a replacement, or an infinite one with it",
        )


def active_groups(
    tables: Tables,
    needed: list[bool],
    resident: list[bool] | None = None,
) -> list[bool]:
    """The active groups. needed: of each group; resident: of each page, all if None."""
    blocked = [False] * len(tables.groups)
    active = []
    for number, group in enumerate(tables.groups):
        here = resident is None or resident[group.page]
        active.append(not blocked[number] and here and needed[number])
        if not active[-1]:
            for finer, _ in group.runs:
                blocked[finer] = True
    return active


def drawn_clusters(tables: Tables, active: list[bool]) -> list[tuple[int, int]]:
    """(page, meshlet of its blob) of each cluster to draw."""
    drawn = []
    for number, group in enumerate(tables.groups):
        replaces = [r for r, count in group.runs for _ in range(count)] or [None] * group.clusters
        for i, finer in enumerate(replaces):
            if active[number] and not (finer is not None and active[finer]):
                drawn.append((group.page, group.first_cluster + i))
    return drawn


def needed_by_view(
    tables: Tables,
    eye: tuple[float, float, float],
    pixels_per_unit: float,
    threshold: float,
    near: float = 1e-6,
) -> list[bool]:
    """Whether each group's replacement is off by more than `threshold` pixels."""

    def pixels(group: Group) -> float:
        distance = max(math.dist(eye, group.centre) - group.radius, near)
        return group.error * pixels_per_unit / distance

    return [pixels(group) > threshold for group in tables.groups]
