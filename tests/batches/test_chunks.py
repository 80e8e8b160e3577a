"""compress --max-memory --scheduler: chunks on Dask workers, the same bytes as on threads."""

import pytest

import gltf_ext
from gltf_ext import MeshletError, scheduler
from tests.helpers import environment
from tests.helpers.cluster import free_port
from tests.helpers.gltf_builder import Builder
from tests.helpers.large import sheet, use_small_chunks

pytest.importorskip("distributed")


@pytest.fixture
def tube(tmp_path, monkeypatch):
    """A model that is read in nine chunks."""
    use_small_chunks(monkeypatch)
    points, normals, triangles = sheet()
    builder = Builder()
    builder.mesh({"POSITION": points, "NORMAL": normals}, triangles)
    return builder.write(tmp_path / "tube.glb")


def compressed(source, **options):
    output = source.with_name("out.glb")
    gltf_ext.compress(source, output, max_memory="1G", **options)
    return output.read_bytes()


def test_threads_and_workers_give_the_same_bytes(tube, cluster, monkeypatch):
    """One thread, two, two workers; and one of these is killed while it has chunks."""
    environment.need_package("meshoptimizer")
    whole = compressed(tube, lod=True, threads=1)
    level_0 = compressed(tube, threads=1)
    assert compressed(tube, lod=True, threads=2) == whole
    address, _, workers = cluster(free_port(), 2)
    assert compressed(tube, lod=True, scheduler=address) == whole
    results = scheduler.Workers._result

    def killing(runner, task):
        result = results(runner, task)
        workers[0].kill()
        return result

    monkeypatch.setattr(scheduler.Workers, "_result", killing)
    assert compressed(tube, lod=True, scheduler=address) == whole
    assert workers[0].wait() and workers[1].poll() is None
    assert compressed(tube, scheduler=address) == level_0


@pytest.mark.parametrize("lost", ["the scheduler", "all workers"])
def test_what_is_lost_is_one_line(tube, cluster, monkeypatch, lost):
    address, scheduler_process, (worker,) = cluster(free_port(), 1)
    if lost == "all workers":
        monkeypatch.setattr(scheduler, "NO_WORKERS", 1)
    results = scheduler.Workers._result

    def killing(runner, task):
        result = results(runner, task)
        (scheduler_process if lost == "the scheduler" else worker).kill()
        return result

    monkeypatch.setattr(scheduler.Workers, "_result", killing)
    with pytest.raises(MeshletError, match=r"^[^\n]*$") as caught:
        compressed(tube, scheduler=address)
    expected = {"the scheduler": "the scheduler is gone", "all workers": "has had no workers for 1"}
    assert expected[lost] in str(caught.value)
    assert list(tube.parent.iterdir()) == [tube]


def test_refused_in_one_line(tube, monkeypatch):
    monkeypatch.setattr(scheduler, "CONNECT", 0.5)
    with pytest.raises(MeshletError, match="no scheduler answers"):
        compressed(tube, scheduler="tcp://127.0.0.1:9")
    with pytest.raises(MeshletError, match="use max_memory too"):
        gltf_ext.compress(tube, tube.with_name("out.glb"), scheduler="tcp://127.0.0.1:9")
