"""How small? Our files beside the paper's encoding, Draco, Corto, meshopt and DGF, equally precise.

Writes docs/size.md and docs/peers.png. All codecs get
the same primitives with positions, normals and texture coordinates (no colours) on the same grids;
bench/peers.py and meshlet_peers.py say what to install. The result names each codec that is
missing; its column stays empty.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path

from bench import figures, meshlet_formats, meshlet_peers, paper_encoding, peers, transport
from bench.common import (
    best_in_bold,
    bullets,
    markdown_table,
    origin_line,
    progress,
    read_result,
    table,
)
from bench.generated import GENERATED
from bench.models import OTHER_MODELS, PAPER_MODELS, all_models
from gltf_ext import _codec
from gltf_ext.attributes.streams import Bits
from gltf_ext.sources.primitives import Primitive
from spec.reference_decoder import BitReader, BlobFile, Meshlet

OPTIONS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12, "page_bytes": 0}
OURS, PAPER = "ours", "the paper's encoding"
KINDS = {
    "connectivity": "connectivity",
    "references_and_headers": "references",
    "positions": "positions",
    "normals": "normals",
    "texcoords": "uv",
    "total": "all",
}
# Sections of a meshlet: label, and the first words of their fields' names
FIELDS = {
    "connectivity": ("p0", "p1", "p2", "p3"),
    "references": (
        *("foreign mask", "loop-end mask", "private mask"),
        *("length", "delta", "slot", "share bits"),
    ),
    "codes": ("code of", "width of chain", "width of interior"),
    "anchors": ("first anchor", "width of further anchors", "further anchors"),
    "chains": ("low of chain", "unary of chain"),
    "interior": ("unary of interior", "low of interior"),
}
TABLES = "headers and tables"  # of blobs and groups, with heads of meshlets, entries and padding
SECTIONS = (*FIELDS, TABLES)
# These must be unpacked before they are drawn: on the GPU they take as much as the raw model.
UNPACKED = ("Draco", "Corto")
Cell = Callable[[dict], str]  # of a model's row


# --- measurements ---


class SectionReader(BitReader):
    """Adds the bits that it reads to their section in `bits`."""

    def __init__(self, reader: BitReader, bits: Counter):
        super().__init__(reader.data, reader.position, reader.end)
        self.bits = bits

    def read(self, width: int, name: str) -> int:
        self.bits[section_of(name)] += width
        return super().read(width, name)

    def read_unary(self, name: str, most: int) -> int:
        """As the base class, but 64 bits at a time: the padding of a blob lets it read so many."""
        begin = self.position
        while True:
            at = self.position >> 3
            window = int.from_bytes(self.data[at : at + 8], "little") >> (self.position & 7)
            if window:
                self.position += (window & -window).bit_length()
                break
            self.position = 8 * (at + 8)
        self.bits[section_of(name)] += self.position - begin
        return self.position - begin - 1


class SectionFile(BlobFile):
    """A blob whose meshlets add their bits to `bits` as they are read."""

    def __init__(self, data: bytes):
        self.bits: Counter = Counter()
        super().__init__(data)
        self.bits.clear()  # of the check of the triangle count

    def reader(self, m: int) -> SectionReader:
        return SectionReader(super().reader(m), self.bits)


@cache
def section_of(field: str) -> str:
    """The section of a field that the reference decoder reads."""
    return next((s for s, starts in FIELDS.items() if field.startswith(starts)), TABLES)


def section_bits(blob: bytes) -> Counter:
    """Bits of each of SECTIONS in a blob; they add up to its length.

    "chains" are the inner vertices of boundaries, "interior" all vertices inside. The reference
    decoder reads the rest; all bits of streams are known from the C++ decoder.
    """
    file, described = SectionFile(blob), _codec.describe(blob)["bits"]
    for m in range(file.meshlet_count):
        Meshlet(file, m)
    bits = Counter({section: file.bits[section] for section in FIELDS})
    bits["interior"] = sum(described["streams"]) - bits["anchors"] - bits["chains"]
    bits[TABLES] = 8 * len(blob) - bits.total()
    return bits


def measure(options: argparse.Namespace) -> dict:
    """All models in all codecs."""
    codecs, missing = peers.available()
    formats, also_missing = meshlet_peers.available()
    rows = []
    for path in all_models():
        rows.append(measure_model(path, codecs, formats))
        progress(f"{path.stem}: {rows[-1]['ratio']:.2f}")
    return {
        "options": OPTIONS,
        "codecs": {codec.name: codec.version for codec in [*codecs, *formats]},
        "missing": missing + also_missing,
        "models": rows,
    }


def measure_model(path: Path, codecs: list, formats: list) -> dict:
    """One model in every codec: inspect's totals of ours, and the bytes of all.

    codecs: of bench/peers.py; formats: of bench/meshlet_peers.py.
    """
    primitives = peers.read_primitives(path)
    parts = peers.parts_of(primitives, _bits())
    row = {"model": path.stem, **measure_ours(primitives)}
    sizes = {
        OURS: {"file_bytes": row["compressed_bytes"], "resident_bytes": row.pop("resident_bytes")}
    }
    paper = len(paper_encoding.encode(parts, _bits()).data)
    sizes[PAPER] = {"file_bytes": paper, "resident_bytes": paper}
    for codec in codecs:
        buffers = codec.encode(parts, _bits())
        sizes[codec.name] = {
            "file_bytes": codec.file_bytes(buffers),
            "resident_bytes": codec.resident_bytes(parts, buffers),
        }
    integers = meshlet_peers.integers_of(primitives, _bits())
    for peer in formats:
        made = peer.run(integers).bytes
        sizes[peer.name] = {"file_bytes": made, "resident_bytes": made}
    for size in sizes.values():
        size.update(
            ratio=row["raw_bytes"] / size["file_bytes"],
            resident_ratio=row["raw_bytes"] / size["resident_bytes"],
            bits_per_triangle=8 * size["file_bytes"] / row["triangles"],
        )
    return {**row, "codecs": sizes}


def measure_ours(primitives: list[Primitive]) -> dict:
    """inspect's totals without `blobs`; `sections` (bits per triangle) and `resident_bytes`."""
    totals, blobs = meshlet_peers.compressed(primitives, **OPTIONS)
    del totals["blobs"]  # one for each primitive
    bits = sum((section_bits(blob) for blob in blobs), Counter())
    bits[TABLES] += 8 * (totals["compressed_bytes"] - sum(map(len, blobs)))
    return {
        **totals,
        "sections": {section: bits[section] / totals["triangles"] for section in SECTIONS},
        "resident_bytes": sum(map(len, blobs)),
    }


def _bits() -> Bits:
    return Bits(OPTIONS["position_bits"], OPTIONS["normal_bits"], OPTIONS["texcoord_bits"])


# --- the document ---


def names_of(result: dict) -> list[str]:
    """The codecs of a result, ours first."""
    return list(dict.fromkeys(name for row in result["models"] for name in row["codecs"]))


def ratios(result: dict, key: str, names: list[str]) -> str:
    """How many times smaller than raw; the best of each row is bold."""
    rows = [
        [
            row["model"],
            *best_in_bold((row["codecs"].get(name, {}).get(key) for name in names), ".2f"),
        ]
        for row in result["models"]
    ]
    return markdown_table(["model", *names], rows)


def figure(form: str, *keys: str) -> Cell:
    """Writes the figure at these keys of a row; nothing if it is not measured."""

    def cell(row: dict) -> str:
        for key in keys:
            if key not in row:
                return ""
            row = row[key]
        return f"{row:{form}}"

    return cell


def byte_table(result: dict, key: str, names: list[str]) -> str:
    columns = {
        "model": figure("", "model"),
        "triangles": figure(",", "triangles"),
        "vertices": figure(",", "source_vertices"),
        "raw": figure(",", "raw_bytes"),
        **{name: figure(",", "codecs", name, key) for name in names},
    }
    return table(result["models"], columns)


def section_table(rows: list[dict]) -> str:
    columns = {
        "model": figure("", "model"),
        "triangles per meshlet": figure(".1f", "mean_triangles_per_meshlet"),
        **{section: figure(".2f", "sections", section) for section in SECTIONS},
        "all": figure(".2f", "bits_per_triangle", "total"),
    }
    return table(rows, columns)


def attribute_table(rows: list[dict]) -> str:
    kinds = {text: figure(".2f", "bits_per_triangle", kind) for kind, text in KINDS.items()}
    return table(rows, {"model": figure("", "model"), **kinds})


def smaller_than_ours(result: dict, key: str, names: list[str]) -> str:
    """The codecs that are smaller than ours and their models, in words."""
    found, of_all = [], f"of {len(result['models'])} models"
    for name in names[1:]:
        models = [
            row["model"]
            for row in result["models"]
            if name in row["codecs"] and row["codecs"][name][key] > row["codecs"][OURS][key]
        ]
        if models:
            found.append(
                f"{name} on "
                + (", ".join(models) if len(models) <= 4 else f"{len(models)} {of_all}")
            )
    return "; ".join(found) or "none"


def report(result: dict) -> str:
    """docs/size.md."""
    names = names_of(result)
    resident = [
        name
        for name in names
        if not name.startswith(UNPACKED) and name != "meshopt-compressed glTF"
    ]
    missing = "".join(f"* not measured: {line}\n" for line in result["missing"])
    measured = {row["model"] for row in result["models"]}
    described = {**PAPER_MODELS, **OTHER_MODELS, **GENERATED}
    return f"""# Size

{origin_line(result)}
Positions have 12 bits, normals 8 + 8, texture coordinates 12. All codecs use the same position
grid, one per mesh.

* Raw: source vertices after joining those that are equal once quantised, 4 bytes per float, plus 12
  bytes per triangle, without colours.
* Ours: all bytes of the extension, its JSON included, in one blob for each primitive. The pages
  that `compress` writes above 131,072 triangles add 0.8 % to igea and dragon. The others: their
  buffers without JSON.
* Draco and DGF drop triangles that collapse on the grid, DGF only those that name a vertex twice;
  the others keep them.
* meshopt meshlets: triangles by `meshopt_encodeMeshlet`, at most 64 vertices and 126 triangles.
  Each meshlet has its own vertices, as the library's manual describes for positions: the
  least value of each element, and bits for the largest difference. 8 bytes more find a meshlet.
* AMD DGF: blocks of 128 bytes with positions and triangles, by each packer of its SDK. Its manual
  puts other attributes beside the blocks, once per vertex of a block: 2 bytes of normal, 3 of
  texture coordinates.

Versions:

{bullets(result["codecs"])}{missing}
## Files

How many times smaller than raw. The smallest file is in bold.
Smaller than ours: {smaller_than_ours(result, "ratio", names)}.
Draco and Corto are made for small files: they must be unpacked as a whole before anything is drawn.
Quantised glTF takes 8 bytes per position; its normals have 3 x 8 bits, or are octahedral with
meshopt compression.

{ratios(result, "ratio", names)}
## On the GPU

How many times smaller than raw the data is that stays in memory while drawing. Ours and the paper's
encoding are drawn from the bytes of the file. Meshopt compression unpacks to quantised glTF. Draco
and Corto unpack to the raw model (1.00), or at best to quantised glTF.
Smaller than ours: {smaller_than_ours(result, "resident_ratio", resident)}.

{ratios(result, "resident_ratio", resident)}
<!-- begin meshlet_formats -->
{meshlet_formats.block(read_result("meshlet_formats"))}<!-- end meshlet_formats -->

<!-- begin transport -->
{transport.block(read_result("transport"))}<!-- end transport -->

## Where our bits go

Bits per triangle, by section of the format. Anchors are vertices where boundaries meet, chains the
boundary vertices between them, interior all others. Headers and tables are those of blobs and of
groups of 32 meshlets, the heads and entries of meshlets, padding, and the extension's JSON.

{section_table(result["models"])}
The same by kind of data:

{attribute_table(result["models"])}
## Bytes

Of the files:

{byte_table(result, "file_bytes", names)}
In memory while drawing:

{byte_table(result, "resident_bytes", names)}
## The models

{bullets({name: text for name, text in described.items() if name in measured})}"""


def write_pictures(result: dict) -> list[Path]:
    """The chart of the peers."""
    return figures.draw_all()
