"""Transport gives back every byte: of all options of `compress`, and by every compiler."""

import importlib.util
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

import gltf_ext
from gltf_ext import _codec
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from spec import reference_transport
from tests.helpers import environment
from tests.helpers.environment import MODELS, ROOT
from tests.helpers.gltf_builder import write_everything

COARSE = {"position_bits": 4, "normal_bits": 4, "texcoord_bits": 4}
COARSE |= {"color_bits": 4, "weight_bits": 4}
FINE = {"position_bits": 24, "normal_bits": 16, "texcoord_bits": 16}
FINE |= {"color_bits": 16, "weight_bits": 16}
SMALL_PAGES = {"page_bytes": 4096}
OPTIONS = {
    "default": {},
    "coarse": COARSE,
    "fine": FINE,
    "odd_bits": {"position_bits": 13, "normal_bits": 9, "texcoord_bits": 11, "color_bits": 5},
    "pages": SMALL_PAGES,
    "coarse_pages": {**COARSE, **SMALL_PAGES},
    "fine_pages": {**FINE, **SMALL_PAGES},
    "one_blob": {"page_bytes": 0},
    "small_meshlets": {"max_triangles": 16, "effort": "fast"},
    "scene_grid": {"grid": "scene"},
    "levels": {"lod": True},
    "fine_levels": {"lod": True, **FINE, **SMALL_PAGES},
}
REAL = sorted(path.stem for path in MODELS.glob("*.glb"))
SMALL = ("DamagedHelmet",)
CODEC = ROOT / "codec"
CLANG = ["clang++", "-O2"]
ZIG = [sys.executable, "-m", "ziglang", "c++", "-O2", "-fno-sanitize=all"]


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    """A folder of the packed and resident views of the generated model by all options."""
    folder = tmp_path_factory.mktemp("views")
    source = write_everything(folder / "generated.glb", columns=40, rows=30)
    for name, options in OPTIONS.items():
        if "lod" in options:
            continue  # its pages are views like others
        gltf_ext.compress(source, folder / "out.glb", **options)
        for number, compressed in enumerate(require_compressed(open_model(folder / "out.glb"))):
            resident = bytes(compressed.blob)
            path = folder / f"valid_pages_{name}_{number}.bin"
            path.write_bytes(_codec.pack(resident))
            path.with_suffix(".resident").write_bytes(resident)
    return folder


def check_round_trip(source, folder, options):
    """Packs and unpacks a file."""
    if "lod" in options:
        environment.need_package("meshoptimizer")
    resident, packed, again = (folder / f"{name}.glb" for name in ("resident", "packed", "again"))
    gltf_ext.compress(source, resident, **options)
    assert gltf_ext.transcode(resident, packed)["packed"]
    assert not gltf_ext.transcode(packed, again)["packed"]
    assert again.read_bytes() == resident.read_bytes()
    assert packed.stat().st_size < resident.stat().st_size


@pytest.mark.parametrize("options", OPTIONS)
def test_generated_models_come_back(options, tmp_path):
    source = write_everything(tmp_path / "in.glb", columns=40, rows=30)
    check_round_trip(source, tmp_path, OPTIONS[options])


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in SMALL else pytest.mark.full) for name in REAL],
)
def test_real_models_come_back(model, name, options, tmp_path):
    if not environment.full and options not in ("default", "fine_pages"):
        pytest.skip("only with --full")
    check_round_trip(model(f"{name}.glb"), tmp_path, OPTIONS[options])


def second_compiler():
    """Clang; without it that of Zig, which compiles its C++ library first, for minutes."""
    if shutil.which(CLANG[0]):
        return CLANG
    if importlib.util.find_spec("ziglang"):
        return ZIG
    environment.missing("no second compiler: install clang++, or ziglang by make .venv/wheel")


@pytest.mark.parametrize(
    "compiler",
    [
        "second",
        pytest.param(["g++", "-O0"], id="g++ -O0", marks=pytest.mark.full),
        pytest.param(ZIG, id="zig c++ -O2", marks=pytest.mark.full),
    ],
)
def test_every_compiler_gives_the_same_bytes(compiler, views, tmp_path):
    command = second_compiler() if compiler == "second" else compiler
    if command == ZIG:
        environment.need_package("ziglang")
    else:
        environment.need_program(command[0], "see CONTRIBUTING.md")
    folders = [CODEC / name for name in ("format", "decode", "transport")]
    sources = [path for folder in folders for path in sorted(folder.glob("*.cpp"))]
    sources.append(CODEC / "processors.cpp")
    sources.append(ROOT / "tests" / "codec" / "native" / "transport_test.cpp")
    flags = ["-std=c++17", "-ffp-contract=off", "-Wno-psabi", f"-I{CODEC}"]

    def compiled(source):
        target = tmp_path / f"{source.stem}.o"
        subprocess.run([*command, *flags, "-c", source, "-o", target], check=True)
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, sources))
    program = tmp_path / "transport_test"
    subprocess.run([*command, "-pthread", *objects, "-o", program], check=True)
    done = subprocess.run([program, views], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_reference_unpacker_gives_the_same_bytes(views):
    path = views / "valid_pages_small_meshlets_0.bin"  # of all attributes
    packed, resident = path.read_bytes(), path.with_suffix(".resident").read_bytes()
    assert len(packed) < len(resident)  # others do not get smaller: their pages are raw
    assert reference_transport.unpack_view(packed) == resident


def test_webassembly_gives_the_same_bytes(views):
    if not (ROOT / "web" / "unpacker.wasm").is_file():
        environment.missing("no web/unpacker.wasm; run: make web")
    environment.need_program("node", "Debian: apt install nodejs")
    command = ["node", ROOT / "tests" / "web" / "unpack.mjs", ROOT / "web", views]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
