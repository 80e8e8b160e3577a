"""Chooses the newest installed LLVM for the `llvm_*` variants: old ones abort on Dr.Jit's code."""

from __future__ import annotations

import os
import re
from pathlib import Path

VARIABLE = "DRJIT_LIBLLVM_PATH"  # of Dr.Jit; never overwritten
LEAST_VERSION = 17
FOLDERS = (
    "/usr/lib/*-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/lib/llvm-*/lib",
    "/usr/local/lib",
)


def choose() -> bool:
    """Points Dr.Jit at LLVM 17 or newer, before its first use; False if there is none."""
    if not os.environ.get(VARIABLE):
        found = [
            (version, path)
            for path in _libraries()
            if (version := _version(path.name)) >= LEAST_VERSION
        ]
        if not found:
            return False
        os.environ[VARIABLE] = str(max(found)[1])
    return True


def _libraries() -> list[Path]:
    root = Path("/")
    return [library for folder in FOLDERS for library in root.glob(f"{folder[1:]}/libLLVM*.so*")]


def _version(name: str) -> int:
    """libLLVM-17.so.1 -> 17, libLLVM.so.19.1 -> 19, 0 for other names."""
    match = re.fullmatch(r"libLLVM(?:-(\d+)\.so(?:\.1)?|\.so\.(\d+)(?:\.\d+)*)", name)
    return int(match[1] or match[2]) if match else 0
