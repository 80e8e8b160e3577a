"""Reference unpacker of EXT_meshlet_transport, in plain Python.

Written from spec/EXT_meshlet_transport.md; read it beside that text. Clarity comes before speed. It
shares connectivity and predictors with the reference decoder of EXT_meshlet_edgebreaker, to whose
sections "A.6" and "A.7" refer.

A malformed view raises ValueError with one sentence.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field

from spec import blob_writer, predictors
from spec.blob_writer import FOREIGN, OWNED, PRIVATE
from spec.reference_decoder import Connectivity, decode_serial

VERSION = 1
WHOLE = 1 << 15
STATE_END = 1 << 31
GRID, COPY, GEO, AFFINE = 0, 2, 4, 5
MAX_BYTES = 448 << 20
TOKEN_BASE = [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128]
TOKEN_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 7]
SYMBOLS = "CLERS"
C, L, E, R, S = range(5)
OWNED_ONE, CANDIDATE, PRIVATE_ONE, FOREIGN_ONE = range(4)  # what a reference is
HALF_TURN = 1608  # in 1/512 of a radian
Value = list[int]


def require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def signed(x: int) -> int:
    """x modulo 2^32, as a signed integer."""
    return (x + 0x80000000 & 0xFFFFFFFF) - 0x80000000


# --- entropy coding ---


def shift_after(seen: int) -> int:
    """The shift of an adaptation."""
    return 2 + sum(seen >= limit for limit in (3, 8, 21, 55))


class Model:
    """Cumulative frequencies of 16 symbols, of WHOLE."""

    def __init__(self) -> None:
        self.cumulative = [i * WHOLE // 16 for i in range(16)]
        self.seen = 0

    def update(self, symbol: int) -> None:
        shift = shift_after(self.seen)
        self.seen += 1
        for i, c in enumerate(self.cumulative):
            target = i if i <= symbol else WHOLE - 16 + i
            self.cumulative[i] = c + (target - c >> shift)


class Flag:
    """The probability of a one, of WHOLE."""

    def __init__(self) -> None:
        self.one = WHOLE // 2
        self.seen = 0

    def update(self, bit: bool) -> None:
        shift = shift_after(self.seen)
        self.seen += 1
        self.one += WHOLE - 1 - self.one >> shift if bit else -(self.one - 1 >> shift)


class Models(dict[tuple, Model]):
    """Models by name and context. Each begins when it is first used."""

    def __missing__(self, key: tuple) -> Model:
        self[key] = Model()
        return self[key]


class Flags(dict[tuple, Flag]):
    def __missing__(self, key: tuple) -> Flag:
        self[key] = Flag()
        return self[key]


class PageReader:
    """Symbols by rANS, and plain bits."""

    def __init__(self, page: bytes) -> None:
        require(len(page) >= 20, "a packed page is shorter than its header.")
        self.triangles, self.meshlets, words, self.state = struct.unpack_from("<3IQ", page)
        require(20 + 4 * words <= len(page), "a packed page is shorter than its header says.")
        self.words = list(struct.unpack_from(f"<{words}I", page, 20))[::-1]
        self.bytes = page[20 + 4 * words :]
        self.bit = 0

    def _take(self, start: int, frequency: int) -> None:
        state = frequency * (self.state >> 15) + (self.state & WHOLE - 1) - start
        if state < STATE_END:
            require(bool(self.words), "a packed page ends early.")
            state = state << 32 | self.words.pop()
        self.state = state & (1 << 64) - 1

    def symbol(self, *models: Model) -> int:
        """A symbol by the mean of one or two models."""
        c = [sum(pair) // len(models) for pair in zip(*(m.cumulative for m in models))] + [WHOLE]
        slot = self.state & WHOLE - 1
        symbol = next(k for k in range(16) if slot < c[k + 1])
        self._take(c[symbol], c[symbol + 1] - c[symbol])
        for model in models:
            model.update(symbol)
        return symbol

    def flag(self, flag: Flag) -> bool:
        zero = WHOLE - flag.one
        bit = self.state & WHOLE - 1 >= zero
        self._take(zero, flag.one) if bit else self._take(0, zero)
        flag.update(bit)
        return bit

    def bits(self, count: int) -> int:
        end = self.bit + count
        require(end <= 8 * len(self.bytes), "a packed page ends early.")
        window = int.from_bytes(self.bytes[self.bit >> 3 : (end + 7) >> 3], "little")
        value = window >> (self.bit & 7) & (1 << count) - 1
        self.bit = end
        return value

    def finish(self) -> None:
        left = 8 * len(self.bytes) - self.bit
        require(
            self.state == STATE_END and not self.words and left < 8 and not self.bits(left),
            "a packed page does not end where its data do.",
        )


def token_of(x: int) -> int:
    if x < 4:
        return x
    length = x.bit_length()
    return 2 * length - 2 + (x >> length - 2 & 1) if length < 8 else 14 + (length > 8)


# --- a page ---


def stream_of(row: bytes) -> blob_writer.Stream:
    """The stream of a row of the stream table."""
    kind, elements, bits, predictor, chain, interior, anchor, zero, step, *offset = struct.unpack(
        "<8B5f", row
    )
    require(1 <= elements <= 4 and 1 <= bits <= 32, "a stream is out of range.")
    require(zero == 0, "a reserved byte is not zero.")
    require(bits <= 24 or predictor == COPY, "a stream has too many bits to be predicted.")
    require(predictor != GEO or (elements == 2 and 2 <= bits <= 16), "normals are out of range.")
    return blob_writer.Stream(
        kind, elements, bits, predictor, chain, interior, anchor, step, tuple(offset)
    )


@dataclass
class Reference:
    """A reference. owner: of a foreign one; user: of an owned one, the last that points at it.

    run: the local vertices along it, with both ends.
    """

    meshlet: int
    index: int
    kind: str
    loop_end: bool = False
    length: int = 0
    shares: list[bool] = field(default_factory=list)
    slot: int = 0
    owner: Reference | None = None
    user: Reference | None = None
    run: list[int] = field(default_factory=list)
    corners: list[int | None] = field(default_factory=list)  # opposite to the run's edges

    def foreign(self, s: int) -> bool:
        return self.kind == FOREIGN and self.shares[s]

    @property
    def open(self) -> bool:
        return self.kind == OWNED and self.user is None


@dataclass
class Step:
    """How a vertex is predicted: by corners of the vertex, opposite to others; or by neighbours."""

    vertex: int  # local id, of several with one number the first
    candidates: list[int]
    neighbours: list[int]  # corners


@dataclass
class Contexts:
    """Of a value's residuals."""

    class_: int
    spread: int
    level: int


@dataclass
class Candidate:
    """The parallelogram of the values a, b and, across their edge, o. x, y: vertices of a and b."""

    x: int
    y: int
    a: Value
    b: Value
    o: Value

    def parallelogram(self) -> Value:
        return [signed(i + j - k) for i, j, k in zip(self.a, self.b, self.o)]

    def diagonal(self) -> bool:
        """Is the edge the longest of its triangle?"""
        others = distance(self.a, self.o), distance(self.b, self.o)
        return distance(self.a, self.b) > max(others)


@dataclass
class Meshlet:
    symbols: str
    connectivity: Connectivity
    references: list[Reference] = field(default_factory=list)
    ids: list[list[int]] = field(default_factory=list)  # [stream][local id]
    corner: int = 0  # of its first triangle
    steps: list[Step] = field(default_factory=list)  # of stream 0

    def loop(self, j: int) -> tuple[int, int]:
        """First and last reference of the loop of reference j."""
        first = j
        while first > 0 and not self.references[first - 1].loop_end:
            first -= 1
        while not self.references[j].loop_end:
            j += 1
        return first, j

    def before(self, r: Reference) -> Reference:
        first, last = self.loop(r.index)
        return self.references[last if r.index == first else r.index - 1]

    def after(self, r: Reference) -> Reference:
        first, last = self.loop(r.index)
        return self.references[first if r.index == last else r.index + 1]


class Page:
    """Unpacks a page; `blob()` is its resident bytes."""

    def __init__(self, data: bytes, resident: int) -> None:
        self.reader = reader = PageReader(data)
        require(
            0 < reader.meshlets <= min(reader.triangles, resident)
            and reader.triangles <= min(64 * reader.meshlets, 8 * resident),
            "a packed page has impossible counts.",
        )
        self.models, self.flags = Models(), Flags()
        self.choices, self.smooth, self.angles = (bool(reader.bits(1)) for _ in range(3))
        self.streams = self._streams()
        self.meshlets: list[Meshlet] = []
        self.values: list[dict[int, Value]] = [{} for _ in self.streams]  # [stream][vertex]
        self.count = [0 for _ in self.streams]  # of vertices
        self.sizes: list[dict[int, int]] = [{} for _ in self.streams]
        self.opposite: list[int | None] = []
        self.corners: list[list[int]] = [[] for _ in self.streams]  # [stream][corner]: vertex
        for m in range(reader.meshlets):
            self._meshlet(m)
        require(
            sum(len(m.symbols) for m in self.meshlets) == reader.triangles,
            "a packed page has another number of triangles than its header says.",
        )
        for s, stream in enumerate(self.streams):
            self._begin_stream()
            if stream.predictor == GEO:
                self._normals(s)
                continue
            for meshlet in self.meshlets:
                self._values(meshlet, s)
        reader.finish()

    def _begin_stream(self) -> None:
        self.order: list[int] = []  # its vertices as they were coded
        self.last_match = 0
        self.last: Value = [0, 0, 0, 0]

    # --- numbers ---

    def _large(self, sign: bool) -> int:
        length = 9 + self.reader.symbol(self.models["large",])
        if length == 24:
            length = min(24 + self.reader.bits(4), 32)
        x = 1 << length - 1 | self.reader.bits(length - 1)
        return -x if sign and self.reader.bits(1) else x

    def _unsigned(self, *models: Model) -> int:
        token = self.reader.symbol(*models)
        if token == 15:
            return self._large(False)
        return TOKEN_BASE[token] + self.reader.bits(TOKEN_BITS[token])

    def _signed(self, *models: Model) -> int:
        token = self.reader.symbol(*models)
        if token == 15:
            return self._large(True)
        bits = self.reader.bits(TOKEN_BITS[token] + (token > 0))
        x = TOKEN_BASE[token] + (bits >> 1)
        return -x if bits & 1 else x

    # --- streams ---

    def _streams(self) -> list[blob_writer.Stream]:
        words = [0] * 7
        streams = []
        for s in range(self.reader.bits(6) + 1):
            for i in range(7):
                if self.reader.bits(1):
                    words[i] = self.reader.bits(32)
            streams.append(stream_of(struct.pack("<7I", *words)))
            require(streams[-1].predictor != GEO or s > 0, "normals come before positions.")
        return streams

    # --- connectivity ---

    def _meshlet(self, m: int) -> None:
        symbols = self._symbols()
        meshlet = Meshlet(symbols, decode_serial(symbols), corner=len(self.opposite))
        self.meshlets.append(meshlet)
        for disk in meshlet.connectivity.disks:
            self._loop(m, meshlet, disk.loop)
        self._resolve(meshlet)
        for s in range(len(self.streams)):
            self._number(meshlet, s)
        self._link(meshlet)

    def _symbols(self) -> str:
        """From the last one to the first."""
        high = self.reader.symbol(self.models["triangles.high",])
        low = self.reader.symbol(self.models["triangles.low", min(high, 3)])
        stored = high << 4 | low
        require(stored < 64, "a meshlet is too large.")
        parts = Parts()
        one, two, symbols = E, E, "E"
        for _ in range(stored):
            p, q = parts.gate()
            symbol = self.reader.symbol(
                self.models["gate", p, q], self.models["before", one, two, p]
            )
            require(symbol < 5, "a symbol is out of range.")
            parts.add(symbol)
            symbols = SYMBOLS[symbol] + symbols
            one, two = symbol, one
        return symbols

    def _candidate(self, r: Reference) -> tuple[int, Reference | None]:
        """(state, the open reference around the corner at which the foreign reference r ends)."""
        p = r.owner
        for _ in range(16):
            if p is None:
                break
            if p.meshlet == r.meshlet:
                return 1, None
            q = self.meshlets[p.meshlet].before(p)
            if q.kind == PRIVATE:
                return 2, None
            if q.open:
                return 3, q
            p = q.user if q.kind == OWNED else q.owner
        return 0, None

    def _loop(self, m: int, meshlet: Meshlet, loop: list[int]) -> None:
        """The references of a loop."""
        around, at = loop + loop[:1], 0
        while at < len(loop):
            left = len(loop) - at
            r = self._reference(m, meshlet, at == 0, left)
            require(r.length <= left, "an owner is longer than the loop has room.")
            r.run = around[at : at + r.length + 1]
            at += r.length
            r.loop_end = at == len(loop)

    def _reference(self, m: int, meshlet: Meshlet, fresh: bool, left: int) -> Reference:
        """left: edges of the loop without a reference. fresh: it is the first one of its loop."""
        require(len(meshlet.references) < 63, "a meshlet has too many references.")
        previous = None if fresh else meshlet.references[-1]
        after_foreign = previous is not None and previous.kind == FOREIGN
        state, candidate = 0, None
        if previous is not None and after_foreign:
            state, candidate = self._candidate(previous)
        context = "first" if previous is None else previous.kind
        what = self.reader.symbol(self.models["kind", context, state])
        require(what <= FOREIGN_ONE, "a reference is out of range.")
        require(what != CANDIDATE or candidate is not None, "a reference has no candidate.")
        r = Reference(m, len(meshlet.references), (OWNED, FOREIGN, PRIVATE, FOREIGN)[what])
        meshlet.references.append(r)
        if what == CANDIDATE:
            r.owner = candidate
        elif what == FOREIGN_ONE:
            self._owner(meshlet, r, 0 if fresh else 1 + after_foreign)
        if r.owner is not None:
            r.owner.user, r.length = r, r.owner.length
        else:
            r.length = self._length(r.kind, fresh, left)
        if r.kind == FOREIGN:
            before = meshlet.references[-2] if r.index else None
            self._shares(r, before)
        return r

    def _length(self, kind: str, fresh: bool, left: int) -> int:
        if left == 1 or self.reader.flag(self.flags["last", kind, fresh]):
            return left
        length = 1 + self._unsigned(
            self.models["length", token_of(left)], self.models["length of", kind, fresh]
        )
        require(length < left, "a reference is longer than its loop.")
        return length

    def _owner(self, meshlet: Meshlet, r: Reference, context: int) -> None:
        """Sets the owner; only its slot if that may come later in the meshlet."""
        delta = self._unsigned(self.models["delta", context])
        require(delta <= r.meshlet, "an owner is of a meshlet before the first.")
        members = self.meshlets[r.meshlet - delta].references
        owners = [q for q in members if q.open]
        if self.reader.flag(self.flags["taken",]):
            r.slot = self.reader.bits(6)
            if delta == 0:
                return
            owners = [q for q in members if q.kind == OWNED]
        elif len(owners) > 16:
            r.slot = self.reader.bits(6)
        elif len(owners) > 1:
            r.slot = self.reader.symbol(self.models["slot", len(owners)])
        require(r.slot < len(owners), "a slot is not among the owners.")
        r.owner = owners[r.slot]

    def _resolve(self, meshlet: Meshlet) -> None:
        """Owners that may come later in the meshlet. Then the slots of the blob."""
        owned = [q for q in meshlet.references if q.kind == OWNED]
        for r in meshlet.references:
            if r.kind == FOREIGN and r.owner is None:
                require(r.slot < len(owned), "a slot is not among the owners of its meshlet.")
                require(owned[r.slot].length == r.length, "an owner has another length.")
                r.owner = owned[r.slot]
                r.owner.user = r
        for r in meshlet.references:
            if r.owner is not None:
                members = self.meshlets[r.owner.meshlet].references[: r.owner.index]
                r.slot = sum(q.kind == OWNED for q in members)

    def _shares(self, r: Reference, previous: Reference | None) -> None:
        r.shares = [True]
        for s in range(1, len(self.streams)):
            seam = previous is not None and previous.kind == FOREIGN and not previous.shares[s]
            r.shares.append(self.reader.flag(self.flags["share", s, r.shares[-1], seam]))

    # --- numbers of vertices, corners ---

    def _hop(self, r: Reference, s: int) -> Reference | None:
        """The reference at whose start the corner of r is in an owner; None if it is stored."""
        p = self.meshlets[r.meshlet].before(r)
        if (
            r.foreign(s)
            and r.owner
            and not (p.foreign(s) and p.owner and p.owner.meshlet < r.owner.meshlet)
        ):
            return self.meshlets[r.owner.meshlet].after(r.owner)
        return p.owner if p.foreign(s) else None

    def _number(self, meshlet: Meshlet, s: int) -> None:
        names: dict[int, tuple[Meshlet, int]] = {}
        for r in meshlet.references:
            h = self._hop(r, s)
            for _ in range(8):
                further = self._hop(h, s) if h is not None and h.meshlet == r.meshlet else None
                if further is None:
                    break
                h = further
            else:
                raise ValueError("a corner is more than 8 hops away.")
            if h is not None:
                names[r.run[0]] = self.meshlets[h.meshlet], h.run[0]
            if r.foreign(s) and r.owner:
                for v, w in zip(r.run[1:-1], r.owner.run[-2:0:-1]):
                    names[v] = self.meshlets[r.owner.meshlet], w
        ids: list[int | None] = []
        for v in range(meshlet.connectivity.vertex_count):
            ids.append(None if v in names else self.count[s])
            self.count[s] += v not in names
        for v in names:
            owner, w = names[v]
            for _ in range(64):
                if owner is not meshlet or w not in names:
                    break
                owner, w = names[w]
            else:
                raise ValueError("vertices of a meshlet refer to each other.")
            ids[v] = ids[w] if owner is meshlet else owner.ids[s][w]
        meshlet.ids.append([i for i in ids if i is not None])

    def _link(self, meshlet: Meshlet) -> None:
        edges: dict[tuple[int, int], int] = {}
        triangles = meshlet.connectivity.triangles
        for t, triangle in enumerate(triangles):
            for k in range(3):
                edge = triangle[(k + 1) % 3], triangle[(k + 2) % 3]
                edges[edge] = meshlet.corner + 3 * t + k
        for triangle in triangles:
            for k in range(3):
                self.opposite.append(edges.get((triangle[(k + 2) % 3], triangle[(k + 1) % 3])))
        for s, ids in enumerate(meshlet.ids):
            self.corners[s] += [ids[v] for triangle in triangles for v in triangle]
        for r in meshlet.references:
            r.corners = [edges.get(edge) for edge in zip(r.run, r.run[1:])]
        for r in meshlet.references:
            if r.owner is not None:
                for c, d in zip(r.corners, reversed(r.owner.corners)):
                    if c is not None and d is not None:
                        self.opposite[c], self.opposite[d] = d, c

    # --- values ---

    def _values(self, meshlet: Meshlet, s: int) -> None:
        """The vertices of a meshlet that are new in stream s."""
        if s == 0:
            meshlet.steps = Plan(self, meshlet, s).steps
        foreign = [r for r in meshlet.references if r.kind == FOREIGN]
        shared = all(r.shares[s] for r in foreign)
        for step in meshlet.steps if shared else Plan(self, meshlet, s).steps:
            self._value(meshlet, s, step)

    def _value(self, meshlet: Meshlet, s: int, step: Step) -> None:
        match = 0
        if step.candidates:
            prediction, contexts = self._predict(s, step.candidates)
        else:
            prediction, contexts = self._start(s, step.neighbours)
            match = self._match(s, len(step.neighbours))
        number, size = meshlet.ids[s][step.vertex], 0
        if match:
            value = self.values[s][self.order[-match]]
        else:
            value, size = self._residual(s, prediction, contexts)
        self.values[s][number] = self.last = value
        self.sizes[s][number] = min(size, 255)
        self.order.append(number)

    def _kind(self, s: int) -> int:
        stream = self.streams[s]
        return 0 if s == 0 else 1 if (stream.kind, stream.elements) == (GRID, 2) else 2

    def _residual(self, s: int, prediction: Value, contexts: Contexts) -> tuple[Value, int]:
        """(value, the sum of the residuals' magnitudes)."""
        stream, kind = self.streams[s], self._kind(s)
        mask = (1 << stream.bits) - 1
        if stream.bits < 32:
            prediction = [min(max(x, 0), mask) for x in prediction]
        value, size = [], 0
        for e in range(stream.elements):
            models = [self.models["first", kind, contexts.class_, contexts.spread, contexts.level]]
            if e:
                token = token_of((2 if e == 1 else 1) * size & 0xFFFFFFFF)
                models = [
                    self.models["near", kind, e, contexts.class_, contexts.spread],
                    self.models["around", kind, e, token],
                ]
            d = self._signed(*models)
            size += abs(d)
            value.append(prediction[e] + d & mask)
        return value, size & 0xFFFFFFFF

    def _candidate_of(self, s: int, c: int) -> Candidate:
        x, y, z = self._around(s, c)
        return Candidate(x, y, *(self.values[s][i] for i in (x, y, z)))

    def _around(self, s: int, c: int) -> list[int]:
        """The vertices x, y and z of the candidate at corner c."""
        first = c - c % 3
        across = self.opposite[c]
        assert across is not None
        corners = self.corners[s]
        return [corners[first + (c + 1) % 3], corners[first + (c + 2) % 3], corners[across]]

    def _predict(self, s: int, candidates: list[int]) -> tuple[Value, Contexts]:
        one = self._candidate_of(s, candidates[0])
        level = level_of(sum(self.sizes[s][i] for i in self._around(s, candidates[0])))
        if s == 0 and len(candidates) == 2:
            return self._choose(one, self._candidate_of(s, candidates[1]), level)
        prediction = one.parallelogram()
        if self._kind(s) == 1:
            c = candidates[0]
            ids = [*self._around(0, c), self.corners[0][c]]
            weights = predictors.affine_weights(*(self.values[0][i] for i in ids))
            if weights is not None:
                prediction = predictors.affine_apply(one.a, one.b, one.o, *weights)
        return prediction, Contexts(1 + one.diagonal(), token_of(distance(one.a, one.b)), level)

    def _choose(self, one: Candidate, two: Candidate, level: int) -> tuple[Value, Contexts]:
        p, q = one.parallelogram(), two.parallelogram()
        apart = distance(p, q)
        spread, choice = token_of(apart), 0
        if self.choices and apart > self.streams[0].elements:
            diagonals = one.diagonal() + 2 * two.diagonal()
            choice = min(self.reader.symbol(self.models["choice", diagonals, spread]), 2)
        prediction = (mean(one, two, self.smooth), p, q)[choice]
        return prediction, Contexts(4 if choice else 3, spread, level)

    def _start(self, s: int, neighbours: list[int]) -> tuple[Value, Contexts]:
        """Without candidates."""
        ids = [self.corners[s][c] for c in neighbours]
        if not ids:
            return self.last, Contexts(0, 0, 3)
        p, q = self.values[s][ids[0]], self.values[s][ids[-1]]
        level = level_of(3 * self.sizes[s][ids[0]])
        if len(ids) == 1:
            return p, Contexts(0, 1, level)
        middle = [signed(x + y) >> 1 for x, y in zip(p, q)]
        return middle, Contexts(0, token_of(distance(p, q)), level)

    def _match(self, s: int, neighbours: int) -> int:
        context = 2 * (self.last_match > 0) + (neighbours > 0)
        self.last_match = self._unsigned(self.models["match", s > 0, context])
        require(self.last_match <= len(self.order), "a vertex repeats one that is not there.")
        return self.last_match

    def _normals(self, s: int) -> None:
        """An OCT stream that GEO predicts."""
        stream, n = self.streams[s], self.count[s]
        sums = self._normal_sums(s)
        centre = ((1 << stream.bits) - 2) // 2
        last = before = 0
        for i in range(n):
            p = [x - centre for x in predictors.octahedral(sums[i], stream.bits)]
            inside_out = abs(p[0]) + abs(p[1]) > centre
            if inside_out:
                p = invert(p[0], p[1], centre)
            area = min(max(abs(x) for x in sums[i]).bit_length() // 2, 15)
            near = token_of(2 * last + before)
            size, q = 0, [0, 0]
            for e in range(2):
                second = token_of(size) if e else near
                d = self._signed(self.models["normal", e, area, second])
                require(abs(d) <= 2 * centre, "a normal is out of range.")
                size += abs(d)
                q[e] = (p[e] + d + centre) % (2 * centre + 1) - centre
            before, last = last, min(size, 255)
            if inside_out:
                q = invert(q[0], q[1], centre)
                if max(abs(q[0]), abs(q[1])) == centre:
                    q = [
                        -x if self.reader.flag(self.flags["mirrored", e]) else x
                        for e, x in enumerate(q)
                    ]
            self.values[s][i] = [x + centre for x in q]

    def _normal_sums(self, s: int) -> list[list[int]]:
        sums = [[0, 0, 0] for _ in range(self.count[s])]
        shift = max(0, self.streams[0].bits - 12)
        for c in range(0, len(self.opposite), 3):
            a, b, v = (
                [x >> shift for x in self.values[0][self.corners[0][c + k]]] for k in range(3)
            )
            e, f = minus(b, a), minus(v, a)
            normal = [
                e[1] * f[2] - e[2] * f[1],
                e[2] * f[0] - e[0] * f[2],
                e[0] * f[1] - e[1] * f[0],
            ]
            weights = [1, 1, 1]
            if self.angles:
                length = math.isqrt(dot(normal, normal))
                if length == 0:
                    continue
                scale = (1 << 38) // length
                normal = [x * scale >> 26 for x in normal]
                first, second = angle(dot(e, f), length), angle(dot(e, minus(e, f)), length)
                weights = [first, second, HALF_TURN - first - second]
            for k, weight in enumerate(weights):
                i = self.corners[s][c + k]
                sums[i] = [signed(x + weight * y) for x, y in zip(sums[i], normal)]
        return sums


class Parts:
    """The parts of a meshlet that symbols have built, from the last symbol to the first.

    The border of each is a ring of nodes, with the number of triangles at each. Begins with the
    last triangle.
    """

    def __init__(self) -> None:
        self.next: list[int] = []
        self.previous: list[int] = []
        self.triangles: list[int] = []
        self.gates: list[int] = []  # of each part, the first node of its gate
        self._triangle()

    def gate(self) -> tuple[int, int]:
        """The numbers of triangles at the gate of the last part, up to 9."""
        p = self.gates[-1]
        return min(self.triangles[p], 9), min(self.triangles[self.next[p]], 9)

    def add(self, symbol: int) -> None:
        """Adds a triangle."""
        if symbol == E:
            self._triangle()
            return
        p = self.gates.pop()
        q = self.next[p]
        self.triangles[q] += 1
        if symbol == C:  # p is an inner vertex now
            a = self.previous[p]
            self.triangles[a] += 1
            self._join(a, q)
            self.gates.append(a)
            return
        self.triangles[p] += 1
        if symbol == S:
            require(bool(self.gates), "an S has no two parts to join.")
            a = self.gates[-1]
            v = self.next[a]  # v and p are one vertex
            self.triangles[a] += 1
            self.triangles[p] += self.triangles[v]
            self._join(p, self.next[v])
            self._join(a, q)
            return
        v = self._node()
        self._join(p, v)
        self._join(v, q)
        self.gates.append(v if symbol == L else p)

    def _node(self) -> int:
        for links in (self.next, self.previous):
            links.append(0)
        self.triangles.append(1)
        return len(self.triangles) - 1

    def _join(self, p: int, q: int) -> None:
        self.next[p], self.previous[q] = q, p

    def _triangle(self) -> None:
        a, b, v = (self._node() for _ in range(3))
        for p, q in ((a, b), (b, v), (v, a)):
            self._join(p, q)
        self.gates.append(a)


class Plan:
    """The order of the vertices of a meshlet that are new in a stream: its steps."""

    def __init__(self, page: Page, meshlet: Meshlet, s: int) -> None:
        self.page, self.meshlet, self.s = page, meshlet, s
        ids = meshlet.ids[s]
        self.unknown = {i for i in ids if i not in page.values[s]}
        self.first = {i: v for v, i in reversed(list(enumerate(ids)))}  # local id of a vertex
        self.triangles = [[ids[v] for v in t] for t in meshlet.connectivity.triangles]
        self.candidates: dict[int, list[int]] = {i: [] for i in ids}
        self.steps: list[Step] = []
        for t in range(len(self.triangles)):
            if len(self.missing(t)) == 1:
                self.add(t)
        while self.unknown:
            vertex, step = self.next_step()
            self.steps.append(step)
            self.know(vertex)

    def missing(self, t: int) -> list[int]:
        """The vertices of its corners without a value."""
        return [i for i in self.triangles[t] if i in self.unknown]

    def add(self, t: int) -> None:
        """Triangle t lacks one vertex: it is a candidate if the vertex across is known."""
        (missing,) = self.missing(t)
        if len(self.candidates[missing]) == 2:
            return
        c = self.meshlet.corner + 3 * t + self.triangles[t].index(missing)
        across, begin = self.page.opposite[c], self.meshlet.corner
        if across is None or across >= begin + 3 * len(self.triangles):
            return
        if across >= begin and self.triangles[(across - begin) // 3][across % 3] in self.unknown:
            return
        if self.s and self.is_seam(c, across):
            return
        self.candidates[missing].append(c)

    def is_seam(self, c: int, d: int) -> bool:
        """Do the two vertices of the edge have other numbers on its other side?"""
        corners = self.page.corners[self.s]
        ends = [[corners[x // 3 * 3 + (x + i) % 3] for i in (1, 2)] for x in (c, d)]
        return ends[0] != ends[1][::-1]

    def next_step(self) -> tuple[int, Step]:
        """The next vertex, and how it is predicted."""
        order = sorted(self.unknown, key=lambda i: self.first[i])
        most = max(len(self.candidates[i]) for i in order)
        if most:
            i = next(i for i in order if len(self.candidates[i]) == most)
            return i, Step(self.first[i], self.candidates[i], [])
        for lacking in (1, 2):
            for t, triangle in enumerate(self.triangles):
                missing = self.missing(t)
                if len(missing) == lacking:
                    known = [k for k in (2, 1, 0) if triangle[k] not in self.unknown]
                    corners = [self.meshlet.corner + 3 * t + k for k in known]
                    return missing[0], Step(self.first[missing[0]], [], corners)
        return order[0], Step(self.first[order[0]], [], [])

    def know(self, i: int) -> None:
        """The vertex is known now: adds the candidates that it completes."""
        self.unknown.remove(i)
        around = [t for t, triangle in enumerate(self.triangles) if i in triangle]
        for t in around:
            if len(self.missing(t)) == 1:
                self.add(t)
        for t in around:
            if not self.missing(t):  # the vertex may be across from another triangle's
                k = self.triangles[t].index(i)
                across = self.page.opposite[self.meshlet.corner + 3 * t + k]
                u = -1 if across is None else (across - self.meshlet.corner) // 3
                if 0 <= u < len(self.triangles) and len(self.missing(u)) == 1:
                    self.add(u)


def mean(one: Candidate, two: Candidate, smooth: bool) -> Value:
    """The mean of two candidates. With one common vertex of their edges, it may be weighted."""
    x, y = (v in (two.x, two.y) for v in (one.x, one.y))
    if not smooth or x == y:
        pairs = zip(one.parallelogram(), two.parallelogram())
        return [signed(p + q + 1) >> 1 for p, q in pairs]
    common = one.a if x else one.b
    elements = zip(common, one.a, one.b, two.a, two.b, one.o, two.o)
    return [
        signed(4 * m + 5 * (a + b + c + d - 2 * m) - 3 * (o + q) + 4) >> 3
        for m, a, b, c, d, o, q in elements
    ]


def level_of(size: int) -> int:
    return sum(size >= limit for limit in (3, 8, 24))


def distance(p: Value, q: Value) -> int:
    return sum(abs(signed(x - y)) for x, y in zip(p, q)) & 0xFFFFFFFF


def angle(x: int, y: int) -> int:
    """The angle of the vector (x, y), y >= 0, nearly."""
    large, small = max(abs(x), y), min(abs(x), y)
    k = max(0, large.bit_length() - 19)
    q = (small >> k << 12) // max(large >> k, 1)
    turn = q * (402 + (140 * (4096 - q) >> 12)) >> 12
    if y > abs(x):
        turn = HALF_TURN // 2 - turn
    return HALF_TURN - turn if x < 0 else turn


def invert(s: int, t: int, centre: int) -> Value:
    """Turns the octahedral square inside out."""
    signs = [1 if x > 0 else -1 for x in (s, t)]
    if min(s, t) >= 0:
        signs = [1, 1]
    if max(s, t) <= 0:
        signs = [-1, -1]
    c, d = signs[0] * centre, signs[1] * centre
    u, v = 2 * s - c, 2 * t - d
    if signs[0] == signs[1]:
        u, v = -u, -v
    return [(v + c) // 2, (u + d) // 2]


def minus(a: Value, b: Value) -> Value:
    return [x - y for x, y in zip(a, b)]


def dot(a: Value, b: Value) -> int:
    return sum(x * y for x, y in zip(a, b))


# --- canonical form ---


def zigzag(value: Value, prediction: Value, bits: int) -> Value:
    half = 1 << bits - 1
    differences = [(x - y + half) % (2 * half) - half for x, y in zip(value, prediction)]
    return [2 * d if d >= 0 else -2 * d - 1 for d in differences]


class Residuals:
    """The lists of a meshlet's blob for stream s."""

    def __init__(self, page: Page, meshlet: Meshlet, s: int) -> None:
        self.stream = page.streams[s]
        self.meshlet = meshlet
        self.values = [page.values[s][i] for i in meshlet.ids[s]]
        self.positions = [page.values[0][i] for i in meshlet.ids[0]]
        own = [r for r in meshlet.references if not r.foreign(s)]
        corners = [r.run[0] for r in own if not meshlet.before(r).foreign(s)]
        self.anchors = [self.values[v] for v in corners]
        self.chain: list[Value] = []
        self.interior: list[Value] = []
        for r in own:
            if r.kind == OWNED:
                self.chain += self._chain(r.run)
            elif r.kind == FOREIGN:
                self.interior += self._chain(r.run)
        self.interior += self._traversed(page.streams[0].bits)

    def _chain(self, run: list[int]) -> list[Value]:
        values, n = [self.values[v] for v in run], len(run) - 1
        residuals = []
        for i in range(1, n):
            if self.stream.predictor == COPY:
                prediction = values[i - 1]
            elif self.stream.predictor == AFFINE:
                positions = [self.positions[v] for v in run]
                prediction = predictors.affine_chain(values, positions, i)
            else:
                prediction = predictors.toward(values[i - 1], values[n], n - i + 1)
            residuals.append(zigzag(values[i], prediction, self.stream.bits))
        return residuals

    def _traversed(self, position_bits: int) -> list[Value]:
        connectivity = self.meshlet.connectivity
        known: set[int] = set()
        for r in self.meshlet.references:
            known.update(r.run[:1] if r.kind == PRIVATE else r.run[:-1])
        normals: list[list[int]] = []
        if self.stream.predictor == GEO:
            normals = predictors.normals(connectivity.triangles, self.positions, position_bits)
        residuals = []
        for disk in connectivity.disks:
            visits: list[tuple[int, int, int, int | None]] = []
            visits.append((disk.loop[-1], disk.first, disk.first, None))
            for t in range(disk.triangle_begin, disk.triangle_end):
                a, b, v = connectivity.triangles[t]
                visits.append((v, a, b, connectivity.opposite[t]))
            for v, a, b, o in visits:
                if v in known:
                    continue
                known.add(v)
                if self.stream.predictor == GEO:
                    prediction = predictors.octahedral(normals[v], self.stream.bits)
                elif a == b:
                    prediction = self.values[b]
                else:
                    prediction = predictors.apex(
                        self.stream.predictor, self.values, self.positions, a, b, o, v
                    )
                residuals.append(zigzag(self.values[v], prediction, self.stream.bits))
        return residuals


def best_code(residuals: list[Value], elements: int, chain: bool, base: int) -> blob_writer.Code:
    """The code of the fewest bits, of several the first."""
    flat = [u for vertex in residuals for u in vertex]
    sizes: dict[int, int] = {}
    for code in range(7):
        exponential = not chain and code >= 4
        k = max(base, 1) - 1 + code - 4 if exponential else base + code
        if exponential:
            quotients = [blob_writer.exp_golomb(u, k)[0] for u in flat]
            possible, bits = max(quotients, default=0) <= 31, sum(2 * q for q in quotients)
        else:
            quotients = [u >> k for u in flat]
            possible, bits = max(quotients, default=0) <= 16383, sum(quotients)
        if k <= 31 and possible:
            sizes[code] = bits + len(flat) * (k + 1)
    widths = [max(column).bit_length() for column in zip(*residuals)] or [0] * elements
    widths = [32 if width == 31 else width for width in widths]
    fixed = 5 * elements + len(residuals) * sum(widths)
    best = min(sizes, key=lambda code: sizes[code], default=None)  # of several the first
    return widths if best is None or fixed < sizes[best] else best


def written(page: Page, meshlet: Meshlet) -> blob_writer.Meshlet:
    """A meshlet as blob_writer takes it."""
    loops: list[list[blob_writer.Reference]] = []
    fresh = True
    whole = len(meshlet.references) == len(meshlet.connectivity.disks)  # a reference per loop
    private = all(r.kind == PRIVATE for r in meshlet.references)
    for r in [] if whole and private else meshlet.references:
        if fresh:
            loops.append([])
        delta = r.meshlet - r.owner.meshlet if r.owner else 0
        loops[-1].append(
            blob_writer.Reference(r.kind, r.length, delta, r.slot, tuple(r.shares[1:]))
        )
        fresh = r.loop_end
    lists = [Residuals(page, meshlet, s) for s in range(len(page.streams))]
    codes = [
        [
            best_code(
                of.chain if chain else of.interior,
                of.stream.elements,
                chain,
                of.stream.chain_base if chain else of.stream.interior_base,
            )
            for of in lists
        ]
        for chain in (True, False)
    ]
    anchors = [
        of.anchors[:1] + blob_writer.further_anchors(of.stream, of.anchors) if of.anchors else []
        for of in lists
    ]
    return blob_writer.Meshlet(
        meshlet.symbols,
        loops,
        anchors,
        codes[0],
        [of.chain for of in lists],
        codes[1],
        [of.interior for of in lists],
    )


def group_layout(group: list[blob_writer.Meshlet]) -> blob_writer.Layout:
    """The least widths; flags that a meshlet needs; the symbol table of fewer bits."""
    foreign = [r for m in group for r in m.references if r.kind == FOREIGN]
    symbols = "".join(m.symbols[:-1] for m in group)
    return blob_writer.Layout(
        delta_width=max((r.delta for r in foreign), default=0).bit_length(),
        slot_width=max((r.slot for r in foreign), default=0).bit_length(),
        reference_width=max(len(m.references) for m in group).bit_length(),
        second_table=2 * symbols.count("L") > symbols.count("C") + symbols.count("E"),
    )


def vertex_count(page: Page) -> int:
    """A.8: local vertices that are no aliases."""
    count = 0
    for meshlet in page.meshlets:
        count += meshlet.connectivity.vertex_count
        for r in meshlet.references:
            whole = r.kind == FOREIGN and all(r.shares)
            p = meshlet.before(r)
            count -= (r.length - 1) * whole
            count -= whole or (p.kind == FOREIGN and all(p.shares))
    return count


def write_page(page: Page) -> bytes:
    """The blob in canonical form."""
    meshlets = [written(page, meshlet) for meshlet in page.meshlets]
    return blob_writer.write_blob(
        page.streams, meshlets, vertex_count(page), lambda g: group_layout(meshlets[32 * g :][:32])
    )


def unpack_page(data: bytes, resident: int) -> bytes:
    """The blob of a packed page. resident: its length by the page table."""
    blob = write_page(Page(data, resident))
    require(len(blob) == resident, "a packed page does not have the length that its table says.")
    return blob


def page_table(data: bytes) -> list[tuple[bytes, int]]:
    """The bytes of each page in the packed view, as many as resident ones if it is raw; and the
    number of its resident bytes."""
    require(len(data) >= 4, "the packed view is too short.")
    word = int.from_bytes(data[:4], "little")
    require(word & 255 == VERSION, "the packed view is of another version.")
    count = word >> 8
    begin = 4 + 8 * count
    require(count > 0 and begin <= len(data), "the packed view is shorter than its page table.")
    table = list(struct.iter_unpack("<2I", data[4:begin]))
    require(
        begin + sum(packed or size for size, packed in table) == len(data),
        "the packed view does not have the length of its pages.",
    )
    pages = []
    for size, packed in table:
        length = packed or size
        require(0 < size <= MAX_BYTES and packed <= MAX_BYTES, "a page has an impossible length.")
        require(size <= 4096 + 256 * length, "a page has an impossible length.")
        require(packed != size, "a packed page is as long as its resident bytes.")
        pages.append((data[begin : begin + length], size))
        begin += length
    return pages


def unpack_view(data: bytes) -> bytes:
    """The resident bytes of a packed view."""
    return b"".join(
        page if len(page) == size else unpack_page(page, size) for page, size in page_table(data)
    )
