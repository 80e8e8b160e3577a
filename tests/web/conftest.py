"""Models of the tests of streams."""

from __future__ import annotations

from pathlib import Path

import pytest

from gltf_ext import compress
from tests.helpers import environment


@pytest.fixture(scope="session")
def bunny(model, tmp_path_factory) -> Path:
    """With levels."""
    environment.need_package("meshoptimizer")
    path = tmp_path_factory.mktemp("bunny") / "bunny.glb"
    compress(model("bunny.glb"), path, lod=True)
    return path
