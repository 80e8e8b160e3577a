"""Builds the C++ programs behind an option of CMakeLists.txt, without Python.

python -m tools.native_build OPTION: prints the folder that they are in.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def build(option: str) -> Path:
    """Builds MESHLET_BENCH, MESHLET_FUZZ or MESHLET_NATIVE_TESTS; FileNotFoundError without cmake."""
    folder = ROOT / "build" / option.lower()
    cmake = shutil.which(
        "cmake",
        path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
    )
    if cmake is None:
        raise FileNotFoundError("cmake is not installed; pip install cmake")
    for command in (
        [cmake, "-S", ROOT, "-B", folder, "-DMESHLET_PYTHON=OFF", f"-D{option}=ON"],
        [cmake, "--build", folder, "--parallel"],
    ):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder


if __name__ == "__main__":
    print(build(sys.argv[1]))
