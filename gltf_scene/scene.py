"""A glTF scene as plain data, read once for all back ends.

Nodes become placed primitives, cameras and lights. Nothing here knows Mitsuba, Vulkan or the
compression.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import member, number, numbers
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.errors import MeshletError
from gltf_scene.camera import Camera, read_camera
from gltf_scene.instancing import MAX_PLACES, instance_count, instance_matrices

LIGHTS = "KHR_lights_punctual"


@dataclass(frozen=True)
class PlacedPrimitive:
    """A triangle primitive in its places.

    node: number of the node in the order of the scene; mesh, primitive: its place in the document;
    material: index of the document's material, or None; matrices: float64[n, 4, 4], object to
    world, of each instance; a node without EXT_mesh_gpu_instancing has one.
    """

    node: int
    mesh: int
    primitive: int
    material: int | None
    matrices: np.ndarray


@dataclass(frozen=True)
class Light:
    """A light of KHR_lights_punctual; it shines along its node's -z axis.

    kind: "directional" (color is in lux), "spot" or "point" (candela); color: linear, times the
    intensity; inner_cone, outer_cone: a spot's, radians.
    """

    node: int
    kind: str
    color: tuple[float, ...]
    matrix: np.ndarray
    inner_cone: float = 0.0
    outer_cone: float = np.pi / 4


@dataclass
class Scene:
    """The default scene of a document; warnings: features that are ignored."""

    primitives: list[PlacedPrimitive] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def camera(self, index: int) -> Camera | None:
        """Return a camera by its index in the order of the nodes; None for 0 if there are none.

        Raises MeshletError.
        """
        if 0 <= index < len(self.cameras):
            return self.cameras[index]
        if index == 0:
            return None
        raise MeshletError(
            f"camera {index} does not exist",
            f"there are {len(self.cameras) or 'none'}",
            options=("camera",),
        )


def read_scene(document: Document) -> Scene:
    """Return the default scene; of a file without scenes, all root nodes. Raises MeshletError."""
    scene = Scene()
    room = MAX_PLACES
    for place, (node, matrix) in enumerate(placed_nodes(document)):
        if "camera" in node:
            camera = item(document.cameras, node["camera"], "camera")
            scene.cameras.append(read_camera(camera, matrix))
        light = member(node.get("extensions"), LIGHTS).get("light")
        if light is not None:
            scene.lights.append(_read_light(document, light, place, matrix))
        if "mesh" in node:
            room -= _places(document, node)
            if room < 0:
                raise MeshletError(
                    f"its nodes show more than {MAX_PLACES:,} primitives", "split the scene"
                )
            _add_primitives(scene, document, node, place, matrix)
    scene.warnings = list(dict.fromkeys(scene.warnings))
    return scene


def _places(document: Document, node: gltf.Node) -> int:
    """Primitives that a node shows, those of each instance counted."""
    count = instance_count(document, node)
    primitives = len(item(document.meshes, node["mesh"], "mesh")["primitives"])
    # Matrices take memory even where a mesh has no primitives.
    return max(primitives, 1) * (1 if count is None else count)


def is_mirrored(matrix: np.ndarray) -> bool:
    """Return whether a matrix turns counter-clockwise triangles into clockwise ones."""
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def _add_primitives(
    scene: Scene, document: Document, node: gltf.Node, place: int, matrix: np.ndarray
) -> None:
    matrices = instance_matrices(document, node, matrix)
    mesh = node["mesh"]
    for index, primitive in enumerate(item(document.meshes, mesh, "mesh")["primitives"]):
        if not gltf.has_triangles(primitive):
            scene.warnings.append(f"mesh {mesh} primitive {index} has no triangles: left out")
            continue
        scene.primitives.append(
            PlacedPrimitive(place, mesh, index, primitive.get("material"), matrices)
        )


def _read_light(document: Document, index: Any, node: int, matrix: np.ndarray) -> Light:
    lights = member(document.json.get("extensions"), LIGHTS).get("lights", [])
    light = item(lights if isinstance(lights, list) else [], index, "light")
    light = light if isinstance(light, dict) else {}
    intensity = number(light.get("intensity"), 1.0)
    kind = light.get("type")
    cone = member(light, "spot")
    return Light(
        node,
        kind if kind in ("directional", "spot") else "point",
        tuple(v * intensity for v in numbers(light.get("color"), (1.0,) * 3)),
        matrix,
        number(cone.get("innerConeAngle"), 0.0),
        number(cone.get("outerConeAngle"), np.pi / 4),
    )
