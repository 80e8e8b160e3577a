"""The predictors of the reference decoder, as A.7 of the specification defines them.

Values are lists of integers, one per element. All 32-bit arithmetic is modulo 2^32: `_signed` maps
the result of each operation that can leave 32 bits into -2^31 .. 2^31 - 1. Python's // and >> round
toward minus infinity.
"""

from __future__ import annotations

from collections.abc import Sequence

PARALLELOGRAM, MEAN, COPY, DAMPED, GEO, AFFINE = range(6)

Value = list[int]
Point = Sequence[int]


def _signed(x: int) -> int:
    """x modulo 2^32, as a signed integer."""
    return (x + 0x80000000 & 0xFFFFFFFF) - 0x80000000


def _minus(a: Point, b: Point) -> list[int]:
    return [x - y for x, y in zip(a, b)]


def _dot(a: Point, b: Point) -> int:
    return sum(x * y for x, y in zip(a, b))


def _largest_length(*vectors: Point) -> int:
    """The bits of the largest magnitude."""
    return max(abs(x) for vector in vectors for x in vector).bit_length()


def _toward_zero(n: int, d: int) -> int:
    """n / d, d > 0, rounded toward zero."""
    return n // d if n >= 0 else -(-n // d)


def toward(before: Value, end: Value, left: int) -> Value:
    """The next vertex of a chain whose end is `left` edges from the vertex `before`."""
    return [a + (b - a + left // 2) // left for a, b in zip(before, end)]


def apex(
    predictor: int,
    values: list[Value],
    positions: list[Value],
    a: int,
    b: int,
    o: int | None,
    v: int,
) -> Value:
    """The apex v of the gate a -> b. o: the vertex on its other side, None at a root."""
    if predictor == COPY:
        return values[a]
    if predictor == MEAN or o is None:
        return [(x + y) >> 1 for x, y in zip(values[a], values[b])]
    if predictor == DAMPED:
        return [(3 * (x + y) - 2 * z + 2) >> 2 for x, y, z in zip(values[a], values[b], values[o])]
    if predictor == AFFINE:
        weights = affine_weights(positions[a], positions[b], positions[o], positions[v])
        if weights is not None:
            return affine_apply(values[a], values[b], values[o], *weights)
    return [x + y - z for x, y, z in zip(values[a], values[b], values[o])]


# --- GEO: normals from positions ---


def normals(triangles: Sequence[Point], positions: list[Value], bits: int) -> list[list[int]]:
    """N: per vertex the sum of the cross products of its triangles (a, b, v)."""
    h = max(0, bits - 13)
    sums = [[0, 0, 0] for _ in positions]
    for triangle in triangles:
        a, b, v = ([x >> h for x in positions[i]] for i in triangle)
        e, f = _minus(b, a), _minus(v, a)
        cross = [
            e[1] * f[2] - e[2] * f[1],
            e[2] * f[0] - e[0] * f[2],
            e[0] * f[1] - e[1] * f[0],
        ]
        for i in triangle:
            sums[i] = [_signed(x + y) for x, y in zip(sums[i], cross)]
    return sums


def octahedral(n: Point, bits: int) -> Value:
    """The integers of the direction n on the octahedral grid of `bits` bits."""
    largest = (1 << bits) - 2
    k = max(0, _largest_length(n) - 13)
    x, y, z = (abs(c) >> k for c in n)
    s = x + y + z
    if s == 0:
        return [largest >> 1, largest >> 1]
    if n[2] < 0:
        x, y = s - y, s - x
    x = s - x if n[0] < 0 else s + x
    y = s - y if n[1] < 0 else s + y
    return [(x * largest + s) // (2 * s), (y * largest + s) // (2 * s)]


# --- AFFINE: texture coordinates from positions ---


def affine_weights(a: Point, b: Point, o: Point, v: Point) -> tuple[int, int] | None:
    """(S, U) in 1/256, such that v is about a + S (b - a) + U (o - a); None if that fails."""
    e, f, r = _minus(b, a), _minus(o, a), _minus(v, a)
    h = max(0, _largest_length(e, f, r) - 14)
    e, f, r = ([x >> h for x in vector] for vector in (e, f, r))
    products = [_dot(e, e), _dot(e, f), _dot(f, f), _dot(r, e), _dot(r, f)]
    n = _largest_length(products)
    ee, ef, ff, re, rf = (x >> n - 15 if n > 15 else x << 15 - n for x in products)
    p = ee * ff
    d = p - ef * ef
    if d <= p >> 5 or d >> 8 == 0:
        return None
    s = _toward_zero(_signed(re * ff - rf * ef), d >> 8)
    u = _toward_zero(_signed(rf * ee - re * ef), d >> 8)
    return (s, u) if abs(s) < 1024 and abs(u) < 1024 else None


def affine_apply(a: Value, b: Value, o: Value, s: int, u: int) -> Value:
    """a + S (b - a) + U (o - a), rounded."""
    return [x + (_signed(s * (y - x) + u * (z - x) + 128) >> 8) for x, y, z in zip(a, b, o)]


def affine_chain(values: list[Value], positions: list[Value], i: int) -> Value:
    """Vertex i of a chain by AFFINE: from vertices i - 1, i - 2 and the end, or by projection."""
    n = len(values) - 1
    before, end = values[i - 1], values[n]
    if i >= 2:
        weights = affine_weights(positions[i - 1], positions[n], positions[i - 2], positions[i])
        if weights is not None:
            return affine_apply(before, end, values[i - 2], *weights)
    e = _minus(positions[n], positions[i - 1])
    r = _minus(positions[i], positions[i - 1])
    h = max(0, _largest_length(e, r) - 10)
    e, r = [x >> h for x in e], [x >> h for x in r]
    ee, re = _dot(e, e), _dot(r, e)
    if ee > 0 and 0 <= re <= ee:
        t = (256 * re + ee // 2) // ee
        return [a + (_signed(t * (b - a) + 128) >> 8) for a, b in zip(before, end)]
    return toward(before, end, n - i + 1)
