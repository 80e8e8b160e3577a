"""Where the tests find the project, the real models and the npm packages, and what happens when something is missing."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
MODELS = Path(os.environ.get("GLTF_MESHLET_MODELS") or ROOT.parent / "shared" / "models")
NODE_MODULES = Path(
    os.environ.get("GLTF_MESHLET_NODE_MODULES") or ROOT / "build" / "node" / "node_modules"
)
VECTORS = ROOT / "spec" / "vectors"

full = False  # set by conftest.py: --full


def missing(reason: str) -> NoReturn:
    """Skip the test for something that this machine lacks; with --full, fail it."""
    if full:
        pytest.fail(reason)
    pytest.skip(reason)
