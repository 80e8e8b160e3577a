"""Writing output files: all of them or none, and never over an input."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from gltf_ext.errors import MeshletError
from gltf_ext.portable import remove, replace
from gltf_ext.work_files import release

BLOCK_BYTES = 1 << 24


def check_output(path: Path, input: str | os.PathLike[str]) -> None:
    """Checks an output path before any work. Raises MeshletError.

    The output must be a .glb or .gltf in an existing folder, and not the input.
    """
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise MeshletError("the output is not a .glb or .gltf", "name it something.glb", str(path))
    if not path.parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", str(path))
    if path.is_dir():
        raise MeshletError("is a folder", "name a file", str(path))
    refuse_overwriting([Path(input)], [path])


def refuse_overwriting(inputs: Sequence[Path], outputs: Sequence[Path]) -> None:
    """Raises MeshletError for an output that is also an input, links included."""
    for output in outputs:
        if any(path.exists() and output.exists() and path.samefile(output) for path in inputs):
            raise MeshletError("is the input too", "name another output", str(output))


def write_model(
    input: str | os.PathLike[str],
    read: Sequence[Path],
    files: Mapping[Path, Sequence[bytes | memoryview]],
) -> dict[str, Any]:
    """Writes the files of a model, as `model_files` gives them, and begins a command's report.

    read: further files that must not be overwritten. Returns input, output, input_bytes and
    output_bytes. Raises MeshletError, OSError.
    """
    input_bytes = os.path.getsize(input)
    refuse_overwriting([Path(input), *read], list(files))
    write_files(files)
    *_, model = files
    return {
        "input": str(input),
        "output": str(model),
        "input_bytes": input_bytes,
        "output_bytes": sum(len(piece) for pieces in files.values() for piece in pieces),
    }


def write_files(contents: Mapping[Path, Sequence[bytes | memoryview]]) -> None:
    """Writes the pieces of each file beside its path, then renames all files: all or none.

    Raises OSError with the final path as its filename. Files that existed are then as before.
    """
    partials = {path: path.with_name(f".{path.name}.{os.getpid()}.part") for path in contents}
    try:
        for path, partial in partials.items():
            with _errors_name(path), open(partial, "wb") as file:
                for piece in contents[path]:
                    _write(file, piece)
        _rename_all(partials)
    finally:
        for partial in partials.values():
            remove(partial)


def _write(file: BinaryIO, piece: bytes | memoryview) -> None:
    """Writes a piece; if it is of a mapped file, without keeping it in memory."""
    for first in range(0, len(piece), BLOCK_BYTES):
        file.write(memoryview(piece)[first : first + BLOCK_BYTES])
        release(piece)


def _rename_all(partials: Mapping[Path, Path]) -> None:
    """Renames partial files to their paths. A rename that fails undoes those before it."""
    *paths, last = partials
    formers: dict[Path, Path | None] = {}  # replaced path -> its file from before, if there was one
    try:
        for path in paths:
            with _errors_name(path):
                if path.is_dir():
                    raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
                former = partials[path].with_suffix(".former") if path.exists() else None
                if former is not None:
                    replace(path, former)
                formers[path] = former
                replace(partials[path], path)
        with _errors_name(last):
            replace(partials[last], last)
    except OSError:
        for path, former in formers.items():
            if former is not None:
                replace(former, path)
            else:
                remove(path)
        raise
    for former in filter(None, formers.values()):
        remove(former)


@contextmanager
def _errors_name(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise
