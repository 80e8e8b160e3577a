"""One file of a batch, in a worker: read, compressed, verified, written, recorded."""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata
import json
import os
import posixpath
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gltf_ext.batches.storage import STATE, Folder
from gltf_ext.batches.thumbnail import thumbnail
from gltf_ext.checks.verify import verify
from gltf_ext.commands.compress import compress
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.importers import referenced_files

Record = dict[str, Any]
VERSION = importlib.metadata.version("gltf-meshlet")
DONE, UNCHANGED, FAILED = "done", "unchanged", "failed"


@dataclass(frozen=True)
class Job:
    """source, destination: URLs of folders; name, output: in them; options: of compress."""

    source: str
    name: str
    destination: str
    output: str
    options: dict[str, Any]
    version: str

    @property
    def record_name(self) -> str:
        return f"{STATE}/{self.output}.json"

    def is_current(self, record: Record | None) -> bool:
        """Whether a record was made from a file of this name with these options and version."""
        return record is not None and all(
            record.get(key) == value
            for key, value in (
                ("name", self.name),
                ("output", self.output),
                ("options", self.options),
                ("version", self.version),
            )
        )

    def failed(self, error: str, seconds: float = 0.0) -> Record:
        return {
            "name": self.name,
            "output": self.output,
            "status": FAILED,
            "error": error,
            "seconds": seconds,
        }


def run(job: Job, scratch: str | None = None) -> Record:
    """Does a job unless its record says that it is done.

    scratch: a folder for temporary files. A file that cannot be compressed gives a record with the
    status "failed"; what may pass, such as an OSError of a network, is raised.
    """
    start = time.perf_counter()
    try:
        if job.version != VERSION:
            raise MeshletError(f"the worker has gltf-meshlet {VERSION}", "update it")
        with tempfile.TemporaryDirectory(dir=scratch, prefix="gltf-meshlet-") as folder:
            return _run(job, Path(folder), start)
    except MeshletError as error:
        return job.failed(error.message, time.perf_counter() - start)
    except MemoryError:
        return job.failed("there is not enough memory; split the model")


def _run(job: Job, folder: Path, start: float) -> Record:
    source, destination = Folder(job.source), Folder(job.destination)
    stamp = source.stamp(job.name)
    model, others = _on_this_machine(source, job.name, folder)
    digest = _digest([model, *others])
    record = read_record(destination, job)
    if (
        record is not None
        and job.is_current(record)
        and record["input_digest"] == digest
        and destination.stamp(job.output) == record["output_stamp"]
    ):
        record["input_stamp"] = stamp
        destination.write(job.record_name, json.dumps(record).encode())
        return {**record, "status": UNCHANGED}
    output = folder / posixpath.basename(job.output)
    report = compress(model, output, **{"threads": 1, **job.options})
    if report["output"] != str(output):
        raise MeshletError("the result does not fit a .glb", "compress it by itself")
    checked = verify(model, output)
    if source.stamp(job.name) != stamp:
        raise MeshletError("changed while it was read", "run again")
    if not checked["ok"]:
        raise MeshletError("; ".join(["is not the same after decoding", *checked["problems"]]))
    for name in report["fallback_files"]:
        fallback = posixpath.join(posixpath.dirname(job.output), name)
        destination.write(fallback, (folder / name).read_bytes())
    destination.write(job.output, output.read_bytes())
    record = {
        "name": job.name,
        "output": job.output,
        "status": DONE,
        "options": job.options,
        "version": job.version,
        "input_digest": digest,
        "input_stamp": stamp,
        "output_digest": _digest([output]),
        "output_stamp": destination.stamp(job.output),
        "input_bytes": sum(path.stat().st_size for path in [model, *others]),
        "output_bytes": report["output_bytes"] + report["fallback_bytes"],
        "triangles": report["totals"]["triangles"],
        "ratio": report["totals"]["ratio"],
        "max_error_percent": checked["max_error_percent"].get("POSITION"),
        "warnings": report["warnings"],
        "seconds": time.perf_counter() - start,
        "thumbnail": base64.b64encode(thumbnail(output)).decode(),
    }
    destination.write(job.record_name, json.dumps(record).encode())
    return record


def read_record(destination: Folder, job: Job) -> Record | None:
    """The record of the output, if there is one that can be read."""
    try:
        record = json.loads(destination.fs.cat_file(destination.at(job.record_name)))
    except (FileNotFoundError, ValueError):
        return None
    return record if isinstance(record, dict) else None


def _on_this_machine(source: Folder, name: str, folder: Path) -> tuple[Path, list[Path]]:
    """The model, and the files it refers to that exist; a copy unless they lie on a disk here."""
    if source.is_local:
        model = Path(source.at(name))
        return model, [path for path in referenced_files(model) if path.is_file()]
    copies = folder / "input"
    copies.mkdir()
    model = copies / posixpath.basename(name)
    source.fs.get_file(source.at(name), str(model))
    others: list[Path] = []
    for _ in range(2):  # an .obj names libraries, and these name images
        for path in referenced_files(model):
            relative = os.path.relpath(path, copies)
            if path in others or relative.startswith("..") or path == model:
                continue  # a file must not have others written outside its folder
            path.parent.mkdir(parents=True, exist_ok=True)
            remote = posixpath.join(posixpath.dirname(source.at(name)), relative)
            try:
                source.fs.get_file(remote, str(path))
            except FileNotFoundError:
                continue
            others.append(path)
    return model, others


def _digest(paths: list[Path]) -> str:
    """SHA-256 of the files' lengths and bytes."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.stat().st_size.to_bytes(8, "little"))
        with open(path, "rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
