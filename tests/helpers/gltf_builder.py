"""Small glTF files for tests, built from arrays without the package under test."""

from __future__ import annotations

import json
import struct
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

COMPONENT_TYPES = {
    "int8": 5120,
    "uint8": 5121,
    "int16": 5122,
    "uint16": 5123,
    "uint32": 5125,
    "float32": 5126,
}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 9: "MAT3", 16: "MAT4"}


class Builder:
    """Collects accessors and meshes; `write` makes a .glb, or a .gltf with a data: URI."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.properties: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "buffers": [],
            "bufferViews": [],
            "accessors": [],
            "meshes": [],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
        }

    def view(self, data: bytes, **more: Any) -> int:
        self.binary += bytes(-len(self.binary) % 4)
        self.properties["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        )
        self.binary += data
        return len(self.properties["bufferViews"]) - 1

    def accessor(self, values: np.ndarray, **more: Any) -> int:
        values = np.ascontiguousarray(values)
        values = values.reshape(len(values), -1)
        size = values.itemsize * values.shape[1]
        stride = {"byteStride": size + -size % 4} if size % 4 and values.shape[1] > 1 else {}
        rows = np.zeros((len(values), stride.get("byteStride", size)), np.uint8)
        rows[:, :size] = values.view(np.uint8).reshape(len(values), size)
        bounds = (
            {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
            if len(values) and np.isfinite(values).all()  # JSON has no NaN and infinity
            else {}
        )
        self.properties["accessors"].append(
            {
                "bufferView": self.view(rows.tobytes(), **stride),
                "componentType": COMPONENT_TYPES[values.dtype.name],
                "count": len(values),
                "type": TYPES[values.shape[1]],
                **bounds,
                **more,
            }
        )
        return len(self.properties["accessors"]) - 1

    def mesh(
        self,
        attributes: dict[str, np.ndarray | int],
        indices: np.ndarray | int | None = None,
        targets: Sequence[dict[str, np.ndarray | int]] = (),
        normalized: Collection[str] = (),
        **more: Any,
    ) -> dict:
        """Adds a mesh of one primitive and returns the primitive.

        Arrays become accessors; integers are indices of existing accessors.
        """

        def group(arrays: dict[str, np.ndarray | int]) -> dict[str, int]:
            return {
                name: v
                if isinstance(v, int)
                else self.accessor(v, **({"normalized": True} if name in normalized else {}))
                for name, v in arrays.items()
            }

        primitive: dict[str, Any] = {"attributes": group(attributes), **more}
        if indices is not None:
            primitive["indices"] = (
                indices
                if isinstance(indices, int)
                else self.accessor(np.asarray(indices).reshape(-1, 1))
            )
        if targets:
            primitive["targets"] = [group(t) for t in targets]
        self.properties["meshes"].append({"primitives": [primitive]})
        return primitive

    def write(self, path: Path) -> Path:
        self.properties["buffers"] = [{"byteLength": len(self.binary)}]
        self.binary += bytes(-len(self.binary) % 4)
        path.write_bytes(glb_bytes(self.properties, bytes(self.binary)))
        return path


def glb_bytes(properties: dict, binary: bytes) -> bytes:
    text = json.dumps(properties).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(binary), b"BIN\0")
        + binary
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def glb_parts(path: Path) -> tuple[dict, bytearray]:
    """The JSON and the binary chunk of a .glb."""
    data = path.read_bytes()
    end = 20 + struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:end]), bytearray(data[end + 8 :])


def glb_json(path: Path) -> dict:
    return glb_parts(path)[0]


def grid_mesh(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """A bumpy sheet: (positions float32[V, 3], triangles uint32[T, 3])."""
    x, y = np.meshgrid(np.linspace(0, 2, columns), np.linspace(0, 1, rows))
    positions = (
        np.stack([x, y, 0.2 * np.sin(5 * x) * np.cos(4 * y)], axis=-1)
        .reshape(-1, 3)
        .astype(np.float32)
    )
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.stack(
        [corner, corner + 1, corner + columns, corner + 1, corner + columns + 1, corner + columns],
        axis=1,
    )
    return positions, quads.reshape(-1, 3).astype(np.uint32)


def wavy_sheet(size: int, height: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet of size x size quads: (positions float32[V, 3], triangles uint32[T, 3])."""
    x, y = np.meshgrid(np.arange(size + 1), np.arange(size + 1), indexing="ij")
    z = height * size * np.sin(x / size * 7.0) * np.cos(y / size * 5.0)
    points = np.stack([x, y, z], axis=2).reshape(-1, 3).astype(np.float32)
    a = (x[:-1, :-1] * (size + 1) + y[:-1, :-1]).reshape(-1)
    quads = np.stack([a, a + size + 1, a + size + 2, a, a + size + 2, a + 1], axis=1)
    return points, quads.reshape(-1, 3).astype(np.uint32)


def everything(
    seed: int = 0, columns: int = 24, rows: int = 17
) -> tuple[dict[str, np.ndarray], np.ndarray, list[dict[str, np.ndarray]]]:
    """A sheet with every kind of attribute and two morph targets: (attributes, triangles, targets).

    _ID numbers the vertices and survives compression exactly, so tests can match vertices without
    trusting `verify`.
    """
    random = np.random.default_rng(seed)
    positions, triangles = grid_mesh(columns, rows)
    count = len(positions)
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weights = random.dirichlet(np.ones(8), count)
    attributes = {
        "POSITION": positions,
        "NORMAL": normals,
        "TANGENT": np.concatenate(
            [normals[:, [1, 2, 0]], random.choice([-1.0, 1.0], (count, 1))], axis=1
        ),
        "TEXCOORD_0": positions[:, :2] * 3 - 1,
        "TEXCOORD_1": random.integers(0, 65536, (count, 2)).astype(np.uint16),
        "COLOR_0": random.random((count, 4)),
        "COLOR_1": random.integers(0, 256, (count, 3)).astype(np.uint8),
        "COLOR_2": random.integers(0, 65536, (count, 4)).astype(np.uint16),
        "JOINTS_0": random.integers(0, 300, (count, 4)).astype(np.uint16),
        "JOINTS_1": random.integers(0, 200, (count, 4)).astype(np.uint8),
        "WEIGHTS_0": weights[:, :4],
        "WEIGHTS_1": weights[:, 4:],
        "_HEAT": random.normal(size=(count, 1)) * 1e5,
        "_FRAME": random.normal(size=(count, 9)),
        "_ID": np.arange(count, dtype=np.uint16)[:, None],
        "_SIGNED": random.integers(-100, 100, (count, 3)).astype(np.int16),
    }
    attributes = {
        name: v.astype(np.float32) if v.dtype == np.float64 else v for name, v in attributes.items()
    }
    targets = []
    for _ in range(2):
        moved = random.random(count) < 0.3
        targets.append(
            {
                "POSITION": (random.normal(size=(count, 3)) * 0.1 * moved[:, None]).astype(
                    np.float32
                ),
                "NORMAL": (random.normal(size=(count, 3)) * 0.2 * moved[:, None]).astype(
                    np.float32
                ),
            }
        )
    return attributes, triangles, targets


NORMALIZED = ("TEXCOORD_1", "COLOR_1", "COLOR_2")


def write_everything(path: Path, **size: int) -> Path:
    """Writes a .glb with a mesh of `everything`, and a sheet of positions alone. size: columns and
    rows. Returns the path."""
    builder = Builder()
    attributes, triangles, targets = everything(**size)
    builder.mesh(attributes, triangles, targets, NORMALIZED)
    builder.mesh({"POSITION": attributes["POSITION"]}, triangles)
    return builder.write(path)


def write_grid(path: Path, size: int = 9) -> Path:
    """Writes a .glb with a grid of size x size vertices."""
    positions, triangles = grid_mesh(size, size)
    builder = Builder()
    builder.mesh({"POSITION": positions}, triangles)
    return builder.write(path)
