"""Pages in Chromium and Firefox, by tests/web/screenshots.mjs."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT

SCREENSHOTS = ROOT / "tests" / "web" / "screenshots.mjs"
SECONDS = 1800  # of a run: static_server.mjs ends waiting before
LAVAPIPE = Path("/usr/share/vulkan/icd.d/lvp_icd.json")


def need_decoder() -> None:
    if not (ROOT / "web" / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")


def lavapipe_environment() -> dict[str, str]:
    """The environment of a program that is to find no other Vulkan device."""
    if not LAVAPIPE.is_file():
        environment.missing("no lavapipe (Debian: apt install mesa-vulkan-drivers)")
    # Chromium sets the older variable itself.
    return {**os.environ, "VK_ICD_FILENAMES": str(LAVAPIPE), "VK_DRIVER_FILES": str(LAVAPIPE)}


def browser_command(browser: str) -> list[str | Path]:
    """What runs screenshots.mjs with a browser: chrome or firefox."""
    environment.need_npm_package("puppeteer-core")
    need_decoder()
    if browser == "chrome":
        display, program = [], environment.need_program("chromium", "Debian: apt install chromium")
    else:
        program = environment.need_program("firefox-esr", "Debian: apt install firefox-esr")
        display = [environment.need_program("xvfb-run", "Debian: apt install xvfb xauth"), "-a"]
        environment.need_program("xauth", "Debian: apt install xauth")
    return [*display, "node", SCREENSHOTS, ROOT, NODE_MODULES, browser, program]


def pictures(browser: str, page: str, folder: Path, *files: str) -> list[dict[str, Any]]:
    """Draws files of a folder on a page; writes FILE.png. Returns what the pages report.

    A file's name may end with ~ or & and options that the page knows.
    """
    command = [*browser_command(browser), folder, page, *files]
    done = subprocess.run(
        list(map(str, command)),
        capture_output=True,
        text=True,
        timeout=SECONDS,
        env=lavapipe_environment() if browser == "firefox" else None,  # Chromium has SwiftShader
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def share_that_differs(folder: Path, *files: str) -> float:
    """Of the pictures of two files: the pixels that differ by more than 2 of 255, as a share of
    those where something is drawn."""
    first, second = (
        np.asarray(Image.open(folder / f"{file}.png").convert("RGB"), np.int16) for file in files
    )
    drawn = (first != first[0, 0]).any(axis=2) | (second != second[0, 0]).any(axis=2)
    assert drawn.mean() > 0.05
    return float((abs(first - second) > 2).any(axis=2).sum() / drawn.sum())
