"""Writes a large displaced model: each triangle of a model cut into n x n, with noise."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gltf_ext
from bench.generated import vertex_normals
from gltf_ext.scheduler import in_order

NOISE = 0.0004  # of the longest side, over n: about a third of an edge of the pieces of the dragon
BLOCK = 1 << 18  # pieces that a thread makes at a time
THREADS = os.cpu_count() or 1


def write_displaced(source: Path, n: int, output: Path, noise: float = NOISE) -> Path:
    """Writes a .glb, or a .gltf with a .bin, with n * n times the triangles of the file's first
    primitive.

    Vertices are moved along their normals by noise, a share of the longest side over n; normals are
    those of the result. Takes 24 bytes of memory for each triangle.
    """
    base = gltf_ext.load(source)[0]
    points = base.attributes["POSITION"].astype(np.float64)
    pieces = _Pieces(base.indices.astype(np.int64), len(points), n)
    positions = np.empty((pieces.vertex_count, 3), np.float32)
    smooth = vertex_normals(points, pieces.triangles)
    scale = noise * float(np.ptp(points, axis=0).max()) / n

    def place(rows: slice, starts: np.ndarray, weights: np.ndarray, heights: np.ndarray) -> None:
        at = np.einsum("vk,vkc->vc", weights, points[starts])
        along = np.einsum("vk,vkc->vc", weights, smooth[starts])
        positions[rows] = at + along * heights * scale

    # One row of random numbers, whatever the number of threads.
    random = np.random.default_rng(1)
    tasks = ((*part, random.normal(size=(len(part[1]), 1))) for part in pieces.vertices())
    for _ in in_order(place, tasks, THREADS):
        pass
    _write(output, positions, _normals(positions, pieces), pieces)
    return output


def _normals(positions: np.ndarray, pieces: _Pieces) -> np.ndarray:
    """Unit normals, float32[V, 3]: sums of the normals of the triangles around each vertex."""
    normals = np.zeros_like(positions)

    pattern, is_inner = pieces.pattern, pieces.inner
    at_borders = np.nonzero(~is_inner[pattern])
    around = [np.nonzero(pattern == place)[0] for place in np.flatnonzero(is_inner)]

    def add(first: int) -> tuple[np.ndarray, np.ndarray]:
        """Sums up for vertices inside of a triangle of the model, which no other block has. Returns
        those on its borders, and what adds to them."""
        triangles = pieces.of(first)
        a, b, c = positions[triangles].transpose(2, 0, 1, 3)
        faces = np.cross(b - a, c - a)
        for place, places_around in enumerate(around):
            rows = pieces.first_inner + first * len(around) + place
            sums = normals[rows :: len(around)][: len(faces)]
            for number in places_around:
                sums += faces[:, number]
        numbers = triangles[:, at_borders[0], at_borders[1]]
        return numbers.reshape(-1), faces[:, at_borders[0]].reshape(-1, 3)

    def scale(first: int) -> None:
        rows = normals[first : first + BLOCK]
        length = np.linalg.norm(rows, axis=1, keepdims=True)
        rows /= np.where(length > 0, length, 1)

    for numbers, values in in_order(add, pieces.firsts(), THREADS):
        for axis in range(3):
            np.add.at(normals[:, axis], numbers, values[:, axis])
    for _ in in_order(scale, ((first,) for first in range(0, len(normals), BLOCK)), THREADS):
        pass
    return normals


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
        number = self.number = {tuple(place): k for k, place in enumerate(self.grid.tolist())}
        self.pattern = np.array(
            [
                [number[p] for p in corners]
                for i in range(n)
                for j in range(n - i)
                for corners in (
                    [(i, j), (i + 1, j), (i, j + 1)],
                    [(i + 1, j), (i + 1, j + 1), (i, j + 1)],
                )
                if sum(corners[1]) <= n
            ]
        )

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
        step = _rows(n - 1)
        for first in range(0, len(self.edges) if n > 1 else 0, step):
            ends = np.repeat(self.edges[first : first + step], n - 1, axis=0)
            at = self.vertices_before + first * (n - 1)
            yield slice(at, at + len(ends)), ends, np.tile(pair, (len(ends) // (n - 1), 1))
        i, j = self.grid[self.inner].T
        weights = np.stack([n - i - j, i, j], axis=1) / n
        step = _rows(len(weights))
        for first in range(0, len(self.triangles) if len(weights) else 0, step):
            corners = np.repeat(self.triangles[first : first + step], len(weights), axis=0)
            at = self.first_inner + first * len(weights)
            tiled = np.tile(weights, (len(corners) // len(weights), 1))
            yield slice(at, at + len(corners)), corners, tiled

    def firsts(self) -> Iterator[tuple[int]]:
        """The first triangle of each block."""
        return ((first,) for first in range(0, len(self.triangles), _rows(self.n**2)))

    def of(self, first: int) -> np.ndarray:
        """int64[F, n * n, 3]: the pieces of a block's triangles."""
        grid = self._grid_of(slice(first, first + _rows(self.n**2)))
        return grid[:, self.pattern]

    def _grid_of(self, rows: slice) -> np.ndarray:
        """int64[F, (n + 1)(n + 2) / 2]: the vertices on the grid of each triangle."""
        n, number, triangles = self.n, self.number, self.triangles[rows]
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


def _rows(each: int) -> int:
    """The number of triangles or edges of a block, of which each has so many pieces."""
    return max(BLOCK // max(each, 1), 1)


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

        def bytes_of(first: int) -> bytes:
            return pieces.of(first).astype("<u4").tobytes()

        for data in in_order(bytes_of, pieces.firsts(), THREADS):
            file.write(data)
