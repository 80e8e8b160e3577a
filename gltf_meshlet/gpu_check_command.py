"""`gltf-meshlet gpu-check`: what a Vulkan driver offers, and whether every path draws rightly."""

from __future__ import annotations

import argparse
import json
import platform
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gltf_ext
from gltf_ext.errors import MeshletError, printable
from gltf_ext.progress import progress_bar
from gltf_meshlet.demo import check_scene

if TYPE_CHECKING:
    from vk_backend.check.report import Checker

WRONG = 1  # exit status


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `gpu-check`."""
    command.add_argument(
        "--device",
        metavar="DEVICE",
        help="number, or a part of the name, or all (default: the first GPU)",
    )
    command.add_argument("--json", action="store_true", help="print JSON instead of the text")


def run(options: argparse.Namespace) -> int:
    """Checks and prints; returns the exit status: 0, or 1 if a path does not draw rightly.

    Raises MeshletError, OSError; without Vulkan, before any work.
    """
    from vk_backend.check.report import chosen

    devices = chosen(options.device)
    with tempfile.TemporaryDirectory() as folder:
        checker = _checker(Path(folder))
        reports = [_checked(checker, number, name) for number, name in devices]
    report = {
        "gltf_meshlet": gltf_ext.__version__,
        "system": _system(),
        "model": checker.model_report(),
        "devices": reports,
    }
    print(json.dumps(report, indent=2) if options.json else _text(report))
    return _status(reports)


def _checker(folder: Path) -> Checker:
    """Makes the scene, compressed without and with levels of detail."""
    from vk_backend.check.report import Checker, Model
    from vk_backend.scene.camera import Camera

    source = check_scene.write(folder / "scene.glb")
    files = folder / "compressed.glb", folder / "levels.glb"
    gltf_ext.compress(source, files[0])
    why_no_levels = ""
    try:
        gltf_ext.compress(source, files[1], lod=True)
    except MeshletError as error:  # of a package that is not installed
        why_no_levels = error.message
    camera = Camera.look_at(
        check_scene.EYE,
        check_scene.TARGET,
        yfov=check_scene.FIELD_OF_VIEW,
        near=check_scene.NEAR,
        far=check_scene.FAR,
    )
    return Checker(Model(str(files[0]), str(files[1]), camera, why_no_levels))


def _checked(checker: Checker, number: int, name: str) -> dict[str, Any]:
    with progress_bar(f"checks {name}", True) as advance:
        return checker.device_report(number, advance)


def _system() -> str:
    """Of the system, nothing that names the machine or its user."""
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"


def _text(report: dict[str, Any]) -> str:
    from vk_backend.check.text import device_text

    head = f"gltf-meshlet {report['gltf_meshlet']} gpu-check, {report['system']}"
    parts = [_printable_lines(device_text(d, report["model"])) for d in report["devices"]]
    return "\n\n".join([head, *parts])


def _printable_lines(text: str) -> str:
    """Names come from drivers."""
    return "\n".join(printable(line) for line in text.split("\n"))


def _status(reports: list[dict[str, Any]]) -> int:
    from vk_backend.check.text import wrong_ways

    wrong = [f"{way} on {printable(r['name'])}" for r in reports for way in wrong_ways(r)]
    if wrong:
        print(f"gltf-meshlet: wrong: {', '.join(wrong)}; please report it", file=sys.stderr)
    return WRONG if wrong else 0
