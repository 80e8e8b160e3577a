"""The wheels of `make wheel` and how their platforms run here."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import gltf_ext
from tests.helpers.environment import ROOT, missing
from tools.other_pythons import ARM, QEMU, WINE

# Platform tag -> command before a program. The other wheels cannot run on Linux.
RUNS: dict[str, tuple[str, ...]] = {
    "manylinux_2_17_x86_64": (),
    "musllinux_1_2_x86_64": (),
    "manylinux_2_17_aarch64": QEMU,
    "musllinux_1_2_aarch64": QEMU,
    "win_amd64": ("wine",),
}


def wheel_of(tag: str) -> Path:
    """The wheel of this version for a platform."""
    path = ROOT / "dist" / f"gltf_meshlet-{gltf_ext.__version__}-py3-none-{tag}.whl"
    if not path.exists():
        missing(f"{path} does not exist; run make wheel")
    return path


def need_platform(tag: str) -> None:
    """Reports what this machine lacks to run programs of a platform."""
    needed = [*RUNS[tag][:1], *(["ld-musl-config"] if tag == "musllinux_1_2_x86_64" else [])]
    for program in needed:
        if shutil.which(program) is None:
            missing(f"{program} is not installed; run make .venv/platforms")
    if RUNS[tag] == QEMU and not ARM.exists():
        missing(f"{ARM} does not exist; run make .venv/platforms")


def run(
    command: Sequence[str | Path], folder: Path, seconds: int = 1800
) -> subprocess.CompletedProcess[str]:
    """Runs a command of any platform in a folder; it must succeed."""
    result = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **WINE},
        capture_output=True,
        text=True,
        timeout=seconds,
    )
    assert result.returncode == 0, result.stderr or result.stdout[-2000:]
    return result
