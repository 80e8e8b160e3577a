"""Every way to decode on the GPU gives the integers of the C++ decoder, and bounds what malformed bytes can do."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT
from vulkan_scenes import require_vulkan

from gltf_ext import _codec
from gltf_ext.extension import require_compressed
from gltf_ext.importers import open_model

VECTORS = ROOT / "tests" / "vectors"
# Of the vectors; one for all, because each other one would be another compilation of the shaders. Teams of 8 and 16 hold the values of
# several meshlets, and have no room for many more components in the 32 KiB that a device may limit them to.
STREAMS, LANES = 5, 11
QUICK = ("single", "passes", "team32", "parallel")
FULL = ("team8", "team16")


@pytest.fixture(scope="module")
def device(request):
    require_vulkan(request)
    from vk_backend.device import Device

    with Device(validation=True) as device:
        yield device
        assert device.messages == []


@pytest.fixture(scope="module", params=[*QUICK, *(pytest.param(name, marks=pytest.mark.full) for name in FULL)])
def decoder(request, device):
    from vk_backend.decode import GpuDecoder

    return GpuDecoder(device, request.param, STREAMS, LANES)


def assert_same(decoded, blob: bytes) -> None:
    """What the GPU decoded is what C++ decodes, meshlet by meshlet."""
    expected = _codec.Decoder(blob)
    assert not decoded.errors.any()
    for m in range(expected.meshlet_count):
        triangles, streams = expected.decode_meshlet(m)
        vertices = len(streams[0])
        assert (decoded.triangle_counts[m], decoded.vertex_counts[m]) == (len(triangles), vertices), m
        packed = decoded.triangles[m, : len(triangles)]
        assert np.array_equal(np.stack([packed & 255, packed >> 8 & 255, packed >> 16 & 255], axis=1), triangles), m
        assert np.array_equal(decoded.integers[m, :, :vertices], np.concatenate(streams, axis=1).T), m


def assert_bounded(decoded) -> None:
    """Whatever the bytes were: counts fit a meshlet, and the triangles of those that decoded name its vertices."""
    sound = decoded.errors == 0
    assert (decoded.triangle_counts[sound] <= 64).all() and (decoded.vertex_counts[sound] <= 64).all()
    for m in np.flatnonzero(sound):
        packed = decoded.triangles[m, : decoded.triangle_counts[m]]
        corners = np.stack([packed & 255, packed >> 8 & 255, packed >> 16 & 255])
        assert (corners < max(decoded.vertex_counts[m], 1)).all()


def malformed_meshlets(blob: bytes) -> np.ndarray:
    """bool[meshlets]: those that the C++ decoder refuses."""
    decoder = _codec.Decoder(blob)
    refused = np.zeros(decoder.meshlet_count, bool)
    for m in range(decoder.meshlet_count):
        try:
            decoder.decode_meshlet(m)
        except ValueError:
            refused[m] = True
    return refused


def test_conformance_vectors(decoder):
    for path in sorted(VECTORS.glob("valid_*.bin")):
        blob = path.read_bytes()
        assert_same(decoder.decode(blob), blob)


def test_malformed_vectors(decoder):
    tried = 0
    for path in sorted(VECTORS.glob("malformed_*.bin")):
        blob = path.read_bytes()
        try:
            refused = malformed_meshlets(blob)
        except ValueError:  # already its header
            continue
        decoded = decoder.decode(blob)
        assert_bounded(decoded)
        assert (decoded.errors[refused] != 0).all(), path.name
        tried += 1
    assert tried > 10


def test_mutated_bytes(decoder):
    blob = (VECTORS / "valid_seams_between_meshlets.bin").read_bytes()
    data = int.from_bytes(blob[24:28], "little")
    random = np.random.default_rng(7)
    for _ in range(150):
        mutated = np.frombuffer(blob, np.uint8).copy()
        for place in random.integers(data, len(blob) - 8, random.integers(1, 6)):
            mutated[place] ^= 1 << random.integers(8)
        mutated = mutated.tobytes()
        decoded = decoder.decode(mutated)
        assert_bounded(decoded)
        refused = malformed_meshlets(mutated)
        assert (decoded.errors[refused] != 0).all()


def test_too_many_streams(device):
    from vk_backend.decode import GpuDecoder

    blob = (VECTORS / "valid_worked_example.bin").read_bytes()
    with pytest.raises(ValueError, match="there is room for"):
        GpuDecoder(device, "single", 1, 11).decode(blob)


@pytest.mark.parametrize("name", ["bunny", pytest.param("all", marks=pytest.mark.full)])
def test_real_models(device, model, tmp_path, name):
    import gltf_ext
    from vk_backend.decode import GpuDecoder

    names = ["suzanne", "materialball", "beast", "chinesedragon", "igea", "engine", "sponza_like", "bistro_like", "DamagedHelmet", "dragon"]
    decoder = GpuDecoder(device, "passes", 8, 20)
    for item in names if name == "all" else [name]:
        gltf_ext.compress(model(f"{item}.glb"), tmp_path / f"{item}.glb")
        for primitive in require_compressed(open_model(tmp_path / f"{item}.glb")):
            assert_same(decoder.decode(primitive.blob), primitive.blob)
