"""The other codecs, behind one interface and on the same integers as ours.

A model becomes Parts: its primitives with positions and texture coordinates in steps of the grids
that our encoder uses, so that every codec is asked for steps of exactly one; normals are vectors,
each codec has its own 8-bit form of them. Other attributes are left out (only colours occur).

    found, missing = available()
    parts = read_parts(path)
    buffers = found[0].encode(parts)
    decode = found[0].decoder(buffers)

Draco needs the Python package DracoPy, whose sizes are those of Draco's own command up to 3 bytes.
gltfpack needs node and the npm package gltfpack in build/node or the folder that
GLTF_MESHLET_NODE_MODULES names, its decoding the Python package meshoptimizer. Corto needs
GLTF_MESHLET_CORTO, the path of its `corto` command, its decoding also the library
libcortocodec_unity.so beside the command (both come out of Corto's CMake build).
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import json
import os
import re
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.common import ROOT, git_output
from gltf_ext.attributes.records import weld_rows
from gltf_ext.attributes.streams import Bits, Grid, Plan, plan_streams, position_grid
from gltf_ext.document import gltf
from gltf_ext.document.accessors import add_accessor, bounds, set_bounds
from gltf_ext.document.container import model_files
from gltf_ext.document.document import Document
from gltf_ext.files import write_files
from gltf_ext.ranges import first_of_each
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import Primitive, triangle_primitives
from gltf_ext.sources.source import read_primitive

NODE_MODULES = Path(
    os.environ.get("GLTF_MESHLET_NODE_MODULES") or ROOT / "build" / "node" / "node_modules"
)
CORTO = os.environ.get("GLTF_MESHLET_CORTO", "")
DEFAULT_BITS = Bits()
TEXTURE = {"textures": [{"source": 0}], "images": [{"uri": "data:image/png;base64,"}]}
# The attributes that all codecs know, and their numbers of components.
ATTRIBUTES = {"POSITION": 3, "NORMAL": 3, "TEXCOORD_0": 2}


class PeerMissing(Exception):
    """A codec that is not installed; the message says what to install."""


@dataclass(frozen=True)
class Part:
    """One primitive for a codec, or decoded by it.

    triangles: uint32[T, 3]; positions: float32[V, 3] in steps of the mesh's grid, 0 to
    2^bits.position - 1; normals: float32[V, 3] unit vectors or None; texcoords: float32[V, 2] in
    steps of the primitive's grid, 0 to 2^bits.texcoord - 1, or None. What a codec decodes are whole
    steps.
    """

    triangles: np.ndarray
    positions: np.ndarray
    normals: np.ndarray | None = None
    texcoords: np.ndarray | None = None

    @property
    def raw_bytes(self) -> int:
        """4 bytes per float component and per index."""
        floats = 3 + 3 * (self.normals is not None) + 2 * (self.texcoords is not None)
        return 4 * (floats * len(self.positions) + self.triangles.size)


# --- JavaScript ---


def require_web(packages: Iterable[str] = (), files: Iterable[str] = ()) -> None:
    """Ends the program if an npm package is missing, or a file of web/ that is compiled."""
    for name in packages:
        if not (NODE_MODULES / name).is_dir():
            raise SystemExit(f"bench: npm install --prefix build/node {name}")
    for name in files:
        if not (ROOT / "web" / name).is_file():
            raise SystemExit(f"bench: no web/{name}; run: make web")


def node(*arguments: object, display: Sequence[str] = ()) -> str:
    """What a program prints in Node. Ends this one if it fails: Node has then said why.

    display: the command that gives Node a display.
    """
    command = [*display, "node", *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise SystemExit("bench: a program in Node failed")
    return done.stdout


# --- models as parts ---


def read_primitives(path: Path, attributes: dict[str, int] = ATTRIBUTES) -> list[Primitive]:
    """A model's welded triangle primitives, without empty ones and with these attributes only.

    attributes: the numbers of components by name.
    """
    document = open_model(path)
    primitives = []
    for mesh, index, _ in triangle_primitives(document):
        source, _ = read_primitive(document, mesh, index)
        kept = {
            name: v
            for name, v in source.attributes.items()
            if attributes.get(name) == v.shape[1] and v.dtype.kind == "f"
        }
        welded = _welded(Primitive(mesh, index, source.indices, kept))
        if len(welded.indices):
            primitives.append(welded)
    return primitives


def _welded(primitive: Primitive) -> Primitive:
    """Joins vertices that are equal in all attributes; drops triangles with two equal ones, and
    unused vertices."""
    arrays = [np.ascontiguousarray(v).view(np.uint8) for v in primitive.attributes.values()]
    numbers, count = weld_rows(np.concatenate(arrays, axis=1))
    triangles = numbers[primitive.indices]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, corners = np.unique(triangles, return_inverse=True)
    rows = first_of_each(numbers, count)[used]
    attributes = {name: values[rows] for name, values in primitive.attributes.items()}
    triangles = corners.reshape(-1, 3).astype(np.uint32)
    return Primitive(primitive.mesh, primitive.primitive, triangles, attributes)


def read_parts(path: Path, bits: Bits = DEFAULT_BITS) -> list[Part]:
    """A model's primitives on the grids of gltf_ext.compress: one position grid per mesh."""
    return parts_of(read_primitives(path), bits)


def parts_of(primitives: list[Primitive], bits: Bits = DEFAULT_BITS) -> list[Part]:
    """Primitives on one position grid per mesh and one texture coordinate grid each."""
    grids = position_grids(primitives, bits)
    return [_part(primitive, grids[primitive.mesh], bits) for primitive in primitives]


def position_grids(primitives: list[Primitive], bits: Bits) -> dict[int, Grid]:
    """The position grid of each mesh, by its number."""
    boxes: dict[int, list[np.ndarray]] = {}
    for primitive in primitives:
        positions = primitive.attributes["POSITION"]
        boxes.setdefault(primitive.mesh, []).append(
            np.stack([positions.min(axis=0), positions.max(axis=0)])
        )
    return {
        mesh: position_grid(np.min(box, axis=0)[0], np.max(box, axis=0)[1], bits.position, None)
        for mesh, box in boxes.items()
    }


def plan_of(primitive: Primitive, grid: Grid, bits: Bits) -> Plan:
    """The streams of a primitive's attributes."""
    ends = {name: np.stack(bounds(values)) for name, values in primitive.attributes.items()}
    return plan_streams(ends, grid, bits, "")


def _part(primitive: Primitive, grid, bits: Bits) -> Part:
    plan = plan_of(primitive, grid, bits)

    def in_steps(name: str) -> np.ndarray | None:
        if name not in primitive.attributes:
            return None
        (stream,) = plan.streams_of(name)
        steps = (primitive.attributes[name].astype(np.float64) - stream.offset) / stream.step
        largest = {"POSITION": 2**bits.position, "TEXCOORD_0": 2**bits.texcoord}[name] - 1
        # Rounding may exceed the grid.
        return np.ascontiguousarray(steps.clip(0, largest), np.float32)

    return Part(
        primitive.indices,
        in_steps("POSITION"),
        primitive.attributes.get("NORMAL"),
        in_steps("TEXCOORD_0"),
    )


class Unpacked:
    """A codec that writes a buffer per part, to be unpacked before drawing."""

    def file_bytes(self, buffers: list[bytes]) -> int:
        return sum(map(len, buffers))

    def resident_bytes(self, parts: list[Part], buffers: list[bytes]) -> int:
        """Unpacked before drawing, to floats and 32-bit indices."""
        return sum(part.raw_bytes for part in parts)


# --- Draco ---


class Draco(Unpacked):
    """Google's Draco through DracoPy, one buffer per part. level: 0 (fastest) to 10 (smallest)."""

    def __init__(self, level: int = 7):
        try:
            import DracoPy
        except ImportError:
            raise PeerMissing("Draco: pip install DracoPy") from None
        self._module, self.level, self.name = DracoPy, level, f"Draco, level {level}"
        self.version = f"DracoPy {importlib.metadata.version('DracoPy')}"

    def encode(self, parts: list[Part], bits: Bits = DEFAULT_BITS) -> list[bytes]:
        return [self._encode(part, bits) for part in parts]

    def _encode(self, part: Part, bits: Bits) -> bytes:
        texcoords = None if part.texcoords is None else part.texcoords.astype(np.float64)
        normals = None if part.normals is None else part.normals.astype(np.float64)
        return self._module.encode(
            part.positions.astype(np.float64),
            part.triangles,
            compression_level=self.level,
            quantization_bits=bits.position,
            quantization_range=2**bits.position - 1,
            quantization_origin=[0.0, 0.0, 0.0],
            normals=normals,
            normal_quantization_bits=bits.normal,
            tex_coord=texcoords,
            tex_coord_quantization_bits=bits.texcoord,
        )

    def decoder(self, buffers: list[bytes]) -> Callable[[], list]:
        """A function that decodes to DracoPy's meshes."""
        return lambda: [self._module.decode(buffer) for buffer in buffers]


# --- Corto ---


class Corto(Unpacked):
    """ISTI's Corto: encodes with its command, decodes with its C library. One buffer per part.

    predictions: its normal modes to try, the smallest result counts ("border" drops differences and
    is inexact).
    """

    name = "Corto"

    def __init__(self, predictions: tuple[str, ...] = ("delta", "estimated")):
        if not CORTO or not os.access(CORTO, os.X_OK):
            raise PeerMissing(
                "Corto: build it (github.com/cnr-isti-vclab/corto) and set GLTF_MESHLET_CORTO to "
                "its corto command"
            )
        self.predictions = predictions
        self.version = f"commit {checkout_version(Path(CORTO).parent)}"

    def encode(self, parts: list[Part], bits: Bits = DEFAULT_BITS) -> list[bytes]:
        return self.encode_timed(parts, bits)[0]

    def encode_timed(
        self, parts: list[Part], bits: Bits = DEFAULT_BITS
    ) -> tuple[list[bytes], float]:
        """(buffers, seconds): the command's own report without loading, in whole milliseconds."""
        buffers, seconds = [], 0.0
        for part in parts:
            tries = [self._encode(part, bits, prediction) for prediction in self.predictions]
            smallest = min(tries, key=lambda result: len(result[0]))
            buffers.append(smallest[0])
            seconds += smallest[1]
        return buffers, seconds

    @staticmethod
    def _encode(part: Part, bits: Bits, prediction: str) -> tuple[bytes, float]:
        with tempfile.TemporaryDirectory() as folder:
            source, target = Path(folder) / "in.ply", Path(folder) / "out.crt"
            source.write_bytes(ply(part, bits))
            options = f"-q 1 -n {bits.normal} -u {bits.texcoord} -N {prediction} -o"
            command = [CORTO, *options.split(), target, source]
            output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            return target.read_bytes(), int(re.search(r"Encoding time: (\d+)ms", output)[1]) / 1000

    def decoder(self, buffers: list[bytes]) -> Callable[[], list[tuple[np.ndarray, ...]]]:
        """A function that decodes into arrays that exist already.

        They are positions, triangles, normals, colours and texture coordinates in units of 2^bits
        steps. Attributes that a buffer lacks stay NaN.
        """
        library = _corto_library(Path(CORTO).with_name("libcortocodec_unity.so"))
        outputs = []
        for buffer in buffers:
            counts = np.zeros(2, np.float32)  # exact up to 2^24
            library.DestroyDecoder(library.CreateDecoder(len(buffer), buffer, counts.ctypes.data))
            triangles, vertices = map(int, counts)
            positions, normals, colors, texcoords = (
                np.full((vertices, width), np.nan, np.float32) for width in (3, 3, 4, 2)
            )
            indices = np.zeros((triangles, 3), np.uint32)
            outputs.append((positions, indices, normals, colors, texcoords))

        def decode() -> list[tuple[np.ndarray, ...]]:
            for buffer, arrays in zip(buffers, outputs):
                counts = (ctypes.c_float * 2)()
                decoder = library.CreateDecoder(len(buffer), buffer, ctypes.addressof(counts))
                library.DecodeMesh(decoder, *(array.ctypes.data for array in arrays))
                library.DestroyDecoder(decoder)
            return outputs

        return decode


def ply(part: Part, bits: Bits) -> bytes:
    """Binary PLY for Corto.

    Values are rounded, because Corto truncates; texture coordinates are in units of 2^bits steps.
    """
    columns = [("xyz", np.rint(part.positions))]
    if part.normals is not None:
        columns.append((("nx", "ny", "nz"), part.normals))
    if part.texcoords is not None:
        columns.append(("st", np.rint(part.texcoords) * 2.0**-bits.texcoord))
    properties = "".join(f"property float {name}\n" for names, _ in columns for name in names)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(part.positions)}\n{properties}"
        f"element face {len(part.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(part.triangles), np.dtype([("n", "u1"), ("v", "<i4", 3)]))
    faces["n"], faces["v"] = 3, part.triangles
    return (
        header.encode()
        + np.concatenate([values for _, values in columns], axis=1).astype("<f4").tobytes()
        + faces.tobytes()
    )


def _corto_library(path: Path):
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        raise PeerMissing(
            f"Corto: its decoding needs {path.name} beside the corto command "
            "(BUILD_CORTO_CODEC_UNITY=ON)"
        ) from None
    library.CreateDecoder.restype = ctypes.c_void_p
    library.CreateDecoder.argtypes = [ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p]
    library.DecodeMesh.argtypes = [ctypes.c_void_p] * 6
    library.DestroyDecoder.argtypes = [ctypes.c_void_p]
    return library


# --- glTF with KHR_mesh_quantization and meshopt compression ---


class Gltfpack:
    """meshoptimizer's gltfpack: KHR_mesh_quantization, and KHR_meshopt_compression on top.

    One .glb holds all parts.

    compressed: False writes plain quantised buffers; True the smallest meshopt compression (-cc,
    the KHR version of the codec).
    """

    def __init__(self, compressed: bool):
        self._script = NODE_MODULES / "gltfpack" / "cli.js"
        if not self._script.exists() or shutil.which("node") is None:
            raise PeerMissing("gltfpack: needs node and npm install --prefix build/node gltfpack")
        self.compressed = compressed
        self.name = "meshopt-compressed glTF" if compressed else "quantised glTF"
        self.version = (
            "gltfpack " + json.loads(self._script.with_name("package.json").read_text())["version"]
        )

    def encode(self, parts: list[Part], bits: Bits = DEFAULT_BITS) -> list[bytes]:
        """Every part as a node of its own, so that nothing is merged or dropped."""
        with tempfile.TemporaryDirectory() as folder:
            source, target = Path(folder) / "in.glb", Path(folder) / "out.glb"
            write_parts(parts, bits, source)
            options = f"-vp {bits.position} -vn {bits.normal} -vt {bits.texcoord} -kn -km".split()
            options += ["-cc", "-ce", "khr"] if self.compressed else []
            command = ["node", self._script, "-i", source, "-o", target, *options]
            subprocess.run(command, check=True, capture_output=True)
            return [target.read_bytes()]

    def decoder(self, buffers: list[bytes]) -> Callable[[], list[list[bytes]]]:
        """A function that decodes the bytes of all buffer views of each file."""
        files = [glb_chunks(buffer) for buffer in buffers]
        return lambda: [
            [_view_bytes(view, binary) for view in document["bufferViews"]]
            for document, binary in files
        ]

    def file_bytes(self, buffers: list[bytes]) -> int:
        """Bytes of geometry in the file: its JSON is left out, as the other codecs have none."""
        return sum((_meshopt(view) or view)["byteLength"] for view in _geometry_views(*buffers))

    def resident_bytes(self, parts: list[Part], buffers: list[bytes]) -> int:
        """What is uploaded: the quantised buffers, unpacked."""
        return sum(view["byteLength"] for view in _geometry_views(*buffers))


def write_parts(parts: list[Part], bits: Bits, path: Path) -> None:
    """Writes parts for gltfpack, a mesh each: positions in steps, texture coordinates in [0, 1].

    The last mesh spans the whole position grid, so that gltfpack, which has one grid per file,
    takes steps of one. Materials have a texture (of no pixels), for without one gltfpack drops
    texture coordinates.
    """
    largest = 2.0**bits.position - 1
    span = Part(
        np.array([[0, 1, 2]], np.uint32),
        np.array([[0, 0, 0], [largest, 0, 0], [0, largest, largest]], np.float32),
    )
    meshes = []
    for part in [*parts, span]:
        unit = None if part.texcoords is None else part.texcoords / (2**bits.texcoord - 1)
        named = {"POSITION": part.positions, "NORMAL": part.normals, "TEXCOORD_0": unit}
        attributes = {name: values for name, values in named.items() if values is not None}
        meshes.append([(part.triangles, attributes)])
    write_plain(meshes, path, textured=True)


def write_primitives(primitives: list[Primitive], path: Path) -> None:
    """Writes the triangles and attributes of primitives as a plain .glb."""
    meshes: dict[int, list] = {}
    for primitive in primitives:
        meshes.setdefault(primitive.mesh, []).append((primitive.indices, primitive.attributes))
    write_plain(list(meshes.values()), path)


def write_plain(
    meshes: list[list[tuple[np.ndarray, dict[str, np.ndarray]]]],
    path: Path,
    textured: bool = False,
) -> None:
    """Writes a float32 .glb of meshes of primitives (triangles, attributes).

    The nodes are named "part N". textured: each primitive has a material with a texture.
    """
    names = {number: f"part {number}" for number in range(len(meshes))}
    properties: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(names)}],
        "nodes": [{"name": name, "mesh": number} for number, name in names.items()],
        "meshes": [{"primitives": []} for _ in meshes],
    }
    if textured:
        texture = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        properties |= {"materials": [{"name": name, **texture} for name in names.values()]}
        properties |= TEXTURE
    document = Document(properties)
    for number, primitives in enumerate(meshes):
        for triangles, attributes in primitives:
            floats = {name: values.astype(np.float32) for name, values in attributes.items()}
            accessors = {name: add_accessor(document, values) for name, values in floats.items()}
            set_bounds(document.accessors[accessors["POSITION"]], *bounds(floats["POSITION"]))
            indices = add_accessor(document, triangles.reshape(-1, 1).astype(np.uint32))
            primitive: gltf.Primitive = {"attributes": accessors, "indices": indices}
            if textured:
                primitive["material"] = number
            document.meshes[number]["primitives"].append(primitive)
    write_files(model_files(document, path), input_files=())


def glb_chunks(data: bytes) -> tuple[dict, bytes]:
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def _meshopt(view: dict) -> dict | None:
    """The compression object of a buffer view."""
    return view.get("extensions", {}).get("KHR_meshopt_compression")


def _geometry_views(file: bytes) -> list[dict]:
    document, _ = glb_chunks(file)
    used = {accessor["bufferView"] for accessor in document["accessors"]}
    return [document["bufferViews"][view] for view in sorted(used)]


def _view_bytes(view: dict, binary: bytes) -> bytes:
    """A buffer view's bytes, unpacked where they are compressed."""
    source = _meshopt(view) or view
    data = binary[source.get("byteOffset", 0) :][: source["byteLength"]]
    return data if source is view else _meshopt_decode(source, data)


def _meshopt_decode(compression: dict, data: bytes) -> bytes:
    try:
        import meshoptimizer
    except ImportError:
        raise PeerMissing(
            "meshopt-compressed glTF: decoding needs pip install meshoptimizer"
        ) from None
    count, stride = compression["count"], compression["byteStride"]
    if compression["mode"] == "TRIANGLES":
        indices = meshoptimizer.decode_index_buffer(count, stride, data)
        return indices.astype(f"<u{stride}").tobytes()
    decoded = np.ascontiguousarray(meshoptimizer.decode_vertex_buffer(count, stride, data))
    if compression.get("filter") == "OCTAHEDRAL":
        decoded = decoded.view(f"<i{stride // 4}").reshape(count, 4)
        decoded = meshoptimizer.decode_filter_oct(decoded, count, stride)
    return decoded.tobytes()


# --- installed codecs ---


# What makes each codec; raises PeerMissing if it is not installed.
MAKERS: tuple[Callable, ...] = (
    *(partial(Draco, level) for level in (7, 10)),
    Corto,
    *(partial(Gltfpack, is_compressed) for is_compressed in (False, True)),
)


def available(makers: Iterable[Callable] = MAKERS) -> tuple[list, list[str]]:
    """(the installed codecs, a line per missing one: what to install)."""
    found, missing = [], []
    for make in makers:
        try:
            found.append(make())
        except PeerMissing as error:
            missing.append(str(error))
    return found, sorted(set(missing))


def checkout_version(folder: Path) -> str:
    """The tag or commit of the source tree that holds a folder."""
    return git_output(folder, "describe", "--always", "--tags") or "version unknown"
