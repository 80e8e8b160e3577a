"""What do many cores give the encoder? The efforts on one thread and on all cores.

Writes a section of docs/efforts.md; otherwise as efforts.py.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from bench import efforts
from bench.common import documents_of, read_result


def add_options(parser: argparse.ArgumentParser) -> None:
    efforts.add_options(parser, (1, os.cpu_count() or 1))


def measure(options: argparse.Namespace) -> dict:
    """All models."""
    return efforts.measure(options)


def summary(result: dict) -> str:
    """The section on more cores."""
    return efforts.cores_section(result)


def write_documents(result: dict) -> list[Path]:
    """docs/efforts.md, if its first part has been measured."""
    first = read_result("efforts")
    return documents_of(efforts, first) if first else []
