"""What rays traverse: the numbers of meshlets, parts of the model, acceleration structures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gltf_scene.scene import box_corners

from ..decode.bounds import record_bounds
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.errors import VulkanError
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline
from ..gpu.reflection import structure
from ..scene.scene import Instance
from ..scene.view import SceneView
from . import acceleration
from .acceleration import BOTTOM, BOX_BYTES, INPUT, TOP, Boxes, Instances, Shape, Structures

PLACED, SOURCE = structure("Placed"), structure("Source")  # of shaders/raytrace/rt_common.glsl
MESHLET_TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
INSTANCE_MASKED = CONSTANTS["INSTANCE_MASKED"]
VISIBLE = 0xFF000000  # visibility mask of an instance, in the upper 8 bits of its custom index


@dataclass(frozen=True)
class Piece:
    """Meshlets [first, first + count) by number: those of a part that belong to a primitive."""

    part: int
    primitive: int
    first: int
    count: int


def spatial_order(centers: np.ndarray, size: int) -> np.ndarray:
    """int64[n]: the points' indices, so that each `size` of them in turn are near each other.

    centers: float64[n, 3]. Cuts the longest side of the box around the points, and so on.
    """

    def cut(own: np.ndarray) -> list[np.ndarray]:
        parts = -(-len(own) // size)
        if parts <= 1:
            return [own]
        points = centers[own]
        axis = int(np.argmax(points.max(axis=0) - points.min(axis=0)))
        own = own[np.argsort(points[:, axis], kind="stable")]
        middle = parts // 2 * size
        return cut(own[:middle]) + cut(own[middle:])

    return np.concatenate(cut(np.arange(len(centers))))


class Geometry:
    """A scene's acceleration structures and the tables of their contents.

    part_meshlets: meshlets of a part; a single part keeps the file's order. constants:
    specialisation constants of bounds.comp.
    sources, placed: buffers of shaders/raytrace/rt_common.glsl. tops: a top level for each part.
    corners: if there are parts, float64[n, 4], homogeneous points of the world around the scene.
    any_masked: whether a material may be transparent.
    """

    def __init__(
        self,
        view: SceneView,
        *,
        constants: dict[str, int],
        part_meshlets: int,
    ):
        device, scene = view.device, view.scene
        self._device, self._scene, self._constants = device, scene, constants
        self._primitives = view.buffers.primitives_address
        self._inputs: list[Buffer] = []  # of the construction
        counts = [p.meshlets for p in scene.primitives]
        rows = np.zeros(sum(counts), SOURCE)
        rows["primitive"] = np.repeat(np.arange(len(counts)), counts)
        rows["meshlet"] = np.concatenate([p.drawn for p in scene.primitives])
        self.sources = Buffer(device, rows.nbytes).write(rows)
        self.parts = -(-len(rows) // part_meshlets)
        pieces, shapes = self._shapes(rows, part_meshlets)
        self.bottom = Structures(device, BOTTOM, shapes)
        self._place(pieces)
        for buffer in self._inputs:
            buffer.free()

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the acceleration structures."""
        return self.bottom.allocated + self.tops.allocated

    def free(self) -> None:
        for owned in (self.bottom, self.tops, self.sources, self.placed):
            owned.free()

    def _input(self, data: np.ndarray) -> int:
        """The address of data that the construction of structures reads."""
        self._inputs.append(Buffer(self._device, data.nbytes, INPUT).write(data))
        return self._inputs[-1].address

    @property
    def _on_grid(self) -> bool:
        """Whether rays are traced in grid coordinates, as they are unless positions are floats."""
        return not self._constants["POSITION_FLOATS"]

    def _shapes(self, rows: np.ndarray, part_meshlets: int) -> tuple[list[Piece], Sequence[Shape]]:
        """The pieces of all parts, and the shapes that the bottom levels are built over."""
        boxes = self._make_boxes(len(rows))
        if self.parts > 1:
            rows = self._sort(rows, boxes, part_meshlets)
        pieces = pieces_of(rows, part_meshlets)
        size = boxes.size // len(rows)
        return pieces, [
            Boxes(boxes.address + p.first * size, p.count * size // BOX_BYTES) for p in pieces
        ]

    def _make_boxes(self, meshlets: int) -> Buffer:
        """The boxes of all meshlets."""
        size = MESHLET_TRIANGLES // self._constants["BOX_TRIANGLES"] * BOX_BYTES
        boxes = Buffer(self._device, meshlets * size, INPUT)
        self._inputs.append(boxes)
        pipeline = ComputePipeline.of(self._device, "bounds.comp", self._constants)
        with self._device.commands() as commands:
            record_bounds(
                commands,
                pipeline,
                meshlets,
                primitives=self._primitives,
                sources=self.sources.address,
                boxes=boxes.address,
            )
        return boxes

    def _sort(self, rows: np.ndarray, buffer: Buffer, size: int) -> np.ndarray:
        """Sorts meshlets and their boxes so that parts are compact in the world."""
        boxes = buffer.read(np.float32).reshape(len(rows), -1, 2, 3)
        low = boxes[:, :, 0].min(axis=1).astype(np.float64)
        high = boxes[:, :, 1].max(axis=1).astype(np.float64)
        centers, corners = np.zeros((len(rows), 3)), []
        for instance in self._scene.instances:
            own = rows["primitive"] == instance.primitive
            matrix = self._to_world(instance).T
            with np.errstate(all="ignore"):  # the numbers of a file may be anything
                around = box_corners(low[own].min(axis=0), high[own].max(axis=0))
                corners.append(_homogeneous(around) @ matrix)
                placed = _homogeneous((low[own] + high[own]) / 2) @ matrix
            centers[own] = np.nan_to_num(placed[:, :3])
        self.corners = np.concatenate(corners)
        order = spatial_order(centers, size)
        # Within a part the file's order: primitive by primitive.
        order = order[np.lexsort((order, np.arange(len(order)) // size))]
        rows, boxes = rows[order], boxes[order]
        buffer.write(boxes)
        self.sources.write(rows)
        return rows

    def _to_world(self, instance: Instance) -> np.ndarray:
        """float64[4, 4] from the coordinates in which an instance's primitive is traced."""
        if not self._on_grid:
            return instance.matrix
        position = self._scene.primitives[instance.primitive].attributes["POSITION"]
        grid = np.diag([position.stream.step * position.scale] * 3 + [1.0])
        grid[:3, 3] = np.array(position.stream.offset[:3]) * position.scale
        matrix: np.ndarray = instance.matrix @ grid
        return matrix

    def _place(self, pieces: list[Piece]) -> None:
        """Builds the top levels: of each part all its pieces in all their instances."""
        instances = self._scene.instances
        numbers: dict[int, list[int]] = {}
        for i, instance in enumerate(instances):
            numbers.setdefault(instance.primitive, []).append(i)
        # By part, then instance.
        placed = sorted((p.part, i, n) for n, p in enumerate(pieces) for i in numbers[p.primitive])
        triangles = MESHLET_TRIANGLES * np.array(
            [1 + int(self._scene.primitives[i.primitive].drawn.max()) for i in instances]
        )
        if triangles.sum() >= 1 << 32 or len(placed) > CONSTANTS["PLACED_INDEX"]:
            raise VulkanError(
                f"{len(placed):,} instances with {triangles.sum():,} triangles are too many to "
                "trace",
                "split the scene",
            )
        keys = np.cumsum(triangles) - triangles
        table = np.array(
            [(i, pieces[n].primitive, pieces[n].first, keys[i]) for _, i, n in placed], PLACED
        )
        self.placed = Buffer(self._device, table.nbytes).write(table)
        templates = np.array([self._instance_row(i) for i in instances], acceleration.INSTANCE)
        rows = templates[table["instance"]]
        rows["index_mask"] |= np.arange(len(rows), dtype=np.uint32)
        rows["structure"] = [self.bottom.addresses[n] for _, _, n in placed]
        self.any_masked = bool((rows["index_mask"] & INSTANCE_MASKED).any())
        address = self._input(rows)
        begins = np.searchsorted([part for part, _, _ in placed], np.arange(self.parts + 1))
        self.tops = Structures(
            self._device,
            TOP,
            [
                Instances(address + rows.itemsize * int(begin), int(end - begin))
                for begin, end in pairwise(begins)
            ],
        )

    def _instance_row(self, instance: Instance) -> np.ndarray:
        """acceleration.INSTANCE[()] of an instance, without index and structure."""
        with np.errstate(over="ignore"):
            transform = self._to_world(instance)[:3].astype(np.float32)
        # A flattened instance has no inverse transform, so rays cannot hit it.
        seen = (
            np.isfinite(transform).all()
            and np.linalg.matrix_rank(transform[:, :3].astype(np.float64)) == 3
        )
        masked = self._scene.materials[instance.material].flags & (
            CONSTANTS["MATERIAL_MASK"] | CONSTANTS["MATERIAL_BLEND"]
        )
        flag = (
            vk.VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR
            if masked
            else vk.VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR
        )
        row = np.zeros((), acceleration.INSTANCE)
        row["transform"] = transform if seen else np.eye(3, 4)
        row["index_mask"] = (INSTANCE_MASKED if masked else 0) | (VISIBLE if seen else 0)
        row["offset_flags"] = flag << 24
        return row


def _homogeneous(points: np.ndarray) -> np.ndarray:
    """float64[n, 4] of float64[n, 3]"""
    return np.column_stack([points, np.ones(len(points))])


def pieces_of(rows: np.ndarray, part_meshlets: int) -> list[Piece]:
    """The pieces of SOURCE rows that are sorted by part, then primitive."""
    parts = np.arange(len(rows)) // part_meshlets
    change = (np.diff(parts) != 0) | (np.diff(rows["primitive"].astype(np.int64)) != 0)
    begins = np.concatenate([[0], np.flatnonzero(change) + 1, [len(rows)]])
    return [
        Piece(int(parts[begin]), int(rows["primitive"][begin]), int(begin), int(end - begin))
        for begin, end in pairwise(begins)
    ]
