"""The reference decoder beside textbook Edgebreaker, and on blobs worked out by hand."""

import random
from itertools import pairwise

import numpy as np
import pytest

from spec import reference_decoder
from spec.blob_writer import (
    COPY,
    DAMPED,
    FOREIGN,
    GEO,
    GEO_ALL,
    GRID,
    MEAN,
    OCT,
    OWNED,
    PARALLELOGRAM,
    PRIVATE,
    BitWriter,
    Layout,
    Meshlet,
    Reference,
    Stream,
    exp_golomb,
    random_blob,
    random_disks,
    write_blob,
)
from spec.reference_decoder import (
    decode_blob,
    decode_meshlet,
    decode_parallel,
    decode_serial,
    decode_view,
)


def textbook_edgebreaker(symbols: str):
    """Recursive Edgebreaker; returns (triangles (a, b, v), loops).

    Each part returns its boundary from b to a.
    """
    triangles: list = [None] * len(symbols)
    vertices = iter(range(3 * len(symbols)))
    position = 0

    def part(b):
        nonlocal position
        t = position
        position += 1
        symbol = symbols[t]
        if symbol == "E":
            v = next(vertices)
            chain = [b, v, next(vertices)]
        elif symbol == "R":
            v = next(vertices)
            chain = [b, *part(v)]
        else:
            chain = part(b)
            v = chain[-1]
            if symbol == "C":
                chain = chain[:-1]
            elif symbol == "L":
                chain = [*chain, next(vertices)]
            else:
                chain += part(v)[1:]
        triangles[t] = (chain[-1], b, v)
        return chain

    loops = []
    while position < len(symbols):
        loops.append(part(next(vertices)))
    return triangles, loops


@pytest.mark.parametrize("smallest_loop", [2, 3])
def test_connectivity_decoders_agree(smallest_loop):
    rng = random.Random(smallest_loop)
    for _ in range(300):
        symbols = "".join(random_disks(rng, smallest_loop))
        triangles, loops = textbook_edgebreaker(symbols)
        connectivity = decode_serial(symbols)
        assert connectivity.triangles == triangles
        assert [disk.loop for disk in connectivity.disks] == loops
        assert decode_parallel(symbols) == triangles


def test_opposite_is_the_triangle_beyond_the_gate():
    rng = random.Random(5)
    for _ in range(100):
        connectivity = decode_serial("".join(random_disks(rng)))
        for t, (a, b, _) in enumerate(connectivity.triangles):
            o = connectivity.opposite[t]
            roots = [disk.triangle_begin for disk in connectivity.disks]
            assert (o is None) == (t in roots)
            if o is not None:
                assert any({a, b, o} == set(triangle) for triangle in connectivity.triangles[:t])


@pytest.mark.parametrize(
    ("symbols", "message"),
    [
        ("C", "lack an E"),
        ("R", "lack an E"),
        ("RRL", "lack an E"),
        ("SE", "lack an E"),
        ("SSEE", "lack an E"),
        ("CCE", "repeated vertex"),
        ("ECCE", "repeated vertex"),
        ("RCCE", "repeated vertex"),
        ("CCCCE", "empty stack"),
        ("E" * 22, "more than 64 vertices"),
        ("R" * 62 + "E", "more than 64 vertices"),
    ],
)
def test_connectivity_refuses(symbols, message):
    with pytest.raises(ValueError, match=message):
        decode_serial(symbols)


def test_connectivity_at_the_limits():
    assert decode_serial("R" * 61 + "E").vertex_count == 64
    assert decode_serial("E" * 21).vertex_count == 63


def test_every_random_symbol_string_is_decoded_or_refused():
    rng = random.Random(11)
    decoded = 0
    for _ in range(3000):
        symbols = "".join(rng.choice("CLERS") for _ in range(rng.randint(1, 9)))
        try:
            connectivity = decode_serial(symbols)
        except ValueError:
            continue
        decoded += 1
        assert (
            decode_parallel(symbols) == connectivity.triangles == textbook_edgebreaker(symbols)[0]
        )
    assert decoded > 100


def one_stream(**changes) -> list[Stream]:
    return [Stream(**{"elements": 1, "bits": 8, **changes})]


def private_meshlet(symbols, anchor, interior):
    """A meshlet without references, one stream of one element, 9-bit fixed residuals."""
    return Meshlet(symbols, [], [[[anchor]]], [], [[]], [[9]], [[[u] for u in interior]])


def test_single_triangle():
    # root a (id 2) is predicted by b, then the apex (id 1) by the mean of a and b
    blob = decode_blob(write_blob(one_stream(), [private_meshlet("E", 10, [8, 3])], 3))
    assert blob.triangles.tolist() == [[2, 0, 1]]
    assert blob.values[0].tolist() == [[10], [10], [14]]


@pytest.mark.parametrize(
    ("predictor", "last"),
    [
        (PARALLELOGRAM, 14 + 12 - 10),
        (MEAN, (14 + 12) >> 1),
        (COPY, 14),
        (DAMPED, (3 * (14 + 12) - 2 * 10 + 2) >> 2),
    ],
)
def test_quad_predictors(predictor, last):
    # R then E: triangles (3, 0, 1) and (3, 1, 2); values b = 10, a = 14, v = 12, and the last one
    # as predicted
    apex = {PARALLELOGRAM: 0, MEAN: 0, COPY: 3, DAMPED: 0}[
        predictor
    ]  # zigzag residual: the mean 12 or a = 14 with -2
    blob = decode_blob(
        write_blob(one_stream(predictor=predictor), [private_meshlet("RE", 10, [8, apex, 0])], 4)
    )
    assert blob.triangles.tolist() == [[3, 0, 1], [3, 1, 2]]
    assert blob.values[0].tolist() == [[10], [12], [last], [14]]


def test_values_wrap_to_their_bits():
    blob = decode_blob(write_blob(one_stream(), [private_meshlet("E", 250, [14, 0])], 3))
    assert blob.values[0].tolist() == [[250], [(250 + 1) >> 1], [1]]


def strip_of_two(length: int, share=(), streams=None) -> bytes:
    """Two fans that meet along a run of `length` edges; the first owns it."""
    symbols = "R" * (length - 1) + "E"
    count = len(streams)
    rest = length + 2 - length

    def anchors(n, first):
        return [[[first + s], *[[2 * i] for i in range(1, n)]] for s in range(count)]

    seams = [not shared for shared in (True, *(share or [True] * (count - 1)))]
    first = Meshlet(
        symbols,
        [[Reference(OWNED, length), Reference(PRIVATE, rest)]],
        anchors(2, 40),
        [[4]] * count,
        [[[0]] * (length - 1)] * count,
        [[4]] * count,
        [[[0]] * (rest - 1)] * count,
    )
    second = Meshlet(
        symbols,
        [[Reference(FOREIGN, length, 1, 0, share), Reference(PRIVATE, rest)]],
        [[[90], [8]] if seam else [] for seam in seams],
        [],
        [],
        [[4]] * count,
        [[[2]] * (rest - 1 + (length - 1) * seam) for seam in seams],
    )
    return write_blob(streams, [first, second], 0)


def with_vertex_count(blob: bytes, count: int) -> bytes:
    return blob[:12] + count.to_bytes(4, "little") + blob[16:]


def test_foreign_run_is_the_owners_backwards():
    streams = one_stream()
    blob = decode_blob(with_vertex_count(strip_of_two(3, streams=streams), 5 + 1))
    first = decode_meshlet(with_vertex_count(strip_of_two(3, streams=streams), 6), 0)[1][0]
    second = decode_meshlet(with_vertex_count(strip_of_two(3, streams=streams), 6), 1)[1][0]
    # anchors 40 and 41; from 40 toward 41 in three steps, then in two
    assert first[:4].tolist() == [[40], [40 + (1 + 1) // 3], [40 + (1 + 1) // 2], [41]]
    assert second[:4].tolist() == first[3::-1].tolist()
    # the first meshlet's ids 0..4, then the one vertex of the second that it does not share
    assert blob.triangles.tolist() == [
        [4, 0, 1],
        [4, 1, 2],
        [4, 2, 3],
        [5, 3, 2],
        [5, 2, 1],
        [5, 1, 0],
    ]


def test_seam_keeps_own_values_for_the_stream():
    streams = [*one_stream(), *one_stream()]
    data = with_vertex_count(strip_of_two(3, (False,), streams), 10)
    blob = decode_blob(data)
    positions, others = decode_meshlet(data, 1)[1]
    assert positions[:4].tolist() == [[41], [41], [40], [40]]
    # own anchors 90 and 94, in our own direction, with residuals of 1
    first = 90 + (4 + 1) // 3 + 1
    assert others[:4].tolist() == [[90], [first], [first + (94 - first + 1) // 2 + 1], [94]]
    assert len(blob.values[1]) == 10


def decode_or_hops(decoder, m):
    """Values of meshlet m; None if a corner takes more than eight hops."""
    try:
        return decoder.meshlet(m)[1]
    except ValueError as error:
        assert "hops" in str(error)
        return None


def test_random_blobs_share_values_exactly():
    """Two meshlets get the same integers along a run if they share it and its corners."""
    rng = random.Random(3)
    shared = 0
    for _ in range(30):
        decoder = reference_decoder.Decoder(random_blob(rng, rng.randint(1, 40)))
        values = [decode_or_hops(decoder, m) for m in range(decoder.file.meshlet_count)]
        runs = [
            decoder.boundary(decoder.file.meshlet(m)) for m in range(decoder.file.meshlet_count)
        ]
        for m, meshlet_values in enumerate(values):
            for j, reference in enumerate(decoder.file.meshlet(m).references):
                if (
                    reference.kind != FOREIGN
                    or meshlet_values is None
                    or values[reference.owner] is None
                ):
                    continue
                owner, k = decoder.owned_reference(reference)
                for s in range(len(meshlet_values)):
                    if reference.shares(s):
                        ours = [meshlet_values[s][v] for v in runs[m][j]]
                        theirs = [values[owner.index][s][v] for v in runs[owner.index][k]][::-1]
                        # Random blobs need not share the corners; encoders take care of that.
                        if (ours[0], ours[-1]) == (theirs[0], theirs[-1]):
                            assert ours == theirs
                            shared += len(ours) - 2
    assert shared > 100


def test_truncations_are_refused():
    data = with_vertex_count(strip_of_two(3, streams=one_stream()), 6)
    for length in range(len(data)):
        with pytest.raises(ValueError):
            decode_blob(data[:length])


def test_further_anchors_are_relative_to_the_one_before():
    loop = [Reference(OWNED, 1) for _ in range(3)]
    meshlet = Meshlet("E", [loop], [[[10], [6], [3]]], [0], [[]], [0], [[]])
    blob = decode_blob(write_blob(one_stream(anchor_base=1), [meshlet], 3))
    assert blob.values[0].tolist() == [[10], [13], [11]]


@pytest.mark.parametrize("k", [0, 1, 5, 31])
def test_exp_golomb_values(k):
    """Every quotient that the code can have; what it holds is what blob_writer put in."""
    values = [0, 1, 2, 3, 100, 2**20 + 7, 2**31 - 1, 2**31, 2**32 - 2]
    if k > 0:  # with k = 0 its quotient would be 32
        values.append(2**32 - 1)
    writer = BitWriter()
    for u in values:
        quotient, low = exp_golomb(u, k)
        writer.put(1 << quotient, quotient + 1)
        writer.put(low, k + quotient)
    reader = reference_decoder.BitReader(writer.to_bytes(), 0, writer.count)
    code = reference_decoder.Code(k, exponential=True)
    for u in values:
        quotient = code.read_unary(reader, "unary")
        assert code.read_low(reader, "low", quotient, 0) == u


@pytest.mark.parametrize("second_table", [False, True])
def test_symbols_survive_their_planes(second_table):
    rng = random.Random(4)
    for _ in range(50):
        disks = random_disks(rng)
        symbols = "".join(disks)
        meshlet = Meshlet(symbols, [], [[[0]] * len(disks)], [], [[]], [[0]], [[]])
        blob = write_blob(one_stream(), [meshlet], 3, Layout(second_table=second_table))
        assert reference_decoder.BlobFile(blob).meshlet(0).symbols == symbols


def test_geo_predicts_the_normal_of_a_plane():
    """A quad in the plane z = 5, and a stream of normals without residuals."""
    streams = [
        Stream(bits=8, anchor_base=5),
        Stream(OCT, 2, 8, GEO_ALL),
        Stream(OCT, 2, 8, GEO),
    ]
    positions = [[0, 0, 5], [100, 0, 5], [100, 100, 5], [0, 100, 5]]
    steps = [
        [2 * d if d >= 0 else -2 * d - 1 for d in np.subtract(b, a).tolist()]
        for a, b in pairwise(positions)
    ]
    private = Meshlet(
        "RE",
        [[Reference(OWNED, 1), Reference(OWNED, 1), Reference(PRIVATE, 2)]],
        [[positions[0], steps[0], steps[1]], [[1, 2], [0, 0], [0, 0]], [[1, 2], [0, 0], [0, 0]]],
        [0] * 3,
        [[]] * 3,
        [[9] * 3, [0], [0]],
        [[[0, 199, 0]], [[0, 0]], [[0, 0]]],
    )
    private.interior_codes[1:] = [[0, 0], [0, 0]]
    values = decode_blob(write_blob(streams, [private], 4)).values
    assert values[1].tolist()[3] == [127, 127]  # straight up
    assert values[2].tolist()[3] == [1, 2]  # on the boundary: the root gate's b


def test_views_are_blobs_back_to_back():
    first = write_blob(one_stream(), [private_meshlet("E", 10, [8, 3])], 3)
    second = write_blob(
        one_stream(predictor=COPY, interior_base=3), [private_meshlet("RE", 10, [8, 3, 0])], 4
    )
    view = decode_view(first + second)
    assert view.triangles.tolist() == [[2, 0, 1], [6, 3, 4], [6, 4, 5]]
    assert view.values[0].tolist() == [
        *decode_blob(first).values[0].tolist(),
        *decode_blob(second).values[0].tolist(),
    ]
    with pytest.raises(ValueError, match="Blob 1 has other streams"):
        decode_view(first + write_blob(one_stream(bits=9), [private_meshlet("E", 1, [1, 1])], 3))
    with pytest.raises(ValueError, match="Blob 1: "):
        decode_view(first + second[:-4])


def test_no_such_meshlet():
    data = write_blob(one_stream(), [private_meshlet("E", 10, [8, 3])], 3)
    with pytest.raises(IndexError):
        decode_meshlet(data, 1)


def test_dequantise():
    def stream(**changes):
        fields = {
            "predictor": COPY,
            "chain_base": 0,
            "interior_base": 0,
            "anchor_base": 0,
            "step": 0.5,
            "offset": (1.0, 2.0, 0.0, 0.0),
            **changes,
        }
        return reference_decoder.Stream(**fields)

    grid = reference_decoder.dequantise(
        stream(kind=GRID, elements=2, bits=8), np.array([[0, 1], [2, 3]], np.uint32)
    )
    assert grid.dtype == np.float32 and grid.tolist() == [[1.0, 2.5], [2.0, 3.5]]
    octahedral = stream(kind=reference_decoder.OCT, elements=2, bits=8)
    corners = reference_decoder.dequantise(
        octahedral, np.array([[0, 0], [254, 254], [254, 0], [127, 127], [0, 127]], np.uint32)
    )
    assert corners.tolist() == [[0, 0, -1]] * 3 + [[0, 0, 1], [-1, 0, 0]]
    assert not np.signbit(corners[corners == 0]).any()
    values = np.array([1.5, -1.5, 0.0, -0.0, np.inf, -np.inf], np.float32)
    bits = values.view(np.uint32)
    ordered = np.where(bits >> 31, ~bits, bits | np.uint32(0x80000000)).astype(np.uint32)
    assert np.array_equal(np.argsort(ordered, kind="stable"), [5, 1, 3, 2, 0, 4])
    lossless = stream(kind=reference_decoder.FLOAT32, elements=1, bits=32)
    assert np.array_equal(reference_decoder.dequantise(lossless, ordered).view(np.uint32), bits)
    sign = stream(kind=reference_decoder.SIGN, elements=1, bits=1)
    assert reference_decoder.dequantise(sign, np.array([[0], [1]], np.uint32)).tolist() == [
        [-1.0],
        [1.0],
    ]
