"""Counts lines of source by folder: python tools/count_lines.py [--against COMMIT] [--json]

Counts the tracked files of the working tree as the formatters have left them: every folder has a
row, and each Python package that the wheel contains is product. SPIR-V is binary: its row counts
kilobytes.
"""

from __future__ import annotations

import argparse
import io
import json
import re
import subprocess
import sys
import tarfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUFFIXES = (".py", ".cpp", ".h", ".js", ".mjs", ".ts", ".css", ".html", ".glsl", ".comp", ".frag")
SUFFIXES += (".geom", ".mesh", ".rahit", ".rchit", ".rgen", ".rint", ".rmiss", ".task", ".vert")
WHEEL_PACKAGES = re.compile(rb"^wheel\.packages = \[(.*?)\]", re.M | re.S)
OTHER_PRODUCT = ("shaders", "web", "blender")  # beside codec and the packages of the wheel
GENERATED = ("web/wgsl", "vk_backend/spirv", "gltf_meshlet/view_page")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Count lines of source by folder.")
    parser.add_argument("--against", metavar="COMMIT", help="also count this commit, and compare")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(arguments)
    trees = {"lines": working_tree()}
    if options.against:
        trees = {"before": tree_of(options.against), "after": trees["lines"]}
    counts = counted(trees)
    if options.json:
        print(json.dumps(counts, indent=2))
        return
    rows = [
        [name, *(f"{count[name]:,}" for count in counts.values())]
        for name in next(iter(counts.values()))
    ]
    for row in [["", *counts], *rows]:
        print(f"{row[0]:<34}" + "".join(f"{cell:>10}" for cell in row[1:]))


def counted(trees: dict[str, dict[str, bytes]]) -> dict[str, dict[str, int]]:
    """Lines by row of the table, of each tree (file name -> content); all have the same rows."""
    sources = {of: source_lines(files) for of, files in trees.items()}
    packages = [package for files in trees.values() for package in wheel_packages(files)]
    product = tuple(dict.fromkeys(("codec", *packages, *OTHER_PRODUCT)))
    aside = sorted({folder for lines in sources.values() for folder in lines}.difference(product))
    return {
        of: {
            **{folder: lines[folder] for folder in product},
            "product, written by hand": sum(lines[folder] for folder in product),
            **{folder: lines[folder] for folder in aside if folder not in GENERATED},
            **{f"generated: {folder}": lines[folder] for folder in GENERATED},
            "generated: SPIR-V, kB": spirv_kilobytes(trees[of]),
        }
        for of, lines in sources.items()
    }


def wheel_packages(files: dict[str, bytes]) -> list[str]:
    """The packages that pyproject.toml puts into the wheel: all that is imported at run time."""
    found = WHEEL_PACKAGES.search(files["pyproject.toml"])
    assert found, "pyproject.toml does not say wheel.packages"
    return re.findall(r'"([^"]+)"', found[1].decode())


def source_lines(files: dict[str, bytes]) -> Counter[str]:
    """Lines of source by folder of the top level, or by generated folder."""
    lines: Counter[str] = Counter()
    for name, content in files.items():
        folder, slash, _ = name.partition("/")
        if slash and name.endswith((".wgsl", *SUFFIXES)):
            generated = (other for other in GENERATED if name.startswith(other + "/"))
            lines[next(generated, folder)] += content.count(b"\n")
    return lines


def spirv_kilobytes(files: dict[str, bytes]) -> int:
    return round(sum(len(data) for name, data in files.items() if name.endswith(".spv")) / 1000)


def working_tree() -> dict[str, bytes]:
    """The tracked files that exist, by name."""
    names = _git("ls-files", "-z").decode().split("\0")
    return {name: (ROOT / name).read_bytes() for name in names if (ROOT / name).is_file()}


def tree_of(commit: str) -> dict[str, bytes]:
    """The files of a commit, by name."""
    with tarfile.open(fileobj=io.BytesIO(_git("archive", commit))) as archive:
        return {
            member.name: archive.extractfile(member).read()  # type: ignore[union-attr]
            for member in archive
            if member.isfile()
        }


def _git(*arguments: str) -> bytes:
    """The output of a git command; git itself says on stderr why it failed."""
    done = subprocess.run(("git", *arguments), cwd=ROOT, stdout=subprocess.PIPE)
    if done.returncode:
        sys.exit(2)
    return done.stdout


if __name__ == "__main__":
    main()
