"""One file of a batch, in a worker: read, compressed, verified, written, recorded."""

from __future__ import annotations

import base64
import errno
import hashlib
import importlib.metadata
import json
import os
import posixpath
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gltf_ext.batches.storage import STATE, UNSURE, Folder, fallback_name, folder_of
from gltf_ext.batches.thumbnail import thumbnail
from gltf_ext.checks.verify import verify
from gltf_ext.commands.compress import compress
from gltf_ext.errors import MeshletError
from gltf_ext.files import refuse_overwriting
from gltf_ext.portable import is_relative
from gltf_ext.sources.importers import referenced_files

Record = dict[str, Any]
VERSION = importlib.metadata.version("gltf-meshlet")
DONE, UNCHANGED, FAILED = "done", "unchanged", "failed"
# What a record has, besides what Job.is_current compares.
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
    """

    source: str
    name: str
    destination: str
    output: str
    options: dict[str, Any]
    version: str

    @property
    def record_name(self) -> str:
        """Name of the job's record in the destination."""
        name = f"{STATE}/{self.output}.json"
        if len(os.fsencode(posixpath.basename(name))) <= LONGEST_RECORD:
            return name
        return f"{STATE}/{hashlib.sha256(os.fsencode(self.output)).hexdigest()}.json"

    @property
    def outputs(self) -> list[str]:
        """Names of all files that it may write, but its record."""
        return [self.output] + [fallback_name(self.output)] * bool(self.options.get("fallback"))

    def is_current(self, record: Any) -> bool:
        """Return whether a record is of a file with this name, options and version."""
        expected_values = {
            "name": self.name,
            "output": self.output,
            "options": self.options,
            "version": self.version,
        }
        return (
            isinstance(record, dict)
            and all(record.get(key) == value for key, value in expected_values.items())
            and all(
                key in record and isinstance(record[key], kind) for key, kind in RECORDED.items()
            )
            and all(isinstance(output, dict) for output in record["outputs"].values())
        )

    def is_unchanged(
        self,
        record: Record,
        stamp: Callable[[str], str | None],
        output_stamp: Callable[[str], str | None],
    ) -> bool:
        """Return whether the stamps of all files that were read or written are as in a record.

        Args:
            record: of this job.
            stamp: returns the stamp of a file that was read, by its path from the model's folder.
            output_stamp: returns the stamp of an output.
        """
        outputs = {name: output.get("stamp") for name, output in record["outputs"].items()}
        return all(
            value == stamp_of(name) and not str(value).endswith(UNSURE)
            for stamps, stamp_of in ((record["inputs"], stamp), (outputs, output_stamp))
            for name, value in stamps.items()
        )

    def failure(self, error: str, seconds: float = 0.0) -> Record:
        """Return the record of this job for an error."""
        return {
            "name": self.name,
            "output": self.output,
            "status": FAILED,
            "error": MeshletError(error).message,
            "seconds": seconds,
        }


def run(job: Job, scratch: str | None = None) -> Record:
    """Do a job unless its record says that it is done.

    scratch: a folder for temporary files. A file that cannot be compressed gives a record with the
    status "failed"; what may pass, such as an OSError of a network, is raised.
    """
    start = time.perf_counter()
    try:
        if job.version != VERSION:
            raise MeshletError(f"the worker has gltf-meshlet {VERSION}", "update it")
        with _temporary_folder(scratch) as folder:
            return _run(job, Path(folder), start)
    except MeshletError as error:
        return job.failure(error.message, time.perf_counter() - start)
    except MemoryError:
        return job.failure("there is not enough memory; split the model")


def _temporary_folder(scratch: str | None) -> tempfile.TemporaryDirectory[str]:
    """Return a folder for temporary files that is deleted at the end.

    Windows deletes no file that is mapped into memory or that a virus scanner reads: such a file is
    deleted with the worker's folder, and does not fail the model.
    """
    return tempfile.TemporaryDirectory(
        dir=scratch, prefix="gltf-meshlet-", ignore_cleanup_errors=True
    )


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
    report, verification = _compress_and_verify(job, inputs, output, folder)
    picture = _picture(output)  # before anything is written: it may kill the worker
    outputs = _write_outputs(destination, job, inputs, folder, old_digests)
    record = {
        "name": job.name,
        "source": job.source,
        "output": job.output,
        "status": DONE,
        "options": job.options,
        "version": job.version,
        "input_digest": inputs.digest,
        "inputs": inputs.stamps,
        "output_digest": outputs[job.output]["digest"],
        "outputs": outputs,
        "former": {name: old_digests[name] for name in old_digests if name not in outputs},
        "input_bytes": sum(path.stat().st_size for path in inputs.paths),
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
    destination: Folder, job: Job, inputs: _Inputs, old_record: Record | None
) -> Record | None:
    """Return the record of a job whose outputs are made from the same bytes; None without one."""
    if old_record and job.is_current(old_record) and old_record["input_digest"] == inputs.digest:
        outputs = _current_outputs(destination, old_record)
        if outputs is not None:
            updates = {"source": job.source, "inputs": inputs.stamps, "outputs": outputs}
            record = {**old_record, **updates}
            destination.write(job.record_name, json.dumps(record).encode())
            return {**record, "status": UNCHANGED}
    return None


def _compress_and_verify(
    job: Job, inputs: _Inputs, output: Path, folder: Path
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Write and verifies the output on this machine; the reports. Raises MeshletError, OSError."""
    report = compress(inputs.model, output, **{"threads": 1, **job.options})
    if report["output"] != str(output):
        raise MeshletError("the result does not fit a .glb", "compress it by itself")
    names = ("max_memory", "work_dir", "obj_groups")
    of_verify = {"work_dir": str(folder), **job.options}
    of_verify = {name: of_verify[name] for name in names if name in of_verify}
    verification = verify(inputs.model, output, **of_verify)
    if inputs.current_stamps() != inputs.stamps:
        raise MeshletError("changed while it was read", "run again")
    if verification["problems"]:  # losses that show are warned of by compress
        raise MeshletError("; ".join(["is not the same after decoding", *verification["problems"]]))
    return report, verification


def _write_outputs(
    destination: Folder, job: Job, inputs: _Inputs, folder: Path, old_digests: dict[str, Any]
) -> dict[str, Any]:
    """Write the outputs to the destination. Returns name -> stamp and digest of each.

    old_digests: digests of outputs that earlier runs wrote.
    """
    if destination.is_local:
        refuse_overwriting(inputs.paths, map(destination.at, job.outputs))
    files = {name: folder / posixpath.basename(name) for name in reversed(job.outputs)}
    files = {name: path for name, path in files.items() if path.exists()}  # the model is the last
    digests = {name: _digest([path]) for name, path in files.items()}
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


def _picture(output: Path) -> bytes:
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
        if name in old_digests and destination.stamp(name) is not None:
            with destination.fs.open(destination.at(name), "rb") as file:
                if _digest_of(file) not in old_digests[name]:
                    problem = f"its output {name} is not as a batch wrote it"
                    raise MeshletError(problem, "move it, or delete it to have it made again")


def _current_outputs(destination: Folder, record: Record) -> dict[str, Any] | None:
    """Return the outputs of a record with their stamps of now, if all still hold the same bytes."""
    current_outputs = {}
    for name, output in record["outputs"].items():
        stamp = destination.stamp(name)
        if stamp is None:
            return None
        if stamp != output.get("stamp") or stamp.endswith(UNSURE):
            with destination.fs.open(destination.at(name), "rb") as file:
                if _digest_of(file) != output.get("digest"):
                    return None
        current_outputs[name] = {**output, "stamp": stamp}
    return current_outputs


class _Inputs:
    """The model of a job and the files that it names, as files of this machine.

    They are copied unless they lie on a disk of it.

    Attributes:
        model: path of the model; paths: of it and of all other files that exist.
        stamps: path from the model's folder -> stamp, None for a file that does not exist.
        digest: SHA-256 of the lengths and bytes of all files.
    """

    def __init__(self, job: Job, folder: Path) -> None:
        self._source, self._name = folder_of(job.source)
        self._names = {self._name: None}
        self.stamps = self.current_stamps()
        if self.stamps[self._name] is None:
            raise MeshletError("is not there, or no file", "check the path")
        self.model = Path(self._source.at(self._name))
        if self._source.is_local:
            self.paths = [self.model, *self._local()]
        else:
            copies = folder / "input"
            copies.mkdir()
            self.model = copies / self._name
            self._source.fs.get_file(self._source.at(self._name), str(self.model))
            self.paths = [self.model, *self._copy_references(copies)]
        self.digest = _digest(self.paths)

    def current_stamps(self) -> dict[str, str | None]:
        """Return the stamps of this moment."""
        return {name: self._source.stamp(name) for name in self._names}

    def _local(self) -> list[Path]:
        files = dict.fromkeys(referenced_files(self.model))
        self._add({_relative(path, self.model.parent): path for path in files})
        return list(filter(os.path.isfile, files))

    def _add(self, names: Iterable[str]) -> None:
        """Note files, and their stamps before they are read."""
        for name in names:
            if name not in self._names:
                self._names[name] = None
                self.stamps[name] = self._source.stamp(name)

    def _copy_references(self, copies: Path) -> list[Path]:
        files: list[Path] = []
        for _ in range(2):  # an .obj names libraries, and these name images
            for path in referenced_files(self.model):
                name = posixpath.normpath(_relative(path, copies))
                if name in self._names:
                    continue
                if _leaves(name):  # there, it would be a file of this machine
                    problem = f"names a file outside its folder ({name})"
                    raise MeshletError(problem, "put the file into the folder")
                self._add([name])
                if self._copy(name, copies / name):
                    files.append(copies / name)
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


def _digest(paths: list[Path]) -> str:
    """SHA-256 of one file; of several, of their lengths and bytes."""
    if len(paths) == 1:
        with open(paths[0], "rb") as file:
            return _digest_of(file)
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.stat().st_size.to_bytes(8, "little"))
        with open(path, "rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def _digest_of(file: Any) -> str:
    digest = hashlib.sha256()
    while block := file.read(1 << 20):
        digest.update(block)
    return digest.hexdigest()
