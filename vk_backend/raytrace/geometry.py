"""What rays traverse: the numbers of meshlets, parts of the model, acceleration structures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gltf_scene.values import box_corners

from ..decode.bounds import record_bounds
from ..gpu import vk
from ..gpu.constants import CONSTANTS
from ..gpu.errors import VulkanError
from ..gpu.memory import Buffer
from ..gpu.pipelines import ComputePipeline
from ..gpu.reflection import structure
from ..scene.view import SceneView
from . import acceleration
from .acceleration import BOTTOM, BOX_BYTES, INPUT, TOP, Boxes, Instances, Shape, Structures

PLACED, SOURCE = structure("Placed"), structure("Source")  # of shaders/raytrace/rt_common.glsl
MESHLET_TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
INSTANCE_MASKED = CONSTANTS["INSTANCE_MASKED"]
MOST_CORNERS = 1 << 14  # that each frame transforms
NO_INSTANCES = np.zeros(0, np.int64)
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
        for number, instances in self._scene.instances.of_primitive.items():
            own = rows["primitive"] == number
            matrices = self._to_world(number, instances)
            with np.errstate(all="ignore"):  # the numbers of a file may be anything
                around = box_corners(low[own].min(axis=0), high[own].max(axis=0))
                corners.append(_homogeneous(around) @ matrices.transpose(0, 2, 1))
                placed = _homogeneous((low[own] + high[own]) / 2) @ matrices[-1].T
            centers[own] = np.nan_to_num(placed[:, :3])
        self.corners = _few_around(np.concatenate([c.reshape(-1, 4) for c in corners]))
        order = spatial_order(centers, size)
        # Within a part the file's order: primitive by primitive.
        order = order[np.lexsort((order, np.arange(len(order)) // size))]
        rows, boxes = rows[order], boxes[order]
        buffer.write(boxes)
        self.sources.write(rows)
        return rows

    def _to_world(self, primitive: int, instances: np.ndarray) -> np.ndarray:
        """float64[n, 4, 4] from the coordinates in which a primitive is traced, of its instances.

        instances: int64[n], numbers.
        """
        matrices: np.ndarray = self._scene.instances.matrix[instances]
        if not self._on_grid:
            return matrices
        position = self._scene.primitives[primitive].attributes["POSITION"]
        grid = np.diag([position.stream.step * position.scale] * 3 + [1.0])
        grid[:3, 3] = np.array(position.stream.offset[:3]) * position.scale
        result: np.ndarray = matrices @ grid
        return result

    def _place(self, pieces: list[Piece]) -> None:
        """Builds the top levels: of each part all its pieces in all their instances."""
        table, part, piece = self._placed_rows(pieces)
        self.placed = Buffer(self._device, table.nbytes).write(table)
        rows = self._instance_rows()[table["instance"]]
        rows["index_mask"] |= np.arange(len(rows), dtype=np.uint32)
        rows["structure"] = np.array(self.bottom.addresses, np.uint64)[piece]
        address = self._input(rows)
        begins = np.searchsorted(part, np.arange(self.parts + 1))
        self.tops = Structures(
            self._device,
            TOP,
            [
                Instances(address + rows.itemsize * int(begin), int(end - begin))
                for begin, end in pairwise(begins)
            ],
        )

    def _placed_rows(self, pieces: list[Piece]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(PLACED[n], the part and the piece of each): pieces in all their instances.

        By part, then instance. Raises VulkanError for too many.
        """
        scene = self._scene
        shown = [scene.instances.of_primitive.get(p.primitive, NO_INSTANCES) for p in pieces]
        piece = np.repeat(np.arange(len(pieces)), [len(own) for own in shown])
        instance = np.concatenate(shown)
        last = [1 + int(p.drawn.max(initial=-1)) for p in scene.primitives]
        triangles = MESHLET_TRIANGLES * scene.of_instances(last)
        if triangles.sum() >= 1 << 32 or len(piece) > CONSTANTS["PLACED_INDEX"]:
            raise VulkanError(
                f"{len(piece):,} instances with {triangles.sum():,} triangles are too many to "
                "trace",
                "split the scene, or choose --path visibility",
            )
        part = np.array([p.part for p in pieces])[piece]
        order = np.lexsort((piece, instance, part))
        piece, instance, part = piece[order], instance[order], part[order]
        table = np.zeros(len(piece), PLACED)
        keys = np.cumsum(triangles) - triangles
        columns = (
            instance,
            np.array([p.primitive for p in pieces])[piece],
            np.array([p.first for p in pieces])[piece],
            keys[instance],
        )
        for name, column in zip(PLACED.names or (), columns):
            table[name] = column
        return table, part, piece

    def _instance_rows(self) -> np.ndarray:
        """acceleration.INSTANCE[n] of all instances, without index and structure."""
        scene = self._scene
        transform = np.zeros((len(scene.instances), 3, 4), np.float32)
        for number, own in scene.instances.of_primitive.items():
            with np.errstate(over="ignore"):
                transform[own] = self._to_world(number, own)[:, :3]
        seen = np.isfinite(transform).all(axis=(1, 2))
        transform[~seen] = np.eye(3, 4)
        # A flattened instance has no inverse transform, so rays cannot hit it.
        seen &= np.linalg.matrix_rank(transform[:, :, :3].astype(np.float64)) == 3
        transform[~seen] = np.eye(3, 4)
        masked = np.array([m.masked for m in scene.materials])[scene.instances.material]
        rows = np.zeros(len(transform), acceleration.INSTANCE)
        rows["transform"] = transform
        rows["index_mask"] = np.where(masked, INSTANCE_MASKED, 0) | np.where(seen, VISIBLE, 0)
        rows["offset_flags"] = np.where(
            masked,
            vk.VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR << 24,
            vk.VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR << 24,
        )
        return rows


def _few_around(corners: np.ndarray) -> np.ndarray:
    """float64[m, 4]: the points themselves, or of many the corners of a box around them."""
    if len(corners) <= MOST_CORNERS:
        return corners
    points = corners[:, :3]
    return _homogeneous(box_corners(points.min(axis=0), points.max(axis=0)))


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
