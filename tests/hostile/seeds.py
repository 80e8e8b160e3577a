"""The files that are mutated: small, and together with every feature that a command reads."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

import gltf_ext
from tests.helpers.environment import ROOT
from tests.helpers.gltf_builder import NORMALIZED, Builder, everything, grid_mesh

IDENTITY = np.eye(4).ravel().tolist()


@dataclass(frozen=True)
class Seed:
    """A glTF file in parts.

    name: with the suffix .glb or .gltf; files: other files that it refers to; original: what verify
    compares it with.
    """

    name: str
    text: str
    binary: bytes
    files: dict[str, bytes]
    original: Path


def make_seeds(folder: Path) -> list[Seed]:
    """Writes the unmutated files into the folder, and returns them in parts."""
    found: list[Seed] = []
    for make in (_textured, _skinned, _instanced, _sparse, _draco):
        builder = make()
        if builder is None:
            continue
        name = make.__name__.strip("_")
        original = builder.write(folder / f"{name}.glb")
        found.append(_read(original, original))
        for kind, options in COMPRESSIONS.get(make, {"": {}}).items():
            path = folder / f"{name}_compressed{kind}.glb"
            gltf_ext.compress(original, path, **options)
            found.append(_read(path, original))
    found.append(_external(found[0], folder))
    vectors = ROOT / "spec" / "vectors"
    files = [vectors / f"gltf_{name}.glb" for name in ("pages", "equal_vertices")]
    for path in (*files, *(ROOT / "spec" / "lod_vectors").glob("lod_*.glb")):
        found.append(_read(path, path))
    return found


def _read(path: Path, original: Path) -> Seed:
    data = path.read_bytes()
    end = 20 + struct.unpack_from("<I", data, 12)[0]
    return Seed(path.name, data[20:end].decode(), data[end + 8 :], {}, original)


def _png(side: int) -> bytes:
    pixels = np.random.default_rng(0).integers(0, 256, (side, side, 4), dtype=np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def _textured() -> Builder:
    """Every kind of texture, material extensions, lights, and both kinds of camera."""
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    colors = np.full((len(positions), 4), 200, np.uint8)
    attributes = {"POSITION": positions, "TEXCOORD_0": positions[:, :2].copy(), "COLOR_0": colors}
    attributes["NORMAL"] = np.tile(np.float32([0, 0, 1]), (len(positions), 1))
    builder.mesh(attributes, triangles, normalized=["COLOR_0"], material=0)
    builder.mesh({"POSITION": positions}, triangles, material=1)
    transform = {"offset": [0.5, 0], "rotation": 0.3, "scale": [2, 2], "texCoord": 0}
    placed = {"index": 1, "extensions": {"KHR_texture_transform": transform}}
    builder.properties.update(
        materials=[
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [1, 0.5, 0.5, 0.9],
                    "metallicFactor": 0.5,
                    "roughnessFactor": 0.4,
                    "baseColorTexture": {"index": 0, "texCoord": 0},
                    "metallicRoughnessTexture": {"index": 1},
                },
                "normalTexture": {"index": 0, "scale": 0.5},
                "emissiveTexture": placed,
                "emissiveFactor": [1, 0.5, 0],
                "alphaMode": "MASK",
                "alphaCutoff": 0.4,
                "doubleSided": True,
                "extensions": {
                    "KHR_materials_emissive_strength": {"emissiveStrength": 2.0},
                    "KHR_materials_ior": {"ior": 1.4},
                    "KHR_materials_clearcoat": {
                        "clearcoatFactor": 0.5,
                        "clearcoatRoughnessFactor": 0.1,
                    },
                    "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3]},
                },
            },
            {
                "alphaMode": "BLEND",
                "extensions": {
                    "KHR_materials_unlit": {},
                    "KHR_materials_transmission": {"transmissionFactor": 0.5},
                },
            },
        ],
        textures=[{"source": 0, "sampler": 0}, {"source": 1}],
        samplers=[{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        images=[
            {"bufferView": builder.view(_png(4)), "mimeType": "image/png"},
            {"bufferView": builder.view(_png(2)), "mimeType": "image/png"},
        ],
        cameras=[
            {
                "type": "perspective",
                "perspective": {"yfov": 1, "znear": 0.1, "zfar": 9.0, "aspectRatio": 1.5},
            },
            {
                "type": "orthographic",
                "orthographic": {"xmag": 2, "ymag": 2, "znear": 0, "zfar": 9},
            },
        ],
        nodes=[
            {"mesh": 0, "children": [1, 2], "translation": [0, 0, 0.5], "scale": [1, 2, 1]},
            {"mesh": 1, "rotation": [0, 0, 0.7071, 0.7071]},
            {"camera": 0, "translation": [1, 0.5, 4]},
            {"camera": 1, "matrix": IDENTITY},
            *({"extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(3)),
        ],
        scenes=[{"nodes": [0, 3, 4, 5, 6], "name": "all"}],
        extensions={
            "KHR_lights_punctual": {
                "lights": [
                    {"type": "directional", "intensity": 2, "color": [1, 0.9, 0.8]},
                    {"type": "point", "range": 9},
                    {"type": "spot", "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
                ]
            }
        },
        extensionsUsed=["KHR_lights_punctual", "KHR_materials_unlit", "KHR_texture_transform"],
    )
    return builder


def _skinned() -> Builder:
    """Every attribute, morph targets (one sparse), a skin, animations, metadata."""
    attributes, triangles, targets = everything(2, 7, 7)
    builder = Builder()
    count = len(attributes["POSITION"])
    moved, by = np.arange(4, dtype=np.uint16), np.ones((4, 3), np.float32)
    builder.properties["accessors"].append(
        {
            "componentType": 5126,
            "count": count,
            "type": "VEC3",
            "sparse": {
                "count": 4,
                "indices": {"bufferView": builder.view(moved.tobytes()), "componentType": 5123},
                "values": {"bufferView": builder.view(by.tobytes())},
            },
        }
    )
    builder.mesh(attributes, triangles, [*targets, {"POSITION": 0}], NORMALIZED)
    times = builder.accessor(np.arange(2, dtype=np.float32).reshape(2, 1))
    turns = builder.accessor(np.tile(np.float32([0, 0, 0, 1]), (2, 1)))
    bind = builder.accessor(np.tile(np.eye(4, dtype=np.float32).reshape(1, 16), (2, 1)))
    table = builder.view(bytes(8))
    builder.properties["meshes"][0].update(weights=[0.1, 0.2, 0.3], name="body", extras={"a": [1]})
    builder.properties.update(
        nodes=[{"mesh": 0, "skin": 0, "children": [1]}, {"name": "joint", "children": [2]}, {}],
        skins=[{"joints": [1, 2], "inverseBindMatrices": bind, "skeleton": 1}],
        animations=[
            {
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
                "samplers": [{"input": times, "output": turns, "interpolation": "LINEAR"}],
            }
        ],
        extensions={
            "EXT_structural_metadata": {
                "propertyTables": [{"properties": {"p": {"values": table}}}]
            }
        },
        extensionsUsed=["EXT_structural_metadata"],
        extras={"kept": [None, {}, []]},
    )
    return builder


def _instanced() -> Builder:
    """EXT_mesh_gpu_instancing, strips and fans, and a tree of nodes with shared meshes."""
    positions, triangles = grid_mesh(6, 6)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles.astype(np.uint16))
    builder.mesh({"POSITION": 0}, triangles[:2].astype(np.uint8), mode=5)
    builder.mesh({"POSITION": 0}, mode=6)
    moves = builder.accessor(np.arange(9, dtype=np.float32).reshape(3, 3))
    instances = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": moves}}}
    builder.properties.update(
        nodes=[
            {"mesh": 0, "extensions": instances, "children": [1, 2]},
            {"mesh": 0, "translation": [3, 0, 0], "children": [3, 4]},
            {"mesh": 0, "scale": [-1, 1, 1]},
            {"mesh": 1},
            {"mesh": 2, "matrix": IDENTITY},
        ],
        extensionsUsed=["EXT_mesh_gpu_instancing"],
    )
    return builder


def _sparse() -> Builder:
    """Interleaved positions, some of which sparse values replace; two primitives in a mesh."""
    positions, triangles = grid_mesh(4, 4)
    builder = Builder()
    rows = np.concatenate([positions, positions], axis=1)
    view = builder.view(rows.tobytes(), byteStride=24)
    sparse = {
        "count": 2,
        "indices": {
            "bufferView": builder.view(np.uint32([1, 5]).tobytes()),
            "componentType": 5125,
            "byteOffset": 0,
        },
        "values": {"bufferView": builder.view(bytes(24)), "byteOffset": 0},
    }
    for offset in (0, 12):
        builder.properties["accessors"].append(
            {
                "bufferView": view,
                "byteOffset": offset,
                "componentType": 5126,
                "count": len(positions),
                "type": "VEC3",
                **({"sparse": sparse} if not offset else {}),
            }
        )
    primitive = builder.mesh({"POSITION": 0, "NORMAL": 1}, triangles)
    builder.properties["meshes"][0]["primitives"].append({**primitive, "material": 0, "mode": 4})
    builder.properties["materials"] = [{"name": "plain"}]
    return builder


def _draco() -> Builder | None:
    try:
        import DracoPy
    except ImportError:
        return None
    positions, triangles = grid_mesh(4, 4)
    data = DracoPy.encode(positions, triangles, quantization_bits=14)
    decoded = DracoPy.decode(data)
    builder = Builder()
    view, identifier = builder.view(data), decoded.attributes[0]["unique_id"]
    builder.properties["accessors"] = [
        {"componentType": 5126, "count": len(decoded.points), "type": "VEC3"},
        {"componentType": 5125, "count": decoded.faces.size, "type": "SCALAR"},
    ]
    extension = {"bufferView": view, "attributes": {"POSITION": identifier}}
    builder.mesh({"POSITION": 0}, 1, extensions={"KHR_draco_mesh_compression": extension})
    builder.properties["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    builder.properties["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return builder


COMPRESSIONS: dict[Callable[[], Builder | None], dict[str, dict[str, object]]] = {
    _textured: {"": {}, "_fallback": {"fallback": True}},
    _skinned: {"": {}, "_pages": {"page_bytes": 4096}, "_packed": {"transport": True}},
    _draco: {},
}


def _external(seed: Seed, folder: Path) -> Seed:
    """The same model as a .gltf with a buffer and an image in files, and one image in its JSON."""
    properties = json.loads(seed.text)
    properties["buffers"][0]["uri"] = "data.bin"
    properties["images"][0] = {"uri": "image.png"}
    properties["images"][1] = {"uri": "data:image/png;base64,iVBORw0KGgo="}
    files = {"data.bin": seed.binary, "image.png": _png(4)}
    path = folder / "external.gltf"
    path.write_text(json.dumps(properties))
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return Seed(path.name, path.read_text(), b"", files, path)
