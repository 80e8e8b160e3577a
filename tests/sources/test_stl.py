"""What .stl files may be: any white space, a wrong count in the header, colours."""

import numpy as np
import pytest

import gltf_ext
from gltf_ext.errors import MeshletError
from gltf_ext.sources import text
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.source import read_primitive

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
FACET = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 {} vertex 0 1 0 endloop endfacet"

ONE = FACET.format(0)


def binary(attributes=(0, 0), header=b"", count=None, more=b""):
    """A file of a triangle for each attribute."""
    triangles = np.zeros(len(attributes), TRIANGLE)
    triangles["corners"] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    triangles["corners"][:, :, 2] = np.arange(len(attributes))[:, None]
    triangles["attribute"] = attributes
    count = len(attributes) if count is None else count
    return header.ljust(80, b"\0") + count.to_bytes(4, "little") + triangles.tobytes() + more


def read(folder, content):
    """name -> the primitive of each solid; warnings."""
    (folder / "a.stl").write_bytes(content if isinstance(content, bytes) else content.encode())
    document = open_model(folder / "a.stl")
    primitives = [read_primitive(document, m, 0)[0] for m in range(len(document.meshes))]
    names = [mesh["name"] for mesh in document.meshes]
    return dict(zip(names, primitives, strict=True)), document.import_warnings


# --- text ---


@pytest.mark.parametrize("size", [1 << 20, 1, 7, 64, 200])
@pytest.mark.parametrize(
    "separate",
    [
        lambda words: " ".join(words),
        lambda words: "\n".join(words),
        lambda words: "\r".join(words),
        lambda words: "\t \r\n".join(words) + "\n",
        lambda words: (
            "  ".join(words).replace("  outer", "\nouter").replace("  vertex", "\n vertex")
        ),
        lambda words: (
            " ".join(words).replace(" facet", "\nfacet").replace(" endsolid", "\nendsolid")
        ),
        lambda words: "\f".join(words),
    ],
)
def test_any_white_space(tmp_path, monkeypatch, separate, size):
    monkeypatch.setattr(text, "MOST_BYTES", size)
    words = []
    for name, count in (("one", 5), ("two", 3)):
        facets = " ".join(FACET.format(i) for i in range(count))
        words += f"solid {name} {facets} endsolid {name}".split()
    solids, warnings = read(tmp_path, separate(words))
    assert list(solids) == ["one", "two"] and warnings == ()
    for primitive, count in zip(solids.values(), (5, 3)):
        corners = primitive.attributes["POSITION"][primitive.indices]
        assert corners.tolist() == [[[0, 0, 0], [1, 0, i], [0, 1, 0]] for i in range(count)]


@pytest.mark.parametrize(
    "content, name",
    [
        ("solid vertex of facets\n{}\nendsolid\n".format(
            ONE.replace(" vertex", "\nvertex").replace(" endloop", "\nendloop")
        ), "vertex of facets"),
        (f"SOLID A {ONE.upper()} ENDSOLID A", "A"),
        (f"solid {ONE} endsolid", "a.stl"),
        (f"\n\n  solid my part {ONE}\nendsolid my part", "my part"),
        (f"solid a\n{ONE}\nendsolid a", "a"),
    ],
)  # fmt: skip
def test_names_of_solids(tmp_path, content, name):
    solids, _ = read(tmp_path, content)
    assert list(solids) == [name] and len(solids[name].indices) == 1


@pytest.mark.parametrize(
    "content, problem",
    [
        (f"solid a {ONE}", "is cut off"),
        (f"solid a {ONE} endsolid".replace("0 1 0", "0 1"), "not 3 numbers"),
        (f"solid a {ONE} endsolid".replace("vertex 0 1 0", ""), "no triangle"),
        ("solid a facet normal 0 0 1 outer loop vertex" + " 0" * 90_000, "does not end"),
    ],
)
def test_damaged_text(tmp_path, content, problem):
    with pytest.raises(MeshletError, match=problem):
        read(tmp_path, content)


# --- the count ---


@pytest.mark.parametrize("header", [b"", b"solid looks like text", b" " * 80])
@pytest.mark.parametrize("count", [0, 1, 3, 2**32 - 1])
def test_the_size_of_the_file_decides(tmp_path, count, header):
    solids, warnings = read(tmp_path, binary(header=header, count=count))
    assert len(solids["a.stl"].indices) == 2
    assert warnings == (f"its header counts {count} triangles, but it has 2",)


def test_bytes_after_the_triangles(tmp_path):
    for more, warnings in ((b"", ()), (b"1234567", ())):
        assert read(tmp_path, binary(more=more))[1] == warnings
    solids, warnings = read(tmp_path, binary(more=bytes(60)))
    assert len(solids["a.stl"].indices) == 2
    assert warnings == ("60 bytes after the triangles are ignored",)
    solids, warnings = read(tmp_path, binary(more=bytes(7), count=0))
    assert len(solids["a.stl"].indices) == 2 and "counts 0" in warnings[0]


@pytest.mark.parametrize("content", [binary()[:-1], binary()[:90], binary()[:84], binary()[:40]])
def test_cut_off(tmp_path, content):
    if len(content) == 84:
        with pytest.raises(MeshletError, match="holds no triangles"):
            read(tmp_path, content)
        return
    with pytest.raises(MeshletError, match="is cut off"):
        read(tmp_path, content)


# --- colours ---


def colors(solids):
    """The colour of each triangle, which all of its corners have."""
    (primitive,) = solids.values()
    corners = primitive.attributes["COLOR_0"][primitive.indices]
    assert (corners == corners[:, :1]).all()
    return corners[:, 0].tolist()


VALID = 1 << 15


def test_colors_of_viscam(tmp_path):
    attributes = [VALID | 31 << 10, VALID | 31 << 5, VALID | 31, 31, VALID | 16 << 10 | 8 << 5 | 1]
    solids, warnings = read(tmp_path, binary(attributes))
    assert colors(solids) == [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [255, 255, 255, 255],
        [132, 66, 8, 255],
    ]
    assert warnings == ()


@pytest.mark.parametrize("before", [b"", b"made by X "])
def test_colors_of_magics(tmp_path, before):
    header = before + b"COLOR=" + bytes([10, 20, 30, 40]) + b",MATERIAL=" + bytes(12)
    solids, _ = read(tmp_path, binary([31, 31 << 5, 31 << 10, VALID, VALID | 31], header))
    assert colors(solids) == [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [10, 20, 30, 40],
        [10, 20, 30, 40],
    ]


def test_no_colors(tmp_path):
    solids, _ = read(tmp_path, binary([0, 1, 0x7FFF]))
    assert set(solids["a.stl"].attributes) == {"POSITION"}


def test_colors_of_later_blocks(tmp_path, monkeypatch):
    """Those before are white."""
    monkeypatch.setattr(text, "MOST_BYTES", 50)
    solids, _ = read(tmp_path, binary([0, 0, VALID | 31, 0]))
    white = [255] * 4
    assert colors(solids) == [white, white, [0, 0, 255, 255], white]


def test_colors_stay_through_compress(tmp_path):
    read(tmp_path, binary([VALID | 31 << 10, VALID | 31]))
    for limits in ({}, {"max_memory": "105M"}):
        gltf_ext.compress(tmp_path / "a.stl", tmp_path / "out.glb", **limits)
        assert gltf_ext.verify(tmp_path / "a.stl", tmp_path / "out.glb", **limits)["ok"]
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert sorted(set(map(tuple, primitive.attributes["COLOR_0"].tolist()))) == [
        (0, 0, 255, 255),
        (255, 0, 0, 255),
    ]
