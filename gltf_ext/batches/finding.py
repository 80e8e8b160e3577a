"""Finds the models of a batch, and the names of their outputs."""

from __future__ import annotations

import codecs
import os
import posixpath
import re
import stat
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

from gltf_ext.batches.storage import (
    STATE,
    Folder,
    Outputs,
    as_folder,
    real_path,
    stamp_of,
    stamp_of_file,
)
from gltf_ext.errors import MeshletError
from gltf_ext.files import identity
from gltf_ext.sources.importers import SUFFIXES

GLOB = re.compile(r"[*?\[]")
NO_MODEL = f"is no model; use {' '.join(SUFFIXES)}"
DISK = "file"  # the protocol of paths
BY_ITSELF = "give it to a batch by itself"
MAC_METADATA = "._"  # starts the names of files that macOS writes beside others


@dataclass
class Model:
    """A model to compress.

    Attributes:
        url: its path on a disk, or URL; name: below the folder that holds all models.
        size: in bytes; stamp: as Folder.stamp gives it.
        problem: why it cannot be read; empty if it can.
    """

    url: str
    name: str = ""
    size: int = 0
    stamp: str | None = None
    problem: str = ""


@dataclass
class Search:
    """All that a source names.

    Attributes:
        models: in the order of their paths; no two have the same name.
        left_out: path -> reason, of what may hold models but is not looked at.
        skipped: names of models in the destination that batches wrote there.
    """

    models: list[Model] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)


def find_models(
    source: str | Sequence[str], goal: Folder, outputs: Outputs, root: str | None = None
) -> Search:
    """Find the models of a batch. What is wrong with a single one is its problem.

    Args:
        source: a folder, searched with all folders below it; a glob; a file; a .txt with a path or
            URL in each line; or a list of those.
        goal: the destination.
        outputs: what is in it.
        root: the folder from which the names of a list's models start; by default, of the storage.

    Raises:
        MeshletError: no model is found, or the source cannot be read.
        OSError: the source cannot be read.
    """
    search = Search()
    if isinstance(source, str) and source.lower().endswith(".txt"):
        source = _lines(source)
    if not isinstance(source, str):
        paths = _from_list(source, search, root)
    elif root:
        raise MeshletError("root is for lists", "leave it out", options=("root",))
    else:
        paths = _from_folder(source, search)
    below = _Below(goal)
    in_destination = 0
    model_by_name: dict[str, Model] = {}
    for path, model in sorted(paths.items()):
        name = below.name_of(model.url)
        if name is None:
            first_model = model_by_name.setdefault(model.name, model)
            if first_model is model:
                search.models.append(model)
            else:
                search.left_out[path] = (
                    f"has the name {model.name}, as {first_model.url}; {BY_ITSELF}"
                )
            continue
        in_destination += 1
        if name in outputs.names:
            search.skipped.append(name)
        else:
            search.left_out[path] = "lies in the destination; name another one, or move the model"
    if search.models:
        return search
    if in_destination:
        raise MeshletError("holds the models too", "name another folder", goal.url)
    for path, reason in search.left_out.items():
        raise MeshletError("holds no models that can be read", f"{path} {reason}", str(source))
    raise MeshletError("holds no models", f"use {' '.join(SUFFIXES)}", str(source))


def _lines(path: str) -> list[str]:
    """Of a .txt. Names on a disk may be any bytes."""
    listing = Folder(path)
    data: bytes = listing.fs.cat_file(listing.path)
    lines = data.removeprefix(codecs.BOM_UTF8).decode(errors="surrogateescape").split("\n")
    return [line.strip() for line in lines if line.strip()]


# --- a list ---


def _from_list(entries: Sequence[str], search: Search, root: str | None) -> dict[str, Model]:
    """Return path or URL -> model, for each entry of a list.

    Names are whole paths, so that no entry changes the name of another one, or start below root.
    Those of other storages start with the protocol.
    """
    models: dict[str, Model] = {}
    start = _parts(f"{root}/model")[1][:-1] if root else ()
    for entry in entries:
        path = posixpath.basename(entry.replace(os.sep, "/"))
        if not path.lower().endswith(SUFFIXES):
            is_folder = "://" not in entry and os.path.isdir(entry)
            search.left_out[entry] = "is a folder; name it by itself" if is_folder else NO_MODEL
            continue
        path, parts = _parts(entry)
        if parts[: len(start)] != start:
            search.left_out[entry] = f"lies outside {root}"
            continue
        name = "/".join(parts[len(start) :] if root or parts[0] != DISK else parts[1:])
        model = _local(path, name) if parts[0] == DISK else _addressed(path, name)
        models[model.url] = model
    return models


def _parts(entry: str) -> tuple[str, tuple[str, ...]]:
    """Return (path or URL of an entry of a list, its protocol and the parts of its path)."""
    if "://" not in entry or entry.startswith(("file://", "local://")):
        path = Folder("/").fs._strip_protocol(entry)
        # With a zero byte, which _local reports, there are no links.
        with suppress(ValueError):
            path = posixpath.join(real_path(os.path.dirname(path)), os.path.basename(path))
        drive, tail = os.path.splitdrive(path)  # C: of Windows is no name of a folder
        steps = f"{drive.replace(':', '')}{tail}".split("/")
        return path, (DISK, *filter(None, steps))
    protocol, _, tail = entry.partition("://")
    return entry, (protocol, *filter(None, tail.split("/")))


def _addressed(entry: str, name: str) -> Model:
    """Return a model of a storage that is no disk, where it may be missing or something else."""
    try:
        folder = Folder(entry)
        info = folder.fs.info(folder.path)
        if info.get("type") == "directory":
            return Model(folder.url, name, problem="is a folder; name it by itself")
        return Model(folder.url, name, int(info.get("size") or 0), stamp_of(info))
    except FileNotFoundError:
        return Model(entry, name, problem="is not there; check the address")
    except Exception as error:  # of a network, of any package
        reason = MeshletError(f"{type(error).__name__}: {error}").message
        return Model(entry, name, problem=f"cannot be read: {reason}")


def _local(path: str, name: str = "") -> Model:
    """Return a model on a disk, where it may be missing or something else."""
    try:
        status = os.stat(path)
    except OSError as error:
        link = os.path.islink(path) and isinstance(error, FileNotFoundError)
        problem = "is a link to nothing" if link else f"cannot be read: {error.strerror}"
        return Model(path, name, problem=f"{problem}; check the path")
    except ValueError:  # a zero byte
        return Model(path, name, problem="is no path; check it")
    if stat.S_ISDIR(status.st_mode):
        return Model(path, name, problem="is a folder; name a file")
    if not stat.S_ISREG(status.st_mode):
        return Model(path, name, problem="is a pipe or a device; name a file")
    return Model(path, name, status.st_size, stamp_of_file(path))


# --- a folder or a glob ---


def _from_folder(source: str, search: Search) -> dict[str, Model]:
    """Return path or URL -> model, for a folder, a glob or a file.

    Names start below the folder; of a glob, below the last folder without a pattern.
    """
    folder = Folder(source)
    root, _, last_part = folder.path.rpartition("/")
    if folder.is_local:
        if os.path.isdir(folder.url):
            return _from_walk(folder.path, "", search)
        if os.path.lexists(folder.path):
            return _from_list([source], search, os.path.dirname(source) or ".")
        if GLOB.search(folder.path):
            return _from_walk(*_split_pattern(folder.path), search)
        raise MeshletError("is not there", "check the path", source)
    try:
        if last_part.lower().endswith(SUFFIXES) and not GLOB.search(folder.path):
            return _from_list([source], search, posixpath.dirname(source))
        if GLOB.search(folder.path) and not folder.fs.exists(folder.path):
            root, _ = _split_pattern(folder.path)
            infos = folder.fs.glob(folder.path, detail=True)
        else:
            root, infos = folder.path, folder.fs.find(folder.path, detail=True)
    except OSError:
        raise
    except Exception as error:  # of a network, of any package
        raise MeshletError(f"cannot be read: {type(error).__name__}: {error}", "", source) from None
    return {path: _remote(folder, path, root, infos[path]) for path in filter(_is_model, infos)}


def _remote(folder: Folder, path: str, root: str, info: dict[str, Any]) -> Model:
    url: str = folder.fs.unstrip_protocol(path)
    return Model(url, path[len(root) + 1 :], int(info.get("size") or 0), stamp_of(info))


def _is_model(path: str) -> bool:
    name = posixpath.basename(path).lower()
    return name.endswith(SUFFIXES) and not name.startswith(MAC_METADATA)


def _split_pattern(path: str) -> tuple[str, str]:
    """Return (the folder before the first pattern, the rest)."""
    pattern = GLOB.search(path)
    assert pattern
    at = path.rfind("/", 0, pattern.start())
    return path[:at], path[at + 1 :]


def _from_walk(root: str, pattern: str, search: Search) -> dict[str, Model]:
    """Path -> model, of all in a folder on a disk that match. pattern: of fsspec; empty for all."""
    matches, may_hold = _matchers(pattern) if pattern else (bool, bool)
    root = real_path(as_folder(root)).rstrip("/")
    models = {}
    for path, is_folder in _walk(root, may_hold, search):
        name = path[len(root) + 1 :]
        if _is_model(name) and matches(name) and not (is_folder and not pattern):
            models[path] = _local(path, name)
    return models


def _matchers(pattern: str) -> tuple[Callable[[str], Any], Callable[[str], Any]]:
    """Return (whether a name matches a pattern, whether one below a folder of this name may)."""
    from fsspec.utils import glob_translate

    parts = pattern.split("/")
    folders = list(takewhile(lambda part: part != "**", parts))
    any_depth = len(folders) < len(parts)
    if not any_depth:
        folders.pop()  # the last part is of the files
    above = [folders[: i + 1] for i in range(len(folders))]
    try:
        whole_name, *folder_levels = [
            re.compile(glob_translate("/".join(p))) for p in (parts, *above)
        ]
    except ValueError as error:
        raise MeshletError(str(error), "change the pattern", pattern) from None

    def may_hold(name: str) -> bool:
        level = name.count("/")
        return bool(folder_levels[level].match(name)) if level < len(folder_levels) else any_depth

    return whole_name.match, may_hold


def _walk(root: str, may_hold: Callable[[str], Any], search: Search) -> Iterator[tuple[str, bool]]:
    """Yield (path, whether it is a folder) of everything in a folder and the folders below it.

    Args:
        root: path of the folder.
        may_hold: whether a folder, by its name below the root, may contain models.
        search: gets the folders that are left out.
    """
    queue = [root]
    while queue:
        folder = queue.pop()
        try:
            with os.scandir(as_folder(folder)) as entries:
                children = sorted(entries, key=lambda entry: entry.name)
        except OSError as error:
            search.left_out[folder] = f"cannot be read: {error.strerror}"
            continue
        for entry in children:
            path = f"{folder}/{entry.name}"
            if not _is_folder(entry):
                yield path, False
                continue
            yield path, True
            if entry.name == STATE or not may_hold(path[len(root) + 1 :]):
                continue
            if entry.is_symlink() or _is_junction(entry):
                search.left_out[path] = "is a link to a folder; name the folder by itself"
            else:
                queue.append(path)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False


def _is_junction(entry: os.DirEntry[str]) -> bool:
    """Return whether it is Windows' other kind of link to a folder."""
    try:
        tag = getattr(entry.stat(follow_symlinks=False), "st_reparse_tag", 0)
    except OSError:
        return False
    return bool(tag == getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", -1))


class _Below:
    """Tells what lies in a folder: on a disk by the folder's identity, not its path."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._identity = identity(folder.url) if folder.is_local else None
        self._names: dict[str, str | None] = {}  # of folders

    def name_of(self, url: str) -> str | None:
        """Return the name that a model has in the folder; None if it is not in it."""
        if not self._folder.is_local:
            start = f"{self._folder.url}/"
            return url[len(start) :] if url.startswith(start) else None
        if "://" in url or self._identity is None:
            return None
        above = self._of_folder(os.path.dirname(url))
        return None if above is None else posixpath.join(above, posixpath.basename(url))

    def _of_folder(self, path: str) -> str | None:
        if path not in self._names:
            above = os.path.dirname(path)
            name: str | None = None
            if identity(path) == self._identity:
                name = ""
            elif above != path:
                outer = self._of_folder(above)
                name = None if outer is None else posixpath.join(outer, posixpath.basename(path))
            self._names[path] = name
        return self._names[path]


# --- outputs ---


def output_names(names: Sequence[str], ignore_case: bool = False) -> dict[str, str]:
    """Return the name of a model -> the name of its output, all different.

    An output has the suffix .glb. It is added to the whole name if two outputs would be equal, or
    one would be a folder of the other.

    Args:
        names: of the models.
        ignore_case: for a destination that does not distinguish "a" and "A".
    """
    number_of = dict.fromkeys(names, 0)
    while True:
        outputs = {name: _output_name(name, number) for name, number in number_of.items()}
        keys = {name: o.lower() if ignore_case else o for name, o in outputs.items()}
        users: dict[str, list[str]] = defaultdict(list)
        for name, key in keys.items():
            users[key].append(name)
        folders = {above.as_posix() for key in users for above in Path(key).parents}
        clashes = [n for key, n in users.items() if len(n) > 1 or key in folders]
        if not clashes:
            return outputs
        for group in clashes:
            for position, name in enumerate(group, start=1):  # numbers differ, so that this ends
                number_of[name] += position if number_of[name] else 1


def _output_name(name: str, number: int) -> str:
    if number == 0:
        return posixpath.splitext(name)[0] + ".glb"
    return f"{name}.glb" if number == 1 else f"{name}.{number}.glb"


def is_safe(name: str) -> bool:
    """Return whether a name of a model, from a storage or a list, stays in the destination."""
    parts = name.split("/")
    reserved = "\\:" if os.sep == "\\" else ""
    return not ({"", ".", ".."} & {*parts} or STATE in parts or any(c in name for c in reserved))
