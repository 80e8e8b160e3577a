"""The WebAssembly decoder beside the native one: same integers, same values, same refusals."""

from __future__ import annotations

import hashlib
import json
import random
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gltf_ext import _codec, compress
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from tests.helpers import environment
from tests.helpers.environment import ROOT, VECTORS
from tests.helpers.long_blobs import MAX_BYTES

WEB = ROOT / "web"
DIGEST = Path(__file__).with_name("digest.mjs")
MODULE_LIMIT, BROTLI_LIMIT = 40_000, 15_000  # bytes
MEMORY_LIMIT = 8 << 20  # of the module, after many small blobs, which need 1 MB


def need_decoder() -> None:
    environment.need_program("node", "Debian: apt install nodejs")
    if not (WEB / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")


def digests_of_node(views: list[bytes], folder: Path) -> list[dict[str, Any]]:
    """What the WebAssembly decoder makes of views, as digest.mjs prints it."""
    return run_digest(views, folder)["results"]


def run_digest(views: list[bytes], folder: Path) -> dict[str, Any]:
    """The output of digest.mjs."""
    need_decoder()
    ends = np.cumsum([len(v) for v in views]).tolist()
    (folder / "views.bin").write_bytes(b"".join(views))
    ranges = [[end - len(v), len(v)] for end, v in zip(ends, views)]
    (folder / "list.json").write_text(
        json.dumps({"packed": str(folder / "views.bin"), "views": ranges})
    )
    done = subprocess.run(
        ["node", str(DIGEST), str(WEB / "decoder.js"), str(folder / "list.json")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def digest(*arrays: np.ndarray) -> str:
    joined = hashlib.sha256()
    for array in arrays:
        joined.update(np.ascontiguousarray(array).tobytes())
    return joined.hexdigest()


def problem(function: Any, view: bytes) -> str | None:
    try:
        function(view, 1)  # with more threads, any of several errors
    except ValueError as error:
        return str(error)
    return None


def expected(view: bytes) -> dict[str, Any]:
    """What the native decoder makes of a view."""
    result: dict[str, Any] = {
        "validate": problem(_codec.validate, view),
        "decode": problem(_codec.decode, view),
    }
    if result["validate"] is not None or result["decode"] is not None:
        return result
    triangles, values = _codec.decode_values(view)
    decoder = _codec.Decoder(view)
    alone = []
    for m in range(decoder.meshlet_count):
        local, integers = decoder.decode_meshlet(m)
        alone += [np.array([len(local), len(integers[0])], np.uint32), local, *integers]
    return {
        **result,
        "triangles": len(triangles),
        "vertices": len(values[0]),
        "meshlets": decoder.meshlet_count,
        "indices": digest(triangles),
        "values": [digest(v) for v in values],
        "integers": [digest(v) for v in _codec.decode(view)[1]],
        "alone": digest(*alone),
    }


def views_of(path: Path) -> list[bytes]:
    """The compressed views of a file, each once."""
    found = {c.view: c.blob for c in require_compressed(open_model(path))}
    return list(found.values())


def test_vectors(tmp_path):
    paths = sorted(VECTORS.glob("*.bin"))
    assert len(paths) > 100
    views = [path.read_bytes() for path in paths]
    for path, view, found in zip(paths, views, digests_of_node(views, tmp_path)):
        assert found == expected(view), path.name
        assert (found["validate"] is None) == (not path.name.startswith("malformed")), path.name


@pytest.mark.parametrize("page_bytes", [0, 4096])
@pytest.mark.parametrize("name", ["nasty/Duck.glb", "nasty/CesiumMan_skinned.glb", "suzanne.glb"])
def test_models(name, page_bytes, model, tmp_path):
    check_model(model(name), page_bytes, tmp_path)


@pytest.mark.full
@pytest.mark.parametrize(
    "name",
    environment.parameters_or_missing(
        sorted(path.name for path in environment.MODELS.glob("*.glb")), "no models"
    ),
)
def test_all_models(name, model, tmp_path):
    check_model(model(name), 0, tmp_path)


def check_model(path: Path, page_bytes: int, folder: Path) -> None:
    compress(path, folder / "compressed.glb", page_bytes=page_bytes)
    views = views_of(folder / "compressed.glb")
    assert digests_of_node(views, folder) == [expected(view) for view in views]


def mutated(view: bytes, source: random.Random) -> bytes:
    """A copy with one to four changed bytes, or cut off."""
    damaged = bytearray(view)
    for _ in range(source.randint(1, 4)):
        damaged[source.randrange(len(damaged))] = source.randrange(256)
    if source.random() < 0.1:
        del damaged[source.randrange(len(damaged)) :]
    return bytes(damaged)


@pytest.mark.parametrize(
    "count", [2000, pytest.param(100_000, marks=pytest.mark.full)], ids=["few", "many"]
)
def test_mutated_vectors_are_refused_alike(count, tmp_path):
    source = random.Random(1)
    vectors = [path.read_bytes() for path in sorted(VECTORS.glob("v*.bin"))]
    views = [mutated(source.choice(vectors), source) for _ in range(count)]
    printed = run_digest(views, tmp_path)
    found = printed["results"]
    assert printed["memory"] <= MEMORY_LIMIT
    assert sum(result["validate"] is not None for result in found) > count / 4
    for number, (view, result) in enumerate(zip(views, found)):
        assert result == expected(view), number


def test_blobs_near_the_limit_of_their_length():
    """Nor are longer pages of packed views accepted."""
    need_decoder()
    small = VECTORS / "valid_worked_example.bin"
    sizes = MAX_BYTES, MAX_BYTES + 4, (1 << 29) - 4
    script = Path(__file__).with_name("long_blobs.mjs")
    done = subprocess.run(
        ["node", str(script), str(WEB), str(small), *map(str, sizes)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    indices = _codec.decode(small.read_bytes())[0].ravel().tolist()
    too_long = "the blob is longer than 448 MiB"
    assert found["blobs"] == [indices, too_long, too_long]
    impossible = ["page 0 has an impossible length"] * 3
    assert found["pages"] == [[1] * 3, impossible, impossible]


def test_module_is_small_and_imports_only_the_refusal():
    need_decoder()
    code = (
        "WebAssembly.compile(require('fs').readFileSync(process.argv[1]))"
        ".then(m => console.log(JSON.stringify(WebAssembly.Module.imports(m)),"
        " require('zlib').brotliCompressSync(require('fs').readFileSync(process.argv[1])).length))"
    )
    module = WEB / "decoder.wasm"
    done = subprocess.run(
        ["node", "-e", code, str(module)], capture_output=True, text=True, check=True
    )
    imports, brotli_bytes = done.stdout.rsplit(maxsplit=1)
    assert json.loads(imports) == [{"module": "host", "name": "refuse", "kind": "function"}]
    assert int(brotli_bytes) <= BROTLI_LIMIT
    assert module.stat().st_size <= MODULE_LIMIT
