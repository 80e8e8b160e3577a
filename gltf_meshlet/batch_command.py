"""`gltf-meshlet batch`: compresses many models and prints a table of them."""

from __future__ import annotations

import argparse
import json
from typing import Any

import gltf_ext
from gltf_ext.errors import printable
from gltf_meshlet import compress_options, report_text

DONE, FAILED = 0, 2  # exit statuses
MAX_FILES = 20  # files in the table, failed ones apart


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `batch`."""
    command.add_argument(
        "source",
        metavar="SOURCE",
        help="a folder, a glob in quotes, or a .txt with a path or URL in each line; on a disk, or "
        "s3://, https:// and whatever else fsspec reads",
    )
    command.add_argument(
        "destination",
        metavar="DESTINATION",
        help="folder to write, likewise; nothing in it is overwritten that no batch wrote there",
    )
    command.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a running Dask scheduler, tcp://HOST:8786; by default processes of this machine",
    )
    command.add_argument(
        "--workers", type=int, metavar="N", help="number of these processes (default: processors)"
    )
    command.add_argument("--json", action="store_true", help="print JSON instead of the table")
    compress_options.add(command, but=("scheduler",))


def run(options: argparse.Namespace) -> int:
    """Runs or goes on with the batch; returns the exit status: 2 if a file failed or something was
    left out. Raises MeshletError, OSError.
    """
    report = gltf_ext.batch(
        options.source,
        options.destination,
        workers=options.workers,
        progress=True,
        **compress_options.values_of(options),
    )
    print(json.dumps(report, indent=2) if options.json else table(report))
    totals = report["totals"]
    return FAILED if totals["failed"] or totals["left_out"] else DONE


def table(report: dict[str, Any]) -> str:
    """A line for each file that failed or was left out and for the largest others, then the
    totals."""
    totals = report["totals"]
    failures = [file for file in report["files"] if file["status"] == "failed"]
    good = [file for file in report["files"] if file["status"] != "failed"]
    largest = sorted(good, key=lambda file: -file["input_bytes"])[:MAX_FILES]
    lines = [f"{printable(file['name'])}: failed: {file['error']}" for file in failures]
    lines += [f"{printable(i['path'])}: left out: it {i['reason']}" for i in report["left_out"]]
    lines += [_line(file) for file in largest]
    if len(largest) < len(good):
        lines.append(f"the {len(largest)} largest of {len(good):,}; batch.html shows all")
    if report["skipped"]:
        count = report_text.plural(len(report["skipped"]), "model")
        lines.append(f"skipped {count} in the destination that batches wrote there")
    if report["leftover"]:
        count = report_text.plural(len(report["leftover"]), "file")
        lines.append(f"{count} in the destination are of models that this run does not have")
    sizes = (
        f"{report_text.size(totals['input_bytes'])} -> {report_text.size(totals['output_bytes'])}"
    )
    counts = (
        f"{totals['done']:,} done, {totals['unchanged']:,} unchanged, {totals['failed']:,} failed"
    )
    if totals["left_out"]:
        counts += f", {totals['left_out']:,} left out"
    triangles = report_text.plural(totals["triangles"], "triangle")
    return "\n".join([*lines, f"{counts}: {sizes}, {triangles}, {report['seconds']:.1f} s"])


def _line(file: dict[str, Any]) -> str:
    smaller = file["input_bytes"] / file["output_bytes"]
    sizes = (
        f"{report_text.size(file['input_bytes']):>9} -> {report_text.size(file['output_bytes']):>9}"
    )
    error = file["max_error_percent"]
    loss = "" if error is None else f", error {error:.2g} %"
    return f"{sizes} {smaller:6.2f} x{loss}  {printable(file['name'])} ({file['status']})"
