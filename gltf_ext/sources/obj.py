"""Reads .obj files and their materials, in blocks."""

from __future__ import annotations

import codecs
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gltf_ext import _codec
from gltf_ext.document.container import EXPORT_AGAIN
from gltf_ext.errors import MeshletError
from gltf_ext.portable import file_name, path_beside
from gltf_ext.sources.mesh_files import (
    CornerNumbers,
    Group,
    Material,
    Mesh,
    MeshFile,
    at_corners,
    color_bytes,
    fans,
    is_there,
    named_file,
    read_texture,
    text_blocks,
    to_floats,
    to_texcoords,
    words_after,
)
from gltf_ext.sources.row_arrays import NewRows, RowArray, add_all

VERTEX, TEXCOORD, NORMAL = range(3)
KINDS = ("v", "vt", "vn")
KEYWORDS = {
    **dict.fromkeys(KINDS, "numbers"),
    "f": "corners",
    **dict.fromkeys(("usemtl", "mtllib", "o"), "any"),
}
NAMES = ("vertex", "texture coordinate", "normal")
ATTRIBUTES = ("POSITION", "TEXCOORD_0", "NORMAL", "COLOR_0")  # of each kind; colours of vertices
FEWEST = (3, 1, 3)  # numbers of a line
# Option of a texture -> the words after it, at most, and those that do not change the picture.
TEXTURE_OPTIONS: dict[bytes, tuple[int, list[Any] | None]] = {
    **dict.fromkeys((b"-blendu", b"-blendv", b"-bm", b"-boost"), (1, None)),
    **dict.fromkeys((b"-imfchan", b"-texres", b"-type"), (1, None)),
    **dict.fromkeys((b"-cc", b"-clamp"), (1, [b"off"])),
    b"-mm": (2, [0.0, 1.0]),
    **dict.fromkeys((b"-o", b"-t"), (3, [0.0, 0.0, 0.0])),  # 1 to 3 numbers
    b"-s": (3, [1.0, 1.0, 1.0]),
}
NONE = -1
MOST_LIBRARIES = 1000  # of a line


class Block(NamedTuple):
    """A piece of the file.

    rows: float64[n, columns] of v, vt and vn; columns: the fewest of a line, but 2 of vt.
    faces: material -> for v, vt and vn, int32[T, 3]: the numbers from 0 at each corner of its
        triangles, in the order of the file; NONE where there is none.
    libraries, objects: names after mtllib and o.
    """

    rows: list[np.ndarray]
    faces: dict[bytes, list[np.ndarray]]
    libraries: list[bytes]
    objects: list[bytes]


def blocks(path: Path) -> Iterator[Block]:
    """Yield the file in order. A face may use vertices of later blocks.

    Raises MeshletError, OSError.
    """
    totals, material = [0, 0, 0], b""
    with open(path, "rb") as file:
        for text in text_blocks(file):
            *scans, of_faces, uses, libraries, objects = _codec.scan_lines(text, KEYWORDS)
            rows = [_rows(scan[0], scan[1], kind) for kind, scan in enumerate(scans)]
            numbers, counts, at = of_faces
            above = _Above(totals, [scan[2] for scan in scans], at)
            corners, triangles = _triangles(numbers.reshape(-1, 3), counts // 3, above)
            parts: dict[bytes, list[slice]] = defaultdict(list)
            names = [material, *words_after(text, uses[2])]
            ends = np.concatenate([[0], np.cumsum(triangles)])
            cuts = ends[np.searchsorted(at, [0, *uses[2]])]
            for material, first, last in zip(names, cuts, [*cuts[1:], ends[-1]]):
                if last > first:
                    parts[material].append(slice(first, last))
            faces = {
                name: [_joined(kind, part) for kind in corners] for name, part in parts.items()
            }
            yield Block(rows, faces, *(words_after(text, k[2]) for k in (libraries, objects)))
            totals = [total + len(r) for total, r in zip(totals, rows)]


def _joined(rows: np.ndarray, parts: list[slice]) -> np.ndarray:
    return rows[parts[0]] if len(parts) == 1 else np.concatenate([rows[part] for part in parts])


class _Above(NamedTuple):
    """totals: lines of each kind before the block; offsets: of those in it; at: of its faces."""

    totals: list[int]
    offsets: list[np.ndarray]
    at: np.ndarray

    def lines(self, kind: int) -> np.ndarray:
        """int32: for each face, the number of lines of a kind above it."""
        lines = np.searchsorted(self.offsets[kind], self.at) + self.totals[kind]
        return lines.astype(np.int32)


def _rows(numbers: np.ndarray, counts: np.ndarray, kind: int) -> np.ndarray:
    if not len(counts):
        return np.empty((0, 6))
    columns = int(counts.min())
    if columns < FEWEST[kind]:
        raise MeshletError(f"has a {NAMES[kind]} of {columns} numbers", EXPORT_AGAIN)
    if kind == TEXCOORD and columns == 1:  # a line without v, which is 0
        numbers = np.insert(numbers, np.cumsum(counts, dtype=np.int64)[counts == 1], 0.0)
        counts = np.maximum(counts, 2)
        columns = 2
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
        result.append(at_corners(written, corners))
    if (result[VERTEX] == NONE).any():
        raise MeshletError("a face uses vertex 0", EXPORT_AGAIN)
    return result, counts


def read(path: Path, new_rows: NewRows) -> MeshFile:
    """Read a mesh for each material that has triangles. Raises MeshletError, OSError."""
    table: dict[str, RowArray] = defaultdict(new_rows)
    faces: dict[bytes, list[CornerNumbers]] = defaultdict(
        lambda: [CornerNumbers(new_rows()) for _ in KINDS]
    )
    libraries: list[bytes] = []
    objects: list[bytes] = []
    for block in blocks(path):
        add_all(table, attributes(block))
        for material, corners in block.faces.items():
            for numbers, more in zip(faces[material], corners):
                numbers.add(more)
        libraries += block.libraries
        objects += block.objects
    contents = MeshFile([])
    materials = _materials_of(path.parent, libraries, contents)
    for material, numbers_of_kinds in faces.items():
        label = material if len(faces) > 1 and material else (objects or [b""])[0]
        name = label.decode(errors="replace") or path.name
        groups, problems = _groups(numbers_of_kinds, table)
        of_groups = {attribute for names, _ in groups for attribute in names}
        rows = {attribute: table[attribute] for attribute in ATTRIBUTES if attribute in of_groups}
        contents.meshes.append(Mesh(name, rows, groups, materials.get(material), shares_rows=True))
        contents.warnings += [f"{name}: {problem}" for problem in problems]
    return contents


def attributes(block: Block) -> dict[str, np.ndarray]:
    """Return the attributes of each line of v (POSITION, COLOR_0), vt and vn, as in Mesh."""
    v, vt, vn = block.rows
    result = {"POSITION": to_floats(v[:, :3]), "NORMAL": to_floats(vn[:, :3])}
    result["TEXCOORD_0"] = to_texcoords(vt)
    result = {name: values for name, values in result.items() if len(values)}
    if len(v) and v.shape[1] >= 6:
        result["COLOR_0"] = color_bytes(v[:, 3:6], v.dtype)
    return result


def _groups(
    numbers_of_kinds: list[CornerNumbers], table: dict[str, RowArray]
) -> tuple[list[Group], list[str]]:
    """Group the attributes that all corners of a material have, and warn of numbers without rows.

    table: the rows of all attributes.
    """
    counts = {attribute: table[attribute].count for attribute in ATTRIBUTES}
    vertex, *others = numbers_of_kinds
    vertex.check(counts["POSITION"], NAMES[VERTEX])
    all_have_colors = counts["COLOR_0"] == counts["POSITION"]
    of_vertices = ("POSITION", "COLOR_0") if all_have_colors else ("POSITION",)
    groups: list[Group] = [(of_vertices, vertex.rows)]
    warnings = []
    for attribute, kind, numbers in zip(ATTRIBUTES[1:], NAMES[1:], others):
        if numbers.least < 0:
            continue  # some corner has none
        if numbers.most < counts[attribute]:
            groups.append(((attribute,), numbers.rows))
        else:
            warnings.append(f"a face uses a {kind} that is not there; all are left out")
    return groups, warnings


# --- materials ---


def referenced_files(path: Path) -> list[Path]:
    """List the libraries that a file may name, and the images that those that exist name."""
    with open(path, "rb") as file:
        lines = [line for text in text_blocks(file) for line in _libraries_of(text)]
    names = [name for line in dict.fromkeys(lines) for names in _readings(line) for name in names]
    libraries = _paths(path.parent, names)
    textures = [
        texture.file
        for library in filter(is_there, libraries)
        for _, lines_of in _libraries_materials(library.read_bytes())
        if (texture := _texture_of(lines_of))
    ]
    return [*libraries, *_paths(path.parent, textures)]


def _paths(folder: Path, names: Iterable[str]) -> list[Path]:
    """List the files that can be read by these names."""
    paths = (path_beside(folder, name) for name in dict.fromkeys(names))
    return [path for path in paths if path is not None]


def _libraries_of(text: bytes) -> list[bytes]:
    ((_, _, offsets),) = _codec.scan_lines(text, {"mtllib": "any"})
    return words_after(text, offsets)


def _readings(line: bytes) -> list[list[str]]:
    """List the names of libraries in a line, of which nothing says whether they have spaces.

    As several names that end in .mtl, as one name, as a name for each word.
    """
    ending = re.split(rb"(?i)(?<=\.mtl) ", line, maxsplit=MOST_LIBRARIES)
    readings = ending, [line], line.split(b" ", MOST_LIBRARIES)
    return [[_file_name(name) for name in dict.fromkeys(names)] for names in readings]


def _file_name(name: bytes) -> str:
    """Return a relative path, which may be in quotes, or have backslashes, as in Windows."""
    return file_name(name.strip(b'"').replace(b"\\", b"/"))


def _materials_of(
    folder: Path, libraries: list[bytes], contents: MeshFile
) -> dict[bytes, Material]:
    """Read the materials of all libraries by name; note their files and what is left out.

    libraries: lines without mtllib.
    """
    materials: dict[bytes, Material] = {}
    for line in dict.fromkeys(libraries):
        readings = _readings(line)
        there = (names for names in readings if any(map(is_there, _paths(folder, names))))
        for file in next(there, readings[0]):
            path = named_file(folder, file, contents)
            for name, lines in _libraries_materials(path.read_bytes() if path else b""):
                materials[name] = _material(folder, name, lines, contents)
    return materials


Lines = dict[bytes, list[bytes]]  # keyword in lower case -> the words after it


def _libraries_materials(text: bytes) -> Iterator[tuple[bytes, Lines]]:
    """Name and lines of each material."""
    name, lines = b"", Lines()
    for line in text.removeprefix(codecs.BOM_UTF8).splitlines():
        keyword, *words = line.split() or [b""]
        if keyword.lower() == b"newmtl":
            if name:
                yield name, lines
            name, lines = b" ".join(words), Lines()
        elif words:
            lines[keyword.lower()] = words
    if name:
        yield name, lines


def _material(folder: Path, name: bytes, lines: Lines, contents: MeshFile) -> Material:
    """Return a glTF material of base colour (Kd, map_Kd) and shininess (Ns)."""
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
    if texture is None:
        return Material(properties)
    image = read_texture(folder, texture.file, contents)
    if image and texture.omissions:
        problem = f"{properties['name']}: its texture is shown without {texture.omissions}"
        contents.warnings.append(problem)
    return Material(properties, image)


class Texture(NamedTuple):
    """A texture of a material.

    Attributes:
        file: relative path; omissions: options that change the picture, which are left out.
    """

    file: str
    omissions: str


def _texture_of(lines: Lines) -> Texture | None:
    """Read the file of a material's base colour texture, and the options before it."""
    if b"map_kd" not in lines:
        return None
    words, omissions = lines[b"map_kd"], []
    while len(words) > 1 and (option := words[0].lower()) in TEXTURE_OPTIONS:
        most, neutral = TEXTURE_OPTIONS[option]
        values = words[1:-1][:most]
        while most == 3 and not _numbers(values) and values:
            values.pop()  # it belongs to the file's name
        setting: list[Any] = _numbers(values) or [value.lower() for value in values]
        if neutral and setting != neutral[: len(values)]:
            omissions.append(option.decode())
        words = words[1 + len(values) :]
    return Texture(_file_name(b" ".join(words)), ", ".join(omissions))


def _numbers(words: list[bytes]) -> list[float]:
    """Nothing if any word is not a finite number."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
