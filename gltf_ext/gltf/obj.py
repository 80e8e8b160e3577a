"""Reads .obj files and their materials, in blocks."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.errors import MeshletError
from gltf_ext.gltf.container import EXPORT_AGAIN
from gltf_ext.gltf.images import read_texture
from gltf_ext.gltf.mesh_files import (
    Collected,
    Imported,
    Material,
    Mesh,
    check_numbers,
    color_bytes,
    fans,
    picked,
    split_vertices,
    text_blocks,
    to_floats,
    to_texcoords,
    words_after,
)
from gltf_ext.portable import file_name

VERTEX, TEXCOORD, NORMAL = range(3)
KINDS = ("v", "vt", "vn")
KEYWORDS = {
    **dict.fromkeys(KINDS, "numbers"),
    "f": "corners",
    **dict.fromkeys(("usemtl", "mtllib", "o"), "any"),
}
NAMES = ("vertex", "texture coordinate", "normal")
FEWEST = (3, 2, 3)  # numbers of a line
NONE = -1


class Block(NamedTuple):
    """A piece of the file.

    rows: float64[n, columns] of v, vt and vn; columns: the fewest of a line, at least FEWEST.
    faces: (material, corners) in the order of the file. corners: int32[T, 3] for v, vt and vn, the
        numbers from 0 at each corner of the triangles; NONE where there is none.
    libraries, objects: names after mtllib and o.
    """

    rows: list[np.ndarray]
    faces: list[tuple[bytes, list[np.ndarray]]]
    libraries: list[bytes]
    objects: list[bytes]


def blocks(path: Path) -> Iterator[Block]:
    """The file in order. A face may use vertices of later blocks. Raises MeshletError, OSError."""
    totals, material = [0, 0, 0], b""
    with open(path, "rb") as file:
        for text in text_blocks(file):
            *scans, found, uses, libraries, objects = _codec.scan_lines(text, KEYWORDS)
            rows = [_rows(scan[0], scan[1], kind) for kind, scan in enumerate(scans)]
            numbers, counts, at = found
            above = _Above(totals, [scan[2] for scan in scans], at)
            corners, triangles = _triangles(numbers.reshape(-1, 3), counts // 3, above)
            faces = []
            names = [material, *words_after(text, uses[2])]
            ends = np.concatenate([[0], np.cumsum(triangles)])
            cuts = ends[np.searchsorted(at, [0, *uses[2]])]
            for material, first, last in zip(names, cuts, [*cuts[1:], ends[-1]]):
                if last > first:
                    faces.append((material, [numbers[first:last] for numbers in corners]))
            yield Block(rows, faces, *(words_after(text, k[2]) for k in (libraries, objects)))
            totals = [total + len(r) for total, r in zip(totals, rows)]


class _Above(NamedTuple):
    """totals: lines of each kind before the block; offsets: of those in it; at: of its faces."""

    totals: list[int]
    offsets: list[np.ndarray]
    at: np.ndarray

    def lines(self, kind: int) -> np.ndarray:
        """int32: for each face, the number of lines of a kind above it."""
        found = np.searchsorted(self.offsets[kind], self.at) + self.totals[kind]
        return found.astype(np.int32)


def _rows(numbers: np.ndarray, counts: np.ndarray, kind: int) -> np.ndarray:
    if not len(counts):
        return np.empty((0, 6))
    columns = int(counts.min())
    if columns < FEWEST[kind]:
        raise MeshletError(f"has a {NAMES[kind]} of {columns} numbers", EXPORT_AGAIN)
    if columns == counts.max():
        return numbers.reshape(-1, columns)
    starts = np.cumsum(counts, dtype=np.int64) - counts
    rows: np.ndarray = numbers[starts[:, None] + np.arange(columns)]
    return rows


def _triangles(
    numbers: np.ndarray, sizes: np.ndarray, above: _Above
) -> tuple[list[np.ndarray], np.ndarray]:
    """Corners of triangles, as in Block, and triangles of each face.

    numbers: int32[corners, 3] as written: from 1, or negative and counted back from the face.
    """
    corners, counts = fans(sizes.astype(np.int64))
    result = []
    for kind in range(len(KINDS)):
        written = numbers[:, kind].copy()
        if not written.any():
            result.append(np.broadcast_to(np.int32(NONE), (int(counts.sum()), 3)))
            continue
        relative = written < 0
        written -= 1
        if relative.any():
            written[relative] += np.repeat(above.lines(kind), sizes)[relative] + 1
            if (written[relative] < 0).any():
                raise MeshletError(f"a face uses a {NAMES[kind]} before the first", EXPORT_AGAIN)
        result.append(picked(written, corners))
    if (result[VERTEX] == NONE).any():
        raise MeshletError("a face uses vertex 0", EXPORT_AGAIN)
    return result, counts


def read(path: Path) -> Imported:
    """A mesh for each material that has triangles. Raises MeshletError, OSError."""
    rows: dict[str, Collected] = defaultdict(Collected)
    faces: dict[bytes, list[list[np.ndarray]]] = defaultdict(list)
    libraries: list[bytes] = []
    objects: list[bytes] = []
    for block in blocks(path):
        for attribute, values in attributes(block).items():
            rows[attribute].add(values)
        for material, corners in block.faces:
            faces[material].append(corners)
        libraries += block.libraries
        objects += block.objects
    table = {attribute: collected.rows() for attribute, collected in rows.items()}
    if len(table.get("COLOR_0", ())) < len(table.get("POSITION", ())):
        table.pop("COLOR_0", None)  # some vertices have none
    materials, warnings, files = materials_of(path.parent, libraries)
    whole = objects[0] if objects else b""
    several = len(faces) > 1
    meshes = []
    for material in list(faces):
        label = material if several and material else whole
        name = label.decode(errors="replace") or path.name
        triangles, values_of, more = _vertices(faces.pop(material), table)
        meshes.append(Mesh(name, triangles, values_of, materials.get(material)))
        warnings += [f"{name}: {line}" for line in more]
    return meshes, warnings, files


def attributes(block: Block) -> dict[str, np.ndarray]:
    """glTF's attributes for each line of v (POSITION, COLOR_0), vt and vn, as in Mesh."""
    v, vt, vn = block.rows
    result = {"POSITION": to_floats(v[:, :3]), "NORMAL": to_floats(vn[:, :3])}
    result["TEXCOORD_0"] = to_texcoords(vt)
    result = {name: values for name, values in result.items() if len(values)}
    if len(v) and v.shape[1] >= 6:
        result["COLOR_0"] = color_bytes(v[:, 3:6], v.dtype)
    return result


def _vertices(
    parts: list[list[np.ndarray]], table: dict[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray], list[str]]:
    """Triangles and attributes, as in Mesh, and warnings: a vertex per combination of numbers.

    parts: corners, as in Block. An attribute that some corner lacks is left out.
    """
    used, warnings = {}, []
    for attribute, kind in (("POSITION", VERTEX), ("TEXCOORD_0", TEXCOORD), ("NORMAL", NORMAL)):
        if any((part[kind] == NONE).any() for part in parts):
            continue
        numbers = np.concatenate([part[kind] for part in parts])
        if kind == VERTEX or numbers.max() < len(table.get(attribute, ())):
            used[attribute] = numbers
        else:
            warnings.append(f"a face uses a {NAMES[kind]} that is not there; all are left out")
    check_numbers(used["POSITION"], len(table.get("POSITION", ())), NAMES[VERTEX])
    triangles, numbers_of = split_vertices(list(used.values()))
    values = {attribute: table[attribute][n] for attribute, n in zip(used, numbers_of)}
    if "COLOR_0" in table:
        values["COLOR_0"] = table["COLOR_0"][numbers_of[0]]
    return triangles, values, warnings


# --- materials ---


def referenced_files(path: Path) -> list[Path]:
    """The libraries that a file names, and the images that those of them name that exist."""
    with open(path, "rb") as file:
        names = [name for text in text_blocks(file) for name in _libraries_of(text)]
    libraries = [path.parent / file_name(name) for name in dict.fromkeys(names)]
    images = [
        path.parent / texture
        for library in libraries
        if library.is_file()
        for _, lines in _libraries_materials(library.read_bytes())
        if (texture := _texture_of(lines))
    ]
    return [*libraries, *dict.fromkeys(images)]


def _libraries_of(text: bytes) -> list[bytes]:
    ((_, _, offsets),) = _codec.scan_lines(text, {"mtllib": "any"})
    return words_after(text, offsets)


def materials_of(
    folder: Path, libraries: list[bytes]
) -> tuple[dict[bytes, Material], list[str], list[Path]]:
    """The materials of all libraries by name, warnings for files that are not there, and the files
    that were looked for."""
    materials: dict[bytes, Material] = {}
    warnings: list[str] = []
    files: list[Path] = []
    for library in dict.fromkeys(libraries):
        path = folder / file_name(library)
        files.append(path)
        if not path.is_file():
            warnings.append(f"{path.name} is not there, so its material is left out")
            continue
        for name, lines in _libraries_materials(path.read_bytes()):
            materials[name], more = _material(folder, name, lines)
            warnings += more
            if texture := _texture_of(lines):
                files.append(folder / texture)
    return materials, warnings, files


Lines = dict[bytes, list[bytes]]  # keyword in lower case -> the words after it


def _libraries_materials(text: bytes) -> Iterator[tuple[bytes, Lines]]:
    """Name and lines of each material."""
    name, lines = b"", Lines()
    for line in text.splitlines():
        keyword, *words = line.split() or [b""]
        if keyword.lower() == b"newmtl":
            if name:
                yield name, lines
            name, lines = b" ".join(words), Lines()
        elif words:
            lines[keyword.lower()] = words
    if name:
        yield name, lines


def _texture_of(lines: Lines) -> str:
    """The file of a material's texture, empty for none."""
    return file_name(b" ".join(lines.get(b"map_kd", [])))


def _material(folder: Path, name: bytes, lines: Lines) -> tuple[Material, tuple[str, ...]]:
    """A glTF material of base colour (Kd, map_Kd) and shininess (Ns), and warnings."""
    shininess = (_numbers(lines.get(b"ns", [])) or [1.0])[0]
    pbr: dict[str, Any] = {
        "metallicFactor": 0.0,
        "roughnessFactor": (2 / (max(shininess, 0.0) + 2)) ** 0.25,
    }
    color = _numbers(lines.get(b"kd", []))
    if len(color) == 3:
        pbr["baseColorFactor"] = [*(min(max(c, 0.0), 1.0) for c in color), 1.0]
    properties = {"name": name.decode(errors="replace"), "pbrMetallicRoughness": pbr}
    texture = _texture_of(lines)
    if not texture:
        return Material(properties), ()
    image, warnings = read_texture(folder, texture)
    return Material(properties, image), warnings


def _numbers(words: list[bytes]) -> list[float]:
    """Nothing if any word is not a finite number."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
