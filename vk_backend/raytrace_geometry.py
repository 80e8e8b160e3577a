"""What rays traverse: the numbers of meshlets, parts of the model, acceleration structures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gltf_ext.gltf.scene import box_corners

from . import acceleration, vk
from .acceleration import BOTTOM, BOX_BYTES, INPUT, TOP, Boxes, Instances, Structures, Triangles
from .constants import CONSTANTS
from .device import Device
from .errors import VulkanError
from .memory import STORAGE, Buffer
from .pipelines import MAX_GROUPS, ComputePipeline, push_record
from .raytrace_layout import BOXES_PUSH, PLACED, SOURCE
from .scene import Primitive, Scene

MESHLET_TRIANGLES = CONSTANTS["MESHLET_TRIANGLES"]
BOXES_THREADS = CONSTANTS["BOXES_THREADS"]
INSTANCE_MASKED = CONSTANTS["INSTANCE_MASKED"]
MESHLET_BOX_BYTES = CONSTANTS["MESHLET_BOX_BYTES"]
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
        groups = -(-len(own) // size)
        if groups <= 1:
            return [own]
        points = centers[own]
        axis = int(np.argmax(points.max(axis=0) - points.min(axis=0)))
        own = own[np.argsort(points[:, axis], kind="stable")]
        middle = groups // 2 * size
        return cut(own[:middle]) + cut(own[middle:])

    return np.concatenate(cut(np.arange(len(centers))))


class Geometry:
    """A scene's acceleration structures and the tables that say what they consist of.

    part_meshlets: meshlets of a part; None keeps the model in one part and the file's order.
    frame: address of a Frame. constants: specialisation constants of boxes.comp.
    any_masked: whether a material may be transparent. corners: with parts, float64[n, 3], points
    of the world around the scene.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        path: str,
        *,
        frame: int,
        constants: dict[str, int],
        part_meshlets: int | None,
    ):
        self._device, self._scene, self._path = device, scene, path
        self._frame, self._constants = frame, constants
        self._temporary: list[Buffer] = []
        counts = np.array([p.meshlets for p in scene.primitives], np.int64)
        self.meshlets = int(counts.sum())
        self.first_triangles: Buffer | None = None
        rows = np.zeros(self.meshlets, SOURCE)
        rows["primitive"] = np.repeat(np.arange(len(counts)), counts)
        rows["meshlet"] = np.arange(self.meshlets) - np.repeat(np.cumsum(counts) - counts, counts)
        self.sources = Buffer(device, rows.nbytes).write(rows)
        if path == "rt-plain":
            triangles = [p.decoded().meshlet_triangles for p in scene.primitives]
            begins = np.concatenate([[0], np.cumsum(np.concatenate(triangles))]).astype(np.uint32)
            self.first_triangles = Buffer(device, begins.nbytes).write(begins)
        self.parts = 1
        if part_meshlets is not None:
            self.parts = -(-self.meshlets // part_meshlets)
            rows = rows[self._order(rows, part_meshlets)]
            self.sources.write(rows)
        self._build(_pieces(rows, part_meshlets or self.meshlets))
        for buffer in self._temporary:
            buffer.free()

    @property
    def resident_bytes(self) -> int:
        """Allocated bytes of the acceleration structures."""
        return self.bottom.allocated + self.tops.allocated

    @property
    def tables(self) -> list[Buffer]:
        """The buffers that stay, besides the acceleration structures."""
        return [b for b in (self.sources, self.placed, self.first_triangles) if b]

    def free(self) -> None:
        self.bottom.free()
        self.tops.free()
        for buffer in self.tables:
            buffer.free()

    @property
    def _in_object_space(self) -> bool:
        """Whether rays are traced in object coordinates instead of grid coordinates."""
        return bool(self._constants["POSITION_FLOATS"]) or self._path not in ("rt", "rt-paper")

    def _order(self, rows: np.ndarray, size: int) -> np.ndarray:
        """The meshlets' places in the file's order, so that parts are compact in the world."""
        bounds = Buffer(self._device, self.meshlets * MESHLET_BOX_BYTES)
        self._run_boxes(bounds=bounds.address)
        boxes = bounds.read(np.float32).reshape(-1, 2, 3).astype(np.float64)
        bounds.free()
        centers, corners = np.zeros((len(rows), 3)), []
        for instance in self._scene.instances:
            own = boxes[rows["primitive"] == instance.primitive]
            primitive = self._scene.primitives[instance.primitive]
            matrix = self._to_world(instance.matrix, primitive)
            with np.errstate(all="ignore"):  # the numbers of a file may be anything
                around = box_corners(own[:, 0].min(axis=0), own[:, 1].max(axis=0))
                corners.append(around @ matrix[:3, :3].T + matrix[:3, 3])
                placed = own.mean(axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
            centers[rows["primitive"] == instance.primitive] = np.nan_to_num(placed)
        self.corners = np.concatenate(corners)
        order = spatial_order(centers, size)
        # Within a part the file's order: primitive by primitive.
        return order[np.lexsort((order, np.arange(len(order)) // size))]

    def _to_world(self, matrix: np.ndarray, primitive: Primitive) -> np.ndarray:
        """The matrix of an instance for the coordinates in which its primitive is traced."""
        return matrix if self._in_object_space else matrix @ _grid_to_object(primitive)

    def _build(self, pieces: list[Piece]) -> None:
        """Builds a bottom level per piece, and a top level per part."""
        device = self._device
        geometries = self._triangles() if self._path == "rt-triangles" else self._boxes(pieces)
        self.bottom = Structures(device, BOTTOM, geometries)
        placed, rows, begins = self._place(pieces)
        self.any_masked = bool((rows["index_mask"] & INSTANCE_MASKED).any())
        self.placed = Buffer(device, placed.nbytes).write(placed)
        address = self._keep_input(rows)
        self.tops = Structures(
            device,
            TOP,
            [
                Instances(address + rows.itemsize * int(begin), int(end - begin))
                for begin, end in pairwise(begins)
            ],
        )

    def _place(self, pieces: list[Piece]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(PLACED[n], acceleration.INSTANCE[n], where the rows of each part begin, and n)"""
        instances: dict[int, list[int]] = {}
        for number, instance in enumerate(self._scene.instances):
            instances.setdefault(instance.primitive, []).append(number)
        keys = MESHLET_TRIANGLES * np.concatenate(
            [
                [0],
                np.cumsum(
                    [self._scene.primitives[i.primitive].meshlets for i in self._scene.instances]
                ),
            ]
        )
        # By part, then instance: without parts, rows are in the order of the instances.
        pairs = sorted(
            ((p, i) for p, piece in enumerate(pieces) for i in instances[piece.primitive]),
            key=lambda pair: (pieces[pair[0]].part, pair[1]),
        )
        if keys[-1] >= 1 << 32 or len(pairs) > CONSTANTS["PLACED_INDEX"]:
            raise VulkanError(
                f"{len(pairs):,} instances with {keys[-1]:,} triangles are too many to trace",
                "split the scene",
            )
        templates = [self._instance_row(i) for i in range(len(self._scene.instances))]
        placed, rows = np.zeros(len(pairs), PLACED), np.zeros(len(pairs), acceleration.INSTANCE)
        for n, (p, i) in enumerate(pairs):
            placed[n] = i, pieces[p].primitive, pieces[p].first, keys[i]
            rows[n] = templates[i]
            rows[n]["index_mask"] |= n
            rows[n]["structure"] = self.bottom.addresses[p]
        parts = np.array([pieces[p].part for p, _ in pairs])
        return placed, rows, np.searchsorted(parts, np.arange(self.parts + 1))

    def _instance_row(self, number: int) -> np.ndarray:
        """acceleration.INSTANCE[()] of an instance, without index and structure."""
        instance = self._scene.instances[number]
        row = np.zeros((), acceleration.INSTANCE)
        matrix = self._to_world(instance.matrix, self._scene.primitives[instance.primitive])
        with np.errstate(over="ignore"):
            row["transform"] = matrix[:3].astype(np.float32)
        # A flattened instance has no inverse transform, so rays cannot hit it.
        seen = (
            np.isfinite(row["transform"]).all()
            and np.linalg.matrix_rank(row["transform"][:, :3].astype(np.float64)) == 3
        )
        if not seen:
            row["transform"] = np.eye(4, dtype=np.float32)[:3]
        masked = self._scene.materials[instance.material].flags & (
            CONSTANTS["MATERIAL_MASK"] | CONSTANTS["MATERIAL_BLEND"]
        )
        row["index_mask"] = (INSTANCE_MASKED if masked else 0) | (VISIBLE if seen else 0)
        flag = (
            vk.VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR
            if masked
            else vk.VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR
        )
        row["offset_flags"] = flag << 24
        return row

    def _keep_input(self, data: np.ndarray) -> int:
        """The address of data that the construction of structures reads."""
        self._temporary.append(Buffer(self._device, data.nbytes, INPUT).write(data))
        return self._temporary[-1].address

    def _triangles(self) -> list[Triangles]:
        geometries = []
        for primitive in self._scene.primitives:
            decoded = primitive.decoded()
            positions = self._keep_input(np.ascontiguousarray(decoded.positions, np.float32))
            triangles = self._keep_input(np.ascontiguousarray(decoded.triangles, np.uint32))
            geometries.append(
                Triangles(positions, len(decoded.positions), 12, triangles, len(decoded.triangles))
            )
        return geometries

    def _boxes(self, pieces: Sequence[Piece]) -> list[Boxes]:
        groups = MESHLET_TRIANGLES // self._constants["GROUP_TRIANGLES"]
        boxes = Buffer(self._device, self.meshlets * groups * BOX_BYTES, INPUT | STORAGE)
        self._temporary.append(boxes)
        self._run_boxes(boxes=boxes.address)
        return [
            Boxes(boxes.address + p.first * groups * BOX_BYTES, p.count * groups) for p in pieces
        ]

    def _run_boxes(self, **outputs: int) -> None:
        """Computes the boxes of all meshlets. outputs: addresses, see boxes.comp."""
        module = "boxes_plain.comp" if self.first_triangles else "boxes.comp"
        data = push_record(
            BOXES_PUSH,
            frame=self._frame,
            sources=self.sources.address,
            first_triangles=self.first_triangles.address if self.first_triangles else 0,
            meshlets=self.meshlets,
            **outputs,
        )
        rows = -(-self.meshlets // (BOXES_THREADS * MAX_GROUPS))
        groups = -(-self.meshlets // (BOXES_THREADS * rows))
        with self._device.commands() as commands:
            ComputePipeline.of(self._device, module, self._constants).dispatch(
                commands, groups, data, rows
            )


def _pieces(rows: np.ndarray, part_meshlets: int) -> list[Piece]:
    """The pieces of SOURCE rows that are sorted by part, then primitive."""
    parts = np.arange(len(rows)) // part_meshlets
    change = (np.diff(parts) != 0) | (np.diff(rows["primitive"].astype(np.int64)) != 0)
    begins = np.concatenate([[0], np.flatnonzero(change) + 1, [len(rows)]])
    return [
        Piece(int(parts[begin]), int(rows["primitive"][begin]), int(begin), int(end - begin))
        for begin, end in pairwise(begins)
    ]


def _grid_to_object(primitive: Primitive) -> np.ndarray:
    """float64[4, 4] from a primitive's position grid to object coordinates."""
    position = primitive.attributes["POSITION"]
    matrix = np.diag([position.stream.step * position.scale] * 3 + [1.0])
    matrix[:3, 3] = np.array(position.stream.offset[:3]) * position.scale
    return matrix
