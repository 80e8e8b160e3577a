#!/usr/bin/env python3
"""Prepares and checks a release: docs/releasing.md. Needs only Python.

release.py owner NAME: the account or organisation of the repository, in all files that name it.
release.py prepare VERSION: sets the version everywhere and cuts CHANGELOG.md, with today's date.
release.py check TAG: fails unless everything says that version and nothing is left to fill in.
release.py notes: prints what CHANGELOG.md says about the version.
release.py next VERSION: begins the next version, such as 0.3.0.dev0.
"""

from __future__ import annotations

import argparse
import datetime
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OWNER = "OWNER"  # stands for the account until it is known
CHANGELOG = "CHANGELOG.md"
UNRELEASED = "## [Unreleased]\n"
NOTES = re.compile(
    r"^## \[(?P<version>[^\]]+)\](?: - (?P<date>\S+))?\n(?P<text>.*?)(?=^## |\Z)", re.M | re.S
)
ENTRY = re.compile(r"^- ", re.M)
RELEASE = re.compile(r"\d+\.\d+\.\d+")


class ReleaseError(Exception):
    """str() is one line: what is wrong and what to do."""


def semantic(version: str) -> str:
    """A Python version as npm and Blender want it: 0.2.0.dev0 -> 0.2.0-dev.0."""
    return re.sub(r"\.dev(\d+)$", r"-dev.\1", version)


def plain(version: str) -> str:
    """The release that a development version leads to: 0.2.0.dev0 -> 0.2.0."""
    return re.sub(r"\.dev\d+$", "", version)


# File -> (pattern with the version as group 2, the version there of a Python version).
VERSIONS: dict[str, tuple[str, Callable[[str], str]]] = {
    "gltf_ext/__init__.py": (r'^(__version__ = ")(.*?)(")', str),
    "web/package.json": (r'^(  "version": ")(.*?)(")', semantic),
    "CITATION.cff": (r"^(version: )(.*?)()$", plain),
    "packaging/conda/recipe.yaml": (r'^(  version: ")(.*?)(")', plain),
    "packaging/conan/conandata.yml": (r'^(  ")(.*?)(":)', plain),
    "packaging/vcpkg/vcpkg.json": (r'^(  "version": ")(.*?)(")', plain),
}
DATE = r"^(date-released: )(.*?)()$"  # of CITATION.cff


def main(arguments: list[str] | None = None) -> int:
    """Returns the exit status."""
    parser = argparse.ArgumentParser(description="Prepare and check a release: docs/releasing.md.")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("owner", help="name the repository's account").add_argument("name")
    commands.add_parser("prepare", help="set the version, cut CHANGELOG.md").add_argument("version")
    commands.add_parser("check", help="fail unless all is ready for a tag").add_argument("tag")
    commands.add_parser("notes", help="print CHANGELOG.md's section of the version")
    commands.add_parser("next", help="begin the next version").add_argument("version")
    options = parser.parse_args(arguments)
    try:
        if options.command == "owner":
            name_owner(options.name)
        elif options.command == "prepare":
            prepare(options.version, datetime.date.today().isoformat())
        elif options.command == "next":
            begin(options.version)
        elif options.command == "check":
            problems = check(options.tag)
            print(*problems, sep="\n", end="\n" if problems else "", file=sys.stderr)
            return int(bool(problems))
        else:
            print(notes(current_version()))
    except ReleaseError as error:
        print(f"release.py: {error}", file=sys.stderr)
        return 1
    return 0


# --- the owner ---


def files_with_owner() -> list[Path]:
    """The tracked files with a placeholder in an address."""
    command = ("git", "grep", "-lzE", rf"\b{OWNER}(\.github\.io)?/gltf-meshlet", "--", ".")
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if result.returncode not in (0, 1):  # 1: there is none
        raise ReleaseError(f"git grep failed: {result.stderr.strip()}")
    return [ROOT / name for name in result.stdout.split("\0") if name]


def name_owner(name: str) -> None:
    """Writes the account into every address."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9-]{0,38}", name):
        raise ReleaseError(f"{name!r} is no name of an account")
    for path in files_with_owner():
        text = path.read_text(encoding="utf-8")
        replaced = re.sub(rf"\b{OWNER}(?=(\.github\.io)?/gltf-meshlet)", name, text)
        path.write_text(replaced, encoding="utf-8")
        print(path.relative_to(ROOT))


# --- the version ---


def current_version() -> str:
    return version_in("gltf_ext/__init__.py")


def version_in(name: str) -> str:
    """What a file says. Raises ReleaseError."""
    match = re.search(VERSIONS[name][0], _read(name), re.M)
    if match is None:
        raise ReleaseError(f"{name} names no version")
    return match[2]


def set_version(version: str) -> None:
    """Writes a Python version into all files of VERSIONS."""
    for name, (pattern, wording) in VERSIONS.items():
        version_in(name)
        _substitute(name, pattern, wording(version))


def prepare(version: str, date: str) -> None:
    """Turns the development version into a release."""
    if not RELEASE.fullmatch(version):
        raise ReleaseError(f"{version!r} is no version such as 0.2.0")
    text = _read(CHANGELOG)
    section = NOTES.search(text)
    if section is None or section["version"] != "Unreleased":
        raise ReleaseError(f"{CHANGELOG} does not start with {UNRELEASED.strip()!r}")
    if not ENTRY.search(section["text"]):
        raise ReleaseError(f"{CHANGELOG} has no entry for {version}")
    development = current_version()
    set_version(version)
    _substitute("CITATION.cff", DATE, date)
    body = section["text"].replace(f"\n{development},", f"\n{version},", 1)
    cut = f"## [{version}] - {date}\n{body}"
    _write(CHANGELOG, text[: section.start()] + cut + text[section.end() :])


def begin(version: str) -> None:
    """Starts the next development version."""
    if not re.fullmatch(rf"{RELEASE.pattern}\.dev\d+", version):
        raise ReleaseError(f"{version!r} is no version such as 0.3.0.dev0")
    text = _read(CHANGELOG)
    section = NOTES.search(text)
    if section is None or section["version"] == "Unreleased":
        raise ReleaseError(f"{CHANGELOG} starts with {UNRELEASED.strip()!r} already")
    set_version(version)
    head = f"{UNRELEASED}\n{version}.\n\n"
    _write(CHANGELOG, text[: section.start()] + head + text[section.start() :])


def notes(version: str) -> str:
    """CHANGELOG.md's text on a version, without the heading. Raises ReleaseError."""
    for section in NOTES.finditer(_read(CHANGELOG)):
        if section["version"] == version:
            return section["text"].strip()
    raise ReleaseError(
        f"{CHANGELOG} has no section {version}; run tools/release.py prepare {version}"
    )


def check(tag: str) -> list[str]:
    """What speaks against publishing this commit under a tag, a line each."""
    version = tag.removeprefix("v")
    problems = []
    if not tag.startswith("v") or not RELEASE.fullmatch(version):
        problems.append(f"{tag!r} is no tag such as v0.2.0")
    for name, (_, wording) in VERSIONS.items():
        if version_in(name) != wording(version):
            problems.append(f"{name} says {version_in(name)}, the tag {version}")
    section = NOTES.search(_read(CHANGELOG))
    if section is None or section["version"] != version or not section["date"]:
        problems.append(f"{CHANGELOG} does not start with '## [{version}] - DATE'")
    problems += [
        f"{path.relative_to(ROOT)} names no owner of the repository; run tools/release.py owner"
        for path in files_with_owner()
    ]
    return problems


def _substitute(name: str, pattern: str, value: str) -> None:
    _write(name, re.sub(pattern, rf"\g<1>{value}\g<3>", _read(name), count=1, flags=re.M))


def _read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def _write(name: str, text: str) -> None:
    (ROOT / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
