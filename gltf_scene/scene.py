"""A glTF scene as plain data, read once for all back ends.

Nodes become placed primitives, cameras and lights; `value_format` says how an attribute's stored
numbers become floats. Nothing here knows Mitsuba, Vulkan or the compression.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gltf_ext.document import gltf
from gltf_ext.document.accessors import accessor_format, stated_bounds
from gltf_ext.document.document import Document, item
from gltf_ext.document.json_values import member, number, numbers
from gltf_ext.document.nodes import placed
from gltf_ext.errors import MeshletError
from gltf_scene.camera import Camera, read_camera

LIGHTS = "KHR_lights_punctual"
QUANTIZATION = "KHR_mesh_quantization"
# Integers in these attributes are fractions even in files that forget to say `normalized`: glTF
# and KHR_mesh_quantization allow nothing else.
ALWAYS_NORMALIZED = ("COLOR_", "NORMAL", "TANGENT", "WEIGHTS_")


@dataclass(frozen=True)
class ValueFormat:
    """How an attribute's stored components become floats.

    dtype: of the accessor's components; normalized: integers stand for fractions of the largest.
    """

    dtype: np.dtype
    components: int
    normalized: bool

    @property
    def is_integer(self) -> bool:
        return self.dtype.kind != "f"

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest integer; zeros for floats."""
        if not self.is_integer:
            return 0.0, 0.0
        limits = np.iinfo(self.dtype)
        return float(limits.min), float(limits.max)

    @property
    def scale(self) -> float:
        """Factor from stored numbers to values, exact in float32."""
        return float(np.float32(1.0 / self.limits[1])) if self.normalized else 1.0

    def to_floats(self, stored: np.ndarray) -> np.ndarray:
        """float32 values of stored components of any shape.

        glTF 2.0, section 3.6.2.2 (Accessor Data Types): max(c / 127, -1) for signed bytes.
        """
        with np.errstate(over="ignore"):  # callers refuse infinite values
            values: np.ndarray = np.asarray(stored).astype(np.float32)
        if not self.normalized:
            return values
        values = np.maximum(values * np.float32(self.scale), np.float32(-1.0))
        return values


def value_format(document: Document, primitive: gltf.Primitive, name: str) -> ValueFormat:
    """The format of one of the primitive's attributes. Raises MeshletError.

    Integer texture coordinates are plain integers only if the file declares
    KHR_mesh_quantization; glTF itself allows only normalised ones.
    """
    index = primitive["attributes"][name]
    accessor = item(document.accessors, index, f"the accessor of {name},")
    dtype, components = accessor_format(accessor, name)
    forgotten = name.startswith(ALWAYS_NORMALIZED) or (
        name.startswith("TEXCOORD_") and QUANTIZATION not in document.extensionsUsed
    )
    normalized = dtype.kind != "f" and (accessor.get("normalized", False) or forgotten)
    return ValueFormat(dtype, components, normalized)


def position_box(
    document: Document, primitive: gltf.Primitive
) -> tuple[np.ndarray, np.ndarray] | None:
    """(low, high), float64[3], from the accessor's min and max; None if these are not valid."""
    index = primitive["attributes"].get("POSITION")
    accessor = item(document.accessors, index, "the accessor of POSITION,")
    stated = stated_bounds(accessor)
    if not all(bound is not None and len(bound) == 3 for bound in stated):
        return None
    box = np.array(stated)
    form = value_format(document, primitive, "POSITION")
    if form.normalized:
        box = np.maximum(box * form.scale, -1.0)
    return (box[0], box[1]) if np.isfinite(box).all() and (box[0] <= box[1]).all() else None


def box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """float64[8, 3]"""
    return np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])


@dataclass(frozen=True)
class PlacedPrimitive:
    """A triangle primitive in its place.

    node: number of the node in the order of the scene; mesh, primitive: its place in the document;
    material: index of the document's material, or None; matrix: float64[4, 4], object to world.
    """

    node: int
    mesh: int
    primitive: int
    material: int | None
    matrix: np.ndarray

    @property
    def mirrored(self) -> bool:
        """The matrix turns counter-clockwise triangles into clockwise ones."""
        return is_mirrored(self.matrix)


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
        """A camera by its index in the order of the nodes; None for 0 if there are none.

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
    """The document's default scene; all root nodes if it has no scenes. Raises MeshletError."""
    scene = Scene()
    for place, (node, matrix) in enumerate(placed(document)):
        if "camera" in node:
            camera = item(document.cameras, node["camera"], "camera")
            scene.cameras.append(read_camera(camera, matrix))
        light = member(node.get("extensions"), LIGHTS).get("light")
        if light is not None:
            scene.lights.append(_read_light(document, light, place, matrix))
        if "mesh" in node:
            scene.warnings += _ignored(node)
            _add_primitives(scene, document, node["mesh"], place, matrix)
    scene.warnings = list(dict.fromkeys(scene.warnings))
    return scene


def is_mirrored(matrix: np.ndarray) -> bool:
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def _ignored(node: gltf.Node) -> list[str]:
    """Warnings about features of a node that no back end has."""
    found = []
    if "skin" in node:
        found.append("a skin is not applied: the mesh is shown in its bind pose")
    if gltf.has_extension(node, "EXT_mesh_gpu_instancing"):
        found.append("EXT_mesh_gpu_instancing is not applied: the mesh is shown once")
    return found


def _add_primitives(
    scene: Scene, document: Document, mesh: int, node: int, matrix: np.ndarray
) -> None:
    for index, primitive in enumerate(item(document.meshes, mesh, "mesh")["primitives"]):
        if gltf.mode(primitive) not in gltf.TRIANGLE_MODES:
            scene.warnings.append(f"mesh {mesh} primitive {index} has no triangles: left out")
            continue
        scene.primitives.append(
            PlacedPrimitive(node, mesh, index, primitive.get("material"), matrix)
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
