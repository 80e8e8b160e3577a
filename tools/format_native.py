"""Formats C++ and GLSL with clang-format: python tools/format_native.py [--check] [FILE ...]

clang-format has no language for GLSL and refuses the suffixes; its syntax is close enough to C++,
so that every file is passed on standard input as C++. Without files: all of the project's.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import clang_format

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("bench", "codec", "examples", "mitsuba_plugin", "shaders", "tests", "web")
CPP = (".cpp", ".h")
GLSL = (".comp", ".frag", ".geom", ".glsl", ".mesh", ".rahit", ".rchit", ".rgen", ".rint", ".rmiss")
GLSL += (".hlsl", ".task", ".vert")
PROGRAM = clang_format.get_executable("clang-format")  # pip's bin/clang-format starts Python first


def main(arguments: list[str] | None = None) -> int:
    """Formats or checks; returns the exit status, 1 if a checked file is not formatted."""
    parser = argparse.ArgumentParser(description="Format C++ and GLSL with clang-format.")
    parser.add_argument("--check", action="store_true", help="change nothing; list what would be")
    parser.add_argument("files", metavar="FILE", nargs="*", type=Path, help="default: all")
    options = parser.parse_args(arguments)
    files = [path.resolve() for path in options.files] or native_files()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        changed = [path for path in pool.map(_changed, files) if path is not None]
    for path, text in changed:
        if options.check:
            print(f"{os.path.relpath(path)}: not formatted; run make format")
        else:
            path.write_bytes(text)
    return 1 if options.check and changed else 0


def native_files() -> list[Path]:
    """The project's C++ and GLSL sources."""
    found = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))
    return sorted(path for path in found if path.suffix in CPP + GLSL)


def _changed(path: Path) -> tuple[Path, bytes] | None:
    """The file and its formatted text; None if they are equal. OSError if there is no such file."""
    text = path.read_bytes()
    result = subprocess.run(
        [PROGRAM, "--assume-filename=x.cpp"],
        input=text,
        capture_output=True,
        cwd=ROOT,  # .clang-format is found from here
        check=False,
    )
    if result.returncode:
        sys.exit(f"{path}: {result.stderr.decode(errors='replace').strip()}")
    return None if result.stdout == text else (path, result.stdout)


if __name__ == "__main__":
    sys.exit(main())
