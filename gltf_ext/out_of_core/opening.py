"""Opens models for compress --max-memory: what does not fit memory stays in files."""

from __future__ import annotations

import os
import shutil
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gltf_ext.compression.options import Options
from gltf_ext.compression.sources import Rows, Source
from gltf_ext.errors import MeshletError
from gltf_ext.gltf import obj, ply, stl
from gltf_ext.gltf.accessors import Format
from gltf_ext.gltf.container import EXPORT_AGAIN
from gltf_ext.gltf.document import Document
from gltf_ext.gltf.importers import MESH_SUFFIXES, open_model
from gltf_ext.gltf.mesh_files import Material, Mesh, to_document
from gltf_ext.out_of_core.sources import (
    BASE_BYTES,
    check_unchanged,
    fitting,
    large_primitives,
    reading,
    stamp_of,
)
from gltf_ext.progress import progress_bar, shared_progress
from gltf_ext.work_files import WorkFile

# A triangle takes at least 18 bytes in an .obj, .ply or .stl, and 300 while it is encoded.
MEMORY_OF_FILE = 16
SPACE_OF_FILE = 1.5  # of arrays in work files
RESULT_BYTES = 2  # of a triangle, about: the result is mapped into memory at the end
MAX_TRIANGLES = (1 << 32) // 3  # of a primitive: decoders number corners with 32 bits

Larges = dict[tuple[int, int], Source]  # by mesh and primitive


def open_large(path: Path, options: Options) -> tuple[Document, Larges]:
    """The document, and its primitives that do not fit memory. Raises MeshletError, OSError."""
    fitting(options)  # check
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        document = open_model(path)
        return document, _checked(large_primitives(document, path, options), path, options)
    size = os.path.getsize(path)
    if MEMORY_OF_FILE * size < options.memory - BASE_BYTES:
        return open_model(path), {}
    folder = str(options.work_dir)
    if shutil.disk_usage(folder).free < SPACE_OF_FILE * size:
        raise MeshletError(
            f"work files need {SPACE_OF_FILE * size:,.0f} bytes",
            "free some space or use another work_dir",
            path=folder,
            options=("work_dir",),
        )
    stamp = stamp_of(path)
    try:
        meshes, warnings, files = {".obj": _obj, ".ply": _ply, ".stl": _stl}[suffix](path, folder)
    except MeshletError:
        raise
    except ValueError as error:  # of _codec.scan_lines
        raise MeshletError(str(error), EXPORT_AGAIN) from None
    finally:
        check_unchanged(path, stamp)
    meshes = [mesh for mesh in meshes if mesh.triangles]
    if not meshes:
        raise MeshletError("holds no triangles", "there is nothing to compress")
    document = to_document([mesh.sketch() for mesh in meshes])
    document.base, document.import_warnings = path.parent, tuple(warnings)
    document.import_files = tuple(filter(Path.is_file, files))
    large = {(m, 0): mesh.primitive(m, options) for m, mesh in enumerate(meshes)}
    return document, _checked(large, path, options)


def _checked(large: Larges, path: Path, options: Options) -> Larges:
    """Reads the bounds of all. Raises MeshletError, also for too many triangles."""
    counts = [primitive.triangle_count for primitive in large.values()]
    for primitive, count in zip(large.values(), counts):
        if count > MAX_TRIANGLES:
            raise MeshletError(
                f"{primitive.where} has {count:,} triangles, more than {MAX_TRIANGLES:,}",
                "split the primitive",
            )
    least = BASE_BYTES + RESULT_BYTES * sum(counts)
    if options.memory < least:
        raise MeshletError(
            f"max_memory is {options.max_memory}, less than the result of {sum(counts):,} "
            "triangles takes",
            f"use at least {-(-least >> 20)}M",
            options=("max_memory",),
        )
    with progress_bar(f"reading {path.name}", options.progress) as advance:
        moves = shared_progress(advance, [count / sum(counts) for count in counts])
        for primitive, move in zip(large.values(), moves):
            primitive.read_bounds(move)
    return large


class WorkArray:
    """Rows in a work file.

    Attributes:
        form: type and number of components; count: number of rows.
    """

    def __init__(self, folder: str) -> None:
        self._file = WorkFile(folder)
        self.form: Format = (np.dtype("<f4"), 0)
        self.count = 0

    def add(self, values: np.ndarray) -> None:
        """values: [n, components] of the same type each time."""
        if self.count and (values.dtype, values.shape[1]) != self.form:
            raise MeshletError("changes the type of its values", EXPORT_AGAIN)
        self.form = values.dtype, values.shape[1]
        self._file.append(values)
        self.count += len(values)

    def rows(self, first: int, last: int) -> np.ndarray:
        """[last - first, components]. Raises OSError."""
        dtype, width = self.form
        return self._file.rows(dtype, first * width, (last - first) * width).reshape(-1, width)


@dataclass
class _Spooled:
    """A mesh in work files; see Source."""

    name: str
    attributes: dict[str, WorkArray]
    indices: list[tuple[tuple[str, ...], WorkArray | None]]
    material: Material | None = None

    @property
    def triangles(self) -> int:
        names, numbers = self.indices[0]
        return (numbers or self.attributes[names[0]]).count // 3

    def sketch(self) -> Mesh:
        """A mesh of one vertex with the same attributes."""
        first = {name: array.rows(0, 1) for name, array in self.attributes.items()}
        return Mesh(self.name, np.zeros((1, 3), np.uint32), first, self.material)

    def primitive(self, mesh: int, options: Options) -> Source:
        attributes: dict[str, Rows] = dict(self.attributes)
        return Source(mesh, 0, attributes, list(self.indices), *reading(options))


Result = tuple[list[_Spooled], list[str], list[Path]]  # as Imported


def _stl(path: Path, folder: str) -> Result:
    meshes: dict[int, _Spooled] = {}
    for number, name, corners in stl.blocks(path):
        if number not in meshes:
            attributes = {"POSITION": WorkArray(folder)}
            meshes[number] = _Spooled(name or path.name, attributes, [(("POSITION",), None)])
        meshes[number].attributes["POSITION"].add(corners.reshape(-1, 3))
    return list(meshes.values()), [], []


def _ply(path: Path, folder: str) -> Result:
    vertices: dict[str, WorkArray] = defaultdict(lambda: WorkArray(folder))
    corners: dict[str, WorkArray] = defaultdict(lambda: WorkArray(folder))
    triangles = WorkArray(folder)
    with open(path, "rb") as file:
        header = ply.read_header(file)
        for element, columns in ply.blocks(file, header):
            if element.name == "vertex":
                for name, values in ply.vertex_attributes(element, columns).items():
                    vertices[name].add(values)
            elif element.name == "face":
                found = ply.face_corners(element, columns)
                if "triangles" in found:
                    triangles.add(found.pop("triangles").reshape(-1, 1).astype("<i4"))
                for name, values in found.items():
                    corners[name].add(values)
    if "POSITION" not in vertices:
        return [], [], []
    own = {name: array for name, array in corners.items() if name not in vertices}
    indices: list[tuple[tuple[str, ...], WorkArray | None]] = [(tuple(vertices), triangles)]
    indices += [((name,), None) for name in own]
    material, warnings, files = ply.material_of(path.parent, header.texture)
    return [_Spooled(path.name, {**vertices, **own}, indices, material)], warnings, files


@dataclass
class _Faces:
    """The faces of a material of an .obj: numbers at corners of each kind; lacks: kinds that some
    corner has none of; most: the largest number of each kind."""

    numbers: list[WorkArray]
    lacks: set[int] = field(default_factory=set)
    most: list[int] = field(default_factory=lambda: [-1, -1, -1])


def _obj(path: Path, folder: str) -> Result:
    rows: dict[str, WorkArray] = defaultdict(lambda: WorkArray(folder))
    faces: dict[bytes, _Faces] = {}
    libraries: list[bytes] = []
    objects: list[bytes] = []
    for block in obj.blocks(path):
        for name, values in obj.attributes(block).items():
            rows[name].add(values)
        for material, corners in block.faces:
            found = faces.setdefault(material, _Faces([WorkArray(folder) for _ in obj.KINDS]))
            for kind, numbers in enumerate(corners):
                found.numbers[kind].add(numbers.reshape(-1, 1).astype("<i4"))
                found.most[kind] = max(found.most[kind], int(numbers.max(initial=-1)))
                if (numbers == obj.NONE).any():
                    found.lacks.add(kind)
        libraries += block.libraries
        objects += block.objects
    materials, warnings, files = obj.materials_of(path.parent, libraries)
    meshes = []
    for material, found in faces.items():
        label = material if len(faces) > 1 and material else (objects or [b""])[0]
        name = label.decode(errors="replace") or path.name
        groups, more = _groups(found, rows)
        attributes = {n: rows[n] for names, _ in groups for n in names}
        meshes.append(_Spooled(name, attributes, groups, materials.get(material)))
        warnings += [f"{name}: {line}" for line in more]
    return meshes, warnings, files


def _groups(
    faces: _Faces, rows: dict[str, WorkArray]
) -> tuple[list[tuple[tuple[str, ...], WorkArray | None]], list[str]]:
    """The attributes that a material's faces have, with their numbers, and warnings."""
    count = rows["POSITION"].count
    colors = ("COLOR_0",) if "COLOR_0" in rows and rows["COLOR_0"].count == count else ()
    names = {
        obj.VERTEX: ("POSITION", *colors),
        obj.TEXCOORD: ("TEXCOORD_0",),
        obj.NORMAL: ("NORMAL",),
    }
    groups: list[tuple[tuple[str, ...], WorkArray | None]] = []
    warnings = []
    for kind, attributes in names.items():
        if kind in faces.lacks:
            continue
        if kind == obj.VERTEX or (
            attributes[0] in rows and faces.most[kind] < rows[attributes[0]].count
        ):
            groups.append((attributes, faces.numbers[kind]))
        else:
            warnings.append(f"a face uses a {obj.NAMES[kind]} that is not there; all are left out")
    return groups, warnings
