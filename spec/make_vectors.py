"""Writes the conformance vectors of spec/vectors and the worked example of the specification.

    python -m spec.make_vectors

valid_NAME.bin is a blob and valid_NAME.json its decoded triangles and integers; view_NAME is the
same for a buffer view of several blobs. gltf_NAME.glb is a file and gltf_NAME.json the components
of its accessors. Decoders must refuse malformed_NAME.bin; malformed.json has the reasons. Most
blobs come from the encoder. The hand-made ones come from blob_writer, because no encoder would
write them.
"""

from __future__ import annotations

import json
import random
import struct
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from gltf_ext import _codec
from spec import blob_writer, reference_decoder, reference_gltf
from spec.blob_writer import (
    AFFINE,
    COPY,
    DAMPED,
    FLOAT32,
    FOREIGN,
    GEO,
    GRID,
    INTEGER,
    MEAN,
    OCT,
    OWNED,
    PARALLELOGRAM,
    PRIVATE,
    SIGN,
)
from tools import paper_encoder

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "spec" / "vectors"
SPECIFICATION = ROOT / "spec" / "EXT_meshlet_edgebreaker.md"
EXAMPLE_BEGIN = "<!-- worked example: begin -->\n"
EXAMPLE_END = "<!-- worked example: end -->\n"


# --- encoded meshes ---


def committed(name: str) -> bytes:
    """A valid vector, as it is in the folder."""
    return (FOLDER / f"valid_{name}.bin").read_bytes()


def position_stream(bits: int = 12, predictor: int = -1) -> _codec.Stream:
    return _codec.Stream(GRID, 3, bits, 0.25, (-1.0, 0.0, 2.0), predictor)


def stream(kind: int, elements: int, bits: int, predictor: int = -1) -> _codec.Stream:
    return _codec.Stream(kind, elements, bits, 1.0, predictor=predictor)


def encode(
    triangles,
    positions,
    streams=None,
    values=(),
    max_triangles: int = 64,
    page_bytes: int = 0,
    encoder: Callable[..., tuple[bytes, dict]] = paper_encoder.encode,
) -> bytes:
    """Encodes integer positions [V, 3] and the values of further streams.

    encoder: the vectors are frozen, as the format is, and older than the efforts of today.

    Vertices may have equal positions. page_bytes: of each blob but the last; 0 for one blob.
    """
    positions = np.asarray(positions, np.uint32)
    _, position_ids = np.unique(positions, axis=0, return_inverse=True)
    blob, _ = encoder(
        np.asarray(triangles, np.uint32),
        position_ids.reshape(-1).astype(np.uint32),
        positions.astype(np.float32),
        streams or [position_stream()],
        [positions, *(np.ascontiguousarray(v, np.uint32) for v in values)],
        max_triangles=max_triangles,
        page_bytes=page_bytes,
    )
    return blob


def grid_triangles(columns: int, rows: int) -> list[list[int]]:
    """Two triangles per cell of a grid of (columns + 1) x (rows + 1) vertices."""
    triangles = []
    for y in range(rows):
        for x in range(columns):
            a = y * (columns + 1) + x
            c = a + columns + 1
            triangles += [[a, a + 1, c + 1], [a, c + 1, c]]
    return triangles


def grid_positions(columns: int, rows: int, scale: int = 40) -> np.ndarray:
    """A gently curved sheet."""
    y, x = np.divmod(np.arange((columns + 1) * (rows + 1)), columns + 1)
    return np.stack([x * scale, y * scale, (x * x + 3 * y * y + x * y) % 4096], axis=1)


def one_triangle() -> bytes:
    return encode([[0, 1, 2]], [[5, 6, 7], [105, 6, 7], [5, 106, 9]])


def quad() -> bytes:
    return encode([[0, 1, 2], [0, 2, 3]], [[0, 0, 0], [100, 0, 0], [100, 100, 10], [0, 100, 10]])


def tetrahedron() -> bytes:
    return encode(
        [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        [[0, 0, 0], [200, 0, 0], [0, 200, 0], [0, 0, 200]],
    )


def worked_example() -> bytes:
    positions = grid_positions(4, 2, 20)
    texcoords = positions[:, :2] + [7, 3]
    streams = [position_stream(8), stream(GRID, 2, 8, AFFINE)]
    return encode(grid_triangles(4, 2), positions, streams, [texcoords], max_triangles=8)


def encoded_pages() -> bytes:
    """A sheet with texture coordinates in blobs of 512 bytes."""
    positions = grid_positions(16, 12)
    streams = [position_stream(), stream(GRID, 2, 12, AFFINE)]
    return encode(
        grid_triangles(16, 12), positions, streams, [positions[:, :2]], 24, page_bytes=512
    )


def tube(columns: int, rows: int):
    """A tube whose first and last column share positions, but not texture coordinates."""
    angle = 2 * np.pi * (np.arange((columns + 1) * (rows + 1)) % (columns + 1) % columns) / columns
    y, x = np.divmod(np.arange((columns + 1) * (rows + 1)), columns + 1)
    positions = np.stack(
        [np.rint(1000 + 900 * np.cos(angle)), np.rint(1000 + 900 * np.sin(angle)), y * 300], axis=1
    )
    return grid_triangles(columns, rows), positions, np.stack([x * 100, y * 100], axis=1)


def seam_within_a_meshlet() -> bytes:
    triangles, positions, texcoords = tube(7, 4)
    return encode(triangles, positions, [position_stream(), stream(GRID, 2, 12)], [texcoords])


def seams_between_meshlets() -> bytes:
    triangles, positions, texcoords = tube(12, 9)
    patch = np.arange(len(positions)) % 13 * 3 // 13
    streams = [position_stream(), stream(GRID, 2, 12), stream(INTEGER, 1, 2)]
    return encode(triangles, positions, streams, [texcoords, patch[:, None]], max_triangles=24)


def several_disks() -> bytes:
    triangles: list[list[int]] = []
    positions: list[list[int]] = []
    for part in range(5):
        first = len(positions)
        triangles += [[first + v for v in t] for t in grid_triangles(part + 1, 1)]
        offset = np.array([0, 300 * part, 0])
        positions += (grid_positions(part + 1, 1) + offset).tolist()
    return encode(triangles, positions)


def every_predictor() -> bytes:
    positions = grid_positions(9, 7)
    streams = [
        position_stream(12, PARALLELOGRAM),
        stream(GRID, 2, 12, MEAN),
        stream(GRID, 1, 12, COPY),
        stream(GRID, 1, 12, DAMPED),
        stream(INTEGER, 1, 32, COPY),
    ]
    wide = positions[:, :1].astype(np.int64) * 40000001 % (1 << 32)
    return encode(
        grid_triangles(9, 7),
        positions,
        streams,
        [positions[:, :2], positions[:, 2:], positions[:, 2:], wide],
        max_triangles=40,
    )


def every_kind() -> bytes:
    positions = grid_positions(6, 6)
    i = np.arange(len(positions))
    normals = np.stack([120 + i % 7, 130 - i // 7], axis=1)
    joints = np.stack([i % 4, i // 13, 0 * i, 3 + 0 * i], axis=1)
    bits = np.linspace(-2.5, 1e6, len(i), dtype=np.float32).view(np.uint32)
    floats = np.where(bits >> 31, ~bits, bits ^ np.uint32(0x80000000))
    streams = [
        position_stream(),
        stream(OCT, 2, 8),
        stream(SIGN, 1, 1),
        stream(INTEGER, 4, 8),
        stream(FLOAT32, 1, 32, COPY),
    ]
    values = [normals, (i % 5 == 0)[:, None], joints, floats[:, None]]
    return encode(grid_triangles(6, 6), positions, streams, values, max_triangles=40)


def octahedral_integers(normals: np.ndarray, bits: int) -> np.ndarray:
    """The encoder's rule of appendix B."""
    n = normals / np.abs(normals).sum(axis=1, keepdims=True)
    x, y = n[:, 0], n[:, 1]
    below = n[:, 2] < 0
    fold_x = (1 - np.abs(y)) * np.where(x < 0, -1, 1)
    fold_y = (1 - np.abs(x)) * np.where(y < 0, -1, 1)
    grid = np.stack([np.where(below, fold_x, x), np.where(below, fold_y, y)], axis=1)
    return np.rint((grid + 1) / 2 * ((1 << bits) - 2))


def normals_and_texcoords() -> bytes:
    """Half a sphere."""
    columns, rows = 12, 9
    y, x = np.divmod(np.arange((columns + 1) * (rows + 1)), columns + 1)
    longitude, latitude = np.pi * x / columns, np.pi * (y + 0.5) / (rows + 1)
    normals = np.stack(
        [
            np.sin(latitude) * np.cos(longitude),
            np.cos(latitude),
            np.sin(latitude) * np.sin(longitude),
        ],
        axis=1,
    )
    streams = [
        position_stream(),
        stream(OCT, 2, 10, GEO),
        stream(OCT, 2, 8, GEO),
        stream(GRID, 2, 12, AFFINE),
    ]
    values = [
        octahedral_integers(normals, 10),
        octahedral_integers(normals, 8),
        np.stack([x * 300, y * 400], axis=1),
    ]
    positions = np.rint(2000 + 1900 * normals)
    return encode(grid_triangles(columns, rows), positions, streams, values, max_triangles=40)


def rice_and_fixed_codes() -> bytes:
    """Smooth positions (Rice codes), a constant stream and a noisy one (fixed widths)."""
    positions = grid_positions(11, 8)
    rng = random.Random(1)
    noise = np.array([[rng.getrandbits(20)] for _ in positions])
    constant = np.full((len(positions), 2), 77)
    streams = [position_stream(), stream(INTEGER, 1, 20), stream(INTEGER, 2, 8)]
    return encode(grid_triangles(11, 8), positions, streams, [noise, constant], max_triangles=48)


def several_groups() -> bytes:
    return encode(grid_triangles(24, 12), grid_positions(24, 12), max_triangles=8)


def awkward_topology() -> bytes:
    """Non-manifold: three triangles on an edge, a vertex between two fans, and bad triangles.

    One triangle occurs twice and once with reversed winding, one is collapsed.
    """
    positions = [
        [0, 0, 0],
        [50, 0, 0],
        [0, 50, 0],
        [0, 0, 50],
        [50, 50, 50],
        [90, 90, 90],
        [90, 0, 90],
        [0, 90, 90],
        [7, 7, 7],
        [7, 7, 7],
        [7, 7, 7],
    ]
    triangles = [
        [0, 1, 2],
        [1, 0, 3],
        [0, 1, 4],
        [4, 5, 6],
        [4, 7, 5],
        [0, 1, 2],
        [2, 1, 0],
        [8, 9, 10],
    ]
    return encode(triangles, positions)


# --- hand-made blobs ---


def fixed_meshlet(symbols, loops, streams, anchors, inner, interior) -> blob_writer.Meshlet:
    """A meshlet with all residuals in fixed width 6.

    anchors, inner (vertices in owned references) and interior are counts per stream.
    """
    numbers = iter(range(1, 10000))

    def values(n, stream, limit):
        return [[next(numbers) % limit for _ in range(stream.elements)] for _ in range(n)]

    return blob_writer.Meshlet(
        symbols,
        loops,
        [values(n, s, min(64, 1 << s.bits)) for n, s in zip(anchors, streams)],
        [[6] * s.elements for s in streams],
        [values(n, s, 64) for n, s in zip(inner, streams)],
        [[6] * s.elements for s in streams],
        [values(n, s, 64) for n, s in zip(interior, streams)],
    )


def reference(kind, length, delta=0, slot=0, share=()) -> blob_writer.Reference:
    return blob_writer.Reference(kind, length, delta, slot, share)


def hop_chain(hops: int) -> bytes:
    """Triangles around a vertex; each takes its first edge from the one before.

    So the anchor of the last triangle's corner 1 is `hops` hops away.
    """
    streams = [blob_writer.Stream(bits=12)]
    meshlets = [
        fixed_meshlet(
            "E",
            [[reference(OWNED, 1), reference(OWNED, 1), reference(OWNED, 1)]],
            streams,
            [3],
            [0],
            [0],
        )
    ]
    for _ in range(hops):
        loop = [reference(FOREIGN, 1, 1, 0), reference(OWNED, 1), reference(OWNED, 1)]
        meshlets.append(fixed_meshlet("E", [loop], streams, [1], [0], [0]))
    return blob_writer.write_blob(streams, meshlets, 3 + hops)


def eight_hops() -> bytes:
    return hop_chain(8)


def filled_hole() -> bytes:
    """A loop of one owned reference, and a meshlet whose loop is that reference backwards.

    Stream 1 is not shared.
    """
    streams = [
        blob_writer.Stream(bits=12),
        blob_writer.Stream(bits=10, elements=2, predictor=MEAN),
    ]
    meshlets = [
        fixed_meshlet("CRRE", [[reference(OWNED, 4)]], streams, [1, 1], [3, 3], [1, 1]),
        fixed_meshlet(
            "RE", [[reference(FOREIGN, 4, 1, 0, (False,))]], streams, [0, 1], [0, 0], [0, 3]
        ),
    ]
    return blob_writer.write_blob(streams, meshlets, 9)


def extreme_codes(quotient: int = 16383, base: int = 28) -> bytes:
    """Rice parameter 31, width 32, the largest quotient, a width above the bits, wrap-around."""
    streams = [
        blob_writer.Stream(bits=24, elements=1, interior_base=base),
        blob_writer.Stream(bits=32, elements=1, kind=INTEGER, predictor=COPY),
        blob_writer.Stream(bits=3, elements=1, kind=INTEGER, predictor=PARALLELOGRAM),
    ]
    meshlet = blob_writer.Meshlet(
        "SEE",
        [],
        [[[0xFFFFFF]], [[0xFFFFFFFF]], [[7]]],
        [],
        [[], [], []],
        [3, [32], 0],
        [
            [[0xFFFFFFFF], [0x80000001], [3], [0]],
            [[0xFFFFFFFE], [1], [2], [0]],
            [[quotient], [3], [6], [1]],
        ],
    )
    return blob_writer.write_blob(streams, [meshlet], 5)


def exp_golomb_codes() -> bytes:
    """Codes 4 to 6 with the bases 0, 1, 12 and 29: the largest parameter and the largest values."""
    streams = [
        blob_writer.Stream(bits=24, elements=1),
        *(blob_writer.Stream(INTEGER, 1, 32, COPY, interior_base=base) for base in (0, 1, 12, 29)),
    ]
    most = [0, 0xFFFFFFFE, 0xFFFFFFFE, 0xFFFFFFFF, 0xFFFFFFFF]
    meshlets = []
    for code in (4, 5, 6):
        residuals = [[[0], [1], [[5, 200, 70000][code - 4]], [m]] for m in most]
        meshlets.append(
            blob_writer.Meshlet(
                "CRRE",
                [],
                [[[3 * code + s]] for s in range(5)],
                [],
                [[]] * 5,
                [code] * 5,
                residuals,
            )
        )
    return blob_writer.write_blob(streams, meshlets, 15)


def chain_codes(quotient: int = 16383) -> bytes:
    """Chains in Rice codes 0 to 6 and in fixed widths, in several streams of a meshlet.

    Rice parameters 0, 6 and 31; a quotient of 16383; widths of 0 and of 32 bits.
    """
    streams = [
        blob_writer.Stream(bits=12, chain_base=0),
        blob_writer.Stream(INTEGER, 1, 32, COPY, chain_base=25),
        blob_writer.Stream(INTEGER, 2, 10, chain_base=4),
        blob_writer.Stream(INTEGER, 2, 32, COPY, chain_base=31),
    ]
    loop = [reference(OWNED, 3), reference(OWNED, 2)]
    meshlets = []
    for code in range(7):
        meshlet = fixed_meshlet("CRRRE", [loop], streams, [2] * 4, [3] * 4, [1] * 4)
        meshlet.chain_codes = [code, code, [0, code], [0, 32] if code else 0]
        meshlet.chain[0][0] = [7 * code, 0, 1]
        meshlet.chain[1] = [[0xFFFFFFFF], [0], [code]]
        meshlet.chain[2] = [[0, code], [0, 0], [0, (1 << code) - 1]]
        meshlet.chain[3] = [[0, 0xFFFFFFFF], [0, 0x80000000], [0, code]]
        meshlets.append(meshlet)
    meshlets[0].chain[0][1] = [quotient, 1, 2]
    return blob_writer.write_blob(streams, meshlets, 42)


ANCHOR_BITS = 12, 32, 24, 5, 31, 32


def anchors_of_every_width() -> bytes:
    """Nine anchors in meshlets with each width field; bases of 0 to 31, values that wrap."""
    bases = 0, 26, 3, 31, 31, 0
    streams = [
        blob_writer.Stream(GRID, 3, bits, anchor_base=base)
        if bits <= 24
        else blob_writer.Stream(INTEGER, 2, bits, COPY, anchor_base=base)
        for bits, base in zip(ANCHOR_BITS, bases)
    ]
    rng = random.Random(2)
    loop = [reference(OWNED, 1) for _ in range(9)]
    meshlets = []
    for first in range(8):
        meshlet = fixed_meshlet("RRRRRRE", [loop], streams, [1] * 6, [0] * 6, [0] * 6)
        for s, stream in enumerate(streams):
            fields = [(first + c) % 8 for c in range(stream.elements)]
            widths = [blob_writer.anchor_width(stream, field) for field in fields]
            most = [(1 << width) - 1 for width in widths]  # the residual that is farthest down
            further = [most, *([rng.randint(0, m) for m in most] for _ in range(7))]
            meshlet.anchor_widths.append(fields)
            meshlet.anchors[s] = [[rng.getrandbits(stream.bits) for _ in fields], *further]
        meshlets.append(meshlet)
    return blob_writer.write_blob(streams, meshlets, 72)


def anchors_without_widths() -> bytes:
    """Meshlets with one stored corner, or none, have no widths."""
    streams = [
        blob_writer.Stream(bits=12, anchor_base=5),
        blob_writer.Stream(INTEGER, 2, 9, anchor_base=7),
    ]
    triangle = [reference(OWNED, 1) for _ in range(3)]
    middle = [reference(FOREIGN, 1, 1, 1), reference(OWNED, 1), reference(OWNED, 1)]
    meshlets = [
        fixed_meshlet("E", [triangle], streams, [3, 3], [0, 0], [0, 0]),
        fixed_meshlet("E", [middle], streams, [1, 1], [0, 0], [0, 0]),
        fixed_meshlet(
            "E",
            [[reference(FOREIGN, 1, 1, 1, (False,)), *middle[1:]]],
            streams,
            [1, 3],
            [0, 0],
            [0, 0],
        ),
        fixed_meshlet("EE", [], streams, [2, 2], [0, 0], [4, 4]),
    ]
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def random_mesh(
    rng: random.Random, streams: list[blob_writer.Stream], meshlets: int
) -> list[blob_writer.Meshlet]:
    """Random meshlets with small residuals, so that neighbours lie close together."""
    result = []
    for _ in range(meshlets):
        symbols = "".join(blob_writer.random_disks(rng)[:1])
        edges = blob_writer.net_growth(symbols) + 1
        vertices = symbols.count("R") + 2 * symbols.count("E") + symbols.count("L") + 1
        run = rng.randint(1, edges - 1)
        loop = [reference(OWNED, run), reference(PRIVATE, edges - run)]

        def residuals(n, s, limit):
            return [[rng.randrange(limit) for _ in range(s.elements)] for _ in range(n)]

        result.append(
            blob_writer.Meshlet(
                symbols,
                [loop],
                [residuals(2, s, 1 << min(8, s.bits)) for s in streams],
                [rng.randint(0, 6) for _ in streams],
                [residuals(run - 1, s, 1 << s.bits // 2) for s in streams],
                [rng.randint(0, 6) for _ in streams],
                [residuals(vertices - run - 1, s, 1 << s.bits // 2) for s in streams],
            )
        )
    return result


def predicted_from_positions(position_bits: int, *kinds: tuple[int, int, int, int]) -> bytes:
    """Streams (kind, elements, bits, predictor) with GEO or AFFINE."""
    streams = [
        blob_writer.Stream(
            bits=position_bits, chain_base=3, interior_base=position_bits // 3, anchor_base=6
        ),
        *(
            blob_writer.Stream(kind, elements, bits, predictor, 2, 2, 4)
            for kind, elements, bits, predictor in kinds
        ),
    ]
    rng = random.Random(position_bits)
    blob = blob_writer.write_blob(streams, random_mesh(rng, streams, 10), 3)
    return with_vertex_count(blob, count_vertices(blob))


def geo() -> bytes:
    return predicted_from_positions(12, (OCT, 2, 8, GEO), (OCT, 2, 13, GEO))


def geo_of_wide_positions() -> bytes:
    return predicted_from_positions(24, (OCT, 2, 16, GEO), (OCT, 2, 2, GEO))


def geo_of_narrow_positions() -> bytes:
    return predicted_from_positions(3, (OCT, 2, 12, GEO))


def geo_without_references() -> bytes:
    """Loops of private references alone: GEO predicts root gates and boundaries."""
    streams = [
        blob_writer.Stream(bits=12, interior_base=3, anchor_base=6),
        blob_writer.Stream(OCT, 2, 10, GEO),
    ]
    rng = random.Random(4)
    meshlets = []
    for symbols, disks in (("E", 1), ("RE", 1), ("CRRRE", 1), ("ELERE", 3), ("SRECRRE", 1)):
        anchors = [[[rng.getrandbits(9)] * s.elements for _ in range(disks)] for s in streams]
        vertices = disks + symbols.count("R") + 2 * symbols.count("E") + symbols.count("L")
        interior = [
            [[rng.getrandbits(8 - 6 * s) for _ in range(stream.elements)] for _ in range(vertices)]
            for s, stream in enumerate(streams)
        ]
        meshlets.append(
            blob_writer.Meshlet(
                symbols, [], anchors, [], [], [2, 1], [of[disks:] for of in interior]
            )
        )
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def affine() -> bytes:
    return predicted_from_positions(12, (GRID, 2, 12, AFFINE), (INTEGER, 4, 8, AFFINE))


def affine_of_wide_positions() -> bytes:
    return predicted_from_positions(24, (GRID, 2, 24, AFFINE), (INTEGER, 1, 24, AFFINE))


def affine_of_narrow_positions() -> bytes:
    return predicted_from_positions(3, (GRID, 2, 12, AFFINE), (INTEGER, 1, 1, AFFINE))


def affine_seams() -> bytes:
    """A run in two meshlets: stream 1 shares it, stream 2 does not; both are AFFINE."""
    streams = [
        blob_writer.Stream(bits=12),
        blob_writer.Stream(GRID, 2, 12, AFFINE),
        blob_writer.Stream(INTEGER, 1, 10, AFFINE),
    ]
    private = reference(PRIVATE, 3)
    shared = reference(FOREIGN, 5, 1, 0, (True, False))
    meshlets = [
        fixed_meshlet(
            "CRRRRRE", [[reference(OWNED, 4), private]], streams, [2] * 3, [3] * 3, [3] * 3
        ),
        fixed_meshlet(
            "RRRRRE", [[reference(OWNED, 5), private]], streams, [2] * 3, [4] * 3, [2] * 3
        ),
        fixed_meshlet("RRRRRE", [[shared, private]], streams, [0, 0, 2], [0] * 3, [2, 2, 6]),
    ]
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def interior_of_several_streams() -> bytes:
    """Rice, exp-Golomb and fixed codes in one meshlet, whose interiors have different lengths."""
    streams = [
        blob_writer.Stream(bits=12, interior_base=3),
        blob_writer.Stream(GRID, 2, 12, MEAN, interior_base=2),
        blob_writer.Stream(INTEGER, 1, 9, interior_base=1),
        blob_writer.Stream(SIGN, 1, 1, COPY),
        blob_writer.Stream(INTEGER, 4, 8, DAMPED, interior_base=5),
    ]
    seam = reference(FOREIGN, 4, 1, 0, (False, True, True, False))
    chains, traversed = [3] * 5, [3] * 5
    meshlets = [
        fixed_meshlet(
            "CRRRRRE",
            [[reference(OWNED, 4), reference(PRIVATE, 3)]],
            streams,
            [2] * 5,
            chains,
            traversed,
        ),
        fixed_meshlet(
            "CRRRRRE",
            [[seam, reference(PRIVATE, 3)]],
            streams,
            [0, 2, 0, 0, 2],
            [0] * 5,
            [3, 6, 3, 3, 6],
        ),
    ]
    meshlets[0].interior_codes = [1, 5, [6], 0, [7, 6, 32, 6]]
    meshlets[1].interior_codes = [6, [6, 8], 3, [6], 4]
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def flat_positions() -> bytes:
    """All positions are equal: no normal, no affine frame."""
    streams = [
        blob_writer.Stream(bits=10),
        blob_writer.Stream(OCT, 2, 10, GEO),
        blob_writer.Stream(GRID, 2, 10, AFFINE),
    ]
    loop = [reference(OWNED, 3), reference(PRIVATE, 4)]
    meshlet = fixed_meshlet("CRRRRRE", [loop], streams, [2] * 3, [2] * 3, [4] * 3)
    meshlet.anchors[0] = [[500, 300, 100], [0, 0, 0]]
    meshlet.chain[0] = [[0, 0, 0]] * 2
    meshlet.interior[0] = [[0, 0, 0]] * 4
    return blob_writer.write_blob(streams, [meshlet], 8)


def oct_axes() -> bytes:
    """The six axes and the corners of the octahedral grid, at 2, 8 and 16 bits."""
    streams = [blob_writer.Stream(OCT, 2, bits, COPY) for bits in (2, 8, 16)]

    def grid(stream):
        m = (1 << stream.bits) - 2
        return [[x, y] for y in (0, m // 2, m) for x in (0, m // 2, m)]

    return nine_anchors(streams, [grid(stream) for stream in streams])


def nine_anchors(streams: list[blob_writer.Stream], values: list[list[list[int]]]) -> bytes:
    """One meshlet of nine vertices with these values in streams 1 and on."""
    streams = [blob_writer.Stream(bits=8), *streams]
    count = len(streams)
    loop = [reference(OWNED, 1) for _ in range(9)]
    meshlet = fixed_meshlet("RRRRRRE", [loop], streams, [9] * count, [0] * count, [0] * count)
    for s, of_stream in enumerate(values, start=1):
        further = blob_writer.further_anchors(streams[s], of_stream)
        meshlet.anchors[s] = of_stream[:1] + further
    return blob_writer.write_blob(streams, [meshlet], 9)


def grid_arithmetic() -> bytes:
    """GRID streams whose values differ if offset + q * step is computed in binary32."""
    rng = random.Random(5)
    steps = 0.1, 1e-5, -0.3
    streams = [
        blob_writer.Stream(bits=24, step=step, offset=(1000.1, -0.1, 7e-8, 0.0), predictor=COPY)
        for step in steps
    ]
    top = (1 << 24) - 1
    values = [
        [[0, 1, top], [top, top - 1, 2], *([rng.getrandbits(24) for _ in "xyz"] for _ in range(7))]
        for _ in streams
    ]
    return nine_anchors(streams, values)


def grid_zero_steps() -> bytes:
    """Steps of 0 and -0 beside offsets of 0, -0 and others: only -0 + -0 is -0."""
    offset = 0.0, -0.0, 5.5, -1e-45
    streams = [
        blob_writer.Stream(elements=4, bits=12, step=step, offset=offset, predictor=COPY)
        for step in (0.0, -0.0, 2.0)
    ]
    values = [[[q, q, q, q] for q in (0, 1, 4095, 0, 2, 3, 4, 5, 0)] for _ in streams]
    return nine_anchors(streams, values)


def small_meshlets(count: int, streams: list[blob_writer.Stream]) -> list[blob_writer.Meshlet]:
    """Meshlets without references, of 1 to 5 triangles."""
    symbols = ("E", "RE", "CRE", "SEE", "LRSEE")
    meshlets = []
    for m in range(count):
        text = symbols[m * m % 5]
        vertices = text.count("R") + 2 * text.count("E") + text.count("L") + 1
        meshlets.append(fixed_meshlet(text, [], streams, [1], [0], [vertices - 1]))
    return meshlets


def group_tables() -> bytes:
    """Five groups: both symbol tables, all strides, biases, entry widths and flags."""
    streams = [blob_writer.Stream(bits=10)]
    meshlets = small_meshlets(4 * 32 + 7, streams)
    meshlets[32:64] = [meshlets[0]] * 32  # all of one size: entries of no bits
    layouts = [
        blob_writer.Layout(0, 0, 0),
        blob_writer.Layout(0, 0, 0, second_table=True),
        blob_writer.Layout(24, 6, 6, True, True, True, stride=0),
        blob_writer.Layout(3, 2, 1, None, True, None, True, stride=1500),
        blob_writer.Layout(3, 2, 1, None, True, None, extra_entry_width=20),
    ]
    blob = blob_writer.write_blob(streams, meshlets, 3, lambda g: layouts[g])
    return with_vertex_count(blob, count_vertices(blob))


def two_vertex_loop() -> bytes:
    """Two triangles glued along two of their edges."""
    streams = [blob_writer.Stream(bits=12)]
    meshlet = fixed_meshlet(
        "CE", [[reference(OWNED, 1), reference(PRIVATE, 1)]], streams, [2], [0], [1]
    )
    return blob_writer.write_blob(streams, [meshlet], 3)


def collapsed_by_aliases() -> bytes:
    """A meshlet that meets itself: each triangle has two local vertices that are one."""
    streams = [blob_writer.Stream(bits=8)]
    loop = [
        reference(PRIVATE, 1),
        reference(OWNED, 1),
        reference(PRIVATE, 1),
        reference(FOREIGN, 1),
        reference(PRIVATE, 1),
    ]
    return blob_writer.write_blob(
        streams, [fixed_meshlet("RRE", [loop], streams, [3], [0], [0])], 3
    )


def redundant_masks() -> bytes:
    """A private mask of zeros, and share bits that are all one."""
    streams = [blob_writer.Stream(bits=12), blob_writer.Stream(bits=10, elements=2)]
    loop = [reference(OWNED, 1), reference(OWNED, 1), reference(OWNED, 1)]
    meshlets = [
        fixed_meshlet("E", [loop], streams, [3, 3], [0, 0], [0, 0]),
        fixed_meshlet(
            "E", [[reference(FOREIGN, 1, 1, 0), *loop[1:]]], streams, [1, 1], [0, 0], [0, 0]
        ),
    ]
    with mock.patch.multiple(
        blob_writer, has_private=lambda meshlet: True, has_seams=lambda meshlet: True
    ):
        return blob_writer.write_blob(streams, meshlets, 4)


def limits() -> bytes:
    """Meshlets of 64 vertices: one loop, a reference of length 64, and 63 references."""
    streams = [blob_writer.Stream(bits=12)]
    symbols = "R" * 61 + "E"
    many = [reference(OWNED, 2), *[reference(OWNED, 1)] * 62]
    meshlets = [
        fixed_meshlet(symbols, [], streams, [1], [0], [63]),
        fixed_meshlet(symbols, [[reference(OWNED, 64)]], streams, [1], [63], [0]),
        fixed_meshlet(symbols, [many], streams, [63], [1], [0]),
    ]
    return blob_writer.write_blob(streams, meshlets, 192)


def many_streams() -> bytes:
    """64 streams, and a reference with 63 share bits."""
    streams = [blob_writer.Stream(bits=12), *[blob_writer.Stream(INTEGER, 1, 8)] * 63]
    own = [reference(OWNED, 1)] * 3
    none = [0] * 64
    meshlets = [
        fixed_meshlet("E", [own], streams, [3] * 64, none, none),
        fixed_meshlet(
            "E", [[reference(FOREIGN, 1, 1, 0), *own[1:]]], streams, [1] * 64, none, none
        ),
    ]
    with mock.patch.multiple(blob_writer, has_seams=lambda meshlet: True):
        return blob_writer.write_blob(streams, meshlets, 4)


def unused_bytes() -> bytes:
    """Unused bytes before the entries of both groups, and after each meshlet's data."""
    streams = [blob_writer.Stream(bits=10, elements=2, offset=(0.0, 0.0, 0.0, -7.5))]
    layout = blob_writer.Layout(before=b"\xff\x5a\xa5", after=b"\xc3\xff")
    blob = blob_writer.write_blob(streams, small_meshlets(35, streams), 3, layout)
    return with_vertex_count(blob, count_vertices(blob))


def gap_before_meshlets() -> bytes:
    """Unused bytes between the entries of each group and its first meshlet."""
    streams = [blob_writer.Stream(bits=10)]
    layouts = [blob_writer.Layout(gap=b"\xff\x5a\xa5"), blob_writer.Layout(gap=bytes(300))]
    blob = blob_writer.write_blob(streams, small_meshlets(35, streams), 3, lambda g: layouts[g])
    return with_vertex_count(blob, count_vertices(blob))


def corner_of_two_runs() -> bytes:
    """A corner between two runs of one owner that do not meet there: the rule "j on a tie".

    The owner's corners 0 and 3 have equal values. Corner 1 of the second meshlet is an alias of
    corner 3, the end of the owner's reference 2; along reference 0 it would be corner 0. Stream 1
    is GEO: the second meshlet's normals come from its own triangles alone.
    """
    streams = [blob_writer.Stream(bits=12), blob_writer.Stream(OCT, 2, 8, GEO)]
    quad = fixed_meshlet("RE", [[reference(OWNED, 1)] * 4], streams, [4] * 2, [0] * 2, [0] * 2)
    corners = [[500, 500, 500], [900, 500, 520], [900, 900, 480], [500, 500, 500]]
    normals = [[100, 110], [130, 120], [90, 140], [100, 110]]
    for s, values in enumerate((corners, normals)):
        quad.anchors[s] = values[:1] + blob_writer.further_anchors(streams[s], values)
    loop = [
        reference(FOREIGN, 1, 1, 0),
        reference(FOREIGN, 1, 1, 2),
        reference(PRIVATE, 4),
    ]
    fan = fixed_meshlet("CRRRRE", [loop], streams, [0] * 2, [0] * 2, [4] * 2)
    blob = blob_writer.write_blob(streams, [quad, fan], 3)
    return with_vertex_count(blob, count_vertices(blob))


def random_structures() -> bytes:
    """Random meshlets, references, codes and residuals (see blob_writer.random_blob)."""
    for seed in range(1000):
        blob = blob_writer.random_blob(random.Random(seed), 8)
        try:
            return with_vertex_count(blob, count_vertices(blob))
        except ValueError:
            continue
    raise AssertionError("no seed gives a blob without more than eight hops")


def with_vertex_count(blob: bytes, count: int) -> bytes:
    return put_bytes(blob, 12, "I", count)


def count_vertices(blob: bytes) -> int:
    """The correct vertex count of a blob. Raises ValueError if a corner takes too many hops."""
    decoder = reference_decoder.Decoder(blob)
    runs: list = []
    count = 0
    for m in range(decoder.file.meshlet_count):
        meshlet = decoder.file.meshlet(m)
        runs.append(decoder.boundary(meshlet))
        count += meshlet.connectivity.vertex_count - len(decoder.alias(meshlet, runs))
        decoder.meshlet(m)
    return count


def pages() -> bytes:
    """Three blobs: predictors, bases, sizes and meshlet counts differ, the streams do not."""
    blobs: list[bytes] = []
    kinds = (("RE", PARALLELOGRAM), ("E", DAMPED), ("CRRE", MEAN))
    for meshlet_count, (symbols, predictor) in enumerate(kinds, start=1):
        streams = [
            blob_writer.Stream(bits=12, predictor=predictor, step=0.5, offset=(1.0, 2.0, 3.0, 0.0)),
            blob_writer.Stream(OCT, 2, 8, GEO if predictor == MEAN else COPY, 1, 2, 3),
        ]
        vertices = symbols.count("R") + 2 * symbols.count("E") + 1
        meshlet = fixed_meshlet(symbols, [], streams, [1, 1], [0, 0], [vertices - 1] * 2)
        blobs.append(blob_writer.write_blob(streams, [meshlet] * meshlet_count, 3))
    return b"".join(with_vertex_count(blob, count_vertices(blob)) for blob in blobs)


def hops_of_different_lengths() -> bytes:
    """A corner between runs of two owners. The smaller one is two hops from the anchor, the other
    one, whose vertex has equal values, is one hop from its own."""
    streams = [blob_writer.Stream(bits=12)]
    own = [reference(OWNED, 1)] * 3
    first = fixed_meshlet("E", [own], streams, [3], [0], [0])
    second = fixed_meshlet("E", [[reference(FOREIGN, 1, 1, 0), *own[1:]]], streams, [1], [0], [0])
    third = fixed_meshlet("E", [own], streams, [3], [0], [0])
    corners = [[800, 800, 810], first.anchors[0][0], [900, 700, 820]]
    third.anchors[0] = corners[:1] + blob_writer.further_anchors(streams[0], corners)
    loop = [reference(FOREIGN, 1, 2, 0), reference(FOREIGN, 1, 1, 0), reference(PRIVATE, 1)]
    last = fixed_meshlet("E", [loop], streams, [0], [0], [0])
    blob = blob_writer.write_blob(streams, [first, second, third, last], 3)
    return with_vertex_count(blob, count_vertices(blob))


def fan_around(ring: list[list[int]], middle: list[int]) -> blob_writer.Meshlet:
    """63 triangles around a vertex, in two streams: positions of 13 bits, normals with GEO."""
    streams = geo_limit_streams()
    loop = [reference(OWNED, 1)] * len(ring)
    none = [0, 0]
    meshlet = fixed_meshlet("C" + "R" * 61 + "E", [loop], streams, [63, 63], none, [1, 1])
    meshlet.anchors[0] = ring[:1] + blob_writer.further_anchors(streams[0], ring)
    # COPY predicts the middle by the loop's last vertex.
    (residual,) = blob_writer.further_anchors(streams[0], [ring[-1], middle])
    meshlet.interior_codes = [[13] * 3, [6] * 2]
    meshlet.interior[0] = [residual]
    return meshlet


def geo_limit_streams() -> list[blob_writer.Stream]:
    return [blob_writer.Stream(bits=13, predictor=COPY), blob_writer.Stream(OCT, 2, 16, GEO)]


def geo_sums_near_2_31() -> bytes:
    """Fans that wind round a square of the largest size, in both senses, in all three planes."""
    most = (1 << 13) - 1
    square = [(0, 0), (most, 0), (most, most), (0, most)]
    meshlets = []
    for axis in range(3):
        for order in (1, -1):
            ring = [list(square[order * i % 4]) for i in range(63)]
            middle = [most // 2, most // 2]
            for point in (*ring, middle):
                point.insert(axis, 5)
            meshlets.append(fan_around(ring, middle))
    blob = blob_writer.write_blob(geo_limit_streams(), meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def affine_ties() -> bytes:
    """Frames on a lattice of few steps: products and quotients that end half-way, of both signs."""
    streams = [
        blob_writer.Stream(bits=3, predictor=COPY),
        blob_writer.Stream(GRID, 2, 12, AFFINE),
        blob_writer.Stream(INTEGER, 2, 3, AFFINE),
    ]
    rng = random.Random(AFFINE_SEED)
    meshlets = []
    for _ in range(16):
        chain = rng.randint(3, 6)
        loop = [reference(OWNED, chain), reference(PRIVATE, 12 - chain)]
        counts = [chain - 1] * 3, [12 - chain] * 3
        meshlet = fixed_meshlet("CRRRRRRRRRRE", [loop], streams, [2] * 3, *counts)
        meshlet.anchors[0] = [[3, 3, 3], [rng.randrange(5) for _ in range(3)]]
        for part, code in ((meshlet.chain, "chain_codes"), (meshlet.interior, "interior_codes")):
            part[0] = [[rng.randrange(3) for _ in range(3)] for _ in part[0]]
            for s in (1, 2):
                part[s] = [[rng.randrange(64) for _ in range(2)] for _ in part[s]]
            setattr(meshlet, code, [[6] * s.elements for s in streams])
        meshlets.append(meshlet)
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def fixed_widths() -> bytes:
    """Chains and interiors in fixed codes of each width: 0 to 30, and 32."""
    streams = [blob_writer.Stream(bits=4), blob_writer.Stream(INTEGER, 2, 32, COPY)]
    loop = [reference(OWNED, 3), reference(PRIVATE, 2)]
    widths = [*range(31), 32]
    meshlets = []
    for pair in zip(widths, widths[::-1]):
        first, second = ((1 << width) - 1 for width in pair)
        meshlet = fixed_meshlet("CRRRE", [loop], streams, [2, 2], [2, 2], [2, 2])
        meshlet.chain_codes[1] = meshlet.interior_codes[1] = list(pair)
        meshlet.chain[1] = meshlet.interior[1] = [[first, 0], [first // 3, second]]
        meshlets.append(meshlet)
    blob = blob_writer.write_blob(streams, meshlets, 3)
    return with_vertex_count(blob, count_vertices(blob))


def widths_of_groups() -> bytes:
    """A group for each delta width from 0 to 24, with all slot and reference widths."""
    streams = [blob_writer.Stream(bits=4, elements=1)]
    small = fixed_meshlet("E", [], streams, [1], [0], [2])
    meshlets, layouts = [], []
    for g in range(25):
        slots, references, length = g % 7, (g + 3) % 7, (2, 3, 5, 9, 17, 33, 60)[g // 3 % 7]
        layouts.append(blob_writer.Layout(g, slots, references, stride=0, extra_entry_width=g % 24))
        pair = [small] * 2
        if g > 0 and references >= 2:
            slot = min(slots, 1)
            pair = owner_and_user(streams, length, slot)
        meshlets += [*pair, *[small] * 30]
    blob = blob_writer.write_blob(streams, meshlets, 3, lambda g: layouts[g])
    return with_vertex_count(blob, count_vertices(blob))


def owner_and_user(
    streams: list[blob_writer.Stream], length: int, slot: int
) -> list[blob_writer.Meshlet]:
    """Two meshlets of loops of length + 4 edges. The second refers to a run of the first."""
    symbols, edges = "R" * (length + 1) + "E", length + 4
    runs = [reference(OWNED, 1), reference(OWNED, length), reference(PRIVATE, 3)]
    owner = fixed_meshlet(symbols, [runs], streams, [3], [length - 1], [2])
    shared = runs[slot].length
    loop = [reference(FOREIGN, shared, 1, slot), reference(PRIVATE, edges - shared)]
    return [owner, fixed_meshlet(symbols, [loop], streams, [0], [0], [edges - shared - 1])]


def minus_zeros() -> bytes:
    """Two blobs whose offsets and steps of 0 have other signs, which are equal as numbers."""
    blobs = []
    for sign in (1.0, -1.0):
        zero = 0.0 * sign
        streams = [
            blob_writer.Stream(bits=8, predictor=COPY),
            blob_writer.Stream(bits=8, step=-0.5, offset=(zero, -zero, 1.0, zero), predictor=COPY),
            blob_writer.Stream(bits=8, step=zero, offset=(-zero, zero, -0.0, 0.0), predictor=COPY),
        ]
        meshlet = fixed_meshlet("E", [], streams, [1] * 3, [0] * 3, [2] * 3)
        for s in (1, 2):
            meshlet.anchors[s] = [[0, 0, 0]]
            meshlet.interior[s] = [[0, 0, 4], [6, 0, 0]]
        blobs.append(blob_writer.write_blob(streams, [meshlet], 3))
    return b"".join(blobs)


# --- whole files ---

BYTE, UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, FLOAT = 5120, 5121, 5122, 5123, 5126
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4}


@dataclass(frozen=True)
class Attribute:
    """An attribute of a file: its accessor, and the index of its first stream."""

    name: str
    kind: str
    component_type: int
    stream: int
    normalized: bool = False


def components(view: bytes, attribute: Attribute) -> np.ndarray:
    return reference_decoder.accessor_components(
        reference_decoder.decode_view(view),
        attribute.stream,
        attribute.component_type,
        WIDTHS[attribute.kind],
    )


def accessor(view: bytes, attribute: Attribute) -> dict:
    values = components(view, attribute)
    result = {
        "componentType": attribute.component_type,
        "count": len(values),
        "type": attribute.kind,
    }
    if attribute.normalized:
        result["normalized"] = True
    if attribute.name == "POSITION":
        result["min"] = values.min(axis=0).tolist()
        result["max"] = values.max(axis=0).tolist()
    return result


def glb(view: bytes, attributes: list[Attribute], targets: list[list[Attribute]]) -> bytes:
    """A binary glTF file with one primitive."""
    decoded = reference_decoder.decode_view(view)
    accessors = [{"componentType": 5125, "count": decoded.triangles.size, "type": "SCALAR"}]

    def add(group: list[Attribute]) -> dict[str, int]:
        first = len(accessors)
        accessors.extend(accessor(view, attribute) for attribute in group)
        return {attribute.name: first + i for i, attribute in enumerate(group)}

    def streams(group: list[Attribute]) -> dict[str, int]:
        return {attribute.name: attribute.stream for attribute in group}

    extension = {"bufferView": 0, "attributes": streams(attributes)}
    primitive = {"mode": 4, "indices": 0, "attributes": add(attributes)}
    if targets:
        extension["targets"] = [streams(target) for target in targets]
        primitive["targets"] = [add(target) for target in targets]
    primitive["extensions"] = {"EXT_meshlet_edgebreaker": extension}
    names = ["EXT_meshlet_edgebreaker"]
    if any(a.component_type != FLOAT for a in attributes if a.name == "POSITION"):
        names.append("KHR_mesh_quantization")
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": names,
        "extensionsRequired": names,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "buffers": [{"byteLength": len(view)}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(view)}],
    }
    return pack_glb(document, view)


def pack_glb(document: dict, view: bytes) -> bytes:
    """A binary glTF file of a document and its buffer."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<2I", len(view), 0x004E4942) + view
    return struct.pack("<3I", 0x46546C67, 2, 12 + len(chunks)) + chunks


def attributes_view() -> bytes:
    """Two meshlets of five triangles, with twelve streams."""
    streams = [
        blob_writer.Stream(bits=12, step=0.25, offset=(-100.0, 0.1, 7.0, 0.0)),
        blob_writer.Stream(OCT, 2, 8, GEO),  # NORMAL
        blob_writer.Stream(OCT, 2, 10, COPY),  # TANGENT x, y, z
        blob_writer.Stream(SIGN, 1, 1, COPY),  # TANGENT w
        blob_writer.Stream(GRID, 2, 12, AFFINE, step=0.5, offset=(0.0, 20.0, 0.0, 0.0)),
        blob_writer.Stream(INTEGER, 4, 4),  # JOINTS_0
        blob_writer.Stream(INTEGER, 4, 8),  # WEIGHTS_0
        blob_writer.Stream(GRID, 2, 10, step=0.125),  # _MATRIX, first column
        blob_writer.Stream(GRID, 2, 10, step=0.375),  # _MATRIX, second column
        blob_writer.Stream(INTEGER, 1, 32, COPY),  # _ID, above 2^24
        blob_writer.Stream(FLOAT32, 1, 32, COPY),  # _EXACT
        blob_writer.Stream(GRID, 3, 10, step=0.25, offset=(-8.0, -8.0, -8.0, 0.0)),  # target
    ]
    count = len(streams)
    loop = [reference(OWNED, 2), reference(PRIVATE, 5)]
    meshlets = [
        fixed_meshlet("RRRRE", [loop], streams, [2] * count, [1] * count, [4] * count)
        for _ in range(2)
    ]
    for m, meshlet in enumerate(meshlets):
        meshlet.anchors[4][0] = [301, 402]  # so that no value is negative
        meshlet.anchors[9][0] = [0xFF000001 - m]
        meshlet.anchors[10][0] = [0xBFC00000 + m]
    return blob_writer.write_blob(streams, meshlets, 14)


ATTRIBUTES = [
    Attribute("POSITION", "VEC3", FLOAT, 0),
    Attribute("NORMAL", "VEC3", FLOAT, 1),
    Attribute("TANGENT", "VEC4", FLOAT, 2),
    Attribute("TEXCOORD_0", "VEC2", UNSIGNED_SHORT, 4, True),
    Attribute("JOINTS_0", "VEC4", UNSIGNED_BYTE, 5),
    Attribute("WEIGHTS_0", "VEC4", UNSIGNED_BYTE, 6, True),
    Attribute("_MATRIX", "MAT2", FLOAT, 7),
    Attribute("_ID", "SCALAR", FLOAT, 9),
    Attribute("_EXACT", "SCALAR", FLOAT, 10),
]
GLTF = {
    "attributes": (
        attributes_view,
        ATTRIBUTES,
        [[Attribute("POSITION", "VEC3", FLOAT, 11)]],
        "a TANGENT and a MAT2 of two streams each, a morph target, values that are rounded to "
        "integers (half-way cases to even), integers above 2^24 as floats",
    ),
    "pages": (
        pages,
        [Attribute("POSITION", "VEC3", FLOAT, 0), Attribute("NORMAL", "VEC3", FLOAT, 1)],
        [],
        "a view of three blobs",
    ),
}


VALID = {
    "one_triangle": (one_triangle, "one triangle"),
    "quad": (quad, "two triangles in one meshlet without references"),
    "tetrahedron": (
        tetrahedron,
        "a closed surface, cut into meshlets that share all of their boundaries",
    ),
    "worked_example": (
        worked_example,
        "the worked example of the specification: sixteen triangles in meshlets of at most eight",
    ),
    "seam_within_a_meshlet": (
        seam_within_a_meshlet,
        "a tube in one meshlet: its boundary meets itself (delta 0) along a seam of stream 1",
    ),
    "seams_between_meshlets": (
        seams_between_meshlets,
        "a tube in several meshlets, with share bits",
    ),
    "several_disks": (several_disks, "five sheets; several disks in a meshlet"),
    "every_predictor": (
        every_predictor,
        "PARALLELOGRAM, MEAN, COPY, DAMPED, and a stream of 32 bits",
    ),
    "every_kind": (every_kind, "GRID, OCT, SIGN, INTEGER, FLOAT32"),
    "normals_and_texcoords": (
        normals_and_texcoords,
        "half a sphere with GEO and AFFINE in several meshlets",
    ),
    "rice_and_fixed_codes": (rice_and_fixed_codes, "Rice and fixed codes, for chains and interior"),
    "several_groups": (several_groups, "more than 32 meshlets"),
    "limits": (limits, "64 vertices, a reference of length 64, and 63 references"),
    "64_streams": (many_streams, "64 streams, and 63 share bits that are all one"),
    "awkward_topology": (
        awkward_topology,
        "non-manifold edges and vertices, duplicate and collapsed triangles",
    ),
    "eight_hops": (eight_hops, "hand-made: a corner found after eight hops"),
    "filled_hole": (
        filled_hole,
        "hand-made: loops of a single owned and of a single foreign reference, which is a seam",
    ),
    "extreme_codes": (
        extreme_codes,
        "hand-made: Rice parameter 31, quotient 16383, width 32, width above the stream's bits",
    ),
    "exp_golomb_codes": (
        exp_golomb_codes,
        "hand-made: codes 4 to 6 of the interior, their largest parameters and values",
    ),
    "chain_codes": (
        chain_codes,
        "hand-made: codes 0 to 6 and fixed widths of chains, their largest parameter and values",
    ),
    "anchors_of_every_width": (
        anchors_of_every_width,
        "hand-made: all width fields of further anchors with anchor bases from 0 to 31, "
        "differences to the first anchor that wrap",
    ),
    "anchors_without_widths": (
        anchors_without_widths,
        "hand-made: meshlets that store one corner of a stream, so that it has no widths",
    ),
    "interior_of_several_streams": (
        interior_of_several_streams,
        "hand-made: the interior of five streams in all codes, with seams of some streams",
    ),
    "geo": (geo, "hand-made: GEO from positions of 12 bits"),
    "geo_of_wide_positions": (
        geo_of_wide_positions,
        "hand-made: GEO from positions of 24 bits, which are shifted",
    ),
    "geo_of_narrow_positions": (
        geo_of_narrow_positions,
        "hand-made: GEO from positions of 3 bits, with triangles that have no normal",
    ),
    "geo_without_references": (
        geo_without_references,
        "hand-made: GEO in meshlets without references, of one disk and of three",
    ),
    "affine": (affine, "hand-made: AFFINE from positions of 12 bits"),
    "affine_of_wide_positions": (
        affine_of_wide_positions,
        "hand-made: AFFINE from positions of 24 bits, values that wrap",
    ),
    "affine_of_narrow_positions": (
        affine_of_narrow_positions,
        "hand-made: AFFINE from positions of 3 bits; most frames are degenerate",
    ),
    "affine_seams": (
        affine_seams,
        "hand-made: AFFINE chains of a run that a stream shares, and of one that is a seam",
    ),
    "flat_positions": (
        flat_positions,
        "hand-made: all positions are equal, so that GEO has no normal and AFFINE no frame",
    ),
    "oct_axes": (
        oct_axes,
        "hand-made: the six axes on octahedral grids of 2, 8 and 16 bits; they decode exactly",
    ),
    "grid_arithmetic": (
        grid_arithmetic,
        "hand-made: GRID values that binary32 instead of binary64 arithmetic rounds differently",
    ),
    "grid_zero_steps": (
        grid_zero_steps,
        "hand-made: GRID streams with steps of 0 and -0; some values are -0",
    ),
    "corner_of_two_runs": (
        corner_of_two_runs,
        "hand-made: a corner between two foreign references with the same owner, whose corners "
        "there are two vertices with equal values; GEO",
    ),
    "gap_before_meshlets": (
        gap_before_meshlets,
        "hand-made: unused bytes between a group's entries and its first meshlet",
    ),
    "group_tables": (
        group_tables,
        "hand-made: groups with all kinds of strides, biases, entry widths, flags and tables",
    ),
    "two_vertex_loop": (two_vertex_loop, "hand-made: a boundary of two vertices"),
    "collapsed_by_aliases": (
        collapsed_by_aliases,
        "hand-made: triangles two of whose local vertices are one vertex through aliases",
    ),
    "redundant_masks": (
        redundant_masks,
        "hand-made: a stored private mask that is zero, stored share bits that are all one",
    ),
    "unused_bytes": (
        unused_bytes,
        "hand-made: unused bytes before groups and after the meshlets' data, "
        "an offset of an element that the stream lacks",
    ),
    "hops_of_different_lengths": (
        hops_of_different_lengths,
        "hand-made: a corner with two owners; the smaller one counts, two hops from an anchor, not "
        "the other one, one hop from an anchor with equal values",
    ),
    "geo_sums_near_2_31": (
        geo_sums_near_2_31,
        "hand-made: GEO with the largest sums of triangles that a meshlet can have, just below "
        "2^31, and products above it",
    ),
    "affine_ties": (
        affine_ties,
        "hand-made: AFFINE values that end half-way between two integers, of both signs",
    ),
    "fixed_widths": (
        fixed_widths,
        "hand-made: fixed codes of chains and interiors with all widths: 0 to 30, and 32",
    ),
    "widths_of_groups": (
        widths_of_groups,
        "hand-made: all delta widths, slot widths and reference widths",
    ),
    "random_structures": (
        random_structures,
        "hand-made: random connectivity, references, codes and residuals",
    ),
}


VIEWS = {
    "pages": (pages, "hand-made: a view of three blobs; predictors and bases differ"),
    "minus_zeros": (
        minus_zeros,
        "hand-made: steps and offsets of two blobs that differ in the sign of zero; each blob's "
        "values follow its own",
    ),
    "encoded_pages": (
        encoded_pages,
        "a sheet in blobs of at most 512 bytes; vertices on their borders repeat",
    ),
}
# Vectors whose JSON has the dequantised values, too.
WITH_COMPONENTS = ("every_kind", "oct_axes", "grid_arithmetic", "grid_zero_steps", "minus_zeros")
AFFINE_SEED = 97  # of affine_ties: the cases that its test names occur
# Malformed vectors that only a validator has to refuse (A.9 of the specification).
VALIDATORS_ONLY = ("nine_hops", "inconsistent", "data_within_data")


# --- fields of blobs ---


@dataclass(frozen=True)
class Field:
    """A field of a meshlet's data: its first bit in the blob, its width in bits, and its value."""

    position: int
    width: int
    name: str
    value: int


def meshlet_fields(blob: bytes, m: int) -> list[Field]:
    """The fields of meshlet m in the order in which the reference decoder reads them."""
    fields = []

    class TracingReader(reference_decoder.BitReader):
        def read(self, width, name):
            position = self.position
            value = super().read(width, name)
            fields.append(Field(position, width, name, value))
            return value

    decoder = reference_decoder.Decoder(blob)
    for owner in range(m):
        decoder.file.meshlet(owner)
    with mock.patch.object(reference_decoder, "BitReader", TracingReader):
        decoder.meshlet(m)
    return fields


# The next functions return a changed copy of a blob.


def put_bits(blob: bytes, position: int, width: int, value: int) -> bytes:
    bits = int.from_bytes(blob, "little")
    mask = ((1 << width) - 1) << position
    return (bits & ~mask | value << position & mask).to_bytes(len(blob), "little")


def put_bytes(blob: bytes, at: int, form: str, value) -> bytes:
    data = struct.pack("<" + form, value)
    return blob[:at] + data + blob[at + len(data) :]


def patch(blob: bytes, m: int, name: str, value: int, occurrence: int = 0) -> bytes:
    """The blob with another value in one field of meshlet m."""
    field = [field for field in meshlet_fields(blob, m) if field.name == name][occurrence]
    return put_bits(blob, field.position, field.width, value)


def patch_group(blob: bytes, position: int, width: int, value: int, g: int = 0) -> bytes:
    """The blob with another value in bits of an entry of the group table."""
    return put_bits(blob, 8 * (table_offsets(blob)["groups"] + 12 * g) + position, width, value)


def table_offsets(blob: bytes) -> dict[str, int]:
    """The first byte of each table."""
    return {"streams": 32, "groups": 32 + 28 * blob[5]}


# --- malformed blobs ---


def symbols_only(symbols: str) -> bytes:
    """One meshlet of the given symbols without references; all residuals are 0."""
    streams = [blob_writer.Stream()]
    meshlet = blob_writer.Meshlet(symbols, [], [[[0, 0, 0]]], [], [[]], [[0, 0, 0]], [[]])
    return blob_writer.write_blob(streams, [meshlet], 3)


def two_triangles(**changes) -> bytes:
    """A meshlet without references. changes: fields of its stream."""
    streams = [blob_writer.Stream(**changes)]
    return blob_writer.write_blob(streams, [fixed_meshlet("RE", [], streams, [1], [0], [3])], 4)


def with_streams(*further: blob_writer.Stream, first: blob_writer.Stream | None = None) -> bytes:
    """Two triangles with further streams, which need not be valid."""
    streams = [first or blob_writer.Stream(), *further]
    n = len(streams)
    meshlet = fixed_meshlet("RE", [], streams, [1] * n, [0] * n, [3] * n)
    return blob_writer.write_blob(streams, [meshlet], 4)


def many_meshlets() -> bytes:
    """Two groups."""
    streams = [blob_writer.Stream(bits=10)]
    blob = blob_writer.write_blob(streams, small_meshlets(34, streams), 3)
    return with_vertex_count(blob, count_vertices(blob))


def two_meshlets() -> bytes:
    """Two meshlets, of two disks and one.

    They have owned, foreign and private references, a loop-end mask and share bits.
    """
    streams = [blob_writer.Stream(), blob_writer.Stream(elements=2)]
    loops = [
        [reference(OWNED, 1), reference(PRIVATE, 2)],
        [reference(OWNED, 2), reference(PRIVATE, 1), reference(OWNED, 1)],
    ]
    loop = [reference(FOREIGN, 2, 1, 1, (False,)), reference(OWNED, 2), reference(PRIVATE, 1)]
    meshlets = [
        fixed_meshlet("ERE", loops, streams, [5, 5], [1, 1], [1, 1]),
        fixed_meshlet("RRE", [loop], streams, [1, 3], [1, 1], [0, 1]),
    ]
    return blob_writer.write_blob(streams, meshlets, 12)


def unused_parameter(code: int) -> bytes:
    """A triangle whose chains have a code of parameter 32, but no inner vertices."""
    streams = [blob_writer.Stream(chain_base=31)]
    loop = [reference(OWNED, 1), reference(OWNED, 1), reference(PRIVATE, 1)]
    meshlet = fixed_meshlet("E", [loop], streams, [3], [0], [0])
    meshlet.chain_codes = [code]
    return blob_writer.write_blob(streams, [meshlet], 3)


def exp_golomb_parameter() -> bytes:
    """A code of parameter 32, in the interior of a stream that is not read before others."""
    streams = [blob_writer.Stream(), blob_writer.Stream(interior_base=31)]
    meshlet = fixed_meshlet("RE", [], streams, [1] * 2, [0] * 2, [3] * 2)
    meshlet.interior_codes[1] = 6
    return blob_writer.write_blob(streams, [meshlet], 4)


def owners_parameter() -> bytes:
    """A triangle whose owner has a code of parameter 32, for an interior of no vertices."""
    streams = [blob_writer.Stream(interior_base=31)]
    own = [reference(OWNED, 1)] * 3
    owner = fixed_meshlet("E", [own], streams, [3], [0], [0])
    owner.interior_codes = [1]
    user = fixed_meshlet("E", [[reference(FOREIGN, 1, 1, 0), *own[1:]]], streams, [1], [0], [0])
    user.interior_codes = [0]
    return blob_writer.write_blob(streams, [owner, user], 4)


def exp_golomb_quotient(k: int, quotient: int) -> bytes:
    """A value with a quotient that is too large for its code; its low bits follow."""
    streams = [blob_writer.Stream(INTEGER, 1, 32, COPY, interior_base=k + 1)]
    residuals = [[(1 << k + quotient) - (1 << k)], [0]]
    meshlet = blob_writer.Meshlet("E", [], [[[1]]], [], [[]], [4], [residuals])
    return blob_writer.write_blob(streams, [meshlet], 3)


def flags_without_references(name: str) -> bytes:
    streams = [blob_writer.Stream()]
    meshlet = fixed_meshlet("RE", [], streams, [1], [0], [3])
    layout = blob_writer.Layout(loops=True, private=True, seams=True)
    return patch(blob_writer.write_blob(streams, [meshlet], 4, layout), 0, name, 1)


def data_within_data() -> bytes:
    """Meshlet 1 starts at the second byte of meshlet 0; both decode if nobody checks the end.

    Each is a triangle: 6 bits of T - 1, a code 0, an anchor of 8 bits, and two residuals 0.
    """
    streams = [blob_writer.Stream(bits=8, elements=1)]
    meshlet = blob_writer.Meshlet("E", [], [[[0]]], [], [[]], [0], [[[0], [0]]])
    blob = blob_writer.write_blob(streams, [meshlet] * 2, 6, blob_writer.Layout(reference_width=0))
    (base,) = struct.unpack_from("<I", blob, table_offsets(blob)["groups"])
    data = 1 << 17 | 1 << 18 | 1 << 25 | 1 << 26
    blob = blob[:base] + data.to_bytes(6, "little") + blob[base + 6 :]
    return patch_group(blob, 32, 16, 1)


def circle() -> bytes:
    """A meshlet with three edges that refer to its first: hops from a corner form a cycle."""
    streams = [blob_writer.Stream()]
    loop = [reference(OWNED, 1), *(reference(FOREIGN, 1) for _ in range(3))]
    return blob_writer.write_blob(streams, [fixed_meshlet("RE", [loop], streams, [0], [0], [0])], 4)


def inconsistent() -> bytes:
    """A closed foreign run of an open owned run: one corner would equal two different ones."""
    streams = [blob_writer.Stream()]
    meshlets = [
        fixed_meshlet("RE", [[reference(OWNED, 3), reference(OWNED, 1)]], streams, [2], [2], [0]),
        fixed_meshlet("E", [[reference(FOREIGN, 3, 1, 0)]], streams, [0], [0], [0]),
    ]
    return blob_writer.write_blob(streams, meshlets, 4)


def every_section() -> bytes:
    """One meshlet of two disks that has every field, except for plane p3 and exp-Golomb codes."""
    streams = [
        blob_writer.Stream(chain_base=2),
        blob_writer.Stream(elements=2, chain_base=2, interior_base=3),
        blob_writer.Stream(elements=2),
    ]
    loops = [
        [reference(OWNED, 1), reference(PRIVATE, 2)],
        [
            reference(FOREIGN, 1, 0, 0, (False, True)),
            reference(OWNED, 2),
            reference(PRIVATE, 2),
        ],
    ]
    meshlet = fixed_meshlet("ERRE", loops, streams, [3, 5, 3], [1] * 3, [2] * 3)
    meshlet.chain_codes = [0, 1, [6, 6]]
    meshlet.interior_codes = [1, 2, [6, 6]]
    return blob_writer.write_blob(streams, [meshlet], 8)


def cut_within(blob: bytes, name: str) -> bytes:
    """The blob of one meshlet without the byte in which the last field of this name ends.

    Unused bytes before the entries make its length a multiple of 4.
    """
    field = [field for field in meshlet_fields(blob, 0) if field.name == name][-1]
    end = (field.position + field.width - 1) >> 3
    group = table_offsets(blob)["groups"]
    tables = group + 12
    unused = bytes(-end % 4)
    cut = blob[:tables] + unused + blob[tables:end] + bytes(8)
    (base,) = struct.unpack_from("<I", blob, group)
    return put_bytes(put_bytes(cut, group, "I", base + len(unused)), 20, "I", len(cut))


FIELDS_TO_CUT = {
    "cut_symbols": "p2",
    "cut_foreign_mask": "foreign mask",
    "cut_private_mask": "private mask",
    "cut_length": "length - 1",
    "cut_slot": "slot",
    "cut_codes": "code of chain, stream 1",
    "cut_width_of_chain": "width of chain, stream 2",
    "cut_width_of_interior": "width of interior, stream 2",
    "cut_first_anchor": "first anchor, stream 2",
    "cut_width_of_further_anchors": "width of further anchors, stream 2",
    "cut_further_anchors": "further anchors, stream 2",
    "cut_chain_low": "low of chain, stream 2",
    "cut_chain_unary": "unary of chain, stream 1",
    "cut_interior_0_unary": "unary of interior, stream 0",
    "cut_interior_0_low": "low of interior, stream 0",
    "cut_interior_unary": "unary of interior, stream 1",
    "cut_interior_low": "low of interior, stream 2",
}


def malformed_header() -> dict[str, bytes]:
    """Name -> a blob with one thing wrong in its header or its length."""
    simple = two_triangles()
    return {
        "empty": b"",
        "header_only": simple[:32],
        "truncated": simple[:-4],
        "longer_than_it_says": simple + bytes(4),
        "length_not_a_multiple_of_four": put_bytes(simple + b"\0", 20, "I", len(simple) + 1),
        "padding_not_zero": simple[:-1] + b"\1",
        "magic": put_bytes(simple, 0, "I", 0x324D4245),
        "version_of_the_draft": put_bytes(simple, 4, "B", 1),
        "version_0": put_bytes(simple, 4, "B", 0),
        "version_3": put_bytes(simple, 4, "B", 3),
        "no_stream": put_bytes(simple, 5, "B", 0),
        "too_many_streams": put_bytes(simple, 5, "B", 65),
        "flags": put_bytes(simple, 6, "B", 1),
        "reserved": put_bytes(simple, 28, "I", 1),
        "reserved_byte": put_bytes(simple, 7, "B", 1),
        "triangle_count": put_bytes(simple, 8, "I", 3),
        "vertex_count_too_small": with_vertex_count(simple, 3),
        "vertex_count_too_large": with_vertex_count(simple, 5),
        "vertex_count_of_no_triangle": with_vertex_count(simple, 2),
        "vertex_count_above_meshlets": with_vertex_count(simple, 65),
        "vertex_count_impossible": with_vertex_count(simple, 0xFFFFFFFF),
        "no_meshlet": put_bytes(simple, 16, "I", 0),
        "meshlet_count_huge": put_bytes(simple, 16, "I", 0xFFFFFFFF),
        "data_offset": put_bytes(simple, 24, "I", table_offsets(simple)["groups"]),
    }


def malformed_streams() -> dict[str, bytes]:
    """Name -> a blob with one thing wrong in its stream table."""
    simple = two_triangles()
    wide = blob_writer.Stream(INTEGER, 1, 32, COPY)
    grid = blob_writer.Stream()
    return {
        "stream_kind": put_bytes(simple, 32, "B", 5),
        "stream_elements": put_bytes(simple, 33, "B", 5),
        "stream_no_elements": put_bytes(simple, 33, "B", 0),
        "stream_no_bits": put_bytes(simple, 34, "B", 0),
        "stream_bits": put_bytes(put_bytes(simple, 34, "B", 33), 35, "B", COPY),
        "stream_grid_bits": put_bytes(put_bytes(simple, 34, "B", 25), 35, "B", COPY),
        "stream_predictor_ring": put_bytes(with_streams(grid), 32 + 28 + 3, "B", 6),
        "stream_predictor_7": put_bytes(with_streams(grid), 32 + 28 + 3, "B", 7),
        "stream_predictor_255": put_bytes(simple, 35, "B", 255),
        "stream_wide_predictor": put_bytes(with_streams(wide), 32 + 28 + 3, "B", MEAN),
        "stream_wide_affine": put_bytes(with_streams(wide), 32 + 28 + 3, "B", AFFINE),
        "stream_chain_base": put_bytes(simple, 36, "B", 32),
        "stream_interior_base": put_bytes(simple, 37, "B", 32),
        "stream_anchor_base": put_bytes(simple, 38, "B", 32),
        "stream_reserved": put_bytes(simple, 39, "B", 1),
        "stream_step": put_bytes(simple, 40, "f", float("nan")),
        "stream_offset": put_bytes(simple, 44, "f", float("inf")),
        "stream_offset_unused": put_bytes(simple, 56, "f", float("inf")),
        "stream_oct_elements": put_bytes(simple, 32, "B", OCT),
        "stream_oct_bits_1": with_streams(blob_writer.Stream(OCT, 2, 1)),
        "stream_sign_elements": with_streams(blob_writer.Stream(SIGN, 2, 1)),
        "stream_sign_bits_2": with_streams(blob_writer.Stream(SIGN, 1, 2)),
        "stream_oct_bits": with_streams(blob_writer.Stream(OCT, 2, 17)),
        "stream_float_bits": put_bytes(simple, 32, "B", FLOAT32),
        "stream_sign_bits": put_bytes(simple, 32, "B", SIGN),
        "stream_0_geo": with_streams(first=blob_writer.Stream(OCT, 2, 8, GEO)),
        "stream_0_affine": two_triangles(predictor=AFFINE),
        "stream_geo_of_grid": with_streams(blob_writer.Stream(GRID, 2, 8, GEO)),
        "stream_affine_of_oct": with_streams(blob_writer.Stream(OCT, 2, 8, AFFINE)),
        "stream_affine_of_sign": with_streams(blob_writer.Stream(SIGN, 1, 1, AFFINE)),
        "stream_geo_without_grid": with_streams(
            blob_writer.Stream(OCT, 2, 8, GEO), first=blob_writer.Stream(INTEGER)
        ),
        "stream_geo_without_three": with_streams(
            blob_writer.Stream(OCT, 2, 8, GEO), first=blob_writer.Stream(elements=2)
        ),
        "stream_affine_without_grid": with_streams(
            blob_writer.Stream(GRID, 2, 8, AFFINE), first=blob_writer.Stream(INTEGER)
        ),
    }


def malformed_groups() -> dict[str, bytes]:
    """Name -> a blob with one thing wrong in its group table or entries."""
    pair = two_meshlets()
    groups = many_meshlets()
    (base,) = struct.unpack_from("<I", groups, table_offsets(groups)["groups"])
    return {
        "group_delta_width": patch_group(pair, 64 + 5, 5, 25),
        "group_slot_width": patch_group(pair, 64 + 10, 3, 7),
        "group_reference_width": patch_group(pair, 64 + 13, 3, 7),
        "group_reserved": patch_group(pair, 64 + 20, 12, 1),
        "group_base_outside": patch_group(pair, 0, 32, 0xFFFFFFFF),
        "group_base_in_tables": patch_group(pair, 0, 32, 32),
        "group_entries_outside": patch_group(pair, 0, 32, len(pair) - 8),
        "group_within_a_group": patch_group(groups, 0, 32, base + 1, g=1),
        "group_base_in_the_last_meshlet": patch_group(groups, 0, 32, last_start(groups, 31), g=1),
        "group_entry_padding": put_bits(
            uneven_meshlets(), 8 * entries_end(uneven_meshlets()) - 1, 1, 1
        ),
        "meshlet_before_its_group": patch_group(pair, 48, 16, 1),
        "meshlet_outside": patch_group(pair, 32, 16, 0xFFFF),
        "meshlets_overlap": patch_group(data_within_data(), 32, 16, 0),
        "data_within_data": data_within_data(),
    }


def last_start(blob: bytes, m: int) -> int:
    return reference_decoder.BlobFile(blob).starts[m]


def uneven_meshlets() -> bytes:
    """Meshlets whose entries do not fill a byte."""
    streams = [blob_writer.Stream(bits=10)]
    meshlets = [
        fixed_meshlet(symbols, [], streams, [1], [0], [len(symbols) + 1])
        for symbols in ("E", "RE", "E")
    ]
    return blob_writer.write_blob(streams, meshlets, 10, blob_writer.Layout(stride=1))


def entries_end(blob: bytes) -> int:
    return reference_decoder.BlobFile(blob).starts[0]


def malformed_meshlets() -> dict[str, bytes]:
    """Name -> a blob with one thing wrong in a meshlet's data."""
    pair = two_meshlets()
    return {
        "loops_without_references": flags_without_references("LOOPS"),
        "private_without_references": flags_without_references("PRIVATE"),
        "seams_without_references": flags_without_references("SEAMS"),
        "symbols_end_within_s": symbols_only("SE"),
        "symbols_repeat_a_vertex": symbols_only("RCCE"),
        "symbols_empty_stack": symbols_only("CCCCE"),
        "more_than_64_vertices": symbols_only("R" * 62 + "E"),
        "last_reference_ends_no_loop": patch(pair, 0, "loop-end mask", 0b00110),
        "too_many_loops": patch(pair, 0, "loop-end mask", 0b10011),
        "too_few_loops": patch(pair, 0, "loop-end mask", 0b10000),
        "private_and_foreign": patch(pair, 1, "private mask", 0b101),
        "length_width": patch(pair, 0, "length width", 7),
        "lengths_too_long": patch(pair, 0, "length - 1", 1),
        "lengths_too_short": patch(pair, 0, "length - 1", 0, occurrence=1),
        "foreign_length": patch(pair, 1, "slot", 2),
        "owner_before_the_first": patch(pair, 1, "delta", 2),
        "slot": patch(pair, 1, "slot", 3),
        "rice_parameter": extreme_codes(base=29),
        "rice_parameter_unused": unused_parameter(1),
        "rice_parameter_unused_6": unused_parameter(6),
        "exp_golomb_parameter": exp_golomb_parameter(),
        "interior_parameter_of_an_owner": owners_parameter(),
        "quotient": extreme_codes(quotient=16384),
        "chain_quotient": chain_codes(quotient=16384),
        "exp_golomb_quotient": exp_golomb_quotient(0, 32),
        "exp_golomb_quotient_and_parameter": exp_golomb_quotient(5, 28),
        **{name: cut_within(every_section(), field) for name, field in FIELDS_TO_CUT.items()},
        "nine_hops": hop_chain(9),
        "hops_in_a_circle": circle(),
        "inconsistent": inconsistent(),
    }


def malformed_views() -> dict[str, bytes]:
    """Name -> a view of two blobs with one thing wrong."""
    first = two_triangles()
    return {
        "view_step": first + two_triangles(step=2.0),
        "view_offset_unused": first + two_triangles(offset=(0.0, 0.0, 0.0, 1.0)),
        "view_bits": first + two_triangles(bits=13),
        "view_elements": first + two_triangles(elements=2),
        "view_kind": first + two_triangles(kind=INTEGER),
        "view_stream_count": first + with_streams(blob_writer.Stream()),
        "view_second_blob": first + put_bytes(first, 0, "I", 0),
        "view_gap": first + bytes(4) + first,
        "view_truncated": first + first[:-4],
    }


def malformed_vectors() -> dict[str, bytes]:
    """Name -> a blob or view with one thing wrong."""
    return {
        **malformed_header(),
        **malformed_streams(),
        **malformed_groups(),
        **malformed_meshlets(),
        **malformed_views(),
    }


# --- worked example ---

SECTIONS = {
    "T - 1": "Head",
    "refs": "Head",
    "LOOPS": "Head",
    "PRIVATE": "Head",
    "SEAMS": "Head",
    "p0": "Symbols",
    "p1": "Symbols",
    "p2": "Symbols",
    "p3": "Symbols",
    "foreign mask": "References",
    "loop-end mask": "References",
    "private mask": "References",
    "length width": "References",
    "length - 1": "References",
    "delta": "References",
    "slot": "References",
    "share bits": "References",
    "code of": "Codes",
    "width of chain": "Codes",
    "width of interior": "Codes",
    "first anchor": "Anchors",
    "width of further anchors": "Anchors",
    "further anchors": "Anchors",
    "low of chain": "Chains",
    "unary of chain": "Chains",
    "unary of interior": "Interior",
    "low of interior": "Interior",
}
MASKS = ("p0", "p1", "p2", "p3", "foreign mask", "loop-end mask", "private mask", "share bits")
HEADER_FIELDS = (
    ("I", "magic"),
    ("B", "version"),
    ("B", "stream count"),
    ("B", "flags"),
    ("B", "reserved"),
    ("I", "triangle count"),
    ("I", "vertex count"),
    ("I", "meshlet count"),
    ("I", "byte length"),
    ("I", "data offset"),
    ("I", "reserved"),
)
STREAM_FIELDS = (
    ("B", "kind"),
    ("B", "elements"),
    ("B", "bits"),
    ("B", "predictor"),
    ("B", "chain base"),
    ("B", "interior base"),
    ("B", "anchor base"),
    ("B", "reserved"),
    ("f", "step"),
    *(("f", f"offset[{c}]") for c in range(4)),
)
GROUP_FIELDS = (
    ("I", "base"),
    ("H", "stride"),
    ("H", "bias"),
)
GROUP_BITS = (
    (5, "entry width"),
    (5, "delta width"),
    (3, "slot width"),
    (3, "reference width"),
    (1, "LOOPS"),
    (1, "PRIVATE"),
    (1, "SEAMS"),
    (1, "symbol table"),
    (12, "reserved"),
)


def table_rows(blob: bytes, at: int, part: str, fields) -> list[str]:
    rows = []
    for form, name in fields:
        size = struct.calcsize(form)
        (value,) = struct.unpack_from("<" + form, blob, at)
        shown = hex(value) if name == "magic" else value
        rows.append(f"| {at} | `{blob[at : at + size].hex(' ')}` | {part}: {name} | {shown} |")
        at += size
    return rows


def group_rows(blob: bytes, g: int) -> list[str]:
    """Rows of an entry of the group table, and of the entries of its meshlets."""
    at = table_offsets(blob)["groups"] + 12 * g
    rows = table_rows(blob, at, f"group {g}", GROUP_FIELDS)
    (word,) = struct.unpack_from("<I", blob, at + 8)
    values = []
    for width, name in GROUP_BITS:
        values.append(f"{name} {word & (1 << width) - 1}")
        word >>= width
    rows.append(
        f"| {at + 8} | `{blob[at + 8 : at + 12].hex(' ')}` | group {g} | {', '.join(values)} |"
    )
    file = reference_decoder.BlobFile(blob)
    group = file.groups[g]
    places = range(32 * g, min(32 * g + 32, file.meshlet_count))
    first = file.starts[places[0]]
    reader = reference_decoder.BitReader(blob, 8 * group.base, 8 * first)
    entries = ", ".join(str(reader.read(group.entry_width, "entry")) for _ in places)
    shown = ", ".join(f"{file.starts[m]} to {file.ends[m] - 1}" for m in places)
    rows.append(
        f"| {group.base} | `{blob[group.base : first].hex(' ')}` | entries of group {g} "
        f"| {entries}: meshlets in bytes {shown} |"
    )
    return rows


def unary_values(bits: list[int]) -> list[int]:
    """The lengths of the runs of 0 bits before each 1 bit."""
    zeros = "".join(map(str, bits)).split("1")[:-1]
    return [len(run) for run in zeros]


def meshlet_rows(blob: bytes, m: int) -> list[str]:
    """One row per run of fields with the same name."""
    runs: list[list[Field]] = []
    for field in meshlet_fields(blob, m):
        if field.width:
            if not runs or runs[-1][0].name != field.name:
                runs.append([])
            runs[-1].append(field)
    rows = []
    for run in runs:
        first = run[0]
        values = [field.value for field in run]
        section = next(
            section for prefix, section in SECTIONS.items() if first.name.startswith(prefix)
        )
        widths = (
            f"{first.width}"
            if len(run) == 1
            else f"{len(run)} \N{MULTIPLICATION SIGN} {first.width}"
        )
        if first.name.startswith("unary of"):
            values = unary_values(values)
            widths = f"{len(run)}"
        shown = ", ".join(map(str, values))
        if first.name in MASKS:
            shown = "bits " + " ".join(f"{value:0{first.width}b}"[::-1] for value in values)
        if len({field.width for field in run}) > 1:
            widths = " + ".join(str(field.width) for field in run)
        rows.append(
            f"| {first.position >> 3} | {first.position & 7} | {widths} "
            f"| {section} | {first.name} | {shown} |"
        )
    return rows


def hops_text(decoder: reference_decoder.Decoder, m: int) -> str:
    """The hops from each corner that meshlet m does not store; the same for all streams."""
    meshlet = decoder.file.meshlet(m)
    assert not meshlet.has_seams
    paths = []
    for j, run in enumerate(decoder.boundary(meshlet)):
        path = f"corner {j} (local id {run[0]})"
        here = meshlet, j
        while (there := decoder.hop(*here, reference_decoder.Reference.shares_all)) is not None:
            here = there
            path += f" → corner {here[1]} of meshlet {here[0].index}"
        if here != (meshlet, j):
            paths.append(path)
    return "; ".join(paths) or "none"


def local_table(blob: bytes, m: int, numbers: dict[int, int]) -> list[str]:
    """Triangles, hops, aliases and values of meshlet m. numbers: local id -> vertex number."""
    decoder = reference_decoder.Decoder(blob)
    triangles, values = decoder.meshlet(m)
    symbols = decoder.file.meshlet(m).symbols
    aliases = decoder.alias(
        decoder.file.meshlet(m), [decoder.boundary(decoder.file.meshlet(n)) for n in range(m + 1)]
    )
    aliases_text = ", ".join(
        f"{v} of {w} of meshlet {owner}" for v, (owner, w) in sorted(aliases.items())
    )
    shown = ", ".join(map(str, triangles))
    rows = [*wrap(f"Symbols {' '.join(symbols)}, triangles (a, b, v): {shown}."), ""]
    rows += wrap(f"Hops: {hops_text(decoder, m)}. Aliases, by local ids: {aliases_text or 'none'}.")
    rows.append("")
    rows += [
        "| local id | vertex | " + " | ".join(f"stream {s}" for s in range(len(values))) + " |",
        "| --- | --- |" + " --- |" * len(values),
    ]
    for v in range(len(values[0])):
        rows.append(
            f"| {v} | {numbers[v]} | "
            + " | ".join(", ".join(map(str, stream_values[v])) for stream_values in values)
            + " |"
        )
    return rows


def wrap(text: str) -> list[str]:
    """The lines of a paragraph."""
    return textwrap.wrap(text, 158, break_on_hyphens=False)


def vertex_numbers(blob: bytes, triangles: list) -> list[dict[int, int]]:
    """Per meshlet: local id -> vertex number, from the decoded triangle list."""
    decoder = reference_decoder.Decoder(blob)
    rest = iter(triangles)
    return [
        {v: number for triangle in decoder.meshlet(m)[0] for v, number in zip(triangle, next(rest))}
        for m in range(decoder.file.meshlet_count)
    ]


def worked_example_text(blob: bytes) -> str:
    """The worked example of the specification, as Markdown."""
    decoded = reference_decoder.decode_blob(blob)
    offsets = table_offsets(blob)
    meshlet_count = struct.unpack_from("<I", blob, 16)[0]
    lines = [
        f"{len(decoded.triangles)} triangles, {len(decoded.values[0])} vertices, "
        f"{meshlet_count} meshlets, {len(blob)} bytes:",
        "",
        "```",
    ]
    lines += [f"{at:4}  {blob[at : at + 16].hex(' ')}" for at in range(0, len(blob), 16)]
    lines += [
        "```",
        "",
        "Header and tables:",
        "",
        "| Byte | Bytes | Field | Value |",
        "| --- | --- | --- | --- |",
    ]
    lines += table_rows(blob, 0, "header", HEADER_FIELDS)
    for s in range(blob[5]):
        lines += table_rows(blob, offsets["streams"] + 28 * s, f"stream {s}", STREAM_FIELDS)
    for g in range(-(-meshlet_count // 32)):
        lines += group_rows(blob, g)
    numbers = vertex_numbers(blob, decoded.triangles.tolist())
    for m in range(meshlet_count):
        lines += ["", f"Meshlet {m} (masks are written first bit first):", ""]
        lines += [
            "| Byte | First bit | Bits | Section | Field | Value |",
            "| --- | --- | --- | --- | --- | --- |",
            *meshlet_rows(blob, m),
            "",
        ]
        lines += local_table(blob, m, numbers[m])
    triangles = ", ".join(str(tuple(t)) for t in decoded.triangles.tolist())
    lines += ["", *wrap(f"Decoded triangles, in vertex numbers: {triangles}.")]
    return "\n".join(lines) + "\n"


def replace_example(document: str, text: str) -> str:
    before, rest = document.split(EXAMPLE_BEGIN)
    return before + EXAMPLE_BEGIN + "\n" + text + "\n" + EXAMPLE_END + rest.split(EXAMPLE_END)[1]


# --- files ---


def description(view: bytes, text: str, components: bool = False) -> dict:
    """The contents of a valid vector's JSON. components: also the dequantised values."""
    decoded = reference_decoder.decode_view(view)
    result = {
        "description": text,
        "triangles": decoded.triangles.tolist(),
        "values": [values.tolist() for values in decoded.values],
    }
    if components:
        result["components"] = [
            decoded.dequantised(s).tolist() for s in range(len(decoded.streams))
        ]
    return result


def refusal(view: bytes) -> str:
    """The reference decoder's reason to refuse a blob or a view."""
    try:
        reference_decoder.decode_view(view)
    except ValueError as error:
        return str(error)
    raise AssertionError("the reference decoder accepts a blob that should be malformed")


# --- malformed files ---

Document = dict[str, Any]
# Name -> stream 1, and the attribute that it does not fit.
MISFITS = {
    "oct_in_integers": (
        blob_writer.Stream(OCT, 2, 8),
        Attribute("NORMAL", "VEC3", BYTE, 1, True),
    ),
    "sign_in_integers": (blob_writer.Stream(SIGN, 1, 1), Attribute("_SIGN", "SCALAR", BYTE, 1)),
    "too_many_elements": (blob_writer.Stream(elements=4), Attribute("_X", "VEC3", FLOAT, 1)),
    "too_few_streams": (blob_writer.Stream(elements=3), Attribute("_X", "VEC4", FLOAT, 1)),
}


def parts_of(file: bytes) -> tuple[Document, bytes]:
    """(the JSON document, the buffer) of a file of pack_glb."""
    (length,) = struct.unpack_from("<I", file, 12)
    return json.loads(file[20 : 20 + length]), file[28 + length :]


def primitive_of(document: Document) -> Document:
    primitive: Document = document["meshes"][0]["primitives"][0]
    return primitive


def object_of(document: Document) -> Document:
    """The extension object."""
    extension: Document = primitive_of(document)["extensions"]["EXT_meshlet_edgebreaker"]
    return extension


def misfit(name: str) -> bytes:
    """A file whose accessors do not fit its streams."""
    stream, wrong = MISFITS[name]
    view = with_streams(stream)
    # The accessor of the position stands in for the wrong one.
    file = glb(view, [ATTRIBUTES[0], replace(ATTRIBUTES[0], name=wrong.name)], [])
    document, _ = parts_of(file)
    primitive = primitive_of(document)
    index = primitive["attributes"][wrong.name]
    document["accessors"][index].update(componentType=wrong.component_type, type=wrong.kind)
    if wrong.normalized:
        document["accessors"][index]["normalized"] = True
    object_of(document)["attributes"][wrong.name] = wrong.stream
    return pack_glb(document, view)


TEXCOORD = Attribute("TEXCOORD_0", "VEC2", FLOAT, 1)
POSITION_OF_TARGET = Attribute("POSITION", "VEC3", FLOAT, 2)


def plain_file() -> tuple[Document, bytes]:
    """A valid file: two triangles with texture coordinates and a morph target."""
    view = with_streams(blob_writer.Stream(elements=2), blob_writer.Stream(elements=3))
    return parts_of(glb(view, [ATTRIBUTES[0], TEXCOORD], [[POSITION_OF_TARGET]]))


def positions_alone(view: bytes, **indices: Any) -> bytes:
    """A file with no attribute but POSITION. indices: changes of the accessor of indices."""
    document, _ = parts_of(glb(view, ATTRIBUTES[:1], []))
    document["accessors"][0].update(indices)
    return pack_glb(document, view)


def add_accessor_of_the_view(document: Document) -> None:
    accessor = {"bufferView": 0, "componentType": 5121, "count": 4, "type": "SCALAR"}
    document["accessors"].append(accessor)


def compress_the_view(document: Document) -> None:
    view, name = document["bufferViews"][0], "KHR_meshopt_compression"
    size = view["byteLength"]
    packed = {"buffer": 0, "byteLength": size, "byteStride": 4, "count": size // 4}
    view["extensions"] = {name: {**packed, "mode": "ATTRIBUTES"}}
    document["extensionsUsed"].append(name)


def drop_an_attribute(document: Document) -> None:
    del object_of(document)["attributes"]["TEXCOORD_0"]
    del primitive_of(document)["attributes"]["TEXCOORD_0"]


def name_a_stream_twice(document: Document) -> None:
    attributes = primitive_of(document)["attributes"]
    attributes["TEXCOORD_1"] = len(document["accessors"])
    document["accessors"].append(dict(document["accessors"][attributes["TEXCOORD_0"]]))
    object_of(document)["attributes"]["TEXCOORD_1"] = 1


def swap_positions(document: Document) -> None:
    object_of(document)["attributes"]["POSITION"] = 2
    object_of(document)["targets"][0]["POSITION"] = 0


def rename_in_target(document: Document) -> None:
    (target,) = object_of(document)["targets"]
    target["NORMAL"] = target.pop("POSITION")


def change_accessor(number: int, **changes: Any) -> Callable[[Document], None]:
    return lambda document: document["accessors"][number].update(changes)


def add_draco(document: Document) -> None:
    name = "KHR_draco_mesh_compression"
    primitive_of(document)["extensions"][name] = {"bufferView": 0, "attributes": {"POSITION": 0}}
    document["extensionsUsed"].append(name)


def share_accessors(document: Document) -> None:
    """A second primitive with a view of its own, of the same bytes, and the same accessors."""
    second = json.loads(json.dumps(primitive_of(document)))
    second["extensions"]["EXT_meshlet_edgebreaker"]["bufferView"] = 1
    document["bufferViews"].append(dict(document["bufferViews"][0]))
    document["meshes"][0]["primitives"].append(second)


def make_sparse(document: Document) -> None:
    """The second texture coordinate is replaced by (0, 0): eight bytes of the padding."""
    end = document["buffers"][0]["byteLength"]
    zeros = {"buffer": 0, "byteOffset": end - 8, "byteLength": 8}
    document["bufferViews"].append(zeros)
    part = {"bufferView": 1}
    document["accessors"][2]["sparse"] = {
        "count": 1, "indices": {**part, "componentType": 5125}, "values": part,
    }  # fmt: skip


# Name -> a change of the document of plain_file.
MALFORMED_DOCUMENTS: dict[str, Callable[[Document], object]] = {
    "view_missing": lambda d: object_of(d).update(bufferView=7),
    "view_stride": lambda d: d["bufferViews"][0].update(byteStride=4),
    "view_target": lambda d: d["bufferViews"][0].update(target=34962),
    "view_of_an_accessor": add_accessor_of_the_view,
    "view_compressed": compress_the_view,
    "attribute_without_a_stream": lambda d: object_of(d)["attributes"].pop("TEXCOORD_0"),
    "stream_of_a_missing_attribute": lambda d: primitive_of(d)["attributes"].pop("TEXCOORD_0"),
    "unused_stream": drop_an_attribute,
    "stream_of_two_attributes": name_a_stream_twice,
    "position_is_another_stream": swap_positions,
    "no_targets": lambda d: object_of(d).pop("targets"),
    "too_many_targets": lambda d: object_of(d)["targets"].append({"POSITION": 2}),
    "target_with_another_name": rename_in_target,
    "mode": lambda d: primitive_of(d).update(mode=5),
    "no_indices": lambda d: primitive_of(d).pop("indices"),
    "indices_count": change_accessor(0, count=3),
    "position_count": change_accessor(1, count=5),
    "attribute_count": change_accessor(2, count=3),
    "target_count": change_accessor(3, count=5),
    "value_out_of_range": change_accessor(2, componentType=5120, normalized=True),
    "bounds": change_accessor(1, max=[99.0, 99.0, 99.0]),
    "sparse": make_sparse,
    "not_in_extensions_used": lambda d: d.update(extensionsUsed=[]),
    "not_in_extensions_required": lambda d: d.pop("extensionsRequired"),
    "draco": add_draco,
    "shared_accessors": share_accessors,
}
# The files among them that decoders other than validators may read.
GLTF_VALIDATORS_ONLY = (
    "view_compressed",
    "view_stride",
    "view_target",
    "view_offset",
    "view_of_an_accessor",
    "stream_of_a_missing_attribute",
    "unused_stream",
    "stream_of_two_attributes",
    "position_is_another_stream",
    "position_kind",
    "position_in_two_streams",
    "too_many_targets",
    "mode",
    "indices_reach_the_largest_value",
    "value_out_of_range",
    "bounds",
    "sparse",
    "fallback_with_other_values",
    "not_in_extensions_used",
    "not_in_extensions_required",
    "draco",
    "shared_accessors",
    *("table_cut_off", "table_place", "table_copies", "table_vertex", "table_parameter"),
    "table_count",
)


def file_with_fallback(moved: float = 0.0) -> bytes:
    """Positions with a fallback in which one coordinate is moved."""
    view = two_triangles()
    document, _ = parts_of(glb(view, ATTRIBUTES[:1], []))
    decoded = reference_decoder.decode_view(view)
    stored = components(view, ATTRIBUTES[0]).copy()
    stored[1, 0] += moved
    buffer = view
    for number, array in enumerate((decoded.triangles.astype(np.uint32), stored)):
        place = {"buffer": 0, "byteOffset": len(buffer), "byteLength": array.nbytes}
        document["accessors"][number]["bufferView"] = len(document["bufferViews"])
        document["bufferViews"].append(place)
        buffer += array.tobytes()
    document["buffers"][0]["byteLength"] = len(buffer)
    del document["extensionsRequired"]
    return pack_glb(document, buffer)


# Of tables of equal vertices: their bits, as text.
COUNT_ONE = "1" + 31 * "0"
MALFORMED_TABLES = {
    "table_cut_off": COUNT_ONE + 32 * "0",
    "table_place": COUNT_ONE + 8 * "0" + "00001" + "1" + 18 * "0",
    "table_copies": COUNT_ONE + 8 * "0" + "1" + "0000001" + 16 * "0",
    "table_parameter": COUNT_ONE + "00000100" + 24 * "0",
    "table_count": 32 * "1" + 8 * "0" + 56 * "1",
}


def file_with_table(bits: str, file: tuple[Document, bytes] | None = None) -> bytes:
    """A file with a table of equal vertices. bits: its bytes', from the lowest bit of each on."""
    table = bytes(int(bits[i : i + 8][::-1], 2) for i in range(0, len(bits), 8))
    document, buffer = file or plain_file()
    buffer += bytes(-len(buffer) % 4)
    place = {"buffer": 0, "byteOffset": len(buffer), "byteLength": len(table)}
    object_of(document)["equalVertices"] = {"bufferView": len(document["bufferViews"])}
    document["bufferViews"].append(place)
    buffer += table
    document["buffers"][0]["byteLength"] = len(buffer)
    return pack_glb(document, buffer)


def equal_vertices() -> tuple[bytes, dict[str, Any]]:
    """A file with a table of equal vertices, and what it holds.

    The parameter is 1, gaps are from 0 to 12, copies from 2 to 6. With the table there are more
    vertices than the type of the indices holds. Bytes follow the last field.
    """
    view = encode(grid_triangles(12, 10), grid_positions(12, 10), page_bytes=192, max_triangles=24)
    decoded = reference_decoder.decode_view(view)
    counts = np.bincount(reference_gltf.places_of(decoded))
    chosen = [p for p in range(4, len(counts)) if counts[p] > 1 and p % 4 and not 40 < p < 52]
    copies = [2 + place % (int(counts[place]) - 1) for place in chosen]
    gaps = [place - before - 1 for place, before in zip(chosen, [-1, *chosen])]
    bits = f"{len(chosen):032b}"[::-1] + "10000000"
    bits += "".join((gap >> 1) * "0" + "1" for gap in gaps)
    bits += "".join(str(gap & 1) for gap in gaps)
    bits += "".join((count - 2) * "0" + "1" for count in copies)
    for place, count in zip(chosen, copies):
        width = (count - 1).bit_length()
        ranks = [corner % count for corner in range(1, counts[place])]
        bits += "".join(f"{rank:0{width}b}"[::-1] for rank in ranks)
    bits += -len(bits) % 32 * "0" + 32 * "1"
    data = file_with_table(bits, parts_of(positions_alone(view, componentType=5121)))
    document, buffer = parts_of(data)
    table = document["bufferViews"][1]
    begin = table["byteOffset"]
    corners = reference_gltf.read_equal_vertices(
        buffer[begin : begin + table["byteLength"]], decoded
    )
    numbers = {corner: number for number, corner in enumerate(dict.fromkeys(corners))}
    expected = {
        "description": "a table of equal vertices; more vertices than an index of 8 bits numbers",
        "indices": decoded.triangles.reshape(-1).tolist(),
        "sourceIndices": [numbers[corner] for corner in corners],
        "attributes": {"POSITION": components(view, ATTRIBUTES[0]).tolist()},
        "targets": [],
    }
    return data, expected


def sheet_with_table() -> bytes:
    """A sheet with a table in which a corner has the 4th of a place's three vertices."""
    view = encode(grid_triangles(4, 4), grid_positions(4, 4))
    middle = int(np.argmax(np.bincount(reference_decoder.decode_view(view).triangles.reshape(-1))))
    bits = COUNT_ONE + 8 * "0" + middle * "0" + "1" + "01" + "11"
    return file_with_table(bits + (96 - len(bits)) * "0", parts_of(positions_alone(view)))


def malformed_files() -> dict[str, bytes]:
    """Name -> a file that breaks a rule of "glTF Schema Updates" or "Exclusions"."""
    result = {name: misfit(name) for name in MISFITS}
    for name, change in MALFORMED_DOCUMENTS.items():
        document, buffer = plain_file()
        change(document)
        result[name] = pack_glb(document, buffer)
    document, buffer = plain_file()
    document["bufferViews"][0]["byteOffset"] = 2
    document["buffers"][0]["byteLength"] += 4
    result["view_offset"] = pack_glb(document, bytes(2) + buffer + bytes(2))
    document, buffer = plain_file()
    result["view_malformed"] = pack_glb(document, buffer[:-1] + b"\1")
    integers = blob_writer.Stream(INTEGER, 3, 12)
    result["position_kind"] = positions_alone(with_streams(first=integers))
    pair = blob_writer.Stream(elements=2), blob_writer.Stream(elements=1)
    result["position_in_two_streams"] = positions_alone(with_streams(pair[1], first=pair[0]))
    sheets = [encode(grid_triangles(n, 15), grid_positions(n, 15)) for n in (15, 16)]
    for name, view in zip(("indices_reach_the_largest_value", "indices_of_bytes"), sheets):
        result[name] = positions_alone(view, componentType=5121)
    result["fallback_with_other_values"] = file_with_fallback(1.0)
    result.update((name, file_with_table(bits)) for name, bits in MALFORMED_TABLES.items())
    result["table_vertex"] = sheet_with_table()
    return result


def refusal_of_file(file: bytes) -> str:
    """The reference validator's reason to refuse a file."""
    try:
        reference_gltf.check_file(file)
    except ValueError as error:
        return str(error)
    raise AssertionError("the reference validator accepts a file that should be malformed")


def vector_files() -> dict[str, bytes]:
    """File name -> contents."""
    files = {}
    for kind, vectors in (("valid", VALID), ("view", VIEWS)):
        for name, (make, text) in vectors.items():
            data = make()
            files[f"{kind}_{name}.bin"] = data
            files[f"{kind}_{name}.json"] = (
                json.dumps(
                    description(data, text, name in WITH_COMPONENTS),
                    separators=(",", ":"),
                    allow_nan=False,
                )
                + "\n"
            ).encode()
    for name, (make, attributes, targets, text) in GLTF.items():
        view = make()
        files[f"gltf_{name}.glb"] = glb(view, attributes, targets)
        expected = {
            "description": text,
            "indices": reference_decoder.decode_view(view).triangles.reshape(-1).tolist(),
            "attributes": {a.name: components(view, a).tolist() for a in attributes},
            "targets": [{a.name: components(view, a).tolist() for a in t} for t in targets],
        }
        files[f"gltf_{name}.json"] = (
            json.dumps(expected, separators=(",", ":"), allow_nan=False) + "\n"
        ).encode()
    files["gltf_equal_vertices.glb"], expected = equal_vertices()
    files["gltf_equal_vertices.json"] = (
        json.dumps(expected, separators=(",", ":"), allow_nan=False) + "\n"
    ).encode()
    reasons = {}
    for name, blob in malformed_vectors().items():
        files[f"malformed_{name}.bin"] = blob
        reasons[f"malformed_{name}.bin"] = {
            "reason": refusal(blob),
            "validators_only": name in VALIDATORS_ONLY,
        }
    for name, data in malformed_files().items():
        file = f"malformed_gltf_{name}.glb"
        files[file] = data
        reasons[file] = {
            "reason": refusal_of_file(data),
            "validators_only": name in GLTF_VALIDATORS_ONLY,
        }
    files["malformed.json"] = (json.dumps(reasons, indent=1) + "\n").encode()
    return files


def main() -> None:
    files = vector_files()
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.iterdir():
        old.unlink()
    for name, data in files.items():
        (FOLDER / name).write_bytes(data)
    SPECIFICATION.write_text(
        replace_example(SPECIFICATION.read_text(), worked_example_text(worked_example()))
    )


if __name__ == "__main__":
    main()
