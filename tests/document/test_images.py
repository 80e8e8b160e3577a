"""Sizes of images, read without Pillow, as it reads them; and nothing heavy is imported."""

import io
import struct
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import gltf_ext
from gltf_ext.document.images import size_in_header, size_of_image
from tests.helpers.gltf_builder import Builder, grid_mesh

FORMATS = {
    "PNG": {},
    "JPEG": {},
    "progressive": {"format": "JPEG", "progressive": True, "exif": b"Exif\0\0" + bytes(999)},
    "WEBP": {},
    "lossless": {"format": "WEBP", "lossless": True},
    "extended": {"format": "WEBP", "exif": b"Exif\0\0MM\0*" + bytes(50)},
    "DDS": {},
}


def encoded(name, size=(37, 300)):
    pixels = np.random.default_rng(1).integers(0, 255, (size[1], size[0], 3), np.uint8)
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, **{"format": name, **FORMATS[name]})
    return data.getvalue()


@pytest.mark.parametrize("name", FORMATS)
def test_sizes_are_those_of_pillow(name):
    data = encoded(name)
    assert size_in_header(data) == size_of_image(data) == (37, 300)
    assert size_in_header(memoryview(data)) == (37, 300)


def test_size_of_a_ktx2():
    header = b"\xabKTX 20\xbb\r\n\x1a\n" + struct.pack("<IIIII", 0, 1, 512, 256, 0)
    assert size_in_header(header) == (512, 256)


@pytest.mark.parametrize("name", FORMATS)
def test_files_that_are_cut_off(name):
    data = encoded(name)
    for count in range(3, 40):
        try:
            width, height = size_in_header(data[:count])
        except gltf_ext.MeshletError:
            continue
        assert count >= 16 and 0 <= width < 2**32 and 0 <= height < 2**32
    with pytest.raises(gltf_ext.MeshletError):
        size_in_header(data[:12])


@pytest.mark.parametrize("data", [b"", b"BM" + bytes(60), b"\xff\xd8" + b"\xff" * 99])
def test_other_files(data):
    with pytest.raises(gltf_ext.MeshletError):
        size_in_header(data)


def test_compress_needs_no_pillow(tmp_path):
    """Blender has none."""
    positions, triangles = grid_mesh(9, 9)
    builder = Builder()
    primitive = builder.mesh({"POSITION": positions, "TEXCOORD_0": positions[:, :2]}, triangles)
    primitive["material"] = 0
    view = builder.view(encoded("PNG"))
    builder.properties.update(
        images=[{"bufferView": view, "mimeType": "image/png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    builder.write(tmp_path / "in.glb")
    code = (
        "import sys; sys.modules['PIL'] = None; import gltf_ext; "
        "gltf_ext.compress('in.glb', 'out.glb')"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=60)
    assert gltf_ext.validate(tmp_path / "out.glb") == []
