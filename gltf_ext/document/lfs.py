"""Git LFS pointers: small texts that stand for files which Git has not fetched."""

from __future__ import annotations

from gltf_ext.errors import MeshletError

START = b"version https://git-lfs.github.com/spec/"
PROBLEM, REMEDY = "a Git LFS pointer, not the file itself", "fetch it: git lfs pull"


def is_pointer(data: bytes | memoryview) -> bool:
    """Return whether the first bytes of a file are those of a pointer."""
    return bytes(data[: len(START)]) == START


def refuse_pointer(data: bytes | memoryview) -> None:
    """Raise MeshletError if the first bytes of a file are those of a pointer."""
    if is_pointer(data):
        raise MeshletError(f"is {PROBLEM}", REMEDY)
