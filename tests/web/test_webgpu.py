"""The WebGPU decoder beside the native one, in Node and in browsers, and the WGSL that it runs."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gltf_ext import _codec, compress
from gltf_ext.compression.extension import require_compressed
from gltf_ext.gltf.importers import open_model
from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT, VECTORS
from web import build_wgsl

LAVAPIPE = Path("/usr/share/vulkan/icd.d/lvp_icd.json")
WIDE = VECTORS / "valid_64_streams.bin"  # more than the passes take
METHODS = ["serial", "passes"]
# Name -> npm package that drives it, program.
BROWSERS = {
    "chromium": ("playwright-core", "chromium"),
    "firefox": ("puppeteer-core", "firefox-esr"),
}
# SwiftShader, in Chromium, compiles the passes for many minutes.
BROWSER_METHODS = [("chromium", "serial"), ("firefox", "passes")]


def need_decoder() -> None:
    if not (ROOT / "web" / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")


def need_lavapipe() -> dict[str, str]:
    """The environment of a program that is to find no other Vulkan device."""
    if not LAVAPIPE.is_file():
        environment.missing("no lavapipe (Debian: apt install mesa-vulkan-drivers)")
    return {**os.environ, "VK_ICD_FILENAMES": str(LAVAPIPE)}


def write_list(blobs: list[bytes], folder: Path, options: dict[str, Any]) -> None:
    """The input of webgpu.mjs and webgpu.html."""
    ends = np.cumsum([len(b) for b in blobs]).tolist()
    (folder / "blobs.bin").write_bytes(b"".join(blobs))
    views = [[end - len(b), len(b)] for end, b in zip(ends, blobs)]
    (folder / "list.json").write_text(json.dumps({"views": views, "options": options}))


def run_node(script: str, *arguments: Any) -> Any:
    command = ["node", Path(__file__).with_name(script), *arguments]
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, env=need_lavapipe()
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def on_dawn(folder: Path) -> list[dict[str, Any]]:
    """What decodeToGPU makes of the listed blobs in Node."""
    environment.need_npm_package("webgpu")
    need_decoder()
    return run_node("webgpu.mjs", ROOT / "web", NODE_MODULES, folder)


def in_browser(name: str, folder: Path, *pages: str) -> list[dict[str, Any]]:
    """What pages report in chromium or firefox; pictures are in FOLDER/n.png."""
    need_decoder()
    environment.need_npm_package("three")
    environment.need_npm_package(BROWSERS[name][0])
    program = environment.need_program(
        BROWSERS[name][1], f"Debian: apt install {BROWSERS[name][1]}"
    )
    return run_node("webgpu_pages.mjs", name, ROOT, NODE_MODULES, program, folder, *pages)


def digest(array: np.ndarray) -> str:
    return hashlib.sha256(array.tobytes()).hexdigest()


def refusal(blob: bytes) -> str | None:
    """Why the native decoder refuses a blob's header or tables, if it does."""
    try:
        _codec.Decoder(blob)
    except ValueError as error:
        return str(error)
    return None


def expected(blob: bytes) -> dict[str, Any]:
    """What decodeToGPU must make of a blob with sound tables: malformed meshlets draw nothing."""
    decoder = _codec.Decoder(blob)
    indices, problem = [], None
    elements = [stream["components"] for stream in decoder.streams]
    integers = [np.zeros((decoder.meshlet_count, 64, n), np.uint32) for n in elements]
    for m in range(decoder.meshlet_count):
        try:
            triangles, values = decoder.decode_meshlet(m)
        except ValueError as error:
            problem = problem or str(error)
            continue
        indices.append(triangles.astype(np.uint32).ravel() + 64 * m)
        for stream, part in zip(integers, values):
            stream[m, : len(part)] = part
    drawn = np.concatenate([np.zeros(0, np.uint32), *indices])
    room = np.zeros(3 * int.from_bytes(blob[8:12], "little"), np.uint32)
    room[: len(drawn)] = drawn
    return {
        "draw": [len(drawn), 1, 0, 0, 0],
        "indices": digest(room),
        "streams": [digest(stream) for stream in integers],
        "problem": problem,
    }


def assert_same(
    blobs: list[bytes],
    folder: Path,
    decode: Callable[[Path], list[dict[str, Any]]] = on_dawn,
    **options: Any,
) -> int:
    """Checks that decodeToGPU and the native decoder agree. Returns the number of refused blobs."""
    refused = 0
    write_list(blobs, folder, {"integers": True, **options})
    results = decode(folder)
    for number, (blob, result) in enumerate(zip(blobs, results, strict=True)):
        error = refusal(blob)
        wanted = {"error": error} if error else expected(blob)
        assert result == wanted, number
        refused += "error" in result or result["problem"] is not None
    return refused


@pytest.mark.parametrize("method", METHODS)
def test_conformance_vectors(method, tmp_path):
    paths = set(VECTORS.glob("valid_*.bin")) - ({WIDE} if method == "passes" else set())
    blobs = [path.read_bytes() for path in sorted(paths)]
    assert len(blobs) > 30
    assert assert_same(blobs, tmp_path, method=method) == 0


@pytest.mark.parametrize("method", METHODS)
def test_malformed_vectors(method, tmp_path):
    blobs = [path.read_bytes() for path in sorted(VECTORS.glob("malformed_*.bin"))]
    assert assert_same(blobs, tmp_path, method=method) > 70


def blobs_of(file: Path) -> list[bytes]:
    """The blobs of a file's compressed views, each once."""
    blobs = []
    for view in {c.view: c.blob for c in require_compressed(open_model(file))}.values():
        at = 0
        while at < len(view):
            blobs.append(view[at : at + int.from_bytes(view[at + 20 : at + 24], "little")])
            at += len(blobs[-1])
    return blobs


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "page_bytes"),
    [
        ("nasty/Duck.glb", 4096),
        ("nasty/CesiumMan_skinned.glb", 0),
        ("suzanne.glb", 0),
        pytest.param("bunny.glb", 0, marks=pytest.mark.full),
        pytest.param("DamagedHelmet.glb", 0, marks=pytest.mark.full),
        pytest.param("dragon.glb", 0, marks=pytest.mark.full),
    ],
)
def test_models(method, name, page_bytes, model, tmp_path):
    compress(model(name), tmp_path / "compressed.glb", page_bytes=page_bytes)
    blobs = blobs_of(tmp_path / "compressed.glb")
    # Little scratch memory: several ranges of meshlets one after another.
    assert assert_same(blobs, tmp_path, method=method, scratchBytes=2**18) == 0


@pytest.mark.parametrize(("browser", "method"), BROWSER_METHODS)
def test_vectors_in_browser(browser, method, tmp_path):
    def decode(folder: Path) -> list[dict[str, Any]]:
        (page,) = in_browser(browser, folder, "tests/web/webgpu.html")
        assert "error" not in page, page
        return page["results"]

    paths = set(VECTORS.glob("valid_*.bin")) - {WIDE} | set(VECTORS.glob("malformed_*.bin"))
    blobs = [path.read_bytes() for path in sorted(paths)]
    assert assert_same(blobs, tmp_path, decode, method=method) > 70


@pytest.mark.parametrize(
    "name", ["DamagedHelmet.glb", pytest.param("dragon.glb", marks=pytest.mark.full)]
)
@pytest.mark.parametrize(("browser", "method"), BROWSER_METHODS)
def test_same_picture_as_on_the_cpu(browser, method, name, model, tmp_path):
    """three's WebGPURenderer draws what the GPU decoded as it draws what WebAssembly decoded."""
    compress(model(name), tmp_path / "model.glb")
    page = "web/examples/three-webgpu.html?file=/files/model.glb"
    pages = (f"{page}&decode=cpu", f"{page}&method={method}")
    assert in_browser(browser, tmp_path, *pages) == [{"backend": "WebGPU"}] * 2
    first, second = (
        np.asarray(Image.open(tmp_path / f"{number}.png").convert("RGB"), np.int16)
        for number in range(2)
    )
    drawn = (first != first[0, 0]).any(axis=2) | (second != second[0, 0]).any(axis=2)
    assert drawn.mean() > 0.05
    different = (abs(first - second) > 2).any(axis=2)
    assert different.sum() < 0.001 * drawn.sum()


def test_wgsl_is_current():
    """A change of the GLSL or of the compiler's version needs: python -m web.build_wgsl."""
    manifest = json.loads(build_wgsl.MANIFEST.read_text())
    assert manifest["sources"] == {name: build_wgsl.digest(name) for name in build_wgsl.MODULES}
    pinned = re.search(r'"slangpy==([\d.]+)"', (ROOT / "pyproject.toml").read_text())
    assert pinned and manifest["slangpy"] == pinned[1]
    assert {path.stem for path in build_wgsl.OUTPUT.glob("*.wgsl")} == set(build_wgsl.MODULES)
    shipped = set(json.loads((ROOT / "web" / "package.json").read_text())["files"])
    assert {f"wgsl/{name}.wgsl" for name in build_wgsl.MODULES} <= shipped


@pytest.mark.parametrize("name", sorted(build_wgsl.MODULES))
def test_wgsl_is_what_slang_makes(name):
    environment.need_package("slangpy")
    text = (build_wgsl.OUTPUT / f"{name}.wgsl").read_text()
    assert text == build_wgsl.translate(build_wgsl.Slang(), name)
