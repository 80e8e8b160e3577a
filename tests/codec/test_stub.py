"""gltf_ext/_codec.pyi, the types of the binding, is up to date."""

import ast
import subprocess
import sys

import pytest

from tests.helpers.environment import ROOT

pytest.importorskip("nanobind")


def syntax(text: str) -> str:
    """The stub without its layout, which ruff changes."""
    return ast.dump(ast.parse(text))


def test_stub_is_current(tmp_path):
    generated = tmp_path / "_codec.pyi"
    command = ["-m", "nanobind.stubgen", "-q", "-m", "gltf_ext._codec", "-o", str(generated)]
    subprocess.run([sys.executable, *command], check=True, cwd=ROOT)
    shipped = ROOT / "gltf_ext" / "_codec.pyi"
    assert syntax(shipped.read_text()) == syntax(generated.read_text()), (
        f"python -m nanobind.stubgen -m gltf_ext._codec -o {shipped}"
    )
