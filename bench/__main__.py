"""python -m bench: lists the questions; python -m bench NAME [OPTION ...]: answers one."""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path

from bench import common

TEXTS = {"summary", "report", "block"}
FOLDER = Path(__file__).resolve().parent


def questions() -> dict[str, str]:
    """Name -> first line of the docstring of each module that measures or draws. Imports none."""
    found = {}
    for path in sorted(FOLDER.glob("[!_]*.py")):
        tree = ast.parse(path.read_text())
        names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        if "draw_all" in names or ("measure" in names and names & TEXTS):
            found[path.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return found


def main() -> int:
    """Answers the question named on the command line; returns the exit status."""
    known = questions()
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        width = max(map(len, known))
        print("python -m bench NAME [OPTION ...]\n")
        print("\n".join(f"  {name:{width}}  {question}" for name, question in known.items()))
        return 0
    name, *arguments = sys.argv[1:]
    if name not in known:
        print(f"bench: no question is called {name}; python -m bench lists them", file=sys.stderr)
        return 2
    question = importlib.import_module(f"bench.{name}")
    try:
        if hasattr(question, "measure"):
            common.answer(question, arguments)
        else:
            for path in question.draw_all():
                common.progress(f"wrote {path.relative_to(common.ROOT)}")
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
