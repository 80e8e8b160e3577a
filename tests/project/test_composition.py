"""The Vulkan back end is made of parts: inheritance is shallow, bases are initialised first."""

import ast

import pytest

from tests.helpers.environment import ROOT

PATHS = sorted((ROOT / "vk_backend").rglob("*.py"))


def classes_of(trees):
    """Name -> definition of all classes."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    return {node.name: node for node in nodes if isinstance(node, ast.ClassDef)}


def depth(name, classes):
    """How many classes of ours a class inherits from, one after the other."""
    bases = [base.id for base in classes[name].bases if isinstance(base, ast.Name)]
    return max((1 + depth(base, classes) for base in bases if base in classes), default=0)


def calls_base(node):
    """Whether a node calls super().__init__."""
    return any(
        isinstance(part, ast.Attribute)
        and part.attr == "__init__"
        and isinstance(part.value, ast.Call)
        and getattr(part.value.func, "id", "") == "super"
        for part in ast.walk(node)
    )


def early_fields(tree):
    """Lines that set a field of self before the base class is initialised."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "__init__" and calls_base(node):
            call = min(part.lineno for part in ast.walk(node) if is_call(part))
            for part in ast.walk(node):
                if is_field(part) and part.lineno < call:
                    yield part.lineno


def is_call(node):
    return isinstance(node, ast.Call) and calls_base(node.func)


def is_field(node):
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and getattr(node.value, "id", "") == "self"
    )


def optional_assertions(tree):
    """Lines that assert that a part is there: `assert self.part`, `... is not None`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert):
            values = {
                getattr(part.value, "id", "") for part in ast.walk(node.test) if is_load(part)
            }
            if "self" in values:
                yield node.lineno


def is_load(node):
    return isinstance(node, ast.Attribute)


def test_classes_override_one_level():
    classes = classes_of(ast.parse(path.read_text()) for path in PATHS)
    assert depth("BatchedDrawing", classes) == 1
    assert {name: n for name in classes if (n := depth(name, classes)) > 1} == {}


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_parts_are_there(path):
    tree = ast.parse(path.read_text())
    assert list(early_fields(tree)) == [], "set after super().__init__"
    assert list(optional_assertions(tree)) == [], "a part that may be missing"


def test_problems_are_found():
    tree = ast.parse(
        "class A:\n    pass\n"
        "class B(A):\n    def __init__(self):\n        self.x = 1\n        super().__init__()\n"
        "class C(B):\n    def f(self):\n        assert self.x is not None\n"
    )
    assert depth("C", classes_of([tree])) == 2
    assert list(early_fields(tree)) == [5] and list(optional_assertions(tree)) == [9]
