"""Streams in browsers from places that need care: stored compressed, from a CDN, without a file."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path

import pytest

from tests.helpers.browsers import pictures
from tests.helpers.environment import ROOT

BROWSERS = ["chrome", "firefox"]
PAGE = "tests/stream_cases.html"


def copy_package(folder: Path, without: str) -> None:
    """The package's files but one."""
    shutil.copytree(
        ROOT / "web", folder / "package", ignore=shutil.ignore_patterns("view", "wgsl", "*.cpp")
    )
    (folder / "package" / without).unlink()


@pytest.mark.parametrize("browser", BROWSERS)
def test_streams_from_every_place(browser, bunny, tmp_path):
    shutil.copy(bunny, tmp_path / "model.glb")
    (tmp_path / "stored.glb").write_bytes(gzip.compress(bunny.read_bytes()))
    copy_package(tmp_path, "stream/core/worker.js")
    files = ["model.glb", "stored.glb", "model.glb~cdn", "model.glb~copy"]
    plain, stored, cdn, copy = pictures(browser, PAGE, tmp_path, *files)
    for name, result in (("plain", plain), ("stored", stored), ("cdn", cdn)):
        assert (result.get("broken"), result.get("valid")) == ([], True), (name, result)
    assert plain["warnings"] == cdn["warnings"] == []
    assert stored["warnings"][-1].endswith("so that the whole file is loaded")
    (problem,) = set(copy["broken"])
    assert problem.startswith("a decoder's Worker failed: its file was not loaded")
    assert problem.endswith("/files/package/stream/core/worker.js")
