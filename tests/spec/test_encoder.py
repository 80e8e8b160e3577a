"""Random meshes from the encoder: both decoders give the triangles of the source back."""

import random

import numpy as np
import pytest

from gltf_ext import _codec
from spec import make_vectors, reference_decoder
from spec.blob_writer import (
    AFFINE,
    COPY,
    DAMPED,
    FLOAT32,
    GEO,
    GRID,
    INTEGER,
    OCT,
    SIGN,
    random_bits,
)

CHOOSE = -1  # in place of a predictor: the encoder chooses


def random_stream(rng: random.Random) -> _codec.Stream:
    kind = rng.choice([GRID, OCT, INTEGER, FLOAT32, SIGN])
    elements = {OCT: 2, FLOAT32: 1, SIGN: 1}.get(kind) or rng.randint(1, 4)
    bits = random_bits(rng, kind)
    predictors = [CHOOSE, COPY]
    if bits <= 24:
        predictors += range(DAMPED + 1)
        predictors += [GEO] * 3 if kind == OCT else [AFFINE] * 3 if kind != SIGN else []
    return make_vectors.stream(kind, elements, bits, rng.choice(predictors))


def random_sheet(rng: random.Random, bits: int):
    """A wavy sheet with holes: (triangles int[T, 3], positions uint32[V, 3], columns)."""
    columns, rows = rng.randint(1, 14), rng.randint(1, 14)
    kept = rng.choice([1, 1, 0.9, 0.7])
    triangles = [t for t in make_vectors.grid_triangles(columns, rows) if rng.random() < kept]
    noise = np.random.default_rng(rng.getrandbits(32))
    y, x = np.divmod(np.arange((columns + 1) * (rows + 1)), columns + 1)
    wave = 0.5 + 0.4 * np.sin(x * rng.random()) * np.cos(y * rng.random())
    points = np.stack([x / columns, y / rows, wave], axis=1)
    points += noise.normal(0, rng.choice([0, 0.0001, 0.02]), points.shape)
    largest = (1 << bits) - 1
    positions = np.rint(points * largest).clip(0, largest).astype(np.uint32)
    return np.array(triangles or [[0, 1, columns + 2]]), positions, columns


def random_values(rng: random.Random, positions: np.ndarray, stream: _codec.Stream) -> np.ndarray:
    """Values that follow the positions, with some noise."""
    noise = np.random.default_rng(rng.getrandbits(32))
    largest = (1 << stream.bits) - 1
    source = positions[:, [c % 3 for c in range(stream.elements)]] / max(positions.max(), 1)
    values = source * largest + noise.normal(0, rng.choice([0, 1, largest / 20]), source.shape)
    return np.rint(values).clip(0, largest).astype(np.uint64).astype(np.uint32)


def cut_seam(rng: random.Random, triangles, positions, values, columns):
    """Doubles the vertices of a column of the sheet; the copies have other values."""
    column = rng.randint(0, columns)
    across = [t for t in triangles if min(t % (columns + 1)) < column]
    doubled = sorted({int(v) for t in across for v in t if v % (columns + 1) == column})
    copies = {v: len(positions) + i for i, v in enumerate(doubled)}
    for t in across:
        t[:] = [copies.get(int(v), v) for v in t]
    positions = np.concatenate([positions, positions[doubled]])
    values = [np.concatenate([of, of[doubled] ^ rng.getrandbits(1)]) for of in values]
    return triangles, positions, values


def sorted_triangles(triangles, values) -> list:
    """All triangles with their corners' values, whatever the vertex numbers and first corners."""
    corners = np.concatenate(values, axis=1)[np.asarray(triangles)].tolist()
    return sorted(min(c[i:] + c[:i] for i in range(3)) for c in corners)


@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(seed, marks=pytest.mark.full) for seed in range(3, 20))]
)
def test_both_decoders_give_the_source_back(seed):
    rng = random.Random(seed)
    predictors = set()
    for _ in range(60):
        bits = rng.choice([4, 8, 12, 16, 24])
        triangles, positions, columns = random_sheet(rng, bits)
        further = [random_stream(rng) for _ in range(rng.randint(0, 3))]
        values = [random_values(rng, positions, stream) for stream in further]
        if rng.random() < 0.6:
            triangles, positions, values = cut_seam(rng, triangles, positions, values, columns)
        streams = [make_vectors.position_stream(bits, rng.randint(CHOOSE, DAMPED)), *further]
        view = make_vectors.encode(
            triangles,
            positions,
            streams,
            values,
            rng.choice([64, 40, 8]),
            page_bytes=rng.choice([0, 0, 600, 2000]),
            encoder=_codec.encode,
        )
        _codec.validate(view)
        ours, theirs = _codec.decode(view), reference_decoder.decode_view(view)
        assert np.array_equal(ours[0], theirs.triangles)
        assert all(map(np.array_equal, ours[1], theirs.values))
        source = sorted_triangles(triangles, [positions, *values])
        assert sorted_triangles(theirs.triangles, theirs.values) == source
        predictors |= {stream.predictor for stream in theirs.streams}
    assert predictors == set(range(6))
