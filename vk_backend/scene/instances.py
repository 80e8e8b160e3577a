"""The instances of a scene, as arrays: a scene may have a million."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gltf_scene.scene import is_mirrored


@dataclass(frozen=True)
class Instance:
    """A primitive, or one of its pages, in its place.

    primitive, material: indices in the Scene; matrix: float64[4, 4], object to world; page: its
    number. The pages of an instance follow each other.
    """

    primitive: int
    material: int
    matrix: np.ndarray
    page: int = 0

    @property
    def mirrored(self) -> bool:
        return is_mirrored(self.matrix)


@dataclass(frozen=True)
class Run:
    """Instances [first, first + count) with one primitive, material and front face."""

    first: int
    count: int


@dataclass(frozen=True, eq=False)
class Instances(Sequence[Instance]):
    """All instances of a scene, in order; see Instance.

    primitive, material, page: int32[n]; matrix: float64[n, 4, 4].
    """

    primitive: np.ndarray
    material: np.ndarray
    matrix: np.ndarray
    page: np.ndarray

    @staticmethod
    def of(instances: Iterable[Instance]) -> Instances:
        """The same as arrays."""
        each = list(instances)
        primitive, material, page = (
            np.array([getattr(i, name) for i in each], np.int32)
            for name in ("primitive", "material", "page")
        )
        matrix = np.array([i.matrix for i in each], np.float64).reshape(-1, 4, 4)
        return Instances(primitive, material, matrix, page)

    @staticmethod
    def joined(parts: Sequence[Instances]) -> Instances:
        """All instances of the parts, in order."""
        names = ("primitive", "material", "matrix", "page")
        return Instances(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))

    @staticmethod
    def placed(pages: range, material: int, matrices: np.ndarray) -> Instances:
        """A primitive with these pages (primitives of the Scene) in each of its places."""
        count, places = len(pages), len(matrices)
        return Instances(
            np.tile(np.array(pages, np.int32), places),
            np.full(count * places, material, np.int32),
            np.repeat(matrices, count, axis=0) if count > 1 else matrices,
            np.tile(np.arange(count, dtype=np.int32), places),
        )

    def __len__(self) -> int:
        return len(self.primitive)

    def __getitem__(self, number: int) -> Instance:  # type: ignore[override]  # no slices
        return Instance(
            int(self.primitive[number]),
            int(self.material[number]),
            self.matrix[number],
            int(self.page[number]),
        )

    def __iter__(self) -> Iterator[Instance]:
        return (self[number] for number in range(len(self)))

    @cached_property
    def mirrored(self) -> np.ndarray:
        """bool[n]"""
        return np.asarray(np.linalg.det(self.matrix[:, :3, :3]) < 0)

    @cached_property
    def of_primitive(self) -> dict[int, np.ndarray]:
        """Primitive -> int64[m], its instances in order."""
        order = np.argsort(self.primitive, kind="stable")
        numbers, first = np.unique(self.primitive[order], return_index=True)
        return dict(zip(numbers.tolist(), np.split(order, first[1:])))

    @cached_property
    def runs(self) -> list[Run]:
        """All instances, in order, as few runs: each is one draw."""
        keys = np.stack([self.primitive, self.material, self.mirrored], axis=1)
        changes = 1 + np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1))
        begins = np.concatenate([[0], changes])
        counts = np.diff(np.append(begins, len(self)))
        return [Run(*pair) for pair in zip(begins.tolist(), counts.tolist())]

    def run_numbers(self) -> np.ndarray:
        """int64[n]: the run of each instance."""
        counts = [run.count for run in self.runs]
        return np.repeat(np.arange(len(counts)), counts)
