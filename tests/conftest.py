"""Options and fixtures of all tests.

`pytest` uses generated models and the small real ones, and skips, with a reason, when their folder is missing.
`pytest --full` uses all of them, and fails without.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers import environment


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="use all real models; fail without them")


def pytest_configure(config: pytest.Config) -> None:
    environment.full = config.getoption("--full")
    config.addinivalue_line("markers", "full: needs large models or much time; only with --full")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--full"):
        for test in items:
            if "full" in test.keywords:
                test.add_marker(pytest.mark.skip(reason="only with --full (make test-full)"))


@pytest.fixture
def model() -> Callable[[str], Path]:
    """A function from a model's name ("nasty/Box.glb") to its path; skips when it is not there, fails with --full."""

    def find(name: str) -> Path:
        path = environment.MODELS / name
        if not path.is_file():
            environment.missing(f"no model {path}; set GLTF_MESHLET_MODELS to the models' folder")
        return path

    return find
