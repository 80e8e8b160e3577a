"""Options and fixtures of all tests.

`pytest` uses generated models and the small real ones, and skips tests, with a reason, if their
files are missing. `pytest --full` uses all models and fails instead.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from tests.helpers import environment, processes

# Seconds of a test that needs large models or emulators. The limit of others is in pyproject.toml.
LONG = 3600


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="use all real models; fail without them")
    parser.addoption("--platforms", action="store_true", help="run tests/platforms, too")


def pytest_configure(config: pytest.Config) -> None:
    environment.full = config.getoption("--full")
    config.addinivalue_line("markers", "full: needs large models or much time; only with --full")
    config.addinivalue_line("markers", "platforms: runs wheels by emulators; only with --platforms")
    config.addinivalue_line("markers", "missing(reason): its files are not on this machine")
    # Examples take longer on a busy machine; a test says nothing about speed.
    hypothesis.settings.register_profile("no deadline", deadline=None)
    hypothesis.settings.load_profile("no deadline")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for option in ("full", "platforms"):
        if not config.getoption(f"--{option}"):
            skip = pytest.mark.skip(reason=f"only with --{option} (make test-{option})")
            for test in items:
                if test.get_closest_marker(option):
                    test.add_marker(skip)
    for test in items:
        if any(test.get_closest_marker(name) for name in ("full", "platforms")):
            test.add_marker(pytest.mark.timeout(LONG))


def pytest_runtest_setup(item: pytest.Item) -> None:
    marker = item.get_closest_marker("missing")
    if marker is not None:
        environment.missing(*marker.args)


@pytest.fixture(scope="session")
def model() -> Callable[[str], Path]:
    """Returns the path of a model by its name ("nasty/Box.glb"); reports it missing if it is."""

    def find(name: str) -> Path:
        path = environment.MODELS / name
        if not path.is_file():
            environment.missing(f"no model {path}; set GLTF_MESHLET_MODELS to the models' folder")
        return path

    return find


@pytest.fixture(scope="module")
def khronos() -> Iterator[Callable[[Iterable[Path]], dict[str, Any]]]:
    """A function from files to {file: {"errors", "warnings"}} by the Khronos validator."""
    environment.need_npm_package("gltf-validator")
    program = environment.ROOT / "tests" / "helpers" / "validator.mjs"
    command = ["node", program, environment.NODE_MODULES]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with processes.running(command, text=True, **pipes) as process:

        def validate(files: Iterable[Path]) -> dict[str, Any]:
            process.stdin.write(json.dumps([str(file) for file in files]) + "\n")
            process.stdin.flush()
            return json.loads(process.stdout.readline())

        yield validate
