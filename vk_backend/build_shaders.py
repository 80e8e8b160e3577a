"""Compiles shaders/ to the SPIR-V that this package ships: python -m vk_backend.build_shaders."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "shaders"
INCLUDE_FOLDERS = (SOURCES, ROOT / "codec")
OUTPUT = Path(__file__).resolve().parent / "spirv"
CONSTANTS = ROOT / "codec" / "format" / "constants.h"  # shipped as it is, for vk_backend.constants
MANIFEST = OUTPUT / "sources.json"
STAGES = {
    ".comp",
    ".task",
    ".mesh",
    ".vert",
    ".geom",
    ".frag",
    ".rgen",
    ".rint",
    ".rahit",
    ".rchit",
    ".rmiss",
}
# Ray tracing: pipelines that differ by constants alone shall compute the same bits, though drivers compile each anew and may fuse a product
# and a sum in one of them.
EXACT_STAGES = {".rgen", ".rint", ".rahit", ".rchit"}
INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)
# A source may be compiled several times: lines `// variants: NAME=MACRO[,MACRO...] ...` make spirv/<NAME>.spv of each.
VARIANTS = re.compile(r"^// variants: (.*)$", re.MULTILINE)


def modules() -> dict[str, tuple[Path, list[str]]]:
    """Module name -> (source, macros) of all shaders."""
    found = {}
    for source in sorted(
        (p for p in SOURCES.rglob("*") if p.suffix in STAGES), key=lambda p: p.name
    ):
        for item in " ".join(VARIANTS.findall(source.read_text())).split() or [source.name]:
            name, _, macros = item.partition("=")
            found[name] = (source, [m for m in macros.split(",") if m])
    return found


def closure(source: Path) -> list[Path]:
    """A source and all that it includes, each once."""
    found = [source]
    for path in found:
        for name in INCLUDE.findall(path.read_text()):
            included = next(folder / name for folder in INCLUDE_FOLDERS if (folder / name).exists())
            if included not in found:
                found.append(included)
    return found


def digest(source: Path, macros: list[str]) -> str:
    """SHA-256 of everything that a module is made from."""
    hashed = hashlib.sha256(
        " ".join([*macros, "exact"] if source.suffix in EXACT_STAGES else macros).encode()
    )
    for path in closure(source):
        hashed.update(path.name.encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()


# Opcodes and a decoration of SPIR-V: OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, and those of vectors and matrices; OpDecorate; NoContraction.
ARITHMETIC = {127, 129, 131, 133, 136, 142, 143, 144, 145, 146, 148}
DECORATE, NO_CONTRACTION = 71, 42
EXTENDED, FMA = 12, 50  # OpExtInst, of GLSL.std.450
FIRST_TYPE, LAST_TYPE = 19, 39


def instructions(words: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """(position, opcode) of each instruction of a module."""
    position = 5
    while position < len(words):
        yield position, words[position] & 0xFFFF
        position += max(words[position] >> 16, 1)


def is_arithmetic(words: tuple[int, ...], position: int, opcode: int) -> bool:
    """Whether an instruction is one that drivers may fuse with others, or take apart."""
    return opcode in ARITHMETIC or (opcode == EXTENDED and words[position + 4] == FMA)


def exact(code: bytes) -> bytes:
    """The module with all its arithmetic and fma decorated NoContraction. For dot, cross and products with matrices that is not enough
    (shaders/rt_exact.glsl)."""
    words = struct.unpack(f"<{len(code) // 4}I", code)
    found = list(instructions(words))
    decorated = {
        words[p + 1] for p, opcode in found if opcode == DECORATE and words[p + 2] == NO_CONTRACTION
    }
    results = [
        words[p + 2]
        for p, opcode in found
        if is_arithmetic(words, p, opcode) and words[p + 2] not in decorated
    ]
    added = [word for result in results for word in (3 << 16 | DECORATE, result, NO_CONTRACTION)]
    begin = next(
        p for p, opcode in found if FIRST_TYPE <= opcode <= LAST_TYPE
    )  # types follow the decorations
    words = (*words[:begin], *added, *words[begin:])
    return struct.pack(f"<{len(words)}I", *words)


def compile_module(name: str, source: Path, macros: list[str]) -> bytes:
    """The SPIR-V of one module. Raises RuntimeError with the compiler's words."""
    output = OUTPUT / f".{name}.part"
    command = [
        "glslangValidator",
        "-V",
        "--target-env",
        "vulkan1.3",
        *(f"-I{folder}" for folder in INCLUDE_FOLDERS),
        "-o",
        str(output),
        str(source),
    ]
    result = subprocess.run([*command, *(f"-D{m}" for m in macros)], capture_output=True, text=True)
    try:
        if result.returncode != 0:
            raise RuntimeError(result.stdout + result.stderr)
        if shutil.which("spirv-opt"):
            subprocess.run(
                ["spirv-opt", "--strip-debug", str(output), "-o", str(output)], check=True
            )
        code = output.read_bytes()
        return exact(code) if source.suffix in EXACT_STAGES else code
    finally:
        output.unlink(missing_ok=True)


def build(force: bool = False) -> list[str]:
    """Compiles what changed and forgets what is gone; returns the names of the compiled modules."""
    OUTPUT.mkdir(exist_ok=True)
    known = json.loads(MANIFEST.read_text()) if MANIFEST.exists() else {}
    wanted = modules()
    digests = {name: digest(*made_from) for name, made_from in wanted.items()}
    stale = [
        n
        for n in wanted
        if force or known.get(n) != digests[n] or not (OUTPUT / f"{n}.spv").exists()
    ]
    with ThreadPoolExecutor() as pool:
        for name, code in zip(stale, pool.map(lambda n: compile_module(n, *wanted[n]), stale)):
            (OUTPUT / f"{name}.spv").write_bytes(code)
    for path in OUTPUT.glob("*.spv"):
        if path.stem not in wanted and path.name.removesuffix(".spv") not in wanted:
            path.unlink()
    (OUTPUT / CONSTANTS.name).write_bytes(CONSTANTS.read_bytes())
    MANIFEST.write_text(json.dumps(digests, indent=1, sort_keys=True) + "\n")
    return stale


if __name__ == "__main__":
    if not shutil.which("glslangValidator"):
        sys.exit(
            "build_shaders: glslangValidator is not installed (Debian: apt install glslang-tools)"
        )
    try:
        names = build("--force" in sys.argv[1:])
    except RuntimeError as error:
        sys.exit(f"build_shaders: {error}")
    print(f"{len(names)} of {len(modules())} modules compiled")
