"""For tests of ray tracing: a device, scenes, and the hits that are right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import gltf_ext
from tests.helpers.environment import missing
from tests.helpers.gltf_builder import Builder, everything

if TYPE_CHECKING:
    from vk_backend.gpu.device import Device

WIDTH, HEIGHT = 64, 48
NO_HIT = 0xFFFFFFFF


def open_device() -> Iterator[Device]:
    """For a fixture: a device with the validation layer, which must be silent."""
    try:
        from vk_backend.gpu.device import Device
        from vk_backend.gpu.errors import VulkanError
    except ImportError as error:
        missing(f"Vulkan cannot be used: {error}")
    try:
        made = Device(validation=True)
    except VulkanError as error:
        missing(f"Vulkan cannot be used: {error}")
    if "raytracing" not in made.capabilities:
        made.close()
        missing(f"{made.name} has no VK_KHR_ray_tracing_pipeline")
    yield made
    messages = list(made.messages)
    made.close()
    assert messages == []


def waves(columns: int, rows: int):
    """Attributes and triangles of a folded sheet, which rays cross several times."""
    values, triangles, _ = everything(columns=columns, rows=rows)
    positions = values["POSITION"].copy()
    positions[:, 2] += 0.4 * np.sin(9 * positions[:, 0]).astype(np.float32)
    return {
        "POSITION": positions,
        "NORMAL": values["NORMAL"],
        "TEXCOORD_0": values["TEXCOORD_0"],
    }, triangles


def several(
    folder,
    material: dict | None = None,
    name: str = "several",
    size: tuple[int, int] = (40, 30),
    **options,
):
    """Compresses a sheet with turned, mirrored and stretched instances, and a second mesh."""
    builder = Builder()
    builder.mesh(*waves(*size))
    values, triangles = waves(20, 16)
    builder.mesh(values, triangles)
    if material:
        builder.properties["materials"] = [material]
        builder.properties["meshes"][0]["primitives"][0]["material"] = 0
    builder.properties["nodes"] = [
        {"mesh": 0, "rotation": [0, 0.3826834, 0, 0.9238795]},
        {"mesh": 0, "translation": [0.3, 1, -0.4], "scale": [1, -1, 1]},
        {"mesh": 0, "translation": [-0.5, 0.2, 0.3], "scale": [1.5, 0.5, 2]},
        {"mesh": 1, "translation": [0, 0.1, 0.2], "rotation": [0.5, 0.5, 0.5, 0.5]},
    ]
    builder.properties["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    output = folder / f"{name}.compressed.glb"
    gltf_ext.compress(builder.write(folder / f"{name}.glb"), output, **options)
    return output


def camera_of(scene, turn: float = 0.0):
    from vk_backend.scene.camera import Camera

    view = (0.45 * np.cos(turn) + np.sin(turn), 0.35, np.cos(turn) - 0.45 * np.sin(turn))
    return Camera.fit_box(scene.low, scene.high, WIDTH, HEIGHT, view)


def rays_of(camera) -> tuple[np.ndarray, np.ndarray]:
    """(origin float64[3], unit directions float64[H, W, 3]) through the pixels' centres."""
    inverse = np.linalg.inv(camera.world_to_clip(WIDTH, HEIGHT))
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    clip = np.stack(
        [2 * x / WIDTH - 1, 2 * y / HEIGHT - 1, np.full_like(x, 0.5), np.ones_like(x)], axis=-1
    )
    through = clip @ inverse.T
    directions = through[..., :3] / through[..., 3:] - camera.eye[:3]
    return np.array(camera.eye[:3]), directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def nearest_hits(scene, camera) -> dict[str, np.ndarray]:
    """Tests all triangles in float64.

    Returns (t, instance, id, barycentrics, t of the nearest hit of any other triangle).
    """
    origin, directions = rays_of(camera)
    d = directions.reshape(-1, 3)
    best = {
        "t": np.full(len(d), np.inf),
        "ids": np.full((len(d), 2), NO_HIT, np.uint32),
        "b": np.zeros((len(d), 2)),
    }
    for number, instance in enumerate(scene.instances):
        decoded = scene.primitives[instance.primitive].decoded()
        points = (
            decoded.positions.astype(np.float64) @ instance.matrix[:3, :3].T
            + instance.matrix[:3, 3]
        )
        for id, corners in zip(decoded.ids(), points[decoded.triangles]):
            first, second = corners[1] - corners[0], corners[2] - corners[0]
            p = np.cross(d, second)
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = 1 / (p @ first)
                s = origin - corners[0]
                u = (p @ s) * inverse
                q = np.cross(s, first)
                v = (d @ q) * inverse
                t = (second @ q) * inverse
                hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best["t"])
            best["t"][hit], best["ids"][hit], best["b"][hit] = (
                t[hit],
                (number, id),
                np.stack([u, v], axis=1)[hit],
            )
    return {
        "t": best["t"].reshape(HEIGHT, WIDTH),
        "ids": best["ids"].reshape(HEIGHT, WIDTH, 2),
        "b": best["b"].reshape(HEIGHT, WIDTH, 2),
    }


def assert_same_hits(picture, expected, scene) -> None:
    """The same hits, apart from rays that pass very near an edge."""
    size = float(np.linalg.norm(scene.high - scene.low))
    same = (picture.ids == expected["ids"]).all(axis=-1)
    assert np.count_nonzero(~same) <= 3  # within rounding of an edge
    seen = same & (picture.ids[..., 0] != NO_HIT)
    assert seen.mean() > 0.02
    assert np.abs(picture.t[seen] - expected["t"][seen]).max() < 1e-5 * size
    assert np.abs(picture.barycentrics[seen] - expected["b"][seen]).max() < 5e-3


def broken_blobs(original: bytes, count: int) -> list[bytes]:
    """Changes bits so that the check of the header does not notice."""
    random = np.random.default_rng(7)
    header = 32 + 28 * original[5]
    found: list[bytes] = []
    for attempt in range(100):
        blob = bytearray(original)
        for place in random.integers(header, len(blob) - 8, 1 + attempt % 20):
            blob[place] ^= 1 << int(random.integers(8))
        try:
            gltf_ext._codec.Decoder(bytes(blob))
        except ValueError:
            continue
        found.append(bytes(blob))
        if len(found) == count:
            return found
    raise AssertionError("the header's check finds nearly everything")


def mitsuba_hits(scene, camera) -> dict[str, np.ndarray]:
    """Hits of Mitsuba's triangle meshes of the decoded model."""
    from tests.helpers.mitsuba_reference import require

    mi, _ = require("scalar_rgb")
    meshes = {}
    for number, instance in enumerate(scene.instances):
        decoded = scene.primitives[instance.primitive].decoded()
        points = (
            decoded.positions.astype(np.float64) @ instance.matrix[:3, :3].T
            + instance.matrix[:3, 3]
        )
        mesh = mi.Mesh(f"instance{number}", len(points), len(decoded.triangles))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = points.astype(np.float32).ravel()
        parameters["faces"] = decoded.triangles.ravel()
        parameters.update()
        meshes[f"instance{number}"] = mesh
    traced = mi.load_dict({"type": "scene", **meshes})
    names = {shape.id(): number for number, shape in enumerate(meshes.values())}
    ids = [scene.primitives[i.primitive].decoded().ids() for i in scene.instances]
    origin, directions = rays_of(camera)
    found = {
        "t": np.full((HEIGHT, WIDTH), np.inf),
        "ids": np.full((HEIGHT, WIDTH, 2), NO_HIT, np.uint32),
        "b": np.zeros((HEIGHT, WIDTH, 2)),
    }
    for y, x in np.ndindex(HEIGHT, WIDTH):
        hit = traced.ray_intersect_preliminary(
            mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*directions[y, x])), True
        )
        if hit.is_valid():
            number = names[hit.shape.id()]
            found["t"][y, x], found["ids"][y, x] = hit.t, (number, ids[number][hit.prim_index])
            found["b"][y, x] = hit.prim_uv.x, hit.prim_uv.y
    return found


def broken_scene(scene):
    """A scene of mutated blobs, in the places of the first mesh's instances."""
    sheet = scene.primitives[0]
    primitives = [replace(sheet, blob=blob) for blob in broken_blobs(sheet.blob, 8)]
    instances = [
        replace(scene.instances[number % 3], primitive=number) for number in range(len(primitives))
    ]
    return replace(scene, primitives=primitives, instances=instances)


def transparent(folder, mode: str):
    """Compresses `several` with a first mesh of this alpha mode."""
    material = {
        "alphaMode": mode,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.4]},
        "doubleSided": True,
    }
    return several(folder, material, "transparent")
