"""The installed CMake package: what it holds, and programs in C11 and C++11 that use it."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gltf_ext
from gltf_ext.sources.importers import open_model
from tests.helpers import interface_program
from tests.helpers.environment import ROOT, missing
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, grid_mesh
from tests.helpers.native import folder_of
from tools.native_build import build_folder, find_cmake

CONSUMER = ROOT / "tests" / "codec" / "package"
SMALL = ROOT / "spec" / "vectors" / "valid_group_tables.bin"


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, **options)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Where the package is installed: from the folder of the native tests, built already."""
    prefix = tmp_path_factory.mktemp("prefix")
    run(find_cmake(), "--install", folder_of("MESHLET_NATIVE_TESTS"), "--prefix", prefix)
    return prefix


def assert_works(folder, tmp_path):
    assert "triangles, " in run(folder / "count", SMALL)
    records = interface_program.run([folder / "files"], interface_program.blobs(), tmp_path)
    interface_program.check_vectors(records)


@pytest.mark.parametrize("library", ["gltf_meshlet", "static", "decoder"])
def test_cmake_package(library, prefix, tmp_path):
    options = (f"-DCMAKE_PREFIX_PATH={prefix}", f"-DLIBRARY=gltf_meshlet::{library}")
    assert_works(build_folder(CONSUMER, tmp_path / "build", *options), tmp_path)


@pytest.mark.full
@pytest.mark.parametrize("library", ["gltf_meshlet", "static"])
def test_subproject(library, tmp_path):
    """FetchContent, which uses add_subdirectory: builds the codec again."""
    options = (f"-DSOURCE={ROOT}", f"-DLIBRARY=gltf_meshlet::{library}")
    assert_works(build_folder(CONSUMER, tmp_path / "build", *options), tmp_path)


@pytest.mark.parametrize("static", [False, True])
def test_pkg_config(static, prefix, tmp_path):
    if not shutil.which("pkg-config"):
        missing("pkg-config is not installed")
    (folder,) = prefix.glob("lib*/pkgconfig")
    environment = {**os.environ, "PKG_CONFIG_PATH": str(folder)}
    flags = ("--static",) if static else ()
    found = run("pkg-config", *flags, "--cflags", "--libs", "gltf_meshlet", env=environment)
    arguments = found.split()
    if static:  # the file: the linker would prefer the shared library
        place = arguments.index("-lgltf_meshlet")
        arguments[place : place + 1] = [
            "-DGLTF_MESHLET_STATIC",
            f"{folder.parent}/libgltf_meshlet.a",
        ]
    program = tmp_path / "program"
    source = CONSUMER / "count.cpp"
    run("g++", "-std=c++11", source, *arguments, f"-Wl,-rpath,{folder.parent}", "-o", program)
    assert "triangles, " in run(program, SMALL)


def write_packed(packed: Path, unpacked: Path) -> None:
    """A file that is packed for download, and the same without."""
    positions, triangles = grid_mesh(40, 40)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    gltf_ext.compress(builder.write(packed), unpacked)
    gltf_ext.transcode(unpacked, packed)
    assert open_model(packed).was_packed


def test_example_loads_a_model(prefix, tmp_path):
    """examples/cpp_loader: a C++11 program with tinygltf, beside gltf_ext."""
    headers = (Path("/usr/include", name) for name in ("tiny_gltf.h", "nlohmann/json.hpp"))
    if not all(header.exists() for header in headers):
        hint = "Debian: apt install libtinygltf-dev nlohmann-json3-dev"
        missing(f"tinygltf is not installed ({hint})")
    attributes, triangles, _ = everything()
    builder = Builder()
    builder.mesh(attributes, triangles, normalized=NORMALIZED)
    builder.write(tmp_path / "in.glb")
    gltf_ext.compress(tmp_path / "in.glb", tmp_path / "out.glb")
    (folder,) = prefix.glob("lib*/pkgconfig")
    environment = {**os.environ, "PKG_CONFIG_PATH": str(folder)}
    found = run("pkg-config", "--cflags", "--libs", "gltf_meshlet", env=environment).split()
    source = ROOT / "examples" / "cpp_loader" / "load.cpp"
    program = tmp_path / "load"
    run("g++", "-std=c++11", source, *found, f"-Wl,-rpath,{folder.parent}", "-o", program)
    printed = run(program, tmp_path / "out.glb")
    write_packed(tmp_path / "packed.glb", tmp_path / "unpacked.glb")
    assert run(program, tmp_path / "packed.glb") == run(program, tmp_path / "unpacked.glb")
    (primitive,) = gltf_ext.load(tmp_path / "out.glb")
    assert printed.startswith(f"{len(primitive.indices)} triangles\n")
    positions = primitive.attributes["POSITION"]
    bounds = zip(positions.min(axis=0), positions.max(axis=0))
    line = next(line for line in printed.splitlines() if line.startswith("  POSITION, "))
    assert line.startswith(f"  POSITION, {len(positions)} vertices: ")
    numbers = [tuple(map(float, word.split(".."))) for word in line.split(": ")[1].split()]
    assert np.array_equal(np.float32(numbers), np.float32(list(bounds)))
    assert all(f"  {name}, " in printed for name in primitive.attributes)
    for name in ("out.glb", "packed.glb"):
        (tmp_path / "cut.glb").write_bytes((tmp_path / name).read_bytes()[:-100])
        refused = subprocess.run([program, tmp_path / "cut.glb"], capture_output=True, text=True)
        assert refused.returncode == 2
        assert len(refused.stderr.splitlines()) == 1


def test_header_is_plain_c(prefix):
    header = prefix / "include" / "gltf_meshlet.h"
    for standard in ("c99", "c11"):
        command = ("gcc", f"-std={standard}", "-Wall", "-Wextra", "-pedantic", "-Werror")
        run(*command, "-fsyntax-only", "-x", "c", header)


def test_shared_library_shows_the_interface_and_nothing_else(prefix):
    (library,) = prefix.glob("lib*/libgltf_meshlet.so")
    symbols = [line.split()[-1] for line in run("nm", "-D", "--defined-only", library).splitlines()]
    headers = [path.read_text() for path in (ROOT / "codec" / "c").glob("*.h")]
    header = "".join(headers)
    declared = set(re.findall(r"\bgltf_meshlet_\w+(?=\()", header))
    assert set(symbols) == declared
    assert "libgltf_meshlet.so.1" in run("objdump", "-p", library)


@pytest.mark.parametrize("name", ["gltf_meshlet", "gltf_meshlet_decoder"])
def test_static_library_has_one_prefix(name, prefix):
    """Functions of the interface, and the codec's namespace; templates of the standard library are
    every program's."""
    (library,) = prefix.glob(f"lib*/lib{name}.a")
    listed = run("nm", "-gC", "--defined-only", library).splitlines()
    # Weak ones, V and W, may be merged: those of templates with arguments of the library only.
    strong = {line.split(" ", 2)[2] for line in listed if re.match(r"\w+ [ABCDGRST] ", line)}
    ours = re.compile(r"^(gltf_meshlet_|(vtable for |typeinfo (name )?for )?gltf_meshlet_codec::)")
    assert len(strong) > 20
    assert sorted(name for name in strong if not ours.match(name)) == []


def test_licence_is_installed(prefix):
    assert (prefix / "share" / "licenses" / "gltf_meshlet" / "LICENSE").exists()
