"""Levels of detail by the C interface, as numpy arrays."""

from __future__ import annotations

import ctypes
from ctypes import byref, c_double, c_float, c_size_t, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass

import numpy as np

from gltf_ext._library import Handle, Struct, address, check, library
from gltf_ext.lod.cuts import View, cut_for_view
from gltf_ext.lod.tables import GROUP, PAGE, RUN_BYTES, Tables

_TYPES = {"u": c_uint32, "q": c_uint64, "f": c_float, "d": c_double, "p": c_void_p}


def _fields(**names: str) -> list[tuple[str, type]]:
    """Fields of a type each; a digit at the end of a name is the length of an array."""
    return [
        (name.rstrip("3"), _TYPES[kind[0]] * 3 if name.endswith("3") else _TYPES[kind[0]])
        for kind, group in names.items()
        for name in group.split()
    ]


class CTables(Struct):
    _fields_ = _fields(
        u="size page_count coarse_page_count group_count run_count root_page_count",
        p="bytes runs",
        q="byte_count run_bytes",
    )


class CLevelCounts(Struct):
    _fields_ = _fields(u="size pages coarse_pages root_pages groups known_groups", q="most_draws")


class CLevelPage(Struct):
    _fields_ = _fields(
        u="size bytes",
        q="offset",
        u2="is_fine is_known triangles vertices meshlets first_group groups",
    )


class CGroup(Struct):
    _fields_ = _fields(u="size", f="centre3 radius error", u2="page first_meshlet meshlets")


class CCut(Struct):
    _fields_ = _fields(
        u="size is_orthographic",
        d="eye3 pixels_per_unit threshold least_distance",
        p="matrix resident active urgency draws",
        q="draw_room draw_count",
        d2="error",
        u2="groups_needed reserved",
    )


class CPackedPage(ctypes.Structure):
    _fields_ = _fields(q="offset", u="stored_bytes page_bytes")


def call(name: str, *arguments: object) -> None:
    """Calls a function of the interface. Raises ValueError and others by its status."""
    function = getattr(library, f"gltf_meshlet_{name}")
    # Without a prototype, ctypes would pass sizes as 32 bits.
    check(function(*(c_size_t(a) if isinstance(a, int) else a for a in map(_plain, arguments))))


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return c_void_p(address(value))
    return getattr(value, "_as_parameter_", value)


@dataclass
class CCutResult:
    """active: bool[known groups]; drawn: bool[C], clusters; urgency: float32[P]."""

    active: np.ndarray
    drawn: np.ndarray
    urgency: np.ndarray
    error: float
    groups_needed: int


class Levels(Handle):
    """Tables that are open. Raises ValueError."""

    def __init__(
        self,
        data: bytes,
        counts: tuple[int, int, int, int],
        root_pages: int = 0,
        known_groups: int | None = None,
    ) -> None:
        """known_groups: of a prefix, which ends with a page."""
        super().__init__()
        pages, coarse, groups, runs = counts
        numbers = {"page_count": pages, "coarse_page_count": coarse, "group_count": groups}
        numbers |= {"run_count": runs, "root_page_count": root_pages}
        view = np.frombuffer(data, np.uint8)
        if known_groups is None:
            tables = CTables(**numbers, bytes=view, byte_count=len(view))
        else:
            head = view[: PAGE.itemsize * pages + GROUP.itemsize * known_groups].copy()
            rest = view[PAGE.itemsize * pages + GROUP.itemsize * groups :]
            known = head[PAGE.itemsize * pages :].view(GROUP)
            rest = rest[: RUN_BYTES * int(known["runs"].sum())].copy()
            parts = {"bytes": head, "runs": rest}
            lengths = {"byte_count": len(head), "run_bytes": len(rest)}
            tables = CTables(**numbers, **parts, **lengths)
        call("open_levels", tables, self.out)
        self.counts = CLevelCounts()
        call("get_level_counts", self, self.counts)

    @classmethod
    def of(cls, tables: Tables, known_groups: int | None = None) -> Levels:
        counts = len(tables.pages), tables.coarse_pages, len(tables.groups), len(tables.run_group)
        return cls(tables.to_bytes(), counts, tables.root_pages, known_groups)

    def cut(
        self,
        tables: Tables,
        view: View,
        threshold: float,
        resident: np.ndarray | None = None,
        matrix: np.ndarray | None = None,
    ) -> CCutResult:
        active = np.full(self.counts.known_groups, 7, np.uint8)
        urgency = np.zeros(self.counts.pages, np.float32)
        draws = np.zeros((self.counts.most_draws, 4), np.uint32)
        columns = None if matrix is None else np.asfortranarray(matrix).reshape(-1, order="F")
        here = None if resident is None else resident.astype(np.uint8)
        arrays = {"matrix": columns, "resident": here, "active": active, "urgency": urgency}
        cut = CCut(
            is_orthographic=view.eye is None,
            pixels_per_unit=view.pixels_per_unit,
            threshold=threshold,
            draws=draws,
            draw_room=len(draws),
            **{name: array for name, array in arrays.items() if array is not None},
        )
        cut.eye[:] = view.eye or (0, 0, 0)
        call("make_cut", self, cut)
        drawn = np.zeros(int(tables.cluster_begin[-1]), bool)
        first_of_page = tables.cluster_begin[tables.pages["firstGroup"]]
        for page, first, count, _ in draws[: cut.draw_count].tolist():
            begin = first_of_page[page] + first
            assert not drawn[begin : begin + count].any()
            drawn[begin : begin + count] = True
        return CCutResult(active == 1, drawn, urgency, cut.error, cut.groups_needed)


def packed_pages(packed: np.ndarray) -> list[CPackedPage]:
    """The pages of a packed view."""
    count = c_size_t()
    head = packed[: 4 + 8 * (int(packed[:4].view(np.uint32)[0]) >> 8)].copy()
    call("get_packed_pages", head, len(head), c_uint64(len(packed)), None, 0, byref(count))
    pages = (CPackedPage * count.value)()
    arguments = c_uint64(len(packed)), pages, count.value, byref(count)
    call("get_packed_pages", head, len(head), *arguments)
    return list(pages)


def rank_pages(urgency: np.ndarray, sizes: np.ndarray, budget: int) -> tuple[np.ndarray, int]:
    """(numbers of the needed pages, how many of the first fit the budget)."""
    order, needed, affordable = np.zeros(len(urgency), np.uint32), c_size_t(), c_size_t()
    arrays = urgency.astype(np.float32), sizes.astype(np.uint32), len(urgency), c_uint64(budget)
    call("rank_pages", *arrays, order, byref(needed), byref(affordable))
    return order[: needed.value], affordable.value


# --- beside Python ---


def reached(tables, active):
    """bool[G]: groups of which all coarser groups are active."""
    blocked = np.zeros(len(tables.groups), bool)
    blocked[tables.run_group[~active[tables.run_owner]]] = True
    return ~blocked


def compare(levels, tables, view, threshold, resident, matrix=None):
    """Compares a cut, and the urgency of its pages, with Python's."""
    made = levels.cut(tables, view, threshold, resident, matrix)
    wanted = cut_for_view(tables, view, threshold, resident, matrix)
    known = levels.counts.known_groups
    np.testing.assert_array_equal(made.active, wanted.active[:known])
    np.testing.assert_array_equal(made.drawn, wanted.drawn)
    pixels = view.pixels(tables, matrix)
    asks = reached(tables, wanted.active) & (pixels > threshold)
    urgency = np.zeros(len(tables.pages))
    np.maximum.at(urgency, tables.groups["page"][:known], np.where(asks, pixels, 0)[:known])
    np.testing.assert_allclose(made.urgency, urgency.astype(np.float32), rtol=1e-6)
    return made


def random_cut(tables, random):
    """(camera, threshold, matrix or None) near the primitive."""
    centre, radius = tables.groups["centre"][0], float(tables.groups["radius"][0])
    direction = random.normal(size=3)
    eye = centre + direction / np.linalg.norm(direction) * radius * 10 ** random.uniform(-1, 2)
    eye = None if random.random() < 0.1 else tuple(map(float, eye))
    matrix = None
    if random.random() < 0.5:
        matrix = np.eye(4)
        matrix[:3, :3] = random.normal(size=(3, 3))
        matrix[:3, 3] = random.normal(size=3) * radius
    return View(eye, 10 ** random.uniform(1, 4)), 10 ** random.uniform(-1, 2), matrix


def compare_at_random(tables: Tables, count: int) -> None:
    """Compares random cuts, with random pages and prefixes of the tables."""
    random = np.random.default_rng(2)
    levels, mixed = Levels.of(tables), 0
    ends = np.append(tables.pages["firstGroup"][1:], len(tables.groups))
    for i in range(count):
        view, threshold, matrix = random_cut(tables, random)
        resident = random.random(len(tables.pages)) < random.choice([0.3, 0.8, 1.0])
        resident[: tables.root_pages] = True
        made = compare(levels, tables, view, threshold, resident, matrix)
        mixed += 0 < made.active.sum() < len(tables.groups)
        if i % 4 == 0:  # a prefix: pages with other groups are not resident
            pages = random.integers(tables.root_pages, len(tables.pages) + 1)
            part = Levels.of(tables, int(ends[pages - 1]))
            assert part.counts.known_groups == ends[pages - 1]
            compare(part, tables, view, threshold, resident & (np.arange(len(resident)) < pages))
    assert mixed > count // 4
