"""The READMEs list every file, and the modules in an order without circles."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.helpers.environment import ROOT
from tools import build_shaders

PACKAGE = ROOT / "vk_backend"
# README -> the files that its tables list: each row starts with a name in backticks.
LISTED = {
    PACKAGE / "README.md": {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if path.name != "__init__.py"
    },
    build_shaders.SOURCES / "README.md": {
        path.relative_to(build_shaders.SOURCES).as_posix()
        for path in build_shaders.SOURCES.rglob("*")
        if path.is_file() and path.suffix != ".md"
    },
}


def rows_of(readme: Path) -> list[str]:
    return re.findall(r"^\| `([^`]+)`", readme.read_text(), re.MULTILINE)


@pytest.mark.parametrize("readme", LISTED, ids=lambda path: path.parent.name)
def test_readme_lists_every_file(readme):
    rows = rows_of(readme)
    assert len(LISTED[readme]) > 20
    assert sorted(LISTED[readme] - set(rows)) == [], "missing"
    assert sorted(set(rows) - LISTED[readme]) == [], "gone"


def imported_modules(path: Path) -> set[str]:
    """Modules of the package that a module imports when it is imported."""
    found = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            folder = path.parents[node.level - 1] / (node.module or "").replace(".", "/")
            of = [folder] if folder.with_suffix(".py").is_file() else []
            names = of or [folder / alias.name for alias in node.names]
            found |= {f"{name.relative_to(PACKAGE).as_posix()}.py" for name in names}
    return found


def test_modules_import_only_modules_above_them():
    order = rows_of(PACKAGE / "README.md")
    assert imported_modules(PACKAGE / "decode" / "decoder.py") >= {
        "gpu/device.py",
        "decode/slots.py",
    }
    for index, name in enumerate(order):
        assert imported_modules(PACKAGE / name) <= set(order[:index]), name
