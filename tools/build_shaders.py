"""Compiles shaders/ to the SPIR-V of vk_backend and bench: python -m tools.build_shaders

Writes to vk_backend/spirv: a .spv file per module, the digests of their sources (sources.json),
their structures and constants by name (reflection.json), and the headers that the host reads, too.
The modules of measurements go to bench/spirv, which is not committed: bench compiles them if they
are stale.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import re
import shutil
import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from .shader_sources import ROOT, SOURCES, closure, include_folders
from .spirv import OP_DECORATE, Reflection, instructions, reflect, words_of

BENCH_SOURCES = ROOT / "bench" / "shaders"
WGSL_ONLY = SOURCES / "web"  # see build_wgsl.py
PACKAGES = ("vk_backend", "bench")  # each has its modules in a folder spirv
OUTPUT = ROOT / "vk_backend" / "spirv"
# Copied to the output for vk_backend.gpu.constants.
HEADERS = (
    ROOT / "codec" / "format" / "constants.h",
    SOURCES / "scene" / "scene_constants.h",
    SOURCES / "raytrace" / "rt_constants.h",
)
MANIFEST = "sources.json"
LOCK = ROOT / "build" / "shaders.lock"
REFLECTION = "reflection.json"
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
# Ray-tracing pipelines that differ only in specialisation constants must compute the same bits.
# Drivers compile each one anew and may fuse a multiplication and an addition in one of them.
EXACT_STAGES = {".rgen", ".rint", ".rahit", ".rchit"}
# A source may be compiled several times: each [PACKAGE:]NAME=MACRO[,MACRO...] in its lines
# `// variants: ...` makes PACKAGE/spirv/NAME.spv. Default: the package of its folder.
VARIANTS = re.compile(r"^// variants: (.*)$", re.MULTILINE)


def modules(package: str = "vk_backend") -> dict[str, tuple[Path, list[str]]]:
    """Module name -> (source, macros) of all shaders of a package."""
    found = {}
    for folder, default in ((SOURCES, "vk_backend"), (BENCH_SOURCES, "bench")):
        for source in sorted(folder.rglob("*"), key=lambda p: p.name):
            if source.suffix not in STAGES or source.parent == WGSL_ONLY:
                continue
            for item in " ".join(VARIANTS.findall(source.read_text())).split() or [source.name]:
                owner, _, variant = item.rpartition(":")
                name, _, macros = variant.partition("=")
                if (owner or default) == package:
                    found[name] = (source, [m for m in macros.split(",") if m])
    return found


def digest(source: Path, macros: list[str]) -> str:
    """SHA-256 of everything that a module is compiled from."""
    hashed = hashlib.sha256(
        " ".join([*macros, "exact"] if source.suffix in EXACT_STAGES else macros).encode()
    )
    for path in closure(source):
        hashed.update(path.name.encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()


# --- exact arithmetic ---

# OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv and those of vectors and matrices.
ARITHMETIC = {127, 129, 131, 133, 136, 142, 143, 144, 145, 146, 148}
NO_CONTRACTION = 42  # decoration
OP_EXTENDED = 12  # OpExtInst of GLSL.std.450
FMA = 50  # of GLSL.std.450
FIRST_OP_TYPE = 19
LAST_OP_TYPE = 39


def is_arithmetic(words: tuple[int, ...], position: int, opcode: int) -> bool:
    """Whether drivers may fuse an instruction with others, or take it apart."""
    return opcode in ARITHMETIC or (opcode == OP_EXTENDED and words[position + 4] == FMA)


def exact(code: bytes) -> bytes:
    """Decorates all arithmetic and fma of a module with NoContraction.

    That is not enough for dot, cross and matrix products: see shaders/raytrace/rt_exact.glsl.
    """
    words = words_of(code)
    found = list(instructions(words))
    decorated = {
        words[p + 1]
        for p, opcode in found
        if opcode == OP_DECORATE and words[p + 2] == NO_CONTRACTION
    }
    results = [
        words[p + 2]
        for p, opcode in found
        if is_arithmetic(words, p, opcode) and words[p + 2] not in decorated
    ]
    added = [word for result in results for word in (3 << 16 | OP_DECORATE, result, NO_CONTRACTION)]
    # Types follow the decorations.
    begin = next(p for p, opcode in found if FIRST_OP_TYPE <= opcode <= LAST_OP_TYPE)
    words = (*words[:begin], *added, *words[begin:])
    return struct.pack(f"<{len(words)}I", *words)


# --- compiling ---


def compile_module(output: Path, source: Path, macros: list[str]) -> tuple[bytes, Reflection]:
    """The SPIR-V of one module, without names, and its reflection. output: a temporary file.

    Raises RuntimeError with the compiler's messages.
    """
    command = [
        "glslangValidator",
        "-V",
        "--target-env",
        "vulkan1.3",
        *(f"-I{folder}" for folder in include_folders()),
        "-o",
        str(output),
        str(source),
    ]
    result = subprocess.run([*command, *(f"-D{m}" for m in macros)], capture_output=True, text=True)
    try:
        if result.returncode != 0:
            raise RuntimeError(result.stdout + result.stderr)
        reflection = reflect(output.read_bytes())
        subprocess.run(["spirv-opt", "--strip-debug", str(output), "-o", str(output)], check=True)
        code = output.read_bytes()
        return exact(code) if source.suffix in EXACT_STAGES else code, reflection
    finally:
        output.unlink(missing_ok=True)


def merge_reflections(found: dict[str, Reflection]) -> dict[str, Any]:
    """{"structures": ..., "strides": ...} of all modules, {"modules": {name: ...}} of each.

    modules: the names of the structures and the ids of the specialisation constants of a module.
    Raises RuntimeError if modules disagree about a structure.
    """
    merged: dict[str, Any] = {"structures": {}, "strides": {}, "modules": {}}
    for name in sorted(found):
        reflection = found[name]
        for part in ("structures", "strides"):
            for structure, value in getattr(reflection, part).items():
                if merged[part].setdefault(structure, value) != value:
                    raise RuntimeError(f"{name}: structure {structure} differs from other modules")
        merged["modules"][name] = {
            "structures": sorted(reflection.structures),
            "specialization": reflection.specialization,
        }
    return merged


def read_reflections(merged: dict[str, Any]) -> dict[str, Reflection]:
    """The inverse of merge_reflections."""
    return {
        name: Reflection(
            {s: merged["structures"][s] for s in module["structures"]},
            {s: merged["strides"][s] for s in module["structures"] if s in merged["strides"]},
            module["specialization"],
        )
        for name, module in merged["modules"].items()
    }


def stale_modules(package: str) -> list[str]:
    """The modules of a package whose SPIR-V is missing or older than its sources."""
    output = ROOT / package / "spirv"
    manifest = output / MANIFEST
    known = json.loads(manifest.read_text()) if manifest.exists() else {}
    return [
        name
        for name, made_from in modules(package).items()
        if known.get(name) != digest(*made_from) or not (output / f"{name}.spv").exists()
    ]


def build(package: str, force: bool = False) -> list[str]:
    """Compiles the modules of a package that changed and deletes those without a source.

    Returns the names of the compiled modules. Raises RuntimeError if a program is missing, and with
    the compiler's messages.
    """
    output = ROOT / package / "spirv"
    output.mkdir(exist_ok=True)
    LOCK.parent.mkdir(exist_ok=True)
    with LOCK.open("w") as lock:  # tests may compile the modules of bench at the same time
        fcntl.flock(lock, fcntl.LOCK_EX)
        wanted = modules(package)
        stale = list(wanted) if force else stale_modules(package)
        if stale:
            _require_programs()
        reflection_file = output / REFLECTION
        reflections = (
            read_reflections(json.loads(reflection_file.read_text()))
            if reflection_file.exists()
            else {}
        )
        with ThreadPoolExecutor() as pool:
            compiled = pool.map(lambda n: compile_module(output / f".{n}.part", *wanted[n]), stale)
            for name, (code, reflection) in zip(stale, compiled):
                (output / f"{name}.spv").write_bytes(code)
                reflections[name] = reflection
        for path in output.glob("*.spv"):
            if path.name.removesuffix(".spv") not in wanted:
                path.unlink()
        merged = merge_reflections({name: reflections[name] for name in wanted})
        digests = {name: digest(*made_from) for name, made_from in wanted.items()}
        for file, content in ((reflection_file, merged), (output / MANIFEST, digests)):
            text = json.dumps(content, indent=1, sort_keys=True) + "\n"
            if not file.exists() or file.read_text() != text:
                file.write_text(text)
        return stale


def _require_programs() -> None:
    for tool, package in (("glslangValidator", "glslang-tools"), ("spirv-opt", "spirv-tools")):
        if not shutil.which(tool):
            raise RuntimeError(f"{tool} is not installed (Debian: apt install {package})")


def main() -> int:
    for package in PACKAGES:
        try:
            names = build(package, "--force" in sys.argv[1:])
        except RuntimeError as error:
            sys.exit(f"build_shaders: {error}")
        print(f"{package}/spirv: {len(names)} of {len(modules(package))} modules compiled")
    for header in HEADERS:
        (OUTPUT / header.name).write_bytes(header.read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main())
