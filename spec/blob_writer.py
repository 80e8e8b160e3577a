"""Writes blobs of EXT_meshlet_edgebreaker field by field, without a mesh: for tests of decoders.

It checks nothing, so that a test can write hostile blobs. `random_blob` makes valid blobs with
random contents, which all decoders must decode to the same integers.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

OWNED, FOREIGN, PRIVATE = "owned", "foreign", "private"
GRID, OCT, INTEGER, FLOAT32, SIGN = range(5)
PARALLELOGRAM, MEAN, COPY, DAMPED = range(4)
SYMBOL_CODES = {"R": 0, "E": 1, "C": 2, "L": 3, "S": 3}
Chain = tuple[int, int, int]  # an owned reference: owner, slot, length
Code = int | list[int]  # a Rice code 0 to 6, or fixed widths


@dataclass
class Stream:
    """An entry of the stream table."""

    kind: int = GRID
    elements: int = 3
    bits: int = 12
    predictor: int = PARALLELOGRAM
    chain_base: int = 0
    interior_base: int = 0
    step: float = 1.0
    offset: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def pack(self) -> bytes:
        return struct.pack(
            "<6BH5f",
            self.kind,
            self.elements,
            self.bits,
            self.predictor,
            self.chain_base,
            self.interior_base,
            0,
            self.step,
            *self.offset,
        )


@dataclass
class Reference:
    """A reference. share: share bits of streams 1 and up; empty if all are shared."""

    kind: str
    length: int
    delta: int = 0
    slot: int = 0
    share: tuple[bool, ...] = ()

    def own(self, s: int) -> bool:
        """True if the meshlet itself stores the run's values of stream s."""
        return self.kind != FOREIGN or (s > 0 and bool(self.share) and not self.share[s - 1])


@dataclass
class Meshlet:
    """The contents of sections A to H; lists are per stream.

    loops: references per loop; empty if R = 0
    anchors: the first one as it is, the others as zigzag differences
    chain_codes, interior_codes: a Rice code 0 to 6, or a list of fixed widths
    chain, interior: unsigned residuals, [vertex][element]
    """

    symbols: str
    loops: list[list[Reference]] = field(default_factory=list)
    anchors: list[list[list[int]]] = field(default_factory=list)
    anchor_widths: list[int] = field(default_factory=list)
    chain_codes: list[Code] = field(default_factory=list)
    chain: list[list[list[int]]] = field(default_factory=list)
    interior_codes: list[Code] = field(default_factory=list)
    interior: list[list[list[int]]] = field(default_factory=list)

    @property
    def references(self) -> list[Reference]:
        return [reference for loop in self.loops for reference in loop]


class BitWriter:
    """Collects bit fields, least significant bit first."""

    def __init__(self) -> None:
        self.bits = 0
        self.count = 0

    def put(self, value: int, width: int) -> None:
        self.bits |= (value & ((1 << width) - 1)) << self.count
        self.count += width

    def put_flags(self, flags: Iterable[bool | int]) -> None:
        for flag in flags:
            self.put(int(flag), 1)

    def put_width(self, width: int) -> None:
        self.put(31 if width == 32 else width, 5)

    def to_bytes(self) -> bytes:
        return self.bits.to_bytes((self.count + 7) // 8, "little")


def _put_code(writer: BitWriter, code: Code) -> None:
    if isinstance(code, int):
        writer.put(code, 3)
        return
    writer.put(7, 3)
    for width in code:
        writer.put_width(width)


def _put_residuals(
    writer: BitWriter,
    streams: list[Stream],
    codes: list[Code],
    bases: list[int],
    residuals: list[list[list[int]]],
) -> None:
    """All low bits, then all quotients."""
    for stream, code, base, vertices in zip(streams, codes, bases, residuals):
        widths = [base + code] * stream.elements if isinstance(code, int) else code
        for vertex in vertices:
            for u, width in zip(vertex, widths):
                writer.put(u, width)
    for code, base, vertices in zip(codes, bases, residuals):
        if isinstance(code, int):
            for vertex in vertices:
                for u in vertex:
                    writer.put(1 << (u >> base + code), (u >> base + code) + 1)


def meshlet_bytes(
    streams: list[Stream], meshlet: Meshlet, delta_width: int, slot_width: int
) -> bytes:
    """Sections A to H."""
    writer = BitWriter()
    codes = [SYMBOL_CODES[symbol] for symbol in meshlet.symbols]
    writer.put_flags(code & 1 for code in codes)
    writer.put_flags(code >> 1 for code in codes)
    writer.put_flags(symbol == "S" for symbol in meshlet.symbols if symbol in "LS")
    references = meshlet.references
    if references:
        seams = has_seams(meshlet)
        writer.put_flags(r.kind == FOREIGN for r in references)
        if len(meshlet.loops) > 1:
            writer.put_flags(r is loop[-1] for loop in meshlet.loops for r in loop)
        if has_private(meshlet):
            writer.put_flags(r.kind == PRIVATE for r in references)
        lengths = [
            r.length - 1
            for loop in meshlet.loops
            for r in loop
            if r.kind == OWNED or (r.kind == PRIVATE and len(loop) > 1)
        ]
        length_width = max(lengths, default=0).bit_length()
        writer.put(length_width, 3)
        for length in lengths:
            writer.put(length, length_width)
        for r in references:
            if r.kind == FOREIGN:
                writer.put(r.delta, delta_width)
                writer.put(r.slot, slot_width)
                if seams:
                    writer.put_flags(r.share or [True] * (len(streams) - 1))
    owns = any(r.kind == OWNED for r in references)
    for s in range(len(streams)):
        if owns:
            _put_code(writer, meshlet.chain_codes[s])
        _put_code(writer, meshlet.interior_codes[s])
    for s, stream in enumerate(streams):
        for n, anchor in enumerate(meshlet.anchors[s]):
            if n == 1:
                writer.put_width(meshlet.anchor_widths[s])
            for value in anchor:
                writer.put(value, stream.bits if n == 0 else meshlet.anchor_widths[s])
    if owns:
        _put_residuals(
            writer,
            streams,
            meshlet.chain_codes,
            [stream.chain_base for stream in streams],
            meshlet.chain,
        )
    _put_residuals(
        writer,
        streams,
        meshlet.interior_codes,
        [stream.interior_base for stream in streams],
        meshlet.interior,
    )
    return writer.to_bytes()


def has_private(meshlet: Meshlet) -> bool:
    return any(r.kind == PRIVATE for r in meshlet.references)


def has_seams(meshlet: Meshlet) -> bool:
    return any(r.share and not all(r.share) for r in meshlet.references)


def write_blob(
    streams: list[Stream],
    meshlets: list[Meshlet],
    vertex_count: int,
    delta_width: int = 6,
    slot_width: int = 6,
) -> bytes:
    """A whole blob."""
    data = b""
    directory = []
    bases = []
    for m, meshlet in enumerate(meshlets):
        if m % 32 == 0:
            bases.append(len(data))
        references = len(meshlet.references)
        directory.append(
            len(data) - bases[-1]
            | len(meshlet.symbols) - 1 << 17
            | references << 23
            | (references > 0 and len(meshlet.loops) > 1) << 29
            | has_private(meshlet) << 30
            | has_seams(meshlet) << 31
        )
        data += meshlet_bytes(streams, meshlet, delta_width, slot_width)
    tables = b"".join(stream.pack() for stream in streams)
    tables += b"".join(struct.pack("<I4B", base, delta_width, slot_width, 0, 0) for base in bases)
    tables += struct.pack(f"<{len(directory)}I", *directory)
    data += bytes(-len(data) % 4 + 8)
    triangle_count = sum(len(meshlet.symbols) for meshlet in meshlets)
    data_offset = 32 + len(tables)
    header = struct.pack(
        "<I4B6I",
        0x314D4245,
        1,
        len(streams),
        0,
        0,
        triangle_count,
        vertex_count,
        len(meshlets),
        data_offset + len(data),
        data_offset,
        0,
    )
    return header + tables + data


# --- random blobs ---


def net_growth(symbols: str) -> int:
    """The number of boundary edges of a disk, without the root gate."""
    return sum({"E": 2, "R": 1, "L": 1, "C": -1, "S": 0}[symbol] for symbol in symbols)


def random_disk(rng: random.Random, triangle_count: int, smallest_loop: int = 3) -> str:
    """Random CLERS symbols of a disk; all parts have at least `smallest_loop` boundary vertices."""
    if triangle_count == 1:
        return "E"
    if triangle_count > 2 and rng.random() < 0.25:
        right = rng.randint(1, triangle_count - 2)
        return (
            "S"
            + random_disk(rng, right, smallest_loop)
            + random_disk(rng, triangle_count - 1 - right, smallest_loop)
        )
    rest = random_disk(rng, triangle_count - 1, smallest_loop)
    if net_growth(rest) - 1 >= smallest_loop - 1 and rng.random() < 0.7:
        return "C" + rest
    return rng.choice("RL") + rest


def random_disks(rng: random.Random, smallest_loop: int = 3) -> list[str]:
    """Random disks that fit into one meshlet together."""
    while True:
        sizes = (
            [rng.randint(1, 64)]
            if rng.random() < 0.6
            else [rng.randint(1, 12) for _ in range(rng.randint(1, 5))]
        )
        disks = [random_disk(rng, size, smallest_loop) for size in sizes]
        symbols = "".join(disks)
        vertex_count = len(disks) + symbols.count("R") + 2 * symbols.count("E") + symbols.count("L")
        if len(symbols) <= 64 and vertex_count <= 64:
            return disks


def random_streams(rng: random.Random) -> list[Stream]:
    """One to five streams of random kinds; the first is a grid."""
    streams = [Stream(bits=rng.randint(4, 24), predictor=rng.randint(0, 3))]
    for _ in range(rng.randint(0, 4)):
        kind = rng.randint(0, 4)
        elements = {OCT: 2, SIGN: 1}.get(kind, rng.randint(1, 4))
        bits = {
            GRID: rng.randint(1, 24),
            OCT: rng.randint(2, 16),
            INTEGER: rng.randint(1, 32),
            FLOAT32: 32,
            SIGN: 1,
        }[kind]
        predictor = rng.randint(0, 3) if bits <= 24 else COPY
        streams.append(
            Stream(kind, elements, bits, predictor, rng.randint(0, 25), rng.randint(0, 25))
        )
    return streams


def _random_loop(
    rng: random.Random,
    length: int,
    m: int,
    slots: int,
    stream_count: int,
    chains: list[Chain],
) -> list[Reference]:
    """Splits a loop of `length` edges of meshlet m into random references.

    slots: owned references of the meshlet so far; chains: those of all meshlets, which grow.
    """
    loop = []
    while length:
        same_meshlet = rng.random() < 0.05  # with more, most corners would take over eight hops
        fitting = [
            chain
            for chain in chains
            if chain[2] <= length and m - chain[0] < 64 and (chain[0] == m) == same_meshlet
        ]
        if fitting and rng.random() < 0.5:
            owner, slot, run = rng.choice(fitting)
            share = (
                tuple(rng.random() < 0.7 for _ in range(stream_count - 1))
                if rng.random() < 0.5
                else ()
            )
            loop.append(Reference(FOREIGN, run, m - owner, slot, share))
        else:
            run = length if rng.random() < 0.2 else rng.randint(1, min(length, 12))
            kind = rng.choice((OWNED, OWNED, PRIVATE))
            loop.append(Reference(kind, run))
            if kind == OWNED:
                chains.append((m, slots, run))
                slots += 1
        length -= run
    return loop


def _random_residuals(
    rng: random.Random, stream: Stream, base: int, count: int
) -> tuple[Code, list[list[int]]]:
    """(code, residuals) of `count` vertices."""
    if rng.random() < 0.5:
        code = rng.randint(0, 6)
        return code, [
            [
                rng.getrandbits(rng.randint(0, min(32, base + code + 4)))
                for _ in range(stream.elements)
            ]
            for _ in range(count)
        ]
    widths = [rng.choice([*range(20), 32]) for _ in range(stream.elements)]
    return widths, [[rng.getrandbits(width) for width in widths] for _ in range(count)]


def random_meshlet(
    rng: random.Random, m: int, streams: list[Stream], chains: list[Chain]
) -> Meshlet:
    """A valid meshlet m without anchors. It refers to `chains` and adds its own."""
    disks = random_disks(rng)
    meshlet = Meshlet("".join(disks))
    loop_lengths = [net_growth(disk) + 1 for disk in disks]
    if rng.random() < 0.9:
        before = list(chains)
        for length in loop_lengths:
            slots = sum(r.kind == OWNED for r in meshlet.references)
            meshlet.loops.append(_random_loop(rng, length, m, slots, len(streams), chains))
        if len(meshlet.references) > 63:
            meshlet.loops = []
            chains[:] = before
    loops = meshlet.loops or [[Reference(PRIVATE, length)] for length in loop_lengths]
    references = [r for loop in loops for r in loop]
    vertex_count = sum(
        disk.count("R") + 2 * disk.count("E") + disk.count("L") + 1 for disk in disks
    )
    inner = {
        kind: sum(r.length - 1 for r in references if r.kind == kind) for kind in (OWNED, PRIVATE)
    }
    for s, stream in enumerate(streams):
        seams = sum(r.length - 1 for r in references if r.kind == FOREIGN and r.own(s))
        traversed = vertex_count - sum(loop_lengths) + inner[PRIVATE]
        for codes, residuals, base, n in (
            (meshlet.chain_codes, meshlet.chain, stream.chain_base, inner[OWNED]),
            (meshlet.interior_codes, meshlet.interior, stream.interior_base, seams + traversed),
        ):
            code, values = _random_residuals(rng, stream, base, n)
            codes.append(code)
            residuals.append(values)
    return meshlet


class Corner(NamedTuple):
    """Corner j: the references that end and start there, and whether they own a stream's values.

    With R = 0 each loop is one private reference.
    """

    before: int
    j: int
    own_before: Callable[[int], bool]
    own: Callable[[int], bool]


def corners(meshlet: Meshlet) -> Iterator[Corner]:
    """The corners of a meshlet in order."""
    loops = meshlet.loops or [
        [Reference(PRIVATE, 1)]
        for _ in range(meshlet.symbols.count("E") - meshlet.symbols.count("S"))
    ]
    first = 0
    for loop in loops:
        for i in range(len(loop)):
            yield Corner(first + (i - 1) % len(loop), first + i, loop[i - 1].own, loop[i].own)
        first += len(loop)


def shared_corners(meshlets: list[Meshlet], s: int) -> dict[tuple[int, int], tuple[int, int]]:
    """(meshlet, corner) -> a representative of all corners with the same value in stream s."""
    parent = {
        (m, j): (m, j) for m, meshlet in enumerate(meshlets) for _, j, _, _ in corners(meshlet)
    }

    def find(corner: tuple[int, int]) -> tuple[int, int]:
        while parent[corner] != corner:
            corner = parent[corner]
        return corner

    after = [{before: j for before, j, _, _ in corners(meshlet)} for meshlet in meshlets]
    for m, meshlet in enumerate(meshlets):
        for j, r in enumerate(meshlet.references):
            if not r.own(s):
                owner = m - r.delta
                k = [
                    i for i, other in enumerate(meshlets[owner].references) if other.kind == OWNED
                ][r.slot]
                parent[find((m, j))] = find((owner, after[owner][k]))
                parent[find((m, after[m][j]))] = find((owner, k))
    return {corner: find(corner) for corner in parent}


def _set_random_anchors(rng: random.Random, streams: list[Stream], meshlets: list[Meshlet]) -> None:
    """Random corner values, equal wherever meshlets share them."""
    for s, stream in enumerate(streams):
        names = shared_corners(meshlets, s)
        near = rng.getrandbits(stream.bits)
        spread = rng.randint(0, stream.bits)
        values = {
            name: [
                (near + rng.getrandbits(spread)) % (1 << stream.bits)
                for _ in range(stream.elements)
            ]
            for name in set(names.values())
        }
        half = 1 << stream.bits - 1
        for m, meshlet in enumerate(meshlets):
            anchors = [
                values[names[m, j]]
                for _, j, own_before, own in corners(meshlet)
                if own_before(s) and own(s)
            ]
            differences = [
                [(v - f + half) % (2 * half) - half for v, f in zip(anchor, anchors[0])]
                for anchor in anchors
            ]
            zigzag = [
                [2 * d if d >= 0 else -2 * d - 1 for d in difference] for difference in differences
            ]
            width = max((u for anchor in zigzag for u in anchor), default=0).bit_length()
            meshlet.anchor_widths.append(width if width < 31 else 32)
            meshlet.anchors.append(anchors[:1] + zigzag[1:])


def random_blob(rng: random.Random, meshlet_count: int, vertex_count: int = 3) -> bytes:
    """A random blob, valid except for corners with too many hops and the vertex count.

    The number of vertices follows only from decoding; the header gets `vertex_count`.
    """
    streams = random_streams(rng)
    chains: list[Chain] = []
    meshlets = [random_meshlet(rng, m, streams, chains) for m in range(meshlet_count)]
    _set_random_anchors(rng, streams, meshlets)
    return write_blob(streams, meshlets, vertex_count)
