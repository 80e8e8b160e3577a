"""Mutated tables and pages: a refusal of one line, or a mesh whose indices are in range."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.compression.extension import compressed_primitives
from gltf_ext.gltf.container import parse_glb
from gltf_ext.lod import View, cut_at_level, cut_for_view
from gltf_ext.lod.reading import read_lod
from spec.make_lod_vectors import FOLDER
from tests.helpers import environment

MUTATIONS, FULL_MUTATIONS = 1_000, 100_000
EXTREMES = (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f")


def mutated(data: bytes, start: int, random: np.random.Generator) -> bytes:
    """Some bytes from `start` on changed: to anything, by a bit, or to extremes."""
    result = bytearray(data)
    for _ in range(random.integers(1, 4)):
        at = int(random.integers(start, len(data)))
        kind = random.integers(3)
        if kind == 0:
            result[at] = random.integers(256)
        elif kind == 1:
            result[at] ^= 1 << random.integers(8)
        else:
            result[at : at + 4] = EXTREMES[random.integers(len(EXTREMES))]
    return bytes(result[: len(data)])


def use(data: bytes) -> bool:
    """Reads levels and cuts of a file. Returns whether it was accepted."""
    try:
        document = parse_glb(data)
        primitives = [read_lod(document, c) for c in compressed_primitives(document)]
        for primitive in filter(None, primitives):
            tables = primitive.tables
            cuts = [cut_at_level(tables, level) for level in range(tables.level_count)]
            cuts.append(cut_for_view(tables, View((0.0, 0.0, 9.0), 1000.0), 1.0))
            for cut in cuts:
                mesh = primitive.mesh(cut)
                assert len(mesh.indices) == 0 or mesh.indices.max() < mesh.vertex_count
        return bool(primitives)
    except gltf_ext.MeshletError as error:
        assert "\n" not in str(error)
        return False


@pytest.mark.parametrize("name", ["lod_strip.glb", "lod_levels.glb"])
def test_mutations_are_refused_or_harmless(name):
    data = (FOLDER / name).read_bytes()
    binary = data.index(b"BIN\0") + 4
    random = np.random.default_rng(0)
    assert use(data)
    count = (FULL_MUTATIONS if environment.full else MUTATIONS) // 2
    accepted = sum(use(mutated(data, binary, random)) for _ in range(count))
    assert 0 < accepted < count


def test_wrong_properties_are_refused():
    text = (FOLDER / "lod_strip.glb").read_bytes()
    for old, new in (
        (b'"pageCount":2', b'"pageCount":0'),
        (b'"pageCount":2', b'"pageCount":9'),
        (b'"groupCount":3', b'"groupCount":4'),
        (b'"runCount":2', b'"runCount":1'),
        (b'"coarsePageCount":1', b'"coarsePageCount":2'),
        (b'"coarsePageCount":1', b'"coarsePageCount":0'),
        (b'"pages":{"bufferView":1}', b'"pages":{"bufferView":7}'),
        (b'"pages":{"bufferView":1}', b'"pages":{"bufferView":2}'),
        (b'"runCount":2', b'"runCount":7'),
    ):
        assert old in text and len(old) == len(new)
        assert not use(text.replace(old, new))
