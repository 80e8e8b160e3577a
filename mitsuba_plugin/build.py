"""Builds the native library for the mitsuba of the Python that runs this: python mitsuba_plugin/build.py [FOLDER]

FOLDER keeps what a later build can use again. Run as a file, since the package cannot be imported without its library.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
NEEDED = ("mitsuba", "drjit", "nanobind")
HASWELL = {"avx2", "bmi1", "bmi2", "fma"}  # what the wheel's code is compiled for


def main(arguments: list[str] | None = None) -> int:
    """Builds and installs into this package; returns the exit status, 1 after one line on stderr."""
    parser = argparse.ArgumentParser(
        prog="build.py", description="Build the Mitsuba plugin's native library."
    )
    parser.add_argument(
        "folder",
        metavar="FOLDER",
        nargs="?",
        help="build here, and keep it (default: a temporary folder)",
    )
    folder = parser.parse_args(arguments).folder
    problem = _obstacle()
    if problem is None:
        with tempfile.TemporaryDirectory() as temporary:
            problem = _build(Path(folder or temporary).resolve(), keep=folder is not None)
    if problem:
        print(f"mitsuba_plugin cannot be built: {problem}", file=sys.stderr)
        return 1
    return 0


def _obstacle() -> str | None:
    """What is known to be in the way before anything is compiled."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return f"it needs an x86-64 processor, this is {platform.machine()}"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists() and not HASWELL <= set(cpuinfo.read_text().split()):
        return "it needs a processor with AVX2"
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        return f"{', '.join(missing)} not installed; pip install 'gltf-meshlet[mitsuba]'"
    if shutil.which("cmake", path=_path()) is None:
        return "cmake is not installed; pip install 'gltf-meshlet[mitsuba]'"
    return None


def _path() -> str:
    """Programs that pip installed beside this Python come first."""
    return os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])


def _build(folder: Path, keep: bool) -> str | None:
    """Configures, compiles and installs; returns what went wrong."""
    folder.mkdir(parents=True, exist_ok=True)
    generator = ["-G", "Ninja"] if shutil.which("ninja", path=_path()) else []
    commands = (
        ["cmake", "-S", HERE, "-B", folder, *generator, f"-DPython_EXECUTABLE={sys.executable}"],
        ["cmake", "--build", folder, "--parallel"],
        ["cmake", "--install", folder, "--prefix", HERE],
    )
    log = folder / "build.log"
    with log.open("w") as output:
        for command in commands:
            try:
                subprocess.run(
                    command,
                    check=True,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    env={**os.environ, "PATH": _path()},
                )
            except subprocess.CalledProcessError:
                break
        else:
            return None
    cause = next(
        (
            line.strip()
            for line in log.read_text(errors="replace").splitlines()
            if "error" in line.lower()
        ),
        "no cause given",
    )
    return f"{cause[:200]}; it needs GCC 12 or newer" + (f"; all of it is in {log}" if keep else "")


if __name__ == "__main__":
    sys.exit(main())
