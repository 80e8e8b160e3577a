"""Materials of .obj files: what becomes a glTF material, and what is said of the rest."""

import io
import json
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext.sources import texture_images
from gltf_ext.sources.importers import open_model

OBJ = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n"
RED, GREEN = (255, 0, 0), (0, 255, 0)


@pytest.fixture
def folder(tmp_path):
    """Textures of several kinds."""
    (tmp_path / "sub").mkdir()
    for name, color in (("red.png", RED), ("my tex  2.png", GREEN), ("sub/green.png", GREEN)):
        Image.new("RGB", (2, 2), color).save(tmp_path / name)
    Image.new("L", (4, 4), 64).save(tmp_path / "gray.png")
    Image.new("L", (2, 2), 192).save(tmp_path / "light.png")
    Image.new("RGBA", (2, 2), (1, 2, 3, 128)).save(tmp_path / "leaf.png")
    Image.new("RGB", (2, 2), (9, 100, 200)).save(tmp_path / "orm.png")
    return tmp_path


def read(folder, lines, obj=OBJ):
    """The glTF material of lines, the document, its warnings."""
    (folder / "m.mtl").write_bytes(b"newmtl a\n" + lines.encode())
    (folder / "a.obj").write_text(obj)
    document = open_model(folder / "a.obj")
    (material,) = json.loads(document.to_json())["materials"]
    assert material.pop("name") == "a"
    return material, document, document.import_warnings


def pixels(document, texture):
    """uint8[height, width, channels] of the image of a texture."""
    image = document.images[document.textures[texture["index"]]["source"]]
    with Image.open(io.BytesIO(bytes(document.bytes_of_view(image["bufferView"])))) as opened:
        return np.array(opened)


# --- numbers ---


@pytest.mark.parametrize(
    "lines, color",
    [
        ("Kd 0.25", [0.25, 0.25, 0.25, 1]),
        ("Kd 1 0.5 0 # orange", [1, 0.5, 0, 1]),
        ("Kd 2 -1 0", [1, 0, 0, 1]),
        ("Kd 1 0 0\nd 0.5", [1, 0, 0, 0.5]),
        ("Kd 1 0 0\nTr 0.75", [1, 0, 0, 0.25]),
        ("Kd 1 0 0\nd -halo 0.5", [1, 0, 0, 0.5]),
        ("Tr 0.5", [1, 1, 1, 0.5]),
        ("Kd 1 0 0\nd 1\nTr 0", [1, 0, 0, 1]),
        ("Kd 1 0 0\nTr 1\nd 1", [1, 0, 0, 1]),
        ("\tKd\t1  0 0 \r\n\td 0.5", [1, 0, 0, 0.5]),
    ],
)
def test_colors_and_opacity(folder, lines, color):
    material, _, warnings = read(folder, lines)
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == color
    is_clear = color[3] < 1
    assert (material.get("alphaMode") == "BLEND") == is_clear and warnings == ()
    assert material.get("doubleSided", False) == is_clear


@pytest.mark.parametrize("line", ["d 0", "Tr 1"])
def test_an_opacity_of_0_is_a_mistake(folder, line):
    material, _, warnings = read(folder, f"Kd 1 0 0\n{line}")
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 1]
    assert warnings == ("a: its opacity of 0 is read as 1",)


@pytest.mark.parametrize(
    "lines, metal, rough",
    [
        ("Pr 0.25\nPm 0.75", 0.75, 0.25),
        ("Ns 98", 0, 0.02**0.25),
        ("Ns 98\nPr 0.5", 0, 0.5),
        ("Pr 7\nPm -1", 0, 1),
        ("Ns x", 0, (2 / 3) ** 0.25),
    ],
)
def test_metal_and_roughness(folder, lines, metal, rough):
    pbr = read(folder, lines)[0]["pbrMetallicRoughness"]
    assert pbr["metallicFactor"] == metal and pbr["roughnessFactor"] == pytest.approx(rough)


@pytest.mark.parametrize(
    "line, factor, strength",
    [
        ("Ke 0.5 0.25 0", [0.5, 0.25, 0], None),
        ("Ke 0.5", [0.5, 0.5, 0.5], None),
        ("Ke 4 2 0", [1, 0.5, 0], 4),
        ("Ke 0 0 0", None, None),
    ],
)
def test_emission(folder, line, factor, strength):
    material, document, _ = read(folder, line)
    assert material.get("emissiveFactor") == factor
    extension = material.get("extensions", {}).get("KHR_materials_emissive_strength")
    assert extension == (strength and {"emissiveStrength": strength})
    assert document.extensionsUsed == ["KHR_materials_emissive_strength"] * bool(strength)


# --- textures ---


@pytest.mark.parametrize(
    "name",
    [
        "red.png",
        '"red.png"',
        "'red.png'",
        ".\\red.png",
        "./red.png",
        '".\\red.png"',
        "C:\\Users\\me\\My Textures\\red.png",
        "\\\\host\\share\\red.png",
        "/home/me/red.png",
        "textures/red.png",
        "textures\\red.png",
        "-blendu off -clamp off red.png",
        "-type sphere .\\red.png   ",
    ],
)
def test_names_of_textures(folder, name):
    material, document, warnings = read(folder, f"Kd 1 1 1\nmap_Kd {name}")
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert (pixels(document, texture)[0, 0] == RED).all() and warnings == ()


@pytest.mark.parametrize("name", ["my tex  2.png", '"my tex  2.png"', "-s 1 1 1 my tex  2.png"])
def test_names_with_blanks(folder, name):
    material, document, _ = read(folder, f"map_Kd {name}")
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert (pixels(document, texture)[0, 0] == GREEN).all()


def test_all_textures(folder):
    material, document, warnings = read(
        folder,
        "Kd 0 0 0\nKe 0 0 0\nmap_Kd red.png\nmap_Ke sub\\green.png\nmap_Pr gray.png\n"
        "map_Pm light.png\nnorm -bm 0.5 orm.png\n",
    )
    pbr = material["pbrMetallicRoughness"]
    assert pbr["baseColorFactor"] == [1, 1, 1, 1], "a colour of 0 hides no texture"
    assert material["emissiveFactor"] == [1, 1, 1]
    assert (pbr["metallicFactor"], pbr["roughnessFactor"]) == (1, 1)
    assert (pixels(document, material["emissiveTexture"]) == GREEN).all()
    joined = pixels(document, pbr["metallicRoughnessTexture"])
    assert joined.shape[:2] == (4, 4) and (joined == (255, 64, 192)).all()
    assert material["normalTexture"]["scale"] == 0.5 and warnings == ()
    assert "alphaMode" not in material
    assert {path.name for path in document.files()} == {
        "m.mtl", "red.png", "green.png", "gray.png", "light.png", "orm.png",
    }  # fmt: skip


@pytest.mark.parametrize(
    "lines, expected",
    [
        ("map_Pr gray.png\nPm 1", (255, 64, 255)),
        ("map_Pm light.png\nPr 0.2", (255, 51, 192)),
        ("map_Pm light.png", (255, 255, 192)),
        ("map_Pr orm.png\nmap_Pm orm.png", (9, 100, 200)),
        ("map_Pr -imfchan r orm.png\nmap_Pm -imfchan g orm.png", (255, 9, 100)),
        ("map_Pr -imfchan m leaf.png\nPm 0", (255, 128, 0)),
    ],
)
def test_metal_and_roughness_share_an_image(folder, lines, expected):
    material, document, warnings = read(folder, lines)
    texture = material["pbrMetallicRoughness"]["metallicRoughnessTexture"]
    assert (pixels(document, texture) == expected).all() and warnings == ()


@pytest.mark.parametrize(
    "lines, expected",
    [
        ("map_Kd red.png\nmap_d gray.png", (*RED, 64)),
        ("map_Kd red.png\nmap_d leaf.png", (*RED, 128)),
        ("map_Kd red.png\nmap_d -imfchan b orm.png", (*RED, 200)),
        ("map_Kd leaf.png\nmap_d leaf.png", (1, 2, 3, 128)),
        ("map_d gray.png", (255, 255, 255, 64)),
    ],
)
def test_opacity_of_a_texture(folder, lines, expected):
    material, document, warnings = read(folder, lines)
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert (pixels(document, texture) == expected).all() and warnings == ()
    assert material["alphaMode"] == "BLEND"


@pytest.mark.parametrize("keyword", ["map_Bump", "bump", "map_bump", "norm"])
def test_normal_maps(folder, keyword):
    material, _, warnings = read(folder, f"{keyword} -bm 1 orm.png")
    assert material["normalTexture"] == {"index": 0} and warnings == ()
    material, _, warnings = read(folder, f"{keyword} gray.png")
    if keyword == "norm":
        assert "normalTexture" in material
    else:
        assert "normalTexture" not in material
        assert warnings == ("a: its height map is left out; glTF has normal maps",)


@pytest.mark.parametrize(
    "options, transform",
    [
        ("-o 0.5 0 0 -s 2 2 1", {"offset": [0.5, -1], "scale": [2, 2]}),
        ("-s 2", {"offset": [0, 0], "scale": [2, 1]}),
        ("-s 2 4", {"offset": [0, -3], "scale": [2, 4]}),
        ("-o 0.25 0.5", {"offset": [0.25, -0.5], "scale": [1, 1]}),
        ("-o 0 0 0 -s 1 1 1", None),
    ],
)
def test_placed_textures(folder, options, transform):
    material, document, warnings = read(folder, f"map_Kd {options} red.png")
    extensions = material["pbrMetallicRoughness"]["baseColorTexture"].get("extensions", {})
    assert extensions.get("KHR_texture_transform") == transform and warnings == ()
    assert document.extensionsUsed == ["KHR_texture_transform"] * bool(transform)
    if transform:  # v of the file, u v of which goes up, through both
        u, v = np.float64([0.3, 0.2])
        numbers = [float(word) for word in options.replace("-o", "").split("-s")[0].split()]
        scales = [float(w) for w in options.partition("-s")[2].split()] or [1, 1]
        offset, scale = ([*a, *b[len(a) :]][:2] for a, b in ((numbers, (0, 0)), (scales, (1, 1))))
        moved = np.float64([u, 1 - v]) * transform["scale"] + transform["offset"]
        assert moved == pytest.approx([u * scale[0] + offset[0], 1 - (v * scale[1] + offset[1])])


def test_clamped_textures(folder):
    _, document, warnings = read(folder, "map_Kd -clamp on red.png\nmap_Ke red.png")
    samplers = [texture.get("sampler") for texture in document.textures]
    assert samplers == [0, None] and document.samplers[0]["wrapS"] == 33071
    assert len(document.images) == 1 and warnings == ()


def test_textures_that_are_not_there(folder):
    material, _, warnings = read(folder, "Kd 0 1 0\nmap_Kd no.png\nmap_Ke m.mtl\nbump x.exr")
    assert "baseColorTexture" not in material["pbrMetallicRoughness"]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0, 1, 0, 1]
    assert warnings == (
        "no.png is not there, so this texture is left out",
        "m.mtl: it cannot be read, so this texture is left out",
        "x.exr is not there, so this texture is left out",
    )


@pytest.mark.parametrize("keyword", ["map_Kd", "map_d", "map_Ke", "map_Pr", "norm", "bump"])
@pytest.mark.parametrize(
    "name, text", [("cut.png", "it is damaged or cut off"), ("cut.jpg", "it is cut off")]
)
def test_images_that_are_cut_off_are_left_out(folder, keyword, name, text):
    pixels = np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)
    Image.fromarray(pixels).save(folder / name)
    (folder / name).write_bytes((folder / name).read_bytes()[:2000])
    _, document, warnings = read(folder, f"map_Ke red.png\n{keyword} {name}")
    assert warnings == (f"{name}: {text}, so this texture is left out",)
    assert len(document.images) == (keyword != "map_Ke")


def test_damaged_pixels_are_left_out_where_they_are_joined(folder):
    """A wrong checksum inside a chunk that is whole."""
    data = b"broken"
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 0, 0, 0, 0)),
        (b"IDAT", data),
        (b"IEND", b""),
    ]
    (folder / "bad.png").write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
            for kind, body in chunks
        )
    )
    _, document, warnings = read(folder, "map_Kd red.png\nmap_d bad.png\nmap_Pr bad.png")
    assert warnings == (
        "a: map_d is left out: it cannot be read",
        "a: a texture is left out: it cannot be read",
    )
    assert len(document.images) == 1


def test_a_library_without_a_name(folder):
    (folder / "a.obj").write_text("mtllib\nmtllib  \nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    text = "mtllib names no file, so its materials are left out"
    assert open_model(folder / "a.obj").import_warnings == (text,)


# --- what is left ---


def test_the_rest_is_named(folder):
    (folder / "m.mtl").write_text(
        "newmtl a\nKa 1 1 1\nKs 1 0 0\nNi 1.45\nillum 2\nmap_Ks red.png\nTf 1 1 1\nPs 0.5\n"
        "# Kd is a comment\nnewmtl b\nKs 0.5 0.5 0.5\nmap_Ks red.png\nnewmtl unused\nrefl x\n"
    )
    (folder / "a.obj").write_text(OBJ + "usemtl b\nf 1/1 2/2 3/3\n")
    assert open_model(folder / "a.obj").import_warnings == (
        "ks of 1 materials is left out",
        "map_ks of 2 materials is left out",
        "ps of 1 materials is left out",
    )


def test_materials_in_no_library(folder):
    (folder / "m.mtl").write_text("newmtl a\n")
    (folder / "a.obj").write_text(OBJ + "usemtl b\nf 1 2 3\nusemtl c d\nf 1 2 3\n")
    assert open_model(folder / "a.obj").import_warnings == (
        "2 materials are in no library, such as b",
    )


@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf", b"\xef\xbb\xbf# made by\r\n", b"\r\n\r\n"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_line_ends_and_marks(folder, start, end):
    lines = end.join([b"newmtl my  red", b"Kd 1 0 0", b"newmtl b", b"Kd 0 1 0", b""])
    (folder / "m.mtl").write_bytes(start + lines)
    (folder / "a.obj").write_text(OBJ.replace("usemtl a", "usemtl my red"))
    (material,) = open_model(folder / "a.obj").materials
    assert material["name"] == "my red"
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 1]


@pytest.mark.parametrize(
    "line",
    [
        "mtllib one.mtl two.mtl",
        'mtllib "one.mtl" "two.mtl"',
        "mtllib .\\one.mtl .\\two.mtl",
        "mtllib C:\\models\\one.mtl\nmtllib /home/me/two.mtl",
        "mtllib one.mtl\nmtllib two.mtl",
        'mtllib "sp ace.mtl"',
        "mtllib sp ace.mtl",
    ],
)
def test_libraries(folder, line):
    for name, text in (
        ("one.mtl", "newmtl a\n"),
        ("two.mtl", "newmtl b\n"),
        ("sp ace.mtl", "newmtl a\nnewmtl b\n"),
    ):
        (folder / name).write_text(text)
    (folder / "a.obj").write_text(OBJ.replace("mtllib m.mtl", line) + "usemtl b\nf 1/1 2/2 3/3\n")
    document = open_model(folder / "a.obj")
    assert [material["name"] for material in document.materials] == ["a", "b"]
    assert document.import_warnings == ()


def test_all_of_it_is_valid(folder):
    """And stays through compress."""
    (folder / "m.mtl").write_text(
        "newmtl a\nKe 3 0 0\nd 0.5\nmap_Kd -s 2 2 red.png\nmap_d -s 2 2 gray.png\n"
        "map_Ke -clamp on red.png\nmap_Pr gray.png\nbump orm.png\n"
    )
    (folder / "a.obj").write_text(OBJ + "f 1 2 3\n")
    gltf_ext.compress(folder / "a.obj", folder / "out.glb")
    document = open_model(folder / "out.glb")
    for primitive in document.meshes[0]["primitives"]:
        has_textures = "Texture" in str(document.materials[primitive["material"]])
        assert has_textures == ("TEXCOORD_0" in primitive["attributes"])
    gltf_ext.validate(folder / "out.glb")
    assert gltf_ext.verify(folder / "a.obj", folder / "out.glb")["ok"]


def test_images_of_16_bits_keep_their_values(tmp_path):
    """Pillow's own conversion to 8 bits clips all above 255."""
    ramp = np.linspace(0, 65535, 64).astype(np.uint16).reshape(8, 8)
    Image.fromarray(ramp).save(tmp_path / "rough.png")
    band = texture_images._band((tmp_path / "rough.png").read_bytes(), b"", "L")
    np.testing.assert_allclose(np.asarray(band), ramp / 257, atol=1)
