"""CONTRIBUTING.md's table of a primitive's way through `compress`, against what it imports."""

import ast
import inspect
import re
import sys
from pathlib import Path

import gltf_ext
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import sheet

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "gltf_ext"
HEADING = "### A primitive's way through `compress`\n"
ROW = re.compile(r"^\|[^|]*\|([^|]*)\|", re.MULTILINE)
NAME = re.compile(r"`([\w/]+\.py)`")


def table():
    """The modules in the order of the table."""
    section = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split(HEADING)[1]
    cells = ROW.findall(section.split("\n### ")[0])
    return [name for cell in cells for name in NAME.findall(cell)]


def imports(module):
    """The modules of the package that one imports, also in functions; folders are none."""
    for node in ast.walk(ast.parse((PACKAGE / module).read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("gltf_ext"):
            continue
        folder = "/".join(node.module.split(".")[1:])
        names = [f"{folder}/{alias.name}.py".lstrip("/") for alias in node.names]
        yield from (name for name in [f"{folder}.py", *names] if (PACKAGE / name).is_file())


def used_by(module):
    """The module, and all that it imports, and what these import."""
    result, remaining = set(), [module]
    while remaining:
        name = remaining.pop()
        if name not in result:
            result.add(name)
            remaining += imports(name)
    return result


def test_each_module_is_named_once():
    names = table()
    assert len(names) == len(set(names))
    assert set(names) == used_by("commands/compress.py")


def called_by(function, *arguments, **options):
    """The modules of the package in the order in which a call first runs a function of theirs."""
    names = {}

    def note(frame, event, _):
        path = Path(frame.f_code.co_filename)
        is_function = frame.f_code.co_flags & inspect.CO_OPTIMIZED  # no module, no class
        if event == "call" and is_function and PACKAGE in path.parents:
            names.setdefault(path.relative_to(PACKAGE).as_posix())

    sys.setprofile(note)
    try:
        function(*arguments, **options)
    finally:
        sys.setprofile(None)
    return list(names)


# Those that many steps use, and those of which something is called before their step.
ELSEWHERE = re.compile(
    r"document/\w+|_\w+|\w+/__init__|scheduler|progress|work_files|ranges|errors|portable|files|"
    r"(commands/result|encode/totals|encode/without_levels|lod/simplifier)"
)


def test_steps_are_in_the_order_of_their_first_calls(tmp_path):
    environment.need_package("meshoptimizer")
    points, _, triangles = sheet(40)
    builder = Builder()
    builder.mesh({"POSITION": points}, triangles)
    path = builder.write(tmp_path / "in.glb")
    calls = called_by(gltf_ext.compress, path, tmp_path / "out.glb", lod=True, threads=1)
    order = [name for name in calls if not ELSEWHERE.fullmatch(name.removesuffix(".py"))]
    assert len(order) > 20
    assert [name for name in table() if name in order] == order
