"""Pages in Chromium and Firefox, by tests/web/screenshots.mjs."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT

SCREENSHOTS = ROOT / "tests" / "web" / "screenshots.mjs"


def browser_command(browser: str) -> list[str | Path]:
    """What runs screenshots.mjs with a browser: chrome or firefox."""
    environment.need_npm_package("puppeteer-core")
    if not (ROOT / "web" / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    if browser == "chrome":
        display, program = [], environment.need_program("chromium", "Debian: apt install chromium")
    else:
        program = environment.need_program("firefox-esr", "Debian: apt install firefox-esr")
        display = [environment.need_program("xvfb-run", "Debian: apt install xvfb xauth"), "-a"]
        environment.need_program("xauth", "Debian: apt install xauth")
    return [*display, "node", SCREENSHOTS, ROOT, NODE_MODULES, browser, program]


def pictures(browser: str, page: str, folder: Path, *files: str) -> list[dict[str, Any]]:
    """Draws files of a folder on a page; writes FILE.png. Returns what the pages report."""
    command = [*browser_command(browser), folder, page, *files]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
