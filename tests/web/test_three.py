"""The three.js plugin in Chromium: pictures of compressed and of decompressed files."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gltf_ext import compress, decompress
from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT

SCREENSHOTS = Path(__file__).with_name("screenshots.mjs")


def pictures(folder: Path, *files: str) -> list[dict[str, Any]]:
    """Draws files of a folder; writes FILE.png. Returns what the pages report."""
    environment.need_npm_package("three")
    environment.need_npm_package("playwright-core")
    chromium = environment.need_program("chromium", "Debian: apt install chromium")
    if not (ROOT / "web" / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    command = ["node", SCREENSHOTS, ROOT, NODE_MODULES, chromium, folder, *files]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    "name",
    [
        "DamagedHelmet.glb",
        "nasty/CesiumMan_skinned.glb",
        "nasty/AnimatedMorphCube.glb",
        pytest.param("dragon.glb", marks=pytest.mark.full),
    ],
)
def test_same_picture_as_the_decompressed_file(name, model, tmp_path):
    compress(model(name), tmp_path / "compressed.glb")
    decompress(tmp_path / "compressed.glb", tmp_path / "plain.glb")
    compressed, plain = pictures(tmp_path, "compressed.glb", "plain.glb")
    assert compressed == plain
    assert compressed["triangles"] > 0
    first, second = (
        np.asarray(Image.open(tmp_path / f"{file}.glb.png").convert("RGB"), np.int16)
        for file in ("compressed", "plain")
    )
    drawn = (first != first[0, 0]).any(axis=2) | (second != second[0, 0]).any(axis=2)
    assert drawn.mean() > 0.05
    different = (abs(first - second) > 2).any(axis=2)
    assert different.sum() < 0.001 * drawn.sum()


def test_damaged_file_is_an_error_that_names_the_primitive(model, tmp_path):
    compress(model("nasty/Box.glb"), tmp_path / "damaged.glb")
    data = bytearray((tmp_path / "damaged.glb").read_bytes())
    data[data.index(b"EBM1") + 4] = 77  # the version
    (tmp_path / "damaged.glb").write_bytes(data)
    (result,) = pictures(tmp_path, "damaged.glb")
    assert result["error"].startswith("mesh 0 primitive 0: ")
    assert "version" in result["error"]
