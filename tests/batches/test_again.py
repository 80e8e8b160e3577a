"""Batches that run again: after errors, from other sources, over files that users put there."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import gltf_ext
from tests.helpers.batch_reports import statuses
from tests.helpers.gltf_builder import write_grid

pytest.importorskip("distributed")
fsspec = pytest.importorskip("fsspec")
TRIANGLE = "v 0 0 {}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NOT_ITS = "is not as a batch wrote it"


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "source"
    folder.mkdir()
    write_grid(folder / "a.glb")
    return folder


@pytest.fixture
def memory():
    """A storage that is no disk, empty."""
    storage = fsspec.filesystem("memory")
    storage.store.clear()
    yield storage
    storage.store.clear()


def triangle(path, z=0):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(TRIANGLE.format(z))
    return path


# --- options ---


@pytest.mark.parametrize(
    "given, plain",
    [
        ({"work_dir": Path("/tmp")}, {"work_dir": "/tmp"}),
        ({"position_bits": np.int64(11)}, {"position_bits": 11}),
        ({"lambda_": np.float32(1.5), "step": np.float64(0.01)}, {"lambda_": 1.5, "step": 0.01}),
        ({"effort": np.str_("fast"), "step": None}, {"effort": "fast", "step": None}),
    ],
)
def test_options_of_other_types(source, tmp_path, compress_all, given, plain):
    report = compress_all(source, tmp_path / "out", **given)
    assert statuses(report) == {"a.glb": "done"} and report["options"] == plain
    assert json.loads((tmp_path / "out" / "batch.json").read_text()) == report
    for options in (given, plain):
        report = compress_all(source, tmp_path / "out", **options)
        assert statuses(report) == {"a.glb": "unchanged"}


def test_a_pool_of_threads_is_no_cluster(source, tmp_path):
    with ThreadPoolExecutor() as pool, pytest.raises(gltf_ext.MeshletError, match="use an address"):
        gltf_ext.batch(source, tmp_path / "out", scheduler=pool)
