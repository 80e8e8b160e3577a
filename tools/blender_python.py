"""The Python that has Blender as a module (bpy), for tests and measurements of the extension."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# `make test-full` creates it; GLTF_MESHLET_BPY names another one, with another Blender.
PYTHON = Path(os.environ.get("GLTF_MESHLET_BPY") or ROOT / "build" / "bpy" / "bin" / "python")
MISSING = f"{PYTHON} has no bpy; run make .venv/blender, or set GLTF_MESHLET_BPY"


def has_bpy() -> bool:
    """Whether PYTHON runs and has bpy."""
    code = "import importlib.util, sys; sys.exit(importlib.util.find_spec('bpy') is None)"
    return PYTHON.exists() and not subprocess.run((PYTHON, "-c", code), check=False).returncode


def find_python(version: tuple[int, int]) -> str | None:
    """An interpreter of that version: this one, one on PATH or one of pyenv's."""
    name = "python{}.{}".format(*version)
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    pattern = "versions/{}.{}.*/bin/{}".format(*version, name)
    for candidate in (sys.executable, shutil.which(name), *map(str, pyenv.glob(pattern))):
        if candidate and _version(candidate) == version:
            return candidate
    return None


def _version(python: str) -> tuple[int, ...] | None:
    """(major, minor); None if the program does not run, such as a shim without a version."""
    code = "import sys; print(*sys.version_info[:2])"
    result = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    return tuple(map(int, result.stdout.split())) if result.returncode == 0 else None
