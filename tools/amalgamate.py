"""Writes the decoder as one header and one source: python -m tools.amalgamate [FOLDER]

FOLDER (default dist/decoder) receives gltf_meshlet.h, gltf_meshlet.cpp and LICENSE: the decoding
half of the C interface, without dependencies, for engines that compile everything themselves. Needs
nothing but Python.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import gltf_ext
from tools.shader_sources import ROOT

CODEC = ROOT / "codec"
HEADER = "gltf_meshlet.h"
SOURCES = (
    "format/blob.cpp",
    "format/problem.cpp",
    "decode/memory.cpp",
    "decode/decoder.cpp",
    "decode/view.cpp",
    "processors.cpp",
    "transport/unpack.cpp",
    "levels/tables.cpp",
    "levels/cut.cpp",
    "c/objects.cpp",
    "c/decode.cpp",
    "c/levels.cpp",
)
ONCE = "#pragma once"
AGAIN = "decode/avx2_begin.h"  # headers that do not say ONCE are compiled again after it
INCLUDE = re.compile(r'^#include "([^"]+)"')
# An unnamed namespace around the codec's: the object file defines no symbol of it, which could
# clash with one of the engine.
NAMESPACE = (
    (re.compile(r"^namespace gltf_meshlet_codec {$"), "namespace { namespace gltf_meshlet_codec {"),
    (re.compile(r"^}(?=  // namespace gltf_meshlet_codec$)"), "}}"),
)
NOTE = """\
// gltf-meshlet {version}: the decoder, made by `make amalgamation`. Manual: docs/c.md.
//
// SPDX-License-Identifier: MIT
"""
HEADER_HEAD = """\
#ifndef GLTF_MESHLET_STATIC
#define GLTF_MESHLET_STATIC
#endif
#ifndef GLTF_MESHLET_DECODER_ONLY
#define GLTF_MESHLET_DECODER_ONLY
#endif
"""
# Values must not depend on the engine's options. -march=haswell alone would fuse multiplications
# and additions: two conformance vectors then decode to other normals.
SOURCE_HEAD = """\
#ifdef __FAST_MATH__
#error "compile this file without -ffast-math: values would depend on the compiler"
#endif
#ifdef __clang__
#ifdef __wasm__
#pragma clang fp reassociate(off)
#else
#pragma float_control(precise, on)
#endif
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#if __GCC_IEC_559 < 1
#error "compile this file without -funsafe-math-optimizations and what it consists of"
#endif
#pragma GCC optimize("fp-contract=off")
#else
#error "compile this file with GCC, Clang or clang-cl"
#endif
#pragma GCC diagnostic ignored "-Wpsabi"  // no function that passes vectors is called from outside
#pragma GCC diagnostic ignored "-Wunused-function"  // of the encoder
#pragma GCC diagnostic ignored "-Wshadow"  // of members, which the decoder's GLSL has at file scope
#define MESHLET_NO_THREADS  // the engine's threads decode: `threads` has no effect
"""


def header() -> str:
    return (
        NOTE.format(version=gltf_ext.__version__) + HEADER_HEAD + (CODEC / "c" / HEADER).read_text()
    )


def source() -> str:
    """All sources with their includes in place: each header once, or once for each processor."""
    done: set[str] = set()
    body = "".join(_expanded(name, done) for name in SOURCES)
    return NOTE.format(version=gltf_ext.__version__) + SOURCE_HEAD + f'#include "{HEADER}"\n' + body


def _expanded(name: str, done: set[str]) -> str:
    lines = [f"\n// ---- {name} ----\n"]
    for line in (CODEC / name).read_text().splitlines(keepends=True):
        found = INCLUDE.match(line)
        if found is None:
            for pattern, text in NAMESPACE:
                line = pattern.sub(text, line)
            lines.append("" if line.startswith(ONCE) else line)
        elif found[1] != f"c/{HEADER}" and found[1] not in done:
            done.add(found[1])
            lines.append(_expanded(found[1], done))
            if found[1] == AGAIN:
                done -= {name for name in done if ONCE not in (CODEC / name).read_text()}
    return "".join(lines)


def main(arguments: list[str]) -> None:
    folder = Path(arguments[0]) if arguments else ROOT / "dist" / "decoder"
    folder.mkdir(parents=True, exist_ok=True)
    licence = (ROOT / "LICENSE").read_text()
    texts = {HEADER: header(), "gltf_meshlet.cpp": source(), "LICENSE": licence}
    for name, text in texts.items():
        (folder / name).write_text(text)
        print(os.path.relpath(folder / name))


if __name__ == "__main__":
    main(sys.argv[1:])
