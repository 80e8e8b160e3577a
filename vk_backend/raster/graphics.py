"""A path's graphics pipeline, and the commands around its draws."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..gpu import vk
from ..gpu.device import Device
from ..gpu.limits import MAX_WORKGROUPS
from ..gpu.pipelines import push
from ..gpu.targets import Targets
from ..scene.buffers import require_room
from ..scene.decoded import HAS_COLOR, HAS_NORMAL, HAS_TEXCOORD
from ..scene.instances import Instance, Run
from ..scene.scene import Scene
from ..scene.view import SceneView
from .pipeline import FRAGMENT, Modules, graphics_pipeline

# Variants of surface.frag, and some of geometry.geom, with the attributes that they pass on. A
# scene uses the first variant that has all of its attributes.
VARIANTS = {
    "position": 0,
    "normal": HAS_NORMAL,
    "texcoord": HAS_NORMAL | HAS_TEXCOORD,
    "color": HAS_NORMAL | HAS_TEXCOORD | HAS_COLOR,
}


def raster_constants(scene: Scene, culling: bool) -> dict[str, int]:
    """Specialisation constants of the raster and decoding shaders."""
    return {
        "MAX_STREAMS": scene.max_streams,
        "MAX_ELEMENTS": scene.max_elements,
        "ATTRIBUTES": scene.attributes,
        "CULLING": int(culling),
    }


def require_team(device: Device, scene: Scene, path: str, shared_bytes: int) -> None:
    """Raises VulkanError if a team that decodes a meshlet needs more shared memory."""
    require_room(device, scene, path, shared_bytes, "choose --path geometry or vertex")


def parts_of_run(run: Run, workgroups: int) -> list[Run]:
    """A run in parts of at most MAX_WORKGROUPS workgroups, or single instances.

    workgroups: of an instance. Shaders find the instance by the row of their workgroup.
    """
    most = max(MAX_WORKGROUPS // max(workgroups, 1), 1)
    return [
        Run(run.first + first, min(most, run.count - first)) for first in range(0, run.count, most)
    ]


class Graphics:
    """A graphics pipeline.

    stages: modules before the fragment shader, with {attributes} to be filled in. variants: names
    of VARIANTS that they have. numbers: the fragment shader reads a mesh shader's numbers of
    triangles.
    """

    def __init__(
        self,
        view: SceneView,
        stages: Modules,
        constants: dict[str, int],
        ids: bool,
        *,
        numbers: bool = False,
        variants: tuple[str, ...] = tuple(VARIANTS),
    ):
        self._view, self._device = view, view.device
        attributes = view.scene.attributes
        chosen = next(name for name in variants if not attributes & ~VARIANTS[name])
        # Mesh shaders that write numbers write all attributes.
        inputs = "mesh" if numbers else chosen
        modules = [(name.format(attributes=chosen), bit) for name, bit in stages]
        modules.append((f"surface_{inputs}{'_ids' if ids else ''}.frag", FRAGMENT))
        constants = {**constants, "NUMBERS": int(numbers)}
        self._pipeline = graphics_pipeline(
            view.device, tuple(modules), constants, view.textures, ids
        )

    @contextmanager
    def rendering(self, commands: Any, targets: Targets, resumed: bool = False) -> Iterator[None]:
        """The block records draws. resumed: over what earlier draws have left."""
        targets.begin(commands, resumed=resumed)
        vk.vkCmdBindPipeline(commands, vk.VK_PIPELINE_BIND_POINT_GRAPHICS, self._pipeline.handle)
        self._view.bind(commands, vk.VK_PIPELINE_BIND_POINT_GRAPHICS)
        yield
        vk.vkCmdEndRendering(commands)

    def set_sides(self, commands: Any, number: int) -> None:
        """Records which sides of an instance's triangles are visible."""
        instance = self._view.scene.instances[number]
        double_sided = self._view.scene.materials[instance.material].double_sided
        front = (
            vk.VK_FRONT_FACE_CLOCKWISE if instance.mirrored else vk.VK_FRONT_FACE_COUNTER_CLOCKWISE
        )
        vk.vkCmdSetCullMode(
            commands, vk.VK_CULL_MODE_NONE if double_sided else vk.VK_CULL_MODE_BACK_BIT
        )
        vk.vkCmdSetFrontFace(commands, front)

    def runs(self, commands: Any, data: np.ndarray) -> Iterator[tuple[Run, Instance]]:
        """(run, its first instance) of all, each with its sides and push constants recorded."""
        for run in self._view.scene.instances.runs:
            self.set_sides(commands, run.first)
            data["instance"] = run.first
            self.push(commands, data)
            yield run, self._view.scene.instances[run.first]

    def push(self, commands: Any, data: np.ndarray) -> None:
        """Records push constants."""
        push(commands, self._view.layout, data)

    def draw_tasks(
        self, commands: Any, data: np.ndarray, count: int, rows: int = 1, **fields: int
    ) -> None:
        """Records draws of rows of `count` workgroups, as many columns as a draw may have.

        data: push constants. fields: how much a field grows with each workgroup.
        """
        draw = self._device.function("vkCmdDrawMeshTasksEXT")
        data = data.copy()
        for first in range(0, count, MAX_WORKGROUPS):
            self.push(commands, data)
            draw(commands, min(count - first, MAX_WORKGROUPS), rows, 1)
            for name, step in fields.items():
                data[name] += MAX_WORKGROUPS * step
