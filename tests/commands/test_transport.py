"""compress --transport, transcode: packed files read like others and come back byte for byte."""

import struct
from itertools import pairwise

import numpy as np
import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.document.transport import TRANSPORT
from gltf_meshlet import cli
from spec.make_lod_vectors import FOLDER as LOD_VECTORS
from tests.helpers.gltf_builder import glb_bytes, glb_json, write_everything


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same model plain, compressed and packed."""
    folder = tmp_path_factory.mktemp("transport")
    plain = write_everything(folder / "plain.glb")
    gltf_ext.compress(plain, folder / "compressed.glb")
    gltf_ext.compress(plain, folder / "packed.glb", transport=True)
    return folder


def equal(first, second):
    return first.read_bytes() == second.read_bytes()


def change(path, output, edit):
    """A copy of a .glb with a changed JSON."""
    properties, data = glb_json(path), path.read_bytes()
    edit(properties)
    output.write_bytes(glb_bytes(properties, data[data.index(b"BIN\0") + 4 :]))
    return output


def test_packed_files_are_smaller_and_declared(files):
    properties = glb_json(files / "packed.glb")
    assert (files / "packed.glb").stat().st_size < (files / "compressed.glb").stat().st_size
    assert TRANSPORT in properties["extensionsRequired"]
    assert any(TRANSPORT in view.get("extensions", {}) for view in properties["bufferViews"])


def test_readers_see_no_difference(files):
    packed, compressed = files / "packed.glb", files / "compressed.glb"
    for a, b in zip(gltf_ext.load(packed), gltf_ext.load(compressed), strict=True):
        assert np.array_equal(a.indices, b.indices)
        for name, values in a.attributes.items():
            assert np.array_equal(values, b.attributes[name])
    assert gltf_ext.validate(packed) == []
    assert gltf_ext.verify(files / "plain.glb", packed)["ok"]
    assert gltf_ext.inspect(packed)["totals"] == gltf_ext.inspect(compressed)["totals"]
    for path in (packed, compressed):
        gltf_ext.decompress(path, files / f"{path.stem}.plain.glb")
    assert equal(files / "packed.plain.glb", files / "compressed.plain.glb")


def test_transcode_keeps_a_fallback_beside_the_file(tmp_path):
    folders = [tmp_path / name for name in ("plain", "packed", "again")]
    for folder in folders:
        folder.mkdir()
    plain = write_everything(tmp_path / "in.glb")
    gltf_ext.compress(plain, folders[0] / "a.glb", fallback=True)
    for folder, next_folder in pairwise(folders):
        gltf_ext.transcode(folder / "a.glb", next_folder / "a.glb")
    for folder in folders[1:]:
        assert equal(folders[0] / "a.fallback.bin", folder / "a.fallback.bin")
        assert gltf_ext.validate(folder / "a.glb") == []
    assert not equal(folders[0] / "a.glb", folders[1] / "a.glb")
    assert equal(folders[0] / "a.glb", folders[2] / "a.glb")


def test_transcode_both_ways_gives_the_same_bytes(files, capsys):
    assert cli.main(["transcode", str(files / "compressed.glb"), str(files / "a.glb")]) == 0
    assert equal(files / "a.glb", files / "packed.glb")
    assert cli.main(["transcode", str(files / "a.glb"), str(files / "b.glb")]) == 0
    assert equal(files / "b.glb", files / "compressed.glb")
    assert [line.rsplit(" ")[-1] for line in capsys.readouterr().out.splitlines()] == [
        "packed",
        "unpacked",
    ]


@pytest.mark.parametrize("name", ["lod_sheet", "lod_streams", "lod_touching_spheres"])
def test_levels_of_detail(name, tmp_path):
    source = LOD_VECTORS / f"{name}.glb"
    outputs = [tmp_path / f"{i}.glb" for i in range(3)]
    for before, after in zip([source, *outputs], outputs):
        gltf_ext.transcode(before, after)
        assert gltf_ext.validate(after) == []
        assert gltf_ext.inspect(after)["lod"] == gltf_ext.inspect(source)["lod"]
    assert equal(outputs[0], outputs[2])


def test_damaged_files_give_one_line(files, tmp_path):
    def longer(properties):
        for view in properties["bufferViews"]:
            if TRANSPORT in view.get("extensions", {}):
                view["extensions"][TRANSPORT]["byteLength"] += 4

    path = change(files / "packed.glb", tmp_path / "longer.glb", longer)
    with pytest.raises(gltf_ext.MeshletError, match=r"bufferView \d: .*does not say that"):
        gltf_ext.load(path)
    data = bytearray((files / "packed.glb").read_bytes())
    view = next(v for v in glb_json(files / "packed.glb")["bufferViews"] if v.get("extensions"))
    begin = data.index(b"BIN\0") + 4 + view.get("byteOffset", 0)
    data[begin + 100] ^= 16
    damaged = tmp_path / "damaged.glb"
    damaged.write_bytes(data)
    assert cli.main(["validate", str(damaged)]) == 2
    with pytest.raises(gltf_ext.MeshletError, match=r"^[^\n]+$"):
        gltf_ext.load(damaged)


@pytest.mark.parametrize("view", [None, "1", {}, [], True, 2.5, 99])
def test_levels_in_no_buffer_view_are_refused(tmp_path, view):
    def edit(properties):
        (primitive,) = (p for mesh in properties["meshes"] for p in mesh["primitives"])
        primitive["extensions"]["EXT_meshlet_lod"]["pages"]["bufferView"] = view

    damaged = change(LOD_VECTORS / "lod_strip.glb", tmp_path / "damaged.glb", edit)
    with pytest.raises(gltf_ext.MeshletError, match=r"bufferView .* does not exist"):
        gltf_ext.transcode(damaged, tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize("by", [0, 4])
def test_pages_that_are_not_blobs_are_refused(tmp_path, by):
    """Raw pages, of which the first one ends `by` bytes late: all bytes of the view are those of
    its blobs, but a reader of single pages would not find them."""
    properties, (source, blobs) = glb_json(LOD_VECTORS / "lod_levels.glb"), level_0_of_the_vector()
    first, second = (len(blob) for blob in blobs)
    table = struct.pack("<5I", 1 | 2 << 8, first + by, 0, second - by, 0)
    view = properties["bufferViews"][2]
    view["extensions"] = {TRANSPORT: {"byteLength": first + second}}
    view["byteLength"] += len(table)
    properties["buffers"][0]["byteLength"] += len(table)
    for names in ("extensionsUsed", "extensionsRequired"):
        properties[names].append(TRANSPORT)
    path = tmp_path / "raw.glb"
    begin = view["byteOffset"]
    path.write_bytes(glb_bytes(properties, source[:begin] + table + source[begin:]))
    if by == 0:
        assert gltf_ext.validate(path) == []
    else:
        assert len(gltf_ext.validate(path)) == 1
        with pytest.raises(gltf_ext.MeshletError, match="are not its blobs"):
            gltf_ext.load(path)


def level_0_of_the_vector():
    """(the binary chunk of lod_levels.glb, the blobs of its last view, which are level 0)."""
    data = (LOD_VECTORS / "lod_levels.glb").read_bytes()
    source = data[data.index(b"BIN\0") + 4 :]
    view = source[glb_json(LOD_VECTORS / "lod_levels.glb")["bufferViews"][2]["byteOffset"] :]
    return source, [view[begin : begin + size] for begin, size in _codec.split(view)]


def test_transport_needs_the_whole_model_in_memory(files):
    with pytest.raises(gltf_ext.MeshletError, match="transport needs the whole model"):
        gltf_ext.compress(files / "plain.glb", files / "x.glb", transport=True, max_memory="1G")


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda p: p["extensionsUsed"].remove(TRANSPORT), "extensionsUsed lacks"),
        (lambda p: p["extensionsRequired"].remove(TRANSPORT), "extensionsRequired lacks"),
        (lambda p: p.setdefault("images", []).append(image_of(p)), "something else refers to it"),
        (lambda p: without_users(p), "is packed, but no"),
    ],
)
def test_validate_finds_broken_rules(files, tmp_path, edit, words):
    broken = change(files / "packed.glb", tmp_path / "broken.glb", edit)
    assert any(words in problem for problem in gltf_ext.validate(broken))


def packed_view(properties):
    views = enumerate(properties["bufferViews"])
    return next(i for i, view in views if TRANSPORT in view.get("extensions", {}))


def image_of(properties):
    return {"bufferView": packed_view(properties), "mimeType": "image/png"}


def without_users(properties):
    view = packed_view(properties)
    for mesh in properties["meshes"]:
        for primitive in mesh["primitives"]:
            extensions = primitive.get("extensions", {})
            if extensions.get("EXT_meshlet_edgebreaker", {}).get("bufferView") == view:
                del extensions["EXT_meshlet_edgebreaker"]
