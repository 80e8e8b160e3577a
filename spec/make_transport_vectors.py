"""Writes spec/transport_vectors: conformance vectors of EXT_meshlet_transport.

    python -m spec.make_transport_vectors

valid_NAME.bin are packed views, valid_NAME.resident their resident bytes. malformed_NAME.bin break
a rule each; malformed.json has the reasons that the reference unpacker gives.
"""

from __future__ import annotations

import json
import struct
from functools import partial
from pathlib import Path

import numpy as np

from gltf_ext import _codec
from spec import blob_writer, make_vectors, reference_decoder, reference_transport
from spec.blob_writer import AFFINE, FOREIGN, GEO, GRID, INTEGER, OCT, OWNED, PRIVATE
from spec.make_vectors import encode, position_stream, stream

FOLDER = Path(__file__).parent / "transport_vectors"
TABLE_BYTES = 12  # of a packed view with one page


def separate_quads() -> bytes:
    """Boxes whose sides share positions, but no vertices: matches, copies and repeats."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    positions: list = []
    normals: list = []
    triangles: list = []
    for box in range(12):
        place = np.array([box % 4 * 700 + 37, box // 4 * 900, box * box * 17])
        for side, quad in enumerate(sides):
            first = len(positions)
            positions += [corners[i] * (200 + 13 * box) + place for i in quad]
            normals += [[127 + 20 * side, side * 91 % 255]] * 4
            triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    streams = [position_stream(13), stream(OCT, 2, 8, GEO), stream(GRID, 2, 10, AFFINE)]
    texcoords = [[0, 0], [1023, 0], [1023, 1023], [0, 1023]] * (len(positions) // 4)
    return encode(triangles, positions, streams, [normals, texcoords])


def large_numbers() -> bytes:
    """Positions of 22 bits and integers of 32, both noisy: large residuals."""
    noise = np.random.default_rng(31).integers(0, 5000, (80, 4))
    positions = make_vectors.grid_positions(9, 7, 400_000) + noise[:, :3]
    integers = np.arange(80)[:, None] * 50_000_000 + noise * [1, 20, 400, 8000]
    streams = [position_stream(22), stream(INTEGER, 4, 32), stream(GRID, 2, 24, AFFINE)]
    return encode(
        make_vectors.grid_triangles(9, 7), positions, streams, [integers, positions[:, :2] * 4]
    )


def halves() -> bytes:
    """Pairs of integers of 32 bits that differ by 2^31: twice their residuals is 0, modulo 2^32."""
    positions = make_vectors.grid_positions(9, 7, 400)
    integers = np.random.default_rng(7).integers(0, 2, (len(positions), 2)) << 31
    streams = [position_stream(13), stream(INTEGER, 2, 32)]
    return encode(make_vectors.grid_triangles(9, 7), positions, streams, [integers])


def surface(columns: int, rows: int, seed: int, noise: int, flip: float) -> bytes:
    """A bent grid with holes: quads are cut along either diagonal, and normals and texture
    coordinates have creases."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    points = np.stack(
        [
            300 * u + 40 * v,
            280 * v + 700,
            900
            + 800 * np.sin(u / 3) * np.cos(v / 4)
            + 300 * (u > columns // 2) * (u - columns / 2),
        ],
        axis=-1,
    )
    positions = np.rint(points + rng.uniform(-noise, noise, points.shape)).reshape(-1, 3)
    triangles = []
    for y in range(rows):
        for x in range(columns):
            a, b = y * (columns + 1) + x, (y + 1) * (columns + 1) + x
            if x % 7 == 3 and y % 5 == 2:
                continue
            diagonal = rng.random() < flip
            triangles += (
                [[a, a + 1, b + 1], [a, b + 1, b]]
                if diagonal
                else [[a, a + 1, b], [a + 1, b + 1, b]]
            )
    bend = 90 + 30 * np.sin(u / 3) + rng.integers(-2, 3, u.shape)
    normals = np.stack([bend, 100 + 10 * np.cos(v / 4) - 60 * (v > rows // 2)], axis=-1)
    texcoords = np.stack([(u * 97 + u * u) % 1024, v * 61], axis=-1)
    streams = [position_stream(13), stream(OCT, 2, 8, GEO), stream(GRID, 2, 10, AFFINE)]
    values = [np.rint(normals).astype(int).reshape(-1, 2), texcoords.reshape(-1, 2)]
    return encode(triangles, positions.astype(int), streams, values)


def backwards() -> bytes:
    """Normals against the triangles' and far around: inverted ones, also at the square's border."""
    triangles, positions = make_vectors.grid_triangles(8, 8), make_vectors.grid_positions(8, 8, 200)
    rng = np.random.default_rng(5)
    corners = np.array([[0, 0], [254, 0], [0, 254], [254, 254], [127, 127], [0, 100], [130, 254]])
    normals = corners[rng.integers(0, len(corners), len(positions))]
    normals[:20] = [[126, 128]] * 20
    return encode(
        triangles[:, ::-1] if isinstance(triangles, np.ndarray) else [t[::-1] for t in triangles],
        positions,
        [position_stream(), stream(OCT, 2, 8, GEO)],
        [normals],
    )


def narrow_and_wide_normals() -> bytes:
    """Normals of 2 and of 16 bits."""
    positions = make_vectors.grid_positions(9, 7, 200)
    rng = np.random.default_rng(8)
    narrow = rng.integers(0, 3, (len(positions), 2))
    wide = 32767 + rng.integers(-40, 41, (len(positions), 2))
    streams = [position_stream(), stream(OCT, 2, 2, GEO), stream(OCT, 2, 16, GEO)]
    return encode(make_vectors.grid_triangles(9, 7), positions, streams, [narrow, wide])


def angles_of_large_triangles() -> bytes:
    """Normals that are weighted by angles, of triangles with long edges."""
    rng = np.random.default_rng(12)
    points = make_vectors.grid_positions(7, 7, 500).reshape(-1, 3).astype(float)
    points += rng.uniform(-180, 180, points.shape) + 200
    positions, triangles = np.rint(points).astype(int), make_vectors.grid_triangles(7, 7)
    sums = np.zeros(points.shape)
    for triangle in triangles:
        for k in range(3):
            a, b, c = (positions[triangle[(k + i) % 3]] for i in range(3))
            e, f = b - a, c - a
            normal = np.cross(e, f).astype(float)
            angle = np.arctan2(np.linalg.norm(normal), e @ f)
            sums[triangle[k]] += normal / np.linalg.norm(normal) * angle
    normals = make_vectors.octahedral_integers(
        sums / np.linalg.norm(sums, axis=1, keepdims=True), 10
    )
    return encode(triangles, positions, [position_stream(), stream(OCT, 2, 10, GEO)], [normals])


def many_owners() -> bytes:
    """Slots among 20, 16 and fewer open references."""
    streams = [blob_writer.Stream(bits=12)]
    reference = make_vectors.reference
    fan = "R" * 17 + "E"
    owners = make_vectors.fixed_meshlet(fan, [[reference(OWNED, 1)] * 20], streams, [20], [0], [0])
    meshlets = [owners]
    for slot in (18, 3, 16, 9, 12, 0, 5):
        loop = [reference(FOREIGN, 1, len(meshlets), slot), reference(PRIVATE, 2)]
        meshlets.append(make_vectors.fixed_meshlet("E", [loop], streams, [0], [0], [1]))
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return canonical(make_vectors.with_vertex_count(blob, make_vectors.count_vertices(blob)))


def later_and_taken_owners() -> bytes:
    """A reference whose owner comes later in its meshlet, and an edge of four triangles."""
    streams = [blob_writer.Stream(bits=12)]
    reference, meshlet = make_vectors.reference, make_vectors.fixed_meshlet
    own, private = reference(OWNED, 1), reference(PRIVATE, 1)
    loop = [private, reference(FOREIGN, 1), private, own, private]
    meshlets = [
        meshlet("E", [[own, own, own]], streams, [3], [0], [0]),
        meshlet("RRE", [loop], streams, [3], [0], [0]),
        *(
            meshlet(
                "E", [[reference(FOREIGN, 1, m, slot), private, private]], streams, [1], [0], [0]
            )
            for m, slot in ((2, 1), (3, 1), (4, 1), (5, 2))
        ),
    ]
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return canonical(make_vectors.with_vertex_count(blob, make_vectors.count_vertices(blob)))


def canonical(blob: bytes) -> bytes:
    """The blob in the canonical form, in which it can be packed."""
    decoder = reference_decoder.Decoder(blob)
    page = reference_transport.Page.__new__(reference_transport.Page)
    count = len(decoder.file.streams)
    rows = (blob[32 + 28 * s :][:28] for s in range(count))
    page.streams = [reference_transport.stream_of(row) for row in rows]
    page.meshlets, page.count, page.values = [], [0] * count, [{} for _ in range(count)]
    for m in range(decoder.file.meshlet_count):
        source = decoder.file.meshlet(m)
        meshlet = reference_transport.Meshlet(source.symbols, source.connectivity)
        page.meshlets.append(meshlet)
        ends = {loop[-1] for loop in source.loops}
        for j, (r, run) in enumerate(zip(source.references, decoder.boundary(source))):
            shares = [r.shares(s) for s in range(count)] if r.kind == FOREIGN else []
            meshlet.references.append(
                reference_transport.Reference(
                    m, j, r.kind, j in ends, len(run) - 1, shares, r.slot, run=run
                )
            )
        for ours, of in zip(meshlet.references, source.references):
            if of.kind == FOREIGN:
                owner, k = decoder.owned_reference(of)
                ours.owner = page.meshlets[owner.index].references[k]
        for s, values in enumerate(decoder.meshlet(m)[1]):
            page._number(meshlet, s)
            page.values[s].update(zip(meshlet.ids[s], values))
    return reference_transport.write_page(page)


def hand_made(name: str) -> bytes:
    return canonical(make_vectors.VALID[name][0]())


# Vectors of EXT_meshlet_edgebreaker whose structures count here, too.
HAND_MADE = (
    "affine_seams",
    "awkward_topology",
    "chain_codes",
    "collapsed_by_aliases",
    "corner_of_two_runs",
    "eight_hops",
    "exp_golomb_codes",
    "extreme_codes",
    "filled_hole",
    "flat_positions",
    "gap_before_meshlets",
    "geo_without_references",
    "grid_arithmetic",
    "hops_of_different_lengths",
    "interior_of_several_streams",
    "oct_axes",
    "redundant_masks",
    "tetrahedron",
    "two_vertex_loop",
)

VALID = {
    "quad": make_vectors.quad,
    "pages": make_vectors.encoded_pages,
    "raw_pages": make_vectors.minus_zeros,
    "seam_within_a_meshlet": make_vectors.seam_within_a_meshlet,
    "seams_between_meshlets": make_vectors.seams_between_meshlets,
    "normals_and_texcoords": make_vectors.normals_and_texcoords,
    "separate_quads": separate_quads,
    "large_numbers": large_numbers,
    "halves": halves,
    "surface": lambda: surface(16, 14, 3, 0, 0.0),
    "rough_surface": lambda: surface(14, 12, 4, 30, 0.5),
    "smooth_surface": lambda: surface(18, 10, 5, 3, 1.0),
    "backwards": backwards,
    "narrow_and_wide_normals": narrow_and_wide_normals,
    "angles_of_large_triangles": angles_of_large_triangles,
    "many_owners": many_owners,
    "later_and_taken_owners": later_and_taken_owners,
    **{
        name: make_vectors.VALID[name][0]
        for name in ("every_kind", "every_predictor", "several_disks", "several_groups")
    },
}
VALID |= {name: partial(hand_made, name) for name in HAND_MADE}


def malformed() -> dict[str, bytes]:
    """Name -> packed view that breaks a rule. All but the first ones change one page."""
    good = _codec.pack(make_vectors.several_disks())
    page = good[TABLE_BYTES:]
    resident = struct.unpack_from("<I", good, 4)[0]
    words = struct.unpack_from("<I", page, 8)[0]
    end = 20 + 4 * words  # of the words

    def view(page: bytes, size: int = resident, version: int = 1, pages: int = 1) -> bytes:
        return struct.pack("<3I", version | pages << 8, size, len(page)) + page

    def with_word(i: int, value: int) -> bytes:
        return view(page[: 4 * i] + struct.pack("<I", value) + page[4 * i + 4 :])

    return {
        "empty": b"",
        "no_pages": struct.pack("<I", 1),
        "version": view(page, version=2),
        "table_beyond_the_end": view(page, pages=1000),
        "page_beyond_the_end": good[:-1],
        "longer_than_its_pages": good + bytes(4),
        "no_resident_bytes": view(page, 0),
        "resident_bytes_huge": view(page, 4096 + 256 * len(page) + 4),
        "resident_bytes_too_many": view(page, resident + 4),
        "resident_bytes_too_few": view(page, resident - 4),
        "raw_page_cut": struct.pack("<3I", 1 | 1 << 8, 96, 0) + bytes(92),
        "page_without_header": view(page[:16]),
        "words_beyond_the_page": with_word(2, len(page)),
        "no_meshlets": with_word(1, 0),
        "triangles_below_meshlets": with_word(0, 0),
        "triangles_above_meshlets": with_word(0, 1000),
        "another_triangle_count": with_word(0, struct.unpack_from("<I", page)[0] - 1),
        "words_missing": view(
            page[:8] + struct.pack("<I", words - 1) + page[12 : end - 4] + page[end:]
        ),
        "words_left": view(
            page[:8] + struct.pack("<I", words + 1) + page[12:end] + bytes(4) + page[end:]
        ),
        "bits_missing": view(page[:-1]),
        "bits_left": view(page + bytes(1)),
        "last_bits_not_zero": view(page[:-1] + bytes([page[-1] | 128])),
        "state": with_word(3, struct.unpack_from("<I", page, 12)[0] ^ 1 << 20),
    }


# Malformed pages: a valid view and the bits of it that are changed, found by trying.
DAMAGED: dict[str, tuple[str, list[int]]] = {
    "match": ("gap_before_meshlets", [732]),
    "normal": ("backwards", [1081]),
    "early_end": ("seam_within_a_meshlet", [1213]),
    "symbol": ("affine_seams", [221, 1361]),
    "reserved": ("extreme_codes", [420, 360]),
    "large_meshlet": ("hops_of_different_lengths", [205]),
    "split": ("affine_seams", [232, 1726]),
    "reference": ("collapsed_by_aliases", [216]),
    "long_reference": ("hops_of_different_lengths", [269, 617]),
    "candidate": ("redundant_masks", [276, 302]),
    "owner_before_the_first": ("eight_hops", [212]),
    "stream": ("eight_hops", [469, 468]),
    "slot": ("redundant_masks", [302]),
    "wide_stream": ("hops_of_different_lengths", [538, 478]),
    "normal_stream": ("quad", [422, 356]),
}


def damaged() -> dict[str, bytes]:
    """Name -> malformed view."""
    result = {}
    for name, (valid, bits) in DAMAGED.items():
        view = bytearray(_codec.pack(VALID[valid]()))
        for bit in bits:
            view[bit >> 3] ^= 1 << (bit & 7)
        result[name] = bytes(view)
    return result


def refusal(packed: bytes) -> str:
    """The reference unpacker's reason."""
    try:
        reference_transport.unpack_view(packed)
    except ValueError as error:
        return str(error)
    raise AssertionError("the reference unpacker accepts a view that should be malformed")


def files() -> dict[str, bytes]:
    """File name -> contents."""
    result = {}
    for name, make in VALID.items():
        view = make()
        result[f"valid_{name}.resident"] = view
        result[f"valid_{name}.bin"] = _codec.pack(view)
    reasons = {}
    for name, packed in (malformed() | damaged()).items():
        result[f"malformed_{name}.bin"] = packed
        reasons[f"malformed_{name}.bin"] = refusal(packed)
    result["malformed.json"] = (json.dumps(reasons, indent=1) + "\n").encode()
    return result


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.iterdir():
        old.unlink()
    for name, data in files().items():
        (FOLDER / name).write_bytes(data)


if __name__ == "__main__":
    main()
