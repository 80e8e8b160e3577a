"""Writing output files: all of them or none, and never over an input."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from gltf_ext.errors import MeshletError


def check_output(path: Path, input: str | os.PathLike[str]) -> None:
    """Checks an output path before any work. Raises MeshletError.

    The output must be a .glb in an existing folder, and not the input.
    """
    if path.suffix.lower() != ".glb":
        raise MeshletError("the output is not a .glb", "name it something.glb", str(path))
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


def write_files(contents: Mapping[Path, Sequence[bytes | memoryview]]) -> None:
    """Writes the pieces of each file beside its path, then renames all files: all or none.

    Raises OSError with the final path as its filename. Files that existed are then as before.
    """
    partials = {path: path.with_name(f".{path.name}.{os.getpid()}.part") for path in contents}
    try:
        for path, partial in partials.items():
            with _errors_name(path), open(partial, "wb") as file:
                file.writelines(contents[path])
        _rename_all(partials)
    finally:
        for partial in partials.values():
            partial.unlink(missing_ok=True)


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
                    os.replace(path, former)
                formers[path] = former
                os.replace(partials[path], path)
        with _errors_name(last):
            os.replace(partials[last], last)
    except OSError:
        for path, former in formers.items():
            if former is not None:
                os.replace(former, path)
            else:
                path.unlink(missing_ok=True)
        raise
    for former in filter(None, formers.values()):
        former.unlink()


@contextmanager
def _errors_name(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise
