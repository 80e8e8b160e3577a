"""What a batch has to do, and what it must not: decided before any work."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import uuid
from collections.abc import Mapping, Sequence
from typing import Any

from gltf_ext.batches import task
from gltf_ext.batches.finding import Model, find_models, is_safe, output_names
from gltf_ext.batches.storage import STATE, Folder, Outputs, folder_of
from gltf_ext.batches.task import UNCHANGED, Job, Record
from gltf_ext.errors import MeshletError
from gltf_ext.files import identity

REPORT, PAGE = "batch.json", "batch.html"
NOT_OURS = "exists, and no batch wrote it; move it, or name another destination"


class Plan:
    """What a run has to do.

    Attributes:
        models: by name; jobs: one for each.
        records: by name, of jobs that need no work: unchanged ones, and those that cannot be done.
        limited: by name, records of jobs that killed their workers or took too long before.
        reasons: by name, why a job has to be done.
        outputs: what batches wrote into the destination before.
        allowed_outputs: names of all files that this run may write.
        remarks: of the report, on what has no job.
    """

    remarks: dict[str, Any]

    def __init__(
        self,
        source: str | Sequence[str],
        goal: Folder,
        options: dict[str, Any],
        root: str | None = None,
    ) -> None:
        """Raise MeshletError, OSError. Writes nothing."""
        self.outputs = Outputs(goal)
        search = find_models(source, goal, self.outputs, root)
        self._goal = goal
        self.models = {model.name: model for model in search.models}
        if not goal.exists(STATE):
            for name in (REPORT, PAGE):
                if goal.exists(name):
                    raise MeshletError(NOT_OURS, path=goal.at(name))
        self._key = str.lower if goal.ignores_case() else str
        run = uuid.uuid4().hex
        names = output_names(list(self.models), self._key is str.lower)
        self.jobs = [
            Job(self.models[name].url, name, goal.url, output, options, task.VERSION, run)
            for name, output in names.items()
        ]
        self.records = self._refused_records()
        possible_jobs = [job for job in self.jobs if job.name not in self.records]
        self.allowed_outputs = {name for job in possible_jobs for name in job.outputs}
        self.limited: dict[str, Record] = {}
        self.reasons: dict[str, str] = {}
        self.records |= self._unchanged_records(possible_jobs)
        self.remarks = {
            "left_out": [{"path": p, "reason": r} for p, r in sorted(search.left_out.items())],
            "skipped": sorted(search.skipped),
            "leftover": sorted(self.outputs.names - {n for job in self.jobs for n in job.outputs}),
        }

    def begin(self) -> None:
        """Write into the destination what the run may write. Raises OSError."""
        if self._goal.is_local:
            os.makedirs(self._goal.at(STATE), exist_ok=True)
        self._goal.remove_partials()
        self.outputs.save(self.allowed_outputs)  # before any is written: the process may be killed

    def open_jobs(self) -> list[Job]:
        """Return the jobs without a record."""
        return [job for job in self.jobs if job.name not in self.records]

    def _refused_records(self) -> dict[str, Record]:
        """Return the records of the jobs that cannot be done."""
        models = {self._file_key(model.url): model for model in self.models.values()}
        output_keys = {self._key(name) for name in self.outputs.names}
        problems = ((job, self._problem(job, models, output_keys)) for job in self.jobs)
        return {job.name: job.failure(problem) for job, problem in problems if problem}

    def _file_key(self, url: str) -> Any:
        """Equal for two paths of a file, as far as the storage tells."""
        return (identity(url) if "://" not in url else None) or url

    def _problem(self, job: Job, models: Mapping[Any, Model], output_keys: set[str]) -> str:
        """Return why a job must not be done; empty if it can be.

        models: by their places; output_keys: keys of outputs of former batches.
        """
        if self.models[job.name].problem:
            return self.models[job.name].problem
        if not is_safe(job.name):
            return "its name leads out of the destination, or into its records; rename it"
        for name in job.outputs:
            path = self._goal.at(name)
            url = path if self._goal.is_local else self._goal.fs.unstrip_protocol(path)
            if (model := models.get(self._file_key(url))) is not None:
                return f"its output {name} is the model {model.name}; name another destination"
            if self._goal.is_local and os.path.isdir(path):
                return f"its output {name} is a folder; move it, or name another destination"
            if self._key(name) not in output_keys and self.outputs.exists(name):
                return f"its output {name} {NOT_OURS}"
        return ""

    def _unchanged_records(self, jobs: list[Job]) -> dict[str, Record]:
        """Return the records of the jobs whose inputs and outputs have not changed."""
        goal = self._goal
        names = (name for job in jobs for name in (job.record_name, job.limit_name))
        texts = goal.read_all([name for name in names if self.outputs.exists(name)])
        folders: dict[str, Folder] = {}
        records = {}
        for job in jobs:
            # A damaged record, or what a storage raises: then its worker has a look, and only this
            # model fails.
            with contextlib.suppress(Exception):
                text = texts.get(job.record_name)
                self.reasons[job.name] = "has no complete record" if text else "is new"
                record: Record = json.loads(text or "null")
                reason = job.difference(record)
                if not reason:
                    folder_url, _, model = job.source.rpartition("/")
                    if folder_url not in folders:
                        folders[folder_url] = folder_of(job.source)[0]
                    known_stamps = {model: self.models[job.name].stamp}
                    stamp = _Stamps(folders[folder_url], known_stamps)
                    # Of other stamps, the worker compares the bytes.
                    reason = job.changed_file(record, stamp, self.outputs.stamp)
                if not reason:  # of ten thousand records, keys alone take 12 MB
                    records[job.name] = {sys.intern(key): v for key, v in record.items()}
                    records[job.name]["status"] = UNCHANGED
                self.reasons[job.name] = reason
                if reason and (text := texts.get(job.limit_name)):
                    record = json.loads(text)
                    if task.reached_limit(job, record, self.models[job.name].stamp):
                        self.limited[job.name] = record
        return records


class _Stamps:
    """Stamps of files in a folder, some of which are known."""

    def __init__(self, folder: Folder, known_stamps: Mapping[str, str | None]) -> None:
        self._folder, self._known_stamps = folder, known_stamps

    def __call__(self, name: str) -> str | None:
        return self._known_stamps[name] if name in self._known_stamps else self._folder.stamp(name)
