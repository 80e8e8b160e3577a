"""Writes spec/lod_vectors: conformance vectors of EXT_meshlet_lod.

    python -m spec.make_lod_vectors

lod_NAME.glb are valid; lod_NAME.json has what a reader finds in them. malformed_NAME.glb break a
rule each; malformed.json has the reasons that the reference reader gives. Also writes the worked
example into spec/EXT_meshlet_lod.md.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gltf_ext import _codec
from spec import make_vectors, reference_lod
from spec.blob_writer import AFFINE, COPY, GEO, GRID, MEAN, OCT, PARALLELOGRAM
from spec.make_vectors import FLOAT, UNSIGNED_SHORT, Attribute, pack_glb
from spec.reference_lod import EDGEBREAKER, LOD, TRANSPORT

FOLDER = Path(__file__).parent / "lod_vectors"
DOCUMENT = Path(__file__).parent / "EXT_meshlet_lod.md"
BEGIN = "<!-- begin worked example: written by spec/make_lod_vectors.py -->\n"
END = "<!-- end worked example -->\n"
COLUMNS = 24  # of a group of level 0 of a strip; two triangles each
SIDE = 4  # cells of a patch of a sheet
NAN, INFINITE = float("nan"), float("inf")

Triangles = list[tuple[int, int, int]]
Cut = dict[str, Any]
Change = Callable[[dict[str, Any]], None]
# Changes a document and its binary chunk; returns another chunk.
Move = Callable[[dict[str, Any], bytes], bytes]


# --- blobs ---


@dataclass(frozen=True)
class Vertices:
    """Streams, and the integers [V, elements] of all vertices of level 0 in each."""

    streams: list[_codec.Stream]
    values: list[np.ndarray]


def stream(
    kind: int, elements: int, bits: int, predictor: int = -1, step: float = 1.0
) -> _codec.Stream:
    return _codec.Stream(kind, elements, bits, step, predictor=predictor)


def blob(clusters: list[Triangles], vertices: Vertices) -> bytes:
    """One page of clusters that are one disk each."""
    triangles = np.array([t for cluster in clusters for t in cluster], np.uint32)
    begin = np.cumsum([0, *map(len, clusters)]).astype(np.uint32)
    count = np.arange(len(clusters) + 1, dtype=np.uint32)
    values = [np.ascontiguousarray(v, np.uint32) for v in vertices.values]
    view, _ = _codec.encode(
        triangles,
        np.arange(len(values[0]), dtype=np.uint32),
        values[0].astype(np.float32),
        vertices.streams,
        values,
        meshlets=(
            np.arange(len(triangles), dtype=np.uint32),
            begin,
            count,
            np.array([0, len(clusters)], np.uint32),
        ),
    )
    return view


# --- files ---


@dataclass
class Group:
    centre: tuple[float, float, float]
    radius: float
    error: float
    clusters: int
    runs: list[tuple[int, int]]


POSITION = Attribute("POSITION", "VEC3", FLOAT, 0)


@dataclass
class File:
    """A file with one primitive. pages: (blob, its groups). Buffer views: tables, coarse pages,
    level 0."""

    pages: list[tuple[bytes, list[Group]]]
    coarse_pages: int
    attributes: list[Attribute] = field(default_factory=lambda: [POSITION])
    targets: list[list[Attribute]] = field(default_factory=list)
    description: str = ""
    cuts: list[Cut] = field(default_factory=list)
    change: Change | None = None
    move: Move | None = None

    def tables(self) -> bytes:
        pages, groups, first_group = [], [], 0
        runs: list[bytes] = []
        for number, (data, members) in enumerate(self.pages):
            header = _codec.Header(data)
            counts = header.triangle_count, header.vertex_count
            pages.append(struct.pack("<4I", len(data), first_group, *counts))
            first_group += len(members)
            cluster = 0
            for g in members:
                numbers = len(runs), number, cluster, g.clusters, len(g.runs)
                groups.append(struct.pack("<5f2IH2B", *g.centre, g.radius, g.error, *numbers))
                runs += [struct.pack("<I", count << 24 | finer) for finer, count in g.runs]
                cluster += g.clusters
        return b"".join([*pages, *groups, *runs])

    def counts(self) -> dict[str, int]:
        groups = [g for _, members in self.pages for g in members]
        return {
            "pageCount": len(self.pages),
            "coarsePageCount": self.coarse_pages,
            "groupCount": len(groups),
            "runCount": sum(len(g.runs) for g in groups),
        }

    def glb(self, tables: bytes | None = None) -> bytes:
        """The file, with other tables."""
        coarse = b"".join(data for data, _ in self.pages[: self.coarse_pages])
        fine = b"".join(data for data, _ in self.pages[self.coarse_pages :])
        parts = [self.tables() if tables is None else tables, coarse, fine]
        views, offset = [], 0
        for part in parts:
            views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
            offset += len(part)
        triangles = _codec.Decoder(fine).triangle_count
        accessors = [{"componentType": 5125, "count": 3 * triangles, "type": "SCALAR"}]

        def add(group: list[Attribute]) -> dict[str, int]:
            first = len(accessors)
            accessors.extend(make_vectors.accessor(fine, attribute) for attribute in group)
            return {attribute.name: first + i for i, attribute in enumerate(group)}

        def streams(group: list[Attribute]) -> dict[str, int]:
            return {attribute.name: attribute.stream for attribute in group}

        compressed = {"bufferView": 2, "attributes": streams(self.attributes)}
        primitive: dict[str, Any] = {
            "mode": 4,
            "indices": 0,
            "attributes": add(self.attributes),
        }
        if self.targets:
            compressed["targets"] = [streams(target) for target in self.targets]
            primitive["targets"] = [add(target) for target in self.targets]
        levels = {"version": 1, "bufferView": 0, "pages": {"bufferView": 1}, **self.counts()}
        primitive["extensions"] = {EDGEBREAKER: compressed, LOD: levels}
        document = {
            "asset": {"version": "2.0"},
            "extensionsUsed": [EDGEBREAKER, LOD],
            "extensionsRequired": [EDGEBREAKER],
            "buffers": [{"byteLength": offset}],
            "bufferViews": views,
            "accessors": accessors,
            "meshes": [{"primitives": [primitive]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        }
        if self.change is not None:
            self.change(document)
        binary = b"".join(parts)
        return pack_glb(document, self.move(document, binary) if self.move else binary)


def primitives_of(document: dict[str, Any]) -> list[dict[str, Any]]:
    primitives: list[dict[str, Any]] = document["meshes"][0]["primitives"]
    return primitives


def levels_of(document: dict[str, Any]) -> dict[str, Any]:
    """The extension object of the first primitive."""
    levels: dict[str, Any] = primitives_of(document)[0]["extensions"][LOD]
    return levels


# --- strips ---


def corner(x: int, y: int) -> int:
    return 2 * x + y


def strip(first: int, last: int, step: int) -> Triangles:
    """Two triangles for each `step` columns."""
    return [
        triangle
        for x in range(first, last, step)
        for triangle in (
            (corner(x, 0), corner(x + step, 0), corner(x + step, 1)),
            (corner(x, 0), corner(x + step, 1), corner(x, 1)),
        )
    ]


def strip_vertices(columns: int) -> Vertices:
    """Every other column is raised by one step."""
    positions = [
        (x, y, x % 2 * (x % (2 * COLUMNS) > 0)) for x in range(columns + 1) for y in (0, 1)
    ]
    return Vertices([stream(GRID, 3, 12)], [np.array(positions)])


def sphere(first: int, last: int) -> tuple[tuple[float, float, float], float]:
    return ((first + last) / 2, 0.5, 0.5), (last - first) / 2 + 1.0


def at_errors(*errors: float) -> list[Cut]:
    return [{"error": error} for error in errors]


def camera(eye: tuple[float, float, float] | None, threshold: float, **further: Any) -> Cut:
    """A cut for a camera of 1000 pixels for each unit at distance one."""
    view = {"eye": eye, "pixelsPerUnit": 1000.0, "threshold": threshold}
    return {"camera": view, **further}


def strip_file() -> File:
    columns = 2 * COLUMNS
    vertices = strip_vertices(columns)
    fine = [strip(0, COLUMNS, 1), strip(COLUMNS, columns, 1)]
    coarse = [strip(0, COLUMNS, 2), strip(COLUMNS, columns, 2)]
    groups = [
        Group(*sphere(0, COLUMNS), 1.0, 1, []),
        Group(*sphere(COLUMNS, columns), 1.0, 1, []),
    ]
    top = Group(*sphere(0, columns), INFINITE, 2, [(1, 1), (2, 1)])
    return File(
        [(blob(coarse, vertices), [top]), (blob(fine, vertices), groups)],
        1,
        description="two groups of level 0 in one page, and one that holds both replacements",
        cuts=[*at_errors(0.0, 0.5, 1.0, 4.0), camera((12.0, 0.5, 20.5), 60.0)],
    )


def levels_file() -> File:
    columns = 4 * COLUMNS
    vertices = strip_vertices(columns)
    quarters = [(k * COLUMNS, (k + 1) * COLUMNS) for k in range(4)]
    fine = [strip(*q, 1) for q in quarters]
    middle = [[strip(first, first + COLUMNS // 2, 2), strip(first + COLUMNS // 2, last, 2)]
              for first, last in quarters]  # fmt: skip
    outer = middle[0] + middle[1][:1], middle[1][1:] + middle[2] + middle[3]
    border = COLUMNS + COLUMNS // 2
    coarse = [strip(0, border, 4), strip(border, columns, 4)]
    top = Group(*sphere(0, columns), INFINITE, 2, [(1, 1), (2, 1)])
    left = Group(*sphere(0, 2 * COLUMNS), 1.5, 3, [(3, 2), (4, 1)])
    right = Group(*sphere(COLUMNS, columns), 2.0, 5, [(4, 1), (5, 2), (6, 2)])
    below = [Group(*sphere(*q), 1.0, 1, []) for q in quarters]
    return File(
        [
            (blob(coarse, vertices), [top]),
            (blob(outer[0], vertices), [left]),
            (blob(outer[1], vertices), [right]),
            (blob(fine[:2], vertices), below[:2]),
            (blob(fine[2:], vertices), below[2:]),
        ],
        3,
        description="three levels in five pages; two groups hold clusters of one replacement",
        cuts=[
            *at_errors(0.0, 0.5, 1.0, 1.5, 1.75, 4.0),
            *({"level": level} for level in range(4)),
        ],
    )


# --- sheets ---


def place(x: int, y: int) -> int:
    """The number of a vertex of a sheet."""
    return 64 * y + x


def sheet_positions() -> np.ndarray:
    """64 x 64 points; a bumpy square lattice."""
    y, x = np.divmod(np.arange(64 * 64), 64)
    return np.stack([x, y, (x * x + 3 * y * y + x * y) % 5], axis=1)


Box = tuple[int, int, int, int]  # x0, y0, x1, y1 of a part of a sheet


def lattice(box: Box) -> Triangles:
    """Two triangles for each cell."""
    x0, y0, x1, y1 = box
    return [
        triangle
        for y in range(y0, y1)
        for x in range(x0, x1)
        for triangle in (
            (place(x, y), place(x + 1, y), place(x + 1, y + 1)),
            (place(x, y), place(x + 1, y + 1), place(x, y + 1)),
        )
    ]


def fan(box: Box) -> Triangles:
    """One triangle for each edge of the border, around the vertex in the middle."""
    x0, y0, x1, y1 = box
    rim = [(x, y0) for x in range(x0, x1)] + [(x1, y) for y in range(y0, y1)]
    rim += [(x, y1) for x in range(x1, x0, -1)] + [(x0, y) for y in range(y1, y0, -1)]
    middle = place((x0 + x1) // 2, (y0 + y1) // 2)
    return [(middle, place(*a), place(*b)) for a, b in zip(rim, rim[1:] + rim[:1])]


def around(box: Box) -> tuple[tuple[float, float, float], float]:
    """A sphere around a part of a sheet."""
    x0, y0, x1, y1 = box
    return ((x0 + x1) / 2, (y0 + y1) / 2, 2.0), (x1 - x0) / 2 + (y1 - y0) / 2 + 2


# Patches of a sheet, column by column: 0 and 1 on the left, 2 and 3 on the right.
PATCHES: list[Box] = [
    (x, y, x + SIDE, y + SIDE) for x in (0, SIDE) for y in (0, SIDE)
]  # fmt: skip
LEFT, RIGHT = (0, 0, SIDE, 2 * SIDE), (SIDE, 0, 2 * SIDE, 2 * SIDE)
WHOLE = (0, 0, 2 * SIDE, 2 * SIDE)
PLAIN = Vertices([stream(GRID, 3, 12)], [sheet_positions()])


def sheet_file(coarse: Vertices = PLAIN, fine: Vertices = PLAIN) -> File:
    """Four patches. coarse, fine: streams of coarse pages and of level 0."""
    top = Group(*around(WHOLE), INFINITE, 2, [(1, 1), (2, 1)])
    middle = [
        Group(*around(LEFT), 0.5, 2, [(3, 1), (4, 1)]),
        Group(*around(RIGHT), 0.375, 2, [(5, 1), (6, 1)]),
    ]
    below = [Group(*around(box), 0.125 + i / 64, 1, []) for i, box in enumerate(PATCHES)]
    fans = [fan(box) for box in PATCHES]
    whole = [lattice(box) for box in PATCHES]
    return File(
        [
            (blob([fan(LEFT), fan(RIGHT)], coarse), [top]),
            (blob(fans[:2], coarse), middle[:1]),
            (blob(fans[2:], coarse), middle[1:]),
            (blob(whole[:2], fine), below[:2]),
            (blob(whole[2:], fine), below[2:]),
        ],
        3,
        description="a sheet of four patches, whose replacements keep all of their borders: "
        "mixed cuts for cameras, with all pages in memory and with some",
        cuts=[
            *at_errors(0.0, 0.125, 0.15, 0.4, 0.5),
            camera((2.0, 2.0, 12.0), 40.0, surface=True),
            camera((7.0, 1.0, 14.0), 20.0),
            camera((4.0, 4.0, 300.0), 1.5),
            camera((4.0, 4.0, 300.0), 1.0),
            camera((4.0, 4.0, 5.0), 100.0),
            camera(None, 140.0),
            # The sheet at twice its size and turned, far from the origin.
            camera(
                (5.0, 30.0, 3.0),
                20.0,
                matrix=[0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 7, 1, 1],
            ),
            # Twice as large in x alone.
            camera(
                (4.0, 4.0, 14.0),
                40.0,
                matrix=[2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
            ),
            *(
                {"error": 0.0, "resident": resident}
                for resident in ([0], [0, 1], [0, 2, 4], [0, 1, 4], [0, 1, 3], [0, 3, 4])
            ),
            camera((2.0, 2.0, 12.0), 40.0, resident=[0, 1, 2, 4]),
            *({"level": level} for level in (0, 1, 2, 3)),
        ],
    )


def unequal_file() -> File:
    """The left half in three levels, the right one in two."""
    top = Group(*around(WHOLE), INFINITE, 2, [(1, 1), (4, 1)])
    middle = Group(*around(LEFT), 0.5, 2, [(2, 1), (3, 1)])
    below = [Group(*around(box), 0.125, 1, []) for box in PATCHES[:2]]
    right = Group(*around(RIGHT), 0.375, 2, [])
    fans = [fan(box) for box in PATCHES]
    whole = [lattice(box) for box in PATCHES]
    return File(
        [
            (blob([fan(LEFT), fan(RIGHT)], PLAIN), [top]),
            (blob(fans[:2], PLAIN), [middle]),
            (blob(whole[:2], PLAIN), below),
            (blob(whole[2:], PLAIN), [right]),
        ],
        2,
        description="a group with clusters of replacements of two levels",
        cuts=[
            *at_errors(0.0, 0.2, 0.375, 0.5),
            *({"level": level} for level in (0, 1, 2)),
            {"error": 0.0, "resident": [0, 3]},
        ],
    )


def streams_file() -> File:
    positions = sheet_positions()
    x, y = positions[:, 0], positions[:, 1]
    normals = np.stack([120 + x % 7, 130 - y % 5], axis=1)
    coordinates = np.stack([40 * x, 40 * y + x], axis=1)
    moves = np.stack([x % 3, 0 * x, 7 + y % 2], axis=1)
    values = [positions, normals, coordinates, moves]

    def vertices(*predictors: int) -> Vertices:
        shapes = (GRID, 3, 12), (OCT, 2, 8), (GRID, 2, 12), (GRID, 3, 4)
        return Vertices([stream(*s, p) for s, p in zip(shapes, predictors)], values)

    file = sheet_file(
        vertices(PARALLELOGRAM, COPY, MEAN, PARALLELOGRAM), vertices(MEAN, GEO, AFFINE, COPY)
    )
    attributes = [
        POSITION,
        Attribute("NORMAL", "VEC3", FLOAT, 1),
        Attribute("TEXCOORD_0", "VEC2", UNSIGNED_SHORT, 2, True),
    ]
    return replace(
        file,
        attributes=attributes,
        targets=[[Attribute("POSITION", "VEC3", FLOAT, 3)]],
        description="four streams, one of them of a morph target; predictors of coarse pages "
        "differ from those of level 0",
        cuts=[{"error": 0.15, "surface": True}],
    )


def touching_file() -> File:
    """Spheres that contain others just so: a radius less by its last bit would be too small."""
    file = strip_file()
    (top_blob, _), (fine_blob, fine) = file.pages
    finer = [replace(g, centre=(g.centre[0], 0.1, 0.7), radius=12.7) for g in fine]
    centre = (24.0, 0.5, 0.5)
    radius = least_radius(centre, finer)
    top = Group(centre, radius, INFINITE, 2, [(1, 1), (2, 1)])
    return replace(
        file,
        pages=[(top_blob, [top]), (fine_blob, finer)],
        description="spheres that contain others with nothing to spare",
        cuts=at_errors(0.5),
    )


def above(value: np.float32) -> float:
    """The next larger binary32."""
    return float(np.nextafter(value, np.float32(INFINITE)))


def least_radius(centre: tuple[float, float, float], finer: list[Group]) -> float:
    """The least binary32 with which a sphere contains others."""
    single = [np.float32(value).item() for g in finer for value in (*g.centre, g.radius)]
    groups = [
        reference_lod.Group((x, y, z), r, 0.0, 0, 0, 1)
        for x, y, z, r in zip(*(single[i::4] for i in range(4)))
    ]
    holder = reference_lod.Group(centre, 0.0, 0.0, 0, 0, 1)
    reach = max(reference_lod.reach(holder, g) for g in groups)
    radius = np.float32(reach)
    return float(radius) if float(radius) >= reach else above(radius)


def shared_file() -> File:
    """Three primitives with one level 0. The last one is drawn in full."""

    def change(document: dict[str, Any]) -> None:
        document["materials"] = [{"name": name} for name in ("one", "two", "three")]
        (first,) = primitives_of(document)
        others = [json.loads(json.dumps(first)) for _ in range(2)]
        del others[1]["extensions"][LOD]
        primitives = [first, *others]
        for number, primitive in enumerate(primitives):
            primitive["material"] = number
        document["meshes"][0]["primitives"] = primitives

    return replace(
        strip_file(),
        change=change,
        description="two primitives that share all buffer views, and one without levels",
        cuts=at_errors(0.5),
    )


def unknown_version_file() -> File:
    """The tables are those of another version: there are none."""

    def change(document: dict[str, Any]) -> None:
        levels = levels_of(document)
        levels.clear()
        levels.update(version=2, tables={"bufferView": 0})

    return replace(
        strip_file(),
        change=change,
        description="a version that no reader of this document knows: there is level 0 alone",
        cuts=[],
    )


def bytes_of(view: dict[str, Any], binary: bytes) -> bytes:
    return binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]


def buffers_file() -> File:
    def move(document: dict[str, Any], binary: bytes) -> bytes:
        views = document["bufferViews"]
        for number in (1, 2):
            data = bytes(8 * number) + bytes_of(views[number], binary)
            uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
            document["buffers"].append({"uri": uri, "byteLength": len(data)})
            views[number].update(buffer=number, byteOffset=8 * number)
        document["buffers"][0]["byteLength"] = views[0]["byteLength"]
        return bytes_of(views[0], binary)

    return replace(
        levels_file(),
        move=move,
        description="tables, coarse pages and level 0 in a buffer each",
    )


def packed(document: dict[str, Any], binary: bytes) -> bytes:
    """Both views of pages in the transport form."""
    views = document["bufferViews"]
    parts = [bytes_of(views[0], binary)]
    for view in views[1:]:
        data = _codec.pack(bytes_of(view, binary), 1)
        view["extensions"] = {TRANSPORT: {"byteLength": view["byteLength"]}}
        view.update(byteOffset=sum(map(len, parts)), byteLength=len(data))
        parts += [data, bytes(-len(data) % 4)]
    for names in ("extensionsUsed", "extensionsRequired"):
        document[names].append(TRANSPORT)
    document["buffers"][0]["byteLength"] = sum(map(len, parts))
    return b"".join(parts)


def packed_file() -> File:
    return replace(
        sheet_file(), move=packed, description="coarse pages and level 0 in the transport form"
    )


VALID: dict[str, Callable[[], File]] = {
    "strip": strip_file,
    "levels": levels_file,
    "sheet": sheet_file,
    "unequal_levels": unequal_file,
    "streams": streams_file,
    "touching_spheres": touching_file,
    "shared_views": shared_file,
    "unknown_version": unknown_version_file,
    "several_buffers": buffers_file,
    "packed": packed_file,
}


# --- what a reader finds ---


def expected(file: File) -> dict[str, Any]:
    """What the reference reader finds."""
    data = file.glb()
    assert reference_lod.problems(data) == []
    found: list[dict[str, Any] | None] = []
    for primitive in reference_lod.read_file(data):
        if primitive is None:
            found.append(None)
            continue
        tables = primitive.tables
        found.append(
            {
                "levels": [g.level for g in tables.groups],
                "rootPages": tables.root_pages,
                "cuts": [found_in_cut(primitive, cut) for cut in file.cuts],
            }
        )
    return {"description": file.description, "primitives": found}


def found_in_cut(primitive: reference_lod.Primitive, cut: Cut) -> Cut:
    tables = primitive.tables
    resident = None
    if "resident" in cut:
        resident = [page in cut["resident"] for page in range(len(tables.pages))]
    active = reference_lod.active_groups(tables, needed(tables, cut), resident)
    triangles = reference_lod.surface(primitive, active)
    return {
        **{key: value for key, value in cut.items() if key != "surface"},
        "active": [number for number, value in enumerate(active) if value],
        "drawn": reference_lod.drawn_clusters(tables, active),
        "triangles": len(triangles),
        **({"surface": triangles} if cut.get("surface") else {}),
    }


def needed(tables: reference_lod.Tables, cut: Cut) -> list[bool]:
    """Which groups a cut of the JSON files needs."""
    if "level" in cut:
        return reference_lod.needed_at_level(tables, cut["level"])
    if "error" in cut:
        return reference_lod.needed_at_error(tables, cut["error"])
    view = cut["camera"]
    sizes = view["pixelsPerUnit"], view["threshold"]
    return reference_lod.needed_by_view(tables, view["eye"], *sizes, cut.get("matrix"))


# --- malformed ---

PAGE_BYTES, GROUP_BYTES = 16, 32


def put(tables: bytes, offset: int, form: str, value: float) -> bytes:
    size = struct.calcsize(form)
    return tables[:offset] + struct.pack(form, value) + tables[offset + size :]


def page(number: int, at: int, value: int) -> Callable[[bytes], bytes]:
    return lambda tables: put(tables, PAGE_BYTES * number + at, "<I", value)


def group(number: int, at: int, form: str, value: float) -> Callable[[bytes], bytes]:
    return lambda tables: put(tables, PAGE_BYTES * 5 + GROUP_BYTES * number + at, form, value)


def run(number: int, finer: int, clusters: int) -> Callable[[bytes], bytes]:
    value = clusters << 24 | finer
    start = PAGE_BYTES * 5 + GROUP_BYTES * 7
    return lambda tables: put(tables, start + 4 * number, "<I", value)


# Changes of the tables of lod_levels.glb.
MALFORMED_TABLES: dict[str, Callable[[bytes], bytes]] = {
    "too_short": lambda tables: tables[:-4],
    "too_long": lambda tables: tables + bytes(4),
    "page_without_bytes": page(1, 0, 0),
    "page_length_not_of_four": page(1, 0, 1001),
    "first_page_starts_late": page(0, 4, 1),
    "pages_without_groups": page(1, 4, 0),
    "page_beyond_the_groups": page(4, 4, 7),
    "group_in_another_page": group(1, 24, "<I", 2),
    "group_without_clusters": group(3, 30, "<B", 0),
    "first_cluster": group(4, 28, "<H", 2),
    "first_run": group(1, 20, "<I", 1),
    "runs_outside": group(2, 31, "<B", 9),
    "too_few_runs": group(2, 31, "<B", 2),
    "level_0_with_runs": group(6, 31, "<B", 1),
    "centre_infinite": group(2, 0, "<f", INFINITE),
    "centre_nan": group(2, 8, "<f", NAN),
    "radius_nan": group(2, 12, "<f", NAN),
    "radius_negative": group(3, 12, "<f", -1.0),
    "error_nan": group(3, 16, "<f", NAN),
    "error_negative": group(3, 16, "<f", -1.0),
    "error_above_its_coarser": group(3, 16, "<f", 1.75),
    "top_with_finite_error": group(0, 16, "<f", 9.0),
    "replaced_with_infinite_error": group(1, 16, "<f", INFINITE),
    "sphere_beyond_its_coarser": group(3, 12, "<f", 90.0),
    "sphere_beyond_by_rounding": group(1, 12, "<f", float(np.nextafter(np.float32(25), 0))),
    "run_of_itself": run(0, 0, 1),
    "run_of_a_coarser_group": run(2, 0, 2),
    "run_beyond_the_groups": run(0, 7, 1),
    "run_without_clusters": run(2, 3, 0),
    "run_with_too_many_clusters": run(2, 3, 3),
}


def object_with(**changes: Any) -> Change:
    """Changes properties of the extension object; None removes one."""

    def change(document: dict[str, Any]) -> None:
        levels = levels_of(document)
        levels.update(changes)
        for name in [name for name, value in changes.items() if value is None]:
            del levels[name]

    return change


def view_with(number: int, **changes: Any) -> Change:
    return lambda document: document["bufferViews"][number].update(changes)


def compressed_view(document: dict[str, Any]) -> None:
    view = document["bufferViews"][0]
    length, extension = view["byteLength"], "KHR_meshopt_compression"
    packed = {"buffer": 0, "byteLength": length, "byteStride": 4, "count": length // 4}
    view["extensions"] = {extension: {**packed, "mode": "ATTRIBUTES"}}
    document["extensionsUsed"].append(extension)


def view_that_an_accessor_uses(document: dict[str, Any]) -> None:
    accessor = {"bufferView": 1, "componentType": 5121, "count": 4, "type": "SCALAR"}
    document["accessors"].append(accessor)


def other_views_of_one_level_0(document: dict[str, Any]) -> None:
    (first,) = primitives_of(document)
    second = json.loads(json.dumps(first))
    document["bufferViews"].append(dict(document["bufferViews"][0]))
    second["extensions"][LOD]["bufferView"] = 3
    document["meshes"][0]["primitives"] = [first, second]


def levels_of_another_level_0(document: dict[str, Any]) -> None:
    (first,) = primitives_of(document)
    second = json.loads(json.dumps(first))
    document["bufferViews"].append(dict(document["bufferViews"][2]))
    second["extensions"][EDGEBREAKER]["bufferView"] = 3
    accessors = document["accessors"]
    count = len(accessors)
    accessors += json.loads(json.dumps(accessors))
    second["indices"] += count
    second["attributes"] = {name: n + count for name, n in second["attributes"].items()}
    document["meshes"][0]["primitives"] = [first, second]


def not_compressed(document: dict[str, Any]) -> None:
    """Adds a triangle with levels, but no other extension."""
    (first,) = primitives_of(document)
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3"}
    bounds = {"min": [0.0] * 3, "max": [0.0] * 3}
    document["accessors"].append({**accessor, **bounds})
    number = len(document["accessors"]) - 1
    bare = {"attributes": {"POSITION": number}, "extensions": {LOD: first["extensions"][LOD]}}
    document["meshes"][0]["primitives"].append(bare)


# Changes of the document of lod_levels.glb.
MALFORMED_DOCUMENTS: dict[str, Change] = {
    "listed_in_extensions_required": lambda d: d["extensionsRequired"].append(LOD),
    "not_in_extensions_used": lambda d: d["extensionsUsed"].remove(LOD),
    "not_compressed": not_compressed,
    "not_an_object": lambda d: primitives_of(d)[0]["extensions"].update({LOD: []}),
    "version_missing": object_with(version=None),
    "version_text": object_with(version="1"),
    "no_pages": object_with(pages=None),
    "pages_not_an_object": object_with(pages=[]),
    "no_coarse_pages": object_with(coarsePageCount=0),
    "no_pages_of_level_0": object_with(coarsePageCount=5),
    "other_page_count": object_with(pageCount=6),
    "no_runs": object_with(runCount=0),
    "one_group": object_with(groupCount=1),
    "root_pages": object_with(rootPageCount=2),
    "root_pages_zero": object_with(rootPageCount=0),
    "view_missing": object_with(bufferView=9),
    "view_offset": view_with(1, byteOffset=2),
    "view_stride": view_with(0, byteStride=16),
    "view_target": view_with(1, target=34962),
    "view_compressed": compressed_view,
    "view_of_an_accessor": view_that_an_accessor_uses,
    "view_longer_than_its_pages": lambda d: d["bufferViews"][1].update(
        byteLength=d["bufferViews"][1]["byteLength"] + 4
    ),
    "shared_level_0_with_other_levels": other_views_of_one_level_0,
    "shared_levels_of_another_level_0": levels_of_another_level_0,
}


def with_page(file: File, number: int, data: bytes) -> File:
    pages = list(file.pages)
    pages[number] = data, pages[number][1]
    return replace(file, pages=pages)


def with_tables(file: File, change: Callable[[bytes], bytes]) -> bytes:
    return file.glb(change(file.tables()))


def lengths_moved(tables: bytes) -> bytes:
    """Page 1 ends four bytes late, page 2 begins there."""
    first, second = (struct.unpack_from("<I", tables, PAGE_BYTES * p)[0] for p in (1, 2))
    return page(2, 0, second - 4)(page(1, 0, first + 4)(tables))


def moved(number: int, by: int) -> Callable[[bytes], bytes]:
    """Adds to a 32-bit field of the tables."""
    return lambda tables: put(
        tables, number, "<I", struct.unpack_from("<I", tables, number)[0] + by
    )


def malformed_pages() -> dict[str, bytes]:
    """Name -> a file whose tables and pages do not go together."""
    file = levels_file()
    columns = 4 * COLUMNS
    plain = strip_vertices(columns)
    coarse = [strip(0, 36, 4), strip(36, columns, 4)]
    split = [coarse[0], strip(36, 72, 4), strip(72, columns, 4)]

    def coarse_with(vertices: Vertices) -> bytes:
        return with_page(file, 0, blob(coarse, vertices)).glb()

    def vertices_with(**changes: Any) -> Vertices:
        return Vertices([replace(plain.streams[0], **changes)], plain.values)

    two_streams = Vertices(
        [*plain.streams, stream(GRID, 1, 12)], [*plain.values, plain.values[0][:, :1]]
    )
    damaged = bytearray(file.pages[2][0])
    damaged[-12] ^= 0xFF
    damaged[-13] ^= 0xFF
    no_magic = bytearray(file.pages[2][0])
    no_magic[0] ^= 1
    return {
        "page_lengths": with_tables(file, lengths_moved),
        "packed_page_lengths": with_tables(replace(file, move=packed), lengths_moved),
        "page_triangles": with_tables(file, moved(PAGE_BYTES + 8, 1)),
        "page_vertices": with_tables(file, moved(PAGE_BYTES + 12, 1)),
        "page_meshlets": with_page(file, 0, blob(split, plain)).glb(),
        "page_damaged": with_page(file, 2, bytes(damaged)).glb(file.tables()),
        "page_without_magic": with_page(file, 2, bytes(no_magic)).glb(file.tables()),
        "page_with_another_step": coarse_with(vertices_with(step=2.0)),
        "page_with_another_offset": coarse_with(vertices_with(offset=(0.0, 1.0, 0.0))),
        "page_with_other_bits": coarse_with(vertices_with(bits=13)),
        "page_with_another_stream": coarse_with(two_streams),
    }


def malformed_replacements() -> dict[str, bytes]:
    """Name -> a file whose cuts have cracks, holes or layers."""
    file = levels_file()
    columns = 4 * COLUMNS
    plain = strip_vertices(columns)
    # Clusters end at x = 48, groups 1 and 2 at x = 36.
    elsewhere = [strip(0, 48, 4), strip(48, columns, 4)]
    raised = plain.values[0].copy()
    raised[corner(36, 0), 2] = 1
    border = Vertices(plain.streams, [raised])
    inner = plain.values[0].copy()
    inner[corner(60, 0), 2] = 2
    new_vertex = Vertices(plain.streams, [inner])
    coarse = [strip(0, 36, 4), strip(36, columns, 4)]
    sheet = sheet_file()
    # The border of the right patches lacks a vertex where the left ones have it.
    rim = [t for t in fan(PATCHES[2]) if place(SIDE, 1) not in t]
    rim.append((place(6, 2), place(SIDE, 2), place(SIDE, 0)))
    twice = np.concatenate([PLAIN.values[0]] * 2)
    again = [(a + 64 * 64, b + 64 * 64, c + 64 * 64) for a, b, c in fan(PATCHES[2])]
    return {
        "replacement_of_another_region": with_page(file, 0, blob(elsewhere, plain)).glb(),
        "replacement_moves_its_border": with_page(file, 0, blob(coarse, border)).glb(),
        "replacement_with_a_new_vertex": with_page(file, 0, blob(coarse, new_vertex)).glb(),
        "replacement_lacks_a_border_vertex": with_page(
            sheet, 2, blob([rim, fan(PATCHES[3])], PLAIN)
        ).glb(),
        "replacement_twice": with_page(
            sheet, 2, blob([fan(PATCHES[2]), again], Vertices(PLAIN.streams, [twice]))
        ).glb(),
    }


# Malformed files in which a reader of tables and of single pages finds nothing wrong.
VALIDATORS_ONLY = (
    "listed_in_extensions_required",
    "not_in_extensions_used",
    "not_compressed",
    "view_of_an_accessor",
    "shared_level_0_with_other_levels",
    "shared_levels_of_another_level_0",
    *(f"replacement_{name}" for name in (
        "of_another_region",
        "moves_its_border",
        "with_a_new_vertex",
        "lacks_a_border_vertex",
        "twice",
    )),
)  # fmt: skip


def malformed_files() -> dict[str, bytes]:
    file = levels_file()
    return {
        **{name: with_tables(file, change) for name, change in MALFORMED_TABLES.items()},
        **{name: replace(file, change=c).glb() for name, c in MALFORMED_DOCUMENTS.items()},
        **malformed_pages(),
        **malformed_replacements(),
    }


def refusal(name: str, data: bytes) -> dict[str, str]:
    """The reason of the reference reader, and who finds it."""
    reasons = reference_lod.problems(data)
    assert len(reasons) == 1, (name, reasons)
    found_by = "validator" if name in VALIDATORS_ONLY else "page"
    try:
        primitives = reference_lod.read_file(data)
    except ValueError as error:
        assert found_by == "page" and str(error) == reasons[0]
        return {"reason": reasons[0], "foundBy": "tables"}
    for primitive in filter(None, primitives):
        for number in range(len(primitive.blobs)):
            try:
                reference_lod.check_page(primitive, number)
            except ValueError:
                assert found_by == "page"
                return {"reason": reasons[0], "foundBy": found_by}
    assert found_by == "validator", name
    return {"reason": reasons[0], "foundBy": found_by}


def worked_example(tables: bytes) -> str:
    """The tables of the strip, field by field."""
    rows = ["| Bytes | Content |", "| --- | --- |"]

    def row(start: int, size: int, text: str) -> None:
        rows.append(f"| `{tables[start : start + size].hex(' ', 4)}` | {text} |")

    for number in range(2):
        length, first, triangles, vertices = struct.unpack_from("<4I", tables, 16 * number)
        text = f"{length} bytes, first group {first}, {triangles} triangles, {vertices} vertices"
        row(16 * number, 16, f"page {number}: {text}")
    for number in range(3):
        x, y, z, radius, error, first_run, page_number, first, clusters, runs = struct.unpack_from(
            "<5f2IH2B", tables, 32 + 32 * number
        )
        at = 32 + 32 * number
        row(at, 16, f"group {number}: centre ({x:g}, {y:g}, {z:g}), radius {radius:g}")
        text = f"error {error:g}, first run {first_run}, page {page_number}"
        text += f", first cluster {first}, clusters {clusters}, runs {runs}"
        row(at + 16, 16, text)
    for number in range(2):
        (word,) = struct.unpack_from("<I", tables, 128 + 4 * number)
        row(128 + 4 * number, 4, f"run {number}: group {word & 0xFFFFFF}, clusters {word >> 24}")
    return "\n".join(rows) + "\n"


def document_with_example() -> str:
    text = DOCUMENT.read_text()
    head, _, rest = text.partition(BEGIN)
    return head + BEGIN + worked_example(strip_file().tables()) + END + rest.partition(END)[2]


def files() -> dict[str, bytes]:
    """Name -> content of everything in the folder."""
    result: dict[str, bytes] = {}
    for name, make in VALID.items():
        file = make()
        result[f"lod_{name}.glb"] = file.glb()
        text = json.dumps(expected(file), separators=(",", ":"), allow_nan=False)
        result[f"lod_{name}.json"] = (text + "\n").encode()
    reasons = {}
    for name, data in malformed_files().items():
        result[f"malformed_{name}.glb"] = data
        reasons[f"malformed_{name}.glb"] = refusal(name, data)
    result["malformed.json"] = (json.dumps(reasons, indent=1) + "\n").encode()
    return result


def main() -> None:
    content = files()
    FOLDER.mkdir(exist_ok=True)
    for path in FOLDER.iterdir():
        path.unlink()
    for name, data in content.items():
        (FOLDER / name).write_bytes(data)
    DOCUMENT.write_text(document_with_example())


if __name__ == "__main__":
    main()
