"""Reads .mtl files, the materials of .obj files, as glTF materials."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from gltf_ext import _codec
from gltf_ext.document.lfs import PROBLEM, REMEDY, is_pointer
from gltf_ext.errors import MeshletError
from gltf_ext.portable import file_name
from gltf_ext.sources import texture_images
from gltf_ext.sources.mesh_files import (
    BASE_COLOR,
    EMISSIVE,
    METAL_ROUGH,
    NORMAL,
    STRENGTH,
    Material,
    MeshFile,
    Texture,
    TexturePath,
    beside,
    is_there,
    named_file,
    read_texture,
    short,
    warn,
)
from gltf_ext.sources.text import skip_mark, text_blocks, words_after

MOST_LIBRARIES = 1000  # of a line
MATERIALS = "its materials are left out"
# Textures by what they are of; a height map (bump) is read as a normal map, as most of them are.
COLOR, ALPHA, EMISSION, ROUGHNESS, METALNESS = b"map_kd", b"map_d", b"map_ke", b"map_pr", b"map_pm"
NORMALS = (b"norm", b"map_bump", b"bump")
NUMBERS = (b"kd", b"d", b"tr", b"ke", b"ns", b"pr", b"pm")
READ = {*NUMBERS, COLOR, ALPHA, EMISSION, ROUGHNESS, METALNESS, *NORMALS}
# What is left out without a word: numbers that change no picture of glTF's; None for all.
SILENT: dict[bytes, tuple[float, ...] | None] = {
    **dict.fromkeys((b"ka", b"illum", b"ni", b"sharpness"), None),
    b"ks": (0.0, 0.5),
    b"tf": (1.0,),
    **dict.fromkeys((b"ps", b"pc", b"pcr", b"aniso", b"anisor"), (0.0,)),
}
# Option of a texture -> the words after it, at most, and those that do not change the picture.
TEXTURE_OPTIONS: dict[bytes, tuple[int, list[Any] | None]] = {
    **dict.fromkeys((b"-blendu", b"-blendv", b"-bm", b"-boost"), (1, None)),
    **dict.fromkeys((b"-clamp", b"-imfchan", b"-texres", b"-type"), (1, None)),
    b"-cc": (1, [b"off"]),
    b"-mm": (2, [0.0, 1.0]),
    **dict.fromkeys((b"-o", b"-s"), (3, None)),  # 1 to 3 numbers
    b"-t": (3, [0.0, 0.0, 0.0]),
}
OPTION, WORD = re.compile(rb"(-[A-Za-z]+)\s+(?=\S)"), re.compile(rb"(\S+)\s+(?=\S)")

Lines = dict[bytes, bytes]  # keyword in lower case -> what follows it


# --- libraries ---


def read(
    folder: Path, libraries: list[bytes], used: Collection[bytes], contents: MeshFile
) -> dict[bytes, Material]:
    """Read the materials of these names out of libraries; note files and what is left out.

    libraries: lines without mtllib.
    """
    materials: dict[bytes, Material] = {}
    omissions: Counter[str] = Counter()
    is_complete = True
    for line in dict.fromkeys(libraries):
        if not line:
            warn(contents, f"mtllib names no file, so {MATERIALS}")
            is_complete = False
            continue
        readings = _readings(line)
        existing = (names for names in readings if any(map(is_there, _paths(folder, names))))
        for file in next(existing, readings[0]):
            path = named_file(folder, file, contents, MATERIALS)
            text = path.read_bytes() if path else b""
            if is_pointer(text):
                warn(contents, f"{short(file)} is {PROBLEM}, so {MATERIALS}; {REMEDY}")
            is_complete &= path is not None and not is_pointer(text)
            for name, lines in _materials_of(text):
                if name in used:
                    reader = _Reader(folder, name.decode(errors="replace"), lines, contents)
                    materials[name] = reader.material()
                    omissions.update(reader.omissions)
    for keyword, count in omissions.items():
        warn(contents, f"{keyword} of {count} materials is left out")
    missing = sorted(name for name in used if name and name not in materials)
    if missing and is_complete:
        first = missing[0].decode(errors="replace")
        warn(contents, f"{len(missing)} materials are in no library, such as {first}")
    return materials


def referenced_files(path: Path) -> list[Path]:
    """List the libraries that an .obj may name, and the images that those that exist name."""
    with open(path, "rb") as file:
        lines = [line for text in text_blocks(file) for line in _libraries_of(text)]
    names = [name for line in dict.fromkeys(lines) for names in _readings(line) for name in names]
    libraries = _paths(path.parent, names)
    textures = [
        _placement(lines_of[keyword]).file
        for library in filter(is_there, libraries)
        for _, lines_of in _materials_of(library.read_bytes())
        for keyword in (COLOR, ALPHA, EMISSION, ROUGHNESS, METALNESS, *NORMALS)
        if keyword in lines_of
    ]
    return [*libraries, *_paths(path.parent, textures)]


def _paths(folder: Path, names: Iterable[str]) -> list[Path]:
    """List the files that can be read by these names."""
    return list(dict.fromkeys(path for name in names for path in beside(folder, name)))


def _libraries_of(text: bytes) -> list[bytes]:
    ((_, _, offsets),) = _codec.scan_lines(text, {"mtllib": "any"})
    return words_after(text, offsets)


def _readings(line: bytes) -> list[list[str]]:
    """List the names of libraries in a line, of which nothing says whether they have spaces.

    As names in quotes, as several names that end in .mtl, as one name, as a name for each word.
    """
    ending = re.split(rb"(?i)(?<=\.mtl) ", line, maxsplit=MOST_LIBRARIES)
    readings = [ending, [line], line.split(b" ", MOST_LIBRARIES)]
    quoted = [match[1] for match in re.finditer(rb'"([^"]+)"', line)][:MOST_LIBRARIES]
    readings = [quoted, *readings] if quoted else readings
    return [[_file_name(name) for name in dict.fromkeys(names)] for names in readings]


def _file_name(name: bytes) -> str:
    """Return a path, which may be in quotes, or have backslashes, as in Windows."""
    return file_name(name.strip(b"\"'").replace(b"\\", b"/"))


def _materials_of(text: bytes) -> Iterator[tuple[bytes, Lines]]:
    """Yield name and lines of each material."""
    name, lines = b"", Lines()
    for line in skip_mark(text).splitlines():
        keyword, *rest = line.split(None, 1) or [b""]
        if keyword.lower() == b"newmtl":
            if name:
                yield name, lines
            name, lines = b" ".join(b"".join(rest).split()), Lines()
        elif rest and not keyword.startswith(b"#"):
            lines[keyword.lower()] = rest[0].strip()
    if name:
        yield name, lines


# --- textures ---


class _Placement(NamedTuple):
    """A texture's file, and what its options say.

    Attributes:
        offset, scale: of the texture coordinates of the .obj; channel: of the image, in lower case;
        strength: of a bump; omissions: options that change the picture, but are not read.
    """

    file: str
    clamps: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    channel: bytes = b""
    strength: float = 1.0
    omissions: tuple[str, ...] = ()

    def texture(self, image: bytes, **more: float) -> Texture:
        """Return the texture of an image. glTF's texture coordinates go down, the file's go up."""
        (u, v), (su, sv) = self.offset, self.scale
        return Texture(image, self.clamps, (u, 1 - sv - v), (su, sv), tuple(more.items()))


def _placement(text: bytes) -> _Placement:
    """Read what follows a texture's keyword: options, then the file."""
    options: dict[bytes, list[Any]] = {}
    omissions = []
    while (match := OPTION.match(text)) and (option := match[1].lower()) in TEXTURE_OPTIONS:
        most, neutral = TEXTURE_OPTIONS[option]
        text, words = text[match.end() :], list[bytes]()
        while len(words) < most and (word := WORD.match(text)):
            if most > 1 and not _numbers(word[1]):
                break  # it belongs to the file's name
            words.append(word[1])
            text = text[word.end() :]
        values: list[Any] = [n for word in words for n in _numbers(word)]
        values = values or [word.lower() for word in words]
        options[option] = values
        if neutral and values != neutral[: len(values)]:
            omissions.append(option.decode())
    offset = [*options.get(b"-o", []), 0.0, 0.0][:2]
    scale = options.get(b"-s", [])
    scale = [*scale, *[1.0, 1.0][len(scale) :]][:2]
    offset += [0.0] * (2 - len(offset))
    strength = options.get(b"-bm", [1.0])
    channel = options.get(b"-imfchan", [b""])
    return _Placement(
        _file_name(text),
        options.get(b"-clamp") == [b"on"],
        (offset[0], offset[1]),
        (scale[0], scale[1]),
        channel[0] if isinstance(channel[0], bytes) else b"",
        strength[0] if isinstance(strength[0], float) else 1.0,
        tuple(omissions),
    )


def _numbers(text: bytes) -> list[float]:
    """Return the finite numbers that a text begins with."""
    numbers = []
    for word in text.split():
        try:
            number = float(word)
        except ValueError:
            break
        if not math.isfinite(number):
            break
        numbers.append(number)
    return numbers


# --- materials ---


class _Reader:
    """Reads one material.

    Attributes:
        omissions: keywords of what is left out.
    """

    def __init__(self, folder: Path, name: str, lines: Lines, contents: MeshFile) -> None:
        """lines: of the material; contents: for files and warnings."""
        self._folder, self._name, self._lines, self._contents = folder, name, lines, contents
        self.omissions = sorted(
            keyword.decode(errors="replace")
            for keyword, text in lines.items()
            if keyword not in READ and not _is_silent(keyword, text)
        )

    def material(self) -> Material:
        """Return the glTF material. Notes a warning for each part of its pictures that is lost."""
        textures: dict[TexturePath, Texture] = {}
        for path, read in (
            (BASE_COLOR, self._base_texture),
            (METAL_ROUGH, self._metal_rough_texture),
            (EMISSIVE, self._emissive_texture),
            (NORMAL, self._normal_texture),
        ):
            try:
                if texture := read():
                    textures[path] = texture
            except MeshletError as error:
                warn(self._contents, f"{self._name}: a texture is left out: {error.message}")
        if not textures:
            return Material(self._properties(textures))
        return Material(self._properties(textures), textures, Material(self._properties({})))

    # --- numbers ---

    def _numbers_of(self, keyword: bytes) -> list[float]:
        return _numbers(self._lines.get(keyword, b""))

    def _number(self, keyword: bytes, default: float) -> float:
        """Return a number from 0 to 1."""
        numbers = self._numbers_of(keyword)
        return min(max(numbers[0], 0.0), 1.0) if numbers else default

    def _color(self, keyword: bytes) -> list[float] | None:
        """Return three numbers, of which a file may give only the first; None for no colour."""
        numbers = self._numbers_of(keyword)
        if len(numbers) not in (1, 3):
            return None
        return [max(n, 0.0) for n in (numbers * 3 if len(numbers) == 1 else numbers)]

    def _alpha(self) -> float:
        """Return the opacity: d, else 1 - Tr. One of 0 is a mistake of an exporter, mostly."""
        text = re.sub(rb"(?i)^-halo\s+", b"", self._lines.get(b"d", b""))
        numbers = _numbers(text) or [1 - n for n in self._numbers_of(b"tr")]
        alpha = min(max(numbers[0], 0.0), 1.0) if numbers else 1.0
        if alpha == 0 and ALPHA not in self._lines:
            warn(self._contents, f"{self._name}: its opacity of 0 is read as 1")
            return 1.0
        return alpha

    def _properties(self, textures: Collection[TexturePath]) -> dict[str, Any]:
        """Return the material without its textures; a colour of 0 does not hide a texture."""
        shininess = (self._numbers_of(b"ns") or [1.0])[0]
        roughness = self._number(b"pr", (2 / (max(shininess, 0.0) + 2)) ** 0.25)
        metalness = self._number(b"pm", 0.0)
        if METAL_ROUGH in textures:  # it has the scalars where the file has one texture only
            roughness = metalness = 1.0
        color = self._color(b"kd")
        if color is None or (BASE_COLOR in textures and not any(color)):
            color = [1.0] * 3
        alpha = self._alpha()
        pbr: dict[str, Any] = {"metallicFactor": metalness, "roughnessFactor": roughness}
        if b"kd" in self._lines or alpha < 1:
            pbr["baseColorFactor"] = [*(min(c, 1.0) for c in color), alpha]
        properties: dict[str, Any] = {"name": self._name, "pbrMetallicRoughness": pbr}
        if alpha < 1 or (ALPHA in self._lines and BASE_COLOR in textures):
            properties.update(alphaMode="BLEND", doubleSided=True)
        emission = self._color(b"ke") or [0.0] * 3
        if EMISSIVE in textures and not any(emission):
            emission = [1.0] * 3
        if any(emission):
            strength = max(1.0, *emission)
            properties["emissiveFactor"] = [c / strength for c in emission]
            if strength > 1:
                properties["extensions"] = {STRENGTH: {"emissiveStrength": strength}}
        return properties

    # --- textures ---

    def _image(self, keyword: bytes) -> tuple[_Placement, bytes] | None:
        """Read a texture's image; None if the material has none."""
        if not self._lines.get(keyword):
            return None
        placement = _placement(self._lines[keyword])
        image = read_texture(self._folder, placement.file, self._contents)
        if image is None:
            return None
        if placement.omissions:
            omissions = ", ".join(placement.omissions)
            warn(self._contents, f"{self._name}: its texture is shown without {omissions}")
        return placement, image

    def _emissive_texture(self) -> Texture | None:
        image = self._image(EMISSION)
        return image and image[0].texture(image[1])

    def _normal_texture(self) -> Texture | None:
        keyword = next((keyword for keyword in NORMALS if keyword in self._lines), b"")
        placement_and_image = self._image(keyword)
        if not placement_and_image:
            return None
        placement, image = placement_and_image
        if keyword != b"norm" and texture_images.is_gray(image):
            warn(self._contents, f"{self._name}: its height map is left out; glTF has normal maps")
            return None
        strength = {} if placement.strength == 1 else {"scale": placement.strength}
        return placement.texture(image, **strength)

    def _base_texture(self) -> Texture | None:
        """Combine colours and opacity."""
        color, alpha = self._image(COLOR), self._image(ALPHA)
        if not alpha:
            return color and color[0].texture(color[1])
        if not color:
            return alpha[0].texture(texture_images.with_alpha(None, alpha[1], alpha[0].channel))
        self._check_placements(color[0], alpha[0], "map_d")
        if color[0].file == alpha[0].file:
            return color[0].texture(color[1])
        try:
            image = texture_images.with_alpha(color[1], alpha[1], alpha[0].channel)
        except MeshletError as error:
            warn(self._contents, f"{self._name}: map_d is left out: {error.message}")
            return color[0].texture(color[1])
        return color[0].texture(image)

    def _metal_rough_texture(self) -> Texture | None:
        """Combine roughness and metalness; a number stands for one that has no texture."""
        rough, metal = self._image(ROUGHNESS), self._image(METALNESS)
        first = rough or metal
        if not first:
            return None
        if rough and metal:
            self._check_placements(rough[0], metal[0], "map_Pm")
            if rough[0].file == metal[0].file and not (rough[0].channel or metal[0].channel):
                return rough[0].texture(rough[1])  # it is glTF's: green is rough, blue is metal
        image = texture_images.metal_rough(
            (rough[1], rough[0].channel) if rough else self._number(b"pr", 1.0),
            (metal[1], metal[0].channel) if metal else self._number(b"pm", 0.0),
        )
        return first[0].texture(image)

    def _check_placements(self, first: _Placement, other: _Placement, keyword: str) -> None:
        if (first.clamps, first.offset, first.scale) != (other.clamps, other.offset, other.scale):
            warn(
                self._contents, f"{self._name}: {keyword} is placed as the texture it is joined to"
            )


def _is_silent(keyword: bytes, text: bytes) -> bool:
    if keyword not in SILENT:
        return False
    neutral = SILENT[keyword]
    return neutral is None or all(number in neutral for number in _numbers(text))
