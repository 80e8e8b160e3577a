"""load_scene: a glTF scene with compressed primitives as a Mitsuba scene."""

from __future__ import annotations

import itertools
import os
import warnings
from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import mitsuba as mi
import numpy as np

from gltf_ext.attributes.extension import read_triangles
from gltf_ext.document.document import Document
from gltf_ext.errors import MeshletError
from gltf_ext.lod.detail import missing_levels
from gltf_ext.lod.reading import LodPrimitive
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import is_compressed
from gltf_scene.camera import Camera, unit
from gltf_scene.default_light import KEY, sky_radiance
from gltf_scene.features import (
    CLEARCOAT,
    IOR,
    LIGHTS,
    METALS,
    NORMALS,
    ROUGHNESS,
    SHEEN,
    STRENGTH,
    TRANSMISSION,
    UNLIT,
    undrawn,
)
from gltf_scene.materials import read_material
from gltf_scene.scene import Light, PlacedPrimitive, is_mirrored, read_scene
from gltf_scene.values import value_format as format_of
from gltf_scene.view_points import view_points

from . import reader
from .lod import LodView, scales_alike
from .materials import Materials
from .native import fits_memory

PLUGIN = "meshlet_edgebreaker"
# glTF cameras look along -z, Mitsuba's along +z with x to the left.
FLIP_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])
# Of gltf_scene.features.
DRAWN = frozenset(
    {LIGHTS, METALS, ROUGHNESS, NORMALS, UNLIT, STRENGTH, IOR, TRANSMISSION, CLEARCOAT, SHEEN}
)
LEAST_NEAR_CLIP = 1e-5
FAR_CLIP = 1e6  # of cameras without a far plane
SKY_ROWS = 64  # of the environment map of the default sky
_group_numbers = itertools.count()


def load_scene(path: str | os.PathLike[str], **options: Any) -> mi.Scene:
    """A Mitsuba scene of a glTF file, ready for `mi.render`; options as for `scene_dict`.

    Raises OSError, and MeshletError for a file that is not valid. Features that Mitsuba lacks are
    ignored with a warning.
    """
    path = os.path.abspath(path)
    try:
        document = open_model(path)
        with reader.holding(path, document):
            scene: mi.Scene = mi.load_dict(_Builder(path, document, **options).result())
        return scene
    except MeshletError as error:
        error.path = error.path or str(path)
        raise


def scene_dict(path: str | os.PathLike[str], **options: Any) -> dict[str, Any]:
    """The dictionary that `load_scene` loads, for changes before `mi.load_dict`.

    width, height: pixels (800 x 600). spp: samples per pixel (64).
    integrator: a dictionary ({"type": "path"}).
    camera: index of a camera in the order of the scene's nodes (0); a file without cameras is
    shown whole.
    accel: how rays find triangles ("auto"), as the shape's.
    cache, cache_bytes: as the shape's, for all shapes together.
    decoded: ordinary meshes instead of compressed ones (False).
    lod_error: show primitives with levels of detail with an error of at most so many pixels for
    the camera, each instance at its own detail (0: all triangles).
    two_sided: single-sided materials show their colour on both sides instead of a black back
    (True). Paths meet these surfaces as solid: light does not pass through their backs.
    default_light: strength of a sky and a key light over the viewer's shoulder, for files without
    KHR_lights_punctual; 0 for none (1).
    """
    path = os.path.abspath(path)
    return _Builder(path, open_model(path), **options).result()


@dataclass(frozen=True)
class _Shown:
    """A primitive in one of its places. node: name of the node, or of its instance."""

    node: str
    mesh: int
    primitive: int
    material: int | None
    matrix: np.ndarray


def _nodes(primitives: list[PlacedPrimitive]) -> list[list[_Shown]]:
    """The primitives of each node, or of each instance of a node."""
    result = []
    for node, group in groupby(primitives, lambda p: p.node):
        of_node = list(group)
        count = len(of_node[0].matrices)
        for k in range(count):
            name = f"node_{node}" if count == 1 else f"node_{node}_instance_{k}"
            result.append(
                [_Shown(name, p.mesh, p.primitive, p.material, p.matrices[k]) for p in of_node]
            )
    return result


class _Builder:
    """Builds the dictionary of one document; options as for `scene_dict`."""

    def __init__(
        self,
        path: str,
        document: Document,
        *,
        width: int = 800,
        height: int = 600,
        spp: int = 64,
        integrator: dict[str, Any] | None = None,
        camera: int = 0,
        accel: str = "auto",
        cache: float | None = None,
        cache_bytes: int | None = None,
        decoded: bool = False,
        lod_error: float = 0.0,
        two_sided: bool = True,
        default_light: float = 1.0,
    ):
        self._path, self._document = path, document
        self._materials = Materials(document, two_sided)
        self._source = read_scene(document)
        pixels = "luminance" if "mono" in (mi.variant() or "") else "rgb"
        self._film: dict[str, Any] = {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": pixels,
        }
        self._spp, self._camera, self._decoded = spp, camera, decoded
        self._default_light, self._lod_error = default_light, lod_error
        self._lod: LodView | None = None  # set with the camera
        self._sources: dict[tuple[int, int], reader.Source] = {}
        self._accel = accel
        self._cache: dict[str, Any] = {} if cache is None else {"cache": cache}
        if accel == "cache" or cache is not None or cache_bytes is not None:
            self._share_cache()
        self._cache_bytes = cache_bytes
        self._scene: dict[str, Any] = {
            "type": "scene",
            "integrator": integrator or {"type": "path"},
        }

    def result(self) -> dict[str, Any]:
        if not self._source.primitives:
            raise MeshletError("its scene shows no triangles", "there is nothing to render")
        reader.require_few(self._source.primitives)
        camera = self._source.camera(self._camera) or self._default_camera()
        if self._lod_error > 0:
            size = self._film["width"], self._film["height"]
            self._lod = LodView.of_camera(camera, size, self._lod_error)
        self._add_meshes()
        for light in self._source.lights:
            self._scene[f"light_{light.node}"] = _emitter(light)
        if not self._source.lights and self._default_light > 0:
            self._scene["default_light"] = _sky(self._default_light)
            self._scene["default_key_light"] = _key_light(camera, self._default_light)
        self._scene["sensor"] = self._sensor(camera)
        levels = missing_levels(self._document) if self._lod else []
        ignored = undrawn(self._document, DRAWN)
        found = [*self._source.warnings, *self._materials.warnings, *ignored, *levels]
        for warning in found:
            warnings.warn(f"{self._path}: {warning}", stacklevel=4)
        return self._scene

    # --- meshes ---

    def _share_cache(self) -> None:
        self._cache["cache_group"] = f"load_scene {next(_group_numbers)}"

    def _add_meshes(self) -> None:
        nodes = _nodes(self._source.primitives)
        shown = [self._what_is_shown(primitives) for primitives in nodes]
        places = Counter(shown)
        groups = {
            key: f"group_{i}"
            for i, (key, primitives) in enumerate(dict(zip(shown, nodes)).items())
            # Mitsuba has no emitters in shape groups.
            if places[key] > 1 and not any(self._materials.emission(p.material) for p in primitives)
        }
        once = {
            groups.get(key, i): primitives for i, (key, primitives) in enumerate(zip(shown, nodes))
        }
        self._choose_accel([p for primitives in once.values() for p in primitives])
        for primitives, key in zip(nodes, shown):
            if key in groups:
                self._add_instance(primitives, groups[key])
            else:
                for p in primitives:
                    self._scene[f"{p.node}_{p.primitive}"] = self._shape(p, p.matrix, self._lod)

    def _choose_accel(self, shapes: list[_Shown]) -> None:
        """Takes a cache if the shapes do not fit memory together; each sees itself alone."""
        if self._accel != "auto" or self._cache or self._decoded or self._lod:
            return
        if (mi.variant() or "").startswith("cuda"):  # has no cache
            return
        primitives = [self._document.primitive(p.mesh, p.primitive) for p in shapes]
        counts = [
            self._document.accessors[p["indices"]]["count"] // 3
            for p in primitives
            if is_compressed(p) and "indices" in p
        ]
        if not fits_memory(sum(counts)):
            self._accel = "cache"
            self._share_cache()

    def _what_is_shown(self, primitives: list[_Shown]) -> tuple[Hashable, ...]:
        """Equal for nodes that can be instances of one shape group: same mesh, same details."""
        key: list[Hashable] = [primitives[0].mesh]
        for p in primitives:
            levels = self._levels(p) if self._lod is not None else None
            if self._lod is None or levels is None:
                continue
            # A shape group has its camera in its own coordinates.
            if not scales_alike(p.matrix):
                return (*key, p.node)
            key.append(self._lod.cut(levels, p.matrix).drawn.tobytes())
        return tuple(key)

    def _levels(self, placed: _Shown) -> LodPrimitive | None:
        place = placed.mesh, placed.primitive
        if not is_compressed(self._document.primitive(placed.mesh, placed.primitive)):
            return None
        if place not in self._sources:
            self._sources[place] = reader.Source(self._document, *place)
        return self._sources[place].levels

    def _add_instance(self, primitives: list[_Shown], group: str) -> None:
        """All primitives of a node, as an instance of a shape group."""
        node, matrix = primitives[0].node, primitives[0].matrix
        if group not in self._scene:
            lod = self._lod and self._lod.inside(matrix)
            members = {
                f"primitive_{p.primitive}": self._shape(p, np.eye(4), lod) for p in primitives
            }
            self._scene[group] = {"type": "shapegroup", **members}
        self._scene[node] = {
            "type": "instance",
            "group": {"type": "ref", "id": group},
            "to_world": mi.ScalarTransform4f(matrix),
        }

    def _shape(
        self, placed: _Shown, matrix: np.ndarray, lod: LodView | None
    ) -> dict[str, Any] | mi.Mesh:
        """lod: the camera in the coordinates to which the matrix leads."""
        primitive = self._document.primitive(placed.mesh, placed.primitive)
        has_colors = "COLOR_0" in primitive["attributes"]
        inside = {"bsdf": self._materials.bsdf(placed.material, has_colors)}
        emission = self._materials.emission(placed.material)
        if emission:
            inside["emitter"] = emission
        if self._decoded or not is_compressed(primitive):
            return self._plain_mesh(placed, matrix, lod, inside)
        limit = {}
        if self._cache_bytes is not None:
            limit["cache_bytes"] = self._cache_bytes
            self._cache_bytes = 0  # the shapes share a cache, whose limit is the sum of theirs
        return {
            "type": PLUGIN,
            "filename": self._path,
            "mesh": placed.mesh,
            "primitive": placed.primitive,
            "to_world": mi.ScalarTransform4f(matrix),
            "keep_outside": True,
            "accel": self._accel,
            **_lod_parameters(lod),
            **self._cache,
            **limit,
            **inside,
        }

    def _plain_mesh(
        self,
        placed: _Shown,
        matrix: np.ndarray,
        lod: LodView | None,
        inside: dict[str, Any],
    ) -> mi.Mesh:
        """A primitive that is not compressed, or is decoded."""
        levels = self._levels(placed) if lod is not None else None
        if lod is not None and levels is not None:
            source = levels.mesh(lod.cut(levels, matrix))
        else:
            source, _ = read_triangles(self._document, placed.mesh, placed.primitive)
        primitive = self._document.primitive(placed.mesh, placed.primitive)
        attributes = {
            name: format_of(self._document, primitive, name).to_floats(values)
            for name, values in source.attributes.items()
        }
        texcoord = read_material(self._document, placed.material).texcoord
        texcoords = attributes.get(f"TEXCOORD_{texcoord}")
        properties = mi.Properties()
        for name, value in inside.items():
            properties[name] = mi.load_dict(value)
        positions = attributes["POSITION"] @ matrix[:3, :3].T + matrix[:3, 3]
        normals = attributes.get("NORMAL")
        if normals is not None:
            normals = normals @ np.linalg.inv(matrix[:3, :3])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        name = f"{placed.mesh}_{placed.primitive}"
        triangles = source.indices[:, [0, 2, 1]] if is_mirrored(matrix) else source.indices
        result = ordinary_mesh(name, triangles, positions, normals, texcoords, properties)
        for own, values in attributes.items():
            for new, (skipped, count) in reader.mesh_attributes(own, values.shape[1]).items():
                flat: Any = _flat(
                    values[:, skipped : skipped + count]
                )  # the stub asks for a sequence
                result.add_attribute(new, count, flat)
        return result

    # --- cameras and lights ---

    def _default_camera(self) -> Camera:
        """Shows the whole scene from the front, a little above and to the right."""
        points = view_points(self._document, self._source.primitives)
        return Camera.fit_points(points, self._film["width"], self._film["height"])

    def _sensor(self, camera: Camera) -> dict[str, Any]:
        to_world = camera.to_world @ FLIP_CAMERA
        sensor: dict[str, Any] = {
            "near_clip": max(camera.near, LEAST_NEAR_CLIP),
            "far_clip": camera.far if np.isfinite(camera.far) else max(FAR_CLIP, 2 * camera.near),
            "film": self._film,
            "sampler": {"type": "multijitter", "sample_count": self._spp},
        }
        if camera.yfov is None:
            to_world = to_world @ np.diag([camera.xmag, camera.xmag, 1.0, 1.0])
            sensor["type"] = "orthographic"
        else:
            sensor["type"] = "perspective"
            sensor["fov"], sensor["fov_axis"] = float(np.degrees(camera.yfov)), "y"
        return {**sensor, "to_world": mi.ScalarTransform4f(to_world)}


def _sky(strength: float) -> dict[str, Any]:
    """The default sky as an environment map."""
    latitude = (np.arange(SKY_ROWS) + 0.5) * np.pi / SKY_ROWS
    directions = np.zeros((SKY_ROWS, 2 * SKY_ROWS, 3))
    directions[..., 1] = np.cos(latitude)[:, None]  # only the height counts
    radiance = strength * sky_radiance(directions)
    return {"type": "envmap", "bitmap": mi.Bitmap(radiance.astype(np.float32))}


def _key_light(camera: Camera, strength: float) -> dict[str, Any]:
    """The default key light, over the viewer's shoulder."""
    irradiance = [strength * np.pi * v for v in KEY]
    return {
        "type": "directional",
        "direction": [-v for v in camera.light_direction()],
        "irradiance": {"type": "rgb", "value": irradiance},
    }


def _emitter(light: Light) -> dict[str, Any]:
    """A light of KHR_lights_punctual; lux and candela are taken for Mitsuba's units."""
    value = {"type": "rgb", "value": list(light.color)}
    direction, position = unit(-light.matrix[:3, 2]), light.matrix[:3, 3]
    if light.kind == "directional":
        return {"type": "directional", "direction": list(direction), "irradiance": value}
    if light.kind == "point":
        return {"type": "point", "position": list(position), "intensity": value}
    up = [0, 0, 1] if abs(direction[1]) > 0.99 else [0, 1, 0]
    return {
        "type": "spot",
        "intensity": value,
        "cutoff_angle": float(np.degrees(light.outer_cone)),
        "beam_width": float(np.degrees(light.inner_cone)),
        "to_world": mi.ScalarTransform4f().look_at(
            origin=list(position), target=list(position + direction), up=up
        ),
    }


def _lod_parameters(lod: LodView | None) -> dict[str, Any]:
    """The shape's."""
    if lod is None:
        return {}
    eye = {} if lod.view.eye is None else {"lod_eye": list(lod.view.eye)}
    scale = {"lod_pixels_per_unit": lod.view.pixels_per_unit}
    return {"lod_error": lod.max_pixels, **scale, **eye}


def ordinary_mesh(
    name: str,
    triangles: np.ndarray,
    positions: np.ndarray,
    normals: np.ndarray | None = None,
    texcoords: np.ndarray | None = None,
    properties: mi.Properties | None = None,
) -> mi.Mesh:
    """Mitsuba's own mesh of [n, components] arrays. properties: its BSDF and emitter."""
    mesh = mi.Mesh(
        name,
        len(positions),
        len(triangles),
        mi.Properties() if properties is None else properties,
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=texcoords is not None,
    )
    parameters = mi.traverse(mesh)
    parameters["faces"] = triangles.astype(np.uint32).ravel()
    arrays = {"positions": positions, "normals": normals, "texcoords": texcoords}
    for role, values in arrays.items():
        if values is not None:
            parameters[f"vertex_{role}"] = _flat(values)
    parameters.update()
    return mesh


def _flat(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32).ravel()
