"""Reference decoder of EXT_meshlet_edgebreaker blobs, in plain Python.

Written from Appendix A of spec/EXT_meshlet_edgebreaker.md alone; read it beside that text. Names
and order are the specification's, and clarity comes before speed. It checks the C++ decoder and
shares no code with it. Programs should use `gltf_ext` instead.

All values are integers. A malformed blob raises ValueError with one sentence that names the error.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from spec import predictors

MAGIC = 0x314D4245
VERSION = 2
DRAFT_VERSION = 1
HEADER_BYTES = 32
STREAM_BYTES = 28
GROUP_BYTES = 12
PADDING_BYTES = 8
MESHLETS_PER_GROUP = 32
MAX_STREAMS = 64
MAX_VERTICES = 64
MAX_HOPS = 8
MAX_QUOTIENT = 16383
MAX_PREDICTED_BITS = 24
ANCHOR_WIDTH_BITS = 3
ANCHOR_WIDTH_FULL = 7
MAX_WORD = 0xFFFFFFFF
MIN_BYTES = 80  # header, one stream, one group, padding
MAX_BYTES = 448 << 20
FLOAT_COMPONENTS = 5126  # glTF's number of the component type float

GRID, OCT, INTEGER, FLOAT32, SIGN = range(5)
PARALLELOGRAM, MEAN, COPY, DAMPED, GEO, AFFINE = range(6)
OWNED, FOREIGN, PRIVATE = "owned", "foreign", "private"


Triangle = tuple[int, int, int]  # local ids a, b, v
Value = list[int]  # the elements of one vertex in one stream
Visit = tuple[int, int, int, int | None]  # v, a, b, o of a traversed vertex
Shares = Callable[["Reference"], bool]


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


# --- bits ---


class BitReader:
    """Reads little-endian bit fields of `data` from bit `position` up to bit `end`."""

    def __init__(self, data: bytes, position: int, end: int):
        self.data = data
        self.position = position
        self.end = end

    def read(self, width: int, name: str) -> int:
        """The next `width` bits, least significant first. `name` is the field's, for errors."""
        stop = self.position + width
        _require(stop <= self.end, f"the field '{name}' runs past the end of the meshlet's data.")
        window = int.from_bytes(self.data[self.position >> 3 : (stop + 7) >> 3], "little")
        value = (window >> (self.position & 7)) & ((1 << width) - 1)
        self.position = stop
        return value

    def read_flags(self, count: int, name: str) -> list[bool]:
        """The next `count` single bits."""
        bits = self.read(count, name)
        return [bool(bits >> i & 1) for i in range(count)]

    def read_width(self, name: str) -> int:
        """A width of 0 to 30 or 32 bits, stored in 5 bits; 31 means 32."""
        width = self.read(5, name)
        return 32 if width == 31 else width

    def read_unary(self, name: str, most: int) -> int:
        """The number of 0 bits before the next 1 bit, at most `most`."""
        quotient = 0
        while not self.read(1, name):
            quotient += 1
            _require(quotient <= most, f"a quotient in '{name}' is larger than {most}.")
        return quotient


def unzigzag(u: int) -> int:
    """0, 1, 2, 3, ... -> 0, -1, 1, -2, ..."""
    return (u >> 1) ^ -(u & 1)


# --- connectivity ---


@dataclass
class Disk:
    """A disk: an edge-connected part of a meshlet.

    Its vertices are the local ids first to end - 1, its triangles triangle_begin to
    triangle_end - 1. loop: the boundary vertices, from the root gate's b to its a.
    """

    first: int
    end: int
    triangle_begin: int
    triangle_end: int
    loop: list[int]


@dataclass
class Connectivity:
    """Triangles (a, b, v) with gate a -> b and apex v, in the order of their symbols.

    opposite[t] is the vertex on the other side of triangle t's gate, None at a root.
    """

    triangles: list[Triangle]
    opposite: list[int | None]
    disks: list[Disk]
    vertex_count: int


def decode_serial(symbols: str) -> Connectivity:
    """The serial decoder, with lists where the specification has bit masks.

    symbols: one of C, L, E, R, S per triangle. Raises ValueError if they do not describe disks.
    """
    apex = [0] * len(symbols)
    stack: list[int] = []  # vertices not popped yet; at the end they are the boundary
    pending: list[int] = []  # triangles that wait for the end of their right part
    # Per disk: the root gate's b, the root gate's a, the first triangle.
    firsts: list[int] = []
    roots: list[int] = []
    begins: list[int] = []
    vertex_count = 0
    t = 0
    fresh = True  # the next symbol starts a disk; otherwise it starts the left part of an S

    def push() -> int:
        nonlocal vertex_count
        stack.append(vertex_count)
        vertex_count += 1
        return vertex_count - 1

    def top() -> int:
        _require(bool(stack), "the CLERS symbols take a vertex from an empty stack.")
        return stack[-1]

    while t < len(symbols):
        if fresh:
            begins.append(t)
            firsts.append(push())
        fresh = True
        q = symbols.find("E", t)
        _require(q >= 0, "the CLERS symbols lack an E.")
        for u in range(t, q):
            if symbols[u] == "R":
                apex[u] = push()
            else:
                pending.append(u)
        apex[q] = push()
        push()
        t = q + 1
        while pending:
            u = pending.pop()
            apex[u] = top()
            if symbols[u] == "C":
                stack.pop()
            elif symbols[u] == "L":
                push()
            else:  # S: the right part is done, the left part comes next
                fresh = False
                break
        if fresh:
            roots.append(top())
    _require(fresh, "the CLERS symbols lack an E: an S waits for its left part.")
    _require(vertex_count <= MAX_VERTICES, f"there are more than {MAX_VERTICES} vertices.")
    return _assemble(symbols, apex, stack, firsts, roots, begins, vertex_count)


def _assemble(
    symbols: str,
    apex: list[int],
    boundary: list[int],
    firsts: list[int],
    roots: list[int],
    begins: list[int],
    vertex_count: int,
) -> Connectivity:
    """The second pass of the serial decoder: finds the gates from the apices."""
    first_ends = [*firsts[1:], vertex_count]
    triangle_ends = [*begins[1:], len(symbols)]
    disks = [
        Disk(first, end, begin, triangle_end, [v for v in boundary if first <= v < end])
        for first, end, begin, triangle_end in zip(firsts, first_ends, begins, triangle_ends)
    ]
    triangles: list[Triangle] = []
    opposite: list[int | None] = []
    for disk, root in zip(disks, roots):
        a, b = root, disk.first
        o: int | None = None
        splits: list[int] = []
        for t in range(disk.triangle_begin, disk.triangle_end):
            v = apex[t]
            _require(
                len({a, b, v}) == 3, "the CLERS symbols make a triangle with a repeated vertex."
            )
            triangles.append((a, b, v))
            opposite.append(o)
            symbol = symbols[t]
            if symbol == "R":  # continue across v -> a
                b, o = v, b
            elif symbol != "E":  # C, L, S: continue across b -> v
                a, o = v, a
                if symbol == "S":
                    splits.append(t)
            elif splits:  # E: continue with the left part of the last S
                a, o, b = triangles[splits.pop()]
    return Connectivity(triangles, opposite, disks, vertex_count)


def decode_parallel(symbols: str) -> list[Triangle]:
    """The parallel decoder: one thread per triangle, after a few shared tables.

    symbols must be valid; the triangles are those of `decode_serial`. On a GPU each comprehension
    is one step of all threads, and each prefix sum is a population count of a mask or a scan.
    """
    count = len(symbols)
    threads = range(count)

    def before(t: int, kinds: str) -> int:
        return sum(symbols[u] in kinds for u in range(t))

    disk_count = before(count, "E") - before(count, "S")
    depth = [before(t, "S") - before(t, "E") + disk_count for t in range(count + 1)]
    # 1. closing[t]: the E that closes the part that triangle t opens
    level: dict[int, list[int]] = {}
    for t in threads:
        if symbols[t] == "E":
            level.setdefault(depth[t + 1], []).append(t)
    closing = [next(q for q in level[depth[t] - 1] if q >= t) for t in threads]
    # a disk ends at the first E that takes the depth below all earlier values
    ends = [level[k][0] for k in range(disk_count)]
    # 2. C and L are written to the string when their right part closes: count them at the closing E
    late = [0] * count
    for t in threads:
        if symbols[t] in "CL":
            late[closing[t]] += 1
    # 3. the part of t starts, ends and has its apex at these positions of the string of + and -
    start = [
        before(t, "R")
        + 2 * before(t, "E")
        + sum(late[q] for q in range(t))
        + sum(end < t for end in ends)
        for t in threads
    ]
    end = [start[t] + closing[t] - t + 2 for t in threads]
    middle = []
    for t in threads:
        if symbols[t] in "RE":
            middle.append(start[t] + 1)
        elif symbols[t] in "CL":
            middle.append(end[t] - 1)
        else:
            middle.append(start[t] + closing[t + 1] - t + 1)
    # 4. the string: - at the end of a C, + elsewhere; and the height of each +
    length = max(end) + 1
    pops = {end[t] for t in threads if symbols[t] == "C"}
    popped = [sum(p <= j for p in pops) for j in range(length)]
    height = [j - 2 * popped[j] for j in range(length)]

    # 5. the vertex on top of the stack after the string's position j
    def vertex(j: int) -> int:
        i = max(i for i in range(j + 1) if i not in pops and height[i] == height[j])
        return i - popped[i]

    return [(vertex(end[t]), vertex(start[t]), vertex(middle[t])) for t in threads]


# --- the blob ---


@dataclass
class Stream:
    """One entry of the stream table: 1 to 4 elements of `bits` bits per vertex."""

    kind: int
    elements: int
    bits: int
    predictor: int
    chain_base: int
    interior_base: int
    anchor_base: int
    step: float
    offset: tuple[float, ...]

    @property
    def content(self) -> tuple:
        """The fields that all blobs of a view have in common."""
        return self.kind, self.elements, self.bits, self.step, self.offset

    @property
    def mask(self) -> int:
        return (1 << self.bits) - 1


@dataclass
class Group:
    """One entry of the group table: up to 32 meshlets."""

    base: int
    stride: int
    bias: int
    entry_width: int
    delta_width: int
    slot_width: int
    reference_width: int
    has_loops: bool
    has_private: bool
    has_seams: bool
    second_table: bool  # (first, second, third) of the symbols are (L, C, E), else (C, E, L)


@dataclass
class Blob:
    """A decoded blob or view: triangles uint32[T, 3] and, per stream, values uint32[V, elements].

    parts: the blobs of a view; empty for a blob.
    """

    triangles: np.ndarray
    values: list[np.ndarray]
    streams: list[Stream]
    parts: list[Blob] = field(default_factory=list)

    def dequantised(self, stream: int) -> np.ndarray:
        """The values of a stream, each blob's by the step and offsets of its own table."""
        return np.concatenate(
            [dequantise(p.streams[stream], p.values[stream]) for p in self.parts or [self]]
        )


class BlobFile:
    """Header and tables of a blob, checked, and its meshlets, parsed on demand."""

    def __init__(self, data: bytes):
        self.data = bytes(data)
        _require(len(self.data) >= MIN_BYTES, f"The blob is shorter than {MIN_BYTES} bytes.")
        (
            magic,
            version,
            stream_count,
            flags,
            reserved,
            self.triangle_count,
            self.vertex_count,
            self.meshlet_count,
            byte_length,
            self.data_offset,
            reserved_end,
        ) = struct.unpack_from("<IBBBBIIIIII", self.data)
        _require(magic == MAGIC, "The blob does not start with the bytes EBM1.")
        _require(
            version != DRAFT_VERSION,
            f"The blob has version {version}, a draft: make it again from its source with "
            "`gltf-meshlet compress`, or decompress it with the last commit of the draft, "
            "which CHANGELOG.md names.",
        )
        _require(
            version == VERSION,
            f"The blob has version {version}, this decoder reads version {VERSION}.",
        )
        _require(
            1 <= stream_count <= MAX_STREAMS,
            f"The blob has {stream_count} streams instead of 1 to {MAX_STREAMS}.",
        )
        _require(
            flags == reserved == reserved_end == 0, "A reserved field of the header is not zero."
        )
        _require(
            byte_length == len(self.data), "The header's byte length is not the length of the blob."
        )
        _require(byte_length % 4 == 0, "The blob's length is not a multiple of four.")
        _require(byte_length <= MAX_BYTES, f"The blob is longer than {MAX_BYTES} bytes.")
        _require(
            not any(self.data[-PADDING_BYTES:]),
            f"The blob's last {PADDING_BYTES} bytes are not zero.",
        )
        _require(self.meshlet_count >= 1, "The blob has no meshlet.")
        _require(
            3
            <= self.vertex_count
            <= min(MAX_VERTICES * self.meshlet_count, 3 * self.triangle_count),
            "The header's vertex count is impossible for its numbers of meshlets and triangles.",
        )
        group_count = -(-self.meshlet_count // MESHLETS_PER_GROUP)
        self.group_table = HEADER_BYTES + STREAM_BYTES * stream_count
        _require(
            self.data_offset == self.group_table + GROUP_BYTES * group_count,
            "The header's data offset does not follow from its counts.",
        )
        _require(
            self.data_offset <= byte_length - PADDING_BYTES, "The blob is too short for its tables."
        )
        self.streams = [self._stream(s) for s in range(stream_count)]
        self._check_predictors()
        self.groups = [self._group(g) for g in range(group_count)]
        self.end = byte_length - PADDING_BYTES
        self._read_places()
        _require(
            sum(self.reader(m).read(6, "T - 1") + 1 for m in range(self.meshlet_count))
            == self.triangle_count,
            "The meshlets' triangles do not add up to the header's triangle count.",
        )
        self._meshlets: dict[int, Meshlet] = {}

    def _stream(self, index: int) -> Stream:
        at = HEADER_BYTES + STREAM_BYTES * index
        (
            kind,
            elements,
            bits,
            predictor,
            chain_base,
            interior_base,
            anchor_base,
            reserved,
            step,
            *offset,
        ) = struct.unpack_from("<8B5f", self.data, at)
        bases = chain_base, interior_base, anchor_base
        where = f"Stream {index}"
        _require(kind <= SIGN, f"{where} has the unknown kind {kind}.")
        _require(1 <= elements <= 4, f"{where} has {elements} elements instead of 1 to 4.")
        _require(1 <= bits <= 32, f"{where} has {bits} bits per element instead of 1 to 32.")
        _require(predictor <= AFFINE, f"{where} has the unknown predictor {predictor}.")
        _require(
            bits <= MAX_PREDICTED_BITS or predictor == COPY,
            f"{where} has more than {MAX_PREDICTED_BITS} bits, which needs COPY.",
        )
        _require(max(bases) <= 31, f"{where} has a base above 31.")
        _require(reserved == 0, f"{where} has a reserved field that is not zero.")
        _require(
            kind != GRID or bits <= MAX_PREDICTED_BITS,
            f"{where} is GRID with more than {MAX_PREDICTED_BITS} bits.",
        )
        _require(
            all(map(math.isfinite, [step, *offset])),
            f"{where} has a step or offset that is not finite.",
        )
        _require(
            kind != OCT or (elements == 2 and 2 <= bits <= 16),
            f"{where} is OCT without 2 elements of 2 to 16 bits.",
        )
        _require(kind != FLOAT32 or bits == 32, f"{where} is FLOAT32 without 32 bits.")
        _require(
            kind != SIGN or (elements == 1 and bits == 1),
            f"{where} is SIGN without 1 element of 1 bit.",
        )
        return Stream(kind, elements, bits, predictor, *bases, step, tuple(offset))

    def _check_predictors(self) -> None:
        """GEO and AFFINE predict from the positions of stream 0."""
        first = self.streams[0]
        for s, stream in enumerate(self.streams):
            if stream.predictor < GEO:
                continue
            _require(
                s > 0 and first.kind == GRID and first.elements == 3,
                f"Stream {s} is predicted from stream 0, which is no other stream of positions.",
            )
            if stream.predictor == AFFINE:
                fits = stream.kind not in (OCT, SIGN)
            else:
                fits = stream.kind == OCT
            _require(fits, f"Stream {s} has a predictor that does not go with its kind.")

    def _group(self, index: int) -> Group:
        base, place, word = struct.unpack_from("<3I", self.data, self.group_table + 12 * index)
        group = Group(
            base=base,
            stride=place & 0xFFFF,
            bias=place >> 16,
            entry_width=word & 31,
            delta_width=word >> 5 & 31,
            slot_width=word >> 10 & 7,
            reference_width=word >> 13 & 7,
            has_loops=bool(word >> 16 & 1),
            has_private=bool(word >> 17 & 1),
            has_seams=bool(word >> 18 & 1),
            second_table=bool(word >> 19 & 1),
        )
        _require(
            group.delta_width <= 24
            and group.slot_width <= 6
            and group.reference_width <= 6
            and word >> 20 == 0,
            f"Group {index} of the group table has a field out of range.",
        )
        return group

    def _read_places(self) -> None:
        """Sets starts and ends: the first byte of each meshlet's data, and the one after it."""
        self.starts: list[int] = []
        self.ends: list[int] = []
        least = self.data_offset  # the least place of what comes next
        for g, group in enumerate(self.groups):
            count = min(MESHLETS_PER_GROUP, self.meshlet_count - MESHLETS_PER_GROUP * g)
            data = group.base + (count * group.entry_width + 7) // 8
            _require(
                least <= group.base and data <= self.end,
                f"The entries of group {g} lie outside the blob or in the data before them.",
            )
            if g:
                self.ends.append(group.base)
            entries = BitReader(self.data, 8 * group.base, 8 * data)
            least = data
            for i in range(count):
                entry = entries.read(group.entry_width, "entry")
                start = (data + group.stride * i - group.bias + entry) & MAX_WORD
                _require(
                    least <= start < self.end,
                    f"Meshlet {MESHLETS_PER_GROUP * g + i} starts outside the blob or "
                    "in the data before it.",
                )
                least = start + 1  # each meshlet has at least one byte
                self.starts.append(start)
                if i:
                    self.ends.append(start)
            _require(
                entries.read(8 * data - entries.position, "padding of entries") == 0,
                f"The padding of the entries of group {g} is not zero.",
            )
        self.ends.append(self.end)

    def reader(self, m: int) -> BitReader:
        """Stands at the first bit of meshlet m and ends with its data."""
        return BitReader(self.data, 8 * self.starts[m], 8 * self.ends[m])

    def meshlet(self, m: int) -> Meshlet:
        """Meshlet m, as far as its own data describe it (all but Interior)."""
        if m not in self._meshlets:
            try:
                self._meshlets[m] = Meshlet(self, m)
            except ValueError as error:
                raise ValueError(f"Meshlet {m}: {error}") from None
        return self._meshlets[m]


# --- a meshlet ---


@dataclass
class Reference:
    """A run of `length` boundary edges of a meshlet's loop number `loop`.

    OWNED: stored in this meshlet, for others to refer to
    FOREIGN: stored by meshlet `owner`, as its owned reference number `slot`; share: per stream,
    whether the values are the owner's; length is 0, because the owner stores it
    PRIVATE: shared with no other reference
    """

    kind: str
    loop: int
    length: int = 0
    owner: int = 0
    slot: int = 0
    share: list[bool] = field(default_factory=list)

    def shares(self, s: int) -> bool:
        """True if the owner stores the run's values of stream s."""
        return self.kind == FOREIGN and self.share[s]

    def shares_all(self) -> bool:
        return self.kind == FOREIGN and all(self.share)


@dataclass
class Code:
    """The code of a list: Rice or exp-Golomb with parameter k, or fixed widths if k is None."""

    k: int | None = None
    exponential: bool = False
    widths: list[int] = field(default_factory=list)

    def read_quotient(self, reader: BitReader, name: str) -> int:
        """The unary part of a value; 0 if the code is fixed, which has none."""
        if self.k is None:
            return 0
        most = min(31, 32 - self.k) if self.exponential else MAX_QUOTIENT
        return reader.read_unary(name, most)

    def read_low(self, reader: BitReader, name: str, quotient: int, c: int) -> int:
        """The low bits of element c of a value. Only those of exp-Golomb need the quotient."""
        if self.k is None:
            return reader.read(self.widths[c], name)
        return reader.read(self.k + quotient if self.exponential else self.k, name)

    def residual(self, quotient: int, low: int) -> int:
        """A signed residual from both parts of its value."""
        if self.k is None:
            return unzigzag(low)
        high = (1 << quotient) - 1 if self.exponential else quotient
        return unzigzag((high << self.k) + low & MAX_WORD)


@dataclass
class ResidualList:
    """A list of residuals: `count` vertices of one stream. name: for errors."""

    name: str
    elements: int
    code: Code
    count: int

    def read_quotients(self, reader: BitReader) -> list[Value]:
        """The unary parts, [vertex][element]."""
        name = f"unary of {self.name}"
        return [
            [self.code.read_quotient(reader, name) for _ in range(self.elements)]
            for _ in range(self.count)
        ]

    def read_low(self, reader: BitReader, quotients: list[Value] | None = None) -> list[Value]:
        """The low bits, [vertex][element]. quotients: for exp-Golomb."""
        name = f"low of {self.name}"
        return [
            [self.code.read_low(reader, name, q, c) for c, q in enumerate(vertex)]
            for vertex in quotients or [[0] * self.elements] * self.count
        ]

    def residuals(self, quotients: list[Value], low: list[Value]) -> list[Value]:
        """Signed residuals, [vertex][element]."""
        return [
            [self.code.residual(*parts) for parts in zip(*vertex)] for vertex in zip(quotients, low)
        ]


class Meshlet:
    """A meshlet without its interior, at which `reader` stands.

    The interior has the inner vertices of seams, whose lengths are in other meshlets.
    """

    def __init__(self, file: BlobFile, m: int):
        self.index = m
        self.streams = file.streams
        self.group = file.groups[m // MESHLETS_PER_GROUP]
        reader = file.reader(m)
        self._read_head(reader)
        self.symbols = self._read_symbols(reader)
        self.connectivity = decode_serial(self.symbols)
        self.references = self._read_references(reader)
        self.owned = [j for j, reference in enumerate(self.references) if reference.kind == OWNED]
        self.loops: list[list[int]] = [[] for _ in self.connectivity.disks]
        for j, reference in enumerate(self.references):
            self.loops[reference.loop].append(j)
        self.chain_codes: list[Code] = []
        self.interior_codes: list[Code] = []
        for s in range(len(self.streams)):
            self._read_codes(reader, s)
        self.anchors = [self._read_anchors(reader, s) for s in range(len(self.streams))]
        self.chain_residuals = self._read_chains(reader)
        self.reader = reader

    def _read_head(self, reader: BitReader) -> None:
        """Counts and flags."""
        group = self.group
        self.triangle_count = reader.read(6, "T - 1") + 1
        self.reference_count = reader.read(group.reference_width, "refs")
        self.has_loops = group.has_loops and bool(reader.read(1, "LOOPS"))
        self.has_private = group.has_private and bool(reader.read(1, "PRIVATE"))
        self.has_seams = group.has_seams and bool(reader.read(1, "SEAMS"))

    # --- Symbols

    def _read_symbols(self, reader: BitReader) -> str:
        """Each plane has a bit per one of the plane before it."""
        first, second, third = "LCE" if self.group.second_table else "CEL"
        count = self.triangle_count - 1
        symbols = ["R"] * count
        places = list(range(count))  # the triangles that the next plane tells apart
        for plane, zero in enumerate(["R", first, second, third]):
            bits = reader.read_flags(len(places), f"p{plane}")
            for t, bit in zip(places, bits):
                symbols[t] = "S" if bit else zero
            places = [t for t, bit in zip(places, bits) if bit]
        return "".join(symbols) + "E"

    # --- References

    def _read_references(self, reader: BitReader) -> list[Reference]:
        disks = self.connectivity.disks
        count = self.reference_count
        if count == 0:  # every loop is one private reference
            _require(
                not (self.has_loops or self.has_private or self.has_seams),
                "a meshlet without references has a flag set.",
            )
            return [Reference(PRIVATE, loop, len(disk.loop)) for loop, disk in enumerate(disks)]
        foreign = reader.read_flags(count, "foreign mask")
        last = (
            reader.read_flags(count, "loop-end mask")
            if self.has_loops
            else [False] * (count - 1) + [True]
        )
        private = reader.read_flags(count, "private mask") if self.has_private else [False] * count
        _require(last[-1], "the last reference does not end a loop.")
        _require(sum(last) == len(disks), "the references' loops are not as many as the disks.")
        _require(
            not any(f and p for f, p in zip(foreign, private)),
            "a reference is both private and foreign.",
        )
        references = []
        for j in range(count):
            kind = FOREIGN if foreign[j] else PRIVATE if private[j] else OWNED
            references.append(Reference(kind, loop=sum(last[:j])))
        length_width = reader.read(3, "length width")
        _require(length_width <= 6, "the length width is 7.")
        for j, reference in enumerate(references):
            alone = last[j] and (j == 0 or last[j - 1])
            if reference.kind == OWNED or (reference.kind == PRIVATE and not alone):
                reference.length = reader.read(length_width, "length - 1") + 1
            elif reference.kind == PRIVATE:
                reference.length = len(disks[reference.loop].loop)
        for reference in references:
            if reference.kind == FOREIGN:
                delta = reader.read(self.group.delta_width, "delta")
                _require(delta <= self.index, "a reference's owner lies before meshlet 0.")
                reference.owner = self.index - delta
                reference.slot = reader.read(self.group.slot_width, "slot")
                others = len(self.streams) - 1
                reference.share = [True] + (
                    reader.read_flags(others, "share bits") if self.has_seams else [True] * others
                )
        return references

    def next(self, j: int) -> int:
        """The reference after reference j in its loop."""
        loop = self.loops[self.references[j].loop]
        return loop[(loop.index(j) + 1) % len(loop)]

    def previous(self, j: int) -> int:
        """The reference before reference j in its loop."""
        loop = self.loops[self.references[j].loop]
        return loop[loop.index(j) - 1]

    # --- Codes

    def _read_codes(self, reader: BitReader, s: int) -> None:
        """The codes of stream s. Without an owned reference, chains have none and are empty."""
        stream = self.streams[s]
        chain = Code(widths=[0] * stream.elements)
        if self.owned:
            name = f"chain, stream {s}"
            chain = self._read_code(reader, name, stream.elements, stream.chain_base, 7)
        self.chain_codes.append(chain)
        name = f"interior, stream {s}"
        interior = self._read_code(reader, name, stream.elements, stream.interior_base, 4)
        self.interior_codes.append(interior)

    @staticmethod
    def _read_code(reader: BitReader, name: str, elements: int, base: int, rice: int) -> Code:
        """rice: the number of Rice codes; those from there to 6 are exp-Golomb, 7 is fixed."""
        code = reader.read(3, f"code of {name}")
        if code == 7:
            return Code(widths=[reader.read_width(f"width of {name}") for _ in range(elements)])
        exponential = code >= rice
        k = max(base, 1) - 1 + code - rice if exponential else base + code
        _require(k <= 31, "the parameter of a code is larger than 31.")
        return Code(k, exponential)

    # --- Anchors

    def stores_corner(self, j: int, s: int) -> bool:
        """True if the corner at the start of reference j is an anchor of stream s."""
        return not (self.references[j].shares(s) or self.references[self.previous(j)].shares(s))

    def _read_anchors(self, reader: BitReader, s: int) -> dict[int, Value]:
        """Corner -> its value in stream s."""
        stream = self.streams[s]
        corners = [j for j in range(len(self.references)) if self.stores_corner(j, s)]
        anchors: dict[int, Value] = {}
        if corners:
            name = f"first anchor, stream {s}"
            first = [reader.read(stream.bits, name) for _ in range(stream.elements)]
            anchors[corners[0]] = first
        if len(corners) > 1:
            widths = [self._read_anchor_width(reader, s) for _ in range(stream.elements)]
        for j in corners[1:]:
            fields = [reader.read(width, f"further anchors, stream {s}") for width in widths]
            anchors[j] = [(x + unzigzag(u)) & stream.mask for x, u in zip(first, fields)]
        return anchors

    def _read_anchor_width(self, reader: BitReader, s: int) -> int:
        """The width of an element of the further anchors of stream s."""
        stream = self.streams[s]
        width = reader.read(ANCHOR_WIDTH_BITS, f"width of further anchors, stream {s}")
        if width == ANCHOR_WIDTH_FULL:
            return stream.bits
        return min(stream.anchor_base + width, stream.bits)

    # --- Chains

    def _read_chains(self, reader: BitReader) -> list[list[Value]]:
        """Residuals [stream][vertex][element] of the inner vertices of the owned references."""
        count = sum(self.references[j].length - 1 for j in self.owned)
        lists = [
            ResidualList(f"chain, stream {s}", stream.elements, code, count)
            for s, (stream, code) in enumerate(zip(self.streams, self.chain_codes))
        ]
        low = [chain.read_low(reader) for chain in lists]
        return [
            chain.residuals(chain.read_quotients(reader), bits) for chain, bits in zip(lists, low)
        ]

    # --- Interior

    def read_interior(
        self, reader: BitReader, streams: list[int], counts: list[int]
    ) -> list[list[Value]]:
        """Residuals [stream][vertex][element] of the interior of the given streams."""
        lists = [
            ResidualList(
                f"interior, stream {s}", self.streams[s].elements, self.interior_codes[s], count
            )
            for s, count in zip(streams, counts)
        ]
        quotients = [interior.read_quotients(reader) for interior in lists]
        return [
            interior.residuals(numbers, interior.read_low(reader, numbers))
            for interior, numbers in zip(lists, quotients)
        ]


# --- values ---


class Decoder:
    """Decodes the values of meshlets; follows references to their owners."""

    def __init__(self, data: bytes):
        self.file = BlobFile(data)

    def owned_reference(self, reference: Reference) -> tuple[Meshlet, int]:
        """The owner of a foreign reference and the number of the owned reference there."""
        owner = self.file.meshlet(reference.owner)
        _require(
            reference.slot < len(owner.owned),
            f"A slot is not among the references that meshlet {owner.index} owns.",
        )
        return owner, owner.owned[reference.slot]

    def length(self, reference: Reference) -> int:
        """The number of edges of a reference's run."""
        if reference.kind != FOREIGN:
            return reference.length
        owner, k = self.owned_reference(reference)
        return owner.references[k].length

    def boundary(self, meshlet: Meshlet) -> list[list[int]]:
        """Per reference: the local ids along its run, with the corners at both ends."""
        runs = []
        for disk, members in zip(meshlet.connectivity.disks, meshlet.loops):
            lengths = [self.length(meshlet.references[j]) for j in members]
            _require(
                sum(lengths) == len(disk.loop),
                f"Meshlet {meshlet.index}: the references' lengths do not add up to the loop.",
            )
            around = disk.loop + disk.loop[:1]
            begin = 0
            for length in lengths:
                runs.append(around[begin : begin + length + 1])
                begin += length
        return runs

    def hop(self, meshlet: Meshlet, j: int, shares: Shares) -> tuple[Meshlet, int] | None:
        """Steps from the corner at the start of reference j to the same corner in an owner.

        Follows one of the two references at the corner for which shares(reference) is true: the
        one with the smaller owner, on a tie j itself. Returns None if there is none.
        """
        candidates = [i for i in (j, meshlet.previous(j)) if shares(meshlet.references[i])]
        if not candidates:
            return None
        i = min(candidates, key=lambda i: meshlet.references[i].owner)
        owner, k = self.owned_reference(meshlet.references[i])
        # A foreign run is the owner's run backwards: the owner's ends at our start.
        return (owner, owner.next(k)) if i == j else (owner, k)

    def resolve_corner(self, meshlet: Meshlet, j: int, shares: Shares) -> tuple[Meshlet, int]:
        """Follows all hops from the corner at the start of reference j."""
        hops = 0
        here = meshlet, j
        while (there := self.hop(*here, shares)) is not None:
            hops += 1
            _require(
                hops <= MAX_HOPS,
                f"Meshlet {meshlet.index}: a corner is more than {MAX_HOPS} hops away "
                "from its anchor.",
            )
            here = there
        return here

    def corner(self, meshlet: Meshlet, j: int, s: int) -> Value:
        """The value of stream s at the corner at the start of reference j."""
        home, k = self.resolve_corner(meshlet, j, lambda reference: reference.shares(s))
        return home.anchors[s][k]

    @staticmethod
    def chain(
        stream: Stream, values: list[Value], residuals: list[Value], positions: list[Value]
    ) -> None:
        """Sets the inner vertices of a run whose first and last value are set.

        Each is predicted from the vertex before it and the run's end. positions: those of the run;
        only for AFFINE.
        """
        n = len(values) - 1
        for i, residual in enumerate(residuals, start=1):
            before, end = values[i - 1], values[n]
            if stream.predictor == COPY:
                prediction = before
            elif stream.predictor == AFFINE:
                prediction = predictors.affine_chain(values, positions, i)
            else:
                prediction = predictors.toward(before, end, n - i + 1)
            values[i] = [(p + r) & stream.mask for p, r in zip(prediction, residual)]

    @staticmethod
    def owned_residuals(meshlet: Meshlet, j: int, s: int) -> list[Value]:
        """The residuals of the owned reference j in stream s."""
        begin = sum(meshlet.references[i].length - 1 for i in meshlet.owned if i < j)
        return meshlet.chain_residuals[s][begin : begin + meshlet.references[j].length - 1]

    def traversed(self, meshlet: Meshlet, runs: list[list[int]]) -> list[Visit]:
        """(v, a, b, o) per vertex v that the traversal predicts, in its order.

        a -> b is the gate and o the vertex on its other side. The root gate's a, which is b's
        neighbour, has a = b.
        """
        known: set[int] = set()  # corners, and inner vertices of owned and foreign references
        for reference, run in zip(meshlet.references, runs):
            known.update(run[:1] if reference.kind == PRIVATE else run[:-1])
        order = []
        for disk in meshlet.connectivity.disks:
            visits: list[Visit] = [(disk.loop[-1], disk.first, disk.first, None)]
            for t in range(disk.triangle_begin, disk.triangle_end):
                a, b, v = meshlet.connectivity.triangles[t]
                visits.append((v, a, b, meshlet.connectivity.opposite[t]))
            for visit in visits:
                if visit[0] not in known:
                    known.add(visit[0])
                    order.append(visit)
        return order

    def meshlet(self, m: int) -> tuple[list[Triangle], list[list[Value]]]:
        """The triangles of meshlet m and its values [stream][local id][element]."""
        meshlet = self.file.meshlet(m)
        runs = self.boundary(meshlet)
        order = self.traversed(meshlet, runs)
        seams = [
            [j for j, r in enumerate(meshlet.references) if r.kind == FOREIGN and not r.shares(s)]
            for s in range(len(meshlet.streams))
        ]
        residuals = self.interior(
            meshlet, [sum(len(runs[j]) - 2 for j in of_stream) + len(order) for of_stream in seams]
        )
        values: list[list[Value]] = []
        for s, (of_stream, interior) in enumerate(zip(seams, residuals)):
            positions = values[0] if s else []
            values.append(
                self._stream_values(meshlet, s, runs, of_stream, order, interior, positions)
            )
        return meshlet.connectivity.triangles, values

    @staticmethod
    def interior(meshlet: Meshlet, counts: list[int]) -> list[list[Value]]:
        """Residuals [stream][vertex][element] of the interior. counts: vertices per stream."""
        reader = BitReader(meshlet.reader.data, meshlet.reader.position, meshlet.reader.end)
        others = list(range(1, len(counts)))
        try:
            first = meshlet.read_interior(reader, [0], counts[:1])
            return first + meshlet.read_interior(reader, others, counts[1:])
        except ValueError as error:
            raise ValueError(f"Meshlet {meshlet.index}: {error}") from None

    def _stream_values(
        self,
        meshlet: Meshlet,
        s: int,
        runs: list[list[int]],
        seams: list[int],
        order: list[Visit],
        residuals: list[Value],
        positions: list[Value],
    ) -> list[Value]:
        """The values of stream s, [local id].

        seams: foreign references that it does not share. positions: the values of stream 0, empty
        while they are decoded themselves.
        """
        stream = meshlet.streams[s]
        values: list[Value] = [[]] * meshlet.connectivity.vertex_count
        rest = iter(residuals)
        for j, run in enumerate(runs):
            values[run[0]] = self.corner(meshlet, j, s)
        for j, (reference, run) in enumerate(zip(meshlet.references, runs)):
            if reference.kind == OWNED:
                chain = self.owned_residuals(meshlet, j, s)
            elif reference.shares(s):  # the owner's direction is the opposite of ours
                run = run[::-1]
                chain = self.owned_residuals(*self.owned_reference(reference), s)
            elif j in seams:
                chain = [next(rest) for _ in run[1:-1]]
            else:  # private: the traversal reaches its vertices
                continue
            inner = [values[v] for v in run]
            self.chain(stream, inner, chain, [positions[v] for v in run] if positions else [])
            for v, value in zip(run, inner):
                values[v] = value
        normals: list[list[int]] = []
        if stream.predictor == GEO:
            normals = predictors.normals(
                meshlet.connectivity.triangles, positions, meshlet.streams[0].bits
            )
        for v, a, b, o in order:
            if stream.predictor == GEO:
                prediction = predictors.octahedral(normals[v], stream.bits)
            elif a == b:  # the root gate's a
                prediction = values[b]
            else:
                prediction = predictors.apex(stream.predictor, values, positions, a, b, o, v)
            values[v] = [(p + r) & stream.mask for p, r in zip(prediction, next(rest))]
        return values

    def check_shared(
        self, meshlet: Meshlet, runs: list[list[list[int]]], local: list[list[list[Value]]]
    ) -> None:
        """Raises ValueError if shared vertices have other values than in their owner.

        runs[m] is `boundary` and local[m] has the values of meshlet m, up to this meshlet.
        """
        for reference, run in zip(meshlet.references, runs[meshlet.index]):
            for s in range(len(meshlet.streams)):
                if reference.shares(s):
                    owner, k = self.owned_reference(reference)
                    ours = [local[meshlet.index][s][v] for v in run]
                    theirs = [local[owner.index][s][v] for v in reversed(runs[owner.index][k])]
                    _require(
                        ours == theirs,
                        f"Meshlet {meshlet.index}: a shared vertex has other values "
                        "than its owner gives it.",
                    )

    def alias(self, meshlet: Meshlet, runs: list[list[list[int]]]) -> dict[int, tuple[int, int]]:
        """Local id -> (meshlet, local id) for each vertex that an earlier meshlet also has.

        runs[m] is `boundary` of meshlet m, up to this meshlet.
        """
        names = {}
        for j, reference in enumerate(meshlet.references):
            run = runs[meshlet.index][j]
            home, k = self.resolve_corner(meshlet, j, Reference.shares_all)
            if (home.index, k) != (meshlet.index, j):
                names[run[0]] = home.index, runs[home.index][k][0]
            if reference.shares_all():
                owner, k = self.owned_reference(reference)
                for v, w in zip(run[1:-1], runs[owner.index][k][-2:0:-1]):
                    names[v] = owner.index, w
        return names


def decode_meshlet(data: bytes, index: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Decodes one meshlet.

    Returns its triangles, uint8[t, 3] of local ids, and per stream the values of its local
    vertices, uint32[v, elements]. Raises ValueError if the blob is malformed and IndexError if it
    has no such meshlet.
    """
    decoder = Decoder(data)
    if not 0 <= index < decoder.file.meshlet_count:
        raise IndexError(
            f"The blob has {decoder.file.meshlet_count} meshlets, there is no meshlet {index}."
        )
    triangles, values = decoder.meshlet(index)
    return np.array(triangles, np.uint8), [np.array(v, np.uint32) for v in values]


def decode_blob(data: bytes) -> Blob:
    """Decodes all meshlets of a blob and joins them. Raises ValueError if the blob is malformed."""
    decoder = Decoder(data)
    file = decoder.file
    triangles: list[list[int]] = []
    values: list[list[Value]] = [[] for _ in file.streams]
    local: list[list[list[Value]]] = []  # [meshlet][stream][local id]
    numbers: list[list[int]] = []  # [meshlet][local id]: the vertex number
    runs: list[list[list[int]]] = []  # [meshlet][reference]: local ids
    vertex_count = 0
    for m in range(file.meshlet_count):
        local_triangles, local_values = decoder.meshlet(m)
        meshlet = file.meshlet(m)
        runs.append(decoder.boundary(meshlet))
        local.append(local_values)
        decoder.check_shared(meshlet, runs, local)
        names = decoder.alias(meshlet, runs)
        new = [v for v in range(meshlet.connectivity.vertex_count) if v not in names]
        numbers.append([0] * meshlet.connectivity.vertex_count)
        for v in new:
            numbers[m][v] = vertex_count
            vertex_count += 1
        for v, (owner, w) in names.items():
            numbers[m][v] = numbers[owner][w]
        triangles += [[numbers[m][v] for v in triangle] for triangle in local_triangles]
        for s, stream_values in enumerate(local_values):
            values[s] += [stream_values[v] for v in new]
    _require(
        vertex_count == file.vertex_count,
        "The meshlets' vertices do not add up to the header's vertex count.",
    )
    return Blob(
        np.array(triangles, np.uint32), [np.array(v, np.uint32) for v in values], file.streams
    )


def split_view(view: bytes) -> list[bytes]:
    """The blobs of a buffer view, back to back. The last one takes the rest, whatever it says."""
    blobs: list[bytes] = []
    at = 0
    while at < len(view) or not blobs:
        rest = len(view) - at
        length = rest
        if rest >= HEADER_BYTES:
            (length,) = struct.unpack_from("<I", view, at + 20)
        if length < HEADER_BYTES or length % 4 or length > rest:
            length = rest
        blobs.append(view[at : at + length])
        at += length
    return blobs


def decode_view(view: bytes) -> Blob:
    """Decodes a buffer view of one or several blobs; vertex numbers go on from blob to blob.

    Raises ValueError if a blob is malformed, or if the blobs do not go together.
    """
    blobs: list[Blob] = []
    for number, data in enumerate(split_view(view)):
        try:
            blobs.append(decode_blob(data))
        except ValueError as error:
            raise ValueError(f"Blob {number}: {error}" if number else str(error)) from None
        _require(
            [stream.content for stream in blobs[-1].streams]
            == [stream.content for stream in blobs[0].streams],
            f"Blob {number} has other streams than the first blob.",
        )
    triangles = []
    vertex_count = 0
    for blob in blobs:
        triangles.append(blob.triangles + np.uint32(vertex_count))
        vertex_count += len(blob.values[0])
        _require(vertex_count <= MAX_WORD, "The blobs have more vertices than 32 bits can count.")
    _require(
        3 * sum(map(len, triangles)) <= MAX_WORD,
        "The blobs have more indices than 32 bits can count.",
    )
    return Blob(
        np.concatenate(triangles),
        [np.concatenate(values) for values in zip(*(blob.values for blob in blobs))],
        blobs[0].streams,
        blobs,
    )


def dequantise(stream: Stream, integers: np.ndarray) -> np.ndarray:
    """The values of a stream's integers, uint32[V, elements].

    Returns float32[V, elements], float32[V, 3] for OCT, and the integers themselves for INTEGER.
    """
    if stream.kind == GRID:
        offset = np.array(stream.offset[: stream.elements])
        values: np.ndarray = offset + integers * np.float64(stream.step)
        return values.astype(np.float32)
    if stream.kind == OCT:
        one = np.float32(1)  # every operation below is binary32
        x, y = (
            integers.astype(np.float32) * (np.float32(2) / np.float32((1 << stream.bits) - 2)) - one
        ).T
        z = one - np.abs(x) - np.abs(y)
        t = np.maximum(-z, np.float32(0))
        x = x - np.copysign(t, x)
        y = y - np.copysign(t, y)
        scale = one / np.sqrt(x * x + y * y + z * z)
        vectors: np.ndarray = np.stack([x * scale, y * scale, z * scale], axis=1)
        return vectors + np.float32(0)  # no negative zeros
    if stream.kind == FLOAT32:
        positive = integers >= 0x80000000
        return (
            np.where(positive, integers ^ np.uint32(0x80000000), ~integers)
            .astype(np.uint32)
            .view(np.float32)
        )
    if stream.kind == SIGN:
        return (2.0 * integers - 1.0).astype(np.float32)
    return integers


def width_of(stream: Stream) -> int:
    """The number of components of an accessor that a stream fills."""
    return 3 if stream.kind == OCT else stream.elements


def accessor_components(blob: Blob, stream: int, component_type: int, width: int) -> np.ndarray:
    """The components of an accessor, [V, width], from the streams from number `stream` on.

    component_type: glTF's number. Returns float32 for 5126, else int64. Raises ValueError if the
    streams do not fit the accessor.
    """
    columns: list[np.ndarray] = []
    while sum(column.shape[1] for column in columns) < width:
        _require(stream < len(blob.streams), "The attribute needs more streams than there are.")
        kind = blob.streams[stream].kind
        values = blob.dequantised(stream)
        if component_type == FLOAT_COMPONENTS:
            values = values.astype(np.float32)
        else:
            _require(kind not in (OCT, SIGN), "An OCT or SIGN stream needs a float accessor.")
            values = np.rint(values.astype(np.float64)).astype(np.int64)  # half-way cases to even
        columns.append(values)
        stream += 1
    components = np.concatenate(columns, axis=1)
    _require(components.shape[1] == width, "The attribute's streams overfill its accessor.")
    return components
