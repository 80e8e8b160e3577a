"""Reference reader of EXT_meshlet_lod, in plain Python.

Written from spec/EXT_meshlet_lod.md alone; read it beside that text. It checks `gltf_ext.lod` and
shares no code with it. Programs should use `gltf_ext.lod` instead. Pages are decoded by the
reference decoder of EXT_meshlet_edgebreaker, and unpacked by that of EXT_meshlet_transport.

`read_file` reads the tables of a .glb and `problems` validates all of it. Malformed data raise
ValueError with one sentence that names the error.
"""

from __future__ import annotations

import base64
import json
import math
import struct
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from spec import reference_decoder, reference_transport

LOD, EDGEBREAKER = "EXT_meshlet_lod", "EXT_meshlet_edgebreaker"
TRANSPORT = "EXT_meshlet_transport"
VERSION = 1
PAGE = struct.Struct("<4I")
GROUP = struct.Struct("<5f2IH2B")
RUN = struct.Struct("<I")
MAX_GROUPS = 1 << 24
LEAST_COUNTS = {"pageCount": 2, "coarsePageCount": 1, "groupCount": 2, "runCount": 1}

Point = tuple[float, float, float]
Corner = tuple[int, ...]  # the integers of a vertex
Triangle = tuple[Corner, Corner, Corner]


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


# --- tables ---


@dataclass
class Page:
    byte_length: int
    first_group: int
    triangles: int
    vertices: int


@dataclass
class Group:
    """runs: (group that is replaced, number of clusters)."""

    centre: Point
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

    @property
    def root_pages(self) -> int:
        """Number of pages up to the last one that holds a top group."""
        return 1 + max(group.page for group in self.groups if math.isinf(group.error))


def read(
    data: bytes, page_count: int, coarse_page_count: int, group_count: int, run_count: int
) -> Tables:
    """The tables of a buffer view. The numbers are those of the extension object."""
    _require(0 < coarse_page_count < page_count, "there are no pages of level 0, or no others")
    _require(group_count <= MAX_GROUPS, "there are more than 2^24 groups")
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


def reach(group: Group, finer: Group) -> float:
    """The least radius with which a sphere at group's centre contains that of a finer group."""
    x, y, z = (a - b for a, b in zip(group.centre, finer.centre))
    return math.sqrt((x * x + y * y) + z * z) + finer.radius


def _check_runs(groups: list[Group]) -> None:
    replaced = set()
    for number, group in enumerate(groups):
        for finer, clusters in group.runs:
            _require(number < finer < len(groups), "a run names a group that is not finer")
            _require(clusters > 0, "a run has no clusters")
            replaced.add(finer)
            other = groups[finer]
            _require(group.error >= other.error, "a coarser group has a smaller error")
            _require(
                reach(group, other) <= group.radius, "a coarser sphere does not contain a finer one"
            )
        if group.runs:
            total = sum(clusters for _, clusters in group.runs)
            _require(total == group.clusters, "the runs are not the clusters of their group")
    for number, group in enumerate(groups):
        _require(
            math.isfinite(group.error) == (number in replaced),
            "a group has a finite error without a replacement, or an infinite one with it",
        )


# --- cuts ---


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


def replaced_groups(group: Group) -> list[int | None]:
    """For each cluster of a group: the group from whose replacement it is, None in level 0."""
    return [r for r, count in group.runs for _ in range(count)] or [None] * group.clusters


def drawn_clusters(tables: Tables, active: list[bool]) -> list[tuple[int, int]]:
    """(page, meshlet of its blob) of each cluster to draw."""
    drawn = []
    for number, group in enumerate(tables.groups):
        for i, finer in enumerate(replaced_groups(group)):
            if active[number] and not (finer is not None and active[finer]):
                drawn.append((group.page, group.first_cluster + i))
    return drawn


def needed_at_error(tables: Tables, error: float) -> list[bool]:
    """Whether each group's replacement is off by more than an error, in units of POSITION."""
    return [group.error > error for group in tables.groups]


def needed_at_level(tables: Tables, level: int) -> list[bool]:
    """Whether each group is of this level or a coarser one, or a top group."""
    return [group.level >= level or math.isinf(group.error) for group in tables.groups]


def needed_by_view(
    tables: Tables,
    eye: Point | None,
    pixels_per_unit: float,
    threshold: float,
    matrix: list[float] | None = None,
    near: float = 1e-6,
) -> list[bool]:
    """Whether each group's replacement is off by more than `threshold` pixels.

    eye: None for an orthographic camera; matrix: from POSITION to the coordinates of the eye, 16
    numbers, column by column.
    """
    columns = [matrix[4 * i : 4 * i + 3] for i in range(4)] if matrix else None
    scale = largest_scale(columns[:3]) if columns else 1.0

    def pixels(group: Group) -> float:
        if eye is None:
            return scale * group.error * pixels_per_unit
        x, y, z = group.centre
        centre = group.centre
        if columns:
            a, b, c, d = columns
            x, y, z = (x * a[i] + y * b[i] + z * c[i] + d[i] for i in range(3))
            centre = x, y, z
        distance = max(math.dist(eye, centre) - scale * group.radius, near)
        return scale * group.error * pixels_per_unit / distance

    return [pixels(group) > threshold for group in tables.groups]


def largest_scale(columns: list[list[float]]) -> float:
    """The largest singular value of a 3 x 3 matrix: the root of the largest eigenvalue of A^T A."""
    vector, size = [1.0, 0.7, 0.4], 0.0
    for _ in range(1000):  # power iteration
        image = [sum(columns[j][i] * vector[j] for j in range(3)) for i in range(3)]
        back = [sum(columns[j][i] * image[i] for i in range(3)) for j in range(3)]
        size = math.hypot(*back)
        if size == 0.0:
            return 0.0
        vector = [value / size for value in back]
    return math.sqrt(size)


# --- files ---


@dataclass
class Primitive:
    """A primitive with levels: its tables, the bytes of each page, and the view of level 0."""

    tables: Tables
    blobs: list[bytes]
    level_0: bytes


def read_document(data: bytes) -> tuple[dict[str, Any], bytes]:
    """(the JSON document, the binary chunk) of a .glb."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def read_file(data: bytes) -> list[Primitive | None]:
    """The levels of each primitive with EXT_meshlet_edgebreaker of a .glb; None without levels."""
    document, buffer = read_document(data)
    return [
        read_primitive(document, buffer, primitive)
        for mesh in document["meshes"]
        for primitive in mesh["primitives"]
        if EDGEBREAKER in primitive.get("extensions", {})
    ]


def read_primitive(
    document: dict[str, Any], buffer: bytes, primitive: dict[str, Any]
) -> Primitive | None:
    """The levels of a primitive; None if it has none, or has them in a version that is unknown."""
    extensions = primitive["extensions"]
    if LOD not in extensions:
        return None
    extension = extensions[LOD]
    _require(isinstance(extension, dict), "the extension is not an object")
    _require(_is_integer(extension.get("version")), "the version is not an integer")
    if extension["version"] != VERSION:
        return None
    for name, least in LEAST_COUNTS.items():
        count = extension.get(name)
        _require(_is_integer(count) and count >= least, f"{name} is missing or less than {least}")
    view, data = _view(document, buffer, extension)
    _require(TRANSPORT not in view.get("extensions", {}), "the tables are packed")
    tables = read(data, *(extension[n] for n in LEAST_COUNTS))
    roots = extension.get("rootPageCount", tables.root_pages)
    _require(roots == tables.root_pages, "rootPageCount is another one than that of the groups")
    split = tables.coarse_pages
    coarse = _view(document, buffer, extension.get("pages"))
    fine = _view(document, buffer, extensions[EDGEBREAKER])
    blobs = _pages_of_view(*coarse, tables.pages[:split])
    blobs += _pages_of_view(*fine, tables.pages[split:])
    return Primitive(tables, blobs, b"".join(blobs[split:]))


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _view(document: dict[str, Any], buffer: bytes, holder: Any) -> tuple[dict[str, Any], bytes]:
    """(the buffer view that an object names, its bytes in the file).

    buffer: the binary chunk; other buffers are data URIs.
    """
    index: Any = holder.get("bufferView") if isinstance(holder, dict) else None
    views = document["bufferViews"]
    _require(_is_integer(index) and 0 <= index < len(views), "a bufferView is missing")
    view = views[index]
    offset = view.get("byteOffset", 0)
    _require(offset % 4 == 0, "a buffer view does not start at a multiple of 4")
    _require(
        "byteStride" not in view and "target" not in view,
        "a buffer view has a byteStride or a target",
    )
    names = view.get("extensions", {})
    _require(
        not any(name.endswith("_meshopt_compression") for name in names),
        "a buffer view is compressed",
    )
    uri = document["buffers"][view["buffer"]].get("uri")
    content = buffer if uri is None else base64.b64decode(uri.partition("base64,")[2])
    return view, content[offset : offset + view["byteLength"]]


def _pages_of_view(view: dict[str, Any], data: bytes, pages: list[Page]) -> list[bytes]:
    """The blobs of a view: each begins at the sum of the lengths before it."""
    if TRANSPORT in view.get("extensions", {}):
        sizes = [resident for _, resident in reference_transport.page_table(data)]
        _require(
            sizes == [page.byte_length for page in pages],
            "the pages of a packed view have other lengths than the tables say",
        )
        data = reference_transport.unpack_view(data)
    blobs, begin = [], 0
    for page in pages:
        blobs.append(data[begin : begin + page.byte_length])
        begin += page.byte_length
    _require(begin == len(data), "the lengths of the pages do not sum to that of their view")
    return blobs


def check_page(primitive: Primitive, number: int) -> list[list[Triangle]]:
    """The triangles of each meshlet of a page. Raises ValueError if the page is malformed, or not
    as the tables say."""
    blob, page = primitive.blobs[number], primitive.tables.pages[number]
    try:
        decoded = reference_decoder.decode_blob(blob)
        file = reference_decoder.BlobFile(blob)
    except ValueError as error:
        raise ValueError(f"page {number}: {error}") from None
    clusters = sum(g.clusters for g in primitive.tables.groups if g.page == number)
    _require(
        (file.triangle_count, file.vertex_count) == (page.triangles, page.vertices),
        "a page has other counts than its blob",
    )
    _require(file.meshlet_count == clusters, "the groups of a page do not have its meshlets")
    first = reference_decoder.split_view(primitive.level_0)[0]
    _require(
        [s.content for s in file.streams]
        == [s.content for s in reference_decoder.BlobFile(first).streams],
        "a page has other streams than level 0",
    )
    corners = [
        tuple(int(q) for column in vertex for q in column) for vertex in zip(*decoded.values)
    ]
    triangles = iter(decoded.triangles.tolist())
    meshlets: list[list[Triangle]] = []
    for m in range(file.meshlet_count):
        count = file.reader(m).read(6, "T - 1") + 1
        meshlets.append([])
        for a, b, v in (next(triangles) for _ in range(count)):
            meshlets[-1].append((corners[a], corners[b], corners[v]))
    return meshlets


def surface(primitive: Primitive, active: list[bool]) -> list[Triangle]:
    """The triangles of a cut."""
    drawn = drawn_clusters(primitive.tables, active)
    pages = {page: check_page(primitive, page) for page in sorted({page for page, _ in drawn})}
    return [triangle for page, meshlet in drawn for triangle in pages[page][meshlet]]


# --- validation ---


def problems(data: bytes) -> list[str]:
    """What a validator finds wrong in the levels of a .glb."""
    document, buffer = read_document(data)
    found = []
    primitives = [p for mesh in document["meshes"] for p in mesh["primitives"]]
    users = [p for p in primitives if LOD in p.get("extensions", {})]
    if users and LOD not in document["extensionsUsed"]:
        found.append("extensionsUsed lacks the extension")
    if LOD in document.get("extensionsRequired", []):
        found.append("extensionsRequired lists the extension")
    if any(EDGEBREAKER not in p["extensions"] for p in users):
        found.append("the primitive is not compressed")
    try:
        for user in users:
            if EDGEBREAKER in user["extensions"]:
                _check_user(document, buffer, user)
        _check_sharing(document, users)
    except ValueError as error:
        found.append(str(error))
    return found


def _check_user(document: dict[str, Any], buffer: bytes, user: dict[str, Any]) -> None:
    primitive = read_primitive(document, buffer, user)
    if primitive is None:
        return
    meshlets = [check_page(primitive, number) for number in range(len(primitive.blobs))]
    views = {user["extensions"][LOD]["bufferView"], user["extensions"][LOD]["pages"]["bufferView"]}
    _require(
        not any(accessor.get("bufferView") in views for accessor in document["accessors"]),
        "an accessor refers to a buffer view of the extension",
    )
    check_replacements(primitive, meshlets)


def _check_sharing(document: dict[str, Any], users: list[dict[str, Any]]) -> None:
    of_level_0: dict[int, list[int]] = {}
    owner: dict[int, int] = {}
    for user in users:
        extension = user["extensions"][LOD]
        if EDGEBREAKER not in user["extensions"] or extension["version"] != VERSION:
            continue
        level_0 = user["extensions"][EDGEBREAKER]["bufferView"]
        views = [extension["bufferView"], extension["pages"]["bufferView"]]
        all_of_it = views + [extension[name] for name in LEAST_COUNTS]
        same = of_level_0.setdefault(level_0, all_of_it) == all_of_it
        same = same and all(owner.setdefault(view, level_0) == level_0 for view in views)
        _require(same, "primitives share some of the buffer views, not all")


def check_replacements(primitive: Primitive, meshlets: list[list[list[Triangle]]]) -> None:
    """Checks the section "Replacements". meshlets: of each page, as check_page returns them."""
    tables = primitive.tables
    split = tables.coarse_pages
    vertices = [
        {
            corner
            for page in pages
            for meshlet in page
            for triangle in meshlet
            for corner in triangle
        }
        for pages in (meshlets[:split], meshlets[split:])
    ]
    _require(vertices[0] <= vertices[1], "a coarse page has a vertex that level 0 does not have")
    fine = [triangle for page in meshlets[split:] for meshlet in page for triangle in meshlet]
    if max(Counter(edge for triangle in fine for edge in directed_edges(triangle)).values()) > 1:
        return  # surfaces touch: borders are a recommendation
    before: list[Border] = [Counter() for _ in tables.groups]
    after: list[Border] = [Counter() for _ in tables.groups]
    whole: Border = Counter()
    for number, group in enumerate(tables.groups):
        for i, finer in enumerate(replaced_groups(group)):
            edges = border(meshlets[group.page][group.first_cluster + i])
            _add(before[number], edges)
            _add(whole if finer is None else after[finer], edges)
    outer = set(whole)
    for number in sorted(range(len(tables.groups)), key=lambda g: tables.groups[g].level):
        if math.isinf(tables.groups[number].error):
            continue
        change = Counter(after[number])
        _add(change, Counter({edge: -count for edge, count in before[number].items()}))
        leaves = {edge for edge in change if edge in before[number]}
        joins = set(change) - leaves
        ends = {end for edge in outer for end in edge}
        _require(
            leaves <= outer and all(end in ends for edge in joins for end in edge),
            "a replacement has another border than its group",
        )
        outer |= joins


# Edges between two positions, the smaller one first: how often they are passed forward minus how
# often backward. No edge has 0.
Edge = tuple[Corner, Corner]
Border = Counter[Edge]


def border(triangles: list[Triangle]) -> Border:
    """The border of triangles, by the integers of stream 0."""
    result: Border = Counter()
    for triangle in triangles:
        for start, end in directed_edges(triangle):
            if start < end:
                _add(result, Counter({(start, end): 1}))
            else:
                _add(result, Counter({(end, start): -1}))
    return result


def directed_edges(triangle: Triangle) -> list[Edge]:
    """The edges between different positions, the integers of stream 0."""
    points = [corner[:3] for corner in triangle]
    return [edge for edge in zip(points, points[1:] + points[:1]) if edge[0] != edge[1]]


def _add(total: Border, edges: Border) -> None:
    for edge, count in edges.items():
        total[edge] += count
        if total[edge] == 0:
            del total[edge]
