"""Files that models in object storage name: of the storage, never of the worker."""

import json

import pytest
from PIL import Image

from gltf_ext.batches import task
from gltf_ext.batches.task import Job
from tests.helpers.batch_reports import run_job
from tests.helpers.gltf_builder import glb_json

fsspec = pytest.importorskip("fsspec")
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n"


def run_remote(tmp_path, files, model):
    """Does the job of a model among files, name -> content, of a storage that is no disk."""
    memory = fsspec.filesystem("memory")
    folder = f"/{tmp_path.name}/models"
    for name, content in files.items():
        memory.pipe_file(f"{folder}/{name}", content)
    url, destination = f"memory:/{folder}/{model}", str(tmp_path / "out")
    return run_job(Job(url, model, destination, "out.glb", {}, task.VERSION))


def naming(kind, name):
    """Files of a model that names another one, and the model's name."""
    model = f"mtllib m.mtl\nusemtl m\n{TRIANGLE}f 1/1 2/1 3/1\n"
    if kind == "library":
        return {"a.obj": model.replace("m.mtl", name).encode()}, "a.obj"
    if kind == "texture":
        return {"a.obj": model.encode(), "m.mtl": f"newmtl m\nmap_Kd {name}\n".encode()}, "a.obj"
    properties = {"asset": {"version": "2.0"}, "images": [{"uri": name}]}
    return {"a.gltf": json.dumps(properties).encode()}, "a.gltf"


@pytest.mark.parametrize("kind", ["library", "texture", "gltf"])
@pytest.mark.parametrize("steps", ["..", "../..", "sub/../..", "../input/.."])
def test_files_of_a_worker_are_not_read(tmp_path, kind, steps):
    """The model is in object storage; the worker has a copy in a folder of its own."""
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    files, model = naming(kind, f"{steps}/secret.png")
    record = run_remote(tmp_path, files, model)
    assert record["status"] == "failed"
    assert "names a file outside its folder" in record["error"] and "secret.png" in record["error"]
    assert not (tmp_path / "out" / "out.glb").exists()


@pytest.mark.parametrize("kind", ["library", "texture"])
def test_absolute_paths_of_a_worker_are_not_read(tmp_path, kind):
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    files, model = naming(kind, str(tmp_path / "secret.png"))
    record = run_remote(tmp_path, files, model)
    # One of that name is looked for beside the model, in its storage.
    assert record["status"] == "done" and record["inputs"].pop("secret.png", None) in (
        None,
        {"stamp": None, "digest": None},
    )
    assert set(record["inputs"]) <= {"a.obj", "m.mtl"}
    assert any("secret.png is not a relative path" in line for line in record["warnings"])
    assert not glb_json(tmp_path / "out" / "out.glb").get("images")


@pytest.mark.parametrize("kind", ["library", "texture"])
@pytest.mark.parametrize("name", ["x" * 256, f"{'x' * 300}/t.png", "a.obj/t.png", "sub", "sub/.."])
def test_names_that_no_file_can_have_in_object_storage(tmp_path, kind, name):
    files, model = naming(kind, name)
    files = {"sub/other.png": b"", **files}
    if name.startswith("x"):
        files[name] = b"longer than a disk allows"
    record = run_remote(tmp_path, files, model)
    assert record["status"] == "done"
    assert any("is not there" in line for line in record["warnings"])
