"""A scene on the device and the camera that looks at it, for the shaders of all raster paths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gltf_ext.errors import blaming

from ..gpu import vk
from ..gpu.device import Device
from ..gpu.memory import Buffer
from .buffers import FRAME, SceneBuffers
from .camera import Camera
from .scene import Scene
from .textures import TextureArray, array_size, textures_layout

BLOBS = frozenset({"blobs", "bounds"})
MATRIX_BYTES = 64


class SceneView:
    """A scene's buffers, textures and pipeline layout, and the record of a frame.

    needs, rows: see SceneBuffers. matrices: whether a frame has a matrix for each instance.
    layout: VkPipelineLayout of all shaders that draw the scene. textures: size of its descriptor
    array.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        needs: frozenset[str],
        rows: Buffer | None = None,
        *,
        matrices: bool = True,
    ):
        self.device, self.scene = device, scene
        self._first: list[Callable[[], None]] = []
        self.textures = array_size(scene.textures)
        self.layout = textures_layout(device, self.textures)
        with blaming(scene.path):
            self._textures = TextureArray(device, scene.textures)
        self.buffers = SceneBuffers(device, scene, needs, rows)
        self._matrix_bytes = MATRIX_BYTES * len(scene.instances) if matrices else 0
        self._frame = Buffer(device, self._matrix_bytes + FRAME.itemsize)

    def at_first_look(self, action: Callable[[], None]) -> None:
        """Registers an action that the first look runs."""
        self._first.append(action)

    @property
    def frame(self) -> int:
        """Address of the record of the frame."""
        return self._frame.address + self._matrix_bytes

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of all buffers, without images."""
        return self.buffers.resident_bytes + self._frame.allocated

    def look(self, camera: Camera, width: int, height: int) -> None:
        """Sets the camera of later pictures."""
        while self._first:
            self._first.pop()()
        frame = self.buffers.frame_record(camera, width, height, self._frame.address).tobytes()
        if self._matrix_bytes:
            matrices = self.buffers.object_to_clip_matrices(camera, width, height)
            frame = matrices.tobytes() + frame
        self._frame.write(frame)

    def bind(self, commands: Any, bind_point: int) -> None:
        """Records the binding of the textures."""
        sets = [self._textures.set]
        vk.vkCmdBindDescriptorSets(commands, bind_point, self.layout, 0, 1, sets, 0, None)

    def free(self) -> None:
        """Frees the memory; a second call does nothing."""
        self.buffers.free()
        self._frame.free()
        self._textures.free()
