"""The report of a batch: what it says, and its files in the destination."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

from gltf_ext.batches import task
from gltf_ext.batches.page import page_count, page_name, pages
from gltf_ext.batches.planning import PAGE, REPORT, Plan
from gltf_ext.batches.storage import Folder
from gltf_ext.batches.task import DONE, FAILED, UNCHANGED

Report = dict[str, Any]


def head(source: str, destination: str, options: dict[str, Any], time_limit: float) -> Report:
    """Return what a report says before anything is looked at."""
    return {
        "source": source,
        "destination": destination,
        "version": task.VERSION,
        "options": options,
        "time_limit": time_limit,
    }


def of_check(report: Report, plan: Plan) -> Report:
    """Return the report of a batch that only says what it would do."""
    todo = [
        {"name": job.name, "reason": plan.reasons[job.name]}
        | ({"limit": plan.limited[job.name]["error"]} if job.name in plan.limited else {})
        for job in plan.open_jobs()
    ]
    refused = [r for r in plan.records.values() if r["status"] == FAILED]
    unchanged = len(plan.records) - len(refused)
    totals = {"todo": len(todo), UNCHANGED: unchanged, FAILED: len(refused)}
    totals["left_out"] = len(plan.remarks["left_out"])
    files = [{"name": r["name"], "error": r["error"]} for r in refused]
    return {**report, "totals": totals, "todo": todo, "files": files, **plan.remarks}


def of_run(
    report: Report, plan: Plan, stopped: str, start: float, default_reason: str = ""
) -> Report:
    """Return the report of a run.

    Args:
        report: its head.
        plan: with the records of all jobs that have ended.
        stopped: what ended the run before all jobs had ended; empty if nothing did.
        start: of the run, on time.perf_counter's clock.
        default_reason: why jobs have no record, if nothing stopped the run.
    """
    files = [
        plan.records.get(job.name) or job.failure(f"not done: {stopped or default_reason}")
        for job in plan.jobs
    ]
    good = [file for file in files if file["status"] != FAILED]
    totals = {
        **{s: sum(file["status"] == s for file in files) for s in (FAILED, DONE, UNCHANGED)},
        **{
            key: sum(file[key] for file in good)
            for key in ("input_bytes", "output_bytes", "triangles")
        },
        "left_out": len(plan.remarks["left_out"]),
    }
    return {
        **report,
        "stopped": stopped or default_reason,
        "totals": totals,
        "files": sorted(files, key=lambda file: (file["status"] != FAILED, file["name"])),
        **plan.remarks,
        "removed": [],
        "seconds": time.perf_counter() - start,
    }


def write(folder: Folder, report: Report) -> None:
    """Write a report into the destination. Raises OSError."""
    folder.write(REPORT, _pieces(report))
    for name, text in pages(report, PAGE):
        folder.write(name, text.encode())
    number = page_count(report)
    while folder.exists(name := page_name(PAGE, number)):  # of a larger batch before
        folder.fs.rm_file(folder.at(name))
        number += 1


def _pieces(report: Report) -> Iterator[bytes]:
    """Yield its JSON, file by file: as one string it would take as much memory as all else."""
    others = json.dumps({name: value for name, value in report.items() if name != "files"})
    separator = f'{others[:-1]}, "files": ['
    for file in report["files"]:
        yield f"{separator}{json.dumps(file)}".encode()
        separator = ", "
    yield b"]}"
