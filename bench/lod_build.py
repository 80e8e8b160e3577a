"""Compresses a model, in a process of its own. For bench.lod; also runs with earlier commits."""

from __future__ import annotations

import resource
import time

import gltf_ext
from bench.common import memory_of_process


def build(input: str, output: str, options: dict) -> dict:
    """Compresses a model. Returns processor time, wall time, peak memory and the report."""
    started = time.perf_counter()
    report = gltf_ext.compress(input, output, **options)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "seconds": time.perf_counter() - started,
        "peak_bytes": memory_of_process("VmHWM"),
        "bytes": report["output_bytes"],
        "triangles": report["totals"]["triangles"],
        "levels": report.get("lod", []),
    }


def package() -> str:
    """The file of the package that builds."""
    return str(gltf_ext.__file__)
