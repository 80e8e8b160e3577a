"""Writing output files: all of them or none, and never over an input."""

from __future__ import annotations

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
    """Writes the pieces of each file beside its path, then renames all files.

    Raises OSError with the final path as its filename; nothing is left half-written.
    """
    partials = {path.with_name(f".{path.name}.{os.getpid()}.part"): path for path in contents}
    try:
        for partial, path in partials.items():
            with _errors_name(path), open(partial, "wb") as file:
                file.writelines(contents[path])
        for partial, path in partials.items():
            with _errors_name(path):
                os.replace(partial, path)
    finally:
        for partial in partials:
            partial.unlink(missing_ok=True)


@contextmanager
def _errors_name(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise
