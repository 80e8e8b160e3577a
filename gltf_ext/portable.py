"""What systems do otherwise: files that are in use, names of files, how many can be open."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path, PurePath

IS_WINDOWS = os.name == "nt"
# Virus scanners and indexers open every new file for a moment, and Windows then refuses to rename
# or to delete it.
PATIENCE, PAUSE = 2.0, 0.05  # seconds
# Of a path, unless long paths are enabled in Windows: 259, and unfinished files have longer names.
MAX_CHARACTERS = 239
SPARE_FILES = 64  # that may be opened beside those that `allow_open_files` is for


def replace(source: str | os.PathLike[str], target: str | os.PathLike[str]) -> None:
    """As os.replace, but on Windows waits for programs that hold a file open. Raises OSError."""
    _patiently(lambda: os.replace(source, target))


def remove(path: Path) -> None:
    """Delete a file if it is there, likewise. Raises OSError."""
    _patiently(lambda: path.unlink(missing_ok=True))


def check_not_in_use(path: Path) -> None:
    """Raise OSError for a file that `replace` cannot replace since another program has it open.

    Windows makes hard links of such a file, but removes neither name.
    """
    if IS_WINDOWS:
        replace(path, path)


def real_path(path: str | os.PathLike[str]) -> str:
    """Return a path without links and "..".

    As os.path.realpath, which Wine refuses for some long paths of files that do not exist.
    """
    try:
        return os.path.realpath(path)
    except OSError:
        return os.path.abspath(path)


def file_name(name: bytes) -> str:
    """Decode the name of a file in a model. os.fsdecode refuses some bytes on Windows only."""
    return name.decode(sys.getfilesystemencoding(), "surrogateescape")


def is_relative(name: str, kind: type[PurePath] = PurePath) -> bool:
    """Return whether a path stays in the folder that it is appended to.

    On Windows, "C:name" and a path with the name of a host do not; the latter would tell the host
    who the user is.
    """
    return not kind(name).anchor


def path_beside(folder: Path, name: str) -> Path | None:
    """Return the path of a file that a model in the folder names; None unless it is relative.

    The system is not asked about the file.
    """
    return folder / name if is_relative(name) else None


def is_too_long(path: str) -> bool:
    """Return whether Windows may refuse a path because of its length, without saying so."""
    return IS_WINDOWS and len(os.path.abspath(path)) > MAX_CHARACTERS


def allow_open_files(count: int) -> None:
    """Raise the process's limit, if it must be, so that so many more files can be open.

    As far as the system lets a process. macOS starts them with 256, Linux with 1024; Windows has no
    such limit.
    """
    if sys.platform == "win32":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        open_count = len(os.listdir("/dev/fd"))
    except OSError:  # as many as the limit allows, or a system that does not list them
        open_count = soft
    limit = open_count + count + SPARE_FILES
    if soft == resource.RLIM_INFINITY or soft >= limit:
        return
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    with suppress(OSError, ValueError):  # then opening fails, and says so
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))


def _patiently(action: Callable[[], None]) -> None:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            return action()
        except PermissionError:
            if not IS_WINDOWS or time.monotonic() > deadline:
                raise
            time.sleep(PAUSE)
