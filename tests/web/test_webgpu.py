"""The WebGPU decoder beside the native one, in Node and in browsers, and the WGSL that it runs."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gltf_ext import _codec, compress, transcode
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from tests.helpers import environment
from tests.helpers.browsers import lavapipe_environment, need_decoder, pictures, share_that_differs
from tests.helpers.environment import NODE_MODULES, ROOT, VECTORS
from tests.helpers.models import HARD, REFUSED, need_package_of
from tools import build_wgsl
from vk_backend.gpu.constants import CONSTANTS

WIDE = VECTORS / "valid_64_streams.bin"  # more than `interior` takes
METHODS = ["interior", "traversal"]
# SwiftShader, in Chromium, compiles the shaders for many minutes. Dawn runs in Node.
BROWSER_METHODS = [("firefox", "interior"), ("firefox", "traversal")]


def write_list(blobs: list[bytes], folder: Path, options: dict[str, Any]) -> None:
    """The input of webgpu.mjs and webgpu.html."""
    ends = np.cumsum([len(b) for b in blobs]).tolist()
    (folder / "blobs.bin").write_bytes(b"".join(blobs))
    views = [[end - len(b), len(b)] for end, b in zip(ends, blobs)]
    (folder / "list.json").write_text(json.dumps({"views": views, "options": options}))


def on_dawn(folder: Path) -> list[dict[str, Any]]:
    """What decodeToGPU makes of the listed blobs in Node."""
    environment.need_npm_package("webgpu")
    need_decoder()
    command = ["node", Path(__file__).with_name("webgpu.mjs"), ROOT / "web", NODE_MODULES, folder]
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, env=lavapipe_environment()
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


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
    elements = [stream.elements for stream in decoder.streams]
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
    paths = set(VECTORS.glob("valid_*.bin")) - ({WIDE} if method == "interior" else set())
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
    ],
)
def test_models(method, name, page_bytes, model, tmp_path):
    compress(model(name), tmp_path / "compressed.glb", page_bytes=page_bytes)
    blobs = blobs_of(tmp_path / "compressed.glb")
    # Little scratch memory: several ranges of meshlets one after another.
    assert assert_same(blobs, tmp_path, method=method, scratchBytes=2**18) == 0


@pytest.mark.full
@pytest.mark.parametrize("options", [{}, {"method": "traversal"}], ids=["default", "traversal"])
@pytest.mark.parametrize(
    "path",
    environment.parameters_or_missing(
        (
            pytest.param(p, id=p.stem)
            for p in [*sorted(environment.MODELS.glob("*.glb")), *HARD]
            if p.stem not in REFUSED
        ),
        f"no models in {environment.MODELS}",
    ),
)
def test_all_models(path, options, tmp_path):
    need_package_of(path)
    compress(path, tmp_path / "compressed.glb")
    blobs = blobs_of(tmp_path / "compressed.glb")
    # Of a large model, several ranges of meshlets.
    assert assert_same(blobs, tmp_path, scratchBytes=2**20, **options) == 0


@pytest.mark.parametrize(("browser", "method"), BROWSER_METHODS)
def test_vectors_in_browser(browser, method, tmp_path):
    def decode(folder: Path) -> list[dict[str, Any]]:
        (page,) = pictures(browser, "tests/webgpu.html", folder, "list.json")
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
    transcode(tmp_path / "model.glb", tmp_path / "packed.glb")
    cpu = "model.glb&decode=cpu"
    gpu = [f"{form}.glb&method={method}" for form in ("model", "packed")]
    page = "examples/three_webgpu/three-webgpu.html"
    assert pictures(browser, page, tmp_path, cpu, *gpu) == [{"backend": "WebGPU"}] * 3
    for file in gpu:
        assert share_that_differs(tmp_path, cpu, file) < 0.001


def test_wgsl_is_current():
    """A change of the GLSL or of the compiler's version needs: python -m tools.build_wgsl."""
    manifest = json.loads(build_wgsl.MANIFEST.read_text())
    assert manifest["sources"] == {name: build_wgsl.digest(name) for name in build_wgsl.MODULES}
    pinned = re.search(r'"slangpy==([\d.]+)"', (ROOT / "pyproject.toml").read_text())
    assert pinned and manifest["slangpy"] == pinned[1]
    assert {path.stem for path in build_wgsl.OUTPUT.glob("*.wgsl")} == set(build_wgsl.MODULES)
    shipped = set(json.loads((ROOT / "web" / "package.json").read_text())["files"])
    assert {f"wgsl/{name}.wgsl" for name in build_wgsl.MODULES} <= shipped


def bytes_of(type_: str, text: str) -> int:
    """Size of a WGSL type."""
    array = re.fullmatch(r"array<(.*), i32\((\d+)\)>", type_)
    if array:
        return int(array[2]) * bytes_of(array[1], text)
    if type_ in ("u32", "i32", "bool", "atomic<u32>"):
        return 4
    if type_ in ("vec2<u32>", "vec3<u32>"):
        return 4 * int(type_[3])
    (body,) = re.findall(rf"struct {type_}\n{{(.*?)}}", text, re.DOTALL)
    return sum(bytes_of(member, text) for member in re.findall(r" : (.*),\n", body))


@pytest.mark.parametrize("name", sorted(build_wgsl.MODULES))
def test_wgsl_stays_within_the_default_limits(name):
    text = (build_wgsl.OUTPUT / f"{name}.wgsl").read_text()
    sizes = {
        space: sum(bytes_of(t, text) for t in re.findall(rf"var<{space}> \w+ : (.*);", text))
        for space in ("private", "workgroup")
    }
    assert sizes["private"] <= 8192 and sizes["workgroup"] <= 16384
    assert len(re.findall("var<storage", text)) <= 8


@pytest.mark.parametrize("name", sorted(build_wgsl.MODULES))
def test_wgsl_is_what_slang_makes(name):
    environment.need_package("slangpy")
    text = (build_wgsl.OUTPUT / f"{name}.wgsl").read_text()
    assert text == build_wgsl.translate(build_wgsl.Slang(), name)


def numbers_in(pattern: str, text: str) -> dict[str, int]:
    """Name -> number of all matches of two groups."""
    return {name: int(number) for name, number in re.findall(pattern, text, re.MULTILINE)}


def test_webgpu_repeats_the_numbers_of_format_and_shaders():
    text = (ROOT / "web" / "webgpu.js").read_text()
    interior = build_wgsl.INTERIOR
    connect = (build_wgsl.OUTPUT / "connect.wgsl").read_text()
    assert numbers_in(r"^const (\w+) = (\d+);", text) == {
        "MESHLET_TRIANGLES": CONSTANTS["MESHLET_TRIANGLES"],
        "MESHLET_VERTICES": CONSTANTS["MESHLET_VERTICES"],
        "PACKED_POSITION_BITS": CONSTANTS["PACKED_POSITION_BITS"],
        "CONNECTED_BYTES": bytes_of("Connected_std430_0", connect),
        "PLACES_BYTES": bytes_of("Places_std430_0", connect),
        "MANY_MESHLETS": 4000,
        "SPREAD": 16,
        "INTERIOR_STREAMS": interior["MAX_STREAMS"],
        "INTERIOR_ELEMENTS": interior["MAX_ELEMENTS"],
        "WORKGROUPS": 65535,  # limits of WebGPU
        "PUSH_BYTES": 256,
    }
    (shared,) = re.findall(r"^const PASSES = \[(.*)\];", text, re.MULTILINE)
    names = [Path(source).stem for source in build_wgsl.MODULES["passes"]]
    assert re.findall(r"\w+", shared) == names
    most = CONSTANTS["BLOB_MAX_STREAMS"], CONSTANTS["STREAM_MAX_ELEMENTS"]
    assert list(build_wgsl.CAPACITIES.values()) == [most[0], most[0] * most[1]]


def test_wgsl_is_short():
    """Generated text that everybody downloads: its limit in lines."""
    texts = [path.read_text() for path in build_wgsl.OUTPUT.glob("*.wgsl")]
    assert sum(text.count("\n") for text in texts) <= 9000
