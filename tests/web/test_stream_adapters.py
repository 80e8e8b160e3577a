"""MeshletStream of three.js and Babylon.js in Node, without pictures."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.helpers import environment, web_package
from tests.helpers.environment import ROOT
from tests.helpers.instances import scattered, write_instanced

LEVELS = ROOT / "spec" / "lod_vectors" / "lod_levels.glb"


@pytest.fixture(scope="module")
def user(tmp_path_factory) -> Path:
    """A folder with the installed packages."""
    packages = ("three", "@babylonjs/core", "@babylonjs/loaders")
    return web_package.install(tmp_path_factory.mktemp("web") / "user", *packages)


def run(user: Path, task: str, file: Path = LEVELS) -> Any:
    environment.need_program("node", "Debian: apt install nodejs")
    command = ["node", ROOT / "tests" / "web" / "stream_adapters.mjs", user, task, file]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_wrong_pixels_and_copies_are_refused(user):
    for engine, result in run(user, "properties").items():
        problem = "RangeError: pixels must be a number of at least 0, not "
        assert (result["set"], result["made"]) == (f"{problem}NaN", f"{problem}1"), engine
        assert result["copied"].endswith("make another one of the same file")
        assert result["pixels"] == 2


def test_streams_with_a_wrong_option_leave_nothing_in_babylons_scene(user):
    result = run(user, "refused")
    assert result["made"].startswith("RangeError: pixels")
    assert result["placed"].startswith("TypeError")
    assert result["left"] == [0, 0, 0, 0]


def test_statistics_are_whole_before_the_first_picture(user):
    for result in run(user, "statistics").values():
        assert result["before"] == result["after"]
        assert len(result["before"][0]) > 10
        assert result["isOurs"] is True


def test_materials_are_freed_also_while_colours_are_shown(user):
    result = run(user, "coloured")
    assert result["made"] == result["freed"] > 0


def test_babylon_has_nothing_to_complain_about(user):
    result = run(user, "quiet")
    assert result["said"] == []
    assert result["made"][0] > 0 and result["left"] == [0, 0, 0, 0]


def test_babylon_is_empty_after_a_stream_that_ends_while_its_pages_come(user):
    result = run(user, "early")
    assert (result["ready"], result["errors"]) == ("Error: the stream is disposed", [])
    assert (result["freed"], result["left"]) == (1, [0, 0, 0, 0])


def test_another_renderer_gets_nothing_of_a_lost_context(user):
    """Also before the event tells that it is lost."""
    first, second = run(user, "lostRenderer")
    assert first == second > 100


def test_places_of_instances_are_freed(user, tmp_path):
    path = write_instanced(tmp_path / "balls.glb", scattered(3))
    assert run(user, "instances", path) == {"made": 2, "freed": 2}


def test_babylon_does_without_the_module_that_moves_pages(user):
    assert run(user, "offline") == {"ready": "nothing", "warnings": ["offline"]}
