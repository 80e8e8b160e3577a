"""Do the vectors suffice? Changes one rule of the reference unpacker at a time.

    python -m spec.mutate_transport [NUMBER]

Each change is of one constant, operator or condition. It is noticed if a valid vector unpacks to
other bytes, or a malformed one is accepted. Prints the changes that no vector notices, and counts;
NUMBER: only every so many changes.
"""

from __future__ import annotations

import ast
import copy
import signal
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path

from spec import reference_transport
from spec.make_transport_vectors import FOLDER

SOURCE = Path(reference_transport.__file__)
SECONDS = 5  # a change that makes a vector take longer is noticed
COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Add,
    ast.RShift: ast.LShift,
    ast.LShift: ast.RShift,
}
NAMES = {"min": "max", "max": "min"}
# They do not unpack: texts of errors, types, and what only saves time.
SKIPPED = ("__future__", "dataclass", "require", "page_table", "unpack_view")


def changes(tree: ast.AST) -> Iterator[tuple[int, str, Callable[[ast.AST], None]]]:
    """(number of the node in ast.walk, words, a function that changes that node in a copy)."""
    for number, node in enumerate(ast.walk(tree)):
        if isinstance(node, ast.Constant) and type(node.value) is int:
            yield number, f"{node.value} + 1", _set("value", node.value + 1)
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
            other = COMPARISONS[type(node.ops[0])]
            yield (
                number,
                f"{ast.unparse(node)}: {other.__name__}",
                _set("ops", [other(), *node.ops[1:]]),
            )
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            operator = OPERATORS[type(node.op)]
            yield number, f"{ast.unparse(node)}: {operator.__name__}", _set("op", operator())
        elif isinstance(node, ast.BoolOp):
            either = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            yield number, f"{ast.unparse(node)}: {type(either).__name__}", _set("op", either)
        elif isinstance(node, ast.Name) and node.id in NAMES:
            yield number, f"{node.id} -> {NAMES[node.id]}", _set("id", NAMES[node.id])
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple):
            for i in range(1, len(node.slice.elts)):
                yield number, f"{ast.unparse(node)}: without context {i}", _without(i)


def _set(name: str, value: object) -> Callable[[ast.AST], None]:
    return lambda node: setattr(node, name, value)


def _without(i: int) -> Callable[[ast.AST], None]:
    """Takes the same model whatever context i is."""

    def change(node: ast.AST) -> None:
        node.slice.elts[i] = ast.Constant(0)  # type: ignore[attr-defined]

    return change


def parts(tree: ast.Module) -> Iterator[ast.AST]:
    """The functions and methods that unpack."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            yield from (f for f in node.body if isinstance(f, ast.FunctionDef))
        elif isinstance(node, ast.FunctionDef) and node.name not in SKIPPED:
            yield node


def unpacker(tree: ast.Module) -> Callable[[bytes], bytes]:
    module = types.ModuleType("changed_transport")
    sys.modules[module.__name__] = module  # dataclasses look there
    exec(compile(ast.fix_missing_locations(tree), str(SOURCE), "exec"), module.__dict__)
    return module.unpack_view


def vectors() -> list[tuple[str, bytes, bytes | None]]:
    """(name, packed, resident bytes or None), small ones first."""
    result = []
    for path in FOLDER.glob("*.bin"):
        resident = path.with_suffix(".resident")
        result.append(
            (path.name, path.read_bytes(), resident.read_bytes() if resident.exists() else None)
        )
    return sorted(result, key=lambda vector: len(vector[1]))


def noticed(unpack: Callable[[bytes], bytes], of: list[tuple[str, bytes, bytes | None]]) -> str:
    """The first vector that notices; empty if none does."""
    for name, packed, resident in of:
        signal.alarm(SECONDS)
        try:
            answer: bytes | None = unpack(packed)
        except ValueError:
            answer = None
        except Exception:
            return name
        finally:
            signal.alarm(0)
        if answer != resident:
            return name
    return ""


def _late(*_: object) -> None:
    raise TimeoutError


def results(step: int = 1) -> Iterator[tuple[str, str]]:
    """(change, name of the first vector that notices it, empty if none does)."""
    signal.signal(signal.SIGALRM, _late)
    tree = ast.parse(SOURCE.read_text())
    for node in ast.walk(tree):  # annotations are no rules
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
    of = vectors()
    listed = [
        (p, number, words, change)
        for p, part in enumerate(parts(tree))
        for number, words, change in changes(part)
    ]
    for p, number, words, change in listed[::step]:
        changed = copy.deepcopy(tree)
        part = list(parts(changed))[p]
        node = list(ast.walk(part))[number]
        place = f"{SOURCE.name}:{getattr(node, 'lineno', 0)}: {getattr(part, 'name', '')}"
        change(node)
        yield f"{place}: {words}", noticed(unpacker(changed), of)


def main() -> None:
    total = left = 0
    for change, name in results(int(sys.argv[1]) if len(sys.argv) > 1 else 1):
        total += 1
        if not name:
            left += 1
            print(change, flush=True)
    print(f"{total - left} of {total} changes are noticed")


if __name__ == "__main__":
    main()
