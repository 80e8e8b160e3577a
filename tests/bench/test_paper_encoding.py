"""bench.paper_encoding: decodes to the same triangles and integers, in the paper's layout."""

import random
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from bench import paper_encoding as pe
from bench import peers
from bench.generated import boxes, torus
from bench.models import PAPER_MODELS
from gltf_ext.attributes.streams import Bits
from gltf_meshlet.demo import model as demo_model

BITS = Bits()


# --- the decoder ---


class BitReader:
    """Reads what a BitWriter wrote, from any bit on."""

    def __init__(self, data: bytes, position: int):
        self._data, self.position = data, position

    def read(self, width: int) -> int:
        start, stop = self.position, self.position + width
        self.position = stop
        return int.from_bytes(self._data[start >> 3 : stop + 7 >> 3], "little") >> (start & 7) & (
            (1 << width) - 1
        )


def unfold(symbols: str) -> tuple[list[tuple[int, int, int]], list[tuple[int, int]], int]:
    """The inverse of `clers`: (triangles, (vertex, end of its gate) per C, length of the loop).

    Ids are the loop's, 0 being where the first gate starts, and after them the interior vertices in
    order.
    """
    length = border_length(symbols, 0)
    triangles, interior = [], []
    rest = [[*range(1, length), 0]]
    t = 0
    while rest:
        border = rest.pop()
        symbol = ""
        while symbol != "E":
            symbol, a, b = symbols[t], border[-1], border[0]
            t += 1
            if symbol == "C":
                v = length + len(interior)
                interior.append((v, b))
                border.append(v)
            elif symbol == "S":
                middle = border_length(symbols, t) - 1
                v = border[middle]
                rest.append(border[middle:])
                del border[middle + 1 :]
            else:
                v = border[-2] if symbol == "L" else border[1]
                del border[-1 if symbol == "L" else 0]
            triangles.append((a, b, v))
    return triangles, interior, length


def border_length(symbols: str, begin: int) -> int:
    """Counts the edges around the part that symbol `begin` starts.

    E closes three, R and L close one, C opens one, S doubles one.
    """
    length, open_parts = 0, 1
    for t in range(begin, len(symbols)):
        symbol = symbols[t]
        length += {"E": 3, "R": 1, "L": 1, "C": -1, "S": -1}[symbol]
        open_parts += (symbol == "S") - (symbol == "E")
        if not open_parts:
            return length
    raise ValueError("the symbols lack an E")


@dataclass
class DecodedMeshlet:
    """triangles: local ids; vertices: (x, y, z, packed other attributes) per local id."""

    triangles: list[tuple[int, int, int]]
    vertices: list[tuple[int, ...]]


def decode(data: bytes) -> list[list[DecodedMeshlet]]:
    """Every meshlet of every part, from the file alone."""
    magic, n, m, normal_bits, texcoord_bits, part_count, table_bytes = pe.HEADER.unpack_from(data)
    if magic != pe.MAGIC:
        raise ValueError(f"the file does not start with {pe.MAGIC.decode()}")
    parts, at, stream_start = [], pe.HEADER.size, 8 * (pe.HEADER.size + table_bytes)
    for _ in range(part_count):
        kinds, meshlets, references, boundaries, origin = pe.PART.unpack_from(data, at)
        words = np.frombuffer(
            data,
            "<u4",
            pe.MESHLET_WORDS * meshlets + references + boundaries + 1,
            at + pe.PART.size,
        ).tolist()
        at += pe.PART.size + 4 * len(words)
        part = PartReader(
            data,
            stream_start + origin,
            n,
            m,
            2 * normal_bits * (kinds & 1) + texcoord_bits * (kinds & 2),
        )
        part.read_tables(words, meshlets, references)
        parts.append([part.meshlet(i) for i in range(meshlets)])
    return parts


class PartReader:
    """Decodes single meshlets of a part; reads only their own bits and their boundaries'."""

    def __init__(self, data: bytes, origin: int, n: int, m: int, attribute_bits: int):
        self.data, self.origin, self.n, self.m, self.attribute_bits = (
            data,
            origin,
            n,
            m,
            attribute_bits,
        )

    def read_tables(self, words: list[int], meshlets: int, references: int) -> None:
        split = pe.MESHLET_WORDS * meshlets
        self.meshlets = [words[i : i + pe.MESHLET_WORDS] for i in range(0, split, pe.MESHLET_WORDS)]
        self.references, self.boundaries = (
            words[split : split + references],
            words[split + references :],
        )

    def meshlet(self, index: int) -> DecodedMeshlet:
        symbols_start, interior_start, first, triangle_count = self.meshlets[index]
        stop = (
            self.meshlets[index + 1][2] if index + 1 < len(self.meshlets) else len(self.references)
        )
        symbols = self._symbols(symbols_start, triangle_count)
        triangles, interior, length = unfold(symbols)
        vertices = [
            v for reference in self.references[first:stop] for v in self._boundary(reference)[:-1]
        ]
        if len(vertices) != length:
            raise ValueError(
                f"meshlet {index}: its boundaries have {len(vertices)} edges instead of {length}"
            )
        reader = BitReader(self.data, self.origin + interior_start)
        for _, gate_end in interior:
            vertices.append(self._moved(reader, vertices[gate_end]))
        return DecodedMeshlet(triangles, vertices)

    def _symbols(self, start: int, count: int) -> str:
        reader, symbols = BitReader(self.data, self.origin + start), ""
        for _ in range(count):
            code = reader.read(2)
            symbols += "CRE"[code] if code < 3 else "LS"[reader.read(1)]
        return symbols

    def _boundary(self, reference: int) -> list[tuple[int, ...]]:
        """The vertices along a reference, both ends included."""
        boundary, backwards = reference >> 1, reference & 1
        reader = BitReader(self.data, self.origin + self.boundaries[boundary])
        stop = self.origin + self.boundaries[boundary + 1]
        run, last = [self._end(reader)], self._end(reader)
        while reader.position < stop:
            run.append(self._moved(reader, run[-1]))
        run.append(last)
        return run[::-1] if backwards else run

    def _end(self, reader: BitReader) -> tuple[int, ...]:
        return (*(reader.read(self.n) for _ in range(3)), reader.read(self.attribute_bits))

    def _moved(self, reader: BitReader, base: tuple[int, ...]) -> tuple[int, ...]:
        difference = read_difference(reader, self.n, self.m)
        position = ((x + pe.unzigzag(u)) % (1 << self.n) for x, u in zip(base, difference))
        return (*position, reader.read(self.attribute_bits))


def read_difference(reader: BitReader, n: int, m: int) -> list[int]:
    """The inverse of `write_difference`."""
    flags = [m < n and reader.read(1) for _ in range(3)]
    low = [reader.read(m) for _ in range(3)]
    return [u | reader.read(n - m) << m if flag else u for flag, u in zip(flags, low)]


def soup(mesh: pe.Mesh) -> list[tuple]:
    """A mesh's triangles as sorted triples of vertices (x, y, z, packed other attributes).

    Each triple starts with its smallest vertex, so that soups compare.
    """
    corners = [(*position, packed) for position, packed in zip(mesh.positions, mesh.attributes)]
    return sorted(
        _rotated([corners[disk.vertices[v]] for v in t])
        for disk in mesh.disks
        for t in disk.triangles
    )


def decoded_soup(meshlets: list[DecodedMeshlet]) -> list[tuple]:
    """The same of what was decoded."""
    return sorted(
        _rotated([meshlet.vertices[v] for v in t])
        for meshlet in meshlets
        for t in meshlet.triangles
    )


def _rotated(triangle: list) -> tuple:
    a, b, c = triangle
    return min((a, b, c), (b, c, a), (c, a, b))


# --- models ---


def source_soup(part: peers.Part) -> list:
    """A part's triangles as `soup` gives them, from its arrays alone."""
    columns = []
    if part.normals is not None:
        columns += [
            (column, BITS.normal) for column in pe.spherical(part.normals, BITS.normal).T.tolist()
        ]
    if part.texcoords is not None:
        columns += [
            (column, BITS.texcoord) for column in np.rint(part.texcoords).astype(int).T.tolist()
        ]
    packed, width = [0] * len(part.positions), 0
    for column, bits in columns:
        packed = [p + (value << width) for p, value in zip(packed, column)]
        width += bits
    corners = [
        (*position, rest)
        for position, rest in zip(np.rint(part.positions).astype(int).tolist(), packed)
    ]
    return sorted(_rotated([corners[v] for v in triangle]) for triangle in part.triangles.tolist())


def parts_from_demo(parts: list[demo_model.Primitive], tmp_path) -> list[peers.Part]:
    demo_model.write_glb(parts, tmp_path / "model.glb")
    return peers.read_parts(tmp_path / "model.glb")


def part_from_trimesh(mesh: trimesh.Trimesh) -> peers.Part:
    positions = mesh.vertices - mesh.vertices.min(axis=0)
    steps = positions / positions.max() * (2**BITS.position - 1)
    return peers.Part(
        mesh.faces.astype(np.uint32),
        steps.astype(np.float32),
        mesh.vertex_normals.astype(np.float32),
    )


# --- bits ---


@given(
    st.lists(
        st.integers(0, 70).flatmap(
            lambda width: st.tuples(st.integers(0, 2**width - 1), st.just(width))
        )
    )
)
def test_bits_come_back(fields):
    writer = pe.BitWriter()
    for value, width in fields:
        writer.write(value, width)
    reader = BitReader(writer.getvalue(), 0)
    assert [reader.read(width) for _, width in fields] == [value for value, _ in fields]
    assert reader.position == writer.position == sum(width for _, width in fields)


@given(
    st.integers(1, 24).flatmap(
        lambda bits: st.tuples(st.just(bits), *[st.integers(0, 2**bits - 1)] * 2)
    )
)
def test_differences_come_back_modulo_the_grid(case):
    bits, x, base = case
    u = pe.zigzag(x - base, bits)
    assert 0 <= u < 2**bits
    assert (base + pe.unzigzag(u)) % 2**bits == x


def test_small_differences_of_either_sign_are_small():
    assert [pe.zigzag(d, 12) for d in (0, -1, 1, -2, 2)] == [0, 1, 2, 3, 4]


def test_layout_of_a_difference():
    """The paper's Figure 2: all flags, then the low blocks, then the needed high blocks."""
    writer = pe.BitWriter()
    pe.write_difference(writer, [0x3, 0x25, 0x0], 8, 4)
    assert writer.position == 3 + 3 * 4 + 4
    reader = BitReader(writer.getvalue(), 0)
    assert [reader.read(1) for _ in range(3)] == [0, 1, 0]
    assert [reader.read(4) for _ in range(4)] == [0x3, 0x5, 0x0, 0x2]
    assert read_difference(BitReader(writer.getvalue(), 0), 8, 4) == [0x3, 0x25, 0x0]


def test_full_width_differences_have_no_flags():
    writer = pe.BitWriter()
    pe.write_difference(writer, [200, 0, 255], 8, 8)
    assert writer.position == 24
    assert read_difference(BitReader(writer.getvalue(), 0), 8, 8) == [200, 0, 255]


def test_m_is_the_best_of_all():
    lengths = Counter({3: 90, 12: 10})
    assert pe.best_m(lengths, 12) == 3
    assert pe.difference_bits(lengths, 12, 3) == 90 * 4 + 10 * 13
    assert pe.best_m(Counter({12: 5}), 12) == 12  # flags would only cost


# --- connectivity ---


def random_disk(rng: random.Random, triangle_count: int) -> tuple[list[tuple], list[int]]:
    """Triangles and border of a disk, grown by gluing triangles to its border."""
    triangles, border, edges, vertices = [(0, 1, 2)], [0, 1, 2], {(0, 1), (1, 2), (2, 0)}, 3
    while len(triangles) < triangle_count:
        i = rng.randrange(len(border))
        border = border[i:] + border[:i]
        a, b, c = border[:3]
        if len(border) > 3 and rng.random() < 0.6 and (a, c) not in edges and (c, a) not in edges:
            triangle, border = (c, b, a), [a, *border[2:]]  # b becomes an inner vertex
        else:
            triangle, border = (b, a, vertices), [a, vertices, *border[1:]]
            vertices += 1
        triangles.append(triangle)
        edges.update(zip(triangle, (*triangle[1:], triangle[0])))
    return triangles, border


@given(st.integers(0, 2**32), st.integers(1, 64))
def test_symbols_unfold_to_the_disk(seed, triangle_count):
    triangles, border = random_disk(random.Random(seed), triangle_count)
    symbols, interior = pe.clers(triangles, border)
    assert len(symbols) == len(triangles)
    unfolded, gates, length = unfold(symbols)
    assert length == len(border)
    names = [*border, *(v for v, _ in interior)]
    rotate = lambda t: min(t[k:] + t[:k] for k in range(3))  # noqa: E731
    assert sorted(rotate(tuple(names[v] for v in t)) for t in unfolded) == sorted(
        map(rotate, triangles)
    )
    assert [(names[v], names[b]) for v, b in gates] == interior


@pytest.mark.parametrize("symbols", ["", "C", "CR", "RRS", "CCRRS"])
def test_unfinished_symbols_are_refused(symbols):
    with pytest.raises(ValueError, match="lack an E"):
        unfold(symbols)


def test_symbol_codes_are_the_papers():
    assert {symbol: width for symbol, (_, width) in pe.CODES.items()} == {
        "C": 2,
        "R": 2,
        "E": 2,
        "L": 3,
        "S": 3,
    }


# --- whole models ---


def check(parts: list[peers.Part], fill: float = 0.0) -> pe.Encoded:
    encoded = pe.encode(parts, BITS, fill)
    decoded = decode(encoded.data)
    assert [decoded_soup(meshlets) for meshlets in decoded] == [source_soup(part) for part in parts]
    assert sum(encoded.bits.values()) == 8 * len(encoded.data)
    assert sum(encoded.symbols.values()) == sum(len(part.triangles) for part in parts)
    return encoded


@pytest.mark.parametrize("fill", [0.0, 0.68])
def test_demo_parts_come_back(tmp_path, fill):
    check(
        parts_from_demo(
            [part for part in demo_model.generate() if part.mesh != "sculpture"], tmp_path
        ),
        fill,
    )


def test_generated_models_come_back(tmp_path):
    check(parts_from_demo([torus(5000)], tmp_path))
    encoded = check(parts_from_demo([boxes(30)], tmp_path))
    assert encoded.counts["meshlets"] == 6 * 30  # a disk for every side


TETRAHEDRON = trimesh.Trimesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
)


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box(),
        trimesh.creation.icosphere(2),
        trimesh.creation.annulus(1, 2, 1),
        TETRAHEDRON,
    ],
)
def test_closed_surfaces_come_back(mesh):
    """One meshlet cuts such a surface open: both sides of a boundary belong to it."""
    check([part_from_trimesh(mesh)])


def test_grid_of_noise_needs_all_bits(tmp_path):
    """Differences that fill the grid are written whole."""
    mesh = trimesh.creation.icosphere(3)
    rng = np.random.default_rng(4)
    part = peers.Part(
        mesh.faces.astype(np.uint32), rng.integers(0, 4096, mesh.vertices.shape).astype(np.float32)
    )
    encoded = check([part])
    assert encoded.m == 12 and encoded.difference_bits == 36 * (
        encoded.counts["inner"] + encoded.counts["interior"]
    )


def test_triangles_that_collapse_on_the_grid_come_back():
    mesh = trimesh.creation.icosphere(3)
    steps = np.rint((mesh.vertices + 1) * 3).astype(np.float32)
    assert len(np.unique(steps, axis=0)) < len(steps)
    check([peers.Part(mesh.faces.astype(np.uint32), steps)])


def test_boundaries_are_stored_once():
    mesh = pe.mesh_of(part_from_trimesh(trimesh.creation.icosphere(4)), BITS, 0.0)
    edges = Counter(frozenset(edge) for run in mesh.boundaries for edge in pairwise(run))
    assert set(edges.values()) == {1}
    sides = sum(len(disk.loop) for disk in mesh.disks)
    assert sides == 2 * len(edges)  # the surface is closed: every edge of a loop has two sides
    assert sum(len(disk.references) for disk in mesh.disks) == 2 * len(mesh.boundaries)


def test_a_meshlet_that_closes_on_itself_stores_each_edge_once():
    """An unfolded tetrahedron: the flaps' tips are one vertex, the loop's edges meet in pairs."""
    triangles, loop = [(0, 1, 2), (1, 0, 3), (2, 1, 4), (0, 2, 5)], [0, 3, 1, 4, 2, 5]
    disk = pe.Disk(triangles, loop, [0, 1, 2, 3, 3, 3])
    boundaries = pe._boundaries([disk])
    assert sorted(map(sorted, boundaries)) == [[0, 3], [1, 3], [2, 3]]
    assert sorted(disk.references) == [
        (b, backwards) for b in range(3) for backwards in (False, True)
    ]
    check_disks([disk], boundaries)


def test_meshlets_that_share_a_whole_loop_start_at_the_same_vertex():
    """A pillow: two squares sewn together, with different diagonals and first corners."""
    front = pe.Disk([(0, 1, 2), (0, 2, 3)], [1, 2, 3, 0], [0, 1, 2, 3])
    back = pe.Disk([(0, 3, 1), (1, 3, 2)], [2, 1, 0, 3], [0, 1, 2, 3])
    boundaries = pe._boundaries([front, back])
    assert len(boundaries) == 1 and len(boundaries[0]) == 5
    assert (front.references, back.references) == ([(0, False)], [(0, True)])
    check_disks([front, back], boundaries)


def test_edges_of_three_triangles_are_shared_by_none():
    disks = [
        pe.Disk([(0, 1, 2)], [0, 1, 2], vertices) for vertices in ([0, 1, 2], [1, 0, 3], [1, 0, 4])
    ]
    boundaries = pe._boundaries(disks)
    assert [disk.references for disk in disks] == [[(0, False)], [(1, False)], [(2, False)]]
    check_disks(disks, boundaries)


def check_disks(disks: list[pe.Disk], boundaries: list[list[int]]) -> None:
    vertex_count = 1 + max(v for disk in disks for v in disk.vertices)
    mesh = pe.Mesh(
        [[v, v * v, 4095 - v] for v in range(vertex_count)],
        [0] * vertex_count,
        0,
        0,
        disks,
        boundaries,
    )
    assert decoded_soup(decode(pe.encode_meshes([mesh], BITS).data)[0]) == soup(mesh)


def test_a_changed_bit_of_a_vertex_shows():
    encoded = pe.encode([part_from_trimesh(trimesh.creation.icosphere(2))])
    good = decoded_soup(decode(encoded.data)[0])
    damaged = bytearray(encoded.data)
    tables = pe.HEADER.unpack_from(encoded.data)[-1]
    damaged[pe.HEADER.size + tables] ^= 1  # the first vertex's x
    assert decoded_soup(decode(bytes(damaged))[0]) != good


def test_other_files_are_refused():
    with pytest.raises(ValueError, match="does not start with"):
        decode(b"EBM1" + bytes(64))


@pytest.mark.parametrize(
    "name",
    [
        "DamagedHelmet.glb",
        *(pytest.param(f"{name}.glb", marks=pytest.mark.full) for name in PAPER_MODELS),
    ],
)
def test_real_models_come_back(model, name):
    check(peers.read_parts(model(name)))
