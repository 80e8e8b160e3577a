"""Writes a large displaced model: each triangle of a model cut into n x n, with noise."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from bench.generated import vertex_normals

NOISE = 0.0004  # of the longest side, over n: about a third of an edge of the pieces of the dragon
BLOCK = 8192  # triangles of the model at a time


def write_displaced(source: Path, n: int, output: Path, noise: float = NOISE) -> Path:
    """Writes a .glb, or a .gltf with a .bin, with n * n times the triangles of the file's first
    primitive.

    Vertices are moved along their normals by noise, a share of the longest side over n; normals are
    those of the result. Takes 24 bytes of memory for each triangle.
    """
    base = gltf_ext.load(source)[0]
    points = base.attributes["POSITION"].astype(np.float64)
    pieces = _Pieces(base.indices.astype(np.int64), len(points), n)
    heights = np.random.default_rng(1)
    positions = np.empty((pieces.vertex_count, 3), np.float32)
    normals = np.zeros_like(positions)
    smooth = vertex_normals(points, pieces.triangles)
    scale = noise * float(np.ptp(points, axis=0).max()) / n
    for rows, starts, weights in pieces.vertices():
        at = np.einsum("vk,vkc->vc", weights, points[starts])
        along = np.einsum("vk,vkc->vc", weights, smooth[starts])
        positions[rows] = at + along * heights.normal(size=(len(at), 1)) * scale
    for triangles in pieces.blocks():
        a, b, c = positions[triangles].transpose(1, 0, 2)
        faces = np.cross(b - a, c - a)
        for axis in range(3):
            np.add.at(normals[:, axis], triangles.reshape(-1), np.repeat(faces[:, axis], 3))
    for rows in np.array_split(np.arange(len(normals)), 64):
        length = np.linalg.norm(normals[rows], axis=1, keepdims=True)
        normals[rows] /= np.where(length > 0, length, 1)
    _write(output, positions, normals, pieces)
    return output


class _Pieces:
    """Triangles cut into n x n. Vertices: those of the model, then n - 1 on each edge, then those
    inside of each triangle."""

    def __init__(self, triangles: np.ndarray, vertices: int, n: int) -> None:
        self.triangles, self.n = triangles, n
        starts, ends = triangles, np.roll(triangles, -1, axis=1)
        keys = np.minimum(starts, ends) * vertices + np.maximum(starts, ends)
        found, edge = np.unique(keys, return_inverse=True)
        self.edges = np.stack([found // vertices, found % vertices], axis=1)
        self.edge_of, self.is_turned = edge.reshape(-1, 3), starts > ends
        self.grid = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)])
        self.inner = np.array([i > 0 and j > 0 and i + j < n for i, j in self.grid])
        self.first_inner = vertices + len(self.edges) * (n - 1)
        self.vertices_before = vertices
        self.vertex_count = self.first_inner + len(triangles) * int(self.inner.sum())
        self.triangle_count = len(triangles) * n * n

    def vertices(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """(numbers, the model's vertices around each [V, k], their weights [V, k])."""
        n = self.n
        yield (
            slice(0, self.vertices_before),
            np.arange(self.vertices_before)[:, None],
            np.ones((self.vertices_before, 1)),
        )
        share = np.arange(1, n) / n
        pair = np.stack([1 - share, share], axis=1)
        for first in range(0, len(self.edges) if n > 1 else 0, BLOCK):
            ends = np.repeat(self.edges[first : first + BLOCK], n - 1, axis=0)
            at = self.vertices_before + first * (n - 1)
            yield slice(at, at + len(ends)), ends, np.tile(pair, (len(ends) // (n - 1), 1))
        i, j = self.grid[self.inner].T
        weights = np.stack([n - i - j, i, j], axis=1) / n
        for first in range(0, len(self.triangles) if len(weights) else 0, BLOCK):
            corners = np.repeat(self.triangles[first : first + BLOCK], len(weights), axis=0)
            at = self.first_inner + first * len(weights)
            tiled = np.tile(weights, (len(corners) // len(weights), 1))
            yield slice(at, at + len(corners)), corners, tiled

    def blocks(self) -> Iterator[np.ndarray]:
        """int64[T, 3]: the pieces of some triangles at a time."""
        n, number = self.n, {tuple(place): k for k, place in enumerate(self.grid.tolist())}
        pattern = [
            [number[p] for p in corners]
            for i in range(n)
            for j in range(n - i)
            for corners in (
                [(i, j), (i + 1, j), (i, j + 1)],
                [(i + 1, j), (i + 1, j + 1), (i, j + 1)],
            )
            if sum(corners[1]) <= n
        ]
        for first in range(0, len(self.triangles), BLOCK):
            grid = self._grid_of(slice(first, first + BLOCK), number)
            yield grid[:, pattern].reshape(-1, 3)

    def _grid_of(self, rows: slice, number: dict[tuple[int, int], int]) -> np.ndarray:
        """int64[F, (n + 1)(n + 2) / 2]: the vertices on the grid of each triangle."""
        n, triangles = self.n, self.triangles[rows]
        result = np.empty((len(triangles), len(self.grid)), np.int64)
        places = ([(0, 0), (n, 0), (0, n)], [(1, 0), (-1, 1), (0, -1)])
        for side, ((i, j), (along_i, along_j)) in enumerate(zip(*places)):
            result[:, number[i, j]] = triangles[:, side]
            edge, is_turned = self.edge_of[rows][:, side], self.is_turned[rows][:, side]
            for k in range(1, n):
                step = np.where(is_turned, n - k, k) - 1
                place = number[i + k * along_i, j + k * along_j]
                result[:, place] = self.vertices_before + edge * (n - 1) + step
        inner = int(self.inner.sum())
        faces = rows.start + np.arange(len(triangles))[:, None]
        result[:, self.inner] = self.first_inner + faces * inner + np.arange(inner)
        return result


def _write(path: Path, positions: np.ndarray, normals: np.ndarray, pieces: _Pieces) -> None:
    sizes = (positions.nbytes, normals.nbytes, 12 * pieces.triangle_count)
    count, low, high = len(positions), positions.min(axis=0), positions.max(axis=0)
    vector = {"componentType": 5126, "count": count, "type": "VEC3"}
    index = {"componentType": 5125, "count": 3 * pieces.triangle_count, "type": "SCALAR"}
    begins = np.cumsum([0, *sizes]).tolist()
    properties: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, **vector, "min": low.tolist(), "max": high.tolist()},
            {"bufferView": 1, **vector},
            {"bufferView": 2, **index},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": begin, "byteLength": size}
            for begin, size in zip(begins, sizes)
        ],
        "buffers": [{"byteLength": begins[-1]}],
    }
    binary, head = path, b""
    if path.suffix == ".gltf":
        binary = path.with_suffix(".bin")
        properties["buffers"][0]["uri"] = binary.name
        path.write_text(json.dumps(properties))
    else:
        text = json.dumps(properties).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + begins[-1])
        head += struct.pack("<I4s", len(text), b"JSON") + text
        head += struct.pack("<I4s", begins[-1], b"BIN\0")
    with open(binary, "wb") as file:
        file.write(head)
        file.write(positions.data)
        file.write(normals.data)
        for triangles in pieces.blocks():
            file.write(triangles.astype("<u4").tobytes())
