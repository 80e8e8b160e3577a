"""load_scene: a glTF scene with compressed primitives as a Mitsuba scene."""

from __future__ import annotations

import itertools
import os
import warnings
from collections import Counter
from typing import Any

import mitsuba as mi
import numpy as np
import pygltflib

from gltf_ext.compression.extension import EXTENSION
from gltf_ext.compression.primitives import TRIANGLE_MODES, read_primitive
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.accessors import DTYPES
from gltf_ext.gltf.document import Document, item
from gltf_ext.gltf.importers import open_model
from gltf_ext.gltf.nodes import placed

from . import reader
from .materials import Materials, texcoord_set

PLUGIN = "meshlet_edgebreaker"
# glTF cameras look along -z, Mitsuba's along +z with x to the left.
FLIP_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])
DEFAULT_VIEW = (0.45, 0.35, 1.0)
DEFAULT_FIELD_OF_VIEW = 40.0
_group_numbers = itertools.count()


def load_scene(path: str | os.PathLike, **options: Any) -> mi.Scene:
    """A Mitsuba scene of a glTF file, ready for `mi.render`; options as for `scene_dict`.

    Raises MeshletError for a file that is not valid. Everything that Mitsuba has no equivalent for is left out with a warning.
    """
    path = os.path.abspath(path)
    try:
        document = open_model(path)
        with reader.keeping(path, document):
            return mi.load_dict(_Builder(path, document, **options).result())
    except MeshletError as error:
        error.path = error.path or str(path)
        raise


def scene_dict(path: str | os.PathLike, **options: Any) -> dict[str, Any]:
    """The dictionary that `load_scene` loads, to add to or to change.

    width, height (800 x 600), spp (64), integrator (a dictionary; {"type": "path"}); camera: index of a node's camera in the order of
    the scene's nodes (0; where there is none, the whole scene is in view); cache (0.25), cache_bytes, cache_policy: as the shape's, for
    the sum of all shapes; decoded: ordinary meshes instead of compressed ones;
    default_light (1): radiance from all around where the file has no KHR_lights_punctual, 0 for none.
    """
    path = os.path.abspath(path)
    return _Builder(path, open_model(path), **options).result()


class _Builder:
    def __init__(
        self,
        path: str,
        document: Document,
        *,
        width: int = 800,
        height: int = 600,
        spp: int = 64,
        integrator: dict | None = None,
        camera: int = 0,
        cache: float = 0.25,
        cache_bytes: int | None = None,
        cache_policy: str = "clock",
        decoded: bool = False,
        default_light: float = 1.0,
    ):
        self._path, self._document, self._materials = path, document, Materials(document)
        pixels = "luminance" if "mono" in mi.variant() else "rgb"
        self._film = {"type": "hdrfilm", "width": width, "height": height, "pixel_format": pixels}
        self._spp, self._integrator, self._camera, self._decoded = (
            spp,
            integrator or {"type": "path"},
            camera,
            decoded,
        )
        self._default_light, self._lit = default_light, False
        self._cache = {
            "cache": cache,
            "cache_policy": cache_policy,
            "cache_group": f"load_scene {next(_group_numbers)}",
        }
        self._cache_bytes = cache_bytes
        self._scene: dict[str, Any] = {"type": "scene", "integrator": self._integrator}
        self._cameras: list[dict[str, Any]] = []
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def result(self) -> dict[str, Any]:
        visible = list(placed(self._document))
        uses = Counter(node.mesh for node, _ in visible if node.mesh is not None)
        groups: dict[int, str] = {}
        for number, (node, matrix) in enumerate(visible):
            if node.mesh is not None:
                self._add_mesh(number, node.mesh, matrix, uses[node.mesh] > 1, groups)
            if node.camera is not None:
                self._cameras.append(
                    self._sensor(item(self._document.cameras, node.camera, "camera"), matrix)
                )
            light = (node.extensions or {}).get("KHR_lights_punctual", {}).get("light")
            if light is not None:
                self._add_light(number, light, matrix)
        if not np.all(np.isfinite(self._low)):
            raise MeshletError("its scene shows no triangles", "there is nothing to render")
        if not self._lit and self._default_light > 0:
            self._scene["default_light"] = {"type": "constant", "radiance": self._default_light}
        if not 0 <= self._camera < max(len(self._cameras), 1):
            raise MeshletError(
                f"camera {self._camera} does not exist", f"there are {len(self._cameras) or 'none'}"
            )
        self._scene["sensor"] = (
            self._cameras[self._camera] if self._cameras else self._default_sensor()
        )
        self._share_cache()
        for warning in self._materials.warnings:
            warnings.warn(f"{self._path}: {warning}", stacklevel=4)
        return self._scene

    # --- meshes ----------------------------------------------------------------------------------------------------------

    def _add_mesh(
        self, number: int, mesh: int, matrix: np.ndarray, repeated: bool, groups: dict[int, str]
    ) -> None:
        primitives = item(self._document.meshes, mesh, "mesh").primitives
        shown = [p for p, primitive in enumerate(primitives) if primitive.mode in TRIANGLE_MODES]
        if not shown:
            return
        for p in shown:
            self._extend_bounds(primitives[p], matrix)
        # Mitsuba has no emitters in shape groups.
        glowing = any(self._materials.emission(primitives[p].material) for p in shown)
        if not repeated or glowing:
            self._scene.update({f"node_{number}_{p}": self._shape(mesh, p, matrix) for p in shown})
            return
        if mesh not in groups:
            groups[mesh] = f"mesh_{mesh}"
            self._scene[groups[mesh]] = {
                "type": "shapegroup",
                **{f"primitive_{p}": self._shape(mesh, p, np.eye(4)) for p in shown},
            }
        self._scene[f"node_{number}"] = {
            "type": "instance",
            "group": {"type": "ref", "id": groups[mesh]},
            "to_world": mi.ScalarTransform4f(matrix),
        }

    def _shape(self, mesh: int, index: int, matrix: np.ndarray) -> dict[str, Any] | mi.Mesh:
        primitive = self._document.meshes[mesh].primitives[index]
        colors = getattr(primitive.attributes, "COLOR_0", None) is not None
        inside: dict[str, Any] = {"bsdf": self._materials.bsdf(primitive.material, colors)}
        emission = self._materials.emission(primitive.material)
        if emission:
            inside["emitter"] = emission
        if EXTENSION not in (primitive.extensions or {}):
            return self._plain_mesh(mesh, index, matrix, inside)
        return {
            "type": PLUGIN,
            "filename": self._path,
            "mesh": mesh,
            "primitive": index,
            "to_world": mi.ScalarTransform4f(matrix),
            "decoded": self._decoded,
            **self._cache,
            **inside,
        }

    def _plain_mesh(
        self, mesh: int, index: int, matrix: np.ndarray, inside: dict[str, Any]
    ) -> mi.Mesh:
        """A primitive that the encoder left as it was."""
        source = read_primitive(self._document, mesh, index)[0]
        attributes = source.attributes
        texcoords = attributes.get(
            f"TEXCOORD_{texcoord_set(self._document, self._document.meshes[mesh].primitives[index].material)}"
        )
        properties = mi.Properties()
        for name, value in inside.items():
            properties[name] = mi.load_dict(value)
        result = mi.Mesh(
            f"{mesh}_{index}",
            len(attributes["POSITION"]),
            len(source.indices),
            properties,
            has_vertex_normals="NORMAL" in attributes,
            has_vertex_texcoords=texcoords is not None,
        )
        parameters = mi.traverse(result)
        parameters["faces"] = source.indices.astype(np.uint32).ravel()
        parameters["vertex_positions"] = (
            (attributes["POSITION"] @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32).ravel()
        )
        if "NORMAL" in attributes:
            normals = attributes["NORMAL"] @ np.linalg.inv(matrix[:3, :3])
            parameters["vertex_normals"] = (
                (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))
                .astype(np.float32)
                .ravel()
            )
        if texcoords is not None:
            parameters["vertex_texcoords"] = _as_float(texcoords).ravel()
        parameters.update()
        if "COLOR_0" in attributes:
            result.add_attribute("vertex_color", 3, _as_float(attributes["COLOR_0"][:, :3]).ravel())
        return result

    def _extend_bounds(self, primitive: pygltflib.Primitive, matrix: np.ndarray) -> None:
        accessor = item(self._document.accessors, primitive.attributes.POSITION, "accessor")
        if not accessor.min or not accessor.max or len(accessor.min) != 3 or len(accessor.max) != 3:
            raise MeshletError("a POSITION accessor has no min and max", "export the model again")
        corners = np.array(
            [
                [(accessor.min, accessor.max)[i >> axis & 1][axis] for axis in range(3)]
                for i in range(8)
            ],
            np.float64,
        )
        if accessor.normalized:
            corners /= np.iinfo(DTYPES[accessor.componentType]).max
        corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
        self._low, self._high = (
            np.minimum(self._low, corners.min(axis=0)),
            np.maximum(self._high, corners.max(axis=0)),
        )

    def _share_cache(self) -> None:
        """A limit in bytes is for all shapes together: each brings along a share by its compressed size."""
        if self._cache_bytes is None:
            return
        shapes = [
            shape
            for value in self._scene.values()
            for shape in ([value] if isinstance(value, dict) else []) + _members(value)
            if shape.get("type") == PLUGIN
        ]
        sizes = [self._blob_bytes(shape) for shape in shapes]
        left = self._cache_bytes
        for i, (shape, size) in enumerate(zip(shapes, sizes)):
            share = (
                left if i == len(shapes) - 1 else int(self._cache_bytes * size / max(sum(sizes), 1))
            )
            shape["cache_bytes"], left = share, left - share

    def _blob_bytes(self, shape: dict[str, Any]) -> int:
        extension = (
            self._document.meshes[shape["mesh"]]
            .primitives[shape["primitive"]]
            .extensions[EXTENSION]
        )
        return (
            item(self._document.bufferViews, extension.get("bufferView"), "bufferView").byteLength
            or 0
        )

    # --- cameras and lights ----------------------------------------------------------------------------------------------

    def _sensor(self, camera: pygltflib.Camera, matrix: np.ndarray) -> dict[str, Any]:
        rigid = matrix.copy()
        rigid[:3, :3] /= np.maximum(np.linalg.norm(rigid[:3, :3], axis=0), 1e-30)
        to_world = rigid @ FLIP_CAMERA
        if camera.type == "orthographic" and camera.orthographic is not None:
            to_world = to_world @ np.diag(
                [camera.orthographic.xmag or 1.0, camera.orthographic.xmag or 1.0, 1.0, 1.0]
            )
            return self._with_film(
                {"type": "orthographic", "to_world": mi.ScalarTransform4f(to_world)}
            )
        if camera.perspective is None:
            raise MeshletError(
                "a camera has neither perspective nor orthographic",
                "the file is not valid glTF; export it again",
            )
        return self._with_film(
            {
                "type": "perspective",
                "fov": float(np.degrees(camera.perspective.yfov)),
                "fov_axis": "y",
                "near_clip": max(camera.perspective.znear or 0.01, 1e-5),
                "far_clip": camera.perspective.zfar or 1e6,
                "to_world": mi.ScalarTransform4f(to_world),
            }
        )

    def _default_sensor(self) -> dict[str, Any]:
        """From the front, a little above and to the right, everything in view."""
        center, radius = (
            (self._low + self._high) / 2,
            max(float(np.linalg.norm(self._high - self._low)) / 2, 1e-6),
        )
        direction = np.array(DEFAULT_VIEW) / np.linalg.norm(DEFAULT_VIEW)
        distance = radius / np.sin(np.radians(DEFAULT_FIELD_OF_VIEW / 2))
        return self._with_film(
            {
                "type": "perspective",
                "fov": DEFAULT_FIELD_OF_VIEW,
                "fov_axis": "smaller",
                "near_clip": distance * 1e-3,
                "far_clip": distance * 10,
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=list(center + direction * distance), target=list(center), up=[0, 1, 0]
                ),
            }
        )

    def _with_film(self, sensor: dict[str, Any]) -> dict[str, Any]:
        return {
            **sensor,
            "film": self._film,
            "sampler": {"type": "multijitter", "sample_count": self._spp},
        }

    def _add_light(self, number: int, index: int, matrix: np.ndarray) -> None:
        """KHR_lights_punctual; lux and candela are taken for Mitsuba's units."""
        lights = (self._document.extensions or {}).get("KHR_lights_punctual", {}).get("lights", [])
        light = item(lights, index, "light")
        color = np.array(light.get("color", (1, 1, 1)), np.float64) * light.get("intensity", 1.0)
        value = {"type": "rgb", "value": [float(v) for v in color]}
        direction = -matrix[:3, 2] / max(float(np.linalg.norm(matrix[:3, 2])), 1e-30)
        position = matrix[:3, 3]
        if light.get("type") == "directional":
            emitter = {"type": "directional", "direction": list(direction), "irradiance": value}
        elif light.get("type") == "spot":
            cone = light.get("spot", {})
            outer, inner = cone.get("outerConeAngle", np.pi / 4), cone.get("innerConeAngle", 0.0)
            up = [0, 0, 1] if abs(direction[1]) > 0.99 else [0, 1, 0]
            emitter = {
                "type": "spot",
                "intensity": value,
                "cutoff_angle": float(np.degrees(outer)),
                "beam_width": float(np.degrees(inner)),
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=list(position), target=list(position + direction), up=up
                ),
            }
        else:
            emitter = {"type": "point", "position": list(position), "intensity": value}
        self._scene[f"light_{number}"] = emitter
        self._lit = True


def _as_float(values: np.ndarray) -> np.ndarray:
    """float32 of glTF's floats and normalised integers."""
    scale = 1.0 if values.dtype.kind == "f" else 1.0 / np.iinfo(values.dtype).max
    return np.ascontiguousarray(values * np.float32(scale), np.float32)


def _members(value: Any) -> list[dict[str, Any]]:
    return (
        [v for v in value.values() if isinstance(v, dict)]
        if isinstance(value, dict) and value.get("type") == "shapegroup"
        else []
    )
