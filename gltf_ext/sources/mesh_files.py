"""What .obj, .ply and .stl have in common: meshes of a file, and the glTF document of them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.document import gltf
from gltf_ext.document.accessors import add_accessor, bounds, set_bounds
from gltf_ext.document.document import Document
from gltf_ext.document.images import as_png_or_jpeg, mime_type
from gltf_ext.errors import MeshletError
from gltf_ext.portable import path_beside
from gltf_ext.ranges import first_of_each
from gltf_ext.sources.limits import check_vertex_count
from gltf_ext.sources.row_arrays import Numbering, Rows

CLAMP_TO_EDGE = 33071  # of OpenGL, as in glTF
# Names of the objects that lead to a texture in a glTF material.
TexturePath = tuple[str, ...]
BASE_COLOR: TexturePath = ("pbrMetallicRoughness", "baseColorTexture")
METAL_ROUGH: TexturePath = ("pbrMetallicRoughness", "metallicRoughnessTexture")
EMISSIVE: TexturePath = ("emissiveTexture",)
NORMAL: TexturePath = ("normalTexture",)
TRANSFORM, STRENGTH = "KHR_texture_transform", "KHR_materials_emissive_strength"
Vector = tuple[float, float, float]
NO_OFFSET: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Texture:
    """An image of a material, and how glTF's texture coordinates find its pixels.

    Attributes:
        image: encoded, as PNG or JPEG.
        clamps: whether its border goes on outside of it, instead of the image.
        offset, scale: texture coordinates are multiplied by the scale, then moved.
        more: members of the texture's object in a material, such as a normal map's scale.
    """

    image: bytes
    clamps: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    more: tuple[tuple[str, float], ...] = ()


@dataclass(eq=False)
class Material:
    """A material of primitives.

    Attributes:
        properties: a glTF material without textures.
        textures: by their paths in a glTF material.
        untextured: what primitives without texture coordinates have instead.
    """

    properties: dict[str, Any]
    textures: Mapping[TexturePath, Texture] = field(default_factory=dict)
    untextured: Material | None = None

    def for_attributes(self, attributes: Mapping[str, Any]) -> Material | None:
        """Return the material of a primitive with these attributes, by name."""
        return self.untextured if self.textures and "TEXCOORD_0" not in attributes else self


@dataclass
class IndexedPrimitive:
    """A primitive in memory whose attributes have the same numbers at corners, as in glTF.

    Attributes:
        triangles: uint32[T, 3]; attributes: name -> float32[V, n], uint8[V, 4] for COLOR_0, or
            [V, 1] of any type for a name of the file's own.
    """

    triangles: np.ndarray
    attributes: dict[str, np.ndarray]
    material: Material | None


class Parent(NamedTuple):
    """A node over those of meshes. number: tells parents of one name apart."""

    number: int
    name: str


@dataclass
class IndexedMesh:
    """A mesh of these primitives; parent: as in Mesh."""

    name: str
    primitives: list[IndexedPrimitive]
    parent: Parent | None = None


@dataclass
class MeshPrimitive:
    """Triangles of one material with the same attributes, as a file has them.

    Attributes:
        attributes: name -> rows, of types as in IndexedPrimitive.
        numberings: each attribute is in one, with numbers of int32. One without numbers has one
            attribute, whose rows are the values at the corners.
        shares_rows: whether other primitives use the same rows. Those that this one does not use
            are then no vertices of it.
    """

    attributes: dict[str, Rows]
    numberings: list[Numbering]
    material: Material | None = None
    shares_rows: bool = False

    @property
    def triangle_count(self) -> int:
        """The number of triangles."""
        names, numbers = self.numberings[0]
        return (numbers or self.attributes[names[0]]).count // 3

    def indexed(self) -> IndexedPrimitive:
        """Return it with a vertex for each different combination of rows at a corner."""
        values = {name: rows.rows(0, rows.count) for name, rows in self.attributes.items()}
        if len(self.numberings) == 1 and not self.shares_rows:
            ((_, numbers),) = self.numberings
            triangles = (
                np.arange(3 * self.triangle_count, dtype=np.uint32).reshape(-1, 3)
                if numbers is None
                else _read(numbers)
            )
            return self._with(triangles.view(np.uint32), values)
        if any(numbers is None for _, numbers in self.numberings):
            check_vertex_count(3 * self.triangle_count, "corners")
        corners = [
            _of_equal_rows(values[names[0]]) if numbers is None else _read(numbers)
            for names, numbers in self.numberings
        ]
        triangles, vertex_numbers = split_vertices(corners)
        rows_of = {
            name: rows
            for (names, _), rows in zip(self.numberings, vertex_numbers)
            for name in names
        }
        return self._with(triangles, {name: values[name][rows_of[name]] for name in values})

    def sample(self) -> IndexedPrimitive:
        """Return one vertex with the same attributes, in the order of their numberings."""
        names = [name for names, _ in self.numberings for name in names]
        first = {name: self.attributes[name].rows(0, 1) for name in names}
        return self._with(np.zeros((1, 3), np.uint32), first)

    def _with(self, triangles: np.ndarray, values: dict[str, np.ndarray]) -> IndexedPrimitive:
        return IndexedPrimitive(triangles, values, self.material)


@dataclass
class Mesh:
    """Primitives of one name. parent: the node over its own, if there is one."""

    name: str
    primitives: list[MeshPrimitive]
    parent: Parent | None = None


@dataclass
class MeshFile:
    """The contents of an .obj, .ply or .stl.

    Attributes:
        warnings: a line for each thing that is left out.
        others: the other files that were looked for, such as materials and textures.
        images: file -> its image as PNG or JPEG, of those that materials have read.
        offset: of all positions, which are without it.
        rounding: the largest difference of a coordinate to that in the file.
    """

    meshes: list[Mesh]
    warnings: list[str] = field(default_factory=list)
    others: list[Path] = field(default_factory=list)
    images: dict[Path, bytes] = field(default_factory=dict)
    offset: Vector = NO_OFFSET
    rounding: float = 0.0

    def keep_triangles(self) -> None:
        """Forget primitives without triangles, and meshes without primitives."""
        for mesh in self.meshes:
            mesh.primitives = [p for p in mesh.primitives if p.triangle_count]
        self.meshes = [mesh for mesh in self.meshes if mesh.primitives]

    def numbered_primitives(self) -> Iterator[tuple[int, int, MeshPrimitive]]:
        """Yield (mesh, primitive, object) of each primitive."""
        for m, mesh in enumerate(self.meshes):
            for p, primitive in enumerate(mesh.primitives):
                yield m, p, primitive


# --- other files ---


def is_there(path: Path | None) -> bool:
    """Return whether `path_beside` leads to a file; False for a name too long for the system."""
    return path is not None and os.path.isfile(path)


def beside(folder: Path, name: str) -> list[Path]:
    """List where a file may be that a model in the folder names: there, else in the folder itself.

    The second is where files are that once had an absolute path on another machine.
    """
    names = dict.fromkeys((name, name.replace("\\", "/").rpartition("/")[2]))
    paths = (path_beside(folder, n) for n in names if n not in ("", ".", ".."))
    return list(dict.fromkeys(path for path in paths if path is not None))


def named_file(folder: Path, name: str, contents: MeshFile, loss: str) -> Path | None:
    """Return a file that a model in the folder names, if it is there; else note a warning.

    loss: what is left out without it.
    """
    for path in beside(folder, name):
        if path not in contents.others:
            contents.others.append(path)
        if is_there(path):
            return path
    problem = "is not there" if path_beside(folder, name) else "is not a relative path"
    warn(contents, f"{short(name)} {problem}, so {loss}")
    return None


def read_texture(folder: Path, name: str, contents: MeshFile) -> bytes | None:
    """Return an image that a model in the folder names, as PNG or JPEG; else note a warning."""
    loss = "this texture is left out"
    path = named_file(folder, name, contents, loss)
    if path is None:
        return None
    try:
        if path not in contents.images:
            contents.images[path] = as_png_or_jpeg(path.read_bytes())
        return contents.images[path]
    except (MeshletError, OSError) as error:
        problem = error.message if isinstance(error, MeshletError) else "it cannot be read"
        warn(contents, f"{short(name)}: {problem}, so {loss}")
        return None


def warn(contents: MeshFile, line: str) -> None:
    """Note a warning, once."""
    if line not in contents.warnings:
        contents.warnings.append(line)


def short(name: str) -> str:
    """Return a name of a file for a warning, on one line."""
    return MeshletError(name or '""').message


# --- vertices ---


def _read(numbers: Rows) -> np.ndarray:
    """int32[T, 3]."""
    return numbers.rows(0, numbers.count).reshape(-1, 3)


def _of_equal_rows(values: np.ndarray) -> np.ndarray:
    """int32[T, 3]: for each corner, the first with the same value. values: [3 T, components]."""
    remap, count = _codec.weld(np.ascontiguousarray(values).view(np.uint8))
    return first_of_each(remap, count)[remap].view(np.int32).reshape(-1, 3)


def split_vertices(corners: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Make a vertex of each different combination of numbers at a corner.

    corners: int32[T, 3] for each kind of number. Returns (triangles: uint32[T, 3], the vertices'
    numbers of each kind: int32[V]).
    """
    first, *others = corners
    keys = [first, *(c for c in others if not np.array_equal(c, first))]
    if len(keys) == 1:
        used = np.zeros(int(first.max(initial=-1)) + 1, bool)
        used[first.reshape(-1)] = True
        rows = np.flatnonzero(used).astype(np.int32)
        new = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
        return new[first], [rows] * len(corners)
    table = np.stack([key.reshape(-1) for key in keys], axis=1)
    remap, count = _codec.weld(table.view(np.uint8))
    at = first_of_each(remap, count)
    return remap.reshape(-1, 3), [c.reshape(-1)[at] for c in corners]


def to_floats(values: np.ndarray) -> np.ndarray:
    """Return float32; numbers beyond its largest become infinite, which compress refuses."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32, copy=False)


def to_texcoords(values: np.ndarray) -> np.ndarray:
    """Turn texture coordinates [n, 2] with v upwards into those of glTF: v grows downwards."""
    return to_floats(np.stack([values[:, 0], 1 - values[:, 1]], axis=1))


# --- the document ---


def to_document(meshes: Sequence[IndexedMesh], offset: Vector = NO_OFFSET) -> Document:
    """Return a document with a node for each mesh, and for each parent of some.

    offset: translation of the root nodes.
    """
    primitives = [primitive for mesh in meshes for primitive in mesh.primitives]
    of_primitives = [p.material and p.material.for_attributes(p.attributes) for p in primitives]
    materials = list(dict.fromkeys(m for m in of_primitives if m))
    document = Document(
        {"asset": {"version": "2.0"}, "scene": 0, **_nodes(meshes, offset), **_materials(materials)}
    )
    images = _images(materials)
    for holder, image in zip(document.images, images):
        holder["bufferView"] = document.add_view(image)
    remaining = iter(of_primitives)
    for mesh in meshes:
        items = [_primitive(document, p, next(remaining), materials) for p in mesh.primitives]
        document.meshes.append({"name": _text(mesh.name), "primitives": items})
    return document


def _primitive(
    document: Document,
    primitive: IndexedPrimitive,
    material: Material | None,
    materials: list[Material],
) -> gltf.Primitive:
    result: gltf.Primitive = {
        "indices": add_accessor(document, primitive.triangles.reshape(-1, 1)),
        "attributes": {
            name: add_accessor(document, values, normalized=name.startswith("COLOR_"))
            for name, values in primitive.attributes.items()
        },
    }
    if material:
        result["material"] = materials.index(material)
    position = document.accessors[result["attributes"]["POSITION"]]
    set_bounds(position, *bounds(primitive.attributes["POSITION"]))
    return result


def _text(name: str) -> str:
    return name.encode(errors="replace").decode()


def _nodes(meshes: Sequence[IndexedMesh], offset: Vector) -> dict[str, Any]:
    """Return nodes and the scene: a node for each mesh, then those of parents."""
    nodes: list[dict[str, Any]] = [
        {"mesh": i, "name": _text(mesh.name)} for i, mesh in enumerate(meshes)
    ]
    parents: dict[Parent, int] = {}
    roots: list[int] = []
    for i, mesh in enumerate(meshes):
        if mesh.parent is None:
            roots.append(i)
            continue
        if mesh.parent not in parents:
            parents[mesh.parent] = len(nodes)
            roots.append(len(nodes))
            nodes.append({"name": _text(mesh.parent.name), "children": []})
        nodes[parents[mesh.parent]]["children"].append(i)
    if any(offset):
        for root in roots:
            nodes[root]["translation"] = list(offset)
    return {"nodes": nodes, "scenes": [{"nodes": roots}]}


def _images(materials: Iterable[Material]) -> list[bytes]:
    return list(dict.fromkeys(t.image for m in materials for t in m.textures.values()))


def _materials(materials: list[Material]) -> dict[str, Any]:
    """Return the document's members for materials; images have no bytes yet."""
    images = {image: i for i, image in enumerate(_images(materials))}
    textures = list(
        dict.fromkeys((t.image, t.clamps) for m in materials for t in m.textures.values())
    )
    sampler = {"wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE}
    objects = [_with_textures(material, textures) for material in materials]
    used = [name for name in (STRENGTH, TRANSFORM) if any(_has_member(o, name) for o in objects)]
    return {
        "materials": objects,
        "textures": [
            {"source": images[image], **({"sampler": 0} if clamps else {})}
            for image, clamps in textures
        ],
        "samplers": [sampler] if any(clamps for _, clamps in textures) else [],
        "images": [{"mimeType": mime_type(image)} for image in images],
        **({"extensionsUsed": used} if used else {}),
    }


def _has_member(value: Any, name: str) -> bool:
    """Return whether objects have a member of this name, at any depth."""
    return isinstance(value, dict) and (
        name in value or any(_has_member(member, name) for member in value.values())
    )


def _with_textures(material: Material, textures: list[tuple[bytes, bool]]) -> dict[str, Any]:
    """Return its glTF properties with textures, which have the numbers of those in the list."""
    result = dict(material.properties)
    for (*objects, last), texture in material.textures.items():
        holder = result
        for name in objects:
            holder[name] = dict(holder.get(name, {}))
            holder = holder[name]
        info: dict[str, Any] = {"index": textures.index((texture.image, texture.clamps))}
        if (texture.offset, texture.scale) != ((0.0, 0.0), (1.0, 1.0)):
            transform = {"offset": list(texture.offset), "scale": list(texture.scale)}
            info["extensions"] = {TRANSFORM: transform}
        holder[last] = {**info, **dict(texture.more)}
    return result
