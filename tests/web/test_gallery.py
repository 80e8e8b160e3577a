"""The gallery that make web builds, and the element <meshlet-view>, in Chromium."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gltf_meshlet.demo import model
from tests.helpers import browsers, environment
from tools import build_gallery

MOST_LINES = 200  # of the element


@pytest.fixture(scope="module")
def gallery(tmp_path_factory) -> Path:
    environment.need_package("meshoptimizer")
    for package in ("three", "esbuild"):
        environment.need_npm_package(package)
    browsers.need_decoder()
    folder, sources = (tmp_path_factory.mktemp(name) for name in ("gallery", "sources"))
    primitives = model.generate()
    models = {"demo": primitives, "gear": primitives[2:3]}
    for name, some in models.items():
        model.write_glb(some, sources / f"{name}.glb")
    build_gallery.build(folder, [sources / f"{name}.glb" for name in models])
    return folder


def test_gallery_shows_its_models(gallery, tmp_path):
    """And an element may get another file, move, lose its context, or be taken out of its page."""
    shutil.copytree(gallery, tmp_path, dirs_exist_ok=True)
    for name in ("gallery.js", "lost_context.js"):
        shutil.copy(Path(__file__).with_name(name), tmp_path)
    page = (gallery / "index.html").read_text()
    script = '<script type="module" src="gallery.js"></script>'
    check = script.replace("gallery.js", "check.js")
    (tmp_path / "gallery.js").rename(tmp_path / "check.js")
    shutil.copy(gallery / "gallery.js", tmp_path)
    assert script in page
    (tmp_path / "page.html").write_text(page.replace(script, script + check))
    (result,) = browsers.pictures("chrome", "files/page.html", tmp_path, "gallery")
    assert result["ends"] == ["load"] * 2
    assert min(result["shown"]) > 500
    assert result["changed"] == 3_000_000
    assert (result["gone"], result["other"], result["canvases"]) == (None, True, 0)
    assert result["errors"] == 0
    assert result["alt"] == ["Demo", "Gear"]
    picture = np.asarray(Image.open(tmp_path / "gallery.png").convert("RGB"), np.int16)
    assert (picture.min(axis=2) > 100).mean() > 0.02  # it is lit


def test_gallery_takes_any_name(tmp_path):
    name = 'gear "1" <b>#2'
    model.write_glb(model.generate()[2:3], tmp_path / f"{name}.glb")
    (tmp_path / "page").mkdir()
    figure = build_gallery.figure(tmp_path / f"{name}.glb", tmp_path / "page")
    (element,) = re.findall("<meshlet-view (.*)></meshlet-view>", figure)
    assert element == (
        'src="./gear%20%221%22%20%3Cb%3E%232.glb" alt="Gear &quot;1&quot; &lt;b&gt;#2"'
    )


def test_gallery_names_no_host(gallery):
    text = (gallery / "index.html").read_text()
    assert "http" not in text.replace("http-equiv", "")
    assert text.count("<meshlet-view") == 2


def test_element_is_small():
    lines = (environment.ROOT / "web" / "element.js").read_text().splitlines()
    assert len(lines) < MOST_LINES
