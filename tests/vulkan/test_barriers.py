"""Each barrier is deleted once: the validation layer notices, or a comment says why it stays.

The layer sees neither what shaders reach by addresses nor what the host does, and Mesa's software
renderer runs commands one after the other, so that no picture changes there.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.environment import ROOT
from tests.helpers.instances import scattered, write_instanced
from tests.helpers.rays import camera_of, several
from tests.helpers.vulkan_scenes import require_vulkan, zoo

PACKAGE = ROOT / "vk_backend"
METHODS = {"barrier", "compute_barrier", "full_barrier", "host_barrier"}
OWN = PACKAGE / "gpu" / "device.py"  # defines them
WIDTH, HEIGHT = 48, 32
COMMENT_LINES = 3  # before a barrier
Site = tuple[str, int]  # file, line


def sites() -> list[Site]:
    """Of all calls that record a barrier."""
    return [
        (path.relative_to(PACKAGE).as_posix(), node.lineno)
        for path in sorted(PACKAGE.rglob("*.py"))
        if path != OWN
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in METHODS
    ]


def has_reason(site: Site) -> bool:
    """Whether a comment stands at the barrier."""
    file, line = site
    lines = (PACKAGE / file).read_text().splitlines()
    return any("# " in text for text in lines[max(line - 1 - COMMENT_LINES, 0) : line])


def caller() -> Site:
    """The call in the back end, of the method that runs."""
    frame = sys._getframe(1)
    while Path(frame.f_code.co_filename) in (OWN, Path(__file__)):
        frame = frame.f_back
    return Path(frame.f_code.co_filename).relative_to(PACKAGE).as_posix(), frame.f_lineno


@pytest.fixture(scope="module")
def renderer():
    """Its messages are read, and need not be empty."""
    require_vulkan()
    from vk_backend.renderer import Renderer

    with Renderer(validation=True) as opened:
        yield opened


class Scenes:
    """Draws in every way that records barriers."""

    def __init__(self, folder: Path):
        from vk_backend.scene.scene import load_scene

        places = scattered(4)
        levels = write_instanced(folder / "levels.glb", places, lod=True, size=(60, 40))
        self.plain = load_scene(zoo(folder / "zoo.glb"))
        self.levels = load_scene(levels, levels=True)
        self.traced = load_scene(several(folder))

    def ways(self, renderer) -> list[Callable[[], None]]:
        """Functions that draw a picture each."""
        from vk_backend.renderer import PATHS, cache_bytes

        cache = cache_bytes(self.plain, "visibility", 0.3)
        ways = [partial(draw, renderer, self.plain, path, None) for path in PATHS]
        ways += [partial(draw, renderer, self.plain, p, cache) for p in ("visibility", "stream")]
        ways += [partial(draw, renderer, self.levels, p, None) for p in ("visibility", "mesh")]
        if "raytracing" in renderer.device.capabilities:
            ways.append(partial(trace, renderer, self.traced))
        return ways


def draw(renderer, scene, path: str, cache: int | None) -> None:
    """Draws with a new drawing."""
    from vk_backend.scene.camera import Camera

    renderer._scene, renderer.cache = None, cache
    camera = Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT)
    renderer.render(scene, camera, path, WIDTH, HEIGHT)


def trace(renderer, scene) -> None:
    from vk_backend.raytrace.tracer import RayTracer
    from vk_backend.renderer import cache_bytes

    tracer = RayTracer(renderer.device, scene, cache=cache_bytes(scene, "rt", 0.4))
    tracer.render(camera_of(scene), 16, 12)
    tracer.free()


@pytest.mark.full
def test_each_barrier_is_needed(renderer, tmp_path, monkeypatch):
    from vk_backend.gpu.device import Device

    ways, record = Scenes(tmp_path).ways(renderer), Device.barrier
    reached: dict[Site, int] = {}  # by the first way that records it
    state: dict[str, Any] = {"deleted": None}

    def barrier(device, commands, *masks):
        site = caller()
        reached.setdefault(site, state["way"])
        if site != state["deleted"]:
            record(device, commands, *masks)

    monkeypatch.setattr(Device, "barrier", barrier)
    messages = renderer.device.messages
    for state["way"], way in enumerate(ways):
        way()
    assert messages == []
    noticed = set()
    for state["deleted"], number in sorted(reached.items()):
        ways[number]()
        if any("SYNC-HAZARD" in message for message in messages):
            noticed.add(state["deleted"])
        messages.clear()
    print(f"noticed: {sorted(noticed)}")  # of a run with -s
    assert {file for file, _ in noticed} >= {"levels/choice.py", "scene/textures.py"}
    assert [site for site in sites() if site not in noticed and not has_reason(site)] == []


def test_barriers_have_a_reason_unless_the_layer_notices():
    """Without drawing, so that it is always tested."""
    found = sites()
    assert len(found) > 30
    assert [site for site in found if not has_reason(site)] == []
