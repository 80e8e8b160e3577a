"""Writes blobs of EXT_meshlet_edgebreaker field by field, without a mesh: for tests of decoders.

It checks nothing, so that a test can write hostile blobs. `random_blob` makes valid blobs with
random contents, which all decoders must decode to the same integers.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

OWNED, FOREIGN, PRIVATE = "owned", "foreign", "private"
GRID, OCT, INTEGER, FLOAT32, SIGN = range(5)
PARALLELOGRAM, MEAN, COPY, DAMPED, GEO, AFFINE = range(6)
VERSION = 2
MESHLETS_PER_GROUP = 32
Chain = tuple[int, int, int]  # an owned reference: owner, slot, length
Code = int | list[int]  # a code 0 to 6 (Rice or exp-Golomb), or fixed widths
ANCHOR_WIDTH_FULL = 7


@dataclass
class Stream:
    """An entry of the stream table."""

    kind: int = GRID
    elements: int = 3
    bits: int = 12
    predictor: int = PARALLELOGRAM
    chain_base: int = 0
    interior_base: int = 0
    anchor_base: int = 0
    step: float = 1.0
    offset: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def pack(self) -> bytes:
        return struct.pack(
            "<8B5f",
            self.kind,
            self.elements,
            self.bits,
            self.predictor,
            self.chain_base,
            self.interior_base,
            self.anchor_base,
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
    """The contents of a meshlet; lists are per stream.

    loops: references per loop; empty if refs = 0
    anchors: the first one as it is, the others as zigzag differences to the first
    anchor_widths: the width field 0 to 7 of each element; empty for the least that fit
    chain_codes, interior_codes: a code 0 to 6, or a list of fixed widths
    chain, interior: unsigned residuals, [vertex][element]
    """

    symbols: str
    loops: list[list[Reference]] = field(default_factory=list)
    anchors: list[list[list[int]]] = field(default_factory=list)
    chain_codes: list[Code] = field(default_factory=list)
    chain: list[list[list[int]]] = field(default_factory=list)
    interior_codes: list[Code] = field(default_factory=list)
    interior: list[list[list[int]]] = field(default_factory=list)
    anchor_widths: list[list[int]] = field(default_factory=list)

    @property
    def references(self) -> list[Reference]:
        return [reference for loop in self.loops for reference in loop]


@dataclass
class Layout:
    """How write_blob lays out a group of meshlets.

    loops, private, seams: whether meshlets have these flags; None: if one needs them
    stride: None for the mean size; second_table: the table of the symbols
    before, gap, after: unused bytes before the group's entries, between them and its first meshlet,
      and after each meshlet's data
    """

    delta_width: int = 6
    slot_width: int = 6
    reference_width: int = 6
    loops: bool | None = None
    private: bool | None = None
    seams: bool | None = None
    second_table: bool = False
    stride: int | None = None
    extra_entry_width: int = 0
    before: bytes = b""
    gap: bytes = b""
    after: bytes = b""

    def complete(self, meshlets: list[Meshlet]) -> Layout:
        """Sets the flags that are None."""

        def needed(flag: bool | None, has: Callable[[Meshlet], bool]) -> bool:
            return any(map(has, meshlets)) if flag is None else flag

        return replace(
            self,
            loops=needed(self.loops, has_loops),
            private=needed(self.private, has_private),
            seams=needed(self.seams, has_seams),
        )


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


def exp_golomb(u: int, k: int) -> tuple[int, int]:
    """(quotient, low bits) of u; the low part has k + quotient bits."""
    x = u + (1 << k)
    q = x.bit_length() - 1 - k
    return q, x & ((1 << (k + q)) - 1)


@dataclass
class _ResidualList:
    """Residuals of one stream in one code. exponential and k mean nothing with widths."""

    residuals: list[list[int]]
    k: int = 0
    exponential: bool = False
    widths: list[int] | None = None

    @classmethod
    def of_chain(cls, residuals: list[list[int]], code: Code, base: int) -> _ResidualList:
        if not isinstance(code, int):
            return cls(residuals, widths=code)
        return cls(residuals, base + code)

    @classmethod
    def of_interior(cls, residuals: list[list[int]], code: Code, base: int) -> _ResidualList:
        if isinstance(code, int) and code >= 4:
            return cls(residuals, max(base, 1) - 1 + code - 4, True)
        return cls.of_chain(residuals, code, base)

    def put_unary(self, writer: BitWriter) -> None:
        if self.widths is None:
            for u in (u for vertex in self.residuals for u in vertex):
                q = exp_golomb(u, self.k)[0] if self.exponential else u >> self.k
                writer.put(1 << q, q + 1)

    def put_low(self, writer: BitWriter) -> None:
        for vertex in self.residuals:
            for c, u in enumerate(vertex):
                if self.widths is not None:
                    writer.put(u, self.widths[c])
                elif self.exponential:
                    q, low = exp_golomb(u, self.k)
                    writer.put(low, self.k + q)
                else:
                    writer.put(u, self.k)


def put_symbols(writer: BitWriter, symbols: str, second_table: bool) -> None:
    """Section Symbols."""
    rest = symbols[:-1]
    for symbol in "RLCE" if second_table else "RCEL":
        writer.put_flags(other != symbol for other in rest)
        rest = rest.replace(symbol, "")


def meshlet_bytes(streams: list[Stream], meshlet: Meshlet, layout: Layout) -> bytes:
    """The data of a meshlet. The layout is complete."""
    writer = BitWriter()
    writer.put(len(meshlet.symbols) - 1, 6)
    writer.put(len(meshlet.references), layout.reference_width)
    for group_flag, has in (
        (layout.loops, has_loops),
        (layout.private, has_private),
        (layout.seams, has_seams),
    ):
        if group_flag:
            writer.put(has(meshlet), 1)
    put_symbols(writer, meshlet.symbols, layout.second_table)
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
                writer.put(r.delta, layout.delta_width)
                writer.put(r.slot, layout.slot_width)
                if seams:
                    writer.put_flags(r.share or [True] * (len(streams) - 1))
    owns = any(r.kind == OWNED for r in references)
    for s in range(len(streams)):
        if owns:
            _put_code(writer, meshlet.chain_codes[s])
        _put_code(writer, meshlet.interior_codes[s])
    for s, stream in enumerate(streams):
        _put_anchors(writer, stream, meshlet, s)
    if owns:
        _put_chains(writer, streams, meshlet)
    _put_interior(writer, streams, meshlet)
    return writer.to_bytes()


def anchor_width(stream: Stream, width_field: int) -> int:
    """The width in bits of an element of further anchors."""
    if width_field == ANCHOR_WIDTH_FULL:
        return stream.bits
    return min(stream.anchor_base + width_field, stream.bits)


def further_anchors(stream: Stream, values: list[list[int]]) -> list[list[int]]:
    """The zigzag differences of all values but the first to the first."""
    half = 1 << stream.bits - 1

    def zigzag(difference: int) -> int:
        d = (difference + half) % (2 * half) - half
        return 2 * d if d >= 0 else -2 * d - 1

    return [[zigzag(x - first) for x, first in zip(value, values[0])] for value in values[1:]]


def _anchor_field(stream: Stream, values: list[int]) -> int:
    """The least width field for the given elements; full if none is large enough."""
    longest = max(values).bit_length()
    return next((f for f in range(7) if anchor_width(stream, f) >= longest), ANCHOR_WIDTH_FULL)


def _put_anchors(writer: BitWriter, stream: Stream, meshlet: Meshlet, s: int) -> None:
    for value in (value for anchor in meshlet.anchors[s][:1] for value in anchor):
        writer.put(value, stream.bits)
    further = meshlet.anchors[s][1:]
    if not further:
        return
    fields = [_anchor_field(stream, list(values)) for values in zip(*further)]
    if meshlet.anchor_widths:
        fields = meshlet.anchor_widths[s]
    for width_field in fields:
        writer.put(width_field, 3)
    for anchor in further:
        for u, width_field in zip(anchor, fields):
            writer.put(u, anchor_width(stream, width_field))


def _put_chains(writer: BitWriter, streams: list[Stream], meshlet: Meshlet) -> None:
    lists = [
        _ResidualList.of_chain(residuals, code, stream.chain_base)
        for residuals, code, stream in zip(meshlet.chain, meshlet.chain_codes, streams)
    ]
    for residuals in lists:
        residuals.put_low(writer)
    for residuals in lists:
        residuals.put_unary(writer)


def _put_interior(writer: BitWriter, streams: list[Stream], meshlet: Meshlet) -> None:
    """Stream 0, then all others together."""
    lists = [
        _ResidualList.of_interior(residuals, code, stream.interior_base)
        for residuals, code, stream in zip(meshlet.interior, meshlet.interior_codes, streams)
    ]
    for part in (lists[:1], lists[1:]):
        for residuals in part:
            residuals.put_unary(writer)
        for residuals in part:
            residuals.put_low(writer)


def has_loops(meshlet: Meshlet) -> bool:
    return len(meshlet.loops) > 1


def has_private(meshlet: Meshlet) -> bool:
    return any(r.kind == PRIVATE for r in meshlet.references)


def has_seams(meshlet: Meshlet) -> bool:
    return any(r.share and not all(r.share) for r in meshlet.references)


def group_bytes(
    streams: list[Stream], meshlets: list[Meshlet], layout: Layout, at: int
) -> tuple[bytes, bytes]:
    """(entry of the group table, data) of a group whose data start at byte `at` of the blob."""
    layout = layout.complete(meshlets)
    sections = [meshlet_bytes(streams, meshlet, layout) + layout.after for meshlet in meshlets]
    starts = [len(layout.gap) + sum(map(len, sections[:i])) for i in range(len(sections))]
    stride = layout.stride
    if stride is None:
        stride = sum(map(len, sections)) // len(sections)
    deviations = [start - stride * i for i, start in enumerate(starts)]
    bias = max(0, -min(deviations))
    width = max(deviation + bias for deviation in deviations).bit_length()
    width += layout.extra_entry_width
    writer = BitWriter()
    for deviation in deviations:
        writer.put(deviation + bias, width)
    word = width | layout.delta_width << 5 | layout.slot_width << 10
    word |= layout.reference_width << 13 | bool(layout.loops) << 16 | bool(layout.private) << 17
    word |= bool(layout.seams) << 18 | layout.second_table << 19
    table = struct.pack("<IHHI", at + len(layout.before), stride, bias, word)
    return table, layout.before + writer.to_bytes() + layout.gap + b"".join(sections)


def write_blob(
    streams: list[Stream],
    meshlets: list[Meshlet],
    vertex_count: int,
    layout: Layout | Callable[[int], Layout] | None = None,
) -> bytes:
    """A whole blob. layout: of all groups, or a function of a group's number."""
    groups = [
        meshlets[m : m + MESHLETS_PER_GROUP] for m in range(0, len(meshlets), MESHLETS_PER_GROUP)
    ]
    tables = b"".join(stream.pack() for stream in streams)
    data_offset = 32 + len(tables) + 12 * len(groups)
    data = b""
    for g, group in enumerate(groups):
        of_group = layout(g) if callable(layout) else layout or Layout()
        entry, of_meshlets = group_bytes(streams, group, of_group, data_offset + len(data))
        tables += entry
        data += of_meshlets
    data += bytes(-(data_offset + len(data)) % 4 + 8)
    triangle_count = sum(len(meshlet.symbols) for meshlet in meshlets)
    header = struct.pack(
        "<I4B6I",
        0x314D4245,
        VERSION,
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


def random_bits(rng: random.Random, kind: int) -> int:
    """Bits that a stream of this kind may have."""
    return {
        GRID: rng.randint(1, 24),
        OCT: rng.randint(2, 16),
        INTEGER: rng.randint(1, 32),
        FLOAT32: 32,
        SIGN: 1,
    }[kind]


def random_streams(rng: random.Random) -> list[Stream]:
    """One to five streams of random kinds and predictors; the first is a grid of positions."""
    streams = [
        Stream(
            bits=rng.randint(4, 24),
            predictor=rng.randint(PARALLELOGRAM, DAMPED),
            anchor_base=rng.randint(0, 31),
        )
    ]
    for _ in range(rng.randint(0, 4)):
        kind = rng.randint(0, 4)
        elements = {OCT: 2, SIGN: 1}.get(kind, rng.randint(1, 4))
        bits = random_bits(rng, kind)
        choices = [PARALLELOGRAM, MEAN, COPY, DAMPED]
        if kind == OCT:
            choices += [GEO] * 4
        elif kind != SIGN:
            choices += [AFFINE] * 4
        predictor = rng.choice(choices) if bits <= 24 else COPY
        chain_base, interior_base = rng.randint(0, 25), rng.randint(0, 25)
        anchor_base = rng.randint(0, 31)
        streams.append(
            Stream(kind, elements, bits, predictor, chain_base, interior_base, anchor_base)
        )
    return streams


def random_layout(rng: random.Random) -> Layout:
    """A random layout that fits every meshlet."""

    def flag() -> bool | None:
        return True if rng.random() < 0.3 else None

    return Layout(
        loops=flag(),
        private=flag(),
        seams=flag(),
        second_table=rng.random() < 0.5,
        stride=rng.randint(0, 60) if rng.random() < 0.2 else None,
        extra_entry_width=rng.choice([0, 0, 0, 1, 5]),
        before=rng.randbytes(rng.choice([0, 0, 0, 1, 6])),
        after=rng.randbytes(rng.choice([0, 0, 0, 1, 2])),
    )


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
    rng: random.Random, stream: Stream, base: int, rice: int, count: int
) -> tuple[Code, list[list[int]]]:
    """(code, residuals) of `count` vertices. rice: the number of Rice codes."""
    if rng.random() < 0.6:
        code = rng.randint(0, 6)
        longest = min(32, base + code + 4) if code < rice else 31

        def residual() -> int:
            return rng.getrandbits(rng.randint(0, longest))

        return code, [[residual() for _ in range(stream.elements)] for _ in range(count)]
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
        for codes, residuals, base, rice, n in (
            (meshlet.chain_codes, meshlet.chain, stream.chain_base, 7, inner[OWNED]),
            (meshlet.interior_codes, meshlet.interior, stream.interior_base, 4, seams + traversed),
        ):
            code, values = _random_residuals(rng, stream, base, rice, n)
            codes.append(code)
            residuals.append(values)
    return meshlet


class Corner(NamedTuple):
    """Corner j: the references that end and start there, and whether they own a stream's values.

    With refs = 0 each loop is one private reference.
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
        for m, meshlet in enumerate(meshlets):
            anchors = [
                values[names[m, j]]
                for _, j, own_before, own in corners(meshlet)
                if own_before(s) and own(s)
            ]
            further = further_anchors(stream, anchors)
            meshlet.anchors.append(anchors[:1] + further)
            fields = [_anchor_field(stream, list(values)) for values in zip(*further)]
            if rng.random() < 0.3:
                fields = [rng.choice([*range(least, 8)]) for least in fields]
            meshlet.anchor_widths.append(fields)


def random_blob(rng: random.Random, meshlet_count: int, vertex_count: int = 3) -> bytes:
    """A random blob, valid except for corners with too many hops and the vertex count.

    The number of vertices follows only from decoding; the header gets `vertex_count`.
    """
    streams = random_streams(rng)
    chains: list[Chain] = []
    meshlets = [random_meshlet(rng, m, streams, chains) for m in range(meshlet_count)]
    _set_random_anchors(rng, streams, meshlets)
    return write_blob(streams, meshlets, vertex_count, lambda g: random_layout(rng))
