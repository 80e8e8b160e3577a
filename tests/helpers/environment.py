"""Where the tests find things outside them, and what happens if something is missing.

A test that needs something this machine may lack calls `missing` or one of the `need_*` functions:
they skip it with the reason, or fail it with --full.
"""

from __future__ import annotations

import importlib
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
MODELS = Path(os.environ.get("GLTF_MESHLET_MODELS") or ROOT.parent / "shared" / "models")
NODE_MODULES = Path(
    os.environ.get("GLTF_MESHLET_NODE_MODULES") or ROOT / "build" / "node" / "node_modules"
)
VECTORS = ROOT / "spec" / "vectors"

full = False  # conftest.py sets it: --full


def missing(reason: str) -> NoReturn:
    """Skips the test because this machine lacks something; fails it with --full."""
    if full:
        pytest.fail(reason)
    pytest.skip(reason)


def need_program(name: str, package: str) -> str:
    """The path of a program. package: how to install it, for the reason of a skipped test."""
    path = shutil.which(name)
    if path is None:
        missing(f"{name} is not installed ({package})")
    return path


def need_package(name: str) -> ModuleType:
    """An optional Python package."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        missing(f"{name} cannot be imported: {error}")


def need_npm_package(name: str) -> Path:
    """The folder of an npm package; `make` installs them into build/node."""
    need_program("node", "Debian: apt install nodejs")
    folder = NODE_MODULES / name
    if not folder.is_dir():
        missing(f"the npm package {name} is not in {NODE_MODULES}")
    return folder


def parameters_or_missing(parameters: Iterable[Any], reason: str) -> list[Any]:
    """Parameters of a test made from files; if there are none, one that reports them missing.

    Without it, a test whose files are missing would vanish silently.
    """
    found = list(parameters)
    return found or [pytest.param(None, id="missing", marks=pytest.mark.missing(reason))]
