"""Folders on a disk or in object storage: what lies there, reading and writing."""

from __future__ import annotations

import json
import os
import posixpath
import shutil
import stat
import time
import uuid
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from gltf_ext import portable
from gltf_ext.document.container import fallback_of
from gltf_ext.errors import MeshletError
from gltf_ext.files import identity, rename_all
from gltf_ext.portable import remove

STATE = ".gltf-meshlet"  # folder in a destination: records, and what is being written
OUTPUTS = f"{STATE}/outputs.json"  # names of all files that batches wrote or are about to write
STALE = 86400  # seconds after which nobody is still writing an unfinished file
UNSURE = "?"  # ends the stamp of a file of which its storage tells only the size
VERSION_KEYS = ("ETag", "mtime", "created", "LastModified", "Last-Modified", "Content-MD5")


class Folder:
    """A folder by its path or URL.

    Attributes:
        path: in its storage `fs` of fsspec; on a disk without links and "..".
    """

    def __init__(self, url: str) -> None:
        """Raise MeshletError for a protocol that no installed package handles."""
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
            self.is_local = "file" in self.fs.protocol
            self.path = (real_path(path) if self.is_local else path).rstrip("/")
        except (ImportError, ValueError) as error:  # ValueError: also of a zero byte
            raise MeshletError(str(error), "check the address", url) from None

    @property
    def url(self) -> str:
        """Its path on a disk, else its URL."""
        if self.is_local:
            return as_folder(self.path)
        url: str = self.fs.unstrip_protocol(self.path)
        return url

    def at(self, name: str) -> str:
        """Return the path of a file in it."""
        return f"{self.path}/{name}"

    def exists(self, name: str) -> bool:
        """Return whether there is anything of this name, a broken link included."""
        if self.is_local:
            return os.path.lexists(self.at(name))
        return bool(self.fs.exists(self.at(name)))

    def stamp(self, name: str) -> str | None:
        """Change whenever the file does; None if there is no such file."""
        if self.is_local:
            return stamp_of_file(name if os.path.isabs(name) else self.at(name))
        self.fs.invalidate_cache()
        try:
            return stamp_of(self.fs.info(self.at(name)))
        except FileNotFoundError:
            return None

    def stamps(self) -> dict[str, str]:
        """Return name -> stamp of all files in the folder, which may not exist yet. Raises OSError.

        Not for folders on a disk, where asking for single files is as fast.
        """
        self.fs.invalidate_cache()
        try:
            infos = self.fs.find(self.path, detail=True)
        except FileNotFoundError:
            return {}
        return {path[len(self.path) + 1 :]: stamp_of(info) for path, info in infos.items()}

    def read(self, name: str, start: int | None = None, end: int | None = None) -> bytes:
        """Return some or all bytes of a file. Raises OSError, and what its storage raises."""
        if self.is_local and self.stamp(name) is None:  # a pipe would wait for its writer
            raise FileNotFoundError(f"{self.at(name)} is no file")
        data: bytes = self.fs.cat_file(self.at(name), start=start, end=end)
        return data

    def read_all(self, names: list[str]) -> dict[str, bytes]:
        """Return name -> bytes of those that can be read."""
        contents: list[Any] = []
        if self.is_local:  # half the time that fsspec takes
            contents = [_read_or_none(self.at(name)) for name in names]
        elif names:  # cat would take brackets in names for patterns
            contents = self.fs.cat_ranges(
                [self.at(n) for n in names], None, None, on_error="return"
            )
        return {n: data for n, data in zip(names, contents) if isinstance(data, bytes)}

    def write(self, name: str, data: bytes | Iterable[bytes]) -> None:
        """Write all of a file or nothing. Raises OSError, and what its storage raises.

        data: all of it, or pieces of it.
        """
        pieces = [data] if isinstance(data, bytes) else data
        if not self.is_local:
            self.fs.pipe_file(self.at(name), b"".join(pieces))  # one request: nobody sees a part
            return
        with self._unfinished([name]) as partials:
            (partial,) = partials.values()
            with open(partial, "wb") as file:
                file.writelines(pieces)

    def write_files(self, files: Mapping[str, Path]) -> None:
        """Write copies of files, by their names in this folder: on a disk all or none.

        Elsewhere each file is written as a whole, the last one last. Raises OSError, and what the
        storage raises.
        """
        if not self.is_local:
            for name, file in files.items():
                self.write(name, file.read_bytes())
            return
        with self._unfinished(list(files)) as partials:
            for file, partial in zip(files.values(), partials.values()):
                shutil.copyfile(file, partial)

    @contextmanager
    def _unfinished(self, names: list[str]) -> Iterator[dict[Path, Path]]:
        """Paths on a disk -> files to write, which then get these paths, all or none."""
        state = Path(self.at(STATE))
        partials = {Path(self.at(name)): state / f"{uuid.uuid4().hex}.part" for name in names}
        for folder in (state, *(path.parent for path in partials)):
            folder.mkdir(parents=True, exist_ok=True)
        try:
            yield partials
            rename_all(partials)
        finally:
            for partial in partials.values():
                remove(partial)

    def remove_partials(self) -> None:
        """Remove what killed writers left behind, but not what another batch is writing."""
        if not self.is_local:
            return
        for partial in Path(self.at(STATE)).iterdir():
            if partial.suffix in (".part", ".former"):
                with suppress(FileNotFoundError):
                    # Of a file from before, only the second one is new. See rename_all.
                    last_change = max(partial.stat().st_mtime, partial.stat().st_ctime)
                    if time.time() - last_change > STALE:
                        remove(partial)

    def ignores_case(self) -> bool:
        """Return whether "a" and "A" are the same file. On a disk, its folder STATE must exist."""
        state = identity(self.at(STATE)) if self.is_local else None
        return state is not None and identity(self.at(STATE.upper())) == state


def _read_or_none(path: str) -> bytes | None:
    """Return the bytes of a file on a disk; None if it cannot be read, or is no file."""
    try:
        if not os.path.isfile(path):  # a pipe would wait for its writer
            return None
        with open(path, "rb") as file:
            return file.read()
    except OSError:
        return None


def fallback_name(output: str) -> str:
    """Of the file beside an output."""
    return posixpath.join(posixpath.dirname(output), fallback_of(Path(output)).name)


def as_folder(path: str) -> str:
    """Return a path without its last slash as systems take it: "/" and "C:/" need it."""
    return f"{path}/" if not path or path.endswith(":") else path


def real_path(path: str) -> str:
    """Without links and "..", with forward slashes."""
    return portable.real_path(path).replace(os.sep, "/")


def stamp_of_file(path: str) -> str | None:
    """Of a file on a disk; None if there is none, also for folders and pipes.

    Programs that copy files set sizes and times: the file's number and the time of its last change,
    which is of its creation on Windows, are the system's.
    """
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    if not stat.S_ISREG(status.st_mode):
        return None
    return f"{status.st_size} {status.st_mtime_ns} {status.st_ino} {status.st_ctime_ns}"


def stamp_of(info: Mapping[str, Any]) -> str:
    """From what fsspec tells about a file."""
    version = next((info[key] for key in VERSION_KEYS if info.get(key)), UNSURE)
    return f"{info.get('size')} {version}"


def folder_of(url: str) -> tuple[Folder, str]:
    """Return (the folder of a file by its path or URL, the file's name in it)."""
    above, _, name = url.rpartition("/")
    return Folder(above if "://" in above else f"{above}/"), name


class Outputs:
    """The files in a destination that batches wrote: no other one is ever overwritten.

    Attributes:
        names: of those that exist, or that a run which was killed was about to write.
        stamps: name -> stamp of all files there, unless it is on a disk.
    """

    def __init__(self, folder: Folder) -> None:
        """Raise OSError."""
        self._folder = folder
        self.stamps = {} if folder.is_local else folder.stamps()
        names = {name.removesuffix(".json") for name in self._records()}
        listed_names = self._read_list()
        # Without the list, records tell the rest. A file beside an output may be another's.
        names |= {fallback_name(name) for name in names} if listed_names is None else listed_names
        self.names = {name for name in names if self.exists(name)}

    def exists(self, name: str) -> bool:
        """Return whether a file exists."""
        return self._folder.exists(name) if self._folder.is_local else name in self.stamps

    def stamp(self, name: str) -> str | None:
        """Return the stamp of a file; None if it does not exist."""
        return self._folder.stamp(name) if self._folder.is_local else self.stamps.get(name)

    def save(self, names: set[str]) -> None:
        """Add files that are about to be written to the list. Raises OSError."""
        self._folder.write(OUTPUTS, json.dumps(sorted(self.names | names), indent=0).encode())

    def settle(self, names: set[str]) -> None:
        """Take from the list what was planned and is not there. Raises OSError.

        What is there was written, even by a job that failed: its record may be what it could not
        write.
        """
        if not self._folder.is_local:
            try:
                self.stamps = self._folder.stamps()
            except Exception:  # of a network, of any package: all that was planned is listed
                return
        self.names = {name for name in self.names if self.exists(name)}
        self.save({name for name in names if self.exists(name)})

    def _read_list(self) -> set[str] | None:
        """Return the list; None before the first batch, or if it is damaged."""
        try:
            names = json.loads(self._folder.read(OUTPUTS))
        except (FileNotFoundError, ValueError, RecursionError):
            return None
        is_list = isinstance(names, list) and all(isinstance(name, str) for name in names)
        return set(names) if is_list else None

    def _records(self) -> list[str]:
        """Name of records, without the folder STATE."""
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
