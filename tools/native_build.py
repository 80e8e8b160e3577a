"""Builds the C++ programs of one option of CMakeLists.txt, without the Python module.

python -m tools.native_build OPTION: prints the folder of the programs.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def build(option: str, root: Path = ROOT, python: bool = False) -> Path:
    """Builds the programs of an option and returns their folder.

    option: MESHLET_BENCH, MESHLET_FUZZ or MESHLET_NATIVE_TESTS.
    root: the project's folder. python: also builds the Python module, into the programs' folder.
    Raises FileNotFoundError without cmake.
    """
    return build_folder(
        root, root / "build" / option.lower(), f"-D{option}=ON", *_python_options(python)
    )


def build_folder(source: Path, folder: Path, *options: str) -> Path:
    """Builds the CMake project in `source` with its options in `folder`; returns `folder`.

    Raises FileNotFoundError without cmake.
    """
    cmake = shutil.which(
        "cmake",
        path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
    )
    if cmake is None:
        raise FileNotFoundError("cmake is not installed; pip install cmake")
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests in several processes share the folder
        for command in (
            [cmake, "-S", source, "-B", folder, *options],
            [cmake, "--build", folder, "--parallel"],
        ):
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder


def _python_options(python: bool) -> list[str]:
    if not python:
        return ["-DMESHLET_PYTHON=OFF"]
    return ["-DMESHLET_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}"]


if __name__ == "__main__":
    print(build(sys.argv[1]))
