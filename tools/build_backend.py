"""The build backend of pyproject.toml: scikit-build-core, with Zig where there is no C++ compiler.

python tools/build_backend.py: prints the package that has the compiler, if one is missing.
"""

from __future__ import annotations

import os
import shlex
import shutil
from pathlib import Path

if __name__ != "__main__":  # make runs this file before it installs scikit-build-core
    from scikit_build_core import build as _build
    from scikit_build_core.build import *  # noqa: F403  the hooks that need no compiler

COMPILERS = ("c++", "g++", "clang++")  # Microsoft's does not compile the codec
ZIG = "ziglang==0.17.1"


def missing_compiler() -> list[str]:
    """The requirement of a compiler, if this machine has none."""
    found = os.environ.get("CXX") or any(map(shutil.which, COMPILERS))
    return [] if found else [ZIG]


def get_requires_for_build_wheel(settings: dict | None = None) -> list[str]:
    return [*_build.get_requires_for_build_wheel(settings), *missing_compiler()]


def get_requires_for_build_editable(settings: dict | None = None) -> list[str]:
    return [*_build.get_requires_for_build_editable(settings), *missing_compiler()]


def build_wheel(folder: str, settings: dict | None = None, metadata: str | None = None) -> str:
    _choose_compiler()
    return _build.build_wheel(folder, settings, metadata)


def build_editable(folder: str, settings: dict | None = None, metadata: str | None = None) -> str:
    _choose_compiler()
    return _build.build_editable(folder, settings, metadata)


def _choose_compiler() -> None:
    if not missing_compiler():
        return
    import ziglang

    zig = shutil.which("zig", path=Path(ziglang.__file__).parent)
    # For any processor of this kind: without a name, Zig compiles for the one that it runs on.
    os.environ["CXX"] = f"{zig} c++ -mcpu=baseline"
    rules = Path(__file__).resolve().parent.parent / "cmake" / "zig.cmake"
    options = [f"-DCMAKE_AR={zig}", f"-DCMAKE_USER_MAKE_RULES_OVERRIDE_CXX={rules}"]
    options += ["-DCMAKE_SHARED_LINKER_FLAGS=-s"]  # 1 MB instead of 16
    os.environ["CMAKE_ARGS"] = f"{os.environ.get('CMAKE_ARGS', '')} {shlex.join(options)}"


if __name__ == "__main__":
    print(*missing_compiler())
