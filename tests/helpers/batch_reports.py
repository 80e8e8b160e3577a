"""What tests of batches ask of a report, and of folders."""

import os
import tempfile
from pathlib import Path

from gltf_ext.batches import task


def statuses(report):
    return {file["name"]: file["status"] for file in report["files"]}


def errors(report):
    return {file["name"]: file["error"] for file in report["files"] if "error" in file}


def left_out(report):
    return {os.path.basename(item["path"]): item["reason"] for item in report["left_out"]}


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run_job(job):
    """The record of a job, as a worker does it."""
    with tempfile.TemporaryDirectory() as folder:
        return task.run(job, Path(folder))
