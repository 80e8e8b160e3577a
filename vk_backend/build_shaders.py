"""Compiles shaders/ to the SPIR-V that this package ships: python -m vk_backend.build_shaders.

Writes to vk_backend/spirv: a .spv file per module, the digests of their sources (sources.json),
their structures and constants by name (reflection.json), and the headers that the host reads, too.
The shaders of measurements, bench/shaders, go to bench/spirv in the same way.
"""

from __future__ import annotations

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

from .reflection import OP_DECORATE, Reflection, instructions, reflect, words_of

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "shaders"
BENCH_SOURCES = ROOT / "bench" / "shaders"
INCLUDE_FOLDERS = (SOURCES, ROOT / "codec", BENCH_SOURCES)
WGSL_ONLY = SOURCES / "web"  # see web/build_wgsl.py
OUTPUT = Path(__file__).resolve().parent / "spirv"
BENCH_OUTPUT = ROOT / "bench" / "spirv"
# Copied to the output for vk_backend.constants.
HEADERS = (
    ROOT / "codec" / "format" / "constants.h",
    SOURCES / "scene" / "scene_constants.h",
    SOURCES / "raytrace" / "rt_constants.h",
)
MANIFEST = "sources.json"
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
INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)
# A source may be compiled several times: each NAME=MACRO[,MACRO...] in its lines
# `// variants: ...` makes spirv/<NAME>.spv.
VARIANTS = re.compile(r"^// variants: (.*)$", re.MULTILINE)


def modules(sources: Path = SOURCES) -> dict[str, tuple[Path, list[str]]]:
    """Module name -> (source, macros) of all shaders in a folder."""
    found = {}
    for source in sorted(
        (p for p in sources.rglob("*") if p.suffix in STAGES and p.parent != WGSL_ONLY),
        key=lambda p: p.name,
    ):
        for item in " ".join(VARIANTS.findall(source.read_text())).split() or [source.name]:
            name, _, macros = item.partition("=")
            found[name] = (source, [m for m in macros.split(",") if m])
    return found


def closure(source: Path) -> list[Path]:
    """A source and all files that it includes, each once.

    Raises RuntimeError if one is missing.
    """
    found = [source]
    for path in found:
        for name in INCLUDE.findall(path.read_text()):
            places = [folder / name for folder in INCLUDE_FOLDERS]
            included = next((place for place in places if place.exists()), None)
            if included is None:
                raise RuntimeError(f"{path}: cannot find {name}, which it includes")
            if included not in found:
                found.append(included)
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


def compile_module(name: str, source: Path, macros: list[str]) -> tuple[bytes, Reflection]:
    """The SPIR-V of one module, without names, and its reflection.

    Raises RuntimeError with the compiler's messages.
    """
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


def build(sources: Path, output: Path, force: bool = False) -> list[str]:
    """Compiles the modules of a folder that changed and deletes those without a source.

    Returns the names of the compiled modules.
    """
    output.mkdir(exist_ok=True)
    manifest, reflection_file = output / MANIFEST, output / REFLECTION
    known = json.loads(manifest.read_text()) if manifest.exists() else {}
    reflections = (
        read_reflections(json.loads(reflection_file.read_text()))
        if reflection_file.exists()
        else {}
    )
    wanted = modules(sources)
    digests = {name: digest(*made_from) for name, made_from in wanted.items()}
    stale = [
        n
        for n in wanted
        if force
        or known.get(n) != digests[n]
        or n not in reflections
        or not (output / f"{n}.spv").exists()
    ]
    with ThreadPoolExecutor() as pool:
        for name, (code, reflection) in zip(
            stale, pool.map(lambda n: compile_module(n, *wanted[n]), stale)
        ):
            (output / f"{name}.spv").write_bytes(code)
            reflections[name] = reflection
    for path in output.glob("*.spv"):
        if path.name.removesuffix(".spv") not in wanted:
            path.unlink()
    merged = merge_reflections({name: reflections[name] for name in wanted})
    reflection_file.write_text(json.dumps(merged, indent=1, sort_keys=True) + "\n")
    manifest.write_text(json.dumps(digests, indent=1, sort_keys=True) + "\n")
    return stale


def main() -> int:
    for tool, package in (("glslangValidator", "glslang-tools"), ("spirv-opt", "spirv-tools")):
        if not shutil.which(tool):
            sys.exit(f"build_shaders: {tool} is not installed (Debian: apt install {package})")
    for sources, output in ((SOURCES, OUTPUT), (BENCH_SOURCES, BENCH_OUTPUT)):
        try:
            names = build(sources, output, "--force" in sys.argv[1:])
        except RuntimeError as error:
            sys.exit(f"build_shaders: {error}")
        folder = output.relative_to(ROOT)
        print(f"{folder}: {len(names)} of {len(modules(sources))} modules compiled")
    for header in HEADERS:
        (OUTPUT / header.name).write_bytes(header.read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main())
