"""Packs the GPU decoder for engines: python -m tools.build_shader_package [FOLDER]

Writes gltf_meshlet-shaders-VERSION.zip to FOLDER (default dist): the serial decoder as one file for
GLSL and one for HLSL and Slang, the manual, and a compute shader that uses each.
"""

from __future__ import annotations

import os
import re
import sys
import zipfile
from pathlib import Path

import gltf_ext
from tools.shader_sources import INCLUDE, ROOT, include_folders

EXAMPLES = ROOT / "examples" / "gpu_decode"
PARTS = (
    "format/constants.h",
    "decoders/serial_prologue.glsl",
    "decode/serial_decoder.glsl",
    "decoders/serial_epilogue.glsl",
)
HEAD = """\
// The serial decoder of gltf-meshlet {version}, {language}: decodes a meshlet with one thread.
// Made by `make shader-package`. Manual: README.md, which is docs/shaders.md of the project.
//
// SPDX-License-Identifier: MIT
#if !defined(BLOB_WORD)
#error "define BLOB_WORD(i), blob_word_total, MAX_STREAMS and MAX_ELEMENTS first"
#endif
"""
# GLSL's words in HLSL, and names in the decoder that are keywords of HLSL.
HLSL_NAMES = {
    "uvec2": "uint2",
    "uvec3": "uint3",
    "ivec2": "int2",
    "ivec3": "int3",
    "bitCount": "countbits",
    "findLSB": "firstbitlow",
    "line": "line_",
    "point": "point_",
    "triangle": "triangle_",
}
HLSL_FIND_MSB = "#define findMSB(x) int(firstbithigh(x))\n"
# A link to another file of the project, which the package does not have.
LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|#)[^)]*\)")
VARIABLE = re.compile(r"^(?:ALIGNED )?((?:uint|bool|small_uint|mask64|[A-Z]\w+) \w+(?:\[.*\])?;)")
STRUCT = re.compile(r"^struct (\w+)", re.MULTILINE)


def glsl() -> str:
    """The decoder as one file of GLSL, without includes."""
    return HEAD.format(version=gltf_ext.__version__, language="GLSL 4.5") + _sources()


def hlsl() -> str:
    """The decoder as one file that is both HLSL and Slang.

    Variables outside functions become static, since HLSL takes them for constants of the host, and
    structures are filled by a list. The rest is macros.
    """
    head = HEAD.format(version=gltf_ext.__version__, language="HLSL (shader model 6.0) and Slang")
    names = "".join(f"#define {old} {new}\n" for old, new in HLSL_NAMES.items())
    undo = "".join(f"#undef {name}\n" for name in (*HLSL_NAMES, "findMSB"))
    text = _sources()
    made = re.compile(rf"^( +)return ({'|'.join(STRUCT.findall(text))})\((.*)\);$", re.MULTILINE)
    text = made.sub(r"\1\2 made = {\3};\n\1return made;", text)
    depth, lines = 0, []
    for line in text.splitlines(keepends=True):
        lines.append(VARIABLE.sub(r"static \1", line) if depth == 0 else line)
        depth += line.count("{") - line.count("}")
    return head + names + HLSL_FIND_MSB + "".join(lines) + undo


def _sources() -> str:
    """All parts one after the other; what they include is among them."""
    texts = []
    for name in PARTS:
        path = next(folder / name for folder in include_folders() if (folder / name).exists())
        text = path.read_text()
        if not set(INCLUDE.findall(text)) <= set(PARTS):
            raise RuntimeError(f"{name} includes a file that is not packed")
        texts.append(f"\n// ---- {name} ----\n\n" + INCLUDE.sub("", text))
    return "".join(texts)


def files() -> dict[str, str]:
    """Name in the package -> text."""
    return {
        "gltf_meshlet.glsl": glsl(),
        "gltf_meshlet.hlsl": hlsl(),
        "README.md": LINK.sub(r"\1", (ROOT / "docs" / "shaders.md").read_text()),
        "LICENSE": (ROOT / "LICENSE").read_text(),
        **{f"examples/{path.name}": path.read_text() for path in sorted(EXAMPLES.iterdir())},
    }


def main(arguments: list[str]) -> None:
    folder = Path(arguments[0]) if arguments else ROOT / "dist"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"gltf_meshlet-shaders-{gltf_ext.__version__}.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files().items():
            information = zipfile.ZipInfo(name)  # of 1980: the same bytes for the same content
            archive.writestr(information, text, zipfile.ZIP_DEFLATED)
    print(os.path.relpath(path))


if __name__ == "__main__":
    main(sys.argv[1:])
