"""Bytes and levels are the same for every compiler, optimisation level and number of threads."""

from __future__ import annotations

import os
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.helpers.environment import ROOT
from tests.helpers.native import program_of

FLAGS = ["-std=c++17", "-ffp-contract=off", "-pthread", f"-I{ROOT / 'codec'}"]
DIGEST = ROOT / "tests" / "codec" / "native" / "encode_digest.cpp"


def sources() -> list[Path]:
    """The codec, and the program that prints digests of the encoder's bytes and of levels."""
    names = ("common", "format", "segment", "encode", "decode", "transport", "lod")
    folders = [ROOT / "codec" / name for name in names]
    sources = sorted(path for folder in folders for path in folder.glob("*.cpp"))
    return [*sources, ROOT / "codec" / "processors.cpp", DIGEST]


def build(compiler: str, level: str, folder: Path) -> Path:
    """Compiles the sources in parallel; returns the program."""

    def compiled(source: Path) -> Path:
        target = folder / f"{source.parent.name}_{source.stem}.o"
        subprocess.run([compiler, level, *FLAGS, "-c", source, "-o", target], check=True)
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, sources()))
    subprocess.run([compiler, "-pthread", *objects, "-o", folder / "digest"], check=True)
    return folder / "digest"


def digests(program: Path) -> str:
    done = subprocess.run([program], check=True, capture_output=True, text=True, timeout=300)
    return done.stdout


@pytest.mark.parametrize(
    ("compiler", "level"),
    [
        ("g++", "-O0"),
        ("clang++", "-O0"),
        pytest.param("g++", "-O3", marks=pytest.mark.full),
        pytest.param("clang++", "-O2", marks=pytest.mark.full),
    ],
)
def test_same_bytes_from_every_build(compiler, level, tmp_path):
    """Compares with the build of CMakeLists.txt, the one that users get."""
    if shutil.which(compiler) is None:  # also with --full: one compiler is enough to build us
        pytest.skip(f"{compiler} is not installed")
    expected = digests(program_of("MESHLET_NATIVE_TESTS", "encode_digest"))
    assert len(expected.splitlines()) == 8
    assert digests(build(compiler, level, tmp_path)) == expected
