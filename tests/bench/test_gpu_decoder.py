"""The GPU decoders give the integers of the C++ decoder, and survive malformed bytes."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from gltf_ext import _codec
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from spec import blob_writer
from spec.blob_writer import AFFINE, COPY, GEO, GRID, INTEGER, OCT, Stream
from tests.helpers.environment import ROOT
from tests.helpers.long_blobs import MAX_BYTES, stretched
from tests.helpers.vulkan_scenes import require_vulkan

VECTORS = ROOT / "spec" / "vectors"
# Capacities that fit all vectors but the one of 64 streams (test_streams_of_every_shape has as
# many): other ones would compile the shaders again. ELEMENTS cannot be much larger: workgroups with
# teams of 8 or 16 hold the values of several meshlets, in 32 KiB.
STREAMS = 6
ELEMENTS = 15
WIDE = VECTORS / "valid_64_streams.bin"
VALID = sorted(set(VECTORS.glob("valid_*.bin")) - {WIDE})
METHODS = ("serial", "team", "parallel", "interior", "traversal")


@pytest.fixture(scope="module")
def device(request):
    require_vulkan()
    from vk_backend.gpu.device import Device

    with Device(validation=True) as device:
        yield device
        assert device.messages == []


@pytest.fixture(scope="module", params=METHODS)
def decoder(request, device):
    from bench.gpu_decoder import GpuDecoder

    return GpuDecoder(device, request.param, STREAMS, ELEMENTS)


def assert_same(decoded, blob: bytes) -> None:
    """Checks that every meshlet is well formed and the same as C++ decodes it."""
    assert assert_agreement(decoded, blob) == 0


def assert_agreement(decoded, blob: bytes) -> int:
    """Checks that the GPU rejects the same meshlets as C++ and decodes the others to the same.

    Returns the number of rejected meshlets.
    """
    expected = _codec.Decoder(blob)
    refused = 0
    for m in range(expected.meshlet_count):
        try:
            triangles, streams = expected.decode_meshlet(m)
        except ValueError:
            refused += 1
            assert decoded.errors[m] != 0, m
            continue
        assert decoded.errors[m] == 0, m
        vertices = len(streams[0])
        assert (decoded.triangle_counts[m], decoded.vertex_counts[m]) == (
            len(triangles),
            vertices,
        ), m
        packed = decoded.triangles[m, : len(triangles)]
        assert np.array_equal(
            np.stack([packed & 255, packed >> 8 & 255, packed >> 16 & 255], axis=1), triangles
        ), m
        assert np.array_equal(
            decoded.integers[m, :, :vertices], np.concatenate(streams, axis=1).T
        ), m
    return refused


def assert_bounded(decoded) -> None:
    """Checks that counts fit a meshlet and that triangles use its vertices, for any bytes."""
    sound = decoded.errors == 0
    assert (decoded.triangle_counts[sound] <= 64).all() and (
        decoded.vertex_counts[sound] <= 64
    ).all()
    for m in np.flatnonzero(sound):
        packed = decoded.triangles[m, : decoded.triangle_counts[m]]
        corners = np.stack([packed & 255, packed >> 8 & 255, packed >> 16 & 255])
        assert (corners < max(decoded.vertex_counts[m], 1)).all()


def has_sound_tables(blob: bytes) -> bool:
    try:
        _codec.Decoder(blob)
    except ValueError:
        return False
    return True


def test_conformance_vectors(decoder):
    for path in VALID:
        blob = path.read_bytes()
        assert_same(decoder.decode(blob), blob)


@pytest.mark.parametrize("decoder", ["serial", "traversal"], indirect=True)  # the others are alike
def test_longest_blob(decoder):
    """Its positions of bits nearly need 33 bits."""
    small = (VECTORS / "valid_worked_example.bin").read_bytes()
    blob = bytes(stretched(small, MAX_BYTES).bytes)
    assert_same(decoder.decode(blob), blob)


def test_malformed_vectors(decoder):
    tried = 0
    for path in sorted(VECTORS.glob("malformed_*.bin")):
        blob = path.read_bytes()
        if not has_sound_tables(blob):
            continue
        decoded = decoder.decode(blob)
        assert_bounded(decoded)
        assert_agreement(decoded, blob)
        tried += 1
    assert tried > 10


@pytest.mark.parametrize("tables", [False, True], ids=["data", "tables and data"])
def test_mutated_bytes(decoder, tables):
    """Flips bits after the stream table, or only in the meshlets' data, of all valid vectors."""
    random = np.random.default_rng(7)
    refused = tried = 0
    for path in VALID:
        blob = path.read_bytes()
        first = 32 + 28 * blob[5] if tables else int.from_bytes(blob[24:28], "little")
        for _ in range(15):
            mutated = bytearray(blob)
            for place in random.integers(first, len(blob) - 8, random.integers(1, 6)):
                mutated[place] ^= 1 << int(random.integers(8))
            if has_sound_tables(bytes(mutated)):
                decoded = decoder.decode(bytes(mutated))
                assert_bounded(decoded)
                refused += assert_agreement(decoded, bytes(mutated))
                tried += 1
    assert tried > 100 and refused > 20


# The largest number of streams, and values that take one word, two, or more, or cross words.
SHAPES = {
    "64 streams": [
        Stream(bits=24),
        *(Stream(INTEGER, 1, 1 + s % 32, COPY if s % 32 > 23 else s % 4) for s in range(63)),
    ],
    "wide": [
        Stream(GRID, 4, 9),
        *(
            Stream(INTEGER, n, bits, COPY)
            for n, bits in (
                (4, 32),
                (4, 20),
                (4, 16),
                (3, 22),
                (3, 21),
                (2, 32),
                (2, 31),
                (2, 16),
                (1, 32),
            )
        ),
    ],
}


def sound_meshlets(decoder, monkeypatch, streams, seed, meshlets):
    """The number of well-formed meshlets in four random blobs, whose values must agree."""
    monkeypatch.setattr(blob_writer, "random_streams", lambda rng: streams)
    random, sound = Random(seed), 0
    for _ in range(4):
        blob = blob_writer.random_blob(random, meshlets)  # rejected if a corner takes too many hops
        sound += meshlets - assert_agreement(decoder.decode(blob), blob)
    return sound


@pytest.mark.parametrize("method", ["interior", "traversal"])
@pytest.mark.parametrize("name", SHAPES)
def test_streams_of_every_shape(device, monkeypatch, name, method):
    """The bulk passes pack values into words."""
    from bench.gpu_decoder import GpuDecoder

    streams = SHAPES[name]
    decoder = GpuDecoder(device, method, len(streams), sum(s.elements for s in streams))
    assert sound_meshlets(decoder, monkeypatch, streams, 1, 12) > 20


def test_streams_predicted_from_positions(decoder, monkeypatch):
    """Two AFFINE streams may share different runs with their neighbours."""
    streams = [
        Stream(GRID, 3, 11),
        Stream(INTEGER, 2, 12, AFFINE),
        Stream(OCT, 2, 8, GEO),
        Stream(INTEGER, 1, 9, AFFINE),
        Stream(OCT, 2, 10, GEO),
    ]
    assert sound_meshlets(decoder, monkeypatch, streams, 5, 24) > 60


def test_seams_without_affine_streams(decoder, monkeypatch):
    """Normals may have seams where positions have none."""
    streams = [Stream(GRID, 3, 11), Stream(OCT, 2, 8, GEO), Stream(INTEGER, 3, 9)]
    assert sound_meshlets(decoder, monkeypatch, streams, 6, 24) > 60


def test_too_many_elements_for_shared_memory(device):
    from bench.gpu_decoder import GpuDecoder
    from vk_backend.gpu.errors import VulkanError

    with pytest.raises(VulkanError, match="too many for the decoder team"):
        GpuDecoder(device, "team", 64, 256 * device.limits.compute_shared_bytes)


def test_too_many_streams(device):
    from bench.gpu_decoder import GpuDecoder

    blob = (VECTORS / "valid_worked_example.bin").read_bytes()
    with pytest.raises(ValueError, match="there is room for"):
        GpuDecoder(device, "serial", 1, 11).decode(blob)


@pytest.mark.parametrize("name", ["bunny", pytest.param("all", marks=pytest.mark.full)])
def test_real_models(device, model, tmp_path, name):
    import gltf_ext
    from bench.gpu_decoder import GpuDecoder

    names = [
        "suzanne",
        "materialball",
        "beast",
        "chinesedragon",
        "igea",
        "engine",
        "sponza_like",
        "bistro_like",
        "DamagedHelmet",
        "dragon",
    ]
    decoder = GpuDecoder(device, "traversal", 8, 20)
    for item in names if name == "all" else [name]:
        gltf_ext.compress(model(f"{item}.glb"), tmp_path / f"{item}.glb")
        for primitive in require_compressed(open_model(tmp_path / f"{item}.glb")):
            assert_same(decoder.decode(primitive.blob), primitive.blob)
