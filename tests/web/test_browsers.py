"""The plugins in Chromium and Firefox: pictures of compressed and of decompressed files."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from gltf_ext import compress, decompress
from tests.helpers import environment
from tests.helpers.browsers import pictures, share_that_differs

MODELS = ["DamagedHelmet.glb", "nasty/CesiumMan_skinned.glb", "nasty/AnimatedMorphCube.glb"]
LARGE = ["dragon.glb"]  # with --full
ENGINES = {"three": "three", "babylon": "@babylonjs/loaders"}


def engine_page(engine: str) -> str:
    environment.need_npm_package(ENGINES[engine])
    return f"tests/{engine}.html"


def files_of(name: str) -> list[str]:
    return [f"{Path(name).stem}-{form}.glb" for form in ("compressed", "plain")]


@pytest.fixture(
    scope="module", params=itertools.product(ENGINES, ["chrome", "firefox"]), ids="-".join
)
def drawn(request, model, tmp_path_factory) -> tuple[Path, dict[str, Any]]:
    """The folder of all models' pictures by one browser, which loads an engine's modules
    only once; file -> what the page told of it."""
    engine, browser = request.param
    folder = tmp_path_factory.mktemp("drawn")
    names = MODELS + (LARGE if environment.full else [])
    for name in names:
        compressed, plain = (folder / file for file in files_of(name))
        compress(model(name), compressed)
        decompress(compressed, plain)
    files = [file for name in names for file in files_of(name)]
    return folder, dict(zip(files, pictures(browser, engine_page(engine), folder, *files)))


@pytest.mark.parametrize(
    "name", [*MODELS, *(pytest.param(name, marks=pytest.mark.full) for name in LARGE)]
)
def test_same_picture_as_the_decompressed_file(name, drawn):
    folder, told = drawn
    files = files_of(name)
    compressed, plain = (told[file] for file in files)
    assert compressed == plain
    assert compressed["triangles"] > 0
    assert share_that_differs(folder, *files) < 0.001


@pytest.mark.parametrize("engine", ENGINES)
def test_packed_file_gives_the_same_picture(engine, model, tmp_path):
    for name, transport in (("packed.glb", True), ("compressed.glb", False)):
        compress(model("DamagedHelmet.glb"), tmp_path / name, transport=transport)
    files = ("packed.glb", "compressed.glb")
    packed, compressed = pictures("chrome", engine_page(engine), tmp_path, *files)
    assert packed == compressed
    assert packed["triangles"] > 0
    first, second = ((tmp_path / f"{file}.png").read_bytes() for file in files)
    assert first == second


@pytest.mark.parametrize("engine", ENGINES)
def test_damaged_file_is_an_error_that_names_the_primitive(engine, model, tmp_path):
    compress(model("nasty/Box.glb"), tmp_path / "damaged.glb")
    data = bytearray((tmp_path / "damaged.glb").read_bytes())
    data[data.index(b"EBM1") + 4] = 77  # the version
    (tmp_path / "damaged.glb").write_bytes(data)
    (result,) = pictures("chrome", engine_page(engine), tmp_path, "damaged.glb")
    assert "mesh 0 primitive 0: " in result["error"]
    assert "version" in result["error"]


def test_attributes_stay_integers_if_asked_to(model, tmp_path):
    """The same picture but for rounding, in half the bytes for normals and tangents."""
    compress(model("DamagedHelmet.glb"), tmp_path / "model.glb")
    floats, integers = pictures(
        "chrome", engine_page("three"), tmp_path, "model.glb", "model.glb~q"
    )
    assert set(floats.pop("types").values()) == {"Float32Array"}
    types = integers.pop("types")
    assert (types["position"], types["normal"]) == ("Float32Array", "Int16Array")
    assert floats == integers
    assert share_that_differs(tmp_path, "model.glb", "model.glb~q") < 0.01
