"""Views of several blobs: the reference decoder and the codec agree."""

import struct

import numpy as np
import pytest

from gltf_ext import _codec
from spec import make_vectors
from spec.reference_decoder import decode_blob, decode_view, split_view

# Blobs of equal streams, and the header's byte length.
ONE = make_vectors.committed("several_groups")
BYTE_LENGTH = 20


def assert_agree(view):
    expected = decode_view(view)
    triangles, values = _codec.decode(view)
    np.testing.assert_array_equal(triangles, expected.triangles)
    for ours, theirs in zip(values, expected.values, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    return expected


def test_blobs_of_a_view_follow_one_another():
    found = assert_agree(ONE + ONE)
    alone = decode_blob(ONE)
    count = len(alone.values[0])
    assert len(found.values[0]) == 2 * count
    np.testing.assert_array_equal(found.triangles[len(alone.triangles) :], alone.triangles + count)


def test_the_blobs_are_split_alike():
    view = ONE + ONE + ONE
    sizes = [len(blob) for blob in split_view(view)]
    assert sizes == [size for _, size in _codec.split(view)] == [len(ONE)] * 3


@pytest.mark.parametrize(
    "view",
    [
        ONE + make_vectors.committed("seams_between_meshlets"),
        ONE + b"more",
        ONE + ONE[:-4],
        ONE[:BYTE_LENGTH] + struct.pack("<I", len(ONE) - 4) + ONE[BYTE_LENGTH + 4 :] + ONE,
    ],
    ids=["other streams", "trailing bytes", "cut off", "a length too short"],
)
def test_malformed_views_are_refused(view):
    with pytest.raises(ValueError):
        decode_view(view)
    with pytest.raises(ValueError):
        _codec.decode(view)
