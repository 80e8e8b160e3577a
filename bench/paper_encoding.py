"""The paper's encoding. `python -m bench paper` measures it; its tests decode it.

A model is cut into meshlets of one edge-connected disk each. Runs of vertices between the same two
meshlets (or one and nothing) are boundaries and stored once, both ends included, so that a corner
is stored by every boundary that meets there. A boundary's ends have absolute positions; every other
vertex of it has the difference from the one before, an interior vertex the difference from its
gate. An element of a difference is written in its low m bits or, with its flag set, in all n; one
m for the model is found by trying all, and m = n writes no flags. Of each such vertex come first
the three flags, then the low blocks, then the high ones. Normals are spherical, texture coordinates
absolute. Triangles are Edgebreaker symbols in fixed codes of 2 bits for C, R, E and 3 for L, S; the
traversal starts at the first edge of the meshlet's first boundary.

The paper leaves open, and we chose: negative differences are interleaved with positive ones (0, -1,
1, -2, ...), so that small ones have leading zeros whatever their sign, which is smaller than two's
complement; an interior vertex is predicted by the end of its gate; positions are on one grid for
the mesh, for relative to each meshlet's box shared vertices would part; and the tables, which are
32-bit words: for each meshlet where its symbols, references and interior vertices start and its
number of triangles, for each reference the boundary and its direction, for each boundary where it
starts. The grids' floats are not part of the file.
"""

from __future__ import annotations

import struct
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from bench.peers import DEFAULT_BITS, Part
from gltf_ext import _codec
from gltf_ext.attributes.records import weld_rows
from gltf_ext.attributes.streams import GRID, INTEGER, Bits
from tools import paper_encoder

SYMBOLS = "CRELS"
# (value, bits), lowest bit first
CODES = {"C": (0, 2), "R": (1, 2), "E": (2, 2), "L": (3, 3), "S": (7, 3)}
# magic, n, m, bits of a normal and of a texture coordinate, parts, bytes of tables
HEADER = struct.Struct("<4s4B2I")
# kinds of attributes, meshlets, references, boundaries, bits before its first bit
PART = struct.Struct("<5I")
MESHLET_WORDS = 4
MAGIC = b"NFR1"
PARTS = (
    "connectivity",
    "meshlets, references, boundaries",
    "boundary ends",
    "boundary inner vertices",
    "interior vertices",
    "header",
)


# --- bits ---


class BitWriter:
    """Collects bit fields, lowest bit first."""

    def __init__(self):
        self._bytes, self._pending, self._count = bytearray(), 0, 0

    def write(self, value: int, width: int) -> None:
        self._pending |= value << self._count
        self._count += width
        if self._count >= 64:
            whole = self._count // 8
            self._bytes += (self._pending & ((1 << 8 * whole) - 1)).to_bytes(whole, "little")
            self._pending >>= 8 * whole
            self._count -= 8 * whole

    @property
    def position(self) -> int:
        return 8 * len(self._bytes) + self._count

    def getvalue(self) -> bytes:
        return bytes(self._bytes) + self._pending.to_bytes((self._count + 7) // 8, "little")


def zigzag(difference: int, bits: int) -> int:
    """A difference modulo 2^bits -> 0, 1, 2, 3, ... for 0, -1, 1, -2, ..."""
    half = 1 << bits - 1
    signed = (difference + half) % (2 * half) - half
    return 2 * signed if signed >= 0 else -2 * signed - 1


def unzigzag(value: int) -> int:
    return value >> 1 ^ -(value & 1)


# --- Edgebreaker ---


def clers(
    triangles: list[tuple[int, int, int]], loop: list[int]
) -> tuple[str, list[tuple[int, int]]]:
    """Edgebreaker symbols of a disk, and (vertex, end of its gate) for each C.

    loop: the border's vertices along its triangles' edges; the traversal starts at the edge loop[0]
    -> loop[1].
    """
    apex = {edge: v for a, b, c in triangles for edge, v in (((a, b), c), ((b, c), a), ((c, a), b))}
    seen = set(loop)
    symbols, interior = [], []
    # Borders of what is left, each from its gate's end b around to its start a.
    rest = [[*loop[1:], loop[0]]]
    while rest:
        border = rest.pop()
        while True:
            a, b = border[-1], border[0]
            v = apex[a, b]
            if v not in seen:
                symbols.append("C")
                interior.append((v, b))
                seen.add(v)
                border.append(v)
            elif len(border) == 3:
                symbols.append("E")
                break
            elif v == border[1]:
                symbols.append("R")
                del border[0]
            elif v == border[-2]:
                symbols.append("L")
                del border[-1]
            else:
                symbols.append("S")
                middle = border.index(v)
                rest.append(border[middle:])
                del border[middle + 1 :]
    return "".join(symbols), interior


# --- meshlets and boundaries ---


@dataclass
class Disk:
    """A meshlet: local triangles, its border in order, and the mesh's index of each local vertex.

    references: (boundary, reversed) along the loop, whose first vertex is the first reference's.
    """

    triangles: list[tuple[int, int, int]]
    loop: list[int]
    vertices: list[int]
    references: list[tuple[int, bool]] = field(default_factory=list)


@dataclass
class Mesh:
    """Input of the encoder: integer positions [V][3], other attributes packed, disks, boundaries.

    attributes: one integer per vertex, of attribute_bits bits; boundaries: indices of vertices,
    ends included.
    """

    positions: list[list[int]]
    attributes: list[int]
    attribute_bits: int
    kinds: int
    disks: list[Disk]
    boundaries: list[list[int]]


def spherical(normals: np.ndarray, bits: int) -> np.ndarray:
    """Directions float[V, 3] -> polar and azimuthal angle, uint32[V, 2] of `bits` bits each."""
    x, y, z = normals.astype(np.float64).T
    polar = np.arctan2(np.hypot(x, y), z) / np.pi * (2**bits - 1)
    azimuth = np.arctan2(y, x) / (2 * np.pi) * 2**bits
    return np.stack([np.rint(polar), np.rint(azimuth) % 2**bits], axis=1).astype(np.uint32)


def quantised(part: Part, bits: Bits) -> tuple[list[_codec.Stream], list[np.ndarray]]:
    """(streams, integers): positions, normals, texture coordinates."""
    arrays = [(GRID, bits.position, np.rint(part.positions))]
    if part.normals is not None:
        arrays.append((INTEGER, bits.normal, spherical(part.normals, bits.normal)))
    if part.texcoords is not None:
        arrays.append((GRID, bits.texcoord, np.rint(part.texcoords)))
    streams = [_codec.Stream(kind, v.shape[1], width, 1.0) for kind, width, v in arrays]
    return streams, [np.ascontiguousarray(values, np.uint32) for _, _, values in arrays]


def mesh_of(part: Part, bits: Bits, fill: float) -> Mesh:
    """A part cut into meshlets as in the paper; fill: 0 for the default of paper_encoder."""
    streams, values = quantised(part, bits)
    mesh = part.triangles, weld_rows(part.positions)[0], part.positions
    blob, _ = paper_encoder.encode(*mesh, streams, values, fill=fill)
    triangles, arrays = _codec.decode(blob)
    packed, width = np.zeros(len(arrays[0]), np.uint64), 0
    for stream, array in zip(streams[1:], arrays[1:]):
        for column in array.T:
            packed |= column.astype(np.uint64) << np.uint64(width)
            width += stream.bits
    kinds = (part.normals is not None) + 2 * (part.texcoords is not None)
    disks = _disks(blob, triangles)
    return Mesh(arrays[0].tolist(), packed.tolist(), width, kinds, disks, _boundaries(disks))


def _disks(blob: bytes, triangles: np.ndarray) -> list[Disk]:
    """All disks of all meshlets of a blob; `triangles` are the blob's, in the same order."""
    decoder = _codec.Decoder(blob)
    disks, begin = [], 0
    for m in range(decoder.meshlet_count):
        local = decoder.decode_meshlet(m)[0]
        whole = triangles[begin : begin + len(local)]
        begin += len(local)
        names = dict(zip(local.ravel().tolist(), whole.ravel().tolist()))
        for disk in _split_disks([tuple(t) for t in local.tolist()]):
            ids = {v: i for i, v in enumerate(dict.fromkeys(v for t in disk for v in t))}
            renamed = [tuple(ids[v] for v in t) for t in disk]
            disks.append(Disk(renamed, _border(renamed), [names[v] for v in ids]))
    return disks


def _split_disks(triangles: list[tuple]) -> list[list[tuple]]:
    """Splits triangles in traversal order into disks: a new disk shares no vertex with the last."""
    disks, seen = [], set()
    for triangle in triangles:
        if seen.isdisjoint(triangle):
            disks.append([])
        disks[-1].append(triangle)
        seen.update(triangle)
    return disks


def _border(triangles: list[tuple]) -> list[int]:
    edges = {edge for a, b, c in triangles for edge in ((a, b), (b, c), (c, a))}
    after = {a: b for a, b in edges if (b, a) not in edges}
    loop = [min(after)]
    while (v := after[loop[-1]]) != loop[0]:
        loop.append(v)
    return loop


def _boundaries(disks: list[Disk]) -> list[list[int]]:
    """Gives every disk its references and rotates its loop to the first; returns the boundaries."""
    mates = _mates(disks)
    starts = _starts(disks, mates)
    boundaries: list[list[int]] = []
    of_edge: dict[tuple[int, int], int] = {}
    for d, disk in enumerate(disks):
        length, ordered = len(disk.loop), sorted(starts[d])
        for start, stop in zip(ordered, [*ordered[1:], ordered[0] + length]):
            mate = mates.get((d, start))
            if mate in of_edge:
                disk.references.append((of_edge[mate], True))
                continue
            disk.references.append((len(boundaries), False))
            of_edge.update({(d, i % length): len(boundaries) for i in range(start, stop)})
            boundaries.append(
                [disk.vertices[disk.loop[i % length]] for i in range(start, stop + 1)]
            )
    for disk, begins in zip(disks, starts):
        disk.loop = disk.loop[min(begins) :] + disk.loop[: min(begins)]
    return boundaries


def _mates(disks: list[Disk]) -> dict[tuple[int, int], tuple[int, int]]:
    """(disk, edge of its loop) -> the same on the edge's other side, where there is exactly one."""
    places: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for d, disk in enumerate(disks):
        around = [disk.vertices[v] for v in disk.loop]
        for i, edge in enumerate(zip(around, around[1:] + around[:1])):
            places.setdefault(edge, []).append((d, i))
    return {
        here[0]: there[0]
        for (a, b), here in places.items()
        if len(here) == 1 and len(there := places.get((b, a), ())) == 1
    }


def _starts(disks: list[Disk], mates: dict) -> list[set[int]]:
    """Per disk: the places in its loop where a boundary starts.

    Two edges belong to one boundary when their mates follow each other, backwards, in one loop and
    are not these edges, or when neither has a mate. A loop of one boundary starts anywhere, and the
    loop around it at the same vertex.
    """
    starts: list[set[int]] = [set() for _ in disks]
    for d, disk in enumerate(disks):
        length = len(disk.loop)
        for i in range(length):
            before, after = mates.get((d, i - 1 if i else length - 1)), mates.get((d, i))
            if before is None and after is None:
                continue
            is_start = before is None or after is None or before == (d, i)
            if not is_start:
                other, place = before
                is_start = after != (other, (place or len(disks[other].loop)) - 1)
            if is_start:
                starts[d].add(i)
    for d in range(len(disks)):
        if not starts[d]:
            starts[d].add(0)
            if mate := mates.get((d, 0)):
                starts[mate[0]].add((mate[1] + 1) % len(disks[mate[0]].loop))
    return starts


# --- encoding ---


@dataclass
class Encoded:
    """A model in the paper's encoding.

    data: the file; bits: of each of PARTS, their sum is 8 * len(data); counts: meshlets,
    references, boundaries, and vertices by how they are stored (ends, inner of boundaries,
    interior); symbols: how many of each; m: the width of short differences; difference_bits: what
    all differences take, flags included.
    """

    data: bytes
    bits: dict[str, int]
    counts: dict[str, int]
    symbols: dict[str, int]
    m: int
    difference_bits: int


class _Traversed:
    """A mesh's symbols per disk, and (vertex, difference) per disk and per boundary."""

    def __init__(self, mesh: Mesh, n: int):
        def difference(v: int, before: int) -> tuple[int, list[int]]:
            return v, [zigzag(x - y, n) for x, y in zip(mesh.positions[v], mesh.positions[before])]

        self.symbols, added = zip(*(clers(disk.triangles, disk.loop) for disk in mesh.disks))
        self.interior = [
            [difference(disk.vertices[v], disk.vertices[b]) for v, b in of]
            for disk, of in zip(mesh.disks, added)
        ]
        self.inner = [[difference(v, u) for u, v in pairwise(run[:-1])] for run in mesh.boundaries]


def encode(parts: list[Part], bits: Bits = DEFAULT_BITS, fill: float = 0.0) -> Encoded:
    """A model in the paper's encoding, with one m for all its parts; fill: see `mesh_of`."""
    return encode_meshes([mesh_of(part, bits, fill) for part in parts], bits)


def encode_meshes(meshes: list[Mesh], bits: Bits) -> Encoded:
    n = bits.position
    traversed = [_Traversed(mesh, n) for mesh in meshes]
    lengths = Counter(
        u.bit_length()
        for t in traversed
        for run in (*t.interior, *t.inner)
        for _, d in run
        for u in d
    )
    m = best_m(lengths, n)
    stream, tables, spent, counts, symbols = BitWriter(), b"", Counter(), Counter(), Counter()
    for mesh, t in zip(meshes, traversed):
        references, boundaries = sum(len(d.references) for d in mesh.disks), len(mesh.boundaries)
        tables += PART.pack(mesh.kinds, len(mesh.disks), references, boundaries, stream.position)
        words = _write_part(stream, mesh, t, n, m, spent)
        tables += np.array(words, "<u4").tobytes()
        spent["meshlets, references, boundaries"] += 32 * len(words)
        counts.update(
            triangles=sum(map(len, t.symbols)),
            meshlets=len(mesh.disks),
            references=references,
            boundaries=boundaries,
            ends=2 * boundaries,
            inner=sum(map(len, t.inner)),
            interior=sum(map(len, t.interior)),
            vertices=len(mesh.positions),
        )
        symbols.update("".join(t.symbols))
    header = HEADER.pack(MAGIC, n, m, bits.normal, bits.texcoord, len(meshes), len(tables))
    data = header + tables + stream.getvalue()
    spent["header"] = 8 * len(data) - sum(spent.values())
    bits_of = {part: spent[part] for part in PARTS}
    symbol_counts = {s: symbols[s] for s in SYMBOLS}
    return Encoded(data, bits_of, dict(counts), symbol_counts, m, difference_bits(lengths, n, m))


def best_m(lengths: Counter, n: int) -> int:
    """The width with the fewest bits, the largest of equals; lengths as in `difference_bits`."""
    return min(range(1, n + 1), key=lambda m: (difference_bits(lengths, n, m), -m))


def difference_bits(lengths: Counter, n: int, m: int) -> int:
    """Bits of all differences; lengths: the number of elements by the bits of their values."""
    if m == n:
        return n * lengths.total()
    return sum(count * (1 + (m if length <= m else n)) for length, count in lengths.items())


def _write_part(
    stream: BitWriter, mesh: Mesh, t: _Traversed, n: int, m: int, spent: Counter
) -> list[int]:
    """Writes a part's bits, adds them up by PARTS, and returns the words of its tables."""
    origin = stream.position

    def end(v: int) -> None:
        for x in mesh.positions[v]:
            stream.write(x, n)
        stream.write(mesh.attributes[v], mesh.attribute_bits)

    def differences(run: list[tuple[int, list[int]]]) -> None:
        for v, difference in run:
            write_difference(stream, difference, n, m)
            stream.write(mesh.attributes[v], mesh.attribute_bits)

    @contextmanager
    def counted(part: str):
        before = stream.position
        yield before - origin
        spent[part] += stream.position - before

    boundary_words, meshlet_words, first_reference = [], [], 0
    for run, inner in zip(mesh.boundaries, t.inner):
        with counted("boundary ends") as start:
            boundary_words.append(start)
            end(run[0])
            end(run[-1])
        with counted("boundary inner vertices"):
            differences(inner)
    boundary_words.append(stream.position - origin)
    for disk, symbols, interior in zip(mesh.disks, t.symbols, t.interior):
        with counted("connectivity") as symbols_start:
            for symbol in symbols:
                stream.write(*CODES[symbol])
        with counted("interior vertices") as interior_start:
            differences(interior)
        meshlet_words += [symbols_start, interior_start, first_reference, len(symbols)]
        first_reference += len(disk.references)
    references = [
        2 * boundary + backwards for disk in mesh.disks for boundary, backwards in disk.references
    ]
    return [*meshlet_words, *references, *boundary_words]


def write_difference(stream: BitWriter, difference: list[int], n: int, m: int) -> None:
    """Writes all flags, all low blocks, then the needed high blocks; only values if m = n."""
    if m < n:
        for u in difference:
            stream.write(u >> m != 0, 1)
    for u in difference:
        stream.write(u & (1 << m) - 1, m)
    for u in difference:
        if u >> m:
            stream.write(u >> m, n - m)
