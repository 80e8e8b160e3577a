"""The library of each wheel beside GCC's: conformance vectors, encoded bytes, levels, refusals."""

import re
import shutil
import sys
import zipfile

import pytest

from tests.helpers import interface_program
from tests.helpers.environment import ROOT, need_package
from tests.helpers.platforms import RUNS, need_platform, run, wheel_of
from tools import build_wheels
from tools.native_build import build_folder

pytestmark = pytest.mark.platforms
HEADERS = ROOT / "codec" / "c"
PROGRAMS = (
    ROOT / "tests" / "codec" / "package" / "files.c",
    ROOT / "tests" / "codec" / "package" / "levels.c",
    ROOT / "tests" / "codec" / "native" / "bad_arguments.cpp",
)
# Fused multiplications and additions would make another mesh.
OPTIONS = ("-O1", "-ffp-contract=off", f"-I{HEADERS}")
VECTOR = ROOT / "spec" / "vectors" / "valid_several_groups.bin"


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Folder with the programs, compiled by GCC with a library by GCC."""
    folder = tmp_path_factory.mktemp("reference")
    simplifier = f"-DMESHLET_SIMPLIFIER={build_wheels.find_simplifier()}"
    library = build_folder(ROOT, ROOT / "build" / "platforms", simplifier)
    for source in PROGRAMS:
        compiler = ["gcc", "-std=c11"] if source.suffix == ".c" else ["g++", "-std=c++17"]
        link = (f"-L{library}", "-lgltf_meshlet", f"-Wl,-rpath,{library}", "-pthread")
        run([*compiler, *OPTIONS, source, *link, "-o", source.stem], folder)
    return folder


@pytest.fixture(scope="module", params=RUNS)
def programs(request, tmp_path_factory):
    """(Name -> command of a program of a platform, its folder)."""
    need_package("ziglang")
    tag = request.param
    need_platform(tag)
    folder = tmp_path_factory.mktemp(tag)
    with zipfile.ZipFile(wheel_of(tag)) as wheel:
        (name,) = (n for n in wheel.namelist() if re.fullmatch(r"gltf_ext/\w+\.(so|dll)", n))
        library = folder / name.removeprefix("gltf_ext/")
        library.write_bytes(wheel.read(name))
    zig = [sys.executable, "-m", "ziglang"]
    link = [library]
    if tag.startswith("win"):
        declared = re.findall(r"\b((?:gltf_meshlet|meshopt)_\w+)(?=\()", _sources())
        names = sorted({name for name in declared if not name.endswith("_h")})
        exports = f"LIBRARY {library.name}\nEXPORTS\n" + "\n".join(names) + "\n"
        (folder / "library.def").write_text(exports)
        link = [folder / "library.lib"]
        run([*zig, "dlltool", "-m", "i386:x86-64", "-d", "library.def", "-l", link[0]], folder)
    if tag.startswith("musl"):
        link.append("-dynamic")
    commands = {}
    for source in PROGRAMS:
        language = ["cc", "-std=c11"] if source.suffix == ".c" else ["c++", "-std=c++17"]
        target = build_wheels.PLATFORMS[tag].zig
        program = folder / (source.stem + (".exe" if tag.startswith("win") else ""))
        options = ["-target", target, *OPTIONS, "-Wl,-rpath,$ORIGIN", "-o", program]
        run([*zig, *language, *options, source, *link], folder)
        commands[source.stem] = [*RUNS[tag], program]
    return commands, folder


def _sources():
    headers = (HEADERS / f"gltf_meshlet{part}.h" for part in ("", "_internal"))
    return "".join(path.read_text() for path in (*headers, PROGRAMS[1]))


def test_vectors_and_encoded_bytes(programs, reference):
    commands, folder = programs
    files = [shutil.copy(path, folder) for path in interface_program.blobs()]
    names = [path.rpartition("/")[2] for path in map(str, files)]
    records = interface_program.run(commands["files"], names, folder)
    interface_program.check_vectors(records)
    expected = interface_program.run([reference / "files"], interface_program.blobs(), reference)
    assert interface_program.records_of(records) == interface_program.records_of(expected)


def test_levels(programs, reference):
    commands, folder = programs
    run([*commands["levels"], "levels.out"], folder)
    run(["./levels", "levels.out"], reference)
    assert (folder / "levels.out").read_bytes() == (reference / "levels.out").read_bytes()


def test_bad_arguments_give_a_status(programs):
    commands, folder = programs
    shutil.copy(VECTOR, folder)
    run([*commands["bad_arguments"], VECTOR.name], folder)
