"""The SPIR-V that is shipped is that of the sources, and valid."""

from __future__ import annotations

import json
import re
import shutil
import struct
import subprocess
from fnmatch import fnmatch

import pytest

from tests.helpers.environment import ROOT
from vk_backend import build_shaders
from vk_backend.constants import CONSTANTS, read_constants

MODULES = build_shaders.modules()


def test_nothing_is_stale_or_left_over():
    recorded = json.loads(build_shaders.MANIFEST.read_text())
    assert recorded == {
        name: build_shaders.digest(*made_from) for name, made_from in MODULES.items()
    }, "run python -m vk_backend.build_shaders"
    assert {path.name for path in build_shaders.OUTPUT.glob("*.spv")} == {
        f"{name}.spv" for name in MODULES
    }


# Described in docs/vulkan-raytracing.md.
RAY_TRACING = ("rt_*", "boxes.comp", "raytrace.py", "acceleration.py")


def test_documentation_names_every_file():
    table = [
        line.split("|")[1]
        for line in (ROOT / "docs" / "vulkan.md").read_text().splitlines()
        if line.startswith("| `")
    ]
    cells = [cell for row in table for cell in re.findall("`([^`]+)`", row)]
    named = [name.strip().rsplit("/", 1)[-1] for cell in cells for name in cell.split(",")]
    files = [
        path.name
        for path in [*build_shaders.SOURCES.iterdir(), *(ROOT / "vk_backend").glob("*.py")]
        if path.is_file()
    ]
    known = [*named, *RAY_TRACING, "__init__.py"]
    assert [name for name in files if not any(fnmatch(name, pattern) for pattern in known)] == []
    assert [
        name for name in named if "." in name and not any(fnmatch(file, name) for file in files)
    ] == [], "gone"


def test_digest_follows_sources_includes_and_macros(tmp_path, monkeypatch):
    monkeypatch.setattr(build_shaders, "SOURCES", tmp_path)
    shader, included = tmp_path / "a.comp", tmp_path / "b.glsl"
    shader.write_text('#include "b.glsl"\n')
    included.write_text("int x;\n")
    first = build_shaders.digest(shader, [])
    assert build_shaders.digest(shader, []) == first
    assert build_shaders.digest(shader, ["IDS"]) != first
    included.write_text("int y;\n")
    assert build_shaders.digest(shader, []) != first


def test_constants_are_the_header_s():
    header = (build_shaders.SOURCES / "constants.h").read_text()
    assert read_constants(header) == CONSTANTS
    definitions = re.findall(r"^#define (\w+) \S", header, re.MULTILINE)
    assert definitions == list(CONSTANTS), "every definition is one integer"
    assert CONSTANTS["BLOB_MAGIC"] == int.from_bytes(b"EBM1", "little")


@pytest.mark.parametrize("name", sorted(MODULES))
def test_module_is_valid(name):
    if not shutil.which("spirv-val"):
        pytest.skip("spirv-val is not installed (Debian: apt install spirv-tools)")
    path = build_shaders.OUTPUT / f"{name}.spv"
    result = subprocess.run(
        ["spirv-val", "--target-env", "vulkan1.3", str(path)], capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout + result.stderr


# Of these drivers make products and sums, decorated or not.
INEXACT = {
    46,
    66,
    67,
    68,
    69,
    70,
    71,
    72,
}  # FMix, Length, Distance, Cross, Normalize, FaceForward, Reflect, Refract
INEXACT_OPERATORS = {
    144,
    145,
    146,
    148,
}  # OpVectorTimesMatrix, OpMatrixTimesVector, OpMatrixTimesMatrix, OpDot


def float_arithmetic(code: bytes) -> tuple[set[int], set[int]]:
    """Results of a module's arithmetic with floats, and those of them that are decorated NoContraction."""
    words = struct.unpack(f"<{len(code) // 4}I", code)
    found = list(build_shaders.instructions(words))
    results = {words[p + 2] for p, opcode in found if build_shaders.is_arithmetic(words, p, opcode)}
    decorations = [words[p + 1 : p + 3] for p, opcode in found if opcode == build_shaders.DECORATE]
    return results, results & {
        target for target, decoration in decorations if decoration == build_shaders.NO_CONTRACTION
    }


def test_ray_tracing_is_exact():
    """Ray-tracing modules leave nothing for compilers to fuse, whichever constants they are specialised with."""
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
        words = struct.unpack(f"<{len(code) // 4}I", code)
        found = list(build_shaders.instructions(words))
        assert (
            not {words[p + 4] for p, opcode in found if opcode == build_shaders.EXTENDED} & INEXACT
        ), name
        assert not {opcode for _, opcode in found} & INEXACT_OPERATORS, name
    others, decorated = float_arithmetic(
        (build_shaders.OUTPUT / "surface_texcoord.frag.spv").read_bytes()
    )
    assert others - decorated
