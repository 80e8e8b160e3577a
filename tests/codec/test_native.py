"""The C++ tests in native/, and a short run of the fuzz target under sanitizers."""

import subprocess

import pytest

from tests.helpers import environment
from tests.helpers.environment import ROOT
from tests.helpers.native import program_of

PROGRAMS = sorted(path.stem for path in (ROOT / "tests" / "codec" / "native").glob("*_test.cpp"))
FEW_MUTATIONS, ALL_MUTATIONS = "10000", "100000"


def run(option: str, program: str, *arguments: str) -> None:
    command = [program_of(option, program), *arguments]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("program", PROGRAMS)
def test_native(program):
    run("MESHLET_NATIVE_TESTS", program)


def test_decoder_survives_damaged_blobs():
    mutations = ALL_MUTATIONS if environment.full else FEW_MUTATIONS
    run("MESHLET_FUZZ", "fuzz_decoder", "spec/vectors", mutations)


def test_unpacker_survives_damaged_views():
    mutations = ALL_MUTATIONS if environment.full else "3000"
    run("MESHLET_FUZZ", "fuzz_transport", "spec/transport_vectors", mutations)
