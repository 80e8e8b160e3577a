"""Compiles the npm package's decoder.wasm and unpacker.wasm: python tools/build_wasm.py [FOLDER]

Needs the Python package ziglang, in the version that pyproject.toml names.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WEB, CODEC = ROOT / "web", ROOT / "codec"
# Module -> its sources, without what only the native library needs, and options.
MODULES: dict[str, tuple[list[Path], list[str]]] = {
    # On the C interface it would have 48.5 kB instead of 35.1: objects, statuses and
    # checks of room, none of which JavaScript needs.
    "decoder.wasm": (
        [
            WEB / "decoder.cpp",
            CODEC / "format" / "blob.cpp",
            CODEC / "decode" / "decoder.cpp",
        ],
        # -O2 is 4 % faster (dragon), but too large: 17 kB with Brotli. So are thresholds of 225
        # (15.6) and 100 (15.1, 1 % faster on igea). The default threshold is 4 % slower.
        ["-Os", "-mllvm", "-inline-threshold=80"],
    ),
    "unpacker.wasm": (
        [WEB / "unpacker.cpp"],
        # -O2 is 19.4 kB with Brotli, this 17.6.
        ["-Os", "-mllvm", "-inline-threshold=200", "-Wno-psabi"],
    ),
}
OPTIONS = [
    *("-target", "wasm32-wasi", "-mexec-model=reactor"),
    *("-std=c++17", "-flto", "-DNDEBUG", "-DMESHLET_NO_BEGINS", "-fvisibility=hidden"),
    *("-fno-exceptions", "-fno-rtti"),
    # As codec/CMakeLists.txt: the same values as any other build.
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
    # Every browser since 2023 has these.
    *("-mbulk-memory", "-mnontrapping-fptoint", "-msign-ext", "-msimd128"),
    *("-Wl,--gc-sections", "-Wl,--strip-all", "-Wl,-z,stack-size=65536"),
    "-Wl,--export=__stack_pointer",  # decoder.js restores it after an exception
]


def build(folder: Path) -> None:
    """Writes the modules. Raises CalledProcessError if the compiler fails."""
    for name, (sources, options) in MODULES.items():
        with tempfile.TemporaryDirectory(dir=folder) as temporary:
            part = Path(temporary) / name
            command = [sys.executable, "-m", "ziglang", "c++", *OPTIONS, *options, f"-I{CODEC}"]
            subprocess.run([*command, *map(str, sources), "-o", str(part)], check=True)
            os.replace(part, folder / name)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else WEB
    try:
        build(folder.resolve())
    except subprocess.CalledProcessError:
        sys.exit(f"{folder}: cannot be compiled; is ziglang installed? (make web installs it)")
