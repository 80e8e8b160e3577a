"""Builds wheels that install without a compiler: python -m tools.build_wheels [FOLDER]

One wheel per platform (--only PLATFORM ..), for all Pythons, by Zig on this machine; --only blender
are those of Blender's platforms. --only here is one for this machine alone, by its own compiler,
which takes what `make` has compiled. FOLDER: default dist. They contain meshoptimizer's simplifier:
levels of detail need no other package. A wheel that is there and made of the same files stays as it
is.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.metadata
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Not pip's own line that a command failed.
ERROR = re.compile("rror: (?!subprocess-exited)")
SIMPLIFIER = "meshoptimizer-0.2.30a0"  # as the extra `lod` of pyproject.toml
# What a wheel is made of, beside the packages that pyproject.toml names.
SOURCES = ("CMakeLists.txt", "LICENSE", "README.md", "cmake", "codec", "pyproject.toml")
SOURCES += ("tools/build_backend.py", "tools/build_wheels.py")
TOOLS = ("scikit-build-core", "ziglang")
SIMPLIFIER_SHA256 = "36b18b61a95ba992de804b1e91e86be2ba185925e4e2c1481495f8c68a17f5db"


@dataclass(frozen=True)
class Platform:
    """zig: its name of the target; system, processor: CMake's."""

    zig: str
    system: str
    processor: str


# A wheel's platform tag -> what it is built for. The oldest systems that Zig's libraries support.
PLATFORMS = {
    "manylinux_2_17_x86_64": Platform("x86_64-linux-gnu.2.17", "Linux", "x86_64"),
    "manylinux_2_17_aarch64": Platform("aarch64-linux-gnu.2.17", "Linux", "aarch64"),
    "musllinux_1_2_x86_64": Platform("x86_64-linux-musl", "Linux", "x86_64"),
    "musllinux_1_2_aarch64": Platform("aarch64-linux-musl", "Linux", "aarch64"),
    "win_amd64": Platform("x86_64-windows-gnu", "Windows", "AMD64"),
    "win_arm64": Platform("aarch64-windows-gnu", "Windows", "ARM64"),
    "macosx_11_0_x86_64": Platform("x86_64-macos.11.0", "Darwin", "x86_64"),
    "macosx_11_0_arm64": Platform("aarch64-macos.11.0", "Darwin", "arm64"),
}


HERE = re.sub(r"[-.]", "_", sysconfig.get_platform())  # on Linux: for no other distribution
# Name -> tags: of this machine, and of the platforms that Blender runs on, which has none for musl.
GROUPS = {
    "here": [HERE],
    "blender": [tag for tag in PLATFORMS if not tag.startswith("musllinux")],
}


def main(arguments: list[str] | None = None) -> int:
    """Builds what it can; returns the exit status, 1 unless that is all."""
    parser = argparse.ArgumentParser(description="Build a wheel for each platform.")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "dist", help="default: dist")
    parser.add_argument(
        "--only", nargs="+", choices=[*PLATFORMS, *GROUPS], help="default: all platforms"
    )
    parser.add_argument(
        "--simplifier", action="store_true", help="build nothing; print where its sources are"
    )
    options = parser.parse_args(arguments)
    if options.simplifier:
        return _print_simplifier()
    failed = False
    folder = options.folder.resolve()
    for tag in tags_of(options.only or list(PLATFORMS)):
        try:
            sources = digest_of_sources(TOOLS if tag in PLATFORMS else ())
            path = current_wheel(tag, folder, sources)
            if path is None:
                print(f"building {tag}", file=sys.stderr)
                path = build(tag, folder, find_simplifier())
                _stamp(tag).write_text(f"{sources} {_sha256(path)}")
            print(f"{os.path.relpath(path)}  {path.stat().st_size / 1e6:.2f} MB", flush=True)
        except (subprocess.CalledProcessError, OSError) as error:
            print(f"no wheel for {tag}: {_reason(error)}", file=sys.stderr)
            failed = True
    return int(failed)


def _print_simplifier() -> int:
    """Prints the folder of meshoptimizer's sources; returns the exit status."""
    try:
        print(find_simplifier())
    except (subprocess.CalledProcessError, OSError) as error:
        print(f"no simplifier: {_reason(error)}", file=sys.stderr)
        return 1
    return 0


def _reason(error: Exception) -> str:
    """The line of a program's output that says why it failed."""
    text = getattr(error, "stderr", None) or getattr(error, "stdout", None) or str(error)
    lines = text.strip().splitlines()
    return next((line for line in lines if ERROR.search(line)), lines[-1]).strip()


def tags_of(names: list[str]) -> list[str]:
    """The tags that platforms and groups of them name."""
    return list(dict.fromkeys(tag for name in names for tag in GROUPS.get(name, [name])))


def digest_of_sources(tools: tuple[str, ...]) -> str:
    """The fingerprint of all that wheels are made of: files, and the tools that build."""
    packages = re.search(
        r"^wheel\.packages = \[(.*)\]", (ROOT / "pyproject.toml").read_text(), re.M
    )
    names = [*SOURCES, *re.findall(r'"(\w+)"', packages[1])] if packages else SOURCES
    digest = hashlib.sha256(SIMPLIFIER_SHA256.encode())
    for tool in tools:
        digest.update(f"{tool} {importlib.metadata.version(tool)}\0".encode())
    for path in sorted(path for name in names for path in _files(ROOT / name)):
        digest.update(f"{path.relative_to(ROOT)} {_sha256(path)}\0".encode())
    return digest.hexdigest()


def _files(path: Path) -> Iterator[Path]:
    """The file, or those of a folder that Python did not leave there."""
    if path.is_dir():
        yield from (p for p in path.rglob("*") if p.is_file() and p.parent.name != "__pycache__")
    else:
        yield path


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _stamp(tag: str) -> Path:
    """Says what the newest wheel for a platform was made of, and which bytes it has."""
    return ROOT / "build" / f"{tag}.stamp"


def current_wheel(tag: str, folder: Path, sources: str) -> Path | None:
    """The wheel in a folder, if it was made of these sources and nobody changed it since."""
    stamp = _stamp(tag)
    digests = stamp.read_text() if stamp.exists() else ""
    for path in folder.glob(f"gltf_meshlet-*-{tag}.whl"):
        if digests == f"{sources} {_sha256(path)}":
            return path
    return None


def find_simplifier() -> Path:
    """The folder of meshoptimizer's sources, in build; downloads them once.

    Raises CalledProcessError, and OSError if they are not those that SIMPLIFIER_SHA256 names.
    """
    folder = ROOT / "build" / SIMPLIFIER
    if not folder.is_dir():
        with tempfile.TemporaryDirectory(dir=_made(ROOT / "build")) as temporary:
            package, version = SIMPLIFIER.split("-")
            pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "-q")
            _run(
                *pip,
                "--no-deps",
                f"--no-binary={package}",
                "-d",
                temporary,
                f"{package}=={version}",
            )
            path = Path(temporary, f"{SIMPLIFIER}.tar.gz")
            if hashlib.sha256(path.read_bytes()).hexdigest() != SIMPLIFIER_SHA256:
                raise OSError(f"{path.name} has another hash than tools/build_wheels.py names")
            with tarfile.open(path) as archive:
                archive.extractall(temporary, filter="data")
            Path(temporary, SIMPLIFIER).rename(folder)
    return folder / "src"


def build(tag: str, folder: Path, simplifier: Path) -> Path:
    """Builds one wheel; returns its path. Raises CalledProcessError."""
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "-q", "--no-deps")
    options, environment = _by_zig(tag, simplifier) if tag in PLATFORMS else _by_own(simplifier)
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "315532800", **environment}  # 1980: the same
    _run(*pip, "--no-build-isolation", *options, "-w", _made(folder), ROOT, env=environment)
    return max(folder.glob(f"gltf_meshlet-*-{tag}.whl"), key=os.path.getmtime)


def _by_own(simplifier: Path) -> tuple[list[str], dict[str, str]]:
    """Options of pip and environment for this machine's compiler, in the folder that make uses."""
    return [f"--config-settings=cmake.define.MESHLET_SIMPLIFIER={simplifier}"], {}


def _by_zig(tag: str, simplifier: Path) -> tuple[list[str], dict[str, str]]:
    """The same for Zig and any platform."""
    import ziglang

    target = PLATFORMS[tag]
    zig = Path(ziglang.__file__).with_name("zig")
    definitions = {
        "CMAKE_SYSTEM_NAME": target.system,
        "CMAKE_SYSTEM_PROCESSOR": target.processor,
        "CMAKE_AR": zig,
        "CMAKE_USER_MAKE_RULES_OVERRIDE_CXX": ROOT / "cmake" / "zig.cmake",
        "CMAKE_SHARED_LINKER_FLAGS": "-s",  # without symbols
        "MESHLET_SIMPLIFIER": simplifier,
    }
    environment = {
        "CXX": f"{zig} c++ -target {target.zig} -mcpu=baseline",
        "CMAKE_ARGS": shlex.join(f"-D{name}={value}" for name, value in definitions.items()),
        "_PYTHON_HOST_PLATFORM": tag,  # scikit-build-core takes the wheel's tag from it
    }
    return [f"--config-settings=build-dir={ROOT / 'build' / tag}"], environment


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _run(*command: str | Path, env: dict[str, str] | None = None) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True, env=env)


if __name__ == "__main__":
    sys.exit(main())
