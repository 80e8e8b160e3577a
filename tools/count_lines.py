"""Counts lines of source by folder: python tools/count_lines.py [--against COMMIT] [--json]

Counts the tracked files of the working tree as the formatters have left them. SPIR-V is binary:
its row counts kilobytes.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import tarfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUFFIXES = (".py", ".cpp", ".h", ".js", ".mjs", ".ts", ".css", ".html", ".glsl", ".comp", ".frag")
SUFFIXES += (".geom", ".mesh", ".rahit", ".rchit", ".rgen", ".rint", ".rmiss", ".task", ".vert")
PRODUCT = ("codec", "gltf_ext", "gltf_meshlet", "vk_backend", "mitsuba_plugin", "shaders", "web")
PRODUCT += ("blender",)
ASIDE = ("tests", "bench", "spec", "tools")
GENERATED = ("web/wgsl", "vk_backend/spirv", "gltf_meshlet/view_page")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Count lines of source by folder.")
    parser.add_argument("--against", metavar="COMMIT", help="also count this commit, and compare")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(arguments)
    counts = {"lines": counted(working_tree())}
    if options.against:
        counts = {"before": counted(tree_of(options.against)), "after": counts["lines"]}
    if options.json:
        print(json.dumps(counts, indent=2))
        return
    rows = [
        [name, *(f"{count[name]:,}" for count in counts.values())]
        for name in next(iter(counts.values()))
    ]
    for row in [["", *counts], *rows]:
        print(f"{row[0]:<34}" + "".join(f"{cell:>10}" for cell in row[1:]))


def counted(files: dict[str, bytes]) -> dict[str, int]:
    """Lines by row of the table; a row for every folder, also an empty one."""
    found: Counter[str] = Counter()
    spirv = 0
    for name, content in files.items():
        generated = next((folder for folder in GENERATED if name.startswith(folder + "/")), None)
        if name.endswith(".spv"):
            spirv += len(content)
        elif name.endswith((".wgsl", *SUFFIXES)):
            found[generated or name.partition("/")[0]] += content.count(b"\n")
    return {
        **{folder: found[folder] for folder in PRODUCT},
        "product, written by hand": sum(found[folder] for folder in PRODUCT),
        **{folder: found[folder] for folder in ASIDE},
        **{f"generated: {folder}": found[folder] for folder in GENERATED},
        "generated: SPIR-V, kB": round(spirv / 1000),
    }


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
