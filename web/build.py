"""Compiles decoder.cpp and the codec's decoder to decoder.wasm: python web/build.py [FILE]

Needs the Python package ziglang, in the version that pyproject.toml names.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

WEB = Path(__file__).resolve().parent
CODEC = WEB.parent / "codec"
# All but format/refuse.cpp, which throws an exception, and what only the native library needs.
SOURCES = [
    WEB / "decoder.cpp",
    CODEC / "format" / "blob.cpp",
    CODEC / "decode" / "decoder.cpp",
    CODEC / "decode" / "bulk_decoder.cpp",
]
OPTIONS = [
    *("-target", "wasm32-wasi", "-mexec-model=reactor"),
    *("-std=c++17", "-Os", "-flto", "-DNDEBUG", "-fvisibility=hidden"),
    *("-fno-exceptions", "-fno-rtti"),
    # -O2 is 4 % faster (dragon), but too large: 17 kB with Brotli. So is a threshold of 225: 15.6.
    # The default threshold is 4 % slower.
    *("-mllvm", "-inline-threshold=100"),
    # As codec/CMakeLists.txt: the same values as any other build.
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
    # Every browser since 2023 has these.
    *("-mbulk-memory", "-mnontrapping-fptoint", "-msign-ext", "-msimd128"),
    *("-Wl,--gc-sections", "-Wl,--strip-all", "-Wl,-z,stack-size=65536"),
    "-Wl,--export=__stack_pointer",  # decoder.js restores it after an exception
]


def build(output: Path) -> None:
    """Writes the module. Raises CalledProcessError if the compiler fails."""
    with tempfile.TemporaryDirectory(dir=output.parent) as folder:
        part = Path(folder) / output.name
        command = [sys.executable, "-m", "ziglang", "c++", *OPTIONS, f"-I{CODEC}"]
        subprocess.run([*command, *map(str, SOURCES), "-o", str(part)], check=True)
        os.replace(part, output)


if __name__ == "__main__":
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else WEB / "decoder.wasm"
    try:
        build(file.resolve())
    except subprocess.CalledProcessError:
        sys.exit(f"{file}: cannot be compiled; is ziglang installed? (make web installs it)")
