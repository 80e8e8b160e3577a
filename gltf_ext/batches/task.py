"""One file of a batch, in a worker: read, compressed, verified, written, recorded."""

from __future__ import annotations

import base64
import errno
import hashlib
import importlib.metadata
import json
import os
import posixpath
import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gltf_ext.batches.storage import STATE, UNSURE, Folder, fallback_name, folder_of
from gltf_ext.batches.thumbnail import thumbnail
from gltf_ext.checks.verify import compare_files
from gltf_ext.commands.compress import compress
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_ext.files import refuse_overwriting
from gltf_ext.options import Options
from gltf_ext.portable import is_relative
from gltf_ext.sources.importers import open_model, referenced_files

Record = dict[str, Any]
VERSION = importlib.metadata.version("gltf-meshlet")
FORMAT = 2  # the version byte of a blob
DONE, UNCHANGED, FAILED = "done", "unchanged", "failed"
# What a record has, besides what Job.difference compares.
RECORDED = {
    "inputs": dict,
    "input_digest": str,
    "outputs": dict,
    "output_digest": str,
    "input_bytes": int,
    "output_bytes": int,
    "triangles": int,
    "ratio": float | int | None,
    "max_error_percent": float | int | None,
    "warnings": list,
    "thumbnail": str,
    "seconds": float | int,
}
Stamp = Callable[[str], str | None]  # of a file by its name, None if there is none
LONGEST_RECORD = 250  # bytes of a name; file systems take 255
# Errors for a name that no file can have on this machine: too long, or below a file.
NO_NAME = (errno.ENAMETOOLONG, errno.ENOTDIR, errno.EEXIST)


@dataclass(frozen=True)
class Job:
    """A model to compress.

    Attributes:
        source: the model's path or URL; name: among all models.
        destination: URL of the folder for outputs; output: name in it.
        options: of compress.
        version: of gltf-meshlet that made the job.
        run: differs between all batches; a job may run twice in one, when a worker is lost.
    """

    source: str
    name: str
    destination: str
    output: str
    options: dict[str, Any]
    version: str
    run: str = ""

    @property
    def record_name(self) -> str:
        """Name of the job's record in the destination."""
        return record_name(self.output)

    @property
    def limit_name(self) -> str:
        """Name of the record of a limit that it reached. Not .json: it tells of no output."""
        return self.record_name.removesuffix("json") + "limit"

    @property
    def outputs(self) -> list[str]:
        """Names of all files that it may write, but its record."""
        return [
            self.output,
            *([fallback_name(self.output)] if self.options.get("fallback") else ()),
        ]

    def is_of_this_run(self, record: Record) -> bool:
        """Return whether this batch has written a record."""
        return bool(self.run) and record.get("run") == self.run

    def difference(self, record: Any) -> str:
        """Return why a record is not of this job as it is now; empty if it is."""
        if record is None:
            return "is new"
        if not _is_complete(record):
            return "has no complete record"
        if record.get("version") != self.version or record.get("format") != FORMAT:
            was = f"gltf-meshlet {record.get('version')}, format {record.get('format')}"
            return f"was made by {was}; this is {self.version}, format {FORMAT}"
        if record.get("options") != self.options:
            return f"has other options: {_changes(record.get('options'), self.options)}"
        if record.get("name") != self.name or record.get("output") != self.output:
            return "has another name"
        return ""

    def changed_file(self, record: Record, stamp: Stamp, output_stamp: Stamp) -> str:
        """Return what the stamps of the files tell that were read or written; empty for no change.

        Args:
            record: of this job, complete.
            stamp: of a file that was read, by its path from the model's folder.
            output_stamp: of an output.
        """
        if record.get("source") != self.source:
            return f"was made of {record.get('source')}"
        for kind, stamp_of in (("inputs", stamp), ("outputs", output_stamp)):
            for name, file in record[kind].items():
                now, before = stamp_of(name), file.get("stamp")
                if now is None and before is not None:
                    return f"{kind[:-1]} {name} is gone"
                if now != before or str(now).endswith(UNSURE):
                    return f"{kind[:-1]} {name} {'is new' if before is None else 'has changed'}"
        return ""

    def failure(self, error: str, seconds: float = 0.0) -> Record:
        """Return the record of this job for an error."""
        return {
            "name": self.name,
            "output": self.output,
            "status": FAILED,
            "error": MeshletError(error).message,
            "seconds": seconds,
        }


def record_name(output: str) -> str:
    """Return the name of the record of an output in the destination."""
    name = f"{STATE}/{output}.json"
    if len(os.fsencode(posixpath.basename(name))) <= LONGEST_RECORD:
        return name
    return f"{STATE}/{hashlib.sha256(os.fsencode(output)).hexdigest()}.json"


def _is_complete(record: Any) -> bool:
    """Return whether a record has all that a report needs."""
    return (
        isinstance(record, dict)
        and all(isinstance(record.get(key, ...), kind) for key, kind in RECORDED.items())
        and all(
            isinstance(file, dict) for k in ("inputs", "outputs") for file in record[k].values()
        )
    )


def _changes(before: Any, now: Mapping[str, Any]) -> str:
    """Return the options that differ, as text."""
    before = before if isinstance(before, dict) else {}
    names = [n for n in {**before, **now} if before.get(n) != now.get(n)]
    return ", ".join(f"{n} {before.get(n, 'default')} -> {now.get(n, 'default')}" for n in names)


def run(job: Job, folder: Path) -> Record:
    """Do a job unless its record says that it is done.

    folder: an empty one for temporary files, which is empty again afterwards. A file that cannot be
    compressed gives a record with the status "failed"; what may pass, such as an OSError of a
    network, is raised.
    """
    start = time.perf_counter()
    try:
        if job.version != VERSION:
            raise MeshletError(f"the worker has gltf-meshlet {VERSION}", "update it")
        return _run(job, folder, start)
    except MeshletError as error:
        return job.failure(error.message, time.perf_counter() - start)
    except MemoryError:
        return job.failure("there is not enough memory; split the model")
    finally:
        _empty(folder)


def _empty(folder: Path) -> None:
    """Delete what is in a folder.

    Windows deletes no file that is mapped into memory or that a virus scanner reads: such a file is
    deleted with the worker's folder, and does not fail the model.
    """
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()


def _run(job: Job, folder: Path, start: float) -> Record:
    destination = Folder(job.destination)
    inputs = _Inputs(job, folder)
    old_record = read_record(destination, job)
    unchanged_record = _refresh_record(destination, job, inputs, old_record)
    if unchanged_record is not None:
        return unchanged_record
    old_digests = digests_of_record(old_record)
    _check_outputs(destination, job, old_digests)
    output = folder / posixpath.basename(job.output)
    report, verification, document = _compress_and_verify(job, inputs, output, folder)
    picture = _picture(document)  # before anything is written: it may kill the worker
    outputs = _write_outputs(destination, job, inputs, folder, old_digests)
    record = {
        "name": job.name,
        "source": job.source,
        "output": job.output,
        "status": DONE,
        "options": job.options,
        "version": job.version,
        "format": FORMAT,
        "run": job.run,
        "input_digest": inputs.digest,
        "inputs": inputs.entries,
        "output_digest": outputs[job.output]["digest"],
        "outputs": outputs,
        "former": {name: old_digests[name] for name in old_digests if name not in outputs},
        "input_bytes": sum(path.stat().st_size for path in inputs.files.values()),
        "output_bytes": report["output_bytes"] + report["fallback_bytes"],
        "triangles": report["totals"]["triangles"],
        "ratio": report["totals"]["ratio"],
        "max_error_percent": verification["max_error_percent"].get("POSITION"),
        "warnings": report["warnings"],
        "seconds": time.perf_counter() - start,
        "thumbnail": base64.b64encode(picture).decode(),
    }
    destination.write(job.record_name, json.dumps(record).encode())
    return record


def _refresh_record(
    destination: Folder, job: Job, inputs: _Inputs, old_record: Any
) -> Record | None:
    """Return the record of a job whose outputs are made from the same bytes; None without one."""
    if not job.difference(old_record) and old_record["input_digest"] == inputs.digest:
        outputs = _current_outputs(destination, old_record)
        if outputs is not None:
            updates = {"source": job.source, "inputs": inputs.entries, "outputs": outputs}
            record: Record = {**old_record, **updates}
            destination.write(job.record_name, json.dumps(record).encode())
            return {**record, "status": DONE if job.is_of_this_run(record) else UNCHANGED}
    return None


def _compress_and_verify(
    job: Job, inputs: _Inputs, output: Path, folder: Path
) -> tuple[dict[str, Any], dict[str, Any], Document]:
    """Write and verify the output on this machine. Returns the reports, and the output as read.

    Raises MeshletError, OSError.
    """
    report = compress(inputs.model, output, **{"threads": 1, **job.options})
    if report["output"] != str(output):
        raise MeshletError("the result does not fit a .glb", "compress it by itself")
    names = ("max_memory", "work_dir", "obj_groups")
    of_verify = {"work_dir": str(folder), **job.options}
    of_verify = {name: of_verify[name] for name in names if name in of_verify}
    document = open_model(output)
    verification = compare_files(inputs.model, output, Options.of(of_verify), document)
    if inputs.current_stamps() != inputs.stamps:
        raise MeshletError("changed while it was read", "run again")
    if verification["problems"]:  # losses that show are warned of by compress
        raise MeshletError("; ".join(["is not the same after decoding", *verification["problems"]]))
    return report, verification, document


def _write_outputs(
    destination: Folder, job: Job, inputs: _Inputs, folder: Path, old_digests: dict[str, Any]
) -> dict[str, Any]:
    """Write the outputs to the destination. Returns name -> stamp and digest of each.

    old_digests: digests of outputs that earlier runs wrote.
    """
    if destination.is_local:
        refuse_overwriting(inputs.files.values(), map(destination.at, job.outputs))
    files = {name: folder / posixpath.basename(name) for name in reversed(job.outputs)}
    files = {name: path for name, path in files.items() if path.exists()}  # the model is the last
    digests = {name: digest_of(path) for name, path in files.items()}
    if old_digests:  # the worker may be killed between the outputs and the record
        all_digests = {
            name: sorted({*old_digests.get(name, ()), digest}) for name, digest in digests.items()
        }
        interim_record = {"outputs": {}, "former": {**old_digests, **all_digests}}
        destination.write(job.record_name, json.dumps(interim_record).encode())
    destination.write_files(files)
    return {
        name: {"stamp": destination.stamp(name), "digest": digest}
        for name, digest in digests.items()
    }


def _picture(output: Document) -> bytes:
    """Return the thumbnail of an output; empty if there can be none: that is no reason to fail."""
    try:
        return thumbnail(output)
    except (MeshletError, MemoryError):
        return b""


def read_record(destination: Folder, job: Job) -> Any:
    """Return the record of the output; None if it cannot be read."""
    try:
        return json.loads(destination.read(job.record_name))
    except (FileNotFoundError, ValueError, RecursionError):
        return None


def record_limit(job: Job, record: Record, limits: Mapping[str, Any]) -> None:
    """Write the record of a model that killed its workers, or took too long.

    limits: what has to change before it is tried again, besides the model and the options. Raises
    OSError, and what the storage raises.
    """
    source, name = folder_of(job.source)
    extra = {"options": job.options, "version": job.version, "stamp": source.stamp(name)}
    data = json.dumps({**record, **extra, "limits": limits}).encode()
    Folder(job.destination).write(job.limit_name, data)


def reached_limit(job: Job, record: Any, stamp: str | None) -> bool:
    """Return whether a record is one of `record_limit`, of this model with these options."""
    values = {"options": job.options, "version": job.version, "stamp": stamp, "name": job.name}
    return (
        isinstance(record, dict)
        and isinstance(record.get("limits"), dict)
        and isinstance(record.get("error"), str)
        and all(record.get(key) == value for key, value in values.items())
    )


def digests_of_record(record: Any) -> dict[str, list[str]]:
    """Return name -> SHA-256 of the outputs that batches wrote, or meant to write."""
    try:
        outputs = {name: [str(output["digest"])] for name, output in record["outputs"].items()}
        former = {name: [*map(str, all_)] for name, all_ in record.get("former", {}).items()}
    except (AttributeError, KeyError, TypeError):
        return {}  # of the first batch, or damaged
    return {**former, **outputs}


def _check_outputs(destination: Folder, job: Job, old_digests: dict[str, list[str]]) -> None:
    """Raise MeshletError for an output that is there and that no batch wrote."""
    for name in job.outputs:
        is_there = name in old_digests and destination.stamp(name) is not None
        if is_there and not holds(destination, name, *old_digests[name]):
            problem = f"its output {name} is not as a batch wrote it"
            raise MeshletError(problem, "move it, or delete it to have it made again")


def _current_outputs(destination: Folder, record: Record) -> dict[str, Any] | None:
    """Return the outputs of a record with their stamps of now, if all still hold the same bytes."""
    current_outputs = {}
    for name, output in record["outputs"].items():
        stamp = destination.stamp(name)
        if stamp is None:
            return None
        is_sure = stamp == output.get("stamp") and not stamp.endswith(UNSURE)
        if not is_sure and not holds(destination, name, output.get("digest")):
            return None
        current_outputs[name] = {**output, "stamp": stamp}
    return current_outputs


class _Inputs:
    """The model of a job and the files that it names, as files of this machine.

    They are copied unless they lie on a disk of it.

    Attributes:
        model: path of the model; files: path from the model's folder -> path of a file that exists.
        stamps: path from the model's folder -> stamp, None for a file that does not exist.
        entries: path from the model's folder -> stamp and SHA-256.
        digest: SHA-256 of the model; of several files, of their digests.
    """

    def __init__(self, job: Job, folder: Path) -> None:
        self._source, self._name = folder_of(job.source)
        self.stamps = {self._name: self._source.stamp(self._name)}
        if self.stamps[self._name] is None:
            raise MeshletError("is not there, or no file", "check the path")
        self.model = Path(self._source.at(self._name))
        if self._source.is_local:
            self.files = {self._name: self.model} | self._local()
        else:
            copies = folder / "input"
            copies.mkdir()
            self.model = copies / self._name
            self._source.fs.get_file(self._source.at(self._name), str(self.model))
            self.files = {self._name: self.model} | self._copy_references(copies)
        digests = {name: digest_of(path) for name, path in self.files.items()}
        self.entries = {
            name: {"stamp": stamp, "digest": digests.get(name)}
            for name, stamp in self.stamps.items()
        }
        self.digest, *others = digests.values()
        if others:
            self.digest = hashlib.sha256("\n".join(digests.values()).encode()).hexdigest()

    def current_stamps(self) -> dict[str, str | None]:
        """Return the stamps of this moment."""
        return {name: self._source.stamp(name) for name in self.stamps}

    def _local(self) -> dict[str, Path]:
        files = {_relative(path, self.model.parent): path for path in referenced_files(self.model)}
        self._add(files)
        return {name: path for name, path in files.items() if os.path.isfile(path)}

    def _add(self, names: Iterable[str]) -> None:
        """Note files, and their stamps before they are read."""
        for name in names:
            if name not in self.stamps:
                self.stamps[name] = self._source.stamp(name)

    def _copy_references(self, copies: Path) -> dict[str, Path]:
        files: dict[str, Path] = {}
        for _ in range(2):  # an .obj names libraries, and these name images
            for path in referenced_files(self.model):
                name = posixpath.normpath(_relative(path, copies))
                if name in self.stamps:
                    continue
                if _leaves(name):  # there, it would be a file of this machine
                    problem = f"names a file outside its folder ({name})"
                    raise MeshletError(problem, "put the file into the folder")
                self._add([name])
                if self._copy(name, copies / name):
                    files[name] = copies / name
        return files

    def _copy(self, name: str, path: Path) -> bool:
        """Return whether there is a file of this name, which is then copied."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._source.fs.get_file(self._source.at(name), str(path))
        except FileNotFoundError:
            return False
        except OSError as error:
            if error.errno not in NO_NAME:
                raise
            return False
        return path.is_file()  # not a folder


def _relative(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, with forward slashes; absolute paths stay as they are.

    It may contain "..", which no text can resolve where there are links.
    """
    try:
        return path.relative_to(folder).as_posix()
    except ValueError:
        return str(path)


def _leaves(name: str) -> bool:
    """Return whether a path without needless ".." leads out of the folder that it starts from."""
    return name.split("/")[0] == ".." or not is_relative(name)


def holds(folder: Folder, name: str, *digests: str | None) -> bool:
    """Return whether a file has one of these SHA-256."""
    with folder.fs.open(folder.at(name), "rb") as file:
        return _digest_of(file) in digests


def digest_of(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file on a disk."""
    with open(path, "rb") as file:
        return _digest_of(file)


def _digest_of(file: Any) -> str:
    digest = hashlib.sha256()
    while block := file.read(1 << 20):
        digest.update(block)
    return digest.hexdigest()
