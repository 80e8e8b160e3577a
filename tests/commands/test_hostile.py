"""Damaged files: every truncation and many mutations succeed or raise MeshletError."""

import json
import random
import re
import struct

import pytest

import gltf_ext
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, glb_bytes, grid_mesh

TOKEN = re.compile(r'(?<=[:\[, ])(-?\d+(?:\.\d+)?(?:e-?\d+)?(?=[,\]}])|"[^"]*"|true|false)(?!\s*:)')
REPLACEMENTS = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "7",
    "100",
    "65536",
    "4294967295",
    "4294967296",
    "1e30",
    "1.5",
    "null",
    "true",
    '"x"',
    "[]",
    "{}",
    "99999999999999999999",
    "5121",
    "5123",
    "5126",
    "4",
    "6",
    '"VEC2"',
    '"MAT4"',
]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """(original, compressed) as bytes of a tiny model and of one with every attribute."""
    folder = tmp_path_factory.mktemp("hostile")
    positions, triangles = grid_mesh(3, 3)
    tiny = Builder()
    tiny.mesh({"POSITION": positions}, triangles)
    rich = Builder()
    attributes, triangles, targets = everything(2, 4, 4)
    rich.mesh(attributes, triangles, targets, NORMALIZED)
    rich.properties["animations"] = [{"channels": [], "samplers": [{"input": 0, "output": 0}]}]
    rich.properties["nodes"][0]["extensions"] = {
        "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}
    }
    data = []
    for name, builder in (("tiny", tiny), ("rich", rich)):
        original = builder.write(folder / f"{name}.glb")
        gltf_ext.compress(original, folder / "out.glb")
        data.append((original.read_bytes(), (folder / "out.glb").read_bytes()))
    return data


def try_everything(path, out, original):
    runs = [
        lambda: gltf_ext.compress(path, out),
        lambda: gltf_ext.decompress(path, out),
        lambda: gltf_ext.inspect(path),
        lambda: gltf_ext.load(path),
        lambda: gltf_ext.validate(path),
        lambda: gltf_ext.verify(original, path),
        lambda: gltf_ext.verify(path, original),
        lambda: [
            d.decode_meshlet(i)
            for d in gltf_ext.decoders(path)
            for i in range(min(d.meshlet_count, 5))
        ],
    ]
    succeeded = 0
    for run in runs:
        try:
            run()
            succeeded += 1
        except gltf_ext.MeshletError as error:
            assert "\n" not in str(error)
    return succeeded


def test_every_truncation(files, tmp_path):
    for data in files[0]:
        (tmp_path / "whole.glb").write_bytes(data)
        for length in range(len(data)):
            (tmp_path / "cut.glb").write_bytes(data[:length])
            assert (
                try_everything(tmp_path / "cut.glb", tmp_path / "out.glb", tmp_path / "whole.glb")
                <= 1
            ), "only validate may succeed"
            assert gltf_ext.validate(tmp_path / "cut.glb")


def flipped(data, rng):
    damaged = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8])):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def other_json(data, rng):
    """One JSON value replaced by another of any type."""
    length = struct.unpack_from("<I", data, 12)[0]
    text = data[20 : 20 + length].decode()
    token = rng.choice(list(TOKEN.finditer(text)))
    text = text[: token.start()] + rng.choice(REPLACEMENTS) + text[token.end() :]
    return glb_bytes(json.loads(text), data[28 + length :])


@pytest.mark.parametrize("damage", [flipped, other_json])
@pytest.mark.parametrize("seed", range(4))
def test_mutations(files, tmp_path, damage, seed):
    rng = random.Random(seed)
    for _ in range(150):
        original, compressed = rng.choice(files)
        (tmp_path / "whole.glb").write_bytes(rng.choice([original, compressed]))
        (tmp_path / "damaged.glb").write_bytes(damage(rng.choice([original, compressed]), rng))
        try_everything(tmp_path / "damaged.glb", tmp_path / "out.glb", tmp_path / "whole.glb")


@pytest.mark.parametrize(
    ("version", "remedy"),
    [(1, "with the last commit of the draft, which CHANGELOG.md names"), (3, "newer release")],
)
def test_other_versions_are_not_called_damaged(files, tmp_path, version, remedy):
    (_, compressed), *_ = files
    at = compressed.index(b"EBM1") + 4
    path = tmp_path / "other.glb"
    path.write_bytes(compressed[:at] + bytes([version]) + compressed[at + 1 :])
    for read in (gltf_ext.load, lambda path: gltf_ext.decompress(path, tmp_path / "out.glb")):
        with pytest.raises(gltf_ext.MeshletError, match=remedy) as error:
            read(path)
        assert "damaged" not in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize("count", [2**24 + 1, 2**31, 2**40])
def test_counts_without_bytes_allocate_nothing(tmp_path, count):
    properties = {
        "asset": {"version": "2.0"},
        "accessors": [{"componentType": 5126, "count": count, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    (tmp_path / "in.glb").write_bytes(glb_bytes(properties, b""))
    with pytest.raises(gltf_ext.MeshletError, match="but no bytes"):
        gltf_ext.compress(tmp_path / "in.glb", tmp_path / "out.glb")
