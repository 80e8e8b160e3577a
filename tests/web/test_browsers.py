"""The plugins in Chromium and Firefox: pictures of compressed and of decompressed files."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from gltf_ext import compress, decompress
from tests.helpers import environment
from tests.helpers.browsers import pictures

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
    first, second = (
        np.asarray(Image.open(tmp_path / f"{file}.png").convert("RGB"), np.int16) for file in files
    )
    drawn = (first != first[0, 0]).any(axis=2) | (second != second[0, 0]).any(axis=2)
    assert drawn.mean() > 0.05
    different = (abs(first - second) > 2).any(axis=2)
    assert different.sum() < 0.001 * drawn.sum()


@pytest.mark.parametrize("engine", ENGINES)
def test_damaged_file_is_an_error_that_names_the_primitive(engine, model, tmp_path):
    compress(model("nasty/Box.glb"), tmp_path / "damaged.glb")
    data = bytearray((tmp_path / "damaged.glb").read_bytes())
    data[data.index(b"EBM1") + 4] = 77  # the version
    (tmp_path / "damaged.glb").write_bytes(data)
    (result,) = pictures("chrome", engine_page(engine), tmp_path, "damaged.glb")
    assert "mesh 0 primitive 0: " in result["error"]
    assert "version" in result["error"]
