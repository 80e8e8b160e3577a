"""The C++ programs: tests/codec/native, and a short run of the fuzz target under sanitizers."""

import subprocess

import pytest

from tests.helpers.environment import ROOT
from tools import native_build

PROGRAMS = sorted(path.stem for path in (ROOT / "tests" / "codec" / "native").glob("*_test.cpp"))
FEW_MUTATIONS, ALL_MUTATIONS = "10000", "100000"


def run(option: str, program: str, *arguments: str) -> None:
    try:
        folder = native_build.build(option)
    except FileNotFoundError as error:
        pytest.skip(str(error))
    result = subprocess.run(
        [folder / program, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=600
    )
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("program", PROGRAMS)
def test_native(program):
    run("MESHLET_NATIVE_TESTS", program)


def test_decoder_survives_damaged_blobs(request):
    run(
        "MESHLET_FUZZ",
        "fuzz_decoder",
        "spec/vectors",
        ALL_MUTATIONS if request.config.getoption("--full") else FEW_MUTATIONS,
    )
