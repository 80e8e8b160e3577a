"""Files with pages: compress --page-bytes, and every reader of a compressed primitive."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.attributes.extension import compressed_primitives
from gltf_ext.options import DEFAULT_PAGE_BYTES, MOST_TRIANGLES_UNPAGED
from gltf_ext.sources.importers import open_model
from gltf_meshlet.cli import main
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, grid_mesh

PAGE = 16384


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """(original, one blob, pages): a sheet with every kind of attribute, and a small one."""
    folder = tmp_path_factory.mktemp("pages")
    attributes, triangles, targets = everything(columns=70, rows=50)
    builder = Builder()
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    positions, small = grid_mesh(5, 4)
    builder.mesh({"POSITION": positions}, small)
    builder.properties["nodes"] = [{"mesh": 0}, {"mesh": 1}]
    builder.properties["scenes"] = [{"nodes": [0, 1]}]
    original = builder.write(folder / "in.glb")
    gltf_ext.compress(original, folder / "one.glb")
    gltf_ext.compress(original, folder / "pages.glb", page_bytes=PAGE)
    return original, folder / "one.glb", folder / "pages.glb"


def views(path):
    return [compressed.blob for compressed in compressed_primitives(open_model(path))]


def corners(primitive: gltf_ext.Primitive) -> np.ndarray:
    """Sorted rows: all bytes of a triangle's corners, from the smallest corner on."""
    columns = [np.ascontiguousarray(values) for _, values in primitive.arrays]
    rows = [c.view(np.uint8).reshape(len(c), -1) for c in columns]
    ids = _codec.weld(np.ascontiguousarray(np.concatenate(rows, axis=1)))[0]
    found = ids[primitive.indices]
    data = np.concatenate(rows, axis=1)
    triangles = [min(tuple(np.roll(data[t], k, axis=0).ravel()) for k in range(3)) for t in
                 primitive.indices]  # fmt: skip
    assert len(found) == len(triangles)
    return np.array(sorted(triangles))


def test_pages_hold_the_same_triangles(files):
    for one, pages in zip(gltf_ext.load(files[1]), gltf_ext.load(files[2])):
        np.testing.assert_array_equal(corners(one), corners(pages))


def test_pages_are_full(files):
    for view in views(files[2]):
        sizes = [size for _, size in _codec.split(view)]
        # A meshlet of this sheet, with all its attributes, takes almost a third of a page.
        assert max(sizes) <= PAGE and sum(sizes) == len(view)
        assert all(size + 5200 > PAGE for size in sizes[:-1])


def test_valid_and_equal_to_the_source(files):
    original, _, pages = files
    assert gltf_ext.validate(pages) == []
    assert gltf_ext.verify(original, pages)["ok"]


def test_reports_count_blobs(files, tmp_path):
    original, one, pages = files
    report = gltf_ext.compress(original, tmp_path / "out.glb", page_bytes=PAGE)
    inspected = gltf_ext.inspect(pages)
    numbers = [len(_codec.split(view)) for view in views(pages)]
    assert numbers[0] > 10 and numbers[1] == 1
    for found in (report, inspected):
        assert found["totals"]["blobs"] == sum(numbers)
        assert [p["blobs"] for p in found["primitives"]] == numbers
    assert report["totals"] == inspected["totals"]
    assert gltf_ext.inspect(one)["totals"]["blobs"] == 2


def test_the_command_line(files, tmp_path, capsys):
    output = tmp_path / "out.glb"
    main(["compress", str(files[0]), str(output), "--page-bytes", str(PAGE)])
    assert output.read_bytes() == files[2].read_bytes()
    assert re.search(r" and 3\d pages", capsys.readouterr().out)
    main(["inspect", str(output)])
    assert " pages, ratio" in capsys.readouterr().out
    main(["validate", str(output)])
    assert "well formed" in capsys.readouterr().out


def test_large_primitives_are_pages_by_default(tmp_path):
    outputs = {}
    for rows in (256, 258):
        positions, triangles = grid_mesh(rows, 258)
        positions += np.random.default_rng(1).random(positions.shape, np.float32) / 200
        builder = Builder()
        builder.mesh({"POSITION": positions}, triangles)
        source = builder.write(tmp_path / "in.glb")
        for options in ({}, {"page_bytes": 0}, {"page_bytes": DEFAULT_PAGE_BYTES}):
            gltf_ext.compress(source, tmp_path / "out.glb", **options)
            outputs[rows, options.get("page_bytes")] = (tmp_path / "out.glb").read_bytes()
    assert 2 * 255 * 257 <= MOST_TRIANGLES_UNPAGED < 2 * 257 * 257
    assert outputs[256, None] == outputs[256, 0]
    assert outputs[258, None] == outputs[258, DEFAULT_PAGE_BYTES] != outputs[258, 0]


@pytest.mark.parametrize("value", [1, 4095, -1, 2**28 + 1, 4096.5, "4KiB"])
def test_sizes_that_make_no_sense(files, tmp_path, value):
    with pytest.raises(gltf_ext.MeshletError, match=r"page_bytes is .*; use "):
        gltf_ext.compress(files[0], tmp_path / "out.glb", page_bytes=value)


def test_meshlets_by_number(files):
    whole = gltf_ext.load(files[2])
    for primitive, decoder in zip(whole, gltf_ext.decoders(files[2])):
        first = 0
        for m in range(decoder.meshlet_count):
            triangles, attributes = decoder.decode_meshlet(m)
            last = first + len(triangles)
            for name, values in attributes.items():
                if name in primitive.attributes:
                    expected = primitive.attributes[name][primitive.indices[first:last]]
                    np.testing.assert_allclose(values[triangles], expected, atol=1e-6)
            first = last
        assert first == decoder.triangle_count == len(primitive.indices)
        with pytest.raises(IndexError):
            decoder.decode_meshlet(decoder.meshlet_count)


def test_fallback_and_decompress(files, tmp_path):
    gltf_ext.compress(files[0], tmp_path / "out.glb", page_bytes=PAGE, fallback=True)
    assert gltf_ext.validate(tmp_path / "out.glb") == []
    for path, plain in zip(files[1:], ("one.glb", "pages.glb")):
        gltf_ext.decompress(path, tmp_path / plain)
    for one, pages in zip(*(gltf_ext.load(tmp_path / n) for n in ("one.glb", "pages.glb"))):
        np.testing.assert_array_equal(corners(one), corners(pages))


def test_compressing_pages_again(files, tmp_path):
    gltf_ext.compress(files[2], tmp_path / "again.glb")
    assert gltf_ext.inspect(tmp_path / "again.glb")["totals"]["blobs"] == 2


def test_trimesh(files):
    trimesh = pytest.importorskip("trimesh", minversion="4.11")
    import gltf_ext.trimesh_handler

    loaded = trimesh.load(files[2], process=False)
    counts = sorted(len(mesh.faces) for mesh in loaded.geometry.values())
    assert counts == sorted(len(p.indices) for p in gltf_ext.load(files[2]))


def test_accessors_count_all_pages(files, tmp_path):
    """A view that lost its last page is well formed, but the accessors do not fit it."""
    document = open_model(files[2])
    view = document.bufferViews[views_of(document)[0]]
    data = bytes(document.bytes_of_view(views_of(document)[0]))
    view["byteLength"] = _codec.split(data)[-1][0]
    with pytest.raises(gltf_ext.MeshletError, match=r"its indices accessor has .* instead of"):
        compressed_primitives(document)


def views_of(document) -> list[int]:
    return [compressed.view for compressed in compressed_primitives(document)]
