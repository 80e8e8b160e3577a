"""Mutated tables and pages: a refusal of one line, or a mesh whose indices are in range."""

import subprocess

import pytest

from spec.make_lod_vectors import FOLDER
from tests.helpers import environment
from tools import fuzz_levels, sanitized

MUTATIONS, FULL_MUTATIONS = 1_000, 100_000
SANITIZED_MUTATIONS = 1_000


def test_mutations_are_refused_or_harmless():
    count = FULL_MUTATIONS if environment.full else MUTATIONS
    accepted = fuzz_levels.run(count)["accepted"]
    assert 0 < accepted < count


@pytest.mark.full  # the sanitized module compiles for minutes
def test_the_native_code_stands_them_too():
    environment.need_program("g++", "Debian: apt install g++")
    command, variables = sanitized.command("tools.fuzz_levels", str(SANITIZED_MUTATIONS))
    done = subprocess.run(
        command, cwd=environment.ROOT, env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_wrong_properties_are_refused():
    text = (FOLDER / "lod_strip.glb").read_bytes()
    for old, new in (
        (b'"pageCount":2', b'"pageCount":0'),
        (b'"pageCount":2', b'"pageCount":9'),
        (b'"groupCount":3', b'"groupCount":4'),
        (b'"runCount":2', b'"runCount":1'),
        (b'"coarsePageCount":1', b'"coarsePageCount":2'),
        (b'"coarsePageCount":1', b'"coarsePageCount":0'),
        (b'"pages":{"bufferView":1}', b'"pages":{"bufferView":7}'),
        (b'"pages":{"bufferView":1}', b'"pages":{"bufferView":2}'),
        (b'"runCount":2', b'"runCount":7'),
    ):
        assert old in text and len(old) == len(new)
        assert not fuzz_levels.use(text.replace(old, new))
