"""_codec.read_header and the stage times of _codec.encode."""

import numpy as np
import pytest

from gltf_ext import _codec
from tests.helpers.environment import ROOT

VECTORS = sorted((ROOT / "spec" / "vectors").glob("valid_*.bin"))


def test_header_agrees_with_the_decoder():
    blobs = [path.read_bytes() for path in VECTORS]
    assert blobs
    for blob in blobs:
        header, decoder = _codec.read_header(blob), _codec.Decoder(blob)
        assert header.triangle_count == decoder.triangle_count
        assert header.vertex_count == decoder.vertex_count
        assert header.meshlet_count == decoder.meshlet_count
        sizes = [len(decoder.decode_meshlet(m)[0]) for m in range(header.meshlet_count)]
        assert header.meshlet_triangles.dtype == np.uint32
        assert header.meshlet_triangles.tolist() == sizes
        for stream, row in zip(header.streams, decoder.streams):
            assert (stream.kind, stream.elements, stream.bits, stream.predictor, stream.step) == (
                row["kind"],
                row["components"],
                row["bits"],
                row["predictor"],
                row["step"],
            )
            assert stream.offset == row["offset"]
            assert len(stream.offset) == stream.elements


def test_header_of_a_damaged_blob():
    with pytest.raises(ValueError, match="does not begin with EBM1"):
        _codec.read_header(bytes(64))


@pytest.mark.parametrize(
    "wrong, problem",
    [
        ({"kind": 256}, "'kind' is not an integer from 0 to 255"),
        ({"bits": 288}, "'bits' is not an integer from 0 to 255"),
        ({"bits": -1}, "'bits' is not an integer from 0 to 255"),
        ({"components": 257}, "'components' is not an integer from 0 to 255"),
        ({"predictor": 256 + _codec.PREDICT_COPY}, "'predictor' is not an integer from -1 to 255"),
        ({"predictor": -2}, "'predictor' is not an integer from -1 to 255"),
        ({"kind": 10**400}, "'kind' is not an integer from 0 to 255"),
        ({"kind": "0"}, "'kind' is not an integer from 0 to 255"),
        ({"step": "1"}, "step or offset is not a number"),
        ({"offset": [0] * 5}, "more than 4 offsets"),
    ],
)
def test_numbers_of_a_stream_are_checked(wrong, problem):
    """They are not cut to the bytes that a blob stores."""
    triangles, positions = np.array([[0, 1, 2]], np.uint32), np.eye(3, dtype=np.float32)
    stream = {"kind": _codec.KIND_INTEGER, "components": 1, "bits": 1, "step": 1.0, "offset": [0]}
    values = [np.array([[0], [1], [0]], np.uint32)]
    with pytest.raises(ValueError, match=problem):
        _codec.encode(triangles, triangles[0], positions, [{**stream, **wrong}], values)
