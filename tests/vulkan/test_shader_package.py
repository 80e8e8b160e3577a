"""The GPU decoder for engines: each language compiles and decodes the conformance vectors."""

from __future__ import annotations

import importlib.util
import re
import shutil
import struct
import subprocess
import zipfile

import numpy as np
import pytest

from gltf_ext import _codec
from tests.helpers.environment import ROOT, missing
from tests.helpers.gltf_builder import Builder, grid_mesh
from tests.helpers.vulkan_scenes import require_vulkan
from tools import build_shader_package
from tools.spirv import instructions, words_of

VECTORS = sorted((ROOT / "spec" / "vectors").glob("*.bin"))
OP_SOURCE = 3
GLSLANG = ("glslangValidator", "-V", "-S", "comp", "--target-env", "vulkan1.1", "-I..")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The unpacked package; its examples are the current folder of compilers."""
    folder = tmp_path_factory.mktemp("shaders")
    build_shader_package.main([str(folder)])
    (path,) = folder.glob("*.zip")
    zipfile.ZipFile(path).extractall(folder)
    return folder


def test_manual_has_no_link_to_a_missing_file(package):
    for target in re.findall(r"\]\(([^)]+)\)", (package / "README.md").read_text()):
        assert target.startswith("https:") or (package / target).exists(), target


def glslang(package, *arguments) -> bytes:
    if not shutil.which("glslangValidator"):
        missing("glslangValidator is not installed (Debian: apt install glslang-tools)")
    output = package / "compiled.spv"
    command = [*GLSLANG, *arguments, "-o", str(output)]
    result = subprocess.run(command, cwd=package / "examples", capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
    return output.read_bytes()


def slang(package, *options: str) -> bytes:
    if importlib.util.find_spec("slangpy") is None:
        missing("the Python package slangpy is not installed (make web installs it)")
    from tools.build_wgsl import Slang

    # By the suffix .hlsl, Slang would give loop variables the scope that they had in old HLSL.
    source = package / "examples" / "decode.slang"
    source.write_text(source.with_suffix(".hlsl").read_text())
    return Slang().compile(
        source, ["main"], "-lang", "slang", f"-I{package}", "-profile", "sm_6_0", *options
    )


def without_language(code: bytes) -> bytes:
    """SPIR-V without OpSource: Debian's tools do not know the number of the language Slang."""
    words = words_of(code)
    for position, opcode in list(instructions(words)):
        if opcode == OP_SOURCE:
            end = position + (words[position] >> 16)
            return struct.pack(f"<{len(words) + position - end}I", *words[:position], *words[end:])
    return code


COMPILERS = {
    "GLSL": lambda package: glslang(package, "decode.comp"),
    "HLSL": lambda package: glslang(package, "-D", "-e", "main", "decode.hlsl"),
    "Slang": lambda package: without_language(slang(package, "-target", "spirv")),
}


@pytest.fixture(scope="module")
def device():
    require_vulkan()
    from vk_backend.gpu.device import Device

    with Device(validation=True) as device:
        yield device
        assert device.messages == []


def host():
    path = ROOT / "examples" / "gpu_decode" / "decode.py"
    spec = importlib.util.spec_from_file_location("gpu_decode", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def assert_as_on_the_cpu(blob: bytes, decoded) -> None:
    summaries, triangles, integers = decoded
    expected = _codec.Decoder(blob)
    for m in range(expected.meshlet_count):
        try:
            local, streams = expected.decode_meshlet(m)
        except ValueError:
            assert summaries[m] >> 16 != 0
            continue
        assert summaries[m] == len(local) | len(streams[0]) << 8
        corners = triangles[m, : len(local), None] >> np.uint32([0, 8, 16]) & 255
        assert np.array_equal(corners, local)
        assert np.array_equal(integers[m, :, : len(streams[0])].T, np.hstack(streams))


# A driver for the CPU takes half a minute to compile one of them.
@pytest.mark.parametrize(
    "language",
    [pytest.param(name, marks=[] if name == "HLSL" else pytest.mark.full) for name in COMPILERS],
)
def test_decodes_all_vectors(language, package, device):
    decoder, decoded = host().GpuDecoder(device, COMPILERS[language](package)), 0
    for path in VECTORS:
        view = path.read_bytes()
        try:
            for at, size in _codec.split(view):
                blob = view[at : at + size]
                assert_as_on_the_cpu(blob, decoder.decode(blob))
        except ValueError:  # a malformed header, or more streams than the example has room for
            assert "malformed" in path.name or path.name == "valid_64_streams.bin"
            continue
        decoded += 1
    assert decoded > len(VECTORS) // 2


@pytest.mark.parametrize("language", COMPILERS)
def test_compiles_to_valid_spirv(language, package):
    if not shutil.which("spirv-val"):
        missing("spirv-val is not installed (Debian: apt install spirv-tools)")
    code = COMPILERS[language](package)
    result = subprocess.run(["spirv-val"], input=code, capture_output=True)
    assert result.returncode == 0, result.stdout


def test_example_opens_a_model(package, tmp_path, monkeypatch, capsys):
    require_vulkan()
    import gltf_ext

    points, indices = grid_mesh(24, 24)
    model = Builder()
    model.mesh({"POSITION": points}, indices)
    model.write(tmp_path / "model.glb")
    gltf_ext.compress(tmp_path / "model.glb", tmp_path / "out.glb")
    (package / "decode.spv").write_bytes(COMPILERS["HLSL"](package))
    gltf_ext.transcode(tmp_path / "out.glb", tmp_path / "packed.glb")
    for name in ("out.glb", "packed.glb"):
        host().main(package / "decode.spv", tmp_path / name)
        assert "1058 triangles, 0 malformed" in capsys.readouterr().out


def test_slang_translates_to_hlsl(package):
    text = slang(package, "-target", "hlsl").decode()
    assert "numthreads(32, 1, 1)" in text
