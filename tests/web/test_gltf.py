"""Accessors' arrays in JavaScript beside those that `decompress` writes."""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gltf_ext import compress
from gltf_ext.attributes.extension import Compressed, require_compressed
from gltf_ext.document.document import Document
from gltf_ext.document.gltf import attribute_sets
from gltf_ext.sources.importers import open_model
from tests.helpers import environment
from tests.helpers.environment import ROOT, VECTORS

WEB = ROOT / "web"
ACCESSORS = Path(__file__).with_name("accessors.mjs")
INDEX_TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32}


def accessors(*files: Path) -> list[list[dict[str, str]]]:
    """Per file, per compressed primitive: digests of the accessors' arrays, or an error."""
    environment.need_program("node", "Debian: apt install nodejs")
    if not (WEB / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    done = subprocess.run(["node", ACCESSORS, WEB, *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def digest(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def expected(document: Document, compressed: Compressed) -> dict[str, Any]:
    """Digests of what the native decoder gives the primitive's accessors."""
    primitive = document.primitive(compressed.mesh, compressed.primitive)
    decoded = compressed.decode()
    index_type = INDEX_TYPES[document.accessors[primitive["indices"]]["componentType"]]
    digests = {str(primitive["indices"]): digest(decoded.indices.astype(index_type))}
    for numbers, arrays in zip(attribute_sets(primitive), [decoded.attributes, *decoded.targets]):
        for name, accessor in numbers.items():
            digests[str(accessor)] = digest(arrays[name])
    return digests


def check(*files: Path) -> None:
    for file, found in zip(files, accessors(*files)):
        document = open_model(file)
        compressed = require_compressed(document)
        assert found == [expected(document, c) for c in compressed], file.name


def test_vectors():
    files = sorted(VECTORS.glob("gltf_*.glb"))
    assert files
    check(*files)


def test_malformed_vectors_are_refused():
    reasons = json.loads((VECTORS / "malformed.json").read_text())
    names = [n for n, reason in reasons.items() if not reason["validators_only"]]
    files = [VECTORS / name for name in names if name.endswith(".glb")]
    assert len(files) > 10
    for file, found in zip(files, accessors(*files)):
        assert any("error" in primitive for primitive in found), file.name


@pytest.mark.parametrize(
    "name",
    [
        "DamagedHelmet.glb",
        "nasty/CesiumMan_skinned.glb",
        "nasty/AnimatedMorphCube.glb",
        "nasty/BoxVertexColors.glb",
        "materialball.glb",
    ],
)
def test_models(name, model, tmp_path):
    compress(model(name), tmp_path / "compressed.glb")
    check(tmp_path / "compressed.glb")
