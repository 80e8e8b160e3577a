"""Folders on a disk or in object storage: what lies there, reading and writing."""

from __future__ import annotations

import json
import os
import posixpath
import shutil
import stat
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gltf_ext import portable
from gltf_ext.errors import MeshletError
from gltf_ext.files import identity
from gltf_ext.gltf.container import fallback_of
from gltf_ext.portable import remove, replace

STATE = ".gltf-meshlet"  # folder in a destination: records, and what is being written
OUTPUTS = f"{STATE}/outputs.json"  # names of all files that batches wrote or are about to write
UNSURE = "?"  # ends the stamp of a file of which its storage tells only the size
VERSION_KEYS = ("ETag", "mtime", "created", "LastModified", "Last-Modified", "Content-MD5")


class Folder:
    """A folder by its path or URL.

    Attributes:
        path: in its storage `fs` of fsspec; on a disk without links and "..".
    """

    def __init__(self, url: str) -> None:
        """Raises MeshletError for a protocol that no installed package handles."""
        try:
            from fsspec.core import url_to_fs
            from fsspec.implementations.local import LocalFileSystem
        except ImportError:
            raise MeshletError("batch needs Dask", "pip install 'gltf-meshlet[batch]'") from None
        try:
            if "://" in url:
                self.fs, path = url_to_fs(url)
            else:  # not to url_to_fs, which takes a path apart at "::"
                self.fs = LocalFileSystem()
                path = self.fs._strip_protocol(url)
        except (ImportError, ValueError) as error:
            raise MeshletError(str(error), "check the address", url) from None
        self.is_local = "file" in self.fs.protocol
        self.path = (real_path(path) if self.is_local else path).rstrip("/")

    @property
    def url(self) -> str:
        """Its path on a disk, else its URL."""
        if self.is_local:
            return as_folder(self.path)
        url: str = self.fs.unstrip_protocol(self.path)
        return url

    def at(self, name: str) -> str:
        """The path of a file in it."""
        return f"{self.path}/{name}"

    def exists(self, name: str) -> bool:
        """Whether there is anything of this name, a broken link included."""
        if self.is_local:
            return os.path.lexists(self.at(name))
        return bool(self.fs.exists(self.at(name)))

    def stamp(self, name: str) -> str | None:
        """Changes whenever the file does; None if there is no such file."""
        if self.is_local:
            return stamp_of_file(name if os.path.isabs(name) else self.at(name))
        self.fs.invalidate_cache()
        try:
            return stamp_of(self.fs.info(self.at(name)))
        except FileNotFoundError:
            return None

    def stamps(self) -> dict[str, str]:
        """Name -> stamp of all files in it, which may not exist yet. Not on a disk, where asking
        for one file is as fast. Raises OSError."""
        self.fs.invalidate_cache()
        try:
            found = self.fs.find(self.path, detail=True)
        except FileNotFoundError:
            return {}
        return {path[len(self.path) + 1 :]: stamp_of(info) for path, info in found.items()}

    def read(self, name: str, start: int | None = None, end: int | None = None) -> bytes:
        """Some or all bytes of a file. Raises OSError, and what its storage raises."""
        if self.is_local and self.stamp(name) is None:  # a pipe would wait for its writer
            raise FileNotFoundError(f"{self.at(name)} is no file")
        data: bytes = self.fs.cat_file(self.at(name), start=start, end=end)
        return data

    def read_all(self, names: list[str]) -> dict[str, bytes]:
        """Name -> bytes of those that can be read."""
        found: list[Any] = []
        if names:  # cat would take brackets in names for patterns
            found = self.fs.cat_ranges([self.at(n) for n in names], None, None, on_error="return")
        return {n: data for n, data in zip(names, found) if isinstance(data, bytes)}

    def write(self, name: str, data: bytes | Path) -> None:
        """Writes all of a file or nothing. data: its bytes, or a file that holds them.

        Raises OSError, and what its storage raises.
        """
        path = self.at(name)
        if not self.is_local:
            content = data if isinstance(data, bytes) else data.read_bytes()
            self.fs.pipe_file(path, content)  # one request: nobody sees a part
            return
        partial = Path(self.at(STATE)) / f"{uuid.uuid4().hex}.part"
        partial.parent.mkdir(parents=True, exist_ok=True)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        try:
            if isinstance(data, bytes):
                partial.write_bytes(data)
            else:
                shutil.copyfile(data, partial)
            replace(partial, path)
        finally:
            remove(partial)

    def remove_partials(self) -> None:
        """Removes what killed writers left behind."""
        if self.is_local:
            for partial in Path(self.at(STATE)).glob("*.part"):
                remove(partial)

    def ignores_case(self) -> bool:
        """Whether "a" and "A" are the same file. On a disk, its folder STATE must exist."""
        state = identity(self.at(STATE)) if self.is_local else None
        return state is not None and identity(self.at(STATE.upper())) == state


def fallback_name(output: str) -> str:
    """Of the file beside an output."""
    return posixpath.join(posixpath.dirname(output), fallback_of(Path(output)).name)


def as_folder(path: str) -> str:
    """A path without its last slash as systems take it: "/" and "C:/" need it."""
    return f"{path}/" if not path or path.endswith(":") else path


def real_path(path: str) -> str:
    """Without links and "..", with forward slashes."""
    return portable.real_path(path).replace(os.sep, "/")


def stamp_of_file(path: str) -> str | None:
    """Of a file on a disk; None if there is none, also for folders and pipes."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return f"{found.st_size} {found.st_mtime_ns}" if stat.S_ISREG(found.st_mode) else None


def stamp_of(info: Mapping[str, Any]) -> str:
    """From what fsspec tells about a file."""
    version = next((info[key] for key in VERSION_KEYS if info.get(key)), UNSURE)
    return f"{info.get('size')} {version}"


def folder_of(url: str) -> tuple[Folder, str]:
    """(the folder of a file by its path or URL, the file's name in it)."""
    above, _, name = url.rpartition("/")
    return Folder(above if "://" in above else f"{above}/"), name


class Outputs:
    """The files in a destination that batches wrote: no other one is ever overwritten.

    Attributes:
        names: of those that exist, or that a run which was killed was about to write.
        stamps: name -> stamp of all files there, unless it is on a disk.
    """

    def __init__(self, folder: Folder) -> None:
        """Raises OSError."""
        self._folder = folder
        self.stamps = {} if folder.is_local else folder.stamps()
        known = {name.removesuffix(".json") for name in self._records()}
        known |= {fallback_name(name) for name in known}
        try:
            listed = json.loads(folder.read(OUTPUTS))
            known.update(name for name in listed if isinstance(name, str))
        except (FileNotFoundError, ValueError, TypeError):
            pass  # of the first batch, or damaged: what has a record is known still
        self.names = {name for name in known if self.exists(name)}

    def exists(self, name: str) -> bool:
        return self._folder.exists(name) if self._folder.is_local else name in self.stamps

    def stamp(self, name: str) -> str | None:
        return self._folder.stamp(name) if self._folder.is_local else self.stamps.get(name)

    def save(self, more: set[str]) -> None:
        """Writes the list, with files that are about to be written or now are. Raises OSError."""
        names = sorted(self.names | more)
        self._folder.write(OUTPUTS, json.dumps(names, indent=0).encode())

    def _records(self) -> list[str]:
        """Names of records, without the folder STATE."""
        if not self._folder.is_local:
            start = f"{STATE}/"
            return [name[len(start) :] for name in self.stamps if name.startswith(start)]
        root = self._folder.at(STATE)
        return [
            posixpath.normpath(
                posixpath.join(os.path.relpath(folder, root).replace(os.sep, "/"), name)
            )
            for folder, _, names in os.walk(root)
            for name in names
            if name.endswith(".json")
        ]
