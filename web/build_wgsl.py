"""Translates shaders/ to the WGSL that the npm package ships: python -m web.build_wgsl

Writes to web/wgsl: a .wgsl file per module, and the digests of what they are made from
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

from vk_backend.build_shaders import INCLUDE_FOLDERS, SOURCES, closure

ROOT = Path(__file__).resolve().parent.parent

OUTPUT = ROOT / "web" / "wgsl"
MANIFEST = OUTPUT / "sources.json"
PRELUDE = SOURCES / "web" / "wgsl.glsl"
# Streams of a blob, and elements of all streams together. The serial decoder takes every blob; the
# passes keep a meshlet's values in WebGPU's 16 KiB of workgroup memory.
ANY = {"MAX_STREAMS": "64u"}
CONNECT = {"MAX_STREAMS": "8u", "SPREAD": "1u"}
INTERIOR = {"MAX_STREAMS": "8u", "MAX_ELEMENTS": "20u"}
# Takes 0.19 in place of 0.31 ms for dragon on an H200: more workgroups fit a multiprocessor.
SMALL = {"MAX_STREAMS": "8u", "MAX_ELEMENTS": "8u"}
# Module -> (source in shaders/, macros).
MODULES = {
    "decode": ("decoders/decode.comp", ANY),
    "connect": ("decoders/connect.comp", CONNECT),
    "lengths": ("decoders/lengths.comp", INTERIOR),
    "corners": ("decoders/corners.comp", INTERIOR),
    "corners_split": ("decoders/corners.comp", {**INTERIOR, "SPLIT": ""}),
    "chains": ("decoders/chains.comp", INTERIOR),
    "chains_split": ("decoders/chains.comp", {**INTERIOR, "NO_AFFINE": ""}),
    "interior": ("decoders/interior.comp", INTERIOR),
    "interior_small": ("decoders/interior.comp", SMALL),
    "traversal": ("decoders/traversal.comp", INTERIOR),
    "geo": ("decoders/geo.comp", INTERIOR),
    "ranges": ("web/ranges.comp", ANY),
    "indices": ("web/indices.comp", ANY),
    "attribute": ("web/attribute.comp", ANY),
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
            ("spGetEntryPointSource", ctypes.c_char_p, [ctypes.c_void_p, ctypes.c_int]),
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

    def translate(self, source: Path) -> str:
        """The WGSL of a compute shader. Raises RuntimeError with the compiler's messages."""
        request = self._c.spCreateCompileRequest(self._session)
        try:
            arguments = [
                str(source),
                *(f"-I{folder}" for folder in INCLUDE_FOLDERS),
                *("-lang", "glsl", "-target", "wgsl", "-entry", "main", "-stage", "compute"),
                *("-warnings-disable", QUIET),
            ]
            encoded = [a.encode() for a in arguments]
            array = (ctypes.c_char_p * len(encoded))(*encoded)
            failed = self._c.spProcessCommandLineArguments(request, array, len(encoded)) < 0
            failed = failed or self._c.spCompile(request) < 0
            messages = (self._c.spGetDiagnosticOutput(request) or b"").decode()
            if failed or messages:
                raise RuntimeError(messages)
            return self._c.spGetEntryPointSource(request, 0).decode()
        finally:
            self._c.spDestroyCompileRequest(request)


def digest(name: str) -> str:
    """SHA-256 of everything that a module is made from, without the compiler."""
    source, macros = MODULES[name]
    hashed = hashlib.sha256(json.dumps(macros).encode())
    for path in [*closure(PRELUDE), *closure(SOURCES / source)]:
        hashed.update(path.name.encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()


def translate(slang: Slang, name: str) -> str:
    """The WGSL of a module."""
    source, macros = MODULES[name]
    with tempfile.TemporaryDirectory() as folder:
        wrapper = Path(folder) / f"{name}.comp"
        lines = [f"#define {macro} {value}" for macro, value in macros.items()]
        lines += [f'#include "{path}"' for path in (PRELUDE.relative_to(SOURCES), source)]
        wrapper.write_text("\n".join(lines) + "\n")
        text = slang.translate(wrapper)
    return f"// Translated from shaders/{source} by web/build_wgsl.py: do not edit.\n{text}"


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
