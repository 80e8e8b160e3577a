"""The bundled page of gltf-meshlet view: current, small, with notices, for any browser."""

from __future__ import annotations

import re
import subprocess

import pytest

from gltf_meshlet.view_server import PAGE, TYPES
from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT

LIMIT = 900_000  # bytes of all files
SOURCES = ROOT / "web" / "view"


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_bundle_is_current(tmp_path):
    """If this fails: make web, and commit the result."""
    for package in ("three", "esbuild"):
        environment.need_npm_package(package)
    if not (ROOT / "web" / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    command = ["node", SOURCES / "build.mjs", NODE_MODULES, tmp_path / "page"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    built, committed = contents(tmp_path / "page"), contents(PAGE)
    assert set(built) == set(committed)
    assert [name for name in built if built[name] != committed[name]] == []


def test_versions_are_those_of_the_makefile():
    """The notice of three.js names the version that is bundled."""
    pinned = re.search(r"three@0\.(\d+)\.", (ROOT / "Makefile").read_text()).group(1)
    assert f'"{pinned}"'.encode() in (PAGE / "vendor.js").read_bytes()


def test_bundle_is_small():
    assert sum(map(len, contents(PAGE).values())) <= LIMIT


def test_server_knows_the_type_of_every_file():
    assert {path.suffix for path in PAGE.iterdir()} <= set(TYPES)


def test_notices():
    notices = (PAGE / "NOTICES.txt").read_text()
    assert (ROOT / "LICENSE").read_text().strip() in notices
    for owner in ("three.js authors", "Zig contributors", "Rich Felker", "LLVM"):
        assert owner in notices
    license = environment.need_npm_package("three") / "LICENSE"
    assert license.read_text().strip() in notices


@pytest.mark.parametrize("name", ["view.js", "vendor.js", "index.html", "view.css"])
def test_page_names_no_host_to_load_from(name):
    """Imports are relative, and nothing needs headers that a static host does not send."""
    text = (PAGE / name).read_text()
    assert re.findall(r'(?:from|import|src=|href=|url\()\s*\(?["\']?(?:https?:)?//', text) == []
    assert "SharedArrayBuffer" not in text


def test_page_allows_itself_no_other_host():
    policy = re.search(
        r'Content-Security-Policy"\s+content="([^"]*)"', (PAGE / "index.html").read_text()
    ).group(1)
    sources = {word for part in policy.split(";") for word in part.split()[1:]}
    assert sources == {"'none'", "'self'", "'wasm-unsafe-eval'", "blob:", "data:"}
