"""The plugins in Chromium and Firefox: pictures of compressed and of decompressed files."""

from __future__ import annotations

import pytest

from gltf_ext import compress, decompress
from tests.helpers import environment
from tests.helpers.browsers import pictures, share_that_differs

MODELS = [
    "DamagedHelmet.glb",
    "nasty/CesiumMan_skinned.glb",
    "nasty/AnimatedMorphCube.glb",
    pytest.param("dragon.glb", marks=pytest.mark.full),
]
ENGINES = {"three": "three", "babylon": "@babylonjs/loaders"}


def engine_page(engine: str) -> str:
    environment.need_npm_package(ENGINES[engine])
    return f"tests/{engine}.html"


@pytest.mark.parametrize("browser", ["chrome", "firefox"])
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", MODELS)
def test_same_picture_as_the_decompressed_file(name, engine, browser, model, tmp_path):
    compress(model(name), tmp_path / "compressed.glb")
    decompress(tmp_path / "compressed.glb", tmp_path / "plain.glb")
    files = ("compressed.glb", "plain.glb")
    compressed, plain = pictures(browser, engine_page(engine), tmp_path, *files)
    assert compressed == plain
    assert compressed["triangles"] > 0
    assert share_that_differs(tmp_path, *files) < 0.001


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
