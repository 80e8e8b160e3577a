"""`gltf-meshlet batch`: compresses many models and prints a table of them."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

import gltf_ext
from gltf_ext.errors import MeshletError, printable
from gltf_meshlet import compress_options, report_text

DONE, FAILED = 0, 2  # exit statuses
MAX_FILES = 20  # files in the table, failed ones apart; and when it asks what to remove


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
    command.add_argument(
        "--root",
        metavar="FOLDER",
        help="for a .txt: names of outputs start below this folder, else they are whole paths",
    )
    command.add_argument(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        help="of a file, after which it fails (default 3600, an hour)",
    )
    command.add_argument(
        "--check",
        action="store_true",
        help="write nothing: say which files would be done, and why",
    )
    command.add_argument(
        "--prune",
        action="store_true",
        help="remove outputs whose models are gone, after asking",
    )
    command.add_argument(
        "--yes", action="store_true", help="with --prune: remove them without asking"
    )
    command.add_argument(
        "--progress",
        choices=["json"],
        help="print a line of JSON for each event instead of the table; by default there is a bar "
        "on a terminal, and elsewhere a line every ten seconds, on standard error",
    )
    command.add_argument("--json", action="store_true", help="print JSON instead of the table")
    compress_options.add(command, but=("scheduler",))


def run(options: argparse.Namespace) -> int:
    """Runs or goes on with the batch; returns the exit status: 2 if a file failed or something was
    left out. Raises MeshletError, OSError.
    """
    if options.json and options.progress:
        raise MeshletError("json and progress both print JSON", "give one", options=("json",))
    limits = {} if options.time_limit is None else {"time_limit": options.time_limit}
    report = gltf_ext.batch(
        options.source,
        options.destination,
        root=options.root,
        workers=options.workers,
        check=options.check,
        prune=(options.yes or _ask) if options.prune else False,
        progress=_print_event if options.progress else True,
        **limits,
        **compress_options.values_of(options),
    )
    if options.json or (options.progress and options.check):
        print(json.dumps(report, indent=2))
    elif not options.progress:
        print(check_table(report) if options.check else table(report))
    totals = report["totals"]
    return FAILED if totals["failed"] or totals["left_out"] else DONE


def _print_event(event: dict[str, Any]) -> None:
    print(json.dumps(event), flush=True)


def _ask(names: list[str]) -> bool:
    """Whether to remove outputs."""
    count = report_text.plural(len(names), "output")
    if sys.stdin is None or not sys.stdin.isatty():
        print(f"{count} of models that are gone: --yes removes them", file=sys.stderr)
        return False
    for name in names[:MAX_FILES]:
        print(f"its model is gone: {printable(name)}", file=sys.stderr)
    print(f"Remove {count}? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def check_table(report: dict[str, Any]) -> str:
    """A line for each file that would be done, with the reason, then the totals."""
    lines = [f"{printable(file['name'])}: fails: {file['error']}" for file in report["files"]]
    lines += _left_out(report)
    for file in report["todo"]:
        limit = f"; {printable(file['limit'])}" if "limit" in file else ""
        lines.append(f"{printable(file['name'])}: {printable(file['reason'])}{limit}")
    lines += [f"{printable(name)}: its model is gone" for name in report["gone"]]
    totals = report["totals"]
    counts = f"{totals['todo']:,} to do, {totals['unchanged']:,} unchanged"
    counts += f", {totals['failed']:,} fail" if totals["failed"] else ""
    counts += f", {totals['left_out']:,} left out" if totals["left_out"] else ""
    return "\n".join([*lines, counts])


def _left_out(report: dict[str, Any]) -> list[str]:
    return [f"{printable(i['path'])}: left out: it {i['reason']}" for i in report["left_out"]]


def table(report: dict[str, Any]) -> str:
    """A line for each file that failed or was left out and for the largest others, then the
    totals."""
    totals = report["totals"]
    failures = [file for file in report["files"] if file["status"] == "failed"]
    good = [file for file in report["files"] if file["status"] != "failed"]
    largest = sorted(good, key=lambda file: -file["input_bytes"])[:MAX_FILES]
    lines = [f"{printable(file['name'])}: failed: {file['error']}" for file in failures]
    lines += _left_out(report)
    lines += [_line(file) for file in largest]
    if len(largest) < len(good):
        lines.append(f"the {len(largest)} largest of {len(good):,}; batch.html shows all")
    if report["skipped"]:
        count = report_text.plural(len(report["skipped"]), "model")
        lines.append(f"skipped {count} in the destination that batches wrote there")
    if report["removed"]:
        count = report_text.plural(len(report["removed"]), "output")
        lines.append(f"removed {count} of models that are gone")
    remaining = [name for name in report["leftover"] if name not in set(report["removed"])]
    if remaining:
        count = report_text.plural(len(remaining), "file")
        orphans = len(set(report["gone"]) - set(report["removed"]))
        advice = f"; {orphans:,} of models that are gone, which --prune removes" if orphans else ""
        lines.append(f"in the destination, of models that this run does not have: {count}{advice}")
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
