"""Quantisation: grids, octahedral directions, weights, ordered bits; the native decoder agrees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from gltf_ext import _codec
from gltf_ext.attributes import streams as a
from gltf_ext.errors import MeshletError

floats32 = st.floats(-(2.0**100), 2.0**100, width=32)


def bounds_of(values):
    return np.stack([values.min(axis=0), values.max(axis=0)])


@given(arrays.arrays(np.float32, (7, 3), elements=floats32), st.integers(4, 24))
def test_positions_are_off_by_at_most_half_a_step(values, bits):
    grid = a.position_grid(values.min(axis=0), values.max(axis=0), bits, None)
    stream = a.Stream(a.GRID, 3, bits, grid.step, grid.offset)
    quantised = a.grid_values(values, stream)
    assert quantised.max() < 2**bits
    result = a.dequantise(quantised, stream).astype(np.float64)
    rounding = 2.0**-23 * np.abs(values.astype(np.float64)).max()
    assert (np.abs(result - values) <= 0.5 * grid.step * (1 + 1e-6) + rounding).all()


@pytest.mark.parametrize("bits", range(4, 17))
def test_octahedral_error_stays_below_its_bound(bits):
    vectors = np.random.default_rng(bits).normal(size=(20000, 3))
    vectors[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    result = a.octahedral_directions(a.octahedral(vectors, bits), bits).astype(np.float64)
    angles = 2 * np.arcsin(np.linalg.norm(result - vectors, axis=1) / 2)
    assert 0.5 * a.octahedral_bound(bits) < angles.max() <= a.octahedral_bound(bits) + 1e-6


def test_zero_normal_points_up():
    np.testing.assert_allclose(
        a.octahedral_directions(a.octahedral(np.zeros((1, 3)), 8), 8)[0], [0, 0, 1], atol=0.01
    )


@given(arrays.arrays(np.float32, (20, 4), elements=st.floats(0, 1, width=32)), st.integers(4, 16))
def test_weights_keep_their_sum(weights, bits):
    total = weights.sum(axis=1, dtype=np.float64)
    usable = total > 0.01
    normalised = (weights[usable] / total[usable, None]).astype(np.float32)
    first, second = a.quantise_weights([normalised[:, :2], normalised[:, 2:]], bits)
    quantised = np.concatenate([first, second], axis=1)
    assert (quantised.sum(axis=1) == 2**bits - 1).all()
    assert (quantised[normalised == 0] == 0).all()
    assert (np.abs(quantised - normalised.astype(np.float64) * (2**bits - 1)) <= 1.01).all()


def test_weights_that_do_not_sum_to_one_are_only_rounded():
    (result,) = a.quantise_weights([np.array([[0.5, 0.1, 0, 0]])], 8)
    assert result.tolist() == [[128, 26, 0, 0]] or result.tolist() == [[128, 25, 0, 0]]


def test_ordered_bits_are_lossless_and_ordered():
    values = np.array(
        [-np.inf, -1e30, -1.5, -1e-45, -0.0, 0.0, 1e-45, 1.5, 1e30, np.inf], np.float32
    )
    quantised = a.ordered_bits(values)
    assert (np.diff(quantised.astype(np.int64)) > 0).all()
    assert a.from_ordered_bits(quantised).tobytes() == values.tobytes()


@settings(max_examples=60)
@given(
    arrays.arrays(np.float32, (9, 3), elements=st.floats(-100, 100, width=32)),
    st.floats(0.001953125, 1, width=32),
)
def test_zero_deltas_stay_zero(values, step):
    values[::2] = 0
    stream = a._delta_grid("POSITION", bounds_of(values), step)
    quantised = a.quantise_columns(values, stream)
    assert (a.dequantise(quantised, stream)[::2] == 0).all()
    assert np.abs(a.dequantise(quantised, stream) - values).max() <= 0.5 * step * (1 + 1e-6) + 1e-5


def test_signed_integers_are_exact():
    values = np.array([[-32768, 5, 32767], [0, 1, 2], [7, 7, 7]], np.int16)
    stream = a._exact("POSITION", bounds_of(values))
    quantised = a.quantise_columns(values, stream)
    assert stream.bits == 16
    np.testing.assert_array_equal(
        a.to_accessor([a.dequantise(quantised, stream)], values.dtype), values
    )


def test_too_many_bits_are_refused():
    with pytest.raises(MeshletError, match="needs more than 24 bits"):
        a.position_grid(np.zeros(3), np.full(3, 100.0), 12, 1e-6)


@pytest.mark.parametrize("extent", [0.0, 1e-44, 6e38])
def test_extreme_extents_have_a_step(extent):
    grid = a.position_grid(np.zeros(3), np.array([extent, 0, 0]), 12, None)
    assert 0 < grid.step < np.inf


def test_streams_must_fill_the_accessor():
    streams = [a.Stream(a.GRID, 3, 12), a.Stream(a.OCT, 2, 8), a.Stream(a.SIGN, 1, 1)]
    assert list(a.streams_of(1, 4, streams)) == [1, 2]
    assert list(a.streams_of(1, 3, streams)) == [1]
    for first, components in ((0, 4), (1, 2), (2, 3), (3, 1)):
        with pytest.raises(ValueError):
            a.streams_of(first, components, streams)


def test_the_native_decoder_dequantises_alike():
    random = np.random.default_rng(3)
    positions = random.normal(size=(3, 3)).astype(np.float32)
    named = {
        "POSITION": positions,
        "NORMAL": positions[:, [1, 2, 0]],
        "TANGENT": np.array([[1, 0, 0, 1], [0, 1, 0, -1], [0, 0, -1, 1]], np.float32),
        "_RAW": random.normal(size=(3, 2)).astype(np.float32),
        "JOINTS_0": random.integers(0, 60000, (3, 4)).astype(np.uint16),
    }
    bounds = {name: bounds_of(values) for name, values in named.items()}
    grid = a.position_grid(*bounds["POSITION"], 12, None)
    plan = a.plan_streams(bounds, grid, a.Bits(), "here")
    quantised = plan.quantise(named)
    values = [quantised[s] for s in range(len(plan.streams))]
    triangles = np.array([[0, 1, 2]], np.uint32)
    blob, _ = _codec.encode(triangles, triangles[0], positions, plan.streams, values)
    _, integers = _codec.decode(blob)
    _, values = _codec.decode_values(blob)
    for stream, quantised, native in zip(plan.streams, integers, values):
        np.testing.assert_allclose(
            a.dequantise(quantised, stream),
            native,
            rtol=0,
            atol=2e-7 if stream.kind == a.OCT else 0,
        )
