"""The decoder as one file: builds without exceptions, decodes the vectors under any options."""

import importlib.util
import platform
import shutil
import subprocess
import sys

import pytest

from tests.helpers import interface_program
from tests.helpers.environment import missing
from tools import amalgamate

# Options that fuse multiplications and additions unless the file forbids it; the processor of every
# machine that runs these tests has them.
HASWELL = ("-march=haswell",) if platform.machine() == "x86_64" else ()
PLAIN = ("-std=c++17", "-O1", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("amalgamation")
    amalgamate.main([str(path)])
    return path


def compile_program(folder, cxx, cc, *options):
    """Builds files.c with the decoder; returns the program's path."""
    command = [*cxx, *PLAIN, "-pedantic", *options, "-c", "gltf_meshlet.cpp", "-o", "decoder.o"]
    run(command, folder)
    return link_program(folder, cxx, cc, "decoder.o")


def link_program(folder, cxx, cc, decoder):
    strict = [*cc, *interface_program.STRICT]
    run([*strict, "-I.", "-c", interface_program.SOURCE, "-o", "program.o"], folder)
    run([*cxx, "program.o", decoder, "-o", "program"], folder)
    return folder / "program"


def run(command, folder):
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize(
    ("cxx", "cc", "options"),
    [
        ("g++", "gcc", HASWELL),
        pytest.param("g++", "gcc", ("-O3",), marks=pytest.mark.full),
        pytest.param("clang++", "clang", HASWELL, marks=pytest.mark.full),
    ],
)
def test_decodes_all_vectors(cxx, cc, options, folder, tmp_path):
    if not shutil.which(cxx):
        missing(f"{cxx} is not installed")
    program = compile_program(folder, [cxx], [cc], *options)
    interface_program.check_vectors(
        interface_program.run([program], interface_program.blobs(), tmp_path)
    )


@pytest.mark.full
def test_decodes_all_vectors_with_options_of_microsofts_compiler(folder, tmp_path):
    """Clang's cl mode, and its ways of reading C++. Microsoft's own headers are not to be had."""
    if not shutil.which("clang++"):
        missing("clang++ is not installed")
    cl = ["clang++", "--driver-mode=cl", f"--target={platform.machine()}-pc-linux-gnu"]
    options = ["/GR-", "/EHs-c-", "/W4", "/WX", "/fp:precise", *(["/arch:AVX2"] if HASWELL else [])]
    dialect = ["/clang:-std=c++17", "/clang:-O2", "-fms-extensions", "-fdelayed-template-parsing"]
    command = [*cl, *options, *dialect, "/c", "gltf_meshlet.cpp", "/Fomicrosoft.o"]
    run(command, folder)
    program = link_program(folder, ["clang++"], ["clang"], "microsoft.o")
    records = interface_program.run([program], interface_program.blobs(), tmp_path)
    interface_program.check_vectors(records)


def test_compiles_for_webassembly(folder):
    if importlib.util.find_spec("ziglang") is None:
        missing("the Python package ziglang is not installed (make web installs it)")
    command = [sys.executable, "-m", "ziglang", "c++", "-target", "wasm32-wasi", "-msimd128"]
    source = ["-c", "gltf_meshlet.cpp", "-o", "wasm.o"]
    run([*command, *PLAIN, *source], folder)


def test_refuses_fast_math(folder):
    command = ["g++", "-std=c++17", "-ffast-math", "-fsyntax-only", "gltf_meshlet.cpp"]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert "without -ffast-math" in result.stderr


def test_uses_no_other_file(folder):
    text = (folder / "gltf_meshlet.cpp").read_text()
    assert [line for line in text.splitlines() if line.startswith('#include "')] == [
        '#include "gltf_meshlet.h"'
    ]
