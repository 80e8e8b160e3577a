"""The C++ programs behind the options of CMakeLists.txt, built on demand."""

from __future__ import annotations

import functools
from pathlib import Path

from tests.helpers.environment import missing
from tools import native_build


@functools.cache
def folder_of(option: str) -> Path:
    """Builds the programs of MESHLET_NATIVE_TESTS or MESHLET_FUZZ; returns their folder."""
    try:
        return native_build.build(option)
    except FileNotFoundError as error:
        missing(str(error))


def program_of(option: str, program: str) -> Path:
    """Builds the programs of an option; returns the path of one."""
    return folder_of(option) / program
