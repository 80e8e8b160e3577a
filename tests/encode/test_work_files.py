"""Work files: on several threads, and without what Windows lacks."""

import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import gltf_ext
from gltf_ext import work_files
from gltf_ext.work_files import WorkFile
from tests.helpers import environment
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import sheet, use_small_chunks

THREADS, ROWS, ROUNDS = 8, 1000, 20
ROW = np.dtype("<u4")


class Slow:
    """A file after whose seek other threads run."""

    def __init__(self, file):
        self._file = file

    def __getattr__(self, name):
        return getattr(self._file, name)

    def seek(self, place):
        self._file.seek(place)
        time.sleep(1e-4)


@pytest.fixture
def file():
    result = WorkFile()
    result._file = Slow(result._file)
    return result


def test_threads_read_and_write_at_a_time(file):
    """Each at a place of its own."""

    def work(thread):
        for number in range(ROUNDS):
            rows = np.full(ROWS, thread * ROUNDS + number, ROW)
            file.write(rows, thread * rows.nbytes)
            assert (file.rows(ROW, thread * ROWS, ROWS) == rows).all()

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(work, range(THREADS)))
    assert file.size == THREADS * ROWS * ROW.itemsize


def test_threads_append_at_a_time(file):
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(lambda n: file.append(np.full(ROWS, n, ROW)), range(ROUNDS)))
    rows = file.rows(ROW, 0, file.size // ROW.itemsize).reshape(ROUNDS, ROWS)
    assert (rows == rows[:, :1]).all() and sorted(rows[:, 0]) == list(range(ROUNDS))


def test_a_file_that_is_cut():
    file = WorkFile()
    file.append(np.arange(10, dtype=ROW))
    file.truncate(20)
    assert file.size == 20 and file.rows(ROW, 0, 5).tolist() == [0, 1, 2, 3, 4]
    file.append(b"abcd")
    assert bytes(file.mapped())[20:] == b"abcd"
    with pytest.raises(OSError, match="cut off"):
        file.rows(ROW, 0, 7)


@pytest.fixture
def without_posix(monkeypatch):
    """Without the functions and signals that Windows lacks, as far as nothing else needs them."""
    for module, names in (
        (os, "pread preadv pwrite pwritev posix_fallocate posix_fadvise sendfile getuid geteuid"),
        (signal, "SIGHUP SIGBUS SIGKILL SIGUSR1"),
    ):
        for name in names.split():
            monkeypatch.delattr(module, name, raising=False)


def test_nothing_needs_what_windows_lacks(tmp_path, monkeypatch, without_posix):
    environment.need_package("meshoptimizer")
    monkeypatch.setattr(work_files, "MAX_SPOOLED", 10_000)
    monkeypatch.setattr(work_files, "BUCKET_BYTES", 10_000)
    use_small_chunks(monkeypatch)
    positions, normals, triangles = sheet()
    builder = Builder()
    builder.mesh({"POSITION": positions, "NORMAL": normals}, triangles)
    source = builder.write(tmp_path / "in.glb")
    for lod in (False, True):
        output = tmp_path / f"{lod}.glb"
        gltf_ext.compress(source, output, lod=lod, max_memory="1G")
        assert gltf_ext.validate(output) == []
        assert gltf_ext.verify(source, output, max_memory="1G")["ok"]
        gltf_ext.decompress(output, tmp_path / "plain.glb")
