"""What do many cores give the encoder? The efforts on one thread and on all cores.

Writes a section of docs/efforts.md; otherwise as efforts.py.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from bench import efforts
from bench.common import Question, read_result


def add_options(parser: argparse.ArgumentParser) -> None:
    efforts.add_options(parser, (1, os.cpu_count() or 1))


def write_pages(result: dict) -> list[Path]:
    """docs/efforts.md, if its first part has been measured."""
    first = read_result("efforts")
    return efforts.write_pages(first) if first else []


QUESTION = Question(
    "efforts_cores",
    __doc__,
    efforts.measure,
    efforts.cores_section,
    write_pages,
    add_options=add_options,
)


def main() -> None:
    QUESTION.run()


if __name__ == "__main__":
    main()
