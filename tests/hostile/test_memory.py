"""Small files that claim to be large: commands check the claim before they take the memory."""

import functools
import io
import os
import struct
import subprocess
import sys
import zlib

import pytest

import gltf_ext
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder, glb_bytes, grid_mesh

ALLOWED, ALLOWED_PER_BYTE = 64 << 20, 40
MEASURED = (
    "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30));"
    "from gltf_meshlet import cli; status = cli.main(sys.argv[1:]);"
    "print(status, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)"
)
MANY = 2**28
PICTURE = ["--width", "16", "--height", "16"]
BACKENDS = {"mitsuba": ["--spp", "1"], "vulkan": ["--path", "vertex"]}


def run(*arguments):
    """(exit status, most bytes in memory, stderr) of a command in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    *lines, last = done.stderr.splitlines()
    status, kilobytes = map(int, last.split())
    return status, kilobytes * 1024, lines


@functools.cache
def usual(*command):
    """Memory that a command takes for a file of nothing."""
    return run(*command)[1]


def check(path, *command, size=None):
    """A command takes little more for this file than for none. Returns (status, lines)."""
    folder = path.parent
    before = usual(*command, folder / "none.glb", *_output(command, folder))
    status, memory, lines = run(*command, path, *_output(command, folder))
    assert memory - before < ALLOWED + ALLOWED_PER_BYTE * (size or path.stat().st_size), lines
    assert status in (0, 2) and all(line.startswith("gltf-meshlet: ") for line in lines), lines
    return status, lines


def _output(command, folder):
    if command[0] == "compress":
        return (folder / "out.glb",)
    return ("-o", folder / "out.png") if command[0] == "render" else ()


def claiming(path, *accessors, **more):
    """A file of a few bytes whose accessors claim what they like."""
    properties = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 64}],
        "bufferViews": [{"buffer": 0, "byteLength": 64}],
        "accessors": list(accessors),
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        **more,
    }
    path.write_bytes(glb_bytes(properties, bytes(64)))
    return path


VEC3 = {"componentType": 5126, "type": "VEC3"}
SPARSE = {
    "count": 1,
    "indices": {"bufferView": 0, "componentType": 5121},
    "values": {"bufferView": 0},
}


@pytest.mark.parametrize(
    "accessor",
    [
        {**VEC3, "count": 2**22},
        {**VEC3, "count": 2**24, "sparse": SPARSE},
        {**VEC3, "count": MANY, "bufferView": 0},
        {**VEC3, "count": 5, "bufferView": 0, "sparse": {**SPARSE, "count": MANY}},
        {"componentType": 5126, "type": "MAT4", "count": 2**20},
    ],
)
def test_accessors(tmp_path, accessor):
    status, lines = check(claiming(tmp_path / "in.glb", accessor), "compress")
    assert status == 2 and len(lines) == 1


def test_many_accessors_without_bytes(tmp_path):
    """Each is within the limit of one."""
    attributes = {"POSITION": 0, **{f"_A{i}": i for i in range(1, 2000)}}
    path = claiming(
        tmp_path / "in.glb",
        *([{"componentType": 5126, "type": "VEC3", "count": 60_000}] * 2000),
        meshes=[{"primitives": [{"attributes": attributes}]}],
    )
    check(path, "compress")


def test_the_same_buffer_in_many_images(tmp_path):
    (tmp_path / "image.png").write_bytes(b"\x89PNG" + bytes(1 << 20))
    path = claiming(
        tmp_path / "in.glb",
        {**VEC3, "count": 5, "bufferView": 0},
        images=[{"uri": "image.png"}] * 1000,
    )
    check(path, "compress", size=path.stat().st_size + (1 << 20))


@pytest.mark.parametrize("uri", ["/dev/zero", "../../../../../../../../dev/zero", "fifo"])
@pytest.mark.parametrize("kind", ["buffers", "images"])
def test_devices_are_not_read(tmp_path, uri, kind):
    os.mkfifo(tmp_path / "fifo")
    path = claiming(
        tmp_path / "in.glb",
        {**VEC3, "count": 5, "bufferView": 0},
        **{kind: [{"uri": uri, "byteLength": 64}]},
    )
    check(path, "compress")


# --- images ---


def png(width, height, row=None):
    """A .png of the size; without a row it ends after its header."""

    def chunk(kind, data):
        crc = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", crc)

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    body = b""
    if row is not None:
        packer = zlib.compressobj(9)
        packed = b"".join(packer.compress(row) for _ in range(height))
        body = chunk(b"IDAT", packed + packer.flush()) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + header + body


def jpeg(width, height):
    """A .jpg whose header claims the size."""
    from PIL import Image

    file = io.BytesIO()
    Image.new("RGB", (16, 16)).save(file, "JPEG")
    data = bytearray(file.getvalue())
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", height, width)
    return bytes(data)


def textured(path, image):
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    builder.mesh(
        {"POSITION": positions, "TEXCOORD_0": positions[:, :2].copy()}, triangles, material=0
    )
    builder.properties.update(
        images=[{"bufferView": builder.view(image), "mimeType": "image/png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    gltf_ext.compress(builder.write(path.with_name("plain.glb")), path)
    return path


@pytest.mark.parametrize("backend", BACKENDS)
def test_images(tmp_path, backend):
    environment.need_package(backend)
    command = ["render", "--backend", backend, *PICTURE, *BACKENDS[backend]]
    none = textured(tmp_path / "none.glb", png(1, 1, bytes(4)))
    before = run(*command, none, "-o", tmp_path / "out.png")[1]
    for image in (
        png(8192, 8192, bytes(1 + 3 * 8192)),  # a bomb
        png(30_000, 30_000),  # ends after its header
        png(2**31 - 1, 2**31 - 1),
        jpeg(65_500, 65_500),
        png(2048, 2048),
    ):
        path = textured(tmp_path / "in.glb", image)
        status, memory, lines = run(*command, path, "-o", tmp_path / "out.png")
        assert status == 0 and len(lines) == 1 and "image 0 is left out" in lines[0]
        assert memory - before < ALLOWED + ALLOWED_PER_BYTE * len(image)


# --- other formats ---


PLY = (
    b"ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
)
PLY += b"element face %d\nproperty list uchar int vertex_indices\nend_header\n"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", PLY % (b"binary_little_endian", MANY, MANY) + bytes(999)),
        ("a.ply", PLY % (b"ascii", MANY, MANY) + b"0 0 0\n" * 99),
        ("a.ply", PLY % (b"binary_little_endian", 3, 2**62) + bytes(999)),
        ("a.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(500)),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 " + b"1 2 3 " * 5000 + b"\n"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/%d 2/1 3/1\n" % 10**400),
        (
            "a.obj",
            b"mtllib " + b" ".join(b"%d" % i for i in range(300_000)) + b"\nf 1 1 1\nv 0 0 0",
        ),
    ],
)
def test_other_formats(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    check(tmp_path / name, "compress")


def test_textures_of_an_obj(tmp_path):
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    )
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd image.png\n")
    (tmp_path / "image.png").write_bytes(png(8192, 8192, bytes(1 + 3 * 8192)))
    check(tmp_path / "a.obj", "compress", size=(tmp_path / "image.png").stat().st_size)


# --- Draco ---


def varint(value):
    data = b""
    while value > 127:
        data, value = data + bytes([value & 127 | 128]), value >> 7
    return data + bytes([value])


@pytest.mark.parametrize("method", [0, 1])
@pytest.mark.parametrize("claim", [2**24, 2**27, 2**30])
def test_draco(tmp_path, method, claim):
    environment.need_package("DracoPy")
    data = b"DRACO" + bytes([2, 2, 1, method, 0, 0])
    if method == 0:  # sequential: faces, points, kind of indices
        data += varint(claim) + varint(claim) + b"\x01"
    else:  # Edgebreaker: traversal, vertices, faces, attributes, symbols, split symbols
        data += b"\0" + varint(claim) + varint(claim) + b"\1" + varint(claim) + b"\0"
    data += bytes(200)
    extension = {"bufferView": 0, "attributes": {"POSITION": 0}}
    properties = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{**VEC3, "count": claim}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0},
                        "extensions": {"KHR_draco_mesh_compression": extension},
                    }
                ]
            }
        ],
    }
    (tmp_path / "in.glb").write_bytes(glb_bytes(properties, data))
    status, lines = check(tmp_path / "in.glb", "compress")
    assert status == 2 and len(lines) == 1


def test_a_large_honest_file_is_within_the_limit(tmp_path):
    """The measurement can fail, and it does not for what the bytes hold."""
    positions, triangles = grid_mesh(300, 300)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    path = builder.write(tmp_path / "in.glb")
    status, _ = check(path, "compress")
    assert status == 0
