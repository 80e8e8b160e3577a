"""Writes spec/lod_vectors: conformance vectors of EXT_meshlet_lod.

    python -m spec.make_lod_vectors

lod_NAME.glb are valid; lod_NAME.json has what a reader finds in them. malformed_NAME.glb break one
rule each; malformed.json has the reasons that the reference reader gives. Also writes the worked
example into spec/EXT_meshlet_lod.md.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gltf_ext import _codec
from spec import reference_lod
from spec.make_vectors import pack_glb

FOLDER = Path(__file__).parent / "lod_vectors"
DOCUMENT = Path(__file__).parent / "EXT_meshlet_lod.md"
BEGIN = "<!-- begin worked example: written by spec/make_lod_vectors.py -->\n"
END = "<!-- end worked example -->\n"
EXTENSION, EDGEBREAKER = "EXT_meshlet_lod", "EXT_meshlet_edgebreaker"
COLUMNS = 24  # of a group of level 0; two triangles each
ERRORS = (0.0, 0.5, 1.0, 4.0)  # of the cuts in the JSON files

Triangles = list[tuple[int, int, int]]


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


def blob(clusters: list[Triangles], columns: int) -> bytes:
    """One page of clusters that are one disk each. Every other column is raised by one step."""
    positions = np.array(
        [(x, y, x % 2 * (x % (2 * COLUMNS) > 0)) for x in range(columns + 1) for y in (0, 1)],
        np.uint32,
    )
    triangles = np.array([t for cluster in clusters for t in cluster], np.uint32)
    begin = np.cumsum([0, *map(len, clusters)]).astype(np.uint32)
    count = np.arange(len(clusters) + 1, dtype=np.uint32)
    row = {"kind": 0, "components": 3, "bits": 12, "step": 1.0, "offset": [0.0, 0.0, 0.0]}
    view, _ = _codec.encode(
        triangles,
        np.arange(len(positions), dtype=np.uint32),
        positions.astype(np.float32),
        [row],
        [positions],
        meshlets=(
            np.arange(len(triangles), dtype=np.uint32),
            begin,
            count,
            np.array([0, len(clusters)], np.uint32),
        ),
    )
    return view


@dataclass
class Group:
    centre: tuple[float, float, float]
    radius: float
    error: float
    clusters: int
    runs: list[tuple[int, int]]


@dataclass
class File:
    """pages: (blob, its groups)."""

    pages: list[tuple[bytes, list[Group]]]
    coarse_pages: int
    columns: int

    def tables(self) -> bytes:
        pages, groups, runs, first_group = [], [], [], 0
        for number, (data, members) in enumerate(self.pages):
            header = _codec.read_header(data)
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

    def glb(self, tables: bytes | None = None, **changes: object) -> bytes:
        """The file, with other tables or properties of the extension object."""
        coarse = b"".join(data for data, _ in self.pages[: self.coarse_pages])
        fine = b"".join(data for data, _ in self.pages[self.coarse_pages :])
        parts = [self.tables() if tables is None else tables, coarse, fine]
        views, offset = [], 0
        for part in parts:
            views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
            offset += len(part)
        extension = {"version": 1, "bufferView": 0, "pages": {"bufferView": 1}, **self.counts()}
        decoder = _codec.Decoder(fine)
        triangles, vertices = decoder.triangle_count, decoder.vertex_count
        high = [float(self.columns), 1.0, 1.0]
        accessors = [
            {"componentType": 5125, "count": 3 * triangles, "type": "SCALAR"},
            {
                "componentType": 5126, "count": vertices, "type": "VEC3",
                "min": [0.0, 0.0, 0.0], "max": high,
            },
        ]  # fmt: skip
        primitive = {
            "mode": 4,
            "indices": 0,
            "attributes": {"POSITION": 1},
            "extensions": {
                EDGEBREAKER: {"bufferView": 2, "attributes": {"POSITION": 0}},
                EXTENSION: {**extension, **changes},
            },
        }
        document = {
            "asset": {"version": "2.0"},
            "extensionsUsed": [EDGEBREAKER, EXTENSION],
            "extensionsRequired": [EDGEBREAKER],
            "buffers": [{"byteLength": offset}],
            "bufferViews": views,
            "accessors": accessors,
            "meshes": [{"primitives": [primitive]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        }
        return pack_glb(document, b"".join(parts))


def sphere(first: int, last: int) -> tuple[tuple[float, float, float], float]:
    return ((first + last) / 2, 0.5, 0.5), (last - first) / 2 + 1.0


def strip_file() -> File:
    """Two groups of level 0 in one page, and one that replaces both."""
    columns = 2 * COLUMNS
    fine = [strip(0, COLUMNS, 1), strip(COLUMNS, columns, 1)]
    coarse = [strip(0, COLUMNS, 2), strip(COLUMNS, columns, 2)]
    groups = [
        Group(*sphere(0, COLUMNS), 1.0, 1, []),
        Group(*sphere(COLUMNS, columns), 1.0, 1, []),
    ]
    top = Group(*sphere(0, columns), float("inf"), 2, [(1, 1), (2, 1)])
    return File([(blob(coarse, columns), [top]), (blob(fine, columns), groups)], 1, columns)


def levels_file() -> File:
    """Three levels in five pages. Two groups have clusters of the same replacement."""
    columns = 4 * COLUMNS
    quarters = [(k * COLUMNS, (k + 1) * COLUMNS) for k in range(4)]
    fine = [strip(*q, 1) for q in quarters]
    middle = [[strip(first, first + COLUMNS // 2, 2), strip(first + COLUMNS // 2, last, 2)]
              for first, last in quarters]  # fmt: skip
    outer = middle[0] + middle[1][:1], middle[1][1:] + middle[2] + middle[3]
    coarse = [strip(*q, 4) for q in ((0, 2 * COLUMNS), (2 * COLUMNS, columns))]
    top = Group(*sphere(0, columns), float("inf"), 2, [(1, 1), (2, 1)])
    left = Group(*sphere(0, 2 * COLUMNS), 1.5, 3, [(3, 2), (4, 1)])
    right = Group(*sphere(COLUMNS, columns), 2.0, 5, [(4, 1), (5, 2), (6, 2)])
    below = [Group(*sphere(*q), 1.0, 1, []) for q in quarters]
    return File(
        [
            (blob(coarse, columns), [top]),
            (blob(outer[0], columns), [left]),
            (blob(outer[1], columns), [right]),
            (blob(fine[:2], columns), below[:2]),
            (blob(fine[2:], columns), below[2:]),
        ],
        3,
        columns,
    )


VALID = {"strip": strip_file, "levels": levels_file}


def expected(file: File) -> dict[str, object]:
    """What the reference reader finds."""
    tables = read_reference(file.tables(), file.counts())
    cuts = []
    for error in ERRORS:
        active = reference_lod.active_groups(tables, [g.error > error for g in tables.groups])
        cuts.append(
            {
                "error": error,
                "active": [number for number, value in enumerate(active) if value],
                "drawn": reference_lod.drawn_clusters(tables, active),
            }
        )
    return {"levels": [g.level for g in tables.groups], "cuts": cuts}


def read_reference(tables: bytes, counts: dict[str, int]) -> reference_lod.Tables:
    return reference_lod.read(
        tables,
        counts["pageCount"],
        counts["coarsePageCount"],
        counts["groupCount"],
        counts["runCount"],
    )


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


NAN, INFINITE = float("nan"), float("inf")
MALFORMED: dict[str, Callable[[bytes], bytes]] = {
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
    "run_of_itself": run(0, 0, 1),
    "run_of_a_coarser_group": run(2, 0, 2),
    "run_beyond_the_groups": run(0, 7, 1),
    "run_without_clusters": run(2, 3, 0),
    "run_with_too_many_clusters": run(2, 3, 3),
}


def refusal(tables: bytes, counts: dict[str, int]) -> str:
    """The reason of the reference reader."""
    try:
        read_reference(tables, counts)
    except ValueError as error:
        return str(error)
    raise AssertionError("the reference reader accepts it")


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
        result[f"lod_{name}.json"] = (json.dumps(expected(file), indent=1) + "\n").encode()
    file, reasons = levels_file(), {}
    for name, change in MALFORMED.items():
        tables = change(file.tables())
        result[f"malformed_{name}.glb"] = file.glb(tables)
        reasons[name] = refusal(tables, file.counts())
    result["malformed.json"] = (json.dumps(reasons, indent=1) + "\n").encode()
    return result


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for path in FOLDER.iterdir():
        path.unlink()
    for name, content in files().items():
        (FOLDER / name).write_bytes(content)
    DOCUMENT.write_text(document_with_example())


if __name__ == "__main__":
    main()
