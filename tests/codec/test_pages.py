"""Pages: a primitive as several blobs, back to back in one view."""

from __future__ import annotations

import dataclasses
import itertools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gltf_ext import _codec
from spec.reference_decoder import BlobFile
from tests.helpers.gltf_builder import grid_mesh

BYTE_LENGTH = 20  # offset of the header's byte length
VERTEX_COUNT = 12


@dataclasses.dataclass
class Mesh:
    """Arguments of _codec.encode. streams: a grid and an INTEGER stream."""

    triangles: np.ndarray
    positions: np.ndarray
    values: list[np.ndarray]
    bits: tuple[int, int] = (10, 6)

    @property
    def arguments(self) -> tuple:
        ids = _codec.weld(np.ascontiguousarray(self.positions).view(np.uint8))[0]
        streams = [
            _codec.Stream(kind, v.shape[1], bits, 0.5, (1.0,) * v.shape[1])
            for kind, v, bits in zip(
                (_codec.KIND_GRID, _codec.KIND_INTEGER), self.values, self.bits
            )
        ]
        return self.triangles, ids, self.positions, streams, self.values

    def encode(self, **options) -> bytes:
        return _codec.encode(*self.arguments, threads=1, **options)[0]

    def corners(self, triangles: np.ndarray | None = None) -> np.ndarray:
        """Sorted rows of the corners' integers, each triangle in a canonical rotation."""
        return canonical(self.triangles if triangles is None else triangles, self.values)


def canonical(triangles: np.ndarray, values: list[np.ndarray]) -> np.ndarray:
    corners = np.concatenate(values, axis=1).astype(np.int64)[triangles]
    turns = [np.roll(corners, k, axis=1).reshape(len(corners), -1) for k in range(3)]
    rows = sorted(min(map(tuple, three)) for three in zip(*turns))
    return np.array(rows)


def sheet(columns: int, rows: int, seed: int = 0) -> Mesh:
    """A bumpy sheet with holes, seams of the second stream, and edges of three triangles."""
    random = np.random.default_rng(seed)
    positions, triangles = grid_mesh(columns, rows)
    triangles = triangles[random.random(len(triangles)) < 0.97]
    shared = random.integers(0, len(positions), (len(positions) // 50, 2))
    positions[shared[:, 0]] = positions[shared[:, 1]]
    # Copies of some vertices, with values of their own.
    copied = np.flatnonzero(random.random(len(positions)) < 0.1)
    copy_of = np.arange(len(positions))
    copy_of[copied] = len(positions) + np.arange(len(copied))
    positions = np.concatenate([positions, positions[copied]])
    triangles = np.where(random.random(triangles.shape) < 0.5, triangles, copy_of[triangles])
    grid = np.round((positions - positions.min(axis=0)) / np.ptp(positions) * 1023)
    attributes = random.integers(0, 64, (len(positions), 2))
    return Mesh(
        triangles.astype(np.uint32), positions, [grid.astype(np.uint32), attributes.astype("u4")]
    )


def soup(count: int, seed: int) -> Mesh:
    """Triangles between random points, with many edges of several triangles."""
    random = np.random.default_rng(seed)
    points = max(3, count // 2)
    triangles = np.array([random.choice(points, 3, replace=False) for _ in range(count)], "u4")
    positions = random.integers(0, 1024, (points, 3)).astype(np.float32)
    return Mesh(
        triangles,
        positions,
        [positions.astype(np.uint32), random.integers(0, 64, (points, 1), "u4")],
    )


def pages_of(view: bytes) -> list[bytes]:
    return [view[start : start + size] for start, size in _codec.split(view)]


MESHES = st.one_of(
    st.builds(sheet, st.integers(2, 30), st.integers(2, 30), st.integers(0, 999)),
    st.builds(soup, st.integers(1, 200), st.integers(0, 999)),
)


@given(MESHES, st.integers(1, 6000))
@settings(max_examples=40)
def test_pages_hold_the_mesh(mesh, page_bytes):
    if not len(mesh.triangles):
        return
    view = mesh.encode(page_bytes=page_bytes)
    _codec.validate(view)
    pages = pages_of(view)
    assert b"".join(pages) == view and all(len(page) % 4 == 0 for page in pages)
    triangles, values = _codec.decode(view)
    np.testing.assert_array_equal(canonical(triangles, values), mesh.corners())
    for page in pages:
        assert len(page) <= page_bytes or _codec.Decoder(page).meshlet_count == 1
    counts = np.sum([[getattr(_codec.Decoder(p), f"{name}_count") for p in pages]
                     for name in ("triangle", "vertex", "meshlet")], axis=1)  # fmt: skip
    whole = _codec.Decoder(view)
    assert counts.tolist() == [whole.triangle_count, whole.vertex_count, whole.meshlet_count]
    assert _codec.describe(view)["blobs"] == len(pages)


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return sheet(90, 70)


@pytest.fixture(scope="module")
def view(mesh) -> bytes:
    view = mesh.encode(page_bytes=4096)
    assert len(pages_of(view)) > 4
    return view


def test_pages_are_full(view):
    assert all(0.9 * 4096 <= len(page) <= 4096 for page in pages_of(view)[:-1])


def test_a_page_for_all_is_one_blob(mesh):
    assert len(pages_of(mesh.encode(page_bytes=1 << 20))) == 1


def test_a_meshlet_larger_than_a_page_has_its_own(mesh):
    pages = pages_of(mesh.encode(page_bytes=16))
    assert {_codec.Decoder(page).meshlet_count for page in pages} == {1}


@pytest.mark.parametrize("threads", [2, 5])
def test_the_number_of_threads_changes_nothing(mesh, view, threads):
    again, _ = _codec.encode(*mesh.arguments, page_bytes=4096, threads=threads)
    assert again == view
    for decode in (_codec.decode, _codec.decode_values):
        triangles, values = decode(view, threads=threads)
        expected, expected_values = decode(view, threads=1)
        np.testing.assert_array_equal(triangles, expected)
        for ours, theirs in zip(values, expected_values):
            np.testing.assert_array_equal(ours, theirs)


def test_statistics_of_the_encoder_are_those_of_the_view(mesh, view):
    again, statistics = _codec.encode(*mesh.arguments, page_bytes=4096)
    assert again == view
    del statistics["generation"]
    described = _codec.describe(view)
    assert statistics == described
    bits = described["bits"]
    assert bits["connectivity"] + bits["references"] + sum(bits["streams"]) == 8 * len(view)


def test_pages_follow_on(view):
    """Vertices and triangles of a page come after those of the pages before it."""
    triangles, values = _codec.decode(view)
    vertex = triangle = 0
    for page in pages_of(view):
        own_triangles, own_values = _codec.decode(page)
        end, last = vertex + len(own_values[0]), triangle + len(own_triangles)
        np.testing.assert_array_equal(triangles[triangle:last], own_triangles + vertex)
        for ours, own in zip(values, own_values):
            np.testing.assert_array_equal(ours[vertex:end], own)
        vertex, triangle = end, last
    assert (triangle, vertex) == (len(triangles), len(values[0]))


def test_a_page_decodes_without_the_others(view):
    """The data of their meshlets, but for their sizes, are overwritten by noise."""
    random = np.random.default_rng(1)
    places, pages = _codec.split(view), pages_of(view)
    whole, first = _codec.Decoder(view), 0
    for kept, page in enumerate(pages):
        noise = bytearray(view)
        for number, (start, _) in enumerate(places):
            if number != kept:
                file = BlobFile(pages[number])
                for begin, end in zip(file.starts, file.ends):
                    noise[start + begin + 1 : start + end] = random.bytes(end - begin - 1)
        noisy, own = _codec.Decoder(bytes(noise)), _codec.Decoder(page)
        for m in range(own.meshlet_count):
            found = [
                d.decode_meshlet(n) for d, n in ((noisy, first + m), (whole, first + m), (own, m))
            ]
            for triangles, values in found[1:]:
                np.testing.assert_array_equal(triangles, found[0][0])
                for ours, theirs in zip(values, found[0][1]):
                    np.testing.assert_array_equal(ours, theirs)
        first += own.meshlet_count
    assert first == whole.meshlet_count
    with pytest.raises(IndexError):
        whole.decode_meshlet(first)


def test_meshlets_of_several_pages_decode_in_any_order(view):
    decoder = _codec.Decoder(view)
    numbers = np.random.default_rng(0).permutation(decoder.meshlet_count)
    triangles = sum(decoder.decode_kept(m)[0] for m in numbers)
    assert triangles == decoder.triangle_count


# --- meshlets of the caller ---


def given_meshlets(mesh: Mesh, random: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Random meshlets in random groups; each triangle is a disk."""
    count = len(mesh.triangles)

    def begins(end: int, largest: int) -> np.ndarray:
        sizes: list[int] = []
        while sum(sizes) < end:
            sizes.append(min(int(random.integers(1, largest + 1)), end - sum(sizes)))
        return np.cumsum([0, *sizes]).astype(np.uint32)

    meshlets = begins(count, 21)
    groups = begins(len(meshlets) - 1, 9)
    disks = np.arange(count + 1, dtype="u4")
    return random.permutation(count).astype("u4"), disks, meshlets, groups


@given(MESHES, st.integers(0, 999))
@settings(max_examples=30)
def test_given_meshlets(mesh, seed):
    if not len(mesh.triangles):
        return
    order, disks, meshlets, pages = given_meshlets(mesh, np.random.default_rng(seed))
    view = mesh.encode(meshlets=(order, disks, meshlets, pages))
    _codec.validate(view)
    found = [_codec.Decoder(page).meshlet_count for page in pages_of(view)]
    assert found == np.diff(pages).tolist()
    decoder = _codec.Decoder(view)
    for m, (begin, end) in enumerate(itertools.pairwise(meshlets)):
        triangles, values = decoder.decode_meshlet(m)
        expected = mesh.corners(mesh.triangles[order[begin:end]])
        np.testing.assert_array_equal(canonical(triangles, values), expected)


def test_meshlets_of_the_encoder_can_be_given_back(mesh, view):
    """In the same pages: the disks are the connected parts of the decoded meshlets."""
    decoder = _codec.Decoder(view)
    triangles, values = _codec.decode(view)
    disks, meshlets = [0], [0]
    for m in range(decoder.meshlet_count):
        local = decoder.decode_meshlet(m)[0].astype(np.int64)
        # A disk's vertices are numbered after those of the disks before it.
        starts = [t for t in range(1, len(local)) if local[t:].min() > local[:t].max()]
        disks += [disks[-1] + n for n in np.diff([0, *starts, len(local)]).cumsum()]
        meshlets.append(len(disks) - 1)
    pages = np.cumsum([0, *(_codec.Decoder(p).meshlet_count for p in pages_of(view))])
    order = np.arange(len(triangles))
    again = Mesh(triangles, values[0].astype(np.float32), values).encode(
        meshlets=tuple(np.array(a, "u4") for a in (order, disks, meshlets, pages))
    )
    assert [_codec.Decoder(p).meshlet_count for p in pages_of(again)] == np.diff(pages).tolist()
    np.testing.assert_array_equal(canonical(*_codec.decode(again)), mesh.corners())


def strip(count: int) -> Mesh:
    """A strip of `count` triangles."""
    positions = np.array([[i // 2, i % 2, 0] for i in range(count + 2)], np.float32)
    corners = np.arange(count)[:, None] + np.where(
        np.arange(count)[:, None] % 2, (1, 0, 2), (0, 1, 2)
    )
    return Mesh(
        corners.astype(np.uint32),
        positions,
        [positions.astype("u4"), positions[:, :1].astype("u4")],
    )


def refused(mesh: Mesh, *parts: list[int]) -> str:
    with pytest.raises(ValueError, match=r"^[a-z]") as error:
        mesh.encode(meshlets=tuple(np.array(part, "u4") for part in parts))
    message = str(error.value)
    assert message and "\n" not in message and not message.endswith(".")
    return message


def test_good_meshlets_of_a_strip_pass():
    view = strip(4).encode(meshlets=tuple(
        np.array(part, "u4") for part in ([0, 1, 2, 3], [0, 2, 4], [0, 1, 2], [0, 1, 2])
    ))  # fmt: skip
    assert len(pages_of(view)) == 2


@pytest.mark.parametrize(
    ("parts", "problem"),
    [
        (([0, 1, 2], [0, 3], [0, 1], [0, 1]), "each triangle once"),
        (([0, 1, 2, 2], [0, 4], [0, 1], [0, 1]), "each triangle once"),
        (([0, 1, 2, 4], [0, 4], [0, 1], [0, 1]), "each triangle once"),
        (([0, 1, 2, 3], [1, 4], [0, 1], [0, 1]), "disks' begins"),
        (([0, 1, 2, 3], [0, 2, 2, 4], [0, 3], [0, 1]), "disks' begins"),
        (([0, 1, 2, 3], [], [0, 1], [0, 1]), "disks' begins"),
        (([0, 1, 2, 3], [0, 2, 4], [0, 1], [0, 1]), "meshlets' begins"),
        (([0, 1, 2, 3], [0, 2, 4], [0, 1, 3], [0, 2]), "meshlets' begins"),
        (([0, 1, 2, 3], [0, 2, 4], [0, 1, 2], [0, 1]), "groups' begins"),
        (([0, 1, 2, 3], [0, 2, 4], [0, 1, 2], [0, 1, 1, 2]), "groups' begins"),
        (([0, 1, 2, 3], [0, 2, 4], [0, 1, 2], []), "groups' begins"),
        (([0, 2, 1, 3], [0, 2, 4], [0, 1, 2], [0, 1, 2]), "not a disk"),
    ],
)
def test_bad_meshlets_are_refused(parts, problem):
    assert problem in refused(strip(4), *parts)


def test_meshlets_beyond_the_limits_are_refused():
    count = 70
    every = list(range(count))
    assert "64 triangles" in refused(strip(count), every, [0, count], [0, 1], [0, 1])
    many = [*range(23)]  # disks of a triangle each: 66 vertices
    for pages in ([0, 2], [0, 1, 2]):
        rest = [every[:22] + every[22:], [*many[:23], count], [0, 22, 23], pages]
        assert "64 vertices" in refused(strip(count), *rest)


def test_a_ring_is_not_a_disk():
    inner = [(np.cos(a), np.sin(a), 0) for a in np.arange(6) * np.pi / 3]
    positions = np.array([*inner, *(2 * np.array(inner))], np.float32)
    triangles = [t for i in range(6) for t in
                 ((i, i + 6, (i + 1) % 6), ((i + 1) % 6, i + 6, (i + 1) % 6 + 6))]  # fmt: skip
    grid = np.round((positions + 2) * 100).astype("u4")
    ring = Mesh(np.array(triangles, "u4"), positions, [grid, grid[:, :1] % 64])
    assert "not a disk" in refused(ring, list(range(12)), [0, 12], [0, 1], [0, 1])
    view = ring.encode(meshlets=(np.arange(12, dtype="u4"), None, np.array([0, 12], "u4"), None))
    _codec.validate(view)
    np.testing.assert_array_equal(canonical(*_codec.decode(view)), ring.corners())
    assert _codec.Decoder(view).meshlet_count == 1


@given(MESHES, st.sampled_from([3, 40, 64, 65, 300]), st.integers(0, 999))
@settings(max_examples=30, deadline=None)
def test_meshlets_of_any_triangles_are_split(mesh, largest, seed):
    """Without disks: meshlets that are too large for one, or hang together nowhere."""
    count = len(mesh.triangles)
    if not count:
        return
    random = np.random.default_rng(seed)
    order = random.permutation(count) if seed % 2 else np.arange(count)
    sizes = random.integers(1, largest + 1, count)
    begins = np.append(np.unique(np.minimum(np.cumsum([0, *sizes]), count))[:-1], count)
    groups = np.unique([0, (len(begins) - 1) // 2, len(begins) - 1])
    parts = tuple(np.array(part, "u4") for part in (order, begins, groups))
    view = mesh.encode(meshlets=(parts[0], None, parts[1], parts[2]))
    _codec.validate(view)
    np.testing.assert_array_equal(canonical(*_codec.decode(view)), mesh.corners())
    pages = pages_of(view)
    assert len(pages) == len(groups) - 1
    for page, first, last in zip(pages, groups, groups[1:]):  # no group leaves its page
        expected = mesh.corners(mesh.triangles[order[begins[first] : begins[last]]])
        np.testing.assert_array_equal(canonical(*_codec.decode(page)), expected)


def test_nearly_all_meshlets_that_are_disks_stay(mesh, view):
    """They are cut anew, and now and then into more disks."""
    decoder = _codec.Decoder(view)
    triangles, values = _codec.decode(view)
    sizes = [len(decoder.decode_meshlet(m)[0]) for m in range(decoder.meshlet_count)]
    begins, order = np.cumsum([0, *sizes]).astype("u4"), np.arange(len(triangles), dtype="u4")
    again = Mesh(triangles, values[0].astype(np.float32), values).encode(
        meshlets=(order, None, begins, None)
    )
    decoder = _codec.Decoder(again)
    assert len(sizes) <= decoder.meshlet_count <= 1.02 * len(sizes)


@given(MESHES, st.sampled_from([16, 400, 1500, 5000]), st.integers(0, 999))
@settings(max_examples=30)
def test_pages_hold_whole_groups_in_their_order(mesh, page_bytes, seed):
    if not len(mesh.triangles):
        return
    parts = given_meshlets(mesh, np.random.default_rng(seed))
    view = mesh.encode(meshlets=parts, page_bytes=page_bytes)
    one = mesh.encode(meshlets=parts, page_bytes=1 << 20)
    _codec.validate(view)
    assert len(pages_of(one)) == 1
    for whole in map(_codec.Decoder, (view, one)):
        sizes = [len(whole.decode_meshlet(m)[0]) for m in range(whole.meshlet_count)]
        assert sizes == np.diff(parts[2]).tolist()
    ends = np.cumsum([0, *(_codec.Decoder(page).meshlet_count for page in pages_of(view))])
    assert set(ends) <= set(parts[3])
    groups = np.diff(np.searchsorted(parts[3], ends))
    for page, count in zip(pages_of(view), groups):
        assert count == 1 or len(page) <= page_bytes


def test_pages_of_small_groups_are_full(mesh):
    count = len(mesh.triangles)
    groups = np.array([*range(0, count, 20), count], "u4")
    places = np.arange(len(groups), dtype="u4")
    order = np.arange(count, dtype="u4")
    parts = (order, np.arange(count + 1, dtype="u4"), groups, places)
    pages = pages_of(mesh.encode(meshlets=parts, page_bytes=8192))
    assert len(pages) > 3 and all(0.9 * 8192 <= len(page) <= 8192 for page in pages[:-1])


# --- hostile views ---


def changed(view: bytes, offset: int, value: int) -> bytes:
    return view[:offset] + struct.pack("<I", value) + view[offset + 4 :]


def number(view: bytes, offset: int) -> int:
    return struct.unpack_from("<I", view, offset)[0]


READERS = (
    _codec.decode,
    _codec.decode_values,
    _codec.validate,
    _codec.describe,
    _codec.split,
    _codec.Decoder,
)


def all_refuse(view: bytes, problem: str, readers=READERS) -> None:
    for reader in readers:
        with pytest.raises(ValueError, match=problem) as error:
            reader(view)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("rest", [b"\0" * 4, b"\0" * 40, b"\0" * 400, b"EBM1"])
def test_trailing_bytes(view, rest):
    all_refuse(view + rest, f"blob {len(pages_of(view))}: the blob")


def test_trailing_bytes_of_no_word(view):
    all_refuse(view + b"\0", "multiple of 4|too short")


def test_a_view_that_ends_early(view):
    all_refuse(view[:-4], "byte length is not the blob's")
    all_refuse(view[: len(view) - len(pages_of(view)[-1]) + 16], "too short for a header")


@pytest.mark.parametrize("length", [0, 4, 32, 33, 0x7FFFFFFC, 0xFFFFFFFC, 0xFFFFFFFF])
@pytest.mark.parametrize("page", [0, 1])
def test_a_wrong_byte_length(view, length, page):
    start = _codec.split(view)[page][0]
    all_refuse(changed(view, start + BYTE_LENGTH, length), "^(blob [12]: )?[a-z]")


def test_a_byte_length_that_swallows_the_next_page(view):
    """Bytes that no meshlet uses are no error, but the triangles are missing: accessors differ."""
    (_, first), (_, second) = _codec.split(view)[:2]
    wrong = changed(view, BYTE_LENGTH, first + second)
    assert len(_codec.split(wrong)) == len(_codec.split(view)) - 1
    lost = _codec.Decoder(pages_of(view)[1]).triangle_count
    assert _codec.Decoder(wrong).triangle_count == _codec.Decoder(view).triangle_count - lost


@pytest.mark.parametrize("other", ["bits", "elements", "count"])
def test_streams_that_differ(mesh, view, other):
    values, bits = mesh.values, mesh.bits
    if other == "bits":
        bits = (10, 7)
    elif other == "elements":
        values = [values[0], values[1][:, :1].copy()]
    else:
        values = values[:1]
    second = dataclasses.replace(mesh, values=values, bits=bits).encode()
    all_refuse(view + second, f"blob {len(pages_of(view))}: its streams differ")


def test_steps_and_offsets_that_differ(view):
    size = len(pages_of(view)[0])
    for field in (8, 12):  # of the second page's first stream
        place = size + 32 + field
        wrong = view[:place] + struct.pack("<f", 2.5) + view[place + 4 :]
        all_refuse(wrong, "blob 1: its streams differ")


def test_vertex_counts_that_cheat_each_other(view):
    """The counts sum to the same, so that only each page's own check finds it."""
    start = _codec.split(view)[1][0]
    for amount in (1, -1):
        wrong = changed(view, VERTEX_COUNT, number(view, VERTEX_COUNT) + amount)
        wrong = changed(wrong, start + VERTEX_COUNT, number(view, start + VERTEX_COUNT) - amount)
        for reader in (_codec.decode, _codec.validate):
            for threads in (1, 2):
                with pytest.raises(ValueError, match=r"^blob [01]: the blob has (more|fewer) vert"):
                    reader(wrong, threads)


@given(st.data())
@settings(max_examples=60)
def test_random_damage_never_crashes(view, data):
    damaged = bytearray(view)
    for _ in range(data.draw(st.integers(1, 8))):
        place = data.draw(st.integers(0, len(view) - 1))
        damaged[place] = data.draw(st.integers(0, 255))
    for reader in READERS:
        try:
            reader(bytes(damaged))
        except ValueError as error:
            assert "\n" not in str(error)


def test_the_first_damaged_page_is_reported_whatever_the_threads(view):
    """Page 2 is found damaged at its end, page 3 at its beginning."""
    pages = _codec.split(view)
    second, third = pages[2][0], pages[3][0]
    damaged = bytearray(
        changed(view, second + VERTEX_COUNT, number(view, second + VERTEX_COUNT) + 1)
    )
    data = third + number(view, third + 24) + 128  # behind the entries
    damaged[data : data + 64] = b"\xff" * 64
    messages = set()
    for threads in [1] + 100 * [2]:
        with pytest.raises(ValueError) as error:
            _codec.validate(bytes(damaged), threads)
        messages.add(str(error.value))
    assert len(messages) == 1 and messages.pop().startswith("blob 2: ")
