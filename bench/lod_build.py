"""Compresses a model, in a process of its own; also runs with earlier commits."""

from __future__ import annotations

import argparse
import os
import resource
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

import gltf_ext
from bench.common import BITS, call_in_process, memory_of_process, progress

EVERY = 0.5  # seconds between looks at the work files


def build(input: str, output: str, options: dict) -> dict:
    """Compresses a model. Returns processor time, wall time, peak memory and the report."""
    started = time.perf_counter()
    report = gltf_ext.compress(input, output, **{**BITS, **options})
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "seconds": time.perf_counter() - started,
        "peak_bytes": memory_of_process("VmHWM"),
        "bytes": report["output_bytes"],
        "triangles": report["totals"]["triangles"],
        "levels": report.get("lod", []),
    }


def watched(source: str, output: str, options: dict) -> dict:
    """As `build`, with the most bytes of work files and of memory of all processes that it starts,
    itself included, and the machine's mean load."""
    looks, ended = [], threading.Event()
    os.setpgid(0, 0)

    def watch() -> None:
        while True:
            looks.append((work_file_bytes(), memory_of_group(), os.getloadavg()[0]))
            if ended.wait(EVERY):
                break

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        built = build(source, output, options)
    finally:
        ended.set()
        watcher.join()
    disk, memory, loads = zip(*looks)
    load = float(np.mean(loads))
    return {**built, "disk_bytes": max(disk), "group_bytes": max(memory), "load": load}


def work_file_bytes() -> int:
    """Bytes on disks of this process's open files that have no names."""
    total = 0
    for entry in os.scandir("/proc/self/fd"):
        with suppress(OSError):
            if os.readlink(entry.path).endswith("(deleted)"):
                total += os.stat(entry.path).st_blocks * 512
    return total


def memory_of_group() -> int:
    """Resident bytes of the processes in this one's group; what they share counts for each."""
    pages = 0
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if os.getpgid(int(folder.name)) == os.getpgrp():
                pages += int((folder / "statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def verified(source: str, output: str, memory: str | None) -> dict:
    """Verifies a compressed file; returns how long that took. Prints problems."""
    start = time.perf_counter()
    report = gltf_ext.verify(source, output, **({"max_memory": memory} if memory else {}))
    seconds = time.perf_counter() - start
    if report["problems"]:
        progress(f"{source}: {'; '.join(report['problems'])}")
    return {"verify_seconds": seconds}


def add_before(parser: argparse.ArgumentParser) -> None:
    """Adds the options of measurements of builders: --jobs and --before."""
    parser.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="models at a time (default: %(default)s)"
    )
    parser.add_argument(
        "--before",
        nargs=2,
        metavar=("COMMIT", "PYTHON"),
        help="also measure the builder of an earlier commit, which this Python has installed",
    )


def require_other_package(question: str, python: str) -> None:
    """Ends the program if a Python, of an earlier commit, has the package of this commit."""
    if call_in_process("bench.lod_build", "package", python=python) == package():
        raise SystemExit(f"bench {question}: {python} has no other gltf_ext than this one")


def package() -> str:
    """The file of the package that builds."""
    return str(gltf_ext.__file__)
