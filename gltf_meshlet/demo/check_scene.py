"""The scene of gpu-check: the demo's model four times on a floor, all of it generated.

It has what paths treat differently: large and small triangles, a triangle across the near plane,
mirrored instances, texture coordinates, vertex colours, several textures.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

from gltf_ext.document import gltf
from gltf_ext.document.accessors import add_accessor
from gltf_ext.document.container import model_files
from gltf_ext.document.document import Document
from gltf_ext.files import write_files
from gltf_meshlet.demo import model

PLACES = ((-1.7, -1.7), (1.7, -1.7), (-1.7, 1.7), (1.7, 1.7))  # x and z of each copy
MIRRORED = 1  # number of the copy
FLOOR_SIDE, FLOOR_CELLS = 24.0, 12
TEXTURED = ("floor", "inlay")
COLORED = "gear"
TEXELS = 64
EYE, TARGET = (1.4, 1.9, 6.0), (0.0, 0.2, 0.0)
FIELD_OF_VIEW, NEAR, FAR = 0.8, 0.5, 40.0


def write(path: Path) -> Path:
    """Writes the scene, uncompressed, as a .glb."""
    primitives = [*model.generate(), _floor()]
    document = model.document_of(primitives)
    for material, primitive in zip(document.materials, primitives):
        if primitive.name in TEXTURED:
            texture = _add_texture(document, TEXTURED.index(primitive.name))
            material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
    _add_colors(document, primitives)
    _place(document)
    write_files(model_files(document, path), input_files=())
    return path


def _floor() -> model.Primitive:
    cells = FLOOR_CELLS
    share = np.linspace(0.0, 1.0, cells + 1)
    u, v = (axis.ravel() for axis in np.meshgrid(share, share))
    positions = np.column_stack([(u - 0.5) * FLOOR_SIDE, 0 * u, (v - 0.5) * FLOOR_SIDE])
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    below = corner + cells + 1
    quads = np.stack([corner, below, corner + 1, corner + 1, below, below + 1], axis=1)
    return model.Primitive(
        "floor",
        "floor",
        (1.0, 1.0, 1.0),
        0.0,
        0.9,
        positions.astype(np.float32),
        np.tile(np.array([0, 1, 0], np.float32), (len(u), 1)),
        np.column_stack([u, v]).astype(np.float32),
        quads.reshape(-1, 3).astype(np.uint32),
    )


def _add_texture(document: Document, number: int) -> int:
    """Smooth, so that neighbouring mip levels look alike."""
    ramp = np.linspace(40, 220, TEXELS).astype(np.uint8)
    pixels = np.full((TEXELS, TEXELS, 3), 128, np.uint8)
    pixels[..., number], pixels[..., number + 1] = ramp, ramp[:, None]
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    view = document.add_view(file.getvalue())
    document.images.append({"bufferView": view, "mimeType": "image/png"})
    document.samplers.append({"wrapS": gltf.CLAMP_TO_EDGE, "wrapT": gltf.CLAMP_TO_EDGE})
    last = len(document.images) - 1
    document.textures.append({"source": last, "sampler": last})
    return last


def _add_colors(document: Document, primitives: list[model.Primitive]) -> None:
    (primitive,) = (p for p in primitives if p.name == COLORED)
    low, high = primitive.positions.min(axis=0), primitive.positions.max(axis=0)
    colors = np.full((len(primitive.positions), 4), 255, np.uint8)
    colors[:, :3] = np.rint(255 * (primitive.positions - low) / (high - low))
    (mesh,) = (mesh for mesh in document.meshes if mesh.get("name") == COLORED)
    mesh["primitives"][0]["attributes"]["COLOR_0"] = add_accessor(document, colors)


def _place(document: Document) -> None:
    """A node for each copy, with all meshes but the floor."""
    meshes = [i for i, mesh in enumerate(document.meshes) if mesh.get("name") != "floor"]
    (floor,) = {*range(len(document.meshes))} - {*meshes}
    nodes: list[gltf.Node] = [{"mesh": mesh} for mesh in meshes]
    nodes.append({"mesh": floor})
    for number, (x, z) in enumerate(PLACES):
        mirror = -1.0 if number == MIRRORED else 1.0
        children = list(range(len(meshes)))
        nodes.append(
            {"children": children, "translation": [x, 0.0, z], "scale": [mirror, 1.0, 1.0]}
        )
    document.nodes[:] = nodes
    document.scenes[0]["nodes"] = list(range(len(meshes), len(nodes)))
