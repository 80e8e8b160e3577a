"""The reference decoder beside textbook Edgebreaker, and on blobs worked out by hand."""

import random

import numpy as np
import pytest

from spec import reference_decoder, reference_transport
from spec.blob_writer import (
    COPY,
    DAMPED,
    FOREIGN,
    GEO,
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
from tests.helpers import long_blobs
from tests.helpers.environment import VECTORS


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


def test_blobs_near_the_limit_of_their_length():
    small = (VECTORS / "valid_worked_example.bin").read_bytes()
    longest = long_blobs.stretched(small, long_blobs.MAX_BYTES)
    decoded, expected = (decode_view(b) for b in (longest.bytes, small))
    np.testing.assert_array_equal(decoded.triangles, expected.triangles)
    for a, b in zip(decoded.values, expected.values, strict=True):
        np.testing.assert_array_equal(a, b)
    longer = long_blobs.stretched(small, long_blobs.MAX_BYTES + 4)
    with pytest.raises(ValueError, match="longer than 469762048 bytes"):
        decode_view(longer.bytes)
    for page in (long_blobs.MAX_BYTES + 4, 0), (80, long_blobs.MAX_BYTES + 4):
        with pytest.raises(ValueError, match="a page has an impossible length"):
            reference_transport.page_table(long_blobs.packed_page(*page).bytes)


def test_truncations_are_refused():
    data = with_vertex_count(strip_of_two(3, streams=one_stream()), 6)
    for length in range(len(data)):
        with pytest.raises(ValueError):
            decode_blob(data[:length])


def written(*fields: tuple[int, int]) -> bytes:
    """Fields (value, width) of the data of a meshlet."""
    writer = BitWriter()
    for value, width in fields:
        writer.put(value, width)
    return writer.to_bytes()


def with_data(streams: list[Stream], meshlet: Meshlet, data: bytes, vertex_count: int) -> bytes:
    """A blob whose only meshlet has the data that the test worked out by hand."""
    blob = write_blob(streams, [meshlet], vertex_count)
    (begin,) = reference_decoder.BlobFile(blob).starts
    padded = data + bytes(-(begin + len(data)) % 4 + 8)
    assert padded == blob[begin:]  # blob_writer agrees
    return blob


@pytest.mark.parametrize(
    ("base", "field", "width"), [(0, 0, 0), (0, 4, 4), (3, 4, 7), (3, 6, 8), (31, 0, 8), (0, 7, 8)]
)
def test_further_anchors_are_relative_to_the_first(base, field, width):
    """A triangle with three anchors. Widths are capped by the stream's 8 bits."""
    loop = [Reference(OWNED, 1) for _ in range(3)]
    streams = one_stream(anchor_base=base, elements=2)
    most = (1 << width) - 1
    meshlet = Meshlet(
        "E",
        [loop],
        [[[10, 20], [most, 6], [most // 2, 3]]],
        [0],
        [[]],
        [0],
        [[]],
        [[field, 7]],
    )
    data = written(
        (0, 6), (3, 6), (0, 3), (0, 3),  # T - 1, refs; foreign mask, length width
        (0, 3), (0, 3),  # codes
        (10, 8), (20, 8), (field, 3), (7, 3),
        (most, width), (6, 8), (most // 2, width), (3, 8),
    )  # fmt: skip
    values = decode_blob(with_data(streams, meshlet, data, 3)).values[0].tolist()
    expected = [10, *(10 + (u // 2 if u % 2 == 0 else -(u + 1) // 2) for u in (most, most // 2))]
    assert values == [[expected[0], 20], [expected[1] % 256, 23], [expected[2] % 256, 18]]


def test_sections_hold_all_streams():
    """Chains have low bits, then unary parts; the interior has stream 0, then all others."""
    streams = [
        *one_stream(chain_base=2, interior_base=1),
        *one_stream(bits=9, interior_base=2),
        *one_stream(bits=10, chain_base=1, interior_base=1),
    ]
    meshlet = Meshlet(
        "CRRE",
        [[Reference(OWNED, 3), Reference(PRIVATE, 1)]],
        [[[1], [0]], [[2], [0]], [[3], [0]]],
        [6, [4], 0],
        [[[257], [2]], [[9], [8]], [[7], [6]]],
        [0, 4, [5]],
        [[[5]], [[6]], [[7]]],
    )
    data = written(
        (3, 6), (2, 6), (1, 1),  # T - 1, refs, PRIVATE
        (0b001, 3), (0, 1),  # p0, p1
        (0, 2), (0b10, 2), (2, 3), (2, 2), (0, 2),  # both masks, length width, length - 1
        (6, 3), (0, 3), (7, 3), (4, 5), (4, 3), (0, 3), (7, 3), (5, 5),  # codes of three streams
        (1, 8), (0, 3), (2, 9), (0, 3), (3, 10), (0, 3),  # anchors
        (1, 8), (2, 8), (9, 4), (8, 4), (1, 1), (0, 1),  # low bits of chains
        (2, 2), (1, 1), (1 << 3, 4), (1 << 3, 4),  # unary parts of streams 0 and 2
        (1 << 2, 3), (1, 1),  # interior of stream 0: Rice, k = 1
        (1 << 2, 3), (0, 3), (7, 5),  # exp-Golomb, k = 1: 6 + 2 = 8; fixed
    )  # fmt: skip
    blob = decode_blob(with_data(streams, meshlet, data, 5))
    # The chain's residuals are -129 and 1; the second vertex is half-way from 128 to the end, 1.
    assert blob.values[0].tolist()[:4] == [[1], [1 - 129 + 256], [128 - 63 + 1], [1]]


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
        quotient = code.read_quotient(reader, "unary")
        low = code.read_low(reader, "low", quotient, 0)
        assert code.residual(quotient, low) == reference_decoder.unzigzag(u)


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
    streams = [Stream(bits=8, anchor_base=5), Stream(OCT, 2, 8, GEO)]
    positions = [[0, 0, 5], [100, 0, 5], [100, 100, 5], [0, 100, 5]]
    steps = [[2 * d for d in np.subtract(p, positions[0]).tolist()] for p in positions]
    meshlet = Meshlet(
        "RE",
        [[Reference(OWNED, 1), Reference(OWNED, 1), Reference(PRIVATE, 2)]],
        [[positions[0], *steps[1:3]], [[1, 2], [0, 0], [0, 0]]],
        [0, 0],
        [[], []],
        [[9] * 3, [0, 0]],
        [[[0, 200, 0]], [[0, 0]]],
    )
    values = decode_blob(write_blob(streams, [meshlet], 4)).values
    assert values[0].tolist() == positions
    # The root gate's a, on the boundary: straight up, whatever its neighbours are.
    assert values[1].tolist() == [[1, 2]] * 3 + [[127, 127]]


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
