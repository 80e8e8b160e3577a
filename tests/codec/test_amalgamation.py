"""The decoder as one file: builds without exceptions, decodes the vectors under any options."""

import importlib.util
import platform
import re
import shutil
import subprocess
import sys

import pytest

from tests.helpers import interface_program
from tests.helpers.environment import ROOT, missing
from tools import amalgamate

# Options that fuse multiplications and additions unless the file forbids it; the processor of every
# machine that runs these tests has them.
HASWELL = ("-march=haswell",) if platform.machine() == "x86_64" else ()
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")
ENGINE = ("-std=c++17", "-O1", "-fno-exceptions", "-fno-rtti")
PLAIN = (*ENGINE, *STRICT)
PROGRAMS = ROOT / "tests" / "codec" / "package"
TRANSPORT = ROOT / "spec" / "transport_vectors"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("amalgamation")
    amalgamate.main([str(path)])
    return path


def compile_program(folder, cxx, cc, *options):
    """Builds files.c with the decoder; returns the program's path."""
    command = [*cxx, *PLAIN, "-pedantic", *options, "-c", "gltf_meshlet.cpp", "-o", "decoder.o"]
    assert run(command, folder) == ""
    return link_program(folder, cxx, cc, "decoder.o")


def link_program(folder, cxx, cc, decoder, source=interface_program.SOURCE, options=()):
    strict = [*cc, *interface_program.STRICT, *options]
    run([*strict, "-I.", "-c", source, "-o", "program.o"], folder)
    run([*cxx, *options, "program.o", decoder, "-o", "program", "-lpthread", "-lm"], folder)
    return folder / "program"


def run(command, folder):
    """What the command prints as notes and warnings."""
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stderr


def sanitized_program(folder, source, sanitizer):
    if not shutil.which("g++"):
        missing("g++ is not installed")
    options = [f"-fsanitize={sanitizer}", "-g"]
    run(["g++", *ENGINE, *options, "-c", "gltf_meshlet.cpp", "-o", "checked.o"], folder)
    return link_program(folder, ["g++"], ["gcc"], "checked.o", PROGRAMS / source, options)


def test_failed_allocations_are_statuses(folder):
    """Without exceptions, each allocation fails once. Under ASan and UBSan."""
    program = sanitized_program(folder, "memory.c", "address,undefined")
    for packed in sorted(TRANSPORT.glob("valid*.bin"))[:3]:
        run([program, interface_program.VECTORS / "valid_group_tables.bin", packed], folder)


def test_formats_and_bounds(folder):
    """Every vertex format, in every way to decode, beside floats; under ASan and UBSan."""
    program = sanitized_program(folder, "formats.c", "address,undefined")
    vectors = interface_program.VECTORS
    run(
        [program, *sorted(vectors.glob("valid_*.bin")), *sorted(vectors.glob("view_*.bin"))], folder
    )


def test_threads_share_a_view_and_its_arrays(folder):
    """A queue of ranges, under ThreadSanitizer."""
    program = sanitized_program(folder, "jobs.c", "thread")
    # ThreadSanitizer of older compilers needs addresses that are not spread over all of memory.
    fixed = ["setarch", "-R"] if shutil.which("setarch") else []
    run([*fixed, program, *sorted(interface_program.VECTORS.glob("valid_*.bin"))], folder)


def test_defines_no_symbol_but_the_interface(folder):
    """An engine may have a namespace of any name."""
    if not shutil.which("g++") or not shutil.which("nm"):
        missing("g++ and nm are not installed")
    run(["g++", *PLAIN, "-c", "gltf_meshlet.cpp", "-o", "symbols.o"], folder)
    listed = subprocess.run(
        ["nm", "-g", "--defined-only", folder / "symbols.o"], stdout=-1, text=True
    )
    names = [line.split()[-1] for line in listed.stdout.splitlines()]
    assert len(names) > 10
    assert [name for name in names if not name.startswith("gltf_meshlet_")] == []


@pytest.mark.skipif(platform.machine() != "x86_64", reason="AVX2 is of x86-64")
def test_code_for_avx2_stays_apart(folder):
    """No function that any processor runs, the libraries' templates included, has AVX2's."""
    if not shutil.which("g++") or not shutil.which("objdump"):
        missing("g++ and objdump are not installed")
    run(["g++", *PLAIN, "-c", "gltf_meshlet.cpp", "-o", "apart.o"], folder)
    listed = subprocess.run(["objdump", "-dC", folder / "apart.o"], stdout=-1, text=True).stdout
    functions = re.split(r"^[0-9a-f]+ (?=<)", listed, flags=re.MULTILINE)
    names = {text.partition(">:")[0] for text in functions if re.search("%ymm|bzhi|pdep", text)}
    assert len(names) > 10
    assert [name for name in names if "::avx2::" not in name] == []


@pytest.mark.skipif(platform.machine() != "x86_64", reason="AVX2 is of x86")
@pytest.mark.parametrize(("bits", "has"), [("-m64", "1"), ("-m32", "0")])
def test_avx2_is_for_64_bits(bits, has, tmp_path):
    """Those of 32 lack instructions that the code for AVX2 has."""
    if not shutil.which("g++"):
        missing("g++ is not installed")
    source = f'#include "decode/build.h"\nstatic_assert(MESHLET_AVX2 == {has}, "");\n'
    (tmp_path / "a.cpp").write_text(source)
    options = (bits, *HASWELL, "-std=c++17", "-I", ROOT / "codec", "-fsyntax-only")
    assert run(["g++", *options, "a.cpp"], tmp_path) == ""


def test_avx2_begin_lists_the_headers_that_are_compiled_again():
    """Without #undef of its guard, a header's code would be that of any processor."""
    codec = ROOT / "codec"
    again = {
        guard
        for room in ("decode", "transport")
        for path in (codec / room).glob("*.h")
        for guard in re.findall(r"^#ifndef ([A-Z_0-9]+_H)$", path.read_text(), re.MULTILINE)
    }
    begin = (codec / "decode" / "avx2_begin.h").read_text()
    listed = set(re.findall(r"^#undef ([A-Z_0-9]+_H)$", begin, re.MULTILINE))
    assert listed == again


def test_is_made_without_packages(tmp_path):
    """By Python alone, as the shader package is; with the licence."""
    for module in ("amalgamate", "build_shader_package"):
        command = [sys.executable, "-S", "-m", f"tools.{module}", tmp_path]
        subprocess.run(command, cwd=ROOT, check=True)
    assert (tmp_path / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()


@pytest.mark.parametrize(
    ("cxx", "cc", "options"),
    [
        ("g++", "gcc", ()),
        ("g++", "gcc", HASWELL),
        ("g++", "gcc", ("-DGLTF_MESHLET_NO_AVX2",)),
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


@pytest.mark.parametrize(
    "options",
    [
        ("-target", "wasm32-wasi", "-msimd128"),
        ("-target", "wasm32-wasi"),
        ("-target", "x86_64-windows-gnu"),
        pytest.param(("-target", "x86-linux-gnu"), marks=pytest.mark.full),
    ],
)
def test_compiles_with_zig(options, folder):
    """Clang, without a warning."""
    if importlib.util.find_spec("ziglang") is None:
        missing("the Python package ziglang is not installed (make web installs it)")
    command = [sys.executable, "-m", "ziglang", "c++", *options, *PLAIN]
    assert run([*command, "-c", "gltf_meshlet.cpp", "-o", "zig.o"], folder) == ""


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["-ffast-math"], "without -ffast-math"),
        (["-funsafe-math-optimizations"], "without -funsafe-math-optimizations"),
        (["-freciprocal-math"], "without -funsafe-math-optimizations"),
        pytest.param(
            ["-mfpmath=387"],
            "compile for SSE2",
            marks=pytest.mark.skipif(platform.machine() != "x86_64", reason="x87 is of x86"),
        ),
    ],
)
def test_refuses_options_that_change_values(options, problem, folder):
    command = ["g++", "-std=c++17", *options, "-fsyntax-only", "gltf_meshlet.cpp"]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert problem in result.stderr


def test_uses_no_other_file(folder):
    text = (folder / "gltf_meshlet.cpp").read_text()
    assert [line for line in text.splitlines() if line.startswith('#include "')] == [
        '#include "gltf_meshlet.h"'
    ]
