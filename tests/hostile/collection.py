"""Models of a folder through compress, verify, validate and decompress; counts what comes of it.

python -m tests.hostile.collection FOLDER [--json OUT] [--lod] [--seconds S]: for collections of
public files, such as the test models of other readers. Fails for an exception that is no error of
a file, a model that does not come back, and one that takes too long. Warnings of numpy count as
exceptions. What is refused is listed with its line, to be compared with an earlier run.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import tempfile
import traceback
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import gltf_ext
from gltf_ext.sources.importers import SUFFIXES

Outcome = dict[str, str]  # path, step, outcome, detail


def outcome_of(path: Path, options: dict[str, Any]) -> Outcome:
    """Take a model through all commands, up to the first that fails."""
    step = "compress"
    try:
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("error")
            output = Path(folder) / "out.glb"
            gltf_ext.compress(path, output, **options)
            step = "verify"
            problems = gltf_ext.verify(path, output)["problems"]
            if problems:
                return {"step": step, "outcome": "differs", "detail": problems[0]}
            step = "validate"
            problems = gltf_ext.validate(output)
            if problems:
                return {"step": step, "outcome": "invalid", "detail": problems[0]}
            step = "decompress"
            gltf_ext.decompress(output, Path(folder) / "plain.glb")
            return {"step": step, "outcome": "good", "detail": ""}
    except (gltf_ext.MeshletError, OSError) as error:
        kind = "refused" if step == "compress" else "failed"
        message = getattr(error, "message", str(error))
        return {"step": step, "outcome": kind, "detail": message}
    except Exception:
        return {"step": step, "outcome": "exception", "detail": traceback.format_exc()}


def outcomes_of(folder: Path, options: dict[str, Any], seconds: float) -> list[Outcome]:
    """Return the outcome of each model of a folder, in a process that is replaced if it hangs."""
    paths = sorted(p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES and p.is_file())
    outcomes = []
    pool = multiprocessing.get_context("spawn").Pool(1)
    for path in paths:
        try:
            outcome = pool.apply_async(outcome_of, (path, options)).get(seconds)
        except multiprocessing.TimeoutError:
            outcome = {"step": "", "outcome": "hangs", "detail": f"{seconds} s"}
            pool.terminate()
            pool = multiprocessing.get_context("spawn").Pool(1)
        outcomes.append({"path": str(path.relative_to(folder)), **outcome})
    pool.terminate()
    return outcomes


def general(detail: str) -> str:
    """Return a line without the numbers and names of a file, for counts."""
    return re.sub(r"\d[\d.,e+-]*", "N", detail.splitlines()[-1] if detail else "")[:110]


def main() -> int:
    """Print counts; return 1 for anything but good and refused models."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path, help="file for the outcome of each model")
    parser.add_argument("--lod", action="store_true", help="with levels of detail")
    parser.add_argument("--seconds", type=float, default=120.0, help="most for a model")
    arguments = parser.parse_args()
    outcomes = outcomes_of(arguments.folder, {"lod": arguments.lod}, arguments.seconds)
    if arguments.json:
        arguments.json.write_text(json.dumps(outcomes, indent=1))
    print(f"{len(outcomes)} models:", dict(Counter(o["outcome"] for o in outcomes)))
    lines = Counter(
        f"{o['step']}: {o['outcome']}: {general(o['detail'])}"
        for o in outcomes
        if o["outcome"] != "good"
    )
    for line, count in lines.most_common():
        print(f"{count:5} {line}")
    return int(any(o["outcome"] not in ("good", "refused") for o in outcomes))


if __name__ == "__main__":
    raise SystemExit(main())
