"""The wheels: what each contains and needs, and that it works in Pythons that have nothing else."""

import os
import re
import sys
import zipfile

import pytest

import gltf_ext
from gltf_meshlet.demo import model
from tests.helpers.environment import ROOT, missing, need_package
from tests.helpers.platforms import fill, run, wheel_of
from tools.blender_python import find_python
from tools.build_wheels import PLATFORMS
from tools.other_pythons import PYTHONS

pytestmark = pytest.mark.platforms
# Libraries that every system of the platform has.
SYSTEM = {
    "manylinux": r"(libc|libm|libdl|libpthread)\.so\.\d|ld-linux-.*\.so\.\d",
    "musllinux": r"libc\.so",
    "win": r"KERNEL32\.dll|ntdll\.dll|api-ms-win-crt-.*\.dll",
    "macosx": r"/usr/lib/libSystem\.B\.dylib",
}
OLDEST_GLIBC = (2, 17)
OLDEST_MACOS = 11
PROCESSORS = {
    "x86_64": ("X86_64", "AMD64"),
    "amd64": ("AMD64",),
    "aarch64": ("AARCH64",),
    "arm64": ("ARM64",),
}
SIMPLIFIER = {
    "meshopt_simplifyWithAttributes",
    "meshopt_partitionClusters",
    "meshopt_simplifyGuarded",
}


# --- what they contain ---


@pytest.fixture(params=PLATFORMS)
def wheel(request):
    """(Platform tag, file name -> contents)."""
    with zipfile.ZipFile(wheel_of(request.param)) as archive:
        return request.param, {name: archive.read(name) for name in archive.namelist()}


def test_a_wheel_has_one_library_and_the_licences(wheel):
    tag, files = wheel
    folder = f"gltf_meshlet-{gltf_ext.__version__}.dist-info"
    lines = files[f"{folder}/WHEEL"].decode().splitlines()
    assert [line for line in lines if line.startswith("Tag:")] == [f"Tag: py3-none-{tag}"]
    native = [name for name in files if re.search(r"\.(so|dll|dylib|pyd|a|lib|pdb)\b", name)]
    assert len(native) == 1 and native[0].startswith("gltf_ext/")
    licence = files[f"{folder}/licenses/meshoptimizer.txt"].decode()
    assert "Arseny Kapoulkine" in licence and "Permission is hereby granted" in licence


def test_a_library_shows_the_interface_and_needs_only_the_system(wheel):
    lief = need_package("lief")
    tag, files = wheel
    (name,) = (n for n in files if re.fullmatch(r"gltf_ext/\w+\.(so|dll|dylib)", n))
    library = lief.parse(files[name])
    if isinstance(library, lief.ELF.Binary):
        shown, needed = [s.name for s in library.exported_symbols], library.libraries
        processor = library.header.machine_type.name
        versions = [
            tuple(map(int, version.name.removeprefix("GLIBC_").split(".")))
            for requirement in library.symbols_version_requirement
            for version in requirement.get_auxiliary_symbols()
        ]
        assert bool(versions) == tag.startswith("manylinux")
        assert max(versions, default=OLDEST_GLIBC) <= OLDEST_GLIBC
    elif isinstance(library, lief.PE.Binary):
        shown = [entry.name for entry in library.get_export().entries]
        needed, processor = [i.name for i in library.imports], library.header.machine.name
    else:
        library = library.at(0) if isinstance(library, lief.MachO.FatBinary) else library
        shown = [s.name.removeprefix("_") for s in library.exported_symbols]
        needed = [i.name for i in library.libraries if i.name != f"@rpath/{name[9:]}"]
        processor = library.header.cpu_type.name
        assert library.build_version.minos[0] == OLDEST_MACOS
        assert library.has_code_signature or "x86_64" in tag  # macOS on ARM runs no other code
    header = (ROOT / "codec" / "c" / "gltf_meshlet.h").read_text()
    declared = set(re.findall(r"\bgltf_meshlet_\w+(?=\()", header))
    if tag.startswith("macosx"):  # Zig cannot hide libc++'s new and delete
        shown = [
            name for name in shown if not re.match("_Zn|_Zd|_mh_dylib_header|__dso_handle", name)
        ]
    assert set(shown) == declared | SIMPLIFIER
    pattern = SYSTEM[re.match("[a-z]+", tag)[0]]
    assert [n for n in needed if not re.fullmatch(pattern, n, re.IGNORECASE)] == []
    ending = next(end for end in PROCESSORS if tag.endswith(end))
    assert processor in PROCESSORS[ending]


# --- that they work ---


STEPS = (
    ("compress", "in.glb", "out.glb"),
    ("verify", "in.glb", "out.glb"),
    ("decompress", "out.glb", "plain.glb"),
    ("compress", "in.glb", "levels.glb", "--lod"),
    ("verify", "in.glb", "levels.glb"),
    ("decompress", "levels.glb", "coarse.glb", "--error", "0.01"),
    ("validate", "levels.glb"),
)


def results(command, folder):
    """Runs the commands on a generated model; returns the written files."""
    for arguments in STEPS:
        run([*command, "-m", "gltf_meshlet", *arguments], folder)
    return {path.name: path.read_bytes() for path in folder.glob("*.glb")}


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """A part of the demo's model, and what this checkout writes."""
    folder = tmp_path_factory.mktemp("reference")
    model.write_glb(model.generate()[2::2], folder / "in.glb")
    return results([sys.executable], folder)


def check(command, folder, reference):
    (folder / "in.glb").write_bytes(reference["in.glb"])
    found = results(command, folder)
    assert len(found) == 5
    assert [name for name in found if found[name] != reference[name]] == []


@pytest.mark.parametrize(
    ("minor", "numpy"),
    [(10, "numpy==1.25.*"), (10, "numpy"), (11, "numpy"), (12, "numpy"), (13, "numpy")],
)
def test_pythons_of_this_machine(minor, numpy, reference, tmp_path):
    """Each in an empty environment, with its newest numpy, and the oldest that we support."""
    python = find_python((3, minor))
    if python is None:
        missing(f"there is no Python 3.{minor}")
    run([python, "-m", "venv", "venv"], tmp_path)
    pip = [tmp_path / "venv" / "bin" / "python", "-m", "pip", "--disable-pip-version-check"]
    run([*pip, "install", "-q", wheel_of("manylinux_2_17_x86_64"), numpy], tmp_path)
    check([tmp_path / "venv" / "bin" / "python", "-I"], tmp_path, reference)


@pytest.mark.parametrize("name", PYTHONS)
def test_other_pythons(name, reference, tmp_path, monkeypatch):
    """Each with a folder that pip filled here."""
    site = fill(PYTHONS[name], tmp_path)
    monkeypatch.setitem(os.environ, "PYTHONPATH", str(site))
    check(PYTHONS[name].command, tmp_path, reference)
