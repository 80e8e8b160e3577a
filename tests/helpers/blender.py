"""Blender as a Python module (bpy), in a process of its own, with the extension installed."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.helpers import processes
from tests.helpers.environment import ROOT, missing
from tools import blender_python


class Crashed(Exception):
    """Blender ended; str() is the end of what it printed."""


class Blender:
    """Calls functions of blender_driver.py in a running Blender."""

    def __init__(self, process: subprocess.Popen[str], answers: Any, log: Path) -> None:
        self._process, self._answers, self._log = process, answers, log

    def __call__(self, name: str, *arguments: Any, **options: Any) -> Any:
        """The function's result. Raises Crashed."""
        assert self._process.stdin is not None
        texts = [str(a) if isinstance(a, Path) else a for a in arguments]
        try:
            self._process.stdin.write(json.dumps([name, texts, options]) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass
        answer = self._answers.readline()
        if not answer:
            raise Crashed(self._log.read_text()[-2000:])
        return json.loads(answer)


def need_bpy() -> Path:
    """The Python that has bpy; reports it missing if there is none."""
    if not blender_python.has_bpy():
        missing(blender_python.MISSING)
    return blender_python.PYTHON


@contextmanager
def running(extension: Path, folder: Path) -> Iterator[Blender]:
    """Blender with the extension of this zip installed; its files and its log are in the folder."""
    reading, writing = os.pipe()
    log = folder / "blender.log"
    driver = ROOT / "tests" / "helpers" / "blender_driver.py"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user")}
    environment.pop("PYTHONPATH", None)
    with (
        log.open("w") as output,
        os.fdopen(reading) as answers,
        processes.running(
            [need_bpy(), driver, extension, writing],
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=output,
            text=True,
            pass_fds=[writing],
            env=environment,
        ) as process,
    ):
        os.close(writing)
        yield Blender(process, answers, log)
