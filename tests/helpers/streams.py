"""Streams in Node, by scripts in tests/web."""

from __future__ import annotations

import json
import subprocess
from typing import Any

from tests.helpers import environment
from tests.helpers.environment import ROOT

WEB = ROOT / "web"


def stream(script: str, task: str, *given: object) -> Any:
    """What a task of a script prints."""
    environment.need_program("node", "Debian: apt install nodejs")
    if not (WEB / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    command = ["node", ROOT / "tests" / "web" / script, WEB, task, *given]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=3000)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
