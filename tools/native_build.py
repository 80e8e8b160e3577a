"""Builds the C++ programs of one option of CMakeLists.txt, and the library of the C interface.

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


def build(option: str, root: Path = ROOT) -> Path:
    """Builds the programs of an option and returns their folder.

    option: MESHLET_BENCH, MESHLET_FUZZ or MESHLET_NATIVE_TESTS.
    root: the project's folder. Raises FileNotFoundError without cmake.
    """
    return build_folder(root, root / "build" / option.lower(), f"-D{option}=ON")


def find_cmake() -> str:
    """The path of cmake, that of this environment first. Raises FileNotFoundError."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    cmake = shutil.which("cmake", path=path)
    if cmake is None:
        raise FileNotFoundError("cmake is not installed; pip install cmake")
    return cmake


def build_folder(source: Path, folder: Path, *options: str) -> Path:
    """Builds the CMake project in `source` with its options in `folder`; returns `folder`.

    Raises FileNotFoundError without cmake.
    """
    cmake = find_cmake()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests in several processes share the folder
        for command in (
            [cmake, "-S", source, "-B", folder, *options],
            # Without a number, make would start all compilers at once.
            [cmake, "--build", folder, "--parallel", str(os.cpu_count() or 1)],
        ):
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder


if __name__ == "__main__":
    print(build(sys.argv[1]))
