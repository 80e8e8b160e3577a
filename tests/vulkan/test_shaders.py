"""The shipped SPIR-V is valid and up to date, and so are its constants."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from tools import build_shaders, shader_sources
from tools.spirv import OP_DECORATE, instructions, words_of
from vk_backend.constants import CONSTANTS, read_constants
from vk_backend.reflection import shipped_reflection

MODULES = build_shaders.modules()


def test_nothing_is_stale_or_left_over():
    assert build_shaders.stale_modules("vk_backend") == [], "run make shaders"
    assert set(shipped_reflection()["modules"]) == set(MODULES)
    assert {path.name for path in build_shaders.OUTPUT.glob("*.spv")} == {
        f"{name}.spv" for name in MODULES
    }


def test_spirv_is_small():
    """Every installation has it: its limit in bytes, as `make lines` counts."""
    assert sum(path.stat().st_size for path in build_shaders.OUTPUT.glob("*.spv")) <= 2_200_000


@pytest.mark.parametrize("source", sorted({source for source, _ in MODULES.values()}), ids=str)
def test_every_shader_opens_with_a_description(source):
    assert source.read_text().startswith("// ")


def test_digest_follows_sources_includes_and_macros(tmp_path, monkeypatch):
    monkeypatch.setattr(shader_sources, "include_folders", lambda: (tmp_path,))
    shader, included = tmp_path / "a.comp", tmp_path / "b.glsl"
    shader.write_text('#include "b.glsl"\n')
    included.write_text("int x;\n")
    first = build_shaders.digest(shader, [])
    assert build_shaders.digest(shader, []) == first
    assert build_shaders.digest(shader, ["IDS"]) != first
    included.write_text("int y;\n")
    assert build_shaders.digest(shader, []) != first


def test_constants_are_those_of_the_headers():
    definitions = []
    for header in build_shaders.HEADERS:
        text = header.read_text()
        assert (build_shaders.OUTPUT / header.name).read_text() == text
        assert read_constants(text).items() <= CONSTANTS.items()
        definitions += re.findall(r"^#define (\w+)[ \\]+\s*\S", text, re.MULTILINE)
    assert sorted(definitions) == sorted(CONSTANTS), "every definition is one integer, made once"
    assert CONSTANTS["BLOB_MAGIC"] == int.from_bytes(b"EBM1", "little")


def test_records_have_the_size_that_the_host_knows():
    strides = shipped_reflection()["strides"]
    assert strides["Found"] == strides["Level"] == CONSTANTS["RECORD_BYTES"]


@pytest.mark.parametrize("name", sorted(MODULES))
def test_module_is_valid(name):
    if not shutil.which("spirv-val"):
        pytest.skip("spirv-val is not installed (Debian: apt install spirv-tools)")
    path = build_shaders.OUTPUT / f"{name}.spv"
    result = subprocess.run(
        ["spirv-val", "--target-env", "vulkan1.3", str(path)], capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout + result.stderr


# Drivers expand these to products and sums and may fuse them, even if decorated NoContraction.
# FMix, Length, Distance, Cross, Normalize, FaceForward, Reflect, Refract of GLSL.std.450.
INEXACT = {46, 66, 67, 68, 69, 70, 71, 72}
# OpVectorTimesMatrix, OpMatrixTimesVector, OpMatrixTimesMatrix, OpDot.
INEXACT_OPERATORS = {144, 145, 146, 148}


def float_arithmetic(code: bytes) -> tuple[set[int], set[int]]:
    """(results of a module's float arithmetic, those that are decorated NoContraction)"""
    words = words_of(code)
    found = list(instructions(words))
    results = {words[p + 2] for p, opcode in found if build_shaders.is_arithmetic(words, p, opcode)}
    decorations = [words[p + 1 : p + 3] for p, opcode in found if opcode == OP_DECORATE]
    return results, results & {
        target for target, decoration in decorations if decoration == build_shaders.NO_CONTRACTION
    }


def test_ray_tracing_is_exact():
    """Drivers must not fuse arithmetic differently in differently specialised pipelines."""
    exact = [
        name for name, (source, _) in MODULES.items() if source.suffix in build_shaders.EXACT_STAGES
    ]
    assert {"rt_camera.rgen", "rt_meshlets.rint", "rt_surface.rchit", "rt_alpha.rahit"} <= set(
        exact
    )
    for name in exact:
        code = (build_shaders.OUTPUT / f"{name}.spv").read_bytes()
        results, decorated = float_arithmetic(code)
        assert results and results == decorated, name
        assert build_shaders.exact(code) == code
        words = words_of(code)
        found = list(instructions(words))
        extended = {words[p + 4] for p, opcode in found if opcode == build_shaders.OP_EXTENDED}
        assert not extended & INEXACT, name
        assert not {opcode for _, opcode in found} & INEXACT_OPERATORS, name
    others, decorated = float_arithmetic(
        (build_shaders.OUTPUT / "surface_texcoord.frag.spv").read_bytes()
    )
    assert others - decorated
