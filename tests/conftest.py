"""Where the real models are, and which of them a run uses.

`pytest` uses generated models and the small real ones, and skips, with a reason, when the folder is missing.
`pytest --full` uses all of them, and fails without.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MODELS = Path(os.environ.get("GLTF_MESHLET_MODELS") or ROOT.parent / "shared" / "models")
NODE_MODULES = Path(os.environ.get("GLTF_MESHLET_NODE_MODULES") or ROOT / "build" / "node" / "node_modules")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="use all real models; fail without them")


_full = False


def missing(reason: str) -> None:
    """What a test needs is not on this machine: it is skipped with the reason, or fails with --full."""
    (pytest.fail if _full else pytest.skip)(reason)


def pytest_configure(config: pytest.Config) -> None:
    global _full
    _full = config.getoption("--full")
    config.addinivalue_line("markers", "full: needs large models or much time; only with --full")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--full"):
        for test in items:
            if "full" in test.keywords:
                test.add_marker(pytest.mark.skip(reason="only with --full (make test-full)"))


@pytest.fixture
def model():
    """A function from a model's name ("nasty/Box.glb") to its path; skips when it is not there, fails with --full."""

    def find(name: str) -> Path:
        path = MODELS / name
        if not path.is_file():
            missing(f"no model {path}; set GLTF_MESHLET_MODELS to the models' folder")
        return path

    return find
