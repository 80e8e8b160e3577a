"""What a driver has compiled, kept on disk for the next start.

A file for each device, driver and set of shaders: 32 bytes of SHA-256 of the rest, then the
driver's data. A file that is damaged, or of another driver, is never given to a driver: some crash
on it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from importlib import resources
from pathlib import Path

from gltf_ext.errors import MeshletError
from gltf_ext.files import cache_folder, write_files

from . import vk
from .device import Device
from .reflection import PACKAGE

DIGEST_BYTES = 32
MAX_BYTES = 1 << 28  # of a file; one of all paths' pipelines takes some 10 MB
KEPT = 8  # files; each driver, and each version of the shaders, makes one


class PipelineCache:
    """A VkPipelineCache with the data of earlier starts; closing the device saves it.

    Without a folder that can be written, it lasts as long as the device. read: bytes of earlier
    starts. handle: VkPipelineCache.
    """

    def __init__(self, device: Device):
        name = hashlib.sha256(device.cache_header + _shaders()).hexdigest()[:32]
        self._path = cache_folder() / "pipelines" / f"{name}.bin"
        self._before = _load(self._path, device.cache_header)
        self.read = len(self._before)
        data = vk.ffi.from_buffer(self._before)
        self.handle = vk.vkCreatePipelineCache(
            device.handle,
            vk.VkPipelineCacheCreateInfo(initialDataSize=self.read, pInitialData=data),
            None,
        )
        self._device = device
        device.at_close(self._save)

    def _save(self) -> None:
        data = vk.vkGetPipelineCacheData(self._device.handle, self.handle)
        vk.vkDestroyPipelineCache(self._device.handle, self.handle, None)
        if data != self._before and data.startswith(self._device.cache_header):
            # A cache that cannot be written only costs time at the next start.
            with suppress(OSError, MeshletError):
                _write(self._path, data)


def _shaders() -> bytes:
    """The digests of all shaders' sources."""
    return (resources.files(PACKAGE) / "spirv" / "sources.json").read_bytes()


def _load(path: Path, header: bytes) -> bytes:
    """A file's data; empty if there is none, or it is damaged, or does not begin with `header`."""
    try:
        if path.stat().st_size > MAX_BYTES:
            return b""
        content = path.read_bytes()
        os.utime(path)  # _prune removes the least recently used
    except OSError:
        return b""
    digest, data = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
    whole = hashlib.sha256(data).digest() == digest and data.startswith(header)
    return data if whole else b""


def _write(path: Path, data: bytes) -> None:
    if len(data) > MAX_BYTES - DIGEST_BYTES:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_files({path: [hashlib.sha256(data).digest(), data]}, [])
    _prune(path.parent.glob("*.bin"))


def _prune(files: Iterable[Path]) -> None:
    """Removes all but the KEPT files that were used last."""

    def used(path: Path) -> float:
        try:
            return path.stat().st_mtime
        except OSError:  # another process has removed it
            return 0.0

    for path in sorted(files, key=used, reverse=True)[KEPT:]:
        with suppress(OSError):
            path.unlink()
