"""Builds the Blender extension: python -m tools.build_blender [FOLDER]

Needs wheels of tools/build_wheels.py in FOLDER (default dist), and writes
gltf_meshlet-blender-VERSION-PLATFORM.zip there for each platform of Blender, or those that --only
names as build_wheels does: the code in blender/,
our wheel, and those of the packages that it imports in Blender. Blender has numpy. With index.json,
the folder on a web server is a repository of extensions that Blender can add.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import gltf_ext
from tools.build_wheels import PLATFORMS as PLATFORMS_OF_WHEELS
from tools.build_wheels import tags_of

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "blender"
# What gltf_ext imports, apart from numpy, to read, decode, compress and write glTF; their own
# requirements follow by themselves.
REQUIREMENTS = ("pygltflib",)
# Blender's Python: 3.11 in 4.2 to 5.0, 3.13 since.
OLDEST_PYTHON = "3.11"
# The end of a wheel's platform tag, in Blender's words.
PLATFORMS = {
    r"(manylinux_.*|linux)_x86_64": "linux-x64",
    r"(manylinux_.*|linux)_aarch64": "linux-arm64",
    r"macosx_.*_arm64": "macos-arm64",
    r"macosx_.*_x86_64": "macos-x64",
    r"win_amd64": "windows-x64",
    r"win_arm64": "windows-arm64",
}
# A line of the manifest whose value is JSON but for the = of its table.
VALUE = re.compile(r"^(\w+) = (.*[\]}\"])$", re.MULTILINE)
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same bytes for the same content


class BuildError(Exception):
    """str() is one line: what is wrong and what to do."""


def main(arguments: list[str] | None = None) -> int:
    """Builds the zips; returns the exit status."""
    parser = argparse.ArgumentParser(description="Build the Blender extension.")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "dist", help="default: dist")
    parser.add_argument("--only", nargs="+", help="as for build_wheels; default: all platforms")
    options = parser.parse_args(arguments)
    try:
        paths = build(options.folder.resolve(), options.only)
    except BuildError as error:
        print(f"no Blender extension: {error}", file=sys.stderr)
        return 1
    for path in paths:
        print(os.path.relpath(path))
    return 0


def build(folder: Path, only: list[str] | None = None) -> list[Path]:
    """Writes zips and index beside the wheels; returns the zips' paths. Raises BuildError.

    only: platforms as build_wheels takes them; by default all that have a wheel.
    """
    by_platform = find_wheels(folder, only or list(PLATFORMS_OF_WHEELS))
    paths, entries = [], []
    with tempfile.TemporaryDirectory() as temporary:
        others = download(Path(temporary))
        for platform, wheel in by_platform.items():
            wheels = [wheel, *others]
            paths.append(folder / f"gltf_meshlet-blender-{gltf_ext.__version__}-{platform}.zip")
            description = manifest([platform], wheels)
            write_zip(paths[-1], description, wheels)
            entries.append(entry(paths[-1], description))
    index = {"version": "v1", "blocklist": [], "data": entries}
    (folder / "index.json").write_text(json.dumps(index, indent=2) + "\n", encoding="utf-8")
    return paths


def entry(path: Path, manifest: str) -> dict[str, Any]:
    """What index.json says about a zip: its manifest, place, size and hash."""
    values = {
        name: json.loads(re.sub(r"(\w+) = ", r'"\1": ', value))
        for name, value in VALUE.findall(manifest)
    }
    data = path.read_bytes()
    return {
        **values,
        "archive_url": f"./{path.name}",
        "archive_size": len(data),
        "archive_hash": f"sha256:{hashlib.sha256(data).hexdigest()}",
    }


def find_wheels(folder: Path, only: list[str]) -> dict[str, Path]:
    """Blender's name of a platform -> the wheel of this version. Raises BuildError."""
    found = {}
    for path in sorted(folder.glob(f"gltf_meshlet-{gltf_ext.__version__}-py3-none-*.whl")):
        tag = path.stem.split("-")[-1]
        platform = blender_platform(tag)
        if platform is not None and tag in tags_of(only):
            found[platform] = path
    if not found:
        raise BuildError(f"no wheel of {gltf_ext.__version__} in {folder}; run make wheel")
    return found


def blender_platform(tag: str) -> str | None:
    """Blender's name of a wheel's platform tag; None if Blender does not run there."""
    names = (name for pattern, name in PLATFORMS.items() if re.fullmatch(pattern, tag))
    return next(names, None)


def download(folder: Path) -> list[Path]:
    """Wheels of REQUIREMENTS for any platform, in the versions installed here, which are tested.

    Raises BuildError.
    """
    constraints = folder / "constraints.txt"
    installed = importlib.metadata.distributions()
    constraints.write_text("".join(f"{d.name}=={d.version}\n" for d in installed))
    target = folder / "requirements"
    command = (sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "-q")
    any_machine = ("--only-binary=:all:", "--platform=any", "--implementation=py", "--abi=none")
    python = f"--python-version={OLDEST_PYTHON}"
    result = subprocess.run(
        (*command, *any_machine, python, "-c", constraints, "-d", target, *REQUIREMENTS),
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode:
        last = (result.stderr.strip().splitlines() or ["no output"])[-1]
        raise BuildError(f"cannot download {', '.join(REQUIREMENTS)}: {last}")
    return sorted(target.glob("*.whl"))


def manifest(platforms: list[str], wheels: list[Path]) -> str:
    """blender_manifest.toml with version, platforms and wheels."""
    listed = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
    quoted = ", ".join(f'"{platform}"' for platform in platforms)
    return (
        (SOURCE / "blender_manifest.toml").read_text()
        + f'version = "{semantic_version(gltf_ext.__version__)}"\n'
        + f"platforms = [{quoted}]\n"
        + f"wheels = [\n{listed}]\n"
    )


def semantic_version(version: str) -> str:
    """A Python version as Blender wants it: 0.2.0.dev0 -> 0.2.0-dev0."""
    return re.sub(r"^(\d+\.\d+\.\d+)\.?(?=[a-z])", r"\1-", version)


def write_zip(path: Path, manifest: str, wheels: list[Path]) -> None:
    """Writes the extension."""
    files = {file.name: file.read_bytes() for file in sorted(SOURCE.glob("*.py"))}
    files["LICENSE"] = (SOURCE / "LICENSE").read_bytes()
    files["blender_manifest.toml"] = manifest.encode()
    files.update((f"wheels/{wheel.name}", wheel.read_bytes()) for wheel in wheels)
    _write_archive(path, files)


def _write_archive(path: Path, contents: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in contents.items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), data, zipfile.ZIP_DEFLATED)


if __name__ == "__main__":
    sys.exit(main())
