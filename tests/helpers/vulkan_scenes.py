"""For tests of the Vulkan back end: a renderer, and small compressed scenes."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

import gltf_ext
from gltf_ext.errors import MeshletError
from tests.helpers.environment import missing
from tests.helpers.gltf_builder import Builder, grid_mesh

if TYPE_CHECKING:
    from vk_backend.gpu.device import Device, Resource
    from vk_backend.renderer import Renderer
    from vk_backend.scene.camera import Camera

UNLIT = {"KHR_materials_unlit": {}}
# 2 x 2 texels, opaque red, green, blue and transparent white.
TEXELS = np.array(
    [[[255, 0, 0, 255], [0, 255, 0, 255]], [[0, 0, 255, 255], [255, 255, 255, 0]]], np.uint8
)

# Those for which the pictures were made: surfaces that coincide have one depth and colour, and the
# bulk passes can decode all streams.
BITS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12, "color_bits": 8}


def require_vulkan() -> None:
    """Reports a missing package, driver or validation layer."""
    try:
        from vk_backend.gpu.device import Device

        Device(validation=True).close()
    except MeshletError as error:
        missing(str(error))


def resources_of(device: Device) -> set[Resource]:
    """Everything on a device that can be freed before the device is closed."""
    from vk_backend.gpu.device import Resource

    owners = {getattr(action, "__self__", None) for action in device._closing}
    return {owner for owner in owners if isinstance(owner, Resource)}


def open_renderer() -> Iterator[Renderer]:
    """For a fixture: yields a Renderer with the validation layer, which must stay silent."""
    require_vulkan()
    from vk_backend.renderer import Renderer

    with Renderer(validation=True) as renderer:
        yield renderer
        assert renderer.device.messages == []
        messages = renderer.device.messages
    assert messages == []


def ball(columns: int = 40, rows: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """A closed unit sphere that faces outwards: (float32[V, 3], uint32[T, 3])."""
    around, up = np.meshgrid(
        np.arange(columns) * 2 * np.pi / columns, np.linspace(-np.pi / 2, np.pi / 2, rows)[1:-1]
    )
    ring = np.stack(
        [np.cos(around) * np.cos(up), np.sin(up), -np.sin(around) * np.cos(up)], axis=-1
    ).reshape(-1, 3)
    positions = np.concatenate([ring, [[0, -1, 0], [0, 1, 0]]]).astype(np.float32)
    cell = np.arange((rows - 3) * columns).reshape(-1, columns)
    right, above, across = np.roll(cell, -1, 1), cell + columns, np.roll(cell, -1, 1) + columns
    south, north = len(ring), len(ring) + 1
    low, high = cell[0], above[-1]
    faces = [(cell, right, across), (cell, across, above)]
    fans = [
        (np.full(columns, south), np.roll(low, -1), low),
        (high, np.roll(high, -1), np.full(columns, north)),
    ]
    triangles = np.concatenate(
        [np.stack([c.ravel() for c in corners], axis=1) for corners in faces + fans]
    )
    return positions, triangles.astype(np.uint32)


def png(pixels: np.ndarray) -> bytes:
    """Encodes uint8[height, width, channels]."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def zoo(path: Path) -> Path:
    """Writes a compressed scene with two cameras, one of each kind.

    A coloured ball occurs three times (once mirrored, once turned and stretched) before a textured
    sheet.
    """
    builder = Builder()
    positions, triangles = ball()
    colors = np.clip(
        np.concatenate([positions * 0.5 + 0.5, np.ones((len(positions), 1))], axis=1), 0, 1
    ).astype(np.float32)
    builder.mesh(
        {"POSITION": positions, "NORMAL": positions, "COLOR_0": colors}, triangles, material=0
    )
    sheet, sheet_triangles = grid_mesh(30, 18)
    normals = np.tile(np.float32([0, 0, 1]), (len(sheet), 1))
    builder.mesh(
        {"POSITION": sheet, "NORMAL": normals, "TEXCOORD_0": sheet[:, :2]},
        sheet_triangles,
        material=1,
    )
    image = builder.view(png(TEXELS))
    builder.properties.update(
        images=[{"bufferView": image, "mimeType": "image/png"}],
        samplers=[{"magFilter": 9728, "wrapS": 10497, "wrapT": 33071}],
        textures=[{"source": 0, "sampler": 0}],
        materials=[
            {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5}},
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0},
                "doubleSided": True,
                "alphaMode": "MASK",
            },
        ],
        cameras=[
            {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 1.0, "zfar": 20.0}},
            {
                "type": "orthographic",
                "orthographic": {"xmag": 3.2, "ymag": 2.4, "znear": 1.0, "zfar": 20.0},
            },
        ],
        nodes=[
            {"mesh": 0, "translation": [-1.6, 0.3, 0]},
            {"mesh": 0, "translation": [0.9, 0.6, -0.4], "scale": [-0.7, 0.7, 0.7]},
            {
                "mesh": 0,
                "translation": [0.2, -1.1, 0.6],
                "rotation": [0.2, 0.4, 0.1, 0.888819441],
                "scale": [0.9, 0.4, 0.5],
            },
            {"mesh": 1, "translation": [-2.2, -1.2, -2.0], "scale": [2.4, 2.4, 1.0]},
            {"camera": 0, "translation": [0.4, 0.3, 7.0], "rotation": [0, 0.05, 0, 0.998749]},
            {"camera": 1, "translation": [0.0, 0.0, 7.0]},
        ],
        scenes=[{"nodes": list(range(6))}],
    )
    raw = path.with_name(f"raw_{path.name}")
    gltf_ext.compress(builder.write(raw), path, **BITS)
    return path


def hall(path: Path) -> Path:
    """Writes balls behind a wall, behind thin bars and behind a sheet with holes.

    Some sheets coincide.
    """
    builder = Builder()
    positions, triangles = ball(60, 36)
    gray = np.full((len(positions), 4), 0.5, np.float32)
    builder.mesh(
        {"POSITION": positions, "NORMAL": positions, "COLOR_0": gray}, triangles, material=0
    )
    sheet, cells = grid_mesh(40, 30)
    normals = np.tile(np.float32([0, 0, 1]), (len(sheet), 1))
    lying = {"POSITION": sheet, "NORMAL": normals}
    builder.mesh({**lying, "TEXCOORD_0": sheet[:, :2]}, cells, material=1)
    builder.mesh({**lying, "TEXCOORD_0": sheet[:, :2]}, cells, material=2)
    place, turned = np.random.default_rng(3), [0.2, 0.4, 0.1, 0.888819441]
    balls = [
        {"mesh": 0, "translation": [*(4 * place.random(2) - 2), -1 - 3 * float(place.random())]}
        | {"scale": ((0.1 + 0.5 * place.random(3)) * (-1, 1, 1)[number % 3]).tolist()}
        | {"rotation": turned}
        for number in range(14)
    ]
    bars = [{"mesh": 1, "translation": [x, -1, 0.5], "scale": [0.01, 2, 1]} for x in (-1.2, 0, 0.9)]
    wall = {"mesh": 1, "translation": [-2, -1, 0.0], "scale": [2.3, 1.4, 1]}
    holes = {"mesh": 2, "translation": [0.4, -0.7, 0.1], "scale": [1.4, 1.5, 1]}
    image = builder.view(png(TEXELS))
    builder.properties.update(
        images=[{"bufferView": image, "mimeType": "image/png"}],
        samplers=[{"magFilter": 9728}],
        textures=[{"source": 0, "sampler": 0}],
        materials=[
            {},
            {"doubleSided": True},
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "doubleSided": True,
                "alphaMode": "MASK",
            },
        ],
        nodes=[*balls, *bars, wall, wall, holes, holes],
        scenes=[{"nodes": list(range(len(balls) + 7))}],
    )
    gltf_ext.compress(builder.write(path.with_name(f"raw_{path.name}")), path, **BITS)
    return path


def hall_flight() -> list[Camera]:
    """Cameras for `hall`: from afar, past the wall, through balls, with the near plane in them."""
    from vk_backend.scene.camera import Camera

    eyes = [(2.5 * np.sin(t), 0.3 * t, 4 - 1.1 * t) for t in np.linspace(0, 5, 14)]
    eyes += [(0.0, 0.0, 0.03), (-0.5, -0.2, 0.2), (0.1, 0.1, 9.0), (0.1, 0.1, 9.0)]
    target = np.array([0.0, 0.0, -2.0])
    cameras = [
        Camera.look_at(np.array(eye), target, near=near, far=40.0, yfov=1.0)
        for eye, near in zip(eyes, [0.1, 0.01, 1e-3] * len(eyes))
    ]
    flat = [Camera(c.to_world, None, 2.5, 0.1, 40.0) for c in cameras[::5]]
    return [*cameras, *flat, *cameras[:2]]


def one_sheet(path: Path, material: dict, **attributes: np.ndarray) -> Path:
    """Writes a compressed square [-1, 1]² of 8 x 8 cells that faces +z and fills its camera."""
    side = np.linspace(-1, 1, 9)
    x, y = np.meshgrid(side, side)
    positions = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    quads = np.stack([corner, corner + 1, corner + 9, corner + 1, corner + 10, corner + 9], axis=1)
    builder = Builder()
    given = {name: np.asarray(value, np.float32) for name, value in attributes.items()}
    builder.mesh(
        {"POSITION": positions, **given}, quads.reshape(-1, 3).astype(np.uint32), material=0
    )
    image = builder.view(png(TEXELS))
    builder.properties.update(
        images=[{"bufferView": image, "mimeType": "image/png"}],
        samplers=[{"magFilter": 9728}],
        textures=[{"source": 0, "sampler": 0}],
        materials=[material],
        cameras=[
            {
                "type": "orthographic",
                "orthographic": {"xmag": 1.0, "ymag": 1.0, "znear": 1.0, "zfar": 5.0},
            }
        ],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}],
        scenes=[{"nodes": [0, 1]}],
    )
    raw = path.with_name(f"raw_{path.name}")
    gltf_ext.compress(builder.write(raw), path)
    return path
