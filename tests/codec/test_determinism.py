"""The encoder's bytes are the same for every compiler, optimisation level and number of threads."""

import shutil
import subprocess

import pytest

from tests.helpers.environment import ROOT

BUILDS = [("g++", "-O0"), ("g++", "-O3"), ("clang++", "-O0"), ("clang++", "-O2")]
FLAGS = ["-std=c++17", "-ffp-contract=off", "-pthread", f"-I{ROOT / 'codec'}"]


def sources():
    """The codec without binding and fuzz target, and the program that prints digests."""
    codec = [
        path
        for folder in ("common", "format", "segment", "encode", "decode")
        for path in (ROOT / "codec" / folder).glob("*.cpp")
    ]
    return [*sorted(codec), ROOT / "tests" / "codec" / "native" / "encode_digest.cpp"]


def digests(compiler, level, folder):
    """The program's output with this compiler and level, or None without the compiler."""
    if shutil.which(compiler) is None:
        return None
    program = folder / f"digest_{compiler.strip('+')}{level}"
    subprocess.run([compiler, level, *FLAGS, *sources(), "-o", program], check=True)
    return subprocess.run([program], check=True, capture_output=True, text=True, timeout=300).stdout


def test_same_bytes_from_every_build(tmp_path):
    found = {build: digests(*build, tmp_path) for build in BUILDS}
    built = {build: text for build, text in found.items() if text is not None}
    if len(built) < 2:
        pytest.skip("needs g++ or clang++")
    assert len(set(built.values())) == 1, built
