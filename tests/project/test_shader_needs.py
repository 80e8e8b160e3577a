"""An included shader source says in a line what it needs from those that include it.

`// needs: NAME, FOLDER/FILE, ...`: functions, macros or variables, and files that have them, for it
and for what it includes. `// optional: NAME, ...`: macros that an includer may define first. What a
file can include by itself, it includes; each has a guard.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tools import build_shaders
from tools.shader_sources import ROOT, closure, include_folders

FOREIGN_LANGUAGE = "wgsl.glsl"  # defines WGSL's names for GLSL's functions
SHARED = ("shaders", "codec/decode", "bench/shaders")
INCLUDED = sorted(
    path
    for folder in SHARED
    for path in (ROOT / folder).rglob("*.glsl")
    if path.name != FOREIGN_LANGUAGE
)
HEADERS = [ROOT / "codec/format/constants.h", *(ROOT / "shaders").rglob("*.h")]
NEEDS = re.compile(r"^// needs: (.*)$", re.MULTILINE)
OPTIONAL = re.compile(r"^// optional: (.*)$", re.MULTILINE)
CONDITION = re.compile(r"^#ifn?def (\w+)", re.MULTILINE)
MACRO = re.compile(r"^\s*#\s*define (\w+)", re.MULTILINE)
PARAMETERS = re.compile(r"^\s*#\s*define \w+\((.*?)\)", re.MULTILINE)
# At the beginning of a line are only declarations of functions, variables and types.
FUNCTION = re.compile(r"^(?:INLINE )?\w+ (\w+)\([^;{]*\)\s*\{", re.MULTILINE)
VARIABLE = re.compile(
    r"^(?:layout\(.*?\) )?(?:(?:const|shared|SHARED|ALIGNED|flat|in|out|\w+EXT|\w+KHR) )*"
    r"(?!return|else|struct)\w+ ((?:\w+(?:\[[^;]*?\])?(?:, )?)+)(?: = [^;]*)?;",
    re.MULTILINE,
)
TYPE = re.compile(r"\b(?:struct|buffer|uniform) (\w+) *\{")
LOCAL = re.compile(r"\b[A-Za-z]\w* (\w+)\b(?!\()")
WORD = re.compile(r"(?<![.\w])([A-Za-z_]\w*)")


def code_of(path: Path) -> str:
    """Without comments."""
    return re.sub(r"//.*", "", path.read_text())


@cache
def defined_in(path: Path) -> frozenset[str]:
    """What a file declares for those that include it."""
    text = code_of(path)
    variables = re.sub(r"\[[^;]*?\]", "", ", ".join(VARIABLE.findall(text)))
    names = MACRO.findall(text) + FUNCTION.findall(text) + TYPE.findall(text)
    names += re.findall(r"^}\n(\w+);", text, re.MULTILINE) + variables.split(", ")
    return frozenset(filter(None, names)) - {guard_of(path)}


def guard_of(path: Path) -> str:
    return re.sub(r"\W", "_", path.name).upper()


@cache
def defined_with(path: Path) -> frozenset[str]:
    """The same, with all that it includes."""
    return frozenset().union(*map(defined_in, closure(path)))


@cache
def everything() -> frozenset[str]:
    """What any file that can be included declares."""
    return frozenset().union(*map(defined_in, [*INCLUDED, *HEADERS]))


@cache
def foreign_to(path: Path) -> frozenset[str]:
    """What a file uses and does not declare, of what any other declares."""
    text = re.sub(r"^\s*#\s*(include|extension|version).*$", "", code_of(path), flags=re.MULTILINE)
    own = {*LOCAL.findall(text), *re.findall(r"\w+", " ".join(PARAMETERS.findall(text)))}
    return frozenset(WORD.findall(text)) & everything() - own - defined_in(path)


def missing(path: Path) -> frozenset[str]:
    """What a file and those that it includes use, and none of them declares."""
    return frozenset().union(*map(foreign_to, closure(path))) - defined_with(path)


def listed(lines: re.Pattern, path: Path) -> list[str]:
    return [name for line in lines.findall(path.read_text()) for name in line.split(", ")]


def provided_by(need: str) -> frozenset[str]:
    """The names that an entry of `needs` stands for."""
    if "." not in need:
        return frozenset({need})
    (path,) = (p for folder in include_folders() if (p := folder / need).exists())
    return defined_with(path)


@pytest.mark.parametrize("path", INCLUDED, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_needs_are_what_a_file_uses_and_does_not_have(path):
    foreign, needs = missing(path), listed(NEEDS, path)
    lacks = foreign - frozenset().union(*map(provided_by, needs))
    assert not lacks, f"{sorted(lacks)}: include a file that has them, or add them to `// needs:`"
    useless = [need for need in needs if not provided_by(need) & foreign]
    assert not useless, f"{useless} are not needed"


@pytest.mark.parametrize("path", INCLUDED, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_options_are_the_macros_that_an_includer_may_define(path):
    options = set(CONDITION.findall(path.read_text())) - {guard_of(path), "WGSL"} - variants()
    assert set(listed(OPTIONAL, path)) == options


@cache
def variants() -> frozenset[str]:
    """The macros of variants: of modules, which the build defines."""
    modules = [build_shaders.modules(package) for package in build_shaders.PACKAGES]
    macros = [m for found in modules for _, macros in found.values() for m in macros]
    return frozenset(macro.partition("=")[0] for macro in macros)


@pytest.mark.parametrize("path", INCLUDED, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_file_may_be_included_twice(path):
    """Not those that C++ and the package for engines include once, and which serial.glsl orders."""
    once = "serial_prologue", "serial_decoder", "serial_epilogue", "parallel_connectivity"
    guard = guard_of(path)
    assert path.stem in once or f"#ifndef {guard}\n#define {guard}\n" in path.read_text()


def test_a_missing_need_is_noticed(tmp_path, monkeypatch):
    path = ROOT / "shaders/decoders/slot_output.glsl"
    changed = tmp_path / path.name
    changed.write_text(path.read_text().replace("// needs: decoded_value\n", ""))
    with pytest.raises(AssertionError, match=r"decoded_value.*add them to"):
        test_needs_are_what_a_file_uses_and_does_not_have(changed)
    changed.write_text(path.read_text().replace("needs: decoded", "needs: WORKGROUP, decoded"))
    with pytest.raises(AssertionError, match=r"WORKGROUP.*are not needed"):
        test_needs_are_what_a_file_uses_and_does_not_have(changed)
