"""Writing output files: all or none."""

import errno
import os
import stat
from collections import Counter
from pathlib import Path, PureWindowsPath

import pytest

from gltf_ext import portable
from gltf_ext.errors import MeshletError
from gltf_ext.files import identity, write_files


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
        write_files({path: [b"new"] for path in paths}, input_files=())
    assert caught.value.filename == str(paths[failing])
    assert contents_of(tmp_path) == before


def test_files_are_replaced(tmp_path):
    paths = [tmp_path / f"{i}.bin" for i in range(3)]
    paths[1].write_bytes(b"former")
    write_files({path: [b"n", memoryview(b"ew")] for path in paths}, input_files=())
    assert contents_of(tmp_path) == dict.fromkeys(("0.bin", "1.bin", "2.bin"), b"new")
    assert len(os.listdir(tmp_path)) == 3


@pytest.mark.parametrize("exists", [True, False])
def test_a_link_stays_a_link(tmp_path, exists):
    """To a file in another folder, whose permissions stay as well; also to one that is not yet."""
    (tmp_path / "folder").mkdir()
    real, link = tmp_path / "folder" / "real.glb", tmp_path / "link.glb"
    if exists:
        real.write_bytes(b"former")
    link.symlink_to(Path("folder", "real.glb"))
    write_files({tmp_path / "side.bin": [b"side"], link: [b"new"]}, input_files=())
    assert link.is_symlink() and real.read_bytes() == b"new" and not real.is_symlink()
    assert sorted(os.listdir(tmp_path)) == ["folder", "link.glb", "side.bin"]
    assert os.listdir(tmp_path / "folder") == ["real.glb"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no modes of files")
@pytest.mark.parametrize("mode", [0o664, 0o600, 0o444])
def test_a_file_keeps_its_mode(tmp_path, mode):
    paths = [tmp_path / "side.bin", tmp_path / "model.glb"]
    for path in paths:
        path.write_bytes(b"former")
        path.chmod(mode)
    write_files({path: [b"new"] for path in paths}, input_files=())
    assert [stat.S_IMODE(path.stat().st_mode) for path in paths] == [mode, mode]
    assert contents_of(tmp_path) == {path.name: b"new" for path in paths}


@pytest.mark.skipif(os.name == "nt" or os.geteuid() != 0, reason="only root gives files away")
def test_a_file_keeps_its_owner(tmp_path):
    path = tmp_path / "out.glb"
    path.write_bytes(b"former")
    path.chmod(0o640)
    os.chown(path, 12345, 23456)
    write_files({path: [b"new"]}, [])
    status = path.stat()
    assert (status.st_uid, status.st_gid) == (12345, 23456)
    assert stat.S_IMODE(status.st_mode) == 0o640 and path.read_bytes() == b"new"


@pytest.mark.skipif(not hasattr(os, "chown"), reason="Windows has no owners")
def test_an_owner_who_cannot_be_kept_is_no_error(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(os, "chown", refuse)
    path = tmp_path / "out.glb"
    path.write_bytes(b"former")
    path.chmod(0o604)
    write_files({path: [b"new"]}, [])
    assert stat.S_IMODE(path.stat().st_mode) == 0o604


def test_other_hard_links_keep_the_former_file(tmp_path):
    """As a backup made of them has to."""
    path, backup = tmp_path / "out.glb", tmp_path / "backup.glb"
    path.write_bytes(b"former")
    os.link(path, backup)
    write_files({path: [b"new"]}, [])
    assert path.read_bytes() == b"new" and backup.read_bytes() == b"former"


def test_links_to_the_same_file_are_refused(tmp_path):
    for name in ("one.bin", "two.bin"):
        (tmp_path / name).symlink_to("real.bin")
    with pytest.raises(MeshletError, match=r"two\.bin: is the same file as another output"):
        write_files({tmp_path / f"{name}.bin": [b"new"] for name in ("one", "two")}, ())
    assert sorted(os.listdir(tmp_path)) == ["one.bin", "two.bin"]


@pytest.mark.parametrize("link", [None, os.symlink, os.link])
def test_no_file_that_was_read_is_overwritten(tmp_path, link):
    read = tmp_path / "read.bin"
    read.write_bytes(b"original")
    (tmp_path / "folder").mkdir()
    path = tmp_path / "folder" / ".." / "read.bin"
    if link:
        path = tmp_path / "link.bin"
        link(read, path)
    with pytest.raises(MeshletError, match="is the input too"):
        write_files({tmp_path / "new.bin": [b"new"], path: [b"new"]}, [tmp_path / "none", read])
    assert read.read_bytes() == b"original" and not (tmp_path / "new.bin").exists()
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("links", [True, False])
def test_a_former_file_is_there_until_the_new_one_is(tmp_path, monkeypatch, links):
    """And is there again when the new one cannot be renamed; also without hard links."""
    paths = [tmp_path / "side.bin", tmp_path / "model.glb"]
    for path in paths:
        path.write_bytes(b"former")
    replace, seen = os.replace, []

    def failing(source, target):
        seen.append(paths[0].exists())
        if target == paths[0] and len(seen) == (1 if links else 2):
            raise PermissionError(13, "Permission denied", str(source))
        replace(source, target)

    def no_links(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "replace", failing)
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    with pytest.raises(PermissionError):
        write_files({path: [b"new"] for path in paths}, input_files=())
    assert seen[0] and contents_of(tmp_path) == {path.name: b"former" for path in paths}
    write_files({path: [b"new"] for path in paths}, input_files=())
    assert contents_of(tmp_path) == {path.name: b"new" for path in paths}
    assert not links or all(seen)


@pytest.mark.parametrize("step", range(4))
@pytest.mark.parametrize("after", [False, True])
def test_ctrl_c_leaves_all_or_nothing(tmp_path, monkeypatch, step, after):
    """Before or after any step: a file is set aside, three are renamed."""
    paths = [tmp_path / name for name in ("side.bin", "more.bin", "model.glb")]
    for path in paths[::2]:
        path.write_bytes(b"former")
    before, steps = contents_of(tmp_path), []

    def interrupted(function):
        def call(*arguments):
            steps.append(arguments)
            is_it = len(steps) == step + 1
            if is_it and not after:
                raise KeyboardInterrupt
            function(*arguments)
            if is_it:
                raise KeyboardInterrupt

        return call

    monkeypatch.setattr(os, "replace", interrupted(os.replace))
    monkeypatch.setattr(os, "link", interrupted(os.link))
    with pytest.raises(KeyboardInterrupt):
        write_files({path: [b"new"] for path in paths}, input_files=())
    is_done = step == 3 and after
    new = {path.name: b"new" for path in paths}
    assert contents_of(tmp_path) == (new if is_done else before)


@pytest.fixture
def no_numbers(monkeypatch):
    """A file system without numbers of files."""
    real = os.stat

    def stat(*arguments, **options):
        result = list(real(*arguments, **options))
        result[1] = 0  # st_ino
        return os.stat_result(result)

    monkeypatch.setattr(os, "stat", stat)


@pytest.mark.parametrize("other", ["folder/../read.bin", "link.bin"])
def test_a_file_system_without_numbers_of_files(tmp_path, no_numbers, other):
    """Not all files are the same there."""
    (tmp_path / "folder").mkdir()
    for name in ("read.bin", "new.bin"):
        (tmp_path / name).write_bytes(b"former")
    (tmp_path / "link.bin").symlink_to("read.bin")
    write_files({tmp_path / "new.bin": [b"new"]}, [tmp_path / "read.bin"])
    with pytest.raises(MeshletError, match="is the input too"):
        write_files({tmp_path / other: [b"new"]}, [tmp_path / "read.bin"])
    assert (tmp_path / "read.bin").read_bytes() == b"former"
    assert identity(tmp_path / "none.bin") is None


# --- files that other programs hold open, on Windows ---


@pytest.fixture
def windows(monkeypatch):
    """As Windows does: renaming and deleting fail so many times, for a file that is in use."""
    monkeypatch.setattr(portable, "IS_WINDOWS", True)
    monkeypatch.setattr(portable, "PATIENCE", 0.3)
    real, left = os.replace, Counter()

    def renaming(source, target):
        if left[str(target)] > 0:
            left[str(target)] -= 1
            raise PermissionError(errno.EACCES, "is in use", str(source), None, str(target))
        real(source, target)

    monkeypatch.setattr(os, "replace", renaming)
    return left


def test_a_file_that_is_in_use_for_a_moment_is_replaced(tmp_path, windows):
    path = tmp_path / "out.glb"
    path.write_bytes(b"former")
    windows[str(path)] = 3
    write_files({path: [b"new"]}, input_files=())
    assert contents_of(tmp_path) == {"out.glb": b"new"}


@pytest.mark.parametrize("used", range(3))
def test_a_file_that_stays_in_use_leaves_all_as_before(tmp_path, windows, used):
    paths = [tmp_path / f"{i}.bin" for i in range(3)]
    for path in paths:
        path.write_bytes(b"former")
    windows[str(paths[used])] = 1000
    # A former file returns: its program has closed it by then.
    with pytest.raises(PermissionError) as caught:
        write_files({path: [b"new"] for path in paths[: used + 1]}, input_files=())
    assert caught.value.filename == str(paths[used])
    windows.clear()
    assert {path.name for path in tmp_path.iterdir()} == {"0.bin", "1.bin", "2.bin"}
    assert set(contents_of(tmp_path).values()) == {b"former"}


def test_a_side_file_that_is_in_use_gets_no_second_name(tmp_path, windows, monkeypatch):
    """Windows makes hard links of a file that is in use, but neither name can be removed then."""
    paths = [tmp_path / "side.bin", tmp_path / "model.glb"]
    for path in paths:
        path.write_bytes(b"former")
    used = paths[0].stat().st_ino

    def refusing(function):
        def call(*names, **options):
            if any(os.path.exists(name) and os.stat(name).st_ino == used for name in names):
                raise PermissionError(errno.EACCES, "is in use", str(names[0]))
            return function(*names, **options)

        return call

    monkeypatch.setattr(os, "replace", refusing(os.replace))
    monkeypatch.setattr(os, "unlink", refusing(os.unlink))
    with pytest.raises(PermissionError) as caught:
        write_files({path: [b"new"] for path in paths}, input_files=())
    assert caught.value.filename == str(paths[0])
    assert {path.name for path in tmp_path.iterdir()} == {"side.bin", "model.glb"}
    assert set(contents_of(tmp_path).values()) == {b"former"}


def test_other_systems_do_not_wait(tmp_path, windows, monkeypatch):
    monkeypatch.setattr(portable, "IS_WINDOWS", False)
    path = tmp_path / "out.glb"
    windows[str(path)] = 1
    with pytest.raises(PermissionError):
        write_files({path: [b"new"]}, input_files=())
    assert contents_of(tmp_path) == {}


# --- names and paths ---


def test_names_of_bytes_that_are_no_text():
    assert portable.file_name("Möbel.mtl".encode()) == "Möbel.mtl"
    assert portable.file_name(b"M\xf6bel.mtl") == "M\udcf6bel.mtl"


def test_paths_that_wine_cannot_resolve(tmp_path, monkeypatch):
    def fail(_):
        raise OSError(errno.EINVAL, "More data available")

    (tmp_path / "link").symlink_to(tmp_path)
    assert portable.real_path(tmp_path / "link" / "x") == str(tmp_path / "x")
    monkeypatch.setattr(os.path, "realpath", fail)
    assert portable.real_path(tmp_path / "no" / ".." / "x") == str(tmp_path / "x")


@pytest.mark.parametrize("name", ["x.bin", "a/x.bin", "../x.bin", "a\\x.bin", "a b:c.bin"])
def test_relative_paths(name):
    assert portable.is_relative(name) and portable.is_relative(name, PureWindowsPath)


@pytest.mark.parametrize("name", ["C:x.bin", "C:/x.bin", "c:\\x.bin", "\\x", "\\\\host\\share\\x"])
def test_paths_of_windows_with_a_drive_or_a_host(name):
    assert portable.is_relative(name) and not portable.is_relative(name, PureWindowsPath)
    assert not portable.is_relative("/x.bin") and not portable.is_relative("/x", PureWindowsPath)
