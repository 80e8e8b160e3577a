"""_codec.Header, and the checks of streams."""

from dataclasses import replace

import numpy as np
import pytest

from gltf_ext import _codec
from tests.helpers.environment import ROOT

VECTORS = sorted((ROOT / "spec" / "vectors").glob("valid_*.bin"))


def test_header_agrees_with_the_decoder():
    blobs = [path.read_bytes() for path in VECTORS]
    assert blobs
    for blob in blobs:
        header, decoder = _codec.Header(blob), _codec.Decoder(blob)
        assert header.triangle_count == decoder.triangle_count
        assert header.vertex_count == decoder.vertex_count
        assert header.meshlet_count == decoder.meshlet_count
        sizes = [len(decoder.decode_meshlet(m)[0]) for m in range(header.meshlet_count)]
        assert header.meshlet_triangles.dtype == np.uint32
        assert header.meshlet_triangles.tolist() == sizes


def test_header_of_a_damaged_blob():
    with pytest.raises(ValueError, match="does not begin with EBM1"):
        _codec.Header(bytes(64))


@pytest.mark.parametrize(
    "wrong, problem",
    [
        ({"kind": 256}, "number that is not from -1 to 254"),
        ({"kind": -1}, "kind"),
        ({"kind": 10**400}, "number that is not from -1 to 254"),
        ({"bits": 288}, "number that is not from -1 to 254"),
        ({"bits": -1}, "bits"),
        ({"elements": 257}, "shape"),
        ({"predictor": 256 + _codec.PREDICT_COPY}, "number that is not from -1 to 254"),
        ({"predictor": -2}, "number that is not from -1 to 254"),
        ({"offset": (0.0,) * 5}, "more than 4 offsets"),
    ],
)
def test_numbers_of_a_stream_are_checked(wrong, problem):
    """They are not cut to the bytes that a blob stores."""
    with pytest.raises(ValueError, match=problem):
        encode_triangle(replace(STREAM, **wrong))


@pytest.mark.parametrize("wrong", [{"kind": "0"}, {"bits": 1.0}, {"step": "1"}, {"offset": "1"}])
def test_types_of_a_stream_are_checked(wrong):
    with pytest.raises(TypeError):
        encode_triangle(replace(STREAM, **wrong))


STREAM = _codec.Stream(_codec.KIND_INTEGER, 1, 1, 1.0)


def encode_triangle(stream: _codec.Stream) -> None:
    triangles, positions = np.array([[0, 1, 2]], np.uint32), np.eye(3, dtype=np.float32)
    values = [np.array([[0], [1], [0]], np.uint32)]
    _codec.encode(triangles, triangles[0], positions, [stream], values)
