"""Buffer views that meshopt compressed: from their fallback, or through a decoder."""

import importlib.util
import sys

import numpy as np
import pytest

import gltf_ext
from gltf_ext.document import meshopt
from gltf_ext.sources.importers import referenced_files
from tests.helpers.gltf_builder import Builder, glb_bytes, glb_json, grid_mesh

EXT, KHR = meshopt.NAMES


def model(name, encode=None, fallback=True):
    """A sheet whose views refer to a second buffer, which has plain bytes or none.

    encode: (view number, its rows) -> (compressed bytes, mode, filter).
    """
    builder = Builder()
    positions, triangles = grid_mesh(20, 20)
    builder.mesh({"POSITION": positions}, triangles.astype(np.uint16))
    views, plain = builder.properties["bufferViews"], bytes(builder.binary)
    arrays = [positions, triangles.astype(np.uint16).reshape(-1, 1)]
    builder.binary.clear()
    for number, (view, rows) in enumerate(zip(list(views), arrays)):
        data, mode = encode(number, rows) if encode else (b"anything", "ATTRIBUTES")
        stride = rows.itemsize * rows.shape[1]
        start = len(builder.binary)
        builder.binary += data + bytes(-len(data) % 4)
        view["extensions"] = {
            name: {
                "buffer": 0,
                "byteOffset": start,
                "byteLength": len(data),
                "byteStride": stride,
                "count": len(rows),
                "mode": mode,
            }
        }
        view["buffer"] = 1
    builder.properties["extensionsUsed"] = builder.properties["extensionsRequired"] = [name]
    second = {"byteLength": len(plain), "extensions": {name: {"fallback": True}}}
    if fallback:
        second["uri"] = "plain.bin"
    return builder, second, plain


def write(folder, builder, second, plain):
    path = folder / "in.glb"
    builder.write(path)
    builder.properties["buffers"] = [*builder.properties["buffers"], second]
    path.write_bytes(glb_bytes(builder.properties, bytes(builder.binary)))
    (folder / "plain.bin").write_bytes(plain)
    return path


@pytest.mark.parametrize("name", meshopt.NAMES)
def test_a_fallback_is_read(tmp_path, monkeypatch, name):
    """Without a decoder: what is compressed is not looked at."""
    monkeypatch.setattr(meshopt, "_decoder", lambda: None)
    path = write(tmp_path, *model(name))
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    assert "meshopt" not in str(glb_json(tmp_path / "out.glb"))
    (positions, _) = grid_mesh(20, 20)
    loaded = gltf_ext.load(tmp_path / "out.glb")[0].attributes["POSITION"]
    assert np.abs(np.sort(loaded, axis=0) - np.sort(positions, axis=0)).max() < 1e-3


@pytest.mark.parametrize("fallback", [False, True])
def test_without_fallback_and_decoder_it_is_refused(tmp_path, monkeypatch, fallback):
    monkeypatch.setattr(meshopt, "_decoder", lambda: None)
    path = write(tmp_path, *model(EXT, fallback=fallback))
    (tmp_path / "plain.bin").unlink()
    message = r"is compressed with meshopt; install a decoder: pip install gltf-meshlet\[meshopt\]"
    with pytest.raises(gltf_ext.MeshletError, match=message):
        gltf_ext.compress(path, tmp_path / "out.glb")


def encode(number, rows):
    package = pytest.importorskip("meshoptimizer")
    if number == 0:
        return bytes(package.encode_vertex_buffer(rows)), "ATTRIBUTES"
    numbers = np.ascontiguousarray(rows.ravel(), np.uint32)
    return bytes(package.encode_index_buffer(numbers, len(numbers), 400)), "TRIANGLES"


@pytest.mark.parametrize("package", ["meshopt", "meshoptimizer"])
@pytest.mark.parametrize("name", meshopt.NAMES)
def test_decoders(tmp_path, monkeypatch, name, package):
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"needs the package {package}")
    decoder = getattr(meshopt, f"_with_{package}")
    monkeypatch.setattr(meshopt, "_decoder", lambda: decoder)
    path = write(tmp_path, *model(name, encode, fallback=False))
    (tmp_path / "plain.bin").unlink()
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert gltf_ext.verify(path, tmp_path / "out.glb")["ok"]
    positions, triangles = grid_mesh(20, 20)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    plain = builder.write(tmp_path / "plain.glb")
    assert gltf_ext.verify(plain, tmp_path / "out.glb")["ok"]


@pytest.mark.parametrize(
    "change",
    [
        {"count": 2**40}, {"count": -1}, {"count": "x"}, {"byteStride": 0}, {"byteStride": 3},
        {"mode": "NONE"}, {"byteLength": 3}, {"filter": "X"}, {"filter": "QUATERNION"},
        {"byteOffset": 10**9}, {"buffer": 9}, {"count": 399},
        {"byteOffset": "x"}, {"byteOffset": {}}, {"byteLength": float("nan")}, {"byteLength": None},
        {"filter": []}, {"filter": None}, {"filter": {}}, {"filter": "OCTAHEDRAL"},
    ],
)  # fmt: skip
def test_damaged_data_is_refused_in_one_line(tmp_path, change):
    pytest.importorskip("meshoptimizer")
    builder, second, plain = model(EXT, encode, fallback=False)
    builder.properties["bufferViews"][0]["extensions"][EXT].update(change)
    path = write(tmp_path, builder, second, plain)
    with pytest.raises(gltf_ext.MeshletError, match="damaged"):
        gltf_ext.compress(path, tmp_path / "out.glb")


@pytest.mark.parametrize("filter_", ["EXPONENTIAL", "OCTAHEDRAL"])
def test_indices_have_no_filter(tmp_path, filter_):
    pytest.importorskip("meshoptimizer")
    builder, second, plain = model(EXT, encode, fallback=False)
    builder.properties["bufferViews"][1]["extensions"][EXT]["filter"] = filter_
    path = write(tmp_path, builder, second, plain)
    with pytest.raises(gltf_ext.MeshletError, match=f"no valid meshopt filter .{filter_}"):
        gltf_ext.compress(path, tmp_path / "out.glb")


def bomb(folder, package, views=40):
    """Views that nothing uses and that share a stream of 40 kB, 200 times smaller than they."""
    builder, second, plain = model(EXT, encode, fallback=False)
    rows = np.zeros((1 << 17, 16), np.float32)
    data = bytes(package.encode_vertex_buffer(rows))
    start = len(builder.binary)
    builder.binary += data
    for _ in range(views):
        extension = {"buffer": 0, "byteOffset": start, "byteLength": len(data), "byteStride": 64,
                     "count": len(rows), "mode": "ATTRIBUTES"}  # fmt: skip
        view = {"buffer": 1, "byteLength": rows.nbytes, "extensions": {EXT: extension}}
        builder.properties["bufferViews"].append(view)
    second["byteLength"] = 1 << 30
    return write(folder, builder, second, plain)


def test_views_that_share_data_are_bounded_together(tmp_path):
    package = pytest.importorskip("meshoptimizer")
    path = bomb(tmp_path, package)
    with pytest.raises(gltf_ext.MeshletError, match="far more than they can"):
        gltf_ext.compress(path, tmp_path / "out.glb")


def test_only_views_in_use_are_decoded(tmp_path, monkeypatch):
    package = pytest.importorskip("meshoptimizer")
    path, decoded = bomb(tmp_path, package, views=4), []
    decoder = meshopt._decoder()

    def decode(mode, data, count, stride):
        decoded.append(count)
        return decoder(mode, data, count, stride)

    monkeypatch.setattr(meshopt, "_decoder", lambda: decode)
    assert referenced_files(path) == [] and not decoded
    gltf_ext.compress(path, tmp_path / "out.glb")
    assert decoded == [400, 19 * 19 * 6]
    with pytest.raises(gltf_ext.MeshletError, match=r"take 33,5.* bytes; use at least 113M"):
        gltf_ext.compress(path, tmp_path / "out.glb", max_memory="110M")


def test_a_broken_package_is_none(monkeypatch):
    monkeypatch.setitem(sys.modules, "meshopt", None)
    monkeypatch.setitem(sys.modules, "meshoptimizer", None)
    assert meshopt._decoder.__wrapped__() is None


# --- filters ---


def both(function, encoded, **arguments):
    """What a filter gives here, and in the package meshoptimizer."""
    package = pytest.importorskip("meshoptimizer")
    ours = meshopt._unfiltered(encoded.copy().view(np.uint8), function)
    theirs = {"OCTAHEDRAL": package.decode_filter_oct, "QUATERNION": package.decode_filter_quat,
              "EXPONENTIAL": package.decode_filter_exp}[function]  # fmt: skip
    expected = np.ascontiguousarray(encoded.copy())
    result = theirs(expected, len(expected), expected.itemsize * expected.shape[1])
    expected = expected if result is None else result
    return ours.view(encoded.dtype), np.asarray(expected).view(encoded.dtype).reshape(encoded.shape)


@pytest.mark.parametrize("kind", ["i1", "i2"])
def test_octahedral_filter(kind):
    random = np.random.default_rng(0)
    limit = {"i1": 127, "i2": 2047}[kind]
    encoded = random.integers(-limit, limit + 1, (500, 4)).astype(kind)
    encoded[:, 2] = limit
    # Inside the octahedron's square, where all encoders stay.
    ours, theirs = both("OCTAHEDRAL", encoded)
    assert np.abs(ours.astype(int) - theirs).max() <= 1
    lengths = np.linalg.norm(ours[:, :3].astype(float), axis=1)
    assert np.allclose(lengths, np.iinfo(kind).max, rtol=0.02)


def test_quaternion_filter():
    random = np.random.default_rng(0)
    encoded = random.integers(-1000, 1001, (500, 4)).astype("i2")
    encoded[:, 3] = 2047 & ~3 | random.integers(0, 4, 500)
    ours, theirs = both("QUATERNION", encoded)
    assert np.abs(ours.astype(int) - theirs).max() <= 1


def test_exponential_filter():
    random = np.random.default_rng(0)
    encoded = random.integers(-100, 101, (500, 3)) << 24 | random.integers(0, 1 << 24, (500, 3))
    ours, theirs = both("EXPONENTIAL", encoded.astype("<i4"))
    assert np.array_equal(ours, theirs)


@pytest.mark.parametrize("kind, bits", [("u1", 8), ("u1", 5), ("u2", 16), ("u2", 9)])
def test_color_filter(kind, bits):
    """By the text of KHR_meshopt_compression: from RGBA of `bits` to the encoded form and back."""
    random = np.random.default_rng(0)
    full, limit = (1 << bits) - 1, np.iinfo(kind).max
    red, green, blue = random.integers(0, full + 1, (3, 300))
    alpha = random.integers(0, (full >> 1) + 1, 300)
    orange = (red - blue) // 2
    base = blue + orange
    chroma = (green - base) // 2
    luma = base + chroma
    encoded = np.stack([luma, orange, chroma, alpha | (full + 1 >> 1)], axis=1).astype(kind)
    ours = meshopt._unfiltered(encoded.view(np.uint8), "COLOR").view(kind).astype(int)
    scale = limit / full
    expected = np.stack([luma + orange - chroma, luma + chroma, luma - orange - chroma], axis=1)
    assert np.abs(ours[:, :3] - np.clip(expected * scale, 0, limit)).max() <= 1
    assert np.abs(ours[:, 3] - (alpha << 1 | alpha & 1) * scale).max() <= 1
