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


@dataclass
class Reference:
    """A reference. owner: of a foreign one; user: of an owned one, the last that points at it.

    run: the local vertices along it, with both ends.
    """

    meshlet: int
    index: int
    kind: str
    loop_end: bool = True
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

    vertex: int  # local id
    candidates: list[int]
    neighbours: list[int]  # corners


@dataclass
class Meshlet:
    references: list[Reference]
    stored: int  # references in the blob
    symbols: str = ""
    connectivity: Connectivity | None = None
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
        self.choices, matches, copies, self.angles, self.repeats = (
            reader.bits(1) for _ in range(5)
        )
        self.matches = (matches, copies)  # of stream 0, of others
        self.streams = self._streams()
        self.meshlets: list[Meshlet] = []
        self.values: list[dict[int, Value]] = [{} for _ in self.streams]  # [stream][vertex]
        self.count = [0 for _ in self.streams]  # of vertices
        self.sizes: list[dict[int, int]] = [{} for _ in self.streams]
        self.valence: dict[int, int] = {}
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

    def _large(self, name: str, sign: bool) -> int:
        length = 9 + self.reader.symbol(self.models[name, "large"])
        if length == 24:
            length = min(24 + self.reader.bits(4), 32)
        x = 1 << length - 1 | self.reader.bits(length - 1)
        return -x if sign and self.reader.bits(1) else x

    def _unsigned(self, name: str, a: Model, b: Model) -> int:
        token = self.reader.symbol(a, b)
        if token == 15:
            return self._large(name, False)
        return TOKEN_BASE[token] + self.reader.bits(TOKEN_BITS[token])

    def _signed(self, name: str, *models: Model) -> int:
        token = self.reader.symbol(*models)
        if token == 15:
            return self._large(name, True)
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
            kind, elements, bits, predictor, chain, interior, anchor, zero, step, *offset = (
                struct.unpack("<8B5f", struct.pack("<7I", *words))
            )
            require(
                1 <= elements <= 4 and 1 <= bits <= 32 and zero == 0, "a stream is out of range."
            )
            require(bits <= 24 or predictor == COPY, "a stream is out of range.")
            require(
                predictor != GEO or (s > 0 and elements == 2 and 2 <= bits <= 16),
                "a stream is out of range.",
            )
            streams.append(
                blob_writer.Stream(
                    kind, elements, bits, predictor, chain, interior, anchor, step, tuple(offset)
                )
            )
        return streams

    # --- connectivity ---

    def _count(self, name: str) -> int:
        high = self.reader.symbol(self.models[name, "high"])
        return high << 4 | self.reader.symbol(self.models[name, "low", min(high, 3)])

    def _meshlet(self, m: int) -> None:
        triangles, stored = self._count("triangles") + 1, self._count("references")
        require(triangles <= 64 and stored <= 63, "a meshlet is too large.")
        meshlet = Meshlet([], stored, corner=len(self.opposite))
        self.meshlets.append(meshlet)
        if stored:
            self._references(m, meshlet)
        meshlet.symbols = self._symbols(meshlet, triangles)
        connectivity = meshlet.connectivity = decode_serial(meshlet.symbols)
        if not stored:
            meshlet.references = [Reference(m, d, PRIVATE) for d in range(len(connectivity.disks))]
        self._place(meshlet)
        for s in range(len(self.streams)):
            self._number(meshlet, s)
        self._link(meshlet)
        for c in self.corners[0][meshlet.corner :]:
            self.valence[c] = self.valence.get(c, 0) + 1

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

    def _references(self, m: int, meshlet: Meshlet) -> None:
        fresh, before, before_before = True, 0, 3
        pending: list[Reference] = []  # foreign ones whose owner may come later in the meshlet
        for j in range(meshlet.stored):
            last = j + 1 == meshlet.stored
            previous = meshlet.references[-1] if j else None
            after_foreign = previous is not None and previous.kind == FOREIGN
            state, candidate = 0, None
            if not fresh and previous is not None and after_foreign:
                state, candidate = self._candidate(previous)
            context = 4 if fresh else before
            what = self.reader.symbol(
                self.models["kind", context, state + 4 * (before_before == 0)]
            )
            require(what <= 3 and (what != 1 or candidate is not None), "a reference is damaged.")
            before_before, before = before, what
            r = Reference(m, j, (OWNED, FOREIGN, PRIVATE, FOREIGN)[what])
            meshlet.references.append(r)
            if not last:
                r.loop_end = self.reader.flag(self.flags["loop end", r.kind])
            if what == 1:
                r.owner = candidate
            elif what == 3:
                self._owner(meshlet, r, fresh, after_foreign, pending)
            if r.kind == FOREIGN:
                if r.owner is not None:
                    r.owner.user, r.length = r, r.owner.length
                self._shares(r, previous)
            elif r.kind == OWNED or not (r.loop_end and fresh):
                kind = (OWNED, FOREIGN, PRIVATE).index(r.kind)
                r.length = 1 + self._unsigned(
                    "length",
                    self.models["length", min(meshlet.stored, 15)],
                    self.models["length at", kind * 4 + last + 2 * fresh],
                )
                require(r.length <= 64, "a reference is too long.")
            fresh = r.loop_end
        for r in pending:
            owned = [q for q in meshlet.references if q.kind == OWNED]
            require(r.slot < len(owned), "a reference has no owner.")
            r.owner = owned[r.slot]
            r.owner.user, r.length = r, r.owner.length
        for r in meshlet.references:
            if r.owner is not None:
                members = self.meshlets[r.owner.meshlet].references[: r.owner.index]
                r.slot = sum(q.kind == OWNED for q in members)

    def _owner(
        self,
        meshlet: Meshlet,
        r: Reference,
        fresh: bool,
        after_foreign: bool,
        pending: list[Reference],
    ) -> None:
        delta = self._unsigned(
            "delta",
            self.models["delta", 0 if fresh else 1],
            self.models["delta", 2 + after_foreign],
        )
        require(delta <= r.meshlet, "a reference has no owner.")
        members = self.meshlets[r.meshlet - delta].references
        if delta == 0:
            members = members[: r.index]
        choices = [q for q in members if q.open]
        slot = 0
        if self.reader.flag(self.flags["claimed",]):
            slot = self.reader.bits(6)
            if delta == 0:
                r.slot = slot
                pending.append(r)
                return
            choices = [q for q in members if q.kind == OWNED]
        elif len(choices) > 16:
            slot = self.reader.bits(6)
        elif len(choices) > 1:
            slot = self.reader.symbol(self.models["slot", len(choices)])
        require(slot < len(choices), "a reference has no owner.")
        r.owner = choices[slot]

    def _shares(self, r: Reference, previous: Reference | None) -> None:
        r.shares = [True]
        for s in range(1, len(self.streams)):
            seam = previous is not None and previous.kind == FOREIGN and not previous.shares[s]
            r.shares.append(self.reader.flag(self.flags["share", s, r.shares[-1], seam]))

    def _place(self, meshlet: Meshlet) -> None:
        assert meshlet.connectivity is not None
        rest = list(meshlet.references)
        for disk in meshlet.connectivity.disks:
            around, at = disk.loop + disk.loop[:1], 0
            first = True
            while True:
                require(bool(rest), "the references do not fit the loops.")
                r = rest.pop(0)
                if r.kind == PRIVATE and r.loop_end and first:
                    r.length = len(disk.loop)
                require(0 < r.length <= len(disk.loop) - at, "the references do not fit the loops.")
                r.run = around[at : at + r.length + 1]
                at += r.length
                first = False
                if r.loop_end:
                    break
            require(at == len(disk.loop), "the references do not fit the loops.")
        require(not rest, "the references do not fit the loops.")

    def _symbols(self, meshlet: Meshlet, triangles: int) -> str:
        ring = Ring(self, meshlet)
        symbols = ""
        fresh = True
        for _ in range(triangles - 1):
            if fresh:
                ring.begin_disk()
            k = self.reader.symbol(self.models["gate", ring.state(ring.b), ring.state(ring.a)])
            require(k < 5, "a symbol is damaged.")
            symbols += SYMBOLS[k]
            fresh = ring.advance(SYMBOLS[k])
        return symbols + "E"

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
        assert meshlet.connectivity is not None
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
        assert meshlet.connectivity is not None
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
        stream, values = self.streams[s], self.values[s]
        kind = 0 if s == 0 else 1 if (stream.kind, stream.elements) == (GRID, 2) else 2
        match = 0
        if step.candidates:
            prediction, class_, spread, around = self._predict(s, kind, step.candidates)
        else:
            prediction, spread, around = self._start(s, step.neighbours)
            class_ = 0
            match = self._match(s, len(step.neighbours)) if self.matches[s > 0] else 0
        number, size, mask = meshlet.ids[s][step.vertex], 0, (1 << stream.bits) - 1
        if match:
            value = values[self.order[-match]]
        else:
            if stream.bits < 32:
                prediction = [min(max(x, 0), signed(mask)) for x in prediction]
            level = 0 if around < 3 else 1 if around < 6 else 2 if around < 9 else 3
            value = []
            for e in range(stream.elements):
                models = [self.models["first", kind, class_, spread, level]]
                if e:
                    token = token_of((2 if e == 1 else 1) * size & 0xFFFFFFFF)
                    models = [
                        self.models["near", kind, e, class_, spread],
                        self.models["around", kind, e, token, level],
                    ]
                d = self._signed(f"values {kind}", *models)
                size += abs(d)
                value.append(prediction[e] + d & mask)
            size &= 0xFFFFFFFF
        values[number] = self.last = value
        self.sizes[s][number] = min(size, 255)
        self.order.append(number)

    def _predict(self, s: int, kind: int, candidates: list[int]) -> tuple[Value, int, int, int]:
        """(prediction, class, token of the spread, token of the residuals around)."""
        values = self.values[s]

        def points(c: int, s: int) -> list[int]:
            """Of a candidate: the vertices of x, y and z in stream s, and the one at corner c."""
            x, y = c // 3 * 3 + (c + 1) % 3, c // 3 * 3 + (c + 2) % 3
            across = self.opposite[c]
            assert across is not None
            return [self.corners[s][i] for i in (x, y, across, c)]

        ids = points(candidates[0], s)
        a, b, o = (values[i] for i in ids[:3])
        around = token_of(sum(self.sizes[s][i] for i in ids[:3]))
        prediction, spread, class_ = parallelogram(a, b, o), distance(a, b), 1
        if s == 0 and len(candidates) == 2:
            two = parallelogram(*(values[i] for i in points(candidates[1], s)[:3]))
            each = [[signed(x + y + 1) >> 1 for x, y in zip(prediction, two)], prediction, two]
            spread, class_, choice = distance(prediction, two), 2, 0
            if self.choices and spread > self.streams[s].elements:
                choice = min(self.reader.symbol(self.models["choice", token_of(spread)]), 2)
                class_ = 3 if choice else 2
            prediction = each[choice]
        if kind == 1:
            places = [self.values[0][i] for i in points(candidates[0], 0)]
            weights = predictors.affine_weights(*places)
            if weights is not None:
                prediction = predictors.affine_apply(a, b, o, *weights)
        return prediction, class_, token_of(spread), around

    def _start(self, s: int, neighbours: list[int]) -> tuple[Value, int, int]:
        """Without candidates: (prediction, two contexts)."""
        ids = [self.corners[s][c] for c in neighbours]
        if not ids:
            return self.last, 0, 15
        p, q = self.values[s][ids[0]], self.values[s][ids[-1]]
        around = token_of(3 * self.sizes[s][ids[0]])
        if len(ids) == 1:
            return p, 1, around
        return [signed(x + y) >> 1 for x, y in zip(p, q)], token_of(distance(p, q)), around

    def _match(self, s: int, neighbours: int) -> int:
        self.last_match = self._unsigned(
            "match",
            self.models["match", s > 0, int(self.last_match > 0)],
            self.models["match", s > 0, 2 + (neighbours > 0)],
        )
        require(self.last_match <= len(self.order), "a vertex repeats one that is not there.")
        return self.last_match

    def _normals(self, s: int) -> None:
        """An OCT stream that GEO predicts."""
        stream, n = self.streams[s], self.count[s]
        sums = self._normal_sums(s)
        centre = ((1 << stream.bits) - 2) // 2
        last = before = repeated = 0
        for i in range(n):
            if self.repeats and i > 0:
                same = self.reader.flag(self.flags["repeated", repeated])
                repeated = 2 * repeated + same & 3
                if same:
                    self.values[s][i] = self.values[s][i - 1]
                    continue
            p = [x - centre for x in predictors.octahedral(sums[i], stream.bits)]
            inside_out = abs(p[0]) + abs(p[1]) > centre
            if inside_out:
                p = invert(*p, centre)
            area = min(max(abs(x) for x in sums[i]).bit_length() // 2, 15)
            near = token_of(2 * last + before)
            size, q = 0, [0, 0]
            for e in range(2):
                second = token_of(size) if e else near
                d = self._signed("normal", self.models["normal", e, area, second])
                require(abs(d) <= 2 * centre, "a normal is out of range.")
                size += abs(d)
                q[e] = (p[e] + d + centre) % (2 * centre + 1) - centre
            before, last = last, min(size, 255)
            if inside_out:
                q = invert(*q, centre)
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


class Ring:
    """The border of what is left of a disk, as linked nodes, with the triangles at each."""

    UNKNOWN, ON_RUN, RUN_END, INSIDE = range(4)

    def __init__(self, page: Page, meshlet: Meshlet) -> None:
        self.place: list[int] = []
        self.triangles: list[int] = []
        self.next: list[int | None] = []
        self.previous: list[int | None] = []
        self.loops: list[tuple[int, int]] = []  # first node, number of nodes
        self.splits: list[list[int]] = []  # the left part's a, L symbols beyond the known nodes
        self.a = self.b = 0
        self.disk = 0
        self.known = meshlet.stored > 0
        for r in meshlet.references:
            if r.length == 0 or len(self.place) + r.length > 64:
                self.known = False
                break
            self._add_run(page, meshlet, r)

    def _add_run(self, page: Page, meshlet: Meshlet, r: Reference) -> None:
        p = meshlet.before(r)
        first = len(self.place)
        if r.index == 0 or meshlet.references[r.index - 1].loop_end:
            self.loops.append((first, 0))
        for k in range(r.length):
            v = self.add(self.UNKNOWN)
            if v:
                self.join(v - 1, v)
            for q, local in ((r, r.length - k), (p, 0)):
                if q.owner is None or q.owner.meshlet == r.meshlet or (q is p and k > 0):
                    continue
                if q is p and r.owner is not None and r.owner.meshlet != r.meshlet:
                    continue
                owner = page.meshlets[q.owner.meshlet]
                self.place[v] = self.ON_RUN if k else self.RUN_END
                self.triangles[v] = page.valence[owner.ids[0][q.owner.run[local]]]
                break
        if r.loop_end:
            begin = self.loops[-1][0]
            self.loops[-1] = begin, len(self.place) - begin
            self.join(len(self.place) - 1, begin)

    def add(self, place: int) -> int:
        self.place.append(place)
        self.triangles.append(0)
        self.next.append(None)
        self.previous.append(None)
        return len(self.place) - 1

    def join(self, p: int, q: int) -> None:
        self.next[p], self.previous[q] = q, p

    def state(self, v: int) -> int:
        n = self.triangles[v]
        match self.place[v]:
            case self.UNKNOWN:
                return min(n, 4)
            case self.ON_RUN:
                return 5 + min(max(n, 1) - 1, 6)
            case self.RUN_END:
                return 12 + min(n, 4)
            case _:
                return 17 + min(max(n, 1) - 1, 6)

    def after(self, v: int) -> int:
        """The node after v; a new one if it is not known."""
        node = self.next[v]
        if node is None:
            node = self.next[v] = self.add(self.UNKNOWN)
        return node

    def begin_disk(self) -> None:
        self.splits = []
        if self.known and self.disk < len(self.loops) and self.loops[self.disk][1] >= 3:
            self.b = self.loops[self.disk][0]
            before = self.previous[self.b]
            assert before is not None
            self.a = before
        else:
            self.a, self.b = self.add(self.UNKNOWN), self.add(self.UNKNOWN)
            self.next[self.a] = self.b
            self.known = False
        self.disk += 1

    def advance(self, symbol: str) -> bool:
        """Takes a triangle away. Returns True at the end of a disk."""
        a, b = self.a, self.b
        self.triangles[a] += 1
        self.triangles[b] += 1
        if symbol == "C":
            v = self.add(self.INSIDE)
            self.join(a, v)
            self.join(v, b)
            self.a = v
        elif symbol == "L":
            node = self.previous[a]
            if node is None:
                node = self.add(self.UNKNOWN)
                if self.splits:
                    self.splits[-1][1] += 1
            v = self.a = node
            self.next[v] = b
        elif symbol == "R":
            v = self.b = self.after(b)
            self.next[a] = v
        elif symbol == "S":
            self.splits.append([a, 0])
            self.a = self.add(self.UNKNOWN)
            self.next[self.a] = b
            return False
        else:
            v = self.after(b)
            self.triangles[v] += 1
            if not self.splits:
                return True
            left, steps = self.splits.pop()
            end = self.next[v] if self.previous[a] is None else v
            for _ in range(steps):
                end = self.next[end] if end is not None else None
            if end is None:
                end = self.add(self.UNKNOWN)
            self.triangles[end] += 1
            self.a, self.b = left, end
            self.next[left] = end
            return False
        self.triangles[v] += 1
        return False


class Plan:
    """The order of the vertices of a meshlet that are new in a stream: its steps."""

    def __init__(self, page: Page, meshlet: Meshlet, s: int) -> None:
        assert meshlet.connectivity is not None
        self.page, self.meshlet, self.s = page, meshlet, s
        self.triangles = meshlet.connectivity.triangles
        self.ids = meshlet.ids[s]
        self.unknown = {v for v, i in enumerate(self.ids) if i not in page.values[s]}
        self.candidates: list[list[int]] = [[] for _ in self.ids]
        self.steps: list[Step] = []
        for t in range(len(self.triangles)):
            if len(self.missing(t)) == 1:
                self.add(t)
        while self.unknown:
            step = self.next_step()
            self.steps.append(step)
            self.know(self.ids[step.vertex])

    def missing(self, t: int) -> list[int]:
        return [v for v in self.triangles[t] if v in self.unknown]

    def add(self, t: int) -> None:
        """Triangle t lacks one vertex: it is a candidate if the vertex across is known."""
        missing = self.missing(t)
        if not missing or len(self.candidates[missing[0]]) == 2:
            return
        c = self.meshlet.corner + 3 * t + self.triangles[t].index(missing[0])
        across, begin = self.page.opposite[c], self.meshlet.corner
        if across is None or across >= begin + 3 * len(self.triangles):
            return
        if across >= begin and self.triangles[(across - begin) // 3][across % 3] in self.unknown:
            return
        if self.s and self.is_seam(c, across):
            return
        self.candidates[missing[0]].append(c)

    def is_seam(self, c: int, d: int) -> bool:
        """Do the two vertices of the edge have other numbers on its other side?"""
        corners = self.page.corners[self.s]
        ends = [[corners[x // 3 * 3 + (x + i) % 3] for i in (1, 2)] for x in (c, d)]
        return ends[0] != ends[1][::-1]

    def next_step(self) -> Step:
        most = max(len(self.candidates[v]) for v in self.unknown)
        if most:
            v = min(v for v in self.unknown if len(self.candidates[v]) == most)
            return Step(v, self.candidates[v], [])
        for lacking in (1, 2):
            for t, triangle in enumerate(self.triangles):
                missing = self.missing(t)
                if len(missing) == lacking:
                    known = [k for k in (2, 1, 0) if triangle[k] not in self.unknown]
                    corners = [self.meshlet.corner + 3 * t + k for k in known]
                    return Step(missing[0], [], corners)
        return Step(min(self.unknown), [], [])

    def know(self, number: int) -> None:
        """The vertex is known now: adds the candidates that it completes."""
        same = [v for v, i in enumerate(self.ids) if i == number]
        left = [len(self.missing(t)) for t in range(len(self.triangles))]
        self.unknown -= set(same)
        for w in same:
            around = [t for t, triangle in enumerate(self.triangles) if w in triangle]
            for t in around:
                left[t] -= 1
            for t in around:
                if left[t] == 1:
                    self.add(t)
            for t in around:
                if left[t] == 0:  # w may be the vertex across from another triangle's
                    k = self.triangles[t].index(w)
                    across = self.page.opposite[self.meshlet.corner + 3 * t + k]
                    u = -1 if across is None else (across - self.meshlet.corner) // 3
                    if 0 <= u < len(self.triangles) and left[u] == 1:
                        self.add(u)


def parallelogram(x: Value, y: Value, z: Value) -> Value:
    return [signed(i + j - k) for i, j, k in zip(x, y, z)]


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
        assert meshlet.connectivity is not None
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
        assert connectivity is not None
        known: set[int] = set()
        for r in self.meshlet.references:
            known.update(r.run[:1] if r.kind == PRIVATE else r.run[:-1])
        normals: list[list[int]] = []
        if self.stream.predictor == GEO:
            normals = predictors.normals(connectivity.triangles, self.positions, position_bits)
        residuals = []
        for disk in connectivity.disks:
            visits = [(disk.loop[-1], disk.first, disk.first, None)]
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
    for r in meshlet.references if meshlet.stored else []:
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
        assert meshlet.connectivity is not None
        count += meshlet.connectivity.vertex_count
        for r in meshlet.references:
            whole = r.kind == FOREIGN and all(r.shares)
            p = meshlet.before(r)
            count -= (r.length - 1) * whole
            count -= whole or (p.kind == FOREIGN and all(p.shares))
    return count


def unpack_page(data: bytes, resident: int) -> bytes:
    """The blob of a packed page. resident: its length by the page table."""
    page = Page(data, resident)
    meshlets = [written(page, meshlet) for meshlet in page.meshlets]
    blob = blob_writer.write_blob(
        page.streams, meshlets, vertex_count(page), lambda g: group_layout(meshlets[32 * g :][:32])
    )
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
