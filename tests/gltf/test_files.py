"""Writing output files: all or none."""

import os

import pytest

from gltf_ext.files import write_files


def contents_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("failing", range(3))
def test_a_rename_that_fails_leaves_everything_as_it_was(tmp_path, failing):
    paths = [tmp_path / f"{i}.bin" for i in range(3)]
    paths[0].write_bytes(b"former")
    paths[failing].unlink(missing_ok=True)
    paths[failing].mkdir()
    before = contents_of(tmp_path)
    with pytest.raises(OSError) as caught:
        write_files({path: [b"new"] for path in paths})
    assert caught.value.filename == str(paths[failing])
    assert contents_of(tmp_path) == before


def test_files_are_replaced(tmp_path):
    paths = [tmp_path / f"{i}.bin" for i in range(3)]
    paths[1].write_bytes(b"former")
    write_files({path: [b"n", memoryview(b"ew")] for path in paths})
    assert contents_of(tmp_path) == dict.fromkeys(("0.bin", "1.bin", "2.bin"), b"new")
    assert len(os.listdir(tmp_path)) == 3
