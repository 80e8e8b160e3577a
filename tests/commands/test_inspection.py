"""compress reports what inspect finds in its output, without decoding that output."""

import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.attributes.records import RecordFormat
from gltf_ext.attributes.streams import Bits, position_grid
from gltf_ext.sources.source import Source
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, grid_mesh


@pytest.fixture
def original(tmp_path):
    """Every kind of attribute, a mesh without seams, one used three times, and a triangle soup."""
    builder = Builder()
    attributes, triangles, targets = everything()
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    positions, plain = grid_mesh(30, 40)
    builder.mesh({"POSITION": positions}, plain)
    shared, indices = builder.accessor(positions * 2), builder.accessor(plain.reshape(-1, 1))
    for _ in range(3):
        builder.mesh({"POSITION": shared}, indices)
    # Many disks per meshlet, each with private vertices only.
    soup = positions[plain[:90]].reshape(-1, 3) + 0.001
    builder.mesh({"POSITION": soup[::-1].copy(), "NORMAL": soup})
    return builder.write(tmp_path / "in.glb")


@pytest.mark.parametrize(
    "options", [{}, {"fallback": True}, {"grid": "scene", "max_triangles": 16, "position_bits": 20}]
)
def test_compress_reports_what_inspect_finds(original, tmp_path, options):
    output = tmp_path / "out.glb"
    report = gltf_ext.compress(original, output, **options)
    found = gltf_ext.inspect(output)
    assert {name: report[name] for name in ("totals", "fallback_files", "primitives")} == {
        name: found[name] for name in ("totals", "fallback_files", "primitives")
    }
    assert found["file_bytes"] == report["output_bytes"]


def test_compress_does_not_decode(original, tmp_path, monkeypatch):
    def fail(*_):
        raise AssertionError("compress decodes its output")

    for name in ("describe", "decode", "decode_values", "validate"):
        monkeypatch.setattr(_codec, name, fail)
    assert gltf_ext.compress(original, tmp_path / "out.glb")["totals"]["triangles"] > 0


def test_the_encoders_statistics_are_those_of_the_blob(original):
    for loaded in gltf_ext.load(original):
        source = Source.of(loaded)
        source.read_bounds()
        form = RecordFormat.of(source, position_grid(*source.box, 14, None), Bits())
        vertices = form.vertices_of(form.triangles_of(source))
        blob, statistics = _codec.encode(*form.encoder_input_of(vertices))
        assert statistics.pop("generation")
        assert statistics == _codec.describe(blob)
