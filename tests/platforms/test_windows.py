"""Large models, paths, files in use and `view` on Windows, by Wine: tests/helpers/on_windows.py."""

import shutil
import sys

import pytest

from tests.helpers import on_windows
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import sheet
from tests.helpers.platforms import fill, run
from tools.other_pythons import PYTHONS

pytestmark = pytest.mark.platforms
# Python 3.12 asks Windows for its version by a function that Wine 8 lacks, and Dask asks Python.
PYTHON = PYTHONS["Windows 3.11"]
# Dask waits for a tick of Windows's clock, 16 ms. Wine's is finer, so that it waits for ever.
COARSE_CLOCK, FINE_CLOCK = "if WINDOWS and sys.version_info < (3, 13):", "if False:"
LARGE, SMALL = 870, 40  # quads along a side: 1.5 M triangles, whose indices take over 16 MiB
SECONDS = 3600


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """A Python for Windows with our wheel and Dask."""
    site = fill(PYTHON, tmp_path_factory.mktemp("pip"))
    metrics = site / "distributed" / "metrics.py"
    metrics.write_text(metrics.read_text().replace(COARSE_CLOCK, FINE_CLOCK))
    assert metrics.read_text().count(FINE_CLOCK) == 1
    return PYTHON.command


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """A folder with the models of all scenarios."""
    folder = tmp_path_factory.mktemp("models")
    for name, size in (("in.glb", LARGE), ("small.glb", SMALL)):
        positions, normals, triangles = sheet(size)
        builder = Builder()
        builder.mesh({"POSITION": positions, "NORMAL": normals}, triangles)
        builder.write(folder / name)
    return folder


@pytest.fixture
def play(python, models, tmp_path):
    """A function that runs a scenario; returns its folder."""

    def play(scenario):
        for path in models.glob("*.glb"):
            shutil.copy(path, tmp_path)
        run([*python, ROOT / "tests" / "helpers" / "on_windows.py", scenario], tmp_path, SECONDS)
        return tmp_path

    return play


@pytest.fixture(scope="module")
def reference(models, tmp_path_factory):
    """What the commands of the scenario `large` write here."""
    folder = tmp_path_factory.mktemp("reference")
    for path in models.glob("*.glb"):
        shutil.copy(path, folder)
    for arguments in on_windows.LARGE:
        run([sys.executable, "-m", "gltf_meshlet", *arguments], folder)
    return folder


def test_a_large_model_gives_the_same_bytes(play, reference):
    folder = play("large")
    names = {path.name for path in reference.glob("*.glb")}
    assert len(names) == 8 and names == {path.name for path in folder.glob("*.glb")}
    assert [n for n in names if (folder / n).read_bytes() != (reference / n).read_bytes()] == []


def test_batch(play, reference):
    folder = play("batch")
    assert (folder / "batched.glb").read_bytes() == (reference / "out.glb").read_bytes()


@pytest.mark.parametrize(
    "scenario", ["paths", "uris", "closed_pipe", "in_use", "batch_in_use", "view"]
)
def test_scenario(play, scenario):
    play(scenario)
