"""Folders on a disk or in object storage, through fsspec."""

from __future__ import annotations

import os
import posixpath
import re
import uuid
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gltf_ext.errors import MeshletError
from gltf_ext.gltf.importers import SUFFIXES
from gltf_ext.portable import remove, replace

STATE = ".gltf-meshlet"  # folder in a destination: records, and what is being written
GLOB = re.compile(r"[*?\[]")


class Folder:
    """A folder by its path or URL."""

    def __init__(self, url: str) -> None:
        """Raises MeshletError for a protocol that no installed package handles."""
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise MeshletError("batch needs Dask", "pip install 'gltf-meshlet[batch]'") from None
        try:
            self.fs, path = url_to_fs(url)
        except (ImportError, ValueError) as error:
            raise MeshletError(str(error), "check the address", url) from None
        self.path = path.rstrip("/")
        self.is_local = "file" in self.fs.protocol

    @property
    def url(self) -> str:
        url: str = self.fs.unstrip_protocol(self.path)
        return url

    def at(self, name: str) -> str:
        """The path of a file in it."""
        return f"{self.path}/{name}"

    def holds(self, path: str, other: Folder) -> bool:
        """Whether a path of the other folder's storage lies in this one."""
        return type(self.fs) is type(other.fs) and f"{path}/".startswith(f"{self.path}/")

    def stamp(self, name: str) -> str | None:
        """Changes whenever the file does; None if there is no such file."""
        self.fs.invalidate_cache()
        try:
            return stamp_of(self.fs.info(self.at(name)))
        except FileNotFoundError:
            return None

    def write(self, name: str, data: bytes) -> None:
        """Writes all of a file or nothing. Raises OSError."""
        path = self.at(name)
        if not self.is_local:
            self.fs.pipe_file(path, data)  # one request: nobody sees a part
            return
        partial = Path(self.at(STATE)) / f"{uuid.uuid4().hex}.part"
        partial.parent.mkdir(parents=True, exist_ok=True)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        try:
            partial.write_bytes(data)
            replace(partial, path)
        finally:
            remove(partial)

    def remove_partials(self) -> None:
        """Removes what killed writers left behind."""
        if self.is_local:
            for partial in Path(self.at(STATE)).glob("*.part"):
                remove(partial)


def stamp_of(info: Mapping[str, Any]) -> str:
    """From what fsspec tells about a file."""
    version = next((info[key] for key in ("ETag", "mtime", "created") if key in info), "")
    return f"{info.get('size')} {version}"


def find_models(
    source: str | Sequence[str], destination: Folder
) -> tuple[Folder, dict[str, Mapping[str, Any]]]:
    """The folder that holds all models, and fsspec's information on each by its name in it.

    source: a folder, searched with all folders below it but the destination; a glob; a file; a .txt
    with a path or URL in each line; or a list of those. Raises MeshletError, OSError.
    """
    if isinstance(source, str) and source.lower().endswith(".txt"):
        listing = Folder(source)
        lines = listing.fs.cat_file(listing.path).decode().splitlines()
        source = [line.strip() for line in lines if line.strip()]
    if isinstance(source, str):
        folder = Folder(source)
        is_glob = GLOB.search(folder.path)
        found = (folder.fs.glob if is_glob else folder.fs.find)(folder.path, detail=True)
    else:
        folders = [Folder(path) for path in source] or [Folder("")]
        folder = folders[0]
        found = {f.path: folder.fs.info(f.path) for f in folders if f.path}
    found = {path: found[path] for path in sorted(found) if path.lower().endswith(SUFFIXES)}
    if not found:
        raise MeshletError("holds no models", f"use {' '.join(SUFFIXES)}", str(source))
    models = {path: info for path, info in found.items() if not destination.holds(path, folder)}
    if not models:
        raise MeshletError("holds the models too", "name another folder", destination.url)
    folder.path = posixpath.commonpath([posixpath.dirname(path) for path in models])
    return folder, {posixpath.relpath(path, folder.path or "."): i for path, i in models.items()}


def output_names(names: Sequence[str]) -> dict[str, str]:
    """Name of a model -> of its output: with the suffix .glb, added where two would be the same."""
    plain = {name: posixpath.splitext(name)[0] + ".glb" for name in names}
    uses = Counter(plain.values())
    return {name: o if uses[o] == 1 else f"{name}.glb" for name, o in plain.items()}
