"""The Python that has Blender as a module (bpy), for tests and measurements of the extension."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# `make test-full` creates it; GLTF_MESHLET_BPY names another one, with another Blender.
PYTHON = Path(os.environ.get("GLTF_MESHLET_BPY") or ROOT / "build" / "bpy" / "bin" / "python")
MISSING = f"{PYTHON} has no bpy; run make .venv/blender, or set GLTF_MESHLET_BPY"


def has_bpy() -> bool:
    """Whether PYTHON runs and has bpy."""
    code = "import importlib.util, sys; sys.exit(importlib.util.find_spec('bpy') is None)"
    return PYTHON.exists() and not subprocess.run((PYTHON, "-c", code), check=False).returncode
