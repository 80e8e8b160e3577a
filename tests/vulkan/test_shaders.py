"""The shipped SPIR-V is valid and up to date, and so are its constants."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from tools import build_shaders, shader_sources
from tools.spirv import DECORATION_SPEC_ID, OP_DECORATE, instructions, words_of
from vk_backend.gpu.constants import CONSTANTS, read_constants
from vk_backend.gpu.reflection import shipped_reflection, specialization_ids
from vk_backend.scene.buffers import team_bytes

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


# --- shared memory ---

WORKGROUP = 4  # storage class
# Operators of OpSpecConstantOp that the lengths of arrays use: IAdd, IMul, Select, UGreaterThan.
OPERATORS = {
    128: lambda a, b: a + b,
    132: lambda a, b: a * b,
    169: lambda condition, a, b: a if condition else b,
    172: lambda a, b: a > b,
}


def workgroup_bytes(name: str, constants: dict[str, int]) -> int:
    """Shared memory of a module's workgroup with these specialisation constants."""
    words = words_of((build_shaders.OUTPUT / f"{name}.spv").read_bytes())
    chosen = specialization_ids(name, constants)
    specialized: dict[int, int] = {}  # id of a constant -> its specialisation id
    values: dict[int, int] = {}
    sizes: dict[int, int] = {}  # of types
    pointed: dict[int, int] = {}
    total = 0
    for position, opcode in instructions(words):
        if opcode == 54:  # OpFunction: after all types, constants and shared variables
            break
        operands = words[position + 1 : position + (words[position] >> 16)]
        first, rest = operands[0], operands[1:]
        if opcode == OP_DECORATE and rest[0] == DECORATION_SPEC_ID:
            specialized[first] = rest[1]
        elif opcode in (43, 50):  # OpConstant, OpSpecConstant
            values[rest[0]] = chosen.get(specialized.get(rest[0]), rest[1])
        elif opcode == 52 and rest[1] in OPERATORS:  # OpSpecConstantOp
            inputs = [values.get(i) for i in rest[2:]]
            if None not in inputs:
                values[rest[0]] = OPERATORS[rest[1]](*inputs)
        elif opcode == 20:  # OpTypeBool
            sizes[first] = 4
        elif opcode in (21, 22):  # OpTypeInt, OpTypeFloat
            sizes[first] = rest[0] // 8
        elif opcode == 23:  # OpTypeVector
            sizes[first] = sizes[rest[0]] * rest[1]
        elif opcode == 28 and rest[0] in sizes and rest[1] in values:  # OpTypeArray
            sizes[first] = sizes[rest[0]] * values[rest[1]]
        elif opcode == 30 and all(i in sizes for i in rest):  # OpTypeStruct
            sizes[first] = sum(sizes[i] for i in rest)
        elif opcode == 32:  # OpTypePointer
            pointed[first] = rest[1]
        elif opcode == 59 and rest[1] == WORKGROUP:  # OpVariable
            total += sizes[pointed[first]]
    return total


@pytest.mark.parametrize(("elements", "streams"), [(1, 1), (5, 2), (12, 5), (86, 8)])
def test_a_team_needs_no_more_shared_memory_than_the_host_demands(elements, streams):
    """Of path mesh and of the filling of ray tracing's cache, the bound is the exact sum."""
    shape = {"MAX_ELEMENTS": elements, "MAX_STREAMS": streams}
    most = team_bytes(elements, streams)
    used = {name: workgroup_bytes(name, shape) for name in MODULES}
    assert used["mesh.mesh"] == used["rt_fill.comp"] == most == max(used.values())
    paper = {"PAYLOAD_WORDS": CONSTANTS["PAPER_WORDS"], "MESH_THREADS": 16}
    assert 0 < workgroup_bytes("mesh.mesh", shape | paper) < most
