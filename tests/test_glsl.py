"""The shaders compile: what the decoder that C++ and GLSL share must not lose while only C++ runs in the tests."""

import shutil
import subprocess

import pytest

from bench.common import ROOT

SHADERS = ROOT / "shaders"
PROGRAMS = sorted(path.name for path in SHADERS.glob("*.comp"))


@pytest.mark.parametrize("program", PROGRAMS)
def test_shader_compiles(program, tmp_path):
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    command = [compiler, "-V", "--target-env", "vulkan1.1", f"-I{SHADERS}", "-o", tmp_path / "program.spv", SHADERS / program]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stdout
