"""Pipelines are compiled in threads, and what a driver has compiled is kept for the next start."""

from __future__ import annotations

import hashlib
import os
import time
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.vulkan_scenes import require_vulkan

DIGEST_BYTES = 32  # of pipeline_cache


@pytest.fixture(autouse=True)
def vulkan() -> None:
    require_vulkan()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the caches' files, which is not there yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "gltf-meshlet" / "pipelines"


def start(monkeypatch: pytest.MonkeyPatch, compiled: bytes = b"") -> int:
    """One start of a driver that adds `compiled` to its data; the bytes that it was given.

    lavapipe's own data never have more than the header.
    """
    from vk_backend.gpu import vk
    from vk_backend.gpu.device import Device
    from vk_backend.gpu.pipelines import Compiler, ComputePipeline

    real = vk.vkGetPipelineCacheData
    monkeypatch.setattr(vk, "vkGetPipelineCacheData", lambda *own: real(*own) + compiled)
    given: list[int] = []
    with Device(validation=True) as device:
        compiler = Compiler.of(device)
        assert ComputePipeline.of(device, "pyramid.comp", {})._pipeline.handle
        assert compiler.statistics()["count"] == 1
        given.append(compiler.statistics()["cached_bytes"])
        messages = device.messages
    monkeypatch.setattr(vk, "vkGetPipelineCacheData", real)
    assert not messages
    return given[0]


def test_the_next_start_has_what_this_one_compiled(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert start(monkeypatch, b"compiled") == 0
    (file,) = folder.iterdir()
    content = file.read_bytes()
    assert content[:DIGEST_BYTES] == hashlib.sha256(content[DIGEST_BYTES:]).digest()
    assert content.endswith(b"compiled")
    assert start(monkeypatch, b"compiled") == len(content) - DIGEST_BYTES


def broken(content: bytes) -> dict[str, bytes]:
    """Name -> contents that no driver may be given."""
    data = bytearray(content[DIGEST_BYTES:])
    data[16] ^= 1  # of the driver's own number
    other = hashlib.sha256(data).digest() + data
    return {
        "bit": content[:-1] + bytes([content[-1] ^ 1]),
        "short": content[:-1],
        "empty": b"",
        "digest alone": hashlib.sha256(b"").digest(),
        "another driver": other,
    }


@pytest.mark.parametrize("fault", broken(bytes(100)))
def test_a_damaged_file_is_ignored_and_replaced(
    fault: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vk_backend.gpu import pipeline_cache

    start(monkeypatch, b"compiled")
    (file,) = folder.iterdir()
    content = file.read_bytes()
    file.write_bytes(broken(content)[fault])
    assert start(monkeypatch, b"compiled") == 0
    assert file.read_bytes() == content
    monkeypatch.setattr(pipeline_cache, "MAX_BYTES", 40)
    assert start(monkeypatch, b"compiled") == 0  # too large to be read


def test_a_folder_that_cannot_be_written_costs_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"a file of the user")
    monkeypatch.setenv("XDG_CACHE_HOME", str(file))
    assert start(monkeypatch, b"compiled") == 0
    assert file.read_bytes() == b"a file of the user"


def test_files_of_other_drivers_and_shaders_are_removed_in_the_end(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vk_backend.gpu.pipeline_cache import KEPT

    folder.mkdir(parents=True)
    for number in range(KEPT + 2):
        path = folder / f"{number}.bin"
        path.write_bytes(b"")
        os.utime(path, (number, number))
    start(monkeypatch, b"compiled")
    names = {path.name for path in folder.iterdir()}
    assert len(names) == KEPT
    assert not names & {"0.bin", "1.bin", "2.bin"}


def test_pipelines_are_created_at_the_same_time(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vk_backend.gpu import vk
    from vk_backend.gpu.device import Device
    from vk_backend.gpu.pipelines import Compiler

    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    with Device() as device:
        compiler = Compiler.of(device)

        def create(*_: Any) -> list[Any]:
            time.sleep(0.2)
            return [vk.ffi.NULL]

        pipelines = [compiler.start(create, None) for _ in range(4)]
        for pipeline in pipelines:
            assert pipeline.handle == vk.ffi.NULL
        statistics = compiler.statistics()
    assert statistics["count"] == 4
    assert statistics["seconds"] < statistics["work_seconds"]


def test_a_refused_pipeline_raises_when_it_is_used(folder: Path) -> None:
    from vk_backend.gpu import vk
    from vk_backend.gpu.device import Device
    from vk_backend.gpu.pipeline_cache import PipelineCache
    from vk_backend.gpu.pipelines import Compiler

    def refuse(*_: Any) -> list[Any]:
        raise vk.VkErrorOutOfDeviceMemory

    with Device() as device:
        pipeline = Compiler.of(device).start(refuse, None)
        with pytest.raises(vk.VkErrorOutOfDeviceMemory):
            _ = pipeline.handle
        assert PipelineCache(device).handle  # the device is still there, and closes
