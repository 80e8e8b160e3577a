"""Writing output files: all of them or none, and never over a file that was read."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from gltf_ext.errors import MeshletError
from gltf_ext.portable import IS_WINDOWS, check_not_in_use, real_path, remove, replace
from gltf_ext.work_files import release

BLOCK_BYTES = 1 << 24


def cache_folder() -> Path:
    """Return the user's folder for what can be made again. Safe to delete at any time.

    XDG_CACHE_HOME names its parent; by default that is LOCALAPPDATA on Windows, else ~/.cache.
    """
    for variable in ("XDG_CACHE_HOME", *(("LOCALAPPDATA",) if IS_WINDOWS else ())):
        base = os.environ.get(variable, "")
        if os.path.isabs(base):
            return Path(base) / "gltf-meshlet"
    return Path.home() / ".cache" / "gltf-meshlet"


def check_output(path: Path, inputs: Iterable[str | os.PathLike[str]]) -> None:
    """Check an output path before any work. Raises MeshletError.

    The output must be a .glb or .gltf in an existing folder, and no input.
    """
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise MeshletError("the output is not a .glb or .gltf", "name it something.glb", str(path))
    if not path.parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", str(path))
    if path.is_dir():
        raise MeshletError("is a folder", "name a file", str(path))
    refuse_overwriting(inputs, [path])


def identity(path: str | os.PathLike[str]) -> tuple[int, int] | str | None:
    """Return a value that is equal for two paths of the same file; None if there is no file.

    Knows links, "..", letter case where the system ignores it, and hard links unless the file
    system does not number files, as some network drives of Windows.
    """
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    if not status.st_ino:
        return os.path.normcase(real_path(path))
    return status.st_dev, status.st_ino


def refuse_overwriting(
    input_files: Iterable[str | os.PathLike[str]], outputs: Iterable[str | os.PathLike[str]]
) -> None:
    """Raise MeshletError for an output that is one of the files that were read.

    Whoever writes files of users calls this, mostly through `write_files`.
    """
    inputs = {identity(path) for path in input_files} - {None}
    for output in outputs:
        if identity(output) in inputs:
            raise MeshletError("is the input too", "name another output", str(output))


def write_files(
    contents: Mapping[Path, Sequence[bytes | memoryview]],
    input_files: Iterable[str | os.PathLike[str]],
) -> None:
    """Write each file beside its path, then rename all: all or none.

    Files that existed are as before if it fails. A link stays: the file that it leads to is
    replaced. A file that is replaced keeps its mode.

    Args:
        contents: path -> pieces of the file.
        input_files: the files that the contents were made from.

    Raises:
        MeshletError: a path is one of the input files, or leads to another one.
        OSError: a file cannot be written; its filename is the final path.
    """
    refuse_overwriting(input_files, contents)
    contents = _by_target(contents)
    # Short names: that of the path may already be as long as the file system allows.
    partials = {path: path.with_name(f".{os.urandom(16).hex()}.part") for path in contents}
    try:
        for path, partial in partials.items():
            with _errors_name(path), open(partial, "xb") as file:
                for piece in contents[path]:
                    _write(file, piece)
        rename_all(partials)
    finally:
        for partial in partials.values():
            remove(partial)


def _by_target(
    contents: Mapping[Path, Sequence[bytes | memoryview]],
) -> dict[Path, Sequence[bytes | memoryview]]:
    """Return the contents by the files that the paths lead to: renaming would replace a link."""
    result: dict[Path, Sequence[bytes | memoryview]] = {}
    for path, pieces in contents.items():
        target = Path(real_path(path)) if path.is_symlink() else path
        if target in result:
            raise MeshletError(
                "is the same file as another output", "remove the link, or name another", str(path)
            )
        result[target] = pieces
    return result


def _write(file: BinaryIO, piece: bytes | memoryview) -> None:
    """Write a piece; if it is of a mapped file, without keeping it in memory."""
    for first in range(0, len(piece), BLOCK_BYTES):
        file.write(memoryview(piece)[first : first + BLOCK_BYTES])
        release(piece)


def rename_all(partials: Mapping[Path, Path]) -> None:
    """Rename complete files to their paths, all or none, even if Ctrl-C interrupts it.

    They get the modes of the files that they replace.

    Call `refuse_overwriting` before, as `write_files` does.

    Args:
        partials: path -> complete file.

    Raises:
        OSError: with the path as its filename.
    """
    for path, partial in partials.items():
        _keep_mode(path, partial)
    *paths, last = partials
    backups: dict[Path, Path | None] = {}  # replaced path -> its file from before, if there was one
    try:
        for path in paths:
            with _errors_name(path):
                if path.is_dir():
                    raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
                backup = partials[path].with_suffix(".former") if path.exists() else None
                backups[path] = backup
                if backup is not None:
                    _set_aside(path, backup)
                replace(partials[path], path)
        with _errors_name(last):
            replace(partials[last], last)
    except BaseException:
        if partials[last].exists():  # else all are renamed
            _bring_back(backups)
        _remove_all(backups.values())
        raise
    _remove_all(backups.values())


def _keep_mode(path: Path, partial: Path) -> None:
    """Give the file that replaces another one its mode, as if it had been written into it."""
    if IS_WINDOWS:  # which has none, and could not remove a file that nobody may write
        return
    with suppress(OSError):  # there is no other file, or its file system has no modes
        partial.chmod(stat.S_IMODE(path.stat().st_mode))


def _bring_back(backups: Mapping[Path, Path | None]) -> None:
    for path, backup in backups.items():
        if backup is None:
            remove(path)
        elif backup.exists():
            replace(backup, path)


def _remove_all(backups: Iterable[Path | None]) -> None:
    """Remove former files: also those that are back, since replace keeps two names of one file."""
    for backup in filter(None, backups):
        remove(backup)


def _set_aside(path: Path, backup: Path) -> None:
    """Give a file a second name, from which it can be restored.

    The first name exists all the time, even if the process is killed, unless it is a link or the
    file system has no hard links.
    """
    check_not_in_use(path)
    with suppress(OSError):
        if not path.is_symlink():
            os.link(path, backup)
            return
    replace(path, backup)


@contextmanager
def _errors_name(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise
