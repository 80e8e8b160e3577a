"""Short functions and files: what a reader can take in at once, in all Python that is shipped."""

import ast

import pytest

from tests.helpers.environment import ROOT

PACKAGES = ("gltf_ext", "gltf_scene", "gltf_meshlet", "mitsuba_plugin", "vk_backend", "blender")
LONGEST_FUNCTION, LONGEST_FILE = 60, 600  # lines; those of a function without its docstring


def lengths(source):
    """(name, lines without the docstring) of each function of a source text."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            docstring = node.body[0] if ast.get_docstring(node, clean=False) is not None else None
            described = docstring.end_lineno - docstring.lineno + 1 if docstring else 0
            yield node.name, node.end_lineno - node.lineno + 1 - described


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_and_files_are_short(package):
    paths = sorted((ROOT / package).rglob("*.py"))
    assert paths
    sources = {path.relative_to(ROOT).as_posix(): path.read_text() for path in paths}
    long = {name: text.count("\n") for name, text in sources.items()}
    assert {name: lines for name, lines in long.items() if lines > LONGEST_FILE} == {}
    functions = {
        f"{name}: {function}": lines
        for name, text in sources.items()
        for function, lines in lengths(text)
    }
    assert {name: n for name, n in functions.items() if n > LONGEST_FUNCTION} == {}


def test_long_functions_are_found():
    body = "    x = 1\n" * LONGEST_FUNCTION
    (function,) = lengths(f'def f():\n    """Two\n    lines."""\n{body}')
    assert function == ("f", LONGEST_FUNCTION + 1)
