"""bench.paper_encoding: decodes to the same triangles and integers, in the paper's layout."""

import random
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from bench import paper_encoding as pe
from bench import peers
from bench.generated import boxes, torus
from gltf_ext.compression.streams import Bits
from gltf_meshlet.demo import model as demo_model

BITS = Bits()


def source_soup(part: peers.Part) -> list:
    """A part's triangles as `pe.soup` gives them, from its arrays alone."""
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
    soup = []
    for triangle in part.triangles.tolist():
        a, b, c = (corners[v] for v in triangle)
        soup.append(min((a, b, c), (b, c, a), (c, a, b)))
    return sorted(soup)


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
    reader = pe.BitReader(writer.getvalue(), 0)
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
    reader = pe.BitReader(writer.getvalue(), 0)
    assert [reader.read(1) for _ in range(3)] == [0, 1, 0]
    assert [reader.read(4) for _ in range(4)] == [0x3, 0x5, 0x0, 0x2]
    assert pe.read_difference(pe.BitReader(writer.getvalue(), 0), 8, 4) == [0x3, 0x25, 0x0]


def test_full_width_differences_have_no_flags():
    writer = pe.BitWriter()
    pe.write_difference(writer, [200, 0, 255], 8, 8)
    assert writer.position == 24
    assert pe.read_difference(pe.BitReader(writer.getvalue(), 0), 8, 8) == [200, 0, 255]


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
    unfolded, gates, length = pe.unfold(symbols)
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
        pe.unfold(symbols)


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
    decoded = pe.decode(encoded.data)
    assert [pe.decoded_soup(meshlets) for meshlets in decoded] == [
        source_soup(part) for part in parts
    ]
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
    assert pe.decoded_soup(pe.decode(pe.encode_meshes([mesh], BITS).data)[0]) == pe.soup(mesh)


def test_a_changed_bit_of_a_vertex_shows():
    encoded = pe.encode([part_from_trimesh(trimesh.creation.icosphere(2))])
    good = pe.decoded_soup(pe.decode(encoded.data)[0])
    damaged = bytearray(encoded.data)
    tables = pe.HEADER.unpack_from(encoded.data)[-1]
    damaged[pe.HEADER.size + tables] ^= 1  # the first vertex's x
    assert pe.decoded_soup(pe.decode(bytes(damaged))[0]) != good


def test_other_files_are_refused():
    with pytest.raises(ValueError, match="does not start with"):
        pe.decode(b"EBM1" + bytes(64))


@pytest.mark.parametrize(
    "name", ["DamagedHelmet.glb", pytest.param("suzanne.glb", marks=pytest.mark.full)]
)
def test_real_models_come_back(model, name):
    check(peers.read_parts(model(name)))
