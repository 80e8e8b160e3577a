"""Translates shaders/ to the WGSL that the npm package ships: python -m tools.build_wgsl

Writes to web/wgsl: a .wgsl file per module, and the digests of their sources
(sources.json). Needs the Python package slangpy, in the version that pyproject.toml names: its
library is the Slang compiler.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.metadata
import importlib.util
import json
import sys
import tempfile
from pathlib import Path

from tools.shader_sources import ROOT, SOURCES, closure, include_folders

OUTPUT = ROOT / "web" / "wgsl"
MANIFEST = OUTPUT / "sources.json"
PRELUDE = "web/wgsl.glsl"
# Capacities: streams of a blob, as many as the format allows, and elements, of which only interior
# holds values in workgroup memory, 16 KiB by WebGPU's default limits.
CAPACITIES = {"MAX_STREAMS": 64, "MAX_ELEMENTS": 256}
INTERIOR = {"MAX_STREAMS": 8, "MAX_ELEMENTS": 20}
# An entry point. web/wgsl.glsl declares what it sets.
ENTRY = """\
[shader("compute")]
void {entry}_main(uint thread : SV_GroupIndex, uint3 workgroup : SV_GroupID,
             uint3 invocation : SV_DispatchThreadID) {{
  the_thread = thread;
  the_workgroup = workgroup;
  the_invocation = invocation;
  {entry}_shader();
}}
"""
WHOLE_PROGRAM = 1 << 8  # SLANG_TARGET_FLAG_GENERATE_WHOLE_PROGRAM: all entry points in one text
DIRECT_SPIRV = 1 << 10  # SLANG_TARGET_FLAG_GENERATE_SPIRV_DIRECTLY, the default: without glslang
# Module -> the shaders whose entry points it has: NAME.comp becomes NAME_main.
MODULES = {
    "connect": ["decoders/connect.comp"],
    "passes": [
        "decoders/lengths.comp",
        "decoders/corners.comp",
        "decoders/chains.comp",
        "decoders/traversal.comp",
        "decoders/geo.comp",
    ],
    "interior": ["decoders/interior.comp"],
    "ranges": ["web/ranges.comp"],
    "indices": ["web/indices.comp"],
    "attribute": ["web/attribute.comp"],
}
# Slang's warnings without use: uninitialised shared memory, loops that test another variable,
# implicit conversions.
QUIET = "41017,30508,39001,30081,15205"


class Slang:
    """The compiler in slangpy's wheel, by its C functions."""

    def __init__(self) -> None:
        spec = importlib.util.find_spec("slangpy")
        if spec is None or spec.origin is None:
            raise RuntimeError("slangpy is not installed (make web installs it)")
        (library,) = Path(spec.origin).parent.glob("libslang-compiler.so*")
        self._c = ctypes.CDLL(str(library))
        self.version = importlib.metadata.version("slangpy")
        for name, result, arguments in (
            ("slang_createGlobalSession2", ctypes.c_int, [ctypes.c_void_p, ctypes.c_void_p]),
            ("spCreateCompileRequest", ctypes.c_void_p, [ctypes.c_void_p]),
            ("spDestroyCompileRequest", None, [ctypes.c_void_p]),
            (
                "spProcessCommandLineArguments",
                ctypes.c_int,
                [ctypes.c_void_p, ctypes.POINTER(ctypes.c_char_p), ctypes.c_int],
            ),
            ("spCompile", ctypes.c_int, [ctypes.c_void_p]),
            ("spGetDiagnosticOutput", ctypes.c_char_p, [ctypes.c_void_p]),
            (
                "spSetTargetFlags",
                None,
                [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint],
            ),
            (
                "spGetTargetCodeBlob",
                ctypes.c_int,
                [ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(ctypes.c_void_p)],
            ),
        ):
            function = getattr(self._c, name)
            function.restype, function.argtypes = result, arguments
        self._session = self._create_session()

    def _create_session(self) -> ctypes.c_void_p:
        class Description(ctypes.Structure):
            _fields_ = [
                ("size", ctypes.c_uint32),
                ("api_version", ctypes.c_uint32),
                ("language_version", ctypes.c_uint32),
                ("glsl", ctypes.c_bool),
                ("reserved", ctypes.c_uint32 * 16),
            ]

        description = Description(language_version=2025, glsl=True)
        description.size = ctypes.sizeof(description)
        session = ctypes.c_void_p()
        if self._c.slang_createGlobalSession2(ctypes.byref(description), ctypes.byref(session)):
            raise RuntimeError("the Slang compiler does not start")
        return session

    def compile(self, source: Path, entries: list[str], *options: str) -> bytes:
        """Compiles a file's entry points, which are compute shaders, as slangc does.

        Raises RuntimeError with the compiler's messages.
        """
        request = self._c.spCreateCompileRequest(self._session)
        try:
            arguments = [
                str(source),
                *options,
                *("-warnings-disable", QUIET),
                *(word for name in entries for word in ("-entry", name, "-stage", "compute")),
            ]
            encoded = [a.encode() for a in arguments]
            array = (ctypes.c_char_p * len(encoded))(*encoded)
            failed = self._c.spProcessCommandLineArguments(request, array, len(encoded)) < 0
            self._c.spSetTargetFlags(request, 0, WHOLE_PROGRAM | DIRECT_SPIRV)
            failed = failed or self._c.spCompile(request) < 0
            messages = (self._c.spGetDiagnosticOutput(request) or b"").decode()
            if failed or messages:
                raise RuntimeError(messages)
            code = ctypes.c_void_p()
            self._c.spGetTargetCodeBlob(request, 0, ctypes.byref(code))
            return _contents(code)
        finally:
            self._c.spDestroyCompileRequest(request)


def _contents(blob: ctypes.c_void_p) -> bytes:
    """The contents of an ISlangBlob, and releases it."""
    table = ctypes.cast(blob, ctypes.POINTER(ctypes.POINTER(ctypes.c_void_p)))[0]
    # The methods: queryInterface, addRef, release, getBufferPointer, getBufferSize.
    release = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_void_p)(table[2])
    pointer = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)(table[3])
    size = ctypes.CFUNCTYPE(ctypes.c_size_t, ctypes.c_void_p)(table[4])
    contents = ctypes.string_at(pointer(blob), size(blob))
    release(blob)
    return contents


def capacities(name: str) -> dict[str, int]:
    """Macro -> value, for a module."""
    return INTERIOR if name == "interior" else CAPACITIES


def digest(name: str) -> str:
    """SHA-256 of everything that a module is made from, without the compiler."""
    hashed = hashlib.sha256(json.dumps([MODULES[name], capacities(name), ENTRY]).encode())
    for path in dict.fromkeys(
        path for source in (PRELUDE, *MODULES[name]) for path in closure(SOURCES / source)
    ):
        hashed.update(path.name.encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()


def translate(slang: Slang, name: str) -> str:
    """The WGSL of a module."""
    lines = [f"#define {macro} {value}u" for macro, value in capacities(name).items()]
    lines.append(f'#include "{PRELUDE}"')
    names = [Path(source).stem for source in MODULES[name]]
    for source, entry in zip(MODULES[name], names):
        lines += [f"#define main {entry}_shader", f'#include "{source}"', "#undef main"]
        lines += ENTRY.format(entry=entry).splitlines()
    with tempfile.TemporaryDirectory() as folder:
        wrapper = Path(folder) / f"{name}.comp"
        wrapper.write_text("\n".join(lines) + "\n")
        includes = (f"-I{folder}" for folder in include_folders())
        entries = [f"{entry}_main" for entry in names]
        text = slang.compile(
            wrapper, entries, "-lang", "glsl", "-target", "wgsl", *includes
        ).decode()
    sources = ", ".join(f"shaders/{source}" for source in MODULES[name])
    return f"// Translated from {sources} by tools/build_wgsl.py: do not edit.\n{text}"


def build() -> None:
    """Translates all modules and deletes files without a module."""
    slang = Slang()
    OUTPUT.mkdir(exist_ok=True)
    for name in MODULES:
        (OUTPUT / f"{name}.wgsl").write_text(translate(slang, name))
    for path in OUTPUT.glob("*.wgsl"):
        if path.stem not in MODULES:
            path.unlink()
    manifest = {"slangpy": slang.version, "sources": {name: digest(name) for name in MODULES}}
    MANIFEST.write_text(json.dumps(manifest, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    try:
        build()
    except RuntimeError as error:
        sys.exit(f"build_wgsl: {error}")
    print(f"{len(MODULES)} modules in {OUTPUT.relative_to(ROOT)}")
