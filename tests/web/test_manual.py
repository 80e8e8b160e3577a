"""The examples of docs/web.md and docs/stream.md with the packed package in Chromium."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gltf_ext import compress
from tests.helpers import environment, web_package
from tests.helpers.browsers import pictures
from tests.helpers.environment import ROOT

ENGINES = {
    "three.js": ["three"],
    "Babylon.js": ["@babylonjs/core", "@babylonjs/loaders"],
    "stream in three.js": ["three"],
    "stream in Babylon.js": ["@babylonjs/core", "@babylonjs/loaders"],
}
# Tell screenshots.mjs how a page ends.
REPORT = """<script>
  addEventListener('error', (event) => (window.done = { error: event.message }));
  addEventListener('unhandledrejection', (event) => (window.done = { error: `${event.reason}` }));
</script>
"""
# How the examples' pages tell that something is drawn.
FRAMES = "requestAnimationFrame(() => requestAnimationFrame(() => (window.done = {})))"
DRAWN = {
    "stream in three.js": FRAMES,
    "stream in Babylon.js": f"await scene.whenReadyAsync(); {FRAMES}",
}
# Loads the file with what the examples for bundlers export or register.
LOAD = {
    "three.js": """
        const { scene } = await loader.loadAsync('model.glb');
        window.done = { name: scene.type };
    """,
    "stream in three.js": """
        await stream.ready;
        window.done = { name: stream.type };
    """,
    "stream in Babylon.js": """
        await stream.ready;
        window.done = { name: stream.getScene().getClassName() };
    """,
    "Babylon.js": """
        import { AppendSceneAsync } from '@babylonjs/core/Loading/sceneLoader.js';
        import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
        import { Scene } from '@babylonjs/core/scene.js';
        import { SceneLoaderFlags } from '@babylonjs/core/Loading/sceneLoaderFlags.js';
        SceneLoaderFlags.ShowLoadingScreen = false;
        const scene = new Scene(new NullEngine());
        await AppendSceneAsync('model.glb', scene);
        window.done = { name: scene.getClassName() };
    """,
}


def example(engine: str, language: str) -> str:
    """The first code block of a language in an engine's section."""
    manual = "stream.md" if engine in DRAWN else "web.md"
    heading = engine.removeprefix("stream in ")
    text = (ROOT / "docs" / manual).read_text()
    section = text.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return re.search(rf"```{language}\n(.*?)```", section, re.S)[1]


def user_folder(engine: str, model: Path, folder: Path) -> Path:
    """A folder with the installed packages and a compressed model."""
    user = web_package.install(folder / "user", *ENGINES[engine])
    compress(model, user / "model.glb", lod=engine in DRAWN)
    return user


def show_page(engine: str, model: Path, folder: Path) -> np.ndarray:
    """The canvas of a manual's page in a folder of a user."""
    folder = user_folder(engine, model, folder)
    shutil.copytree(folder / "node_modules" / "gltf-meshlet", folder / "gltf-meshlet")
    before, end, _ = example(engine, "html").rpartition("</script>")
    page = f"{before}{DRAWN.get(engine, 'window.done = {}')};{end}"
    (folder / "page.html").write_text(REPORT + page)
    (result,) = pictures("chrome", "files/page.html", folder, "model.glb")
    assert result == {}
    picture = np.asarray(Image.open(folder / "model.glb.png").convert("RGB"), np.int16)
    canvas = picture[100:300, 100:500]
    assert (canvas != picture[60, 60]).any(axis=2).mean() > 0.02
    return canvas


@pytest.mark.parametrize("engine", ENGINES)
def test_page_from_a_local_copy_shows_the_model(engine, model, tmp_path):
    name = "beast.glb" if engine in DRAWN else "nasty/CesiumMan_skinned.glb"
    show_page(engine, model(name), tmp_path)


def test_first_page_lights_models_without_a_material(model, tmp_path):
    canvas = show_page("three.js", model("beast.glb"), tmp_path)
    bright = canvas.max(axis=2) > 60
    assert bright.mean() > 0.1


@pytest.mark.parametrize("engine", ENGINES)
def test_bundle_loads_the_model(engine, model, tmp_path):
    program = environment.need_npm_package("esbuild") / "bin" / "esbuild"
    folder = user_folder(engine, model("nasty/Box.glb"), tmp_path)
    shutil.copy(folder / "node_modules" / "gltf-meshlet" / "decoder.wasm", folder)
    (folder / "entry.js").write_text(example(engine, "js") + LOAD[engine])
    options = ["--bundle", "--format=esm", "--outfile=bundle.js", "--log-level=error"]
    subprocess.run([program, "entry.js", *options], cwd=folder, check=True)
    worker = [program, "gltf-meshlet/stream/worker", *options[:2], "--outfile=worker.js"]
    subprocess.run(worker, cwd=folder, check=True)
    (folder / "page.html").write_text(REPORT + '<script type="module" src="bundle.js"></script>')
    (result,) = pictures("chrome", "files/page.html", folder, "model.glb")
    assert result in ({"name": "Group"}, {"name": "Scene"})
