"""Chunks: the k-d tree, tasks on threads, how many chunks memory holds."""

import threading
import time

import numpy as np
import pytest

from gltf_ext.encode.chunks import Cells
from gltf_ext.errors import MeshletError
from gltf_ext.options import Options
from gltf_ext.scheduler import in_order
from gltf_ext.sources.memory import chunk_size, plan_chunk_memory, triangles_that_fit
from gltf_ext.work_files import hashes


@pytest.mark.parametrize("count", [1, 2, 7])
def test_shared_positions_are_those_in_other_cells(count):
    random = np.random.default_rng(0)
    corners = random.integers(0, 60, (3000, 3, 3))
    corners[:, 1:] = np.maximum(corners[:, :1] - random.integers(0, 4, (3000, 2, 3)), 0)
    middles = corners.sum(axis=1) // 3
    cells = Cells.over(middles, count, 1)
    chunk = cells.of(middles)
    assert set(chunk) == set(range(count))
    is_outside = cells.of(corners.reshape(-1, 3)) != np.repeat(chunk, 3)
    expected = np.unique(hashes(corners.reshape(-1, 3)[is_outside]))
    assert np.array_equal(cells.keys_outside(chunk, corners), expected)
    assert bool(len(expected)) == (count > 1)


def test_results_are_in_order_and_tasks_few_at_a_time():
    running, most, lock = 0, 0, threading.Lock()

    def task(number):
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        time.sleep(0.01 * (number % 3))
        with lock:
            running -= 1
        return number

    assert list(in_order(task, ((n,) for n in range(20)), 3)) == list(range(20))
    assert most == 3


def test_few_results_wait_for_a_slow_task():
    taken = []

    def tasks():
        for number in range(100):
            taken.append(number)
            yield (number,)

    def task(number):
        time.sleep(0.2 if number == 0 else 0)

    next(in_order(task, tasks(), 2))
    assert len(taken) <= 5


def test_an_error_of_a_task_ends_the_others():
    taken = []

    def tasks():
        for number in range(1000):
            taken.append(number)
            yield (number,)

    def task(number):
        assert number != 5, "the fifth"
        return number

    with pytest.raises(AssertionError, match="the fifth"):
        list(in_order(task, tasks(), 2))
    assert len(taken) < 10


@pytest.mark.parametrize("lod", [False, True])
def test_more_chunks_than_open_files_are_refused(lod):
    options = Options.of({"max_memory": "110M", "lod": lod})
    most = 512 * triangles_that_fit(options)
    assert plan_chunk_memory(options, most)[0] == 1
    with pytest.raises(MeshletError, match=r"use at least \d+M") as raised:
        plan_chunk_memory(options, 2 * most)
    least = str(raised.value).split()[-1]
    assert plan_chunk_memory(Options.of({"max_memory": least, "lod": lod}), 2 * most)[0] == 1


@pytest.mark.parametrize("memory", ["109M", "500M", "2G", "8G", "64G"])
def test_chunks_fit_memory(memory):
    """Also those of the most triangles that a primitive may have, with an open file each."""
    options = Options.of({"max_memory": memory, "lod": True})
    for triangles in (1_000_000, 1_400_000_000 if options.memory > 4 << 30 else 20_000_000):
        size = chunk_size(options, triangles)
        at_once, bytes_of_one = plan_chunk_memory(options, triangles)
        assert at_once >= 1 and triangles / size <= 520
        assert at_once * (bytes_of_one - (80 << 20)) <= options.memory - (80 << 20)
