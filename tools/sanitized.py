"""Runs a Python module with gltf_ext's native code under ASan and UBSan.

python -m tools.sanitized MODULE [ARGUMENTS]. The exit status is the module's, or that of a
sanitizer's report.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tools.native_build import ROOT, build_folder

# Puts the sanitized library before the installed one, then runs the other module.
_RUN = """
import runpy, sys, gltf_ext
gltf_ext.__path__.insert(0, sys.argv[1])
sys.argv = sys.argv[2:]
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""


def command(module: str, *arguments: str) -> tuple[list[str], dict[str, str]]:
    """(command, environment) that runs the module. Builds the native code with GCC.

    Raises FileNotFoundError without cmake or g++.
    """
    folder = build_folder(
        ROOT,
        ROOT / "build" / "sanitized",
        "-DMESHLET_FUZZ=ON",
        "-DCMAKE_CXX_COMPILER=g++",
    )
    environment = {
        **os.environ,
        # ASan must come first; with libstdc++ beside it, it finds the functions for exceptions.
        "LD_PRELOAD": f"{_library('libasan.so')} {_library('libstdc++.so.6')}",
        # Python does not free everything at its end.
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    return [sys.executable, "-c", _RUN, str(folder), module, *arguments], environment


def _library(name: str) -> Path:
    """The path of a library of GCC."""
    found = subprocess.run(
        ["g++", f"-print-file-name={name}"], check=True, capture_output=True, text=True
    )
    return Path(found.stdout.strip()).resolve()


def main() -> int:
    if len(sys.argv) < 2:
        sys.exit("usage: python -m tools.sanitized MODULE [ARGUMENTS]")
    arguments, environment = command(*sys.argv[1:])
    return subprocess.run(arguments, cwd=ROOT, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
