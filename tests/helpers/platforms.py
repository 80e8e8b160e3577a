"""The wheels of `make wheel` and how their platforms run here."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import gltf_ext
from tests.helpers.environment import ROOT, missing
from tools.build_wheels import PLATFORMS
from tools.other_pythons import ARM, QEMU, WINE, Python

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


def fill(python: Python, folder: Path) -> Path:
    """The folder of packages of a Python: the wheel of its platform and what it needs.

    folder: where pip runs. Tests in several processes share the packages; they are installed again
    for another wheel. Reports what this machine lacks.
    """
    if not python.folder.exists():
        missing(f"{python.folder} does not exist; run make .venv/platforms")
    tag = next(tag for tag in reversed(python.tags) if tag in PLATFORMS)
    if tag in RUNS:
        need_platform(tag)
    wheel, site, stamp = wheel_of(tag), python.folder / "site", python.folder / "site.stamp"
    wanted = " ".join([hashlib.sha256(wheel.read_bytes()).hexdigest(), *python.pins])
    with open(python.folder / "site.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not stamp.exists() or stamp.read_text() != wanted:
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "-q"]
            allowed = [f"--platform={tag}" for tag in python.tags]
            target = ["--upgrade", "--target", site, "--only-binary=:all:"]
            only = [*allowed, "--implementation=cp", f"--python-version={python.version}"]
            run([*pip, *target, *only, wheel, *python.pins], folder)
            stamp.write_text(wanted)
    return site


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
