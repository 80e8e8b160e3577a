"""The whole check of a device, for JSON and as text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gltf_ext.progress import Advance

from ..gpu.instance import open_instance
from ..gpu.physical import NEEDED, devices_of, index_of
from ..renderer import PATHS
from ..scene.camera import Camera
from ..scene.scene import Scene, load_scene
from .apart import Failure, run_apart
from .drawn import CHECKED, TIMED, WAYS, Drawn, Job, Way, draw
from .driver import RAYS, driver_report, limits_report, why_not_offered
from .reference import Reference, wrong_colors

ALL = "all"  # devices
SECONDS = 120.0  # of a way to draw: a software renderer compiles for ten
RIGHT, WRONG, FAILED, NOT_OFFERED = "right", "wrong", "failed", "not offered"
# Pixels whose colours may differ: another mip level, a triangle at an edge.
COLOR_SHARE = 1e-3


@dataclass(frozen=True)
class Model:
    """The scene to draw: the same triangles in a compressed file and in one with levels.

    why_no_levels: instead of the latter.
    """

    compressed: str
    levels: str
    camera: Camera
    why_no_levels: str = ""


class Checker:
    """Checks devices with a model. run: as `run_apart`."""

    def __init__(self, model: Model, run: Callable[..., Any] = run_apart):
        self._model, self._run = model, run
        self._scene: Scene = load_scene(model.compressed)
        self._references: dict[bool, Reference] = {}

    def model_report(self) -> dict[str, Any]:
        primitives = self._scene.primitives
        return {
            "triangles": self._scene.triangles,
            "instances": len(self._scene.instances),
            "meshlets": sum(primitives[i.primitive].meshlets for i in self._scene.instances),
            "checked_pixels": list(CHECKED),
        }

    def device_report(self, number: int, advance: Advance | None = None) -> dict[str, Any]:
        """number: of the device, in the order of the drivers."""
        with open_instance() as instance:
            device = devices_of(instance)[number]
            absent = why_not_offered(device)
            limits = [] if device.fault(NEEDED) else limits_report(device)
            report = {
                "device": number,
                **driver_report(device),
                "paths": len({*PATHS, RAYS} - set(absent)),
                "limits": limits,
                "timed_pixels": list(CHECKED if device.is_software else TIMED),
            }
        ways: list[dict[str, Any]] = []
        plain: Drawn | None = None
        for done, way in enumerate(WAYS):
            why = absent.get(way.path) or (way.lod_error and self._model.why_no_levels)
            if why:
                ways.append({"way": way.name, "result": NOT_OFFERED, "why": why})
            else:
                drawn = self._draw(number, way, report["timed_pixels"])
                plain = drawn if isinstance(drawn, Drawn) and plain is None else plain
                ways.append(self._judged(way, drawn, plain))
            if advance:
                advance((done + 1) / len(WAYS))
        return {**report, "ways": ways}

    def _draw(self, number: int, way: Way, timed: list[int]) -> Drawn | Failure:
        m = self._model
        job = Job(number, way, m.camera, m.compressed, m.levels, (timed[0], timed[1]))
        drawn: Drawn | Failure = self._run(draw, job, SECONDS)
        return drawn

    def _judged(self, way: Way, drawn: Drawn | Failure, plain: Drawn | None) -> dict[str, Any]:
        """The report on a way. plain: what the uncompressed draw drew."""
        if isinstance(drawn, Failure):
            return {"way": way.name, "result": FAILED, "why": drawn.why}
        problems = self._problems(way, drawn, plain)
        report = {
            "way": way.name,
            "result": WRONG if problems else RIGHT,
            "milliseconds": drawn.milliseconds,
            "of_uncompressed": drawn.milliseconds / plain.milliseconds
            if plain and plain.milliseconds
            else None,
            "frames": drawn.frames,
            "first_seconds": drawn.first_seconds,
            "meshlets_compared": drawn.meshlets,
        }
        return {**report, "why": "; ".join(problems)} if problems else report

    def _problems(self, way: Way, drawn: Drawn, plain: Drawn | None) -> list[str]:
        pixels = self._reference(way.path == RAYS).wrong_pixels(drawn.depth, drawn.ids)
        problems = [f"{pixels:,} of {drawn.depth.size:,} pixels show another triangle"] * (
            pixels > 0
        )
        if drawn.wrong_meshlets:
            meshlets = f"{drawn.wrong_meshlets:,} of {drawn.meshlets:,} meshlets"
            problems.append(f"{meshlets} are decoded to other bytes")
        if plain is not None and plain is not drawn and drawn.color is not None:
            assert drawn.ids is not None and plain.color is not None and plain.ids is not None
            wrong, compared = wrong_colors(drawn.color, drawn.ids, plain.color, plain.ids)
            if wrong > COLOR_SHARE * compared:
                problems.append(f"{wrong:,} of {compared:,} pixels have another colour")
        return problems

    def _reference(self, two_sided: bool) -> Reference:
        if two_sided not in self._references:
            self._references[two_sided] = Reference(
                self._scene, self._model.camera, *CHECKED, two_sided=two_sided
            )
        return self._references[two_sided]


def chosen(select: str | None) -> list[tuple[int, str]]:
    """(number, name) of the devices to check: ALL, or the one that Device would choose.

    If that is none because all have faults, the first one. Raises VulkanError.
    """
    with open_instance() as instance:
        devices = devices_of(instance)
        if select == ALL:
            numbers = list(range(len(devices)))
        elif select is not None:
            numbers = [index_of(select, [device.name for device in devices])]
        else:
            sound = [i for i, device in enumerate(devices) if device.fault(NEEDED) is None]
            sound.sort(key=lambda i: devices[i].is_software)
            numbers = (sound or [0])[:1]
        return [(number, devices[number].name) for number in numbers]
